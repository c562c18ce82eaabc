"""What a question ends with on a terminal, in words: of a reliability the probability of failure at each pose."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import takewhile

import numpy as np

from mechdesign.ground.numerals import numeral, printed
from mechdesign.ground.results import Table
from mechdesign.ground.table_text import Rounding
from mechdesign.questions.reliability.schema.methods import METHODS

FAILURES = "reliability"  # the table of probabilities of failure
_MOST = 6  # poses with a line of their own
_DIGITS = 3


def closing_words(failures: Table | None) -> tuple[str, ...]:
    """What a question ends with, by its table of probabilities of failure; nothing where it has none."""
    return () if failures is None else (*_failures_in_words(failures),)


def _failures_in_words(table: Table) -> Iterator[str]:
    """``at crank = 30 deg: probability of failure 0.0277 (0.0274 to 0.0284), importance sampling``, a line a pose.

    Of several methods it is that of the most accurate one, and of many poses it is the worst of them; then comes the
    probability over the whole cycle.
    """
    method = max(table["method"].tolist(), key=lambda name: METHODS[name].accuracy)
    rows = table.where(method=method) & np.isfinite(table["failure"])
    given = [*takewhile(lambda column: column.name != "method", table.columns)][1:]
    rounding = Rounding.of(table.columns)
    alone, cycle = (np.flatnonzero(rows & ((table["scope"] == "cycle") == whole)) for whole in (False, True))
    worst = alone if len(alone) <= _MOST else alone[np.argsort(-table["failure"][alone], kind="stable")][: _MOST - 1]
    for row in worst.tolist():
        pose = (f"{column.name} = {rounding.cell(table.columns, row, column)} {printed(column.unit)}".rstrip()
                for column in given)  # fmt: skip
        yield f"at {', '.join(pose)}: {_probability(table, row)}"
    if len(worst) < len(alone):
        yield f"at {len(alone) - len(worst)} more poses it is smaller"
    for row in cycle.tolist():
        yield f"over all poses together: {_probability(table, row)}"


def _probability(table: Table, row: int) -> str:
    """The probability of failure in a row, with its interval and the method."""
    failure, low, high = (float(table[name][row]) for name in ("failure", "failure_low", "failure_high"))
    interval = f" (99.7 %: {numeral(low, _DIGITS)} to {numeral(high, _DIGITS)})" if low < high else ""
    words = METHODS[table["used"][row]].words if table["used"][row] in METHODS else table["used"][row]
    if failure == 0 < high:
        return f"probability of failure below {numeral(high, _DIGITS)}, no failure seen, {words}"
    return f"probability of failure {numeral(failure, _DIGITS)}{interval}, {words}"
