"""Drawings as DXF of release 2000, whose header says the unit: text of pairs of a code and a value.

Of what the release has a drawing needs the tables, the blocks of model and paper, and a dictionary, each with a handle
of its own. [Autodesk, DXF reference for release 2000.]
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import count
from textwrap import wrap

from mechdesign.door.exporting.drawing import CentreMark, Drawing, DrawnCircle, Shape, Text
from mechdesign.ground.errors import printable

LONGEST = 240  # letters of a line
MILLIMETRES, METRIC = 4, 1  # as the header counts them
MODEL, PAPER = "*Model_Space", "*Paper_Space"
Pair = tuple[int, str | float | int]


def to_dxf(drawing: Drawing) -> str:
    """The drawing as the text of a DXF file, one unit of which is a millimetre."""
    pairs = [*_comments(drawing), *_Release2000(drawing).pairs()]
    return "".join(f"{code}\n{_written(value)}\n" for code, value in pairs)


def _written(value: str | float) -> str:
    """A value; letters beyond ASCII as the release has them."""
    if isinstance(value, float):
        return f"{round(value, 9) + 0.0:.9f}".rstrip("0").rstrip(".")
    text = printable(str(value))
    return "".join(letter if letter.isascii() else f"\\U+{ord(letter):04X}" for letter in text)


def _comments(drawing: Drawing) -> Iterator[Pair]:
    for remark in (drawing.title, "made by mechdesign; one unit is 1 mm", *drawing.remarks):
        yield from ((999, line) for line in wrap(remark, LONGEST))


class _Release2000:
    """The sections of a file, with a handle for each thing in them."""

    def __init__(self, drawing: Drawing) -> None:
        self.drawing = drawing
        self._handles = (f"{number:X}" for number in count(16))
        self.root, self.records, self.model, self.paper = (next(self._handles) for _ in range(4))

    def pairs(self) -> Iterator[Pair]:
        low, high = self.drawing.box
        sections = {
            "CLASSES": [], "TABLES": [*self._tables()], "BLOCKS": [*self._blocks()],
            "ENTITIES": [pair for shape in self.drawing.shapes for pair in self._entity(shape)],
            "OBJECTS": [*self._objects()],
        }  # fmt: skip
        header: list[Pair] = [(9, "$ACADVER"), (1, "AC1015"), (9, "$DWGCODEPAGE"), (3, "ANSI_1252")]
        header += [(9, "$INSUNITS"), (70, MILLIMETRES), (9, "$MEASUREMENT"), (70, METRIC)]
        for name, corner in (("$EXTMIN", low), ("$EXTMAX", high)):
            header += [(9, name), *_at(corner)]
        header += [(9, "$HANDSEED"), (5, next(self._handles))]
        for name, pairs in {"HEADER": header, **sections}.items():
            yield from ((0, "SECTION"), (2, name), *pairs, (0, "ENDSEC"))
        yield 0, "EOF"

    def _tables(self) -> Iterator[Pair]:
        layers = [("0", 7), *((layer.name, layer.index) for layer in self.drawing.layers)]
        line: list[Pair] = [(72, 65), (73, 0), (40, 0.0)]
        low, high = self.drawing.box
        middle, tall = (low + high) / 2, max((high - low).imag, (high - low).real, 1.0)
        view: list[Pair] = [
            (10, 0.0), (20, 0.0), (11, 1.0), (21, 1.0), (12, middle.real), (22, middle.imag), (13, 0.0), (23, 0.0),
            (14, 1.0), (24, 1.0), (15, 0.0), (25, 0.0), (16, 0.0), (26, 0.0), (36, 1.0), (17, 0.0), (27, 0.0),
            (37, 0.0), (40, tall), (41, 1.0), (42, 50.0), (43, 0.0), (44, 0.0), (50, 0.0), (51, 0.0),
        ]  # fmt: skip
        yield from self._table("VPORT", "Viewport", {"*Active": view})
        yield from self._table("LTYPE", "Linetype", {"ByBlock": [(3, ""), *line], "ByLayer": [(3, ""), *line],
                                                     "Continuous": [(3, "Solid line"), *line]})  # fmt: skip
        yield from self._table("LAYER", "Layer", {name: [(62, color), (6, "Continuous")] for name, color in layers})
        style: list[Pair] = [(40, 0.0), (41, 1.0), (50, 0.0), (71, 0), (42, 2.5), (3, "txt"), (4, "")]
        yield from self._table("STYLE", "TextStyle", {"Standard": style})
        for kind in ("VIEW", "UCS"):
            yield from self._table(kind, "", {})
        yield from self._table("APPID", "RegApp", {"ACAD": []})
        yield from self._table("DIMSTYLE", "DimStyle", {"Standard": []})
        yield from self._table("BLOCK_RECORD", "Block", {MODEL: [], PAPER: []})

    def _table(self, kind: str, record: str, entries: dict[str, list[Pair]]) -> Iterator[Pair]:
        """A table with its entries; blocks and dimension styles have handles and flags of their own kind."""
        blocks, styles = kind == "BLOCK_RECORD", kind == "DIMSTYLE"
        own = self.records if blocks else next(self._handles)
        yield from ((0, "TABLE"), (2, kind), (5, own), (330, "0"), (100, "AcDbSymbolTable"), (70, len(entries)))
        if styles:
            yield 100, "AcDbDimStyleTable"
        for name, pairs in entries.items():
            handle = {MODEL: self.model, PAPER: self.paper}.get(name) or next(self._handles)
            yield from ((0, kind), (105 if styles else 5, handle), (330, own), (100, "AcDbSymbolTableRecord"))
            yield from ((100, f"AcDb{record}TableRecord"), (2, name))
            yield from ([] if blocks else [(70, 0)])
            yield from pairs
        yield 0, "ENDTAB"

    def _blocks(self) -> Iterator[Pair]:
        for name, owner in ((MODEL, self.model), (PAPER, self.paper)):
            head: list[Pair] = [(330, owner), (100, "AcDbEntity"), *([(67, 1)] if name == PAPER else []), (8, "0")]
            yield from ((0, "BLOCK"), (5, next(self._handles)), *head, (100, "AcDbBlockBegin"), (2, name), (70, 0))
            yield from (*_at(0j), (3, name), (1, ""))
            yield from ((0, "ENDBLK"), (5, next(self._handles)), *head, (100, "AcDbBlockEnd"))

    def _entity(self, shape: Shape) -> Iterator[Pair]:
        head: list[Pair] = [(5, next(self._handles)), (330, self.model), (100, "AcDbEntity"), (8, shape.layer)]
        if isinstance(shape, DrawnCircle):
            yield from ((0, "CIRCLE"), *head, (100, "AcDbCircle"), *_at(shape.place), (40, shape.radius))
        elif isinstance(shape, CentreMark):
            yield from ((0, "POINT"), *head, (100, "AcDbPoint"), *_at(shape.place))
        elif isinstance(shape, Text):
            yield from ((0, "TEXT"), *head, (100, "AcDbText"), *_at(shape.place), (40, shape.height), (1, shape.words))
            if shape.centred:
                yield from ((72, 1), *_at(shape.place, 1))
            yield 100, "AcDbText"
            if shape.centred:
                yield 73, 2
        else:
            yield from ((0, "LWPOLYLINE"), *head, (100, "AcDbPolyline"), (90, len(shape.corners)))
            yield from ((70, int(shape.closed)), (43, 0.0))
            for corner, bulge in zip(shape.corners, shape.bulges, strict=True):
                yield from ((10, corner.real), (20, corner.imag), *([(42, bulge)] if bulge else []))

    def _objects(self) -> Iterator[Pair]:
        groups = next(self._handles)
        yield from self._dictionary(self.root, "0", [("ACAD_GROUP", groups)])
        yield from self._dictionary(groups, self.root, [])

    def _dictionary(self, handle: str, owner: str, entries: Iterable[tuple[str, str]]) -> Iterator[Pair]:
        yield from ((0, "DICTIONARY"), (5, handle), (330, owner), (100, "AcDbDictionary"), (281, 1))
        for name, entry in entries:
            yield from ((3, name), (350, entry))


def _at(place: complex, ordinal: int = 0) -> tuple[Pair, ...]:
    return (10 + ordinal, place.real), (20 + ordinal, place.imag), (30 + ordinal, 0.0)
