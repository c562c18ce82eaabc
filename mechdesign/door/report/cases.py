"""Cases of a sweep in words: their changes, and which cases are best."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from mechdesign.commands import QUESTIONS, SWEEP
from mechdesign.ground.columns import CHOSEN, VARIED, Column
from mechdesign.ground.errors import OUTCOMES, counted
from mechdesign.ground.numerals import numeral
from mechdesign.ground.results import Table
from mechdesign.study.text.document import in_yaml

RANK, FRONT = "rank", "front"


def short(name: str) -> str:
    """The name of an entry without ``mechanism.parameters.`` or ``mechanism.``."""
    return name.removeprefix("mechanism.parameters.").removeprefix("mechanism.")


def text_of(value: Any) -> str:
    """A value in words."""
    if isinstance(value, float):
        return numeral(value)
    return value if isinstance(value, str) else in_yaml(value)


def changes_in_words(changes: Iterable[tuple[str, Any]]) -> str:
    """``r 35, l 120``."""
    return ", ".join(f"{short(name)} {text_of(value)}" for name, value in changes)


@dataclass(frozen=True)
class BestCase:
    """The best case of a sweep.

    Parameters
    ----------
    case : int
        Its number, from 1; of equals the first.
    label : str
        What the file of cases calls it.
    changes : str
        Its values in words.
    ranked, equals, front : int
        How many cases are ranked, are as good as it, and are on the Pareto front.
    """

    case: int
    label: str
    changes: str
    ranked: int
    equals: int
    front: int

    @property
    def words(self) -> str:
        """``case 17 (r 35, l 120)``."""
        more = f" and {self.equals - 1} more as good" if self.equals > 1 else ""
        return f"case {self.case} ({f'{self.label}: ' * bool(self.label)}{self.changes}){more}"

    @property
    def name(self) -> str:
        """Its number and label, ``17 (spare)``."""
        return f"{self.case} ({self.label})" if self.label else f"{self.case}"

    def __str__(self) -> str:
        front = f"; {self.front} of them are on the Pareto front" if self.front > self.equals else ""
        return f"best of {counted(self.ranked, 'ranked case')} is {self.words}{front}"


def telling(table: Table) -> list[Column]:
    """Columns of a sweep as people read them: the case, what varies, the verdict in words, results, and all others."""
    required = [name for name in table.names if f"{name}_met" in table]
    kept = {1: "NOT MET", 0: "met"} if required else {}
    codes = table["exit_code"].tolist() if "exit_code" in table else []
    words = np.array([kept.get(code) or OUTCOMES[code] for code in codes])
    first = [column for column in table.columns if column.name in ("case", "label")]
    varied = [column for column in table.columns if column.meaning == VARIED]
    first += [Column(short(column.name), column.values, column.unit, column.meaning, column.kind) for column in varied]
    first += [Column("verdict", words, meaning="what became of the case")] * bool(codes)
    first += [column for column in table.columns if column.name == RANK]
    first += [column for column in table.columns if column.meaning == CHOSEN]
    first += [column for column in table.columns if column.name in required]
    rest = [column for column in table.columns if column not in (*first, *varied) and column.name != "exit_code"]
    return [*first, *rest]


def arranged(command: str, table: Table) -> list[Column]:
    """The columns of an answer as people read them; of a sweep see `telling`.

    Those that its question puts first are first, and what says nothing in any row is last.
    """
    if command == SWEEP.name:
        return telling(table)
    first = getattr(import_module(QUESTIONS[command].columns), "FIRST", ())
    order = sorted(table.columns, key=lambda column: (*first, column.name).index(column.name) if first else 0)
    return sorted(order, key=lambda column: not column.numeric and not any(column.values.tolist()))


def best_of(table: Table) -> BestCase | None:
    """The best case of a sweep's table, which is read block by block; None where no case is ranked."""
    if FRONT not in table:
        return None
    best: tuple[int, str, str] | None = None
    numbers = np.zeros(3, dtype=np.intp)
    for part in table.blocks():
        rank = part[RANK]
        first = np.flatnonzero(rank == 1)
        if best is None and len(first):
            row = first[0]
            changes = [
                (column.name, column.values[row].tolist()) for column in part.columns if column.meaning == VARIED
            ]
            label = str(part["label"][row]) if "label" in part else ""
            best = int(part["case"][row]), label, changes_in_words(changes)
        numbers += np.isfinite(rank).sum(), len(first), int(part[FRONT].sum())
    return None if best is None else BestCase(*best, *numbers.tolist())
