"""The cheapest method that is precise enough, each rung checked by the ones below it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mechdesign.analyses.reliability.engine.design_points import find
from mechdesign.analyses.reliability.engine.form import form
from mechdesign.analyses.reliability.engine.importance import importance_sampling
from mechdesign.analyses.reliability.engine.precision import Precision
from mechdesign.analyses.reliability.engine.problem import Estimate, Problem

# Plain samples that every rung is checked with, and up to how many of them need no other method.
PILOT, FEW = 4000, 40_000
# Two methods disagree where their intervals are farther apart than this factor.
FACTOR = 1.5


def climb(
    problem: Problem,
    precision: Precision,
    plain: Callable[[int], Estimate],
    rng: np.random.Generator,
    most: int,
) -> tuple[Estimate, str, dict[str, Estimate]]:
    """Probability of failure to a precision.

    Parameters
    ----------
    plain : callable
        Monte Carlo with so many samples all told; keeps what it has drawn before.
    most : int
        Samples that are drawn at most by any method.

    Returns
    -------
    estimate : Estimate
        Its evaluations are those of all rungs. Where no failure was seen the value is the interval's upper end.
    used : str
        The method that it comes from.
    rungs : dict of str to Estimate
        What each method that was tried says.
    """
    rungs = {"monte_carlo": plain(min(PILOT, most))}

    def plainly(count: float) -> tuple[Estimate, str]:
        rungs["monte_carlo"] = plain(int(min(most, max(count, PILOT))))
        return rungs["monte_carlo"], "monte_carlo"

    found, used = rungs["monte_carlo"], "monte_carlo"
    if not precision.reached(found.failure, found.low, found.high):
        share = found.failure if found.failures >= 30 else 0.0
        enough = 1.1 * precision.needed(share, share * (1.0 - share))
        if enough <= FEW:
            found, used = plainly(enough)
        else:
            points = find(problem, rng)
            rungs["form"] = form(problem, points)
            sampled = importance_sampling(problem, points, rng, most, precision)
            rungs["importance_sampling"] = sampled
            # Plain samples see every failure: what they exclude has missed some of them.
            missed = not sampled.failures or sampled.high < rungs["monte_carlo"].low
            precise = precision.reached(sampled.failure, sampled.low, sampled.high)
            found, used = sampled, "importance_sampling"
            if missed or not precise:
                other = plainly(enough)
                narrower = other[0].high - other[0].low < sampled.high - sampled.low
                found, used = other if missed or narrower else (sampled, used)
    total = problem.evaluations + rungs["monte_carlo"].evaluations
    value = found.failure if found.failures else found.high
    return replace(found, failure=value, evaluations=total), used, rungs


def disagree(one: Estimate, other: Estimate) -> float:
    """How many times two estimates are apart beyond their intervals; 1 where these overlap."""
    low, high = max(one.low, other.low), min(one.high, other.high)
    if not low > high:
        return 1.0
    return low / high if high > 0 else float("inf")
