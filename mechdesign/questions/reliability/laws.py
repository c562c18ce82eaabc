"""Laws (distributions) of deviations from nominal.

Every law maps a standard normal variable onto a deviation, so that all methods share one space of independent standard
normal variables. [Rosenblatt, Remarks on a multivariate transformation, 1952.]
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Self

import numpy as np

from mechdesign.expressions import Number
from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.questions.reliability.schema.variation import Dimension

# Half the width of a tolerance in standard deviations of a normal law; `truncated_normal` is cut there [S2, eq. 5].
SIGMAS = 3.0


def _normal_cdf(u: Floats | float) -> Floats:
    """Probability that a standard normal variable is below `u`."""
    # Imported here because the moments of laws need no SciPy, and its import takes long.
    from scipy.special import ndtr

    return np.asarray(ndtr(u))


def _normal_quantile(share: Floats | float) -> Floats:
    """Quantile of the standard normal law, at least one-dimensional."""
    from scipy.special import ndtri

    return np.atleast_1d(ndtri(share))


def normal_within(radius: float, rng: np.random.Generator, dimension: int, count: int) -> Floats:
    """Standard normal points, shape (dimension, count), drawn again where they are farther from zero than `radius`."""
    points = rng.standard_normal((dimension, count))
    outside = np.flatnonzero((points * points).sum(axis=0) > radius * radius)
    while len(outside):
        again = rng.standard_normal((dimension, len(outside)))
        points[:, outside] = again
        outside = outside[(again * again).sum(axis=0) > radius * radius]
    return points


@dataclass(frozen=True)
class Marginal(ABC):
    """The law of one deviation from its nominal value. For the first-order analysis its numbers may be arrays of poses.

    The tolerance [low, high] is the worst case; for unbounded laws three standard deviations to either side.
    """

    low: Number
    high: Number
    nominal: Number = 0.0

    # Half the width of the tolerance in standard deviations `sigma`.
    reach: ClassVar[float] = SIGMAS
    # Second and fourth central moment where `sigma` is 1.
    second: ClassVar[float] = 1.0
    fourth: ClassVar[float] = 3.0

    @property
    def numbers(self) -> tuple[Number, ...]:
        """All numbers that the law depends on."""
        return self.low, self.high, self.nominal

    def take(self, rows: Sequence[int] | Ints) -> Self:
        """The law at these poses."""
        return replace(
            self, low=at_rows(self.low, rows), high=at_rows(self.high, rows), nominal=at_rows(self.nominal, rows)
        )

    @property
    def mean(self) -> Number:
        """The middle of the tolerance; the mean of a law that may be skewed is in `moments`."""
        return 0.5 * (self.low + self.high)

    @property
    def sigma(self) -> Number:
        """Standard deviation, of a truncated law before the cut; that of a law that may be skewed is in `moments`."""
        return 0.5 * (self.high - self.low) / self.reach

    @property
    def moments(self) -> tuple[Number, Number, Number, Number]:
        """Mean, and second to fourth central moment."""
        return self.mean, self.second * self.sigma**2, 0.0, self.fourth * self.sigma**4

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        """Independent deviations, shape (count,)."""
        return self.at(rng.standard_normal(count))

    @property
    def kinks(self) -> Floats:
        """Values of the standard normal variable between which `at` is smooth."""
        return np.zeros(0)

    @abstractmethod
    def at(self, u: Floats) -> Floats:
        """Deviations at values `u` of a standard normal variable, in the shape of `u`; increasing in `u`."""

    def _from_ends(self, u: Floats, inward: Floats) -> Floats:
        """Deviations at a distance `inward` from the end of the tolerance on the side of `u`, to full precision."""
        return np.asarray(np.where(u < 0, self.low + inward, self.high - inward))

    def widened(self, factor: Number) -> Self:
        """The law with its tolerance times a factor, about the same middle."""
        half = 0.5 * factor * (self.high - self.low)
        return replace(self, low=self.mean - half, high=self.mean + half)

    def scaled(self, factor: Number) -> Self:
        """The law with deviations and nominal value times a factor."""
        return replace(self, low=factor * self.low, high=factor * self.high, nominal=factor * self.nominal)


def at_rows(value: Number, rows: Any) -> Number:
    """A number at these poses (an index of the array of poses); the number itself where it is the same at all poses."""
    return value if isinstance(value, float | int) or np.ndim(value) == 0 else np.asarray(value)[rows]


def marginal(spread: Dimension, nominal: Number, factor: float = 1.0) -> Marginal:
    """The law of a deviation that a study gives in its units.

    `nominal` is in the core's units (radians, lengths), and `factor` of these are one unit of the study.

    Raises
    ------
    ToleranceClassError
        If the tolerance class does not cover the nominal value.
    """
    law = LAWS[spread.distribution]
    low, high = spread.ends(nominal)
    if spread.sigma is not None:
        low, high = -law.reach * spread.sigma, law.reach * spread.sigma
    if spread.shape is not None:
        return Beta(factor * low, factor * high, nominal, spread.shape)
    return law(factor * low, factor * high, nominal)


class Normal(Marginal):
    """Normal."""

    def at(self, u: Floats) -> Floats:
        return np.asarray(self.mean + self.sigma * u)


# Part of the variance that a normal variable loses when its tails are cut at `SIGMAS`.
_TAIL = 2.0 * SIGMAS * math.exp(-0.5 * SIGMAS**2) / math.sqrt(2.0 * math.pi) / math.erf(SIGMAS / math.sqrt(2.0))


class TruncatedNormal(Marginal):
    """Normal, cut at three standard deviations of the uncut law: no deviation lies outside the tolerance."""

    second = 1.0 - _TAIL
    fourth = 3.0 * second - SIGMAS**2 * _TAIL

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        return np.asarray(self.mean + self.sigma * normal_within(SIGMAS, rng, 1, count)[0])

    def at(self, u: Floats) -> Floats:
        from scipy.special import ndtri

        # By the lower tail, where small probabilities keep their digits.
        tail = _normal_cdf(-SIGMAS)
        below = ndtri(tail + _normal_cdf(-np.abs(u)) * (1.0 - 2.0 * tail))
        return np.asarray(self.mean + self.sigma * np.copysign(below, u))


class Uniform(Marginal):
    """Uniform over the tolerance."""

    reach = math.sqrt(3.0)
    fourth = 1.8

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        return self.low + (self.high - self.low) * rng.random(count)

    def at(self, u: Floats) -> Floats:
        return self._from_ends(u, (self.high - self.low) * _normal_cdf(-np.abs(u)))


class Triangular(Marginal):
    """Triangular over the tolerance; the mode is the nominal value, or the end of the tolerance nearest to it."""

    reach = math.sqrt(6.0)

    @property
    def mode(self) -> Number:
        """The most likely deviation."""
        return np.minimum(np.maximum(0.0, self.low), self.high)

    @property
    def moments(self) -> tuple[Number, Number, Number, Number]:
        a, b, c = self.low, self.high, self.mode
        second = (a * a + b * b + c * c - a * b - a * c - b * c) / 18.0
        third = (a + b - 2 * c) * (2 * a - b - c) * (a - 2 * b + c) / 270.0
        return (a + b + c) / 3.0, second, third, 2.4 * second**2

    @property
    def kinks(self) -> Floats:
        return _normal_quantile((self.mode - self.low) / (self.high - self.low) if self.high > self.low else 0.5)

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        if self.high == self.low:
            return np.full(count, self.low)
        return rng.triangular(self.low, self.mode, self.high, count)

    def at(self, u: Floats) -> Floats:
        width, rise = self.high - self.low, self.mode - self.low
        below, above = _normal_cdf(u), _normal_cdf(-u)
        climb = self.low + np.sqrt(below * width * rise)
        fall = self.high - np.sqrt(above * width * (width - rise))
        return np.asarray(np.where(below * width < rise, climb, fall))


class Lognormal(Marginal):
    """nominal + deviation is lognormal, and positive."""

    @property
    def moments(self) -> tuple[Number, Number, Number, Number]:
        second = self.sigma**2
        w = 1.0 + second / (self.nominal + self.mean) ** 2
        third = second**1.5 * (w + 2.0) * np.sqrt(w - 1.0)
        return self.mean, second, third, second**2 * (w**4 + 2 * w**3 + 3 * w**2 - 3.0)

    def at(self, u: Floats) -> Floats:
        size = self.nominal + self.mean
        # Standard deviation of the logarithm.
        s = math.sqrt(math.log1p((self.sigma / size) ** 2))
        return np.asarray(self.mean + size * np.expm1(s * u - 0.5 * s * s))


@dataclass(frozen=True)
class _OfFit(Marginal):
    """Hole minus shaft, both of the same law over their tolerances; `hole` is the hole's share of the sum of both."""

    hole: float = 0.5

    @property
    def sigma(self) -> Number:
        return super().sigma * math.hypot(self.hole, 1.0 - self.hole)


