"""A mechanism as SVG whose parts a script moves: a group for each rigid part, drawn in the frame of its link.

What moves says so by attributes: `data-at` names the point that a group stays at, `data-turn` the link that it turns
with; a path with `data-from`, `data-to` and `data-way` runs through shares of the way from one point to another, and so
far to its left.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from matplotlib.colors import to_hex
from matplotlib.path import Path

from mechdesign.drawing import callouts, shapes, style
from mechdesign.drawing.framing import fit
from mechdesign.drawing.labels import MOST_LETTERS, Label, Position, net, positions, rows
from mechdesign.drawing.panels import round_down
from mechdesign.drawing.scene import Still
from mechdesign.drawing.shapes import Dashes, Line, Shape, Strut, Symbol
from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.mechanism.graph import GROUND
from mechdesign.questions.kinematics.figures.paths import PathLook

# Width, greatest height and margin of a drawing, in its own units of about one point on paper.
WIDTH = 520.0
MAX_HEIGHT = 470.0
_PAD = 30.0
_STRIP = 14.0  # below, for the bar of the scale
_POINTS = 72.0
_STEEL = "#777777"
_NAME = 12.0  # size of the letters of points
_RULER = 0.3  # part of the width that the bar of the scale is long at most
KEPT = "moving-kept"  # class of what stays where the mechanism below is drawn anew: names and the ruler
_LETTERS = {int(Path.MOVETO): "M", int(Path.LINETO): "L"}


@dataclass(frozen=True)
class Canvas:
    """Where a drawing lies: units of the drawing per length of the study, and the place of its upper left corner."""

    corner: complex
    scale: float
    width: float
    height: float

    @classmethod
    def around(cls, places: Complexes) -> Canvas:
        """A sheet that shows all of these places."""
        window = fit(places, WIDTH / _POINTS, MAX_HEIGHT / _POINTS, _PAD / _POINTS)
        scale, height = window.scale * _POINTS, window.height * _POINTS
        return cls(window.middle + complex(-WIDTH, height) / 2 / scale, scale, WIDTH, height + _STRIP)

    def at(self, place: complex) -> complex:
        """A point of the plane in the drawing's coordinates, whose y axis points down."""
        return ((place - self.corner) * self.scale).conjugate()

    def all(self, places: Complexes) -> Complexes:
        """Points of the plane in the drawing's coordinates."""
        return np.conj((places - self.corner) * self.scale)

    def path(self, places: Complexes) -> str:
        """SVG path through points, simplified as far as no difference is visible, interrupted at nan."""
        drawn = self.all(places)
        corners = Path(np.column_stack([drawn.real, drawn.imag])).cleaned(remove_nans=True, simplify=True)
        steps = zip(np.asarray(corners.vertices).tolist(), np.asarray(corners.codes).tolist(), strict=True)
        return "".join(f"{_LETTERS[code]}{x:.1f} {y:.1f}" for (x, y), code in steps if code in _LETTERS)

    def root(self, alt: str) -> Element:
        """The empty drawing with a white background."""
        looks = {"viewBox": f"0 0 {self.width:g} {self.height:.1f}", "role": "img", "aria-label": alt, "fill": "none"}
        root = Element(
            "svg", looks | {"class": "moving-drawing", "stroke-linecap": "round", "stroke-linejoin": "round"}
        )
        add(root, "rect", width="100%", height="100%", fill="white")
        return root


