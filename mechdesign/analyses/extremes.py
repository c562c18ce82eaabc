"""Extremes of a motion: the smallest and largest value of each output and error, also between the poses of a sweep."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses import targets
from mechdesign.analyses.poses import in_study_units, radians
from mechdesign.analyses.rates import drive_velocities
from mechdesign.analyses.roots import bracketed_roots
from mechdesign.analyses.targets import Error
from mechdesign.mechanism import Reason
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.outputs import first
from mechdesign.results import Column, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses

Array = NDArray[np.float64]

# How far from its place an extreme may be found, as a part of a step of the sweep.
PRECISION = 1e-13
# An error's extreme is flat: its value is exact when its place is known to the root of rounding.
SECTIONS = 40
GOLDEN = (5**0.5 - 1) / 2
# A range below this part of the output's size is rounding: the output does not move.
STILL = 1e-12


def extremes(
    study: Study, outputs: Sequence[Coordinate], errors: Sequence[Error], arrays: Mapping[str, Array], poses: Poses,
    swept: str | None, reason: NDArray[np.int8],
) -> Table:  # fmt: skip
    """Smallest and largest value of each output and error over the valid poses, and the ratio of the times between.

    Where one coordinate is swept, an output's extreme between two poses is found by its derivative, and an error's by
    golden section. `time_ratio` is the longer over the shorter part of a full turn of the swept
    angle between the two extremes, for a drive of constant speed; nan elsewhere. `min_at` is the swept coordinate, or
    the row where there is none.

    Parameters
    ----------
    arrays : mapping of str to ndarray, shape (poses,)
        The outputs and what targets need, in the study's units.
    swept : str or None
        The one coordinate that moves.
    reason : int8 array, shape (poses,)
        See `mechdesign.mechanism.Reason`.
    """
    mechanism = study.mechanism
    names = [*(output.name for output in outputs), *(error.name for error in errors)]
    quantities = [*(output.quantity for output in outputs), *(error.quantity for error in errors)]
    curves = [*(arrays[output.name] for output in outputs), *(error.values for error in errors)]
    at = poses.values[swept] if swept is not None else np.arange(poses.count, dtype=float)
    unit = study.units.label(mechanism.quantity(swept)) if swept is not None else ""
    turn = 2 * np.pi / study.units.angle_factor
    full_turn = bool(
        swept is not None
        and mechanism.quantity(swept) == "angle"
        and np.ptp(at) >= turn * (1 - 1e-9)
        and not reason.any()
    )
    found = np.full((2, len(names), 2), np.nan)  # smallest and largest: value and place
    index = np.zeros((2, len(names)), dtype=np.intp)
    moving = np.zeros(len(names), dtype=bool)
    for k, (curve, quantity) in enumerate(zip(curves, quantities, strict=True)):
        values = np.where(reason == Reason.OK, curve, np.nan)
        if np.isfinite(values).any():
            index[:, k] = np.nanargmin(values), np.nanargmax(values)
            size = {"length": mechanism.size, "angle": turn}.get(quantity, 0.0)
            moving[k] = np.nanmax(values) - np.nanmin(values) > STILL * max(float(np.nanmax(np.abs(values))), size)
            if not moving[k]:
                index[:, k] = np.flatnonzero(np.isfinite(values))[0]
            found[:, k, 0], found[:, k, 1] = values[index[:, k]], at[index[:, k]]
    rows = np.flatnonzero(moving)
    if swept is not None:
        of_outputs, of_errors = rows[rows < len(outputs)], rows[rows >= len(outputs)]
        for k, sign in enumerate((1, -1)):
            which = [outputs[j] for j in of_outputs]
            found[k, of_outputs] = _refined(
                study, which, poses, swept, index[k, of_outputs], sign, full_turn, found[k, of_outputs]
            )
            wanted = [errors[j - len(outputs)] for j in of_errors]
            found[k, of_errors] = _refined_errors(
                study, wanted, arrays, poses, swept, index[k, of_errors], sign, found[k, of_errors]
            )
    span = found[1, :, 0] - found[0, :, 0]
    ratio = np.full(len(names), np.nan)
    if full_turn:
        part = np.where(moving, (found[1, :, 1] - found[0, :, 1]) % turn, np.nan)
        with np.errstate(divide="ignore"):
            ratio = np.maximum(part, turn - part) / np.minimum(part, turn - part)
        ratio[~np.isfinite(ratio)] = np.nan
    where = f"{swept or 'row'} at the"
    return Table(
        "extremes",
        (
            Column("output", np.array(names), "", "output or error, in its own unit"),
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
    """Extremes where the derivative by the swept coordinate is zero, beside the pose that is the best of all.

    `sampled` and the answer hold a value and a place a row. Where the derivative does not change its sign beside the
    pose (an extreme at the end of the sweep, or beside a pose that fails) the row stays. `sign` is 1 for the smallest
    values, -1 for the largest.
    """
    if not outputs:
        return sampled
    mechanism, group = study.mechanism, poses.groups[0]
    plan = mechanism.plan(group.names)
    drive = mechanism.coordinate(swept)
    unit = [float(name == swept) for name in group.names]
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

    def solve(lane: NDArray[np.intp], place: Array) -> tuple[Array, Array]:
        """Value of some lanes' output and its derivative by the swept coordinate, times `sign`."""
        some = [values[lane] for values in given]
        some[group.names.index(swept)] = place
        configuration = plan.solve(some, start=start.take(lane))
        linear = mechanism.linearize(configuration)
        velocity = linear.velocity(drive_velocities(mechanism, linear, plan.structure.given, unit))
        asked = [outputs[k] for k in lane.tolist()]
        value = [np.broadcast_to(configuration.value(o), lane.shape)[k] for k, o in enumerate(asked)]
        slope = [np.broadcast_to(first(configuration, o, velocity), lane.shape)[k] for k, o in enumerate(asked)]
        valid = configuration.valid
        return np.where(valid, value, np.nan), sign * np.where(valid, slope, np.nan)

    slopes = [solve(lanes, end)[1] for end in (low, high)]
    turns = (slopes[0] < 0) & (slopes[1] > 0)
    if not turns.any():
        return sampled
    step = high - low
    moving = np.flatnonzero(turns)
    none = np.full(len(moving), np.nan)
    place, value = low.copy(), np.full(len(lanes), np.nan)
    place[moving] = bracketed_roots(
        lambda lane, at: solve(moving[lane], at)[1],
        low[moving], slopes[0][moving], high[moving], slopes[1][moving], none, none, PRECISION * step[moving],
    )  # fmt: skip
    value[moving] = solve(moving, place[moving])[0]
    # Where the pose itself is the extreme, its place is kept as the study gives it.
    turns &= np.isfinite(value) & (np.abs(place - at[index]) > 1e-9 * step)
    if full_turn:
        begin, end = min(at[0], at[-1]), max(at[0], at[-1])
        place = np.where(place < begin, place + 2 * np.pi, np.where(place > end, place - 2 * np.pi, place))
    answer = sampled.copy()
    turn = 2 * np.pi / study.units.angle_factor
    for k in np.flatnonzero(turns).tolist():
        answer[k] = in_study_units(study, outputs[k], value[k]), in_study_units(study, drive, place[k])
        if outputs[k].quantity == "angle":
            # Continuous with the poses beside it.
            answer[k, 0] += turn * round((sampled[k, 0] - answer[k, 0]) / turn)
    return answer


