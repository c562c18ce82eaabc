"""Convex quadratic programs, many at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mechdesign.numerics.arrays import Floats

MOST_STEPS = 30
# Part of the way to the nearest bound that a step takes.
INSIDE = 0.995
# Slack times multiplier, and what the equations miss, where a program is solved.
COMPLEMENTARITY, RESIDUAL = 1e-9, 1e-9
REGULAR = 1e-13


@np.errstate(all="ignore")
def solve(bent: Floats, slope: Floats, rows: Floats, bounds: Floats, begin: Floats) -> tuple[Floats, Floats]:
    """Points where ``z bent z / 2 + slope z`` is least under ``rows z <= bounds``, and the multipliers of the rows.

    Mehrotra's predictor and corrector [Nocedal & Wright, Numerical Optimization, 2006, alg. 16.4]. Numbers that matter
    are to be about 1.

    Parameters
    ----------
    bent : ndarray, shape (lanes, n, n)
        Positive semidefinite.
    slope, begin : ndarray, shape (lanes, n)
    rows : ndarray, shape (lanes, m, n)
    bounds : ndarray, shape (lanes, m)

    Returns
    -------
    ndarray, shape (lanes, n)
    ndarray, shape (lanes, m)
        Where a program has no end, or no point keeps its rows, the last point that was come to.
    """
    z = begin.copy()
    slack = np.maximum(bounds - _times(rows, z), 1.0)
    multipliers = np.asarray(1 / slack)
    for _ in range(MOST_STEPS):
        dual = _times(bent, z) + slope + _times(np.swapaxes(rows, 1, 2), multipliers)
        primal = _times(rows, z) + slack - bounds
        gap = slack * multipliers
        missed = np.maximum(np.abs(dual).max(axis=1), np.abs(primal).max(axis=1))
        open_ = (gap.max(axis=1) > COMPLEMENTARITY) | (missed > RESIDUAL)
        if not open_.any():
            break
        newton = _Newton(bent, rows, dual, primal, slack, multipliers)
        try:
            _, change, rise = newton.step(gap)
            mean = gap.mean(axis=1)
            after = (slack + _most(slack, change) * change) * (multipliers + _most(multipliers, rise) * rise)
            centre = (np.maximum(after.mean(axis=1), 0.0) / mean) ** 3 * mean
            ways = newton.step(gap + change * rise - centre[:, None])
        except np.linalg.LinAlgError:
            break
        open_ &= np.all([np.isfinite(way).all(axis=1) for way in ways], axis=0)
        way, change, rise = (np.where(open_[:, None], way, 0.0) for way in ways)
        length = INSIDE * np.minimum(_most(slack, change), _most(multipliers, rise))
        z, slack, multipliers = z + length * way, slack + length * change, multipliers + length * rise
    return z, multipliers


@dataclass(frozen=True)
class _Newton:
    """Newton's method on the conditions of an optimum; what they miss is of `solve`'s shapes."""

    bent: Floats
    rows: Floats
    dual: Floats
    primal: Floats
    slack: Floats
    multipliers: Floats

    @cached_property
    def _across(self) -> Floats:
        return np.swapaxes(self.rows, 1, 2)

    @cached_property
    def _matrix(self) -> Floats:
        weights = (self.multipliers / self.slack)[:, :, None]
        return np.asarray(self.bent + self._across @ (weights * self.rows) + REGULAR * np.eye(self.rows.shape[2]))

    def step(self, wanted: Floats) -> tuple[Floats, Floats, Floats]:
        """Changes of the point, the slacks and the multipliers by which their products fall by what is wanted."""
        right = -self.dual - _times(self._across, (self.multipliers * self.primal - wanted) / self.slack)
        way = np.asarray(np.linalg.solve(self._matrix, right[:, :, None])[:, :, 0])
        change = -self.primal - _times(self.rows, way)
        return way, change, (-wanted - self.multipliers * change) / self.slack


def _times(matrices: Floats, vectors: Floats) -> Floats:
    return np.asarray((matrices @ vectors[:, :, None])[:, :, 0])


def _most(values: Floats, changes: Floats) -> Floats:
    """The longest part of the way, at most all of it, that leaves values positive; shape (lanes, 1)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        parts = np.where(changes < 0, -values / changes, np.inf)
    return np.asarray(np.minimum(parts.min(axis=1, keepdims=True), 1.0))
