"""Convex quadratic programs, many at once."""

from __future__ import annotations

from functools import partial

import numpy as np

from mechdesign.ground.numerics.arrays import Floats

# Largest number of steps.
MOST_STEPS = 30
# Length of a step, as a fraction of the distance to the nearest bound.
INSIDE = 0.995
# Largest product of a slack and its multiplier where a program counts as solved.
COMPLEMENTARITY = 1e-9
# Largest residual of the equations there.
RESIDUAL = 1e-9
# Added to the diagonal of Newton's matrix, so that it is regular.
REGULAR = 1e-13


def solve(bent: Floats, slope: Floats, rows: Floats, bounds: Floats, begin: Floats) -> tuple[Floats, Floats]:
    """Points where ``z bent z / 2 + slope z`` is least under ``rows z <= bounds``, and the multipliers of the rows.

    Mehrotra's predictor and corrector [Nocedal & Wright, Numerical Optimization, 2006, alg. 16.4]. Variables and rows
    should be scaled to about 1.

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
        Points and multipliers. Those of a program that is unbounded, or whose rows no point satisfies, are the last
        that were reached.
    """
    z = begin.copy()
    slack = np.maximum(bounds - _times(rows, z), 1.0)
    multipliers = np.asarray(1 / slack)
    for _ in range(MOST_STEPS):
        dual = _times(bent, z) + slope + _times(np.swapaxes(rows, 1, 2), multipliers)
        primal = _times(rows, z) + slack - bounds
        gap = slack * multipliers
        residual = np.maximum(np.abs(dual).max(axis=1), np.abs(primal).max(axis=1))
        open_ = (gap.max(axis=1) > COMPLEMENTARITY) | (residual > RESIDUAL)
        if not open_.any():
            break
        weighted = (multipliers / slack)[:, :, None] * rows
        matrix = bent + np.swapaxes(rows, 1, 2) @ weighted + REGULAR * np.eye(rows.shape[2])
        newton = partial(_step, matrix, rows, dual, primal, slack, multipliers)
        try:
            _, change, rise = newton(gap)
            mean = gap.mean(axis=1)
            predicted = (slack + _longest(slack, change) * change) * (multipliers + _longest(multipliers, rise) * rise)
            centre = (np.maximum(predicted.mean(axis=1), 0.0) / mean) ** 3 * mean
            steps = newton(gap + change * rise - centre[:, None])
        except np.linalg.LinAlgError:
            break
        open_ &= np.all([np.isfinite(move).all(axis=1) for move in steps], axis=0)
        move, change, rise = (np.where(open_[:, None], move, 0.0) for move in steps)
        length = INSIDE * np.minimum(_longest(slack, change), _longest(multipliers, rise))
        z, slack, multipliers = z + length * move, slack + length * change, multipliers + length * rise
    return z, multipliers


def _step(
    matrix: Floats, rows: Floats, dual: Floats, primal: Floats, slack: Floats, multipliers: Floats, reduction: Floats
) -> tuple[Floats, Floats, Floats]:
    """Newton's changes of the point, slacks and multipliers that lower the slacks times multipliers by `reduction`."""
    right = -dual - _times(np.swapaxes(rows, 1, 2), (multipliers * primal - reduction) / slack)
    move = np.asarray(np.linalg.solve(matrix, right[:, :, None])[:, :, 0])
    change = -primal - _times(rows, move)
    return move, change, (-reduction - multipliers * change) / slack


def _times(matrices: Floats, vectors: Floats) -> Floats:
    return np.asarray((matrices @ vectors[:, :, None])[:, :, 0])


def _longest(values: Floats, changes: Floats) -> Floats:
    """The largest fraction, at most 1, of `changes` that leaves values positive; shape (lanes, 1)."""
    parts = np.where(changes < 0, -values / changes, np.inf)
    return np.asarray(np.minimum(parts.min(axis=1, keepdims=True), 1.0))