def _refined_errors(
    study: Study, asked: Sequence[Error], arrays: Mapping[str, Array], poses: Poses, swept: str,
    index: NDArray[np.intp], sign: int, sampled: Array,
) -> Array:  # fmt: skip
    """Extremes of errors between the poses beside the best one of all, by golden section.

    A lane's row stays where nothing better is found: beside a pose that fails, or where a target is given a pose.
    """
    if not asked:
        return sampled
    mechanism, group = study.mechanism, poses.groups[0]
    plan = mechanism.plan(group.names)
    watched = [mechanism.coordinate(name) for name in targets.needed(study, poses)]
    turn = 2 * np.pi / study.units.angle_factor
    given = [np.asarray(values, dtype=float)[index] for values in group.columns()]
    start = plan.solve([radians(study, c, v) for c, v in zip(plan.structure.given, given, strict=True)])

    def error(place: Array) -> Array:
        """Each lane's error, times `sign`; infinite where it has none."""
        given[group.names.index(swept)] = place
        held = dict(zip(group.names, given, strict=True))
        solved = plan.solve(
            [radians(study, c, v) for c, v in zip(plan.structure.given, given, strict=True)], start=start
        )
        values = {}
        for c in watched:
            value = held.get(c.name)
            if value is None:
                value = np.broadcast_to(np.asarray(in_study_units(study, c, solved.value(c))), place.shape)
                if c.quantity == "angle":
                    # Continuous with the pose itself.
                    value = value + turn * np.round((arrays[c.name][index] - value) / turn)
            values[c.name] = value
        known = {found.name: found.values for found in targets.errors(study, poses, values, None)}
        none = np.full(place.shape, np.nan)
        own = np.array([known.get(one.name, none)[lane] for lane, one in enumerate(asked)])
        return np.where(solved.valid & np.isfinite(own), sign * own, np.inf)

    at = group.values[swept]
    one, other = at[np.maximum(index - 1, 0)], at[np.minimum(index + 1, len(at) - 1)]
    low, high = np.minimum(one, other), np.maximum(one, other)
    for _ in range(SECTIONS):
        left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        lower = error(left) < error(right)
        low, high = np.where(lower, low, left), np.where(lower, right, high)
    place = (low + high) / 2
    value = sign * error(place)
    # Where the pose itself is the extreme its place is kept as the study gives it: beside it values are equal.
    size = {"length": mechanism.size, "angle": turn}
    rounding = STILL * np.array([size.get(one.quantity, 0.0) for one in asked])
    better = np.isfinite(value) & (sign * (sampled[:, 0] - value) > rounding)
    return np.where(better[:, None], np.stack([value, place], axis=1), sampled)
