"""PMKS+ (https://app.pmksplus.com): share addresses of both generations, and the files of the first.

The first generation lists joints, links and forces in the address, ``?j=...&l=...&f=...&s=...``: a line each, fields
between commas, ``|`` between names. Its files have the same tables under headings. The second generation is one text of
numbers to the base 64 in thousandths, records between full stops, with a character at the end that counts its length
[PMKS-Web/PMKSWeb, src/app/services/transcoding].
"""

from __future__ import annotations

import csv
import math
import re
from urllib.parse import unquote

from mechdesign.ground.errors import StudyError, cut
from mechdesign.study.importing.names import clean, distinct
from mechdesign.study.importing.sketch import GROUND, FileDrive, FileLink, FileSketch, Force, Slide, number
from mechdesign.study.importing.source import ImportedText

NAME = "PMKS+ share address or file"
_TOOL = "PMKS+"

_DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
_COUNTED = _DIGITS[:62]
# Units by the number of the unit of length.
_UNITS = {
    0: ({"length": "in", "mass": "lb", "force": "lbf"}, "lb*in^2"),
    1: ({"length": "cm", "mass": "g", "force": "N"}, "kg*cm^2"),
    2: ({"length": "m", "mass": "kg", "force": "N"}, "kg*m^2"),
}
# First characters of links that no other link contains.
_WHOLE, _PARTS = "YAMG0123", "Namg4567"
_NEWER = "pmks2:"
# Speed of a driven slide where the address gives none, in units of length per second.
_LINEAR = 5.0


def recognises(source: ImportedText) -> bool:
    """Whether it is an address of PMKS+, or what follows its question mark, or a file of the first generation."""
    query = _query(source)
    return query.startswith(("j=", _NEWER)) or _is_file(source) or _is_encoded(query)


def read(source: ImportedText) -> FileSketch:
    """Read an address or file.

    Raises
    ------
    StudyError
        If it is incomplete or contradicts itself.
    """
    query = _query(source)
    if query.startswith(_NEWER):
        raise StudyError(
            "an address of the development version of PMKS+ (pmks2:...); share the drawing from app.pmksplus.com"
        )
    sketch = source.started(_TOOL)
    if _is_encoded(query):
        _read_encoded(sketch, query)
    else:
        _read_tables(sketch, *(_tables_of_file(source.text) if _is_file(source) else _tables_of_query(query)))
    return sketch


def _query(source: ImportedText) -> str:
    text = source.text.strip()
    address = text.partition("?")[2] if "://" in text.partition("?")[0] or text.startswith("?") else text
    return unquote(address)


def _is_file(source: ImportedText) -> bool:
    lines = source.text.split("\n", 2)
    return lines[0].strip() == "joints" and len(lines) > 1 and lines[1].startswith("id,x,y")


def _is_encoded(query: str) -> bool:
    """Whether it has the form of the second generation: settings of digits alone, then records."""
    head = query.split(".", 4)
    settings = "".join(head[:4]).replace(",", "")
    return len(head) == 5 and "," in head[4] and 0 < len(settings) < 60 and set(settings) <= set(_DIGITS)


# The second generation.


def _whole(digits: str, *, signed: bool = True) -> int:
    """A whole number; one that begins with 0 is negative."""
    negative = signed and digits.startswith("0")
    value = 0
    for digit in digits[negative:][:12]:
        value = value * 64 + _value(digit)
    return -value if negative else value


def _value(digit: str) -> int:
    value = _DIGITS.find(digit)
    if value < 0:
        raise StudyError(f"the address has {cut(repr(digit))} where a digit of a number is expected")
    return value


class _Record:
    """The fields of a record, one after the other; those that are missing are empty."""

    def __init__(self, text: str, flags: int) -> None:
        self.flags, self._fields = text[:flags], text[flags:].split(",")

    def text(self) -> str:
        return self._fields.pop(0) if self._fields else ""

    def decimal(self) -> float:
        return _whole(self.text()) / 1000

    def place(self) -> complex:
        return complex(self.decimal(), self.decimal())

    def has(self, bit: int) -> bool:
        return bool(_whole(self.flags, signed=False) >> bit & 1)

    def rest(self) -> list[str]:
        return self._fields


