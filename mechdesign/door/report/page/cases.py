"""The cases of a sweep in a page: the best of them beside what is required, and the rows of its table."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdesign.door.report.cases import RANK, best_of, short, telling, text_of
from mechdesign.door.report.page.headlines import shown
from mechdesign.door.report.requirements import DrawnCases, Limits
from mechdesign.ground.columns import Column
from mechdesign.ground.results import Result, Table
from mechdesign.study.text.units import Amount

# Cells of the table of a sweep that a page has, at most.
MOST_CELLS = 6000
_SENSES = {1: "less is better", -1: "more is better"}


def gates(result: Result) -> dict[str, Any] | None:
    """What varies and what is judged in a sweep, a row each: the best case, the limits, and how many cases keep them.

    None where nothing is judged.
    """
    table, drawn = result.main, DrawnCases.of(result)
    best = best_of(table)
    if best is None and not any(
        name for name, bounds in drawn.results.items() if any(bound is not None for bound in bounds)
    ):
        return None
    row = None if best is None else int(np.flatnonzero(table[RANK] == 1)[0])
    rows = [] if row is None else [_row(table, row, name) for name in drawn.entries]
    for name in dict.fromkeys((*drawn.goals, *drawn.results)):
        about = _row(table, row, name) | {"sense": _SENSES.get(drawn.goals.get(name, 0), "")}
        if f"{name}_met" in table:
            met = table[f"{name}_met"].astype(bool)
            about["limit"] = _limits(drawn.results[name], table.column(name))
            about["kept"] = f"{met.sum()} of {len(table)}"
            about["met"] = bool(met.all()) if row is None else bool(met[row])
        rows.append(about)
    return {"best": None if best is None else str(best), "case": None if best is None else best.name, "rows": rows}


def _row(table: Table, row: int | None, name: str) -> dict[str, Any]:
    """A quantity of a case, without a limit."""
    column = table.column(name)
    value = "" if row is None else _text(column, row)
    return {"name": short(name), "unit": column.unit, "value": value, "sense": "", "limit": "", "kept": "", "met": None}


def _text(column: Column, row: int) -> str:
    value = column.values[row].item()
    return shown(value) if column.numeric else text_of(value)


def _limits(bounds: Limits, column: Column) -> str:
    """``≥ 78, ≤ 80``: the limits of a result, in the unit of its column."""
    signs = ("\N{GREATER-THAN OR EQUAL TO}", "\N{LESS-THAN OR EQUAL TO}")
    return ", ".join(f"{sign} {shown(Amount.of(bound).within(column.unit))}"
                     for sign, bound in zip(signs, bounds, strict=True) if bound is not None)  # fmt: skip


def telling_rows(table: Table) -> tuple[Table, str]:
    """The rows of a sweep's table that a page has, what is asked for in the first columns; in words which they are."""
    ordered = Table(table.name, tuple(telling(table)), table.meaning)
    most = max(1, MOST_CELLS // len(ordered.columns))
    if len(table) <= most:
        return ordered, "all"
    if RANK not in table:
        return ordered.take(np.arange(most)), f"the first {most} of"
    return ordered.take(np.argsort(table[RANK], kind="stable")[:most]), f"the best {most} of"
