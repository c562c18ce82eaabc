"""Roots and smallest values of many functions at once, each within its bracket."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from mechdesign.ground.numerics.arrays import Flags, Floats, Ints

# Values of the functions `which` (indices of brackets) at `x`.
Evaluate = Callable[[Ints, Floats], Floats]
# Largest number of steps to a root.
MAX_ROOT_STEPS = 80
# Where a function becomes nan, a step towards the zero of a secant stops short of it by a fraction of the step. The
# fraction lies between these two; it is small where the step is short compared with the secant.
SHORT = (1e-3, 0.1)
# The golden section of an interval.
GOLDEN = (math.sqrt(5) - 1) / 2
# Largest number of successive parabolas.
MAX_PARABOLAS = 24
# Accuracy of a minimum's place, as a fraction of the place or of its bracket.
LOWEST_ACCURACY = 1e-9
# A function counts as too high if it would have to fall this many times as far as convexity allows.
STEEP = 2.0
# Samples of a parabola in the plane: the place itself, right, left, up, down and across (sampling distances).
AROUND = np.array([0, 1, -1, 1j, -1j, 1 + 1j])


def bracketed_roots(
    evaluate: Evaluate, a: Floats, fa: Floats, b: Floats, fb: Floats, c: Floats, fc: Floats, tolerance: Floats
) -> Floats:
    """Roots between `a` and `b`, where the functions have opposite signs, by Muller's method kept inside the bracket.

    The parabola through the ends and a third point has exactly one root between ends of opposite sign, so a step never
    leaves the bracket, and one step solves a quadratic function. nan counts as negative (the function ends there);
    a bracket that shrinks too slowly, or has nan at an end, is halved.

    Parameters
    ----------
    evaluate : callable
        Values of the functions of some brackets (indices) at places of the same shape.
    a, b, c, fa, fb, fc : ndarray, shape (n,)
        Both ends of each bracket and a third point, which may lie anywhere or be nan, and the values there.
    tolerance : ndarray, shape (n,)
        Accuracy of each root, as far as floating-point numbers allow.
    """
    a, b, c, fa, fb, fc = (np.array(v, dtype=float) for v in (a, b, c, fa, fb, fc))
    root = np.where(fa == 0, a, np.where(fb == 0, b, 0.5 * (a + b)))
    tolerance = np.maximum(tolerance, 2 * np.spacing(np.maximum(np.abs(a), np.abs(b))))
    active = np.nonzero((fa != 0) & (fb != 0))[0]
    before = np.abs(b - a)
    for step in range(MAX_ROOT_STEPS):
        if not active.size:
            break
        al, bl, cl, fal, fbl, fcl = a[active], b[active], c[active], fa[active], fb[active], fc[active]
        width = bl - al
        slope = (fbl - fal) / width
        bend = ((fcl - fal) / (cl - al) - slope) / (cl - bl)
        bend = np.where(np.isfinite(bend), bend, 0.0)
        # Parabola about a: fal + linear x + bend x^2, solved without cancellation.
        linear = slope - bend * width
        square = np.sqrt(np.maximum(linear * linear - 4 * bend * fal, 0.0))
        half = -0.5 * (linear + np.copysign(square, linear))
        first_root, second_root = fal / half, half / bend
        x = al + np.where((first_root / width >= 0) & (first_root / width <= 1), first_root, second_root)
        # Where the function is nan at one end: the secant through the other two points, and not quite to its zero,
        # so that the root is approached from the side where the function has values.
        finite_end, f_finite = np.where(np.isnan(fal), bl, al), np.where(np.isnan(fal), fbl, fal)
        secant = (fcl - f_finite) / (cl - finite_end)
        ended = (np.isnan(fal) | np.isnan(fbl)) & np.isfinite(secant)
        to_zero = f_finite / secant
        short = np.clip(SHORT[1] * np.abs(to_zero / (cl - finite_end)), *SHORT)
        x = np.where(ended, finite_end - (1 - short) * to_zero, x)
        square = np.where(ended, np.abs(secant), square)
        halve = ~((x - al) * (x - bl) <= 0) | (ended & ((x == al) | (x == bl)))
        if step % 3 == 2:
            halve |= np.abs(width) > 0.5 * before[active]
            before[active] = np.abs(width)
        x = np.where(halve, al + 0.5 * width, x)
        fx = evaluate(active, x)
        near = np.abs(fx) <= tolerance[active] * np.where(halve, np.abs(slope), square)
        root[active] = x
        lower = (fx > 0) == (fal > 0)
        defined = ~np.isnan(fx)
        c[active] = np.where(defined, np.where(lower, al, bl), cl)
        fc[active] = np.where(defined, np.where(lower, fal, fbl), fcl)
        a[active], fa[active] = np.where(lower, x, al), np.where(lower, fx, fal)
        b[active], fb[active] = np.where(lower, bl, x), np.where(lower, fbl, fx)
        done = (fx == 0) | near | (np.abs(b[active] - a[active]) <= tolerance[active])
        active = active[~done]
    return root


def dips(
    function: Callable[[Ints, Floats], Floats], x: Floats, values: Floats, enough: Floats
) -> tuple[Floats, Floats]:
    """Places and values, shape (n,), of minima of many functions, by successive parabolas.

    Parameters
    ----------
    function : callable
        Values of some functions (indices) at places of the same shape.
    x, values : ndarray, shape (3, n)
        Ascending places of which the middle one is lowest, and the values there, infinite where unknown.
    enough : ndarray, shape (n,)
        A function is not lowered further once its value is below this, nor if it could not come so low even by falling
        `STEEP` times as far as convexity allows. Minus infinity asks for the minimum itself.
    """
    x, values, active = x.copy(), values.copy(), np.arange(x.shape[1])
    for _ in range(MAX_PARABOLAS):
        (a, b, c), (fa, fb, fc) = x[:, active], values[:, active]
        fall, rise, vertex = parabola(x[:, active], values[:, active])
        # A convex function stays above both lines from an end of the bracket through the middle place.
        too_high = fb - enough[active] > STEEP * np.maximum(fall * (c - b), rise * (b - a))
        too_high &= np.isfinite(enough[active])
        converged = np.abs(vertex - b) <= LOWEST_ACCURACY * np.maximum(np.abs(c), c - a)
        keep = ~(too_high | converged | (fb < enough[active]))
        active, a, b, c, fa, fb, fc, vertex = (v[keep] for v in (active, a, b, c, fa, fb, fc, vertex))
        if not active.size:
            break
        golden = np.where(c - b > b - a, b + (1 - GOLDEN) * (c - b), b - (1 - GOLDEN) * (b - a))
        trial = np.where((vertex > a) & (vertex < c), vertex, golden)
        trial_value = function(active, trial)
        lower, above = trial_value < fb, trial > b
        # The lower of the two is the new middle, and the other an end.
        x[1, active], values[1, active] = np.where(lower, trial, b), np.where(lower, trial_value, fb)
        other, f_other = np.where(lower, b, trial), np.where(lower, fb, trial_value)
        begins = lower == above
        x[0, active], values[0, active] = np.where(begins, other, a), np.where(begins, f_other, fa)
        x[2, active], values[2, active] = np.where(begins, c, other), np.where(begins, fc, f_other)
    return x[1], values[1]


def parabola(x: Floats, values: Floats) -> tuple[Floats, Floats, Floats]:
    """Of the parabolas through three points, `x` and `values` of shape (3, n): two slopes, and the place of the vertex.

    The slopes are those from the middle point up to the points on either side. The vertex is not finite for a line.
    """
    (a, b, c), (fa, fb, fc) = x, values
    fall, rise = (fa - fb) / (b - a), (fc - fb) / (c - b)
    return fall, rise, b + 0.5 * (fall * (c - b) - rise * (b - a)) / (fall + rise)


def lowest_near(values: Floats) -> tuple[Floats, Flags, Floats]:
    """Of the parabola in the plane through samples `AROUND` a place: the way to its vertex, in sampling distances.

    Parameters
    ----------
    values : ndarray, shape (6, ...)

    Returns
    -------
    (way, low, fall)
        The way in x and in y, shape (2, ...); whether the parabola is lowest there; twice its change as far as there.
    """
    here, right, left, up, down, across = values
    gx, gy = 0.5 * (right - left), 0.5 * (up - down)
    xx, yy, xy = right + left - 2 * here, up + down - 2 * here, across + here - right - up
    det = xx * yy - xy * xy
    dx, dy = (gy * xy - gx * yy) / det, (gx * xy - gy * xx) / det
    return np.array([dx, dy]), np.asarray((xx > 0) & (det > 0)), gx * dx + gy * dy
