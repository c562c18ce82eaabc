"""Rows of tables in words: where a value stands."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from mechdesign.ground.results import Table
from mechdesign.ground.table_text import Rounding
from mechdesign.questions.dynamics import columns as dynamics
from mechdesign.questions.kinematics import columns as kinematics

# Columns of the places of the extremes before them.
_PLACES = [
    *(table[f"{end}_at"] for table in (kinematics.EXTREMES, dynamics.EXTREMES) for end in ("min", "max")),
    *(kinematics.LOOPS[f"transmission_{end}_at"] for end in ("min", "max")),
    dynamics.EXTREMES["peak_at"], kinematics.TARGETS["at"],
]  # fmt: skip


def place_of(table: Table, row: int, judged: str, freedom: int, begin: int = 0) -> str:
    """The row in words: its leading columns, which are the pose and words such as the method.

    In a table of extremes it is the place of the extreme. `begin` is the number of rows before the table, where it is a
    part of a long one.
    """
    read = Rounding.of(table.columns)
    places = {before.name: column for before, column in pairwise(table.columns) if column.kind in _PLACES}
    place = places.get(judged)
    if place is not None:
        words = [f"{column.name} {column.values[row]}" for column in table.columns[:1] if not column.numeric]
        at = [f"{place.meaning.partition(' at the ')[0]} {read.cell(table.columns, row, place)}"]
        return ", ".join([*words, *(at if np.isfinite(place.values[row]) else [])])
    parts: list[str] = []
    for column in table.columns:
        if column.numeric:
            freedom -= 1
            if column.name == judged or (freedom < 0 and table.strands is None):
                break
            parts += [f"{column.name} {read.cell(table.columns, row, column)}"] if freedom >= 0 else []
        else:
            parts.append(f"{column.name} {column.values[row]}")
    return ", ".join(parts) or f"row {begin + row + 1}"
