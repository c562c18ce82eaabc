"""The mobility that a mechanism really has, with its own dimensions: ranks and null spaces of all its equations.

Counting unknowns and equations is right for links of any dimensions; special dimensions (equal cranks, parallel
guides) make equations depend on each other. Here the equations of all edges are solved from the sketch by least
squares, and the rank of their Jacobian is taken there and at a second configuration, reached along its null space: a
motion that is only infinitesimal (a stretched chain) does not count. The motions are the right null space, and the
equations that depend on each other, the states of self-stress, the left one [Pellegrino and Calladine 1986].
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.mechanism.algebra import Value, Vector, vector, wrap
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.decomposition import TWICE_AND_FREE, Undetermined
from mechdesign.mechanism.geometry import Geometry
from mechdesign.mechanism.graph import Graph
from mechdesign.mechanism.loops import Loops, gap_of, unknowns_of
from mechdesign.mechanism.sketch import Sketch
from mechdesign.mechanism.structure import Structure, whole

# Singular values below this fraction of the largest are zeros, of columns scaled to length 1.
RANK = 1e-7
# Gaps below this fraction of the mechanism's size are closed.
CLOSED = 1e-9
# Step along the null space (radians, or fractions of the mechanism's size).
NULL_SPACE_STEP = 0.05
# A motion that can be followed over at least this part of a step is finite.
REAL_MOTION = 0.3
# Number of random directions, starts and dimensions that are tried, from fixed seeds.
ATTEMPTS = 6
# Random dimensions that are tried until the equations are regular; for a train of 200 four-bars one try in three is.
DRAWS = 50


@dataclass(frozen=True, eq=False)
class LoopEquations:
    """The equations of all edges and couplings, whose gaps are zero.

    Unknowns are angles of classes, slides and nodes, lengths as fractions of `size`.
    """

    graph: Graph
    geometry: Geometry
    size: float
    couplings: tuple[Coordinate, ...] = ()

    @property
    def angles(self) -> int:
        """Number of unknown angles, which come first."""
        return self.graph.classes - 1

    @property
    def inner(self) -> int:
        """Number of unknown angles and slides; x and y of each node but the first follow."""
        return self.angles + len(self.graph.slides)

    @cached_property
    def _units(self) -> Floats:
        """Unit of each unknown: a radian, or the length `size`."""
        unknowns = self.inner + 2 * (len(self.graph.nodes) - 1)
        return np.where(np.arange(unknowns) < self.angles, 1.0, self.size)

    def pack(self, nodes: Sequence[Vector], rotations: Sequence[Vector], slides: Sequence[Value]) -> Floats:
        """Unknowns from positions (lengths as in the study)."""
        (group,) = whole(self.graph).groups
        return np.array(unknowns_of(group, nodes, rotations, slides), dtype=float) / self._units

    def at(self, x: Floats, held: Sequence[Coordinate] = (), values: Sequence[float] = ()) -> Loops:
        """The loops at given unknowns; `values` of the held coordinates (radians or lengths) are zero if left out."""
        structure = whole(self.graph, (*self.couplings, *held))
        zeros = [0.0] * len(self.couplings)
        loops = Loops.start(self.graph, structure, self.geometry.nominal, [*zeros, *(values or [0.0] * len(held))])
        loops.put(structure.groups[0], x * self._units)
        return loops

    def from_sketch(self, sketch: Sketch, spread: float = 0.0, seed: int = 0) -> Floats:
        """Unknowns as drawn, or random where the sketch does not show them; then all are moved by up to `spread`."""
        rng = np.random.default_rng(seed)
        drawn = np.array([np.nan if node is None else node for node in sketch.nodes], dtype=complex)
        is_drawn = np.isfinite(drawn)
        anywhere = self.size * vector(*rng.uniform(-0.5, 0.5, (2, len(drawn))))
        nodes = list(np.where(is_drawn, drawn, drawn[is_drawn].mean() + anywhere))
        turns = [np.exp(1j * rng.uniform(-3, 3)) if turn is None else turn for turn in sketch.rotations]
        loops = replace(sketch, nodes=nodes, rotations=turns, slides=[*sketch.slides])
        for k, edge in enumerate(self.graph.edges):
            if edge.slide is not None:
                loops.slides[edge.slide] = loops.displacement(k)
        x = self.pack(nodes, turns, loops.slides)
        return x + spread * rng.uniform(-1, 1, len(x))

    def gaps(self, x: Floats) -> Complexes:
        """Vector by which each edge misses its head, in the study's length."""
        return self._system(self.at(x))[0][: 2 * len(self.graph.edges)].view(np.complex128) * self.size

    def jacobian(self, x: Floats, held: Sequence[Coordinate] = ()) -> Floats:
        """Derivatives of the equations by the unknowns: x and y of each edge, couplings, then held coordinates."""
        return self._system(self.at(x, held))[1]

    def _system(self, loops: Loops) -> tuple[Floats, Floats]:
        """Residuals of all equations, lengths as fractions of `size`, and their Jacobian.

        Each loop is one edge, with few unknowns of the many: it is not `Loops.equations` that fills the rows.
        """
        structure = loops.structure
        group, lines = structure.groups[0], np.zeros((len(structure.groups[0].loops), len(self._units)), complex)
        angles = {root: k for k, root in enumerate(group.angles)}
        slides = {slide: len(angles) + k for k, slide in enumerate(group.slides)}
        bases = {node: len(angles) + len(slides) + 2 * k for k, node in enumerate(group.bases)}
        misses = np.array([gap_of(loop, loops.nodes) for loop in group.loops], dtype=complex)
        for number, loop in enumerate(group.loops):
            for k, sign in loop.edges:
                edge, step = structure.edges[k], sign * loops.edge(k)
                misses[number] += step
                if (root := structure.ties[edge.frame].root) in angles:
                    lines[number, angles[root]] += 1j * step
                if edge.slide in slides:
                    lines[number, slides[edge.slide]] += sign * loops.direction(k)
            for node, end in ((loop.start, 1.0), (loop.end, -1.0)):
                if node in bases:
                    lines[number, bases[node] : bases[node] + 2] += [end, 1j * end]
        rows = np.stack([lines.real, lines.imag], axis=1).reshape(-1, lines.shape[1])
        errors = misses.view(float)
        if group.conditions:
            loops.place(group)
            rows = np.concatenate([rows, np.array(loops.condition_rows(group), dtype=float)])
            errors = np.append(errors, np.array(loops.gaps(group), dtype=float))
        held = [self.size if c.quantity == "length" else 1.0 for c in loops.structure.given]
        units = np.array([self.size] * 2 * len(self.graph.edges) + held)
        return errors / units, rows * self._units / units[:, None]

    def generic(self, held: Sequence[Coordinate] = ()) -> Floats:
        """The Jacobian for random dimensions, free of special relations except between the directions of slides.

        It is the one of largest rank of several draws, as chance can only lower the rank. Where an expression has no
        value in any draw its derivatives are random.
        """
        draws = [self.drawn(held, seed) for seed in range(ATTEMPTS)]
        anything = np.random.default_rng(ATTEMPTS).uniform(-1, 1, draws[0].shape)
        finite = [jacobian for jacobian in draws if np.isfinite(jacobian).all()]
        finite = finite or [np.where(np.isfinite(jacobian), jacobian, anything) for jacobian in draws]
        return min(finite, key=lambda jacobian: null_space(jacobian).shape[1])

    def drawn(self, held: Sequence[Coordinate], seed: int) -> Floats:
        """The Jacobian for dimensions drawn at random; the directions of slides stay."""
        loops = self.at(np.random.default_rng(seed).uniform(-1, 1, len(self._units)), held)
        for k, edge in enumerate(self.graph.edges):
            loops.w[k] += np.conj(loops.rotations[edge.frame]) * (loops.chord(k) - loops.edge(k))
        return self._system(loops)[1]

    def without_value(self, x: Floats) -> list[str]:
        """Names of the couplings that have no value at given unknowns."""
        values = self._system(self.at(x))[0][2 * len(self.graph.edges) :]
        return [c.name for c, value in zip(self.couplings, values, strict=True) if not np.isfinite(value)]

    def solve(
        self, x: Floats, held: Sequence[tuple[Coordinate, float]] = (), step: Floats | None = None
    ) -> tuple[Floats, float]:
        """Least squares from `x`, some coordinates held (angles in radians): the unknowns and the largest gap.

        With a `step` the solution must lie that far from `x` in the direction of the step. Otherwise the solver would
        run back to `x` where two motions cross or one ends. The gap is infinite where a coupling has no value at the
        begin.
        """
        from scipy.optimize import least_squares

        coordinates, values = [coordinate for coordinate, _ in held], [value for _, value in held]
        conditions = [*self.couplings, *coordinates]
        turns = np.array([False] * 2 * len(self.graph.edges) + [c.quantity == "angle" for c in conditions])
        ahead = np.zeros((0, len(x))) if step is None else step[None] / np.linalg.norm(step)
        start = x if step is None else x + step

        # The solver asks for the slope where it has just asked for the residual.
        @lru_cache(maxsize=1)
        def system(unknowns: bytes) -> tuple[Floats, Floats]:
            return self._system(self.at(np.frombuffer(unknowns), coordinates, values))

        def residual(y: Floats) -> Floats:
            errors, _ = system(y.tobytes())
            return np.concatenate([np.where(turns, wrap(errors), errors), ahead @ (y - start)])

        def slope(y: Floats) -> Floats:
            return np.vstack([system(y.tobytes())[1], ahead])

        if not np.isfinite(residual(start)).all():
            return start, np.inf
        result = least_squares(residual, start, slope, xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=200)
        return result.x, float(np.abs(result.fun).max(initial=0.0))

    def assemble(self, sketch: Sketch) -> Floats | None:
        """An assembled configuration near the sketch; None where there is none."""
        for attempt in range(ATTEMPTS):
            x, gap = self.solve(self.from_sketch(sketch, 0.1 * attempt, attempt))
            if gap < CLOSED:
                return x
        return None

    def mobility(self, x: Floats) -> tuple[int, Floats]:
        """Degrees of freedom of the finite motion from an assembled configuration, and a second one on its way."""
        motions = null_space(self.jacobian(x))
        ordinary = null_space(self.generic()).shape[1]
        if motions.shape[1] == ordinary:
            return ordinary, x
        best = (0, x)
        rng = np.random.default_rng(2)
        for _ in range(ATTEMPTS):
            step = motions @ rng.uniform(-1, 1, motions.shape[1])
            step *= NULL_SPACE_STEP / np.abs(step).max()
            y, gap = self.solve(x, step=step)
            if gap < CLOSED:
                best = max(best, (self._realised(y, ordinary), y), key=lambda trial: trial[0])
        return best

    def _realised(self, x: Floats, ordinary: int) -> int:
        """Number of motions at a configuration that are finite, not only of first order."""
        motions = np.linalg.qr(null_space(self.jacobian(x)))[0]
        if motions.shape[1] == ordinary:
            return ordinary
        kept = np.zeros((motions.shape[1], motions.shape[1]))
        for k, motion in enumerate(motions.T):
            step = motion * (NULL_SPACE_STEP / np.abs(motion).max())
            y, gap = self.solve(x, step=step)
            if gap < CLOSED:
                kept[:, k] = motions.T @ (y - x) / np.linalg.norm(step)
        return int((np.linalg.svd(kept, compute_uv=False) > REAL_MOTION).sum())

    def without(self, jacobian: Floats, edges: Collection[int], classes: Collection[int]) -> tuple[int, int]:
        """Degrees of freedom, and the excess of equations over unknowns, if edges and classes are left out.

        Slides along these edges and nodes that no other edge places are left out as well.
        """
        every = self.graph.edges
        left = [k for k in range(len(every)) if k not in edges]
        placed, once = ({node for k in part for node in (every[k].tail, every[k].head)} for part in (left, edges))
        slides = {slide for k in edges if (slide := every[k].slide) is not None}
        gone = {frame - 1 for frame in classes} | {self.angles + slide for slide in slides}
        gone |= {self.inner + 2 * (node - 1) + part for node in once - placed - {0} for part in (0, 1)}
        kept = [column for column in range(jacobian.shape[1]) if column not in gone]
        rows = [2 * k + part for k in left for part in (0, 1)]
        rows += range(2 * len(every), len(jacobian))
        return int(null_space(jacobian[np.ix_(rows, kept)]).shape[1]), len(rows) - len(kept)


