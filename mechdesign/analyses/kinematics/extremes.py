"""Extremes of a motion: the smallest and largest value of each output and error, also between the poses of a sweep."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.kinematics import targets
from mechdesign.analyses.kinematics.boundaries import Boundary
from mechdesign.analyses.kinematics.curves import Curves
from mechdesign.analyses.kinematics.lines import Line
from mechdesign.analyses.kinematics.peaks import STILL, Curve, Peak, peaks, searched
from mechdesign.analyses.kinematics.targets import Error
from mechdesign.analyses.poses import in_study_units
from mechdesign.mechanism import Reason
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.results import Column, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses


def extremes(
    study: Study, outputs: Sequence[Coordinate], errors: Sequence[Error], arrays: Mapping[str, Floats], poses: Poses,
    swept: str | None, reason: NDArray[np.int8], ends: Sequence[Boundary] = (), asked: Collection[str] | None = None,
) -> tuple[Table, Flags]:  # fmt: skip
    """Smallest and largest value of each output and error over the motion, and the ratio of the times between.

    Where one coordinate is swept they are those of the whole motion, from limit to limit, between its poses too;
    elsewhere those of the valid poses. `time_ratio` is the longer over the shorter part of a full turn of the swept
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
    ends : sequence of Boundary
        Limits of the motion, of a single design.
    asked : collection of str, optional
        Outputs and errors whose extremes between the poses are wanted; all where left out.

    Returns
    -------
    (Table, bool array of shape (designs,))
        The table, and the designs whose motion ends where no limit is known, so that it does not answer for them.
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
        full_turn[:] = ~reason.reshape(shape).any(axis=1) & (not ends)
    found = np.full((2, shape[0], len(names), 2), np.nan)  # smallest and largest: value and place
    index = np.zeros((2, shape[0], len(names)), dtype=np.intp)
    moving = np.zeros((shape[0], len(names)), dtype=bool)
    first_row = np.arange(shape[0]) * shape[1]
    torn = np.zeros(shape[0], dtype=bool)
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
        between = _Between(study, outputs, errors, arrays, poses, swept, reason == Reason.OK, ends)
        torn = between.refine(found, index, some, moving)
        full_turn &= ~torn
    low_ends, high_ends = found.reshape(2, -1, 2)
    span = high_ends[:, 0] - low_ends[:, 0]
    timed = moving.ravel() & np.repeat(full_turn, len(names))
    part = np.where(timed, (high_ends[:, 1] - low_ends[:, 1]) % turn, np.nan)
    with np.errstate(divide="ignore"):
        ratio = np.maximum(part, turn - part) / np.minimum(part, turn - part)
    ratio[~np.isfinite(ratio)] = np.nan
    where = f"{swept or 'row'} at the"
    units = np.array([study.units.label(quantity) for quantity in quantities], dtype=str)
    table = Table(
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
    return table, torn


@dataclass(frozen=True, eq=False)
class _Between:
    """Extremes of outputs and errors between the poses of a sweep, and at the limits of its motion."""

    study: Study
    outputs: Sequence[Coordinate]
    errors: Sequence[Error]
    arrays: Mapping[str, Floats]
    poses: Poses
    swept: str
    valid: Flags
    ends: Sequence[Boundary]

    def refine(
        self, found: Floats, index: Ints, some: Flags, moving: Flags
    ) -> Flags:  # fmt: skip
        """Put better extremes than those of the poses into a table; returns the designs whose motion is torn.

        Parameters
        ----------
        found : ndarray, shape (2, designs, names, 2)
            Smallest and largest: value and place, in the study's units.
        index : ndarray of int, shape (2, designs, names)
            Their poses.
        some : bool array, shape (names,)
            Outputs and errors that are asked.
        moving : bool array, shape (designs, names)
            Which move; those found to move are added.
        """
        study, poses, count = self.study, self.poses, len(self.outputs)
        mine: Ints = np.flatnonzero(some[:count])
        wrong = bool(some[count:].any())
        watched = [study.mechanism.coordinate(name) for name in (targets.needed(study, poses) if wrong else ())]
        curves = Curves([*(self.outputs[k] for k in mine.tolist()), *watched], study.units.angle_factor)
        still = STILL * self._sizes(found)
        line = Line(study, poses, self.swept, self.valid, curves.leaves, self.ends)
        for k, name in enumerate(curves.names):
            known = self.arrays.get(name, poses.groups[0].values.get(name))
            if curves.leaves[k].turning and known is not None:
                line.align(k, known * study.units.angle_factor)
        for end, peak in enumerate(peaks(line, curves.curves[: len(mine)], still[mine])):
            self._take(peak, 1 - 2 * end, still, found[end], index[end], moving, mine)
        for end, sign in enumerate((1, -1) if wrong else ()):
            peak = self._of_errors(line, curves.curves[len(mine) :], watched, sign, still[count:])
            every = np.arange(count, len(some))
            self._take(peak, sign, still, found[end], index[end], moving, every, rough=True)
        return line.torn

    def _sizes(self, found: Floats) -> Floats:
        """Sizes that rounding is judged by, shape (names, designs)."""
        turn = 2 * np.pi / self.study.units.angle_factor
        sizes = {"length": self.study.mechanism.size, "angle": turn}
        quantities = [*(output.quantity for output in self.outputs), *(error.quantity for error in self.errors)]
        own = np.array([sizes.get(quantity, 0.0) for quantity in quantities])
        values: Floats = np.nan_to_num(np.abs(found[..., 0])).max(axis=0)
        return np.asarray(np.maximum(own, values).T)

    def _take(
        self, peak: Peak, sign: int, still: Floats, found: Floats, index: Ints, moving: Flags,
        which: Ints, rough: bool = False,
    ) -> None:  # fmt: skip
        """Put the better ones of some names into the table; where places are `rough`, only those of better values."""
        value, still = found[:, which, 0].T, still[which]
        best = np.where(np.isnan(value), np.inf, sign * value)
        better = peak.better(best, index[:, which].T, still, moving[:, which].T & (not rough))
        place = in_study_units(self.study, self.study.mechanism.coordinate(self.swept), peak.place)
        moving[:, which] |= (better & (np.abs(peak.value - best) > still)).T
        found[:, which] = np.where(
            better.T[..., None], np.stack([sign * peak.value.T, place.T], axis=-1), found[:, which]
        )

    def _of_errors(
        self, line: Line, curves: Sequence[Curve], watched: Sequence[Coordinate], sign: int, still: Floats
    ) -> Peak:  # fmt: skip
        """Smallest errors times a sign."""
        study, poses = self.study, self.poses
        held = {name: values for name, values in poses.groups[0].values.items() if name != self.swept}
        names = [error.name for error in self.errors]
        drive = study.mechanism.coordinate(self.swept)

        def errors(leaves: Floats, row: Ints, place: Floats) -> Floats:
            values = {c.name: curve(leaves, leaves)[0] for c, curve in zip(watched, curves, strict=True)}
            values |= {name: column[row] for name, column in held.items() if name in values}
            if self.swept in values:
                values[self.swept] = in_study_units(study, drive, place)
            table = np.full((len(names), len(row)), np.nan)
            for error in targets.errors(study, poses, values, row, between=True):
                table[names.index(error.name)] = error.values
            return sign * table

        def along(node: Ints, place: Floats) -> Floats:
            leaves = line.near(line.sample(line.row[node], place)[0], node)
            return errors(leaves, line.row[node], place)

        return searched(line, along, errors(line.values, line.row, line.place), still)
