"""What is known of a mechanism while its groups are solved one after another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mechdesign.mechanism.algebra import Value, plus, rotation, vector
from mechdesign.mechanism.geometry import Vectors
from mechdesign.mechanism.graph import Graph
from mechdesign.mechanism.structure import Group, Loop, Structure
from mechdesign.numerics.arrays import Flags, Floats

# The unknowns of all groups without a closed form, one after another (see `Structure.unknowns`).
Unknowns = Sequence[Value] | Floats
NEWTON_STEPS = 10
# After a correction this small (radians, or parts of the mechanism's size) another one would be below rounding.
CONVERGED = 1e-8


@dataclass
class State:
    """Positions found so far (`None` where not known yet), for given coordinates `given`.

    Groups with a closed form leave their `closures`, with `beyond` also stretched or folded (see
    `mechdesign.mechanism.solve`). The others are solved by at most `steps` of Newton's corrections, until one is below
    `enough` (radians, or parts of the length `size`), and leave their unknowns, which poses converged, and the
    determinant of their equations. `near` are values within half a turn of which angles in given expressions lie.
    """

    graph: Graph
    structure: Structure
    vectors: Vectors
    w: list[Value]
    nodes: list[Any]
    rotations: list[Any]
    ties: list[Value]
    slides: list[Any]
    given: Sequence[Value] = ()
    size: float = 1.0
    steps: int = NEWTON_STEPS
    enough: float = CONVERGED
    beyond: bool = False
    near: Mapping[str, Value] = field(default_factory=dict)
    closures: list[Value] = field(default_factory=list)
    unknowns: list[Value] = field(default_factory=list)
    converged: list[Flags] = field(default_factory=list)
    determinants: list[Value] = field(default_factory=list)

    def solved(self, shape: tuple[int, ...], signs: Sequence[Value] | None = None) -> Flags:
        """Which poses of a batch converged in all groups, with determinants of these signs."""
        found = np.ones(shape, dtype=bool)
        for converged in self.converged:
            found &= converged
        for determinant, sign in zip(self.determinants, signs or (), strict=False):
            found &= np.sign(determinant) == sign
        return found

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

    def gap(self, loop: Loop) -> Value:
        """Known part of a loop's closure error: from the node where it ends to that where it starts."""
        return 0.0 if loop.start == loop.end else self.nodes[loop.start] - self.nodes[loop.end]

    def turn(self, root: int, turn: Value) -> None:
        """Set the rotation of a root and of the classes tied to it."""
        for frame, tie in enumerate(self.structure.ties):
            if tie.root == root:
                self.rotations[frame] = turn if isinstance(self.ties[frame], float) else turn * self.ties[frame]

    def place(self, group: Group) -> None:
        """Place the nodes of a group whose angles and slides are known."""
        for k, sign in group.tree:
            edge = self.structure.edges[k]
            step = self.edge(k)
            if sign > 0:
                self.nodes[edge.head] = self.nodes[edge.tail] + step
            else:
                self.nodes[edge.tail] = self.nodes[edge.head] - step


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
            angle = plus(angle, sign, given[k])
        if tie.given:
            turn = rotation(angle)
        for sign, body in tie.offsets:
            offset = vectors.offsets[body]
            if not isinstance(offset, float):
                turn = np.multiply(turn, offset if sign > 0 else np.conj(offset))
        ties.append(turn)
        rotations.append(turn if tie.root == 0 else None)
    w = [*vectors.w]
    for _, k in structure.spans:
        w.append(given[k])
    for slide, k in structure.known_slides:
        slides[slide] = given[k]
    for k, coordinate in enumerate(structure.given):
        # Half a point may stand in an expression before the other half is known.
        if coordinate.kind in ("x", "y"):
            nodes[coordinate.node] = vector(given[k], np.nan) if coordinate.kind == "x" else vector(np.nan, given[k])
    for node, x, y in structure.known_nodes:
        nodes[node] = vector(given[x], given[y])
    return State(graph, structure, vectors, w, nodes, rotations, ties, slides, given)


def columns(state: State, group: Group, path: Sequence[tuple[int, int]]) -> tuple[Value, list[Value]]:
    """Sum of the signed edges along `path`, and its derivatives with respect to a group's angles and slides."""
    total: Value = 0.0
    by_root: dict[int, Value] = dict.fromkeys(group.angles, 0.0)
    by_slide: dict[int, Value] = dict.fromkeys(group.slides, 0.0)
    for k, sign in path:
        edge = state.structure.edges[k]
        root = state.structure.ties[edge.frame].root
        step = state.edge(k)
        total = plus(total, sign, step)
        if root in by_root:
            by_root[root] = plus(by_root[root], sign, step)
        if edge.slide is not None and edge.slide in by_slide:
            direction = state.turned(state.vectors.d[k], edge.frame)
            by_slide[edge.slide] = plus(by_slide[edge.slide], sign, direction)
    return total, [_quarter_turn(value) for value in by_root.values()] + list(by_slide.values())


def _quarter_turn(value: Value) -> Value:
    """i times a vector; a vector that no edge contributes to stays the plain zero."""
    return value if isinstance(value, float) else vector(-value.imag, value.real)


def scalars(loop_columns: Sequence[Value]) -> tuple[list[Value], list[Value]]:
    """Real and imaginary parts of columns, contiguous in memory."""
    return [_part(c, "real") for c in loop_columns], [_part(c, "imag") for c in loop_columns]


def _part(value: Value, name: str) -> Value:
    if isinstance(value, float):
        return value if name == "real" else 0.0
    part = getattr(value, name)
    return np.ascontiguousarray(part) if np.ndim(part) else part
