"""The part of a report about one question, as plain data: ``report.json`` in the folder of the question."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mechdesign.door.report.page.cases import gates, telling_rows
from mechdesign.door.report.page.front import front
from mechdesign.door.report.page.headlines import headlines
from mechdesign.door.report.page.moving import moving
from mechdesign.door.report.page.solutions import solutions
from mechdesign.door.report.page.tracks import MovingPicture
from mechdesign.door.report.requirements import DrawnCases
from mechdesign.door.report.tables import json_text, plain
from mechdesign.drawing import style
from mechdesign.drawing.before import Before
from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import explain
from mechdesign.ground.results import Result, Table
from mechdesign.ground.table_text import readable
from mechdesign.questions.optimize.analysis import DrawnDesigns
from mechdesign.questions.synthesize.analysis import DrawnSolutions
from mechdesign.study import Study

# Of tables with more rows than this only the first rows are shown.
MOST_ROWS = 24
FIRST_ROWS = 8
# A table with few rows and many columns is transposed: one line per column, with its meaning.
FEW_ROWS = 3
MANY_COLUMNS = 7
MOST_ON_PAPER = 8  # columns of a table that is printed


def section(
    study: Study, result: Result, pictures: Mapping[str, str], mechanism: str, undrawn: Sequence[Caution],
    before: Before | None = None, *, plots: bool,
) -> tuple[dict[str, Any], tuple[Caution, ...]]:  # fmt: skip
    """The part of a report that a result fills, and a warning if the mechanism cannot be shown moving.

    Parameters
    ----------
    pictures : mapping of str to str
        HTML of the pictures of the question by their names.
    mechanism : str
        HTML of the drawing of the mechanism; empty where there is none.
    before : Before, optional
        The study before, whose curves stand beside the mechanism that moves, too.
    plots : bool
        Whether pictures are wanted; without them nothing moves.
    """
    part, warnings, numbers = None, tuple(undrawn), headlines(result.seen)
    if plots and not result.interrupted:
        try:
            marked = [number.place for number in numbers if number.place is not None]
            part = _moving(study, result.seen, before, marked)
        except Exception as error:
            still = f"the mechanism cannot be shown moving: {explain(error)[1]}"
            warnings = (*warnings, Caution("undrawn", still))
    shown = {name: html for name, html in pictures.items() if part is None or name not in part.replaces}
    swept = isinstance(result.drawn, DrawnCases)
    return {
        "command": result.command,
        "headlines": [dataclasses.asdict(number) for number in numbers],
        "mechanism": mechanism,
        "pictures": [{"name": name, "html": html} for name, html in shown.items()],
        "moving": None if part is None else dataclasses.asdict(part),
        "gates": gates(result) if swept else None,
        "tables": [
            _cases(table, study.size) if swept else _table(table, study.size) for table in result.tables.values()
        ],
        "files": list(result.files),
        "counts": plain(dict(result.counts)),
        "warnings": [*map(str, (*result.warnings, *warnings))],
        "notes": list(result.notes),
        "interrupted": result.interrupted,
    }, warnings


def _moving(study: Study, result: Result, before: Before | None, marked: Sequence[float]) -> MovingPicture | None:
    """The mechanism of a result moving; of a front any of its designs, where these have a motion."""
    part = None
    if isinstance(result.drawn, DrawnDesigns) and "pareto" in result.tables:
        # In the width of half a page the texts of the picture are large enough.
        with style.context("paper"):
            part = front(result.drawn.designs, result.tables["pareto"], f"{result.command}-front")
    if isinstance(result.drawn, DrawnSolutions):
        with style.context("paper"):
            return solutions(study, result, f"{result.command}-trade")
    return part or moving(study, result, before, marked)


def encoded(part: Mapping[str, Any]) -> bytes:
    """The part as the bytes of its file."""
    return (json_text(part, separators=(",", ":")) + "\n").encode()


def _table(table: Table, size: tuple[float, str]) -> dict[str, Any]:
    """A table that is folded; where it is long its first rows alone."""
    count = len(table)
    turned = 0 < count <= FEW_ROWS and len(table.columns) >= MANY_COLUMNS
    first = count if count <= MOST_ROWS else FIRST_ROWS
    which = "all" if first == count else f"the first {first} of"
    return _part(table, table.take(np.arange(first)), which, size, turned=turned)


def _cases(table: Table, size: tuple[float, str]) -> dict[str, Any]:
    """The table of a sweep, open."""
    some, which = telling_rows(table)
    return _part(table, some, which, size, turned=False, opened=True)


def _part(
    table: Table, some: Table, which: str, size: tuple[float, str], *, turned: bool, opened: bool = False
) -> dict[str, Any]:  # fmt: skip
    """Some rows of a table; `which`, in words. All rows and those of an open table can be sorted."""
    read = readable(table.seen.columns, some.columns, size)
    return {
        "name": table.name,
        "meaning": table.meaning,
        "rows": len(table),
        "which": which,
        "turned": turned,
        "narrow": turned or len(table.columns) <= MOST_ON_PAPER,
        "open": opened,
        "sorted": not turned and len(some) > 1 and (opened or len(some) == len(table)),
        "columns": [
            {"name": column.name, "unit": column.unit, "meaning": column.meaning, "numeric": column.numeric}
            for column in read
        ],
        "cells": [column.cells for column in read]
        if turned
        else [*zip(*(column.cells for column in read), strict=True)],
    }
