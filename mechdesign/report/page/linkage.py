"""A mechanism as SVG whose parts a script moves: a group for each rigid part, drawn in the frame of its link.

What moves says so by attributes: `data-at` names the point that a group stays at, `data-turn` the link that it turns
with; a line with `data-from`, `data-to` and `data-part` runs between two shares of the way from one point to another.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from matplotlib.colors import to_hex
from matplotlib.path import Path

from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.graph import GROUND
from mechdesign.numerics.arrays import Complexes, Floats
from mechdesign.report.figures.framing import fit
from mechdesign.report.figures.labels import HATCHED, Label, Position, net, positions
from mechdesign.report.figures.scene import Scene
from mechdesign.report.figures.shapes import (
    TICK,
    TICK_ANGLE,
    TICK_SPACING,
    Dashes,
    Line,
    Shape,
    Symbol,
    Travel,
    link_colors,
    link_labels,
    mechanism_shapes,
    point_labels,
)

# Of a drawing, in its own units, which are about points on paper: its width, its height at most, room around.
WIDTH = 520.0
MAX_HEIGHT = 470.0
_PAD = 30.0
_STRIP = 14.0  # below, for the bar of the scale
_POINTS = 72.0
_STEEL = "#777777"
_NAME = 12.0  # size of the letters of points
_RULER = 0.3  # part of the width that the bar of the scale is long at most
_LETTERS = {int(Path.MOVETO): "M", int(Path.LINETO): "L"}


@dataclass(frozen=True)
class Sheet:
    """Where a drawing lies: units of the drawing per length of the study, and the place of its upper left corner."""

    corner: complex
    scale: float
    width: float
    height: float

    @classmethod
    def around(cls, places: Complexes) -> Sheet:
        """A sheet that shows all of these places."""
        window = fit(places, WIDTH / _POINTS, MAX_HEIGHT / _POINTS, _PAD / _POINTS)
        scale, height = window.scale * _POINTS, window.height * _POINTS
        return cls(window.middle + complex(-WIDTH, height) / 2 / scale, scale, WIDTH, height + _STRIP)

    def at(self, place: complex) -> complex:
        """A place of the study in the drawing, whose y axis points down."""
        return ((place - self.corner) * self.scale).conjugate()

    def all(self, places: Complexes) -> Complexes:
        """Several places of the study in the drawing."""
        return np.conj((places - self.corner) * self.scale)

    def path(self, places: Complexes) -> str:
        """Lines along places, with no more corners than can be seen, broken where they are nan."""
        drawn = self.all(places)
        corners = Path(np.column_stack([drawn.real, drawn.imag])).cleaned(remove_nans=True, simplify=True)
        steps = zip(np.asarray(corners.vertices).tolist(), np.asarray(corners.codes).tolist(), strict=True)
        return "".join(f"{_LETTERS[code]}{x:.1f} {y:.1f}" for (x, y), code in steps if code in _LETTERS)

    def root(self, alt: str) -> Element:
        """The drawing, empty but for its white card."""
        looks = {"viewBox": f"0 0 {self.width:g} {self.height:.1f}", "role": "img", "aria-label": alt, "fill": "none"}
        root = Element(
            "svg", looks | {"class": "moving-drawing", "stroke-linecap": "round", "stroke-linejoin": "round"}
        )
        add(root, "rect", width="100%", height="100%", fill="white")
        return root


@dataclass(frozen=True)
class Body:
    """A rigid link in the first pose: the point that its parts are drawn about, and where that is; its direction."""

    name: str
    point: str
    place: complex
    turn: complex
    scale: float

    def local(self, place: complex) -> complex:
        """A place of the first pose in the link's frame, in the drawing's units and with its y axis down."""
        return ((place - self.place) / self.turn * self.scale).conjugate()


class Sketcher:
    """Draws a pose of a mechanism into an SVG element."""

    def __init__(self, root: Element, sheet: Sheet, mechanism: Mechanism, scene: Scene, travel: Travel) -> None:
        self.root, self.sheet, self.scene, self.travel = root, sheet, scene, travel
        self.colors = link_colors(mechanism)

    def body(self, name: str) -> Body:
        """The frame in which the parts of a link are drawn."""
        point = self.scene.link_points(name)[0]
        return Body(name, point, self.scene.points[point], self.scene.rotations[name], self.sheet.scale)

    def draw(self) -> None:
        """The mechanism without its names."""
        for shape in sorted(self._shapes(self.scene), key=lambda shape: shape.layer):
            if isinstance(shape, Symbol):
                self._symbol(shape)
            elif shape.leg:
                self._leg(shape, *shape.leg)
            else:
                self._line(shape)

    def _shapes(self, scene: Scene) -> list[Shape]:
        return mechanism_shapes(scene, self.colors, self.travel)

    def _moved(self, body: Body) -> Element:
        """A group that moves with a link."""
        transform = f"{_shift(self.sheet.at(body.place))} {_turned(body.turn)}"
        return add(self.root, "g", data_at=body.point, data_turn=body.name, transform=transform)

    def _placed(self, point: str) -> Element:
        """A group that stays at a point."""
        return add(self.root, "g", data_at=point, transform=_shift(self.sheet.at(self.scene.points[point])))

    def _line(self, line: Line) -> None:
        """A line or plate that moves with its link, or a rail."""
        parent, places = self.root, [self.sheet.at(place) + line.rail.conjugate() for place in line.places]
        if line.link != GROUND:
            body = self.body(line.link)
            parent, places = self._moved(body), [body.local(place) for place in line.places]
        way = f"M{'L'.join(map(_pair, places))}{'z' * line.filled}" + (_ticks(*places) if line.rail else "")
        look = {"fill": to_hex(line.color)} if line.filled else {}
        path = add(parent, "path", d=way, stroke=to_hex(line.color), stroke_width=line.width, **look)
        dashed(path, line.dashes, line.width)

    def _leg(self, line: Line, base: str, tip: str, first: float, last: float) -> None:
        """A part of a telescopic leg."""
        begin, end = (self.sheet.at(place) for place in line.places)
        add(self.root, "line", data_from=base, data_to=tip, data_part=f"{first:g} {last:g}", x1=begin.real,
            y1=begin.imag, x2=end.real, y2=end.imag, stroke=to_hex(line.color), stroke_width=line.width,
            stroke_linecap=line.cap)  # fmt: skip

    def _symbol(self, symbol: Symbol) -> None:
        colors = (("fill", symbol.fill), ("stroke", symbol.edge))
        look = {key: to_hex(color) for key, color in colors if color} | {"stroke_width": symbol.width}
        origin, turn = 0j, symbol.direction
        if symbol.link != GROUND:
            body = self.body(symbol.link)
            parent, origin, turn = self._moved(body), body.local(symbol.place), turn / body.turn
        elif symbol.point:
            parent = self._placed(symbol.point)
        else:
            parent = add(self.root, "g", transform=_shift(self.sheet.at(symbol.place)))
        lines = [[_pair(origin + (place * turn).conjugate()) for place in line] for line in symbol.outlines]
        if symbol.radius:
            add(parent, "circle", r=symbol.radius, **look)
        elif symbol.fill:
            add(parent, "polygon", points=" ".join(lines[0]), **look)
        else:
            add(parent, "path", d="".join(f"M{'L'.join(line)}" for line in lines), **look)

    def trace(self, places: Complexes, color: str, width: float, share: float) -> None:
        """The path of a point; the script may hide it."""
        add(self.root, "path", **{"class": "moving-trace"}, d=self.sheet.path(places), stroke=color,
            stroke_width=width, opacity=share)  # fmt: skip

    def names(self, scenes: Sequence[Scene]) -> None:
        """Names of the points and links, each where it covers least in some poses of the motion.

        Those of links stay level; the script shows them on request.
        """
        points = [replace(label, size=_NAME) for label in point_labels(self.scene)]
        links = [replace(label, optional=False) for label in link_labels(self.scene, self.colors, driven=True)]
        bodies = [self.body(label.text) for label in links]
        anchors = []
        for scene in scenes:
            places = [np.array([scene.points[label.text]]) for label in points]
            for label, body in zip(links, bodies, strict=True):
                turn = scene.rotations[body.name] / body.turn
                places.append(scene.points[body.point] + turn * (np.array(label.anchors) - body.place))
            anchors.append([_rows(self._paper(z)) for z in places])
        nets = [net(map(self._outline, self._shapes(scene))) for scene in scenes]
        window = _rows(np.array([-1j * self.sheet.height, self.sheet.width]))
        chosen = positions([*points, *links], anchors, nets, window)
        for label, position in zip(points, chosen, strict=False):
            if position:
                self._name(self._placed(label.text), label, position)
        for label, body, position in zip(links, bodies, chosen[len(points) :], strict=True):
            if position:
                anchor = label.anchors[position.anchor]
                looks = {"data-offset": _pair(body.local(anchor)), "class": "moving-name moving-off"}
                group = add(self.root, "g", data_at=body.point, data_turn=body.name,
                            transform=_shift(self.sheet.at(anchor)), **looks)  # fmt: skip
                self._name(group, label, position, font_style="italic")

    def _name(self, group: Element, label: Label, position: Position, **looks: str) -> None:
        """A name at its position from the origin of a group."""
        x, y = position.offset.tolist()
        add(group, "text", label.text, x=x, y=0.35 * label.size - y, text_anchor="middle", font_size=label.size,
            fill=to_hex(label.color), stroke="white", stroke_width=2.6, paint_order="stroke", **looks)  # fmt: skip

    def _paper(self, places: Complexes) -> Complexes:
        """Places of the study in points from the sheet's upper left corner, the y axis up."""
        return (places - self.sheet.corner) * self.sheet.scale

    def _outline(self, shape: Shape) -> tuple[Complexes, float, bool]:
        """What a shape covers: its outline on paper, its width, whether it is an area."""
        if isinstance(shape, Line):
            outline = self._paper(np.array(shape.places)) + shape.rail
            return outline, HATCHED if shape.rail else shape.width, shape.filled
        around = shape.radius * np.array([1, 1j, -1, -1j]) if shape.radius else np.concatenate(shape.outlines)
        return self._paper(np.array(shape.place)) + around * shape.direction, shape.width, shape.fill is not None

    def ruler(self, unit: str) -> None:
        """A bar of the drawing's scale at its lower left corner."""
        length = rounded(_RULER * self.sheet.width / self.sheet.scale)
        begin, wide = complex(12, self.sheet.height - 6), length * self.sheet.scale
        add(self.root, "path", d=f"M{_pair(begin - 4j)}v4h{_number(wide)}v-4", stroke=_STEEL)
        add(self.root, "text", f"{length:g} {unit}".rstrip(), x=begin.real + wide / 2, y=begin.imag - 4,
            text_anchor="middle", font_size=10, fill="#555555")  # fmt: skip


