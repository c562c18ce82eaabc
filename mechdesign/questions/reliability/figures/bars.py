"""What errors come from, and what keeping them small costs: bars a source of the variance, and of the tolerances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.numerics.arrays import Floats
from mechdesign.questions.poses import pose_in_words
from mechdesign.questions.reliability.figures.view import ErrorsView
from mechdesign.questions.reliability.schema.section import ReliabilitySection
from mechdesign.report.figures import style
from mechdesign.report.figures.looks import best_probability, followed_in_words, heading
from mechdesign.report.figures.panels import MAX_PANELS, legend_below, number, title
from mechdesign.report.figures.pictures import picture
from mechdesign.results import Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses

MAX_SOURCES = 16
MIN_SOURCES = 3
MAX_TOLERANCES = 20
MAX_POSE_BARS = 4
# Sobol' indices that differ from the first-order share by more than this part of the variance are marked.
_SAME_SHARE = 0.01
_SHARE = "share, to the first order"
_NAMES = 0.4  # of the width, for names beside bars
# Inches.
_AROUND = 2.1  # above and below all panels
_LEGEND = 0.35
_LETTER = 0.072  # of a name
_SOURCE_HEIGHT = 0.24
_TOLERANCE_HEIGHT = 0.36  # of both bars
_FAILURE_HEIGHT = 0.75
_FAILURE_ROOM = 1.4
_BEFORE_FAILURE = 1.1
_PANEL_GAP = 0.5
_NEGATIVE = 0.5  # inches, of the number of a negative bar
_ACROSS = 0.3
_MIN_WIDTH = 1.9  # of a panel


@picture(ErrorsView, "contributions", order=50)
def contributions_picture(view: ErrorsView) -> Figure:
    """The contributions at the pose whose samples are shown, or the average."""
    worst = view.drawn.samples.pose if view.drawn.samples is not None else 0
    return contributions_figure(view.study, view.result.tables["contributions"], view.poses, worst)


def contributions_figure(study: Study, table: Table, poses: Poses, worst: int = 0) -> Figure:
    """A panel an output and order: bars of the first-order shares, and marks where Sobol' indices differ from them.

    A bar a pose where a few are listed; else the worst pose with Sobol' indices, or the average over the poses. The
    sources are in one order, the largest of any panel first.
    """
    pairs = list(dict.fromkeys(zip(table["output"].tolist(), table["order"].tolist(), strict=True)))[:MAX_PANELS]
    names = list(dict.fromkeys(table["source"].tolist()))
    sobol = _sobol_pose(table, poses, worst)
    per_pose = sobol is None and poses.listed and poses.count <= MAX_POSE_BARS
    blocks = [table.take(table.where(output=output, order=order)) for output, order in pairs]
    bars = [100.0 * _shares(block["share"].reshape(poses.count, -1), sobol, per_pose) for block in blocks]
    largest = np.max([np.nan_to_num(bar).mean(axis=0) for bar in bars], axis=0)
    names, margin, lines = _beside(names)
    columns = max(
        1, min(len(pairs), 3 if len(names) < 9 else 2, int((style.width() - margin) / (_ACROSS + _MIN_WIDTH)))
    )
    bar = max(_SOURCE_HEIGHT, 0.1 * len(bars[0]) + 0.06, style.line(10.0) * lines)
    free = style.tallest() - _AROUND + _PANEL_GAP
    rows = -(-len(pairs) // columns)
    # Where a page does not hold all panels with a few bars each, the last are left out.
    while rows > 1 and rows * (_PANEL_GAP + (0.15 + min(MIN_SOURCES, len(names))) * bar) > free:
        rows -= 1
    held = rows * columns
    left_out = len(pairs[held:])
    pairs, blocks, bars = pairs[:held], blocks[:held], bars[:held]
    most = MAX_SOURCES
    while most > MIN_SOURCES and rows * (_PANEL_GAP + (0.15 + most) * bar) > free:
        most -= 1
    ranked = np.argsort(-largest, kind="stable")[:most]
    where = "" if per_pose and poses.count > 1 else f"average over {poses.count} poses"
    if sobol is not None or poses.count == 1:
        section, pose = ReliabilitySection.of(study), sobol or 0
        fails_most = pose == worst and bool(section.limits)
        where = f"at {followed_in_words(study, poses, pose) if fails_most else pose_in_words(study, poses, pose)}"
    notes = []
    if any((bar < -1.0).any() for bar in bars):
        notes.append("correlated sources make up for each other: negative shares, and others above 100 %")
    if left_out:
        notes.append(f"the first {len(pairs)} of {len(pairs) + left_out} errors")
    if len(ranked) < len(names):
        notes.append(f"the {len(ranked)} largest of {len(names)} sources")
    tall = (0.15 + len(ranked)) * bar
    figure, grid = style.page(
        len(pairs), columns, tall, left=margin, right=0.2, top=0.95, bottom=0.6, across=_ACROSS,
        down=_PANEL_GAP, sharex=True, sharey=True,
    )  # fmt: skip
    entries: dict[str, Any] = {}
    for k, (axis, block, shown) in enumerate(zip(grid, blocks, bars, strict=True)):
        for place, values in enumerate(shown[:, ranked]):
            height = 0.8 / len(shown)
            label = pose_in_words(study, poses, place) if len(shown) > 1 else _SHARE
            look: dict[str, Any] = {"color": style.PALETTE[place % len(style.PALETTE)]}
            if hatch := style.HATCHES[place % len(style.HATCHES)]:
                look |= {"hatch": hatch, "edgecolor": "white", "linewidth": 0}
            drawn = axis.barh(np.arange(len(ranked)) + (place + 0.5) * height - 0.4, values, height, **look)
            entries[label] = drawn
            if len(shown) == 1:
                axis.bar_label(drawn, fmt="%.1f", padding=2, fontsize=8)
        if sobol is not None:
            _mark_sobol(axis, block.take(sobol * len(names) + ranked), entries)
        _name(axis, [names[k] for k in ranked])
        axis.set_title(heading(*pairs[k]), loc="left", fontsize=9.5)
        axis.set_xlabel("share of the variance [%]" if k + columns >= len(pairs) else "")
    low = min(0.0, *(float(np.nanmin(shown)) for shown in bars)) if any((bar < -1.0).any() for bar in bars) else 0.0
    high = max(float(np.nanmax(shown, initial=1.0)) for shown in bars)
    # The number of a negative bar stands left of it.
    share = _NEGATIVE / (grid[0].get_position().width * style.width()) if low < 0 else 0.0
    grid[0].set_xlim(low - share / (1 - share) * (1.25 * high - low), 1.25 * high)
    if list(entries) != [_SHARE]:
        style.grow(figure, below=_LEGEND)
        legend_below(figure, list(entries.values()), list(entries))
    elif sobol is None:
        notes.append("shares to the first order")
    else:
        notes.append(
            f"shares to the first order; Sobol indices agree within {100 * _SAME_SHARE:g} % or their intervals"
        )
    title(figure, "Where the variance of the error comes from", where, "; ".join(notes), left=margin)
    return figure


def _beside(names: Sequence[str]) -> tuple[list[str], float, int]:
    """Names beside bars in lines, the inches that they need, and how many lines the longest has."""
    folded = [style.folded(name, 10.0, _NAMES * style.width()) for name in names]
    lines = [line for name in folded for line in name.split("\n")]
    return folded, 0.3 + _LETTER * max(map(len, lines)), max(name.count("\n") for name in folded) + 1


def _sobol_pose(table: Table, poses: Poses, worst: int) -> int | None:
    """The worst pose if it has Sobol' indices, else the first pose that has."""
    if "sobol_first" not in table:
        return None
    indexed = np.isfinite(table["sobol_first"]).reshape(poses.count, -1).any(axis=1)
    return (worst if indexed[worst] else int(np.argmax(indexed))) if indexed.any() else None


