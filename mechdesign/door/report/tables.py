"""Tables as text: CSV and JSON, 12 significant digits, the same bytes for the same numbers."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.columns import Column
from mechdesign.ground.errors import printable, printable_lines
from mechdesign.ground.results import Table
from mechdesign.ground.table_text import texts

_DIGITS = 12
_BLOCK = 20_000
# A cell that begins with one of these is a formula to a spreadsheet.
_FORMULA = ("=", "+", "-", "@")


def _harmless(text: str) -> str:
    """A cell that no spreadsheet takes for a formula: one that begins like one and is no number gets an apostrophe."""
    return f"'{text}" if text.startswith(_FORMULA) and not _is_number(text) else text


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def cells(table: Table, digits: int = _DIGITS) -> list[list[str]]:
    """Text of every cell, column by column; booleans as 1 and 0."""
    return [texts(column.values, digits) for column in table.columns]


def to_csv(table: Table) -> str:
    """The table as CSV: a header, then a line a row, quoted as RFC 4180 asks, ``nan`` and ``inf`` as they are.

    Words that begin with = + - or @, which spreadsheets would compute, stand after an apostrophe.
    """
    return "".join(csv_blocks(table))


def csv_blocks(table: Table) -> Iterator[str]:
    """The text of `to_csv` in blocks of some thousand rows, for tables whose text would fill the memory."""
    head = io.StringIO()
    csv.writer(head, lineterminator="\n").writerow([_harmless(printable(name)) for name in table.names])
    yield head.getvalue()
    for part in table.blocks():
        columns = [column.values for column in part.columns]
        for start in range(0, len(part), _BLOCK):
            yield _lines([values[start : start + _BLOCK] for values in columns])


class _Words(dict[str, str]):
    """Cells of texts, each made once: in one safe line, harmless and quoted; `alone` in its line or beside others."""

    def __init__(self, *, alone: bool) -> None:
        self.alone = alone

    def __missing__(self, text: str) -> str:
        stream = io.StringIO()
        cell = _harmless(printable(text))
        csv.writer(stream, lineterminator="").writerow([cell] if self.alone else [cell, ""])
        self[text] = stream.getvalue() if self.alone else stream.getvalue()[:-1]
        return self[text]


def _lines(columns: Sequence[NDArray[Any]]) -> str:
    """Lines of a table, all formatted at once."""
    rows, words = len(columns[0]), _Words(alone=len(columns) == 1)
    forms = {"f": f"%.{_DIGITS}g"} | dict.fromkeys("iub", "%d")
    line = ",".join(forms.get(values.dtype.kind, "%s") for values in columns) + "\n"
    flat: list[Any] = [0] * (len(columns) * rows)
    for k, values in enumerate(columns):
        if values.dtype.kind in forms:
            # Adding zero turns -0.0 into 0.0: the sign of a zero is an accident of rounding.
            flat[k :: len(columns)] = (values + 0.0 if values.dtype.kind == "f" else values).tolist()
        else:
            flat[k :: len(columns)] = [words[str(value)] for value in values.tolist()]
    return line * rows % tuple(flat)


def from_csv(text: str, name: str, columns: Sequence[Mapping[str, Any]], meaning: str = "") -> Table:
    """The table that `to_csv` wrote, to its digits; `name`, `unit` and `meaning` of the columns are the manifest's."""
    _, *rows = csv.reader(io.StringIO(text))
    texts = zip(*rows, strict=True) if rows else [()] * len(columns)
    return Table(
        name, tuple(Column(**head, values=_values(cells)) for head, cells in zip(columns, texts, strict=True)), meaning
    )


def _values(texts: Sequence[str]) -> NDArray[Any]:
    for kind in (int, float):
        try:
            return np.array([kind(text) for text in texts])
        except ValueError:
            continue
    return np.array([text[1:] if text[:1] == "'" and text[1:].startswith(_FORMULA) else text for text in texts])


def plain(value: Any) -> Any:
    """Values of a study or a table as values of JSON.

    Floats keep 12 significant digits; nan and infinities, which JSON does not know, become None; booleans of a
    table's column are the business of `json_blocks`.
    """
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, (bool, int, str)):
        return value
    if isinstance(value, float):
        return float(format(value + 0.0, f".{_DIGITS}g")) if math.isfinite(value) else None
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return [plain(item) for item in value.tolist()]
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, (set, frozenset)):
        return sorted(plain(item) for item in value)
    return str(value)


def json_text(value: Any, **options: Any) -> str:
    """A value as JSON: letters unchanged, unprintable characters as escapes such as ``\\u202e``."""
    return printable_lines(json.dumps(value, ensure_ascii=False, **options), json.dumps)


def json_blocks(table: Table) -> Iterator[str]:
    """The table as a JSON array, an object a row, in blocks; booleans are 1 and 0 as in the CSV file, nan is null."""
    before = "[\n"
    for part in table.blocks():
        lists = []
        for column in part.columns:
            values = np.asarray(column.values)
            lists.append(plain(values.astype(int) if values.dtype.kind == "b" else values))
        for row in zip(*lists, strict=True):
            yield before + json_text(dict(zip(table.names, row, strict=True)))
            before = ",\n"
    yield "\n]\n" if len(table) else "[]\n"
