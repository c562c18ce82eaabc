"""Importance sampling about the design points, by a mixture of normal densities that learns where failures lie.

[Melchers, Search-based importance sampling, 1990; Kurtz & Song, Cross-entropy-based adaptive importance sampling using
Gaussian mixture, 2013; the part that never changes bounds the weights as in Owen & Zhou, Safe and effective importance
sampling, 2000.]
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechdesign.analyses.reliability.engine.design_points import (
    EXPLORED,
    DesignPoints,
    explored_weights,
    find,
)
from mechdesign.analyses.reliability.engine.mixture import Mixture
from mechdesign.analyses.reliability.engine.problem import (
    POINTS_TOGETHER,
    Estimate,
    Problem,
    failed,
    needed,
    reached,
    weighted,
)
from mechdesign.analyses.reliability.methods import SEARCH, of_limits
from mechdesign.analyses.reliability.simulation import Setting, Sums, generator, problem_of, simulate
from mechdesign.analyses.reliability.task import MethodResult, Task
from mechdesign.numerics.arrays import Floats
from mechdesign.study.schema.reliability import Precision

# Rounds of learning, from all failures so far, and their samples a dimension, each part besides, and at least.
_ROUNDS = 12
_ROUND_SAMPLES = 40
_PART_SAMPLES = 10
_ROUND_LEAST = 1600
# Learned enough where the relative variance of a round's weights is below this, or below the number of rounds.
_GOOD_VARIANCE = 2.0
# A part more, of this weight, where a failure adds so much to that variance and lacks so many times its samples.
_PART_WEIGHT = 0.05
_PART_VARIANCE = 0.1
_PART_LACK = 10.0
# Parts up to which more are added.
_MAX_PARTS = 24
# Explored failures, by their weights, from which on they add parts before the first round.
_EXPLORED_MANY = 5
# Share of the learned parts' samples that are drawn widely, so that the variance of the weights is finite.
_WIDE_SHARE = 0.2
# Share of the samples that stay with the design points, and with the least of them.
_FIXED_SHARE = 0.1
_LEAST_SHARE = 0.02
# Share of these beyond so much of the distance of the nearest design point: what was not found lies there too.
_BEYOND_SHARE = 0.2
_BEYOND_FROM = 0.9
# First samples of the value, by which the rest is planned, and how many times those needed are drawn.
_FIRST_SAMPLES = 3000
_MARGIN = 1.1
# Least density that counts, and the largest logarithm of a density.
_LEAST_DENSITY = 1e-200
_MAX_LOG_DENSITY = 600.0


def run(task: Task) -> MethodResult:
    """Of every pose; where no failure was seen, plain samples bound what was missed."""
    return of_limits("importance_sampling", task, _at_pose)


def _at_pose(task: Task, setting: Setting) -> Estimate:
    problem = problem_of(setting, task.sources)
    rng = generator(task.seed, setting.pose, SEARCH, 1)
    found = importance_sampling(problem, find(problem, rng), rng, task.samples)
    if found.failures:
        return found
    sums: dict[int, Sums] = {}
    simulate([setting], task.sources, task.seed, task.samples, sums)
    found = sums[setting.pose].estimate
    return replace(found, evaluations=found.evaluations + problem.evaluations)


def importance_sampling(
    problem: Problem,
    points: DesignPoints,
    rng: np.random.Generator,
    samples: int,
    precision: Precision | None = None,
) -> Estimate:
    """Probability of failure; 0 with the interval [0, 1] where no failure was seen, or no design point is known.

    Besides those that the mixture learns from at most `samples` are drawn, all of them where no precision is given.
    """
    if not len(points.u):
        return Estimate(0.0, 0.0, 1.0, problem.evaluations)
    mixture, square, most = _learned(problem, points, rng)
    total = squares = 0.0
    done = failures = invalid = 0
    wanted = samples if precision is None else min(_FIRST_SAMPLES, samples)
    while done < wanted:
        count = min(POINTS_TOGETHER, wanted - done)
        u = mixture.draw(rng, count)
        margins = problem.margins(u)
        broken = failed(margins)
        weights = mixture.worth(u[:, broken])
        total, squares = total + float(weights.sum()), squares + float(weights @ weights)
        most = max(most, float(weights.max(initial=0.0)))
        done, failures = done + count, failures + int(broken.sum())
        invalid += int(np.isnan(margins).any(axis=0).sum())
        if done == wanted < samples and precision is not None and total > 0:
            mean = total / done
            if not reached(precision, mean, *weighted(total, max(squares, done * square), most, done)):
                more = _MARGIN * needed(precision, mean, max(squares / done, square) - mean * mean)
                wanted = int(min(samples, max(1.2 * done, more)))
    low, high = weighted(total, max(squares, done * square), most, done)
    # Weights are 1 on the average only.
    return Estimate(min(total / done, 1.0), low, high, problem.evaluations, done, failures, invalid)


rung = importance_sampling


def _about(problem: Problem, points: DesignPoints) -> Mixture:
    """Parts about the design points, weighted by the tangents' probabilities, and what is beyond the nearest one."""
    from scipy.special import i0e, log_ndtr

    near = points.near
    # A mean that fails itself is where most of the failures are.
    centre = np.where(points.distance[near, None] > 0, points.u[near][:, problem.normals], 0.0)
    logs = log_ndtr(-points.distance[near]) + np.log(i0e(np.linalg.norm(points.pull[near], axis=2))).sum(axis=1)
    weight = np.exp(logs - logs.max())
    weight = np.maximum(weight / weight.sum(), _LEAST_SHARE)
    d = len(problem.normals)
    return Mixture(
        problem, (1.0 - _BEYOND_SHARE) * weight / weight.sum(), centre, np.broadcast_to(np.eye(d), (len(centre), d, d)),
        points.pull[near], _BEYOND_FROM * _least(np.concatenate([centre.T, points.seen[problem.normals]], axis=1)),
    )  # fmt: skip