def _read_encoded(sketch: FileSketch, query: str) -> None:
    body, count = query[:-1], query[-1:]
    if count != _COUNTED[len(body) % 62]:
        raise StudyError("the address is not complete: its last character counts its length; copy it whole")
    parts = body.split(".")
    flags = _whole(parts[0], signed=False)
    decimals = [_whole(text) / 1000 for text in parts[1].split(",")]
    turns = _whole(parts[2].split(",")[0]) * math.pi / 30 * (-1 if flags & 1 else 1)
    slide = decimals[1] if len(decimals) > 1 and decimals[1] else _LINEAR
    _use_units(sketch, _value(parts[3][:1] or "1"))
    rest = iter(parts[4:])
    joints = [_Record(text, 1) for text in iter(lambda: next(rest, ""), "")]
    links = [_Record(text, 2) for text in iter(lambda: next(rest, ""), "")]
    forces = [_Record(text, 1) for text in iter(lambda: next(rest, ""), "")]
    table = _Joints(sketch)
    for record in joints:
        name, _, x, y, angle = (record.text(), record.text(), record.decimal(), record.decimal(), record.decimal())
        guide, *through = record.text(), record.text(), record.text()
        table.add(
            name, x, y, slides=record.has(0), driven=record.has(1), fixed=record.has(2), welded=record.has(3),
            traced=record.has(4), angle=angle, guide=guide, through=tuple(through), speed=record.decimal(),
        )  # fmt: skip
    for record in links:
        if record.flags[:1] not in tuple(_WHOLE + _PARTS):
            raise StudyError(f"the address has a link of the kind {cut(record.flags[:1])!r}, which is not known")
        name, title = record.text(), record.text()
        link = FileLink([], mass=record.decimal(), inertia=record.decimal(), center=record.place())
        record.text()
        fields = record.rest()
        link.points = fields[: fields.index("")] if "" in fields else fields
        if record.flags[:1] in tuple(_WHOLE):
            table.link(name, title, link, block=record.flags[1:] == "P")
    for record in forces:
        name, of, _ = record.text(), record.text(), record.text()
        start, end = record.place(), record.place()
        table.force(name, of, start, end, record.decimal(), local=record.has(0), outward=record.has(1))
    sketch.gravity = not flags >> 8 & 1
    table.finish(turns, slide)
    sketch.omitted.append("colours, grid and other settings of the picture")
    if any("," in text or "~" in text for text in list(rest)[1:]):
        sketch.omitted.append("locks, anchors of centres of mass and marks of a synthesis")


# The first generation.


def _tables_of_query(query: str) -> tuple[list[list[str]], list[list[str]], list[list[str]], list[str]]:
    """Rows of joints, links and forces, and the settings."""
    _, *parts = re.split("(?:^|&)([jlfs])=", query)
    texts = dict(zip(parts[::2], parts[1::2], strict=True))
    joints, links, forces = (
        [line.split(",") for line in texts.get(key, "").split("\n") if line.strip()] for key in "jlf"
    )
    return joints, links, forces, texts.get("s", "").strip().split(",")


def _tables_of_file(text: str) -> tuple[list[list[str]], list[list[str]], list[list[str]], list[str]]:
    rows: dict[str, list[list[str]]] = {"joints": [], "links": [], "forces": []}
    key = ""
    try:
        read = list(csv.reader(text.splitlines()))
    except csv.Error as error:
        raise StudyError(f"the file cannot be read as CSV: {error}") from None
    for row in read:
        if len(row) == 1 and row[0]:
            key = row[0].strip()
        elif row and row[0] != "id" and key in rows:
            rows[key].append([cell.replace(",", "|") for cell in row])
    return rows["joints"], rows["links"], rows["forces"], []


def _read_tables(
    sketch: FileSketch, joints: list[list[str]], links: list[list[str]], forces: list[list[str]], settings: list[str]
) -> None:
    units = {"in": 0, "cm": 1, "m": 2}
    unit = settings[3].strip() if len(settings) > 3 else ""
    _use_units(sketch, units.get(unit, units["cm"]))
    if unit not in units:
        reason = f"the unit {cut(repr(unit))} is not known" if unit else "the file says no unit"
        sketch.choices.append(f"{reason}: lengths are taken as cm, the unit that PMKS+ begins with")
    table = _Joints(sketch)
    for row in joints:
        _check_length(row, 8, "joint")
        slides = row[4] == "P"
        angle = number(row[6], f"angle of joint {row[0]!r}") if slides else 0.0
        table.add(row[0], row[1], row[2], slides=slides, fixed=_yes(row[5]), driven=_yes(row[7]), angle=angle)
    for row in links:
        _check_length(row, 7, "link")
        mass, inertia, x, y = (
            None if cell == "Null" else number(cell, f"mass of link {row[0]!r}") for cell in row[2:6]
        )  # fmt: skip
        center = None if x is None or y is None else complex(x, y)
        link = FileLink([name for name in row[6].split("|") if name], mass=mass, inertia=inertia, center=center)
        table.link(row[0], row[0], link, block=row[1] == "P")
    for row in forces:
        _check_length(row, 9, "force")
        x, y, u, v, size = (number(cell, f"force {row[0]!r}") for cell in (*row[2:6], row[8]))
        table.force(row[0], row[1], complex(x, y), complex(u, v), size, local=not _yes(row[6]), outward=_yes(row[7]))
    sketch.gravity = len(settings) > 2 and _yes(settings[2])
    turns = number(settings[0], "the input's speed") if settings and settings[0] else 0.0
    clockwise = len(settings) > 1 and _yes(settings[1])
    table.finish((-1 if clockwise else 1) * turns * math.pi / 30, _LINEAR)


