"""Errors over a sweep: bands of three standard deviations, means, deviations, and where methods differ [S3]."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mechdesign.report.figures import style
from mechdesign.report.figures.panels import BARE, MOST_PANELS, WITH_LEGEND, Along, legend_below, stack, tick_abscissa
from mechdesign.report.figures.reliability.looks import LOOKS, best_moments, channels, error_limits, methods, select
from mechdesign.results import Table
from mechdesign.study import Study

MOST_OUTPUTS = 7
# A limit so many times as far out as all errors is told and not drawn.
_FAR = 3.0


def sweep_figures(study: Study, moments: Table, swept: Along) -> dict[str, Figure]:
    """Bands of the errors, means, standard deviations and the methods' difference over the sweep [S3, Figs. 5 to 7]."""
    found = {"bands": _bands(study, moments, swept)}
    for name, column, what in (("means", "mean", "mean"), ("deviations", "sigma", "standard deviation")):
        found[name] = _curves(moments, swept, column, f"{what} of made mechanisms".capitalize())
    reference, computed = best_moments(moments), [m for m in methods(moments) if not LOOKS[m].simulated]
    if LOOKS[reference].simulated and computed:
        found["difference"] = _difference(moments, swept, reference, computed)
    return found


def _bands(study: Study, moments: Table, swept: Along) -> Figure:
    """Mean error and three standard deviations to both sides: computed ones as a band, simulated ones as dots."""
    shown = channels(moments)[:MOST_PANELS]
    known = methods(moments)
    figure, axes = stack(len(shown), "Errors of made mechanisms: mean \N{PLUS-MINUS SIGN} 3 standard deviations",
                         swept.label)  # fmt: skip
    tick_abscissa(axes[-1], swept)
    entries: dict[str, Any] = {}
    filled = next((method for method in known if not LOOKS[method].simulated), None)
    for axis, (output, order, unit) in zip(axes, shown, strict=True):
        axis.axhline(0.0, color=style.FAINT, linewidth=0.8)
        for method in known:
            look, rows = LOOKS[method], select(moments, output=output, order=order, method=method)
            mean = moments["mean"][rows] - moments["nominal"][rows]
            reach = 3.0 * moments["sigma"][rows]
            if method == filled:
                band = axis.fill_between(swept.values, mean - reach, mean + reach, color=look.color, alpha=0.22,
                                         linewidth=0)  # fmt: skip
                axis.plot(swept.values, mean, color=look.color, linewidth=1.2)
                entries[look.words] = band
                continue
            drawn = look.dashes or "None"
            for value in (mean - reach, mean, mean + reach):
                (line,) = axis.plot(swept.values, value, linestyle=drawn, color=look.color, linewidth=1.2,
                                    marker=look.marker if look.simulated else "", markersize=2.8)  # fmt: skip
            entries[look.words] = line
        limits = [limit for limit in error_limits(study, output, order) or () if np.isfinite(limit)]
        far = [limit for limit in limits if abs(limit) > _FAR * np.abs(axis.get_ylim()).max()]
        for limit in limits:
            if limit not in far:
                line = axis.axhline(limit, color=style.VERMILION, linestyle=(0, (5, 2)), linewidth=1.4)
                entries["limit of the error"] = line
        if far:
            told = f"limit {', '.join(f'{limit:+g}' for limit in far)} {unit}, outside"
            axis.set_title(told, loc="right", fontsize=8, color=style.VERMILION)
        axis.set_ylabel(style.axis_label("error", unit))
        axis.set_title(output if order == "position" else f"{output} {order}", loc="left", fontsize=9.5)
    legend_below(figure, list(entries.values()), list(entries))
    return figure


