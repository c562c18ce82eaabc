"""Laws of the places of pins in their holes, and of sliders in their guides, for a clearance of 1.

As the laws of deviations they map standard normal variables onto places.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from mechdesign.numerics.arrays import Floats
from mechdesign.questions.reliability.laws import SIGMAS, Marginal, Normal, TruncatedNormal, Uniform, normal_within


@dataclass(frozen=True)
class PinLaw:
    """Law of a pin's place in its hole for a radial clearance of 1, isotropic [S2, eqs. 6, 12, 13].

    Parameters
    ----------
    variance, fourth : float
        E[x^2] and E[x^4] of each coordinate.
    draw : callable
        Fills an array of shape (2, count) with places.
    stretch : callable
        Ratio of the pin's offset to the length of two standard normal variables, from half that length squared.
    """

    variance: float
    fourth: float
    draw: Callable[[np.random.Generator, Floats], None]
    stretch: Callable[[Floats], Floats]

    @property
    def mixed(self) -> float:
        """E[x^2 y^2]."""
        return self.fourth / 3.0

    def at(self, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        """The place, in the direction (u, v), at values of two independent standard normal variables."""
        ratio = self.stretch(0.5 * (u * u + v * v))
        return ratio * u, ratio * v


# Half the squared radius, in standard deviations, at which a normal pin of sigma 1/3 reaches the unit circle.
_CUT = 0.5 * SIGMAS**2
# Probability of the normal law outside the circle.
_OUTSIDE = math.exp(-_CUT)


def _normal(rng: np.random.Generator, out: Floats, cut: float = math.inf) -> None:
    """Normal places of sigma 1/3, drawn again where they are farther than `cut` standard deviations from the middle."""
    normal_within(cut, rng, out)
    out *= 1.0 / 3.0


def _turned(rng: np.random.Generator, out: Floats, *, inside: bool) -> None:
    """Places uniform in the disc, or on its rim."""
    radius = np.sqrt(rng.random(out.shape[1])) if inside else 1.0
    angle = rng.random(out.shape[1])
    angle *= 2.0 * np.pi
    out[:] = radius * np.cos(angle), radius * np.sin(angle)


def _stretch(squared: Callable[[Floats], Floats]) -> Callable[[Floats], Floats]:
    """`PinLaw.stretch` from the squared offset as a function of half the squared length, which is kept above 0."""

    def ratio(half: Floats) -> Floats:
        half = np.maximum(half, 1e-290)
        return np.asarray(np.sqrt(squared(half) / (2.0 * half)))

    return ratio


def _squared_in_disc(half: Floats) -> Floats:
    # P(offset > s) = (exp(-9 s^2/2) - outside)/(1 - outside) is that of the Rayleigh variable, exp(-half).
    return -np.log1p((1.0 - _OUTSIDE) * np.expm1(-half)) / _CUT


# Mean and mean square of the exponential law cut at _CUT: of the squared offset in units of 1/_CUT.
_FIRST = (1.0 - (1.0 + _CUT) * _OUTSIDE) / (1.0 - _OUTSIDE)
_SECOND = (2.0 - (_CUT**2 + 2.0 * _CUT + 2.0) * _OUTSIDE) / (1.0 - _OUTSIDE)

# The variance of `normal_in_disc` is that of the cut law; S2 draws from it but uses the uncut variance in its formula.
PIN_LAWS: Mapping[str, PinLaw] = {
    "normal": PinLaw(1.0 / 9.0, 3.0 / 81.0, _normal, lambda half: np.full_like(half, 1.0 / 3.0)),
    "normal_in_disc": PinLaw(
        0.5 * _FIRST / _CUT, 0.375 * _SECOND / _CUT**2, partial(_normal, cut=SIGMAS), _stretch(_squared_in_disc)
    ),
    "uniform": PinLaw(1 / 4, 1 / 8, partial(_turned, inside=True), _stretch(lambda half: -np.expm1(-half))),
    "contact": PinLaw(1 / 2, 3 / 8, partial(_turned, inside=False), _stretch(np.ones_like)),
}


class Wall(Marginal):
    """At the low or the high end of the tolerance, each with probability 1/2."""

    reach = 1.0
    fourth = 1.0

    def at(self, u: Floats) -> Floats:
        return np.where(u < 0, self.low, self.high)


@dataclass(frozen=True)
class SlideLaw:
    """Law of the two independent ends of a slider in its guide, for a clearance of 1 on either side."""

    end: Marginal

    @property
    def variance(self) -> float:
        """Variance of each end."""
        return float(self.end.moments[1])

    @property
    def fourth(self) -> float:
        """E[x^4] of each end."""
        return float(self.end.moments[3])

    @property
    def mixed(self) -> float:
        """E[x^2 y^2] of both ends."""
        return self.variance**2

    def draw(self, rng: np.random.Generator, out: Floats) -> None:
        """Fill with both ends, shape (2, count)."""
        for end in out:
            self.end.draw(rng, end)

    def at(self, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Both ends at values of two independent standard normal variables."""
        return self.end.at(u), self.end.at(v)


SLIDE_LAWS: Mapping[str, SlideLaw] = {
    "normal": SlideLaw(Normal(-1.0, 1.0)),
    "normal_in_disc": SlideLaw(TruncatedNormal(-1.0, 1.0)),
    "uniform": SlideLaw(Uniform(-1.0, 1.0)),
    "contact": SlideLaw(Wall(-1.0, 1.0)),
}
