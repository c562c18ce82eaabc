"""Solved poses all over a region, from which others are continued where the inverse problem has no closed form.

From the sketch every pose would be a long way off, and what cannot be reached would be tried again and again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.configuration import Configuration, Reason, hide
from mechdesign.mechanism.continuation import unknowns_of
from mechdesign.mechanism.plan import Plan
from mechdesign.mechanism.state import State
from mechdesign.numerics.arrays import Complexes, Flags, Floats, Ints

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

# Distance of neighbouring poses, as a share of the mechanism's size.
SPACING = 0.03
# Beyond this many spacings from the nearest solved pose nothing is inside; where the groups are not solved at once, the
# place so far from it is told.
BEYOND = 1.6
MOST = 20_000
# Poses outside the study's limits are passed through over this many spacings: there may be another piece beyond.
GAP = 15
# Step of differences, and of a change of dimensions, as parts of the mechanism's size and of the change.
STEP, STAGES = 1e-6, 8
# Beyond a fold, how often the way is cut back, and how much shorter than to where the grip is expected to vanish.
BACK, ASIDE = 3, 1e-3
# Every so many-th pose of the nominal mechanism is brought to other dimensions, where the poses of those grow from.
COARSE = 3
# Poses of all designs that are kept for the next question.
KEPT = 500_000
SIDES = np.array([1, 1j, -1, -1j])


@dataclass(frozen=True, eq=False)
class _Poses:
    """Solved poses of one design on a lattice.

    Parameters
    ----------
    tree : cKDTree
        Places of the point.
    table : ndarray, shape (unknowns, poses)
        Unknowns of the groups without a closed form.
    slopes : ndarray, shape (2, unknowns, poses)
        Their derivatives by the point's x and y.
    lattice : ndarray of complex, shape (poses,)
        Places in spacings from the sketch's.
    grip : ndarray, shape (poses,)
        See `Atlas.solve`.
    """

    tree: cKDTree
    table: Floats
    slopes: Floats
    lattice: Complexes
    grip: Floats


@dataclass(frozen=True, eq=False)
class Atlas:
    """Poses of a mechanism all over its region, for the nominal dimensions and for others as they are asked for.

    Parameters
    ----------
    approach : Approach
    origin : complex
        The point's place in the sketch.
    """

    plan: Plan
    approach: Approach
    origin: complex
    known: dict[bytes, _Poses] = field(default_factory=dict)

    @staticmethod
    def of(plan: Plan, held: tuple[float, ...]) -> Atlas:
        """Poses of the nominal mechanism, grown from the sketch's place until nothing more is reached.

        There are none where the mechanism cannot be brought from its sketch to the held values.
        """
        sketch = plan.core.sketch_configuration
        origin = complex(*(float(sketch.value(c)) for c in plan.structure.given[:2]))
        given = [np.array([origin.real]), np.array([origin.imag]), *map(np.asarray, held)]
        first = plan.solve(given, limits=False)
        guess = unknowns_of(plan.structure, plan.all_rotations(first, given), first.slides, first.nodes)
        state = plan.run(given, first.vectors, guess)
        signs = [float(np.sign(np.ravel(d)[0])) for d in state.determinants]
        atlas = Atlas(plan, Approach(plan, held, signs), origin)
        seeds = np.flatnonzero(first.valid)
        (atlas.known[b""],) = atlas._grown({}, seeds, np.zeros(len(seeds), complex), unknowns(state, (1,))[:, seeds])
        return atlas

    @property
    def empty(self) -> bool:
        """Whether the held values cannot be had at the point's place in the sketch, where poses would grow from."""
        return not self.known[b""].tree.n

    @cached_property
    def _drawn(self) -> dict[str, float]:
        """Angles of the sketch: others lie within half a turn of them."""
        return self.plan.core.drawn_angles()

    @property
    def spacing(self) -> float:
        """Distance of neighbouring poses."""
        return SPACING * self.plan.core.size

    def solve(self, z: Complexes, places: Mapping[str, Value]) -> tuple[Configuration, Floats]:
        """The mechanism with its point at `z`, and how far it is from where assemblies meet: its grip.

        The grip is the product of the squared determinants: zero at a fold, linear in the distance to it, and negative
        beyond, where a pose near the fold is told; nan where nothing is known. What does not depend on a leg that
        cannot reach stays finite, as where all groups have a closed form.

        Parameters
        ----------
        places : mapping of str to array_like
            Dimensions that differ from the nominal ones; they broadcast against `z`.
        """
        shape = np.broadcast_shapes(z.shape, *(np.shape(value) for value in places.values()))
        flat = np.broadcast_to(z, shape).ravel()
        sizes = {name: np.broadcast_to(np.asarray(v, dtype=float), shape).ravel() for name, v in places.items()}
        near, table, slopes, firm = self._nearest(flat, sizes)
        lost = ~np.isfinite(near) | ~np.isfinite(flat)
        way = np.where(lost, 0.0, flat - near)
        reach = BEYOND * self.spacing
        far = np.abs(way) > reach
        goal = np.where(lost, self.origin, flat)
        with np.errstate(all="ignore"):
            found, grip = self.approach.corrected(goal, sizes, table, self.approach.expected(table, slopes, way), ~far)

            def again(rows: Ints, step: Complexes) -> Floats:
                own = {name: value[rows] for name, value in sizes.items()}
                goal[rows], start = near[rows] + step, table[:, rows]
                ahead = self.approach.expected(start, slopes[:, :, rows], step)
                every = np.ones(rows.shape, dtype=bool)
                found[:, rows], new = self.approach.corrected(goal[rows], own, start, ahead, every)
                return new

            rows = np.flatnonzero(far & np.isnan(grip))
            if len(rows):
                way[rows] *= reach / np.abs(way[rows])
                grip[rows] = again(rows, way[rows])
            # Beyond a fold the pose where the way from the known one meets it is told: the grip is linear along it.
            rows = np.flatnonzero(grip < 0)
            share, now = np.ones(len(rows)), grip[rows]
            for _ in range(BACK):
                if not len(rows):
                    break
                share = share * (1 - ASIDE) / (1 - now / firm[rows])
                now = again(rows, np.asarray(share * way[rows]))
                rows, share, now = rows[now < 0], share[now < 0], now[now < 0]
            state = self.approach.state(goal, sizes, found)
        grip[lost] = np.nan
        told = self._told(state, places, flat.shape)
        reason = np.where(grip > 0, np.int8(Reason.OK), np.int8(Reason.NOT_CLOSED)).astype(np.int8)
        told = replace(told, reason=reason)
        # What is told of another place is not inside.
        open_ = self._open(state, flat.shape)
        grip[far & ~open_] = np.nan
        return _shaped(told, shape), grip.reshape(shape)

    def _nearest(self, z: Complexes, sizes: Mapping[str, Floats]) -> tuple[Complexes, Floats, Floats, Floats]:
        """Places of the nearest solved poses (nan where there is none), their unknowns, slopes and grip."""
        if not sizes or self.empty:
            return _pick(self.known[b""], z)
        rows = np.stack(list(sizes.values()), axis=-1)
        rows, which = np.unique(rows, axis=0, return_inverse=True)
        which = which.ravel()
        keys = [",".join(sizes).encode() + row.tobytes() for row in rows]
        new = [k for k, key in enumerate(keys) if key not in self.known]
        if new:
            fresh = self._designs({name: rows[new, k] for k, name in enumerate(sizes)}, len(new))
            self.known.update({keys[k]: poses for k, poses in zip(new, fresh, strict=True)})
        count = len(self.known[b""].table)
        near = np.empty(z.shape, dtype=complex)
        table, slopes, grip = np.empty((count, len(z))), np.empty((2, count, len(z))), np.empty(z.shape)
        order = np.argsort(which, kind="stable")
        ends = np.searchsorted(which[order], np.arange(len(keys) + 1))
        for key, begin, end in zip(keys, ends[:-1], ends[1:], strict=True):
            lanes = order[begin:end]
            near[lanes], table[:, lanes], slopes[:, :, lanes], grip[lanes] = _pick(self.known[key], z[lanes])
        # Those found longest ago go first, never the nominal ones.
        total = sum(poses.tree.n for poses in self.known.values())
        for key in [key for key in self.known if key]:
            if total <= KEPT:
                break
            total -= self.known.pop(key).tree.n
        return near, table, slopes, grip

    def _designs(self, sizes: Mapping[str, Floats], count: int) -> list[_Poses]:
        """Poses of several designs: some of the nominal ones are brought to their dimensions and grow from there."""
        nominal = self.known[b""]
        coarse = np.flatnonzero((nominal.lattice.real % COARSE == 0) & (nominal.lattice.imag % COARSE == 0))
        design, seed = np.repeat(np.arange(count), len(coarse)), np.tile(coarse, count)
        table, lattice = nominal.table[:, seed], nominal.lattice[seed]
        for stage in range(1, STAGES + 1):
            between = {}
            for name, value in sizes.items():
                begin = self.plan.core.nominal.get(name, 0.0)
                between[name] = begin + (stage / STAGES) * (value[design] - begin)
            z = self.origin + self.spacing * lattice
            table, grip = self.approach.corrected(z, between, table, 0.0, np.ones(z.shape, dtype=bool))
            reached = grip > 0
            design, lattice, table = design[reached], lattice[reached], table[:, reached]
        return self._grown(sizes, design, lattice, table)

    def _grown(self, sizes: Mapping[str, Floats], design: Ints, lattice: Complexes, table: Floats) -> list[_Poses]:
        """Poses of all designs, from solved ones to their neighbours on the lattice until nothing more closes."""
        count = max((len(value) for value in sizes.values()), default=1)
        seen = set(zip(design.tolist(), lattice.tolist(), strict=True))
        layers = []
        # Spacings since a pose was within the limits.
        outside = np.zeros(len(design), dtype=int)
        while len(design):
            z = self.origin + self.spacing * lattice
            own = {name: value[design] for name, value in sizes.items()}
            table, grip = self.approach.corrected(z, own, table, 0.0, np.ones(z.shape, dtype=bool))
            reached = grip > 0
            state = self.approach.state(z, own, table)
            # Poses just outside, where a leg does not reach, tell how far outside it is; but nothing grows from them.
            outside = np.where(self._within(state, own, z.shape), 0, outside + 1)
            closed = np.flatnonzero(reached & ~self._open(state, z.shape) & (outside < GAP))
            layers.append((design[reached], lattice[reached], table[:, reached], grip[reached]))
            fresh: dict[tuple[int, complex], int] = {}
            steps = (lattice[closed, None] + SIDES).ravel().tolist()
            parents = np.repeat(closed, len(SIDES)).tolist()
            for k, owner, step in zip(parents, design[parents].tolist(), steps, strict=True):
                if (owner, step) not in seen:
                    fresh.setdefault((owner, step), k)
            if len(seen) + len(fresh) > MOST * count:
                break
            seen.update(fresh)
            parent = np.array(list(fresh.values()), dtype=np.intp)
            design = design[parent]
            lattice = np.array([step for _, step in fresh], dtype=complex)
            table, outside = table[:, parent], outside[parent]
        none = (np.zeros(0, np.intp), np.zeros(0, complex), np.zeros((len(table), 0)), np.zeros(0))
        design, lattice, table, grip = (np.concatenate(parts, axis=-1) for parts in zip(none, *layers, strict=True))
        slopes = self._slopes(lattice, {name: value[design] for name, value in sizes.items()}, table)
        found = []
        for k in range(count):
            lanes = np.flatnonzero(design == k)
            z = self.origin + self.spacing * lattice[lanes]
            # Here, for a mechanism is drawn without SciPy.
            from scipy.spatial import cKDTree

            tree = cKDTree(np.stack([z.real, z.imag], axis=-1))
            found.append(_Poses(tree, table[:, lanes], slopes[:, :, lanes], lattice[lanes], grip[lanes]))
        return found

    def _slopes(self, lattice: Complexes, sizes: Mapping[str, Floats], table: Floats) -> Floats:
        """Derivatives of the unknowns by the point's x and y; 0 where they have none."""
        h = STEP * self.plan.core.size
        z = self.origin + self.spacing * lattice
        found = []
        for step in (h, 1j * h):
            with np.errstate(all="ignore"):
                state = self.approach.step(z + step, sizes, table, 1)
                slope = (unknowns(state, z.shape) - table) / h
            found.append(np.where(np.isfinite(slope).all(axis=0), slope, 0.0))
        return np.stack(found)

    def _within(self, state: State, sizes: Mapping[str, Floats], shape: tuple[int, ...]) -> Flags:
        """Which poses are within the study's limits."""
        mechanism, found = self.plan.core, np.ones(shape, dtype=bool)
        for _, margin in mechanism.margins(self._told(state, sizes, shape)):
            found &= np.asarray(margin) >= 0
        return found

    def _told(self, state: State, places: Mapping[str, Value], shape: tuple[int, ...]) -> Configuration:
        """A state as a configuration, whether it was reached or not."""
        graph, vectors = self.plan.core.graph, self.plan.core.geometry.vectors(places)
        return Configuration(
            graph, vectors, shape, state.nodes, state.rotations[: graph.classes], state.slides, state.closures,
            np.zeros(shape, dtype=np.int8), places,
            self._drawn | self.plan.turns([0.0, 0.0, *self.approach.held], places),
        )  # fmt: skip

    def _open(self, state: State, shape: tuple[int, ...]) -> Flags:
        """Where a leg does not reach, or has no length."""
        lengths = [state.slides[slide] for slide in self.plan.core.graph.telescopic]
        found = np.zeros(shape, dtype=bool)
        for margin in (*state.closures, *lengths):
            found |= ~(np.asarray(margin) > 0)
        return found


