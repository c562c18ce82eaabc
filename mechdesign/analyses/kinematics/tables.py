"""Tables of kinematics with a row a pose: the motion, its Jacobian, instant centres."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from mechdesign.analyses.columns import shared
from mechdesign.analyses.kinematics.instant_centres import MOTIONS
from mechdesign.analyses.kinematics.motion import Motion, entry
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.results import Column, Table
from mechdesign.study import Study


def motion_table(motion: Motion) -> Table:
    """Every pose with all outputs."""
    return Table("motion", tuple(motion.columns()), "positions, velocities and accelerations per pose")


def jacobian_table(motion: Motion) -> Table:
    """Every entry of the Jacobian, a row a pose."""
    question = motion.question
    columns = motion.pose_columns()
    for output in question.listed:
        for drive in question.drives:
            name = entry(output, drive)
            meaning = f"derivative of {output.name} by {drive.name}, angles in radians"
            columns.append(Column(name, motion.arrays[name], _per(question.study, output, drive), meaning))
    columns += shared(question.study.units, valid=motion.valid)
    return Table("jacobian", tuple(columns), "derivatives of outputs by the drives, per radian")


def centres_table(motion: Motion) -> Table:
    """Instant centres of pairs of links, a row a pose."""
    length, columns = motion.question.study.units.label("length"), motion.pose_columns()
    for centre in motion.question.centres:
        pair = f"{centre.one} and {centre.other}"
        for axis in "xy":
            meaning = f"place of the instant centre of {pair}; inf where one translates against the other"
            columns.append(Column(f"{centre.name}.{axis}", motion.arrays[f"{centre.name}.{axis}"], length, meaning))
        numbers = np.nan_to_num(motion.arrays[f"{centre.name}.motion"]).round().astype(int)
        meaning = f"how {centre.one} moves against {centre.other}: rotation, translation or rest"
        columns.append(Column(f"{centre.name}.motion", np.array(MOTIONS)[numbers], "", meaning))
    columns += shared(motion.question.study.units, valid=motion.valid)
    return Table("instant_centres", tuple(columns), "instant centres of velocity of pairs of links")


def _per(study: Study, output: Coordinate, drive: Coordinate) -> str:
    """Unit of a derivative; angles in radians whatever the study's unit."""
    above, below = (
        {"length": study.units.label("length"), "angle": "rad"}.get(c.quantity, "") for c in (output, drive)
    )  # fmt: skip
    if above == below:
        return ""
    return f"{above or '1'}/{below}" if below else above


# Tables with a row a pose.
A_ROW_A_POSE = {"motion": motion_table, "jacobian": jacobian_table, "instant_centres": centres_table}


def pose_tables(motion: Motion, wanted: Collection[str] = A_ROW_A_POSE) -> dict[str, Table]:
    """Those of them that a question has, of some that are wanted."""
    question = motion.question
    known = {"motion": True, "jacobian": question.square, "instant_centres": bool(question.centres)}
    return {name: make(motion) for name, make in A_ROW_A_POSE.items() if name in wanted and known[name]}
