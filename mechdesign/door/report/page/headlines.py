"""The most important numbers of a result, chosen by the kinds of its columns."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from mechdesign.door.report.cases import RANK, best_of, short, text_of
from mechdesign.door.report.requirements import DrawnCases
from mechdesign.ground.columns import VARIED, Column
from mechdesign.ground.errors import counted
from mechdesign.ground.numerals import in_watts, numeral, printed
from mechdesign.ground.numerics.rounding import unchanging
from mechdesign.ground.results import KeyNumber, Result, Table
from mechdesign.ground.rows import choose, unit_of
from mechdesign.ground.table_text import Rounding
from mechdesign.motion.followed import Followed
from mechdesign.questions.columns import DRIVE, GIVEN, TIMED, key_numbers
from mechdesign.questions.kinematics.columns import EXTREMES, MOTION
from mechdesign.questions.kinematics.drawn import DrawnPoses
from mechdesign.questions.optimize.columns import OPTIMUM
from mechdesign.questions.workspace.columns import HELD

# Largest number of headlines of a question.
MOST = 8
_MOST_GOALS = 4  # of the best case of a sweep
# Rates, forces, what cams have and clearances: their extremes are not shown, of some the largest absolute value is.
_RATES_AND_FORCES = [
    MOTION[name]
    for name in (
        "<drive>_effort", "<output>_advantage", "<output>_velocity", "<output>_acceleration",
        "<coupling>_pressure_angle", "<coupling>_curvature_radius", "<a>.<b>.clearance", "clearance",
    )
]  # fmt: skip
# Kinds of columns that say which pose a row is of.
_POSE = (TIMED, DRIVE, GIVEN, HELD)
_DIGITS = 4
_SMALL, _LARGE = 1e-3, 1e7
# Rows of key numbers that are told by absolute values, and by the smallest.
_ABSOLUTE, _LOWEST = ("size", "least"), ("smallest", "least")
_MINUS = "\N{MINUS SIGN}"
_TOGETHER = "\N{NO-BREAK SPACE}"
_NARROW = "\N{NARROW NO-BREAK SPACE}"
_SHORT = 20  # letters for which a line has always room


@dataclass(frozen=True)
class Headline:
    """A number with its unit and its name."""

    label: str
    value: str
    unit: str = ""
    note: str = ""  # the pose where it occurs, or its bounds
    at: str = ""  # the words of the note that say the pose
    pose: Mapping[str, float] = field(default_factory=dict)  # by coordinate, in the study's units
    place: float | None = None  # of a number that occurs between the poses of the motion: where, in rows
    meaning: str = ""  # of its column, where no unit tells it from others of its kind


class _Pose(NamedTuple):
    """Where a number occurs: in words, by coordinate, and between the poses of a motion its place in rows."""

    words: str = ""
    coordinates: Mapping[str, float] = {}
    place: float | None = None


def shown(value: float) -> str:
    """A number with four digits, thousands separated, with a power of ten where it is very small or large."""
    value = float(value)
    if not np.isfinite(value):
        return "none" if np.isnan(value) else "infinite" if value > 0 else f"{_MINUS}infinite"
    if value and not _SMALL <= abs(value) < _LARGE:
        return numeral(value, _DIGITS).replace("-", _MINUS)
    places = max(0, _DIGITS - 1 - int(np.floor(np.log10(abs(value)))) if value else 0)
    text = f"{value:,.{places}f}".replace(",", _NARROW).replace("-", _MINUS)
    return text.rstrip("0").rstrip(".") if "." in text else text


@np.errstate(all="ignore")
def headlines(result: Result) -> list[Headline]:
    """The headlines of a result, at most `MOST`, no name twice."""
    numbers = {number.label: number for number in _of_cases(result)}
    front = "pareto" in result.tables
    if front:
        numbers |= {number.label: number for number in _of_front(result.tables[OPTIMUM.name])}
    for rule in () if front else key_numbers(result.command):
        table = result.tables.get(rule.table.name)
        if table is None or not len(table):
            continue
        kind = rule.table[rule.column] if rule.column else None
        columns = [column for column in table.columns
                   if kind in (None, column.kind) and column.numeric and _requested(result, rule, column)]  # fmt: skip
        if rule.nearest:
            columns = sorted(columns, key=lambda column: _least(result, rule, column))[:1]
        for column in columns:
            for number in _of(result, rule, column):
                numbers.setdefault(number.label, number)
    return list(numbers.values())[:MOST]


def _of_cases(result: Result) -> Iterator[Headline]:
    """The best case of a sweep with its goals, the front, and how many cases meet every requirement."""
    table = result.main
    if (best := best_of(table)) is not None:
        row = int(np.flatnonzero(table[RANK] == 1)[0])
        more = [f"{best.equals - 1} more as good"] * (best.equals > 1)
        changes = [column for column in table.columns if column.meaning == VARIED]
        yield Headline("best case", best.name, "", "; ".join([_in_words(changes, row), *more]))
        for name in [*DrawnCases.of(result).goals][:_MOST_GOALS]:
            yield Headline(f"{name} of the best case", shown(table[name][row]), table.column(name).unit)
        if best.front > best.equals:
            yield Headline("cases on the Pareto front", shown(best.front), "", f"of {best.ranked} ranked cases")
    if any(f"{name}_met" in table for name in table.names):
        met = int((table["exit_code"] == 0).sum())
        yield Headline("cases that meet every requirement", shown(met), "", f"of {counted(len(table), 'case')}")


def _of_front(table: Table) -> Iterator[Headline]:
    """The knee of a front with each goal, and the best of each goal, and which designs these are."""
    goals = [name.removeprefix("w_") for name in table.names if name.startswith("w_")]
    variables = [column for column in table.columns if column.kind == OPTIMUM["<variable>"]]
    for row, role in enumerate(table["what"].tolist()):
        design = _in_words(variables, row)
        columns = [column for column in (*variables, *map(table.column, goals)) if column.numeric]
        numbers = {column.name: float(column.values[row]) for column in columns}
        for goal in goals:
            own, others = table.column(goal), [table.column(name) for name in goals if name != goal]
            if role == "knee":
                yield Headline(f"{goal} of the knee", shown(own.values[row]), own.unit, design, design, numbers)
            elif role == f"best {goal}":
                note = f"{design}; there {_in_words(others, row)}"
                yield Headline(role, shown(own.values[row]), own.unit, note, design, numbers)


def _in_words(columns: Iterable[Column], row: int) -> str:
    """``r = 35 mm, section = tube``; a line may be broken between quantities, and before the value of a long name."""
    values = [(column, column.values[row].item()) for column in columns]
    words = [f"{short(column.name)} = {shown(value) if column.numeric else text_of(value)} {printed(column.unit)}"
             for column, value in values]  # fmt: skip
    return ", ".join(map(_together, words))


def _together(words: str) -> str:
    """``name = 35 mm`` in one line, or where that is long at least the value with its unit."""
    name, equals, value = words.strip().partition(" = ")
    value = f"={_TOGETHER}{value.replace(' ', _TOGETHER)}" if equals else ""
    together = f"{name} {value}".rstrip()
    return together if len(together) > _SHORT else together.replace(" ", _TOGETHER)


def _requested(result: Result, rule: KeyNumber, column: Column) -> bool:
    """Whether the study asked for a column: the rate of an output, or a goal with a weight."""
    if rule.column == "<output>_velocity" and "extremes" in result.tables:
        return column.name.removesuffix("_velocity") in result.tables["extremes"]["output"]
    if not rule.column:
        return f"w_{column.name}" in result.tables["optimum"]
    return True


def _least(result: Result, rule: KeyNumber, column: Column) -> float:
    """The smallest value of a column over the motion, or of its rows; infinite without any."""
    between = _between(rule, result, column)
    return between[1] if between else float(np.nanmin(column.values, initial=np.inf))


def _of(result: Result, rule: KeyNumber, column: Column) -> Iterator[Headline]:
    table = result.tables[rule.table.name]
    values = np.asarray(column.values, dtype=float)
    if rule.row in _ABSOLUTE:
        values = np.abs(values)
    groups = list(zip(*(table[name].tolist() for name in rule.by), strict=True)) or [()] * len(table)
    valid = table["valid"].astype(bool) if "valid" in table else np.ones(len(table), dtype=bool)
    finite = np.flatnonzero(np.isfinite(values) & valid)
    rounding = Rounding.of(table.columns)
    if rule.row == "size" and values[finite].max(initial=0.0) <= rounding.still(column, column.unit):
        return
    if rule.row in ("first", "each"):
        rows = finite[: 1 if rule.row == "first" else None].tolist()
    else:
        sign = 1.0 if rule.row in _LOWEST else -1.0
        best: dict[tuple[Any, ...], int] = {}
        for row in finite[np.argsort(sign * values[finite], kind="stable")].tolist():
            best.setdefault(groups[row], row)
        order = [group for group in dict.fromkeys(groups) if group in best]
        if (rank := rule.rank) is not None:
            order.sort(key=lambda group: -rank(group[0]))
        rows = [best[group] for group in order]
    between = _between(rule, result, column)
    for row in [between[0]] if between and rows else rows:
        words = {other.name: str(other.values[row]) for other in table.columns if not other.numeric}
        if rule.table is EXTREMES and result.tables["motion"].column(words["output"]).kind in _RATES_AND_FORCES:
            continue
        unit = unit_of(table, column.name, np.arange(len(table)) == row)
        still, watts = rounding.still(column, unit), in_watts(unit)
        unit = "W" if watts else unit

        def told(number: float, still: float = still, factor: float = watts or 1.0) -> str:
            return shown(0.0 if abs(number) <= still else factor * number)

        name = re.sub("_(effort|power|mean)$", "", column.name)
        pair = " and ".join(name.split(".")[:-1])
        label = rule.label.format_map({**words, "name": name, "meaning": column.meaning, "pair": pair})
        low, high = (float(table[bound][row]) for bound in rule.bounds or (column.name, column.name))
        if rule.table is EXTREMES and low == high:
            # The motion has a single pose.
            yield Headline(words["output"], told(low), unit)
        else:
            notes = [rule.interval.format(low=told(low), high=told(high))] if low < high else []
            alike = [other for other in finite.tolist() if groups[other] == groups[row]]
            constant = rule.row in ("first", "each") or bool(unchanging(values[alike].min(), values[alike].max()))
            own = _swept(result, table.column(rule.at), row) if rule.at else _Pose() if constant else _pose(table, row)
            _, value, pose = between or (row, values[row], own)
            at = f"at {pose.words}" if pose.words else ""
            notes += [at] * bool(at)
            if rule.several and len(finite) > 1:
                least = told(values[finite].min())
                notes.append(f"the largest of {len(finite)} {rule.several}, the smallest is {least}")
            # What a label calls by the words of the field needs no other words.
            said = unit or rule.table is EXTREMES or "{name}" not in rule.label
            meaning = "" if said else column.meaning
            yield Headline(label, told(value), unit, "; ".join(notes), at, pose.coordinates, pose.place, meaning)


def _between(rule: KeyNumber, result: Result, column: Column) -> tuple[int, float, _Pose] | None:
    """The extreme over the whole motion and where it occurs, if the motion is known between the rows of the table.

    The first of the three is a row with its words.
    """
    scope = result.tables[rule.table.name].scope
    if scope is None or scope.follow is None or rule.row in ("first", "each"):
        return None
    sign, absolute = -1 if rule.row in _LOWEST else 1, rule.row in _ABSOLUTE
    courses = _courses(rule, result, column)
    ends = [tuple(float(end[0]) for end in course.worst(sign, absolute=absolute)) for course in courses]
    present = [row for row, (value, _) in enumerate(ends) if np.isfinite(value)]
    if not present:
        return None
    row = max(present, key=lambda number: sign * ends[number][0])
    value, at = ends[row]
    if np.isnan(at):
        return row, value, _Pose()
    poses, pose = courses[row].along.curve.poses, courses[row].pose(at)
    units = {column.name: column.unit for other in result.tables.values() for column in other.columns}
    coordinates = [
        Column(name, np.array([pose[name]]), units.get(name, ""))
        for name in ([*pose] if poses.swept is None else [poses.swept])
    ]
    return row, value, _Pose(_in_words(coordinates, 0), pose, at)


def _courses(rule: KeyNumber, result: Result, column: Column) -> list[Followed]:
    """A column over the motion; what the answer has followed already, but for its zeros, is not followed again."""
    chosen = choose(result, f"{rule.table.name}.{column.name}", {})
    along = result.drawn.along if isinstance(result.drawn, DrawnPoses) else None
    names = [request.column for request in chosen.requests]
    if along is None or rule.row == "least" or not {*names} <= {*along.columns} or not len(along.peaks.place):
        return [*chosen.courses.values()]
    return [Followed(along, name) for name in names]


def _swept(result: Result, at: Column, row: int) -> _Pose:
    """The pose by the value of what is swept in a column; nothing where that is no coordinate, or along a path."""
    swept, value = Column(at.meaning.partition(" at ")[0], at.values, at.unit), float(at.values[row])
    if swept.name not in result.main or not np.isfinite(value):
        return _Pose()
    return _Pose(_in_words([swept], row), {swept.name: value})


def _pose(table: Table, row: int) -> _Pose:
    """The pose of a row, or its held coordinates; nothing where all rows agree."""
    leading = [column for column in table.columns if column.kind in _POSE]
    if all(len(np.unique(column.values)) == 1 for column in leading):
        return _Pose()
    return _Pose(_in_words(leading, row), {column.name: float(column.values[row]) for column in leading})
