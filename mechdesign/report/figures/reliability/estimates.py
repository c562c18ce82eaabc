"""Probability of failure with its interval: pose by pose, over a sweep, and of the whole cycle."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.analyses.poses import pose_in_words
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.report.figures import style
from mechdesign.report.figures.panels import Along, fitting, legend_below, number, tick_abscissa, title
from mechdesign.report.figures.reliability.looks import look, methods
from mechdesign.results import Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses
from mechdesign.study.schema.methods import METHODS

# Listed poses whose names fit below a picture.
MAX_LISTED = 12
# Values that are written beside their marks.
MAX_WRITTEN = 8
# Inches.
_LEFT = 0.95
_ABOVE = 0.7
_HEIGHT = 2.7
# Values whose ratio is larger than this are drawn on a logarithmic scale.
_MAX_LINEAR_RATIO = 8.0
# Handles by their words; error bars are no artists.
Legend = dict[str, Any]


def estimate_figure(study: Study, table: Table, poses: Poses, swept: Along | None) -> Figure:
    """Failure by every method, over what a sweep runs over or beside the words for each listed pose."""
    known, unseen = methods(table), _unseen(table)
    count = poses.count if swept is not None else min(poses.count, MAX_LISTED)
    values = np.arange(count, dtype=np.float64) if swept is None else swept.values
    written = swept is None and count * len(known) <= MAX_WRITTEN
    # Methods stand beside each other at a listed pose; of a sweep those that are simulated, a little.
    beside = known if swept is None else [method for method in known if look(method).simulated]
    step = min(0.3 if written else 0.14, 0.8 / len(known)) if swept is None else 0.2 * np.ptp(values) / count
    lines = 1 if swept is not None else min(len(poses.names), 4)
    figure, (axes,) = style.page(1, 1, _HEIGHT, left=_LEFT, right=0.15, top=_ABOVE, bottom=1.0)
    axes.set_ylabel("failure probability")
    floor = _scale(axes, table)
    entries: Legend = {}
    for method in known:
        rows, drawn = np.flatnonzero(table.where(method=method, scope="pose"))[:count], look(method)
        at = values + (beside.index(method) - (len(beside) - 1) / 2) * step if method in beside else values
        value = table["failure"][rows]
        if drawn.simulated:
            _dots(axes, table, rows, at, method, floor, entries)
        elif swept is None:
            # What is 0 stands on the floor of a logarithmic axis.
            (entries[drawn.words],) = axes.plot(
                at, np.maximum(value, floor), drawn.marker, color=drawn.color, clip_on=False
            )
        else:
            shown = np.where(value > 0, value, np.nan) if floor else value
            (entries[drawn.words],) = axes.plot(at, shown, drawn.dashes, color=drawn.color)
        for x, row in zip(at, rows, strict=True) if written else ():
            height = float(table["failure_high" if unseen[row] else "failure"][row])
            if not np.isnan(height):
                axes.annotate("< " * bool(unseen[row]) + number(height), (x, max(height, floor)), xytext=(8, 0),
                              textcoords="offset points", va="center", fontsize=8)  # fmt: skip
    heading = "Probability that an error leaves its limits"
    if swept is None:
        words = [pose_in_words(study, poses, row).replace(", ", "\n") for row in range(count)]
        axes.set_xticks(values, words, fontsize=8 if count <= 8 else 6.5)
        axes.set_xlim(-0.6, count - 0.4)
        heading += f" (first {MAX_LISTED} of {poses.count} poses)" if poses.count > MAX_LISTED else ""
    else:
        axes.set_xlabel(swept.label)
        tick_abscissa(axes, swept)
        axes.margins(x=0.02)
    for method in known:
        _cycle(axes, table, method, entries)
    bottom = 0.45 + 0.15 * lines + 0.2 * -(-len(entries) // fitting(list(entries)))
    height = _ABOVE + _HEIGHT + bottom
    figure.set_figheight(height)
    figure.subplots_adjust(bottom=bottom / height, top=1 - _ABOVE / height)
    notes = ["whiskers: 99.7 % intervals"] * any(look(method).simulated for method in known)
    notes += ["open arrows: no failure was seen, upper end of the interval"] * bool(unseen.any())
    title(figure, heading, "; ".join(notes), left=_LEFT)
    legend_below(figure, list(entries.values()), list(entries))
    return figure


def _scale(axes: Axes, table: Table) -> float:
    """Set the axis, logarithmic where values lie far apart; returns its floor, 0 where it is linear."""
    value = np.concatenate([table["failure"], table["failure_high"][_unseen(table)]])
    positive = value[np.isfinite(value) & (value > 0)]
    if len(positive) and positive.max() > _MAX_LINEAR_RATIO * positive.min():
        axes.set_yscale("log")
        floor = 10.0 ** np.floor(np.log10(max(0.5 * positive.min(), 1e-300)))
        axes.set_ylim(floor, min(1.0, 3.0 * float(np.nanmax(table["failure_high"]))))
        return float(floor)
    return 0.0


def _unseen(table: Table) -> Flags:
    """Rows of samples without a failure: only an upper end is known."""
    return np.asarray((table["failure_low"] == 0) & (table["failure_high"] > 0) & (table["samples"] > 0))


def _dots(axes: Axes, table: Table, rows: Ints, at: Floats, asked: str, floor: float, entries: Legend) -> None:
    """Values with intervals, one marker for each method that they come from."""
    used, unseen, color = table["used"][rows], _unseen(table)[rows], look(asked).color
    value, low, high = (table[name][rows] for name in ("failure", "failure_low", "failure_high"))
    for method in dict.fromkeys(used.tolist()):
        own, by, words = used == method, asked, look(asked).words
        if method != asked and method in METHODS:
            by, solved = method, int(table["evaluations"][rows[own]].sum())
            words += f" by {look(method).words}, {solved:,} solved"
        seen, none = own & ~unseen, own & unseen
        bars = np.abs(np.stack([value - np.maximum(low, floor), high - value]))
        entries[words] = axes.errorbar(
            at[seen], value[seen], bars[:, seen], fmt=look(by).marker, markersize=5,
            capsize=3 if len(at) < 25 else 0, color=color, elinewidth=1.2,
        )  # fmt: skip
        if none.any():
            axes.plot(at[none], high[none], linestyle="None", marker="v", markersize=6, color=color,
                      markerfacecolor="white")  # fmt: skip


def _cycle(axes: Axes, table: Table, method: str, entries: Legend) -> None:
    """The whole cycle across the picture: its value, and the bounds or the interval about it."""
    drawn = look(method)
    for row in np.flatnonzero(table.where(method=method, scope="cycle")):
        low, high, value = (float(table[name][row]) for name in ("failure_low", "failure_high", "failure"))
        between = axes.axhspan(max(low, axes.get_ylim()[0]), high, color=drawn.color, alpha=0.15, linewidth=0)
        if table["used"][row] == "bounds":
            entries[f"whole cycle, bounds by {drawn.words}"] = between
        else:
            entries[f"whole cycle, {drawn.words}"] = axes.axhline(
                value, color=drawn.color, linestyle=(0, (7, 2)), linewidth=1.6
            )
