"""Velocities, accelerations, Jacobians and sensitivities at a solved configuration, all in closed form.

All of them solve the loop equations of a group with the same small matrix and different right-hand sides
[S3, eqs. 9-12]: those of the `rest` of each edge e = m U, m = w + s d (see `mechdesign.mechanism.loops`). Below, x' is
a time derivative and x_z a derivative with respect to a dimension:

    e'    rest = 0
    e''   rest = (2 i theta' s' d - theta'^2 m) U
    e_z   rest = (w_z + s d_z) U
    e'_z  rest = (i theta' m_z + s' d_z + i theta_z m') U + i theta_z i theta' e
    e''_z rest = (s'' d_z + 2 i theta'_z s' d + 2 i theta' m'_z - 2 theta' theta'_z m + (i theta'' - theta'^2) m_z
                 + i theta_z (m'' + 2 i theta' m' + (i theta'' - theta'^2) m)) U

A coupling q = f(p) is one equation more: q' = f_p p', and what else its derivatives have is a rest as well.

They are always computed in the Assur groups of the drives, whichever coordinates the configuration was solved from.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism.algebra import Either, Value, Vector, added, cross, dot, plus, times, vector
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.geometry import Geometry
from mechdesign.mechanism.loops import Loops, base_columns, gap_of, nothing, rows_of, tied, walk
from mechdesign.mechanism.outputs import Rates, acceleration_sensitivity, first, second
from mechdesign.mechanism.solve import solve_linear
from mechdesign.mechanism.structure import Group, Structure

# Below this regularity a pose is singular: at a dead centre the angle between links is accurate to the root of rounding
# only, so that rates are mostly rounding.
STALLED = 1e-6

# Derivative of a coordinate at configurations, from the derivatives of positions that are solved so far.
Derived = Callable[[Configuration, Coordinate, Rates], Value]


class Linearization(Loops):
    """The loop equations of the drives' groups at a configuration, ready to be solved for any right-hand side."""

    def __init__(self, structure: Structure, geometry: Geometry, configuration: Configuration) -> None:
        vectors = configuration.vectors
        super().__init__(
            configuration.graph, structure, vectors, list(vectors.w), list(configuration.nodes),
            list(configuration.rotations), [], list(configuration.slides),
        )  # fmt: skip
        self.geometry = geometry
        self.configuration = configuration
        self._columns: dict[int, list[list[Vector]]] = {}
        self._conditions: dict[int, list[list[Value]]] = {}
        self._scales: dict[int, Value] = {}
        self._edges: dict[int, Vector] = {}

    def edge(self, k: int) -> Vector:
        """World vector of an edge."""
        if k not in self._edges:
            self._edges[k] = super().edge(k)
        return self._edges[k]

    def pose(self) -> Configuration:
        """The configuration."""
        return self.configuration

    def rows(self, index: int, group: Group) -> list[list[Value]]:
        """Matrix of a group's equations: of its loops, x and y, then of its conditions."""
        if index not in self._conditions:
            self._conditions[index] = self.condition_rows(group) if group.conditions else []
        return rows_of(self.loop_columns(index, group)) + self._conditions[index]

    def loop_columns(self, index: int, group: Group) -> list[list[Vector]]:
        """Per loop of a group, the derivatives of its closure with respect to the group's unknowns."""
        if index not in self._columns:
            self._columns[index] = [
                self.columns(group, loop.edges)[1] + base_columns(group, loop) for loop in group.loops
            ]
        return self._columns[index]

    @cached_property
    def conditionings(self) -> dict[int, Value]:
        """By index of the drives' groups, their distance from a singularity: from -1 to 1, zero at a singularity.

        The determinant of its loop equations over the product of the lengths of its columns, whichever loops these are;
        for two links that meet it is the sine of the angle between them. It changes its sign where the motion passes a
        forward singularity.
        """
        groups = [(k, group) for k, group in enumerate(self.structure.groups) if group.solved]
        signed: dict[int, Value] = {}
        for (index, group), determinant in zip(groups, determinants(self), strict=True):
            lines, count = self.loop_columns(index, group), group.unknowns
            columns = [[line[j] for line in lines] for j in range(count)]
            sizes = [inner(self.structure.metrics[index], column, column) for column in columns]
            for row in self.rows(index, group)[2 * len(lines) :]:
                sizes = [size + value * value for size, value in zip(sizes, row, strict=True)]
            signed[index] = determinant / np.sqrt(math.prod(sizes))
        return signed

    def _solve_group(self, index: int, group: Group, right: list[Vector], gaps: list[Value]) -> list[Value]:
        if not group.dyad:
            sides = [part for value in right for part in (-value.real, -value.imag)]
            return solve_linear(self.rows(index, group), [*sides, *(-1.0 * gap for gap in gaps)])[0]
        ((a, b),) = self.loop_columns(index, group)
        scale = self._scale(index, a, b)
        return [cross(right[0], b) * scale, cross(a, right[0]) * scale]

    def hold_group(self, index: int, group: Group, moving: Sequence[Value]) -> tuple[list[Vector], list[Value]]:
        """Forces that hold a group's loops closed against what would move its unknowns, and efforts of its conditions.

        There is one of each loop, and one of each condition. They solve the transposed equations, matrix^T f = -moving.
        """
        if not group.dyad:
            sides = [-1.0 * value for value in moving]
            parts = solve_linear(list(zip(*self.rows(index, group), strict=True)), sides)[0]
            count = 2 * len(group.loops)
            return [vector(parts[k], parts[k + 1]) for k in range(0, count, 2)], parts[count:]
        ((a, b),) = self.loop_columns(index, group)
        p, q = (value * self._scale(index, a, b) for value in moving)
        along = q * a - p * b
        return [vector(-along.imag, along.real)], []

    def _scale(self, index: int, a: Vector, b: Vector) -> Value:
        if index not in self._scales:
            self._scales[index] = -1 / cross(a, b)
        return self._scales[index]

    def _solve(
        self, given: Sequence[Value], rest: Sequence[Vector], rates: Rates | None = None, derived: Derived = first
    ) -> Rates:
        """Derivatives of all positions from those of drives, and the `rest` of each edge.

        Offsets of bodies and parameters have those of `rates`. `derived` gives the derivative of a coordinate from the
        derivatives of the positions that it follows from.
        """
        structure = self.structure
        offsets, parameters = (rates.offsets, rates.parameters) if rates is not None else ({}, {})
        values = [*given, *(0.0 for _ in structure.numbers)]
        angles = [tied(tie, values, offsets) for tie in structure.ties]
        slides: list[Value] = [0.0] * len(self.slides)
        for slide, k in structure.known_slides:
            slides[slide] = values[k]
        nodes: list[Any] = [0.0, *[None] * (len(self.nodes) - 1)]
        so_far = Rates(nodes, angles, slides, offsets, parameters)

        def step(k: int) -> Vector:
            return self.change(k, angles, slides, rest[k])

        for index, group in enumerate(structure.groups):
            if group.form == "coupled":
                (number,) = group.conditions
                value = derived(self.configuration, structure.values[number], so_far)
                for frame, tie in enumerate(structure.ties):
                    for sign, k in tie.given:
                        angles[frame] = plus(angles[frame], sign, value if k == number else 0.0)
                for slide, k in structure.known_slides:
                    slides[slide] = value if k == number else slides[slide]
            elif group.solved:
                right = []
                for loop in group.loops:
                    total = gap_of(loop, nodes)
                    for k, sign in loop.edges:
                        total = plus(total, sign, step(k))
                    right.append(total)
                if group.conditions:
                    for base in group.bases:
                        nodes[base] = 0.0
                    walk(structure.edges, group.tree, nodes, step)
                gaps = [derived(self.configuration, structure.values[k], so_far) for k in group.conditions]
                unknowns = self._solve_group(index, group, right, gaps)
                for root, unknown in zip(group.angles, unknowns, strict=False):
                    for frame, tie in enumerate(structure.ties):
                        if tie.root == root:
                            angles[frame] = plus(angles[frame], 1, unknown)
                rest_of = iter(unknowns[len(group.angles) :])
                for slide, unknown in zip(group.slides, rest_of, strict=False):
                    slides[slide] = unknown
                for base, x, y in zip(group.bases, rest_of, rest_of, strict=False):
                    nodes[base] = vector(x, y)
            walk(structure.edges, group.tree, nodes, step)
        return so_far

    def velocity(self, rates: Sequence[Value]) -> Rates:
        """Velocities for given drive rates (radians and lengths per time), or derivatives along any change of them."""
        return self._solve(rates, [0.0] * len(self.structure.edges))

    @cached_property
    def by_drives(self) -> list[Rates]:
        """Derivatives of all positions by each drive, per radian."""
        count = len(self.structure.given)
        return [self.velocity([float(j == k) for j in range(count)]) for k in range(count)]

    def acceleration(self, velocity: Rates, accelerations: Sequence[Value]) -> Rates:
        """Accelerations for given drive accelerations."""
        rest: list[Vector] = []
        for k, edge in enumerate(self.structure.edges):
            omega = velocity.angles[edge.frame]
            total: Vector = 0.0
            if not nothing(omega):
                total = self.edge(k) * (-omega * omega)
                if edge.slide is not None:
                    total = total + self.direction(k) * (2j * omega * velocity.slides[edge.slide])
            rest.append(total)
        return self._solve(
            accelerations, rest, derived=lambda pose, c, rates: second(pose, c, velocity, velocity, rates)
        )

    def sensitivity(self, places: Sequence[str]) -> Rates:
        """Derivatives with respect to dimensions, the drives held; a leading axis runs over `places`.

        Drives may be among them: the derivative is then that with respect to the drive.
        """
        given, explicit, offsets = self._explicit(places)
        rest = self._rests(explicit)
        axes = (1,) * len(self.configuration.shape)
        parameters = {
            name: np.array([float(place == own) for place in places]).reshape(-1, *axes)
            for name, own in self.geometry.measured.items()
        }
        return self._solve(given, rest, Rates([], [], [], offsets, parameters))

    def rate_sensitivity(
        self, places: Sequence[str], position: Rates, velocity: Rates, acceleration: Rates
    ) -> tuple[Rates, Rates]:
        """Derivatives of velocities and accelerations with respect to dimensions; `position` from `sensitivity`."""
        _, explicit, _ = self._explicit(places)
        none, edges = [0.0] * len(self.structure.given), self.structure.edges
        s, s1, s2, s_z = map(self._along, (self.slides, velocity.slides, acceleration.slides, position.slides))
        rest: list[Vector] = []
        arms: list[tuple[Vector, ...]] = []
        for k, edge in enumerate(edges):
            (w_z, d_z), d, m = explicit[k], self.vectors.d[k], self.arm(k)
            omega, turn_z = velocity.angles[edge.frame], position.angles[edge.frame]
            m_z, m1 = w_z + s[k] * d_z + s_z[k] * d, s1[k] * d
            arms.append((m, m_z, m1, d, d_z))
            here = added(1j * omega * m_z, s1[k] * d_z, 1j * turn_z * added(m1, 1j * omega * m))
            rest.append(self.turned(here, edge.frame))
        velocity_z = self._solve(none, rest, derived=lambda pose, c, rates: second(pose, c, velocity, position, rates))
        s1_z = self._along(velocity_z.slides)
        for k, edge in enumerate(edges):
            m, m_z, m1, d, d_z = arms[k]
            omega, turn_z = velocity.angles[edge.frame], position.angles[edge.frame]
            alpha, omega_z = acceleration.angles[edge.frame], velocity_z.angles[edge.frame]
            m1_z, bend = s1_z[k] * d + s1[k] * d_z, 1j * alpha - omega * omega
            here = added(
                s2[k] * d_z, 2j * omega_z * m1, 2j * omega * m1_z, -2 * omega * omega_z * m, bend * m_z,
                1j * turn_z * added(s2[k] * d, 2j * omega * m1, bend * m),
            )  # fmt: skip
            rest[k] = self.turned(here, edge.frame)
        return velocity_z, self._solve(
            none, rest,
            derived=lambda pose, c, rates: acceleration_sensitivity(
                pose, c, (velocity, acceleration), (position, velocity_z, rates)
            ),
        )  # fmt: skip

    def column_sensitivity(self, group: Group, places: Sequence[str], position: Rates) -> list[list[Vector]]:
        """Derivatives of `loop_columns` with respect to dimensions; `position` from `sensitivity`."""
        _, explicit, _ = self._explicit(places)
        rest = self._rests(explicit)

        def edge_z(k: int) -> Vector:
            return self.change(k, position.angles, position.slides, rest[k])

        def direction_z(k: int) -> Vector:
            frame = self.structure.edges[k].frame
            return self.turned(explicit[k][1], frame) + 1j * position.angles[frame] * self.direction(k)

        return [self.columns(group, loop.edges, edge_z, direction_z)[1] for loop in group.loops]

    def _rests(self, explicit: Sequence[tuple[Vector, Vector]]) -> list[Vector]:
        """The `rest` of each edge's derivatives with respect to dimensions."""
        pairs = zip(explicit, self._along(self.slides), self.structure.edges, strict=True)
        return [self.turned(plus(w, 1, times(s, d)), edge.frame) for (w, d), s, edge in pairs]

    def _along(self, slides: Sequence[Value]) -> list[Value]:
        """Displacements, or derivatives of them, by edge; zero for edges without a slide."""
        return [0.0 if edge.slide is None else slides[edge.slide] for edge in self.structure.edges]

    def _explicit(self, places: Sequence[str]) -> tuple[list[Value], list[tuple[Vector, Vector]], dict[str, Value]]:
        configuration = self.configuration
        axes = (1,) * len(configuration.shape)

        def lead(values: Sequence[Either]) -> Either:
            if any(np.ndim(value) for value in values):
                return np.stack([np.broadcast_to(value, configuration.shape) for value in values])
            array = np.array(values)
            return array.reshape((len(values), *axes)) if array.any() else 0.0

        drives = [coordinate.name for coordinate in self.structure.given]
        given = [lead([float(place == drive) for place in places]) for drive in drives]
        sizes = configuration.places
        # Nominal vectors are numbers, the same for every pose.
        vectors = configuration.vectors if sizes else self.geometry.nominal
        changes = [self.geometry.derivatives(place, sizes, vectors) for place in places]
        explicit = [
            (lead([w[k] for w, _ in changes]), lead([d[k] for _, d in changes]))
            for k in range(len(self.structure.edges))
        ]
        offsets = {
            body: lead([self.geometry.angle_derivative(turns, place, sizes) for place in places])
            for body, (_, turns) in self.geometry.graph.bodies.items()
            if turns
        }
        return given, explicit, offsets


def determinants(linearization: Linearization) -> list[Value]:
    """Per group of the drives' structure, the determinant of its loop equations; zero at a forward singularity."""
    values = []
    for index, group in enumerate(linearization.structure.groups):
        if not group.solved:
            continue
        if group.dyad:
            values.append(cross(*linearization.loop_columns(index, group)[0]))
        else:
            rows = linearization.rows(index, group)
            values.append(solve_linear(rows, [0.0] * len(rows))[1])
    return values


def inner(metric: Floats, one: Sequence[Vector], other: Sequence[Vector]) -> Value:
    """Inner product of two columns of loop equations, a vector each loop, by the metric of the loops."""
    total: Value = 0.0
    for j, k in zip(*np.nonzero(metric), strict=True):
        a, b = one[j], other[k]
        # A loop without the unknown has the number 0.
        if not any(isinstance(value, float) and value == 0.0 for value in (a, b)):
            total = total + float(metric[j, k]) * dot(a, b)
    return total


def regularity(linearization: Linearization) -> Value:
    """How far the drives are from a singularity, for each pose: 0 at one, at most 1; the smallest over the groups."""
    least: Value = 1.0
    for conditioning in linearization.conditionings.values():
        least = np.minimum(least, np.abs(conditioning))
    return least
