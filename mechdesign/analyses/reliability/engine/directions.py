"""Directions that bring limits nearest to the mean.

A direction is no normal variable: it costs no distance. Each is turned to where its limit is nearest, which of a margin
that is linear in its cosine and sine is against the slope, and the nearest point is sought again.
"""

from __future__ import annotations

import numpy as np

from mechdesign.analyses.reliability.engine.descent import descend
from mechdesign.analyses.reliability.engine.problem import Problem
from mechdesign.numerics.arrays import Floats, Ints

# How often directions are turned to the worst, and what is no turn (distance on the circle).
TURNS, STILL = 6, 0.02


def worst(problem: Problem, limit: Ints, u: Floats, scale: Floats) -> tuple[Floats, Ints, Floats, Floats]:
    """Descend with directions held, and turn these to the worst, one after the other until they stay.

    Parameters
    ----------
    limit : ndarray of int, shape (starts,)
    u : ndarray, shape (dimension, starts)
    scale : ndarray, shape (limits,)
        Those of `descent.sizes`.

    Returns
    -------
    u, limit, normal, pull
        Of the points that were found, as in `DesignPoints`, but `u` and `normal` of shape (dimension, points). Where
        directions alone break a limit, the point is at the mean of all else.
    """
    found, at, normal = _points(problem, limit, _turned(problem, limit, u)[0], scale)
    if not len(problem.circles):
        return found, at, normal, np.zeros((len(at), 0, 2))
    for _ in range(TURNS):
        turned = _turned(problem, at, found)[0]
        moved = np.linalg.norm(turned - found, axis=0).max(initial=0.0)
        found, at, normal = _points(problem, at, turned, scale)
        if moved < STILL:
            break
    # What directions do alone, all normal variables at their means.
    alone = np.where(problem.straight[:, None], 0.0, u)
    for _ in range(TURNS):
        alone, margin, _ = _turned(problem, limit, alone)
    alone, by = alone[:, margin < 0], limit[margin < 0]
    found, at = np.concatenate([found, alone], axis=1), np.concatenate([at, by])
    normal = np.concatenate([normal, np.zeros_like(alone)], axis=1)
    _, margin, slope = _turned(problem, at, found)
    steep = np.linalg.norm(slope[problem.normals], axis=0)
    # A direction counts by how much the logarithm of the probability changes as it turns: the slope by the direction
    # over that by the distance, times how fast the logarithm falls with the distance.
    away = (found * normal).sum(axis=0)
    width = np.where(away > 0, steep / _hazard(away), steep * (1.0 - away) + np.maximum(-margin, 0.0))
    pull = np.moveaxis(-slope[problem.circles], 2, 0) / np.where(width > 0, width, 1.0)[:, None, None]
    return found, at, normal, pull


def _points(problem: Problem, limit: Ints, u: Floats, scale: Floats) -> tuple[Floats, Ints, Floats]:
    """Starts that came to their limits: points, limits and normals."""
    u, normal, good = descend(problem, limit, u, scale)
    return u[:, good], limit[good], normal[:, good]


def _turned(problem: Problem, limit: Ints, u: Floats) -> tuple[Floats, Floats, Floats]:
    """Points with their directions against the slope of their limits; margins and slopes before."""
    if not len(problem.circles) or not len(limit):
        return u, np.zeros(len(limit)), np.zeros_like(u)
    margins, gradients = problem.gradients(u)
    lanes = np.arange(len(limit))
    slope = np.nan_to_num(gradients[limit, :, lanes].T, posinf=0.0, neginf=0.0)
    turned = u.copy()
    for pair in problem.circles:
        size = np.hypot(*slope[pair])
        turned[pair] = np.where(size > 0, -slope[pair] / np.where(size > 0, size, 1.0), u[pair])
    return turned, margins[limit, lanes], slope


def _hazard(distance: Floats) -> Floats:
    """Derivative of -log P(a standard normal variable is beyond)."""
    from scipy.special import log_ndtr

    return np.asarray(np.exp(-0.5 * distance**2 - log_ndtr(-distance)) / np.sqrt(2.0 * np.pi))
