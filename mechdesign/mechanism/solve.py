"""Run a compiled structure for a batch: closed forms group by group, Newton's method where a group has none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.mechanism import dyads
from mechdesign.mechanism.algebra import Value, plus, rotation, vector
from mechdesign.mechanism.geometry import Vectors
from mechdesign.mechanism.graph import Graph
from mechdesign.mechanism.structure import Group, Loop, Structure

Guess = Mapping[int, tuple[Sequence[Value], Sequence[Value]]]
NEWTON_STEPS = 10
# After a correction this small a further one would be below rounding (Newton's method converges quadratically).
CONVERGED = 1e-8
# Dividing by a vector that has shrunk to nothing gives inf, where Python's own zero would raise.
ZERO = np.float64(0.0)


@dataclass
class State:
    """Positions found so far; `None` where nothing is known yet."""

    structure: Structure
    vectors: Vectors
    w: list[Value]
    nodes: list[Any]
    rotations: list[Any]
    ties: list[Value]
    slides: list[Any]
    closures: list[Value] = field(default_factory=list)
    # Newton groups only: whether each pose converged, and the determinant of the group's loop equations.
    converged: list[NDArray[np.bool_]] = field(default_factory=list)
    determinants: list[NDArray[np.float64]] = field(default_factory=list)

    def arm(self, k: int) -> Value:
        """Vector w + s d of an edge in the frame of its class."""
        slide = self.structure.edges[k].slide
        return self.w[k] if slide is None else self.w[k] + self.slides[slide] * self.vectors.d[k]

    def turned(self, arm: Value, frame: int) -> Value:
        """A vector of a class's frame in the world."""
        turn = self.rotations[frame]
        return arm if isinstance(turn, float) else arm * turn

    def edge(self, k: int) -> Value:
        """World vector of an edge whose rotation and slide are known."""
        return self.turned(self.arm(k), self.structure.edges[k].frame)


def start_state(graph: Graph, structure: Structure, vectors: Vectors, given: Sequence[Value]) -> State:
    """What is known before the first group: the ground, the given coordinates, and the ties between classes."""
    nodes: list[Any] = [None] * len(graph.nodes)
    nodes[0] = 0.0
    slides: list[Any] = [None] * len(graph.slides)
    ties: list[Value] = []
    rotations: list[Any] = []
    for tie in structure.ties:
        turn: Value = 1.0
        angle: Value = 0.0
        for sign, k in tie.given:
            angle = angle + sign * given[k]
        if tie.given:
            turn = rotation(angle)
        for sign, body in tie.offsets:
            offset = vectors.offsets[body]
            if not isinstance(offset, float):
                turn = turn * (offset if sign > 0 else np.conj(offset))
        ties.append(turn)
        rotations.append(turn if tie.root == 0 else None)
    w = [*vectors.w]
    for _, k in structure.spans:
        w.append(given[k])
    for slide, k in structure.known_slides:
        slides[slide] = given[k]
    for node, x, y in structure.known_nodes:
        nodes[node] = vector(given[x], given[y])
    return State(structure, vectors, w, nodes, rotations, ties, slides)


def run(state: State, modes: Sequence[int], guess: Guess | None = None, given: Sequence[Value] = ()) -> State:
    """Solve all groups in order; Newton groups start from `guess` (angles of roots, slides), by group."""
    for index, group in enumerate(state.structure.groups):
        if group.form == "newton":
            assert guess is not None
            _newton(state, group, *guess[index], given)
        elif group.form != "place":
            _closed_form(state, group, modes[index])
        for k, sign in group.tree:
            edge = state.structure.edges[k]
            step = state.edge(k)
            if sign > 0:
                state.nodes[edge.head] = state.nodes[edge.tail] + step
            else:
                state.nodes[edge.tail] = state.nodes[edge.head] - step
    return state


def _set_rotation(state: State, root: int, turn: Value) -> None:
    for frame, tie in enumerate(state.structure.ties):
        if tie.root == root:
            state.rotations[frame] = turn if isinstance(state.ties[frame], float) else turn * state.ties[frame]


def _closed_form(state: State, group: Group, mode: int) -> None:
    structure = state.structure
    loop = group.loops[0]
    k: Value = ZERO if loop.start == loop.end else state.nodes[loop.start] - state.nodes[loop.end]
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
    if group.form == "two angles":
        first, second = group.angles
        u1, u2, closures = dyads.two_angles(k, z[first], z[second], mode)
        _set_rotation(state, first, u1)
        _set_rotation(state, second, u2)
    elif group.form == "two slides":
        one, two = group.slides
        state.slides[one], state.slides[two], closures = dyads.two_slides(k, d[one], d[two])
    else:
        solve = dyads.angle_and_fixed_slide if "fixed" in group.form else dyads.angle_and_turning_slide
        (root,), (slide,) = group.angles, group.slides
        u, state.slides[slide], closures = solve(k, z[root], d[slide], mode)
        _set_rotation(state, root, u)
    state.closures.extend(closures)


