"""Where a pin lies in its hole, for a radial clearance of 1 [S2, eqs. 6, 12, 13].

All laws are isotropic. Two standard normal variables map onto a place in the disc without turning it and without a
kink: their length is Rayleigh distributed, and its quantile is the length of the pin's offset.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from mechdesign.numerics.arrays import Floats

# Half the squared radius, in standard deviations, at which a normal pin of sigma 1/3 reaches the unit circle, and the
# share of the normal law that lies outside.
_CUT = 4.5
_OUTSIDE = math.exp(-_CUT)


@dataclass(frozen=True)
class PinLaw:
    """Law of a pin's place.

    Parameters
    ----------
    variance, fourth : float
        Of each coordinate: E[x^2] and E[x^4]; E[x^2 y^2] is a third of the latter.
    draw : callable
        ``draw(rng, count)``: x and y, each of shape (count,).
    stretch : callable
        Ratio of the offset's length to that of two standard normal variables, of half their squared length.
    """

    variance: float
    fourth: float
    draw: Callable[[np.random.Generator, int], tuple[Floats, Floats]]
    stretch: Callable[[Floats], Floats]

    def at(self, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        """The place at values of two independent standard normal variables."""
        ratio = self.stretch(0.5 * (u * u + v * v))
        return ratio * u, ratio * v


def _normal(rng: np.random.Generator, count: int, cut: float = math.inf) -> tuple[Floats, Floats]:
    """Of sigma 1/3, drawn anew where half the squared radius is beyond `cut`."""
    x, y = rng.standard_normal((2, count))
    outside = np.flatnonzero(x * x + y * y > 2.0 * cut) if math.isfinite(cut) else np.zeros(0, dtype=np.intp)
    while len(outside):
        again_x, again_y = rng.standard_normal((2, len(outside)))
        x[outside], y[outside] = again_x, again_y
        outside = outside[again_x * again_x + again_y * again_y > 2.0 * cut]
    x *= 1.0 / 3.0
    y *= 1.0 / 3.0
    return x, y


def _uniform(rng: np.random.Generator, count: int) -> tuple[Floats, Floats]:
    radius = np.sqrt(rng.random(count))
    angle = rng.random(count)
    angle *= 2.0 * np.pi
    return radius * np.cos(angle), radius * np.sin(angle)


def _contact(rng: np.random.Generator, count: int) -> tuple[Floats, Floats]:
    angle = rng.random(count)
    angle *= 2.0 * np.pi
    return np.cos(angle), np.sin(angle)


def _stretch(squared: Callable[[Floats], Floats]) -> Callable[[Floats], Floats]:
    """The ratio from the squared offset; the limit of small ones follows from its own series by a small floor."""

    def ratio(half: Floats) -> Floats:
        half = np.maximum(half, 1e-290)
        return np.asarray(np.sqrt(squared(half) / (2.0 * half)))

    return ratio


def _squared_in_disc(half: Floats) -> Floats:
    # P(offset > s) = (exp(-9 s^2/2) - outside)/(1 - outside) is that of the Rayleigh variable, exp(-half).
    return -np.log1p((1.0 - _OUTSIDE) * np.expm1(-half)) / _CUT


# Mean squared offset, in units of 1/_CUT, of the exponential law cut at _CUT, and its mean square.
_FIRST = (1.0 - (1.0 + _CUT) * _OUTSIDE) / (1.0 - _OUTSIDE)
_SECOND = (2.0 - (_CUT**2 + 2.0 * _CUT + 2.0) * _OUTSIDE) / (1.0 - _OUTSIDE)

# In `normal_in_disc` the variance is that of the cut law, which S2 draws but does not use in its formula.
PIN_LAWS: Mapping[str, PinLaw] = {
    "normal": PinLaw(1.0 / 9.0, 3.0 / 81.0, _normal, lambda half: np.full_like(half, 1.0 / 3.0)),
    "normal_in_disc": PinLaw(
        0.5 * _FIRST / _CUT, 0.375 * _SECOND / _CUT**2, partial(_normal, cut=_CUT), _stretch(_squared_in_disc)
    ),
    "uniform": PinLaw(1.0 / 4.0, 1.0 / 8.0, _uniform, _stretch(lambda half: -np.expm1(-half))),
    "contact": PinLaw(1.0 / 2.0, 3.0 / 8.0, _contact, _stretch(np.ones_like)),
}