def _pick(poses: _Poses, z: Complexes) -> tuple[Complexes, Floats, Floats, Floats]:
    """Place, unknowns, slopes and grip of the pose nearest to each place; nan where there is none."""
    if not poses.tree.n:
        shape = (len(poses.table), len(z))
        return np.full(z.shape, complex(np.nan, np.nan)), np.zeros(shape), np.zeros((2, *shape)), np.ones(z.shape)
    at = np.stack([z.real, z.imag], axis=-1)
    index = np.asarray(poses.tree.query(np.where(np.isfinite(at), at, 0.0))[1])
    near = np.asarray(poses.tree.data)[index]
    return near[:, 0] + 1j * near[:, 1], poses.table[:, index], poses.slopes[:, :, index], poses.grip[index]


def _shaped(found: Configuration, shape: tuple[int, ...]) -> Configuration:
    """A flat batch in another shape."""

    def shaped(value: Value) -> Value:
        value = np.asarray(value)
        return value if value.ndim == 0 else value.reshape(shape)

    return replace(
        found, shape=shape, nodes=[shaped(node) for node in found.nodes],
        rotations=[shaped(turn) for turn in found.rotations], slides=[shaped(slide) for slide in found.slides],
        closures=[shaped(closure) for closure in found.closures], reason=found.reason.reshape(shape),
        near={name: shaped(value) for name, value in found.near.items()},
    )  # fmt: skip


def hidden(found: Configuration, lost: Flags) -> Configuration:
    """nan for poses that are not reached."""
    return replace(
        found, nodes=[hide(node, lost) for node in found.nodes],
        rotations=[hide(turn, lost) for turn in found.rotations],
        slides=[hide(slide, lost) for slide in found.slides],
        closures=[hide(closure, lost) for closure in found.closures],
    )  # fmt: skip
