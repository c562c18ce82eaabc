"""The loop equations of a mechanism: edges, what closes round a loop, and derivatives of both.

One edge is e = (w + s d) U with U = exp(i theta). Every derivative of it, in time or by an unknown, a drive or a
dimension, consists of a term with the angle's derivative, one with the slide's, and a rest without either:

    e^ = i e theta^ + d U s^ + rest

A loop is a signed sum of edges between two nodes whose places are known, X_start + sum(sign e) - X_end = 0. The columns
of its derivatives by the angles that edges turn with and by slides along them are thus sums of i e and of d U. Edges of
a tree place the other nodes; the same sums of the edges' derivatives give the derivatives of the nodes. Solver,
derivatives, rank and sketch all use these equations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Self

import numpy as np

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism.algebra import Value, Vector, angle_of, dot, nearest, plus, rotation, vector
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.coordinates import Coordinate, angles_of
from mechdesign.mechanism.geometry import Vectors
from mechdesign.mechanism.graph import Edge, Graph
from mechdesign.mechanism.outputs import Rates, first
from mechdesign.mechanism.structure import Group, Loop, Structure, Tie

# Unknowns of groups: of each its angles, its slides, then x and y of its bases (see `Structure.unknowns`).
Unknowns = Sequence[Value] | Floats
# A vector of each edge, by its number.
OfEdges = Callable[[int], Vector]
# Dividing by a vector that has shrunk to nothing gives inf, where Python's own zero would raise.
ZERO = np.float64(0.0)


@dataclass
class Loops:
    """The edges of a structure while its groups are solved; positions that are not solved yet are `None`.

    `given` are the values of the given coordinates, then those of couplings, `w` the vectors of the edges and of given
    distances, and `ties` the rotations of classes against their roots. Angles in expressions lie within half a turn of
    `near`.
    """

    graph: Graph
    structure: Structure
    vectors: Vectors
    w: list[Vector]
    nodes: list[Any]
    rotations: list[Any]
    ties: list[Vector]
    slides: list[Any]
    given: list[Value] = field(default_factory=list)
    near: Mapping[str, Value] = field(default_factory=dict)
    whole: Mapping[str, float] = field(default_factory=dict)
    drawn: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def start(cls, graph: Graph, structure: Structure, vectors: Vectors, given: Sequence[Value]) -> Self:
        """The positions before the first group is solved: the ground and the given coordinates."""
        nodes: list[Any] = [0.0, *[None] * (len(graph.nodes) - 1)]
        slides: list[Any] = [None] * len(graph.slides)
        # What follows from a coupling is not a number before its group is solved, and the gap of one is zero.
        values = [*given, *(np.nan if k in structure.coupled else 0.0 for k in structure.numbers)]
        ties = [tie_rotation(tie, values, vectors) for tie in structure.ties]
        rotations = [
            turn if tie.root == 0 and structure.coupled.isdisjoint(k for _, k in tie.given) else None
            for tie, turn in zip(structure.ties, ties, strict=True)
        ]
        for slide, k in structure.known_slides:
            slides[slide] = values[k]
        for k, coordinate in enumerate(structure.given):
            # An expression may contain the given x of a point whose y is still unknown, or the other way round.
            if coordinate.kind in ("x", "y"):
                pair = (given[k], np.nan) if coordinate.kind == "x" else (np.nan, given[k])
                nodes[coordinate.node] = vector(*pair)
        for node, x, y in structure.known_nodes:
            nodes[node] = vector(given[x], given[y])
        w = [*vectors.w, *(given[k] for _, k in structure.spans)]
        return cls(graph, structure, vectors, w, nodes, rotations, ties, slides, values)

    def arm(self, k: int) -> Vector:
        """Vector w + s d of an edge in the frame of its class."""
        slide = self.structure.edges[k].slide
        return self.w[k] if slide is None else self.w[k] + self.slides[slide] * self.vectors.d[k]

    def turned(self, arm: Vector, frame: int) -> Vector:
        """A vector of a class's frame in the world."""
        turn = self.rotations[frame]
        return arm if isinstance(turn, float) else arm * turn

    def edge(self, k: int) -> Vector:
        """World vector of an edge whose rotation and slide are known."""
        return self.turned(self.arm(k), self.structure.edges[k].frame)

    def direction(self, k: int) -> Vector:
        """World direction of an edge's slide; zero of an edge that has none."""
        return self.turned(self.vectors.d[k], self.structure.edges[k].frame)

    def chord(self, k: int) -> Vector:
        """World vector from the tail to the head of an edge, whose positions are known."""
        edge = self.structure.edges[k]
        span: Vector = self.nodes[edge.head] - self.nodes[edge.tail]
        return span

    def displacement(self, k: int) -> Value:
        """Displacement of an edge's slide from the positions of its ends and its rotation, which are known."""
        frame = self.structure.edges[k].frame
        return dot(self.chord(k) - self.turned(self.w[k], frame), self.direction(k))

    def change(self, k: int, angles: Sequence[Value], slides: Sequence[Value], rest: Vector = 0.0) -> Vector:
        """Derivative of an edge's world vector, from the derivatives of all angles and slides and its `rest`."""
        edge = self.structure.edges[k]
        if not nothing(angles[edge.frame]):
            rest = plus(rest, 1, self.edge(k) * (1j * angles[edge.frame]))
        if edge.slide is not None and not nothing(slides[edge.slide]):
            rest = plus(rest, 1, slides[edge.slide] * self.direction(k))
        return rest

    def turn(self, root: int, turn: Vector) -> None:
        """Set the rotation of a root and of the classes tied to it."""
        for frame, tie in enumerate(self.structure.ties):
            if tie.root == root:
                self.rotations[frame] = turn if isinstance(self.ties[frame], float) else turn * self.ties[frame]

    def couple(self, group: Group) -> None:
        """Set the coordinates that follow by a coupled group's function of positions which are known."""
        (k,) = group.conditions
        self.count_turns(group)
        self.given[k] = self.pose().value(self.structure.values[k])
        for frame, tie in enumerate(self.structure.ties):
            if any(k == number for _, number in tie.given):
                self.ties[frame] = tie_rotation(tie, self.given, self.vectors)
                root = self.rotations[tie.root]
                if root is not None:
                    self.rotations[frame] = self.ties[frame] if tie.root == 0 else root * self.ties[frame]
        for slide, number in self.structure.known_slides:
            if number == k:
                self.slides[slide] = self.given[k]

    def gaps(self, group: Group) -> list[Value]:
        """What a group's conditions miss their values by."""
        configuration = self.pose()
        return [configuration.value(self.structure.values[k]) - self.given[k] for k in group.conditions]

    def count_turns(self, group: Group) -> None:
        """Count the turns of the angles in a group's conditions that are sums of values."""
        if group.conditions:
            angles = angles_of(self.structure.values[k] for k in group.conditions)
            self.near = {**self.near, **self.counted(angles.values())}

    def counted(self, angles: Iterable[Coordinate]) -> dict[str, Value]:
        """By name, the angles that are sums of values, whose turns therefore count."""
        counted: dict[str, Value] = {}
        for angle in angles:
            pair = self.structure.counted(angle, self.graph)
            if pair is not None:
                offsets = {
                    body: nearest(angle_of(np.asarray(turn)), self.drawn.get(body, 0.0))
                    for body, turn in self.vectors.offsets.items()
                }
                one, other = (tied(tie, self.given, offsets) for tie in pair)
                turned = one - other + offsets[angle.body] - offsets[angle.reference]
                counted[angle.name] = turned - self.whole.get(angle.name, 0.0)
        return counted

    def put(self, group: Group, unknowns: Unknowns) -> None:
        """Set a group's angles, slides and, behind the slides, the x and y of its bases."""
        rest = iter(unknowns)
        for root, value in zip(group.angles, rest, strict=False):
            self.turn(root, rotation(value))
        for slide, value in zip(group.slides, rest, strict=False):
            self.slides[slide] = value
        for base, x, y in zip(group.bases, rest, rest, strict=False):
            self.nodes[base] = vector(x, y)

    def place(self, group: Group) -> None:
        """Place the nodes of a group whose angles and slides are known."""
        walk(self.structure.edges, group.tree, self.nodes, self.edge)

    def columns(
        self, group: Group, path: Sequence[tuple[int, int]], edge: OfEdges | None = None, along: OfEdges | None = None
    ) -> tuple[Vector, list[Vector]]:
        """Sum of the signed edges along `path`, and its derivatives with respect to a group's angles and slides.

        `edge` and `along` may give other vectors in place of the edges and the directions of their slides, such as the
        derivatives of these.
        """
        edge, along = edge or self.edge, along or self.direction
        total: Vector = 0.0
        by_root: dict[int, Vector] = dict.fromkeys(group.angles, 0.0)
        by_slide: dict[int, Vector] = dict.fromkeys(group.slides, 0.0)
        for k, sign in path:
            frame, slide = self.structure.edges[k].frame, self.structure.edges[k].slide
            root, step = self.structure.ties[frame].root, edge(k)
            total = plus(total, sign, step)
            if root in by_root:
                by_root[root] = plus(by_root[root], sign, step)
            if slide is not None and slide in by_slide:
                by_slide[slide] = plus(by_slide[slide], sign, along(k))
        return total, [_quarter_turn(value) for value in by_root.values()] + list(by_slide.values())

    def equations(self, group: Group) -> tuple[list[list[Value]], list[Value]]:
        """Matrix (a list of rows) and residuals of a group's equations at its angles, slides and bases."""
        rows: list[list[Value]] = []
        errors: list[Value] = []
        for loop in group.loops:
            total, derivatives = self.columns(group, loop.edges)
            rows += rows_of([derivatives + base_columns(group, loop)])
            gap = plus(gap_of(loop, self.nodes), 1, total)
            errors += [gap.real, gap.imag]
        if group.conditions:
            self.place(group)
            rows += self.condition_rows(group)
            errors += self.gaps(group)
        return rows, errors

    def condition_rows(self, group: Group) -> list[list[Value]]:
        """Derivatives of a group's conditions with respect to its unknowns, at positions that are placed."""
        configuration, moves = self.pose(), self._moves(group)
        return [[first(configuration, self.structure.values[k], move) for move in moves] for k in group.conditions]

    def _moves(self, group: Group) -> list[Rates]:
        """Derivatives of every position with respect to each of a group's unknowns."""
        moves = []
        count = len(group.angles) + len(group.slides)
        for j in range(count + 2 * len(group.bases)):
            own = iter([float(j == k) for k in range(count)])
            roots, slides = dict(zip(group.angles, own, strict=False)), dict(zip(group.slides, own, strict=False))
            angles = [roots.get(tie.root, 0.0) for tie in self.structure.ties]
            shifts = [slides.get(slide, 0.0) for slide in range(len(self.slides))]
            nodes: list[Vector] = [0.0j] * len(self.nodes)
            if j >= count:
                nodes[group.bases[(j - count) // 2]] = 1j if (j - count) % 2 else 1.0 + 0j
            walk(self.structure.edges, group.tree, nodes, partial(self.change, angles=angles, slides=shifts))
            moves.append(Rates(nodes, angles, shifts, {}))
        return moves

    def dyad(self, group: Group) -> tuple[Vector, dict[int, Vector], dict[int, Vector]]:
        """A dyad's loop: known vector k, vector z that turns with each unknown angle, direction d of each slide.

        z and d of a link that turns are in the frame of its angle's root, so that they do not contain the unknowns.
        """
        structure = self.structure
        loop = group.loops[0]
        k: Vector = ZERO if loop.start == loop.end else gap_of(loop, self.nodes)
        z: dict[int, Vector] = dict.fromkeys(group.angles, ZERO)
        d: dict[int, Vector] = {}
        for index, sign in loop.edges:
            edge = structure.edges[index]
            root = structure.ties[edge.frame].root
            unknown_slide = edge.slide is not None and edge.slide in group.slides
            arm = self.w[index] if unknown_slide else self.arm(index)
            if root in z:
                arm = arm if isinstance(self.ties[edge.frame], float) else arm * self.ties[edge.frame]
                z[root] = plus(z[root], sign, arm)
                if unknown_slide:
                    direction = self.vectors.d[index]
                    d[edge.slide or 0] = sign * direction * self.ties[edge.frame]
            else:
                k = plus(k, sign, self.turned(arm, edge.frame))
                if unknown_slide:
                    d[edge.slide or 0] = sign * self.direction(index)
        return k, z, d

    def pose(self) -> Configuration:
        """The positions solved so far as a configuration, for values of coordinates."""
        return Configuration(
            self.graph, self.vectors, (), self.nodes, self.rotations, self.slides, [], np.zeros((), np.int8), {},
            self.near,
        )  # fmt: skip


def tied(tie: Tie, given: Sequence[Value], offsets: Mapping[str, Value]) -> Value:
    """Angle of a class against its root, or its derivative, from given coordinates and bodies' offsets or theirs."""
    total: Value = 0.0
    for sign, k in tie.given:
        total = plus(total, sign, given[k])
    for sign, body in tie.offsets:
        total = plus(total, sign, offsets.get(body, 0.0))
    return total


def base_columns(group: Group, loop: Loop) -> list[Vector]:
    """Derivatives of a loop's closure with respect to x and y of a group's bases."""
    ends = [float((base == loop.start) - (base == loop.end)) for base in group.bases]
    return [part for end in ends for part in (end, end * 1j)]


def tie_rotation(tie: Tie, given: Sequence[Value], vectors: Vectors) -> Vector:
    """Rotation of a class against its root."""
    turn: Vector = rotation(tied(tie, given, {})) if tie.given else 1.0
    for sign, body in tie.offsets:
        offset = vectors.offsets[body]
        if not isinstance(offset, float):
            turn = np.multiply(turn, offset if sign > 0 else np.conj(offset))
    return turn


def gap_of(loop: Loop, nodes: Sequence[Vector]) -> Vector:
    """Vector from the node where a loop ends to the node where it starts, or a derivative of this vector."""
    return 0.0 if loop.start == loop.end else plus(nodes[loop.start], -1, nodes[loop.end])


def walk(edges: Sequence[Edge], tree: Sequence[tuple[int, int]], nodes: list[Vector], step: OfEdges) -> None:
    """Place nodes along signed edges from nodes already placed; or add up derivatives in the same way."""
    for k, sign in tree:
        begin, end = (edges[k].tail, edges[k].head) if sign > 0 else (edges[k].head, edges[k].tail)
        nodes[end] = plus(nodes[begin], sign, step(k))


def unknowns_of(
    group: Group, nodes: Sequence[Vector], rotations: Sequence[Vector], slides: Sequence[Value]
) -> list[Value]:
    """A group's angles, slides, and x and y of its bases, at given positions; see `Loops.put`."""
    unknowns: list[Value] = [angle_of(np.asarray(rotations[root])) for root in group.angles]
    unknowns += [slides[slide] for slide in group.slides]
    return unknowns + [part for base in group.bases for part in (nodes[base].real, nodes[base].imag)]


def nothing(value: Vector) -> bool:
    """Whether a value is the number 0, the derivative of a constant."""
    return isinstance(value, float) and value == 0.0


def _quarter_turn(value: Vector) -> Vector:
    """i times a vector; the number 0 stays the number 0."""
    return value if isinstance(value, float) else vector(-value.imag, value.real)


def rows_of(lines: Sequence[Sequence[Vector]]) -> list[list[Value]]:
    """Loop equations as rows of a real matrix: of each line of columns the real and the imaginary parts."""
    parts = [part for line in lines for part in ([z.real for z in line], [z.imag for z in line])]
    return [[_contiguous(value) for value in row] for row in parts]


def _contiguous(part: Value) -> Value:
    return part if isinstance(part, float) or not part.ndim else np.ascontiguousarray(part)
