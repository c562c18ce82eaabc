"""DXF sketches in ASCII, R12 to 2018: lines and polylines are links, circles are pins.

Where circles are drawn, links meet at them alone, at ends or between, and lines that touch without a circle are one
rigid link; in a drawing without circles every common end is a pin. A polyline is one link, a closed one an outline with
the circles inside as its pins. Layers, by a word in their
names: GROUND has what does not move, DRIVE the pins of inputs, TRACE the points whose paths are asked for, SLIDE fixed
lines along which the pins on them move; LINK, if there is such a layer, all that is a link.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from mechdesign.ground.errors import StudyError, cut
from mechdesign.study.importing.sketch import GROUND, MOST, FileSketch, Slide, number
from mechdesign.study.importing.source import ImportedText

NAME = "DXF sketch (ASCII)"
_TOOL = "DXF"
# Places closer than this part of the drawing's size are one.
_CLOSE = 1e-6
# Units of length by their number in the header.
_UNITS = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m"}
_WORDS = ("ground", "drive", "trace", "slide")
# Shapes with coordinates in a plane of their own; those of the others are of the drawing.
_OWN_PLANE = ("LWPOLYLINE", "POLYLINE", "CIRCLE")
_READ = ("LINE", "LWPOLYLINE", "POLYLINE", "VERTEX", "SEQEND", "CIRCLE", "POINT")


@dataclass
class _Shape:
    kind: str
    layer: str
    places: list[complex] = field(default_factory=list)
    closed: bool = False
    mirrored: bool = False

    def on(self, word: str) -> bool:
        return word in self.layer


def recognises(source: ImportedText) -> bool:
    """Whether it begins with a section, or is the binary form, which `read` refuses."""
    head = source.text[:2000].split()
    return source.text.startswith("AutoCAD Binary DXF") or head[:2] == ["0", "SECTION"] or head[:1] == ["999"]


def read(source: ImportedText) -> FileSketch:
    """Read a drawing.

    Raises
    ------
    StudyError
        If it is binary or broken, or has nothing that could be a link.
    """
    if source.text.startswith("AutoCAD Binary DXF"):
        raise StudyError("the drawing is a binary DXF: save it as DXF in ASCII, R12 to 2018")
    sketch = source.started(_TOOL)
    shapes, others, unit = _shapes(source.text)
    if unit is None:
        sketch.choices.append("the drawing says no unit: lengths are taken as mm")
    sketch.units = {"length": unit or "mm"}
    for kind, count in others.items():
        sketch.omitted.append(f"{count} of the kind {kind}")
    _Drawing(sketch, shapes).add()
    if not sketch.fixed:
        raise StudyError("no pin of the drawing is fixed: put its circle on a layer with GROUND or DRIVE in its name")
    return sketch


def _entities(text: str) -> list[tuple[str, list[tuple[int, str]]]]:
    """Each kind of an entity, with the groups of code and value that follow; a section is one, too."""
    entities: list[tuple[str, list[tuple[int, str]]]] = []
    lines = text.splitlines()
    for index in range(0, len(lines) - 1, 2):
        code, value = lines[index].strip(), lines[index + 1].strip()
        if not code.lstrip("-").isdigit() or len(code) > 5:
            raise StudyError(f"line {index + 1} of the drawing is {cut(code)!r}, not the number of a group")
        if int(code) == 0:
            entities.append((value.upper(), []))
        elif entities:
            entities[-1][1].append((int(code), value))
    return entities


def _shapes(text: str) -> tuple[list[_Shape], dict[str, int], str | None]:
    """Shapes of the model, how many there are of other kinds, and the unit of length."""
    shapes: list[_Shape] = []
    others = Counter[str]()
    unit, section = None, ""
    for kind, groups in _entities(text):
        if kind in ("SECTION", "ENDSEC"):
            section = next((value.upper() for code, value in groups if code == 2), "")
            for (_, name), (_, value) in pairwise(groups):
                if section == "HEADER" and name == "$INSUNITS":
                    unit = _UNITS.get(int(number(value, name)))
        elif section == "ENTITIES" and kind in _READ:
            _add_shape(shapes, kind, groups)
        elif section == "ENTITIES":
            others[kind] += 1
    return shapes, others, unit


def _add_shape(shapes: list[_Shape], kind: str, groups: list[tuple[int, str]]) -> None:
    layer = next((value for code, value in groups if code == 8), "").lower()
    xs = [number(value, f"x of a {kind}") for code, value in groups if code in (10, 11)]
    ys = [number(value, f"y of a {kind}") for code, value in groups if code in (20, 21)]
    outer = shapes[-1] if kind == "VERTEX" and shapes and shapes[-1].kind == "POLYLINE" else None
    mirrored = kind in _OWN_PLANE and _mirrored(kind, groups) if outer is None else outer.mirrored
    places = [complex(-x if mirrored else x, y) for x, y in zip(xs, ys, strict=False)]
    closed = any(code == 70 and value.isdigit() and int(value[:9]) & 1 for code, value in groups)
    if kind == "VERTEX":
        if outer is not None:
            outer.places += places
    elif kind == "POLYLINE":
        shapes.append(_Shape(kind, layer, closed=closed, mirrored=mirrored))
    elif kind != "SEQEND" and places:
        shapes.append(_Shape(kind, layer, places, closed and kind == "LWPOLYLINE"))
    if len(shapes) > MOST or sum(len(shape.places) for shape in shapes[-1:]) > MOST:
        raise StudyError(
            f"the drawing has more than {MOST} lines and circles, or corners of a polyline; take a part of it"
        )


def _mirrored(kind: str, groups: list[tuple[int, str]]) -> bool:
    """Whether the plane of a shape, given by its normal, is seen from behind: its x points to the left.

    Raises
    ------
    StudyError
        If the plane is inclined.
    """
    given = {code: number(value, f"the plane of a {kind}") for code, value in groups if code in (210, 220, 230)}
    x, y, z = (given.get(code, default) for code, default in ((210, 0.0), (220, 0.0), (230, 1.0)))
    if max(abs(x), abs(y)) > _CLOSE * abs(z):
        raise StudyError(f"a {kind} of the drawing lies in an inclined plane: draw it in the x-y plane")
    return z < 0


class _Drawing:
    """The links and pins that shapes stand for."""

    def __init__(self, sketch: FileSketch, shapes: list[_Shape]) -> None:
        self.sketch = sketch
        of_links = [shape for shape in shapes if shape.kind in ("LINE", "LWPOLYLINE", "POLYLINE")]
        self.circles = [shape for shape in shapes if shape.kind in ("CIRCLE", "POINT")]
        self.guides = [shape for shape in of_links if shape.on("slide") and shape.kind == "LINE"]
        named = any(shape.on("link") for shape in of_links)
        self.bars = [s for s in of_links if not s.on("slide") and (s.on("ground") or not named or s.on("link"))]
        left = len(of_links) - len(self.bars) - len(self.guides)
        if left:
            sketch.omitted.append(f"{left} lines that are on no layer of links")
        if not [bar for bar in self.bars if not bar.on("ground")]:
            raise StudyError("the drawing has no line or polyline that could be a link")
        corners = [place for shape in shapes for place in shape.places]
        size = float(max(np.ptp(np.real(corners)), np.ptp(np.imag(corners))))
        self.close = _CLOSE * size or _CLOSE

    def add(self) -> None:
        """Add points where links meet, begin or end, then the links, what is fixed, slides and drives."""
        pins = [circle for circle in self.circles if circle.kind == "CIRCLE"]
        places = [shape.places[0] for shape in self.circles]
        places += [place for bar in self.bars if not self._inside(bar) for place in bar.places]
        places += [place for guide in self.guides for place in guide.places]
        for place in places:
            if self._at(place) is None:
                self._add_point(place)
        pinned = {self._at(circle.places[0]) for circle in pins}
        for count, group in enumerate(self._links(pinned), 1):
            self.sketch.add_link(f"link_{count}", group)
        loose = [name for name in self.sketch.points if name in pinned and not self.sketch.links_with(name)]
        if loose:
            self.sketch.omitted.append(f"circles that lie on no link: {', '.join(map(self._written, loose))}")
        self._add_slides()
        for circle in self.circles:
            if circle.on("drive"):
                self.sketch.drives.append(self.sketch.drive_at(str(self._at(circle.places[0]))))
        if pins:
            self.sketch.choices.append("circles are pins; lines that touch without one are one rigid link")
        else:
            self.sketch.choices.append("the drawing has no circles: common ends of lines are pins")

    def _written(self, name: str) -> str:
        place = self.sketch.points[name]
        return f"{name} at ({place.real:.6g}, {place.imag:.6g})"

    def _at(self, place: complex) -> str | None:
        return next((name for name, other in self.sketch.points.items() if abs(other - place) <= self.close), None)

    def _add_point(self, place: complex) -> None:
        marks, bars, guides = (
            [shape for shape in shapes if any(abs(corner - place) <= self.close for corner in shape.places)]
            for shapes in (self.circles, self.bars, self.guides)
        )
        fixed = bool(guides) or any(shape.on("ground") for shape in (*bars, *marks))
        fixed |= any(mark.on("drive") for mark in marks)
        traced = any(mark.on("trace") for mark in marks)
        self.sketch.add_point(f"P{len(self.sketch.points) + 1}", place.real, place.imag, traced=traced, fixed=fixed)

    def _links(self, pinned: set[str | None]) -> list[list[str]]:
        """Points of each link: bars that touch without a pin are one."""
        groups: list[set[str]] = []
        for bar in self.bars:
            if bar.on("ground"):
                continue
            ends = {str(self._at(place)) for place in self._inside(bar) or bar.places}
            marked = pinned | self.sketch.traced
            ends |= {name for name, place in self.sketch.points.items() if name in marked and self._lies_on(bar, place)}
            touching = [group for group in groups if pinned and any(end not in pinned for end in group & ends)]
            groups = [group for group in groups if group not in touching]
            groups.append(ends.union(*touching))
        order = list(self.sketch.points)
        return [sorted(group, key=order.index) for group in groups]

    def _inside(self, bar: _Shape) -> list[complex]:
        """Circles and points in a closed outline or on it."""
        places = [circle.places[0] for circle in self.circles] if bar.closed else []
        return [place for place in places if self._lies_on(bar, place) or _encloses(bar.places, place)]

    def _lies_on(self, bar: _Shape, place: complex) -> bool:
        ends = bar.places[1:] + (bar.places[:1] if bar.closed else [])
        return any(_distance(a, b, place) <= self.close for a, b in zip(bar.places, ends, strict=False))

    def _add_slides(self) -> None:
        for count, guide in enumerate(self.guides, 1):
            ends = [str(self._at(place)) for place in guide.places[:2]]
            riders = [
                name for name, place in self.sketch.points.items()
                if name not in self.sketch.fixed and self.sketch.links_with(name)
                and _distance(guide.places[0], guide.places[1], place) <= self.close
            ]  # fmt: skip
            for name in riders:
                label = f"slide_{count}" if len(riders) == 1 else f"slide_{count}_{name}"
                self.sketch.slides[label] = Slide(name, GROUND, (ends[0], ends[1]), limited=True)
            if not riders:
                self.sketch.omitted.append(f"the guide from {ends[0]!r} to {ends[1]!r}, on which no pin lies")


def _encloses(corners: list[complex], place: complex) -> bool:
    """Whether an outline goes round a place: a ray from there crosses it an odd number of times."""
    crossed = False
    for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
        if (a.imag > place.imag) != (b.imag > place.imag):
            crossed ^= place.real < (a + (place.imag - a.imag) / (b.imag - a.imag) * (b - a)).real
    return crossed


def _distance(a: complex, b: complex, place: complex) -> float:
    """Distance of a place from a line segment."""
    along, to = b - a, place - a
    if not along:
        return abs(to)
    share = min(1.0, max(0.0, (to * along.conjugate()).real / abs(along) ** 2))
    return abs(to - share * along)
