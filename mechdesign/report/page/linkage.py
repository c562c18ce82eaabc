"""A mechanism as SVG whose parts a script moves: a group for each rigid part, drawn in the frame of its link.

What moves says so by attributes: `data-at` names the point that a group stays at, `data-turn` the link that it turns
with; a line with `data-from`, `data-to` and `data-part` runs between two shares of the way from one point to another.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from matplotlib.colors import to_hex
from matplotlib.path import Path

from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.graph import GROUND
from mechdesign.numerics.arrays import Complexes
from mechdesign.report.figures import style
from mechdesign.report.figures.drawing import (
    BAR,
    GROUND_HEIGHT,
    PIN,
    SLIDER_SIZE,
    Color,
    Travel,
    bodies,
    darker,
    lighter,
    link_colors,
    reach,
)
from mechdesign.report.figures.framing import fit
from mechdesign.report.figures.scene import Guide, Scene

# Of a drawing, in its own units, which are about points on paper: its width, its height at most, room around.
WIDTH = 520.0
MAX_HEIGHT = 470.0
_PAD = 30.0
_STRIP = 14.0  # below, for the bar of the scale
_POINTS = 72.0
_STEEL = "#777777"
_RAIL_SPACING = 6.0
_NAME = 12.0  # size of letters
_LETTER = 0.6  # width of a letter in sizes
_DIRECTIONS = 8  # in which names may stand
_NET = np.linspace(0, 1, 9)  # places along a bar that names should not cover
_FOOT = np.array([-10, -5, 0, 5, 10]) + 8j  # places that the symbol of a pivot covers
_ROUND = ("stroke-linecap", "stroke-linejoin")
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
    """Draws a pose of a mechanism into an SVG element, layer by layer as `report.figures.drawing` does."""

    def __init__(self, root: Element, sheet: Sheet, mechanism: Mechanism, scene: Scene) -> None:
        self.root, self.sheet, self.scene = root, sheet, scene
        self.colors = {name: to_hex(color) for name, color in link_colors(mechanism).items()}

    def body(self, name: str) -> Body:
        """The frame in which the parts of a link are drawn."""
        point = self.scene.link_points(name)[0]
        return Body(name, point, self.scene.points[point], self.scene.rotations[name], self.sheet.scale)

    def draw(self, travel: Travel) -> None:
        """The mechanism without its names."""
        scene = self.scene
        for point in scene.pivots():
            self._pivot(scene.points[point])
        slotted = []
        for guide in scene.guides:
            ends = guide.ends(travel, scene.span)
            if guide.owner == GROUND:
                self._rail(*ends)
            else:
                self._bar(guide.owner, reach(scene, guide, ends))
                if guide.slider is None:
                    slotted.append((guide.owner, ends))
        # Plates below bars, as there.
        for name, corners in sorted(bodies(scene), key=lambda found: len(found[1]) < 3):
            if len(corners) > 2:
                self._plate(name, corners)
            elif len(corners) == 2:
                self._bar(name, corners)
        for owner, ends in slotted:
            _line(self._moved(self.body(owner)), map(self.body(owner).local, ends), "white", BAR - 3.4)
        for name, link in scene.description.links.items():
            if link.telescopic and link.ends:
                self._leg(*link.ends, self.colors[name])
        for guide in scene.guides:
            if guide.slider is not None:
                self._block(guide, guide.slider)
        owners: dict[str, str] = {}
        for name in scene.description.links:
            for point in scene.link_points(name):
                owners.setdefault(point, name)
        for point, kind in scene.kinds().items():
            if kind != "none":
                self._joint(point, kind, self.colors[owners[point]])

    def _moved(self, body: Body) -> Element:
        """A group that moves with a link."""
        transform = f"{_shift(self.sheet.at(body.place))} {_turned(body.turn)}"
        return add(self.root, "g", data_at=body.point, data_turn=body.name, transform=transform)

    def _placed(self, point: str) -> Element:
        """A group that stays at a point."""
        return add(self.root, "g", data_at=point, transform=_shift(self.sheet.at(self.scene.points[point])))

    def _pivot(self, place: complex) -> None:
        foot = GROUND_HEIGHT - 3
        group = add(self.root, "g", transform=_shift(self.sheet.at(place)), stroke=style.INK)
        add(group, "path", d=f"M0 0L-8 {foot:g}L8 {foot:g}z", fill="#EEEEEE", stroke_width=1.2)
        hatch = "".join(f"M{-10 + 5.5 * k:g} {foot:g}l-4 4" for k in range(5))
        add(group, "path", d=f"M-12 {foot:g}H12{hatch}", stroke_width=1.1)

    def _rail(self, start: complex, end: complex) -> None:
        """A guide fixed to the ground: the slide's line, and a hatched rail on its lower side."""
        ends = sorted((self.sheet.at(start), self.sheet.at(end)), key=lambda place: (place.real, place.imag))
        _line(self.root, ends, _STEEL, 0.8).set("stroke-dasharray", "9 3 2 3")
        length = abs(ends[1] - ends[0])
        along = (ends[1] - ends[0]) / length
        down = 1j * along
        begin = ends[0] + down * (SLIDER_SIZE[1] / 2 + 1.2)
        marks = [begin + along * step for step in np.arange(_RAIL_SPACING, length, _RAIL_SPACING).tolist()]
        hatch = "".join(f"M{_pair(mark)}l{_pair((down - along) * 3.5)}" for mark in marks)
        way = f"M{_pair(begin)}L{_pair(begin + along * length)}{hatch}"
        add(self.root, "path", d=way, stroke=style.INK, stroke_width=1.1)

    def _bar(self, name: str, ends: Sequence[complex]) -> None:
        body, color = self.body(name), self.colors[name]
        group = self._moved(body)
        _line(group, map(body.local, ends), color, BAR)
        _line(group, map(body.local, ends), lighter(color), BAR - 2.4)

    def _plate(self, name: str, corners: Sequence[complex]) -> None:
        body, color = self.body(name), self.colors[name]
        group = self._moved(body)
        outline = "L".join(_pair(body.local(corner)) for corner in corners)
        for shade, width in ((color, BAR), (to_hex(lighter(color)), BAR - 2.4)):
            add(group, "path", d=f"M{outline}z", fill=shade, stroke=shade, stroke_width=width)

    def _leg(self, base: str, tip: str, color: str) -> None:
        """A telescopic leg: cylinder from the base, rod to the tip."""
        looks = (("0 1", color, 3.6, "round"), ("0 1", lighter(color), 1.6, "round"),
                 ("0.12 0.58", color, BAR + 3, "butt"), ("0.123 0.577", lighter(color), BAR + 0.6, "butt"))  # fmt: skip
        begin, end = (self.sheet.at(self.scene.points[point]) for point in (base, tip))
        for part, shade, width, cap in looks:
            one, two = (begin + float(share) * (end - begin) for share in part.split())
            add(self.root, "line", data_from=base, data_to=tip, data_part=part, x1=one.real, y1=one.imag, x2=two.real,
                y2=two.imag, stroke=to_hex(shade), stroke_width=width, stroke_linecap=cap)  # fmt: skip

    def _block(self, guide: Guide, slider: str) -> None:
        """A slider, which lies along its guide."""
        wide, high = SLIDER_SIZE
        color, body = self.colors[slider], self.body(slider)
        transform = f"{_shift(body.local(guide.pin))} {_turned(guide.along / body.turn)}"
        add(self._moved(body), "rect", x=-wide / 2, y=-high / 2, width=wide, height=high, transform=transform,
            fill=to_hex(lighter(color)), stroke=color, stroke_width=1.4)  # fmt: skip

    def _joint(self, point: str, kind: str, color: str) -> None:
        group = self._placed(point)
        if kind == "clamp":
            add(group, "rect", x=-PIN, y=-PIN, width=2 * PIN, height=2 * PIN, fill=style.INK)
        elif kind == "pin":
            add(group, "circle", r=PIN, fill="white", stroke=style.INK, stroke_width=1.5)
        else:
            add(group, "circle", r=PIN - 0.8, fill=color, stroke=style.INK, stroke_width=1)

    def trace(self, places: Complexes, color: str, width: float, share: float) -> None:
        """The path of a point; the script may hide it."""
        add(self.root, "path", **{"class": "moving-trace"}, d=self.sheet.path(places), stroke=color,
            stroke_width=width, opacity=share)  # fmt: skip

    def names(self, scenes: Sequence[Scene]) -> None:
        """Names of the points, each on the side where it covers least in some poses of the motion, and of the links."""
        slid = {guide.point for guide in self.scene.guides if guide.slider is not None}
        shown = [point for point, kind in self.scene.kinds().items() if kind != "none" or point in slid]
        nets = [self._covered(scene) for scene in scenes]
        for point in shown:
            half = complex(_LETTER * _NAME * len(point), _NAME) / 2
            costs = []
            for k in range(_DIRECTIONS):
                toward = cmath.exp(2j * math.pi * k / _DIRECTIONS - 0.25j * math.pi)
                shift = (PIN + 4) * toward + complex(half.real * _clip(toward.real), half.imag * _clip(toward.imag))
                cost = 0.02 * k
                for scene, net in zip(scenes, nets, strict=True):
                    away = net - self.sheet.at(scene.points[point]) - shift
                    inside = (np.abs(away.real) < half.real + 2) & (np.abs(away.imag) < half.imag + 2)
                    cost += np.count_nonzero(inside) / len(scenes)
                costs.append((cost, k, shift))
            _, _, shift = min(costs, key=lambda found: found[:2])
            add(self._placed(point), "text", point, x=shift.real, y=shift.imag + 0.35 * _NAME, text_anchor="middle",
                font_size=_NAME, fill=style.INK, stroke="white", stroke_width=2.6, paint_order="stroke")  # fmt: skip

        for name in self.scene.description.links:
            if name != GROUND:
                self._link_name(name)

    def _link_name(self, name: str) -> None:
        """A link's name at its middle, which stays level; the script shows it on request."""
        body, ends = self.body(name), self.scene.link_points(name)
        middle = sum(self.scene.points[point] for point in ends) / len(ends)
        at, offset = self.sheet.at(middle), body.local(middle)
        looks = {"data-offset": _pair(offset), "class": "moving-name moving-off"}
        group = add(self.root, "g", data_at=body.point, data_turn=name, transform=_shift(at), **looks)
        # Above the middle of a bar, in a plate, below a slider, whose point has its name above.
        y = {1: SLIDER_SIZE[1] / 2 + _NAME, 2: -BAR / 2 - 3}.get(len(ends), 0.35 * _NAME)
        color = to_hex(darker(self.colors[name]))
        add(group, "text", name, y=y, text_anchor="middle", font_size=_NAME - 2, font_style="italic", fill=color,
            stroke="white", stroke_width=2.6, paint_order="stroke")  # fmt: skip

    def _covered(self, scene: Scene) -> Complexes:
        """Places along the links of a pose, and its joints."""
        found = [np.array([self.sheet.at(place) for place in scene.points.values()])]
        found += [self.sheet.at(scene.points[point]) + _FOOT for point in scene.pivots()]
        for name in scene.description.links.keys() - {GROUND}:
            corners = [self.sheet.at(scene.points[point]) for point in scene.link_points(name)]
            for begin, end in zip(corners, corners[1:] + corners[:1], strict=True):
                found.append(begin + _NET * (end - begin))
        return np.concatenate(found)

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


def rounded(value: float) -> float:
    """The largest of 1, 2, 5 times powers of ten that is not above a value."""
    power = 10.0 ** math.floor(math.log10(value))
    return max(step * power for step in (1, 2, 5) if step * power <= value)


def _clip(part: float) -> float:
    return max(-1.0, min(1.0, 1.3 * part))


def _number(value: float) -> str:
    """Two decimals, as short as they can be written."""
    return f"{round(value, 2) + 0.0:g}"


def _pair(place: complex) -> str:
    return f"{_number(place.real)} {_number(place.imag)}"


def _shift(place: complex) -> str:
    return f"translate({_pair(place)})"


def _turned(direction: complex) -> str:
    return f"rotate({_number(-math.degrees(cmath.phase(direction)))})"


def _line(group: Element, ends: Iterable[complex], color: Color, width: float) -> Element:
    return add(group, "path", d=f"M{'L'.join(map(_pair, ends))}", stroke=to_hex(color), stroke_width=width)
