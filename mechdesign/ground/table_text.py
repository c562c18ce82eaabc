"""Cells of a table as texts: to the digits of a file, or as a person reads them on a page or in a notebook."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.columns import Column
from mechdesign.ground.errors import printable

_READ = 6  # significant digits of the numbers that a person reads
# Of the largest number with the same unit: what is smaller is rounding error.
_ROUNDING = 1e-13
_NO_NUMBER = {"nan": "\N{EN DASH}", "inf": "\N{INFINITY}", "-inf": "\N{MINUS SIGN}\N{INFINITY}"}


def texts(values: NDArray[Any], digits: int) -> list[str]:
    """Floats to so many significant digits, booleans as 1 and 0, anything else in one safe line."""
    values = np.asarray(values)
    if values.dtype.kind == "f":
        # Adding zero turns -0.0 into 0.0: the sign of a zero is an accident of rounding.
        return [format(value, f".{digits}g") for value in (values + 0.0).tolist()]
    if values.dtype.kind == "b":
        return ["1" if value else "0" for value in values.tolist()]
    return [printable(str(value)) for value in values.tolist()]


def readable(columns: Iterable[Column], shown: Iterable[Column]) -> list[list[str]]:
    """Cells of columns as a person reads them, column by column.

    Numbers have six digits. Where a column has a unit, a number that is rounding error beside the largest of that unit
    in the table is 0.

    Parameters
    ----------
    columns : iterable of Column
        All columns of the table, with the rows of which numbers are seen.
    shown : iterable of Column
        Those of them, with those of their rows, that are read.
    """
    largest = _largest(columns)
    cells = []
    for column in shown:
        values = column.values
        if values.dtype.kind == "f" and column.unit:
            values = np.where(np.abs(values) <= _ROUNDING * largest[column.unit], 0.0, values)
        words = texts(values, _READ)
        cells.append([_NO_NUMBER.get(word, word) for word in words] if values.dtype.kind == "f" else words)
    return cells


def _largest(columns: Iterable[Column]) -> Mapping[str, float]:
    """The largest finite size of the numbers of each unit."""
    largest: dict[str, float] = {}
    for column in columns:
        if column.values.dtype.kind == "f":
            size = float(np.max(np.abs(column.values), initial=0.0, where=np.isfinite(column.values)))
            largest[column.unit] = max(largest.get(column.unit, 0.0), size)
    return largest
