"""Paths of a coordinate or a point: as the study file gives them, and as arrays.

A path is points or numbers one after another, a circle, an arc, or a line. That of a point has, at every place, the
length of the way to it and the direction and bend of the path there.
"""

from __future__ import annotations

import csv
import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from mechdesign.errors import StudyError
from mechdesign.numerics.arrays import Complexes, Floats, Ints
from mechdesign.study.text import fields
from mechdesign.study.text.fields import MIN_NUMBER, Context, failure, read_number, read_rows
from mechdesign.study.text.inputs import Folder, file_of

# Numbers of poses where a study does not say them: of a circle (in steps of 5 deg); of a line or an arc, both ends too.
CIRCLE_POSES = 72
LINE_POSES = 51
# Pieces of a spline between two of its points whose lengths are added up.
SPLINE_PIECES = 64
# Steps of a path that differ by less than this part of them go on evenly.
EVEN = 1e-9
_ROWS = {"type": ["array", "string", "number"], "title": "[[x, y], ...] or [number, ...] or file or number"}

Speed = Annotated[float, fields.number("velocity", 0.0, exclusive=True)]
Point = Annotated[tuple[fields.Length, fields.Length], fields.pair_of("[x, y]")]


def _radians(raw: Any, context: Context) -> float:
    return read_number(raw, context, "angle").nominal * context.units.angle_factor


Radians = Annotated[float, fields.Read(_radians, fields.NUMBER_FORM, "angle")]


class Circle(fields.Model):
    """A whole circle, counter-clockwise unless it says otherwise; the last pose is one step before it closes."""

    center: Point
    """Centre [x, y]. Example: [0, 220]"""
    radius: fields.PositiveLength
    """Radius of the circle. Example: 40"""
    from_: Radians = Field(0.0, alias="from")
    """Angle of the first place about the centre, from the x axis. Example: 90"""
    clockwise: bool = False
    """Whether it is passed clockwise."""

    @property
    def to(self) -> float:
        """Angle at which it closes."""
        return self.from_ + (-2.0 if self.clockwise else 2.0) * math.pi


class Arc(fields.Model):
    """Part of a circle between two angles from the x axis, both ends included; clockwise where they fall."""

    center: Point
    """Centre [x, y]. Example: [0, 220]"""
    radius: fields.PositiveLength
    """Radius of the circle. Example: 40"""
    from_: Radians = Field(alias="from")
    """Angle of the first place about the centre, from the x axis. Example: 0"""
    to: Radians
    """Angle of the last place; less than ``from``: clockwise. Example: 180"""

    @model_validator(mode="after")
    def _some(self) -> Arc:
        if self.from_ == self.to:
            raise failure("an arc needs two different angles 'from' and 'to'")
        return self


def _through(raw: Any, context: Context) -> tuple[tuple[float, ...], ...]:
    """Numbers or [x, y] one after another; a number alone is held."""
    rule = "a list of [x, y] (of a point) or a list of numbers, not a mixture, is expected"
    if not isinstance(raw, list):
        return read_rows([raw], context, 1, rule, "")
    return read_rows(raw, context, 2, rule, "an empty path; give its points, [[x, y], ...]")


class PathSection(fields.Model):
    """What one coordinate or point passes; a list, a CSV file's name or a number alone are short forms."""

    short = (_ROWS,)
    one_of = ("a path is one of through, file, circle, arc, line", "through", "file", "circle", "arc", "line")
    through: Annotated[tuple[tuple[float, ...], ...], fields.Read(_through, _ROWS)] | None = None
    """Places [x, y] of a point, or numbers of a coordinate, one a pose; a list alone means this. Example: [[10, 20],
    [15, 20], [20, 25]] Example: [0, 5, 20]
    """
    file: str | None = None
    """CSV file beside the study with a pose a line: two columns of a point, one of a coordinate; its name alone means
    this. Example: path.csv
    """
    circle: Circle | None = None
    arc: Arc | None = None
    line: (
        Annotated[tuple[Point, Point], fields.pair_of("a line from [x, y] to [x, y], as a list of the two")] | None
    ) = None
    """Straight line [[x, y], [x, y]], both ends included. Example: [[0, 0], [50, 0]]"""
    points: Annotated[int, fields.whole(2, 10_000_000)] | None = None
    """How many poses, evenly spaced. Left out: |CIRCLE_POSES| on a circle, |LINE_POSES| on an arc or a line, on a
    spline its own points. Example: 36
    """
    spline: bool = False
    """Whether a smooth curve (cubic spline) is laid through the listed points, closed where they are."""

    @property
    def shape(self) -> str | None:
        """Which figure of the plane it is; None for what is listed."""
        return next(iter(self.given("circle", "arc", "line")), None)

    @model_validator(mode="before")
    @classmethod
    def _long_form(cls, raw: Any) -> Any:
        if isinstance(raw, str) and file_of(raw) is not None:
            return {"file": raw}
        return raw if isinstance(raw, dict | PathSection) else {"through": raw}

    @model_validator(mode="after")
    def _fitting(self) -> PathSection:
        if self.spline and self.shape:
            raise failure(f"{self.shape!r} is smooth already: 'spline' is for a list of points")
        if self.points is not None and not self.shape and not self.spline:
            raise failure(
                "a list of points has its own number; 'points' goes with a spline, a circle, an arc or a line"
            )
        return self


