"""Extremes of a motion: the smallest and largest value of each output and error, also between the poses of a sweep."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from mechdesign.analyses.kinematics import targets
from mechdesign.analyses.kinematics.lines import STILL, PoseLine
from mechdesign.analyses.kinematics.motion import Motion
from mechdesign.analyses.kinematics.peaks import Along, Peak, peaks, searched
from mechdesign.analyses.poses import in_study_units
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.results import Column, Table


def needed(motion: Motion, names: Collection[str] | None) -> list[Coordinate]:
    """Coordinates that a line must follow for extremes of some outputs and errors, or all."""
    mechanism = motion.question.study.mechanism
    found = [output for output in motion.question.outputs if names is None or output.name in names]
    if any(names is None or error.name in names for error in motion.errors):
        found += [mechanism.coordinate(name) for name in targets.needed(motion.question.study, motion.question.poses)]
    return found


def extremes(motion: Motion, swept: str | None, line: PoseLine | None, names: Collection[str] | None = None) -> Table:
    """Smallest and largest value of each output and error over the motion, and the ratio of the times between.

    Where one coordinate is swept they are those of the whole motion, from limit to limit, between its poses too;
    elsewhere those of the valid poses. `time_ratio` is the longer over the shorter part of a full turn of the swept
    angle between the two extremes, for a drive of constant speed; nan elsewhere. `min_at` is the swept coordinate, or
    the row where there is none.

    Parameters
    ----------
    swept : str or None
        The one coordinate that moves.
    line : PoseLine or None
        The motion along it.
    names : collection of str, optional
        Outputs and errors whose extremes between the poses are wanted; all where left out.
    """
    study, poses, outputs = motion.question.study, motion.question.poses, motion.question.outputs
    mechanism = study.mechanism
    shape = (poses.designs, poses.count // poses.designs)
    curves = {output.name: (output.quantity, motion.arrays[output.name]) for output in outputs}
    curves |= {error.name: (error.quantity, error.values) for error in motion.errors}
    at = poses.values[swept] if swept is not None else np.tile(np.arange(shape[1], dtype=float), shape[0])
    turn = 2 * np.pi / study.units.angle_factor
    sizes = {"length": mechanism.size, "angle": turn}
    # Of both ends: value and place, and the pose; shape (designs, names).
    found, row = np.full((2, 2, shape[0], len(curves)), np.nan), np.zeros((2, shape[0], len(curves)), dtype=np.intp)
    still, first_row = np.zeros((shape[0], len(curves))), np.arange(shape[0]) * shape[1]
    for k, (quantity, curve) in enumerate(curves.values()):
        values, known = curve.reshape(shape), (motion.valid & np.isfinite(curve)).reshape(shape)
        some = known.any(axis=1)
        every = known.all()
        row[0, :, k] = first_row + (values if every else np.where(known, values, np.inf)).argmin(axis=1)
        row[1, :, k] = first_row + (values if every else np.where(known, values, -np.inf)).argmax(axis=1)
        low, high = (values.ravel()[row[end, :, k]] for end in (0, 1))
        still[:, k] = STILL * np.fmax(np.fmax(np.abs(low), np.abs(high)), sizes.get(quantity, 0.0))
        # What stands still does so from its first pose on.
        stands = some & ~(high - low > still[:, k])
        row[:, stands, k] = (first_row + known.argmax(axis=1))[stands]
        found[:, 0, some, k], found[:, 1, some, k] = values.ravel()[row[:, some, k]], at[row[:, some, k]]
    moving = np.asarray(found[1, 0] - found[0, 0] > still)
    if line is not None:
        _between(motion, line, names, found, row, still, moving)
    (low, low_at), (high, high_at) = found
    timed = np.zeros(shape[0], dtype=bool)
    if line is not None and mechanism.quantity(line.swept) == "angle" and np.ptp(at) >= turn * (1 - 1e-9):
        timed = motion.valid.reshape(shape).all(axis=1) & ~line.torn & (not line.ends)
    part = np.where(timed[:, None] & moving, (high_at - low_at) % turn, np.nan)
    with np.errstate(divide="ignore"):
        ratio = np.maximum(part, turn - part) / np.minimum(part, turn - part)
    ratio[~np.isfinite(ratio)] = np.nan
    where = f"{swept or 'row'} at the"
    unit = study.units.label(mechanism.quantity(swept)) if swept is not None else ""
    units = [study.units.label(quantity) for quantity, _ in curves.values()]
    return Table(
        "extremes",
        (
            Column("output", np.tile(np.array(list(curves)), shape[0]), "", "output or error, in its own unit"),
            Column("min", low.ravel(), "", "smallest value over the motion, in `unit`"),
            Column("min_at", low_at.ravel(), unit, f"{where} smallest value"),
            Column("max", high.ravel(), "", "largest value over the motion, in `unit`"),
            Column("max_at", high_at.ravel(), unit, f"{where} largest value"),
            Column("range", (high - low).ravel(), "", "max - min, in `unit`"),
            Column("time_ratio", ratio.ravel(), "", "longer over shorter time between the extremes, constant speed"),
            Column("unit", np.tile(np.array(units, dtype=str), shape[0]), "", "unit of min, max and range"),
        ),
        "extremes of the outputs over the motion",
    )


def _between(
    motion: Motion,
    line: PoseLine,
    names: Collection[str] | None,
    found: Floats,
    row: Ints,
    still: Floats,
    moving: Flags,
) -> None:
    """Put better extremes than those of the poses into a table: from between the poses, and at limits of the motion.

    Parameters
    ----------
    found : ndarray, shape (2, 2, designs, names)
        Smallest and largest: value and place, in the study's units.
    row : ndarray of int, shape (2, designs, names)
        Their poses.
    still : ndarray, shape (designs, names)
        What is rounding.
    moving : bool array, shape (designs, names)
        Which move; those found to move are added.
    """
    study, outputs = motion.question.study, motion.question.outputs
    swept = study.mechanism.coordinate(line.swept)

    def take(peak: Peak, end: int, which: Sequence[int], exact: bool) -> None:
        sign = 1 - 2 * end
        value = np.where(np.isnan(found[end, 0][:, which]), np.inf, sign * found[end, 0][:, which])
        new, place, rounding = sign * peak.value.T, in_study_units(study, swept, peak.place.T), still[:, which]
        away = np.abs(peak.position.T - row[end][:, which])
        with np.errstate(invalid="ignore"):
            # Better, or that pose's own extreme, but beside it.
            beside = (np.abs(sign * new - value) <= rounding) & (away < 1) & (away > 1e-9) & moving[:, which] & exact
            lower = sign * new < value - rounding
        for part, table in enumerate((new, place)):
            found[end, part][:, which] = np.where(lower | beside, table, found[end, part][:, which])
        moving[:, which] |= lower

    mine = [k for k, output in enumerate(outputs) if names is None or output.name in names]
    rows = np.array([line.rows[outputs[k].name] for k in mine], dtype=np.intp)
    for end, peak in enumerate(peaks(line, rows, still.T[mine])):
        take(peak, end, mine, True)
    wrong = list(range(len(outputs), still.shape[1]))
    if any(names is None or error.name in names for error in motion.errors):
        for end, sign in enumerate((1, -1)):
            along = _errors(motion, line, sign)
            every = np.arange(len(line.row))
            take(searched(line, along, along(every, line.place), still.T[wrong]), end, wrong, False)


def _errors(motion: Motion, line: PoseLine, sign: int) -> Along:
    """Errors times a sign, beside poses of a line."""
    study, poses = motion.question.study, motion.question.poses
    names, wanted = [error.name for error in motion.errors], targets.needed(study, poses)
    held = {name: values for name, values in poses.groups[0].values.items() if name != line.swept}

    def along(node: Ints, place: Floats) -> Floats:
        row, values = line.row[node], line.at(node, place)
        known = {name: held[name][row] if name in held else values[line.rows[name]] for name in wanted}
        table = np.full((len(names), len(row)), np.nan)
        for error in targets.errors(study, poses, known, row, between=True):
            table[names.index(error.name)] = error.values
        return sign * table

    return along
