"""Solved poses all over a region of the plane, from which others are continued where there is no closed form.

From the sketch every pose would be a long way, and places out of reach would be tried again and again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from mechdesign.mechanism.algebra import Value, nearest, quiet
from mechdesign.mechanism.configuration import Configuration, Reason, hide
from mechdesign.mechanism.continuation import MAX_CHANGE, scale_of, table_of
from mechdesign.mechanism.plan import Plan
from mechdesign.mechanism.solve import State
from mechdesign.numerics.arrays import Complexes, Flags, Floats, Ints

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

# Distance of neighbouring poses, as a part of the mechanism's size.
SPACING = 0.03
# Beyond this many spacings from the nearest solved pose nothing is inside.
REACH = 1.6
# Most poses of a design.
MAX_POSES = 20_000
# Poses outside the study's limits are passed through over this many spacings: there may be another piece beyond.
LIMIT_GAP = 15
# Step of finite differences, as a part of the mechanism's size.
DIFFERENCE_STEP = 1e-6
# Steps in which dimensions are changed.
STAGES = 8
# Steps in which held coordinates are brought from their values in the sketch to others.
HELD_STAGES = 16
# Of the nominal poses, those at every so many-th place of the lattice are brought to other dimensions.
SEED_EVERY = 3
# Poses of all designs that are kept for later calls.
KEPT_POSES = 500_000
# Newton's corrections of a pose predicted by slopes.
CORRECTIONS = 5
# Newton's corrections near a fold, made one at a time.
SINGLE_CORRECTIONS = 30
# A correction that leaves less of the determinant than this leads towards a fold (at the fold itself: a half).
NEAR_FOLD = 0.8
# Steps to the neighbours of a place of the lattice.
NEIGHBOURS = np.array([1, 1j, -1, -1j])

# Dimensions of each pose that differ from the nominal ones.
Sizes = Mapping[str, Floats]


@dataclass(frozen=True, eq=False)
class _Poses:
    """Solved poses of one design on a lattice.

    Places of the point as a tree, and in spacings from the sketch's; a table of the unknowns of the groups without a
    closed form, shape (unknowns, poses), and their slopes by the point's x and y, shape (2, unknowns, poses).
    """

    tree: cKDTree
    lattice: Complexes
    table: Floats
    slopes: Floats


@dataclass(frozen=True, eq=False)
class Atlas:
    """Poses of a mechanism all over its region, for the nominal dimensions, and for others when they are needed.

    `held` are the values of the plan's coordinates after the point's x and y, `signs` those of the determinants of the
    groups without a closed form, shape (groups, 1) (others are other assemblies), `origin` the point in the sketch.
    """

    plan: Plan
    held: tuple[float, ...]
    signs: Floats
    origin: complex
    known: dict[bytes, _Poses] = field(default_factory=dict)

    @staticmethod
    def of(plan: Plan, held: tuple[float, ...]) -> Atlas:
        """Poses of the nominal mechanism, grown from the sketch's place until nothing more is reached.

        Where the held values cannot be had there, all poses with those of the sketch are brought to them step by step.
        There are none where that does not lead to them either.
        """
        sketch, coordinates = plan.core.sketch_configuration, plan.structure.given
        origin = complex(*(float(sketch.value(c)) for c in coordinates[:2]))

        def begun(values: Sequence[float]) -> tuple[Atlas, Floats]:
            given = [np.array([origin.real]), np.array([origin.imag]), *map(np.asarray, values)]
            first = plan.solve(given, limits=False)
            start = plan.start(first)
            grown = Atlas(plan, tuple(values), np.array(start.signs).reshape(-1, 1), origin)
            return grown, table_of(start.unknowns, (1,))[:, np.flatnonzero(first.valid)]

        atlas, table = begun(held)
        lattice = np.zeros(table.shape[1], dtype=complex)
        if not lattice.size:
            drawn = [float(sketch.value(c)) for c in coordinates[2:]]
            goal = [nearest(v, at) if c.quantity == "angle" else v for c, v, at in
                    zip(coordinates[2:], held, drawn, strict=True)]  # fmt: skip
            between, table = begun(drawn)
            lattice = np.zeros(table.shape[1], dtype=complex)
            for share in np.linspace(0, 1, HELD_STAGES + 1).tolist():
                values = tuple(at + share * (v - at) for at, v in zip(drawn, goal, strict=True))
                between = replace(between, held=values)
                (poses,) = between._grown({}, np.zeros(len(lattice), dtype=np.intp), lattice, table)
                lattice, table = poses.lattice, poses.table
            atlas = replace(between, held=held)
        (atlas.known[b""],) = atlas._grown({}, np.zeros(len(lattice), dtype=np.intp), lattice, table)
        return atlas

    @property
    def empty(self) -> bool:
        """Whether the held values cannot be had at the point's place in the sketch, where poses would grow from."""
        return not self.known[b""].tree.n

    @property
    def spacing(self) -> float:
        """Distance of neighbouring poses."""
        return SPACING * self.plan.core.size

    def solve(self, z: Complexes, places: Mapping[str, Value], *, beyond: bool = False) -> tuple[Configuration, Floats]:
        """The mechanism with its point at `z`, and how far it is from where two of its assemblies meet (a fold).

        Links that do not depend on a leg out of reach stay finite, as where all groups have a closed form. Where the
        nearest solved pose is far and a leg does not reach either, the pose is that of a place on the way from there.

        Parameters
        ----------
        places : mapping of str to array_like
            Dimensions that differ from the nominal ones; they broadcast against `z`.
        beyond : bool
            Whether beyond a fold the pose is that at the fold, and beyond a leg's reach that with the leg stretched.

        Returns
        -------
        configuration : Configuration
            nan where nothing is reached.
        fold_distance : ndarray
            The product of the squared determinants, linear in the distance to a fold and negative beyond it; nan
            where nothing is known.
        """
        shape = np.broadcast_shapes(z.shape, *(np.shape(value) for value in places.values()))
        flat = np.broadcast_to(z, shape).ravel()
        sizes = {name: np.broadcast_to(np.asarray(v, dtype=float), shape).ravel() for name, v in places.items()}
        near, table, slopes = self._nearest(flat, sizes)
        lost = ~np.isfinite(near) | ~np.isfinite(flat)
        way = np.where(lost, 0.0, flat - near)
        goal = np.where(lost, self.origin, flat)
        reach = REACH * self.spacing
        far = np.abs(way) > reach
        within = np.where(far, near + way * (reach / np.maximum(np.abs(way), reach)), goal)
        ahead = slopes[0] * way.real + slopes[1] * way.imag
        state, fold_distance = self._solved(goal, sizes, table, ahead, within, beyond)
        fold_distance[lost | (far & ~self._open(state, flat.shape))] = np.nan
        lost = np.isnan(fold_distance) if beyond else ~(fold_distance > 0)
        return self._configuration(state, places, lost.reshape(shape)), fold_distance.reshape(shape)

    @quiet
    def _solved(
        self, z: Complexes, sizes: Sizes, table: Floats, ahead: Value, within: Complexes, beyond: bool = False
    ) -> tuple[State, Floats]:
        """The mechanism near known poses, and its distances from a fold (see `solve`).

        `table` has the unknowns of the known poses, `ahead` the change expected from there. Where a pose is not solved
        at once, that with the point at `within` is found instead of `z`.
        """
        # Near a fold the unknowns change too fast for a prediction by their slopes.
        scale = scale_of(self.plan.structure, self.plan.core.size, table)
        guess = table + np.where((np.abs(ahead) <= MAX_CHANGE * scale).all(axis=0), ahead, 0.0)
        state = self._run(z, sizes, guess, CORRECTIONS, beyond)
        fold_distance = np.prod(_determinants(state, z.shape) ** 2, axis=0)
        rows = np.flatnonzero(~state.solved(z.shape, self.signs.tolist()))
        if not len(rows):
            return state, fold_distance
        solved = table_of(state.unknowns, z.shape)
        own = {name: value[rows] for name, value in sizes.items()}
        solved[:, rows], fold_distance[rows] = self._beside_fold(within[rows], own, table[:, rows])
        z[rows] = within[rows]
        return self._run(z, sizes, solved, 0, beyond), fold_distance

    def _beside_fold(self, z: Complexes, sizes: Sizes, table: Floats) -> tuple[Floats, Floats]:
        """Unknowns and distances from a fold, by single corrections until a pose is solved or seen to be beyond.

        Towards a fold the equations are those of a parabola: from one side of it corrections never pass to the other,
        where the determinant has the other sign, unless there is no solution. The squared determinant of the solution
        is g = D0 (2 D1 - D0), with D0 and D1 before and after a correction, also where it is negative: so far beyond.
        Corrections alone would only halve D each time; a longer one ends at the root of g, or beside the fold.
        """
        fold_distance, left = np.full(z.shape, np.nan), np.arange(len(z))
        unknowns, guess = table.copy(), table
        # The last place, the determinants there, and whether a correction led from there.
        last, before, led = guess, np.full((len(self.signs), len(z)), np.nan), np.zeros(len(z), dtype=bool)
        for _ in range(SINGLE_CORRECTIONS):
            own = {name: value[left] for name, value in sizes.items()}
            state = self._run(z[left], own, guess, 1)
            now, new = _determinants(state, left.shape), table_of(state.unknowns, left.shape)
            squares = before * (2 * now - before)
            crossed = np.sign(now) != self.signs
            beyond = crossed.any(axis=0)
            solved = ~beyond & state.solved(left.shape)
            unknowns[:, left[solved]], fold_distance[left[solved]] = new[:, solved], np.prod(now**2, axis=0)[solved]
            # Beyond the fold: the pose at the fold.
            share = np.where(crossed & led, before / (before - now), 1.0).min(axis=0)
            unknowns[:, left[beyond]] = (last + share * (guess - last))[:, beyond]
            squared = np.where(crossed & led, squares, now**2)
            fold_distance[left[beyond]] = -np.abs(np.prod(squared, axis=0))[beyond]
            # The group that is nearest to its fold says how much longer the correction should have been.
            nearest = np.argmin(np.where(led, now / before, 1.0), axis=0)[None]
            d0, d1, g = (np.take_along_axis(v, nearest, axis=0)[0] for v in (before, now, squares))
            goal = np.copysign(np.where(g > 0, 1.0, 0.5) * np.sqrt(np.abs(g)), d0)
            longer = led & (d1 / d0 < NEAR_FOLD)
            target = np.where(longer, last + (d0 - goal) / (d0 - d1) * (guess - last), new)
            moving = ~solved & ~beyond & np.isfinite(target).all(axis=0)
            left, last, guess, before = left[moving], guess[:, moving], target[:, moving], now[:, moving]
            led = ~longer[moving]
            if not len(left):
                break
        return unknowns, fold_distance

    def _run(self, z: Complexes, sizes: Sizes, table: Floats, steps: int, beyond: bool = False) -> State:
        """The whole mechanism after some of Newton's corrections."""
        vectors = self.plan.core.geometry.vectors(sizes)
        return self.plan.run([z.real, z.imag, *self.held], vectors, table, steps=steps, beyond=beyond)

    def _nearest(self, z: Complexes, sizes: Sizes) -> tuple[Complexes, Floats, Floats]:
        """Places of the nearest solved poses (nan where there is none), their unknowns and slopes."""
        if not sizes or self.empty:
            return _pick(self.known[b""], z)
        rows, which = np.unique(np.stack(list(sizes.values()), axis=-1), axis=0, return_inverse=True)
        which = which.ravel()
        keys = [",".join(sizes).encode() + row.tobytes() for row in rows]
        new = [k for k, key in enumerate(keys) if key not in self.known]
        if new:
            fresh = self._designs({name: rows[new, k] for k, name in enumerate(sizes)}, len(new))
            self.known.update({keys[k]: poses for k, poses in zip(new, fresh, strict=True)})
        count = len(self.known[b""].table)
        near = np.empty(z.shape, dtype=complex)
        table, slopes = np.empty((count, len(z))), np.empty((2, count, len(z)))
        order = np.argsort(which, kind="stable")
        for key, lanes in zip(keys, np.split(order, np.cumsum(np.bincount(which))[:-1]), strict=True):
            near[lanes], table[:, lanes], slopes[:, :, lanes] = _pick(self.known[key], z[lanes])
        if sum(poses.tree.n for poses in self.known.values()) > KEPT_POSES:
            for key in self.known.keys() - {b"", *keys}:
                del self.known[key]
        return near, table, slopes

    def _designs(self, sizes: Sizes, count: int) -> list[_Poses]:
        """Poses of several designs: some of the nominal ones are brought to their dimensions and grow from there."""
        nominal = self.known[b""]
        coarse = np.flatnonzero((nominal.lattice.real % SEED_EVERY == 0) & (nominal.lattice.imag % SEED_EVERY == 0))
        design, seed = np.repeat(np.arange(count), len(coarse)), np.tile(coarse, count)
        table, lattice = nominal.table[:, seed], nominal.lattice[seed]
        for stage in range(1, STAGES + 1):
            between = {}
            for name, value in sizes.items():
                begin = self.plan.core.nominal.get(name, 0.0)
                between[name] = begin + (stage / STAGES) * (value[design] - begin)
            z = self.origin + self.spacing * lattice
            state, fold_distance = self._solved(z, between, table, 0.0, z)
            reached = fold_distance > 0
            design, lattice = design[reached], lattice[reached]
            table = table_of(state.unknowns, reached.shape)[:, reached]
        return self._grown(sizes, design, lattice, table)

    def _grown(self, sizes: Sizes, design: Ints, lattice: Complexes, table: Floats) -> list[_Poses]:
        """Poses of all designs, from solved ones to their neighbours on the lattice until nothing more closes."""
        count = max((len(value) for value in sizes.values()), default=1)
        seen = set(zip(design.tolist(), lattice.tolist(), strict=True))
        layers = [(design[:0], lattice[:0], table[:, :0])]
        # Spacings since a pose was within the limits.
        outside = np.zeros(len(design), dtype=int)
        while len(design):
            z = self.origin + self.spacing * lattice
            own = {name: value[design] for name, value in sizes.items()}
            state, fold_distance = self._solved(z, own, table, 0.0, z)
            table, reached = table_of(state.unknowns, z.shape), fold_distance > 0
            # Poses just outside, where a leg does not reach, are kept, but nothing grows from them.
            outside = np.where(self._within(state, own, z.shape), 0, outside + 1)
            closed = np.flatnonzero(reached & ~self._open(state, z.shape) & (outside < LIMIT_GAP))
            layers.append((design[reached], lattice[reached], table[:, reached]))
            fresh: dict[tuple[int, complex], int] = {}
            steps = (lattice[closed, None] + NEIGHBOURS).ravel().tolist()
            parents = np.repeat(closed, len(NEIGHBOURS)).tolist()
            for k, owner, step in zip(parents, design[parents].tolist(), steps, strict=True):
                if (owner, step) not in seen:
                    fresh.setdefault((owner, step), k)
            if len(seen) + len(fresh) > MAX_POSES * count:
                break
            seen.update(fresh)
            parent = np.array(list(fresh.values()), dtype=np.intp)
            design = design[parent]
            lattice = np.array([step for _, step in fresh], dtype=complex)
            table, outside = table[:, parent], outside[parent]
        from scipy.spatial import cKDTree

        design, lattice, table = (np.concatenate(parts, axis=-1) for parts in zip(*layers, strict=True))
        slopes = self._slopes(lattice, {name: value[design] for name, value in sizes.items()}, table)
        designs = []
        for k in range(count):
            lanes = np.flatnonzero(design == k)
            z = self.origin + self.spacing * lattice[lanes]
            tree = cKDTree(np.stack([z.real, z.imag], axis=-1))
            designs.append(_Poses(tree, lattice[lanes], table[:, lanes], slopes[:, :, lanes]))
        return designs

    def _slopes(self, lattice: Complexes, sizes: Sizes, table: Floats) -> Floats:
        """Derivatives of the unknowns by the point's x and y; 0 where they have none."""
        h = DIFFERENCE_STEP * self.plan.core.size
        z = self.origin + self.spacing * lattice
        beside = [table_of(self._run(z + step, sizes, table, 1).unknowns, z.shape) for step in (h, 1j * h)]
        slopes = (np.stack(beside) - table) / h
        return np.where(np.isfinite(slopes).all(axis=1, keepdims=True), slopes, 0.0)

    def _within(self, state: State, sizes: Sizes, shape: tuple[int, ...]) -> Flags:
        """Which poses are within the study's limits."""
        within = np.ones(shape, dtype=bool)
        for _, margin in self.plan.core.margins(self._configuration(state, sizes, np.zeros(shape, dtype=bool))):
            within &= np.asarray(margin) >= 0
        return within

    def _configuration(self, state: State, places: Mapping[str, Value], lost: Flags) -> Configuration:
        """A flat batch of states in the shape of `lost`, nan where that is true."""
        graph, shape = self.plan.core.graph, lost.shape

        def shaped(values: Sequence[Value]) -> list[Value]:
            full = [value if np.ndim(value) == 0 else np.asarray(value).reshape(shape) for value in values]
            return [hide(value, lost) for value in full] if lost.any() else full

        return Configuration(
            graph, self.plan.core.geometry.vectors(places), shape, shaped(state.nodes),
            shaped(state.rotations[: graph.classes]), shaped(state.slides), shaped(state.closures),
            np.where(lost, Reason.NOT_CLOSED, Reason.OK).astype(np.int8), places,
            self.plan.near_sketch([0.0, 0.0, *self.held], places),
        )  # fmt: skip

    def _open(self, state: State, shape: tuple[int, ...]) -> Flags:
        """Where a leg does not reach, or has no length."""
        lengths = [state.slides[slide] for slide in self.plan.core.graph.telescopic]
        open_ = np.zeros(shape, dtype=bool)
        for margin in (*state.closures, *lengths):
            open_ |= ~(np.asarray(margin) > 0)
        return open_


def _pick(poses: _Poses, z: Complexes) -> tuple[Complexes, Floats, Floats]:
    """Place, unknowns and slopes of the pose nearest to each place; nan where there is none."""
    if not poses.tree.n:
        shape = (len(poses.table), len(z))
        return np.full(z.shape, complex(np.nan, np.nan)), np.zeros(shape), np.zeros((2, *shape))
    at = np.stack([z.real, z.imag], axis=-1)
    index = np.asarray(poses.tree.query(np.where(np.isfinite(at), at, 0.0))[1])
    near = np.asarray(poses.tree.data)[index]
    return near[:, 0] + 1j * near[:, 1], poses.table[:, index], poses.slopes[:, :, index]


def _determinants(state: State, shape: tuple[int, ...]) -> Floats:
    """Determinants of a state's groups without a closed form, one a row."""
    return np.stack([np.broadcast_to(determinant, shape) for determinant in state.determinants])
