"""Probability of failure with its interval: pose by pose, over a sweep, and of the whole cycle."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.analyses.poses import pose_in_words
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.report.figures.panels import Along, fitting, framed, legend_below, number, tick_abscissa, title
from mechdesign.report.figures.reliability.looks import LOOKS, Look, methods, select
from mechdesign.results import Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses

# Listed poses whose names fit below a picture.
MOST_LISTED = 12
# Values that are written beside their marks.
MOST_WRITTEN = 8
_LEFT, _ABOVE, _TALL = 0.95, 0.7, 2.7  # inches
# Values farther apart than this are drawn on a logarithmic scale.
_WIDE = 8.0
# Handles by their words; error bars are no artists.
Legend = dict[str, Any]


def estimate_figure(study: Study, table: Table, poses: Poses, swept: Along | None) -> Figure:
    """Failure by every method, over what a sweep runs over or beside the words for each listed pose."""
    known = methods(table)
    figure = framed(4.5, left=_LEFT, right=0.15, top=_ABOVE, bottom=1.0)
    axes = figure.subplots()
    axes.set_ylabel("failure probability")
    floor = _scale(axes, table)
    entries: Legend = {}
    if swept is None:
        _listed(study, axes, table, poses, floor, entries)
    else:
        _swept(axes, table, swept, floor, entries)
    for method in known:
        _cycle(axes, table, method, entries)
    heading = "Probability that an error leaves its limits"
    if swept is None and poses.count > MOST_LISTED:
        heading += f" (first {MOST_LISTED} of {poses.count} poses)"
    lines = 1 if swept is not None else min(len(poses.names), 4)
    bottom = 0.45 + 0.15 * lines + 0.2 * -(-len(entries) // fitting(list(entries)))
    height = _ABOVE + _TALL + bottom
    figure.set_figheight(height)
    figure.subplots_adjust(bottom=bottom / height, top=1 - _ABOVE / height)
    notes = ["whiskers: 99.7 % intervals"] * any(LOOKS[method].simulated for method in known)
    notes += ["open arrows: no failure was seen, upper end of the interval"] * bool(_unseen(table).any())
    title(figure, heading, "; ".join(notes), left=_LEFT)
    legend_below(figure, list(entries.values()), list(entries))
    return figure


def _listed(study: Study, axes: Axes, table: Table, poses: Poses, floor: float, entries: Legend) -> None:
    """Methods beside each other at each pose, with their values where there is room to write them."""
    known, unseen = methods(table), _unseen(table)
    count = min(poses.count, MOST_LISTED)
    written = count * len(known) <= MOST_WRITTEN
    apart = min(0.3 if written else 0.14, 0.8 / len(known))
    for k, method in enumerate(known):
        rows = np.flatnonzero(select(table, method=method, scope="pose"))[:count]
        at = np.arange(count, dtype=np.float64) + (k - (len(known) - 1) / 2) * apart
        look = LOOKS[method]
        if look.simulated:
            _dots(axes, table, rows, at, look, floor, entries)
        else:
            # What is 0 stands on the floor of a logarithmic axis.
            value = np.maximum(table["failure"][rows], floor)
            (entries[look.words],) = axes.plot(at, value, look.marker, color=look.color, clip_on=False)
        for x, row in zip(at, rows, strict=True) if written else ():
            height = float(table["failure_high" if unseen[row] else "failure"][row])
            if np.isnan(height):
                continue
            axes.annotate(f"< {number(height)}" if unseen[row] else number(height), (x, max(height, floor)),
                          xytext=(8, 0), textcoords="offset points", va="center", fontsize=8)  # fmt: skip
    words = [pose_in_words(study, poses, row).replace(", ", "\n") for row in range(count)]
    axes.set_xticks(np.arange(count), words, fontsize=8 if count <= 8 else 6.5)
    axes.set_xlim(-0.6, count - 0.4)


def _swept(axes: Axes, table: Table, swept: Along, floor: float, entries: Legend) -> None:
    """Lines of what is computed, and dots of what is simulated, moved a little from one another."""
    known = methods(table)
    simulated = [method for method in known if LOOKS[method].simulated]
    apart = 0.2 * float(np.ptp(swept.values)) / len(swept.values)
    for method in known:
        rows, look = np.flatnonzero(select(table, method=method, scope="pose")), LOOKS[method]
        if look.simulated:
            shift = (simulated.index(method) - (len(simulated) - 1) / 2) * apart
            _dots(axes, table, rows, swept.values + shift, look, floor, entries)
        else:
            value = table["failure"][rows]
            shown = np.where(value > 0, value, np.nan) if floor else value
            (entries[look.words],) = axes.plot(swept.values, shown, look.dashes, color=look.color)
    axes.set_xlabel(swept.label)
    tick_abscissa(axes, swept)
    axes.margins(x=0.02)


def _scale(axes: Axes, table: Table) -> float:
    """Set the axis, logarithmic where values lie far apart; returns its floor, 0 where it is linear."""
    value = np.concatenate([table["failure"], table["failure_high"][_unseen(table)]])
    positive = value[np.isfinite(value) & (value > 0)]
    if len(positive) and positive.max() > _WIDE * positive.min():
        axes.set_yscale("log")
        floor = 10.0 ** np.floor(np.log10(max(0.5 * positive.min(), 1e-300)))
        axes.set_ylim(floor, min(1.0, 3.0 * float(np.nanmax(table["failure_high"]))))
        return float(floor)
    return 0.0


def _unseen(table: Table) -> Flags:
    """Rows of samples without a failure: only an upper end is known."""
    return np.asarray((table["failure_low"] == 0) & (table["failure_high"] > 0) & (table["samples"] > 0))


def _dots(axes: Axes, table: Table, rows: Ints, at: Floats, look: Look, floor: float, entries: Legend) -> None:
    """Values with intervals, one marker for each method that they come from."""
    used = table["used"][rows]
    unseen = _unseen(table)[rows]
    value, low, high = (table[name][rows] for name in ("failure", "failure_low", "failure_high"))
    for method in dict.fromkeys(used.tolist()):
        own = used == method
        shown, words = look, look.words
        if method != table["method"][rows[0]] and method in LOOKS:
            shown = replace(look, marker=LOOKS[method].marker)
            solved = int(table["evaluations"][rows[own]].sum())
            words = f"{look.words} by {LOOKS[method].words}, {solved:,} solved"
        seen = own & ~unseen
        bars = np.abs(np.stack([value - np.maximum(low, floor), high - value]))
        entries[words] = axes.errorbar(
            at[seen], value[seen], bars[:, seen], fmt=shown.marker, markersize=5, capsize=3 if len(at) < 25 else 0,
            color=look.color, elinewidth=1.2,
        )  # fmt: skip
        none = own & unseen
        if none.any():
            axes.plot(at[none], high[none], linestyle="None", marker="v", markersize=6, color=look.color,
                      markerfacecolor="white")  # fmt: skip


def _cycle(axes: Axes, table: Table, method: str, entries: Legend) -> None:
    """The whole cycle across the picture: its value, and the bounds or the interval about it."""
    for row in np.flatnonzero(select(table, method=method, scope="cycle")):
        look = LOOKS[method]
        low, high, value = (float(table[name][row]) for name in ("failure_low", "failure_high", "failure"))
        between = axes.axhspan(max(low, axes.get_ylim()[0]), high, color=look.color, alpha=0.15, linewidth=0)
        if table["used"][row] == "bounds":
            entries[f"whole cycle, bounds by {look.words}"] = between
        else:
            entries[f"whole cycle, {look.words}"] = axes.axhline(
                value, color=look.color, linestyle=(0, (7, 2)), linewidth=1.6
            )