def _shares(shares: Floats, pose: int | None, per_pose: bool) -> Floats:
    """Shares of one pose, of each pose, or averaged over the poses that have them, shape (bars, sources)."""
    if pose is not None or per_pose:
        return shares if pose is None else shares[[pose]]
    complete = shares[np.isfinite(shares).all(axis=1)]
    return complete.mean(axis=0, keepdims=True) if len(complete) else np.zeros((1, shares.shape[1]))


def _mark_sobol(axis: Axes, table: Table, entries: dict[str, Any]) -> None:
    """Marks with intervals where an index differs from the first-order share by more than its interval explains."""
    kinds = (("first", "o", "Sobol index, alone"), ("total", "D", "Sobol index, with all interactions"))
    for kind, marker, words in kinds:
        value, low, high = (table[f"sobol_{kind}{end}"] for end in ("", "_low", "_high"))
        apart = np.abs(value - table["share"]) > np.maximum(_SAME_SHARE, (high - low) / 2)
        if apart.any():
            reach = 100.0 * np.abs(np.stack([low, high]) - value)[:, apart]
            entries[words] = axis.errorbar(
                100.0 * value[apart], np.flatnonzero(apart), xerr=reach,
                fmt=marker, color=style.INK, markersize=4.5, markerfacecolor="white", elinewidth=1.0,
            )  # fmt: skip


def _name(axis: Axes, names: list[str]) -> None:
    axis.grid(visible=False, axis="y")
    axis.tick_params(axis="y", length=0)
    axis.set_yticks(np.arange(len(names)), names)
    axis.set_ylim(len(names) - 0.42, -0.58)


@picture(ErrorsView, "allocation", order=60)
def allocation_picture(view: ErrorsView) -> Figure | None:
    """The tolerances that were allocated, if any were."""
    return allocation_figure(view.study, view.result.tables) if "allocation" in view.result.tables else None


