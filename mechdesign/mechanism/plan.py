"""The batch solution of a mechanism for given coordinates."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.ground.work.chunks import map_chunks, worker_count
from mechdesign.ground.work.threads import keep_freed_memory
from mechdesign.mechanism.algebra import TURN, Value, angle_of, cross, norm2, picked
from mechdesign.mechanism.change_points import ChangePoints
from mechdesign.mechanism.configuration import Configuration, Reason, hide, joined
from mechdesign.mechanism.continuation import Start
from mechdesign.mechanism.coordinates import angles_of, leaves
from mechdesign.mechanism.core import Core
from mechdesign.mechanism.geometry import Vectors
from mechdesign.mechanism.loops import Unknowns, unknowns_of
from mechdesign.mechanism.solve import CONVERGED, NEWTON_STEPS, State, run
from mechdesign.mechanism.structure import Group, Structure
from mechdesign.mechanism.way import Way, flat

# A pose set exactly on a limit must not fall outside by rounding.
LIMIT_ROUNDING = 1e-14
# Squares of lengths below this part of that of the mechanism's size are zero.
ONE_PLACE = 1e-14
# Poses of a chunk: the fastest of 4,096 to 262,144, measured.
CHUNK = 32768
# The same on several threads, which gain only on longer arrays: each operation passes on the interpreter's lock.
THREAD_CHUNK = 131072


class Plan:
    """How to find the whole mechanism from given coordinates; made by `Mechanism.plan`.

    `modes` has the assembly mode of each group as drawn (0 where it has none). Motions pass change points if the study
    says ``branch: follow`` and `follows` is true; it must be false until the sketch is assembled, where they start.
    """

    def __init__(self, core: Core, structure: Structure, modes: Sequence[int], *, follows: bool = True) -> None:
        self.core = core
        self.structure = structure
        self.modes = tuple(modes)
        self.follows = follows and core.description.branch == "follow"
        linear = [k for group in structure.groups if group.form == "linear" for k in group.conditions]
        solved = angles_of(structure.values[k] for k in linear).values()
        #: Angles of which linear couplings give the turns.
        self.solved = tuple(angle.name for angle in solved if structure.counted(angle, core.graph) is None)
        self.iterative = any(group.form == "newton" for group in structure.groups)
        #: Angles in given expressions and in couplings whose turns are counted on the way from a start, as they do not
        #: follow from values.
        inner = angles_of(c for c in structure.values if c.kind == "expression")
        open_ = [angle for name, angle in inner.items() if name not in self.counted.union(self.solved)]
        self.angles = tuple(angle for angle in open_ if structure.counted(angle, core.graph) is None)
        self.followers = tuple(coupling.follower for coupling in core.couplings)
        # Given and coupled values that move these angles.
        behind = frozenset[int]().union(*(structure.behind(angle, core.graph) for angle in self.angles))
        moving = structure.coupled & {k for index in behind for k in structure.groups[index].conditions}
        self.pacing = [*range(len(structure.given)), *sorted(moving)] if self.angles else []

    @cached_property
    def _within_given(self) -> tuple[str, ...]:
        """Angles in given expressions, which keep their turns as the expressions do."""
        within = angles_of(c for c in self.structure.given if c.kind == "expression").values()
        return tuple(angle.name for angle in within if self.structure.counted(angle, self.core.graph) is not None)

    @property
    def continued(self) -> bool:
        """Whether poses are continued from a start: for groups without a closed form, or to count turns."""
        return self.iterative or bool(self.angles)

    @cached_property
    def change_points(self) -> ChangePoints | None:
        """Where the motion passes from one assembly to another, if the study lets it (``branch: follow``)."""
        if not self.follows or len(self.structure.given) != 1 or not any(self.modes):
            return None
        (coordinate,) = self.structure.given
        period = 2 * np.pi if coordinate.quantity == "angle" else self.core.size
        sketch = float(self.core.sketch_configuration.value(coordinate))
        return ChangePoints(self.structure.groups, self.modes, sketch, period, self._closures)

    def _closures(self, values: Floats, modes: Sequence[Value]) -> Sequence[Value]:
        return self.run([values], self.core.geometry.nominal, None, modes).closures

    def modes_at(self, given: Sequence[Value]) -> Sequence[Value]:
        """Assembly mode of each group at given values: as drawn, or changed at change points that are followed."""
        return self.modes if self.change_points is None else self.change_points.modes(given[0])

    def run(
        self,
        given: Sequence[Value],
        vectors: Vectors,
        guess: Unknowns | None,
        modes: Sequence[Value] | None = None,
        steps: int = NEWTON_STEPS,
        enough: float = CONVERGED,
        *,
        beyond: bool = False,
        turns: Sequence[Value] | Floats | None = None,
    ) -> State:
        """Solve all groups, in the assembly as drawn or that of `modes`; `turns` as in `begin`."""
        state = self.begin(given, vectors, turns)
        state.steps, state.enough, state.beyond = steps, enough, beyond
        return run(state, self.modes if modes is None else modes, guess)

    def begin(self, given: Sequence[Value], vectors: Vectors, turns: Sequence[Value] | Floats | None = None) -> State:
        """The state before the first group; `turns` has values near to the `angles`, else these are near the sketch."""
        state = State.start(self.core.graph, self.structure, vectors, given)
        state.size = self.core.size if self.iterative else 1.0
        state.whole, state.drawn = self._whole_turns, self._drawn_offsets
        near = self._drawn_turns if turns is None else turns
        state.near = {
            **{angle.name: value for angle, value in zip(self.angles, near, strict=False)},
            **self._given_angles(given),
        }
        return state

    def near_of(self, configuration: Configuration) -> list[Value] | None:
        """What `begin` takes to count the turns as in solved poses; None where it has none."""
        names = [angle.name for angle in self.angles]
        known = all(name in configuration.near for name in names)
        return [configuration.near[name] for name in names] if known else None

    def start(self, at: Configuration | None) -> Start:
        """A solved pose to continue from; the sketch where left out."""
        at = self.core.sketch_configuration if at is None else at
        given = [at.value(coordinate) for coordinate in self.structure.given]
        guess = self.unknowns(at, given)
        turns = [at.value(angle) for angle in self.angles]
        state = self.run(given, at.vectors, guess, turns=turns)
        moving = [state.given[k] for k in self.pacing]
        return Start(given, at.places, guess, [np.sign(d) for d in state.determinants], turns + moving)

    def unknowns(self, at: Configuration, given: Sequence[Value]) -> list[Value]:
        """Unknowns of the groups without a closed form in a solved pose; `given` are its given coordinates."""
        rotations = [*at.rotations]
        for position, (_, k) in enumerate(self.structure.spans):
            edge = self.structure.edges[len(self.core.graph.edges) + position]
            rotations.append(np.divide(at.nodes[edge.head] - at.nodes[edge.tail], given[k]))
        groups = [self.structure.groups[index] for index in self.structure.unknowns]
        return [value for group in groups for value in unknowns_of(group, at.nodes, rotations, at.slides)]

    def solve(
        self,
        given: Sequence[ArrayLike],
        places: Mapping[str, ArrayLike] | None = None,
        *,
        vectors: Vectors | None = None,
        start: Configuration | None = None,
        limits: bool = True,
        jobs: int | None = 1,
    ) -> Configuration:
        """Assemble the mechanism for a batch of poses.

        Parameters
        ----------
        given : sequence of array_like
            Values of the plan's coordinates in its order (angles in radians); they broadcast to the batch.
        places : mapping of str to array_like, optional
            Dimensions that differ from the nominal ones, by place name; they broadcast against `given`.
        vectors : Vectors, optional
            The edges for these dimensions, of a flat batch, where the caller has them.
        start : Configuration, optional
            Solved pose (of batch shape or single) that groups without a closed form are continued from; the sketch
            where left out.
        limits : bool
            Whether the study's limits make a pose invalid.
        jobs : int or None
            Threads for a large batch; None uses every processor. The result does not depend on it.

        Returns
        -------
        Configuration
            nan where the mechanism cannot be assembled; never raises for a pose.
        """
        values = [np.asarray(g, dtype=float) for g in given]
        if len(values) != len(self.structure.given):
            raise ValueError(f"{len(self.structure.given)} given coordinates needed, {len(values)} passed")
        dims = {name: np.asarray(v, dtype=float) for name, v in (places or {}).items()}
        shape = np.broadcast_shapes(*(v.shape for v in values), *(v.shape for v in dims.values()))
        count = int(np.prod(shape, dtype=np.int64))
        if count <= CHUNK:
            return self._at_once(values, dims, shape, vectors, start, limits)
        # By chunks that stay in the processor's cache, on one or more threads.
        keep_freed_memory()
        if self.change_points is not None:
            self.change_points.cover(values[0])
        columns, sizes = [flat(v, shape) for v in values], {name: flat(v, shape) for name, v in dims.items()}
        length = CHUNK if self.continued or worker_count(jobs) == 1 else THREAD_CHUNK
        starts: Ints | None = None
        if start is not None and start.shape:
            starts = np.broadcast_to(np.arange(start.reason.size).reshape(start.shape), shape).reshape(-1)

        def part(begin: int) -> Configuration:
            rows, begun = slice(begin, begin + length), start
            if start is not None and starts is not None:
                begun = start.take(np.unravel_index(starts[rows], start.shape))
            dimensions = {name: picked(v, rows) for name, v in sizes.items()}
            own = None if vectors is None else vectors.take(rows)
            drives = [picked(v, rows) for v in columns]
            return self._at_once(drives, dimensions, (min(length, count - begin),), own, begun, limits)

        parts = map_chunks(part, range(0, count, length), jobs)
        counted = sorted({*(angle.name for angle in self.angles), *self._within_given, *self.coupled})
        whole = joined(parts, shape, vectors or self.core.geometry.vectors(dims), dims, counted)
        return replace(whole, near={**self.turns(values, dims), **whole.near}, counted=self.counted)

    def _at_once(
        self,
        values: Sequence[Value],
        dims: Mapping[str, Value],
        shape: tuple[int, ...],
        vectors: Vectors | None,
        start: Configuration | None,
        limits: bool,
    ) -> Configuration:
        """`solve` in one piece, for arrays of floats that broadcast to `shape`."""
        reached: Flags | None = None
        guess: Unknowns | None = None
        turns: Floats = np.empty((0, *shape))
        if self.continued:
            begin = self.start(start)
            way = Way(self.structure, self.core, self.angles, self.pacing, self.run, self.modes_at)
            guess, reached, turns = way.to(values, dims, shape, begin)
        vectors = vectors or self.core.geometry.vectors(dims)
        state = self.run(values, vectors, guess, self.modes_at(values), turns=turns)
        if self.iterative and reached is not None:
            # The end of a path must be a pose, and of the same assembly.
            reached &= state.solved(shape, begin.signs)
        else:
            # What has closed forms needs no way; where there is none an angle is nearest to where the way ended.
            reached = None
        poses = self.configuration(state, shape, dims, reached, values)
        if self.angles:
            near = dict(zip((angle.name for angle in self.angles), turns, strict=True))
            poses = replace(poses, near={**poses.near, **near})
        near = {name: state.near[name] for name in (*self._within_given, *self.solved)}
        if near or self.followers:
            poses = replace(poses, near={**poses.near, **near, **state.counted(self.followers)})
        if limits:
            self.judge(poses)
        return poses

    def turns(self, given: Sequence[Value], dims: Mapping[str, Value]) -> dict[str, Value]:
        """By name, values that angles are reported within half a turn of: given angles, and the limits of drives."""
        return self.core.turns(dims) | self._given_angles(given)

    def _given_angles(self, given: Sequence[Value]) -> dict[str, Value]:
        return {c.name: v for c, v in zip(self.structure.given, given, strict=False) if c.kind == "angle"}

    @cached_property
    def _drawn_offsets(self) -> dict[str, float]:
        """Angles of bodies against their classes at the nominal dimensions."""
        return {body: float(angle_of(np.asarray(turn))) for body, turn in self.core.geometry.nominal.offsets.items()}

    @cached_property
    def _whole_turns(self) -> dict[str, float]:
        """Whole turns by which sums of the sketch's drives are away from the angles that the sketch shows."""
        if not self.structure.functions:
            return {}
        drawn = [self.core.sketch.value(c) or 0.0 if c.kind == "angle" else 0.0 for c in self.structure.given]
        sketch = State.start(self.core.graph, self.structure, self.core.geometry.nominal, drawn)
        sketch.drawn = self._drawn_offsets
        angles = angles_of((*self.structure.values, *self.followers)).values()
        # What follows has the turns that its coupling gives it.
        return {
            name: TURN * float(np.round(turned / TURN))
            for name, turned in sketch.counted(angles).items()
            if np.isfinite(turned)
        }

    @cached_property
    def _drawn_turns(self) -> list[Value]:
        """The `angles` in the sketch."""
        return [self.core.sketch_configuration.value(angle) for angle in self.angles]

    @cached_property
    def _drawn_angles(self) -> dict[str, float]:
        return self.core.drawn_angles()

    def near_sketch(self, given: Sequence[Value], dims: Mapping[str, Value]) -> dict[str, Value]:
        """The same, and for other angles the values in the sketch."""
        return self._drawn_angles | self.turns(given, dims)

    @cached_property
    def coupled(self) -> frozenset[str]:
        """Angles that couplings count the turns of, from pose to pose the same whatever the way between them."""
        if not self.structure.functions:
            return frozenset()
        known = [c for c in self.followers if self.structure.counted(c, self.core.graph) is not None]
        return frozenset(angle.name for angle in (*self.angles, *known)).union(self.solved)

    @cached_property
    def counted(self) -> frozenset[str]:
        """Angles whose turns are given."""
        return frozenset(c.name for c in self.structure.given if c.kind == "angle")

    def configuration(
        self,
        state: State,
        shape: tuple[int, ...],
        dims: Mapping[str, Value],
        reached: Flags | None,
        given: Sequence[Value] | None = None,
    ) -> Configuration:
        """A state as a configuration, with the reason of each pose; angles that are `given` keep their turns."""
        graph = self.core.graph
        open_: Flags = np.zeros((), dtype=bool)
        # A group that does not close leaves nan in its first unknown.
        values = [state.rotations[root] for group in self.structure.groups for root in group.angles[:1]]
        values += [state.slides[slide] for group in self.structure.groups for slide in group.slides[:1]]
        values += [state.nodes[base] for group in self.structure.groups for base in group.bases[:1]]
        values += [state.nodes[c.node] for c in self.structure.given if c.kind in ("x", "y")]
        values += [state.rotations[graph.bodies[c.body][0]] for c in self.structure.given if c.kind == "angle"]
        for value in values:
            open_ = open_ | ~np.isfinite(np.real(value))
        for slide in graph.telescopic:
            open_ = open_ | ~(np.asarray(state.slides[slide]) > 0)
        for k, _ in self.structure.spans:
            open_ = open_ | ~(np.asarray(state.w[k]) >= 0)
        reason = np.zeros(shape, dtype=np.int8)
        if np.any(open_):
            reason[np.broadcast_to(open_, shape)] = Reason.NOT_CLOSED
            reason[np.broadcast_to(self._free(state), shape)] = Reason.NOT_DETERMINED
        if reached is not None:
            solved = state.solved(shape)
            reason[~reached & solved & (reason == Reason.OK)] = Reason.OTHER_ASSEMBLY
            reason[~reached & ~solved] = Reason.NOT_CLOSED
        for number, lost in self._lost_values(state):
            first = lost & (reason < Reason.NO_VALUE)
            reason[np.broadcast_to(first, shape)] = Reason.NO_VALUE + number
        nodes, rotations, slides = state.nodes, state.rotations[: graph.classes], state.slides
        if (reason != Reason.OK).any():
            lost = reason != Reason.OK
            nodes = [hide(x, lost) for x in nodes]
            rotations = [hide(u, lost) for u in rotations]
            slides = [hide(s, lost) for s in slides]
        return Configuration(
            graph, state.vectors, shape, nodes, rotations, slides, state.closures, reason, dict(dims),
            self.turns(given or (), dims), frozenset() if given is None else self.counted,
        )  # fmt: skip

    def _lost_values(self, state: State) -> Iterator[tuple[int, Flags]]:
        """Couplings that have no value at some poses though what they follow has, in the order of solution."""
        for group in self.structure.groups:
            if group.form == "coupled" and not np.isfinite(state.given[group.conditions[0]]).all():
                number = self.coupling_of(group)
                values = [state.pose().value(part) for part in leaves(self.structure.functions[number])]
                known = [np.isfinite(value) for value in values]
                yield (
                    number,
                    np.all(np.broadcast_arrays(~np.isfinite(state.given[group.conditions[0]]), *known), axis=0),
                )

    def coupling_of(self, group: Group) -> int:
        """Number of the coupling whose value a coupled group is."""
        return group.conditions[0] - len(self.structure.given)

    def _free(self, state: State) -> Flags:
        """Poses in which links that meet may point anywhere: their other joints are at one place."""
        free: Flags = np.zeros((), dtype=bool)
        for group in self.structure.groups:
            if group.form in ("two angles", "angle and turning slide"):
                span, links, lines = state.dyad(group)
                one, *other = [norm2(links[root]) for root in group.angles]
                apart = [one - part for part in other] or [cross(lines[group.slides[0]], links[group.angles[0]]) ** 2]
                same = np.maximum(norm2(span), np.abs(apart[0])) <= ONE_PLACE * self.core.size**2
                free = free | (same & ~np.isfinite(np.real(state.rotations[group.angles[0]])))
        return free

    def judge(self, configuration: Configuration) -> None:
        """Set the reason of solved poses that are outside the study's limits."""
        reason, places = configuration.reason, {**self.core.nominal, **configuration.places}
        for bound in self.core.bounds:
            slack = LIMIT_ROUNDING * bound.scale(self.core.size)
            for _, margin in bound.margins(configuration, places):
                outside = np.broadcast_to(margin, configuration.shape) < -slack
                reason[outside & (reason == Reason.OK)] = Reason.LIMIT
