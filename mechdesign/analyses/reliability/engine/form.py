"""First-order reliability method: each limit replaced by its tangent at the design points.

[Hohenbichler & Rackwitz, First-order concepts in system reliability, 1983.]
"""

from __future__ import annotations

import numpy as np

from mechdesign.analyses.reliability.engine.design_points import DesignPoints
from mechdesign.analyses.reliability.engine.problem import Estimate, Problem
from mechdesign.analyses.reliability.error_limits import Band
from mechdesign.analyses.reliability.probability import failure_probability


def form(problem: Problem, points: DesignPoints) -> Estimate:
    """Probability that any tangent half-space is entered; no interval is claimed.

    Notes
    -----
    Where no design point was found nothing breaks a limit within reach, and the value is 0.
    """
    if not len(points.u):
        return Estimate(0.0, 0.0, 0.0, problem.evaluations)
    bands = [Band(k, -np.inf, float(beta)) for k, beta in enumerate(points.distance)]
    value = failure_probability(points.normal @ points.normal.T, bands, ())
    return Estimate(value, value, value, problem.evaluations)
