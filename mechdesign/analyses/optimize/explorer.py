"""Points of the unit cube and what is known of them: the memory that all stages of a search share."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.workspace.rays import Floats


class Spent(Exception):
    """The evaluations that were allowed are used up."""


@dataclass(frozen=True, eq=False)
class Objective:
    """What is made small: a weighted sum of the goals.

    Parameters
    ----------
    factors : ndarray, shape (goals,)
        Negative where a goal is made large.
    """

    factors: Floats

    def __call__(self, values: Floats) -> Floats:
        """From the values of the goals, shape (points, goals), to shape (points,)."""
        return np.asarray(values @ self.factors)


@dataclass(frozen=True)
class Part:
    """Rows that a goal or a condition is the worst of.

    Parameters
    ----------
    column : int
        Of the goals, and after them of the conditions.
    sign : float
        1 where the largest row is the worst, -1 where the smallest is.
    absolute : bool
        Whether absolute values are judged.
    place : slice
        Columns of `Known.rows`.
    bound : float
        Of a condition.
    """

    column: int
    sign: float
    absolute: bool
    place: slice
    bound: float = 0.0

    def pieces(self, rows: Floats) -> Floats:
        """What ``sign * (goal - bound)`` is the largest of, and by how much a condition is not met; smooth."""
        found = self.sign * rows[:, self.place]
        if self.absolute and self.sign > 0:
            found = np.concatenate([found, -found], axis=1)
        elif self.absolute:
            # Smooth but at zero, where nothing is that should be far from it.
            found = -np.abs(found)
        return np.asarray(found - self.sign * self.bound)


class Outcome(NamedTuple):
    """What an evaluation of points gives; see `Known`."""

    values: Floats
    margins: Floats
    rows: Floats


@dataclass(frozen=True)
class Known:
    """Everything evaluated so far.

    Parameters
    ----------
    u : ndarray, shape (points, dimensions)
        Points of the unit cube.
    values : ndarray, shape (points, goals)
        Values of the goals; nan where there is none.
    margins : ndarray, shape (points, conditions)
        By how much each condition is met, negative where it is not.
    rows : ndarray, shape (points, rows)
        What goals and conditions are the worst of, as far as that is known; see `Part`.
    """

    u: Floats
    values: Floats
    margins: Floats
    rows: Floats

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Points that have values."""
        return np.asarray(~np.isnan(self.values).any(axis=1) & ~np.isnan(self.margins).any(axis=1))

    @property
    def feasible(self) -> NDArray[np.bool_]:
        """Points that have values and meet every condition."""
        return np.asarray(self.valid & (self.margins >= 0).all(axis=1))

    def merit(self, objective: Objective) -> Floats:
        """What is made small, shape (points,): feasible points before the others, those by how much they miss.

        [Deb, An efficient constraint handling method for genetic algorithms, 2000.]
        """
        valid, feasible = self.valid, self.feasible
        merit = np.full(len(self.u), np.inf)
        merit[feasible] = objective(self.values[feasible])
        missing = valid & ~feasible
        if missing.any():
            scale = np.abs(self.margins[valid]).max(axis=0)
            short = np.maximum(-self.margins[missing] / np.where(scale > 0, scale, 1.0), 0.0).sum(axis=1)
            worst = merit[feasible].max() if feasible.any() else 0.0
            merit[missing] = worst + (1.0 + short) * max(1.0, abs(worst))
        return merit


class Explorer:
    """Evaluates points of the unit cube, each once.

    Parameters
    ----------
    evaluate
        From points, shape (m, dimensions), to what is known of them.
    budget : int
        How many points may be evaluated.
    parts : sequence of Part
        Which rows there are.
    """

    def __init__(
        self, evaluate: Callable[[Floats], Outcome], dimensions: int, budget: int, parts: Sequence[Part] = ()
    ) -> None:
        self._evaluate = evaluate
        self.dimensions = dimensions
        self.left = budget
        self.parts = tuple(parts)
        self._rows: dict[bytes, int] = {}
        self.known = Known(np.empty((0, dimensions)), *[np.empty((0, 0))] * 3)

    def edged(self, objective: Objective) -> bool:
        """Whether rows are known of a worst row that is made better."""
        factors = objective.factors
        return any(part.column < len(factors) and factors[part.column] * part.sign > 0 for part in self.parts)

    def __call__(self, u: Floats) -> NDArray[np.intp]:
        """Rows of `known` that hold these points, shape (m, dimensions).

        Raises
        ------
        Spent
            If there are more new points than may be evaluated; nothing is evaluated then.
        """
        u = np.clip(u, 0.0, 1.0) + 0.0
        keys = [point.tobytes() for point in u]
        new = {key: k for k, key in reversed(list(enumerate(keys))) if key not in self._rows}
        if new:
            order = sorted(new.values())
            if len(order) > self.left:
                raise Spent
            self.left -= len(order)
            found, begun = (u[order], *self._evaluate(u[order])), len(self.known.u)
            before = (self.known.u, self.known.values, self.known.margins, self.known.rows)
            self.known = Known(*(
                np.concatenate([old, new]) if begun else new for old, new in zip(before, found, strict=True)
            ))  # fmt: skip
            self._rows |= {keys[k]: begun + row for row, k in enumerate(order)}
        return np.array([self._rows[key] for key in keys], dtype=np.intp)