def _yes(cell: str) -> bool:
    return cell.strip().lower() in ("t", "true")


def _check_length(row: list[str], least: int, noun: str) -> None:
    if len(row) < least:
        raise StudyError(f"a {noun} with {len(row)} of {least} fields: {cut(','.join(row))!r}")


# Both.


def _use_units(sketch: FileSketch, unit: int) -> None:
    if unit not in _UNITS:
        raise StudyError(f"the address has no unit of length with the number {unit}")
    sketch.units, sketch.inertia_unit = _UNITS[unit]


class _Joints:
    """Joints as PMKS+ has them, where a slide is a second joint at the place of a pin, and a block joins the two."""

    def __init__(self, sketch: FileSketch) -> None:
        self.sketch = sketch
        self._sliding: dict[str, tuple[float, str, tuple[str, ...]]] = {}
        self._blocks: dict[str, list[str]] = {}
        self._welded: list[str] = []
        self._driven: dict[str, float] = {}
        self._titles = {GROUND: GROUND}

    def add(
        self, name: str, x: float | str, y: float | str, *, slides: bool, fixed: bool, driven: bool,
        angle: float, welded: bool = False, traced: bool = False, guide: str = "", through: tuple[str, ...] = (),
        speed: float = 0.0,
    ) -> None:  # fmt: skip
        """Add a joint; one that slides along the ground has its line through its place."""
        self.sketch.add_point(name, x, y, traced=traced, fixed=fixed)
        if slides:
            self._sliding[name] = (angle, guide or GROUND, through if guide else (name,))
        if welded:
            self._welded.append(name)
        if driven:
            self._driven[name] = speed

    def link(self, name: str, title: str, link: FileLink, *, block: bool) -> None:
        """Add a link, by its title if that is one of its own, or a block."""
        if block:
            if any(point not in self.sketch.points for point in link.points):
                raise StudyError(f"block {name!r} has a joint that the address does not have")
            self._blocks[name] = link.points
            return
        self._titles[name] = title if title and title not in self.sketch.links else name
        new = self.sketch.add_link(self._titles[name], link.points)
        new.mass, new.inertia, new.center = link.mass, link.inertia, link.center

    def force(
        self, name: str, link: str, start: complex, end: complex, size: float, *, local: bool, outward: bool
    ) -> None:
        """Add a force along its arrow, out of the link or into it."""
        if link not in self._titles:
            self.sketch.omitted.append(f"force {name!r}, which acts on {link!r}, no link")
            return
        if start == end:
            self.sketch.omitted.append(f"force {name!r}, which has no direction")
            return
        vector = (size if outward else -size) / abs(end - start) * (end - start)
        self.sketch.forces.append(Force(name, self._titles[link], start, vector, local))

    def finish(self, turns: float, slide: float) -> None:
        """Make slides of the blocks, and drives of the inputs, at these speeds unless a joint has its own."""
        sketch = self.sketch
        sketch.welds += [tuple(sketch.links_with(name)) for name in self._welded]
        slides = {name: self._add_slide(name) for name in self._sliding}
        for name, speed in self._driven.items():
            if name in slides:
                sketch.drives.append(FileDrive("slide", slides[name], speed=speed or slide))
                continue
            links = sketch.turned_at(name)
            if len(links) < 2:
                raise StudyError(f"the input at joint {name!r} moves no link")
            if len(links) > 2:
                text = f"the input at {name!r} turns {links[1]!r} from {links[0]!r}, of {len(links)} links"
                sketch.choices.append(text)
            sketch.drives.append(FileDrive("angle", links[1], links[0], speed or turns))
        weighed = any(link.mass not in (None, 0.0, 1.0) for link in sketch.links.values())
        sketch.dynamic = bool(sketch.forces) or weighed
        if not sketch.dynamic:
            sketch.omitted.append("masses: those that PMKS+ gives every new link, and no force acts")

    def _add_slide(self, name: str) -> str:
        """The slide of a joint: of the pin that its block joins to it, or of itself; it fixes what is welded there."""
        sketch = self.sketch
        angle, carrier, through = self._sliding[name]
        if carrier not in self._titles or any(point not in sketch.points for point in through):
            raise StudyError(
                f"joint {name!r} slides on link {cut(carrier)!r} or on joints that the address does not have"
            )
        guide = self._titles[carrier]
        block = next((joints for joints in self._blocks.values() if name in joints), [])
        pin = next((joint for joint in block if joint != name), name)
        if guide == GROUND and pin == name:
            # The line is fixed, and the joint on it is not.
            through = (clean(f"{name}_line"),)
            sketch.add_point(through[0], sketch.points[name].real, sketch.points[name].imag, fixed=True)
            sketch.fixed = [point for point in sketch.fixed if point != name]
        riders = tuple(sketch.links_with(pin)) if pin in self._welded else ()
        slide = distinct(clean(f"{pin}_slide"), sketch.slides.__contains__)
        sketch.slides[slide] = Slide(pin, guide, through, angle, riders)
        return slide
