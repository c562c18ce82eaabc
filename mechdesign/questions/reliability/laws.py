"""Laws (distributions) of deviations from nominal, each declared once: schema, checks and computation follow from it.

Every law maps a standard normal variable onto a deviation, so that all methods share one space of independent standard
normal variables. [Rosenblatt, Remarks on a multivariate transformation, 1952.]

A study is read with this module, so that SciPy is imported where a law is computed, not at the top.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import Annotated, Any, ClassVar, Self

import numpy as np
import scipy

from mechdesign.ground.expressions import Number
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.study.text import fields

# Half the width of a tolerance in standard deviations of a normal law; `truncated_normal` is cut there [S2, eq. 5].
SIGMAS = 3.0


def normal_cdf(u: Floats | float) -> Floats:
    """Probability that a standard normal variable is below `u`."""
    return np.asarray(scipy.special.ndtr(u))


def normal_quantile(share: Floats | float) -> Floats:
    """Quantile of the standard normal law, at least one-dimensional."""
    return np.atleast_1d(scipy.special.ndtri(share))


def normal_within(radius: float, rng: np.random.Generator, out: Floats) -> None:
    """Fill with standard normal points, shape (dimension, count), drawn again where farther from zero than `radius`."""
    rng.standard_normal(out=out)
    outside = _outside(radius, out)
    while len(outside):
        again = rng.standard_normal((len(out), len(outside)))
        out[:, outside] = again
        outside = outside[_outside(radius, again)]


def _outside(radius: float, points: Floats) -> Ints:
    squared = points[0] * points[0]
    for row in points[1:]:
        squared += row * row
    return np.flatnonzero(squared > radius * radius)


@dataclass(frozen=True)
class Marginal(ABC):
    """The law of one deviation from its nominal value. For the first-order analysis its numbers may be arrays of poses.

    The tolerance [low, high] is the worst case; for unbounded laws three standard deviations to either side.
    """

    low: Number
    high: Number
    nominal: Number = 0.0

    # The word that a study names it by (empty where none does), and its meaning in a line.
    name: ClassVar[str] = ""
    meaning: ClassVar[str] = ""
    # Keys of a study that this law needs: fields of `Distribution` and of its own class, each a number or several.
    keys: ClassVar[tuple[str, ...]] = ()
    # Whether the value itself is positive; its nominal value must be positive then.
    positive: ClassVar[bool] = False
    # Whether it needs the two ends of a tolerance: a standard deviation alone does not give it.
    between_ends: ClassVar[bool] = False
    # Half the width of the tolerance over the standard deviation `sigma`.
    reach: ClassVar[float] = SIGMAS
    # Second and fourth central moment where `sigma` is 1.
    second: ClassVar[float] = 1.0
    fourth: ClassVar[float] = 3.0

    @property
    def numbers(self) -> tuple[Number, ...]:
        """All numbers that the law depends on."""
        own = (getattr(self, key) for key in self.keys)
        parts = (part if isinstance(part, tuple) else (part,) for part in own)
        return self.low, self.high, self.nominal, *chain.from_iterable(parts)

    def take(self, rows: Sequence[int] | Ints) -> Self:
        """The law at these poses."""

        def taken(value: Any) -> Any:
            return tuple(map(taken, value)) if isinstance(value, tuple) else at_rows(value, rows)

        return replace(self, **{key: taken(getattr(self, key)) for key in ("low", "high", "nominal", *self.keys)})

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

    def draw(self, rng: np.random.Generator, out: Floats) -> None:
        """Fill with independent deviations, shape (count,)."""
        rng.standard_normal(out=out)
        out[:] = self.at(out)

    @property
    def kinks(self) -> Floats:
        """Values of the standard normal variable between which `at` is smooth."""
        return np.zeros(0)

    @abstractmethod
    def at(self, u: Floats) -> Floats:
        """Deviations at values `u` of a standard normal variable, in the shape of `u`; increasing in `u`."""

    def from_ends(self, u: Floats, inward: Floats) -> Floats:
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


class Normal(Marginal):
    """Normal."""

    name = "normal"
    meaning = "normal; the tolerance is three standard deviations"

    def draw(self, rng: np.random.Generator, out: Floats) -> None:
        rng.standard_normal(out=out)
        out *= self.sigma
        if self.mean:
            out += self.mean

    def at(self, u: Floats) -> Floats:
        return np.asarray(self.mean + self.sigma * u)


# Part of the variance that a normal variable loses when its tails are cut at `SIGMAS`.
_TAIL = 2.0 * SIGMAS * math.exp(-0.5 * SIGMAS**2) / math.sqrt(2.0 * math.pi) / math.erf(SIGMAS / math.sqrt(2.0))


class TruncatedNormal(Marginal):
    """Normal, cut at three standard deviations of the uncut law: no deviation lies outside the tolerance."""

    name = "truncated_normal"
    meaning = "as normal, and cut at the ends of the tolerance"
    second = 1.0 - _TAIL
    fourth = 3.0 * second - SIGMAS**2 * _TAIL

    def draw(self, rng: np.random.Generator, out: Floats) -> None:
        normal_within(SIGMAS, rng, out[None])
        out *= self.sigma
        out += self.mean

    def at(self, u: Floats) -> Floats:
        # By the lower tail, where small probabilities keep their digits.
        tail = normal_cdf(-SIGMAS)
        below = scipy.special.ndtri(tail + normal_cdf(-np.abs(u)) * (1.0 - 2.0 * tail))
        return np.asarray(self.mean + self.sigma * np.copysign(below, u))


class Uniform(Marginal):
    """Uniform over the tolerance."""

    name = "uniform"
    meaning = "equally likely over the whole tolerance"
    reach = math.sqrt(3.0)
    fourth = 1.8

    def draw(self, rng: np.random.Generator, out: Floats) -> None:
        rng.random(out=out)
        out *= self.high - self.low
        out += self.low

    def at(self, u: Floats) -> Floats:
        return self.from_ends(u, (self.high - self.low) * normal_cdf(-np.abs(u)))


class Triangular(Marginal):
    """Triangular over the tolerance; the mode is the nominal value, or the end of the tolerance nearest to it."""

    name = "triangular"
    meaning = "over the tolerance, most likely at the nominal value"
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
        return normal_quantile((self.mode - self.low) / (self.high - self.low) if self.high > self.low else 0.5)

    def draw(self, rng: np.random.Generator, out: Floats) -> None:
        out[:] = self.low if self.high == self.low else rng.triangular(self.low, self.mode, self.high, len(out))

    def at(self, u: Floats) -> Floats:
        width, rise = self.high - self.low, self.mode - self.low
        below, above = normal_cdf(u), normal_cdf(-u)
        climb = self.low + np.sqrt(below * width * rise)
        fall = self.high - np.sqrt(above * width * (width - rise))
        return np.asarray(np.where(below * width < rise, climb, fall))


class Lognormal(Marginal):
    """nominal + deviation is lognormal, and positive."""

    name = "lognormal"
    meaning = "mean and deviation of normal; the value itself is lognormal and stays positive"
    positive = True

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
class Beta(Marginal):
    """Beta over the tolerance, with two shape parameters: equal ones are symmetric, (1, 1) is uniform."""

    name = "beta"
    meaning = "beta over the tolerance, with two shape parameters, 'shape'"
    keys = ("shape",)
    between_ends = True
    shape: tuple[Number, Number] = (1.0, 1.0)

    @property
    def moments(self) -> tuple[Number, Number, Number, Number]:
        a, b = self.shape
        n, width = a + b, self.high - self.low
        second = width**2 * a * b / (n * n * (n + 1.0))
        third = second**1.5 * 2.0 * (b - a) * np.sqrt((n + 1.0) / (a * b)) / (n + 2.0)
        excess = 6.0 * ((a - b) ** 2 * (n + 1.0) - a * b * (n + 2.0)) / (a * b * (n + 2.0) * (n + 3.0))
        return self.low + width * a / n, second, third, (3.0 + excess) * second**2

    def draw(self, rng: np.random.Generator, out: Floats) -> None:
        out[:] = self.low + (self.high - self.low) * rng.beta(*self.shape, len(out))

    def at(self, u: Floats) -> Floats:
        (a, b), width, tail = self.shape, self.high - self.low, normal_cdf(-np.abs(u))
        inward = width * np.where(u < 0, scipy.special.betaincinv(a, b, tail), scipy.special.betaincinv(b, a, tail))
        return self.from_ends(u, inward)


@dataclass(frozen=True)
class MeasuredLaw(Marginal):
    """The empirical law of measured deviations: the k-th smallest of n is the quantile (k - 1/2)/n.

    Quantiles between two values are interpolated; no deviation lies beyond the smallest or the largest. The values are
    stretched a little about their mean, so that the law has the standard deviation of the sample (with n - 1).
    """

    ordered: Floats = field(default_factory=lambda: np.zeros(1), compare=False)  # above the smallest

    @staticmethod
    def of(values: Floats, about: Number, nominal: Number) -> MeasuredLaw:
        """The law of the differences between measured values, which are not all the same, and the value `about`."""
        ordered, mean = np.sort(values), float(values.mean())
        ordered = mean + (ordered - mean) * values.std(ddof=1) / math.sqrt(_interpolated(ordered - mean, 2))
        least, most = float(ordered[0]), float(ordered[-1])
        return MeasuredLaw(least - about, most - about, nominal, ordered - least)

    @property
    def moments(self) -> tuple[Number, Number, Number, Number]:
        mean = float(self.ordered.mean())
        second, third, fourth = (_interpolated(self.ordered - mean, power) for power in (2, 3, 4))
        return self.low + mean, second, third, fourth

    @property
    def kinks(self) -> Floats:
        return normal_quantile(self._shares)

    def draw(self, rng: np.random.Generator, out: Floats) -> None:
        out[:] = self._quantile(rng.random(len(out)))

    def at(self, u: Floats) -> Floats:
        return self._quantile(normal_cdf(u))

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


# The laws that a study names, in the order of the schema.
_DECLARED: tuple[type[Marginal], ...] = (Normal, TruncatedNormal, Uniform, Triangular, Lognormal, Beta)
LAWS = {law.name: law for law in _DECLARED}


class Distribution(fields.Model):
    """The law that a study chooses, and the keys that only some laws have."""

    distribution: Annotated[str, fields.choice(LAWS, "distribution")] = Normal.name
    """Distribution of the deviations."""
    shape: (
        Annotated[tuple[fields.Positive, fields.Positive], fields.pair_of("two shape parameters such as [2, 5]")] | None
    ) = None
    """The two shape parameters of a beta distribution. Example: [2, 5]"""

    def faults(self) -> Iterator[str]:
        for key in [key for key in Distribution.model_fields if key != "distribution"]:
            if (key in LAWS[self.distribution].keys) != (getattr(self, key) is not None):
                owners = " or ".join(law.name for law in LAWS.values() if key in law.keys)
                example = self.said(key).examples[0]
                yield f"'distribution: {owners}' and its {key!r}, such as {example}, go together"
