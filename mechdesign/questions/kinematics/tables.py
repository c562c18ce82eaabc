"""Tables of kinematics with a row a pose: the motion, its Jacobian, instant centres."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.questions.columns import VALID
from mechdesign.questions.kinematics.columns import INSTANT_CENTRES, JACOBIAN, MOTION
from mechdesign.questions.kinematics.instant_centres import MOTIONS
from mechdesign.questions.kinematics.motion import Motion, entry
from mechdesign.results import Table
from mechdesign.study import Study


def motion_table(motion: Motion) -> Table:
    """Every pose with all outputs."""
    return MOTION.table(motion.columns())


def jacobian_table(motion: Motion) -> Table:
    """Every entry of the Jacobian, a row a pose."""
    question, derivative = motion.question, JACOBIAN["<output>_by_<drive>"]
    columns = motion.pose_columns()
    for output in question.listed:
        for drive in question.drives:
            values, unit = motion.arrays[entry(output, drive)], _per(question.study, output, drive)
            columns.append(derivative.column(values, unit, output=output.name, drive=drive.name))
    return JACOBIAN.table([*columns, VALID.column(motion.valid)])


def centres_table(motion: Motion) -> Table:
    """Instant centres of pairs of links, a row a pose."""
    columns = motion.pose_columns()
    for centre in motion.question.centres:
        words = motion.question.study.units.labels | {"a": centre.one, "b": centre.other}
        x, y, number = (motion.arrays[f"{centre.name}.{part}"] for part in ("x", "y", "motion"))
        motions = np.array(MOTIONS)[np.nan_to_num(number).round().astype(int)]
        values = {"<a>.<b>.x": x, "<a>.<b>.y": y, "<a>.<b>.motion": motions}
        columns += INSTANT_CENTRES.columns(words, **values)
    return INSTANT_CENTRES.table([*columns, VALID.column(motion.valid)])


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


def pose_tables(motion: Motion, names: Collection[str] = A_ROW_A_POSE) -> dict[str, Table]:
    """The tables of a question with a row a pose, of some names."""
    question = motion.question
    available = {"motion": True, "jacobian": question.square, "instant_centres": bool(question.centres)}
    return {name: make(motion) for name, make in A_ROW_A_POSE.items() if name in names and available[name]}
