"""The poses of a question, solved, with angles that do not jump along their motion, and those that a picture shows."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mechdesign.errors import AssemblyError
from mechdesign.mechanism import Configuration, Mechanism, Reason
from mechdesign.mechanism.algebra import TURN, Value, wrap
from mechdesign.mechanism.configuration import joined
from mechdesign.mechanism.coordinates import Coordinate, angles_of
from mechdesign.mechanism.mechanism import begun
from mechdesign.mechanism.plan import Plan
from mechdesign.numerics.arrays import Floats, Ints, evenly
from mechdesign.parallel import map_chunks, worker_count
from mechdesign.results import Column
from mechdesign.study import Study
from mechdesign.study.poses import PoseGroup, Poses, default, expand
from mechdesign.study.schema.poses import PoseSection

# Poses solved at once: their arrays stay within some megabytes, however long the sweep.
POSES_AT_ONCE = 65536
# Threads that solve poses of a long motion: what is made of them is one thread's work, and more would fill the memory.
_MOST_SOLVERS = 4
# An angle this near to the cut at half a turn begins above it, whatever rounding says (radians).
ON_THE_CUT = 1e-9
# What an angle may turn between neighbouring poses so that the way round is certain.
SURE_TURN = np.pi / 2
# What is given moves at most this far between poses before any angle is looked at: an angle, and a length as a part of
# the mechanism's size. A link could turn nearly round within one longer step and seem to stand still.
MAX_TURN_STEP = np.pi / 4
MAX_LENGTH_STEP = 0.25
# Poses between two of the motion, at most: more than these only a jump needs, and it has no way round.
MAX_PARTS = 4096
# Poses of a motion that a picture can show.
MAX_SHOWN_POSES = 2001
# Solves poses with given values near rows of a study's, both of one shape.
Solve = Callable[[Sequence[Floats], Ints], Configuration]


@dataclass(frozen=True, eq=False)
class SolvedPoses:
    """Poses that give the same coordinates, solved: their rows in the study's order, and the names given."""

    rows: Ints
    given: tuple[str, ...]
    configuration: Configuration


def study_poses(study: Study, section: str) -> Poses:
    """Poses at which ``kinematics``, ``reliability`` or ``stiffness`` is asked.

    A section that says none takes those of kinematics, and these are by default a turn of the drive or its limits.

    Raises
    ------
    StudyError
        Where nothing sensible can be assumed.
    """
    for name in dict.fromkeys((section, "kinematics")):
        asked: PoseSection | None = getattr(study, name)
        if asked is not None and asked.at_nodes:
            # Here, for regions need SciPy, which is slow to import.
            from mechdesign.analyses.region.curves import workspace_nodes

            return workspace_nodes(study)
        if asked is not None:
            found = expand(asked, study.folder)
            if found is not None:
                return found
    return default(study.mechanism.description)


def radians(study: Study, coordinate: Coordinate, value: Value) -> Value:
    """A value in the study's units as the core takes it."""
    return value * study.units.angle_factor if coordinate.quantity == "angle" else value


def in_study_units(study: Study, coordinate: Coordinate, value: Value) -> Value:
    """A value of the core in the study's units."""
    return value / study.units.angle_factor if coordinate.quantity == "angle" else value


def solve_poses(
    study: Study, poses: Poses, wanted: Sequence[Coordinate] = (), jobs: int | None = 1
) -> Iterator[SolvedPoses]:  # fmt: skip
    """Solve each group of poses with the plan of its coordinates, at most `POSES_AT_ONCE` poses at a time.

    What a pose gives keeps its turns. Drives that are found lie within their limits. Where the poses are those of a
    motion or a grid, the other angles of the wanted coordinates and of the study's limits, in expressions too, are
    followed along it from a first value in (-180, 180] deg, a drive's from the sketch's; of listed poses each is in
    (-180, 180] deg. The result is the same for any number of threads, `jobs`.

    Raises
    ------
    MechanismError
        Where the coordinates of a pose do not determine the mechanism.
    """
    for group in poses.groups:
        yield from _solve_group(study, poses, group, wanted, jobs)


