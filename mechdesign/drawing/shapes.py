"""What is drawn of a mechanism in a pose, for Matplotlib and SVG alike: lines and symbols in layers, and names."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import starmap
from typing import Any, Literal

import numpy as np
from matplotlib.colors import to_rgb

from mechdesign.drawing import style
from mechdesign.drawing.scene import Guide, RoundPart, Still, hull, spring_points
from mechdesign.mechanism.elements.springs import Spring
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.model import Description

# Of symbols, in points on paper.
BAR = 8.0  # width of a link
PLATES, PATHS = -0.8, -0.7  # layer of plates, the lowest, and that which paths of points begin above them
PIN = 3.6  # radius of a joint
GROUND_HEIGHT = 13.0
SLIDER_SIZE = (22.0, 13.0)  # along its guide and across
SPRING_COLOR = "#444444"
COIL, _WINDINGS = 5.5, 12  # half width of a coil spring or damper, and its turns to either side
_SPIRAL = 15.0  # radius of a spiral spring
_CENTER = 4.6  # radius of a centre of mass
_TICK, _TICK_SPACING = 4.95 * cmath.exp(0.75j * math.pi), 5.5  # strokes of a hatched rail, for one along x
_MOST_TICKS = 10_000  # of a rail; nobody sees those of a longer one
_PROFILE = 2.8  # width of the profile of a cam, of which half shows around a disc
_PITCH: Any = (0, (9, 2, 2, 2))  # dashes of a pitch circle
_STEEL = "#777777"
_GHOST = "#777777"
LINK_COLORS = (style.BLUE, style.GREEN, style.ORANGE, style.PURPLE, style.SKY, "#8A6A2A", "#5B4FA2", "#6E6E6E")
Paper = Callable[[complex], complex]
Color = str | tuple[float, float, float]
Dashes = Literal["-"] | tuple[float, tuple[float, ...]]  # for Matplotlib: dashes and gaps in widths of the line


@dataclass(frozen=True)
class Line:
    """A line through places of the mechanism, or a filled plate with this outline.

    Parameters
    ----------
    width : float
        Points on paper.
    layer : float
        A shape lies above those of lower layers, and above earlier ones of its own.
    link : str
        The link in which its places are fixed.
    rail : complex
        Displacement on paper (points) of a rail, which is hatched on its left; 0 for a plain line.
    """

    places: Sequence[complex]
    color: Color
    width: float
    layer: float
    link: str = GROUND
    filled: bool = False
    cap: Literal["round", "butt", "projecting"] = "round"
    dashes: Dashes = "-"
    rail: complex = 0j

    def on_paper(self, at: Paper, size: float = 1.0) -> list[list[complex]]:
        """The line in points, and the strokes of a rail, which a short one has not; `at` gives those of a place."""
        places = [at(place) + self.rail * size for place in self.places]
        way = places[-1] - places[0]
        if not self.rail or abs(way) > _TICK_SPACING * _MOST_TICKS:
            return [places]
        steps = np.arange(_TICK_SPACING, abs(way) - _TICK_SPACING * (abs(way) <= 2 * _TICK_SPACING), _TICK_SPACING)
        along = way / (abs(way) or 1.0)
        feet = (places[0] + steps * along).tolist()
        return [places, *([foot, foot + _TICK * along] for foot in feet)]


@dataclass(frozen=True)
class Symbol:
    """A symbol in points on paper at a place of the mechanism, its x axis along `direction`.

    Parameters
    ----------
    outlines : sequence of sequences of complex
        Lines, or the corners of one area where there is a `fill`.
    radius : float
        Of a circle in place of the outlines.
    width : float
        Of the edge, points.
    point : str
        The point at which it stays.
    link : str
        The link in which it is fixed.
    """

    place: complex
    layer: float
    outlines: Sequence[Sequence[complex]] = ()
    radius: float = 0.0
    fill: Color | None = None
    edge: Color | None = style.INK
    width: float = 1.0
    dashes: Dashes = "-"
    direction: complex = 1.0
    point: str = ""
    link: str = GROUND

    def on_paper(self, at: Paper, size: float = 1.0) -> list[list[complex]]:
        """Its outlines in points, of a circle some places; `at` gives those of a place."""
        place, way = at(self.place), size * self.direction
        around = self.outlines or [(self.radius * np.exp(0.5j * np.pi * np.arange(5))).tolist()]
        return [[place + way * corner for corner in line] for line in around]


@dataclass(frozen=True)
class Strut:
    """Lines between two points that move apart: a part of a telescopic leg, or a spring.

    Parameters
    ----------
    places, points : tuple
        Both ends, and their names.
    outlines : sequence of sequences of complex
        Lines, or closed ones around one area where there is a `fill`: x is a share of the way from the first end to the
        second, y a distance to its left in points on paper.
    """

    places: tuple[complex, complex]
    points: tuple[str, str]
    outlines: Sequence[Sequence[complex]]
    color: Color
    width: float
    layer: float
    fill: Color | None = None
    cap: Literal["round", "butt", "projecting"] = "round"

    def on_paper(self, at: Paper, size: float = 1.0) -> list[list[complex]]:
        """Its outlines in points; `at` gives those of a place."""
        begin, end = map(at, self.places)
        left = 1j * size * (end - begin) / (abs(end - begin) or 1.0)
        return [[begin + corner.real * (end - begin) + corner.imag * left for corner in line] for line in self.outlines]


Shape = Line | Symbol | Strut


def lighter(color: Color, share: float = 0.62) -> Color:
    """A colour mixed with white."""
    red, green, blue = (1 - (1 - part) * (1 - share) for part in to_rgb(color))
    return red, green, blue


def darker(color: Color, share: float = 0.3) -> Color:
    """A colour mixed with black, for text."""
    red, green, blue = (part * (1 - share) for part in to_rgb(color))
    return red, green, blue


def link_colors(description: Description) -> dict[str, str]:
    """The colour of each link, the same in every picture."""
    moving = [name for name in description.links if name != GROUND]
    return {name: LINK_COLORS[k % len(LINK_COLORS)] for k, name in enumerate(moving)} | {GROUND: style.INK}


def mechanism_shapes(scene: Still) -> list[Shape]:
    """A mechanism in one pose without drives and names."""
    colors, shapes = link_colors(scene.description), list[Shape]()
    for point in scene.pivots():
        shapes += _pivot(scene.points[point])
    for guide in scene.guides:
        shapes += _guide(scene, guide, colors, guide.ends)
    for rank, (name, body) in enumerate(bodies(scene)):
        if len(body) > 2:
            # A smaller plate lies on a larger one, all of them below paths and bars.
            layer = PLATES + (PATHS - PLATES) * (1 - 0.5**rank)
            shapes += [Line(body, shade, width, layer, name, filled=True)
                       for shade, width in ((colors[name], BAR), (lighter(colors[name]), BAR - 2.4))]  # fmt: skip
        elif len(body) == 2:
            shapes += _bar(body, colors[name], name)
    owners: dict[str, str] = {}
    for name, link in scene.description.links.items():
        if link.telescopic and link.ends:
            shapes += _leg(scene, link.ends, colors[name])
        for point in scene.link_points(name):
            owners.setdefault(point, name)
    for point, kind in scene.kinds().items():
        place = scene.points[point]
        if kind == "pin":
            shapes.append(Symbol(place, 0.5, radius=PIN, fill="white", width=1.5, point=point))
        elif kind == "clamp":
            shapes.append(Symbol(place, 0.5, (_rectangle(PIN, PIN),), fill=style.INK, point=point))
        elif kind == "tracer":
            shapes.append(Symbol(place, 0.5, radius=PIN - 0.8, fill=colors[owners[point]], point=point))
    for outline in scene.outlines:
        shapes += _outline(outline, colors[outline.link])
    return [*shapes, *spring_shapes(scene)]


def spring_shapes(scene: Still) -> list[Shape]:
    """The springs of a mechanism in one pose."""
    springs = scene.description.springs.values()
    return [part for one in springs for part in (_torsion if one.turning else _spring)(scene, one)]


def _outline(outline: RoundPart, color: Color) -> list[Shape]:
    """A pitch circle, the line of a rack, a pulley, a side of a belt, a cam as a plate or groove, or its follower."""
    looks: dict[str, list[tuple[Color, float, float]]] = {
        "pitch": [(color, 1.2, 0.05)], "rim": [(color, 1.2, 0.05)], "strand": [(style.INK, 1.4, 0.06)],
        "disc": [(color, _PROFILE, PLATES - 0.1), (lighter(color, 0.8), 0.1, PLATES - 0.05)],
        "groove": [(color, _PROFILE / 2, PLATES - 0.1)],
        "roller": [("white", 0.1, 0.02), (color, 1.6, 0.05)], "face": [(color, BAR / 2, 0.05)],
    }  # fmt: skip
    dashes: Dashes = _PITCH if outline.kind == "pitch" else "-"
    return [
        Line(outline.places.tolist(), shade, width, layer, outline.link, dashes=dashes,
             filled=outline.kind == "disc" or shade == "white")
        for shade, width, layer in looks[outline.kind]
    ]  # fmt: skip


def _rectangle(half: float, high: float) -> tuple[complex, ...]:
    return complex(-half, -high), complex(half, -high), complex(half, high), complex(-half, high)


def _pivot(place: complex) -> list[Symbol]:
    """The ground symbol under a pivot: triangle and hatch."""
    foot = -GROUND_HEIGHT + 3
    hatch = [(complex(x, foot), complex(x - 4, foot - 4)) for x in (-10 + 5.5 * k for k in range(5))]
    return [
        Symbol(place, 0.0, ((0j, complex(-8, foot), complex(8, foot)),), fill="#EEEEEE", width=1.2),
        Symbol(place, 0.0, ((complex(-12, foot), complex(12, foot)), *hatch), width=1.1),
    ]


def _guide(scene: Still, guide: Guide, colors: Mapping[str, str], ends: tuple[complex, complex]) -> list[Shape]:
    """A rail of the ground, or a bar with a slot, and the slider on it."""
    shapes: list[Shape] = []
    if guide.owner == GROUND:
        shapes += _rail(*ends) if ends[0] != ends[1] else []
    else:
        shapes += _bar(reach(scene, guide, ends), colors[guide.owner], guide.owner)
        if guide.slider is None:
            shapes.append(Line(ends, "white", BAR - 3.4, 0.12, guide.owner))
    if guide.slider is not None:
        color, half = colors[guide.slider], SLIDER_SIZE[0] / 2
        shapes.append(Symbol(guide.pin, 0.2, (_rectangle(half, SLIDER_SIZE[1] / 2),), fill=lighter(color), edge=color,
                             width=1.4, direction=guide.along, link=guide.slider))  # fmt: skip
    return shapes


def _rail(start: complex, end: complex) -> list[Shape]:
    """A guide fixed to the ground: the slide's line, and a hatched rail on its lower side."""
    along = (end - start) / abs(end - start)
    down = -1j * along if (-1j * along).imag <= 0 else 1j * along
    # Ticks stand on the left of the rail: it runs so that this is away from the slider.
    first, last = (start, end) if (1j * along * down.conjugate()).real > 0 else (end, start)
    return [
        Line((start, end), _STEEL, 0.8, 0.0, dashes=(0, (9, 3, 2, 3))),
        Line((first, last), style.INK, 1.2, 0.0, cap="projecting", rail=down * (SLIDER_SIZE[1] / 2 + 1.2)),
    ]


