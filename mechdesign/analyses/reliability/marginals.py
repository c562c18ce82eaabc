"""Distributions of one deviation from nominal: moments, quantiles and random draws.

Every law maps a standard normal variable onto its deviation, so that all methods share one space of independent
standard normal variables. [Rosenblatt, Remarks on a multivariate transformation, 1952.]
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from mechdesign.numerics.arrays import Floats
from mechdesign.study.schema.reliability import Dimension

# A tolerance is three standard deviations of a normal law, which `truncated_normal` is cut at [S2, eq. 5].
SIGMAS = 3.0


class Marginal(ABC):
    """The law of one deviation from its nominal value."""

    # Half the width of the tolerance in standard deviations.
    reach = SIGMAS

    @classmethod
    @abstractmethod
    def within(cls, low: float, high: float, nominal: float) -> Self:
        """The law that a tolerance of these deviations means; what is lognormal is nominal + deviation."""

    @property
    @abstractmethod
    def moments(self) -> tuple[float, float, float, float]:
        """Mean, and second to fourth central moment."""

    @property
    @abstractmethod
    def ends(self) -> tuple[float, float]:
        """Lowest and highest deviation that a worst case counts with: of unbounded laws three sigma."""

    @abstractmethod
    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        """Independent deviations, shape (count,)."""

    @abstractmethod
    def at(self, u: Floats) -> Floats:
        """Deviations at values of a standard normal variable, increasing, in the shape of `u`."""

    @abstractmethod
    def widened(self, factor: float) -> Self:
        """The law of a tolerance as many times as wide, about the same middle."""


def marginal(spread: Dimension, nominal: float, factor: float = 1.0) -> Marginal:
    """The law that a study gives.

    Parameters
    ----------
    spread : Dimension
        Tolerance or sigma, and distribution; in the study's units.
    nominal : float
        Nominal value in the core's units.
    factor : float
        The core's units in one of the study's.
    """
    law = LAWS[spread.distribution]
    if spread.sigma is not None:
        half = law.reach * spread.sigma
        return law.within(-factor * half, factor * half, nominal)
    assert spread.tolerance is not None
    low, high = spread.tolerance
    return law.within(factor * low, factor * high, nominal)


@dataclass(frozen=True)
class _Bell(Marginal):
    """Of this mean; a tolerance is three standard deviations `sigma` about its middle."""

    mean: float
    sigma: float

    @classmethod
    def within(cls, low: float, high: float, nominal: float) -> Self:
        return cls(0.5 * (low + high), 0.5 * (high - low) / SIGMAS)

    @property
    def ends(self) -> tuple[float, float]:
        return self.mean - SIGMAS * self.sigma, self.mean + SIGMAS * self.sigma

    def widened(self, factor: float) -> Self:
        return replace(self, sigma=factor * self.sigma)


@dataclass(frozen=True)
class _Bounded(Marginal):
    """Between two ends."""

    low: float
    high: float

    @classmethod
    def within(cls, low: float, high: float, nominal: float) -> Self:
        return cls(low, high)

    @property
    def ends(self) -> tuple[float, float]:
        return self.low, self.high

    def widened(self, factor: float) -> Self:
        middle, half = 0.5 * (self.low + self.high), 0.5 * factor * (self.high - self.low)
        return replace(self, low=middle - half, high=middle + half)


class Normal(_Bell):
    """Normal."""

    @property
    def moments(self) -> tuple[float, float, float, float]:
        return self.mean, self.sigma**2, 0.0, 3.0 * self.sigma**4

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        return self.mean + self.sigma * rng.standard_normal(count)

    def at(self, u: Floats) -> Floats:
        return np.asarray(self.mean + self.sigma * u)


class TruncatedNormal(_Bell):
    """Normal, cut at three standard deviations `sigma` of what is cut: nothing lies outside the tolerance."""

    @property
    def moments(self) -> tuple[float, float, float, float]:
        tail = 2.0 * SIGMAS * math.exp(-0.5 * SIGMAS**2) / math.sqrt(2.0 * math.pi)
        tail /= math.erf(SIGMAS / math.sqrt(2.0))
        second = 1.0 - tail
        return self.mean, self.sigma**2 * second, 0.0, self.sigma**4 * (3.0 * second - SIGMAS**2 * tail)

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        drawn = rng.standard_normal(count)
        outside = np.flatnonzero(np.abs(drawn) > SIGMAS)
        while len(outside):
            again = rng.standard_normal(len(outside))
            drawn[outside] = again
            outside = outside[np.abs(again) > SIGMAS]
        return np.asarray(self.mean + self.sigma * drawn)

    def at(self, u: Floats) -> Floats:
        from scipy.special import ndtr, ndtri

        # In the lower tail, where small probabilities keep their digits.
        tail = ndtr(-SIGMAS)
        below = ndtri(tail + ndtr(-np.abs(u)) * (1.0 - 2.0 * tail))
        return np.asarray(self.mean + self.sigma * np.copysign(below, u))


class Uniform(_Bounded):
    """Uniform between the ends."""

    reach = math.sqrt(3.0)

    @property
    def moments(self) -> tuple[float, float, float, float]:
        half = 0.5 * (self.high - self.low)
        return 0.5 * (self.low + self.high), half**2 / 3.0, 0.0, half**4 / 5.0

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        return self.low + (self.high - self.low) * rng.random(count)

    def at(self, u: Floats) -> Floats:
        from scipy.special import ndtr

        inward = (self.high - self.low) * ndtr(-np.abs(u))
        return np.asarray(np.where(u < 0, self.low + inward, self.high - inward))


class Triangular(_Bounded):
    """Triangular between the ends, most likely at the nominal value where the tolerance has it."""

    reach = math.sqrt(6.0)

    @property
    def mode(self) -> float:
        """The deviation that is most likely."""
        return min(max(0.0, self.low), self.high)

    @property
    def moments(self) -> tuple[float, float, float, float]:
        a, b, c = self.low, self.high, self.mode
        second = (a * a + b * b + c * c - a * b - a * c - b * c) / 18.0
        third = (a + b - 2 * c) * (2 * a - b - c) * (a - 2 * b + c) / 270.0
        return (a + b + c) / 3.0, second, third, 2.4 * second**2

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
class Lognormal(_Bell):
    """nominal + deviation is lognormal, and positive; `mean` and `sigma` are the deviation's."""

    nominal: float

    @classmethod
    def within(cls, low: float, high: float, nominal: float) -> Self:
        return cls(0.5 * (low + high), 0.5 * (high - low) / SIGMAS, nominal)

    @property
    def _size(self) -> float:
        """Mean of what is lognormal."""
        return self.nominal + self.mean

    @property
    def moments(self) -> tuple[float, float, float, float]:
        second = self.sigma**2
        w = 1.0 + (self.sigma / self._size) ** 2
        third = second**1.5 * (w + 2.0) * math.sqrt(w - 1.0)
        return self.mean, second, third, second**2 * (w**4 + 2 * w**3 + 3 * w**2 - 3.0)

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        return self.at(rng.standard_normal(count))

    def at(self, u: Floats) -> Floats:
        # Standard deviation of the logarithm.
        s = math.sqrt(math.log1p((self.sigma / self._size) ** 2))
        return np.asarray(self.mean + self._size * np.expm1(s * u - 0.5 * s * s))


LAWS: dict[str, type[Marginal]] = {
    "normal": Normal,
    "truncated_normal": TruncatedNormal,
    "uniform": Uniform,
    "triangular": Triangular,
    "lognormal": Lognormal,
}
