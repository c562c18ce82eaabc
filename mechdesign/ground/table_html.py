"""A table as HTML for a notebook's cell: its first rows under names and units, every text escaped."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from mechdesign.ground.columns import Column
from mechdesign.ground.errors import counted, cut, printable
from mechdesign.ground.table_text import ReadColumn, readable

ROWS = 24  # at most


def table_html(name: str, meaning: str, columns: Sequence[Column], shown: Sequence[Column], more: int) -> str:
    """The first rows of a table, all its columns, and that so many rows are left; colours are the notebook's own."""
    read = readable(columns, shown)
    numeric = [column.numeric for column in read]
    head = _row("th", map(_head, read), numeric)
    rows = "".join(_row("td", map(_text, row), numeric) for row in zip(*(column.cells for column in read), strict=True))
    title = f"{_text(name)}: {_text(meaning)}" if meaning else _text(name)
    left = f"<div>and {counted(more, 'more row')}</div>" if more else ""
    return (
        '<div style="overflow-x: auto"><table style="margin-left: 0">'
        f'<caption style="text-align: left">{title}</caption>{head}{rows}</table></div>{left}'
    )


def _row(tag: str, cells: Iterable[str], numeric: Iterable[bool]) -> str:
    aligned = zip(cells, numeric, strict=True)
    inner = "".join(f'<{tag} style="text-align: {"right" if n else "left"}">{cell}</{tag}>' for cell, n in aligned)
    return f"<tr>{inner}</tr>"


def _head(column: ReadColumn) -> str:
    unit = f"<br>[{_text(column.unit)}]" if column.unit else ""
    return f'<span title="{_text(column.meaning)}">{_text(column.name)}</span>{unit}'


def _text(text: str) -> str:
    return escape(cut(printable(text)))