def _bar(ends: Sequence[complex], color: str, link: str) -> list[Shape]:
    return [Line(ends, color, BAR, 0.1, link), Line(ends, lighter(color), BAR - 2.4, 0.11, link)]


def _leg(scene: Still, ends: tuple[str, str], color: str) -> list[Shape]:
    """A telescopic leg: cylinder from the base, rod to the tip."""
    base, tip = (scene.points[end] for end in ends)
    parts = ((0.0, 1.0, color, 3.6, 0.1), (0.0, 1.0, lighter(color), 1.6, 0.11),
             (0.12, 0.58, color, BAR + 3, 0.12), (0.123, 0.577, lighter(color), BAR + 0.6, 0.13))  # fmt: skip
    return [
        Strut((base, tip), ends, ((first + 0j, last + 0j),), shade, width, layer, cap="round" if last == 1 else "butt")
        for first, last, shade, width, layer in parts
    ]


def _spring(scene: Still, spring: Spring) -> list[Shape]:
    """A coil spring as a zigzag, a damper as a piston in its cup, both side by side, or a gas spring."""
    points = spring_points(spring)
    places = scene.points[points[0]], scene.points[points[1]]
    looks: dict[str, Any] = {"color": SPRING_COLOR, "width": 1.4, "layer": 0.14}
    if spring.force != 0.0:
        cylinder = [complex(x, y) for x, y in ((0.08, -4), (0.6, -4), (0.6, 4), (0.08, 4), (0.08, -4))]
        return [Strut(places, points, ((0j, 1 + 0j),), **looks | {"width": 2.4}),
                Strut(places, points, (cylinder,), fill="#DDDDDD", **looks | {"layer": 0.15})]  # fmt: skip
    *leads, zigzag = coil(0.12, 0.88)
    cup = [complex(x, y) for x, y in ((0.68, -COIL), (0.32, -COIL), (0.32, COIL), (0.68, COIL))]
    piston = [complex(0.55, -0.7 * COIL), complex(0.55, 0.7 * COIL)]
    dashpot = [[0.12 + 0j, 0.32 + 0j], cup, piston, [0.55 + 0j, 0.88 + 0j]]
    parts = [[zigzag]] * (spring.stiffness != 0.0 or spring.preload != 0.0) + [dashpot] * (spring.damping != 0.0)
    outlines = leads
    for part, aside in zip(parts, (0.0,) if len(parts) == 1 else (1.4 * COIL, -1.4 * COIL), strict=True):
        outlines += [[corner + 1j * aside for corner in line] for line in part]
    if len(parts) > 1:
        outlines += [[complex(end, 1.4 * COIL), complex(end, -1.4 * COIL)] for end in (0.12, 0.88)]
    return [Strut(places, points, outlines, **looks)]


