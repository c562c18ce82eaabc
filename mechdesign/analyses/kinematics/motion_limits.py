"""Limits of a motion: the values of the drive at which a mechanism stops moving, and its change points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechdesign.analyses.kinematics.boundaries import Boundary, ChangePoint, boundaries
from mechdesign.analyses.kinematics.lines import thinned
from mechdesign.analyses.kinematics.motion import Motion, as_given
from mechdesign.analyses.poses import in_study_units, radians
from mechdesign.mechanism.coordinates import Coordinate, angles_of
from mechdesign.mechanism.margins import SweepMargins
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.results import Column, Table
from mechdesign.study import Study

# A change point this near to zero, as a part of the sweep, is there.
SMALL = 1e-7


def motion_limits(motion: Motion, swept: str) -> tuple[Table, list[str], list[Boundary]]:
    """Every value of the swept coordinate at which the motion ends, with the pose there, and change points as warnings.

    `kind` is ``dead centre`` (a group of links is stretched or folded), ``singularity`` (links that are solved
    together turn back, or the motion goes to infinity), ``leg at zero length`` or ``limit`` (one that the study
    states); `joint` names the joints of the group, the leg or the limit.

    Parameters
    ----------
    swept : str
        The one coordinate that moves.

    Returns
    -------
    (Table, list of str, list of Boundary)
        The table of limits, what is to be said beside it, and the ends of the motion.
    """
    study, outputs = motion.question.study, motion.question.outputs
    (group,) = motion.question.poses.groups
    mechanism = study.mechanism
    angles = angles_of([*outputs, *mechanism.counting])
    rows = np.flatnonzero(thinned(motion, swept))
    near = {name: radians(study, c, motion.arrays[name][rows]) for name, c in angles.items()}
    given = {name: radians(study, mechanism.coordinate(name), group.values[name][rows]) for name in group.names}
    margins = SweepMargins(mechanism, given, swept, near)
    found, changes = boundaries(margins, motion.valid[rows])
    ends = [replace(end, position=float(np.interp(end.position, np.arange(len(rows)), rows))) for end in found]
    unit = study.units.label(mechanism.quantity(swept))
    places = as_given(motion, swept, np.array([e.place for e in ends]), np.array([e.position for e in ends]))
    columns = [
        Column(swept, places, unit, "value at the limit of motion"),
        Column("kind", np.array([end.cause.kind for end in ends], dtype=str), "", "what ends the motion"),
        Column("joint", np.array([end.cause.joint for end in ends], dtype=str), "", "where"),
    ]
    columns += [
        Column(
            output.name, _values(study, output, ends), study.units.label(output.quantity), f"{output.name} at the limit"
        )
        for output in outputs
        if output.name != swept
    ]
    table = Table("limits", tuple(columns), "limits of motion found along the sweep")
    warnings = _hidden(swept, unit, places, ends, motion.valid)
    if mechanism.description.branch != "follow":
        warnings += _warnings(study, margins, swept, changes)
    return table, warnings, ends


def _values(study: Study, output: Coordinate, ends: list[Boundary]) -> Floats:
    """An output at the limits."""
    poses = [end.configuration for end in ends]
    found = [np.nan if pose is None else float(in_study_units(study, output, pose.value(output))) for pose in poses]
    return np.array(found, dtype=float)


def _hidden(swept: str, unit: str, places: Floats, ends: list[Boundary], valid: Flags) -> list[str]:
    """A warning where the motion ends between neighbouring poses that are both valid: their rows do not tell."""
    hidden = [
        f"{swept} = {place:.6g} {unit}".rstrip()
        for place, end in zip(places.tolist(), ends, strict=True)
        if end.position % 1 > 0 and valid[int(end.position)] and valid[int(end.position) + 1]
    ]
    if not hidden:
        return []
    more = f" and {len(hidden) - 4} more" if len(hidden) > 4 else ""
    return [f"the motion ends between poses that are both valid, at {', '.join(hidden[:4])}{more}: see the limits"]


def _warnings(study: Study, margins: SweepMargins, swept: str, changes: list[ChangePoint]) -> list[str]:
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
