"""Limits of a motion: the values of the drive at which a mechanism stops moving, and its change points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.kinematics.boundaries import Boundary, ChangePoint, boundaries
from mechdesign.analyses.kinematics.margins import Margins
from mechdesign.analyses.poses import in_study_units, radians
from mechdesign.mechanism import Reason
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.turns import angles_of
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.results import Column, Table
from mechdesign.study import Study
from mechdesign.study.poses import PoseGroup

# A place this near to a pose or to zero, as a part of the sweep, is there.
AT_POSE = 1e-12
# A change point this near to zero, as a part of the sweep, is there.
SMALL = 1e-7


@dataclass(frozen=True, eq=False)
class Limits:
    """The table of limits and what is to be said beside it; the sweep, and its ends for what else is sought on it."""

    table: Table
    warnings: list[str]
    margins: Margins
    ends: list[Boundary]


def motion_limits(
    study: Study,
    group: PoseGroup,
    swept: str,
    reason: NDArray[np.int8],
    outputs: Sequence[Coordinate],
    arrays: Mapping[str, Floats],
) -> Limits:
    """Every value of the swept coordinate at which the motion ends, with the pose there, and change points as warnings.

    `kind` is ``dead centre`` (a group of links is stretched or folded), ``singularity`` (links that are solved
    together turn back, or the motion goes to infinity), ``leg at zero length`` or ``limit`` (one that the study
    states); `joint` names the joints of the group, the leg or the limit.

    Parameters
    ----------
    swept : str
        The one coordinate of the group that moves.
    reason : int8 array
        See `mechdesign.mechanism.Reason`, over all poses.
    outputs : sequence of Coordinate
        Whose values at the limits are told.
    arrays : mapping of str to ndarray, shape (poses,)
        Their values over all poses, in the study's units.
    """
    mechanism = study.mechanism
    angles = angles_of([*outputs, *mechanism.counting])
    near = {name: radians(study, c, arrays[name][group.rows]) for name, c in angles.items()}
    margins = Margins(study, group, swept, near)
    ends, changes = boundaries(margins, reason[group.rows] == Reason.OK)
    unit = study.units.label(mechanism.quantity(swept))
    places = as_given(study, margins, group.values[swept], [end.place for end in ends], [end.row for end in ends])
    columns = [
        Column(swept, np.array(places, dtype=float), unit, "value at the limit of motion"),
        Column("kind", np.array([end.cause.kind for end in ends], dtype=str), "", "what ends the motion"),
        Column("joint", np.array([end.cause.joint for end in ends], dtype=str), "", "where"),
    ]
    columns += [
        Column(
            output.name,
            _values(study, output, ends),
            study.units.label(output.quantity),
            f"{output.name} at the limit",
        )
        for output in outputs
        if output.name != swept
    ]
    table = Table("limits", tuple(columns), "limits of motion found along the sweep")
    follows = mechanism.description.branch == "follow"
    warnings = _hidden(swept, unit, places, ends, margins, reason[group.rows] == Reason.OK)
    if not follows:
        warnings += _warnings(study, margins, swept, changes)
    return Limits(table, warnings, margins, ends)


def as_given(
    study: Study, margins: Margins, given: Floats, places: Sequence[float], rows: Sequence[int]
) -> list[float]:
    """Places on a sweep in the study's unit; those at a pose as the study gives it, not there and back through radians.

    Parameters
    ----------
    given : ndarray, shape (poses,)
        The sweep in the study's unit.
    rows : sequence of int
        A pose beside each place, or the first of the two.
    """
    found = []
    for place, row in zip(places, rows, strict=True):
        value = float(in_study_units(study, margins.coordinate, place))
        beside = given[max(row - 1, 0) : row + 2]
        at = beside[np.abs(beside - value) <= AT_POSE * np.ptp(given)]
        found.append(float(at[0]) if len(at) else 0.0 if abs(value) <= AT_POSE * np.ptp(given) else value)
    return found


def _values(study: Study, output: Coordinate, ends: list[Boundary]) -> Floats:
    """An output at the limits."""
    poses = [end.configuration for end in ends]
    found = [np.nan if pose is None else float(in_study_units(study, output, pose.value(output))) for pose in poses]
    return np.array(found, dtype=float)


def _hidden(
    swept: str, unit: str, places: list[float], ends: list[Boundary], margins: Margins, valid: Flags
) -> list[str]:
    """A warning where the motion ends between neighbouring poses that are both valid: their rows do not tell."""
    steps = [int(end.position) for end in ends]
    hidden = [
        f"{swept} = {place:.6g} {unit}".rstrip()
        for place, step, end in zip(places, steps, ends, strict=True)
        if step + 1 < len(valid) and end.position > step and valid[step] and valid[step + 1]
    ]
    if not hidden:
        return []
    more = f" and {len(hidden) - 4} more" if len(hidden) > 4 else ""
    return [f"the motion ends between poses that are both valid, at {', '.join(hidden[:4])}{more}: see the limits"]


def _warnings(study: Study, margins: Margins, swept: str, changes: list[ChangePoint]) -> list[str]:
    unit = study.units.label(study.mechanism.quantity(swept))
    places: dict[str, dict[str, None]] = {}
    for change in sorted(changes, key=lambda change: change.place):
        # The smallest value of a smooth function is found to the root of rounding.
        at = change.place if abs(change.place) > SMALL * np.ptp(margins.at) else 0.0
        place = f"{in_study_units(study, margins.coordinate, at):.6g} {unit}".rstrip()
        places.setdefault(place, {})[change.cause.joint] = None
    return [
        f"change point at {swept} = {place} (joints {'; '.join(joints)}): two assemblies meet there, and branch 'side' "
        "keeps each joint on its side of the line, where a made mechanism may cross it"
        for place, joints in places.items()
    ]
