"""Poses of a motion that failed, in words: why, and at a limit the values there beside those that it allows."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import AssemblyError
from mechdesign.ground.numerals import numeral
from mechdesign.ground.numerics.arrays import Ints
from mechdesign.mechanism import Configuration, Mechanism, Reason
from mechdesign.motion.motion import Motion, in_study_units
from mechdesign.motion.solving import POSES_AT_ONCE, solve_rows
from mechdesign.study.text.units import Units

_NAMED = 5  # poses


def failures(
    motion: Motion, reason: NDArray[np.int8], begin: int = 0, table: str = ""
) -> tuple[list[Caution], str]:  # fmt: skip
    """Warnings for poses of a design that failed, and the message where that is an error (exit code 3).

    Parameters
    ----------
    reason : int8 array, shape (poses of the design,)
        See `mechdesign.mechanism.Reason`.
    begin : int
        Row of its first pose.
    table : str
        The table whose rows are the poses of the design, if there is one.

    Raises
    ------
    AssemblyError
        If every pose failed.
    """
    bad = np.flatnonzero(reason)
    if not len(bad):
        return [], ""
    if (reason == Reason.LIMIT).all() and (allowed := _limits(motion, begin + bad[:POSES_AT_ONCE])):
        raise AssemblyError(f"no pose is valid: {allowed}")
    named = [f"{motion.in_words(begin + row)}: {_why(motion, begin + row, int(reason[row]))}"
             for row in bad[:_NAMED].tolist()]  # fmt: skip
    if len(bad) == len(reason):
        more = "; ..." if len(bad) > len(named) else ""
        raise AssemblyError(f"no pose is valid; {'; '.join(named)}{more}")
    invalid = motion.invalid_in_words(reason)
    place = (table, int(bad[0]) if table else None, motion.in_words(begin + int(bad[0])))
    if motion.poses.listed:
        return [Caution("unassembled", invalid, *place)], f"pose {'; pose '.join(named)}"
    return [Caution("unassembled", f"{invalid}; the first: {named[0]}", *place)], ""


def _why(motion: Motion, row: int, reason: int) -> str:
    """Why the pose of a row failed."""
    words = _limits(motion, np.array([row])) if reason == Reason.LIMIT else ""
    return words or motion.mechanism.why(reason)


def _limits(motion: Motion, rows: Ints) -> str:
    """The limits that poses are beyond; empty of one of several designs, whose messages are counted by their words."""
    if motion.poses.designs > 1:
        return ""
    group = motion.poses.take(rows).groups[0]
    return "; ".join(passed_limits(motion.mechanism, motion.units, solve_rows(motion, rows[group.rows])))


def passed_limits(mechanism: Mechanism, units: Units, poses: Configuration) -> Iterator[str]:
    """``limit of drive arm: 0 to 90 deg where 100 to 120 deg is allowed``, of each limit that poses are beyond."""
    places = {**mechanism.nominal, **poses.places}
    for bound in mechanism.bounds:
        outside = np.zeros(poses.shape, dtype=bool)
        for _, margin in bound.margins(poses, places):
            outside |= np.broadcast_to(margin, poses.shape) < 0
        if not outside.any():
            continue
        unit, quantity = units.label(bound.coordinate.quantity), bound.coordinate
        values = np.broadcast_to(in_study_units(units, quantity, poses.value(quantity)), poses.shape)[outside]
        low, high = (None if end is None else float(np.ravel(in_study_units(units, quantity, end))[0])
                     for end in bound.ends(places))  # fmt: skip
        name = f"{bound.limit.kind} {'-'.join(bound.limit.items)}"
        here = _between(values.min(), values.max(), unit)
        yield f"limit of {name}: {here} where {_between(low, high, unit)} is allowed"


def _between(low: float | None, high: float | None, unit: str) -> str:
    """``0 to 90 deg``; ``at least 0 deg`` where one end is open, and a single value where both are the same."""
    words = [numeral(end) for end in (low, high) if end is not None]
    open_end = "at most " if low is None else "at least " if high is None else ""
    return f"{open_end}{' to '.join(dict.fromkeys(words))} {unit}".rstrip()
