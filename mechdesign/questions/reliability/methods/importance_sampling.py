"""Importance sampling about the design points, by a mixture of normal densities that learns where failures lie.

[Melchers, Search-based importance sampling, 1990; Kurtz & Song, Cross-entropy-based adaptive importance sampling using
Gaussian mixture, 2013; the part that never changes bounds the weights as in Owen & Zhou, Safe and effective importance
sampling, 2000.]
"""

from __future__ import annotations

from dataclasses import replace
from functools import reduce
from operator import add

import numpy as np

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.questions.reliability.engine.design_points import (
    EXPLORED,
    DesignPoints,
    explored_weights,
    find,
)
from mechdesign.questions.reliability.engine.mixture import Mixture
from mechdesign.questions.reliability.engine.problem import (
    POINTS_TOGETHER,
    Estimate,
    LimitStates,
    failed,
    needed,
    reached,
    weighted,
)
from mechdesign.questions.reliability.methods import SEARCH, pose_by_pose
from mechdesign.questions.reliability.schema.section import Precision
from mechdesign.questions.reliability.simulation import Setting, generator, problem_of, simulate
from mechdesign.questions.reliability.task import MethodResult, Task

# Most rounds of learning; samples of a round for each dimension, further ones for each dimension and part, and the
# least samples of a round.
_ROUNDS = 12
_ROUND_SAMPLES = 40
_PART_SAMPLES = 10
_ROUND_LEAST = 1600
# Learning ends where the relative variance of a round's weights is below this, or below the number of rounds.
_GOOD_VARIANCE = 2.0
# A new part of the mixture is added about a failure that adds at least this much to that variance and is this many
# times less likely in the mixture than it should be; and the weight of the new part.
_PART_WEIGHT = 0.05
_PART_VARIANCE = 0.1
_PART_LACK = 10.0
# Most parts up to which new ones are added.
_MAX_PARTS = 24
# Effective number of failures among the explored samples from which on they add parts before the first round.
_EXPLORED_MANY = 5
# Share of the learned parts' samples that are drawn widely, so that the variance of the weights is finite.
_WIDE_SHARE = 0.2
# Share of the samples that are always drawn about the design points, and the least share of one design point.
_FIXED_SHARE = 0.1
_LEAST_SHARE = 0.02
# Share of these that are drawn anywhere beyond this part of the nearest design point's distance, where failures that
# were not found may lie.
_BEYOND_SHARE = 0.2
_BEYOND_FROM = 0.9
# Samples by which the number of all samples is planned, and the factor by which more than planned are drawn.
_FIRST_SAMPLES = 3000
_MARGIN = 1.1
# Least density and largest logarithm of a density; smaller and larger ones are clipped against overflow.
_LEAST_DENSITY = 1e-200
_MAX_LOG_DENSITY = 600.0


def run(task: Task) -> MethodResult:
    """Probability of failure at every pose; where no sample failed, the bound that plain samples give."""
    return pose_by_pose(task, _at_pose) if task.question.limits else MethodResult()


def _at_pose(task: Task, setting: Setting) -> MethodResult:
    problem = problem_of(setting, task.sources)
    rng = generator(task.seed, setting.pose, SEARCH, 1)
    estimate = importance_sampling(problem, find(problem, rng), rng, task.samples)
    if not estimate.failures:
        parts = simulate([setting], task.sources, task.seed, task.samples)
        estimate = reduce(add, (part for _, part in parts)).estimate
        estimate = replace(estimate, evaluations=estimate.evaluations + problem.evaluations)
    return MethodResult({setting.pose: estimate})