def add(parent: Element, kind: str, /, text: str | None = None, **looks: str | float) -> Element:
    """A new element with attributes, whose names have a hyphen for each underscore."""
    told = {key.replace("_", "-"): look if isinstance(look, str) else _number(look) for key, look in looks.items()}
    element = SubElement(parent, kind, told)
    element.text = text
    return element


def dashed(element: Element, dashes: Dashes, width: float) -> None:
    """Give a line of some width its dashes."""
    if not isinstance(dashes, str):
        element.set("stroke-dasharray", " ".join(_number(width * part) for part in dashes[1]))


def rounded(value: float) -> float:
    """The largest of 1, 2, 5 times powers of ten that is not above a value."""
    power = 10.0 ** math.floor(math.log10(value))
    return max(step * power for step in (1, 2, 5) if step * power <= value)


def _number(value: float) -> str:
    """Two decimals, as short as they can be written."""
    return f"{round(value, 2) + 0.0:g}"


def _pair(place: complex) -> str:
    return f"{_number(place.real)} {_number(place.imag)}"


def _shift(place: complex) -> str:
    return f"translate({_pair(place)})"


def _turned(direction: complex) -> str:
    return f"rotate({_number(-math.degrees(cmath.phase(direction)))})"


def _ticks(begin: complex, end: complex) -> str:
    """The strokes of a hatched rail."""
    along = (end - begin) / abs(end - begin)
    stroke = _pair(TICK * along * cmath.exp(-1j * math.radians(TICK_ANGLE)))
    steps = np.arange(TICK_SPACING, abs(end - begin), TICK_SPACING).tolist()
    return "".join(f"M{_pair(begin + step * along)}l{stroke}" for step in steps)


def _rows(places: Complexes) -> Floats:
    return np.column_stack([places.real, places.imag])