def null_space(matrix: Floats) -> Floats:
    """Basis of the right null space, shape (columns, dimension)."""
    if matrix.shape[0] == 0 or matrix.shape[1] == 0:
        return np.eye(matrix.shape[1])
    sizes = np.linalg.norm(matrix, axis=0)
    scale = np.where(sizes > 0, 1 / np.where(sizes > 0, sizes, 1.0), 1.0)
    _, values, rows = np.linalg.svd(matrix * scale, full_matrices=True)
    rank = int((values > RANK * values[0]).sum())
    return np.asarray(rows[rank:].T * scale[:, None])


def separated(basis: Floats, pivots: int) -> list[Floats]:
    """Basis of the same space by Gauss-Jordan elimination, so that each vector is a motion of few links.

    Pivots are taken among the first `pivots` entries as long as these are not all zero. Entries within rounding are
    set to zero.
    """
    rows = basis.T.copy()
    for index in range(len(rows)):
        part = np.abs(rows[index:, :pivots])
        if part.size == 0 or part.max() < RANK * np.abs(rows[index:]).max():
            part = np.abs(rows[index:])
        row, column = divmod(int(part.argmax()), part.shape[1])
        rows[[index, index + row]] = rows[[index + row, index]]
        rows[index] /= rows[index, column]
        others = np.arange(len(rows)) != index
        rows[others] -= rows[others, column][:, None] * rows[index]
    sizes = np.abs(rows).max(axis=1, initial=0.0)
    return [np.where(np.abs(row) > 10 * RANK * size, row, 0.0) for row, size in zip(rows, sizes, strict=True)]


def check_independent(equations: LoopEquations, structure: Structure) -> None:
    """Check that the equations of groups without a closed form are independent.

    A perfect matching of equations and unknowns is necessary but not sufficient: one part may be over-constrained while
    another floats. So the rank is computed for random dimensions. One regular draw is proof, as chance can make regular
    equations singular but not the reverse.

    Raises
    ------
    Undetermined
        If the equations depend on each other for all dimensions.
    """
    if not any(group.form == "newton" for group in structure.groups):
        return
    singular = False
    for seed in range(DRAWS):
        draw = equations.drawn(structure.given, seed)
        # A given expression may have no value for random dimensions; such a draw does not count.
        if np.isfinite(draw).all():
            singular = null_space(draw).shape[1] > 0
            if not singular:
                return
    if singular:
        raise Undetermined(f"{TWICE_AND_FREE}; give one of the other part instead")
