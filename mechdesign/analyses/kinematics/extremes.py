"""Extremes of a motion: the smallest and largest value of each output and error, also between the poses of a sweep."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.kinematics import targets
from mechdesign.analyses.kinematics.rates import drive_velocities
from mechdesign.analyses.kinematics.targets import Error
from mechdesign.analyses.poses import dimensions, in_study_units, radians, starts
from mechdesign.analyses.roots import bracketed_roots
from mechdesign.mechanism import Configuration, Reason
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.golden import lowest
from mechdesign.mechanism.outputs import first
from mechdesign.mechanism.plan import Plan
from mechdesign.results import Column, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses

Array = NDArray[np.float64]

# How far from its place an extreme may be found, as a part of a step of the sweep.
PRECISION = 1e-13
# A range below this part of the output's size is rounding: the output does not move.
STILL = 1e-12


def extremes(
    study: Study, outputs: Sequence[Coordinate], errors: Sequence[Error], arrays: Mapping[str, Array], poses: Poses,
    swept: str | None, reason: NDArray[np.int8], asked: Collection[str] | None = None,
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
    asked : collection of str, optional
        Outputs and errors whose extremes between the poses are wanted; all where left out.
    """
    mechanism = study.mechanism
    shape = (poses.designs, poses.count // poses.designs)
    names = [*(output.name for output in outputs), *(error.name for error in errors)]
    quantities = [*(output.quantity for output in outputs), *(error.quantity for error in errors)]
    curves = [*(arrays[output.name] for output in outputs), *(error.values for error in errors)]
    at = poses.values[swept] if swept is not None else np.tile(np.arange(shape[1], dtype=float), shape[0])
    unit = study.units.label(mechanism.quantity(swept)) if swept is not None else ""
    turn = 2 * np.pi / study.units.angle_factor
    full_turn = np.zeros(shape[0], dtype=bool)
    if swept is not None and mechanism.quantity(swept) == "angle" and np.ptp(at) >= turn * (1 - 1e-9):
        full_turn[:] = ~reason.reshape(shape).any(axis=1)
    found = np.full((2, shape[0], len(names), 2), np.nan)  # smallest and largest: value and place
    index = np.zeros((2, shape[0], len(names)), dtype=np.intp)
    moving = np.zeros((shape[0], len(names)), dtype=bool)
    first_row = np.arange(shape[0]) * shape[1]
    for k, (curve, quantity) in enumerate(zip(curves, quantities, strict=True)):
        values = np.where(reason == Reason.OK, curve, np.nan).reshape(shape)
        known = np.isfinite(values)
        some = known.any(axis=1)
        low, high = np.where(known, values, np.inf), np.where(known, values, -np.inf)
        size = {"length": mechanism.size, "angle": turn}.get(quantity, 0.0)
        with np.errstate(invalid="ignore"):
            scale = np.maximum(np.where(known, np.abs(values), 0.0).max(axis=1), size)
            moving[:, k] = some & (high.max(axis=1) - low.min(axis=1) > STILL * scale)
        still = known.argmax(axis=1)
        for end, best in enumerate((low.argmin(axis=1), high.argmax(axis=1))):
            rows = first_row + np.where(moving[:, k], best, still)
            index[end, :, k] = rows
            found[end, some, k, 0], found[end, some, k, 1] = values.ravel()[rows[some]], at[rows[some]]
    if swept is not None:
        some = np.array([asked is None or name in asked for name in names])
        design, which = np.nonzero(moving & some)
        for k, sign in enumerate((1, -1)):
            for of_errors in (False, True):
                mine = (which >= len(outputs)) == of_errors
                lanes = design[mine], which[mine]
                if not mine.any():
                    continue
                # Targets may be known within the sweep only.
                sweep = _Sweep(study, poses, swept, index[k][lanes], full_turn[lanes[0]] & (not of_errors))
                sampled = found[k][lanes]
                if of_errors:
                    found[k][lanes] = _refined_errors(sweep, errors, lanes[1] - len(outputs), arrays, sign, sampled)
                else:
                    found[k][lanes] = _refined(sweep, outputs, lanes[1], sign, sampled)
    low_ends, high_ends = found.reshape(2, -1, 2)
    span = high_ends[:, 0] - low_ends[:, 0]
    timed = moving.ravel() & np.repeat(full_turn, len(names))
    part = np.where(timed, (high_ends[:, 1] - low_ends[:, 1]) % turn, np.nan)
    with np.errstate(divide="ignore"):
        ratio = np.maximum(part, turn - part) / np.minimum(part, turn - part)
    ratio[~np.isfinite(ratio)] = np.nan
    where = f"{swept or 'row'} at the"
    units = np.array([study.units.label(quantity) for quantity in quantities], dtype=str)
    return Table(
        "extremes",
        (
            Column("output", np.tile(np.array(names), shape[0]), "", "output or error, in its own unit"),
            Column("min", low_ends[:, 0], "", "smallest value over the motion, in `unit`"),
            Column("min_at", low_ends[:, 1], unit, f"{where} smallest value"),
            Column("max", high_ends[:, 0], "", "largest value over the motion, in `unit`"),
            Column("max_at", high_ends[:, 1], unit, f"{where} largest value"),
            Column("range", span, "", "max - min, in `unit`"),
            Column("time_ratio", ratio, "", "longer over shorter time between the extremes, constant speed"),
            Column("unit", np.tile(units, shape[0]), "", "unit of min, max and range"),
        ),
        "extremes of the outputs over the motion",
    )


@dataclass(frozen=True, eq=False)
class _Sweep:
    """Lanes of a sweep, each beside one pose.

    Parameters
    ----------
    index : ndarray of int, shape (lanes,)
        The pose.
    full_turn : ndarray of bool, shape (lanes,)
        Whether the ends of the sweep are one pose.
    """

    study: Study
    poses: Poses
    swept: str
    index: NDArray[np.intp]
    full_turn: NDArray[np.bool_]

    @cached_property
    def plan(self) -> Plan:
        """Plan of the coordinates given."""
        return self.study.mechanism.plan(self.poses.groups[0].names)

    @cached_property
    def swept_at(self) -> int:
        """Which of the given coordinates moves."""
        return self.poses.groups[0].names.index(self.swept)

    @cached_property
    def given(self) -> list[Array]:
        """Values of the given coordinates at the poses, in the study's units."""
        return [np.asarray(values, dtype=float)[self.index] for values in self.poses.groups[0].columns()]

    @cached_property
    def start(self) -> Configuration:
        """The poses."""
        start = starts(self.plan.mechanism, self.poses, self.index) if self.plan.iterative else None
        return self._solve(self.given, self.index, start)

    def _solve(self, given: Sequence[Array], index: NDArray[np.intp], start: Configuration | None) -> Configuration:
        values = [radians(self.study, c, v) for c, v in zip(self.plan.structure.given, given, strict=True)]
        return self.plan.solve(values, dimensions(self.poses, index), start=start)

    def solve(self, lane: NDArray[np.intp], place: Array) -> Configuration:
        """Some lanes with the swept coordinate elsewhere, in the study's units."""
        given = [values[lane] for values in self.given]
        given[self.swept_at] = place
        return self._solve(given, self.index[lane], self.start.take(lane))

    def beside(self) -> tuple[Array, Array]:
        """The swept coordinate at the poses before and after, in rising order; at an end, the pose itself."""
        at = self.poses.groups[0].values[self.swept]
        line = self.poses.count // self.poses.designs
        row = self.index % line
        before, after = at[self.index - (row > 0)], at[self.index + (row < line - 1)]
        before = np.where(self.full_turn & (row == 0), at[0] - (at[line - 1] - at[line - 2]), before)
        after = np.where(self.full_turn & (row == line - 1), at[line - 1] + (at[1] - at[0]), after)
        return np.minimum(before, after), np.maximum(before, after)


def _refined(sweep: _Sweep, outputs: Sequence[Coordinate], which: NDArray[np.intp], sign: int, sampled: Array) -> Array:
    """Extremes where the derivative by the swept coordinate is zero, beside the pose that is the best of all.

    `sampled` and the answer hold a value and a place a lane, `which` its output. Where the derivative does not change
    its sign beside the pose (an extreme at the end of the sweep, or beside a pose that fails) the row stays. `sign` is
    1 for the smallest values, -1 for the largest.
    """
    study, mechanism, plan = sweep.study, sweep.study.mechanism, sweep.plan
    drive = mechanism.coordinate(sweep.swept)
    unit = [float(name == sweep.swept) for name in sweep.poses.groups[0].names]
    lanes = np.arange(len(which))
    at = np.asarray(radians(study, drive, sweep.given[sweep.swept_at]), dtype=float)
    low, high = (np.asarray(radians(study, drive, end), dtype=float) for end in sweep.beside())

    def solve(lane: NDArray[np.intp], place: Array) -> tuple[Array, Array]:
        """Value of some lanes' output and its derivative by the swept coordinate, times `sign`."""
        configuration = sweep.solve(lane, np.asarray(in_study_units(study, drive, place)))
        linear = mechanism.linearize(configuration)
        velocity = linear.velocity(drive_velocities(mechanism, linear, plan.structure.given, unit))
        value, slope = np.empty(lane.shape), np.empty(lane.shape)
        for k in np.unique(which[lane]):
            mine = which[lane] == k
            value[mine] = np.broadcast_to(configuration.value(outputs[k]), lane.shape)[mine]
            slope[mine] = np.broadcast_to(first(configuration, outputs[k], velocity), lane.shape)[mine]
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
    turns &= np.isfinite(value) & (np.abs(place - at) > 1e-9 * step)
    ends = np.asarray(radians(study, drive, sweep.poses.groups[0].values[sweep.swept]), dtype=float)
    begin, end = ends.min(), ends.max()
    around = np.where(place < begin, place + 2 * np.pi, np.where(place > end, place - 2 * np.pi, place))
    place = np.where(sweep.full_turn, around, place)
    turn = 2 * np.pi / study.units.angle_factor
    place = np.asarray(in_study_units(study, drive, place))
    angular = np.array([output.quantity == "angle" for output in outputs])[which]
    value = np.where(angular, value / study.units.angle_factor, value)
    # Continuous with the poses beside it.
    value = np.where(angular, value + turn * np.round((sampled[:, 0] - value) / turn), value)
    return np.where(turns[:, None], np.stack([value, place], axis=1), sampled)


def _refined_errors(
    sweep: _Sweep, asked: Sequence[Error], which: NDArray[np.intp], arrays: Mapping[str, Array], sign: int,
    sampled: Array,
) -> Array:  # fmt: skip
    """Extremes of errors between the poses beside the best one of all, by golden section.

    A lane's row stays where nothing better is found: beside a pose that fails, or where a target is given a pose.
    """
    study, poses = sweep.study, sweep.poses
    mechanism = study.mechanism
    watched = [mechanism.coordinate(name) for name in targets.needed(study, poses)]
    turn = 2 * np.pi / study.units.angle_factor
    every = np.arange(len(which))

    def error(place: Array) -> Array:
        """Each lane's error, times `sign`; infinite where it has none."""
        solved = sweep.solve(every, place)
        held = dict(zip(poses.groups[0].names, sweep.given, strict=True)) | {sweep.swept: place}
        values = {}
        for c in watched:
            value = held.get(c.name)
            if value is None:
                value = np.broadcast_to(np.asarray(in_study_units(study, c, solved.value(c))), place.shape)
                if c.quantity == "angle":
                    # Continuous with the pose itself.
                    value = value + turn * np.round((arrays[c.name][sweep.index] - value) / turn)
            values[c.name] = value
        own = np.full(place.shape, np.nan)
        for found in targets.errors(study, poses, values, sweep.index, between=True):
            mine = np.array([one.name == found.name for one in asked])[which]
            own[mine] = found.values[mine]
        return np.where(solved.valid & np.isfinite(own), sign * own, np.inf)

    place, value = lowest(error, *sweep.beside())
    value = sign * value
    # Where the pose itself is the extreme its place is kept as the study gives it: beside it values are equal.
    size = {"length": mechanism.size, "angle": turn}
    rounding = STILL * np.array([size.get(one.quantity, 0.0) for one in asked])[which]
    better = np.isfinite(value) & (sign * (sampled[:, 0] - value) > rounding)
    return np.where(better[:, None], np.stack([value, place], axis=1), sampled)
