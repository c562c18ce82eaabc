"""Paths of coordinates and points as arrays, of one design or of many.

That of a point has, at every place, the length of the way to it and the direction and bend of the path there.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.numerics.arrays import Complexes, Floats, Ints
from mechdesign.study.text.reading import MIN_NUMBER

# Pieces of a spline between two of its points whose lengths are added up.
SPLINE_PIECES = 64
# Steps of a path that differ by less than this part of them go on evenly.
EVEN = 1e-9


@dataclass(frozen=True, eq=False)
class PointPath(ABC):
    """The path of a point, of one design or of many: functions of the place along it, in rows from 0.

    `count` poses stand at its first rows. Designs are numbered by `line`; where the path is the same for all of them
    there is one.
    """

    count: int

    @property
    def closed(self) -> bool:
        """Whether the path goes on from its last pose to its first."""
        return False

    @property
    def corners(self) -> Floats:
        """Places between the ends at which the path of some design is not smooth."""
        return np.empty(0)

    @abstractmethod
    def at(self, line: Ints, s: Floats) -> Complexes:
        """Point of the plane (x + i y) at places of some designs, both of shape (n,)."""

    @abstractmethod
    def course(self, line: Ints, s: Floats) -> tuple[Complexes, Complexes, Floats]:
        """Direction of the path (a unit vector), and its bend: the derivatives of the point by the path's length.

        The bend leads to the centre of curvature and is 1 / radius long. Then the length of the path, a row.
        """

    @abstractmethod
    def way(self, line: Ints, s: Floats) -> Floats:
        """Length of the path from its first pose."""

    def take(self, designs: Ints) -> PointPath:
        """The path of some designs; where it is the same for all of them it is that."""
        return self

    def lengths(self, designs: int) -> Floats:
        """Length of the path between the poses and up to where it closes, shape (designs, rows)."""
        rows = np.arange(self.count + self.closed, dtype=float)
        line, s = (grid.ravel() for grid in np.meshgrid(np.arange(designs), rows, indexing="ij"))
        return np.diff(self.way(line, s).reshape(designs, -1), axis=1)


def _of(values: NDArray[Any], line: Ints) -> NDArray[Any]:
    """The values of some designs; of one, those of all."""
    return values[line] if len(values) > 1 else np.broadcast_to(values[0], (len(line), *values.shape[1:]))


@dataclass(frozen=True, eq=False)
class Polyline(PointPath):
    """Straight segments; a corner has the direction of the segment that begins there, nan where none has a length."""

    places: Complexes  # of the poses, shape (designs, count)

    @staticmethod
    def through(places: Complexes) -> Polyline:
        """The segments through the places of each design, shape (designs, count)."""
        return Polyline(places.shape[1], places)

    @cached_property
    def _lengths(self) -> Floats:
        lengths = np.abs(np.diff(self.places, axis=1))
        # What is shorter than any number of a study is no step: its reciprocal would overflow.
        lengths[lengths < MIN_NUMBER] = 0.0
        return lengths

    @cached_property
    def _units(self) -> Complexes:
        """Direction of the segment that begins at each pose, or of the next one with a length, shape (designs, count).

        At the end it is that of the last one, of a closed line that of the first.
        """
        units = np.where(self._lengths > 0, np.diff(self.places, axis=1) / self._lengths, np.nan)
        moving = self._lengths > 0
        closes = self.places[:, 0] == self.places[:, -1]
        rows, last = np.arange(len(units)), moving.shape[1] - 1
        first, final = moving.argmax(axis=1), last - moving[:, ::-1].argmax(axis=1)
        after = np.minimum.accumulate(np.where(moving, np.arange(last + 1), last + 1)[:, ::-1], axis=1)[:, ::-1]
        after = np.concatenate([after, np.full((len(units), 1), last + 1)], axis=1)
        return units[rows[:, None], np.where(after > last, np.where(closes, first, final)[:, None], after)]

    def take(self, designs: Ints) -> PointPath:
        return Polyline(self.count, self.places[designs]) if len(self.places) > 1 else self

    @property
    def corners(self) -> Floats:
        return bends(self.places)

    def at(self, line: Ints, s: Floats) -> Complexes:
        return between(self.places, line if len(self.places) > 1 else np.zeros_like(line), s)

    def course(self, line: Ints, s: Floats) -> tuple[Complexes, Complexes, Floats]:
        row = np.clip(np.floor(s), 0, self.count - 1).astype(np.intp)
        lane = np.arange(len(s))
        units, lengths = _of(self._units, line)[lane, row], _of(self._lengths, line)
        return units, np.zeros(len(s), dtype=complex), lengths[lane, np.minimum(row, self.count - 2)]

    def way(self, line: Ints, s: Floats) -> Floats:
        ways = np.concatenate([np.zeros((len(self._lengths), 1)), np.cumsum(self._lengths, axis=1)], axis=1)
        return between(ways, line if len(ways) > 1 else np.zeros_like(line), np.clip(s, 0, self.count - 1))


@dataclass(frozen=True, eq=False)
class Round(PointPath):
    """A circle, or a part of it between two angles (radians); each of shape (designs,)."""

    center: Complexes
    radius: Floats
    begin: Floats
    end: Floats
    whole: bool  # whether the last pose is one step before the end

    @property
    def closed(self) -> bool:
        return self.whole

    def take(self, designs: Ints) -> PointPath:
        center, parts = _of(self.center, designs), (self.radius, self.begin, self.end)
        radius, begin, end = (_of(part, designs) for part in parts)
        return Round(self.count, center, radius, begin, end, self.whole)

    def _turned(self, line: Ints, s: Floats) -> Floats:
        last, begin, end = self.count - 1 + self.whole, _of(self.begin, line), _of(self.end, line)
        return np.where(s == last, end, begin + s * ((end - begin) / last))

    def at(self, line: Ints, s: Floats) -> Complexes:
        return np.asarray(_of(self.center, line) + _of(self.radius, line) * np.exp(1j * self._turned(line, s)))

    def course(self, line: Ints, s: Floats) -> tuple[Complexes, Complexes, Floats]:
        outward, turn = np.exp(1j * self._turned(line, s)), _of(self.end - self.begin, line)
        radius = _of(self.radius, line)
        pace = radius * np.abs(turn) / (self.count - 1 + self.whole)
        return 1j * np.copysign(1.0, turn) * outward, outward / -radius, pace

    def way(self, line: Ints, s: Floats) -> Floats:
        return np.asarray(_of(self.radius, line) * np.abs(self._turned(line, s) - _of(self.begin, line)))


@dataclass(frozen=True, eq=False)
class Spline(PointPath):
    """A cubic spline by the length of the chords through three places or more, periodic where the first is the last."""

    curve: Any  # SciPy's CubicSpline of complex numbers, for a spline is linear in its values
    rows: Floats  # its parameter, the length of the chords in a unit of its own, at the poses
    fine: Floats  # its parameter at ends of pieces of it,
    length: Floats  # and the length up to there

    @staticmethod
    def through(places: Complexes, points: int | None) -> Spline:
        """The spline through some places, with so many poses evenly spaced, or those that are given."""
        from scipy.interpolate import CubicSpline

        knots = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(places)))])
        # Its equations are scaled: by a power of two, so that no digit changes.
        knots = np.ldexp(knots, -np.frexp(knots[-1])[1])
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

    def at(self, line: Ints, s: Floats) -> Complexes:
        return np.asarray(self.curve(self._parameter(s)))

    def course(self, line: Ints, s: Floats) -> tuple[Complexes, Complexes, Floats]:
        x = self._parameter(s)
        first, second = self.curve(x, 1), self.curve(x, 2)
        speed = np.abs(first)
        unit = first / speed
        across = second - (second * np.conj(unit)).real * unit
        pace = np.diff(self.rows)[np.clip(np.floor(s), 0, self.count - 2).astype(np.intp)]
        return unit, across / speed**2, speed * pace

    def way(self, line: Ints, s: Floats) -> Floats:
        x = self._parameter(s)
        piece = np.clip(np.searchsorted(self.fine, x, side="right") - 1, 0, len(self.fine) - 2)
        return self.length[piece] + _spline_lengths(self.curve, self.fine[piece], x)


@dataclass(frozen=True, eq=False)
class EvenValues:
    """Evenly spaced values of a coordinate, both ends included; numbers of each design, shape (designs,)."""

    begin: Floats
    step: Floats
    end: Floats
    count: int

    def __getitem__(self, at: tuple[Ints, Ints]) -> Floats:
        """Values of some designs, by their numbers."""
        design, k = at
        return np.where(k == self.count - 1, self.end[design], self.begin[design] + k * self.step[design])

    @property
    def shape(self) -> tuple[int, int]:
        """Designs, and values of each."""
        return len(self.begin), self.count

    @classmethod
    def from_to(cls, begin: Floats, end: Floats, count: int) -> EvenValues:
        """So many values from one end to the other."""
        return cls(begin, (end - begin) / max(count - 1, 1), end if count > 1 else begin, count)


def _spline_lengths(curve: Any, begin: Floats, end: Floats) -> Floats:
    """Lengths of short pieces of a spline."""
    nodes, weights = np.polynomial.legendre.leggauss(4)
    middle, half = (begin + end) / 2, (end - begin) / 2
    return np.asarray(half * (np.abs(curve(middle[:, None] + half[:, None] * nodes, 1)) @ weights))


def between(rows: NDArray[Any] | EvenValues, line: Ints, s: Ints | Floats) -> NDArray[Any]:
    """Values at rows of some lines, shape (lines, rows), or at places between them, where they change evenly."""
    if s.dtype.kind == "i":
        return np.asarray(rows[line, s.astype(np.intp, copy=False)])
    k = np.clip(np.floor(s), 0, max(rows.shape[1] - 2, 0)).astype(np.intp)
    begin = rows[line, k]
    return np.asarray(begin + (s - k) * (rows[line, np.minimum(k + 1, rows.shape[1] - 1)] - begin))


def bends(rows: NDArray[Any]) -> Floats:
    """Places between the ends at which some of the lines of rows, shape (lines, rows), do not go on evenly."""
    steps = np.abs(np.diff(rows, axis=1))
    rounding = EVEN * np.maximum(steps[:, 1:], steps[:, :-1]) + 4 * np.finfo(float).eps * np.abs(rows[:, 1:-1])
    return np.asarray(np.flatnonzero((np.abs(np.diff(rows, 2, axis=1)) > rounding).any(axis=0)) + 1.0)
