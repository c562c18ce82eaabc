"""The poses of a question, solved, with angles that do not jump along their motion, and those that a picture shows."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Self

import numpy as np
from numpy.typing import NDArray

from mechdesign.cautions import Caution
from mechdesign.curve.anchors import Anchors
from mechdesign.curve.corners import curve_of
from mechdesign.curve.motion import Curve, from_sketch
from mechdesign.curve.turns import drive_turns
from mechdesign.errors import AssemblyError
from mechdesign.mechanism import Configuration, Mechanism, Reason
from mechdesign.mechanism.algebra import TURN, Value
from mechdesign.mechanism.configuration import joined
from mechdesign.mechanism.coordinates import Coordinate, angles_of
from mechdesign.mechanism.mechanism import begun
from mechdesign.mechanism.plan import Plan
from mechdesign.numerics.arrays import Floats, Ints, evenly
from mechdesign.questions.columns import GIVEN, TIMED
from mechdesign.results import Column, Scope, Table
from mechdesign.study import Study
from mechdesign.study.designs import Designs
from mechdesign.study.expansion import OWN, Numbers, default, expand, number_of_poses
from mechdesign.study.poses import TIME, PoseGroup, Poses
from mechdesign.study.schema.poses import PoseSection
from mechdesign.work.chunks import map_chunks, worker_count

# Poses solved at once: their arrays stay within some megabytes, however long the sweep.
POSES_AT_ONCE = 65536
# Threads that solve poses of a long motion: what is made of them is one thread's work, and more would fill the memory.
_MOST_SOLVERS = 4
# Poses of a motion that a picture can show.
MAX_SHOWN_POSES = 2001


@dataclass(frozen=True, eq=False)
class SolvedPoses:
    """Poses that give the same coordinates, solved: their rows in the study's order, and the names given."""

    rows: Ints
    names: tuple[str, ...]
    configuration: Configuration


def study_poses(study: Study, section: str, numbers: Numbers = OWN) -> Poses:
    """Poses at which ``kinematics``, ``reliability`` or ``stiffness`` is asked, of the study's own design or of some.

    A section that says none takes those of kinematics, and these are by default a turn of the drive or its limits.

    Raises
    ------
    StudyError
        Where nothing sensible can be assumed.
    """
    for owner in _with_poses(study, section):
        if owner.at_nodes:
            # Here, for regions need SciPy, which is slow to import.
            from mechdesign.region.curves import workspace_nodes

            return workspace_nodes(study)
        poses = expand(owner, study.folder, numbers)
        if poses is not None:
            return poses
    return default(study.mechanism.description, numbers)


def _with_poses(study: Study, section: str) -> list[PoseSection]:
    """The sections of a study that may give the poses of one, in their order."""
    own: PoseSection | None = getattr(study, section)
    names = (section, *(own.fallbacks if own is not None else ("kinematics",)))
    return [part for name in dict.fromkeys(names) if (part := getattr(study, name)) is not None]


