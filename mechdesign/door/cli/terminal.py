"""Messages on stderr, data on stdout: a table on a terminal, CSV in a pipe."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import sys
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from textwrap import wrap
from typing import Literal, TextIO

import numpy as np

from mechdesign.door.report.tables import csv_blocks, json_blocks
from mechdesign.ground.columns import Column
from mechdesign.ground.errors import counted, printable_lines
from mechdesign.ground.results import Table
from mechdesign.ground.table_text import readable as read

_ROWS = 24  # rows shown on a terminal
_PIECE = 1 << 20  # characters copied at a time from a file
_NAMES = 6  # most names listed of columns that do not fit
_HEAD = 18  # characters in a line of a column's head, unless a word is longer
_WORDS = re.compile(r"(?<= )(?=[^ ])|(?<=\.)(?=[^\W\d])")  # where the words of a column's name begin
_VERDICT = re.compile(r"(?<=:)(\s+)(met|NOT\s+MET)(?=,\s+worst\s)")
_GREEN, _RED = "\x1b[32m", "\x1b[1;31m"
_PLAIN = "\x1b[0m"
_INDENT = 2  # characters by which the rest of a folded line is indented further
DELAY = 1.0  # seconds before progress is shown


def say(text: str, *, quiet: bool = False) -> None:
    """Print a message to stderr, unless `quiet`."""
    if not quiet:
        print(readable(printable_lines(text), sys.stderr), file=sys.stderr, flush=True)


def readable(text: str, stream: TextIO) -> str:
    """A text as people read it on a stream: on a terminal folded, and its verdicts in colour."""
    return coloured(folded(text, stream), stream)


def folded(text: str, stream: TextIO) -> str:
    """A text whose lines a terminal shows without a break inside a word; elsewhere as it is."""
    return _fold(text, shutil.get_terminal_size().columns) if stream.isatty() else text


def _fold(text: str, width: int, further: int = _INDENT) -> str:
    """A text in lines of at most this width, unless a word is longer; the rest of a line is indented further."""
    lines = []
    for line in text.split("\n"):
        indent = " " * (len(line) - len(line.lstrip()) + further)
        parts = wrap(line, width, subsequent_indent=indent, break_on_hyphens=False, break_long_words=False)
        lines += parts if len(line) > width else [line]
    return "\n".join(lines)


def coloured(text: str, stream: TextIO) -> str:
    """A text, with its verdicts in colour where the stream is a terminal with colours and ``NO_COLOR`` is not set."""
    if not colours(stream):
        return text
    return _VERDICT.sub(lambda match: f"{match[1]}{_GREEN if match[2] == 'met' else _RED}{match[2]}{_PLAIN}", text)


def colours(stream: TextIO) -> bool:
    """Whether a stream is a terminal with colours, and ``NO_COLOR`` is not set; the console of Windows tells none."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM", "dumb") != "dumb"


def is_terminal() -> bool:
    """Whether tables are shown to a person."""
    return sys.stdout.isatty()


def suggest(path: Path | None, *, quiet: bool) -> None:
    """Tell people at a terminal which file to open, as a line that they can paste into a shell."""
    if path is not None and is_terminal():
        line = f'explorer "{path}"' if sys.platform == "win32" else f"open {shlex.quote(str(path))}"
        if not quiet:
            print(printable_lines(line), file=sys.stderr, flush=True)


def emit(text: str) -> None:
    """Write data to stdout."""
    emit_all([text])


def emit_words(text: str) -> None:
    """Write lines for people to stdout, folded on a terminal."""
    emit(folded(text, sys.stdout))


def emit_all(texts: Iterable[str]) -> None:
    """Write data to stdout, piece by piece."""
    for text in texts:
        sys.stdout.write(text)
    sys.stdout.flush()


def show(
    table: Table, *, as_json: bool, rest: Path | None = None, size: tuple[float, str] = (0.0, ""),
    arranged: Callable[[Table], Sequence[Column]] | None = None,
) -> None:  # fmt: skip
    """Write a table to stdout: as JSON, as CSV in a pipe, or on a terminal what fits and the file of the `rest`.

    There columns are `arranged`, the most telling first; `size` is the mechanism's, beside which numbers are rounding.
    """
    if as_json:
        emit_all(json_blocks(table))
    elif is_terminal():
        _show_to_people(table, rest, arranged or _columns, size)
    elif rest is not None:
        with rest.open(encoding="utf-8", newline="") as stream:
            emit_all(iter(partial(stream.read, _PIECE), ""))
    else:
        emit_all(csv_blocks(table))


def show_lines(lines: Sequence[str]) -> None:
    """Write the first lines, and how many are left."""
    more = len(lines) - _ROWS
    emit_words("".join(f"{printable_lines(line)}\n" for line in lines[:_ROWS]))
    if more > 0:
        emit_words(f"... {more} more; --out DIR writes all of them\n")


def _columns(table: Table) -> Sequence[Column]:
    return table.columns


def _show_to_people(
    table: Table, rest: Path | None, arranged: Callable[[Table], Sequence[Column]], size: tuple[float, str]
) -> None:  # fmt: skip
    from rich.console import Console
    from rich.table import Table as Grid
    from rich.text import Text

    console = Console()
    columns = read(table.seen.columns, arranged(table.take(np.arange(min(len(table), _ROWS)))), size)
    heads = [[*_in_lines(column.name), *([f"[{column.unit}]"] if column.unit else [])] for column in columns]
    grid = Grid(header_style="bold", box=None, pad_edge=False)
    # A long word leaves room for other columns.
    room, widest = console.width, console.width // 2
    shown = 0
    for column, head in zip(columns, heads, strict=True):
        room -= 2 + min(widest, max(len(text) for text in (*head, *column.cells)))
        if room < 0 and shown:
            break
        justify: Literal["right", "left"] = "right" if column.numeric else "left"
        grid.add_column(Text("\n".join(head)), justify=justify, no_wrap=True, max_width=widest)
        shown += 1
    for row in zip(*(column.cells for column in columns[:shown]), strict=True):
        grid.add_row(*(Text(text) for text in row))
    console.print(grid)
    left = []
    if len(table) > _ROWS:
        left.append(counted(len(table) - _ROWS, "more row"))
    if hidden := [column.name for column in columns[shown:]]:
        names = [*hidden[:_NAMES], *(["..."] if len(hidden) > _NAMES else [])]
        left.append(f"{counted(len(hidden), 'more column')} ({', '.join(names)})")
    if left:
        words = f"... {' and '.join(left)}{f' in {rest}' if rest is not None else ''}"
        console.print(Text(_fold(words, console.width, further=0)), style="dim", soft_wrap=True)


def _in_lines(name: str) -> list[str]:
    """The name of a column in lines of a head: broken behind dots and blanks, never inside a word."""
    lines = [""]
    for word in _WORDS.split(name):
        if lines[-1] and len(lines[-1]) + len(word.rstrip()) > _HEAD:
            lines.append("")
        lines[-1] += word
    return [line.rstrip() for line in lines]


def lively() -> bool:
    """Whether stderr is a terminal that can show a live display, and not the log of a CI server."""
    ci = os.environ.get("CI", "").lower() not in ("", "0", "false")
    return sys.stderr.isatty() and os.environ.get("TERM", "dumb") != "dumb" and not ci
