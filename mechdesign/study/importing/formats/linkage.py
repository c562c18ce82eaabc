"""Linkage by David Rector (https://blog.rectorsquid.com): ``.linkage2`` files, which are XML.

Connectors are points, anchors those of the ground; a connector is an input of so many turns a minute, clockwise for
positive ones; a slider moves on the line of two connectors. Lengths are 96 to the inch, whatever the unit is that the
program shows; an arc has a radius beside its ends [rectorsquid/Linkage, LinkageDoc.cpp, Simulator.cpp].
"""

from __future__ import annotations

import math
import re
from xml.etree.ElementTree import Element, ParseError, TreeBuilder, XMLParser

from mechdesign.ground.errors import StudyError
from mechdesign.study.importing.names import distinct
from mechdesign.study.importing.sketch import GROUND, FileDrive, FileSketch, Gears, number
from mechdesign.study.importing.source import ImportedText

NAME = "Linkage (.linkage2)"
_TOOL = "Linkage"
_ROOT = "linkage2"
# Deepest nesting of elements, and most of them.
_DEEPEST = 10
_MOST_ELEMENTS = 50_000
# The value of an attribute and the letter behind it: some files have no space before the next attribute.
_ATTRIBUTE = re.compile(r"""(=\s*"[^"<]*")([A-Za-z_]?)""")
# What the program shows of a unit of the file; its millimetres are 24.5 to the inch.
_UNITS = {"Millimeters": ("mm", 24.5 / 96), "Inches": ("in", 1 / 96)}
# The layer of what is drawn only.
_DRAWING = "1"


def recognises(source: ImportedText) -> bool:
    """Whether its first element is `linkage2`."""
    return f"<{_ROOT}" in source.text[:2000]


def read(source: ImportedText) -> FileSketch:
    """Read a file.

    Raises
    ------
    StudyError
        If it is not well formed, or has what no mechanism has.
    """
    root = _parsed(source.text)
    sketch = source.started(_TOOL)
    program = root.find("program")
    shown = "" if program is None else program.get("units", "")
    unit, scale = _UNITS.get(shown, _UNITS["Millimeters"])
    sketch.units = {"length": unit}
    sketch.choices.append(f"96 units of the file are {96 * scale:.6g} {unit}, as the program shows them")
    return _Reader(sketch, root, scale).finish()


class _Builder(TreeBuilder):
    """Builds the elements of a file, no deeper and no more than a Linkage file has."""

    _depth = _count = 0

    def doctype(self, *_: object) -> None:
        raise StudyError("the file declares a document type or entities, which no Linkage file has")

    def start(self, tag: str, attributes: dict[str, str]) -> Element:
        self._depth += 1
        self._count += 1
        if self._count > _MOST_ELEMENTS or self._depth > _DEEPEST:
            raise StudyError("the file has more elements, or deeper ones, than a Linkage file")
        return super().start(tag, attributes)

    def end(self, tag: str) -> Element:
        self._depth -= 1
        return super().end(tag)


def _parsed(text: str) -> Element:
    parser = XMLParser(target=_Builder())
    text = _ATTRIBUTE.sub(lambda match: f"{match[1]} {match[2]}" if match[2] else match[1], text)
    try:
        parser.feed(text.encode(errors="surrogatepass"))
        root: Element = parser.close()
    except ParseError as error:
        raise StudyError(f"the file is no XML: {error}") from None
    if root.tag != _ROOT:
        raise StudyError(f"the file has no element {_ROOT!r}")
    return root


def _number(element: Element, key: str) -> float:
    return number(element.get(key) or 0, f"{key} of {element.tag.lower()} {element.get('id')}")


def _is_true(element: Element, key: str) -> bool:
    return element.get(key) == "true"


def _ids(element: Element, tag: str) -> list[str]:
    return [child.get("id", "") for child in element.findall(tag)]


