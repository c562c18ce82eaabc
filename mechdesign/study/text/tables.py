"""Tables of numbers in a study, of one design or of many."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.study.text.units import Amount


def table_of(rows: Sequence[Sequence[float]], value: Callable[[float], Floats]) -> Floats:
    """Rows of numbers of each design, shape (designs, rows, columns); one design's where they follow no parameter."""
    table = np.array(rows, dtype=float)[None]
    for row, column in np.ndindex(table.shape[1:]):
        number = rows[row][column]
        if isinstance(number, Amount) and number.expression is not None:
            values = value(number)
            table = np.repeat(table, len(values) // len(table), axis=0)
            table[:, row, column] = values
    return table
