"""A drawing at full size: outlines of lines and arcs, circles and texts on layers, in millimetres, y upwards."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Self

from mechdesign.mechanism.plates import hull

# Sides of a circle as which it is drawn.
ROUND = 96


@dataclass(frozen=True)
class Layer:
    """A layer of a drawing: its meaning, and its colour as an index of AutoCAD and as red, green and blue."""

    name: str
    meaning: str
    index: int
    color: str


LAYERS = {
    layer.name: layer
    for layer in (
        Layer("cut", "what is cut through", 1, "#ff0000"),
        Layer("pocket", "both sides of a groove, which is milled to a depth", 4, "#00a0a0"),
        Layer("drill", "centres of holes", 3, "#00a000"),
        Layer("engrave", "names and marks", 5, "#0000ff"),
        Layer("links", "links of the mechanism in a pose", 7, "#000000"),
        Layer("curves", "paths of points over the motion", 6, "#c000c0"),
        Layer("notes", "words about the drawing", 8, "#808080"),
    )
}


@dataclass(frozen=True)
class Path:
    """Lines and arcs from corner to corner, and back to the first where it is `closed`.

    `bulges` says for each corner what begins there: 0 a line, else an arc, by the tangent of a quarter of its angle,
    positive counter-clockwise.
    """

    layer: str
    corners: tuple[complex, ...]
    bulges: tuple[float, ...]
    closed: bool = True

    @classmethod
    def line(cls, layer: str, corners: Iterable[complex]) -> Path:
        """Straight lines from place to place."""
        places = tuple(corners)
        return cls(layer, places, (0.0,) * len(places), closed=False)

    def close(self) -> Path:
        """The same with a line from the last place to the first."""
        return replace(self, closed=True)

    @property
    def ends(self) -> Iterator[complex]:
        """Places that bound it: its corners, and the outermost places of each arc in x and y."""
        yield from self.corners
        for corner, following, bulge in self.pieces():
            if bulge:
                center, radius = arc(corner, following, bulge)
                begin, turn = cmath.phase(corner - center), 4 * math.atan(bulge)
                for k in range(4):
                    angle = k * math.pi / 2
                    if (angle - begin) * math.copysign(1.0, turn) % (2 * math.pi) < abs(turn):
                        yield center + cmath.rect(radius, angle)

    def pieces(self) -> Iterator[tuple[complex, complex, float]]:
        """Begin, end and bulge of each line and arc."""
        following = (*self.corners[1:], self.corners[0]) if self.closed else self.corners[1:]
        return zip(self.corners, following, self.bulges, strict=False)

    def moved(self, by: complex, turn: complex = 1.0) -> Path:
        """The same turned about 0 by the angle of a unit vector, and then moved."""
        return replace(self, corners=tuple(by + turn * corner for corner in self.corners))


@dataclass(frozen=True)
class _Placed:
    """What lies at a place and keeps its form when it is turned."""

    layer: str
    place: complex

    def moved(self, by: complex, turn: complex = 1.0) -> Self:
        """The same with its place turned about 0 by the angle of a unit vector, and then moved."""
        return replace(self, place=by + turn * self.place)


@dataclass(frozen=True)
class DrawnCircle(_Placed):
    """A circle about its place."""

    radius: float

    @property
    def ends(self) -> Iterator[complex]:
        """Its outermost places in x and y."""
        return (self.place + self.radius * way for way in (1, 1j, -1, -1j))


@dataclass(frozen=True)
class CentreMark(_Placed):
    """A place that is marked, such as the centre of a hole."""

    @property
    def ends(self) -> Iterator[complex]:
        """The place."""
        return iter((self.place,))


@dataclass(frozen=True)
class Text(_Placed):
    """A line of text, level, whose lower left corner is at `place`, or with `centred` its middle."""

    height: float
    words: str
    centred: bool = False

    @property
    def width(self) -> float:
        """About how wide it is."""
        return 0.65 * self.height * len(self.words)

    @property
    def ends(self) -> Iterator[complex]:
        """About its corners."""
        begin = self.place - complex(self.width, self.height) / 2 if self.centred else self.place
        return iter((begin, begin + complex(self.width, self.height)))


Shape = Path | DrawnCircle | CentreMark | Text


@dataclass(frozen=True)
class Drawing:
    """Shapes, those in one group together under its name; `title` and `remarks` say what it is.

    `longest` is the length (mm) of its longer side on a screen, beyond which it is shown reduced.
    """

    title: str
    groups: Mapping[str, Sequence[Shape]]
    remarks: Sequence[str] = ()
    longest: float = math.inf

    @property
    def shapes(self) -> list[Shape]:
        """All shapes."""
        return [shape for group in self.groups.values() for shape in group]

    @property
    def layers(self) -> list[Layer]:
        """The layers that it has, in the order of `LAYERS`."""
        used = {shape.layer for shape in self.shapes}
        return [layer for name, layer in LAYERS.items() if name in used]

    @property
    def box(self) -> tuple[complex, complex]:
        """Lower left and upper right corner of what is drawn."""
        return box(self.shapes)


def box(shapes: Iterable[Shape]) -> tuple[complex, complex]:
    """Lower left and upper right corner of some shapes; a point at 0 of none."""
    ends = [end for shape in shapes for end in shape.ends] or [0j]
    x, y = [end.real for end in ends], [end.imag for end in ends]
    return complex(min(x), min(y)), complex(max(x), max(y))


def arc(begin: complex, end: complex, bulge: float) -> tuple[complex, float]:
    """Centre and radius of an arc between two places."""
    chord = end - begin
    center = (begin + end) / 2 + 1j * chord * (1 / bulge - bulge) / 4
    return center, abs(chord) * (1 + bulge * bulge) / (4 * abs(bulge))


def traced(shape: Path | DrawnCircle) -> list[complex]:
    """Places along an outline, from its begin to its end, so close that arcs look round."""
    if isinstance(shape, DrawnCircle):
        return [shape.place + cmath.rect(shape.radius, 2 * math.pi * k / ROUND) for k in range(ROUND + 1)]
    places = [shape.corners[0]]
    for begin, end, bulge in shape.pieces():
        if bulge:
            center, _ = arc(begin, end, bulge)
            steps = max(1, round(ROUND * abs(4 * math.atan(bulge)) / (2 * math.pi)))
            turn = cmath.rect(1.0, 4 * math.atan(bulge) / steps)
            places += [center + (begin - center) * turn**k for k in range(1, steps)]
        places.append(end)
    return places


def roomiest(places: Sequence[complex], holes: Iterable[tuple[complex, float]], empty: float) -> tuple[complex, float]:
    """Where a name has most room: of the middles of `places` the one farthest from all holes, and its distance.

    `holes` are centres and radii; without any the distance is `empty`.
    """
    holes = [*holes]
    middles = [(a + b) / 2 for a, b in combinations(places, 2)] or [*places]
    middles.append(sum(places) / len(places))

    def room(place: complex) -> float:
        return min((abs(place - center) - radius for center, radius in holes), default=empty)

    place = max(middles, key=lambda middle: round(room(middle), 9))
    return place, room(place)


def around(layer: str, places: Iterable[complex], radius: float) -> Path | DrawnCircle:
    """The outline at a distance around the convex hull of some places: lines, and arcs about its corners."""
    corners = hull(places)
    if len(corners) == 1:
        return DrawnCircle(layer, corners[0], radius)
    sides = [b - a for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]
    outwards = [-1j * side / abs(side) for side in sides]
    outline: list[complex] = []
    bulges: list[float] = []
    for corner, before, behind in zip(corners, [outwards[-1], *outwards[:-1]], outwards, strict=True):
        turn = cmath.phase(behind / before) % (2 * math.pi)
        outline += [corner + radius * before, corner + radius * behind]
        bulges += [math.tan(turn / 4), 0.0]
    return Path(layer, tuple(outline), tuple(bulges))
