"""Pictures of samples at the pose that fails most: histograms, and how mean and failure settle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.layout import fitting_panels
from mechdesign.drawing.looks import apart, channels, heading, look, methods
from mechdesign.drawing.marks import Area, Axis, Lines, Panel, PanelMark, Picture, Steps, Trace, Zone
from mechdesign.drawing.panels import MAX_PANELS, number
from mechdesign.drawing.pictures import picture
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.results import Table
from mechdesign.questions.reliability.drawn import Samples
from mechdesign.questions.reliability.figures.view import ErrorsView

# A limit farther out than this, in widths of the histogram, is named and not drawn.
_FAR_FROM_HISTOGRAM = 0.6
# Bins of a distance.
_BINS = 60
# More samples than these have a logarithmic axis, as have probabilities whose ratio is larger than this.
_MAX_LINEAR_SAMPLES = 400_000
_MAX_LINEAR_RATIO = 50.0


@picture(ErrorsView, "histogram", order=40)
def histogram_picture(view: ErrorsView) -> Picture | None:
    """Each error, the distance from no error where a circle limits it, the limits, and below each its tail."""
    samples = view.sampled("histogram")
    if samples is None:
        return None
    shown = _histograms(samples, view.result.tables["histogram"])[:MAX_PANELS]
    columns = min(len(shown), 2 if len(shown) == 4 else 3, fitting_panels())
    panels: list[Panel | None] = []
    for k in range(0, len(shown), columns):
        for row in zip(*shown[k : k + columns], strict=True):
            panels += [*row, *[None] * (columns - len(row))]
    note = f"{look(view.method).words}, {samples.errors.shape[1]:,} samples"
    note += f", {int((~samples.kept).sum()):,} of them fail" if samples.limits else ""
    return Picture(f"Errors of made mechanisms {view.where}", panels,
                   (f"{note}; below: the same on a logarithmic axis",), columns)  # fmt: skip


def _histograms(samples: Samples, table: Table) -> list[tuple[Panel, Panel]]:
    """Distances that a circle limits, then the errors that vary."""
    panels, ends = [], {limit.output: (limit.low, limit.high) for limit in samples.limits if not limit.round}
    for limit in samples.limits:
        if limit.round:
            distance = limit.distance(samples.errors)
            edges = np.linspace(distance.min(), distance.max(), _BINS + 1)
            name = f"{samples.outputs[limit.output].rpartition('.')[0]}: distance from {limit.origin}"
            panels.append(_panels(samples, limit.output, name, distance, edges, None, (limit.low, limit.high)))
    for k, (output, order) in enumerate(zip(samples.outputs.tolist(), samples.orders.tolist(), strict=True)):
        rows = table.where(output=output, order=order)
        if rows.any():
            edges, normal = np.append(table["low"][rows], table["high"][rows][-1]), table["normal"][rows]
            own, name = ends.get(k, (-np.inf, np.inf)), heading(output, order)
            panels.append(_panels(samples, k, name, samples.errors[k], edges, normal, own))
    return panels


def _panels(
    samples: Samples, channel: int, name: str, values: Floats, edges: Floats, normal: Floats | None,
    limits: tuple[float, float],
) -> tuple[Panel, Panel]:  # fmt: skip
    """All samples, those that fail, a normal density and the limits that are near; below on a logarithmic axis."""
    every, failed = (np.histogram(part, edges)[0] for part in (values, values[~samples.kept]))
    unit, one = str(samples.units[channel]), 1.0 / (every.sum() * (edges[1] - edges[0]))  # density of a single sample
    marks: list[PanelMark] = [
        Steps(one * counts, edges, label=words, look={"color": color})
        for words, counts, color in (("made mechanisms", every, style.SKY),
                                     ("of these those that fail", failed, style.VERMILION))
        if counts.any()
    ]  # fmt: skip
    top = one * float(every.max())
    if normal is not None:
        marks.append(Trace((edges[1:] + edges[:-1]) / 2, normal, label="normal, same mean and deviation",
                           look={"color": style.BLUE, "linewidth": 1.8}))  # fmt: skip
        top = max(top, float(normal.max()))
    span = edges[-1] - edges[0]
    near, far = apart(limits, edges[0] - _FAR_FROM_HISTOGRAM * span, edges[-1] + _FAR_FROM_HISTOGRAM * span)
    sides = [edges[0], edges[-1], *(limit + side for limit in near for side in (-0.08 * span, 0.08 * span))]
    ends, red = (float(min(sides)), float(max(sides))), {"color": style.VERMILION}
    marks.append(Lines(near, "x", label="limit of the error", look=red | {"linestyle": (0, (5, 2))}))
    beyond = red | {"alpha": 0.1, "zorder": 0}
    marks += [Zone(limit, ends[bool(limit == limits[1])], "x", look=beyond) for limit in near]
    density = f"1/({unit})" if "/" in unit else f"1/{unit}" if unit else ""
    aside = f"limit {', '.join(f'{limit:+g}' for limit in far)} {unit}, outside" if far else ""
    plain = Axis("density", density, ends=(0.0, 1.08 * top))
    logarithmic = Axis("density", density, "log", (0.5 * one, 3.0 * top))
    return (
        Panel(marks, Axis(ends=ends, numbers=False), plain, name, aside),
        Panel(marks, Axis("error", unit, ends=ends), logarithmic),
    )


@picture(ErrorsView, "convergence", order=90)
def convergence_picture(view: ErrorsView) -> Picture | None:
    """Mean error of the simulation against the number of samples, within three standard errors of its end [S3, Fig. 4].

    Not the mean itself: beside large dimensions its changes are lost.
    """
    samples = view.sampled("convergence")
    if samples is None:
        return None
    table, moments, panels = view.result.tables["convergence"], view.result.tables["moments"], []
    for output, order, unit in channels(table)[:MAX_PANELS]:
        rows = table.where(output=output, order=order, unit=unit)
        same = moments.where(output=output, order=order, unit=unit, method=view.method)
        row = np.flatnonzero(same)[samples.pose]
        count, mean = table["samples"][rows], table["mean"][rows] - moments["nominal"][row]
        band = 3.0 * moments["sigma"][row] / np.sqrt(count)
        final = moments["mean"][row] - moments["nominal"][row]
        marks = [
            Area(count, final - band, final + band, label="three standard errors",
                 look={"color": style.SKY, "alpha": 0.3}),
            Trace(count, mean, label="mean", look={"color": style.BLUE, "marker": "." if len(count) == 1 else ""}),
            Lines([0.0], label="no error", look={"color": style.INK, "linestyle": "--", "linewidth": 1.0}),
        ]  # fmt: skip
        name = output if order == "position" else f"{output} {order}"
        panels.append(Panel(marks, _sample_axis(table["samples"]), Axis(name, unit)))
    note = f"{view.where}; {look(view.method).words}"
    return Picture("Mean error of made mechanisms as samples are added", panels, (note,), share="x")


@picture(ErrorsView, "estimate", order=70)
def trend_picture(view: ErrorsView) -> Picture | None:
    """Failure probability against the number of samples with its interval, beside what other methods say."""
    shown = view.sampled("estimate")
    if shown is None:
        return None
    table, reliability = view.result.tables["estimate"], view.result.tables["reliability"]
    samples, value, low, high = (table[name] for name in ("samples", "failure", "failure_low", "failure_high"))
    late = len(samples) // 20
    ends, lines = [low[late:].min(), value[-1], high[late:].max()], list[PanelMark]()
    for method in (method for method in methods(reliability) if method != "monte_carlo"):
        row = np.flatnonzero(reliability.where(method=method, scope="pose"))[shown.pose]
        failure = float(reliability["failure"][row])
        if np.isfinite(failure):
            drawn, used = look(method), str(reliability["used"][row])
            words = f"{drawn.words}{f' by {look(used).words}' * (used != method)}: {number(failure)}"
            own = {"color": drawn.color, "linestyle": (0, (1, 1)) if drawn.sampled else drawn.dashes, "linewidth": 1.4}
            lines.append(Lines([failure], label=words, look=own))
            ends.append(failure)
    positive, margin = [end for end in ends if end > 0], 0.06 * (max(ends) - min(ends))
    axis = Axis("failure probability", ends=(max(min(ends) - margin, 0.0), max(ends) + margin or 1.0))
    if positive and max(positive) > _MAX_LINEAR_RATIO * min(positive):
        axis = replace(axis, scale="log", ends=(0.3 * min(positive), 2.0 * max(ends)))
    floor = 0.3 * min(positive) if axis.scale == "log" else 0.0
    plain = {"color": style.INK, "marker": "." if len(samples) == 1 else ""}
    marks = [
        Area(samples, np.maximum(low, floor), high, label="plain samples, 99.7 % interval",
             look={"color": style.INK, "alpha": 0.15}),
        Trace(samples, value, label=f"plain samples: {number(float(value[-1]))}", look=plain),
    ]  # fmt: skip
    return Picture("Failure probability as samples are added", [Panel([*marks, *lines], _sample_axis(samples), axis)],
                   (view.where,))  # fmt: skip


def _sample_axis(samples: np.ndarray) -> Axis:
    if samples.max() > _MAX_LINEAR_SAMPLES:
        return Axis("samples", scale="log")
    return Axis("samples", ends=(0.0, 1.01 * float(samples.max())))