def _solve_group(
    study: Study, poses: Poses, group: PoseGroup, wanted: Sequence[Coordinate], jobs: int | None
) -> Iterator[SolvedPoses]:  # fmt: skip
    mechanism: Mechanism = study.mechanism
    plan = mechanism.plan(group.names)
    jobs = min(worker_count(jobs), _MOST_SOLVERS)
    pieces = [slice(begin, begin + POSES_AT_ONCE) for begin in range(0, len(group.rows), POSES_AT_ONCE)]

    def given(piece: slice = slice(None)) -> list[Floats]:
        columns = zip(plan.structure.given, group.columns(), strict=True)
        return [np.asarray(radians(study, c, v[piece]), dtype=float) for c, v in columns]

    def solve(values: Sequence[Floats], rows: Ints) -> Configuration:
        """Poses at or near some rows, not yet judged by the limits."""
        start = starts(mechanism, poses, rows) if plan.iterative else None
        return plan.solve(values, dimensions(poses, rows), start=start, limits=False)

    def at(piece: slice) -> Configuration:
        return solve(given(piece), group.rows[piece])

    def judged(piece: slice, configuration: Configuration, near: Mapping[str, Floats]) -> SolvedPoses:
        known = {**configuration.near, **near}
        configuration = replace(configuration, near=known, counted=configuration.counted | near.keys())
        plan.judge(configuration)
        return SolvedPoses(group.rows[piece], group.names, configuration)

    angles = [] if poses.listed else _followed(mechanism, plan, wanted)
    names = [angle.name for angle in angles]
    bounded = {bound.coordinate.name for bound in mechanism.bounds if bound.drive}
    if poses.designs == 1 and len(poses.grid) == 1 and not bounded.intersection(names):
        way, begun = _Way(plan, angles, solve), dict[str, float]()
        for piece, configuration in zip(pieces, map_chunks(at, pieces, jobs), strict=True):
            near = dict(zip(names, way.follow(piece.start, given(piece), configuration) if angles else (), strict=True))
            for name in mechanism.drives:
                if name in near and (known := np.isfinite(near[name])).any():
                    begin = begun.setdefault(name, float(near[name][known.argmax()]))
                    near[name] = _begun(study, poses, name, near[name], begin)
            yield judged(piece, configuration, near)
        return
    only = [at(piece) for piece in pieces] if len(pieces) == 1 else None
    near = {}
    if angles:
        values = np.empty((len(angles), len(group.rows)))
        for piece, configuration in zip(pieces, only or map_chunks(at, pieces, jobs), strict=True):
            values[:, piece] = _values_of(angles, configuration)
        lines = continuous(poses.grid[-1], plan, given(), angles, values, solve)
        near = dict(zip(names, (_across(row, poses.grid) for row in lines), strict=True))
        near |= {name: _begun(study, poses, name, near[name]) for name in mechanism.drives if name in near}
    for piece, configuration in zip(pieces, only or map_chunks(at, pieces, jobs), strict=True):
        yield judged(piece, configuration, {name: values[piece] for name, values in near.items()})


def _values_of(angles: Sequence[Coordinate], configuration: Configuration) -> Floats:
    """Values of some angles, shape (angles, ...)."""
    return np.stack([np.broadcast_to(configuration.value(angle), configuration.shape) for angle in angles])


@dataclass
class _Way:
    """Angles along a motion that comes piece by piece; `last` is the pose from which the next piece goes on."""

    plan: Plan
    angles: Sequence[Coordinate]
    solve: Solve
    last: tuple[int, Floats, Floats, Floats] | None = None  # row, what is given, angles, and their whole turns

    def follow(self, begin: int, given: Sequence[Floats], configuration: Configuration) -> Floats:
        """The angles without jumps at the poses of the next piece, whose first row is `begin`."""
        values = _values_of(self.angles, configuration)
        rows, turns = begin + np.arange(values.shape[1]), None
        if self.last is not None:
            row, places, before, turns = self.last
            rows, values = np.append(row, rows), np.concatenate([before[:, None], values], axis=1)
            given = [np.append(place, column) for place, column in zip(places, given, strict=True)]
        found = continuous(values.shape[1], self.plan, given, self.angles, values, self.solve, rows, turns)
        known = np.flatnonzero(np.isfinite(values).all(axis=0))
        if len(known):
            k = known[-1]
            turned = np.round((found[:, k] - values[:, k]) / TURN)
            self.last = int(rows[k]), np.array([column[k] for column in given]), values[:, k], turned
        return found[:, len(rows) - configuration.shape[0] :]