class _Reader:
    def __init__(self, sketch: FileSketch, root: Element, scale: float) -> None:
        self.sketch, self._root, self._scale = sketch, root, scale
        self._connectors = {c.get("id", ""): c for c in root.findall("connector") if not _drawn(c)}
        # Files may give several links one number, which then stands for the first.
        self._links = [link for link in root if link.tag in ("Link", "element") and not _drawn(link)]
        self._points: dict[str, str] = {}
        self._names: dict[str, str] = {}

    def finish(self) -> FileSketch:
        """Take over all that is not drawn only."""
        drawn = sum(_drawn(part) for part in self._root if part.tag in ("connector", "Link", "element"))
        if drawn:
            self.sketch.omitted.append(f"{drawn} points and lines that are drawn or measure only")
        for key, connector in self._connectors.items():
            self._add_connector(key, connector)
        names = [self._add_link(link) for link in self._links]
        self._fasten(names)
        for key, connector in self._connectors.items():
            if _is_true(connector, "slider"):
                self._add_slide(key, connector)
        for ratio in self._root.findall("ratios/ratio"):
            self._add_gears(ratio)
        for key, connector in self._connectors.items():
            if _is_true(connector, "input"):
                self._add_input(key, connector)
        self.sketch.omitted.append("colours, layers, zoom and what is selected")
        return self.sketch

    def _add_connector(self, key: str, connector: Element) -> None:
        name = connector.get("name") or f"P{key}"
        self._points[key] = name = name if name not in self.sketch.points else f"{name}_{key}"
        x, y = self._scale * _number(connector, "x"), self._scale * _number(connector, "y")
        fixed = _is_true(connector, "anchor")
        traced = _is_true(connector, "draw")
        self.sketch.add_point(name, x, y, traced=traced, fixed=fixed)

    def _add_link(self, link: Element) -> str:
        """Add a link and return its name, which is one of its own."""
        key = link.get("id", "")
        name = distinct(link.get("name") or f"link_{key}", self.sketch.links.__contains__)
        self._names.setdefault(key, name)
        points = list(dict.fromkeys(self._points[end] for end in _ids(link, "connector") if end in self._points))
        actuator = _is_true(link, "actuator") and len(points) == 2
        self.sketch.add_link(name, points, telescopic=actuator)
        if actuator:
            self._add_actuator(name, link)
        return name

    def _add_actuator(self, name: str, link: Element) -> None:
        """An actuator grows by its throw and shrinks again, so many times a minute; negative ones pull."""
        length = self.sketch.distance(*self.sketch.links[name].points)
        throw = self._scale * _number(link, "throw")
        cycles = _number(link, "cpm")
        low, high = (length, length + throw) if cycles >= 0 else (length - throw, length)
        if not throw > 0 or low <= 0:
            raise StudyError(f"actuator {name!r} is {length:.6g} long and has a throw of {throw:.6g}")
        speed = math.copysign(2 * throw * abs(cycles) / 60, cycles)
        self.sketch.drives.append(
            FileDrive("length", name, speed=speed, span=(low, high), held=_is_true(link, "alwaysmanual"))
        )

    def _fasten(self, names: list[str]) -> None:
        """Links that are fastened to links or anchors, and the links of an input, which turn as one."""
        sketch = self.sketch
        for name, link in zip(names, self._links, strict=True):
            anchor = link.get("fastenconnector", "")
            holder = self._names.get(link.get("fastenlink", ""))
            if holder is not None:
                sketch.welds.append((holder, name))
            elif anchor in self._points and self._points[anchor] in sketch.fixed:
                sketch.welds.append((GROUND, name))
            elif anchor:
                sketch.omitted.append(f"that link {name!r} is fastened to a connector which is no anchor")
        for key, connector in self._connectors.items():
            holder = self._names.get(connector.get("fastenlink", "") or connector.get("fasten", ""))
            if holder is not None and self._points[key] not in sketch.links[holder].points:
                sketch.links[holder].points.append(self._points[key])
            if _is_true(connector, "input") and _is_true(connector, "anchor"):
                sketch.welds.append(tuple(self._turned(key)))

    def _turned(self, key: str) -> list[str]:
        """The links that an input turns: all at its anchor, but those that are fastened or lie between anchors."""
        held = {name for weld in self.sketch.welds if weld[:1] == (GROUND,) for name in weld[1:]}
        moving = self.sketch.moving_at(self._points[key])
        return [
            name for name in self.sketch.links_with(self._points[key])
            if name not in held and (name in moving or len(self.sketch.links[name].points) == 1)
        ]  # fmt: skip

    def _add_slide(self, key: str, connector: Element) -> None:
        name = self._points[key]
        ends = [self._points[end] for end in _ids(connector, "slidelimit") if end in self._points][:2]
        if len(ends) < 2:
            self.sketch.omitted.append(f"slider {name!r}, which has no two limits")
            return
        if radius := abs(self._scale * _number(connector, "slideradius")):
            self.sketch.add_arc(name, ends, radius)
        else:
            self.sketch.add_track(name, ends, limited=True)

    def _add_gears(self, ratio: Element) -> None:
        """Two wheels; with a chain they turn alike. The sizes are radii, or else only their ratio counts."""
        ends = [end for end in ratio.findall("link") if end.get("id") in self._names][:2]
        if len(ends) < 2:
            self.sketch.omitted.append("a ratio of gears that are not there")
            return
        one, other = (self._names[end.get("id", "")] for end in ends)
        first, second = (_number(end, "size") for end in ends)
        if not (first > 0 and second > 0) or not all(self.sketch.links[name].points for name in (one, other)):
            raise StudyError(f"gears {one!r} and {other!r} have the sizes {first:g} and {second:g}")
        chain = ratio.get("type") != "gears"
        radius = self._scale * first if chain and _is_true(ratio, "sizeassize") else None
        axes = self.sketch.links[one].points[0], self.sketch.links[other].points[0]
        turn = second / first if chain else -second / first
        self.sketch.gears.append(Gears(one, other, turn, axes, chain, radius))

    def _add_input(self, key: str, connector: Element) -> None:
        name, links = self._points[key], self._turned(key)
        if not links:
            self.sketch.omitted.append(f"input {name!r}, which turns no link")
            return
        base = GROUND if name in self.sketch.fixed else links.pop()
        if not links:
            raise StudyError(f"input {name!r} is no anchor and has one link alone")
        # Positive turns are clockwise.
        speed = -_number(connector, "rpm") * math.pi / 30
        self.sketch.drives.append(FileDrive("angle", links[0], base, speed, held=_is_true(connector, "alwaysmanual")))


def _drawn(element: Element) -> bool:
    """Whether it is drawn or measures only."""
    return _is_true(element, "measurementelement") or element.get("layer", "").lstrip("0") == _DRAWING
