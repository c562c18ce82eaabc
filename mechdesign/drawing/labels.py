"""Placement of names: each where it covers least of the drawing and of other names."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from numpy.typing import ArrayLike

from mechdesign.drawing import style
from mechdesign.ground.numerics.arrays import Complexes, Floats

HALO = [withStroke(linewidth=2.2, foreground="white")]  # keeps names clear of the lines below them
_DIRECTIONS = 16
_NET = 4.5  # spacing (points) of the net on what names must not cover
_SYMBOL = 36.0  # largest diagonal of a symbol, points: nothing is written into it
_CLEARLY = 2.0  # points by which a name must be nearer to what it names than to another
_UNCLEAR = 4.0  # cost of a name that is not
_OVER = 60.0  # cost of a name over another or beyond the paper
# Distances from what is named, in reaches, and how much they displease; those of names that find no room near.
_NEAR = ((1.0, 0.0), (1.8, 0.6), (2.8, 1.4), (4.5, 3.0))
_FAR = (*_NEAR, (7.0, 5.0), (10.0, 8.0))
_NO_ROOM = 5.5  # cost from which an optional name is left out
_LEADERLESS = 14.0  # points beyond its reach from which a name has a leader
_LEADER: dict[str, Any] = {"arrowstyle": "-", "linewidth": 0.7, "shrinkA": 0.5}
MOST_LETTERS, _FEWEST_LETTERS = 24, 12  # of a name in a drawing
_WIDEST = 0.08  # of such letters a point of the width of a panel
_CROWDED, _SMALLER = 0.15, 0.8  # part of the paper that names take from which on they are smaller, and by how much
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

    @property
    def half(self) -> Floats:
        """Half the width and height of the text (points)."""
        return np.array([style.length(self.text, self.size), self.size]) / 2


@dataclass(frozen=True)
class Position:
    """Where a label stands: by which of its anchors, its middle from there (points), and whether a line leads to it."""

    anchor: int
    offset: Floats
    leader: bool


def positions(
    labels: Sequence[Label], anchors: Sequence[Sequence[Floats]], nets: Sequence[Floats], window: Floats
) -> list[Position | None]:
    """Where labels stand, one after another, each at the place that costs least on average over some poses.

    A label that is not nearer to what it names than to another of its kind has a line to it. None is an optional label
    that finds no room near, and in a single pose one that would lie over another or beyond the paper.

    Parameters
    ----------
    anchors : sequence of sequences of ndarray, shape (n, 2)
        Of each pose the anchors of each label on paper.
    nets : sequence of ndarray, shape (n, 2)
        Of each pose the places on paper that names should not cover (`net`).
    window : ndarray, shape (2, 2)
        Lower left and upper right corner of the paper.
    """
    poses, count = len(nets), 0
    taken = np.empty((poses, len(labels), 4))
    chosen: list[Position | None] = []
    for which, label in enumerate(labels):
        # Names of one kind could be mistaken for each other.
        alike = [k for k, other in enumerate(labels) if k != which and other.size == label.size]
        half = label.half
        for stretches in (_NEAR, _FAR):
            offsets, strains = _offsets(label, half, stretches)
            # Only what is within reach of some place can be covered.
            reach = np.abs(offsets).max(axis=0) + half + 2
            candidates = []
            for rank in range(len(label.anchors)):
                costs, unclear = strains + 0.4 * rank, np.zeros(len(offsets))
                for named, net, boxes_taken in zip(anchors, nets, taken, strict=True):
                    origin = named[which][rank]
                    near = net[(np.abs(net - origin) <= reach).all(axis=1)]
                    written = boxes_taken[:count]
                    low, high = origin - reach, origin + reach
                    written = written[((written[:, :2] < high) & (written[:, 2:] > low)).all(axis=1)]
                    boxes = np.column_stack([origin + offsets - half, origin + offsets + half])
                    others = np.concatenate([named[k] for k in alike]) if alike else np.full((1, 2), np.inf)
                    doubtful = _distances(boxes, named[which]) + _CLEARLY > _distances(boxes, others)
                    costs = costs + _costs(boxes, near, written, window) / poses + _UNCLEAR * doubtful / poses
                    unclear += doubtful / poses
                k = int(np.argmin(costs))
                candidates.append((float(costs[k]), rank, offsets[k], unclear[k] > 0.5))
            cost, rank, offset, doubt = min(candidates, key=lambda candidate: candidate[0])
            if cost < _OVER or label.optional or poses > 1:
                break
        if cost >= (_NO_ROOM if label.optional else _OVER) and (label.optional or poses == 1):
            chosen.append(None)
            continue
        far = np.hypot(*np.maximum(np.abs(offset) - half, 0.0)) > label.reach + _LEADERLESS
        chosen.append(Position(rank, offset, bool(far or doubt)))
        middles = np.array([named[which][rank] for named in anchors]) + offset
        taken[:, count], count = np.column_stack([middles - half, middles + half]), count + 1
    return chosen


def place_labels(axes: Axes, labels: Sequence[Label], obstacles: Floats, order: float) -> None:
    """Write labels, one after another, each at the place that costs least (`positions`).

    The axes' limits must be final: what overlaps depends on the scale.

    Parameters
    ----------
    obstacles : ndarray, shape (n, 2)
        Points of the drawing that names should not cover, in points on paper (`covered`).
    """
    window = paper(axes, np.array([complex(axes.get_xlim()[0], axes.get_ylim()[0]),
                                   complex(axes.get_xlim()[1], axes.get_ylim()[1])]))  # fmt: skip
    most = int(min(MOST_LETTERS, max(_FEWEST_LETTERS, _WIDEST * (window[1] - window[0])[0])))
    labels = [replace(label, text=style.shortened(label.text, most)) for label in labels]
    if sum(4 * np.prod(label.half) for label in labels) > _CROWDED * np.prod(window[1] - window[0]):
        labels = [replace(label, size=_SMALLER * label.size) for label in labels]
    labels = [replace(label, size=max(label.size, style.small())) for label in labels]
    anchors = [paper(axes, np.array(label.anchors)) for label in labels]
    for label, position in zip(labels, positions(labels, [anchors], [obstacles], window), strict=True):
        if position is None:
            continue
        anchor = label.anchors[position.anchor]
        # A line ends at what is named: a pin, or the arrow about it.
        leader = _LEADER | {"color": label.color, "shrinkB": max(label.reach - 3.0, 3.0)} if position.leader else None
        axes.annotate(
            label.text, (anchor.real, anchor.imag), xytext=tuple(position.offset), textcoords="offset points",
            ha="center", va="center", arrowprops=leader, color=label.color, fontsize=label.size,
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
    return _points(axes, axes.transData.transform(rows(places)))


def rows(places: Complexes) -> Floats:
    """Places as rows of x and y."""
    return np.column_stack([places.real, places.imag])


def _points(axes: Axes, pixels: ArrayLike) -> Floats:
    figure = axes.get_figure(root=True)
    assert figure is not None
    return np.asarray(pixels, dtype=float) * 72 / figure.dpi


def covered(axes: Axes) -> Floats:
    """Points on paper, shape (n, 2), in a net, that lines and symbols cover; what is pale may be written on."""
    lines: list[tuple[Complexes, float, bool]] = []
    artists: list[Line2D | Patch] = [*axes.lines, *axes.patches]
    for artist in artists:
        width = artist.get_linewidth()
        if not width or (artist.get_alpha() or 1.0) < _PALE:
            continue
        filled = isinstance(artist, Patch) and bool(to_rgba(artist.get_facecolor())[3])
        path, moved = artist.get_path(), artist.get_transform()
        dots = isinstance(artist, Line2D) and artist.get_linestyle() == "None"
        pieces = moved.transform(path.vertices)[:, None] if dots else path.to_polygons(moved, closed_only=False)
        lines += [(_points(axes, piece) @ np.array([1, 1j]), width, filled) for piece in pieces]
    return net(lines)


def net(lines: Iterable[tuple[Complexes, float, bool]]) -> Floats:
    """Points in a net, shape (n, 2), that lines on paper cover, each with its width (points); small areas entirely."""
    places = [np.empty(0, dtype=complex)]
    for z, width, filled in lines:
        if not np.isfinite(z).all():
            continue
        low, high = complex(z.real.min(), z.imag.min()), complex(z.real.max(), z.imag.max())
        if filled and abs(high - low) < _SYMBOL:
            x, y = (np.arange(a, b + _NET, _NET) for a, b in ((low.real, high.real), (low.imag, high.imag)))
            places.append(np.add.outer(x, 1j * y).ravel())
            continue
        ends = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(z)))])
        line = np.interp(np.linspace(0.0, ends[-1], 2 + int(ends[-1] / _NET)), ends, z)
        along = np.gradient(line)
        across = 0.5j * width * along / np.maximum(np.abs(along), 1e-9)
        places += [line - across, line, line + across]
    every = np.concatenate(places)
    return np.unique(np.round(rows(every) / _NET), axis=0) * _NET


def _offsets(label: Label, half: Floats, stretches: Sequence[tuple[float, float]]) -> tuple[Floats, Floats]:
    """Where the middle of the text may stand from its anchor (points), shape (n, 2), and how much each displeases."""
    steps = np.arange(_DIRECTIONS)
    way = (math.pi / 4 if label.heading is None else label.heading) + math.tau * steps / _DIRECTIONS
    toward = np.column_stack([np.cos(way), np.sin(way)])
    turned = np.minimum(steps, _DIRECTIONS - steps) / _DIRECTIONS * (0.5 if label.heading is None else 2.0)
    stretch, strain = np.array(stretches).T
    # The distance is that of the nearest edge of the text, not of its middle.
    places = label.reach * np.multiply.outer(stretch, toward) + half * np.clip(1.3 * toward, -1, 1)
    return places.reshape(-1, 2), np.add.outer(strain, turned).ravel()


def _costs(boxes: Floats, obstacles: Floats, taken: Floats, window: Floats) -> Floats:
    """Cost of each box (left, low, right, high; a row each): what it covers, and whether it leaves the window."""
    left, low, right, high = boxes.T[:, :, None]
    x, y = obstacles.T
    inside = (x > left - 1) & (x < right + 1) & (y > low - 1) & (y < high + 1)
    wide = np.minimum(right, taken[:, 2]) - np.maximum(left, taken[:, 0]) + 2
    tall = np.minimum(high, taken[:, 3]) - np.maximum(low, taken[:, 1]) + 1
    over = np.where((wide > 0) & (tall > 0), _OVER + wide * tall, 0.0)
    (x0, y0), (x1, y1) = window
    outside = (left < x0) | (right > x1) | (low < y0) | (high > y1)
    costs: Floats = 0.8 * inside.sum(axis=1) + over.sum(axis=1) + _OVER * outside[:, 0]
    return costs
