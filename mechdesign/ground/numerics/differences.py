"""Derivatives by central differences of functions that may be rough, kinked or undefined at places."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mechdesign.ground.numerics.arrays import Floats

# Steps, as fractions of the largest.
STEPS: Floats = 0.5 ** np.arange(6.0)
# Number of neighbouring steps in one fit.
_FITTED = 4
# Powers of the step in the fits of the odd part, of the even part less the middle value, and of the values of one side.
_ODD, _EVEN, _SIDE = (1, 3, 5), (1, 2, 4), (1, 2, 3)
# Student's 97.5 % quantile of two degrees of freedom, which four steps leave a fit of two terms.
_STUDENT = 4.303
# Smallest bend of a kink, as a multiple of the bend's error.
_BEND_ERRORS = 10.0
# Smallest bend of a kink, as a fraction of the slope.
_BEND_PART = 1e-4


class Slope(NamedTuple):
    """Derivatives with their estimated errors; at a kink both are nan, and the slopes `below` and `above` it are given.

    All are of shape (values,); `below` and `above` are nan where there is no kink.
    """

    value: Floats
    error: Floats
    below: Floats
    above: Floats


def slope(middle: Floats, below: Floats, above: Floats, step: float) -> Slope:
    """Derivatives of any values with respect to one number.

    Parameters
    ----------
    middle : ndarray, shape (values,)
        Values at the number itself.
    below, above : ndarray, shape (6, values)
        Values where the number is smaller, and larger, by `STEPS` times `step`; nan where there is none.

    Notes
    -----
    The odd part of the differences is fitted over four neighbouring steps by a linear, a cubic and a fifth-order term,
    with and without the last. The error is the difference of the two slopes, or the residual if that is larger; of the
    three sets of steps the one with the least error counts. Rough values, such as counts of samples, may agree by
    chance where the steps are small: two sets whose slopes differ by more than their errors get that difference as
    their error. The even part has a linear term only at a kink.
    """
    rounding = np.finfo(float).eps * np.abs(np.concatenate([below, above, middle[None]])).max(axis=0, initial=0.0)
    fits: list[tuple[Floats, ...]] = []
    for first in range(len(STEPS) - _FITTED + 1):
        steps = STEPS[first : first + _FITTED]
        low, high = below[first : first + _FITTED], above[first : first + _FITTED]
        odd = _linear(0.5 * (high - low), steps, _ODD, rounding)
        even = _linear(0.5 * (high + low) - middle, steps, _EVEN, rounding)
        sides = [_linear(sign * (side - middle), steps, _SIDE, rounding)[0] for sign, side in ((-1, low), (1, high))]
        fits.append((*odd, *even, *sides))
    value, error, *rest = np.array(fits).transpose(1, 0, 2)
    difference = np.abs(value[:, None] - value)
    error = np.maximum(error, np.where(difference > error[:, None] + error, difference, 0.0).max(axis=1))
    best = np.argmin(np.where(np.isnan(error), np.inf, error), axis=0)[None]
    value, error, bend, bend_error, left, right = (
        np.take_along_axis(row, best, 0)[0] / step for row in (value, error, *rest)
    )
    kinked = (np.abs(bend) > _BEND_ERRORS * bend_error) & (np.abs(bend) > _BEND_PART * np.abs(value))
    nan = np.full_like(value, np.nan)
    return Slope(
        np.where(kinked, nan, value), np.where(kinked, nan, error),
        np.where(kinked, left, nan), np.where(kinked, right, nan),
    )  # fmt: skip


def _linear(values: Floats, steps: Floats, powers: tuple[int, ...], rounding: Floats) -> tuple[Floats, Floats]:
    """The linear coefficients of fits by `powers` of the steps, and their errors; `values` of shape (steps, values)."""
    full, short = (np.linalg.pinv(steps[:, None] ** np.array(exponents)) for exponents in (powers, powers[:-1]))
    linear = full[0] @ values
    residual = values - steps[:, None] ** np.array(powers[:-1]) @ (short @ values)
    noise = _STUDENT * np.sqrt((residual**2).sum(axis=0) / (len(steps) - len(powers) + 1)) + rounding
    return linear, np.maximum(np.abs(linear - short[0] @ values), noise * np.linalg.norm(full[0]))
