"""Limit states over independent standard normal variables; probabilities of failure and their 99.7 % intervals.

An interval is three standard deviations of a normal estimate [S2, eq. 15].
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.questions.reliability.schema.section import Precision

# Probability with which an interval holds the true value.
CONFIDENCE = 0.997
# Half the width of this interval for a normal estimate, in standard errors.
WIDTH = 2.97


def _half_wanted(precision: Precision, value: float) -> float:
    """Half the width of the widest interval that meets a precision."""
    return precision.half_width if precision.half_width is not None else WIDTH * (precision.relative or 0.0) * value


def reached(precision: Precision, value: float, low: float, high: float) -> bool:
    """Whether an interval meets a precision."""
    return 0.5 * (high - low) <= _half_wanted(precision, value)


def needed(precision: Precision, value: float, variance: float) -> float:
    """Number of samples that meets a precision, from the mean and the variance of one sample."""
    half = _half_wanted(precision, value)
    return WIDTH**2 * variance / half**2 if half > 0 else float("inf")


def binomial(events: int, samples: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Clopper-Pearson interval of the probability of an event that occurred in `events` of `samples`."""
    if samples == 0:
        return float("nan"), float("nan")
    tail = 0.5 * (1.0 - confidence)
    low = scipy.special.betaincinv(events, samples - events + 1, tail) if events else 0.0
    high = scipy.special.betaincinv(events + 1, samples - events, 1.0 - tail) if events < samples else 1.0
    return float(low), float(high)


def weighted(total: float, squares: float, most: float, samples: int) -> tuple[float, float]:
    """Interval of the mean of positive weights, many of them zero, from their sum, sum of squares and the largest.

    Its ends are quantiles of a gamma law with the mean and the variance of the estimate; for the upper end one more
    sample of the largest weight is counted. [Fay & Feuer, Confidence intervals for directly standardized rates, 1997.]
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
    # A variance below the rounding error of the sums counts as zero.
    if variance <= 1e-20 * mean * mean:
        return mean
    return float(scipy.special.gammaincinv(mean * mean / variance, share)) * variance / mean


# Step of a difference quotient of margins, in standard deviations: the third root of their rounding.
_MARGIN_STEP = 1e-4
# Points evaluated in one call, few enough that intermediate values stay in the processor's cache.
POINTS_TOGETHER = 20_000


@dataclass(frozen=True)
class Estimate:
    """A probability of failure by one method, and its 99.7 % interval; `low` = `high` where the method gives none.

    Parameters
    ----------
    evaluations : int
        Number of points at which margins were evaluated.
    samples : int
        Number of samples whose mean is the value; 0 where it is not a mean.
    failures, invalid : int
        Samples that failed, and those among them whose margins are nan.
    """

    failure: float
    low: float
    high: float
    evaluations: int
    samples: int = 0
    failures: int = 0
    invalid: int = 0

    @property
    def error(self) -> float:
        """Three standard errors of counted failures [S2, eq. 16]; of another method half the interval."""
        if self.samples and self.failure == self.failures / self.samples:
            return 3.0 * math.sqrt(self.failure * (1.0 - self.failure) / self.samples)
        return 0.5 * (self.high - self.low)


def counted(failures: int, samples: int, invalid: int, evaluations: int) -> Estimate:
    """Estimate from counted failures, with the interval of Clopper and Pearson."""
    return Estimate(failures / samples, *binomial(failures, samples), evaluations, samples, failures, invalid)


class LimitStates:
    """Limit states over `dimension` independent standard normal variables, and how often they were evaluated.

    Parameters
    ----------
    margins : callable
        From points, shape (dimension, n), to margins, shape (limits, n). A limit is broken where its margin is
        negative; nan is a failure of its own kind (what cannot be assembled has no margins).
    gradients : callable, optional
        From points to margins and their derivatives, shape (limits, dimension, n). Without it difference quotients are
        used.
    circles : sequence of (int, int)
        Pairs of variables that are not normal but the cosine and the sine of a direction, uniform over the circle.
        Margins are defined off the circle, too, so that they have derivatives by these variables.
    """

    def __init__(
        self,
        dimension: int,
        margins: Callable[[Floats], Floats],
        gradients: Callable[[Floats], tuple[Floats, Floats]] | None = None,
        circles: Sequence[tuple[int, int]] = (),
    ) -> None:
        self.dimension = dimension
        self.circles = np.array(circles, dtype=np.intp).reshape(-1, 2)
        self.normals = np.setdiff1d(np.arange(dimension), self.circles)
        self.evaluations = 0
        self._margins = margins
        self._gradients = gradients

    def draw(self, rng: np.random.Generator, count: int, spread: float = 1.0) -> Floats:
        """Random points, shape (dimension, count): normal variables of this standard deviation, and directions."""
        u = np.where(self.is_normal[:, None], spread, 1.0) * rng.standard_normal((self.dimension, count))
        for pair in self.circles:
            length = np.linalg.norm(u[pair], axis=0)
            u[pair[0]] = np.where(length > 0, u[pair[0]], 1.0)
            u[pair] /= np.where(length > 0, length, 1.0)
        return u

    @property
    def is_normal(self) -> Flags:
        """Which variables are normal, shape (dimension,)."""
        return np.isin(np.arange(self.dimension), self.normals)

    def margins(self, u: Floats) -> Floats:
        """Margins at points `u` of shape (dimension, n): shape (limits, n)."""
        self.evaluations += u.shape[1]
        parts = [self._margins(u[:, k : k + POINTS_TOGETHER]) for k in range(0, u.shape[1], POINTS_TOGETHER)]
        return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)

    def gradients(self, u: Floats) -> tuple[Floats, Floats]:
        """Margins, shape (limits, n), and their derivatives, shape (limits, dimension, n)."""
        if self._gradients is not None:
            self.evaluations += u.shape[1]
            return self._gradients(u)
        return self.margins(u), slopes(self.margins, u, _MARGIN_STEP)


def slopes(function: Callable[[Floats], Floats], u: Floats, step: float) -> Floats:
    """Difference quotients of functions, from shape (dimension, n) to (rows, n): shape (rows, dimension, n)."""
    d, n = u.shape
    steps = step * np.eye(d)[:, :, None]
    points = np.concatenate([(u + way * steps).swapaxes(0, 1).reshape(d, d * n) for way in (1, -1)], axis=1)
    ahead, back = function(points).reshape(-1, 2, d, n).swapaxes(0, 1)
    return np.asarray((ahead - back) / (2 * step))


def failed(margins: Floats) -> Flags:
    """Which points fail, shape (n,), from margins of shape (limits, n)."""
    return np.asarray(~np.all(margins >= 0, axis=0))