def coil(begin: float, end: float) -> list[list[complex]]:
    """Outlines of a `Strut`: two straight ends, and a zigzag between two shares of the way."""
    windings = ((begin + (end - begin) * (k + 0.5) / _WINDINGS, COIL * (-1) ** k) for k in range(_WINDINGS))
    return [[0j, complex(begin)], [complex(end), 1 + 0j], [complex(begin), *starmap(complex, windings), complex(end)]]


def _torsion(scene: Still, spring: Spring) -> list[Shape]:
    """A spiral spring at the pivot of two links, which ends on the one that moves."""
    link, reference = spring.between if spring.between[0] != GROUND else spring.between[::-1]
    pivot = scene.pivot(link, reference)
    others = [scene.points[point] for point in scene.link_points(link) if point != pivot]
    way = sum(others) / len(others) - scene.points[pivot] if others else scene.rotations[link]
    angles = np.linspace(-3.5 * math.pi, 0.0, 64)
    spiral = np.linspace(PIN, _SPIRAL, 64) * np.exp(1j * angles)
    return [Symbol(scene.points[pivot], 0.45, (spiral.tolist(),), edge=SPRING_COLOR, width=1.4,
                   direction=way / (abs(way) or 1.0), link=link)]  # fmt: skip


def center_shapes(places: Iterable[complex]) -> list[Shape]:
    """Centres of mass: circles with two black quarters."""
    turns = np.exp(0.5j * np.pi * np.linspace(0, 1, 9))
    quarter = (0j, *(_CENTER * turns).tolist())
    shapes: list[Shape] = []
    for place in places:
        shapes += [Symbol(place, 0.6, radius=_CENTER, fill="white", width=1.1),
                   *(Symbol(place, 0.61, ([side * corner for corner in quarter],), fill=style.INK, edge=None)
                     for side in (1, -1))]  # fmt: skip
    return shapes


