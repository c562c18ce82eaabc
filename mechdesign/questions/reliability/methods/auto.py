"""The cheapest method that meets the precision, checked by the cheaper ones; moments from plain Monte Carlo."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from importlib import import_module

import numpy as np

from mechdesign.questions.reliability.engine.design_points import DesignPoints, find
from mechdesign.questions.reliability.engine.problem import Estimate, LimitStates, needed, reached
from mechdesign.questions.reliability.methods import SEARCH, pose_by_pose
from mechdesign.questions.reliability.schema.methods import METHODS
from mechdesign.questions.reliability.schema.section import Precision
from mechdesign.questions.reliability.simulation import Setting, Sums, generator, problem_of, simulate_chunk
from mechdesign.questions.reliability.task import MethodResult, Task

# Plain Monte Carlo samples that are drawn first, and that every other method is checked against.
PILOT = 4000
# Number of plain samples up to which no other method is tried.
FEW = 40_000
# Failures from which on their share is precise enough to predict the samples needed.
_ENOUGH_FAILURES = 30
# A method that is tried after plain samples: from the problem, its design points, a generator, the most samples and the
# precision to an estimate, or None where it does not apply. An estimate without samples is only a check.
Rung = Callable[[LimitStates, DesignPoints, np.random.Generator, int, Precision], Estimate | None]
# Ratio of the nearest ends of two methods' intervals from which on they disagree.
FACTOR = 1.5


def rungs() -> dict[str, Rung]:
    """The methods that the schema declares as steps of `auto`, in their order."""
    steps = sorted((method for method in METHODS.values() if method.step), key=lambda method: method.step)
    return {method.name: import_module(method.place).rung for method in steps}


def run(task: Task) -> MethodResult:
    """Plain samples first, then the other methods, until one is precise enough."""
    return pose_by_pose(task, _at_pose)


def _at_pose(task: Task, setting: Setting) -> MethodResult:
    # Sums of all samples so far, after each chunk.
    drawn: list[Sums] = []

    def plain(count: int) -> Estimate:
        while (done := drawn[-1].samples if drawn else 0) < count:
            size = min(PILOT if not drawn else FEW, count - done)
            part = simulate_chunk(setting, task.sources, task.seed, len(drawn), size)
            drawn.append(drawn[-1] + part if drawn else part)
        return drawn[-1].estimate

    pose = setting.pose
    if not task.question.limits:
        plain(min(FEW, task.most))
        return MethodResult(sums={pose: drawn[-1]})
    rng = generator(task.seed, setting.pose, SEARCH, 2)
    # All poses share about `task.most` plain samples.
    problem, shared = problem_of(setting, task.sources), max(FEW, task.most // task.poses.count)
    estimate, used, tried = climb(problem, task.precision, plain, rungs(), rng, task.most, shared)
    return MethodResult({pose: estimate}, {pose: drawn[-1]}, {pose: used}, {pose: tried})


def climb(
    problem: LimitStates,
    precision: Precision,
    plain: Callable[[int], Estimate],
    rungs: Mapping[str, Rung],
    rng: np.random.Generator,
    most: int,
    most_plain: int,
) -> tuple[Estimate, str, dict[str, Estimate]]:
    """Probability of failure with a given precision, by the first method that meets it.

    Parameters
    ----------
    plain : callable
        Monte Carlo with this number of samples in all; samples drawn before are kept.
    rungs : mapping of str to Rung
        The methods that are tried in this order where plain samples do not suffice.
    most, most_plain : int
        Most samples of any method, and of Monte Carlo.

    Returns
    -------
    estimate, used, tried
        The estimate, with the evaluations of all rungs; the method that it comes from; the estimates of all methods.
    """
    tried = {"monte_carlo": plain(min(PILOT, most, most_plain))}

    def plainly(count: float) -> Estimate:
        tried["monte_carlo"] = plain(int(min(most, most_plain, max(count, PILOT))))
        return tried["monte_carlo"]

    def precise(estimate: Estimate) -> bool:
        return reached(precision, estimate.failure, estimate.low, estimate.high)

    def enough(estimate: Estimate) -> float:
        # With few failures their share is uncertain: the upper end of its interval is used.
        share = estimate.failure if estimate.failures >= _ENOUGH_FAILURES else estimate.high
        return 1.1 * needed(precision, share, share * (1.0 - share))

    best, used = tried["monte_carlo"], "monte_carlo"
    if not precise(best) and enough(best) <= FEW:
        best = plainly(enough(best))
    if not precise(best):
        points = find(problem, rng)
        candidates: dict[str, Estimate] = {}
        for name, rung in rungs.items():
            estimate = rung(problem, points, rng, most, precision)
            if estimate is None:
                continue
            tried[name] = estimate
            # Plain samples miss no kind of failure: an estimate below their interval has missed one.
            if estimate.failures and estimate.high >= best.low:
                candidates[name] = estimate
                if precise(estimate):
                    break
        if not any(map(precise, candidates.values())):
            best = plainly(enough(best) if best.failures >= _ENOUGH_FAILURES else np.inf)
        for name, estimate in candidates.items():
            if precise(estimate) or estimate.high - estimate.low < best.high - best.low:
                best, used = estimate, name
    total = problem.evaluations + tried["monte_carlo"].evaluations
    return replace(best, evaluations=total), used, tried


def disagree(one: Estimate, other: Estimate) -> float:
    """Ratio of the nearest ends of two estimates' intervals, at least 1; 1 where they overlap."""
    low, high = max(one.low, other.low), min(one.high, other.high)
    if not low > high:
        return 1.0
    return low / high if high > 0 else float("inf")
