"""Solved poses on a lattice over the workspace, from which groups without a closed form are continued to other poses.

The way from the sketch would be long for most poses, and poses out of reach would be tried again and again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.mechanism.algebra import Value, nearest
from mechdesign.mechanism.configuration import Configuration, Reason, hide
from mechdesign.mechanism.continuation import MAX_CHANGE, scale_of, table_of
from mechdesign.mechanism.plan import Plan
from mechdesign.mechanism.solve import State

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

# Distance of neighbouring poses, as a part of the mechanism's size.
SPACING = 0.03
# A pose farther than this many spacings from the nearest solved one is out of reach.
REACH = 1.6
# Largest number of poses of a design.
MAX_POSES = 20_000
# The lattice grows through poses outside the study's limits over this many spacings, as there may be others beyond.
LIMIT_GAP = 15
# Step of finite differences, as a part of the mechanism's size.
DIFFERENCE_STEP = 1e-6
# Number of steps in which dimensions are changed.
STAGES = 8
# Number of steps in which held coordinates are changed from their values in the sketch.
HELD_STAGES = 16
# Every third node of the lattice along x and y is continued to other dimensions; the rest grows from these.
SEED_EVERY = 3
# Number of poses, of all designs, that are kept for later calls.
KEPT_POSES = 500_000
# Newton steps for a pose that was predicted by slopes.
CORRECTIONS = 5
# Newton steps near a fold, made one at a time.
SINGLE_CORRECTIONS = 30
# A Newton step that leaves less than this part of the determinant leads towards a fold (at a fold one half is left).
NEAR_FOLD = 0.8
# Steps to the neighbours of a node of the lattice.
NEIGHBOURS = np.array([1, 1j, -1, -1j])

# Dimensions of each pose that differ from the nominal ones.
Sizes = Mapping[str, Floats]


@dataclass(frozen=True, eq=False)
class _Poses:
    """Solved poses of one design on a lattice.

    `tree` and `lattice` have the places of the point, the latter in spacings from its place in the sketch. `table` has
    the unknowns of the groups without a closed form, shape (unknowns, poses), and `slopes` their derivatives by the
    point's x and y, shape (2, unknowns, poses).
    """

    tree: cKDTree
    lattice: Complexes
    table: Floats
    slopes: Floats


@dataclass(frozen=True, eq=False)
class Atlas:
    """Solved poses of a mechanism over its workspace, of the nominal dimensions and of others that have been asked for.

    `held` are the values of the plan's coordinates after the point's x and y. `signs` are the signs of the determinants
    of the groups without a closed form, shape (groups, 1); other signs mean another assembly. `origin` is the point in
    the sketch, and `poses` has the poses by dimensions.
    """

    plan: Plan
    held: tuple[float, ...]
    signs: Floats
    origin: complex
    poses: dict[bytes, _Poses] = field(default_factory=dict)

    @staticmethod
    def of(plan: Plan, held: tuple[float, ...]) -> Atlas:
        """The atlas of the nominal mechanism, grown from the sketch until no more poses are reached.

        Where the point in the sketch cannot have the held values, the atlas for the values in the sketch is continued
        to them step by step. It is empty if that fails.
        """
        sketch, coordinates = plan.core.sketch_configuration, plan.structure.given
        origin = complex(*(float(sketch.value(c)) for c in coordinates[:2]))

        def begun(values: Sequence[float]) -> tuple[Atlas, Floats]:
            given = [np.array([origin.real]), np.array([origin.imag]), *map(np.asarray, values)]
            first = plan.solve(given, limits=False)
            start = plan.start(first)
            grown = Atlas(plan, tuple(values), table_of(start.signs, (1,)), origin)
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
        (atlas.poses[b""],) = atlas._grown({}, np.zeros(len(lattice), dtype=np.intp), lattice, table)
        return atlas

    @property
    def empty(self) -> bool:
        """Whether no pose with the held values was reached."""
        return not self.poses[b""].tree.n

    @property
    def spacing(self) -> float:
        """Distance of neighbouring poses."""
        return SPACING * self.plan.core.size

    def solve(self, z: Complexes, places: Mapping[str, Value], *, beyond: bool = False) -> tuple[Configuration, Floats]:
        """The mechanism with its point at `z`, and how far it is from where two of its assemblies meet (a fold).

        Links that do not depend on a leg out of reach stay finite, as with closed forms. Where the nearest solved pose
        is far and a leg does not reach, the pose is that of a place on the way from the nearest one.

        Parameters
        ----------
        places : mapping of str to array_like
            Dimensions that differ from the nominal ones; they broadcast against `z`.
        beyond : bool
            Whether beyond a fold the pose is that at the fold, and beyond a leg's reach that with the leg stretched.

        Returns
        -------
        configuration : Configuration
            nan where no pose is reached.
        fold_distance : ndarray
            The product of the squared determinants, linear in the distance to a fold and negative beyond it; nan
            where no solved pose is near.
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

    def _solved(
        self, z: Complexes, sizes: Sizes, table: Floats, ahead: Value, within: Complexes, beyond: bool = False
    ) -> tuple[State, Floats]:
        """The mechanism near solved poses, and its distances from a fold (see `solve`).

        `table` has the unknowns of the solved poses, `ahead` their predicted change. Where Newton's method fails at
        once, the pose is solved with the point at `within`, and `z` is overwritten.
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

        Near a fold the equations are a parabola: Newton steps from one side pass to the other, where the determinant
        has the other sign, only if there is no solution. With the determinants D0 and D1 before and after a step, the
        squared determinant of the solution is g = D0 (2 D1 - D0); it is negative beyond the fold. Newton steps alone
        would halve D each time; a longer one ends where D squared is g, or beside the fold.
        """
        fold_distance, left = np.full(z.shape, np.nan), np.arange(len(z))
        unknowns, guess = table.copy(), table
        # The last unknowns, their determinants, and whether a Newton step led from there.
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
            # Beyond the fold the pose is that at the fold.
            share = np.where(crossed & led, before / (before - now), 1.0).min(axis=0)
            unknowns[:, left[beyond]] = (last + share * (guess - last))[:, beyond]
            squared = np.where(crossed & led, squares, now**2)
            fold_distance[left[beyond]] = -np.abs(np.prod(squared, axis=0))[beyond]
            # The group nearest to its fold tells how much longer the step should have been.
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
        """The whole mechanism after at most `steps` Newton steps."""
        vectors = self.plan.core.geometry.vectors(sizes)
        return self.plan.run([z.real, z.imag, *self.held], vectors, table, steps=steps, beyond=beyond)

    def _nearest(self, z: Complexes, sizes: Sizes) -> tuple[Complexes, Floats, Floats]:
        """Places of the nearest solved poses, nan where there are none, with their unknowns and slopes."""
        if not sizes or self.empty:
            return _pick(self.poses[b""], z)
        rows, which = np.unique(np.stack(list(sizes.values()), axis=-1), axis=0, return_inverse=True)
        which = which.ravel()
        keys = [",".join(sizes).encode() + row.tobytes() for row in rows]
        new = [k for k, key in enumerate(keys) if key not in self.poses]
        if new:
            fresh = self._designs({name: rows[new, k] for k, name in enumerate(sizes)}, len(new))
            self.poses.update({keys[k]: poses for k, poses in zip(new, fresh, strict=True)})
        count = len(self.poses[b""].table)
        near = np.empty(z.shape, dtype=complex)
        table, slopes = np.empty((count, len(z))), np.empty((2, count, len(z)))
        order = np.argsort(which, kind="stable")
        for key, lanes in zip(keys, np.split(order, np.cumsum(np.bincount(which))[:-1]), strict=True):
            near[lanes], table[:, lanes], slopes[:, :, lanes] = _pick(self.poses[key], z[lanes])
        if sum(poses.tree.n for poses in self.poses.values()) > KEPT_POSES:
            for key in self.poses.keys() - {b"", *keys}:
                del self.poses[key]
        return near, table, slopes

    def _designs(self, sizes: Sizes, count: int) -> list[_Poses]:
        """Poses of several designs: some nominal ones are continued to their dimensions and grow from there."""
        nominal = self.poses[b""]
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
        """Poses of several designs, grown from solved ones to neighbours on the lattice until no more are reached."""
        count = max((len(value) for value in sizes.values()), default=1)
        visited = set(zip(design.tolist(), lattice.tolist(), strict=True))
        layers = [(design[:0], lattice[:0], table[:, :0])]
        # Number of spacings since the last pose within the limits.
        outside = np.zeros(len(design), dtype=int)
        while len(design):
            z = self.origin + self.spacing * lattice
            own = {name: value[design] for name, value in sizes.items()}
            state, fold_distance = self._solved(z, own, table, 0.0, z)
            table, reached = table_of(state.unknowns, z.shape), fold_distance > 0
            # Poses at which a leg does not reach are kept, but nothing grows from them.
            outside = np.where(self._within(state, own, z.shape), 0, outside + 1)
            closed = np.flatnonzero(reached & ~self._open(state, z.shape) & (outside < LIMIT_GAP))
            layers.append((design[reached], lattice[reached], table[:, reached]))
            fresh: dict[tuple[int, complex], int] = {}
            steps = (lattice[closed, None] + NEIGHBOURS).ravel().tolist()
            parents = np.repeat(closed, len(NEIGHBOURS)).tolist()
            for k, owner, step in zip(parents, design[parents].tolist(), steps, strict=True):
                if (owner, step) not in visited:
                    fresh.setdefault((owner, step), k)
            if len(visited) + len(fresh) > MAX_POSES * count:
                break
            visited.update(fresh)
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
        """Derivatives of the unknowns by the point's x and y; 0 where these are not finite."""
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
        """The poses of a flat state in the shape of `lost`, nan where `lost`."""
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
        """Whether a leg does not reach, or has no length, in each pose."""
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
