"""Intervals of estimated probabilities at 99.7 %: three standard deviations of a normal estimate [S2, eq. 15]."""

from __future__ import annotations

import numpy as np
from scipy.special import betaincinv, gammaincinv

from mechdesign.analyses.reliability.engine.precision import CONFIDENCE
from mechdesign.numerics.arrays import Floats
from mechdesign.numerics.statistics import student


def binomial(events: int, samples: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Clopper-Pearson interval of the probability of an event that was seen `events` times in `samples`."""
    if samples == 0:
        return float("nan"), float("nan")
    tail = 0.5 * (1.0 - confidence)
    low = betaincinv(events, samples - events + 1, tail) if events else 0.0
    high = betaincinv(events + 1, samples - events, 1.0 - tail) if events < samples else 1.0
    return float(low), float(high)


def weighted(total: float, squares: float, most: float, samples: int) -> tuple[float, float]:
    """Interval of the mean of positive weights, many of them zero, from their sum, sum of squares and the largest.

    That of a gamma law with the mean's moments; its upper end counts on one more of the largest weight, so that it is
    exact where all weights that are not zero are equal and rare. [Fay & Feuer, Confidence intervals for directly
    standardized rates, 1997.]
    """
    mean = total / samples
    if mean <= 0:
        return 0.0, 1.0
    variance = max(squares / samples - mean * mean, 0.0) / max(samples - 1, 1)
    one, tail = most / samples, 0.5 * (1.0 - CONFIDENCE)
    low = _gamma(mean, variance, tail)
    high = _gamma(mean + one, variance + one * one, 1.0 - tail)
    return min(low, 1.0), min(high, 1.0)


def _gamma(mean: float, variance: float, share: float) -> float:
    """Quantile of a gamma law."""
    # Below the rounding of the sums the law is its mean.
    if variance <= 1e-20 * mean * mean:
        return mean
    return float(gammaincinv(mean * mean / variance, share)) * variance / mean


def replicated(means: Floats) -> tuple[float, float]:
    """Student's interval of the mean of independent estimates."""
    count = len(means)
    half = student(count - 1, CONFIDENCE) * float(np.std(means, ddof=1)) / float(np.sqrt(count))
    mean = float(np.mean(means))
    return max(mean - half, 0.0), min(mean + half, 1.0)
