"""Columns of results by name, and which rows of them count: what requirements, goals and conditions judge."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdesign.ground.errors import suggestion
from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.ground.numerics.rounding import cleared
from mechdesign.ground.results import Result, Strands, Table
from mechdesign.ground.row_values import equal_to, present_words
from mechdesign.ground.statistics import (
    STATISTICS,
    Interval,
    Measured,
    Part,
    Request,
    RowSpread,
    Several,
    ValueRange,
    no_value,
    no_value_along,
)  # fmt: skip
from mechdesign.ground.table_text import IN_UNIT

if TYPE_CHECKING:
    from mechdesign.motion.followed import Followed

# Number of rows that a message names.
MOST_ROWS = 8


class UnknownColumnError(Exception):
    """A column that the result does not have, that holds words, or whose rows have different units."""


@dataclass(frozen=True, eq=False)
class ChosenRows:
    """A column and the rows of its table that count."""

    table: Table
    column: str
    values: Floats  # all rows
    counts: Flags  # which rows count
    missing: str = ""  # where the table never has the rows that `where` names: why, and which it has
    statistic: str = ""  # number that is taken of the rows, a word of `STATISTICS`; empty for the one row itself
    part: Part = ()  # part of a motion that counts: columns, and the interval in which each lies
    name: str = ""  # as the study may name it: command, table and row, without the statistic
    picked: bool = False  # whether `where` picks single poses: then the motion between the rows does not count
    strands: Ints | None = None  # of a table with several rows a pose: which of these count, by their numbers

    @property
    def unit(self) -> str:
        """Unit of the rows that count, or of their statistic."""
        pure = self.statistic and STATISTICS[self.statistic].pure
        return "" if pure else unit_of(self.table, self.column, self.counts)

    @property
    def parts(self) -> tuple[ChosenRows, ...]:
        """The columns that it is made from: itself. A `Sum` has one for each term."""
        return (self,)

    @property
    def isolated(self) -> bool:
        """Whether it speaks of the poses alone, though rows of a motion are judged."""
        scope = self.table.scope
        return scope is not None and (scope.poses_only or not (scope.follow is None or self.picked or self.courses))

    def counted(self, *, assembled: bool) -> Flags:
        """Rows that count; `assembled`: of these only assembled poses do."""
        valid = self.table["valid"].astype(bool) if assembled and "valid" in self.table else True
        return np.asarray(self.counts & valid)

    @property
    def lacking(self) -> str:
        """Where a row that counts, or the motion between the rows, has no value, in words; empty where it has."""
        if self.table.lacking is not None:
            return next(filter(None, self.table.lacking[self.counts].tolist()), "")
        counts = self.counted(assembled=True)
        lost = int(np.count_nonzero(np.isnan(self.values[counts])))
        if lost and self.table.scope is not None and len(self.table) > 1:
            return no_value(lost, int(np.count_nonzero(counts)), "pose" if self.table.strands is None else "row")
        return next((no_value_along(part) for course in self.courses.values() if (part := float(course.lost[0]))), "")

    @property
    def gaps(self) -> tuple[str, ...]:
        """Which poses, parts of the motion or samples are missing, in words; empty where none is."""
        words = self.table.unassembled.get(self.column)
        rows = [] if words is None else [word for word in words[self.counts].tolist() if word][:1]
        return tuple(filter(None, [self.table.scope.missing if self.table.scope is not None else "", *rows]))

    @cached_property
    def courses(self) -> Mapping[str, Followed]:
        """The column between the rows, where these are poses of a motion that is followed.

        Of a table with several rows a pose there is one of each, by its words.
        """
        scope = self.table.scope
        if scope is None or scope.follow is None or self.picked:
            return {}
        seen = self.table.seen
        words = [
            ", ".join(f"{column.name} {column.values[k]}" for column in seen.columns if not column.numeric)
            for k in ([] if self.strands is None else self.strands.tolist())
        ]
        courses = zip(words or [""], scope.follow(self.requests), strict=True)
        known = {word: course for word, course in courses if course is not None}
        return known if len(known) == len(self.requests) else {}

    @property
    def requests(self) -> tuple[Request, ...]:
        """What has to be known of the column between the rows."""
        integral = bool(self.statistic) and STATISTICS[self.statistic].integral
        if self.strands is None or self.table.strands is None:
            return (Request(self.column, self.part, integral),)
        names, own, main = self.table.strands

        def request(strand: str) -> Request:
            columns = {name: f"{strand}.{name}" for name in own} | {main: strand}
            column, *ends = (columns.get(name, name) for name in (self.column, *dict(self.part)))
            part = tuple((end, interval) for end, (_, interval) in zip(ends, self.part, strict=True))
            return Request(column, part, integral)

        return tuple(request(names[k]) for k in self.strands.tolist())

    def shaped(self, designs: int, *, assembled: bool = False) -> tuple[Floats, Flags]:
        """Values of several designs, shape (designs, rows), and which count; `assembled`: only assembled poses do."""
        shape = designs, len(self.values) // designs
        return self.values.reshape(shape), self.counted(assembled=assembled).reshape(shape)

    def numbers(self, designs: int = 1, *, assembled: bool = False) -> Floats:
        """The one number of each design, shape (designs,): its statistic, or the row that counts.

        Along a motion that is followed the statistic is that of the whole motion, not of its rows alone. It is nan
        where no row counts, and where a row that counts has no value.

        Raises
        ------
        UnknownColumnError
            If several rows count and no statistic is named.
        """
        values, counts = self.shaped(designs, assembled=assembled)
        if not self.statistic:
            if (several := counts.sum(axis=1)).max(initial=0) > 1:
                raise UnknownColumnError(self._several(int(several.max())))
            return RowSpread(values, counts).end(1)
        statistic = STATISTICS[self.statistic].of
        spread = RowSpread(values, counts)
        rows = statistic(spread)
        if not self.courses:
            return rows
        courses = [*self.courses.values()]
        rounding = max(course.rounding for course in courses)
        lost = (np.isnan(values) & counts).any(axis=1) | ~np.all([course.followed for course in courses], axis=0)
        numbers = np.where(lost, rows, statistic(Several(courses, spread, rounding)))
        if not STATISTICS[self.statistic].pure:
            numbers = cleared(numbers, rounding)
        return np.where(np.any([course.lost > 0 for course in courses], axis=0), np.nan, numbers)

    def _several(self, count: int) -> str:
        words = [*STATISTICS]
        return (
            f"{self.name} has {count} rows; ask for {self.name}.{words[0]}, or for its {', '.join(words[1:-1])} or "
            f"{words[-1]}, or name its row"
        )

    def bound(self, value: float) -> float:
        """A bound in the unit of the rows that count.

        Raises
        ------
        UnknownColumnError
            If it is a quantity of another kind.
        """
        return amount_in(value, f"{self.table.name}.{self.column}", self.unit)


def choose(result: Result, path: str, where: Mapping[str, Any]) -> ChosenRows:
    """Find a column and the rows in which others have the values of `where`, or lie in its spans.

    Parameters
    ----------
    path : str
        ``column``, of the first table that has it; ``table.column``; or ``table.row.column`` with a word of the row,
        as in ``extremes.C.x.range``; each also with a word of `STATISTICS` behind it, as in ``C.x.mean``.

    Raises
    ------
    UnknownColumnError
        If there is no such column (why, where the result says so), it holds words, its rows have several units, or a
        value of `where` is a quantity of another kind than its column.
    """
    path, statistic = named(result, path)
    table, column, rows = located(result, path)
    counts = rows
    values = table[column]
    if column in result.absent and np.isnan(values).all():
        raise UnknownColumnError(_why_absent(result, column))
    if not table.column(column).numeric:
        raise UnknownColumnError(
            f"column {column!r} of {table.name} holds words, which cannot be compared with a number"
        )
    where, part = dict(where), list[tuple[str, Interval]]()
    # Rows of words alone, and whether other values pick poses among them.
    worded, picked = rows, False
    for name, value in where.items():
        if name not in table:
            several = isinstance(value, ValueRange) and table.name == "extremes"
            hint = "; name what is told of a column itself, as in kinematics.C.x.range" * several
            raise UnknownColumnError(_unknown("where", name, table.names) + hint)
        if isinstance(value, ValueRange):
            part.append((name, _interval(value, table, name, counts)))
            counts = counts & part[-1][1].holds(table[name].astype(float))
            continue
        if table.column(name).numeric and isinstance(value, Measured):
            where[name] = in_unit(value, table, name, counts)
        equal = equal_to(table[name], where[name])
        counts = counts & equal
        # Words name rows of each pose, and the poses that are valid are all there are of a motion.
        whole = name == "valid" and where[name] == 1
        picked |= not whole and (table.strands is None or table.column(name).numeric)
        worded = worded if table.column(name).numeric else worded & equal
    _one_unit(table, column, counts)
    numbers = values.astype(float)
    if table.lacking is not None:
        numbers = np.where(table.lacking == "", numbers, np.nan)
    missing = "" if counts.any() or part else _missing(table, rows, where)
    return ChosenRows(
        table, column, numbers, counts, missing, statistic, tuple(part),
        f"{result.command}.{path}", picked, _strands(table, worded),
    )  # fmt: skip


def _strands(table: Table, rows: Flags) -> Ints | None:
    """Which rows of a pose are among some rows, of a table with several; else None."""
    if table.strands is None:
        return None
    return np.flatnonzero(rows.reshape(-1, len(table.strands.names)).any(axis=0))


def named(result: Result, path: str) -> tuple[str, str]:
    """The path of a column, and the statistic behind it; empty where it names none.

    Raises
    ------
    UnknownColumnError
        If there is no such column or statistic.
    """
    if _place(result, path) is not None:
        return path, ""
    head, _, word = path.rpartition(".")
    if not head or _place(result, head) is None:
        located(result, path)
    if word not in STATISTICS:
        raise UnknownColumnError(f"{head} has no {word!r}; it has {', '.join(STATISTICS)}")
    return head, word


def unit_of(table: Table, name: str, rows: Flags) -> str:
    """Unit of a column in some rows, all of one unit: that of the column, or where its meaning says so, of the rows."""
    column = table.column(name)
    own = IN_UNIT in column.meaning and "unit" in table and rows.any()
    return str(table["unit"][rows.argmax()]) if own else column.unit


def in_unit(value: Any, table: Table, name: str, rows: Flags | None = None) -> float:
    """A number in the unit that a column has in some rows, or in all; a bare number is in that unit already.

    Raises
    ------
    UnknownColumnError
        If it is a quantity of another kind, or the rows have several units.
    """
    rows = np.ones(len(table), dtype=bool) if rows is None else rows
    if isinstance(value, Measured):
        _one_unit(table, name, rows)
    return amount_in(value, f"{table.name}.{name}", unit_of(table, name, rows))


def amount_in(value: Any, label: str, unit: str) -> float:
    """A number in a unit, which a bare number has already; raises UnknownColumnError if the kinds differ."""
    try:
        return value.within(unit) if isinstance(value, Measured) else float(value)
    except ValueError as error:
        raise UnknownColumnError(f"{label}: {error}") from None


def _interval(span: ValueRange, table: Table, name: str, rows: Flags) -> Interval:
    """A span in the unit that a column has in some rows, the same in all of them."""
    if not table.column(name).numeric:
        raise UnknownColumnError(f"where: column {name!r} of {table.name} holds words, which have no range")
    _one_unit(table, name, rows)
    try:
        return span.interval(unit_of(table, name, rows))
    except ValueError as error:
        raise UnknownColumnError(f"where: {name}: {error}") from None


def _one_unit(table: Table, column: str, counts: Flags) -> None:
    """Check that the rows that count have one unit, not millimetres and degrees."""
    if IN_UNIT not in table.column(column).meaning or "unit" not in table:
        return
    units = np.asarray(table["unit"])[counts]
    if len(set(units.tolist())) < 2:
        return
    named = [other for other in table.columns if not other.numeric and other.name != "unit"]
    pairs = {other.name: dict.fromkeys(zip(other.values[counts], units.tolist(), strict=True)) for other in named}
    # The column of words that distinguishes the rows of one unit from those of another.
    distinct = [name for name, own in pairs.items() if len({word for word, _ in own}) == len(own)]
    words = distinct[0] if distinct else named[0].name
    rows = [f"{word} ({unit or 'no unit'})" for word, unit in pairs[words]]
    listed = ", ".join(rows[:MOST_ROWS]) + ", ..." * (len(rows) > MOST_ROWS)
    raise UnknownColumnError(
        f"the rows of {table.name} whose {column} is judged have several units: {listed}; say which of them count by "
        f"'where', e.g. where: {{{words}: {next(iter(pairs[words]))[0]}}}"
    )


def located(result: Result, path: str) -> tuple[Table, str, Flags]:
    """The table, the column and the rows that a path names; see `choose`."""
    if (place := _place(result, path)) is not None:
        return place
    for absent in result.absent:
        if absent in path.split("."):
            raise UnknownColumnError(_why_absent(result, absent))
    first, word = path.partition(".")[0], path.rpartition(".")[2]
    tables = [result.tables[first]] if first in result.tables else [*result.tables.values()]
    columns = [name for table in tables for name in (*table.names, *(table.strands.names if table.strands else ()))]
    written = [f"{name}.{word}" for name in columns if word in STATISTICS]
    written += [f"{table.name}.{name}" for table in tables for name in (*table.names, *_of_rows(table))]
    raise UnknownColumnError(_unknown(f"the result of {result.command}", path, columns, written))


def _of_rows(table: Table) -> Iterator[str]:
    """Its numbers by the words of their rows, such as ``C.x.range`` of the extremes."""
    words = dict.fromkeys(word for column in table.columns if not column.numeric for word in column.values.tolist())
    return (f"{word}.{column.name}" for word in words if word for column in table.columns if column.numeric)


def _place(result: Result, path: str) -> tuple[Table, str, Flags] | None:
    """What `located` gives; None where there is no such column."""
    name, _, rest = path.partition(".")
    named = result.tables.get(name)
    places = [(table, path) for table in result.tables.values()] + ([(named, rest)] if named else [])
    for table, column in places:
        if column in table:
            return table, column, np.ones(len(table), dtype=bool)
    strand, _, rest_of_strand = path.removeprefix(f"{name}." if named is not None else "").partition(".")
    for table in result.tables.values() if named is None else [named]:
        names, own, main = table.strands or Strands((), (), "")
        # A joint of several links bears a force on each.
        numbers = [k for k, own_name in enumerate(names) if own_name == strand or own_name.startswith(f"{strand}_on_")]
        if numbers and (column := rest_of_strand or main) in own:
            return table, column, np.isin(np.arange(len(table)) % len(names), numbers)
    if named is not None:
        for column in named.names:
            word = rest.removesuffix(f".{column}")
            for words in named.columns if word != rest else ():
                if not words.numeric and (rows := equal_to(words.values, word)).any():
                    return named, column, rows
    return None


def _why_absent(result: Result, name: str) -> str:
    return f"{result.command} has no {name}: {result.absent[name]}"


def _unknown(where: str, name: str, columns: Iterable[str], written: Iterable[str] = ()) -> str:
    names = list(dict.fromkeys(columns))
    hint = suggestion(name, [*names, *written]) or f"; it has {', '.join(names)}"
    return f"{where}: no column {name!r}{hint}"


def _missing(table: Table, rows: Flags, where: Mapping[str, Any]) -> str:
    """Why no row has the values of `where`; empty where a row might have them in another run, such as a valid pose."""
    stated = {name: value for name, value in where.items() if table[name].dtype.kind != "b"}
    together = rows
    for name, value in stated.items() if rows.any() else ():
        equal = equal_to(table[name], value)
        if not (rows & equal).any():
            return (
                f"no row of {table.name} has {_stated(table, name, value)}; {present_words(table[name][rows], value)}"
            )
        together = together & equal
    words = ", ".join(_stated(table, name, value) for name, value in stated.items())
    return f"no row of {table.name} has {words} at once" if rows.any() and not together.any() else ""


def _stated(table: Table, name: str, value: Any) -> str:
    """A value of a column in words; a quantity with the unit of the column, to which it was converted."""
    number = isinstance(value, float) and not isinstance(value, Measured)
    return f"{name} {value:.12g} {table.column(name).unit}".rstrip() if number else f"{name} {value}"
