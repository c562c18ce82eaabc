"""What errors come from, and what keeping them small costs: bars a source of the variance, and of the tolerances."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.analyses.poses import pose_in_words
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.report.figures import style
from mechdesign.report.figures.panels import MAX_PANELS, legend_below, title
from mechdesign.report.figures.reliability.looks import heading
from mechdesign.results import Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses

MAX_SOURCES = 16
MAX_TOLERANCES = 20
MAX_POSE_BARS = 4
# Columns of bars, in words and colours.
_SOBOL = {
    "share": ("first-order share", style.BLUE),
    "sobol_first": ("Sobol index, alone", style.ORANGE),
    "sobol_total": ("Sobol index, with all interactions", style.GREEN),
}
# Inches.
_SOURCE_HEIGHT = 0.24
_TOLERANCE_HEIGHT = 0.36  # of both bars
_PANEL_GAP = 0.94
_MIN_WIDTH = 1.9  # of a panel


def contributions_figure(study: Study, table: Table, poses: Poses) -> Figure:
    """A panel an output and order; a bar a pose where a few are listed, their average otherwise, or three indices."""
    pairs = list(dict.fromkeys(zip(table["output"].tolist(), table["order"].tolist(), strict=True)))[:MAX_PANELS]
    names = list(dict.fromkeys(table["source"].tolist()))
    margin = 0.3 + 0.072 * max(len(name) for name in names)
    columns = max(1, min(len(pairs), 3 if len(names) < 9 else 2, int(style.WIDTH / (margin + _MIN_WIDTH))))
    sobol = _sobol_pose(table, poses, len(names))
    each = sobol is None and poses.listed and poses.count <= MAX_POSE_BARS
    bars = 3 if sobol is not None else poses.count if each else 1
    tall = (0.15 + min(len(names), MAX_SOURCES)) * max(_SOURCE_HEIGHT, 0.1 * bars + 0.06)
    bottom = 0.55 + 0.2 * (0 if bars == 1 else 1 if bars < 3 else 2)
    figure, grid = style.page(
        len(pairs),
        columns,
        tall,
        left=margin,
        right=0.15,
        top=0.75,
        bottom=bottom,
        across=margin + 0.1,
        down=_PANEL_GAP,
    )
    for k, (axis, (output, order)) in enumerate(zip(grid, pairs, strict=True)):
        rows = table.where(output=output, order=order)
        if sobol is not None:
            _indices(axis, table, rows, names, sobol)
        else:
            _shares(study, axis, table["share"][rows].reshape(poses.count, len(names)), names, poses, each)
        axis.grid(visible=False, axis="y")
        axis.tick_params(axis="y", length=0)
        axis.set_title(heading(output, order), loc="left", fontsize=9.5)
        axis.set_xlabel("share of the variance [%]" if k + columns >= len(pairs) else "")
    which = ""
    if sobol is not None:
        which = f"at {pose_in_words(study, poses, sobol)}; whiskers: 99.7 % intervals"
        if not np.isfinite(table["sobol_first"][: len(names)]).all():
            which += "; correlated sources have no Sobol index"
    elif poses.count == 1:
        which = f"at {pose_in_words(study, poses, 0)}"
    elif not each:
        which = f"average over {poses.count} poses"
    title(figure, "Where the variance of the error comes from", which, left=margin)
    handles, labels = grid[0].get_legend_handles_labels()
    if len(labels) > 1:
        legend_below(figure, handles, labels)
    return figure


def _sobol_pose(table: Table, poses: Poses, sources: int) -> int | None:
    """The first pose with Sobol indices."""
    if "sobol_first" not in table:
        return None
    known = np.isfinite(table["sobol_first"]).reshape(poses.count, -1).any(axis=1)
    return int(np.argmax(known)) if known.any() else None


def _shares(study: Study, axis: Axes, shares: Floats, names: list[str], poses: Poses, each: bool) -> None:
    known = shares[np.isfinite(shares).all(axis=1)]
    average = known.mean(axis=0) if len(known) else np.zeros(len(names))
    ranked = np.argsort(-average, kind="stable")[:MAX_SOURCES]
    shown = 100.0 * (shares[:, ranked] if each else average[None, ranked])
    height = 0.8 / len(shown)
    for k, values in enumerate(shown):
        label = pose_in_words(study, poses, k) if each and len(shown) > 1 else None
        bars = axis.barh(np.arange(len(ranked)) + (k + 0.5) * height - 0.4, values, height,
                         color=style.PALETTE[k % len(style.PALETTE)], label=label)  # fmt: skip
        if len(shown) == 1:
            axis.bar_label(bars, fmt="%.1f", padding=2, fontsize=8)
    _name(axis, [names[k] for k in ranked])


def _indices(axis: Axes, table: Table, rows: Flags, names: list[str], pose: int) -> None:
    """First-order share, first and total index of each source, by the total one."""
    own = np.flatnonzero(rows)[pose * len(names) : (pose + 1) * len(names)]
    # Correlated sources have no indices of their own: they are ranked by their share.
    largest = np.fmax(table["sobol_total"][own], table["share"][own])
    ranked = own[np.argsort(-np.nan_to_num(largest), kind="stable")[:MAX_SOURCES]]
    height = 0.8 / len(_SOBOL)
    for k, (column, (words, color)) in enumerate(_SOBOL.items()):
        values, reach = 100.0 * table[column][ranked], None
        if f"{column}_low" in table:
            ends = 100.0 * np.stack([table[f"{column}_low"][ranked], table[f"{column}_high"][ranked]])
            reach = np.abs(ends - values)
        axis.barh(np.arange(len(ranked)) + (k + 0.5) * height - 0.4, values, height, xerr=reach, color=color,
                  label=words, error_kw={"elinewidth": 1.0, "ecolor": style.INK})  # fmt: skip
    _name(axis, [str(name) for name in table["source"][ranked]])


def _name(axis: Axes, names: list[str]) -> None:
    axis.set_yticks(np.arange(len(names)), names)
    axis.set_ylim(len(names) - 0.42, -0.58)
    axis.margins(x=0.18)
    axis.set_xlim(left=min(0.0, axis.get_xlim()[0]) if axis.get_xlim()[0] < -2.0 else 0.0)


def allocation_figure(study: Study, table: Table) -> Figure:
    """Bars for each source: its tolerance, given and allocated, and its cost."""
    section = study.reliability
    assert section is not None
    assert section.allocate is not None
    total = [float(np.nansum(table[name])) for name in ("cost_given", "cost_allocated")]
    note = f"cost {total[0]:.4g} as given, {total[1]:.4g} allocated ({100 * (total[1] / total[0] - 1):+.1f} %)"
    table = table.take(np.arange(len(table))[:MAX_TOLERANCES])
    names = [f"{row['source']}" + f" ({row['kind']})" * (row["kind"] != "tolerance") for row in table]
    units = table["unit"].tolist()
    margin = 0.35 + 0.075 * max(len(name) for name in names)
    figure, (one, two) = style.page(
        2, 2, _TOLERANCE_HEIGHT * len(table), left=margin, right=0.2, top=0.8, bottom=1.05,
        across=0.45 * (style.WIDTH - margin - 0.2) / 2.45, sharey=True,
    )  # fmt: skip
    alike, given, allocated = len(set(units)) == 1, table["given"], table["allocated"]
    # Tolerances of several units do not share an axis: their ratios do.
    scale = np.ones(len(table)) if alike else given
    _pair(one, given / scale, allocated / scale)
    one.set_xlabel(style.axis_label("tolerance", units[0]) if alike else "tolerance over the given one")
    for place, (value, unit) in enumerate(zip(allocated, units, strict=True)):
        text = f" {value:.3g}" + ("" if alike else f" {unit}")
        one.text(float(value / scale[place]), place + 0.2, text, va="center", fontsize=8)
    _pair(two, table["cost_given"], table["cost_allocated"])
    two.set_xlabel("cost")
    one.set_yticks(np.arange(len(names)), names)
    one.invert_yaxis()
    two.tick_params(axis="y", length=0)
    for axis in (one, two):
        axis.grid(visible=False, axis="y")
        axis.margins(x=0.16, y=0.02)
        axis.locator_params(axis="x", nbins=5)
    title(figure, f"Cheapest tolerances for a reliability of {section.allocate.reliability:.10g}", note, left=margin)
    legend_below(figure, *one.get_legend_handles_labels())
    return figure


def _pair(axis: Axes, given: Floats, allocated: Floats) -> None:
    places = np.arange(len(given))
    axis.barh(places - 0.2, given, 0.36, color=style.FAINT, label="as given")
    axis.barh(places + 0.2, allocated, 0.36, color=style.BLUE, label="allocated")