def _curves(moments: Table, swept: Along, column: str, heading: str) -> Figure:
    """A panel for each order and unit; outputs by colour, methods by dashes or dots."""
    panels, known = _grouped(moments), methods(moments)
    figure, axes = stack(len(panels), heading, swept.label)
    tick_abscissa(axes[-1], swept)
    single = all(len(outputs) == 1 for _, _, outputs in panels)
    for axis, (order, unit, outputs) in zip(axes, panels, strict=True):
        for output, color in zip(outputs, style.PALETTE, strict=False):
            for method in known:
                look, rows = LOOKS[method], select(moments, output=output, order=order, unit=unit, method=method)
                axis.plot(swept.values, moments[column][rows], color=look.color if single else color,
                          linestyle=look.dashes or "None", marker=look.marker if look.simulated else "",
                          markersize=3.2)  # fmt: skip
        _name_outputs(axis, outputs, [style.INK] if single else style.PALETTE)
        axis.set_ylabel(style.axis_label(order, unit))
        if column == "sigma":
            axis.set_ylim(0.0, 1.1 * axis.get_ylim()[1])
    handles = [
        Line2D([], [], color=LOOKS[m].color if single else style.INK, linestyle=LOOKS[m].dashes or "None",
               marker=LOOKS[m].marker if LOOKS[m].simulated else "", markersize=4) for m in known
    ]  # fmt: skip
    legend_below(figure, handles, [LOOKS[method].words for method in known])
    return figure


def _difference(moments: Table, swept: Along, reference: str, computed: Sequence[str]) -> Figure:
    """Standard deviations of the computed methods, in per cent of the simulated ones, and how far apart on average."""
    panels = _grouped(moments)
    figure, axes = stack(
        len(panels), f"Standard deviation less that of {LOOKS[reference].words}, in per cent of it", swept.label,
        note="in brackets: how far apart on average", bottom=WITH_LEGEND if len(computed) > 1 else BARE,
    )  # fmt: skip
    tick_abscissa(axes[-1], swept)
    for axis, (order, unit, outputs) in zip(axes, panels, strict=True):
        axis.axhline(0.0, color=style.FAINT, linewidth=0.8)
        named = []
        for output, color in zip(outputs, style.PALETTE, strict=False):
            true = moments["sigma"][select(moments, output=output, order=order, unit=unit, method=reference)]
            apart = []
            for method in computed:
                rows = select(moments, output=output, order=order, unit=unit, method=method)
                with np.errstate(invalid="ignore", divide="ignore"):
                    percent = 100.0 * (moments["sigma"][rows] / true - 1.0)
                mean = np.nanmean(np.abs(percent)) if np.isfinite(percent).any() else np.nan
                apart.append(f"{mean:.2f} %")
                axis.plot(swept.values, percent, LOOKS[method].dashes, marker=".", markersize=4, linewidth=1.2,
                          color=color)  # fmt: skip
            named.append(f"{output} ({', '.join(apart)})")
        axis.set_ylabel(f"{order} [%]")
        _name_outputs(axis, named, style.PALETTE)
    if len(computed) > 1:
        handles = [Line2D([], [], color=style.INK, linestyle=LOOKS[m].dashes, marker=".") for m in computed]
        legend_below(figure, handles, [LOOKS[method].words for method in computed])
    return figure


def _name_outputs(axis: Axes, outputs: Sequence[str], colors: Sequence[str]) -> None:
    """The outputs above a panel, each in its colour."""
    if len(outputs) == 1:
        axis.set_title(outputs[0], loc="left", fontsize=9.5)
        return
    handles = [Line2D([], [], color=color) for color, _ in zip(colors, outputs, strict=False)]
    axis.legend(handles, outputs, loc="lower left", bbox_to_anchor=(-0.01, 0.98), ncols=len(outputs), borderaxespad=0.0,
                handlelength=1.2, columnspacing=1.2)  # fmt: skip


def _grouped(table: Table) -> list[tuple[str, str, list[str]]]:
    """Order, unit and outputs of each panel: outputs that share an order and a unit."""
    panels: dict[tuple[str, str], list[str]] = {}
    for output, order, unit in channels(table):
        panels.setdefault((order, unit), []).append(output)
    return [(*key, outputs[:MOST_OUTPUTS]) for key, outputs in list(panels.items())[:MOST_PANELS]]