class NormalFit(_OfFit, Normal):
    """Clearance of a fit whose hole and shaft are normal."""


class UniformFit(_OfFit):
    """Clearance of a fit whose hole and shaft are uniform: trapezoidal."""

    reach = Uniform.reach

    @property
    def moments(self) -> tuple[Number, Number, Number, Number]:
        hole, shaft = (0.5 * (self.high - self.low) * part / self.reach for part in (self.hole, 1.0 - self.hole))
        return self.mean, self.sigma**2, 0.0, Uniform.fourth * (hole**4 + shaft**4) + 6.0 * (hole * shaft) ** 2

    @property
    def kinks(self) -> Floats:
        edge = 0.5 * min(self.hole, 1.0 - self.hole) / max(self.hole, 1.0 - self.hole)
        return _normal_quantile(np.array([edge, 1.0 - edge]))

    def at(self, u: Floats) -> Floats:
        width, wider, narrower = self.high - self.low, max(self.hole, 1.0 - self.hole), min(self.hole, 1.0 - self.hole)
        tail = _normal_cdf(-np.abs(u))
        rising = np.sqrt(2.0 * wider * narrower * tail)
        inward = width * np.where(2.0 * wider * tail < narrower, rising, 0.5 * narrower + wider * tail)
        return self._from_ends(u, inward)


