"""Closed-form solutions of one vector loop with two unknowns: every dyad is one of these four forms.

With k the sum of the known vectors, z a vector fixed in a link that turns with the unknown rotation U, d a unit
vector and s a displacement, the loop of a dyad (RRR, RRP, RPR, PRP, RPP in any order of joints) reads

    two angles (RRR)                  k + z1 U1 + z2 U2 = 0
    angle and fixed slide (RRP)       k + z U + s d = 0
    angle and turning slide (RPR)     k + (z + s d) U = 0
    two slides (PRP, RPP)             k + s1 d1 + s2 d2 = 0

Each function takes complex arrays that broadcast and the assembly mode (+1 or -1), and returns the unknowns and the
closures: quantities that are positive where the loop closes and zero at the limit of motion (squares of lengths, so
that they stay smooth there). Outside, the unknowns are nan, or with `beyond` those of links stretched or folded towards
each other, continuous at the limit.
"""

from __future__ import annotations

import math

import numpy as np

from mechdesign.mechanism.algebra import Value, cross, dot, norm2, vector

# In products of complex arrays a temporary stands first, or `np.multiply` is called: of long arrays NumPy's operator
# computes the product in the temporary's place, with the factors exchanged if it is the second, and in other last bits.

# Closures down to this fraction of the links' squared lengths count as an exact limit, not as open: they are
# differences of squares, so rounding leaves a few units in the last place there.
ROUNDING = 4e-15

Solution = tuple[Value, Value, tuple[Value, ...]]


def _root(product: Value, beyond: bool, *sizes: Value) -> Value:
    """Square root, zero down to -ROUNDING times the product of `sizes` and nan below it, or zero where `beyond`."""
    if beyond:
        return np.sqrt(np.maximum(product, 0.0))
    below = product < 0
    if np.any(below):
        product = np.where(below & (product >= -ROUNDING * math.prod(sizes)), 0.0, product)
    return np.sqrt(product)


def two_angles(k: Value, z1: Value, z2: Value, mode: Value, beyond: bool = False) -> Solution:
    """Rotations U1, U2 of two links that meet; `mode` is the side of the line -k on which they meet (+1 left)."""
    n1, n2, reach = norm2(z1), norm2(z2), norm2(k)
    product = 2 * np.sqrt(n1 * n2)
    outer, inner = (n1 + n2 + product) - reach, reach - (n1 + n2 - product)
    height = _root(outer * inner, beyond, n1 + n2, reach)
    half = 0.5 / reach
    first = vector((reach + (n1 - n2)) * half, height * (mode * half)) * k
    u1 = np.multiply(first, np.conj(z1) * (-1 / n1))
    u2 = (first - k) * (np.conj(z2) * (1 / n2))
    return u1, u2, (outer, inner)


def angle_and_fixed_slide(k: Value, z: Value, d: Value, mode: Value, beyond: bool = False) -> Solution:
    """Rotation U and displacement s along a known direction; `mode` is the side of the perpendicular's foot."""
    n = norm2(z)
    offset = cross(d, k)
    closure = n - offset * offset
    s = mode * _root(closure, beyond, n) - dot(d, k)
    u = (k + s * d) * (np.conj(z) * (-1 / n))
    return u, s, (closure,)


def angle_and_turning_slide(k: Value, z: Value, d: Value, mode: Value, beyond: bool = False) -> Solution:
    """Rotation U and displacement s of a slide that turns with it; `mode` is the sign of the slide from its foot."""
    offset = cross(d, z)
    reach = norm2(k)
    closure = reach - offset * offset
    s = mode * _root(closure, beyond, reach) - dot(d, z)
    u = np.conj(z + s * d) * k * (-1 / reach)
    return u, s, (closure,)


def two_slides(k: Value, d1: Value, d2: Value) -> Solution:
    """Displacements along two known directions; infinite where they are parallel."""
    across = cross(d1, d2)
    return cross(d2, k) / across, cross(k, d1) / across, ()