def ghost_shapes(scene: Still, dashes: Dashes) -> list[Shape]:
    """The links as thin grey lines."""
    lines = [[*body, *(body[:1] if len(body) > 2 else [])] for _, body in bodies(scene) if len(body) > 1]
    for link in scene.description.links.values():
        if link.telescopic and link.ends:
            lines.append([scene.points[end] for end in link.ends])
    lines += [reach(scene, guide, (guide.pin,)) for guide in scene.guides if guide.owner != GROUND]
    return [Line(line, _GHOST, 1.3, 0.1, dashes=dashes) for line in lines]


def bodies(scene: Still) -> list[tuple[str, list[complex]]]:
    """RoundPart of each moving rigid link, the largest first so that none hides another."""
    outlines = []
    for name, link in scene.description.links.items():
        if name != GROUND:
            points = link.points if link.telescopic else scene.link_points(name)
            outlines.append((name, hull([scene.points[point] for point in points])))
    return sorted(outlines, key=lambda item: -_area(item[1]))


def _area(corners: list[complex]) -> float:
    turned = zip(corners, corners[1:] + corners[:1], strict=True)
    return abs(sum((a.conjugate() * b).imag for a, b in turned)) / 2 if len(corners) > 2 else 0.0


def reach(scene: Still, guide: Guide, places: Iterable[complex]) -> list[complex]:
    """Ends of the line that a link carries: from its own points to where something slides."""
    own = [scene.points[point] for point in scene.link_points(guide.owner)]
    along = [((place - guide.origin) * guide.along.conjugate()).real for place in (*own, *places)]
    return [guide.origin + s * guide.along for s in (min(along), max(along))]
