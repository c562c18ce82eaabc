"""First-order reliability method: each limit replaced by its tangent at the design points.

[Hohenbichler & Rackwitz, First-order concepts in system reliability, 1983.]
"""

from __future__ import annotations

from mechdesign.analyses.reliability.engine.design_points import DesignPoints
from mechdesign.analyses.reliability.engine.problem import Estimate, Problem
from mechdesign.analyses.reliability.probability import half_spaces


def form(problem: Problem, points: DesignPoints) -> Estimate:
    """Probability that any tangent half-space is entered; no interval is claimed.

    Notes
    -----
    Where no design point was found nothing breaks a limit within reach, and the value is 0.
    """
    value = half_spaces(points.normal, points.distance)
    return Estimate(value, value, value, problem.evaluations)
