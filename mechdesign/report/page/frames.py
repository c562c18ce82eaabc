"""The poses of a motion that a page draws: those of its table, and more between two that are far apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mechdesign.curve.motion import Curve
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import quiet
from mechdesign.numerics.arrays import Complexes, Floats, evenly
from mechdesign.questions.kinematics.along import Along
from mechdesign.questions.kinematics.drawn import DrawnMotion
from mechdesign.questions.kinematics.motion import Motion
from mechdesign.questions.kinematics.tables import motion_table
from mechdesign.questions.poses import SolvedPoses
from mechdesign.report.figures.scene import Sweep
from mechdesign.results import Table
from mechdesign.study.poses import Poses

# Of more poses evenly spread ones are taken, and none are added.
MAX_POSES = 721
# The page moves a pin straight from one pose to the next: this far from its path at most, as a part of the mechanism's
# size.
CHORD = 1e-3
_HALVINGS = 8  # of the way from one pose to the next at most: a jump is never short enough


def frames(drawn: DrawnMotion, table: Table, marked: Sequence[float]) -> tuple[Sweep, Table]:
    """The poses that a page draws, and the table of motion of which these are the rows `Sweep.rows`.

    Parameters
    ----------
    table : Table
        The motion at the poses of the study.
    marked : sequence of float
        Places of the motion, in rows, that are drawn as well.
    """
    shown, along = drawn.shown, drawn.along
    some = evenly(len(shown.rows), MAX_POSES)
    sweep = Sweep(shown.study, shown.poses, shown.rows[some], shown.configuration.take(some))
    if along is None or along.curve.spent.any():
        return sweep, table
    rows = sweep.poses.numbers[sweep.rows]
    begin = np.union1d(rows, along.snapped(np.array(marked, dtype=float)))
    places = near_the_paths(along.curve, [*sweep.places], begin, MAX_POSES)
    if len(places) == len(rows):
        return sweep, table
    poses, configuration, solved = _solved(along, places)
    at_rows = np.searchsorted(places, rows)
    columns = []
    for column in table.columns:
        own = column.values[sweep.rows]
        # An error of a target that is given pose by pose is drawn straight between these.
        values = np.array(solved[column.name] if column.name in solved else np.interp(places, rows, own))
        values[at_rows] = own
        columns.append(replace(column, values=values))
    numbers = replace(table, columns=tuple(columns))
    return Sweep(shown.study, poses, np.arange(len(places)), configuration), numbers


@quiet
def near_the_paths(curve: Curve, points: Sequence[str], places: Floats, most: int) -> Floats:
    """Places of motions with more between them, as far as the chords of the points' paths need them.

    Parameters
    ----------
    curve : Curve
        Motions that all get the same places.
    places : ndarray
        In rows of the poses of each motion.
    most : int
        With so many places none is added.
    """
    mechanism, poses = curve.mechanism, curve.poses

    def pins(s: Floats) -> Complexes:
        _, configuration = curve.solve(*curve.grid(s), turning=False)
        paths = [np.where(configuration.valid, configuration.point(point), np.nan) for point in points]
        return np.array(paths).reshape(-1, len(s))

    if poses.closed:
        places = np.append(places, poses.end)
    for _ in range(_HALVINGS):
        if len(places) >= most:
            break
        middles, ends = (places[:-1] + places[1:]) / 2, pins(places)
        chords = (ends[:, :-1] + ends[:, 1:]) / 2
        far = (np.abs(pins(middles) - chords) > CHORD * mechanism.size).any(axis=0)
        if not far.any():
            break
        places = np.sort(np.append(places, middles[far]))
    return places[: len(places) - poses.closed]


@quiet
def _solved(along: Along, places: Floats) -> tuple[Poses, Configuration, Table]:
    """Poses at places of a motion, and its table there, without errors of targets."""
    question = along.question
    poses, configuration = along.curve.solve(np.zeros(len(places), dtype=np.intp), places)
    poses = replace(poses, motion=True, paths=question.poses.paths, rows=places)
    motion = Motion(replace(question, poses=poses), reason=configuration.reason.copy())
    motion.fill(SolvedPoses(np.arange(len(places)), poses.groups[0].names, configuration))
    return poses, configuration, motion_table(motion)
