"""Cells of a table as texts: to the digits of a file, or as a person reads them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.columns import Column
from mechdesign.ground.errors import printable
from mechdesign.ground.numerals import DIGITS, in_watts, numeral, printed
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.numerics.rounding import STILL, cleared
from mechdesign.ground.unit_table import unit_value

# The column with the units of the rows, and what the meaning of a column says that has these.
UNIT, IN_UNIT = "unit", "in `unit`"
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


@dataclass(frozen=True)
class ReadColumn:
    """A column as a person reads it: a power in watts, and what is rounding as 0."""

    name: str
    unit: str
    meaning: str
    numeric: bool
    cells: list[str]


def readable(
    columns: Sequence[Column], shown: Iterable[Column], size: tuple[float, str] = (0.0, "")
) -> list[ReadColumn]:
    """Columns as a person reads them; numbers have six digits.

    Parameters
    ----------
    columns : sequence of Column
        All columns of the table, with the rows of which numbers are seen.
    shown : iterable of Column
        Those of them, with those of their rows, that are read.
    size : (float, str)
        A length of the mechanism with its unit, see `Rounding`.
    """
    rounding, shown = Rounding.of(columns, size), [*shown]
    own = _units_of_rows(shown)
    return [_read(column, rounding, own) for column in shown]


def _read(column: Column, rounding: Rounding, own: NDArray[Any] | None) -> ReadColumn:
    unit, watts = column.unit, in_watts(column.unit)
    if column.values.dtype.kind != "f":
        words = texts(column.values, DIGITS)
        cells = ["W" if in_watts(word) else printed(word) for word in words] if column.name == UNIT else words
        return ReadColumn(column.name, unit, column.meaning, column.numeric, cells)
    factors: Any = watts or 1.0
    if own is not None and IN_UNIT in column.meaning:
        factors = np.array([in_watts(word) or 1.0 for word in own.tolist()])
    cells = [numeral(value) for value in (factors * rounding.cleared(column, own)).tolist()]
    cells = [_NO_NUMBER.get(cell, cell) for cell in cells]
    return ReadColumn(column.name, "W" if watts else unit, column.meaning, True, cells)


@dataclass(frozen=True)
class Rounding:
    """Up to which size the numbers of a table are rounding, of each unit and each column of pure numbers.

    That is `STILL` of what they are made of: of the largest number of the same unit, and of those of other units that
    differ from it by lengths and angles alone, each over or times the size of the mechanism: what turns by rounding
    about a metre moves by rounding.
    """

    units: Mapping[str, float]
    columns: Mapping[str, float]

    @classmethod
    def of(cls, columns: Sequence[Column], size: tuple[float, str] = (0.0, "")) -> Rounding:
        """Of the columns of a table, and a length of the mechanism with its unit (0: none is known)."""
        largest, pure = _largest(columns)
        length, own = unit_value(size[1]), dict(largest)
        if length is not None and size[0] > 0:
            metres = size[0] * length[1]
            known = {unit: named for unit in largest if (named := unit_value(unit)) is not None}
            known |= {unit: named for unit in (size[1],) if unit and (named := length)}
            sizes = {**largest, size[1]: max(size[0], largest.get(size[1], 0.0))}
            for unit, (powers, factor) in known.items():
                alike = (
                    sizes[other] * value * metres ** (powers[0] - others[0]) / factor
                    for other, (others, value) in known.items()
                    if others[2:] == powers[2:]
                )
                own[unit] = max(alike)
        return cls(
            {unit: STILL * most for unit, most in own.items()}, {name: STILL * most for name, most in pure.items()}
        )

    def cell(self, columns: Sequence[Column], row: int, column: Column, digits: int = DIGITS) -> str:
        """A number of a table as a person reads it, in its own unit."""
        own = _units_of_rows(columns)
        values = np.asarray(column.values, dtype=float)[row : row + 1]
        here = Column(column.name, values, column.unit, column.meaning, column.kind)
        return numeral(float(self.cleared(here, None if own is None else own[row : row + 1])[0]), digits)

    def cleared(self, column: Column, own: NDArray[Any] | None = None) -> Floats:
        """The values of a column, and 0 where they are rounding; `own` are the units of its rows, if they have some."""
        if own is not None and IN_UNIT in column.meaning:
            return cleared(column.values, np.array([self.still(column, unit) for unit in own.tolist()]))
        return cleared(column.values, self.still(column, column.unit))

    def still(self, column: Column, unit: str) -> float:
        """Up to which size numbers of a column are rounding, in rows of a unit."""
        return self.units.get(unit, 0.0) if unit else self.columns.get(column.name, 0.0)


def _units_of_rows(columns: Sequence[Column]) -> NDArray[Any] | None:
    return next((column.values for column in columns if column.name == UNIT), None)


def _largest(columns: Sequence[Column]) -> tuple[dict[str, float], dict[str, float]]:
    """The largest finite sizes of the numbers of each unit, and of each column of pure numbers that has no tail."""
    largest: dict[str, float] = {}
    pure: dict[str, float] = {}
    own = _units_of_rows(columns)
    for column in columns:
        if column.values.dtype.kind != "f":
            continue
        sizes = np.where(np.isfinite(column.values), np.abs(column.values), 0.0)
        if own is not None and IN_UNIT in column.meaning:
            parts = [(unit, sizes[own == unit]) for unit in dict.fromkeys(own.tolist())]
        else:
            parts = [(column.unit, sizes)]
        for unit, part in parts:
            if unit:
                largest[unit] = max(largest.get(unit, 0.0), float(part.max(initial=0.0)))
            elif column.kind is None or not column.kind.tail:
                # Ratios are made of what is of one size: an efficiency of 1e-15 is none.
                pure[column.name] = float(part.max(initial=1.0))
    return largest, pure
