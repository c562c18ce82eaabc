"""Roots and smallest values of many functions at once, each within its bracket."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from mechdesign.numerics.arrays import Floats, Ints

# Values of the functions `which` (indices of brackets) at `x`.
Evaluate = Callable[[Ints, Floats], Floats]
MAX_ROOT_STEPS = 80
# Shares of the way to where a function seems to end that are left: less where the points it is judged by are near.
SHORT = (1e-3, 0.1)
GOLDEN = (math.sqrt(5) - 1) / 2
# Golden sections that leave 1e-10 of a bracket: a value is exact then, as it is flat where it is smallest.
GOLDEN_SECTIONS = 50
# Successive parabolas at most.
MAX_PARABOLAS = 24
# Part of a place, or of its bracket, to which the lowest place is found.
LOWEST_ACCURACY = 1e-9
# How many times as far as a convex function one may fall.
STEEP = 2.0


def bracketed_roots(
    evaluate: Evaluate, a: Floats, fa: Floats, b: Floats, fb: Floats, c: Floats, fc: Floats, tolerance: Floats
) -> Floats:
    """Roots between `a` and `b`, where the functions have opposite signs, by Muller's method kept inside the bracket.

    The parabola through the ends and a third point has exactly one root between ends of opposite sign, so a step never
    leaves the bracket, and one step solves a quadratic function. nan counts as negative (the function ends there);
    a bracket that shrinks too slowly, or has nan at an end, is halved. The third point `c` may lie anywhere (or be
    nan); `tolerance` is the wanted accuracy of each root, if its digits hold it.
    """
    a, b, c, fa, fb, fc = (np.array(v, dtype=float) for v in (a, b, c, fa, fb, fc))
    root = np.where(fa == 0, a, np.where(fb == 0, b, 0.5 * (a + b)))
    tolerance = np.maximum(tolerance, 2 * np.spacing(np.maximum(np.abs(a), np.abs(b))))
    left = np.nonzero((fa != 0) & (fb != 0))[0]
    before = np.abs(b - a)
    for step in range(MAX_ROOT_STEPS):
        if not left.size:
            break
        al, bl, cl, fal, fbl, fcl = a[left], b[left], c[left], fa[left], fb[left], fc[left]
        width = bl - al
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            slope = (fbl - fal) / width
            bend = ((fcl - fal) / (cl - al) - slope) / (cl - bl)
            bend = np.where(np.isfinite(bend), bend, 0.0)
            # Parabola about a: fal + linear x + bend x^2, solved without cancellation.
            linear = slope - bend * width
            square = np.sqrt(np.maximum(linear * linear - 4 * bend * fal, 0.0))
            far = -0.5 * (linear + np.copysign(square, linear))
            one, two = fal / far, far / bend
            x = al + np.where((one / width >= 0) & (one / width <= 1), one, two)
            # Where the function ends at one side of the bracket: the line through the other two points, and not quite
            # as far, so that it is approached from where the function is known.
            last, f_last = np.where(np.isnan(fal), bl, al), np.where(np.isnan(fal), fbl, fal)
            secant = (fcl - f_last) / (cl - last)
            ended = (np.isnan(fal) | np.isnan(fbl)) & np.isfinite(secant)
            way = f_last / secant
            short = np.clip(SHORT[1] * np.abs(way / (cl - last)), *SHORT)
            x = np.where(ended, last - (1 - short) * way, x)
            square = np.where(ended, np.abs(secant), square)
        halve = ~((x - al) * (x - bl) <= 0) | (ended & ((x == al) | (x == bl)))
        if step % 3 == 2:
            halve |= np.abs(width) > 0.5 * before[left]
            before[left] = np.abs(width)
        x = np.where(halve, al + 0.5 * width, x)
        fx = evaluate(left, x)
        with np.errstate(invalid="ignore", divide="ignore"):
            near = np.abs(fx) <= tolerance[left] * np.where(halve, np.abs(slope), square)
        root[left] = x
        lower = (fx > 0) == (fal > 0)
        known = ~np.isnan(fx)
        c[left] = np.where(known, np.where(lower, al, bl), cl)
        fc[left] = np.where(known, np.where(lower, fal, fbl), fcl)
        a[left], fa[left] = np.where(lower, x, al), np.where(lower, fx, fal)
        b[left], fb[left] = np.where(lower, bl, x), np.where(lower, fbl, fx)
        done = (fx == 0) | near | (np.abs(b[left] - a[left]) <= tolerance[left])
        left = left[~done]
    return root


def lowest(function: Callable[[Floats], Floats], low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Places and smallest values, shape (n,), between `low` and `high`, where each function falls and then rises.

    `function` gives the values of all of them at places of shape (n,), never nan.
    """
    left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_left, at_right = function(left), function(right)
    for _ in range(GOLDEN_SECTIONS):
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
    function: Callable[[Ints, Floats], Floats], x: Floats, values: Floats, enough: Floats, steps: int = MAX_PARABOLAS
) -> tuple[Floats, Floats]:
    """Lowest places of many functions by successive parabolas, and their values; only so low as is `enough`.

    A function is left alone when it could not fall so far even as steeply as `STEEP` times what convexity allows.
    ``function(which, x)`` gives the values of some functions (indices) at places of the same shape. `x` and `values`,
    shape (3, n), are ascending places of which the middle one is lowest, and the values there, infinite where unknown;
    `enough`, shape (n,), is minus infinity where the lowest place is wanted.
    """
    x, values, left = x.copy(), values.copy(), np.arange(x.shape[1])
    for _ in range(steps):
        (a, b, c), (fa, fb, fc) = x[:, left], values[:, left]
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            fall, rise = (fa - fb) / (b - a), (fc - fb) / (c - b)
            # From the lowest place a convex function falls no farther than the line from either end through it.
            hopeless = fb - enough[left] > STEEP * np.maximum(fall * (c - b), rise * (b - a))
            hopeless &= np.isfinite(enough[left])
            vertex = b + 0.5 * (fall * (c - b) - rise * (b - a)) / (fall + rise)
        met = np.abs(vertex - b) <= LOWEST_ACCURACY * np.maximum(np.abs(c), c - a)
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