def importance_sampling(
    problem: LimitStates,
    points: DesignPoints,
    rng: np.random.Generator,
    samples: int,
    precision: Precision | None = None,
) -> Estimate:
    """Probability of failure; 0 with the interval [0, 1] where no sample failed, or no design point was found.

    At most `samples` are drawn besides those that the mixture learns from; all of them where no precision is given.
    """
    if not len(points.u):
        return Estimate(0.0, 0.0, 1.0, problem.evaluations)
    mixture, square, most = _learned(problem, points, rng)
    total = squares = 0.0
    done = failures = invalid = 0
    planned = samples if precision is None else min(_FIRST_SAMPLES, samples)
    while done < planned:
        count = min(POINTS_TOGETHER, planned - done)
        u = mixture.draw(rng, count)
        margins = problem.margins(u)
        broken = failed(margins)
        weights = mixture.worth(u[:, broken])
        total, squares = total + float(weights.sum()), squares + float(weights @ weights)
        most = max(most, float(weights.max(initial=0.0)))
        done, failures = done + count, failures + int(broken.sum())
        invalid += int(np.isnan(margins).any(axis=0).sum())
        if done == planned < samples and precision is not None and total > 0:
            mean = total / done
            if not reached(precision, mean, *weighted(total, max(squares, done * square), most, done)):
                more = _MARGIN * needed(precision, mean, max(squares / done, square) - mean * mean)
                planned = int(min(samples, max(1.2 * done, more)))
    low, high = weighted(total, max(squares, done * square), most, done)
    # The mean weight of all samples is 1 only in expectation, so that the estimate can exceed 1.
    return Estimate(min(total / done, 1.0), low, high, problem.evaluations, done, failures, invalid)


rung = importance_sampling


def _about(problem: LimitStates, points: DesignPoints) -> Mixture:
    """Parts about the design points, weighted by the tangents' probabilities, and a part beyond the nearest one."""
    from scipy.special import i0e, log_ndtr

    near = points.near
    # Where the mean itself fails, most failures lie about the mean.
    centre = np.where(points.distance[near, None] > 0, points.u[near][:, problem.normals], 0.0)
    logs = log_ndtr(-points.distance[near]) + np.log(i0e(np.linalg.norm(points.pull[near], axis=2))).sum(axis=1)
    weight = np.exp(logs - logs.max())
    weight = np.maximum(weight / weight.sum(), _LEAST_SHARE)
    d = len(problem.normals)
    return Mixture(
        problem, (1.0 - _BEYOND_SHARE) * weight / weight.sum(), centre, np.broadcast_to(np.eye(d), (len(centre), d, d)),
        points.pull[near], _BEYOND_FROM * _least(np.concatenate([centre.T, points.failures[problem.normals]], axis=1)),
    )  # fmt: skip


def _least(normal: Floats) -> float:
    """Least distance from the mean of points of shape (normal variables, n)."""
    return float(np.sqrt((normal * normal).sum(axis=0).min(initial=np.inf)))


def _learned(problem: LimitStates, points: DesignPoints, rng: np.random.Generator) -> tuple[Mixture, float, float]:
    """The learned mixture joined with the fixed one about the design points, and the mean square and largest weight.

    Each round is one step of expectation and maximisation over all failures so far. Mean square and largest weight are
    estimated from these failures for samples of the returned mixture.
    """
    fixed = _about(problem, points)
    parts = replace(fixed, weight=(1.0 - _LEAST_SHARE) * fixed.weight / fixed.weight.sum())
    explored = explored_weights(problem, points.failures)
    # Failures among the explored samples may show regions that have no design point.
    if float(explored.sum()) ** 2 > _EXPLORED_MANY * float(explored @ explored):
        parts = _covering(fixed, parts, points.failures, explored, EXPLORED)
    count = max(_ROUND_LEAST, (_ROUND_SAMPLES + _PART_SAMPLES * len(fixed.weight)) * problem.dimension)
    points_by_round, weights_by_round = [], []
    for rounds in range(1, _ROUNDS + 1):
        mixture = parts.joined(parts.widened, _WIDE_SHARE).joined(fixed, _FIXED_SHARE)
        u = mixture.draw(rng, count)
        u = u[:, failed(problem.margins(u))]
        weights = mixture.worth(u)
        # A failure nearer to the mean than all before moves the edge of the part beyond inwards.
        beyond = min(fixed.beyond, _BEYOND_FROM * _least(u[problem.normals]))
        fixed, parts = replace(fixed, beyond=beyond), replace(parts, beyond=beyond)
        points_by_round.append(u)
        weights_by_round.append(weights)
        failures, worth = np.concatenate(points_by_round, axis=1), np.concatenate(weights_by_round)
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
    """`parts` with new parts about failures `u`, shape (dimension, n), that both mixtures draw far too seldom.

    `worth` are the weights that the failures had when they were drawn, among `drawn` samples.
    """
    total = float(worth.sum())
    if not total > 0:
        return parts
    held, own = (np.exp(np.minimum(mixture.logs(u), _MAX_LOG_DENSITY)).sum(axis=0) for mixture in (fixed, parts))
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
