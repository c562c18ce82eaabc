"""Random draws: streams, distributions of dimensions, and where a pin lies in its hole.

Every chunk of every pose has a stream of its own, so that the answer depends neither on the number of threads nor on
how many samples follow. Pins are drawn in the unit circle and scaled by the radial clearance [S2, eqs. 12, 13].
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mechdesign.errors import StudyError

CHUNK = 20_000

Floats = NDArray[np.float64]

# Half the squared radius, in standard deviations, at which a normal pin of sigma 1/3 reaches the unit circle.
_CUT = 4.5
# Variance of each coordinate of the pin for a radial clearance of 1 [S2, eq. 6]; the second is that of the normal
# law cut to the unit circle, which the paper draws but does not use in its formula.
PIN_VARIANCE = {
    "normal": 1.0 / 9.0,
    "normal_in_disc": (1.0 - _CUT * math.exp(-_CUT) / -math.expm1(-_CUT)) / 9.0,
    "uniform": 1.0 / 4.0,
}


def generator(seed: int, pose: int, chunk: int) -> np.random.Generator:
    """Stream of random numbers of one chunk of samples at one pose."""
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence(entropy=seed, spawn_key=(pose, chunk))))


def deviations(rng: np.random.Generator, distribution: str, sigma: float, count: int) -> Floats:
    """Draw deviations from the mean with standard deviation `sigma`, shape (count,).

    Parameters
    ----------
    distribution : str
        ``normal`` (not cut) or ``uniform``.

    Raises
    ------
    StudyError
        For any other distribution.
    """
    if distribution == "normal":
        drawn = rng.standard_normal(count)
        drawn *= sigma
        return drawn
    if distribution == "uniform":
        half_width = sigma * math.sqrt(3.0)
        drawn = rng.random(count)
        drawn *= 2.0 * half_width
        drawn -= half_width
        return drawn
    raise StudyError(f"the distribution {distribution!r} is not available in this version")


def pins(rng: np.random.Generator, law: str, count: int) -> tuple[Floats, Floats]:
    """Draw places of a pin for a radial clearance of 1: x and y, each of shape (count,).

    Parameters
    ----------
    law : str
        ``normal`` (sigma 1/3), ``normal_in_disc`` (the same, cut to the unit circle by rejection) or ``uniform``
        (in the disc).

    Raises
    ------
    StudyError
        For any other law.
    """
    if law == "uniform":
        radius = np.sqrt(rng.random(count))
        angle = rng.random(count)
        angle *= 2.0 * np.pi
        return radius * np.cos(angle), radius * np.sin(angle)
    if law not in PIN_VARIANCE:
        raise StudyError(f"the pin law {law!r} is not available in this version")
    x, y = rng.standard_normal((2, count))
    if law == "normal_in_disc":
        outside = np.flatnonzero(x * x + y * y > 2.0 * _CUT)
        while len(outside):
            again_x, again_y = rng.standard_normal((2, len(outside)))
            x[outside], y[outside] = again_x, again_y
            outside = outside[again_x * again_x + again_y * again_y > 2.0 * _CUT]
    x *= 1.0 / 3.0
    y *= 1.0 / 3.0
    return x, y