def _followed(mechanism: Mechanism, plan: Plan, wanted: Sequence[Coordinate]) -> list[Coordinate]:
    """Angles whose turns only the motion gives: not those given, nor drives whose limits leave them one turn."""
    settled = {bound.coordinate.name for bound in mechanism.bounds if bound.drive}
    settled -= {coordinate.name for coordinate in mechanism.counting}
    found = angles_of([*wanted, *mechanism.counting])
    return [angle for name, angle in found.items() if name not in plan.counted | settled]


def _begun(study: Study, poses: Poses, drive: str, values: Floats, first: float | None = None) -> Floats:
    """A drive's values in each design in the turn that leaves it within its limits, else near the sketch's value.

    `first` is where the motion began of which the values are a later piece.
    """
    mechanism = study.mechanism
    drawn = float(mechanism.sketch_configuration.value(mechanism.coordinate(drive)))
    lines = values.reshape(poses.designs, -1)
    known = np.isfinite(lines)
    begin = np.take_along_axis(lines, known.argmax(axis=1)[:, None], axis=1)[:, 0]
    if first is not None:
        begin = np.array([first])
    smallest, largest = (f(np.where(known, lines, begin[:, None]), axis=1) for f in (np.min, np.max))
    turns = np.round((drawn - begin) / TURN)
    sizes = mechanism.nominal | {name: place[:: lines.shape[1]] for name, place in poses.places.items()}
    for bound in mechanism.bounds:
        if bound.drive and bound.of_angle and bound.coordinate.name == drive:
            low, high = bound.ends(sizes)
            # All of the motion where it fits, or else its begin.
            for least, most in ((begin, begin), (smallest, largest)):
                fewest, greatest = np.ceil((low - least) / TURN), np.floor((high - most) / TURN)
                turns = np.where(fewest <= greatest, np.clip(turns, fewest, greatest), turns)
    return np.asarray(lines + TURN * turns[:, None]).ravel()


def dimensions(poses: Poses, rows: Ints) -> dict[str, Value]:
    """Dimensions of the designs that some poses belong to, where they differ from the nominal ones; shape of `rows`."""
    return {name: values[rows] for name, values in poses.places.items()}


