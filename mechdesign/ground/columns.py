"""Columns of tables, and what they are declared as."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

# Meaning of a column of what varies over the cases of a sweep.
VARIED = "varied"
# Meaning of a column of a result that a sweep was asked for.
CHOSEN = "chosen result"


@dataclass(frozen=True, eq=False, repr=False)
class Column:
    """One column of a table.

    >>> import numpy as np
    >>> from mechdesign.ground.columns import Column
    >>> Column("P.x", np.array([1.5, 2.5]), "mm", "coordinate of a point")
    <Column P.x in mm: 2 values>
    """

    name: str  #: header in the CSV file, fixed by the study format
    values: NDArray[Any]  #: floats, integers, booleans (written as 1 and 0) or strings, one a row
    unit: str = ""  #: as the study declares it; empty for pure numbers and text
    meaning: str = ""  #: one line for the manifest
    kind: ColumnKind | None = None  #: what it is; of columns that the reference does not have, None

    def __repr__(self) -> str:
        unit = f" in {self.unit}" if self.unit else ""
        return f"<Column {self.name}{unit}: {len(self.values)} values>"

    @property
    def numeric(self) -> bool:
        """Whether it holds numbers or booleans rather than words."""
        return self.values.dtype.kind in "fiub"


# A place in a declared text at which a name of the study stands.
PLACE = re.compile(r"<([^>]*)>")


def filled(text: str, words: Mapping[str, str]) -> str:
    """A declared text with the words of a study at its places."""
    return PLACE.sub(lambda place: words[place[1]], text) if "<" in text else text


@dataclass(frozen=True)
class ColumnKind:
    """What a column is, for the columns of answers and for the reference.

    ``<places>`` in its name and its meaning stand for names of a study.

    >>> import numpy as np
    >>> from mechdesign.ground.columns import ColumnKind
    >>> VELOCITY = ColumnKind("<output>_velocity", "velocity of <output>", "as the output, per time")
    >>> VELOCITY.column(np.array([1.5, 2.5]), "mm/s", output="P.x")
    <Column P.x_velocity in mm/s: 2 values>
    """

    name: str  #: header; several, separated by ``, ``, where columns differ in their names alone
    meaning: str  #: one line
    unit: str = ""  #: kind of quantity, several with ``or``, or, after ``as``, what has its unit; empty: none
    formula: str = ""
    #: whether it is the probability of what is rare, of which no size is rounding
    tail: bool = field(default=False, kw_only=True)

    @property
    def names(self) -> list[str]:
        """The headers."""
        return self.name.split(", ")

    def column(self, values: ArrayLike, unit: str = "", name: str = "", /, **words: str) -> Column:
        """A column of this kind, with the words that stand at its places; `name` is one of several names."""
        return Column(filled(name or self.name, words), np.asarray(values), unit, filled(self.meaning, words), self)
