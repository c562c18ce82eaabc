"""Names beside the things they name: each where it covers least of the drawing and of the other names."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

_LETTER = 0.62  # mean width of a letter in font sizes
_DIRECTIONS = 16


@dataclass(frozen=True)
class Label:
    """A name and where it may stand.

    Parameters
    ----------
    anchors : sequence of complex
        Places in the drawing's lengths, the best first.
    reach : float
        Distance from the anchor to the nearest edge of the text, points.
    heading : float or None
        Preferred direction from the anchor, radians.
    optional : bool
        Left out where it would cover something.
    """

    text: str
    anchors: Sequence[complex]
    color: str | tuple[float, float, float]
    reach: float = 7.0
    heading: float | None = None
    size: float = 10.0
    italic: bool = False
    optional: bool = False


def place_labels(axes: Axes, labels: Sequence[Label], obstacles: NDArray[np.float64], order: float) -> None:
    """Write labels, one after another, each at the place that costs least.

    The axes' limits must be final: what overlaps depends on the scale.

    Parameters
    ----------
    obstacles : ndarray, shape (n, 2)
        Points of the drawing that names should not cover, in points on paper (`paper`).
    """
    window = paper(axes, np.array([complex(axes.get_xlim()[0], axes.get_ylim()[0]),
                                   complex(axes.get_xlim()[1], axes.get_ylim()[1])]))  # fmt: skip
    taken: list[tuple[float, float, float, float]] = []
    for label in labels:
        half = np.array([_LETTER * label.size * len(label.text), 0.85 * label.size]) / 2
        best: tuple[float, complex, NDArray[np.float64]] | None = None
        for rank, anchor in enumerate(label.anchors):
            origin = paper(axes, np.array([anchor]))[0]
            places = _offsets(label, half)
            # Only what is within reach of some place can be covered.
            reach = np.max([np.abs(offset) for offset, _ in places], axis=0) + half + 1
            near = obstacles[(np.abs(obstacles - origin) <= reach).all(axis=1)]
            for offset, strain in places:
                box = (*(origin + offset - half), *(origin + offset + half))
                cost = strain + 0.4 * rank + _cost(box, near, taken, window)
                if best is None or cost < best[0]:
                    best = cost, anchor, offset
        if best is None or (label.optional and best[0] > 4.0):
            continue
        _, anchor, offset = best
        origin = paper(axes, np.array([anchor]))[0]
        taken.append((*(origin + offset - half), *(origin + offset + half)))
        axes.annotate(
            label.text, (anchor.real, anchor.imag), xytext=tuple(offset), textcoords="offset points", ha="center",
            va="center", color=label.color, fontsize=label.size, fontstyle="italic" if label.italic else "normal",
            zorder=order, path_effects=[withStroke(linewidth=2.2, foreground="white")],
        )  # fmt: skip


def paper(axes: Axes, places: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Places of the drawing in points on paper, shape (n, 2)."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    pixels = axes.transData.transform(np.column_stack([places.real, places.imag]))
    return np.asarray(pixels, dtype=float) * 72 / figure.dpi


def _offsets(label: Label, half: NDArray[np.float64]) -> list[tuple[NDArray[np.float64], float]]:
    """Where the middle of the text may stand from its anchor (points), and how much each displeases."""
    found = []
    preferred = math.pi / 4 if label.heading is None else label.heading
    for stretch, strain in ((1.0, 0.0), (1.8, 0.6), (2.8, 1.4)):
        for k in range(_DIRECTIONS):
            angle = preferred + math.tau * k / _DIRECTIONS
            toward = cmath.exp(1j * angle)
            turned = min(k, _DIRECTIONS - k) / _DIRECTIONS
            place = label.reach * stretch * np.array([toward.real, toward.imag])
            # The text's nearest edge, not its middle, keeps the distance.
            place += half * np.clip(1.3 * np.array([toward.real, toward.imag]), -1, 1)
            found.append((place, strain + turned * (0.5 if label.heading is None else 2.0)))
    return found


def _cost(
    box: tuple[float, ...],
    obstacles: NDArray[np.float64],
    taken: Sequence[tuple[float, float, float, float]],
    window: NDArray[np.float64],
) -> float:
    left, low, right, high = box
    inside = (
        (obstacles[:, 0] > left - 1) & (obstacles[:, 0] < right + 1)
        & (obstacles[:, 1] > low - 1) & (obstacles[:, 1] < high + 1)
    )  # fmt: skip
    cost = 0.8 * float(np.count_nonzero(inside))
    for other in taken:
        wide = min(right, other[2]) - max(left, other[0]) + 2
        tall = min(high, other[3]) - max(low, other[1]) + 1
        if wide > 0 and tall > 0:
            cost += 20 + wide * tall
    (x0, y0), (x1, y1) = window
    if left < x0 or right > x1 or low < y0 or high > y1:
        cost += 40
    return cost
