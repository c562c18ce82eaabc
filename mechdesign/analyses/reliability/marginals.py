"""Distributions of one deviation from nominal: moments, quantiles and random draws.

Every law maps a standard normal variable onto its deviation, so that all methods share one space of independent
standard normal variables. [Rosenblatt, Remarks on a multivariate transformation, 1952.]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mechdesign.numerics.arrays import Floats
from mechdesign.study.schema.reliability import Spread

# A tolerance is three standard deviations of a normal law, which `truncated_normal` is cut at [S2, eq. 5].
SIGMAS = 3.0


class Marginal(Protocol):
    """The law of one deviation from its nominal value."""

    @property
    def moments(self) -> tuple[float, float, float, float]:
        """Mean, and second to fourth central moment."""

    @property
    def ends(self) -> tuple[float, float]:
        """Lowest and highest deviation that a worst case counts with: of unbounded laws three sigma."""

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        """Independent deviations, shape (count,)."""

    def at(self, u: Floats) -> Floats:
        """Deviations at values of a standard normal variable, increasing, in the shape of `u`."""


def marginal(spread: Spread, nominal: float, factor: float = 1.0) -> Marginal:
    """The law that a study gives.

    Parameters
    ----------
    spread : Spread
        Tolerance or sigma, and distribution; in the study's units.
    nominal : float
        Nominal value in the core's units: what is lognormal is nominal + deviation.
    factor : float
        The core's units in one of the study's.
    """
    if spread.sigma is not None:
        middle, sigma = 0.0, factor * spread.sigma
        half = sigma * HALF_WIDTHS.get(spread.distribution, SIGMAS)
        low, high = -half, half
    else:
        assert spread.tolerance is not None
        low, high = (factor * end for end in spread.tolerance)
        middle, sigma = 0.5 * (low + high), 0.5 * (high - low) / SIGMAS
    if spread.distribution == "uniform":
        return Uniform(low, high)
    if spread.distribution == "triangular":
        return Triangular(low, min(max(0.0, low), high), high)
    if spread.distribution == "truncated_normal":
        return TruncatedNormal(middle, sigma)
    if spread.distribution == "lognormal":
        return Lognormal(nominal, nominal + middle, sigma)
    return Normal(middle, sigma)


@dataclass(frozen=True)
class Normal:
    """Normal with this mean and standard deviation; a tolerance [low, high] is three sigma about its middle."""

    mean: float
    sigma: float

    @property
    def moments(self) -> tuple[float, float, float, float]:
        return self.mean, self.sigma**2, 0.0, 3.0 * self.sigma**4

    @property
    def ends(self) -> tuple[float, float]:
        return self.mean - SIGMAS * self.sigma, self.mean + SIGMAS * self.sigma

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        return _shifted(rng.standard_normal(count), self.sigma, self.mean)

    def at(self, u: Floats) -> Floats:
        return np.asarray(self.mean + self.sigma * u)


@dataclass(frozen=True)
class TruncatedNormal:
    """Normal, cut at three standard deviations `sigma` of what is cut: nothing lies outside the tolerance."""

    mean: float
    sigma: float

    @property
    def moments(self) -> tuple[float, float, float, float]:
        tail = 2.0 * SIGMAS * math.exp(-0.5 * SIGMAS**2) / math.sqrt(2.0 * math.pi)
        tail /= math.erf(SIGMAS / math.sqrt(2.0))
        second = 1.0 - tail
        return self.mean, self.sigma**2 * second, 0.0, self.sigma**4 * (3.0 * second - SIGMAS**2 * tail)

    @property
    def ends(self) -> tuple[float, float]:
        return self.mean - SIGMAS * self.sigma, self.mean + SIGMAS * self.sigma

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        drawn = rng.standard_normal(count)
        outside = np.flatnonzero(np.abs(drawn) > SIGMAS)
        while len(outside):
            again = rng.standard_normal(len(outside))
            drawn[outside] = again
            outside = outside[np.abs(again) > SIGMAS]
        return _shifted(drawn, self.sigma, self.mean)

    def at(self, u: Floats) -> Floats:
        from scipy.special import ndtr, ndtri

        # In the lower tail, where small probabilities keep their digits.
        tail = ndtr(-SIGMAS)
        below = ndtri(tail + ndtr(-np.abs(u)) * (1.0 - 2.0 * tail))
        return np.asarray(self.mean + self.sigma * np.copysign(below, u))


@dataclass(frozen=True)
class Uniform:
    """Uniform between two ends."""

    low: float
    high: float

    @property
    def moments(self) -> tuple[float, float, float, float]:
        half = 0.5 * (self.high - self.low)
        return 0.5 * (self.low + self.high), half**2 / 3.0, 0.0, half**4 / 5.0

    @property
    def ends(self) -> tuple[float, float]:
        return self.low, self.high

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        return _shifted(rng.random(count), self.high - self.low, self.low)

    def at(self, u: Floats) -> Floats:
        from scipy.special import ndtr

        inward = (self.high - self.low) * ndtr(-np.abs(u))
        return np.asarray(np.where(u < 0, self.low + inward, self.high - inward))


@dataclass(frozen=True)
class Triangular:
    """Triangular between two ends, most likely at `mode`: at the nominal value where the tolerance has it."""

    low: float
    mode: float
    high: float

    @property
    def moments(self) -> tuple[float, float, float, float]:
        a, b, c = self.low, self.high, self.mode
        second = (a * a + b * b + c * c - a * b - a * c - b * c) / 18.0
        third = (a + b - 2 * c) * (2 * a - b - c) * (a - 2 * b + c) / 270.0
        return (a + b + c) / 3.0, second, third, 2.4 * second**2

    @property
    def ends(self) -> tuple[float, float]:
        return self.low, self.high

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        if self.high == self.low:
            return np.full(count, self.low)
        return rng.triangular(self.low, self.mode, self.high, count)

    def at(self, u: Floats) -> Floats:
        from scipy.special import ndtr

        width, rise = self.high - self.low, self.mode - self.low
        below, above = ndtr(u), ndtr(-u)
        climb = self.low + np.sqrt(below * width * rise)
        fall = self.high - np.sqrt(above * width * (width - rise))
        return np.asarray(np.where(below * width < rise, climb, fall))


@dataclass(frozen=True)
class Lognormal:
    """nominal + deviation is lognormal, with this mean and standard deviation; both positive."""

    nominal: float
    mean: float
    sigma: float

    @property
    def _shape(self) -> float:
        """Standard deviation of the logarithm."""
        return math.sqrt(math.log1p((self.sigma / self.mean) ** 2))

    @property
    def moments(self) -> tuple[float, float, float, float]:
        second = self.sigma**2
        w = 1.0 + (self.sigma / self.mean) ** 2
        third = second**1.5 * (w + 2.0) * math.sqrt(w - 1.0)
        return self.mean - self.nominal, second, third, second**2 * (w**4 + 2 * w**3 + 3 * w**2 - 3.0)

    @property
    def ends(self) -> tuple[float, float]:
        middle = self.mean - self.nominal
        return middle - SIGMAS * self.sigma, middle + SIGMAS * self.sigma

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        return self.at(rng.standard_normal(count))

    def at(self, u: Floats) -> Floats:
        s = self._shape
        return np.asarray(self.mean - self.nominal + self.mean * np.expm1(s * u - 0.5 * s * s))


# Half the width of a bounded law, in its standard deviations.
HALF_WIDTHS = {"uniform": math.sqrt(3.0), "triangular": math.sqrt(6.0)}


def _shifted(drawn: Floats, factor: float, offset: float) -> Floats:
    drawn *= factor
    if offset:
        drawn += offset
    return drawn