class Sketcher:
    """Draws a pose of a mechanism into an SVG element."""

    def __init__(self, root: Element, sheet: Canvas, scene: Still) -> None:
        self.root, self.sheet, self.scene = root, sheet, scene

    def draw(self, paths: Iterable[PathLook] = (), goals: Iterable[Complexes] = ()) -> None:
        """The mechanism without its names; the paths of points, and places that these shall pass, lie on its plates."""
        ordered = sorted(shapes.mechanism_shapes(self.scene), key=lambda shape: shape.layer)
        plates = sum(shape.layer < shapes.PATHS for shape in ordered)
        self._shapes(ordered[:plates])
        for path in paths:
            self._trace(path)
        for places in goals:
            dots = "".join(f"M{_pair(place)}h0" for place in self.sheet.all(places).tolist())
            add(self.root, "path", **{"class": "moving-goals"}, d=dots, stroke=to_hex(style.VERMILION), stroke_width=6)
        self._shapes(ordered[plates:])

    def _shapes(self, drawn: Iterable[Shape]) -> None:
        for shape in drawn:
            if isinstance(shape, Symbol):
                self._symbol(shape)
            elif isinstance(shape, Strut):
                self._strut(shape)
            else:
                self._line(shape)

    def _group(self, point: str, link: str = GROUND) -> Element:
        """A group that stays at a point, and turns with a link that moves."""
        place, moves = _shift(self.sheet.at(self.scene.points[point])), {"data_at": point}
        if link != GROUND:
            place, moves = f"{place} {_turned(self.scene.rotations[link])}", moves | {"data_turn": link}
        return add(self.root, "g", **moves, transform=place)

    def _local(self, link: str, place: complex) -> complex:
        """A point in the frame of a link at the link's first point, in the drawing's units, y axis down."""
        way = place - self.scene.points[self.scene.link_points(link)[0]]
        return (way / self.scene.rotations[link] * self.sheet.scale).conjugate()

    def _on_paper(self, place: complex) -> complex:
        """A place in the drawing's units, its y axis up."""
        return self.sheet.at(place).conjugate()

    def _line(self, line: Line) -> None:
        """A line or plate that moves with its link, or a rail."""
        parent, lines = self.root, [[place.conjugate() for place in part] for part in line.on_paper(self._on_paper)]
        if line.link != GROUND:
            parent = self._group(self.scene.link_points(line.link)[0], line.link)
            lines = [[self._local(line.link, place) for place in line.places]]
        way = "".join(f"M{'L'.join(map(_pair, part))}" for part in lines) + "z" * line.filled
        look = {"fill": to_hex(line.color)} if line.filled else {}
        path = add(parent, "path", d=way, stroke=to_hex(line.color), stroke_width=line.width, **look)
        dashed(path, line.dashes, line.width)

    def _strut(self, strut: Strut) -> None:
        """A part of a telescopic leg, or a spring."""
        way = ",".join(" ".join(_digits(corner) for corner in line) for line in strut.outlines)
        lines = strut.on_paper(self._on_paper)
        path = "".join(f"M{'L'.join(_pair(corner.conjugate()) for corner in line)}" for line in lines)
        base, tip = strut.points
        look = {"fill": to_hex(strut.fill)} if strut.fill else {}
        add(self.root, "path", data_from=base, data_to=tip, data_way=way, d=path, stroke=to_hex(strut.color),
            stroke_width=strut.width, stroke_linecap=strut.cap, **look)  # fmt: skip

    def _symbol(self, symbol: Symbol) -> None:
        colors = (("fill", symbol.fill), ("stroke", symbol.edge))
        look = {key: to_hex(color) for key, color in colors if color}
        origin, turn = 0j, symbol.direction
        if symbol.link != GROUND:
            parent = self._group(self.scene.link_points(symbol.link)[0], symbol.link)
            origin, turn = self._local(symbol.link, symbol.place), turn / self.scene.rotations[symbol.link]
        elif symbol.point:
            parent = self._group(symbol.point)
        else:
            parent = add(self.root, "g", transform=_shift(self.sheet.at(symbol.place)))
        lines = [[_pair(origin + (place * turn).conjugate()) for place in line] for line in symbol.outlines]
        if symbol.radius:
            add(parent, "circle", r=symbol.radius, stroke_width=symbol.width, **look)
        elif symbol.fill:
            add(parent, "polygon", points=" ".join(lines[0]), stroke_width=symbol.width, **look)
        else:
            way = "".join(f"M{'L'.join(line)}" for line in lines)
            add(parent, "path", d=way, stroke_width=symbol.width, **look)

    def _trace(self, path: PathLook) -> None:
        """The path of a point; the script may hide it."""
        add(self.root, "path", **{"class": "moving-trace"}, d=self.sheet.path(path.path), stroke=path.color,
            stroke_width=path.width, opacity=path.share)  # fmt: skip

    def names(self, scenes: Sequence[Still], *, links: bool = True) -> None:
        """Names of the points and of the links, each where it covers least, averaged over some poses of the motion.

        Those of links stay level; the script shows them on request.
        """
        first = self.scene
        labels = [replace(label, size=_NAME) for label in callouts.point_labels(first)]
        owners = [(label.text, GROUND) for label in labels]
        for label in callouts.link_labels(first, driven=True) if links else ():
            labels.append(replace(label, size=_NAME - 2, optional=False))
            owners.append((first.link_points(label.text)[0], label.text))
        labels = [replace(label, text=style.shortened(label.text, MOST_LETTERS)) for label in labels]

        def anchors(scene: Still, label: Label, point: str, link: str) -> Floats:
            moved = (np.array(label.anchors) - first.points[point]) * scene.rotations[link] / first.rotations[link]
            return rows(self.sheet.all(scene.points[point] + moved).conj())

        places = [[anchors(scene, label, *owner) for label, owner in zip(labels, owners, strict=True)]
                  for scene in scenes]  # fmt: skip
        nets = [net(map(self._outline, shapes.mechanism_shapes(scene))) for scene in scenes]
        window = rows(np.array([-1j * self.sheet.height, self.sheet.width]))
        chosen = positions(labels, places, nets, window)
        for label, (point, link), position in zip(labels, owners, chosen, strict=True):
            if position and link == GROUND:
                group = self._group(point)
                group.set("class", KEPT)
                self._name(group, label, position)
            elif position:
                anchor = label.anchors[position.anchor]
                looks = {"data-offset": _pair(self._local(link, anchor)), "class": f"moving-name moving-off {KEPT}"}
                group = add(self.root, "g", data_at=point, data_turn=link, transform=_shift(self.sheet.at(anchor)),
                            **looks)  # fmt: skip
                self._name(group, label, position, font_style="italic")

    def _name(self, group: Element, label: Label, position: Position, **looks: str) -> None:
        """A name at its position from the origin of a group."""
        x, y = position.offset.tolist()
        color = to_hex(label.color)
        if position.leader:
            # The leader runs from the named point to the edge of the text.
            middle, width = complex(x, -y), float((label.half / np.maximum(np.abs(position.offset), 1e-9)).min())
            begin, end = middle / abs(middle) * max(label.reach - 3.0, 3.0), middle * (1 - width)
            add(group, "line", x1=begin.real, y1=begin.imag, x2=end.real, y2=end.imag, stroke=color, stroke_width=0.7)
        add(group, "text", label.text, x=x, y=0.35 * label.size - y, text_anchor="middle", font_size=label.size,
            fill=color, stroke="white", stroke_width=2.6, paint_order="stroke", **looks)  # fmt: skip

    def _outline(self, shape: Shape) -> tuple[Complexes, float, bool]:
        """The area that a shape covers: its outline on paper, its line width, and whether it is filled."""
        filled = shape.filled if isinstance(shape, Line) else shape.fill is not None
        return np.concatenate(shape.on_paper(self._on_paper)), shape.width, filled

    def ruler(self, unit: str) -> None:
        """A bar of the drawing's scale at its lower left corner."""
        length = round_down(_RULER * self.sheet.width / self.sheet.scale)
        begin, wide = complex(12, self.sheet.height - 6), length * self.sheet.scale
        group = add(self.root, "g", **{"class": KEPT})
        add(group, "path", d=f"M{_pair(begin - 4j)}v4h{_number(wide)}v-4", stroke=_STEEL)
        add(group, "text", f"{length:g} {unit}".rstrip(), x=begin.real + wide / 2, y=begin.imag - 4,
            text_anchor="middle", font_size=10, fill="#555555")  # fmt: skip


def add(parent: Element, kind: str, /, text: str | None = None, **looks: str | float) -> Element:
    """A new element with attributes, whose names have a hyphen for each underscore."""
    attributes = {
        key.replace("_", "-"): look if isinstance(look, str) else _number(look) for key, look in looks.items()
    }
    element = SubElement(parent, kind, attributes)
    element.text = text
    return element


def dashed(element: Element, dashes: Dashes, width: float) -> None:
    """Set the dashes of a line; they are multiples of its width."""
    if not isinstance(dashes, str):
        element.set("stroke-dasharray", " ".join(_number(width * part) for part in dashes[1]))


def _number(value: float) -> str:
    """A number with at most two decimals, without trailing zeros."""
    return f"{round(value, 2) + 0.0:g}"


def _pair(place: complex) -> str:
    return f"{_number(place.real)} {_number(place.imag)}"


def _digits(corner: complex) -> str:
    """A corner of a strut: three decimals of a share."""
    return f"{round(corner.real, 3):g} {_number(corner.imag)}"


def _shift(place: complex) -> str:
    return f"translate({_pair(place)})"


def _turned(direction: complex) -> str:
    return f"rotate({_number(-math.degrees(cmath.phase(direction)))})"
