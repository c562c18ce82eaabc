"""Drawings as DXF of release 12, which every program for cutters reads: text of pairs of a code and a value."""

from __future__ import annotations

from collections.abc import Iterator
from textwrap import wrap

from mechdesign.door.exporting.drawing import CentreMark, Drawing, DrawnCircle, Path, Shape, Text
from mechdesign.ground.errors import printable

LONGEST = 240  # letters of a line
Pair = tuple[int, str | float | int]


def to_dxf(drawing: Drawing) -> str:
    """The drawing as the text of a DXF file, one unit of which is a millimetre."""
    lines = [f"{code}\n{_written(value)}" for code, value in _pairs(drawing)]
    return "\n".join(lines) + "\n"


def _written(value: str | float) -> str:
    """A value; letters beyond ASCII as release 12 has them."""
    if isinstance(value, float):
        return f"{round(value, 9) + 0.0:.9f}".rstrip("0").rstrip(".")
    text = printable(str(value))
    return "".join(letter if letter.isascii() else f"\\U+{ord(letter):04X}" for letter in text)


def _pairs(drawing: Drawing) -> Iterator[Pair]:
    low, high = drawing.box
    for remark in (drawing.title, "made by mechdesign; one unit is 1 mm", *drawing.remarks):
        yield from ((999, line) for line in wrap(remark, LONGEST))
    yield from ((0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1009"))
    for name, corner in (("$EXTMIN", low), ("$EXTMAX", high)):
        yield from ((9, name), (10, corner.real), (20, corner.imag), (30, 0.0))
    yield from ((0, "ENDSEC"), (0, "SECTION"), (2, "TABLES"))
    yield from ((0, "TABLE"), (2, "LTYPE"), (70, 1), (0, "LTYPE"), (2, "CONTINUOUS"), (70, 0), (3, "Solid line"))
    yield from ((72, 65), (73, 0), (40, 0.0), (0, "ENDTAB"), (0, "TABLE"), (2, "LAYER"), (70, len(drawing.layers) + 1))
    for name, color in (("0", 7), *((layer.name, layer.index) for layer in drawing.layers)):
        yield from ((0, "LAYER"), (2, name), (70, 0), (62, color), (6, "CONTINUOUS"))
    yield from ((0, "ENDTAB"), (0, "TABLE"), (2, "STYLE"), (70, 1), (0, "STYLE"), (2, "STANDARD"), (70, 0), (40, 0.0))
    yield from ((41, 1.0), (50, 0.0), (71, 0), (42, 2.5), (3, "txt"), (4, ""), (0, "ENDTAB"), (0, "ENDSEC"))
    yield from ((0, "SECTION"), (2, "ENTITIES"))
    for shape in drawing.shapes:
        yield from _entity(shape)
    yield from ((0, "ENDSEC"), (0, "EOF"))


def _entity(shape: Shape) -> Iterator[Pair]:
    if isinstance(shape, DrawnCircle):
        yield from _headed("CIRCLE", shape, shape.place)
        yield 40, shape.radius
    elif isinstance(shape, CentreMark):
        yield from _headed("POINT", shape, shape.place)
    elif isinstance(shape, Text):
        yield from _headed("TEXT", shape, shape.place)
        yield from ((40, shape.height), (1, shape.words))
        if shape.centred:
            yield from ((72, 1), (73, 2), (11, shape.place.real), (21, shape.place.imag), (31, 0.0))
    else:
        yield from _polyline(shape)


def _polyline(path: Path) -> Iterator[Pair]:
    yield from _headed("POLYLINE", path, 0j)
    yield from ((66, 1), (70, int(path.closed)))
    for corner, bulge in zip(path.corners, path.bulges, strict=True):
        yield from _headed("VERTEX", path, corner)
        if bulge:
            yield 42, bulge
    yield from ((0, "SEQEND"), (8, path.layer))


def _headed(kind: str, shape: Shape, place: complex) -> Iterator[Pair]:
    yield from ((0, kind), (8, shape.layer), (10, place.real), (20, place.imag), (30, 0.0))
