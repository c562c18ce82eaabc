"""A table as HTML for a notebook's cell: its first rows under names and units, every text escaped."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdesign.errors import counted, cut, printable

if TYPE_CHECKING:
    from mechdesign.results import Column, Table

_ROWS = 24
_DIGITS = 6  # significant digits of numbers


def table_html(table: Table) -> str:
    """The first rows of a table, all its columns, and how many rows are left; colours are the notebook's own."""
    shown = table.take(np.arange(min(_ROWS, len(table))))
    numeric = [column.numeric for column in shown.columns]
    head = _row("th", map(_head, shown.columns), numeric)
    texts = ([_cell(value) for value in np.asarray(column.values).tolist()] for column in shown.columns)
    rows = "".join(_row("td", row, numeric) for row in zip(*texts, strict=True))
    title = f"{_text(table.name)}: {_text(table.meaning)}" if table.meaning else _text(table.name)
    more = len(table) - len(shown)
    left = f"<div>and {counted(more, 'more row')}</div>" if more else ""
    return (
        '<div style="overflow-x: auto"><table style="margin-left: 0">'
        f'<caption style="text-align: left">{title}</caption>{head}{rows}</table></div>{left}'
    )


def _row(tag: str, cells: Iterable[str], numeric: Iterable[bool]) -> str:
    aligned = zip(cells, numeric, strict=True)
    inner = "".join(f'<{tag} style="text-align: {"right" if n else "left"}">{cell}</{tag}>' for cell, n in aligned)
    return f"<tr>{inner}</tr>"


def _head(column: Column) -> str:
    unit = f"<br>[{_text(column.unit)}]" if column.unit else ""
    return f'<span title="{_text(column.meaning)}">{_text(column.name)}</span>{unit}'


def _cell(value: Any) -> str:
    """A float to six digits, a boolean as 1 or 0, anything else as it is."""
    if isinstance(value, bool):
        return str(int(value))
    return f"{value:.{_DIGITS}g}" if isinstance(value, float) else _text(str(value))


def _text(text: str) -> str:
    return escape(cut(printable(text)))