@dataclass(frozen=True, eq=False)
class PointPath(ABC):
    """The path of a point: functions of the place along it, in rows from 0; `count` poses stand at its first rows."""

    count: int

    @property
    def closed(self) -> bool:
        """Whether the path goes on from its last pose to its first."""
        return False

    @property
    def corners(self) -> Floats:
        """Places between the ends at which the path is not smooth."""
        return np.empty(0)

    @abstractmethod
    def at(self, s: Floats) -> Complexes:
        """Point of the plane (x + i y) at places of shape (n,)."""

    @abstractmethod
    def course(self, s: Floats) -> tuple[Complexes, Complexes, Floats]:
        """Direction of the path (a unit vector), and its bend: the derivatives of the point by the path's length.

        The bend leads to the centre of curvature and is 1 / radius long. Then the length of the path, a row.
        """

    @abstractmethod
    def way(self, s: Floats) -> Floats:
        """Length of the path from its first pose."""


@dataclass(frozen=True, eq=False)
class Polyline(PointPath):
    """Straight segments; a corner has the direction of the segment that begins there, nan where none has a length."""

    places: Complexes  # of the poses, shape (count,)

    @staticmethod
    def through(places: Complexes) -> Polyline:
        """The segments through some places."""
        return Polyline(len(places), places)

    @cached_property
    def _lengths(self) -> Floats:
        lengths = np.abs(np.diff(self.places))
        # What is shorter than any number of a study is no step: its reciprocal would overflow.
        lengths[lengths < MIN_NUMBER] = 0.0
        return lengths

    @property
    def corners(self) -> Floats:
        return bends(self.places[None])

    def at(self, s: Floats) -> Complexes:
        return between(self.places[None], np.zeros(len(s), dtype=np.intp), s)

    def course(self, s: Floats) -> tuple[Complexes, Complexes, Floats]:
        moving: Ints = np.flatnonzero(self._lengths > 0)
        none = np.zeros(len(s))
        if not len(moving):
            return np.full(len(s), complex(np.nan, np.nan)), np.zeros(len(s), dtype=complex), none
        units: Complexes = np.diff(self.places)[moving] / self._lengths[moving]
        # The segment that begins at each place, or the next one with a length.
        after = np.searchsorted(moving, np.floor(s))
        last = 0 if self.places[0] == self.places[-1] else len(moving) - 1
        pace = self._lengths[np.clip(np.floor(s), 0, self.count - 2).astype(np.intp)]
        return units[np.where(after < len(moving), after, last)], np.zeros(len(s), dtype=complex), pace

    def way(self, s: Floats) -> Floats:
        return np.asarray(np.interp(s, np.arange(self.count), np.concatenate([[0.0], np.cumsum(self._lengths)])))


@dataclass(frozen=True, eq=False)
class Round(PointPath):
    """A circle, or a part of it between two angles (radians)."""

    center: complex
    radius: float
    begin: float
    end: float
    whole: bool  # whether the last pose is one step before the end

    @property
    def closed(self) -> bool:
        return self.whole

    def _turned(self, s: Floats) -> Floats:
        last = self.count - 1 + self.whole
        return np.where(s == last, self.end, self.begin + s * ((self.end - self.begin) / last))

    def at(self, s: Floats) -> Complexes:
        return np.asarray(self.center + self.radius * np.exp(1j * self._turned(s)))

    def course(self, s: Floats) -> tuple[Complexes, Complexes, Floats]:
        outward, turn = np.exp(1j * self._turned(s)), self.end - self.begin
        pace = self.radius * abs(turn) / (self.count - 1 + self.whole)
        return complex(0.0, math.copysign(1.0, turn)) * outward, outward / -self.radius, np.full(len(s), pace)

    def way(self, s: Floats) -> Floats:
        return self.radius * np.abs(self._turned(s) - self.begin)


