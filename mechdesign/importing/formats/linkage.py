"""Linkage by David Rector (https://blog.rectorsquid.com): ``.linkage2`` files, which are XML.

Connectors are points, anchors those of the ground; a connector is an input of so many turns a minute, clockwise for
positive ones; a slider moves on the line of two connectors. Lengths are 96 to the inch, whatever the unit is that the
program shows [rectorsquid/Linkage, LinkageDoc.cpp, Simulator.cpp].
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any
from xml.parsers import expat

from mechdesign.errors import StudyError
from mechdesign.importing.names import clean
from mechdesign.importing.sketch import GROUND, Drive, Gears, Sketch, Slide, number
from mechdesign.importing.source import Source

NAME = "Linkage (.linkage2)"
_TOOL = "Linkage"
_ROOT = "linkage2"
# Deepest nesting of elements, and most of them.
_DEEPEST = 10
_MOST_ELEMENTS = 50_000
# What the program shows of a unit of the file; its millimetres are 24.5 to the inch.
_UNITS = {"Millimeters": ("mm", 24.5 / 96), "Inches": ("in", 1 / 96)}
# The layer of what is drawn only.
_DRAWING = 1


@dataclass
class _Element:
    tag: str
    attributes: dict[str, str] = field(default_factory=dict)
    children: list[_Element] = field(default_factory=list)

    def get(self, key: str) -> str:
        return self.attributes.get(key, "")

    def is_true(self, key: str) -> bool:
        return self.get(key) == "true"

    def number(self, key: str) -> float:
        return number(self.get(key) or 0, f"{key} of {self.tag.lower()} {self.get('id')}")

    def all(self, *tags: str) -> list[_Element]:
        return [child for child in self.children if child.tag in tags]

    def ids(self, tag: str) -> list[str]:
        return [child.get("id") for child in self.all(tag)]


def recognises(source: Source) -> bool:
    """Whether its first element is `linkage2`."""
    return f"<{_ROOT}" in source.text[:2000]


def read(source: Source) -> Sketch:
    """Read a file.

    Raises
    ------
    StudyError
        If it is not well formed, or has what no mechanism has.
    """
    root = _parsed(source.text)
    sketch = source.started(_TOOL)
    program = next(iter(root.all("program")), _Element("program"))
    unit, scale = _UNITS.get(program.get("units"), _UNITS["Millimeters"])
    sketch.units = {"length": unit}
    sketch.choices.append(f"96 units of the file are {96 * scale:.6g} {unit}, as the program shows them")
    return _Reader(sketch, root, scale).finish()


def _parsed(text: str) -> _Element:
    parser = expat.ParserCreate()
    top = _Element("")
    path, count = [top], 0

    def refuse(*_: Any) -> None:
        raise StudyError("the file declares a document type or entities, which no Linkage file has")

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if count > _MOST_ELEMENTS or len(path) > _DEEPEST:
            raise StudyError("the file has more elements, or deeper ones, than a Linkage file")
        element = _Element(tag, attributes)
        path[-1].children.append(element)
        path.append(element)

    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refuse
    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: path.pop()
    try:
        parser.Parse(text.encode(errors="surrogatepass"), True)
    except expat.ExpatError as error:
        raise StudyError(f"the file is no XML: {error}") from None
    roots = top.all(_ROOT)
    if not roots:
        raise StudyError(f"the file has no element {_ROOT!r}")
    return roots[0]


class _Reader:
    def __init__(self, sketch: Sketch, root: _Element, scale: float) -> None:
        self.sketch, self._root, self._scale = sketch, root, scale
        self._connectors = {c.get("id"): c for c in root.all("connector") if not _drawn(c)}
        # Files may give several links one number, which then stands for the first.
        self._links = [link for link in root.all("Link", "element") if not _drawn(link)]
        self._points: dict[str, str] = {}
        self._names: dict[str, str] = {}

    def finish(self) -> Sketch:
        """Take over all that is not drawn only."""
        drawn = len(self._root.all("connector", "Link", "element")) - len(self._connectors) - len(self._links)
        if drawn:
            self.sketch.omitted.append(f"{drawn} points and lines that are drawn or measure only")
        for key, connector in self._connectors.items():
            self._add_connector(key, connector)
        names = [self._add_link(link) for link in self._links]
        self._fasten(names)
        for key, connector in self._connectors.items():
            if connector.is_true("slider"):
                self._add_slide(key, connector)
        for ratio in (ratio for group in self._root.all("ratios") for ratio in group.all("ratio")):
            self._add_gears(ratio)
        for key, connector in self._connectors.items():
            if connector.is_true("input"):
                self._add_input(key, connector)
        self.sketch.omitted.append("colours, layers, zoom and what is selected")
        return self.sketch

    def _add_connector(self, key: str, connector: _Element) -> None:
        name = connector.get("name") or f"P{key}"
        self._points[key] = name = name if name not in self.sketch.points else f"{name}_{key}"
        x, y = self._scale * connector.number("x"), self._scale * connector.number("y")
        fixed = connector.is_true("anchor")
        traced = connector.is_true("draw")
        self.sketch.add_point(name, x, y, traced=traced, fixed=fixed)

    def _add_link(self, link: _Element) -> str:
        """Add a link and return its name, which is one of its own."""
        key = link.get("id")
        first, count = link.get("name") or f"link_{key}", 1
        name = first
        while name in self.sketch.links:
            count += 1
            name = f"{first}_{count}"
        self._names.setdefault(key, name)
        points = list(dict.fromkeys(self._points[end] for end in link.ids("connector") if end in self._points))
        actuator = link.is_true("actuator") and len(points) == 2
        self.sketch.add_link(name, points, telescopic=actuator)
        if actuator:
            self._add_actuator(name, link)
        return name

    def _add_actuator(self, name: str, link: _Element) -> None:
        """An actuator grows by its throw and shrinks again, so many times a minute; negative ones pull."""
        length = self.sketch.distance(*self.sketch.links[name].points)
        throw = self._scale * link.number("throw")
        cycles = link.number("cpm")
        low, high = (length, length + throw) if cycles >= 0 else (length - throw, length)
        if not throw > 0 or low <= 0:
            raise StudyError(f"actuator {name!r} is {length:.6g} long and has a throw of {throw:.6g}")
        speed = math.copysign(2 * throw * abs(cycles) / 60, cycles)
        self.sketch.drives.append(
            Drive("length", name, speed=speed, span=(low, high), held=link.is_true("alwaysmanual"))
        )

    def _fasten(self, names: list[str]) -> None:
        """Links that are fastened to links or anchors, and the links of an input, which turn as one."""
        sketch = self.sketch
        for name, link in zip(names, self._links, strict=True):
            anchor = link.get("fastenconnector")
            if link.get("fastenlink") in self._names:
                sketch.welds.append((self._names[link.get("fastenlink")], name))
            elif anchor in self._points and self._points[anchor] in sketch.fixed:
                sketch.welds.append((GROUND, name))
            elif anchor:
                sketch.omitted.append(f"that link {name!r} is fastened to a connector which is no anchor")
        for key, connector in self._connectors.items():
            holder = self._names.get(connector.get("fastenlink") or connector.get("fasten"))
            if holder is not None and self._points[key] not in sketch.links[holder].points:
                sketch.links[holder].points.append(self._points[key])
            if connector.is_true("input") and connector.is_true("anchor"):
                sketch.welds.append(tuple(self._turned(key)))

    def _turned(self, key: str) -> list[str]:
        """The links that an input turns: all at its anchor, but those that are fastened or lie between anchors."""
        held = {name for weld in self.sketch.welds if weld[:1] == (GROUND,) for name in weld[1:]}
        moving = self.sketch.moving_at(self._points[key])
        return [
            name for name in self.sketch.links_at(self._points[key])
            if name not in held and (name in moving or len(self.sketch.links[name].points) == 1)
        ]  # fmt: skip

    def _add_slide(self, key: str, connector: _Element) -> None:
        name = self._points[key]
        ends = [self._points[end] for end in connector.ids("slidelimit") if end in self._points][:2]
        if len(ends) < 2:
            self.sketch.omitted.append(f"slider {name!r}, which has no two limits")
            return
        if connector.number("slideradius"):
            raise StudyError(
                f"slider {name!r} moves on an arc; a study has straight slides, and a link about its centre"
            )
        guides = [link for link in self.sketch.links_at(ends[0]) if ends[1] in self.sketch.links[link].points]
        if {*ends} <= {*self.sketch.fixed}:
            guides = [GROUND]
        if not guides or name in ends:
            raise StudyError(f"slider {name!r} moves between {ends[0]!r} and {ends[1]!r}, which are on no common link")
        self.sketch.slides[clean(f"{name}_slide")] = Slide(name, guides[0], (ends[0], ends[1]), limited=True)

    def _add_gears(self, ratio: _Element) -> None:
        """Two wheels; with a chain they turn alike. The sizes are radii, or else only their ratio counts."""
        ends = [end for end in ratio.all("link") if end.get("id") in self._names][:2]
        if len(ends) < 2:
            self.sketch.omitted.append("a ratio of gears that are not there")
            return
        one, other = (self._names[end.get("id")] for end in ends)
        first, second = (end.number("size") for end in ends)
        if not (first > 0 and second > 0) or not all(self.sketch.links[name].points for name in (one, other)):
            raise StudyError(f"gears {one!r} and {other!r} have the sizes {first:g} and {second:g}")
        chain = ratio.get("type") != "gears"
        radius = self._scale * first if chain and ratio.is_true("sizeassize") else None
        axes = self.sketch.links[one].points[0], self.sketch.links[other].points[0]
        turn = second / first if chain else -second / first
        self.sketch.gears.append(Gears(one, other, turn, axes, chain, radius))

    def _add_input(self, key: str, connector: _Element) -> None:
        name, links = self._points[key], self._turned(key)
        if not links:
            self.sketch.omitted.append(f"input {name!r}, which turns no link")
            return
        base = GROUND if name in self.sketch.fixed else links.pop()
        if not links:
            raise StudyError(f"input {name!r} is no anchor and has one link alone")
        # Positive turns are clockwise.
        speed = -connector.number("rpm") * math.pi / 30
        self.sketch.drives.append(Drive("angle", links[0], base, speed, held=connector.is_true("alwaysmanual")))


def _drawn(element: _Element) -> bool:
    layer = element.get("layer")
    return element.is_true("measurementelement") or (layer.isascii() and layer.isdigit() and int(layer[:9]) == _DRAWING)
