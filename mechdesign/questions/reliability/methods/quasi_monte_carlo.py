"""Scrambled Sobol points, in independent replicates whose spread gives the interval.

[Sobol, 1967; Owen, Randomly permuted (t,m,s)-nets, 1995; Joe & Kuo, Constructing Sobol sequences with better
two-dimensional projections, 2008 (scipy.stats.qmc).]
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from mechdesign.numerics.arrays import Floats
from mechdesign.questions.reliability.engine.problem import POINTS_TOGETHER, Estimate, binomial, replicated
from mechdesign.questions.reliability.methods import QUASI, pose_by_pose
from mechdesign.questions.reliability.simulation import Setting, Sums, generator, sums_of
from mechdesign.questions.reliability.task import MethodResult, Task

REPLICATES = 16
# With fewer failures the replicates' means are far from normal, and the wider binomial interval is used.
_FEW_FAILURES = 200


def run(task: Task) -> MethodResult:
    """Results at every pose, with about the study's number of samples as points."""
    return pose_by_pose(task, _at_pose)


def _at_pose(task: Task, setting: Setting) -> MethodResult:
    sources, counts = task.sources, replicates(task.samples)
    seeds = generator(task.seed, setting.pose, QUASI, 0).integers(2**62, size=len(counts))
    parts: list[list[Sums]] = []
    for count, seed in zip(counts, seeds.tolist(), strict=True):
        begun = sum(map(len, parts))
        parts.append([
            sums_of(replace(setting, scale=None), sources.made(sources.at(u)), u.shape[1], begun + block)
            for block, u in enumerate(points(len(sources.owners), count, seed))
        ])  # fmt: skip
    total = Sums.total([part for replicate in parts for part in replicate])
    # Points of a Sobol sequence are not independent: their trend with the number of samples is left out.
    result = MethodResult(sums={setting.pose: replace(total, trend=total.trend[:0])})
    if task.question.limited:
        broken = [sum(part.failures for part in replicate) for replicate in parts]
        result.estimates[setting.pose] = estimate(broken, counts[0], total.samples - total.valid)
    return result


def replicates(samples: int) -> list[int]:
    """Number of points of each replicate: the power of two with which all together have about `samples`."""
    exponent = max(1, round(np.log2(max(samples / REPLICATES, 2))))
    return [2**exponent] * REPLICATES


def points(dimension: int, count: int, seed: int) -> Iterator[Floats]:
    """Scrambled Sobol points as standard normal variables, in blocks of shape (dimension, n)."""
    from scipy.special import ndtri
    from scipy.stats import qmc

    sequence = qmc.Sobol(dimension, scramble=True, rng=np.random.default_rng(seed))
    for begin in range(0, count, POINTS_TOGETHER):
        # A scrambled point is 0 with a probability of 2^-30, and its quantile would be infinite.
        yield ndtri(np.clip(sequence.random(min(POINTS_TOGETHER, count - begin)), 2.0**-32, 1 - 2.0**-32)).T


def estimate(broken: Sequence[int], count: int, invalid: int) -> Estimate:
    """Estimate from the failures of each replicate of `count` points."""
    failures, total = sum(broken), count * len(broken)
    if failures < _FEW_FAILURES or total - failures < _FEW_FAILURES:
        low, high = binomial(failures, total)
    else:
        low, high = replicated(np.array(broken) / count)
    return Estimate(failures / total, low, high, total, total, failures, invalid)
