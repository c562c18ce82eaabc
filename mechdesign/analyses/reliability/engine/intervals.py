"""Intervals of estimated probabilities at 99.7 %: three standard deviations of a normal estimate [S2, eq. 15].

SciPy takes a quarter of a second to import, and moments do without: it is imported where an interval is computed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechdesign.numerics.arrays import Floats

# Of all intervals.
CONFIDENCE = 0.997
# Half the width of such an interval in standard errors.
WIDTH = 2.97


@dataclass(frozen=True)
class Precision:
    """How wide the 99.7 % interval may be.

    Parameters
    ----------
    relative : float or None
        Coefficient of variation: the standard error as a fraction of the probability of failure. Half the interval is
        about three times that.
    half_width : float or None
        Half the interval itself.
    """

    relative: float | None
    half_width: float | None

    def _half(self, value: float) -> float:
        return self.half_width if self.half_width is not None else WIDTH * (self.relative or 0.0) * value

    def reached(self, value: float, low: float, high: float) -> bool:
        """Whether an interval is narrow enough."""
        return 0.5 * (high - low) <= self._half(value)

    def needed(self, value: float, variance: float) -> float:
        """Samples that reach it, from the value and the variance of one sample."""
        half = self._half(value)
        return WIDTH**2 * variance / half**2 if half > 0 else float("inf")


def binomial(events: int, samples: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Clopper-Pearson interval of the probability of an event that was seen `events` times in `samples`."""
    from scipy.special import betaincinv

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
    from scipy.special import gammaincinv

    # Below the rounding of the sums the law is its mean.
    if variance <= 1e-20 * mean * mean:
        return mean
    return float(gammaincinv(mean * mean / variance, share)) * variance / mean


def replicated(means: Floats) -> tuple[float, float]:
    """Student's interval of the mean of independent estimates."""
    from mechdesign.numerics.statistics import student

    count = len(means)
    half = student(count - 1, CONFIDENCE) * float(np.std(means, ddof=1)) / float(np.sqrt(count))
    mean = float(np.mean(means))
    return max(mean - half, 0.0), min(mean + half, 1.0)