def _least(normal: Floats) -> float:
    """Least distance from the mean of points of shape (normal variables, n)."""
    return float(np.sqrt((normal * normal).sum(axis=0).min(initial=np.inf)))


def _learned(problem: Problem, points: DesignPoints, rng: np.random.Generator) -> tuple[Mixture, float, float]:
    """The mixture nearest to the failures, beside the fixed one: one step of expectation and maximisation a round.

    With it, from all failures of the rounds: the mean square and the largest of the weights of its own samples.
    """
    fixed = _about(problem, points)
    parts = replace(fixed, weight=(1.0 - _LEAST_SHARE) * fixed.weight / fixed.weight.sum())
    explored = explored_weights(problem, points.seen)
    # Where many of them count, the samples that starts were taken from know of places without a design point.
    if float(explored.sum()) ** 2 > _EXPLORED_MANY * float(explored @ explored):
        parts = _covering(fixed, parts, points.seen, explored, EXPLORED)
    count = max(_ROUND_LEAST, (_ROUND_SAMPLES + _PART_SAMPLES * len(fixed.weight)) * problem.dimension)
    seen, known = [], []
    for rounds in range(1, _ROUNDS + 1):
        mixture = parts.joined(parts.widened, _WIDE_SHARE).joined(fixed, _FIXED_SHARE)
        u = mixture.draw(rng, count)
        u = u[:, failed(problem.margins(u))]
        weights = mixture.worth(u)
        # What is nearer than the nearest design point was not found before.
        beyond = min(fixed.beyond, _BEYOND_FROM * _least(u[problem.normals]))
        fixed, parts = replace(fixed, beyond=beyond), replace(parts, beyond=beyond)
        seen.append(u)
        known.append(weights)
        failures, worth = np.concatenate(seen, axis=1), np.concatenate(known)
        if worth.sum() > 0:
            parts = _covering(fixed, parts.fitted(failures, worth, _LEAST_SHARE), failures, worth, rounds * count)
        if count * float(weights @ weights) < (1.0 + max(_GOOD_VARIANCE, rounds)) * float(weights.sum()) ** 2:
            break
    if worth.sum() > 0:
        parts = _covering(fixed, parts.fitted(failures, worth, _LEAST_SHARE), failures, worth, rounds * count)
    mixture = parts.joined(parts.widened, _WIDE_SHARE).joined(fixed, _FIXED_SHARE)
    weights = mixture.worth(failures)
    return mixture, float(worth @ weights) / (rounds * count), float(weights.max(initial=0.0))


def _covering(fixed: Mixture, parts: Mixture, u: Floats, worth: Floats, drawn: int) -> Mixture:
    """`parts`, and more of them about failures, shape (dimension, n), that both mixtures have far too few samples of.

    `worth` are the weights of the failures when they were seen among `drawn` samples.
    """
    total = float(worth.sum())
    if not total > 0:
        return parts
    held, own = (np.exp(np.minimum(each.logs(u), _MAX_LOG_DENSITY)).sum(axis=0) for each in (fixed, parts))
    while len(parts.weight) < max(len(fixed.weight), _MAX_PARTS):
        # Density of failures over that of the mixture: its mean over failures is 1 and the weights' relative variance.
        density = _FIXED_SHARE * held + (1 - _FIXED_SHARE) * own
        lack = drawn / (total * np.maximum(density, _LEAST_DENSITY))
        adds = lack * worth / total
        worst = int(np.argmax(adds))
        if adds[worst] < _PART_VARIANCE or lack[worst] < _PART_LACK:
            break
        part = parts.about(u[:, worst])
        own = (1 - _PART_WEIGHT) * own + _PART_WEIGHT * np.exp(np.minimum(part.logs(u)[0], _MAX_LOG_DENSITY))
        parts = parts.joined(part, _PART_WEIGHT)
    return parts