def allocation_figure(study: Study, tables: Mapping[str, Table]) -> Figure:
    """Bars for each source, its tolerance, given and allocated, and its cost; below, how often either fails."""
    section, table = ReliabilitySection.of(study), tables["allocation"]
    assert section.allocate is not None
    total = [float(np.nansum(table[name])) for name in ("cost_given", "cost_allocated")]
    note = f"cost {total[0]:.4g} as given, {total[1]:.4g} allocated ({100 * (total[1] / total[0] - 1):+.1f} %)"
    table = table.take(np.arange(len(table))[:MAX_TOLERANCES])
    names = [f"{row['source']}" + f" ({row['kind']})" * (row["kind"] != "tolerance") for row in table]
    units = table["unit"].tolist()
    names, margin, lines = _beside(names)
    margin = max(margin, _BEFORE_FAILURE)
    tall = max(_TOLERANCE_HEIGHT, style.line(10.0) * lines) * len(table)
    figure, (one, two) = style.page(
        2, 2, tall, left=margin, right=0.2, top=0.8, bottom=_FAILURE_ROOM + 1.05,
        across=0.45 * (style.width() - margin - 0.2) / 2.45, sharey=True,
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
        axis.locator_params(axis="x", nbins=3 if style.narrow() else 5)
    height = figure.get_figheight()
    below = figure.add_axes(
        (margin / style.width(), 1.0 / height, 1 - (margin + 0.2) / style.width(), _FAILURE_HEIGHT / height)
    )
    capable = section.allocate.cpk is not None
    goal = (section.allocate.cpk if capable else section.allocate.reliability) or 0.0
    if capable:
        _capabilities(below, tables, goal)
    else:
        _failures(below, tables, 1.0 - goal)
    noun = "Cpk" if capable else "reliability"
    title(figure, f"Cheapest tolerances for a {noun} of {goal:.10g}", note, left=margin)
    handles, labels = (
        [*first, *second] for first, second in zip(
            one.get_legend_handles_labels(), below.get_legend_handles_labels(), strict=True)
    )  # fmt: skip
    legend_below(figure, handles, labels)
    return figure


def _failures(axis: Axes, tables: Mapping[str, Table], allowed: float) -> None:
    """How often made mechanisms fail at the worst pose with the tolerances given and allocated, and what is allowed."""
    before, after = tables["reliability"], tables["confirmation"]
    before = before.take(before.where(scope="pose", method=best_probability(before)))
    sides = [
        [before[name] for name in ("failure", "failure_low", "failure_high")],
        [1.0 - after[name] for name in ("simulated", "high", "low")],
    ]
    worst = [[float(part[int(np.argmax(np.nan_to_num(side[0])))]) for part in side] for side in sides]
    axis.axvline(allowed, color=style.VERMILION, linestyle=(0, (5, 2)), label=f"allowed: {number(allowed)}")
    axis.set_xscale("log")
    _sides(axis, worst, "probability that an error leaves its limits, at the pose that fails most")


def _capabilities(axis: Axes, tables: Mapping[str, Table], goal: float) -> None:
    """The least Cpk of any limit at any pose with the tolerances given and allocated, and what is asked."""
    before, after = tables["capability"], tables["confirmation"]
    given, worst = float(np.nanmin(before["cpk"])), int(np.argmin(after["simulated"]))
    axis.axvline(goal, color=style.VERMILION, linestyle=(0, (5, 2)), label=f"asked: {number(goal)}")
    sides = [[given] * 3, [float(after[name][worst]) for name in ("simulated", "low", "high")]]
    _sides(axis, sides, "least Cpk of any limit at any pose")


def _sides(axis: Axes, sides: Sequence[Sequence[float]], label: str) -> None:
    """Value, lowest and highest, of the tolerances given and of those allocated."""
    for place, ((value, low, high), color) in enumerate(zip(sides, (style.FAINT, style.BLUE), strict=True)):
        axis.errorbar(value, place, xerr=[[value - low], [high - value]], fmt="o", color=color, capsize=3)
        axis.annotate(f"{number(value)}", (value, place), xytext=(0, 7), textcoords="offset points", ha="center",
                      fontsize=8)  # fmt: skip
    axis.margins(x=0.1)
    axis.set_ylim(1.6, -0.9)
    axis.set_yticks([0, 1], ["as given", "allocated"])
    axis.grid(visible=False, axis="y")
    axis.tick_params(axis="y", length=0)
    axis.set_xlabel(style.folded(label, 10.0, axis.get_position().width * style.width()))


def _pair(axis: Axes, given: Floats, allocated: Floats) -> None:
    places = np.arange(len(given))
    axis.barh(
        places - 0.2, given, 0.36, color=style.FAINT, hatch="////", edgecolor="white", linewidth=0, label="as given"
    )
    axis.barh(places + 0.2, allocated, 0.36, color=style.BLUE, label="allocated")
