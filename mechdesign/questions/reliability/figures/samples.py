"""Pictures of samples at the pose that fails most: histograms, and how mean and failure settle."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.numerics.arrays import Floats
from mechdesign.questions.reliability.figures.view import ErrorsView
from mechdesign.questions.reliability.tables import Samples
from mechdesign.report.figures import style
from mechdesign.report.figures.looks import Sampled, apart, channels, heading, look, methods
from mechdesign.report.figures.panels import MAX_PANELS, clear_of_ticks, legend_below, number, stack, title
from mechdesign.report.figures.pictures import picture

# A limit farther out than this, in widths of the histogram, is named and not drawn.
_FAR_FROM_HISTOGRAM = 0.6
# Bins of a distance.
_BINS = 60
# More samples than these have a logarithmic axis, as have probabilities whose ratio is larger than this.
_MAX_LINEAR_SAMPLES = 400_000
_MAX_LINEAR_RATIO = 50.0
_DASHED = (0, (5, 2))
_DIGIT = 0.075  # inches, of a number
_TICK = 0.65  # inches from one number along x to the next
_AROUND = 2.8  # inches above and below all panels, with a legend of several rows


class _Histogram(NamedTuple):
    """One panel: bins of all samples and of those that fail, a normal density, and limits."""

    name: str
    unit: str
    edges: Floats
    counts: Floats
    failed: Floats
    normal: Floats | None
    limits: tuple[float, float]


@picture(ErrorsView, "histogram", order=40)
def histogram_figure(view: ErrorsView) -> Figure | None:
    """Each error, the distance from no error where a circle limits it, the limits, and below each its tail."""
    sampled = view.sampled("histogram")
    if sampled is None:
        return None
    shown = _histograms(sampled)
    columns = min(len(shown), 2 if style.narrow() or len(shown) == 4 else 3)
    if style.narrow() and len(shown) < 3:
        columns = 1
    blocks = [shown[k : k + columns] for k in range(0, len(shown), columns)]
    down, rows = 0.5 if len(blocks) == 1 else 0.85 if style.narrow() else 0.68, 2 * len(blocks)
    tall = min(1.75, (style.tallest() - _AROUND + down) / rows - down)
    figure, grid = style.page(
        columns * rows, columns, tall, left=0.8, right=0.15, top=0.95, bottom=0.95, across=0.75, down=down
    )
    entries: dict[str, Any] = {}
    for place, block in enumerate(blocks):
        for column in range(columns):
            pair = [grid[(2 * place + line) * columns + column] for line in (0, 1)]
            if column >= len(block):
                for axis in pair:
                    axis.remove()
                continue
            for axis, logarithmic in zip(pair, (False, True), strict=True):
                _histogram(axis, block[column], entries, logarithmic=logarithmic)
            room = pair[0].get_position().width * style.width()
            pair[0].set_title(style.folded(block[column].name, 9.5, room), loc="left", fontsize=9.5)
            for axis in pair:
                axis.locator_params(axis="x", nbins=max(1, min(4, int(room / _TICK))))
                _spread_ticks(axis, room)
            pair[1].set_xlabel(style.axis_label("error", block[column].unit))
    kept, samples = sampled.samples.kept, sampled.samples.errors.shape[1]
    note = f"{look(sampled.method).words}, {samples:,} samples"
    note += f", {int((~kept).sum()):,} of them fail" if sampled.samples.bands or sampled.samples.discs else ""
    title(
        figure, f"Errors of made mechanisms {sampled.where}", f"{note}; below: the same on a logarithmic axis", left=0.8
    )
    legend_below(figure, list(entries.values()), list(entries))
    return figure


def _spread_ticks(axis: Axes, room: float) -> None:
    """Leave out every second number along x where they have no room (inches of the whole axis)."""
    low, high = axis.get_xlim()
    ticks = np.array([tick for tick in axis.get_xticks() if low <= tick <= high])
    letters = max(map(len, axis.xaxis.get_major_formatter().format_ticks(ticks.tolist())), default=0)
    if len(ticks) > 2 and room * (ticks[1] - ticks[0]) / (high - low) < _DIGIT * letters:
        axis.set_xticks(ticks[::2])


def _histograms(sampled: Sampled) -> list[_Histogram]:
    """Distances that a circle limits, then the errors that vary."""
    samples, table = sampled.samples, sampled.tables["histogram"]
    histograms = []
    for x, y, radius in samples.discs:
        distance = np.hypot(samples.errors[x], samples.errors[y])
        edges = np.linspace(distance.min(), distance.max(), _BINS + 1)
        name = f"{samples.outputs[x].rpartition('.')[0]}: distance from no error"
        histograms.append(_counted(samples, name, x, distance, edges, None, (-np.inf, radius)))
    bands = {channel: (low, high) for channel, low, high in samples.bands}
    for k, (output, order) in enumerate(zip(samples.outputs.tolist(), samples.orders.tolist(), strict=True)):
        rows = table.where(output=output, order=order)
        if rows.any():
            edges, ends = np.append(table["low"][rows], table["high"][rows][-1]), bands.get(k, (-np.inf, np.inf))
            name, normal = heading(output, order), table["normal"][rows]
            histograms.append(_counted(samples, name, k, samples.errors[k], edges, normal, ends))
    return histograms[:MAX_PANELS]


def _counted(
    samples: Samples, name: str, channel: int, values: Floats, edges: Floats, normal: Floats | None,
    limits: tuple[float, float],
) -> _Histogram:  # fmt: skip
    counts, failed = (np.histogram(part, edges)[0] for part in (values, values[~samples.kept]))
    return _Histogram(name, str(samples.units[channel]), edges, counts, failed, normal, limits)


def _histogram(axis: Axes, shown: _Histogram, entries: dict[str, Any], *, logarithmic: bool) -> None:
    edges, unit = shown.edges, shown.unit
    width, middle = np.diff(edges), (edges[1:] + edges[:-1]) / 2
    one = 1.0 / (shown.counts.sum() * width[0])  # density of a single sample
    for words, counts, color in (
        ("made mechanisms", shown.counts, style.SKY), ("of these those that fail", shown.failed, style.VERMILION),
    ):  # fmt: skip
        if counts.any():
            entries[words] = axis.stairs(one * counts, edges, fill=True, color=color)
    top = one * shown.counts.max()
    if shown.normal is not None:
        (entries["normal, same mean and deviation"],) = axis.plot(middle, shown.normal, color=style.BLUE, linewidth=1.8)
        top = max(top, shown.normal.max())
    axis.set_xlim(edges[0], edges[-1])
    far = _limits(axis, shown.limits, entries)
    if logarithmic:
        axis.set_yscale("log")
        axis.set_ylim(0.5 * one, 3.0 * top)
    else:
        axis.set_ylim(0.0, (1.25 if far else 1.08) * top)
        axis.locator_params(axis="y", nbins=5)
        axis.tick_params(labelbottom=False)
    if far and not logarithmic:
        beyond = ", ".join(f"{limit:+g}" for limit in far)
        axis.text(0.99, 0.98, f"limit {beyond} {unit}, outside", transform=axis.transAxes, ha="right", va="top",
                  fontsize=8, color=style.VERMILION)  # fmt: skip
    axis.set_ylabel(style.axis_label("density", f"1/({unit})" if "/" in unit else f"1/{unit}" if unit else ""))


def _limits(axis: Axes, limits: tuple[float, float], entries: dict[str, Any]) -> list[float]:
    """Draw limits that are near and shade what lies beyond them; returns those that are too far to be drawn."""
    low, high = axis.get_xlim()
    span = high - low
    near, far = apart(limits, low - _FAR_FROM_HISTOGRAM * span, high + _FAR_FROM_HISTOGRAM * span)
    ends = [low, high, *(limit + side for limit in near for side in (-0.08 * span, 0.08 * span))]
    axis.set_xlim(min(ends), max(ends))
    for limit in near:
        entries["limit of the error"] = axis.axvline(limit, color=style.VERMILION, linestyle=_DASHED)
        axis.axvspan(limit, max(ends) if limit == limits[1] else min(ends), color=style.VERMILION, alpha=0.1, zorder=0)
    return far


@picture(ErrorsView, "convergence", order=90)
def convergence_figure(view: ErrorsView) -> Figure | None:
    """Mean error of the simulation against the number of samples, within three standard errors of its end [S3, Fig. 4].

    Not the mean itself: beside large dimensions its changes are lost.
    """
    sampled = view.sampled("convergence")
    if sampled is None:
        return None
    table, moments = sampled.tables["convergence"], sampled.tables["moments"]
    shown = channels(table)[:MAX_PANELS]
    figure, axes = stack(len(shown), "Mean error of made mechanisms as samples are added", "samples",
                         note=f"{sampled.where}; {look(sampled.method).words}")  # fmt: skip
    for axis, (output, order, unit) in zip(axes, shown, strict=True):
        rows = table.where(output=output, order=order, unit=unit)
        row = np.flatnonzero(moments.where(output=output, order=order, unit=unit, method=sampled.method))[
            sampled.samples.pose
        ]
        samples, mean = table["samples"][rows], table["mean"][rows] - moments["nominal"][row]
        band = 3.0 * moments["sigma"][row] / np.sqrt(samples)
        final = moments["mean"][row] - moments["nominal"][row]
        axis.fill_between(samples, final - band, final + band, color=style.SKY, alpha=0.3, linewidth=0,
                          label="three standard errors")  # fmt: skip
        axis.plot(samples, mean, color=style.BLUE, marker="." if len(samples) == 1 else "", label="mean")
        axis.axhline(0.0, color=style.INK, linestyle="--", linewidth=1.0, label="no error")
        axis.set_ylabel(style.axis_label(output if order == "position" else f"{output}\n{order}", unit))
    _sample_axis(axes[-1], table["samples"])
    legend_below(figure, *axes[0].get_legend_handles_labels())
    clear_of_ticks(figure, axes)
    return figure


@picture(ErrorsView, "estimate", order=70)
def trend_figure(view: ErrorsView) -> Figure | None:
    """Failure probability against the number of samples with its interval, beside what other methods say."""
    sampled = view.sampled("estimate")
    if sampled is None:
        return None
    table, reliability = sampled.tables["estimate"], sampled.tables["reliability"]
    others = [method for method in methods(reliability) if method != "monte_carlo"]
    figure, (axis,) = stack(1, "Failure probability as samples are added", "samples", note=sampled.where,
                            tall=2.8, bottom=0.65 + 0.1 * (len(others) + 3))  # fmt: skip
    samples, value, low, high = (table[name] for name in ("samples", "failure", "failure_low", "failure_high"))
    late = len(samples) // 20
    ends = [low[late:].min(), value[-1], high[late:].max()]
    lines: list[tuple[float, dict[str, Any]]] = []
    for method in others:
        row = np.flatnonzero(reliability.where(method=method, scope="pose"))[sampled.samples.pose]
        failure = float(reliability["failure"][row])
        if np.isfinite(failure):
            drawn, used = look(method), str(reliability["used"][row])
            words = drawn.words + f" by {look(used).words}" * (used != method)
            dashes = (0, (1, 1)) if drawn.sampled else drawn.dashes
            lines.append((failure, {"color": drawn.color, "ls": dashes, "label": f"{words}: {number(failure)}"}))
            ends.append(failure)
    positive = [end for end in ends if end > 0]
    floor = 0.0
    if positive and max(positive) > _MAX_LINEAR_RATIO * min(positive):
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
    if samples.max() > _MAX_LINEAR_SAMPLES:
        axis.set_xscale("log")
    else:
        axis.xaxis.set_major_formatter("{x:,.0f}")
        axis.set_xlim(0, 1.01 * samples.max())
