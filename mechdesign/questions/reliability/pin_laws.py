"""Laws of the places of pins in their holes, and of sliders in their guides, for a clearance of 1.

As the laws of deviations they map standard normal variables onto places.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.questions.reliability.laws import SIGMAS, Marginal, Normal, TruncatedNormal, Uniform, normal_within


@dataclass(frozen=True)
class PlaceLaw:
    """Law of the place of a pin in its hole, or of both ends of a slider in its guide, for a clearance of 1.

    Parameters
    ----------
    variance, fourth, mixed : float
        E[x^2] and E[x^4] of each coordinate, and E[x^2 y^2].
    draw : callable
        Fills an array of shape (2, count) with places.
    at : callable
        Both coordinates at values of two independent standard normal variables.
    """

    variance: float
    fourth: float
    mixed: float
    draw: Callable[[np.random.Generator, Floats], None]
    at: Callable[[Floats, Floats], tuple[Floats, Floats]]


def _pin(
    variance: float, fourth: float, draw: Callable[[np.random.Generator, Floats], None],
    squared: Callable[[Floats], Floats],
) -> PlaceLaw:  # fmt: skip
    """Law of a pin's place, isotropic [S2, eqs. 6, 12, 13].

    `squared` is the squared offset as a function of half the squared length of two standard normal variables, which
    give its direction.
    """

    def at(u: Floats, v: Floats) -> tuple[Floats, Floats]:
        half = np.maximum(0.5 * (u * u + v * v), 1e-290)
        ratio = np.sqrt(squared(half) / (2.0 * half))
        return ratio * u, ratio * v

    return PlaceLaw(variance, fourth, fourth / 3.0, draw, at)


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


def _squared_in_disc(half: Floats) -> Floats:
    # P(offset > s) = (exp(-9 s^2/2) - outside)/(1 - outside) is that of the Rayleigh variable, exp(-half).
    return -np.log1p((1.0 - _OUTSIDE) * np.expm1(-half)) / _CUT


# Mean and mean square of the exponential law cut at _CUT: of the squared offset in units of 1/_CUT.
_FIRST = (1.0 - (1.0 + _CUT) * _OUTSIDE) / (1.0 - _OUTSIDE)
_SECOND = (2.0 - (_CUT**2 + 2.0 * _CUT + 2.0) * _OUTSIDE) / (1.0 - _OUTSIDE)

# The variance of `normal_in_disc` is that of the cut law; S2 draws from it but uses the uncut variance in its formula.
PIN_LAWS: Mapping[str, PlaceLaw] = {
    "normal": _pin(1.0 / 9.0, 3.0 / 81.0, _normal, lambda half: half / 4.5),
    "normal_in_disc": _pin(
        0.5 * _FIRST / _CUT, 0.375 * _SECOND / _CUT**2, partial(_normal, cut=SIGMAS), _squared_in_disc
    ),
    "uniform": _pin(1 / 4, 1 / 8, partial(_turned, inside=True), lambda half: -np.expm1(-half)),
    "contact": _pin(1 / 2, 3 / 8, partial(_turned, inside=False), np.ones_like),
}


class Wall(Marginal):
    """At the low or the high end of the tolerance, each with probability 1/2."""

    reach = 1.0
    fourth = 1.0

    def at(self, u: Floats) -> Floats:
        return np.where(u < 0, self.low, self.high)


def _ends(end: Marginal) -> PlaceLaw:
    """Law of the two ends of a slider, each independent with this law."""

    def draw(rng: np.random.Generator, out: Floats) -> None:
        for row in out:
            end.draw(rng, row)

    _, variance, _, fourth = map(float, end.moments)
    return PlaceLaw(variance, fourth, variance**2, draw, lambda u, v: (end.at(u), end.at(v)))


SLIDE_LAWS: Mapping[str, PlaceLaw] = {
    "normal": _ends(Normal(-1.0, 1.0)),
    "normal_in_disc": _ends(TruncatedNormal(-1.0, 1.0)),
    "uniform": _ends(Uniform(-1.0, 1.0)),
    "contact": _ends(Wall(-1.0, 1.0)),
}
