"""Names beside the things they name: each where it covers least of the drawing and of the other names."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from numpy.typing import ArrayLike

from mechdesign.numerics.arrays import Complexes, Floats

HALO = [withStroke(linewidth=2.2, foreground="white")]  # keeps names clear of the lines below them
_LETTER = 0.62  # mean width of a letter in font sizes
_DIRECTIONS = 16
_NET = 4.5  # points between two places of what names keep off
_SYMBOL = 36.0  # largest diagonal of a symbol, points: nothing is written into it
_HATCHED = 10.0  # width of a hatched line, points
_CLEARLY = 2.0  # points by which a name must be nearer to what it names than to another
_UNCLEAR = 4.0  # what it costs where it is not
_LEADERLESS = 14.0  # points beyond a name's reach from where a line leads to its place
_LEADER: dict[str, Any] = {"arrowstyle": "-", "linewidth": 0.7, "shrinkA": 0.5}
_PALE = 0.5  # opacity below which a drawing may be written on


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
        In italics, and left out where it would cover something.
    """

    text: str
    anchors: Sequence[complex]
    color: str | tuple[float, float, float]
    reach: float = 7.0
    heading: float | None = None
    size: float = 10.0
    optional: bool = False


def place_labels(axes: Axes, labels: Sequence[Label], obstacles: Floats, order: float) -> None:
    """Write labels, one after another, each at the place that costs least.

    A label that is not nearer to what it names than to another of its kind has a line to it. The axes' limits must be
    final: what overlaps depends on the scale.

    Parameters
    ----------
    obstacles : ndarray, shape (n, 2)
        Points of the drawing that names should not cover, in points on paper (`covered`).
    """
    window = paper(axes, np.array([complex(axes.get_xlim()[0], axes.get_ylim()[0]),
                                   complex(axes.get_xlim()[1], axes.get_ylim()[1])]))  # fmt: skip
    obstacles = obstacles[np.argsort(obstacles[:, 0])]
    named = [paper(axes, np.array(label.anchors)) for label in labels]
    taken, count = np.empty((len(labels), 4)), 0
    for label, own in zip(labels, named, strict=True):
        # Names of one kind could change places.
        alike = [
            there for other, there in zip(labels, named, strict=True) if there is not own and other.size == label.size
        ]
        others = np.concatenate(alike) if alike else np.full((1, 2), np.inf)
        half = np.array([_LETTER * label.size * len(label.text), label.size]) / 2
        offsets, strains = _offsets(label, half)
        # Only what is within reach of some place can be covered.
        reach = np.abs(offsets).max(axis=0) + half + 2
        best: tuple[float, complex, Floats, Floats, bool] | None = None
        for rank, (anchor, origin) in enumerate(zip(label.anchors, own, strict=True)):
            first, last = np.searchsorted(obstacles[:, 0], origin[0] + reach[0] * np.array([-1, 1]))
            near = obstacles[first:last]
            near = near[np.abs(near[:, 1] - origin[1]) <= reach[1]]
            written = taken[:count]
            low, high = origin - reach, origin + reach
            written = written[((written[:, :2] < high) & (written[:, 2:] > low)).all(axis=1)]
            boxes = np.column_stack([origin + offsets - half, origin + offsets + half])
            unclear = _distances(boxes, own) + _CLEARLY > _distances(boxes, others)
            costs = strains + 0.4 * rank + _costs(boxes, near, written, window) + _UNCLEAR * unclear
            k = int(np.argmin(costs))
            if best is None or costs[k] < best[0]:
                best = float(costs[k]), anchor, offsets[k], boxes[k], bool(unclear[k])
        if best is None or (label.optional and best[0] > 5.5):
            continue
        _, anchor, offset, box, unclear_here = best
        taken[count], count = box, count + 1
        # A line ends at what is named: a pin, or the arrow about it.
        leader = None
        if unclear_here or np.hypot(*np.maximum(np.abs(offset) - half, 0.0)) > label.reach + _LEADERLESS:
            leader = _LEADER | {"color": label.color, "shrinkB": max(label.reach - 3.0, 3.0)}
        axes.annotate(
            label.text, (anchor.real, anchor.imag), xytext=tuple(offset), textcoords="offset points", ha="center",
            va="center", arrowprops=leader, color=label.color, fontsize=label.size,
            fontstyle="italic" if label.optional else "normal", zorder=order,
            path_effects=HALO,
        )  # fmt: skip


