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
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from mechdesign.ground.numerics.arrays import Flags
from mechdesign.ground.numerics.linear import solved
from mechdesign.mechanism.algebra import Value, Vector, cross, dot, largest, norm2, plus, times, vector
from mechdesign.mechanism.coordinates import angles_of
from mechdesign.mechanism.loops import Loops, Unknowns
from mechdesign.mechanism.structure import Group

# In products of complex arrays a temporary stands first, or `np.multiply` is called: with a temporary as second factor
# NumPy exchanges the factors of long arrays, and their last bits would differ from those of short ones.

# Closures down to this fraction of the links' squared lengths count as an exact limit, not as open: they are
# differences of squares, so rounding leaves a few units in the last place there.
CLOSURE_ROUNDING = 4e-15
# Up to this many unknowns equations are solved by minors, on whole arrays; more unknowns pose by pose.
MINORS_ORDER = 4

NEWTON_STEPS = 10
# After a correction this small (radians, or parts of the mechanism's size) the next would be below rounding.
CONVERGED = 1e-8

Solution = tuple[Vector, Vector, tuple[Value, ...]]


@dataclass
class State(Loops):
    """The positions of a mechanism while its groups are solved one after another.

    Groups with a closed form leave their `closures`, with `beyond` also stretched or folded. The others are solved by
    at most `steps` of Newton's corrections, until one is below `enough` (radians, or parts of the length `size`), and
    leave their unknowns, which poses converged, and the determinant of their equations.
    """

    size: float = 1.0
    steps: int = NEWTON_STEPS
    enough: float = CONVERGED
    beyond: bool = False
    closures: list[Value] = field(default_factory=list)
    unknowns: list[Value] = field(default_factory=list)
    converged: list[Flags] = field(default_factory=list)
    determinants: list[Value] = field(default_factory=list)

    def solved(self, shape: tuple[int, ...], signs: Sequence[Value] | None = None) -> Flags:
        """Which poses of a batch converged in all groups, with determinants of these signs."""
        solved = np.ones(shape, dtype=bool)
        for converged in self.converged:
            solved &= converged
        for determinant, sign in zip(self.determinants, signs or (), strict=False):
            solved &= np.sign(determinant) == sign
        return solved


def solve_newton(state: State, index: int, guess: Unknowns) -> None:
    """Solve group `index` of a state from a guess of its unknowns, and put the result into the state.

    A pose that has converged is not changed any more: its result does not depend on its batch.
    """
    group = state.structure.groups[index]
    state.count_turns(group)
    unknowns: list[Value] = [np.asarray(value, dtype=float) for value in guess]
    count = len(group.angles)
    active: Flags = np.ones((), dtype=bool)
    determinant: Value = 0.0
    for _ in range(state.steps):
        state.put(group, unknowns)
        solution, determinant = solve_linear(*state.equations(group))
        turned, moved = largest(solution[:count]), largest(solution[count:])
        moving = np.logical_not((turned < state.enough) & (moved < state.enough * state.size))
        if active.ndim:
            solution = [np.where(active, step, 0.0) for step in solution]
            moving = moving & active
        unknowns = [value - step for value, step in zip(unknowns, solution, strict=True)]
        active = np.asarray(moving)
        if not active.any():
            break
    state.put(group, unknowns)
    state.unknowns += unknowns
    state.converged.append(~active)
    state.determinants.append(determinant)


def solve_linear(rows: Sequence[Sequence[Value]], right: Sequence[Value]) -> tuple[list[Value], Value]:
    """Solve small linear systems, one for each pose; returns the unknowns and the determinant.

    `rows` and `right` hold arrays that broadcast, or plain floats where an entry is the same for all. Where a matrix
    is singular or not finite the unknowns are not finite.
    """
    return _by_minors(rows, right) if len(rows) <= MINORS_ORDER else _by_matrix(rows, right)


def _by_minors(rows: Sequence[Sequence[Value]], right: Sequence[Value]) -> tuple[list[Value], Value]:
    """Cramer's rule with Laplace's expansion by the 2 x 2 minors of the upper and of the lower rows."""
    count = len(rows)
    # Rows and columns of the identity fill the matrix up to two pairs of rows; as plain numbers they cost nothing.
    zeros = [0.0] * (MINORS_ORDER - count)
    full = [[*row, *zeros, side] for row, side in zip(rows, right, strict=True)]
    full += [[*(float(i == j) for j in range(MINORS_ORDER)), 0.0] for i in range(count, MINORS_ORDER)]
    upper, lower = _minors(full[0], full[1]), _minors(full[2], full[3])

    def expand(order: Sequence[int]) -> Value:
        total: Value = 0.0
        for i, j in combinations(range(MINORS_ORDER), 2):
            k, m = (x for x in range(MINORS_ORDER) if x not in (i, j))
            sign, one = _signed(upper, order[i], order[j])
            other_sign, other = _signed(lower, order[k], order[m])
            total = plus(total, sign * other_sign * (-1) ** (i + j + 1), times(one, other))
        return total

    determinant = expand(range(MINORS_ORDER))
    scale = np.divide(1.0, determinant)
    unknowns = [
        scale * expand([MINORS_ORDER if column == j else column for column in range(MINORS_ORDER)])
        for j in range(count)
    ]
    return unknowns, determinant


