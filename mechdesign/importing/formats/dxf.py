"""DXF sketches in ASCII, R12 to 2018: lines and polylines are links, circles are pins.

Where circles are drawn, links meet at them alone, at ends or between, and lines that touch without a circle are one
rigid link; in a drawing without circles every common end is a pin. A polyline is one link, a closed one an outline with
the circles inside as its pins. Layers, by a word in their
names: GROUND has what does not move, DRIVE the pins of inputs, TRACE the points whose paths are asked for, SLIDE fixed
lines along which the pins on them move; LINK, if there is such a layer, all that is a link.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from mechdesign.errors import StudyError, cut
from mechdesign.importing.sketch import GROUND, MOST, Drive, Sketch, Slide, number
from mechdesign.importing.source import Source

NAME = "DXF sketch (ASCII)"
_TOOL = "DXF"
# Places closer than this part of the drawing's size are one.
_CLOSE = 1e-6
# Units of length by their number in the header.
_UNITS = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m"}
_WORDS = ("ground", "drive", "trace", "slide")
_READ = ("LINE", "LWPOLYLINE", "POLYLINE", "VERTEX", "SEQEND", "CIRCLE", "POINT")


class _Place(NamedTuple):
    x: float
    y: float


@dataclass
class _Shape:
    kind: str
    layer: str
    places: list[_Place] = field(default_factory=list)
    closed: bool = False

    def on(self, word: str) -> bool:
        return word in self.layer


def recognises(source: Source) -> bool:
    """Whether it begins with a section, or is the binary form, which `read` refuses."""
    head = source.text[:2000].split()
    return source.text.startswith("AutoCAD Binary DXF") or head[:2] == ["0", "SECTION"] or head[:1] == ["999"]


def read(source: Source) -> Sketch:
    """Read a drawing.

    Raises
    ------
    StudyError
        If it is binary or broken, or has nothing that could be a link.
    """
    if source.text.startswith("AutoCAD Binary DXF"):
        raise StudyError("a binary DXF: save it as ASCII")
    sketch = source.started(_TOOL)
    shapes, others, unit = _shapes(list(_pairs(source.text)))
    if unit is None:
        sketch.choices.append("the drawing says no unit: lengths are taken as mm")
    sketch.units = {"length": unit or "mm"}
    for kind, count in others.items():
        sketch.omitted.append(f"{count} of the kind {kind}")
    _Drawing(sketch, shapes).add()
    if not sketch.fixed:
        raise StudyError("no pin of the drawing is fixed: put its circle on a layer with GROUND or DRIVE in its name")
    return sketch


def _pairs(text: str) -> Iterator[tuple[int, str]]:
    lines = text.splitlines()
    for index in range(0, len(lines) - 1, 2):
        code = lines[index].strip()
        if not code.lstrip("-").isdigit() or len(code) > 5:
            raise StudyError(f"line {index + 1} of the drawing is {cut(code)!r}, not the number of a group")
        yield int(code), lines[index + 1].strip()


def _shapes(pairs: list[tuple[int, str]]) -> tuple[list[_Shape], dict[str, int], str | None]:
    """Shapes of the model, how many there are of other kinds, and the unit of length."""
    shapes: list[_Shape] = []
    others: dict[str, int] = {}
    unit, section, kind, variable = None, "", "", ""
    groups: list[tuple[int, str]] = []

    def end() -> None:
        if section == "ENTITIES" and kind in _READ:
            _add_shape(shapes, kind, groups)
        elif section == "ENTITIES" and kind not in ("", "SECTION", "ENDSEC"):
            others[kind] = others.get(kind, 0) + 1

    for code, value in pairs:
        if code == 0:
            end()
            kind, groups = value.upper(), []
        elif code == 2 and kind == "SECTION" and not groups:
            section = value.upper()
        elif code == 9:
            variable = value
        elif code == 70 and variable == "$INSUNITS" and section == "HEADER":
            unit, variable = _UNITS.get(int(number(value, "$INSUNITS"))), ""
        else:
            groups.append((code, value))
        if kind == "ENDSEC":
            section = ""
    end()
    return shapes, others, unit


def _add_shape(shapes: list[_Shape], kind: str, groups: list[tuple[int, str]]) -> None:
    layer = next((value for code, value in groups if code == 8), "").lower()
    xs = [number(value, f"x of a {kind}") for code, value in groups if code in (10, 11)]
    ys = [number(value, f"y of a {kind}") for code, value in groups if code in (20, 21)]
    places = [_Place(x, y) for x, y in zip(xs, ys, strict=False)]
    closed = any(code == 70 and value.isdigit() and int(value[:9]) & 1 for code, value in groups)
    if kind == "VERTEX":
        if shapes and shapes[-1].kind == "POLYLINE":
            shapes[-1].places += places
    elif kind == "POLYLINE":
        shapes.append(_Shape(kind, layer, closed=closed))
    elif kind != "SEQEND" and places:
        shapes.append(_Shape(kind, layer, places, closed and kind == "LWPOLYLINE"))
    if len(shapes) > MOST or sum(len(shape.places) for shape in shapes[-1:]) > MOST:
        raise StudyError(
            f"the drawing has more than {MOST} lines and circles, or corners of a polyline; take a part of it"
        )


class _Drawing:
    """The links and pins that shapes stand for."""

    def __init__(self, sketch: Sketch, shapes: list[_Shape]) -> None:
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
        size = max(max(p[k] for p in corners) - min(p[k] for p in corners) for k in (0, 1))
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
        groups = self._links(pinned)
        for count, group in enumerate(groups, 1):
            self.sketch.add_link(f"link_{count}", group)
        self._add_slides(pinned)
        for circle in self.circles:
            if circle.on("drive"):
                self._add_drive(str(self._at(circle.places[0])))
        if pins:
            self.sketch.choices.append("circles are pins; lines that touch without one are one rigid link")
        else:
            self.sketch.choices.append("the drawing has no circles: common ends of lines are pins")

    def _at(self, place: _Place) -> str | None:
        return next((n for n, p in self.sketch.points.items() if math.dist((p.x, p.y), place) <= self.close), None)

    def _add_point(self, place: _Place) -> None:
        marks = [c for c in self.circles if math.dist(c.places[0], place) <= self.close]
        grounds = [s for s in self.bars if s.on("ground") and any(math.dist(p, place) <= self.close for p in s.places)]
        grounds += [c for c in marks if c.on("ground") or c.on("drive")]
        on_guides = [g for g in self.guides if any(math.dist(p, place) <= self.close for p in g.places)]
        traced = any(mark.on("trace") for mark in marks)
        name = f"P{len(self.sketch.points) + 1}"
        self.sketch.add_point(name, *place, traced=traced, fixed=bool(grounds or on_guides))

    def _links(self, pinned: set[str | None]) -> list[list[str]]:
        """Points of each link: bars that touch without a pin are one."""
        groups: list[set[str]] = []
        for bar in self.bars:
            if bar.on("ground"):
                continue
            inside = self._inside(bar)
            ends = {str(self._at(place)) for place in inside or bar.places}
            for name, point in self.sketch.points.items():
                if (name in pinned or point.traced) and self._lies_on(bar, _Place(point.x, point.y)):
                    ends.add(name)
            touching = [group for group in groups if pinned and any(end not in pinned for end in group & ends)]
            groups = [group for group in groups if group not in touching]
            groups.append(ends.union(*touching))
        order = list(self.sketch.points)
        return [sorted(group, key=order.index) for group in groups]

    def _inside(self, bar: _Shape) -> list[_Place]:
        """Circles and points in a closed outline or on it."""
        places = [circle.places[0] for circle in self.circles] if bar.closed else []
        return [place for place in places if self._lies_on(bar, place) or _encloses(bar.places, place)]

    def _lies_on(self, bar: _Shape, place: _Place) -> bool:
        ends = bar.places[1:] + (bar.places[:1] if bar.closed else [])
        return any(_distance(a, b, place) <= self.close for a, b in zip(bar.places, ends, strict=False))

    def _add_slides(self, pinned: set[str | None]) -> None:
        for count, guide in enumerate(self.guides, 1):
            ends = [str(self._at(place)) for place in guide.places[:2]]
            riders = [
                name for name, point in self.sketch.points.items()
                if name not in self.sketch.fixed and self.sketch.links_at(name)
                and _distance(guide.places[0], guide.places[1], _Place(point.x, point.y)) <= self.close
            ]  # fmt: skip
            for name in riders:
                label = f"slide_{count}" if len(riders) == 1 else f"slide_{count}_{name}"
                self.sketch.slides[label] = Slide(name, GROUND, (ends[0], ends[1]), limited=True)
            if not riders:
                self.sketch.omitted.append(f"the guide from {ends[0]!r} to {ends[1]!r}, on which no pin lies")

    def _add_drive(self, name: str) -> None:
        links = self.sketch.moving_at(name)
        if len(links) != 1:
            raise StudyError(f"the pin {name!r} on the layer of drives belongs to {len(links)} links, not one")
        self.sketch.drives.append(Drive("angle", links[0]))


def _encloses(corners: list[_Place], place: _Place) -> bool:
    """Whether an outline goes round a place: a ray from there crosses it an odd number of times."""
    crossed = False
    for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
        if (a.y > place.y) != (b.y > place.y):
            crossed ^= place.x < a.x + (place.y - a.y) / (b.y - a.y) * (b.x - a.x)
    return crossed


def _distance(a: _Place, b: _Place, place: _Place) -> float:
    """Distance of a place from a line segment."""
    along, to = complex(b.x - a.x, b.y - a.y), complex(place.x - a.x, place.y - a.y)
    if not along:
        return abs(to)
    share = min(1.0, max(0.0, (to * along.conjugate()).real / abs(along) ** 2))
    return abs(to - share * along)
