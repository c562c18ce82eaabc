"""Tables of dynamics: a row a pose, a row a pose and joint, and what the motion comes to."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.numerics.rounding import STILL, cleared, larger, unchanging
from mechdesign.ground.results import Table
from mechdesign.motion.along import of_swept
from mechdesign.motion.question import PoseValues
from mechdesign.questions.columns import VALID
from mechdesign.questions.dynamics.columns import DYNAMICS, EXTREMES, JOINT_FORCES
from mechdesign.questions.dynamics.question import PARTS, ForceQuestion
from mechdesign.questions.kinematics.along import KinematicAlong, over
from mechdesign.questions.kinematics.extremes import gaps_in_words
from mechdesign.questions.kinematics.tables import pose_columns

# Places among the numbers of an extreme that are values.
VALUES = [0, 2, 4, 6, 7, 8]


def question_of(motion: PoseValues) -> ForceQuestion:
    """The question about the forces of a motion."""
    question: ForceQuestion = motion.question.acting
    return question


def dynamics_table(motion: PoseValues) -> Table:
    """``dynamics.csv``: efforts, powers, shaking forces and energies of every pose."""
    question = question_of(motion)
    hidden, labels = {"shaking", *question.forces}, motion.question.study.units.labels
    columns = []
    for static in question.statics:
        if static.name not in hidden:
            values = {static.kind: motion.arrays[static.name]}
            columns += DYNAMICS.columns({**labels, **static.words, "force or moment": static.unit}, **values)
    return DYNAMICS.table([*pose_columns(motion), *columns, VALID.column(motion.valid)])


def joint_table(motion: PoseValues) -> Table:
    """``joint_forces.csv``: what every joint bears, a row a pose and joint."""
    question = question_of(motion)
    rows = question.borne_by
    count, joints = len(motion.reason), len(rows)

    def per_joint(values: NDArray[Any]) -> NDArray[Any]:
        return np.repeat(values, joints)

    words = {part: np.array([[motion.arrays[f"{name}.{part}"]] for name, *_ in rows]) for part in PARTS}
    table = {part: values.reshape(joints, count).T.ravel() for part, values in words.items()}
    names = {
        key: np.tile(np.array([row[k] for row in rows], dtype=str), count)
        for k, key in enumerate(("joint", "on", "by"), 1)
    }
    poses = [replace(column, values=per_joint(column.values)) for column in pose_columns(motion)]
    columns = JOINT_FORCES.columns(motion.question.study.units.labels, **names, **table)
    bears = JOINT_FORCES.table([*poses, *columns, VALID.column(per_joint(motion.valid))])
    return replace(bears, strands=question.strands)


def extremes_table(motion: PoseValues, along: KinematicAlong | None, names: Collection[str]) -> Table:
    """``extremes.csv``: smallest and largest values, peaks and means of some columns over the motion.

    Along a motion they are those of all of it, between its poses too; elsewhere those of the valid poses.
    """
    question, poses = motion.question, motion.question.poses
    statics, swept = [static for static in question_of(motion).statics if static.name in names], poses.swept
    at = poses.abscissa.reshape(poses.designs, -1)
    valid = motion.valid.reshape(poses.designs, -1)
    numbers = np.full((len(statics), poses.designs, 9), np.nan)
    bearings = question_of(motion).forces
    for k, static in enumerate(statics):
        values = motion.arrays[static.name].reshape(poses.designs, -1)
        numbers[k] = _of_poses(np.where(valid, values, np.nan), at)
        if along is not None and static.name in along.columns:
            numbers[k] = np.where(
                along.curve.spent[:, None], numbers[k],
                _between(along, static.name, numbers[k], static.size, bears=static.name in bearings),
            )  # fmt: skip
        numbers[k][:, 8] = numbers[k][:, 8] if static.name in bearings else np.nan
        peak = numbers[k][:, [4]]
        values = cleared(numbers[k][:, VALUES], STILL * np.fmax(np.where(np.isfinite(peak), peak, 0.0), static.size))
        numbers[k][:, VALUES] = values
        # What is the same everywhere has no place.
        numbers[k][unchanging(values[:, 0], values[:, 1], static.size), 1:6:2] = np.nan
    low, low_at, high, high_at, peak, peak_at, mean, rms, cubic = numbers.transpose(2, 1, 0).reshape(9, -1)
    names, units = ([getattr(static, key) for static in statics] * poses.designs for key in ("name", "unit"))
    columns = EXTREMES.columns(
        of_swept(question.motion, swept, "place in rows (from 0)"), output=np.array(names), min=low, min_at=low_at,
        max=high, max_at=high_at, peak=peak, peak_at=peak_at, mean=mean, rms=rms, cubic_mean=cubic,
        unit=np.array(units, dtype=str),
    )  # fmt: skip
    lacking = np.array([gaps_in_words(motion, along, static.name) for static in statics]).reshape(len(statics), -1)
    table = EXTREMES.table(columns, **over(along, [static.name for static in statics]))
    return replace(table, lacking=lacking.T.ravel())


def _of_poses(values: Floats, at: Floats) -> Floats:
    """Numbers of each design's valid poses, shape (designs, 9)."""
    lanes, finite = np.arange(len(values)), np.isfinite(values)
    low, high, peak = (np.where(finite, judged, -np.inf).argmax(axis=1) for judged in (-values, values, np.abs(values)))
    count, safe = np.maximum(finite.sum(axis=1), 1), np.where(finite, values, 0.0)
    numbers = [
        values[lanes, low], at[lanes, low], values[lanes, high], at[lanes, high], np.abs(values[lanes, peak]),
        at[lanes, peak], safe.sum(axis=1) / count, np.sqrt((safe**2).sum(axis=1) / count),
        np.cbrt((np.abs(safe) ** 3).sum(axis=1) / count),
    ]  # fmt: skip
    some = np.asarray(finite.any(axis=1))
    return np.where(some[:, None], np.stack(numbers, axis=1), np.nan)


def _between(along: KinematicAlong, name: str, poses: Floats, size: float, *, bears: bool) -> Floats:
    """The same over the motion between its poses."""
    lines = np.arange(along.curve.lines)
    still = STILL * np.fmax(np.nan_to_num(poses[:, 4]), size)
    peaks = along.functions.extremes([name], still[None])
    (low, high), (low_at, high_at) = peaks.value[:, 0], peaks.place[:, 0]
    upper = larger(low, high, low_at, high_at, STILL * np.maximum(high, -low))
    peak, peak_at = np.where(upper, high, -low), np.where(upper, high_at, low_at)
    ends = [low, along.shown(lines, low_at), high, along.shown(lines, high_at), peak, along.shown(lines, peak_at)]
    square = np.maximum(along.mean(name, 2), 0.0)
    cube = along.mean(name, 3) if bears else np.full(len(lines), np.nan)
    whole = np.stack([*ends, along.mean(name), np.sqrt(square), np.cbrt(cube)], axis=1)
    return np.where(np.isnan(low)[:, None], poses, whole)
