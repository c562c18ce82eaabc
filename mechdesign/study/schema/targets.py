"""Targets of a mechanism section: what outputs should be, checked against the mechanism and its poses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechdesign.ground.errors import StudyError
from mechdesign.ground.expressions import Expression
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism import Mechanism
from mechdesign.motion.rows import Poses
from mechdesign.study.building.section import WrittenCurve, WrittenTarget
from mechdesign.study.schema.checker import Checker
from mechdesign.study.text.csv_files import read_table
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.fields import own_numbers
from mechdesign.study.text.reporter import Reporter

ROOT: KeyPath = ("mechanism", "targets")


@dataclass(frozen=True, eq=False)
class Target:
    """What an output should be: a function of coordinates, or a table.

    A table has as many columns as coordinates: one row a pose, or of a point a path without timing, a polyline. With
    one more the first is the drive's value, rising, between which the others are interpolated linearly. A curve is the
    other way round: a table of points, from which the motion of a point is judged, not the point from its path.
    """

    owner: str  # a coordinate or a measure, or a point whose path it is
    coordinates: tuple[str, ...]  # what has an error: the owner, or the point's x and y
    expression: Expression | None = None  # over coordinates and parameters, in the study's units
    table: Floats | None = None  # in the study's units, shape (rows, columns)
    rows: Sequence[Sequence[float]] = ()  # the numbers of the table, if some follow parameters
    closed: bool | None = None  # of points that the whole path of a point shall pass at any time: whether it is closed

    @property
    def timed(self) -> bool:
        """Whether the table's first column is the value of the drive."""
        return self.table is not None and self.table.shape[1] == len(self.coordinates) + 1

    @property
    def names(self) -> tuple[str, ...]:
        """Coordinates and parameters that the target itself depends on."""
        return tuple(sorted(self.expression.names)) if self.expression is not None else ()


def check(checker: Checker, written: Mapping[str, WrittenTarget]) -> dict[str, Target]:
    """Targets without mistakes; the mistakes of the others are reported."""
    targets: dict[str, Target] = {}
    owners: dict[str, str] = {}
    for owner, value in written.items():
        path: KeyPath = (*ROOT, owner)
        point = owner in checker.mechanism.owners
        if not point and checker.coordinate(owner, path, at_key=True) is None:
            continue
        coordinates = checker.mechanism.coordinates_of(owner)
        for name in [name for name in coordinates if name in owners][:1]:
            checker.report(path, f"{name} has a target already, by {owners[name]!r}", at_key=True)
        owners.update(dict.fromkeys(coordinates, owner))
        quantity = "length" if point else checker.mechanism.coordinates[owner]
        if isinstance(value, WrittenCurve):
            table = _table(checker, owner, value.points, path, 2, "length") if point else None
            if not point or (table is not None and table.shape[1] != 2):
                checker.report(path, "a curve is of a point, a row [x, y] each")
            elif table is not None:
                moved = value.points if any(own_numbers(value.points)) and not isinstance(value.points, str) else ()
                targets[owner] = Target(owner, coordinates, table=table, rows=moved, closed=value.closed)
        elif not isinstance(value, Expression):
            table = _table(checker, owner, value, path, len(coordinates), quantity)
            if table is not None:
                moved = () if isinstance(value, str) or not any(own_numbers(value)) else value
                targets[owner] = Target(owner, coordinates, table=table, rows=moved)
        elif _right(checker, owner, value, path, point):
            if quantity != "none":
                checker.kind(path, quantity)
            targets[owner] = Target(owner, coordinates, value)
    return targets


def _right(checker: Checker, owner: str, expression: Expression, path: KeyPath, point: bool) -> bool:
    """Whether the target of a coordinate is an expression over other coordinates and parameters."""
    if point:
        message = f"the target of a point is a path; give {owner}.x and {owner}.y their expressions"
        checker.report(path, message)
        return False
    right = True
    for name in sorted(expression.names):
        if name == owner:
            checker.report(path, f"{owner!r} is what the target is for: it cannot depend on it")
            right = False
        elif name not in checker.parameters.nominal:
            right &= checker.coordinate(name, path, others=checker.parameters.nominal) is not None
    return right


def _table(checker: Checker, owner: str, value: Any, path: KeyPath, count: int, quantity: str) -> Floats | None:
    """The table of a target; None, and a report, unless its rows have `count` numbers or one more."""
    try:
        table = read_table(checker.folder, value, most=3) if isinstance(value, str) else np.array(value)
    except StudyError as error:
        checker.report(path, str(error))
        return None
    columns = table.shape[1]
    if columns not in (count, count + 1):
        form = "[x, y] or [drive, x, y]" if count == 2 else "[value] or [drive, value]"
        checker.report(path, f"a row of the target of {owner!r} is {form}, not {columns} numbers")
        return None
    if not isinstance(value, str) and quantity != "none":
        for index, place in np.ndindex(len(table), count):
            checker.kind((*path, index, place + columns - count), quantity)
    if columns == count:
        return table
    table = table[np.argsort(table[:, 0], kind="stable")]
    same = np.flatnonzero(np.diff(table[:, 0]) == 0)
    if len(same):
        checker.report(path, f"the drive's value {table[same[0], 0]:g} stands in two rows")
        return None
    return table


def timing(drives: Sequence[str], poses: Poses) -> str | None:
    """The coordinate that a table's first column means: the only drive, or the only coordinate that moves."""
    if len(drives) == 1:
        return drives[0]
    moving = [name for name in poses.names if len(poses.groups) == 1 and np.ptp(poses.values[name]) > 0]
    return moving[0] if len(moving) == 1 else None


def check_poses(targets: Mapping[str, Target], mechanism: Mechanism, poses: Poses, reporter: Reporter) -> None:
    """Check that targets and the poses of kinematics fit each other."""
    for owner, target in targets.items():
        if target.table is None:
            continue
        if target.closed is not None:
            if not poses.followed:
                sweep = f"sweep: {{{mechanism.drives[0]}: {{from: 0, to: 360, step: 5}}}}"
                reporter.report((*ROOT, owner), f"a curve is passed by a motion; give kinematics one, such as {sweep}")
            continue
        rows = len(target.table)
        drive = timing(mechanism.drives, poses)
        if target.timed and drive is not None:
            for row in range(rows):
                reporter.kind((*ROOT, owner, row, 0), mechanism.quantity(drive))
        elif target.timed:
            message = (
                f"its first column is the value of the drive, but of {', '.join(mechanism.drives)} no single one is "
                "swept; give one row a pose"
            )
            reporter.report((*ROOT, owner), message)
        elif not target.timed and len(target.coordinates) == 1 and rows != poses.count:
            message = (
                f"{rows} values for {poses.count} poses: give one a pose, or rows [drive, value] to interpolate between"
            )
            reporter.report((*ROOT, owner), message)
