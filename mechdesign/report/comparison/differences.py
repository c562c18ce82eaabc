"""Differences of two folders of results, and their tolerances."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from mechdesign.errors import counted
from mechdesign.numerics.arrays import Floats
from mechdesign.results import Column, Table

# What is otherwise; of `bytes` a file that is to be the same again.
Change = Literal["moved", "missing", "new", "unit", "verdict", "outcome", "bytes", "stale", "not met"]


class Tolerance(NamedTuple):
    """A number is as it was within ``atol + rtol * |old|``."""

    rtol: float
    atol: float | None = None  # None: `tables.ROUNDING` of the largest number of its unit in the table


@dataclass(frozen=True)
class Tolerances:
    """Tolerances of columns: of the patterns that fit ``command.table.column`` the last counts.

    A pattern may begin with the folder, ``FOLDER/reliability.*``.
    """

    default: Tolerance
    patterns: Mapping[str, Tolerance] = field(default_factory=dict)


@dataclass(frozen=True)
class Difference:
    """A difference in a column, a table, a folder or a verdict."""

    folder: str
    table: str  # empty where it is the whole folder
    column: str  # empty where it is the whole table, or rows of it
    change: Change
    rows: int = 0  # how many
    largest: float = math.nan  # absolute difference; inf between a number and none; nan of words
    relative: float = math.nan  # that difference over the old value
    old: str = ""  # where it is largest
    new: str = ""
    row: str = ""  # its pose or key
    unit: str = ""
    # For the picture: all numbers of a column that moved, before and after; the pose where it alone tells rows apart.
    values: tuple[Floats, Floats] | None = field(default=None, compare=False, repr=False)
    along: Column | None = field(default=None, compare=False, repr=False)

    @property
    def share(self) -> float:
        """The largest difference over the largest old value."""
        assert self.values is not None
        scale = np.abs(self.values[0][np.isfinite(self.values[0])]).max(initial=0.0)
        return self.largest / float(scale) if scale else math.inf

    def __str__(self) -> str:
        place = ": ".join(part for part in (self.folder, ".".join(filter(None, (self.table, self.column)))) if part)
        at = f" at {self.row}" if self.row else ""
        if self.change in ("missing", "new"):
            whole = "column" if self.column else "table" if self.table else "result"
            noun = counted(self.rows, "row") if self.rows else whole
            return f"{place}: {noun} {self.change}{f', the first{at}' if at else ''}"
        if self.change in ("stale", "not met"):
            return f"{place}: {self.change}{': ' * bool(self.new)}{self.new}"
        size = "" if math.isnan(self.largest) else f" by {self.largest:.3g} {self.unit}".rstrip()
        size += "" if math.isnan(self.relative) else f" (relative {self.relative:.2g})"
        rows = f" ({self.rows} rows)" if self.rows > 1 else ""
        return f"{place}: {self.change}{size}{at}: {self.old} -> {self.new}{rows}"


@dataclass
class Comparison:
    """All differences of two folders of results; `compared` counts the tables and columns that both have."""

    differences: list[Difference] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    compared: Counter[str] = field(default_factory=Counter)
    cases: list[tuple[str, str]] = field(default_factory=list)  # folder and table of each that was compared

    @property
    def moved(self) -> list[Difference]:
        """The columns of numbers that moved, those first that moved most for their size."""
        return sorted(
            (difference for difference in self.differences if difference.values), key=lambda entry: -entry.share
        )

    @property
    def table(self) -> Table:
        """The differences as a table."""
        meanings = {
            "folder": "of the result, below those compared",
            "table": "its table; empty where it is the whole result",
            "column": "its column; empty where it is the whole table or rows of it",
            "change": "moved, missing, new; unit, verdict or outcome: another one; not met: a requirement; stale: of a "
            "question that the study of the results beside it does not ask",
            "rows": "how many rows",
            "largest": "largest absolute difference, in `unit`; inf between a number and nan; nan of words",
            "relative": "that difference over the old value of the same row",
            "old": "old value where the absolute difference is largest",
            "new": "new value there",
            "row": "pose or key of that row, or of the first that is missing or new",
            "unit": "unit of the column",
        }
        kinds: dict[str, type] = {"rows": int, "largest": float, "relative": float}
        columns = []
        for name, meaning in meanings.items():
            values = [getattr(difference, name) for difference in self.differences]
            columns.append(Column(name, np.array(values, kinds.get(name, str)), meaning=meaning))
        return Table("differences", tuple(columns), "what moved, is missing or is new")
