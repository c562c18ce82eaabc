"""Extremes of a motion: the smallest and largest value of each output, also between the poses of a sweep."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.poses import in_study_units, radians
from mechdesign.mechanism import Reason
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.outputs import first
from mechdesign.results import Column, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses

Array = NDArray[np.float64]

# Halvings of a step of the sweep, which reach the last bit of the drive's value.
HALVINGS = 52
# A range below this part of the output's size is rounding: the output does not move.
STILL = 1e-12


def extremes(
    study: Study, columns: Sequence[Column], poses: Poses, swept: str | None, reason: NDArray[np.int8]
) -> Table:
    """Smallest and largest value of each output over the valid poses, and the ratio of the times between them.

    Where a drive is swept, an extreme between two poses is found by its derivative. `time_ratio` is the longer over
    the shorter part of a full turn of the swept angle between the two extremes, for a drive of constant speed; nan
    elsewhere. `min_at` is the swept coordinate, or the row where there is none.

    Parameters
    ----------
    columns : sequence of Column
        Named as the outputs they hold, over all poses.
    swept : str or None
        The one coordinate that moves.
    reason : int8 array, shape (poses,)
        See `mechdesign.mechanism.Reason`.
    """
    mechanism = study.mechanism
    outputs = [mechanism.coordinate(column.name) for column in columns]
    at = poses.values[swept] if swept is not None else np.arange(poses.count, dtype=float)
    unit = study.units.label(mechanism.quantity(swept)) if swept is not None else ""
    turn = 2 * np.pi / study.units.angle_factor
    full_turn = bool(
        swept is not None
        and mechanism.quantity(swept) == "angle"
        and np.ptp(at) >= turn * (1 - 1e-9)
        and not reason.any()
    )
    found = np.full((2, len(columns), 2), np.nan)  # smallest and largest: value and place
    index = np.zeros((2, len(columns)), dtype=np.intp)
    moving = np.zeros(len(columns), dtype=bool)
    for k, (column, output) in enumerate(zip(columns, outputs, strict=True)):
        values = np.where(reason == Reason.OK, column.values, np.nan)
        if np.isfinite(values).any():
            index[:, k] = np.nanargmin(values), np.nanargmax(values)
            size = {"length": mechanism.size, "angle": turn}.get(output.quantity, 0.0)
            moving[k] = np.nanmax(values) - np.nanmin(values) > STILL * max(float(np.nanmax(np.abs(values))), size)
            if not moving[k]:
                index[:, k] = np.flatnonzero(np.isfinite(values))[0]
            found[:, k, 0], found[:, k, 1] = values[index[:, k]], at[index[:, k]]
    if swept is not None and set(poses.names) == set(mechanism.drives):
        rows = np.flatnonzero(moving)
        for k, sign in enumerate((1, -1)):
            asked = [outputs[j] for j in rows]
            found[k, rows] = _refined(study, asked, poses, swept, index[k, rows], sign, full_turn, found[k, rows])
    span = found[1, :, 0] - found[0, :, 0]
    ratio = np.full(len(columns), np.nan)
    if full_turn:
        part = np.where(moving, (found[1, :, 1] - found[0, :, 1]) % turn, np.nan)
        with np.errstate(divide="ignore"):
            ratio = np.maximum(part, turn - part) / np.minimum(part, turn - part)
        ratio[~np.isfinite(ratio)] = np.nan
    where = f"{swept or 'row'} at the"
    return Table(
        "extremes",
        (
            Column("output", np.array([c.name for c in columns]), "", "output, in its own unit"),
            Column("min", found[0, :, 0], "", "smallest value over the motion"),
            Column("min_at", found[0, :, 1], unit, f"{where} smallest value"),
            Column("max", found[1, :, 0], "", "largest value over the motion"),
            Column("max_at", found[1, :, 1], unit, f"{where} largest value"),
            Column("range", span, "", "max - min"),
            Column("time_ratio", ratio, "", "longer over shorter time between the extremes, constant speed"),
        ),
        "extremes of the outputs over the motion",
    )


def _refined(
    study: Study, outputs: Sequence[Coordinate], poses: Poses, swept: str, index: NDArray[np.intp], sign: int,
    full_turn: bool, sampled: Array,
) -> Array:  # fmt: skip
    """Extremes where the derivative by the swept drive is zero, by halving about the pose that is the best of all.

    `sampled` and the answer hold a value and a place a row. Where the derivative does not change its sign beside the
    pose (an extreme at the end of the sweep, or beside a pose that fails) the row stays. `sign` is 1 for the smallest
    values, -1 for the largest.
    """
    if not outputs:
        return sampled
    mechanism, group = study.mechanism, poses.groups[0]
    plan = mechanism.plan(group.names)
    drive = mechanism.coordinate(swept)
    which = mechanism.drives.index(swept)
    lanes = np.arange(len(outputs))
    at = np.asarray(radians(study, drive, group.values[swept]), dtype=float)
    before, after = at[np.maximum(index - 1, 0)], at[np.minimum(index + 1, len(at) - 1)]
    if full_turn:
        before = np.where(index == 0, at[0] - (at[-1] - at[-2]), before)
        after = np.where(index == len(at) - 1, at[-1] + (at[1] - at[0]), after)
    low, high = np.minimum(before, after), np.maximum(before, after)
    given = [
        np.asarray(radians(study, c, v), dtype=float)[index]
        for c, v in zip(plan.structure.given, group.columns(), strict=True)
    ]
    start = plan.solve(given)

    def solve(place: Array) -> tuple[Array, Array]:
        """Value of each lane's output and its derivative by the swept drive, times `sign`."""
        given[group.names.index(swept)] = place
        configuration = plan.solve(given, start=start)
        rates = mechanism.linearize(configuration).drives()
        full = (len(mechanism.drives), len(lanes))
        value = [np.broadcast_to(configuration.value(o), lanes.shape)[k] for k, o in enumerate(outputs)]
        slope = [np.broadcast_to(first(configuration, o, rates), full)[which, k] for k, o in enumerate(outputs)]
        valid = configuration.valid
        return np.where(valid, value, np.nan), sign * np.where(valid, slope, np.nan)

    turns = (solve(low)[1] < 0) & (solve(high)[1] > 0)
    if not turns.any():
        return sampled
    step = high - low
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        rising = solve(middle)[1] > 0
        low, high = np.where(rising, low, middle), np.where(rising, middle, high)
    value, _ = solve(high)
    # Where the pose itself is the extreme, its place is kept as the study gives it.
    turns &= np.isfinite(value) & (np.abs(high - at[index]) > 1e-9 * step)
    if full_turn:
        begin, end = min(at[0], at[-1]), max(at[0], at[-1])
        high = np.where(high < begin, high + 2 * np.pi, np.where(high > end, high - 2 * np.pi, high))
    answer = sampled.copy()
    turn = 2 * np.pi / study.units.angle_factor
    for k in np.flatnonzero(turns).tolist():
        answer[k] = in_study_units(study, outputs[k], value[k]), in_study_units(study, drive, high[k])
        if outputs[k].quantity == "angle":
            # Continuous with the poses beside it.
            answer[k, 0] += turn * round((sampled[k, 0] - answer[k, 0]) / turn)
    return answer
