"""What an analysis returns: named columns with units and a one-line meaning."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechdesign.ground.cautions import Caution
from mechdesign.ground.columns import Column, ColumnKind, filled
from mechdesign.ground.statistics import Request

if TYPE_CHECKING:
    import pandas

# What a number says that nothing is known of between the poses.
POSES_ONLY = "of the asked poses only"
# Number of columns that a table's repr names.
MAX_SHOWN = 8


@dataclass(frozen=True)
class TableKind:
    """What a table is, and the kinds of its columns."""

    name: str  #: that of its file, without ``.csv``
    meaning: str  #: one line; ``<places>`` stand for words of an answer
    kinds: tuple[ColumnKind, ...]

    @classmethod
    def of(cls, name: str, meaning: str, *kinds: ColumnKind | tuple[str, ...]) -> TableKind:
        """A table of kinds of columns, each of which may be given as its name, meaning, unit and formula."""
        return cls(name, meaning, tuple(ColumnKind(*kind) if isinstance(kind, tuple) else kind for kind in kinds))

    @cached_property
    def _by_name(self) -> dict[str, ColumnKind]:
        return {name: kind for kind in self.kinds for name in kind.names}

    def __getitem__(self, name: str) -> ColumnKind:
        if name not in self._by_name:
            raise KeyError(f"table {self.name!r} declares no column {name!r}; it declares {', '.join(self._by_name)}")
        return self._by_name[name]

    def columns(self, words: Mapping[str, str], /, **values: ArrayLike) -> list[Column]:
        """Columns by their declared names.

        Parameters
        ----------
        words : mapping
            Labels of units by their kinds, as `mechdesign.study.Units.labels`, and what stands at the places.

        Raises
        ------
        KeyError
            If a column is not declared, or a unit or a place of it has no word.
        """
        units = {"": "", **words}
        return [self[name].column(column, units[self[name].unit], name, **words) for name, column in values.items()]

    def table(self, columns: Iterable[Column], /, **words: str) -> Table:
        """The table of some columns, with the words that stand at the places of its meaning."""
        return Table(self.name, tuple(columns), filled(self.meaning, words))


@dataclass(frozen=True)
class KeyNumber:
    """A number at the top of a report: in which column it stands, and in which row."""

    table: TableKind
    column: str  #: its kind, by its declared name; empty: any
    label: str  #: with the words of the row, the column's `name` and its `meaning` at its places in braces
    #: Size is the largest and least the smallest, whatever their signs.
    row: Literal["first", "each", "largest", "smallest", "size", "least"] = "each"
    by: tuple[str, ...] = ()  #: columns of words of which each value counts by itself
    rank: Callable[[str], int] | None = None  #: of the words of the first of these columns: the highest stands first
    bounds: tuple[str, str] | None = None  #: columns of the ends between which it lies
    interval: str = "from {low} to {high}"
    several: str = ""  #: what the rows are, where the smallest of several stands beside the largest
    nearest: bool = False  #: of several such columns that with the most extreme number alone
    at: str = ""  #: the column of the value of what is swept where it occurs


class Strands(NamedTuple):
    """The rows of each pose, of a table that has several: one of each joint, say.

    Parameters
    ----------
    names : tuple of str
        Of the rows of a pose, in their order, such as ``B_force``.
    columns : tuple of str
        Columns that each row has of its own; along a motion they are called ``B_force.fx``.
    main : str
        The column that a name alone means, also along a motion.
    """

    names: tuple[str, ...]
    columns: tuple[str, ...]
    main: str


@dataclass(frozen=True, eq=False)
class Scope:
    """What the rows of a table, one a pose or of all poses together, say of a motion.

    Parameters
    ----------
    poses_only : bool
        Whether nothing is known between the poses asked for.
    missing : str
        In words, which poses or parts of the motion are not valid; empty where all are.
    follow : callable, optional
        Columns along the motion, or parts of it, as `mechdesign.motion.followed` has them, asked together; None for
        each that is not known there.
    until : str
        In words, where the motion has its own end before the time that was asked.
    """

    poses_only: bool = False
    missing: str = ""
    follow: Callable[[Sequence[Request]], Sequence[Any]] | None = None
    until: str = ""


@dataclass(frozen=True, eq=False, repr=False)
class Table:
    """Columns of equal length; ``table["sigma"]`` is the NumPy array.

    Iteration gives its rows as dictionaries, so that ``pandas.DataFrame(table)`` is the same table; `to_pandas` has its
    units as well. Polars takes ``polars.DataFrame(table.to_dict())``.

    >>> import mechdesign
    >>> study = mechdesign.load(text='''
    ... mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, 100]}, drives: [arm]}
    ... kinematics: {poses: [{arm: 0}, {arm: 60}], outputs: [P]}
    ... ''')
    >>> motion = mechdesign.kinematics(study).tables["motion"]
    >>> motion
    <Table motion: 2 rows of arm, P.x, P.y, conditioning, valid>
    >>> motion["P.x"].round(6), motion.column("P.x").unit
    (array([100.,  50.]), 'mm')
    >>> len(motion.take(motion.where(arm=60)))
    1
    """

    name: str
    columns: tuple[Column, ...]
    meaning: str = ""
    scope: Scope | None = None  #: of poses and motions
    strands: Strands | None = None  #: the rows of a pose, where it has several
    #: of each row, why its numbers are not those of the whole motion; empty where they are
    lacking: NDArray[Any] | None = None
    #: of each row, by column, how many of the samples behind it cannot be assembled, in words; empty where all can
    unassembled: Mapping[str, NDArray[Any]] = field(default_factory=dict)

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
        mask = np.ones(len(self), dtype=bool)
        for name, value in values.items():
            mask &= self[name] == value
        return mask

    def take(self, rows: NDArray[Any]) -> Table:
        """The table of some rows, by a mask or by their numbers."""
        columns = tuple(replace(column, values=np.asarray(column.values)[rows]) for column in self.columns)
        unassembled = {name: words[rows] for name, words in self.unassembled.items()}
        lacking = None if self.lacking is None else self.lacking[rows]
        return replace(self, columns=columns, lacking=lacking, unassembled=unassembled)

    def blocks(self) -> Iterator[Table]:
        """The table in parts, one after the other, of which each is in memory."""
        yield self

    @property
    def seen(self) -> Table:
        """The rows that pictures show: all of them."""
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns, in order."""
        return tuple(column.name for column in self.columns)

    def to_dict(self) -> dict[str, NDArray[Any]]:
        """The arrays by the names of their columns, as most libraries of tables take them."""
        return {column.name: column.values for column in self.columns}

    def to_pandas(self) -> pandas.DataFrame:
        """The table as pandas has it: a column each, their units in ``attrs["units"]``.

        Raises
        ------
        ImportError
            If pandas, which mechdesign does without, is not installed.
        """
        try:
            import pandas
        except ImportError as error:
            message = "to_pandas needs pandas: pip install pandas; to_dict() gives the columns without it"
            raise ImportError(message) from error
        frame = pandas.DataFrame(self.to_dict())
        frame.attrs["units"] = {column.name: column.unit for column in self.columns}
        return frame

    def __iter__(self) -> Iterator[dict[str, Any]]:
        """Iterate over rows as dictionaries of Python scalars."""
        lists = [np.asarray(column.values).tolist() for column in self.columns]
        for row in zip(*lists, strict=True):
            yield dict(zip(self.names, row, strict=True))

    def __repr__(self) -> str:
        shown = ", ".join(self.names[:MAX_SHOWN]) + ", ..." * (len(self.names) > MAX_SHOWN)
        return f"<Table {self.name}: {len(self)} rows of {shown}>"

    def _repr_html_(self) -> str:
        from mechdesign.ground.table_html import ROWS, table_html

        shown = self.take(np.arange(min(ROWS, len(self))))
        return table_html(self.name, self.meaning, self.seen.columns, shown.columns, len(self) - len(shown))


