"""The cheapest method that reaches the precision asked, each step checked by those below; moments of plain samples."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from importlib import import_module

import numpy as np

from mechdesign.analyses.reliability.engine.design_points import DesignPoints, find
from mechdesign.analyses.reliability.engine.problem import Estimate, Problem, needed, reached
from mechdesign.analyses.reliability.methods import SEARCH, pose_by_pose
from mechdesign.analyses.reliability.simulation import Setting, Sums, generator, problem_of, simulate_chunk
from mechdesign.analyses.reliability.task import MethodResult, Task
from mechdesign.study.schema.methods import METHODS
from mechdesign.study.schema.reliability import Precision

# Plain samples that every rung is checked with, and up to how many of them need no other method.
PILOT = 4000
FEW = 40_000
# Failures from which on their share is known well enough to plan by.
_ENOUGH_FAILURES = 30
# A step beyond plain samples: from the problem, its design points, a generator, the most samples and the precision.
# None says nothing; an estimate without samples claims no interval, and checks those that do.
Rung = Callable[[Problem, DesignPoints, np.random.Generator, int, Precision], Estimate | None]
# Two methods disagree where their intervals are farther apart than this factor.
FACTOR = 1.5


def rungs() -> dict[str, Rung]:
    """Of the methods that are declared as steps, in their order."""
    steps = sorted((method for method in METHODS.values() if method.step), key=lambda method: method.step)
    return {method.name: import_module(method.place).rung for method in steps}


def run(task: Task) -> MethodResult:
    """Plain samples first, then the steps, until one is precise enough."""
    return pose_by_pose("auto", task, _at_pose)


def _at_pose(task: Task, setting: Setting) -> MethodResult:
    drawn: list[Sums] = []

    def plain(count: int) -> Estimate:
        while (have := sum(part.samples for part in drawn)) < count:
            # The first chunk is the pilot, the following ones are whole.
            size = min(PILOT if not drawn else FEW, count - have)
            drawn.append(simulate_chunk(setting, task.sources, task.seed, len(drawn), size))
        return Sums.total(drawn).estimate

    if not task.question.limited:
        plain(min(FEW, task.most))
        return MethodResult("auto", sums={setting.pose: Sums.total(drawn)})
    rng = generator(task.seed, setting.pose, SEARCH, 2)
    # Where nothing else helps, plain samples are as many in all.
    problem, shared = problem_of(setting, task.sources), max(FEW, task.most // task.poses.count)
    estimate, used, said = climb(problem, task.precision, plain, rungs(), rng, task.most, shared)
    pose = setting.pose
    return MethodResult("auto", {pose: estimate}, {pose: Sums.total(drawn)}, {pose: used}, {pose: said})


def climb(
    problem: Problem,
    precision: Precision,
    plain: Callable[[int], Estimate],
    rungs: Mapping[str, Rung],
    rng: np.random.Generator,
    most: int,
    most_plain: int,
) -> tuple[Estimate, str, dict[str, Estimate]]:
    """Probability of failure to a precision.

    Parameters
    ----------
    plain : callable
        Monte Carlo with so many samples in all; keeps what it has drawn before.
    rungs : mapping of str to Rung
        The methods that are tried in this order where plain samples do not suffice.
    most, most_plain : int
        Samples that are drawn at most by any method, and by Monte Carlo.

    Returns
    -------
    estimate, used, said
        The estimate, with the evaluations of all rungs; the method that it comes from; those of all methods tried.
    """
    said = {"monte_carlo": plain(min(PILOT, most, most_plain))}

    def plainly(count: float) -> Estimate:
        said["monte_carlo"] = plain(int(min(most, most_plain, max(count, PILOT))))
        return said["monte_carlo"]

    def precise(estimate: Estimate) -> bool:
        return reached(precision, estimate.failure, estimate.low, estimate.high)

    def enough(estimate: Estimate) -> float:
        # Of few failures the interval's end is the safe number to plan with.
        share = estimate.failure if estimate.failures >= _ENOUGH_FAILURES else estimate.high
        return 1.1 * needed(precision, share, share * (1.0 - share))

    found, used = said["monte_carlo"], "monte_carlo"
    if not precise(found) and enough(found) <= FEW:
        found = plainly(enough(found))
    if not precise(found):
        points = find(problem, rng)
        candidates: dict[str, Estimate] = {}
        for name, rung in rungs.items():
            tried = rung(problem, points, rng, most, precision)
            if tried is None:
                continue
            said[name] = tried
            # Plain samples see every failure: what they exclude has missed some of them.
            if tried.failures and tried.high >= found.low:
                candidates[name] = tried
                if precise(tried):
                    break
        if not any(map(precise, candidates.values())):
            found = plainly(enough(found) if found.failures >= _ENOUGH_FAILURES else np.inf)
        for name, tried in candidates.items():
            if precise(tried) or tried.high - tried.low < found.high - found.low:
                found, used = tried, name
    total = problem.evaluations + said["monte_carlo"].evaluations
    return replace(found, evaluations=total), used, said


def disagree(one: Estimate, other: Estimate) -> float:
    """How many times two estimates are apart beyond their intervals; 1 where these overlap."""
    low, high = max(one.low, other.low), min(one.high, other.high)
    if not low > high:
        return 1.0
    return low / high if high > 0 else float("inf")