def fit_law(distribution: str, hole: float, shaft: float, nominal: float) -> Marginal:
    """Law of a radial clearance about its mean, from half the diameter tolerances of the hole and the shaft."""
    law = NormalFit if distribution == "normal" else UniformFit
    reach = 0.5 * (hole + shaft)
    return law(-reach, reach, nominal, hole / (hole + shaft))


@dataclass(frozen=True)
class Beta(Marginal):
    """Beta over the tolerance, with two shape parameters: equal ones are symmetric, (1, 1) is uniform."""

    shape: tuple[Number, Number] = (1.0, 1.0)

    @property
    def numbers(self) -> tuple[Number, ...]:
        return *super().numbers, *self.shape

    def take(self, rows: Sequence[int] | Ints) -> Self:
        a, b = self.shape
        return replace(super().take(rows), shape=(at_rows(a, rows), at_rows(b, rows)))

    @property
    def moments(self) -> tuple[Number, Number, Number, Number]:
        a, b = self.shape
        n, width = a + b, self.high - self.low
        second = width**2 * a * b / (n * n * (n + 1.0))
        third = second**1.5 * 2.0 * (b - a) * np.sqrt((n + 1.0) / (a * b)) / (n + 2.0)
        excess = 6.0 * ((a - b) ** 2 * (n + 1.0) - a * b * (n + 2.0)) / (a * b * (n + 2.0) * (n + 3.0))
        return self.low + width * a / n, second, third, (3.0 + excess) * second**2

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        return self.low + (self.high - self.low) * rng.beta(*self.shape, count)

    def at(self, u: Floats) -> Floats:
        from scipy.special import betaincinv

        (a, b), width, tail = self.shape, self.high - self.low, _normal_cdf(-np.abs(u))
        inward = width * np.where(u < 0, betaincinv(a, b, tail), betaincinv(b, a, tail))
        return self._from_ends(u, inward)


@dataclass(frozen=True)
class Measured(Marginal):
    """The empirical law of measured deviations: the k-th smallest of n is the quantile (k - 1/2)/n.

    Quantiles between two values are interpolated; no deviation lies beyond the smallest or the largest. The values are
    stretched a little about their mean, so that the law has the standard deviation of the sample (with n - 1).
    """

    ordered: Floats = field(default_factory=lambda: np.zeros(1), compare=False)  # above the smallest

    @staticmethod
    def of(values: Floats, about: Number, nominal: Number) -> Measured:
        """The law of the differences between measured values, which are not all the same, and the value `about`."""
        ordered, mean = np.sort(values), float(values.mean())
        ordered = mean + (ordered - mean) * values.std(ddof=1) / math.sqrt(_interpolated(ordered - mean, 2))
        least, most = float(ordered[0]), float(ordered[-1])
        return Measured(least - about, most - about, nominal, ordered - least)

    @property
    def moments(self) -> tuple[Number, Number, Number, Number]:
        mean = float(self.ordered.mean())
        second, third, fourth = (_interpolated(self.ordered - mean, power) for power in (2, 3, 4))
        return self.low + mean, second, third, fourth

    @property
    def kinks(self) -> Floats:
        return _normal_quantile(self._shares)

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        return self._quantile(rng.random(count))

    def at(self, u: Floats) -> Floats:
        return self._quantile(_normal_cdf(u))

    def _quantile(self, share: Floats) -> Floats:
        return np.asarray(self.low + np.interp(share, self._shares, self.ordered))

    @property
    def _shares(self) -> Floats:
        """Probability below each value, shape (n,)."""
        return np.asarray((np.arange(len(self.ordered)) + 0.5) / len(self.ordered))


def _interpolated(ordered: Floats, power: int) -> float:
    """Moment E[x^power] of a variable with these quantiles at (k - 1/2)/n, linear between them."""
    low, high = ordered[:-1], ordered[1:]
    between = sum((low**k * high ** (power - k) for k in range(power + 1)), start=np.zeros(len(low))) / (power + 1)
    return float(between.sum() + 0.5 * (ordered[0] ** power + ordered[-1] ** power)) / len(ordered)


LAWS: dict[str, type[Marginal]] = {
    "normal": Normal,
    "truncated_normal": TruncatedNormal,
    "uniform": Uniform,
    "triangular": Triangular,
    "lognormal": Lognormal,
    "beta": Beta,
}
