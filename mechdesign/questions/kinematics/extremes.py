"""Extremes of outputs, errors and efforts over a motion, the times between them, and means of errors."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.numerics.rounding import STILL, cleared
from mechdesign.ground.results import Table
from mechdesign.ground.statistics import no_value, no_value_along
from mechdesign.motion.along import of_swept
from mechdesign.motion.question import PoseValues
from mechdesign.questions.kinematics.along import KinematicAlong, over
from mechdesign.questions.kinematics.columns import EXTREMES, TARGETS
from mechdesign.questions.kinematics.curves import distances
from mechdesign.questions.kinematics.targets import error, judged

# A row within this part of an extreme of the motion between the rows does not contradict it.
AT_ROW = 1e-9


def gaps_in_words(motion: PoseValues, along: KinematicAlong | None, name: str) -> list[str]:
    """Of each design, where a column has no value though the mechanism assembles, in words; empty where it has one."""
    poses, valid = motion.question.poses, motion.valid
    lost = (valid & np.isnan(motion.arrays[name])).reshape(poses.designs, -1).sum(axis=1)
    count = valid.reshape(poses.designs, -1).sum(axis=1)
    between = np.zeros(poses.designs)
    if along is not None and name in along.columns:
        between = np.where(along.curve.spent, 0.0, along.lost(name))
    # Of a long motion some poses are kept, those without a value among them.
    some = "no value in some poses" if poses.picked is not None else ""
    return [
        (some or no_value(number, valid)) if number else no_value_along(part) if part else ""
        for number, valid, part in zip(lost.tolist(), count.tolist(), between.tolist(), strict=True)
    ]


def extremes(motion: PoseValues, along: KinematicAlong | None, names: Collection[str] | None = None) -> Table:
    """Smallest and largest value of outputs and other columns over the motion, and the ratio of times between.

    Along a motion they are those of all of it, from limit to limit, between its poses too; elsewhere those of the valid
    poses. Efforts and mechanical advantages are infinite at their poles. `time_ratio` is the longer over the shorter
    part of a full turn of the swept angle between the two extremes, for a drive of constant speed; nan elsewhere.
    `min_at` is what is swept, or the place in rows where nothing or more than one coordinate is.

    They are those of the columns `names`, or of all.
    """
    question = motion.question
    poses, mechanism, turn = question.poses, question.study.mechanism, question.sizes["angle"]
    curves = {name: curve for name, curve in question.columns.items() if names is None or name in names}
    targeted = {error(output): output for output in judged(question.study)}
    arrays = motion.arrays
    units = [unit for _, unit in curves.values()]
    swept = poses.swept
    # Values by column, design and pose; `ends` will have value and place of both extremes.
    table = np.array([arrays[name] for name in curves]).reshape(len(curves), poses.designs, -1)
    places = poses.abscissa.reshape(poses.designs, -1)
    counted = motion.valid.reshape(poses.designs, -1) & ~np.isnan(table)
    row = np.stack([np.where(counted, sign * table, np.inf).argmin(axis=2) for sign in (1, -1)])
    low, high = (np.take_along_axis(table, index[..., None], axis=2)[..., 0] for index in row)
    finite = np.where(counted & np.isfinite(table), np.abs(table), 0.0).max(axis=2, initial=0.0)
    size = np.array([scale for scale, _ in curves.values()])[:, None]
    still = STILL * np.maximum(finite, size)
    followed = [k for k, name in enumerate(curves) if along is not None and name in along.columns]
    peaks = None
    if along is not None:
        peaks = along.functions.extremes([list(curves)[k] for k in followed], still[followed])
        still[followed] = peaks.still
    moving = high - low > still
    # A curve that stands still has both extremes at its first pose.
    row = np.where(moving, row, counted.argmax(axis=2))
    values = np.stack([np.take_along_axis(table, index[..., None], axis=2)[..., 0] for index in row])
    ends = np.stack([values, places[np.arange(poses.designs), row]], axis=1)
    ends = np.where(counted.any(axis=2), ends, np.nan)
    if along is not None and peaks is not None:
        line = np.broadcast_to(np.arange(poses.designs), (len(followed), poses.designs))
        moves = peaks.value[1] - peaks.value[0] > peaks.still
        moving[followed] |= moves
        shown = along.shown(np.tile(line.ravel(), 2), peaks.place.ravel()).reshape(peaks.place.shape)
        # A row is evidence: no extreme contradicts one that is farther out by more than rounding.
        inner = np.array([[[-1.0]], [[1.0]]]) * (ends[:, 0, followed] - peaks.value)
        kept = inner > AT_ROW * np.abs(peaks.value) + peaks.still
        better = np.isfinite(peaks.place) & moves & ~kept
        for k, new in enumerate((peaks.value, shown)):
            ends[:, k, followed] = np.where(better, new, ends[:, k, followed])
    values = cleared(ends[:, 0], STILL * np.maximum(finite, size))
    # What is the same everywhere has no place.
    ends = np.stack([values, np.where(moving & (values != 0).any(axis=0), ends[:, 1], np.nan)], axis=1)
    (low, low_at), (high, high_at) = ends
    timed = np.zeros(poses.designs, dtype=bool)
    if along is not None and swept is not None and swept in poses.names and mechanism.quantity(swept) == "angle":
        timed = (np.ptp(places, axis=1) >= turn * (1 - 1e-9)) & along.whole
    part = np.where(timed & moving & np.isfinite(high - low), (high_at - low_at) % turn, np.nan)
    ratio = np.maximum(part, turn - part) / np.minimum(part, turn - part)
    span = high - low
    ratio[~np.isfinite(ratio)] = np.nan
    lacking = _lacking(motion, along, [targeted.get(name, name) for name in curves])
    return replace(EXTREMES.table(EXTREMES.columns(
        of_swept(question.motion, swept, "place in rows (from 0)"),
        output=np.tile(np.array(list(curves)), poses.designs),
        min=low.T.ravel(), min_at=low_at.T.ravel(), max=high.T.ravel(), max_at=high_at.T.ravel(),
        range=span.T.ravel(), time_ratio=ratio.T.ravel(), unit=np.tile(np.array(units, dtype=str), poses.designs),
    ), **over(along, list(curves))), lacking=lacking)  # fmt: skip


def _lacking(motion: PoseValues, along: KinematicAlong | None, outputs: Sequence[str]) -> NDArray[np.str_]:
    """Where outputs, or coordinates of points, have no value: a row each, design by design."""
    parts = [[name] if name in motion.arrays else [f"{name}.{axis}" for axis in "xy"] for name in outputs]
    words = [[max(pair) for pair in zip(*(gaps_in_words(motion, along, name) for name in part), strict=True)]
             for part in parts]  # fmt: skip
    return np.array(words, dtype=str).reshape(len(outputs), -1).T.ravel()


def targets_table(motion: PoseValues, along: KinematicAlong | None) -> Table:
    """Mean and largest errors of each design over the motion, or over the valid poses that have a target.

    Those of a curve are the distances of its points from the motion. `along` is the motion between the poses, None of
    listed poses and grids.
    """
    study, poses, valid = motion.question.study, motion.question.poses, motion.valid
    errors, sizes = judged(study), motion.question.sizes
    shape, swept = (poses.designs, poses.count // poses.designs), poses.swept
    at = poses.abscissa
    numbers = np.full((4, poses.designs, len(errors) + len(study.curves)), np.nan)
    for k, (output, quantity) in enumerate(errors.items()):
        name, column = error(output), motion.arrays[error(output)]
        counted = (valid & np.isfinite(column)).reshape(shape)
        some = counted.any(axis=1)
        values = np.where(counted, column.reshape(shape), 0.0)[some]
        worst = np.where(counted[some], np.abs(values), -1.0).argmax(axis=1)
        lane, (count, total, squares) = np.arange(len(worst)), motion.totals[:, some, k]
        numbers[:, some, k] = (
            np.sqrt(squares / count),
            total / count,
            np.abs(values[lane, worst]),
            at.reshape(shape)[some][lane, worst],
        )
        if along is not None and name in along.columns:
            value, place = along.worst(name, 1, absolute=True, still=STILL * sizes.get(quantity, 1.0))
            between = np.stack([
                np.sqrt(along.mean(name, 2)), along.mean(name), value,
                along.shown(np.arange(len(place)), place),
            ])  # fmt: skip
            numbers[:, :, k] = np.where(along.curve.spent, numbers[:, :, k], between)
        numbers[:3, :, k] = cleared(numbers[:3, :, k], STILL * sizes.get(quantity, 1.0))
        numbers[3, numbers[2, :, k] == 0, k] = np.nan
    for k, curve in enumerate(study.curves.values(), len(errors)):
        gaps, place = distances(motion, along, curve)
        last, lane = gaps.argmax(axis=1), np.arange(len(gaps))
        numbers[:, :, k] = (
            np.sqrt((gaps**2).mean(axis=1)), gaps.mean(axis=1), gaps[lane, last], place[lane, last],
        )  # fmt: skip
    rms, mean, largest, where = numbers.reshape(4, -1)
    words = of_swept(motion.question.motion, swept, "row (from 0)")
    quantities = [*errors.values(), *("length" for _ in study.curves)]
    units = np.tile(np.array([*map(study.units.label, quantities)], dtype=str), poses.designs)
    outputs = np.tile(np.array([*errors, *study.curves], dtype=str), poses.designs)
    columns = TARGETS.columns(words, output=outputs, rms=rms, mean=mean, max_abs=largest, at=where, unit=units)
    table = TARGETS.table(columns, **over(along, [*map(error, errors)]))
    return replace(table, lacking=_lacking(motion, along, [*errors, *study.curves]))
