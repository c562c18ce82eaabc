"""First-order reliability method: each limit replaced by its tangent at the design points.

[Hohenbichler & Rackwitz, First-order concepts in system reliability, 1983.]
"""

from __future__ import annotations

import math

from mechdesign.analyses.reliability.engine.design_points import DesignPoints
from mechdesign.analyses.reliability.engine.problem import Estimate, Problem
from mechdesign.analyses.reliability.probability import half_spaces


def form(problem: Problem, points: DesignPoints) -> Estimate:
    """Probability that any tangent half-space is entered; no interval is claimed.

    Notes
    -----
    Where no design point was found nothing breaks a limit within reach, and the value is 0; nan if samples fail all the
    same, for example by limits that nothing random moves, or that depend on where a pin in contact lies alone.
    """
    if not len(points.u) and points.seen.shape[1]:
        return Estimate(math.nan, math.nan, math.nan, problem.evaluations)
    value = half_spaces(points.normal, points.distance)
    return Estimate(value, value, value, problem.evaluations)