def _distances(boxes: Floats, places: Floats) -> Floats:
    """From each box (left, low, right, high) to the nearest of some places."""
    x, y = places.T
    left, low, right, high = boxes.T[:, :, None]
    aside = np.maximum(np.maximum(left - x, x - right), 0.0)
    above = np.maximum(np.maximum(low - y, y - high), 0.0)
    return np.asarray(np.hypot(aside, above).min(axis=1))


def paper(axes: Axes, places: Complexes) -> Floats:
    """Places of the drawing in points on paper, shape (n, 2)."""
    return _points(axes, axes.transData.transform(np.column_stack([places.real, places.imag])))


def _points(axes: Axes, pixels: ArrayLike) -> Floats:
    figure = axes.get_figure(root=True)
    assert figure is not None
    return np.asarray(pixels, dtype=float) * 72 / figure.dpi


def covered(axes: Axes) -> Floats:
    """Points on paper, shape (n, 2), in a net, that lines and symbols cover; what is pale may be written on."""
    found = [np.empty(0, dtype=complex)]
    filled = {patch for patch in axes.patches if to_rgba(patch.get_facecolor())[3]}
    lines: list[Line2D | Patch] = [*axes.lines, *axes.patches]
    for artist in lines:
        # The strokes of a hatched line stand beside it.
        width = _HATCHED if artist.get_path_effects() else artist.get_linewidth()
        if not width or (artist.get_alpha() or 1.0) < _PALE:
            continue
        path, moved = artist.get_path(), artist.get_transform()
        dots = isinstance(artist, Line2D) and artist.get_linestyle() == "None"
        pieces = moved.transform(path.vertices)[:, None] if dots else path.to_polygons(moved, closed_only=False)
        for piece in filter(lambda piece: np.isfinite(piece).all(), pieces):
            z = _points(axes, piece) @ np.array([1, 1j])
            low, high = complex(z.real.min(), z.imag.min()), complex(z.real.max(), z.imag.max())
            if artist in filled and abs(high - low) < _SYMBOL:
                x, y = (np.arange(a, b + _NET, _NET) for a, b in ((low.real, high.real), (low.imag, high.imag)))
                found.append(np.add.outer(x, 1j * y).ravel())
                continue
            ends = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(z)))])
            line = np.interp(np.linspace(0.0, ends[-1], 2 + int(ends[-1] / _NET)), ends, z)
            along = np.gradient(line)
            across = 0.5j * width * along / np.maximum(np.abs(along), 1e-9)
            found += [line - across, line, line + across]
    every = np.concatenate(found)
    return np.unique(np.round(np.column_stack([every.real, every.imag]) / _NET), axis=0) * _NET


def _offsets(label: Label, half: Floats) -> tuple[Floats, Floats]:
    """Where the middle of the text may stand from its anchor (points), shape (n, 2), and how much each displeases."""
    places, strains = [], []
    preferred = math.pi / 4 if label.heading is None else label.heading
    for stretch, strain in ((1.0, 0.0), (1.8, 0.6), (2.8, 1.4), (4.5, 3.0)):
        for k in range(_DIRECTIONS):
            angle = preferred + math.tau * k / _DIRECTIONS
            toward = cmath.exp(1j * angle)
            turned = min(k, _DIRECTIONS - k) / _DIRECTIONS
            place = label.reach * stretch * np.array([toward.real, toward.imag])
            # The text's nearest edge, not its middle, keeps the distance.
            place += half * np.clip(1.3 * np.array([toward.real, toward.imag]), -1, 1)
            places.append(place)
            strains.append(strain + turned * (0.5 if label.heading is None else 2.0))
    return np.array(places), np.array(strains)


def _costs(boxes: Floats, obstacles: Floats, taken: Floats, window: Floats) -> Floats:
    """What each of some boxes (left, low, right, high; a row each) would cover, and how far it leaves the window."""
    left, low, right, high = boxes.T[:, :, None]
    x, y = obstacles.T
    inside = (x > left - 1) & (x < right + 1) & (y > low - 1) & (y < high + 1)
    wide = np.minimum(right, taken[:, 2]) - np.maximum(left, taken[:, 0]) + 2
    tall = np.minimum(high, taken[:, 3]) - np.maximum(low, taken[:, 1]) + 1
    over = np.where((wide > 0) & (tall > 0), 20 + wide * tall, 0.0)
    (x0, y0), (x1, y1) = window
    outside = (left < x0) | (right > x1) | (low < y0) | (high > y1)
    found: Floats = 0.8 * inside.sum(axis=1) + over.sum(axis=1) + 40 * outside[:, 0]
    return found
