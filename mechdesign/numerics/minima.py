"""The smallest values of many functions at once, each within its bracket."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from mechdesign.numerics.arrays import Floats, Ints

GOLDEN = (math.sqrt(5) - 1) / 2
# Sections that leave 1e-10 of a bracket: a value is exact then, as it is flat where it is smallest.
SECTIONS = 50
# Successive parabolas at most, the part of a place or of its bracket to which the lowest place is found, and how many
# times as far as a convex function one may fall.
PARABOLAS = 24
BOTTOM = 1e-6
STEEP = 2.0


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


def dips(
    function: Callable[[Ints, Floats], Floats], x: Floats, values: Floats, enough: Floats
) -> tuple[Floats, Floats]:
    """Lowest places of many functions by successive parabolas, and their values; only so low as is `enough`.

    A function is left alone when it could not fall so far even as steeply as `STEEP` times what convexity allows.

    Parameters
    ----------
    function : callable
        ``function(which, x)``: values of some functions (indices) at places, of the same shape.
    x, values : ndarray, shape (3, n)
        Ascending places of which the middle one is lowest, and the values there; infinite where unknown.
    enough : ndarray, shape (n,)
        Value below which a place is low enough; minus infinity where the lowest place is wanted.
    """
    x, values, left = x.copy(), values.copy(), np.arange(x.shape[1])
    for _ in range(PARABOLAS):
        (a, b, c), (fa, fb, fc) = x[:, left], values[:, left]
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            fall, rise = (fa - fb) / (b - a), (fc - fb) / (c - b)
            # From the lowest place a convex function falls no farther than the line from either end through it.
            hopeless = fb - enough[left] > STEEP * np.maximum(fall * (c - b), rise * (b - a))
            hopeless &= np.isfinite(enough[left])
            vertex = b + 0.5 * (fall * (c - b) - rise * (b - a)) / (fall + rise)
        met = np.abs(vertex - b) <= BOTTOM * np.maximum(np.abs(c), c - a)
        keep = ~(hopeless | met | (fb < enough[left]))
        left, a, b, c, fa, fb, fc, vertex = (v[keep] for v in (left, a, b, c, fa, fb, fc, vertex))
        if not left.size:
            break
        golden = np.where(c - b > b - a, b + (1 - GOLDEN) * (c - b), b - (1 - GOLDEN) * (b - a))
        trial = np.where((vertex > a) & (vertex < c), vertex, golden)
        found = function(left, trial)
        lower, above = found < fb, trial > b
        # The lower of the two is the new middle, and the other an end.
        x[1, left], values[1, left] = np.where(lower, trial, b), np.where(lower, found, fb)
        other, f_other = np.where(lower, b, trial), np.where(lower, fb, found)
        begins = lower == above
        x[0, left], values[0, left] = np.where(begins, other, a), np.where(begins, f_other, fa)
        x[2, left], values[2, left] = np.where(begins, c, other), np.where(begins, fc, f_other)
    return x[1], values[1]