class Drawn:
    """What the pictures of a result need besides its tables; each question has a record of its own."""

    study: Any = None  # whose mechanism is shown for the answer; None: that which was asked

    @classmethod
    def of(cls, result: Result) -> Self:
        """The record of this kind that a result carries.

        Raises
        ------
        TypeError
            If it carries none, or one of another kind.
        """
        if not isinstance(result.drawn, cls):
            raise TypeError(f"a result of {result.command} carries no {cls.__name__}")
        return result.drawn


@dataclass(frozen=True, eq=False, repr=False)
class Result:
    """Answer of one command.

    >>> import mechdesign
    >>> study = mechdesign.load(text='''
    ... mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, 100]}, drives: [arm]}
    ... kinematics: {poses: [{arm: 0}, {arm: 60}], outputs: [P]}
    ... ''')
    >>> result = mechdesign.kinematics(study)
    >>> list(result.tables), result.main["P.y"].round(4), list(result.warnings)
    (['motion', 'extremes'], array([ 0.    , 86.6025]), [])
    """

    command: str  #: its name in `mechdesign.commands.COMMANDS`
    tables: Mapping[str, Table]  #: named as their files; the first is the main table
    warnings: Sequence[Caution] = ()  #: what the user must know, such as poses that failed
    counts: Mapping[str, int] = field(default_factory=dict)  #: poses, samples, designs; how many of them were invalid
    failed: str = ""  #: why a pose that a person asked for could not be assembled (exit code 3); tables are whole
    files: Mapping[str, str] = field(default_factory=dict)  #: texts to be written with the tables, by their file names
    interrupted: str = ""  #: how far it came, where it is the finished part of an interrupted computation
    drawn: Drawn | None = None  #: what pictures need besides the tables
    absent: Mapping[str, str] = field(default_factory=dict)  #: why columns and tables have no values, by their names
    notes: Sequence[str] = ()  #: what is said of the whole answer, such as how complete a list of solutions is
    reached: bool = True  #: else `failed` says why a reliability is not reached, where all poses assemble
    allocated: Mapping[str, Table] = field(default_factory=dict)  #: those with allocated tolerances, which are judged

    def __repr__(self) -> str:
        tables = ", ".join(f"{name} ({len(table)} rows)" for name, table in self.tables.items())
        count = len(self.warnings)
        return f"<Result of {self.command}: {tables}; {count or 'no'} warning{'s' * (count != 1)}>"

    def whose(self, study: Any) -> Any:
        """The study whose mechanism is shown for the answer: that which was asked, or its own, such as the best."""
        return study if self.drawn is None or self.drawn.study is None else self.drawn.study

    @property
    def seen(self) -> Result:
        """The result with those rows of its tables that pictures show."""
        return replace(self, tables={name: table.seen for name, table in self.tables.items()})

    @property
    def main(self) -> Table:
        """The table that a terminal shows."""
        return next(iter(self.tables.values()))
