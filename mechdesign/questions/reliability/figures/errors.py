"""Errors [S3] and probabilities of failure: over a sweep, over a plane, at listed poses, and of the whole cycle."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.looks import (
    best_moments,
    best_probability,
    channels,
    heading,
    look,
    methods,
)
from mechdesign.drawing.marks import Area, Axis, Dots, Lines, Panel, PanelMark, Picture, Trace, Words, Zone
from mechdesign.drawing.panels import MAX_PANELS, Along, maps, number
from mechdesign.drawing.pictures import picture
from mechdesign.ground.numerals import printed
from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.ground.results import Table
from mechdesign.questions.poses import pose_in_words
from mechdesign.questions.reliability.drawn import FIRST_ORDER
from mechdesign.questions.reliability.figures.view import ErrorsView
from mechdesign.questions.reliability.schema.methods import METHODS, Method

_MARKS = ("o", "s", "^", "D", "v", "P", "X")  # of outputs, in grey
MAX_MAPS = 4
# A limit this many times beyond all errors is named, not drawn.
_FAR_FROM_ERRORS = 3.0
# Listed poses whose names fit below a picture.
MAX_LISTED = 12
# Values that are written beside their marks.
MAX_WRITTEN = 8
# Values whose ratio is larger than this are drawn on a logarithmic scale.
_MAX_LINEAR_RATIO = 8.0
_LIMIT = {"color": style.VERMILION, "linestyle": (0, (5, 2)), "linewidth": 1.4}


@picture(ErrorsView, "bands", "deviations", order=10)
def sweep_pictures(view: ErrorsView) -> dict[str, Picture] | None:
    """Bands of the errors and standard deviations over the sweep, with the difference of the methods [S3]."""
    moments, swept = view.result.tables["moments"], view.swept
    if swept is None:
        return None
    bands = [_band(view, swept, output, order, unit) for output, order, unit in channels(moments)[:MAX_PANELS]]
    return {
        "bands": Picture("Errors of made mechanisms: mean \N{PLUS-MINUS SIGN} 3 standard deviations", bands, share="x"),
        "deviations": _deviations(view, swept),
    }


def _band(view: ErrorsView, swept: Along, output: str, order: str, unit: str) -> Panel:
    """Mean error and three standard deviations to both sides: computed ones as a band, simulated ones as dots."""
    shown = methods(view.result.tables["moments"])
    filled = next((method for method in shown if not look(method).sampled), None)
    marks: list[PanelMark] = [Lines([0.0], look={"color": style.FAINT, "linewidth": 0.8})]
    largest = 0.0
    for method in shown:
        drawn, (over, moments) = look(method), view.curve("moments", method)
        x, rows = over.values, moments.where(output=output, order=order)
        mean, reach = moments["mean"][rows] - moments["nominal"][rows], 3.0 * moments["sigma"][rows]
        largest = max(largest, float(np.nanmax(np.abs(mean) + reach, initial=0.0)))
        if method == filled:
            marks.append(
                Area(x, mean - reach, mean + reach, label=drawn.words, look={"color": drawn.color, "alpha": 0.22})
            )
            marks.append(Trace(x, mean, look={"color": drawn.color, "linewidth": 1.2}))
            continue
        own = _line(drawn, len(x)) | {"linewidth": 1.2, "markersize": 2.8}
        marks += [Trace(x, value, label=drawn.words, look=own) for value in (mean - reach, mean, mean + reach)]
    far, x = [], view.curve("moments", FIRST_ORDER)[0].values
    ends = view.drawn.finer[0].limits.get((output, order), (-np.inf, np.inf))
    for limit in (np.broadcast_to(end, len(x)) for end in ends):
        near = np.where(np.abs(limit) < _FAR_FROM_ERRORS * largest, limit, np.nan)
        if np.isfinite(near).any():
            # Limits of single poses are no line.
            alone = not np.isfinite(near[1:] + near[:-1]).any()
            own = _LIMIT | ({"linestyle": "", "marker": "_", "markersize": 8.0} if alone else {})
            marks.append(Trace(x, near, label="limit of the error", look=own))
        elif len(beyond := limit[np.isfinite(limit)]):
            far.append(" to ".join(dict.fromkeys(f"{end:+g}" for end in (beyond.min(), beyond.max()))))
    words = f"limit {', '.join(far)} {printed(unit)}, outside" if far else ""
    return Panel(marks, swept.axis, Axis("error", unit), heading(output, order), words)


def _deviations(view: ErrorsView, swept: Along) -> Picture:
    """A panel for each order and unit; outputs by colour, methods by dashes or dots."""
    moments = view.result.tables["moments"]
    curves = {method: view.curve("moments", method) for method in methods(moments)}
    shown, reference = methods(moments), best_moments(moments)
    compared = [method for method in shown if not look(method).sampled] if look(reference).sampled else []
    groups: dict[tuple[str, str], list[str]] = {}
    for output, order, unit in channels(moments):
        groups.setdefault((order, unit), []).append(output)
    single, panels = all(len(outputs) == 1 for outputs in groups.values()), []
    for (order, unit), outputs in list(groups.items())[:MAX_PANELS]:
        marks: list[PanelMark] = []
        for output, color, mark in zip(outputs, style.PALETTE, _MARKS, strict=False):
            sigma = {method: moments["sigma"][moments.where(output=output, order=order, unit=unit, method=method)]
                     for method in shown}  # fmt: skip
            apart = ", ".join(_apart(sigma[method], sigma[reference]) for method in compared)
            named = f"{output} ({apart})" if apart else output
            first = f"{order} of {named}" if order != "position" else named
            for method, (over, rows) in curves.items():
                values = rows["sigma"][rows.where(output=output, order=order, unit=unit)]
                own = {"markersize": 3.2} | _line(look(method), len(values)) | ({} if single else {"color": color})
                if not single and not look(method).sampled:
                    own |= {"marker": mark, "markersize": 6, "markevery": over.spread(8, 0.0)}
                words = look(method).words if single else first * (method == shown[0])
                marks.append(Trace(over.values, values, label=words, look=own))
        if not single:
            marks += [Trace([], [], label=look(method).words, look=_line(look(method), 1) | {"color": style.INK})
                      for method in shown]  # fmt: skip
        panels.append(Panel(marks, swept.axis, Axis(order, unit, ends=(0.0, None)), named if single else ""))
    note = f"in brackets: difference from {look(reference).words} on average" if compared else ""
    return Picture("Standard deviation of made mechanisms", panels, (note,), share="x")


def _apart(computed: Floats, simulated: Floats) -> str:
    """By how much deviations differ from simulated ones on average, in per cent of these."""
    finite = np.isfinite(computed) & (simulated > 0)
    return f"{100.0 * np.mean(np.abs(computed[finite] / simulated[finite] - 1.0)):.2g} %" if finite.any() else "unknown"


def _most_dots() -> int:
    """Simulated poses of a sweep that can be told apart."""
    return 36 if style.narrow() else 80


def _line(drawn: Method, poses: int) -> dict[str, Any]:
    """Dashes of what is computed, markers of what is simulated, of many poses at some."""
    dashes, marker = ("None", drawn.marker) if drawn.sampled else (drawn.dashes, "")
    every = max(1, -(-poses // _most_dots()))
    return {"color": drawn.color, "linestyle": dashes, "marker": marker, "markevery": every}


@picture(ErrorsView, "deviation_map", "failure_map", order=20)
def map_pictures(view: ErrorsView) -> dict[str, Picture] | None:
    """Standard deviation of each output, and the failure probability where there are limits."""
    study, tables, over = view.study, view.result.tables, view.over
    if over is None:
        return None
    moments = tables["moments"]
    method = best_moments(moments)
    shown = [channel for channel in channels(moments) if channel[1] == "position"] or channels(moments)
    parts = [
        (style.axis_label(output, unit),
         moments["sigma"][moments.where(output=output, order=order, method=method)].reshape(over.x.shape))
        for output, order, unit in shown[:MAX_MAPS]
    ]  # fmt: skip
    note = f"by {look(method).words}; the error is that of made mechanisms at this pose"
    made = {"deviation_map": maps(study, over, parts, "Standard deviation of the error", note)}
    if "reliability" in tables:
        table = tables["reliability"]
        method = best_probability(table)
        failure = table["failure"][table.where(method=method, scope="pose")].reshape(over.x.shape)
        made["failure_map"] = maps(study, over, [("", failure)], "Probability that an error leaves its limits",
                                   f"by {look(method).words}", logarithmic=True)  # fmt: skip
    return made


@picture(ErrorsView, "reliability", order=30)
def estimates(view: ErrorsView) -> Picture | None:
    """Failure by every method, over what a sweep runs over or beside the words for each listed pose."""
    study, poses, swept = view.study, view.poses, view.swept
    few = poses.listed or (view.over is None and poses.count <= MAX_LISTED)
    if "reliability" not in view.result.tables or (not few and swept is None):
        return None
    table = view.result.tables["reliability"]
    shown, unseen = methods(table), _unseen(table)
    count = poses.count if swept is not None else min(poses.count, MAX_LISTED)
    values = np.arange(count, dtype=np.float64) if swept is None else swept.values
    written = swept is None and count * len(shown) <= (MAX_WRITTEN // 2 if style.narrow() else MAX_WRITTEN)
    # At listed poses methods stand side by side; along a sweep simulated ones are shifted a little.
    beside = shown if swept is None else [method for method in shown if look(method).sampled]
    step = min(0.3 if written else 0.14, 0.8 / len(shown)) if swept is None else 0.2 * np.ptp(values) / count
    axis = _scale(table)
    floor = axis.ends[0] or 0.0
    marks: list[PanelMark] = []
    for method in shown:
        rows, drawn = np.flatnonzero(table.where(method=method, scope="pose"))[:count], look(method)
        at = values + (beside.index(method) - (len(beside) - 1) / 2) * step if method in beside else values
        value = table["failure"][rows]
        if drawn.sampled:
            marks += _intervals(table, rows, at, method, floor)
        elif swept is None:
            # Zero is drawn at the lower end of a logarithmic axis.
            own = {"marker": drawn.marker, "color": drawn.color, "clip_on": False}
            marks.append(Dots(at, np.maximum(value, floor), label=drawn.words, look=own))
        else:
            over, curve = view.curve("reliability", method)
            value, own = curve["failure"], {"linestyle": drawn.dashes, "color": drawn.color}
            shown_value = np.where(value > floor, value, np.nan) if floor else value
            marks.append(Trace(over.values, shown_value, label=drawn.words, look=own))
        for x, row in zip(at.tolist(), rows, strict=True) if written else ():
            height = float(table["failure_high" if unseen[row] else "failure"][row])
            if not np.isnan(height):
                words = "< " * bool(unseen[row]) + number(height)
                marks.append(Words(x, max(height, floor), words, (8, 0), look={"va": "center"}))
    title, x_axis = (
        "Probability that an error leaves its limits",
        swept.wider
        if swept is not None
        else Axis(
            words=[pose_in_words(study, poses, row).replace(", ", "\n") for row in range(count)],
            ends=(-0.6, count - 0.4),
        ),
    )
    if count < poses.count:
        title += f" (first {MAX_LISTED} of {poses.count} poses)"
    for method in shown:
        marks += _cycle(table, method, floor)
    notes = ["whiskers: 99.7 % intervals"] * any(look(method).sampled for method in shown)
    notes += ["open arrows: no failure was seen, upper end of the interval"] * bool(unseen.any())
    return Picture(title, [Panel(marks, x_axis, axis)], ("; ".join(notes),))


def _scale(table: Table) -> Axis:
    """The axis of failure, logarithmic where values lie far apart."""
    value = np.concatenate([table["failure"], table["failure_high"][_unseen(table)]])
    positive = value[np.isfinite(value) & (value > 0)]
    if not len(positive) or positive.max() <= _MAX_LINEAR_RATIO * positive.min():
        return Axis("failure probability")
    floor = 10.0 ** np.floor(np.log10(max(0.5 * positive.min(), 1e-300)))
    return Axis(
        "failure probability", "", "log", (float(floor), min(1.0, 3.0 * float(np.nanmax(table["failure_high"]))))
    )


def _unseen(table: Table) -> Flags:
    """Rows whose samples have no failure: only an upper bound is known."""
    return np.asarray((table["failure_low"] == 0) & (table["failure_high"] > 0) & (table["samples"] > 0))


def _intervals(table: Table, rows: Ints, at: Floats, chosen: str, floor: float) -> Iterator[PanelMark]:
    """Values with intervals, one marker for each method that they come from."""
    used, unseen, color = table["used"][rows], _unseen(table)[rows], look(chosen).color
    value, low, high = (table[name][rows] for name in ("failure", "failure_low", "failure_high"))
    for method in dict.fromkeys(used.tolist()):
        own, by, words = used == method, chosen, look(chosen).words
        if method != chosen and method in METHODS:
            by, solved = method, int(table["evaluations"][rows[own]].sum())
            words += f" by {look(method).words}, {solved:,} solved"
        failing, none = own & ~unseen, own & unseen
        bars = np.abs(np.stack([value - np.maximum(low, floor), high - value]))
        shown = {"marker": look(by).marker, "markersize": 5, "capsize": 3 if len(at) < 25 else 0, "color": color,
                 "elinewidth": 1.2}  # fmt: skip
        yield Dots(at[failing], value[failing], along_y=bars[:, failing], label=words, look=shown)
        yield Dots(
            at[none], high[none], look={"marker": "v", "markersize": 6, "color": color, "markerfacecolor": "white"}
        )


def _cycle(table: Table, method: str, floor: float) -> Iterator[PanelMark]:
    """The whole cycle across the picture: its value, and the bounds or the interval about it."""
    drawn = look(method)
    for row in np.flatnonzero(table.where(method=method, scope="cycle")):
        low, high, value = (float(table[name][row]) for name in ("failure_low", "failure_high", "failure"))
        bounds = table["used"][row] == "bounds"
        words = f"whole cycle, bounds by {drawn.words}" if bounds else ""
        yield Zone(max(low, floor), high, label=words, look={"color": drawn.color, "alpha": 0.15})
        if not bounds:
            dashes = {"color": drawn.color, "linestyle": (0, (7, 2)), "linewidth": 1.6}
            yield Lines([value], label=f"whole cycle, {drawn.words}", look=dashes)
