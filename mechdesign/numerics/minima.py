"""Golden section: the smallest value of many functions at once, each within its bracket."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from mechdesign.numerics.arrays import Floats

GOLDEN = (math.sqrt(5) - 1) / 2
# Sections that leave 1e-10 of a bracket: a value is exact then, as it is flat where it is smallest.
SECTIONS = 50


def lowest(function: Callable[[Floats], Floats], low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Places and smallest values between `low` and `high`.

    Parameters
    ----------
    function : callable
        Values, shape (n,), of all functions at places of shape (n,), never nan.
    low, high : ndarray, shape (n,)
        Brackets in which each function falls and then rises.
    """
    left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_left, at_right = function(left), function(right)
    for _ in range(SECTIONS):
        lower = at_left < at_right
        low, high = np.where(lower, low, left), np.where(lower, right, high)
        left, right = (
            np.where(lower, high - GOLDEN * (high - low), right),
            np.where(lower, left, low + GOLDEN * (high - low)),
        )
        new = function(np.where(lower, left, right))
        at_left, at_right = np.where(lower, new, at_right), np.where(lower, at_left, new)
    place = low + (high - low) / 2
    return place, function(place)
