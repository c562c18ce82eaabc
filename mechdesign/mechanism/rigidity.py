"""The mobility that a mechanism really has, with its own dimensions: ranks and null spaces of all its equations.

Counting unknowns and equations is right for links of any dimensions; special dimensions (equal cranks, parallel
guides) make equations depend on each other. Here the equations of all edges are solved from the sketch by least
squares, and their Jacobian is judged at the place found and at a second one, reached along its null space: a motion
that is only infinitesimal (a stretched chain) is none. The motions are the right null space, and the equations that
depend on each other, the states of self-stress, the left one [Pellegrino and Calladine 1986].
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mechdesign.mechanism.algebra import vector, wrap
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.geometry import Geometry
from mechdesign.mechanism.graph import Graph
from mechdesign.mechanism.outputs import Rates, first
from mechdesign.mechanism.sketch import Sketch
from mechdesign.mechanism.structure import Structure, Undetermined
from mechdesign.numerics.arrays import Complexes, Floats, Ints

# Singular values below this fraction of the largest are zeros, of columns scaled to length 1.
RANK = 1e-7
# Gaps below this fraction of the mechanism's size are closed.
CLOSED = 1e-9
# Step along the null space (radians, or fractions of the size).
NULL_SPACE_STEP = 0.05
# A motion that goes on for at least this part of a step is a finite one.
REAL_MOTION = 0.3
# Directions and starts that are tried, drawn from fixed seeds.
ATTEMPTS = 6
# Random dimensions that are tried until one is regular: of a train of 200 four-bars one in three is.
DRAWS = 50


@dataclass(frozen=True, eq=False)
class Equations:
    """All edges' equations; the unknowns are angles of classes, slides, and nodes, lengths as fractions of `size`."""

    graph: Graph
    geometry: Geometry
    size: float

    @cached_property
    def _ends(self) -> tuple[Ints, Ints, Ints, Ints]:
        edges = self.graph.edges
        slides = [-1 if edge.slide is None else edge.slide for edge in edges]
        columns = ([e.tail for e in edges], [e.head for e in edges], [e.frame for e in edges], slides)
        tail, head, frame, slide = (np.array(column, dtype=np.intp) for column in columns)
        return tail, head, frame, slide

    @cached_property
    def _arms(self) -> tuple[Complexes, Complexes]:
        vectors = self.geometry.nominal
        return np.array(vectors.w, dtype=np.complex128) / self.size, np.array(vectors.d, dtype=np.complex128)

    @property
    def angles(self) -> int:
        """Number of unknown angles, which come first."""
        return self.graph.classes - 1

    @property
    def inner(self) -> int:
        """Number of unknown angles and slides; the x of all nodes but the first follow, then the y."""
        return self.angles + len(self.graph.slides)

    def pack(self, nodes: Complexes, angles: Floats, slides: Floats) -> Floats:
        """Unknowns from positions (lengths as in the study), angles of all classes and slides."""
        scaled = nodes[1:] / self.size
        return np.concatenate([angles[1:], slides / self.size, scaled.real, scaled.imag])

    def unpack(self, x: Floats) -> tuple[Complexes, Floats, Floats]:
        """Positions as fractions of the size, angles of all classes, slides as fractions of the size."""
        places = x[self.inner :].reshape(2, -1)
        nodes = np.concatenate([[0j], vector(places[0], places[1])])
        return nodes, np.concatenate([[0.0], x[: self.angles]]), x[self.angles : self.inner]

    def from_sketch(self, sketch: Sketch, spread: float = 0.0, seed: int = 0) -> Floats:
        """Unknowns as drawn, those not drawn at random, all moved at random by up to `spread`."""
        rng = np.random.default_rng(seed)
        drawn = np.array([np.nan if node is None else node for node in sketch.nodes], dtype=complex)
        known = np.isfinite(drawn)
        anywhere = self.size * vector(*rng.uniform(-0.5, 0.5, (2, len(drawn))))
        nodes = np.where(known, drawn, drawn[known].mean() + anywhere)
        turns = [np.exp(1j * rng.uniform(-3, 3)) if turn is None else turn for turn in sketch.rotations]
        angles = np.angle(np.array(turns, dtype=complex))
        tail, head, frame, slide = self._ends
        w, d = self._arms
        slides = np.zeros(len(self.graph.slides))
        for k in np.flatnonzero(slide >= 0):
            along = (nodes[head[k]] - nodes[tail[k]]) * np.exp(-1j * angles[frame[k]]) - w[k] * self.size
            slides[slide[k]] = (along * d[k].conjugate()).real
        x = self.pack(nodes, angles, slides)
        return x + spread * rng.uniform(-1, 1, len(x))

    def _spans(self, x: Floats) -> tuple[Complexes, Complexes, Complexes]:
        nodes, angles, slides = self.unpack(x)
        tail, head, frame, slide = self._ends
        w, d = self._arms
        turn = np.exp(1j * angles[frame])
        reach = np.append(slides, 0.0)[slide]
        spans = (w + reach * d) * turn
        return nodes[tail] + spans - nodes[head], spans, d * turn

    def gaps(self, x: Floats) -> Complexes:
        """By how much each edge misses its head, in the study's lengths."""
        return self._spans(x)[0] * self.size

    def jacobian(self, x: Floats, held: Sequence[Coordinate] = ()) -> Floats:
        """Derivatives of the equations (x and y of each edge, then the held coordinates) by the unknowns."""
        _, spans, directions = self._spans(x)
        return np.vstack([self._edge_rows(spans, directions), *(self._row(x, coordinate) for coordinate in held)])

    def generic(self, held: Sequence[Coordinate] = ()) -> Floats:
        """The Jacobian for dimensions without any special relation (but the directions of slides).

        Of several draws one of the largest rank: chance can only lower it. Not finite where no draw is, as a held
        expression may be defined for few values only.
        """
        draws = [self.drawn(held, seed) for seed in range(ATTEMPTS)]
        finite = [jacobian for jacobian in draws if np.isfinite(jacobian).all()]
        return min(finite, key=lambda jacobian: null_space(jacobian).shape[1], default=draws[0])

    def drawn(self, held: Sequence[Coordinate], seed: int) -> Floats:
        """The Jacobian for dimensions drawn at random (but the directions of slides)."""
        rng = np.random.default_rng(seed)
        x = rng.uniform(-1, 1, self.inner + 2 * (len(self.graph.nodes) - 1))
        tail, head, *_ = self._ends
        nodes = self.unpack(x)[0]
        rows = self._edge_rows(nodes[head] - nodes[tail], self._spans(x)[2])
        return np.vstack([rows, *(self._row(x, coordinate) for coordinate in held)])

    def _edge_rows(self, spans: Complexes, directions: Complexes) -> Floats:
        tail, head, frame, slide = self._ends
        count, nodes = len(tail), len(self.graph.nodes)
        turning = np.zeros((count, self.graph.classes), dtype=complex)
        rows = np.arange(count)
        turning[rows, frame] = 1j * spans
        sliding = np.zeros((count, len(self.graph.slides) + 1), dtype=complex)
        sliding[rows, slide] = directions
        placing = np.zeros((count, nodes))
        placing[rows, tail] += 1
        placing[rows, head] -= 1
        inner = np.hstack([turning[:, 1:], sliding[:, :-1]])
        none = np.zeros((count, nodes - 1))
        both = [np.hstack([inner.real, placing[:, 1:], none]), np.hstack([inner.imag, none, placing[:, 1:]])]
        return np.stack(both, axis=1).reshape(2 * count, -1)

    def _configuration(self, x: Floats) -> Configuration:
        nodes, angles, slides = self.unpack(x)
        return Configuration(
            self.graph, self.geometry.nominal, (), list(nodes * self.size), list(np.exp(1j * angles)),
            list(slides * self.size), [], np.zeros((), dtype=np.int8), {},
        )  # fmt: skip

    def _row(self, x: Floats, coordinate: Coordinate) -> Floats:
        every = [self.unpack(unit) for unit in np.eye(len(x))]
        nodes, angles, slides = (np.array(part).T for part in zip(*every, strict=True))
        # A length's derivative is that of its fraction of the size.
        rates = Rates(list(nodes * self.size), list(angles), list(slides * self.size), {})
        scale = self.size if coordinate.quantity == "length" else 1.0
        return np.asarray(first(self._configuration(x), coordinate, rates)) / scale

    def solve(
        self, x: Floats, held: Sequence[tuple[Coordinate, float]] = (), step: Floats | None = None
    ) -> tuple[Floats, float]:
        """Least squares from `x`, some coordinates held (angles in radians): the unknowns and the largest gap.

        With a `step` the solution must lie that far from `x` in its direction: a point where two motions cross, or
        where one ends, draws all others to itself.
        """
        from scipy.optimize import least_squares

        coordinates = [coordinate for coordinate, _ in held]
        ahead = np.zeros((0, len(x))) if step is None else step[None] / np.linalg.norm(step)
        start = x if step is None else x + step

        def residual(y: Floats) -> Floats:
            gaps = self._spans(y)[0]
            misses = [self._miss(y, coordinate, value) for coordinate, value in held]
            return np.concatenate([gaps.view(float), misses, ahead @ (y - start)])

        def slope(y: Floats) -> Floats:
            return np.vstack([self.jacobian(y, coordinates), ahead])

        found = least_squares(residual, start, slope, xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=200)
        return found.x, float(np.abs(found.fun).max(initial=0.0))

    def _miss(self, x: Floats, coordinate: Coordinate, value: float) -> float:
        miss = float(self._configuration(x).value(coordinate)) - value
        if coordinate.quantity == "angle":
            return float(wrap(miss))
        return miss / self.size if coordinate.quantity == "length" else miss

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
                best = max(best, (self._realised(y, ordinary), y), key=lambda found: found[0])
        return best

    def _realised(self, x: Floats, ordinary: int) -> int:
        """How many of the motions at a configuration go on beyond the first order."""
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
        """Degrees of freedom where edges, slides on them, and classes are left out, with what only they place.

        And how many more equations than unknowns are left.
        """
        left = [k for k in range(len(self.graph.edges)) if k not in edges]
        tail, head, _, slide = self._ends
        placed = {int(node) for k in left for node in (tail[k], head[k])}
        lonely = {int(node) for k in edges for node in (tail[k], head[k])} - placed - {0}
        nodes = len(self.graph.nodes) - 1
        gone = {frame - 1 for frame in classes} | {self.angles + int(slide[k]) for k in edges if slide[k] >= 0}
        gone |= {self.inner + part + node - 1 for node in lonely for part in (0, nodes)}
        kept = [column for column in range(jacobian.shape[1]) if column not in gone]
        rows = [2 * k + part for k in left for part in (0, 1)]
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
    """Basis vectors reduced against each other, so that independent motions come one by one.

    Pivots are taken among the first `pivots` entries while these say anything. Entries within rounding are zero.
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


def check_independent(equations: Equations, structure: Structure) -> None:
    """Check a mechanism with groups without a closed form for equations that depend on each other.

    A perfect matching of equations and unknowns is necessary, but not enough: a part may be joined within itself too
    often while another floats. So the rank of the equations is taken for random dimensions. Chance can make a draw
    singular, but never singular equations regular: one regular draw is proof.

    Raises
    ------
    Undetermined
        If there are any whatever the dimensions.
    """
    if not any(group.form == "newton" for group in structure.groups):
        return
    singular = False
    for seed in range(DRAWS):
        draw = equations.drawn(structure.given, seed)
        # A given expression may have no value at random dimensions; such a draw does not count.
        if np.isfinite(draw).all():
            singular = null_space(draw).shape[1] > 0
            if not singular:
                return
    if singular:
        raise Undetermined(
            "the given coordinates fix one part of the mechanism twice and leave another free; give one of the other "
            "part instead"
        )
