"""Derivatives by central differences, of values that may be rough, kinked or missing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mechdesign.numerics.arrays import Floats

# Steps, as parts of the largest; four neighbouring ones are fitted together.
STEPS: Floats = 0.5 ** np.arange(6.0)
_FITTED = 4
# Powers of the step in the fits of the odd part, of the even part less the value in the middle, and of one side.
_ODD, _EVEN, _SIDE = (1, 3, 5), (1, 2, 4), (1, 2, 3)
# Student's 97.5 % quantile of two degrees of freedom, which four steps leave a fit of two terms.
_STUDENT = 4.303
# A bend counts from so many of its errors on, and from this part of the slope on.
_BEND_ERRORS, _BEND_PART = 10.0, 1e-4


class Slope(NamedTuple):
    """Derivatives and their error estimates; of a kink, where they are nan, the slopes below and above it."""

    value: Floats
    error: Floats
    below: Floats
    above: Floats


def slope(middle: Floats, below: Floats, above: Floats, step: float) -> Slope:
    """Derivatives of any values with respect to one number.

    Parameters
    ----------
    middle : ndarray, shape (values,)
        Where the number is as it is.
    below, above : ndarray, shape (6, values)
        Where it is less and more by `STEPS` of the largest `step`; nan where there is none.

    Notes
    -----
    The odd part of the differences is a slope, a cubic and a fifth-order term. Four neighbouring steps are fitted with
    and without the last: what they differ by, or the rest that is left, is the error; of three sets of steps the least
    counts. Rough values, such as counts of samples, agree by chance where the steps are small: two sets of steps that
    contradict each other both have their difference as their error. The even part has no linear term, but at a kink.
    """
    rounding = np.finfo(float).eps * np.abs(np.concatenate([below, above, middle[None]])).max(axis=0, initial=0.0)
    found: list[tuple[Floats, ...]] = []
    for first in range(len(STEPS) - _FITTED + 1):
        steps = STEPS[first : first + _FITTED]
        low, high = below[first : first + _FITTED], above[first : first + _FITTED]
        odd = _linear(0.5 * (high - low), steps, _ODD, rounding)
        even = _linear(0.5 * (high + low) - middle, steps, _EVEN, rounding)
        sides = [_linear(sign * (side - middle), steps, _SIDE, rounding)[0] for sign, side in ((-1, low), (1, high))]
        found.append((*odd, *even, *sides))
    value, error, *rest = np.array(found).transpose(1, 0, 2)
    apart = np.abs(value[:, None] - value)
    error = np.maximum(error, np.where(apart > error[:, None] + error, apart, 0.0).max(axis=1))
    best = np.argmin(np.where(np.isnan(error), np.inf, error), axis=0)[None]
    value, error, bend, bend_error, left, right = (
        np.take_along_axis(each, best, 0)[0] / step for each in (value, error, *rest)
    )
    kinked = (np.abs(bend) > _BEND_ERRORS * bend_error) & (np.abs(bend) > _BEND_PART * np.abs(value))
    nan = np.full_like(value, np.nan)
    return Slope(
        np.where(kinked, nan, value), np.where(kinked, nan, error),
        np.where(kinked, left, nan), np.where(kinked, right, nan),
    )  # fmt: skip


def _linear(values: Floats, steps: Floats, powers: tuple[int, ...], rounding: Floats) -> tuple[Floats, Floats]:
    """The linear coefficient of a fit by powers of the steps, and its error."""
    full, short = (np.linalg.pinv(steps[:, None] ** np.array(some)) for some in (powers, powers[:-1]))
    found = full[0] @ values
    rest = values - steps[:, None] ** np.array(powers[:-1]) @ (short @ values)
    noise = _STUDENT * np.sqrt((rest**2).sum(axis=0) / (len(steps) - len(powers) + 1)) + rounding
    return found, np.maximum(np.abs(found - short[0] @ values), noise * np.linalg.norm(full[0]))
