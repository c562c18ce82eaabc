"""Errors [S3] and probabilities of failure: over a sweep, over a plane, at listed poses, and of the whole cycle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.questions.poses import pose_in_words
from mechdesign.questions.reliability.figures.view import ErrorsView
from mechdesign.questions.reliability.schema.methods import METHODS, Method
from mechdesign.report.figures import style
from mechdesign.report.figures.looks import (
    best_moments,
    best_probability,
    channels,
    error_limits,
    heading,
    look,
    methods,
)
from mechdesign.report.figures.panels import (
    MAX_PANELS,
    Along,
    clear_of_ticks,
    fitting,
    legend_below,
    map_sheet,
    number,
    stack,
    tick_abscissa,
    title,
)
from mechdesign.report.figures.pictures import picture
from mechdesign.results import Table
from mechdesign.study import Study

MAX_OUTPUTS = 7
_MARKS = ("o", "s", "^", "D", "v", "P", "X")  # of outputs, in grey
MAX_MAPS = 4
# A limit this many times beyond all errors is named, not drawn.
_FAR_FROM_ERRORS = 3.0
# Listed poses whose names fit below a picture.
MAX_LISTED = 12
# Values that are written beside their marks.
MAX_WRITTEN = 8
# Inches, of failure probabilities.
_LEFT = 0.95
_ABOVE = 0.7
_HEIGHT = 2.7
# Values whose ratio is larger than this are drawn on a logarithmic scale.
_MAX_LINEAR_RATIO = 8.0
# Handles by their words; error bars are no artists.
Legend = dict[str, Any]


@picture(ErrorsView, "bands", "deviations", order=10)
def sweep_figures(view: ErrorsView) -> dict[str, Figure] | None:
    """Bands of the errors and standard deviations over the sweep, with the difference of the methods [S3]."""
    study, tables, swept = view.study, view.result.tables, view.swept
    if swept is None:
        return None
    return {"bands": _bands(study, tables, swept), "deviations": _deviations(tables["moments"], swept)}


def _bands(study: Study, tables: Mapping[str, Table], swept: Along) -> Figure:
    """Mean error and three standard deviations to both sides: computed ones as a band, simulated ones as dots."""
    moments = tables["moments"]
    shown = channels(moments)[:MAX_PANELS]
    shown_methods = methods(moments)
    figure, axes = stack(len(shown), "Errors of made mechanisms: mean \N{PLUS-MINUS SIGN} 3 standard deviations",
                         swept.label)  # fmt: skip
    tick_abscissa(axes[-1], swept)
    entries: dict[str, Any] = {}
    filled = next((method for method in shown_methods if not look(method).sampled), None)
    for axis, (output, order, unit) in zip(axes, shown, strict=True):
        axis.axhline(0.0, color=style.FAINT, linewidth=0.8)
        for method in shown_methods:
            drawn, rows = look(method), moments.where(output=output, order=order, method=method)
            mean = moments["mean"][rows] - moments["nominal"][rows]
            reach = 3.0 * moments["sigma"][rows]
            if method == filled:
                entries[drawn.words] = axis.fill_between(
                    swept.values, mean - reach, mean + reach, color=drawn.color, alpha=0.22, linewidth=0
                )
                axis.plot(swept.values, mean, color=drawn.color, linewidth=1.2)
                continue
            for value in (mean - reach, mean, mean + reach):
                every = max(1, len(value) // _most_dots())
                (entries[drawn.words],) = axis.plot(swept.values, value, linewidth=1.2, markersize=2.8, markevery=every,
                                                    **_line(drawn))  # fmt: skip
        reach = _FAR_FROM_ERRORS * np.abs(axis.get_ylim()).max()
        far = []
        for limit in np.broadcast_to(error_limits(study, tables, output, order), (2, len(swept.values))):
            near = np.where(np.abs(limit) < reach, limit, np.nan)
            if np.isfinite(near).any():
                (entries["limit of the error"],) = axis.plot(
                    swept.values, near, color=style.VERMILION, linestyle=(0, (5, 2)), linewidth=1.4
                )
            elif len(beyond := limit[np.isfinite(limit)]):
                far.append(" to ".join(dict.fromkeys(f"{end:+g}" for end in (beyond.min(), beyond.max()))))
        if far:
            words = f"limit {', '.join(far)} {style.printed(unit)}, outside"
            axis.set_title(words, loc="right", fontsize=8, color=style.VERMILION)
        axis.set_ylabel(style.axis_label("error", unit))
        axis.set_title(heading(output, order), loc="left", fontsize=9.5)
    legend_below(figure, list(entries.values()), list(entries))
    clear_of_ticks(figure, axes)
    return figure


def _deviations(moments: Table, swept: Along) -> Figure:
    """A panel for each order and unit; outputs by colour, methods by dashes or dots."""
    panels, shown_methods = _grouped(moments), methods(moments)
    reference, computed = best_moments(moments), [method for method in shown_methods if not look(method).sampled]
    compared = computed if look(reference).sampled else []
    note = f"in brackets: difference from {look(reference).words} on average" if compared else ""
    figure, axes = stack(len(panels), "Standard deviation of made mechanisms", swept.label, note=note)
    tick_abscissa(axes[-1], swept)
    single = all(len(outputs) == 1 for _, _, outputs in panels)
    for axis, (order, unit, outputs) in zip(axes, panels, strict=True):
        named = []
        for output, color, mark in zip(outputs, style.PALETTE, _MARKS, strict=False):
            sigma = {
                method: moments["sigma"][moments.where(output=output, order=order, unit=unit, method=method)]
                for method in shown_methods
            }
            for method, values in sigma.items():
                shown = _line(look(method)) | ({} if single else {"color": color})
                if not single and not look(method).sampled:
                    shown |= {"marker": mark, "markersize": 6, "markevery": max(len(swept.values) // 8, 1)}
                axis.plot(swept.values, values, **({"markersize": 3.2} | shown))
            apart = [_apart(sigma[method], sigma[reference]) for method in compared]
            named.append(f"{output} ({', '.join(apart)})" if apart else output)
        _name_outputs(axis, named, [style.INK] if single else style.PALETTE)
        axis.set_ylabel(style.axis_label(order, unit))
        axis.set_ylim(0.0, 1.1 * axis.get_ylim()[1])
    looks = [_line(look(method)) | ({} if single else {"color": style.INK}) for method in shown_methods]
    legend_below(figure, [Line2D([], [], markersize=4, **shown) for shown in looks],
                 [look(method).words for method in shown_methods])  # fmt: skip
    clear_of_ticks(figure, axes)
    return figure


def _apart(computed: Floats, simulated: Floats) -> str:
    """By how much deviations differ from simulated ones on average, in per cent of these."""
    finite = np.isfinite(computed) & (simulated > 0)
    return f"{100.0 * np.mean(np.abs(computed[finite] / simulated[finite] - 1.0)):.2g} %" if finite.any() else "unknown"


def _most_dots() -> int:
    """Simulated poses of a sweep that can be told apart."""
    return 36 if style.narrow() else 80


def _line(drawn: Method) -> dict[str, Any]:
    """Dashes of what is computed, markers of what is simulated."""
    dashes, marker = ("None", drawn.marker) if drawn.sampled else (drawn.dashes, "")
    return {"color": drawn.color, "linestyle": dashes, "marker": marker}


def _name_outputs(axis: Axes, outputs: Sequence[str], colors: Sequence[str]) -> None:
    """The outputs above a panel, each in its colour."""
    if len(outputs) == 1:
        axis.set_title(outputs[0], loc="left", fontsize=9.5)
        return
    handles = [Line2D([], [], color=color, marker=mark, markersize=6)
               for color, mark, _ in zip(colors, _MARKS, outputs, strict=False)]  # fmt: skip
    axis.legend(handles, outputs, loc="lower left", bbox_to_anchor=(-0.01, 0.98), ncols=len(outputs), borderaxespad=0.0,
                handlelength=1.2, columnspacing=1.2)  # fmt: skip


def _grouped(table: Table) -> list[tuple[str, str, list[str]]]:
    """Order, unit and outputs of each panel: outputs that share an order and a unit."""
    panels: dict[tuple[str, str], list[str]] = {}
    for output, order, unit in channels(table):
        panels.setdefault((order, unit), []).append(output)
    return [(*key, outputs[:MAX_OUTPUTS]) for key, outputs in list(panels.items())[:MAX_PANELS]]


@picture(ErrorsView, "deviation_map", "failure_map", order=20)
def map_figures(view: ErrorsView) -> dict[str, Figure] | None:
    """Standard deviation of each output, and the failure probability where there are limits."""
    study, result, over = view.study, view.result, view.over
    if over is None:
        return None
    moments = result.tables["moments"]
    method = best_moments(moments)
    shown = [channel for channel in channels(moments) if channel[1] == "position"] or channels(moments)
    parts = []
    for output, order, unit in shown[:MAX_MAPS]:
        rows = moments.where(output=output, order=order, method=method)
        parts.append((style.axis_label(output, unit), moments["sigma"][rows].reshape(over.x.shape)))
    note = f"by {look(method).words}; the error is that of made mechanisms at this pose"
    made = {"deviation_map": map_sheet(study, over, parts, "Standard deviation of the error", note)}
    if "reliability" in result.tables:
        table = result.tables["reliability"]
        method = best_probability(table)
        rows = table.where(method=method, scope="pose")
        failure = table["failure"][rows].reshape(over.x.shape)
        made["failure_map"] = map_sheet(
            study, over, [("", failure)], "Probability that an error leaves its limits", f"by {look(method).words}",
            logarithmic=True,
        )  # fmt: skip
    return made


@picture(ErrorsView, "reliability", order=30)
def estimate_figure(view: ErrorsView) -> Figure | None:
    """Failure by every method, over what a sweep runs over or beside the words for each listed pose."""
    study, poses, swept = view.study, view.poses, view.swept
    few = poses.listed or (view.over is None and poses.count <= MAX_LISTED)
    if "reliability" not in view.result.tables or (not few and swept is None):
        return None
    table = view.result.tables["reliability"]
    shown_methods, unseen = methods(table), _unseen(table)
    count = poses.count if swept is not None else min(poses.count, MAX_LISTED)
    values = np.arange(count, dtype=np.float64) if swept is None else swept.values
    written = swept is None and count * len(shown_methods) <= (MAX_WRITTEN // 2 if style.narrow() else MAX_WRITTEN)
    # At listed poses methods stand side by side; along a sweep simulated ones are shifted a little.
    beside = shown_methods if swept is None else [method for method in shown_methods if look(method).sampled]
    step = min(0.3 if written else 0.14, 0.8 / len(shown_methods)) if swept is None else 0.2 * np.ptp(values) / count
    lines = 1 if swept is not None else min(len(poses.names), 4)
    figure, (axes,) = style.page(1, 1, _HEIGHT, left=_LEFT, right=0.15, top=_ABOVE, bottom=1.0)
    axes.set_ylabel("failure probability")
    floor = _scale(axes, table)
    entries: Legend = {}
    for method in shown_methods:
        rows, drawn = np.flatnonzero(table.where(method=method, scope="pose"))[:count], look(method)
        at = values + (beside.index(method) - (len(beside) - 1) / 2) * step if method in beside else values
        value = table["failure"][rows]
        if drawn.sampled:
            _dots(axes, table, rows, at, method, floor, entries)
        elif swept is None:
            # Zero is drawn at the lower end of a logarithmic axis.
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
    for method in shown_methods:
        _cycle(axes, table, method, entries)
    bottom = 0.45 + 0.15 * lines + 0.2 * -(-len(entries) // fitting(list(entries)))
    height = _ABOVE + _HEIGHT + bottom
    figure.set_figheight(height)
    figure.subplots_adjust(bottom=bottom / height, top=1 - _ABOVE / height)
    notes = ["whiskers: 99.7 % intervals"] * any(look(method).sampled for method in shown_methods)
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
    """Rows whose samples have no failure: only an upper bound is known."""
    return np.asarray((table["failure_low"] == 0) & (table["failure_high"] > 0) & (table["samples"] > 0))


def _dots(axes: Axes, table: Table, rows: Ints, at: Floats, chosen: str, floor: float, entries: Legend) -> None:
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
        entries[words] = axes.errorbar(
            at[failing], value[failing], bars[:, failing], fmt=look(by).marker, markersize=5,
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
