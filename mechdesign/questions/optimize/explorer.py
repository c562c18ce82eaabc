"""Evaluated points of the unit cube, which all stages of a search share."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.ground.numerics.arrays import Flags, Floats, Ints

# Least merits, all larger than any goal, of points that miss a condition, of points without a value, and of those of
# which nothing is known; far enough from each other for an order within each class.
CONDITION_MISSED = 1e60
NO_VALUE = 1e90
UNKNOWN = 1e120
# Column of the margins of assembly, negative where a pose does not assemble: they belong to no goal or condition.
ASSEMBLY = -1
FIRST_ROWS = 256


class Spent(Exception):
    """The allowed evaluations are used up."""


@dataclass(frozen=True)
class Part:
    """The columns `place` of `Points.rows` whose worst value, or root mean square, is a goal or a condition.

    Parameters
    ----------
    column : int
        Number of the goal, or of the condition after all goals; or `ASSEMBLY`.
    sign : float
        1 where the largest row is the worst, -1 where the smallest is.
    absolute : bool
        Whether absolute values are judged.
    squares : bool
        Whether the goal is the root mean square of the rows.
    """

    column: int
    sign: float
    absolute: bool
    place: slice
    bound: float = 0.0
    squares: bool = False

    def pieces(self, rows: Floats) -> Floats:
        """Smooth functions whose largest value is ``sign * (goal - bound)``, the violation of a condition."""
        pieces = self.sign * rows[:, self.place]
        if self.absolute and self.sign > 0:
            pieces = np.concatenate([pieces, -pieces], axis=1)
        elif self.absolute:
            # These values are made large, and so stay away from the kink at zero.
            pieces = -np.abs(pieces)
        return np.asarray(pieces - self.sign * self.bound)


@dataclass(frozen=True)
class Points:
    """Evaluated points.

    Parameters
    ----------
    u : ndarray, shape (points, dimensions)
        Points of the unit cube.
    values : ndarray, shape (points, goals)
        Values of the goals; nan where a point has none.
    margins : ndarray, shape (points, conditions)
        Margin of each condition, negative where it is not met.
    rows : ndarray, shape (points, rows)
        The rows whose worst are goals and conditions, as far as they are known; see `Part`.
    shortfall : ndarray, shape (points,)
        How far a point without a value is from assembling; nan where that is not known.
    """

    u: Floats
    values: Floats
    margins: Floats
    rows: Floats
    shortfall: Floats

    def take(self, rows: Ints) -> Points:
        """Some of the points."""
        return Points(*(column[rows] for column in vars(self).values()))

    @property
    def valid(self) -> Flags:
        """Points that have values."""
        return np.asarray(~np.isnan(self.values).any(axis=1) & ~np.isnan(self.margins).any(axis=1))

    @property
    def feasible(self) -> Flags:
        """Points that have values and meet every condition."""
        return np.asarray(self.valid & (self.margins >= 0).all(axis=1))

    def merit(self, objective: Floats) -> Floats:
        """What a search minimises, shape (points,): of feasible points the sum of the goals times `objective`.

        Points that miss a condition come after all feasible ones, ordered by their violation, then points without a
        value, ordered by their shortfall [Deb, An efficient constraint handling method for genetic algorithms, 2000];
        infinite where that is not known.
        """
        valid, feasible = self.valid, self.feasible
        merit = np.where(np.isnan(self.shortfall), np.inf, NO_VALUE * (1.0 + self.shortfall))
        merit[feasible] = self.values[feasible] @ objective
        missing = valid & ~feasible
        if missing.any():
            scale = np.abs(self.margins[valid]).max(axis=0)
            short = np.maximum(-self.margins[missing] / np.where(scale > 0, scale, 1.0), 0.0).sum(axis=1)
            merit[missing] = CONDITION_MISSED * (1.0 + short)
        return merit


class Explorer:
    """Evaluates points of the unit cube, at most `budget` of them and each once.

    Parameters
    ----------
    evaluate
        Evaluates points, shape (m, dimensions).
    snap
        Moves points, shape (m, dimensions), so that points of the same design are equal.
    rough : bool
        Whether values are known to a tolerance only, so that differences over small steps are noise.

    Attributes
    ----------
    left, reserve : int
        Evaluations that are left, and how many of these are kept for later.
    visited : ndarray of int
        Rows of `points` that were requested since the last `forget`.
    """

    def __init__(
        self, evaluate: Callable[[Floats], Points], dimensions: int, budget: int, parts: Sequence[Part] = (),
        *, snap: Callable[[Floats], Floats] = np.asarray, rough: bool = False,
    ) -> None:  # fmt: skip
        self._evaluate, self._snap, self.dimensions, self.parts = evaluate, snap, dimensions, tuple(parts)
        self.left, self.reserve = budget, 0
        self.rough = rough
        self._rows: dict[bytes, int] = {}
        self._visits: list[Ints] = []
        # Columns of points, values, margins, rows and shortfall, with room for further points.
        self._table, self._ends = np.empty((0, dimensions + 1)), [dimensions] * 4

    @property
    def points(self) -> Points:
        """Everything evaluated so far."""
        u, values, margins, rows, shortfall = np.split(self._table[: len(self._rows)], self._ends, axis=1)
        return Points(u, values, margins, rows, shortfall[:, 0])

    @property
    def evaluated(self) -> int:
        """How many points are known."""
        return len(self._rows)

    @property
    def visited(self) -> Ints:
        """Rows of `points` that were requested since the last `forget`, each once."""
        return np.unique(np.concatenate([np.empty(0, dtype=np.intp), *self._visits]))

    def forget(self) -> None:
        """Start a new list of visited points."""
        self._visits.clear()

    def __call__(self, u: Floats) -> Ints:
        """Rows of `points` that hold these points, shape (m, dimensions).

        Raises
        ------
        Spent
            If there are more new points than may be evaluated; nothing is evaluated then.
        """
        u = self._snap(np.clip(u, 0.0, 1.0) + 0.0)
        keys = [point.tobytes() for point in u]
        new = {key: k for k, key in reversed(list(enumerate(keys))) if key not in self._rows}
        if new:
            order, begun = sorted(new.values()), len(self._rows)
            if len(order) > self.left - self.reserve:
                raise Spent
            self.left -= len(order)
            points = self._evaluate(u[order])
            parts = (points.u, points.values, points.margins, points.rows, points.shortfall[:, None])
            end = begun + len(order)
            if end > len(self._table):
                *self._ends, width = np.cumsum([part.shape[1] for part in parts]).tolist()
                grown = np.empty((max(FIRST_ROWS, 2 * end), width))
                grown[:begun] = self._table[:begun] if begun else 0.0
                self._table = grown
            self._table[begun:end] = np.concatenate(parts, axis=1)
            self._rows |= {keys[k]: begun + row for row, k in enumerate(order)}
        rows = np.array([self._rows[key] for key in keys], dtype=np.intp)
        self._visits.append(rows)
        return rows
