"""Errors of outputs against their targets: functions, values a pose, and paths with or without timing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from mechdesign.ground.expressions import Corner, Expression
from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.mechanism.algebra import dot, norm2
from mechdesign.mechanism.elements.declared import Quantity
from mechdesign.motion.question import PoseValues
from mechdesign.motion.rows import Poses
from mechdesign.study import Study
from mechdesign.study.schema.targets import Target, timing
from mechdesign.study.text.tables import table_of

# Distances between poses and pieces of a path that are held in memory at once.
MAX_DISTANCES = 1 << 20
# A drive's value within this part of the table's range beyond its end is at the end.
TABLE_END_ROUNDING = 1e-9


def needed(study: Study, poses: Poses) -> tuple[str, ...]:
    """Coordinates whose values the errors need: those with targets, and those that targets depend on."""
    names: list[str] = []
    for target in study.targets.values():
        names += [*target.coordinates, *(name for name in target.names if name not in study.parameters.nominal)]
        drive = timing(study.mechanism.drives, poses) if target.timed else None
        names += [drive] if drive is not None else []
    return tuple(dict.fromkeys(names))


def followed(study: Study, poses: Poses) -> dict[str, Quantity]:
    """Quantities of the errors that have values between the poses, by column: not of targets with a value for each."""
    each = [(owner, *target.coordinates) for owner, target in study.targets.items() if _a_value_each(target, poses)]
    return {error(name): quantity for name, quantity in judged(study).items() if not any(name in own for own in each)}


def error(output: str) -> str:
    """Name of the column of its errors."""
    return f"{output}_error"


def judged(study: Study) -> dict[str, Quantity]:
    """Outputs with targets and the quantities of their errors, a point's x and y before its distance."""
    outputs: dict[str, Quantity] = {}
    for target in study.targets.values():
        outputs |= {name: study.mechanism.quantity(name) for name in target.coordinates}
        outputs |= {target.owner: "length"} if len(target.coordinates) == 2 else {}
    return outputs


def knots(study: Study, target: Target, poses: Poses) -> list[Corner]:
    """Where a target by a table of a drive's values bends: at the values of its rows, and where the table ends."""
    drive = timing(study.mechanism.drives, poses) if target.timed else None
    if drive is None:
        return []
    turn = 2 * np.pi / study.units.angle_factor if study.mechanism.quantity(drive) == "angle" else 0.0
    values = Expression(drive, (("name", drive),))
    return [Corner(values, tuple(np.unique(table[:, 0]).tolist()), turn) for table in own_tables(target, poses)]


def path(target: Target, poses: Poses) -> bool:
    """Whether a target is a path without timing, a polyline."""
    return target.table is not None and not target.timed and not _a_value_each(target, poses)


def owner(target: Target, poses: Poses, points: Complexes, line: Ints) -> Ints:
    """Corner or side of its path without timing that is nearest to each point, of the motion of a line."""
    tables, owners = own_tables(target, poses), np.zeros(len(points), dtype=np.intp)
    for k, table in enumerate(tables):
        some = np.flatnonzero((line == k) | (len(tables) == 1))
        owners[some] = nearest(points[some], table[:, 0] + 1j * table[:, 1])[1]
    return owners


def _a_value_each(target: Target, poses: Poses) -> bool:
    """Whether a target has a value for each pose of a design."""
    return target.table is not None and not target.timed and len(target.table) == poses.count // poses.designs


def errors(
    study: Study, poses: Poses, values: Mapping[str, Floats], rows: Ints, *, between: bool = False
) -> dict[str, Floats]:
    """Errors of all targets by their columns: a coordinate less its target, or a point's distance from its path.

    They are in the study's units, angles in (-half a turn, half a turn]; nan where the output or the target has no
    value.

    Parameters
    ----------
    values : mapping of str to ndarray, shape (n,)
        The coordinates of `needed` in the study's units, angles continuous where they are so in the results.
    rows : ndarray of int, shape (n,)
        The pose of each value.
    between : bool
        Whether they are values between the poses, where targets that are given for each pose have none.
    """
    turn, columns = 2 * np.pi / study.units.angle_factor, dict[str, Floats]()
    for target in study.targets.values():
        goals = _goals(study, target, poses, values, rows, between)
        if goals is None:
            continue
        parts = []
        for name, should in zip(target.coordinates, goals, strict=True):
            gap = values[name] - should
            if study.mechanism.quantity(name) == "angle":
                gap = gap - turn * np.ceil(gap / turn - 0.5)
            parts.append(gap)
            columns[error(name)] = gap
        if len(parts) == 2:
            columns[error(target.owner)] = np.hypot(*parts)
    return columns


