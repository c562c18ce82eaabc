"""What samples say at the first pose: histograms of errors, and how mean and failure settle as samples are added."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.report.figures import style
from mechdesign.report.figures.panels import MOST_PANELS, legend_below, number, stack, title
from mechdesign.report.figures.reliability.looks import (
    Sampled,
    apart,
    channels,
    error_limits,
    heading,
    look,
    methods,
    select,
)
from mechdesign.results import Table
from mechdesign.study import Study

# A limit farther out than this, in widths of the histogram, is told and not drawn.
_FAR = 0.6
# Above that many samples their axis is logarithmic.
_MANY = 400_000
_DASHED = (0, (5, 2))
# Probabilities farther apart than this are drawn on a logarithmic scale.
_WIDE = 50.0


def histogram_figure(given: Sampled) -> Figure:
    """Each output's error, the normal density with its mean and deviation, and the limits."""
    table = given.tables["histogram"]
    shown = channels(table)[:MOST_PANELS]
    columns = 1 if len(shown) == 1 else 2
    lines = -(-len(shown) // columns)
    figure, grid = style.page(
        len(shown), columns, 2.6 if lines == 1 else 1.9, left=0.75, right=0.15, top=0.95, bottom=0.95, across=0.75,
        down=0.85,
    )  # fmt: skip
    entries: dict[str, Any] = {}
    samples = 0
    for axis, (output, order, unit) in zip(grid, shown, strict=True):
        rows = select(table, output=output, order=order, unit=unit)
        samples = max(samples, int(table["count"][rows].sum()))
        _histogram(axis, table, rows, entries)
        _limits(given.study, axis, output, order, unit, entries)
        axis.set_title(heading(output, order), loc="left", fontsize=9.5)
        axis.set_xlabel(style.axis_label("error", unit))
        axis.set_ylabel(style.axis_label("density", f"1/({unit})" if "/" in unit else f"1/{unit}"))
        axis.locator_params(axis="x", nbins=6)
        axis.locator_params(axis="y", nbins=5)
    note = f"at {given.where}; {look(given.method).words}, {samples:,} samples"
    title(figure, "Errors of made mechanisms", note, left=0.75)
    legend_below(figure, list(entries.values()), list(entries))
    return figure


def _histogram(axis: Axes, table: Table, rows: np.ndarray, entries: dict[str, Any]) -> None:
    low, high, density, normal = (table[name][rows] for name in ("low", "high", "density", "normal"))
    bars = axis.bar(low, density, high - low, align="edge", color=style.SKY, edgecolor="white", linewidth=0.3)
    (fit,) = axis.plot((low + high) / 2, normal, color=style.BLUE, linewidth=1.8)
    axis.set_xlim(low[0], high[-1])
    axis.set_ylim(0.0, 1.08 * max(density.max(), normal.max()))
    entries |= {"made mechanisms": bars, "normal, same mean and deviation": fit}


def _limits(study: Study, axis: Axes, output: str, order: str, unit: str, entries: dict[str, Any]) -> None:
    low, high = axis.get_xlim()
    span = high - low
    near, far = apart(error_limits(study, output, order), low - _FAR * span, high + _FAR * span)
    for limit in near:
        entries["limit of the error"] = axis.axvline(limit, color=style.VERMILION, linestyle=_DASHED)
    ends = [low, high, *(limit + side for limit in near for side in (-0.03 * span, 0.03 * span))]
    axis.set_xlim(min(ends), max(ends))
    if far:
        axis.set_ylim(0.0, 1.15 * axis.get_ylim()[1])
        told = ", ".join(f"{limit:+g}" for limit in far)
        axis.text(0.99, 0.98, f"limit {told} {unit}, outside", transform=axis.transAxes, ha="right", va="top",
                  fontsize=8, color=style.VERMILION)  # fmt: skip


def convergence_figure(given: Sampled) -> Figure:
    """Mean of the simulation against the number of samples, within three standard errors of its end [S3, Fig. 4]."""
    table, moments = given.tables["convergence"], given.tables["moments"]
    shown = channels(table)[:MOST_PANELS]
    figure, axes = stack(len(shown), "Mean of made mechanisms as samples are added", "samples",
                         note=f"at {given.where}; {look(given.method).words}")  # fmt: skip
    for axis, (output, order, unit) in zip(axes, shown, strict=True):
        rows = select(table, output=output, order=order, unit=unit)
        samples, mean = table["samples"][rows], table["mean"][rows]
        row = np.flatnonzero(select(moments, output=output, order=order, unit=unit, method=given.method))[given.pose]
        band = 3.0 * moments["sigma"][row] / np.sqrt(samples)
        final = moments["mean"][row]
        axis.fill_between(samples, final - band, final + band, color=style.SKY, alpha=0.3, linewidth=0,
                          label="three standard errors")  # fmt: skip
        axis.plot(samples, mean, color=style.BLUE, marker="." if len(samples) == 1 else "", label="mean")
        axis.axhline(moments["nominal"][row], color=style.INK, linestyle="--", linewidth=1.0, label="nominal")
        axis.set_ylabel(style.axis_label(output if order == "position" else f"{output}\n{order}", unit))
        axis.ticklabel_format(axis="y", useOffset=False)
    _sample_axis(axes[-1], table["samples"])
    legend_below(figure, *axes[0].get_legend_handles_labels())
    return figure


def trend_figure(given: Sampled) -> Figure:
    """Failure probability against the number of samples with its interval, beside what other methods say."""
    table, reliability = given.tables["estimate"], given.tables["reliability"]
    known = [method for method in methods(reliability) if method != "monte_carlo"]
    figure, (axis,) = stack(1, "Failure probability as samples are added", "samples", note=f"at {given.where}",
                            tall=2.8, bottom=0.65 + 0.1 * (len(known) + 3))  # fmt: skip
    samples, value, low, high = (table[name] for name in ("samples", "failure", "failure_low", "failure_high"))
    late = len(samples) // 20
    ends = [low[late:].min(), value[-1], high[late:].max()]
    lines: list[tuple[float, dict[str, Any]]] = []
    for method in known:
        row = np.flatnonzero(select(reliability, method=method, scope="pose"))[given.pose]
        failure = float(reliability["failure"][row])
        if np.isfinite(failure):
            drawn, used = look(method), str(reliability["used"][row])
            words = drawn.words + f" by {look(used).words}" * (used != method)
            dashes = (0, (1, 1)) if drawn.simulated else drawn.dashes
            lines.append((failure, {"color": drawn.color, "ls": dashes, "label": f"{words}: {number(failure)}"}))
            ends.append(failure)
    positive = [end for end in ends if end > 0]
    floor = 0.0
    if positive and max(positive) > _WIDE * min(positive):
        axis.set_yscale("log")
        floor = 0.3 * min(positive)
        axis.set_ylim(floor, 2.0 * max(ends))
    else:
        margin = 0.06 * (max(ends) - min(ends))
        axis.set_ylim(max(min(ends) - margin, 0.0), max(ends) + margin or 1.0)
    axis.fill_between(samples, np.maximum(low, floor), high, color=style.INK, alpha=0.15, linewidth=0,
                      label="plain samples, 99.7 % interval")  # fmt: skip
    axis.plot(samples, value, color=style.INK, marker="." if len(samples) == 1 else "",
              label=f"plain samples: {number(float(value[-1]))}")  # fmt: skip
    for failure, options in lines:
        axis.axhline(failure, linewidth=1.4, **options)
    axis.set_ylabel("failure probability")
    _sample_axis(axis, samples)
    legend_below(figure, *axis.get_legend_handles_labels())
    return figure


def _sample_axis(axis: Axes, samples: np.ndarray) -> None:
    if samples.max() > _MANY:
        axis.set_xscale("log")
    else:
        axis.xaxis.set_major_formatter("{x:,.0f}")
        axis.set_xlim(0, 1.01 * samples.max())