def starts(mechanism: Mechanism, poses: Poses, rows: Ints) -> Configuration | None:
    """Where poses of other designs without a closed form start, see `begun`; shape of `rows`."""
    if not poses.places:
        return None
    each = poses.count // poses.designs
    designs, which = np.unique(rows // each, return_inverse=True)
    return begun(mechanism, dimensions(poses, designs * each)).take(which.reshape(rows.shape))


def pose_columns(study: Study, poses: Poses, rows: Ints | slice = slice(None)) -> list[Column]:
    """The coordinates that the study gives, as columns; of these rows of the poses."""
    return [
        Column(name, values[rows], study.units.label(study.mechanism.quantity(name)), "given")
        for name, values in poses.values.items()
    ]


def judge_failures(study: Study, poses: Poses, reason: NDArray[np.int8]) -> tuple[list[str], str]:
    """Warnings for poses that failed, and the message where that is an error (exit code 3).

    Parameters
    ----------
    reason : int8 array, shape (poses,)
        See `mechdesign.mechanism.Reason`.

    Raises
    ------
    AssemblyError
        If every pose failed.
    """
    bad = np.flatnonzero(reason)
    if not len(bad):
        return [], ""
    counts = [f"{np.count_nonzero(reason == kind)} {kind.text}" for kind in Reason if kind and (reason == kind).any()]
    told = f"{len(bad)} of {poses.count} poses are not valid ({', '.join(counts)})"
    named = [f"{pose_in_words(study, poses, int(row))}: {Reason(int(reason[row])).text}" for row in bad[:5]]
    if len(bad) == poses.count:
        raise AssemblyError(f"no pose is valid; {'; '.join(named)}" + ("; ..." if len(bad) > len(named) else ""))
    if poses.listed:
        return [told], f"pose {'; pose '.join(named)}"
    return [f"{told}; the first: {named[0]}"], ""


def pose_in_words(study: Study, poses: Poses, row: int, digits: int = 6) -> str:
    """``theta1 = 30 deg, theta2 = 60 deg`` for the pose of a row."""
    parts = []
    for name, values in poses.values.items():
        if np.isfinite(values[row]):
            unit = study.units.label(study.mechanism.quantity(name))
            parts.append(f"{name} = {values[row] + 0.0:.{digits}g} {unit}".rstrip())
    return ", ".join(parts)


def expand_outputs(study: Study, names: tuple[str, ...]) -> list[Coordinate]:
    """Outputs as coordinates, a point as its x and y.

    Raises
    ------
    MechanismError
        For a name that is neither.
    """
    mechanism = study.mechanism
    found = []
    for name in names:
        parts = [f"{name}.x", f"{name}.y"] if name in mechanism.points else [name]
        found += [mechanism.coordinate(part) for part in parts]
    return found


def continuous(
    line: int, plan: Plan, given: Sequence[Floats], angles: Sequence[Coordinate], values: Floats, solve: Solve,
    rows: Ints | None = None, begun: Floats | None = None,
) -> Floats:  # fmt: skip
    """Angles without jumps along a sweep, a path or each line of a grid, which has as many poses as `line`.

    Between poses that are far apart the mechanism is solved on the way, twice as finely until no angle turns by a
    right angle or more in one step. Poses without a value are stepped over.

    Parameters
    ----------
    given : sequence of ndarray, shape (poses,)
        Values of the plan's coordinates (radians, lengths).
    values : ndarray, shape (angles, poses)
        The angles at the poses (radians), nan where a pose has none.
    rows : ndarray of int, shape (poses,), optional
        Places of the poses along the motion; one after the other where left out.
    begun : ndarray, shape (angles,), optional
        Whole turns with which the first pose begins; by default its angles begin in (-pi, pi].
    """
    known = np.flatnonzero(np.isfinite(values).all(axis=0))
    if not len(known):
        return values
    seen = values if len(known) == values.shape[1] else values[:, known]
    starts = known // line != np.append(-1, known[:-1] // line)
    rises = np.diff(seen, axis=1)
    far = ~starts[1:] & (np.abs(rises) >= SURE_TURN).any(axis=0)
    parts = _parts(plan, given, known)
    at = np.flatnonzero(far | (parts > 1) & ~starts[1:])
    moved = wrap(rises[:, at])
    place = known if rows is None else rows[known]
    coarse = np.flatnonzero(
        (place[at + 1] == place[at] + 1) & ((parts[at] > 1) | (np.abs(moved) >= SURE_TURN).any(axis=0))
    )
    if len(coarse):
        begins = known[at[coarse]]
        moved[:, coarse] = _on_the_way(angles, given, begins, parts[at[coarse]], solve)
    # Whole turns from each of some poses on, counted anew on every line of a grid.
    heads = np.flatnonzero(starts)
    begins = np.concatenate([heads, at + 1])
    order = np.argsort(begins, kind="stable")
    more = np.concatenate([np.zeros((len(values), len(heads))), np.round((moved - rises[:, at]) / TURN)], axis=1)
    total = np.cumsum(more[:, order], axis=1)
    line_of = np.cumsum(order < len(heads)) - 1
    first = (seen[:, heads] < ON_THE_CUT - np.pi) if begun is None else begun[:, None]
    total += (first - total[:, order < len(heads)])[:, line_of]
    if not total.any():
        return values
    found = values.copy()
    found[:, known] += TURN * np.repeat(total, np.diff(np.append(begins[order], len(known))), axis=1)
    return found


def _parts(plan: Plan, given: Sequence[Floats], known: Ints) -> Ints:
    """In how many parts (a power of two) each step is made, so that what is given moves little in each."""
    longest = np.ones(len(known) - 1)
    for coordinate, values in zip(plan.structure.given, given, strict=True):
        step = {"angle": MAX_TURN_STEP, "length": MAX_LENGTH_STEP * plan.core.size}.get(coordinate.quantity)
        if step:
            longest = np.maximum(longest, np.abs(np.diff(values[known])) / step)
    parts = np.ones(len(longest), dtype=np.intp)
    # A step that is just one part must not become two by rounding.
    long = np.flatnonzero(longest > 1 + 1e-9)
    powers = np.ceil(np.log2(longest[long]) - 1e-9)
    parts[long] = 2 ** np.clip(powers, 0, math.log2(MAX_PARTS)).astype(np.intp)
    return parts


def _on_the_way(
    angles: Sequence[Coordinate], given: Sequence[Floats], begins: Ints, parts: Ints, solve: Solve
) -> Floats:
    """How far each angle turns to the next pose, shape (angles, begins); the nearest way where it does not close."""
    found = np.empty((len(angles), len(begins)))
    number = np.maximum(parts, 2)
    pending = np.arange(len(begins))
    while len(pending):
        count = int(number[pending].min())
        at = pending[number[pending] == count]
        left = [pending[number[pending] > count]]
        most = max(1, POSES_AT_ONCE // (count + 1))
        for first in range(0, len(at), most):
            pairs = at[first : first + most]
            way = np.linspace(0.0, 1.0, count + 1)
            between = [v[begins[pairs], None] * (1 - way) + v[begins[pairs] + 1, None] * way for v in given]
            turned = _values_of(angles, solve(between, begins[pairs, None]))
            steps = wrap(np.diff(turned, axis=-1))
            closed = np.isfinite(steps).all(axis=(0, 2))
            sure = (np.abs(steps) < SURE_TURN).all(axis=(0, 2))
            straight = wrap(turned[..., -1] - turned[..., 0])
            found[:, pairs] = np.where(closed, steps.sum(axis=-1), straight)
            finer = pairs[closed & ~sure & (count < MAX_PARTS)]
            number[finer] = 2 * count
            left.append(finer)
        pending = np.concatenate(left)
    return found


def _across(values: Floats, grid: Sequence[int]) -> Floats:
    """Whole turns between the lines of a grid taken out, its last axis being continuous already."""
    for axis in range(len(grid) - 2, -1, -1):
        # Each design of several has a grid of its own.
        for stack in values.reshape(-1, grid[axis], math.prod(grid[axis + 1 :])):
            for before, block in pairwise(stack):
                jump = (block - before)[np.isfinite(block - before)][:1]
                block -= TURN * np.round(jump / TURN).sum()
    return values


@dataclass(frozen=True, eq=False)
class Shown:
    """Poses of a study's kinematics in their order: those that give the same coordinates as the first.

    `rows` are those of the study's poses: all of them, or evenly spread where there are more than can be shown.
    """

    study: Study
    poses: Poses
    rows: Ints
    configuration: Configuration


@dataclass(eq=False)
class Keeper:
    """Keeps what pictures show of the poses that an analysis solves, chunk by chunk."""

    study: Study
    poses: Poses
    _parts: list[Configuration] = field(default_factory=list)

    @cached_property
    def rows(self) -> Ints:
        """Which poses are shown."""
        return _rows(self.poses, MAX_SHOWN_POSES)

    def keep(self, solved: SolvedPoses) -> None:
        """Take over the shown ones of some solved poses."""
        index = np.flatnonzero(np.isin(solved.rows, self.rows))
        if len(index):
            self._parts.append(solved.configuration.take(index))

    @property
    def shown(self) -> Shown:
        """All that was kept."""
        whole = self._parts[0]
        if len(self._parts) > 1:
            whole = joined(self._parts, self.rows.shape, whole.take(0).vectors, {})
        return Shown(self.study, self.poses, self.rows, whole)


def solve_shown(study: Study, most: int = MAX_SHOWN_POSES) -> Shown:
    """Solve what a picture shows of a motion that no analysis was asked for; raises as `solve_rows`."""
    poses = study_poses(study, "kinematics")
    rows = _rows(poses, most)
    return Shown(study, poses, rows, solve_rows(study, poses, rows))


def solve_rows(study: Study, poses: Poses, rows: Ints) -> Configuration:
    """Poses that give the same coordinates.

    Raises
    ------
    MechdesignError
        Where these do not determine the mechanism.
    """
    names = next(group.names for group in poses.groups if rows[0] in group.rows)
    plan = study.mechanism.plan(names)
    given = [radians(study, c, poses.values[name][rows]) for c, name in zip(plan.structure.given, names, strict=True)]
    return plan.solve(given)


def _rows(poses: Poses, most: int) -> Ints:
    rows = poses.groups[0].rows
    return rows[evenly(len(rows), most)]