def _goals(
    study: Study, target: Target, poses: Poses, values: Mapping[str, Floats], rows: Ints, between: bool
) -> Sequence[Floats] | None:
    """What each coordinate of a target should be; None where that is not known between the poses."""
    if target.expression is not None:
        varied = {name: column[rows] for name, column in poses.parameters.items()}
        env: dict[str, ArrayLike] = {**study.parameters.nominal, **varied, **values}
        return [np.asarray(target.expression.evaluate(env), dtype=float) + 0 * values[target.owner]]
    if between and _a_value_each(target, poses):
        return None
    tables = own_tables(target, poses)
    if len(tables) == 1:
        return _by_table(study, target, tables[0], poses, values, rows)
    design = rows // (poses.count // poses.designs)
    goals = np.empty((len(target.coordinates), len(rows)))
    for k in np.unique(design).tolist():
        some = np.flatnonzero(design == k)
        own = {name: column[some] for name, column in values.items()}
        goals[:, some] = _by_table(study, target, tables[k], poses, own, rows[some])
    return list(goals)


def own_tables(target: Target, poses: Poses) -> Floats:
    """The target's table for each design, shape (designs, rows, columns); one where it follows no parameter."""
    assert target.table is not None
    if not target.rows or not poses.own.parameters:
        return target.table[None]
    tables = table_of(target.rows, poses.own.of)
    order = np.argsort(tables[:, :, 0], axis=1, kind="stable")
    return np.take_along_axis(tables, order[..., None], axis=1) if target.timed else tables


def _by_table(
    study: Study, target: Target, table: Floats, poses: Poses, values: Mapping[str, Floats], rows: Ints
) -> Sequence[Floats]:
    """What each coordinate of a target with this table should be."""
    if target.timed:
        drive = timing(study.mechanism.drives, poses)
        assert drive is not None
        turn = 2 * np.pi / study.units.angle_factor if study.mechanism.quantity(drive) == "angle" else None
        return _interpolated(table, values[drive], turn)
    if _a_value_each(target, poses):
        return list(table[rows % len(table)].T)
    x, y = (values[name] for name in target.coordinates)
    foot, _ = nearest(x + 1j * y, table[:, 0] + 1j * table[:, 1])
    return [foot.real, foot.imag]


def _interpolated(table: Floats, at: Floats, turn: float | None) -> list[Floats]:
    """Columns of a table at values of its first, linearly; nan outside.

    Where `turn` is given, values outside the table are taken at the turn in which it may hold them.
    """
    first, last = table[0, 0], table[-1, 0]
    slack = TABLE_END_ROUNDING * max(last - first, abs(first))
    outside = (at < first - slack) | (at > last + slack)
    if turn is not None:
        at = np.where(outside, first + np.mod(at - first, turn), at)
        outside = at > last + slack
    return [np.where(outside | np.isnan(at), np.nan, np.interp(at, table[:, 0], column)) for column in table[:, 1:].T]


def nearest(points: Complexes, corners: Complexes) -> tuple[Complexes, Ints]:
    """The nearest point of a polyline to each point (x + i y), and which of its corners or sides it lies on.

    The polyline is given by its corners, which have even numbers; its sides have odd ones. A single corner is a point.
    """
    if len(corners) == 1:
        return np.where(np.isnan(points), np.nan, corners[0]), np.zeros(len(points), dtype=np.intp)
    begins, spans = corners[:-1], np.diff(corners)
    lengths = norm2(spans)
    # A piece without length is its corner: any positive divisor gives part 0.
    lengths = np.where(lengths > 0, lengths, 1.0)
    nearest_feet, owners = np.empty(len(points), dtype=complex), np.empty(len(points), dtype=np.intp)
    step = max(1, MAX_DISTANCES // len(spans))
    for first in range(0, len(points), step):
        some = points[first : first + step, None]
        parts = np.clip(dot(spans, some - begins) / lengths, 0.0, 1.0)
        feet = begins + parts * spans
        # The sides beside a corner that is nowhere are nowhere.
        best = np.argmin(np.nan_to_num(norm2(some - feet), nan=np.inf), axis=1)
        lanes = np.arange(len(feet))
        nearest_feet[first : first + step] = feet[lanes, best]
        part = parts[lanes, best]
        owners[first : first + step] = 2 * best + np.where(part <= 0, 0, np.where(part >= 1, 2, 1))
    return nearest_feet, owners


def totals(values: PoseValues) -> Floats:
    """Number, sum, and sum of the squares of each design's errors at valid poses, shape (3, designs, errors)."""
    outputs, designs, valid = judged(values.question.study), values.question.poses.designs, values.valid
    sums = np.zeros((3, designs, len(outputs)))
    for k, output in enumerate(outputs):
        column = values.arrays[error(output)]
        counted = (valid & np.isfinite(column)).reshape(designs, -1)
        own = np.where(counted, column.reshape(counted.shape), 0.0)
        sums[:, :, k] = counted.sum(axis=1), own.sum(axis=1), (own**2).sum(axis=1)
    return sums


def untargeted(values: PoseValues) -> dict[str, Flags]:
    """By outputs with targets, points among them, the valid poses where their target has no value."""
    return {owner: values.valid & ~np.isfinite(values.arrays[error(owner)]) for owner in values.question.study.targets}