def alike(designs: Designs, section: str, rows: Ints) -> Iterator[Ints]:
    """Some designs in groups that have as many poses, `POSES_AT_ONCE` at most unless they are of one design."""
    if not len(rows):
        return
    owner = next((part for part in _with_poses(designs.study, section) if part.source is not None), None)
    counts = (
        np.zeros((len(rows), 0))
        if owner is None
        else number_of_poses(owner, designs.study.folder, designs.take(rows).numbers)
    )
    kinds, which = np.unique(counts, axis=0, return_inverse=True)
    for kind in range(len(kinds)):
        members = rows[which.ravel() == kind]
        if (kinds[kind] < 0).any():
            yield members
            continue
        count = study_poses(designs.study, section, designs.take(members[:1]).numbers).count
        size = max(1, POSES_AT_ONCE // count)
        yield from (members[begin : begin + size] for begin in range(0, len(members), size))


def radians(study: Study, coordinate: Coordinate, value: Value) -> Value:
    """A value in the study's units as the core takes it."""
    return value * study.units.angle_factor if coordinate.quantity == "angle" else value


def in_study_units(study: Study, coordinate: Coordinate, value: Value) -> Value:
    """A value of the core in the study's units."""
    return value / study.units.angle_factor if coordinate.quantity == "angle" else value


def solve_poses(
    study: Study, poses: Poses, coordinates: Sequence[Coordinate] = (), jobs: int | None = 1, curve: Curve | None = None
) -> Iterator[SolvedPoses]:  # fmt: skip
    """Solve each group of poses with the plan of its coordinates, at most `POSES_AT_ONCE` poses at a time.

    What a pose gives keeps its turns. Drives that are found lie within their limits. Where the poses are those of a
    motion or a grid, the other angles of the `coordinates` and of the study's limits, in expressions too, are
    followed along it from a first value in (-180, 180] deg, a drive's from the sketch's; of listed poses each is in
    (-180, 180] deg. Those of torsion springs have in all of them the turns of the way from the sketch. The result is
    the same for any number of threads, `jobs`. `curve` is the motion of the poses, with these angles, where it is there
    already.

    Raises
    ------
    MechanismError
        Where the coordinates of a pose do not determine the mechanism.
    """
    for group in poses.groups:
        yield from _solve_group(study, poses, group, coordinates, jobs, curve)


def _solve_group(
    study: Study, poses: Poses, group: PoseGroup, coordinates: Sequence[Coordinate], jobs: int | None,
    curve: Curve | None,
) -> Iterator[SolvedPoses]:  # fmt: skip
    mechanism: Mechanism = study.mechanism
    plan = mechanism.plan(group.names)
    jobs = min(worker_count(jobs), _MOST_SOLVERS)
    pieces = [slice(begin, begin + POSES_AT_ONCE) for begin in range(0, len(group.rows), POSES_AT_ONCE)]
    angles = [] if poses.listed else followed_angles(mechanism, plan, coordinates)
    if angles and curve is None:
        curve = curve_of(study, poses, angles)

    anchors = anchors_of(study, poses, plan, curve)

    def at(piece: slice) -> Configuration:
        """Poses of some rows, not yet judged by the limits."""
        rows = group.rows[piece]
        columns = zip(plan.structure.given, group.columns(), strict=True)
        values = [np.asarray(radians(study, c, v[piece]), dtype=float) for c, v in columns]
        start = starts(mechanism, poses, rows) if plan.continued else None
        if plan.angles and anchors is not None:
            start = anchors.at(*np.divmod(rows, poses.line))
        return plan.solve(values, dimensions(poses, rows), start=start, limits=False)

    turns = _Turns(study, poses, angles, curve)
    for piece, configuration in zip(pieces, map_chunks(at, pieces, jobs), strict=True):
        rows, values = group.rows[piece], {name: column[piece] for name, column in group.values.items()}
        near = from_sketch(study, values, dimensions(poses, rows)) if poses.listed else turns.near(rows, configuration)
        configuration = replace(
            configuration, near={**configuration.near, **near}, counted=configuration.counted | near.keys()
        )
        plan.judge(configuration)
        yield SolvedPoses(group.rows[piece], group.names, configuration)


def followed_angles(mechanism: Mechanism, plan: Plan, coordinates: Sequence[Coordinate]) -> list[Coordinate]:
    """Angles whose turns only the motion gives: not those given, coupled, nor drives whose limits leave one turn.

    Those of torsion springs are among them.
    """
    settled = {bound.coordinate.name for bound in mechanism.bounds if bound.drive}
    settled -= {coordinate.name for coordinate in mechanism.counting}
    angles = angles_of([*coordinates, *mechanism.counting, *mechanism.windings.values()])
    return [angle for name, angle in angles.items() if name not in plan.counted | plan.coupled | settled]


class _Turns:
    """Values near which angles lie at the poses of a motion or a grid; chunk by chunk in the order of the rows."""

    def __init__(self, study: Study, poses: Poses, angles: Sequence[Coordinate], curve: Curve | None) -> None:
        self.study, self.poses, self.angles, self.curve = study, poses, angles, curve
        self._last = np.zeros(len(angles))

    def near(self, rows: Ints, configuration: Configuration) -> dict[str, Floats]:
        if self.curve is None or not self.angles:
            return {}
        if len(self.poses.grid) > 1:
            table = self._grid[:, rows]
        else:
            line, s = np.divmod(rows, self.poses.line)
            table = np.nan_to_num(self.curve.beside(line, s.astype(float)))
            if self.curve.spent.any():
                # Of a motion that is not followed between its poses an angle goes the nearest way.
                table = np.where(self.curve.spent[line], self._nearest(configuration), table)
        return dict(zip((angle.name for angle in self.angles), table, strict=True))

    def _nearest(self, configuration: Configuration) -> Floats:
        """Angles of poses, each in the turn that is nearest to the pose before it."""
        table = np.empty((len(self.angles), *configuration.shape))
        for k, angle in enumerate(self.angles):
            values = np.array(np.broadcast_to(configuration.value(angle), configuration.shape))
            valid = np.isfinite(values)
            values[valid] = np.unwrap(np.append(self._last[k], values[valid]), period=angle.turn)[1:]
            table[k], self._last[k] = values, values[valid][-1] if valid.any() else self._last[k]
        return table

    @cached_property
    def _grid(self) -> Floats:
        """Angles of a grid of rows, without whole turns between its lines; drives within their limits."""
        mechanism, poses, curve = self.study.mechanism, self.poses, self.curve
        assert curve is not None
        line, s = np.divmod(np.arange(poses.count), poses.line)
        table = curve.turned(line, s.astype(float))
        table[:, ~curve.holds(line, s.astype(float))] = np.nan
        for angle, values in zip(self.angles, table, strict=True):
            for axis in range(len(poses.grid) - 2, -1, -1):
                # Each design of several has a grid of its own.
                for stack in values.reshape(-1, poses.grid[axis], math.prod(poses.grid[axis + 1 :])):
                    for before, block in pairwise(stack):
                        jump = (block - before)[np.isfinite(block - before)][:1]
                        block -= angle.turn * np.round(jump / angle.turn).sum()
            if angle.name in mechanism.drives:
                lines = values.reshape(poses.designs, -1)
                finite = np.isfinite(lines)
                begin = np.take_along_axis(lines, finite.argmax(axis=1)[:, None], axis=1)[:, 0]
                least, most = (f(np.where(finite, lines, begin[:, None]), axis=1) for f in (np.min, np.max))
                sizes = {name: place[:: lines.shape[1]] for name, place in poses.places.items()}
                turns = np.nan_to_num(drive_turns(mechanism, angle.name, begin, least, most, sizes))
                values += TURN * np.repeat(turns, lines.shape[1])
        return np.nan_to_num(table)


def anchors_of(study: Study, poses: Poses, plan: Plan, curve: Curve | None = None) -> Anchors | None:
    """Poses that count turns along the motions that some poses are; None where turns do not count, and of places."""
    if not plan.angles or poses.listed or poses.regions:
        return None
    return Anchors(study, poses, plan) if curve is None else curve.anchors


def dimensions(poses: Poses, rows: Ints) -> dict[str, Value]:
    """Dimensions of the designs that some poses belong to, where they differ from the nominal ones; shape of `rows`."""
    return {name: values[rows] for name, values in poses.places.items()}


def starts(mechanism: Mechanism, poses: Poses, rows: Ints) -> Configuration | None:
    """Where poses of other designs without a closed form start, see `begun`; shape of `rows`."""
    if not poses.places:
        return None
    per_design = poses.count // poses.designs
    designs, which = np.unique(rows // per_design, return_inverse=True)
    return begun(mechanism, dimensions(poses, designs * per_design)).take(which.reshape(rows.shape))


def pose_columns(study: Study, poses: Poses, rows: Ints | slice = slice(None)) -> list[Column]:
    """The time of a motion and the coordinates that the study gives, as columns; of these rows of the poses."""
    timed = [TIMED.column(poses.times[rows], study.units.label("time"))] if poses.times is not None else []
    return timed + [
        GIVEN.column(values[rows], study.units.label(study.mechanism.quantity(name)), coordinate=name)
        for name, values in poses.values.items()
    ]


def unit_of(study: Study, swept: str) -> str:
    """Unit of time, or of a coordinate."""
    return study.units.label("time" if swept == TIME else study.mechanism.quantity(swept))


def judge_failures(
    study: Study, poses: Poses, reason: NDArray[np.int8], begin: int = 0, table: str = ""
) -> tuple[list[Caution], str]:  # fmt: skip
    """Warnings for poses of a design that failed, and the message where that is an error (exit code 3).

    Parameters
    ----------
    reason : int8 array, shape (poses of the design,)
        See `mechdesign.mechanism.Reason`.
    begin : int
        Row of its first pose.
    table : str
        The table whose rows are the poses of the design, if there is one.

    Raises
    ------
    AssemblyError
        If every pose failed.
    """
    bad = np.flatnonzero(reason)
    if not len(bad):
        return [], ""
    invalid = invalid_in_words(study, reason)
    named = [
        f"{pose_in_words(study, poses, begin + int(row))}: {study.mechanism.why(int(reason[row]))}" for row in bad[:5]
    ]
    if len(bad) == len(reason):
        more = "; ..." if len(bad) > len(named) else ""
        raise AssemblyError(f"no pose is valid; {'; '.join(named)}{more}")
    place = (table, int(bad[0]) if table else None, pose_in_words(study, poses, begin + int(bad[0])))
    if poses.listed:
        return [Caution("unassembled", invalid, *place)], f"pose {'; pose '.join(named)}"
    return [Caution("unassembled", f"{invalid}; the first: {named[0]}", *place)], ""


def invalid_in_words(study: Study, reason: NDArray[np.int8]) -> str:
    """How many poses are not valid, and why; empty where all are."""
    numbers, counts = np.unique(reason[reason != Reason.OK], return_counts=True)
    whys = [study.mechanism.why(number).partition(":")[0] for number in numbers.tolist()]
    words = [f"{count} {why}" for why, count in zip(whys, counts.tolist(), strict=True)]
    return f"{sum(counts)} of {len(reason)} poses are not valid ({', '.join(words)})" if words else ""


def of_poses(study: Study, tables: Iterable[Table], reason: NDArray[np.int8]) -> dict[str, Table]:
    """Tables by their names, whose rows speak of the poses alone and not of the motion between them."""
    scope = Scope(poses_only=True, missing=invalid_in_words(study, reason))
    return {table.name: replace(table, scope=scope) for table in tables}


def pose_in_words(study: Study, poses: Poses, row: int, digits: int = 6) -> str:
    """``theta1 = 30 deg, theta2 = 60 deg`` for the pose of a row, with its time along a motion over time."""
    parts = []
    for name, values in poses.named.items():
        if np.isfinite(values[row]):
            unit = unit_of(study, name)
            parts.append(f"{name} = {values[row] + 0.0:.{digits}g} {unit}".rstrip())
    return ", ".join(parts)


@dataclass(frozen=True, eq=False)
class Shown:
    """Poses of a study's kinematics in their order: those that give the same coordinates as the first.

    `rows` are those of the study's poses: all of them, or evenly spread where there are more than can be shown.
    """

    study: Study
    poses: Poses
    rows: Ints
    configuration: Configuration

    def take(self, index: Ints) -> Self:
        """Some of the poses."""
        return replace(self, rows=self.rows[index], configuration=self.configuration.take(index))


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
    values = [radians(study, c, poses.values[name][rows]) for c, name in zip(plan.structure.given, names, strict=True)]
    anchors = anchors_of(study, poses, plan)
    return plan.solve(values, start=None if anchors is None else anchors.at(*np.divmod(rows, poses.line)))


def _rows(poses: Poses, most: int) -> Ints:
    rows = poses.groups[0].rows
    return rows[evenly(len(rows), most)]
