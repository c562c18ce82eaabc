"""Tables of kinematics with a row a pose: the motion, its Jacobian, instant centres."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from mechdesign.ground.columns import Column
from mechdesign.ground.results import Table
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.plates import CLEARANCE
from mechdesign.motion.question import PoseValues
from mechdesign.questions.columns import DRIVE, VALID, power_of_length
from mechdesign.questions.kinematics.columns import INSTANT_CENTRES, JACOBIAN, MOTION
from mechdesign.questions.kinematics.instant_centres import MOTIONS
from mechdesign.questions.kinematics.targets import error, judged
from mechdesign.questions.kinematics.values import entry
from mechdesign.study import Study


def motion_table(motion: PoseValues) -> Table:
    """Every pose with all outputs."""
    return MOTION.table(motion_columns(motion))


def jacobian_table(motion: PoseValues) -> Table:
    """Every entry of the Jacobian, a row a pose."""
    question, derivative = motion.question, JACOBIAN["<output>_by_<drive>"]
    columns = pose_columns(motion)
    for output in question.listed:
        for drive in question.drives:
            values, unit = motion.arrays[entry(output, drive)], _per(question.study, output, drive)
            columns.append(derivative.column(values, unit, output=output.name, drive=drive.name))
    return JACOBIAN.table([*columns, VALID.column(motion.valid)])


def centres_table(motion: PoseValues) -> Table:
    """Instant centres of pairs of links, a row a pose."""
    columns = pose_columns(motion)
    for centre in motion.question.centres:
        words = motion.question.study.units.labels | {"a": centre.one, "b": centre.other}
        x, y, number = (motion.arrays[f"{centre.name}.{part}"] for part in ("x", "y", "motion"))
        motions = np.array(MOTIONS)[np.nan_to_num(number).round().astype(int)]
        values = {"<a>.<b>.x": x, "<a>.<b>.y": y, "<a>.<b>.motion": motions}
        columns += INSTANT_CENTRES.columns(words, **values)
    return INSTANT_CENTRES.table([*columns, VALID.column(motion.valid)])


def motion_columns(motion: PoseValues) -> list[Column]:
    """The columns of the motion table, `valid` last."""
    question, arrays, label = motion.question, motion.arrays, motion.question.study.units.label
    rates, errors = question.rates, judged(question.study)
    shown = {output.name: output for output in question.outputs}
    drives = {drive.name: drive for drive in question.drives}
    columns = [column for column in pose_columns(motion) if column.name in drives or column.name not in shown]
    for name, output in question.rated.items():
        if name not in drives:
            columns.append(MOTION["<output>"].column(arrays[name], label(output.quantity), output=name))
        for order in ("velocity", "acceleration"):
            rate = f"{name}_{order}"
            if rate in rates:
                columns.append(MOTION[f"<output>_{order}"].column(arrays[rate], rates[rate], output=name))
        point, _, axis = name.rpartition(".")
        for owner, quantity in errors.items():
            # Between poses there are no errors of targets that are given pose by pose.
            if error(owner) in arrays and (owner == name or (axis == "y" and owner == point)):
                kind = "<point>_error" if owner in question.study.mechanism.points else "<output>_error"
                values, unit = arrays[error(owner)], label(quantity)
                columns.append(MOTION[kind].column(values, unit, point=owner, output=owner))
    rows = ", ".join(output.name for output in question.listed)
    lengths = [sum(c.quantity == "length" for c in side) for side in (question.listed, question.drives)]
    area = power_of_length(question.study.units, lengths[0] - lengths[1])
    words = {"outputs": rows, "as its outputs over the drives, multiplied": area}
    names = ("det_J", "inverse_condition", "conditioning")
    columns += MOTION.columns(words, **{name: arrays[name] for name in names if name in arrays})
    rubs = "though its joints have some" if question.study.mechanism.description.friction else ""
    for static in question.statics:
        column = MOTION[static.kind].column(arrays[static.name], static.unit, **static.words)
        lossless = static.kind == "<output>_advantage"
        columns.append(replace(column, meaning=f"{column.meaning} {rubs}".rstrip()) if lossless else column)
    gap = MOTION["<a>.<b>.clearance"]
    columns += [gap.column(arrays[name], label("length"), a=pair.one.name, b=pair.other.name)
                for name, pair in question.pairs.items()]  # fmt: skip
    columns += MOTION.columns(question.study.units.labels, **{CLEARANCE: arrays[CLEARANCE]}) if question.pairs else []
    return [*columns, VALID.column(motion.valid)]


def pose_columns(motion: PoseValues) -> list[Column]:
    """The drives, and the coordinates that the study gives."""
    question, units = motion.question, motion.question.study.units
    columns = [
        replace(column, values=motion.arrays.get(column.name, column.values)) for column in question.motion.columns()
    ]
    drives = [DRIVE.column(motion.arrays[c.name], units.label(c.quantity), drive=c.name) for c in question.drives]
    named = {column.name for column in drives}
    timed = columns[:1] if question.poses.times is not None else []
    return [*timed, *drives, *(column for column in columns[len(timed) :] if column.name not in named)]


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


def pose_tables(motion: PoseValues, names: Collection[str] = A_ROW_A_POSE) -> dict[str, Table]:
    """The tables of a question with a row a pose, of some names."""
    question = motion.question
    available = {"motion": True, "jacobian": question.square, "instant_centres": bool(question.centres)}
    return {name: make(motion) for name, make in A_ROW_A_POSE.items() if name in names and available[name]}