def _minors(one: Sequence[Value], two: Sequence[Value]) -> dict[tuple[int, int], Value]:
    return {(i, j): plus(times(one[i], two[j]), -1, times(one[j], two[i])) for i, j in combinations(range(len(one)), 2)}


def _signed(minors: dict[tuple[int, int], Value], i: int, j: int) -> tuple[int, Value]:
    return (1, minors[i, j]) if i < j else (-1, minors[j, i])


def _by_matrix(rows: Sequence[Sequence[Value]], right: Sequence[Value]) -> tuple[list[Value], Value]:
    shape = np.broadcast_shapes(*(np.shape(e) for row in rows for e in row), *(np.shape(e) for e in right))
    matrix = np.stack([np.stack([np.broadcast_to(c, shape) for c in row], axis=-1) for row in rows], axis=-2)
    sides = np.stack([np.broadcast_to(e, shape) for e in right], axis=-1)
    solution, determinant = solved(matrix, sides[..., None])
    return [solution[..., j, 0] for j in range(len(rows))], determinant


def run(state: State, modes: Sequence[Value], guess: Unknowns | None = None, begin: int = 0) -> State:
    """Solve the groups from `begin` on that have a mode (+1, -1, or an array of one a pose), in order.

    Newton's method starts from `guess`, the unknowns of the groups without a closed form.
    """
    for index, (group, mode) in enumerate(zip(state.structure.groups, modes, strict=False)):
        if index < begin:
            continue
        if group.form == "newton":
            assert guess is not None
            solve_newton(state, index, guess[state.structure.unknowns[index]])
        elif group.form == "coupled":
            state.couple(group)
        elif group.form == "linear":
            _solve_linear_conditions(state, group)
        elif group.form != "place":
            _closed_form(state, group, mode)
        state.place(group)
    return state


def _solve_linear_conditions(state: State, group: Group) -> None:
    """Solve conditions that are linear in a group's unknowns, and count the turns of the angles in them."""
    state.count_turns(group)
    state.put(group, [0.0] * group.unknowns)
    solution, _ = solve_linear(state.condition_rows(group), state.gaps(group))
    unknowns = [-1.0 * value for value in solution]
    turned = dict(zip(group.angles, unknowns, strict=False))
    angles = angles_of(state.structure.values[k] for k in group.conditions)
    turns = {name: state.pose().value(angle) for name, angle in angles.items() if name not in state.near}
    for name in turns:
        for body, sign in ((angles[name].body, 1), (angles[name].reference, -1)):
            root = state.structure.ties[state.graph.bodies[body][0]].root
            turns[name] = plus(turns[name], sign, turned.get(root, 0.0))
    state.near = {**state.near, **turns}
    state.put(group, unknowns)


def _closed_form(state: State, group: Group, mode: Value) -> None:
    k, z, d = state.dyad(group)
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
    """Square root; zero where the product is below zero by no more than rounding, or `beyond`, elsewhere nan."""
    if beyond:
        return np.sqrt(np.maximum(product, 0.0))
    below = product < 0
    if np.any(below):
        product = np.where(below & (product >= -CLOSURE_ROUNDING * math.prod(sizes)), 0.0, product)
    return np.sqrt(product)


def two_angles(k: Vector, z1: Vector, z2: Vector, mode: Value, beyond: bool = False) -> Solution:
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


def angle_and_fixed_slide(k: Vector, z: Vector, d: Vector, mode: Value, beyond: bool = False) -> Solution:
    """Rotation U and displacement s along a known direction; `mode` is the side of the perpendicular's foot."""
    n = norm2(z)
    offset = cross(d, k)
    closure = n - offset * offset
    s = mode * _root(closure, beyond, n) - dot(d, k)
    u = (k + s * d) * (np.conj(z) * (-1 / n))
    return u, s, (closure,)


def angle_and_turning_slide(k: Vector, z: Vector, d: Vector, mode: Value, beyond: bool = False) -> Solution:
    """Rotation U and displacement s of a slide that turns with it; `mode` is the sign of the slide from its foot."""
    offset = cross(d, z)
    reach = norm2(k)
    closure = reach - offset * offset
    s = mode * _root(closure, beyond, reach) - dot(d, z)
    u = np.conj(z + s * d) * k * (-1 / reach)
    return u, s, (closure,)


def two_slides(k: Vector, d1: Vector, d2: Vector) -> Solution:
    """Displacements along two known directions; infinite where they are parallel."""
    across = cross(d1, d2)
    return cross(d2, k) / across, cross(k, d1) / across, ()
