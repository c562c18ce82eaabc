"""Groups without a closed form: Newton's method on their loops and conditions, for the whole batch at once."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from itertools import combinations

import numpy as np

from mechdesign.mechanism.algebra import Value, plus, rotation, times, vector
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.outputs import Rates, first
from mechdesign.mechanism.state import State, Unknowns, columns, loop_gap, scalars
from mechdesign.mechanism.structure import Group
from mechdesign.numerics.arrays import Flags

# Up to this many unknowns the equations are solved by minors, array by array; above it matrix by matrix.
BY_MINORS = 4


def solve_newton(state: State, index: int, guess: Unknowns) -> None:
    """Solve group `index` of a state from a guess of its unknowns, and note what came out in the state.

    A pose that has converged is left alone: its result does not depend on its batch.
    """
    group = state.structure.groups[index]
    found: list[Value] = [np.asarray(value, dtype=float) for value in guess]
    count = len(group.angles)
    active: Flags = np.ones((), dtype=bool)
    determinant: Value = 0.0
    for _ in range(state.steps):
        set_unknowns(state, group, found)
        solution, determinant = solve_linear(*equations(state, group))
        turned, moved = (reduce(np.maximum, map(np.abs, part), 0.0) for part in (solution[:count], solution[count:]))
        moving = np.logical_not((turned < state.enough) & (moved < state.enough * state.size))
        if active.ndim:
            solution = [np.where(active, step, 0.0) for step in solution]
            moving = moving & active
        found = [value - step for value, step in zip(found, solution, strict=True)]
        active = np.asarray(moving)
        if not active.any():
            break
    set_unknowns(state, group, found)
    state.unknowns += found
    state.converged.append(~active)
    state.determinants.append(determinant)


def set_unknowns(state: State, group: Group, unknowns: Unknowns) -> None:
    """Put a group's angles, slides and, behind the slides, the x and y of its bases into a state."""
    rest = iter(unknowns)
    for root, value in zip(group.angles, rest, strict=False):
        state.turn(root, rotation(value))
    for slide, value in zip(group.slides, rest, strict=False):
        state.slides[slide] = value
    for base, x, y in zip(group.bases, rest, rest, strict=False):
        state.nodes[base] = vector(x, y)


def equations(state: State, group: Group) -> tuple[list[list[Value]], list[Value]]:
    """Matrix (a list of rows) and errors of a group's equations at the state's angles and slides."""
    rows: list[list[Value]] = []
    errors: list[Value] = []
    for loop in group.loops:
        total, derivatives = columns(state, group, loop.edges)
        rows += [[*row, *([0.0] * 2 * len(group.bases))] for row in scalars(derivatives)]
        gap = plus(loop_gap(state, loop.start, loop.end), 1, total)
        errors += [gap.real, gap.imag]
    if group.conditions:
        state.place(group)
        configuration = Configuration(
            state.graph, state.vectors, (), state.nodes, state.rotations, state.slides, [], np.zeros((), np.int8), {}
        )
        moves = _moves(state, group)
        for which in group.conditions:
            coordinate: Coordinate = state.structure.given[which]
            rows.append([first(configuration, coordinate, move) for move in moves])
            errors.append(configuration.value(coordinate) - state.given[which])
    return rows, errors


def _moves(state: State, group: Group) -> list[Rates]:
    """Derivatives of every position with respect to each of a group's unknowns."""
    structure = state.structure
    lengths = len(group.slides) + 2 * len(group.bases)
    nodes: list[list[Value]] = [[0.0j] * len(state.nodes) for _ in range(len(group.angles) + lengths)]
    into: dict[int, tuple[tuple[int, int], ...]] = {}
    begun = {base: base for base in group.bases}
    for k, sign in group.tree:
        edge = structure.edges[k]
        tail, head = (edge.tail, edge.head) if sign > 0 else (edge.head, edge.tail)
        into[head] = (*into.get(tail, ()), (k, sign))
        _, derivatives = columns(state, group, into[head])
        for j, value in enumerate(derivatives):
            nodes[j][head] = value
        if tail in begun:
            begun[head] = begun[tail]
    for node, base in begun.items():
        j = len(group.angles) + len(group.slides) + 2 * group.bases.index(base)
        nodes[j][node], nodes[j + 1][node] = 1.0 + 0.0j, 1.0j
    angles = [[float(tie.root == root) for tie in structure.ties] for root in group.angles]
    slides = [[float(slide == own) for slide in range(len(state.slides))] for own in group.slides]
    still, held = [0.0] * structure.classes, [0.0] * len(state.slides)
    turns = [*angles, *([still] * lengths)]
    shifts = [*([held] * len(group.angles)), *slides, *([held] * 2 * len(group.bases))]
    return [Rates(*each, {}) for each in zip(nodes, turns, shifts, strict=True)]


def solve_linear(rows: Sequence[Sequence[Value]], right: Sequence[Value]) -> tuple[list[Value], Value]:
    """Solve small linear systems, one for each pose; returns the unknowns and the determinant.

    `rows` and `right` hold arrays that broadcast, or plain floats where an entry is the same for all. Where a matrix
    is singular or not finite the unknowns are not finite.
    """
    return _by_minors(rows, right) if len(rows) <= BY_MINORS else _by_matrix(rows, right)


def _by_minors(rows: Sequence[Sequence[Value]], right: Sequence[Value]) -> tuple[list[Value], Value]:
    """Cramer's rule with Laplace's expansion by the 2 x 2 minors of the upper and of the lower rows."""
    count = len(rows)
    # Rows and columns of the identity fill up to two pairs of rows; the plain numbers in them cost nothing.
    full = [[*row, *(0.0 for _ in range(count, BY_MINORS)), side] for row, side in zip(rows, right, strict=True)]
    full += [[float(i == j) for j in range(BY_MINORS)] + [0.0] for i in range(count, BY_MINORS)]
    upper, lower = _minors(full[0], full[1]), _minors(full[2], full[3])

    def expand(order: Sequence[int]) -> Value:
        total: Value = 0.0
        for i, j in combinations(range(BY_MINORS), 2):
            k, m = (x for x in range(BY_MINORS) if x not in (i, j))
            sign, one = _signed(upper, order[i], order[j])
            other_sign, other = _signed(lower, order[k], order[m])
            total = plus(total, sign * other_sign * (-1) ** (i + j + 1), times(one, other))
        return total

    determinant = expand(range(BY_MINORS))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        scale = np.divide(1.0, determinant)
        unknowns = [
            expand([BY_MINORS if column == j else column for column in range(BY_MINORS)]) * scale for j in range(count)
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
    good = np.asarray(np.isfinite(matrix).all(axis=(-1, -2)) & np.isfinite(sides).all(axis=-1))
    identity = np.eye(len(rows))
    determinant = np.linalg.det(np.where(good[..., None, None], matrix, identity))
    determinant = np.where(good, determinant, 0.0)
    good &= determinant != 0
    solution = np.linalg.solve(np.where(good[..., None, None], matrix, identity), sides[..., None])[..., 0]
    solution = np.where(good[..., None], solution, np.nan)
    return [solution[..., j] for j in range(len(rows))], determinant