def loop_sum(state: State, loop: Loop) -> Value:
    """Closure error of a loop."""
    total: Value = 0.0 if loop.start == loop.end else state.nodes[loop.start] - state.nodes[loop.end]
    for k, sign in loop.edges:
        total = plus(total, sign, state.edge(k))
    return total


def columns(state: State, group: Group, path: Sequence[tuple[int, int]]) -> list[Value]:
    """Derivatives of the sum of signed edges along `path` with respect to a group's angles and slides."""
    by_root: dict[int, Value] = dict.fromkeys(group.angles, 0.0)
    by_slide: dict[int, Value] = dict.fromkeys(group.slides, 0.0)
    for k, sign in path:
        edge = state.structure.edges[k]
        root = state.structure.ties[edge.frame].root
        if root in by_root:
            by_root[root] = plus(by_root[root], sign, state.edge(k))
        if edge.slide is not None and edge.slide in by_slide:
            direction = state.turned(state.vectors.d[k], edge.frame)
            by_slide[edge.slide] = plus(by_slide[edge.slide], sign, direction)
    return [1j * value for value in by_root.values()] + list(by_slide.values())


def _path_to(state: State, group: Group, node: int) -> list[tuple[int, int]]:
    """Signed tree edges from a known node to `node`."""
    edges = state.structure.edges
    into = {(edges[k].head if sign > 0 else edges[k].tail): (k, sign) for k, sign in group.tree}
    path: list[tuple[int, int]] = []
    while node in into:
        k, sign = into[node]
        path.append((k, sign))
        node = edges[k].tail if sign > 0 else edges[k].head
    return path


def _newton(
    state: State, group: Group, angles: Sequence[Value], slides: Sequence[Value], given: Sequence[Value]
) -> None:
    theta = [np.array(a, dtype=float) for a in angles]
    s = [np.array(a, dtype=float) for a in slides]
    paths = [_path_to(state, group, node) for node, _, _ in group.fixed]
    active: NDArray[np.bool_] | None = None
    determinant: NDArray[np.float64] = np.zeros(())
    for _ in range(NEWTON_STEPS):
        for root, value in zip(group.angles, theta, strict=True):
            _set_rotation(state, root, rotation(value))
        for slide, value in zip(group.slides, s, strict=True):
            state.slides[slide] = value
        equations: list[Value] = []
        rows: list[list[Value]] = []
        for loop in group.loops:
            error, derivatives = loop_sum(state, loop), columns(state, group, loop.edges)
            for part in ("real", "imag"):
                equations.append(getattr(error, part))
                rows.append([getattr(np.asarray(c), part) for c in derivatives])
        for (node, axis, which), path in zip(group.fixed, paths, strict=True):
            part = "real" if axis == "x" else "imag"
            origin = node
            for k, sign in path:
                edge = state.structure.edges[k]
                origin = edge.tail if sign > 0 else edge.head
            place = state.nodes[origin] + sum(sign * state.edge(k) for k, sign in path)
            equations.append(getattr(place, part) - given[which])
            rows.append([getattr(np.asarray(c), part) for c in columns(state, group, path)])
        shape = np.broadcast_shapes(*(np.shape(e) for e in equations), *(np.shape(a) for a in (*theta, *s)))
        right = np.stack([np.broadcast_to(e, shape) for e in equations], axis=-1)
        matrix = np.stack([np.stack([np.broadcast_to(c, shape) for c in row], axis=-1) for row in rows], axis=-2)
        finite = np.isfinite(matrix).all(axis=(-1, -2)) & np.isfinite(right).all(axis=-1)
        matrix = np.where(finite[..., None, None], matrix, np.eye(matrix.shape[-1]))
        determinant = np.linalg.det(matrix)
        regular = finite & (determinant != 0)
        matrix = np.where(regular[..., None, None], matrix, np.eye(matrix.shape[-1]))
        step = np.linalg.solve(matrix, right[..., None])[..., 0]
        if active is not None:
            # A pose that has converged is left alone: the result of a pose must not depend on its batch.
            step = np.where(active[..., None], step, 0.0)
        size = np.abs(step).max(axis=-1)
        theta = [value - step[..., i] for i, value in enumerate(theta)]
        s = [value - step[..., len(theta) + i] for i, value in enumerate(s)]
        moving = ~(regular & (size < CONVERGED))
        active = moving if active is None else active & moving
        if not active.any():
            break
    for root, value in zip(group.angles, theta, strict=True):
        _set_rotation(state, root, rotation(value))
    for slide, value in zip(group.slides, s, strict=True):
        state.slides[slide] = value
    assert active is not None
    state.converged.append(~active)
    state.determinants.append(determinant)
