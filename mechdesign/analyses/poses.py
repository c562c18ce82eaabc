"""The poses of a question, solved: shared by kinematics, reliability and stiffness."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.continuity import continuous
from mechdesign.errors import AssemblyError
from mechdesign.mechanism import Configuration, Mechanism, Reason
from mechdesign.mechanism.algebra import TURN, Value
from mechdesign.mechanism.coordinates import Coordinate, angles_of
from mechdesign.mechanism.plan import Plan
from mechdesign.mechanism.variant import drawn
from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.parallel import map_chunks
from mechdesign.results import Column
from mechdesign.study import Study
from mechdesign.study.poses import PoseGroup, Poses, default, expand
from mechdesign.study.schema.poses import PoseSection

# Poses solved at once: their arrays stay within some megabytes, however long the sweep.
CHUNK = 65536


@dataclass(frozen=True, eq=False)
class SolvedPoses:
    """Poses that give the same coordinates, solved for the nominal dimensions.

    Parameters
    ----------
    rows : ndarray of int
        Place of each pose in the study's order.
    given : tuple of str
        The coordinates given.
    """

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
            from mechdesign.analyses.region.nodes import workspace_nodes

            return workspace_nodes(study)
        if asked is not None:
            found = expand(asked, study.path.parent if study.path else Path())
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
    """Solve each group of poses with the plan of its coordinates, at most `CHUNK` poses at a time.

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
    coordinates = plan.structure.given
    given = [np.asarray(radians(study, c, v), dtype=float) for c, v in zip(coordinates, group.columns(), strict=True)]
    solve = partial(_solve, mechanism, plan, poses)
    pieces = [slice(begin, begin + CHUNK) for begin in range(0, len(group.rows), CHUNK)]

    def at(piece: slice) -> Configuration:
        return solve([v[piece] for v in given], group.rows[piece])

    only = [at(piece) for piece in pieces] if len(pieces) == 1 else None
    near: dict[str, Floats] = {}
    angles = [] if poses.listed else _followed(mechanism, plan, wanted)
    if angles:
        values = np.empty((len(angles), len(group.rows)))
        for piece, configuration in zip(pieces, only or map_chunks(at, pieces, jobs), strict=True):
            for row, angle in zip(values, angles, strict=True):
                row[piece] = configuration.value(angle)
        values = continuous(poses, plan, given, angles, values, solve)
        near = {angle.name: row for angle, row in zip(angles, values, strict=True)}
        near |= {name: _begun(study, poses, name, near[name]) for name in mechanism.drives if name in near}
    for piece, configuration in zip(pieces, only or map_chunks(at, pieces, jobs), strict=True):
        told = {**configuration.near, **{name: values[piece] for name, values in near.items()}}
        configuration = replace(configuration, near=told, counted=configuration.counted | near.keys())
        plan.judge(configuration)
        yield SolvedPoses(group.rows[piece], group.names, configuration)


def _solve(mechanism: Mechanism, plan: Plan, poses: Poses, given: Sequence[Floats], rows: Ints) -> Configuration:
    """Poses at or near some rows, not yet judged by the limits."""
    start = starts(mechanism, poses, rows) if plan.iterative else None
    return plan.solve(given, dimensions(poses, rows), start=start, limits=False)


def _followed(mechanism: Mechanism, plan: Plan, wanted: Sequence[Coordinate]) -> list[Coordinate]:
    """Angles whose turns only the motion tells: not those given, nor drives whose limits leave them one turn."""
    settled = {bound.coordinate.name for bound in mechanism.bounds if bound.drive}
    settled -= {coordinate.name for coordinate in mechanism.counting}
    found = angles_of([*wanted, *mechanism.counting])
    return [angle for name, angle in found.items() if name not in plan.counted | settled]


def _begun(study: Study, poses: Poses, drive: str, values: Floats) -> Floats:
    """A drive's values in each design in the turn that leaves it within its limits, else near the sketch's value."""
    mechanism = study.mechanism
    drawn = float(mechanism.sketch_configuration.value(mechanism.coordinate(drive)))
    lines = values.reshape(poses.designs, -1)
    known = np.isfinite(lines)
    begin = np.take_along_axis(lines, known.argmax(axis=1)[:, None], axis=1)[:, 0]
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
    """Where poses of other designs without a closed form start: their own assembled sketch, shape of `rows`."""
    if not poses.places:
        return None
    each = poses.count // poses.designs
    designs, which = np.unique(rows // each, return_inverse=True)
    return drawn(mechanism, dimensions(poses, designs * each)).take(which.reshape(rows.shape))


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


def pose_in_words(study: Study, poses: Poses, row: int) -> str:
    """``theta1 = 30 deg, theta2 = 60 deg`` for the pose of a row."""
    parts = []
    for name, values in poses.values.items():
        if np.isfinite(values[row]):
            unit = study.units.label(study.mechanism.quantity(name))
            parts.append(f"{name} = {values[row]:g} {unit}".rstrip())
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
