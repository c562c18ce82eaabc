"""Run a compiled structure for a batch: closed forms group by group, Newton's method where a group has none.

With k the sum of the known vectors, z a vector fixed in a link that turns with the unknown rotation U, d a unit
vector and s a displacement, the loop of a dyad (RRR, RRP, RPR, PRP, RPP in any order of joints) reads

    two angles (RRR)                  k + z1 U1 + z2 U2 = 0
    angle and fixed slide (RRP)       k + z U + s d = 0
    angle and turning slide (RPR)     k + (z + s d) U = 0
    two slides (PRP, RPP)             k + s1 d1 + s2 d2 = 0

Their functions take complex arrays that broadcast and the assembly mode (+1 or -1), and return the unknowns and the
closures: quantities that are positive where the loop closes and zero at the limit of motion (squares of lengths, so
that they stay smooth there). Outside, the unknowns are nan, or with `beyond` those of links stretched or folded towards
each other, continuous at the limit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from mechdesign.mechanism.algebra import Value, cross, dot, norm2, plus, vector
from mechdesign.mechanism.newton import solve_newton
from mechdesign.mechanism.state import State, Unknowns, loop_gap
from mechdesign.mechanism.structure import Group

# Dividing by a vector that has shrunk to nothing gives inf, where Python's own zero would raise.
ZERO = np.float64(0.0)
# In products of complex arrays a temporary stands first, or `np.multiply` is called: of long arrays NumPy's operator
# computes the product in the temporary's place, with the factors exchanged if it is the second, and in other last bits.

# Closures down to this fraction of the links' squared lengths count as an exact limit, not as open: they are
# differences of squares, so rounding leaves a few units in the last place there.
ROUNDING = 4e-15

Solution = tuple[Value, Value, tuple[Value, ...]]


def run(state: State, modes: Sequence[Value], guess: Unknowns | None = None, begin: int = 0) -> State:
    """Solve all groups in order.

    Parameters
    ----------
    modes : sequence
        Assembly mode (+1 or -1) of each group, or an array of one for each pose. Groups that it does not reach are left
        unsolved.
    guess : sequence, optional
        Where Newton's method starts, for the groups without a closed form.
    begin : int
        First group to solve; those before it are known already.
    """
    for index, (group, mode) in enumerate(zip(state.structure.groups, modes, strict=False)):
        if index < begin:
            continue
        if group.form == "newton":
            assert guess is not None
            solve_newton(state, index, guess[state.structure.unknowns[index]])
        elif group.form != "place":
            _closed_form(state, group, mode)
        state.place(group)
    return state


def loop_vectors(state: State, group: Group) -> tuple[Value, dict[int, Value], dict[int, Value]]:
    """Around a dyad's loop: the known vector k, and by its unknowns the vectors z that turn and the directions d."""
    structure = state.structure
    loop = group.loops[0]
    k: Value = ZERO if loop.start == loop.end else loop_gap(state, loop.start, loop.end)
    z: dict[int, Value] = dict.fromkeys(group.angles, ZERO)
    d: dict[int, Value] = {}
    for index, sign in loop.edges:
        edge = structure.edges[index]
        root = structure.ties[edge.frame].root
        unknown_slide = edge.slide is not None and edge.slide in group.slides
        arm = state.w[index] if unknown_slide else state.arm(index)
        if root in z:
            arm = arm if isinstance(state.ties[edge.frame], float) else arm * state.ties[edge.frame]
            z[root] = plus(z[root], sign, arm)
            if unknown_slide:
                direction = state.vectors.d[index]
                d[edge.slide or 0] = sign * direction * state.ties[edge.frame]
        else:
            k = plus(k, sign, state.turned(arm, edge.frame))
            if unknown_slide:
                d[edge.slide or 0] = sign * state.turned(state.vectors.d[index], edge.frame)
    return k, z, d


def _closed_form(state: State, group: Group, mode: Value) -> None:
    k, z, d = loop_vectors(state, group)
    if group.form == "two angles":
        first, second = group.angles
        u1, u2, closures = two_angles(k, z[first], z[second], mode, state.beyond)
        state.turn(first, u1)
        state.turn(second, u2)
    elif group.form == "two slides":
        one, two = group.slides
        state.slides[one], state.slides[two], closures = two_slides(k, d[one], d[two])
    else:
        solve = angle_and_fixed_slide if "fixed" in group.form else angle_and_turning_slide
        (root,), (slide,) = group.angles, group.slides
        u, state.slides[slide], closures = solve(k, z[root], d[slide], mode, state.beyond)
        state.turn(root, u)
    state.closures.extend(closures)


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
