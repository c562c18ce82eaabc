"""Roots of many functions at once, each within its bracket."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mechdesign.numerics.arrays import Floats, Ints

# Values of the functions `which` (indices of brackets) at `x`.
Evaluate = Callable[[Ints, Floats], Floats]
STEPS = 80
# Shares of the way to where a function seems to end that are left: less where the points it is judged by are near.
SHORT = (1e-3, 0.1)


def bracketed_roots(
    evaluate: Evaluate, a: Floats, fa: Floats, b: Floats, fb: Floats, c: Floats, fc: Floats, tolerance: Floats
) -> Floats:
    """Roots between `a` and `b`, where the functions have opposite signs, by Muller's method kept inside the bracket.

    The parabola through the ends and a third point has exactly one root between ends of opposite sign, so a step never
    leaves the bracket, and one step solves a quadratic function. nan counts as negative (the function ends there);
    a bracket that shrinks too slowly, or has nan at an end, is halved.

    Parameters
    ----------
    c, fc : ndarray
        A third point, anywhere (may be nan).
    tolerance : ndarray
        Wanted accuracy of each root, if its digits hold it.
    """
    a, b, c, fa, fb, fc = (np.array(v, dtype=float) for v in (a, b, c, fa, fb, fc))
    root = np.where(fa == 0, a, np.where(fb == 0, b, 0.5 * (a + b)))
    tolerance = np.maximum(tolerance, 2 * np.spacing(np.maximum(np.abs(a), np.abs(b))))
    left = np.nonzero((fa != 0) & (fb != 0))[0]
    before = np.abs(b - a)
    for step in range(STEPS):
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
