"""A mechanism by whichever of its angles and slides determine it best: regular where the drives are not.

All positions are the angles of the classes and the slides, an array `x`. A chart is as many of them as the mobility,
from which the others follow. Its assembly is that of `x`, which need be accurate only enough to tell it: the sign of a
group's determinant at `x` is its assembly mode, and Newton's method starts there.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import qr

from mechdesign.ground.errors import MechanismError
from mechdesign.ground.notation import Step
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.mechanism.algebra import TURN, Value, cross, rotation
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.coordinates import Coordinate, Coupled, angles_of, corners_of
from mechdesign.mechanism.decomposition import compile_structure
from mechdesign.mechanism.derivatives import Linearization
from mechdesign.mechanism.loops import Loops
from mechdesign.mechanism.mechanism import Mechanism
from mechdesign.mechanism.plan import Plan
from mechdesign.mechanism.sketch import WITHOUT_MODE, side
from mechdesign.mechanism.structure import Structure

Sides = tuple[tuple[tuple[Step, ...], float], ...]


class ChartPositions:
    """Angles of the classes, each that of its first body, and slides of a mechanism.

    Angles of `coordinates` are reported in the turns that they have on the way from a pose `at`.

    Attributes
    ----------
    coordinates : tuple of Coordinate
        What the rows of `x` are.
    scales : Floats, shape (m,)
        A radian for angles, for slides the size of the mechanism.
    """

    def __init__(self, mechanism: Mechanism, at: Configuration, coordinates: Iterable[Coordinate] = ()) -> None:
        self.mechanism, graph = mechanism, mechanism.graph
        first = {frame: body for body, (frame, _) in reversed([*graph.bodies.items()]) if frame}
        #: By class, its row; the ground has none.
        self.rows = {frame: row for row, frame in enumerate(sorted(first))}
        angles = [Coordinate(f"{first[frame]}.angle", "angle", "angle", body=first[frame], turn=TURN)
                  for frame in self.rows]  # fmt: skip
        slides = [Coordinate(f"{name}.slide", "slide", "length", slide=k) for k, name in enumerate(graph.slides)]
        self.coordinates = (*angles, *slides)
        #: A length that counts as a radian.
        self.size = mechanism.size
        self.scales = np.array([1.0] * len(angles) + [self.size] * len(slides))
        offsets = mechanism.geometry.nominal.offsets
        self._bases = np.array([float(np.angle(offsets[angle.body])) for angle in angles])
        self.start = self.of(at)[:, 0]
        followed = angles_of([*coordinates, *self.coordinates, *(c.function for c in mechanism.couplings)]).values()
        self.angles = {angle.name: angle for angle in followed if angle.kind == "angle"}
        self._turns = {name: float(at.value(a)) - self.between(a.body, a.reference, self.start[:, None])[0]
                       for name, a in self.angles.items()}  # fmt: skip

    def of(self, configuration: Configuration) -> Floats:
        """Values in poses, shape (m, poses); of a single pose (m, 1)."""
        shape = configuration.shape or (1,)
        return np.array([np.broadcast_to(configuration.value(c), shape) for c in self.coordinates])

    def near(self, x: Floats) -> dict[str, Value]:
        """Values of the angles, with their turns."""
        return {name: self.between(a.body, a.reference, x) + self._turns[name] for name, a in self.angles.items()}

    def rate(self, coordinate: Coordinate, rates: Floats) -> Floats:
        """Derivative of an angle between bodies or of a slide from those of all positions, of shape (m, ...)."""
        if coordinate.kind == "slide":
            slide: Floats = rates[len(self.rows) + coordinate.slide]
            return slide
        return self.between(coordinate.body, coordinate.reference, rates)

    def between(self, body: str, reference: str, x: Floats) -> Floats:
        """Angle from the class of a reference to that of a body, up to a constant; of rates of `x` its rate."""
        total = np.zeros(x.shape[1:])
        for sign, end in ((1, body), (-1, reference)):
            frame = self.mechanism.graph.bodies[end][0]
            total = total + sign * x[self.rows[frame]] if frame else total
        return total

    def loops(self, structure: Structure, x: Floats) -> Loops:
        """The edges of a structure with these angles and slides."""
        angles = self.angles_of_classes(x)
        rotations = [rotation(angles[frame]) if frame else 1.0 for frame in range(self.mechanism.graph.classes)]
        vectors, slides = self.mechanism.geometry.nominal, [*x[len(self.rows) :]]
        return Loops(self.mechanism.graph, structure, vectors, list(vectors.w), [], rotations, [], slides)

    def angles_of_classes(self, x: Floats) -> dict[int, Floats]:
        """Angle of each class."""
        return {frame: x[row] - self._bases[row] for frame, row in self.rows.items()}


class Chart:
    """A mechanism by some of its angles and slides, as many as the mobility: `rows` of `x`.

    Raises
    ------
    MechanismError
        If they do not determine it.
    """

    def __init__(self, positions: ChartPositions, rows: Sequence[int], couplings: Sequence[Coupled]) -> None:
        self.positions, self.rows = positions, np.array(rows, dtype=int)
        mechanism = positions.mechanism
        given = [positions.coordinates[row] for row in rows]
        self.structure = compile_structure(mechanism.graph, given, couplings)
        self.plan = Plan(mechanism, self.structure, [0] * len(self.structure.groups), follows=False)

    def solve(self, x: Floats, last: Configuration) -> Linearization:
        """Poses near to `x`, shape (m, poses), with its independent values, ready for derivatives by these.

        Points that no loop but only couplings hold are searched for from those of a single pose `last`.
        """
        positions, plan, structure = self.positions, self.plan, self.structure
        loops, angles = positions.loops(structure, x), positions.angles_of_classes(x)
        modes: list[Value] = []
        guess: list[Value] = []
        for group in structure.groups:
            if group.form == "newton":
                guess += [angles[root] for root in group.angles]
                guess += [x[len(angles) + slide] for slide in group.slides]
                places = [complex(last.nodes[base]) for base in group.bases]
                guess += [np.full(x.shape[1], part) for place in places for part in (place.real, place.imag)]
            if group.form in WITHOUT_MODE:
                modes.append(0.0)
            else:
                ((loop),) = group.loops
                modes.append(np.where(side(group, *loops.columns(group, loop.edges)[1])[0] > 0, 1.0, -1.0))
        near = positions.near(x)
        turns = [near.get(angle.name, last.value(angle)) for angle in plan.angles]
        given = [x[row] for row in self.rows]
        state = plan.run(given, positions.mechanism.geometry.nominal, guess, modes, turns=turns)
        shape = x.shape[1:]
        reached = state.solved(shape) if plan.iterative else None
        configuration = plan.configuration(state, shape, {}, reached, given)
        configuration = replace(configuration, near={**configuration.near, **near}, counted=frozenset(near))
        return Linearization(structure, positions.mechanism.geometry, configuration)


def regularity(linear: Linearization) -> Floats:
    """How far a chart is from a pose where two assemblies meet, shape of the batch; 0 where it has no solution.

    Of two links that meet the sine of the angle between them, of a group without a closed form the smallest singular
    value of its equations, whose columns have the length 1; the least of all groups.
    """
    least = np.ones(linear.configuration.shape)
    for index, group in enumerate(linear.structure.groups):
        if not group.solved:
            continue
        if group.dyad:
            ((a, b),) = linear.loop_columns(index, group)
            least = np.minimum(least, np.nan_to_num(np.abs(cross(a, b)) / (np.abs(a) * np.abs(b))))
            continue
        rows = [[np.broadcast_to(e, least.shape) for e in row] for row in linear.rows(index, group)]
        matrix = np.moveaxis(np.array(rows), (0, 1), (-2, -1))
        matrix = matrix / np.linalg.norm(matrix, axis=-2, keepdims=True)
        finite = np.isfinite(matrix).all(axis=(-1, -2))
        values = np.linalg.svd(np.where(finite[..., None, None], matrix, 0.0), compute_uv=False)[..., -1]
        least = np.minimum(least, values)
    return least


class Charts:
    """Charts of a mechanism, compiled where they are wanted."""

    def __init__(self, positions: ChartPositions) -> None:
        self.positions = positions
        self._charts: dict[tuple[tuple[int, ...], Sides], Chart | None] = {}
        laws = corners_of(coupling.function for coupling in positions.mechanism.couplings)
        self._programs = {corner.argument.program for corner in laws}

    def best(self, slopes: Floats, sides: Sides) -> tuple[Chart, float]:
        """The chart whose coordinates move most along the mechanism's motions, and the volume that they span.

        Parameters
        ----------
        slopes : Floats, shape (m, mobility)
            Derivatives of all positions by any coordinates.
        sides : tuple of (program, sign)
            On which couplings are kept; see `Expression.held`.

        Raises
        ------
        MechanismError
            If no angles and slides determine the mechanism.
        """
        scaled = slopes / self.positions.scales[:, None]
        left = np.arange(len(scaled))
        while len(left) >= slopes.shape[1]:
            upper, order = qr(scaled[left].T, mode="r", pivoting=True)
            rows = left[order[: slopes.shape[1]]]
            chart = self.chart(rows, sides)
            if chart is not None:
                return chart, float(np.abs(np.prod(np.diag(upper))))
            left = left[left != rows[-1]]
        raise MechanismError("no angles and slides of the mechanism determine its motion", "dynamics.forward")

    def chart(self, rows: Ints, sides: Sides) -> Chart | None:
        """The chart of some positions; None if they do not determine the mechanism."""
        key = (tuple(sorted(rows.tolist())), (*(side for side in sides if side[0] in self._programs),))
        if key not in self._charts:
            kept = dict(key[1])
            couplings = [replace(c, function=c.function.held(kept), gap=c.gap.held(kept))
                         for c in self.positions.mechanism.couplings]  # fmt: skip
            try:
                self._charts[key] = Chart(self.positions, key[0], couplings)
            except MechanismError:
                self._charts[key] = None
        return self._charts[key]
