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

from mechdesign.errors import printable, printable_lines
from mechdesign.results import Column, Table
from mechdesign.table_text import texts

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


def _lines(columns: Sequence[NDArray[Any]]) -> str:
    """Lines of a table; tables of numbers only are formatted at once, in a third of the time."""
    if not all(values.dtype.kind in "fiub" for values in columns):
        stream = io.StringIO()
        cells = [texts(v, _DIGITS) if v.dtype.kind in "fiub" else map(_harmless, texts(v, _DIGITS)) for v in columns]
        csv.writer(stream, lineterminator="\n").writerows(zip(*cells, strict=True))
        return stream.getvalue()
    floats = [values.dtype.kind == "f" for values in columns]
    line = ",".join(f"%.{_DIGITS}g" if each else "%d" for each in floats) + "\n"
    flat: list[float] = [0] * (len(columns) * len(columns[0]))
    for k, values in enumerate(columns):
        flat[k :: len(columns)] = (values + 0.0 if floats[k] else values).tolist()
    return line * len(columns[0]) % tuple(flat)


def from_csv(text: str, name: str, columns: Sequence[Mapping[str, Any]], meaning: str = "") -> Table:
    """The table that `to_csv` wrote, to its digits; `name`, `unit` and `meaning` of the columns are the manifest's."""
    _, *rows = csv.reader(io.StringIO(text))
    texts = zip(*rows, strict=True) if rows else [()] * len(columns)
    return Table(
        name, tuple(Column(**each, values=_values(cells)) for each, cells in zip(columns, texts, strict=True)), meaning
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
