"""What an analysis returns: named columns with units and a one-line meaning."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Column:
    """One column of a table.

    Parameters
    ----------
    name : str
        Header in the CSV file, fixed by the study format.
    values : ndarray, shape (rows,)
        Floats, integers, booleans (written as 1 and 0) or strings.
    unit : str
        Unit as the study declares it; empty for pure numbers and text.
    meaning : str
        One line for the manifest.
    """

    name: str
    values: NDArray[Any]
    unit: str = ""
    meaning: str = ""

    @property
    def numeric(self) -> bool:
        """Whether it holds numbers or booleans rather than words."""
        return self.values.dtype.kind in "fiub"


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of equal length; ``table["sigma"]`` is the NumPy array."""

    name: str
    columns: tuple[Column, ...]
    meaning: str = ""

    def __post_init__(self) -> None:
        lengths = {len(column.values) for column in self.columns}
        if len(lengths) > 1:
            raise ValueError(f"table {self.name}: columns of unequal length {sorted(lengths)}")

    def column(self, name: str) -> Column:
        """The column of a name.

        Raises
        ------
        KeyError
            If there is none.
        """
        for column in self.columns:
            if column.name == name:
                return column
        raise KeyError(f"table {self.name!r} has no column {name!r}; it has {', '.join(self.names)}")

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.column(name).values

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def __len__(self) -> int:
        return len(self.columns[0].values) if self.columns else 0

    def where(self, **values: object) -> NDArray[np.bool_]:
        """Which rows have these values in columns of these names, as a mask."""
        found = np.ones(len(self), dtype=bool)
        for name, value in values.items():
            found &= self[name] == value
        return found

    def take(self, rows: NDArray[Any]) -> Table:
        """The table of some rows, by a mask or by their numbers."""
        columns = tuple(replace(column, values=np.asarray(column.values)[rows]) for column in self.columns)
        return replace(self, columns=columns)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns, in order."""
        return tuple(column.name for column in self.columns)

    def rows(self) -> Iterator[dict[str, Any]]:
        """Iterate over rows as dictionaries of Python scalars."""
        lists = [np.asarray(column.values).tolist() for column in self.columns]
        for row in zip(*lists, strict=True):
            yield dict(zip(self.names, row, strict=True))


@dataclass(frozen=True, eq=False)
class Result:
    """Answer of one command.

    Parameters
    ----------
    command : str
        Its name in `mechdesign.commands.COMMANDS`.
    tables : mapping of str to Table
        Named as their files; the first is the main table.
    warnings : sequence of str
        What the user must know: poses that failed, near singularities, shared parameters.
    counts : mapping of str to int
        Poses, samples, designs, and how many of them were invalid.
    failed : str
        Message where a pose that a person asked for could not be assembled (exit code 3); tables are whole.
    files : mapping of str to str
        Texts to be written beside the tables, by the names of their files.
    interrupted : str
        How far it came, where it is the finished part of an interrupted computation.
    drawn : mapping of str to object
        What pictures show beside the tables: solved poses, springs; by names that the command's pictures know.
    """

    command: str
    tables: Mapping[str, Table]
    warnings: Sequence[str] = ()
    counts: Mapping[str, int] = field(default_factory=dict)
    failed: str = ""
    files: Mapping[str, str] = field(default_factory=dict)
    interrupted: str = ""
    drawn: Mapping[str, Any] = field(default_factory=dict)

    @property
    def main(self) -> Table:
        """The table that a terminal shows."""
        return next(iter(self.tables.values()))
