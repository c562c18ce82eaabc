"""Quasi Monte Carlo: scrambled Sobol points, replicated for an interval.

[Sobol, 1967; Owen, Randomly permuted (t,m,s)-nets, 1995; Joe & Kuo, Constructing Sobol sequences with better
two-dimensional projections, 2008 (scipy.stats.qmc).]
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from mechdesign.analyses.reliability.engine.intervals import binomial, replicated
from mechdesign.analyses.reliability.engine.problem import BLOCK, Estimate
from mechdesign.numerics.arrays import Floats

REPLICATES = 16
# Beyond so few failures the means of the replicates are far from normal, and the interval is that of plain samples,
# which is wider: the variance of a scrambled net is hardly ever above theirs.
FEW = 200


def replicates(samples: int) -> list[int]:
    """Points of each replicate: powers of two, about as many as asked all told."""
    each = max(1, round(np.log2(max(samples / REPLICATES, 2))))
    return [2**each] * REPLICATES


def points(dimension: int, count: int, seed: int) -> Iterator[Floats]:
    """Scrambled Sobol points as standard normal variables, in blocks of shape (dimension, n)."""
    from scipy.special import ndtri
    from scipy.stats import qmc

    sequence = qmc.Sobol(dimension, scramble=True, rng=np.random.default_rng(seed))
    for begin in range(0, count, BLOCK):
        # The scrambling leaves points at 0 a chance of one in 2^30.
        yield ndtri(np.clip(sequence.random(min(BLOCK, count - begin)), 2.0**-32, 1 - 2.0**-32)).T


def estimate(broken: Sequence[int], count: int, invalid: int) -> Estimate:
    """Estimate from the failures of each replicate of `count` points."""
    failures, total = sum(broken), count * len(broken)
    if failures < FEW or total - failures < FEW:
        low, high = binomial(failures, total)
    else:
        low, high = replicated(np.array(broken) / count)
    return Estimate(failures / total, low, high, total, total, failures, invalid)