@dataclass(frozen=True, eq=False)
class Spline(PointPath):
    """A cubic spline by the length of the chords through three places or more, periodic where the first is the last."""

    curve: Any  # SciPy's CubicSpline of complex numbers, for a spline is linear in its values
    rows: Floats  # its parameter at the poses
    fine: Floats  # its parameter at ends of pieces of it,
    length: Floats  # and the length up to there

    @staticmethod
    def through(places: Complexes, points: int | None) -> Spline:
        """The spline through some places, with so many poses evenly spaced, or those that are given."""
        from scipy.interpolate import CubicSpline

        knots = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(places)))])
        curve: Any = CubicSpline(knots, places, bc_type="periodic" if places[0] == places[-1] else "not-a-knot")
        fine = np.unique(np.concatenate([np.linspace(a, b, SPLINE_PIECES + 1) for a, b in pairwise(knots)]))
        lengths = _spline_lengths(curve, fine[:-1], fine[1:])
        length = np.concatenate([[0.0], np.cumsum(lengths)])
        rows = knots if points is None else np.interp(np.linspace(0.0, length[-1], points), length, fine)
        return Spline(len(rows), curve, rows, fine, length)

    @property
    def corners(self) -> Floats:
        # Beyond its second derivative the curve is not smooth at its knots, nor is the pace at which poses pass it.
        knots = np.interp(self.curve.x, self.rows, np.arange(self.count))
        return np.unique(np.concatenate([knots, np.arange(self.count)]))[1:-1]

    def _parameter(self, s: Floats) -> Floats:
        return between(self.rows[None], np.zeros(len(s), dtype=np.intp), s)

    def at(self, s: Floats) -> Complexes:
        return np.asarray(self.curve(self._parameter(s)))

    def course(self, s: Floats) -> tuple[Complexes, Complexes, Floats]:
        x = self._parameter(s)
        first, second = self.curve(x, 1), self.curve(x, 2)
        speed = np.abs(first)
        unit = first / speed
        across = second - (second * np.conj(unit)).real * unit
        pace = np.diff(self.rows)[np.clip(np.floor(s), 0, self.count - 2).astype(np.intp)]
        return unit, across / speed**2, speed * pace

    def way(self, s: Floats) -> Floats:
        x = self._parameter(s)
        piece = np.clip(np.searchsorted(self.fine, x, side="right") - 1, 0, len(self.fine) - 2)
        return self.length[piece] + _spline_lengths(self.curve, self.fine[piece], x)


def _spline_lengths(curve: Any, begin: Floats, end: Floats) -> Floats:
    """Lengths of short pieces of a spline."""
    nodes, weights = np.polynomial.legendre.leggauss(4)
    middle, half = (begin + end) / 2, (end - begin) / 2
    return np.asarray(half * (np.abs(curve(middle[:, None] + half[:, None] * nodes, 1)) @ weights))


def between(rows: NDArray[Any], line: Ints, s: Floats) -> NDArray[Any]:
    """Values at places of some lines of rows, shape (lines, rows), that change evenly from row to row."""
    k = np.clip(np.floor(s), 0, max(rows.shape[1] - 2, 0)).astype(np.intp)
    begin = rows[line, k]
    return np.asarray(begin + (s - k) * (rows[line, np.minimum(k + 1, rows.shape[1] - 1)] - begin))


def bends(rows: NDArray[Any]) -> Floats:
    """Places between the ends at which some of the lines of rows, shape (lines, rows), do not go on evenly."""
    steps = np.abs(np.diff(rows, axis=1))
    rounding = EVEN * np.maximum(steps[:, 1:], steps[:, :-1]) + 4 * np.finfo(float).eps * np.abs(rows[:, 1:-1])
    return np.asarray(np.flatnonzero((np.abs(np.diff(rows, 2, axis=1)) > rounding).any(axis=0)) + 1.0)


