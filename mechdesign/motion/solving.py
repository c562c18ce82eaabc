"""The poses of a motion, solved, with angles that do not jump along it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.ground.work.chunks import map_chunks, worker_count
from mechdesign.mechanism import Configuration, Mechanism
from mechdesign.mechanism.algebra import TURN
from mechdesign.mechanism.coordinates import Coordinate, angles_of
from mechdesign.mechanism.mechanism import begun
from mechdesign.mechanism.plan import Plan
from mechdesign.motion.anchors import Anchors
from mechdesign.motion.corners import curve_of
from mechdesign.motion.curve import Curve, from_sketch
from mechdesign.motion.motion import Motion, SolvedPoses, radians
from mechdesign.motion.rows import PoseGroup, Poses
from mechdesign.motion.turns import drive_turns

# Poses solved at once: their arrays stay within some megabytes, however long the sweep.
POSES_AT_ONCE = 65536
# Threads that solve poses of a long motion: what is made of them is one thread's work, and more would fill the memory.
_MOST_SOLVERS = 4


def solve_poses(
    motion: Motion, coordinates: Sequence[Coordinate] = (), jobs: int | None = 1, curve: Curve | None = None
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
    for group in motion.poses.groups:
        yield from _solve_group(motion, group, coordinates, jobs, curve)


def _solve_group(
    motion: Motion, group: PoseGroup, coordinates: Sequence[Coordinate], jobs: int | None, curve: Curve | None
) -> Iterator[SolvedPoses]:  # fmt: skip
    mechanism, poses = motion.mechanism, motion.poses
    plan = mechanism.plan(group.names)
    jobs = min(worker_count(jobs), _MOST_SOLVERS)
    pieces = [slice(begin, begin + POSES_AT_ONCE) for begin in range(0, len(group.rows), POSES_AT_ONCE)]
    angles = [] if poses.listed else followed_angles(mechanism, plan, coordinates)
    if angles and curve is None:
        curve = curve_of(motion, angles)

    anchors = anchors_of(motion, plan, curve)

    def at(piece: slice) -> SolvedPoses:
        """Poses of some rows, not yet judged by the limits."""
        some = poses.take(group.rows[piece])
        columns = zip(plan.structure.given, group.names, strict=True)
        values = [np.asarray(radians(motion.units, c, some.named[name]), dtype=float) for c, name in columns]
        start = _starts(mechanism, some) if plan.continued else None
        if plan.angles and anchors is not None:
            start = anchors.at(*some.places_along)
        solved, rows = plan.solve(values, some.places, start=start, limits=False), group.rows[piece]
        if solved.shape != rows.shape:
            # A structure, which has no drives, stands in the same pose in every row.
            solved = replace(solved, shape=rows.shape, reason=np.full(rows.shape, solved.reason))
        return SolvedPoses(motion.at(some), rows, solved)

    turns = _Turns(motion, angles, curve)
    for part in map_chunks(at, pieces, jobs):
        configuration = part.configuration
        near = from_sketch(part.motion) if poses.listed else turns.near(part.rows, configuration)
        configuration = replace(
            configuration, near={**configuration.near, **near}, counted=configuration.counted | near.keys()
        )
        plan.judge(configuration)
        yield replace(part, configuration=configuration)


def curve_with(motion: Motion, coordinates: Sequence[Coordinate]) -> Curve:
    """The motion of some poses with the angles of coordinates, those of limits and of torsion springs."""
    plan = motion.mechanism.plan(motion.poses.names)
    return curve_of(motion, followed_angles(motion.mechanism, plan, coordinates))


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

    def __init__(self, motion: Motion, angles: Sequence[Coordinate], curve: Curve | None) -> None:
        self.mechanism, self.poses, self.angles, self.curve = motion.mechanism, motion.poses, angles, curve
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
        mechanism, poses, curve = self.mechanism, self.poses, self.curve
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
                turns = np.nan_to_num(drive_turns(mechanism, angle.name, begin, least, most, poses.own.places))
                values += TURN * np.repeat(turns, lines.shape[1])
        return np.nan_to_num(table)


def anchors_of(motion: Motion, plan: Plan, curve: Curve | None = None) -> Anchors | None:
    """Poses that count turns along the motions that some poses are; None where turns do not count, and of places."""
    if not plan.angles or motion.poses.listed or motion.poses.rule.regions:
        return None
    return Anchors(motion, plan) if curve is None else curve.anchors


def _starts(mechanism: Mechanism, poses: Poses) -> Configuration | None:
    """Where poses of other designs without a closed form start, see `begun`."""
    if not poses.own.places:
        return None
    designs, which = np.unique(poses.design, return_inverse=True)
    return begun(mechanism, poses.own.take(designs).places).take(which.reshape(poses.count))


def solve_rows(motion: Motion, rows: Ints) -> Configuration:
    """Poses of some rows, which give the same coordinates.

    Raises
    ------
    MechdesignError
        Where these do not determine the mechanism.
    """
    poses = motion.poses.take(rows)
    names = poses.groups[0].names
    plan = motion.mechanism.plan(names)
    given = zip(plan.structure.given, names, strict=True)
    values = [radians(motion.units, coordinate, poses.named[name]) for coordinate, name in given]
    anchors = anchors_of(motion, plan)
    return plan.solve(values, start=None if anchors is None else anchors.at(*poses.places_along))
