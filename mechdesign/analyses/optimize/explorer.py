"""Points of the unit cube and what is known of them: the memory that all stages of a search share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.workspace.rays import Floats

# From the values of the goals, shape (points, goals), to what is made small, shape (points,).
Objective = Callable[[Floats], Floats]


class Spent(Exception):
    """The evaluations that were allowed are used up."""


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
    """

    u: Floats
    values: Floats
    margins: Floats

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
        From points, shape (m, dimensions), to values and margins as in `Known`.
    budget : int
        How many points may be evaluated.
    """

    def __init__(self, evaluate: Callable[[Floats], tuple[Floats, Floats]], dimensions: int, budget: int) -> None:
        self._evaluate = evaluate
        self.dimensions = dimensions
        self.left = budget
        self._rows: dict[bytes, int] = {}
        self.known = Known(np.empty((0, dimensions)), np.empty((0, 0)), np.empty((0, 0)))

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
            values, margins = self._evaluate(u[order])
            begun = len(self.known.u)
            before = self.known if begun else Known(self.known.u, values[:0], margins[:0])
            self.known = Known(
                np.concatenate([before.u, u[order]]),
                np.concatenate([before.values, values]),
                np.concatenate([before.margins, margins]),
            )
            self._rows |= {keys[k]: begun + row for row, k in enumerate(order)}
        return np.array([self._rows[key] for key in keys], dtype=np.intp)
