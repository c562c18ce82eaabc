"""First-order reliability method: each limit replaced by its tangent at the design points.

[Hohenbichler & Rackwitz, First-order concepts in system reliability, 1983; the union of the half-spaces as in Owen,
Maximov & Chertkov, Importance sampling the union of rare events, 2019.]
"""

from __future__ import annotations

import numpy as np

from mechdesign.analyses.reliability.engine.design_points import DesignPoints
from mechdesign.analyses.reliability.engine.problem import Estimate, Problem

# Points in the half-spaces, of which none is an evaluation; the value is then off by less than half a per cent.
_SAMPLES = 20_000


def form(problem: Problem, points: DesignPoints) -> Estimate:
    """Probability that any tangent half-space is entered; no interval is claimed.

    Notes
    -----
    Where no design point was found nothing breaks a limit within reach, and the value is 0.
    """
    value = _union(points) if len(points.u) else 0.0
    return Estimate(value, value, value, problem.evaluations)


def _union(points: DesignPoints) -> float:
    """Sum of the half-spaces' probabilities, times the mean of one over how many of them hold a point of one."""
    from scipy.special import ndtr, ndtri

    chances = ndtr(-points.distance)
    total = float(chances.sum())
    if len(chances) == 1 or total == 0:
        return total
    rng = np.random.Generator(np.random.SFC64(0))
    half = rng.choice(len(chances), _SAMPLES, p=chances / total)
    normal = points.normal[half].T
    u = rng.standard_normal(normal.shape)
    depth = -ndtri(chances[half] * (1.0 - rng.random(_SAMPLES)))
    u += normal * (depth - (normal * u).sum(axis=0))
    held = points.normal @ u > points.distance[:, None]
    # Its own half-space holds a point whatever rounding says.
    held[half, np.arange(_SAMPLES)] = True
    return total * float(np.mean(1.0 / held.sum(axis=0)))
