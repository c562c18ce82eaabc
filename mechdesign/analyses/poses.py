"""The poses of a question, solved: shared by kinematics, reliability and stiffness."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechdesign.errors import AssemblyError
from mechdesign.mechanism import Configuration, Mechanism, Reason
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.variant import drawn
from mechdesign.results import Column
from mechdesign.study import Study
from mechdesign.study.poses import Poses

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
    drives : sequence of ndarray
        Value of each drive (radians and lengths): as given, or from the inverse problem.
    """

    rows: NDArray[np.intp]
    given: tuple[str, ...]
    configuration: Configuration
    drives: tuple[Value, ...]


def radians(study: Study, coordinate: Coordinate, value: Value) -> Value:
    """A value in the study's units as the core takes it."""
    return value * study.units.angle_factor if coordinate.quantity == "angle" else value


def in_study_units(study: Study, coordinate: Coordinate, value: Value) -> Value:
    """A value of the core in the study's units."""
    return value / study.units.angle_factor if coordinate.quantity == "angle" else value


def solve_poses(study: Study, poses: Poses) -> Iterator[SolvedPoses]:
    """Solve each group of poses with the plan of its coordinates, at most `CHUNK` poses at a time.

    Raises
    ------
    MechanismError
        Where the coordinates of a pose do not determine the mechanism.
    """
    mechanism: Mechanism = study.mechanism
    for group in poses.groups:
        plan = mechanism.plan(group.names)
        whole = [radians(study, c, v) for c, v in zip(plan.structure.given, group.columns(), strict=True)]
        for begin in range(0, len(group.rows), CHUNK):
            given = [values[begin : begin + CHUNK] for values in whole]
            rows = group.rows[begin : begin + CHUNK]
            start = starts(mechanism, poses, rows) if plan.iterative else None
            configuration = plan.solve(given, dimensions(poses, rows), start=start)
            known: dict[str, Value] = dict(zip(group.names, given, strict=True))
            drives = tuple(
                np.broadcast_to(
                    known[name] if name in known else configuration.value(mechanism.coordinate(name)),
                    configuration.shape,
                )
                for name in mechanism.drives
            )
            yield SolvedPoses(rows, group.names, configuration, drives)


def dimensions(poses: Poses, rows: NDArray[np.intp]) -> dict[str, Value]:
    """Dimensions of the designs that some poses belong to, where they differ from the nominal ones; shape of `rows`."""
    return {name: values[rows] for name, values in poses.places.items()}


def starts(mechanism: Mechanism, poses: Poses, rows: NDArray[np.intp]) -> Configuration | None:
    """Where poses of other designs without a closed form start: their own assembled sketch, shape of `rows`."""
    if not poses.places:
        return None
    each = poses.count // poses.designs
    designs, which = np.unique(rows // each, return_inverse=True)
    return drawn(mechanism, dimensions(poses, designs * each)).take(which.reshape(rows.shape))


def pose_columns(study: Study, poses: Poses) -> list[Column]:
    """The coordinates that the study gives, as columns."""
    columns = []
    for name, values in poses.values.items():
        quantity = study.mechanism.quantity(name)
        columns.append(Column(name, values, study.units.label(quantity), "given"))
    return columns


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
