"""Joint density of two errors of made mechanisms: regions of given shares beside ellipses [S2]."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from mechdesign.drawing import style
from mechdesign.drawing.looks import heading, look
from mechdesign.drawing.marks import Axis, Dots, Own, Panel, PanelMark, Picture, Trace
from mechdesign.drawing.pictures import picture
from mechdesign.drawing.shapes import lighter
from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.questions.reliability.drawn import Samples
from mechdesign.questions.reliability.figures.view import ErrorsView

# Shares of the made mechanisms that an ellipse or a region holds, with the ellipses' dashes and the regions' tints.
SHARES = (0.5, 0.9, 0.997)
_DASHES: tuple[Any, ...] = ("-", (0, (6, 2)), (0, (1.5, 1.5)))
_TINTS = (0.3, 0.55, 0.78)
# A region is drawn if at least this many samples lie outside it: with fewer its edge is random.
_FEWEST_OUTSIDE = 30
# Of the net that samples are counted on before they are smoothed: half width, in deviations, and cells a side.
_NET_REACH = 5.5
_NET_CELLS = 165
MAX_MARKS = 600
# A limit farther out than this, in reaches of the errors, is named and not drawn.
_FAR_FROM_ERRORS = 5.0
_BEYOND = "#FBEDE4"  # where a limit is broken
Ends = tuple[float, float]


@picture(ErrorsView, "density_contours", order=80)
def density_picture(view: ErrorsView) -> Picture | None:
    """Regions that hold shares of the samples, the ellipses of the first order for the same shares, and the limits."""
    samples = view.sampled("density")
    if samples is None or samples.pair is None:
        return None
    pair = list(samples.pair)
    errors, units, failed = samples.errors[pair], samples.units[pair], ~samples.kept
    ellipses = [_ellipse(samples.mean[pair], samples.covariance[np.ix_(pair, pair)], share) for share in SHARES]
    reach = np.abs(ellipses[-1]).max(axis=1, keepdims=True)
    (outline, limits, far), alike = _limits(samples, reach.ravel()), bool(units[0] == units[1])
    near = np.where(np.abs(outline) < _FAR_FROM_ERRORS * reach, outline, 0.0)
    ends, marks = _ends([*ellipses, errors[:, failed][:, :MAX_MARKS], near]), list[PanelMark]()
    if near.any():
        marks.append(Own(partial(_outlined, outline), label=limits))
    region, method = smoothed(errors), look(view.method).words
    if region is not None:
        colors = [lighter(style.BLUE, tint) for tint in _TINTS[: len(region.levels)]]
        levels = [*region.levels[::-1], 1.01 * region.density.max()]
        marks.append(Own(lambda axes: axes.contourf(
            region.x, region.y, region.density, levels, colors=colors[::-1], zorder=1.5)))  # fmt: skip
        marks += [Own(partial(_patch, color), label=f"{method}: holds {_percent(share)}")
                  for share, color in zip(SHARES, colors, strict=False)]  # fmt: skip
    marks += [Trace(*ellipse, label=f"first order: holds {_percent(share)}",
                    look={"color": style.INK, "linestyle": dashes, "linewidth": 1.2, "zorder": 2.5})
              for share, dashes, ellipse in zip(SHARES, _DASHES, ellipses, strict=True)]  # fmt: skip
    outside = ~failed if region is None else region.outside & ~failed
    shown: dict[str, tuple[Floats, dict[str, Any]]] = {
        "other samples" if region else "samples": (errors[:, outside], {"marker": ".", "ms": 3, "color": style.FAINT}),
        "samples that fail": (errors[:, failed], {"marker": "x", "ms": 4, "color": style.VERMILION, "zorder": 2.7}),
        "no error": (np.zeros((2, 1)), {"marker": "+", "ms": 11, "mew": 1.8, "color": style.INK, "zorder": 3}),
    }
    marks += [
        Dots(*places[:, :MAX_MARKS], label=words, look=own) for words, (places, own) in shown.items() if places.size
    ]
    count = f"{samples.errors.shape[1]:,} samples"
    if limits:
        count += f", {(number := int(failed.sum())):,} of them fail" + f" ({MAX_MARKS} marked)" * (number > MAX_MARKS)
    note = f"{method}: {count}" + (f", smoothed over {region.width:.2f} of their deviation" if region else "")
    note += "; " * bool(far) + far
    x, y = (Axis(f"{heading(samples.outputs[k], samples.orders[k])} error", samples.units[k], ends=end)
            for k, end in zip(pair, ends, strict=True))  # fmt: skip
    panel = Panel(marks, x, y, equal=alike, legend="beside")
    return Picture(f"Two errors of made mechanisms {view.where}", [panel], (note,))


def _ellipse(mean: Floats, covariance: Floats, share: float) -> Floats:
    """Ellipse that holds a share of a bivariate normal law, of radius sqrt(-2 ln(1 - share)), shape (2, points)."""
    values, vectors = np.linalg.eigh(covariance)
    turn = np.linspace(0.0, 2 * np.pi, 181)
    axes = vectors * np.sqrt(np.maximum(values, 0.0) * -2 * np.log1p(-share))
    return np.asarray(mean[:, None] + axes @ np.stack([np.cos(turn), np.sin(turn)]))


class DensityRegion(NamedTuple):
    """A smoothed density on a net of places, its levels that hold `SHARES`, and which samples lie outside all."""

    x: Floats
    y: Floats
    density: Floats
    levels: list[float]
    outside: Flags
    width: float


def smoothed(errors: Floats) -> DensityRegion | None:
    """Density of errors, shape (2, n), by a normal kernel of Scott's width n^(-1/6) deviations; None of too few.

    A level is the density that a share of the samples lies above, at their own places.
    """
    count = errors.shape[1]
    shares = [share for share in SHARES if (1 - share) * count >= _FEWEST_OUTSIDE]
    if not shares:
        return None
    values, vectors = np.linalg.eigh(np.cov(errors))
    if values[0] <= 1e-12 * values[1]:
        return None
    mean, axes = errors.mean(axis=1), vectors * np.sqrt(values)
    own = np.linalg.solve(axes, errors - mean[:, None])
    centres = ((np.arange(_NET_CELLS) + 0.5) / _NET_CELLS * 2 - 1) * _NET_REACH
    width = count ** (-1 / 6)
    kernel = np.exp(-0.5 * (np.subtract.outer(centres, centres) / width) ** 2)
    cells = np.clip((own / _NET_REACH + 1) / 2 * _NET_CELLS, 0, _NET_CELLS - 1).astype(np.intp)
    counts = np.zeros((_NET_CELLS, _NET_CELLS))
    np.add.at(counts, tuple(cells), 1.0)
    density = kernel @ counts @ kernel
    at = density[cells[0], cells[1]]
    levels = [float(level) for level in np.quantile(at, [1 - share for share in shares])]
    net = np.stack(np.meshgrid(centres, centres, indexing="ij"))
    x, y = mean[:, None, None] + np.tensordot(axes, net, axes=1)
    return DensityRegion(x, y, density, levels, at < levels[-1], width)


def _limits(samples: Samples, reach: Floats) -> tuple[Floats, str, str]:
    """Outline within which two errors keep their limits, (2, points), its words, and in words what is far off.

    It is a circle, or a rectangle that leaves the picture where a side is open or far; `reach` are the largest errors.
    """
    assert samples.pair is not None
    if samples.limits and samples.limits[0].round:
        circle = samples.limits[0]
        radius, middle = circle.high, np.array(circle.middle)[:, None]
        words = f"limit: {radius:g} {samples.units[samples.pair[0]]}".rstrip() + f" from {circle.origin}"
        turn = np.linspace(0.0, 2 * np.pi, 181)
        outline = middle + radius * np.stack([np.cos(turn), np.sin(turn)])
        if np.hypot(*outline).min() >= _FAR_FROM_ERRORS * reach.max():
            return np.zeros((2, 0)), words, f"{words}, outside"
        return outline, words, ""
    limits, sides, far = (
        {limit.output: (limit.low, limit.high) for limit in samples.limits},
        list[list[float]](),
        list[str](),
    )
    for channel, size in zip(samples.pair, _FAR_FROM_ERRORS * reach, strict=True):
        ends = limits.get(channel, (-np.inf, np.inf))
        sides.append([end if abs(end) < size else float(10.0 * np.copysign(size, end)) for end in ends])
        far += [f"{end:+g} {samples.units[channel]} of {samples.outputs[channel]}" for end in ends
                if np.isfinite(end) and abs(end) >= size]  # fmt: skip
    (left, right), (low, high) = sides
    outline = np.array([[left, right, right, left, left], [low, low, high, high, low]])
    return outline, "limits" * bool(limits), f"limits outside: {', '.join(far)}" if far else ""


def _outlined(outline: Floats, axes: Axes) -> Patch:
    """Draw the limits as a line, and tint what lies beyond them; returns the line."""
    axes.set_facecolor(_BEYOND)
    axes.fill(*outline, color="white", zorder=0.4)
    (line,) = axes.fill(*outline, fill=False, edgecolor=style.VERMILION, linewidth=1.8, zorder=2.6)
    return line


def _ends(parts: Sequence[Floats]) -> tuple[Ends, Ends]:
    """Ranges of the axes that show places of shape (2, n) and no error."""
    places = np.concatenate([np.zeros((2, 1)), *parts], axis=1)
    low, high = places.min(axis=1), places.max(axis=1)
    middle, span = (low + high) / 2, 1.08 * (high - low)
    (left, bottom), (right, top) = (middle - span / 2).tolist(), (middle + span / 2).tolist()
    return (left, right), (bottom, top)


def _patch(color: Any, _: Axes) -> Patch:
    """What a legend shows of a region."""
    return Patch(color=color)


def _percent(share: float) -> str:
    return f"{100 * share:g} %"
