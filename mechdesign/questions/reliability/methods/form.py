"""First-order reliability method: each limit replaced by its tangent at the design points; no interval is claimed.

[Hohenbichler & Rackwitz, First-order concepts in system reliability, 1983.]

A random direction (`Problem.circles`) has no tangent: tangents are taken with the directions fixed, and the probability
is the mean over random directions.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.special import ndtr, ndtri

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.questions.reliability.engine.descent import descend, sizes
from mechdesign.questions.reliability.engine.design_points import DesignPoints, find
from mechdesign.questions.reliability.engine.mixture import Mixture
from mechdesign.questions.reliability.engine.problem import Estimate, LimitStates
from mechdesign.questions.reliability.methods import SEARCH, pose_by_pose
from mechdesign.questions.reliability.probability import half_spaces
from mechdesign.questions.reliability.schema.section import Precision
from mechdesign.questions.reliability.simulation import Setting, generator, problem_of
from mechdesign.questions.reliability.task import MethodResult, Task

# Choices of all directions that are drawn in each round of learning which of them fail most, the number of these
# rounds, and the choices drawn for the value.
_LEARNING_CHOICES = 96
_LEARNING_ROUNDS = 2
_VALUE_CHOICES = 384
# Design points from which the tangents of each choice are searched, and points drawn in their half-spaces.
_POINTS_BEGUN = 8
_POINTS_DRAWN = 16
# Share of the choices that are drawn uniformly.
_UNIFORM_SHARE = 0.1
# Least share of one part of the learned mixture.
_LEAST_SHARE = 0.02


def run(task: Task) -> MethodResult:
    """Probability of failure at every pose."""
    return pose_by_pose(task, _at_pose) if task.question.limits else MethodResult()


def _at_pose(task: Task, setting: Setting) -> MethodResult:
    problem = problem_of(setting, task.sources)
    points = find(problem, generator(task.seed, setting.pose, SEARCH, 0))
    return MethodResult({setting.pose: form(problem, points)})


def rung(
    problem: LimitStates, points: DesignPoints, rng: np.random.Generator, most: int, precision: Precision
) -> Estimate | None:
    """The step of `auto`: a check of importance sampling."""
    # With random directions the check would cost more than the sampling.
    return None if len(problem.circles) else form(problem, points)


def form(problem: LimitStates, points: DesignPoints) -> Estimate:
    """Probability that a point lies beyond any of the tangents.

    It is 0 where no design point was found and no sample failed. It is nan where samples failed although no design
    point was found, or where all samples break one limit, for example one that no random source moves.
    """
    if points.always or (not len(points.u) and points.failures.shape[1]):
        return Estimate(math.nan, math.nan, math.nan, problem.evaluations)
    if len(points.u) and len(problem.circles):
        value = _mean(problem, points)
    else:
        value, _ = half_spaces(points.normal, points.distance)
    return Estimate(value, value, value, problem.evaluations)


def _mean(problem: LimitStates, points: DesignPoints) -> float:
    """Mean of the tangents' probability over random directions, drawn more often where failures are likely."""
    rng = np.random.Generator(np.random.SFC64(0))
    count, d = len(points.u), len(problem.normals)
    ones = np.full(count, (1.0 - _UNIFORM_SHARE) / count)
    mixture = Mixture(problem, ones, np.zeros((count, d)), np.repeat(np.eye(d)[None], count, axis=0), points.pull, 0.0)
    drawn, worth = np.zeros((problem.dimension, 0)), np.zeros(0)
    for _ in range(_LEARNING_ROUNDS):
        u = mixture.draw(rng, _LEARNING_CHOICES)
        drawn = np.concatenate([drawn, u], axis=1)
        worth = np.append(worth, mixture.worth(u) * _chances(problem, points, u, rng))
        if not worth.any():
            continue
        parts = mixture.fitted(drawn, worth, _LEAST_SHARE)
        count = len(parts.weight)
        mixture = replace(
            parts, weight=(1.0 - _UNIFORM_SHARE) * parts.weight / parts.weight.sum(), centre=np.zeros((count, d)),
            root=np.repeat(np.eye(d)[None], count, axis=0),
        )  # fmt: skip
    u = mixture.draw(rng, _VALUE_CHOICES)
    return min(float(np.mean(mixture.worth(u) * _chances(problem, points, u, rng))), 1.0)


def _chances(problem: LimitStates, points: DesignPoints, u: Floats, rng: np.random.Generator) -> Floats:
    """Probability of failure by tangents, with the directions that the points `u`, shape (dimension, n), have: (n,)."""
    count, begun = u.shape[1], points.u[:_POINTS_BEGUN]
    limit = points.limit[:_POINTS_BEGUN]
    starts = np.where(problem.is_normal[:, None, None], begun.T[:, :, None], u[:, None])
    at_mean = problem.margins(np.where(problem.is_normal[:, None], 0.0, u))
    normal = np.repeat(points.normal[:_POINTS_BEGUN].T[:, :, None], count, axis=2)
    distance = np.repeat(points.distance[:_POINTS_BEGUN, None], count, axis=1)
    sloped = limit >= 0
    ends, normals, good = descend(
        problem, np.repeat(limit[sloped], count), starts[:, sloped].reshape(len(u), -1), sizes(problem), together=False
    )
    shape = (len(u), int(sloped.sum()), count)
    normal[:, sloped] = normals.reshape(shape)
    # Where the descent does not reach the limit, it is broken everywhere or nowhere: the mean tells which.
    broken = np.where(at_mean[limit[sloped]] < 0, -np.inf, np.inf)
    distance[sloped] = np.where(good.reshape(shape[1:]), (ends * normals).reshape(shape).sum(axis=0), broken)
    chance = ndtr(-distance)
    total = chance.sum(axis=0)
    # The estimate of `half_spaces`, for each choice of directions.
    share = np.cumsum(chance / np.where(total > 0, total, 1.0), axis=0)
    half = np.minimum((rng.random((_POINTS_DRAWN, 1, count)) > share).sum(axis=1), len(share) - 1)
    lanes = np.arange(count)
    own = normal[:, half, lanes]
    z = rng.standard_normal((len(u), _POINTS_DRAWN, count)) * problem.is_normal[:, None, None]
    depth = -ndtri(chance[half, lanes] * (1.0 - rng.random((_POINTS_DRAWN, count))))
    z += own * np.nan_to_num(depth - (own * z).sum(axis=0))
    held = (np.einsum("dhn,dmn->hmn", normal, z) > distance[:, None]).sum(axis=0)
    return np.asarray(np.minimum(total * (1.0 / np.maximum(held, 1)).mean(axis=0), 1.0))