def course(name: str, given: PathSection, folder: Folder) -> PointPath | Floats:
    """The path of a point, or the values of a coordinate.

    Raises
    ------
    StudyError
        Where a file cannot be read, or what is listed is no such path.
    """
    for form, count, whole in ((given.circle, CIRCLE_POSES, True), (given.arc, LINE_POSES, False)):
        if form is not None:
            return Round(given.points or count, complex(*form.center), form.radius, form.from_, form.to, whole)
    if given.line is not None:
        start, stop = (complex(*place) for place in given.line)
        if start == stop:
            raise StudyError(f"path: the line of {name!r} needs two different places")
        return Polyline.through(np.linspace(start, stop, given.points or LINE_POSES, dtype=np.complex128))
    point = "." not in name
    table = read_table(folder, given.file) if given.file is not None else np.array(given.through, dtype=float)
    if point and table.shape[1] == 2:
        places = table[:, 0] + 1j * table[:, 1]
        if not given.spline:
            return Polyline.through(places)
        if len(places) < 3 or not np.diff(places).all():
            raise StudyError(f"path: the spline of {name!r} needs three points or more, no two in succession the same")
        return Spline.through(places, given.points)
    if table.shape[1] == 1:
        return np.asarray(table[:, 0])
    raise StudyError(f"path: {name!r} needs a list of " + ("[x, y]" if point else "numbers"))


def read_table(folder: Folder, file: str, most: int = 2) -> Floats:
    """Read a CSV file of one to `most` columns of numbers, with or without a line of names.

    Raises
    ------
    StudyError
        Where it cannot be read or holds anything else.
    """
    rows: list[list[float]] = []
    for number, line in _lines(folder, file):
        try:
            row = [float(part) for part in line.replace(";", ",").split(",")]
        except ValueError:
            if rows or number > 1:
                raise StudyError(f"{file}:{number}: the line is not a row of numbers") from None
            continue
        if len(row) > most or (rows and len(row) != len(rows[0])) or not all(map(math.isfinite, row)):
            columns = "one or two" if most == 2 else f"one to {most}"
            raise StudyError(f"{file}:{number}: the line is not a row of the same {columns} finite numbers")
        rows.append(row)
    if not rows:
        raise StudyError(f"{file} holds no numbers")
    return np.array(rows)


def read_column(folder: Folder, file: str, name: str | None) -> Floats:
    """Read the numbers of a CSV file's column of this name, or of a file with one number a line.

    Raises
    ------
    StudyError
        Where the file cannot be read, there is no such column, or it holds anything but finite numbers.
    """
    rows = read_cells(folder, file)
    first, place = rows[0][1], 0
    if name is not None and name not in first:
        raise StudyError(f"{file} has no column {name!r} among the {len(first)} of its first line")
    if name is not None:
        place = first.index(name)
    elif len(first) > 1:
        raise StudyError(f"{file} has {len(first)} columns: say by 'column' which one, by its name in the first line")
    found = []
    for number, row in rows:
        value = _number(row[place]) if place < len(row) <= len(first) else None
        if value is not None and math.isfinite(value):
            found.append(value)
        elif row is not first or (name is None and value is not None):
            what = f" of column {name!r}" if name is not None else ""
            hint = "; a decimal is written with a point" if any("," in cell for cell in row) else ""
            raise StudyError(f"{file}:{number}: the line has no finite number{what}{hint}")
    return np.array(found)


def read_cells(folder: Folder, file: str) -> list[tuple[int, list[str]]]:
    """Read the cells of a CSV file, line by line with its number; commas, semicolons or tabs stand between them.

    Raises
    ------
    StudyError
        Where it cannot be read, or is empty.
    """
    lines = _lines(folder, file)
    if not lines:
        raise StudyError(f"{file} holds no numbers")
    separator = next((mark for mark in (";", "\t") if mark in lines[0][1]), ",")
    try:
        return [
            (number, [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]) for number, line in lines
        ]
    except csv.Error as error:
        raise StudyError(f"{file} is no CSV file: {error}") from None


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _lines(folder: Folder, file: str) -> list[tuple[int, str]]:
    """Lines of a text with their numbers, without empty ones and comments; a StudyError where it cannot be read."""
    lines = [line.strip() for line in folder.text(file).splitlines()]
    return [(number, line) for number, line in enumerate(lines, start=1) if line and not line.startswith("#")]
