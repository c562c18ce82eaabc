"""The poses of a motion that a page draws: those of its table, and more between two that are far apart."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from mechdesign.drawing.sweep import Sweep
from mechdesign.ground.numerics.arrays import Complexes, Floats, evenly
from mechdesign.ground.results import Table
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import quiet
from mechdesign.motion.curve import Curve
from mechdesign.motion.question import PoseValues
from mechdesign.questions.kinematics.along import KinematicAlong
from mechdesign.questions.kinematics.drawn import DrawnPoses, DrawnVectors
from mechdesign.questions.kinematics.moved import full
from mechdesign.questions.poses import Shown

# Of more poses evenly spread ones are taken, and none are added.
MAX_POSES = 721
# The page moves a pin straight from one pose to the next: this far from its path at most, as a part of the mechanism's
# size.
CHORD = 1e-3
_ARROW = 0.2  # length of the longest arrow, as a part of the mechanism's size, as far as its tip is followed
_COMMON, _BOUND = 0.9, 3.0  # quantile of the largest vectors of the poses, and how much longer the longest arrow may be
_HALVINGS = 8  # of the way from one pose to the next at most: a jump is never short enough


def largest(vectors: Iterable[DrawnVectors]) -> dict[str, float]:
    """Size of the longest arrow by its unit, 0 where none has any: the largest, but near a singularity, where vectors
    grow without bound, a few times the usual largest one of a pose.
    """
    sizes: dict[str, float] = {}
    peaks: dict[str, list[Floats]] = {}
    for kind in vectors:
        peaks.setdefault(kind.unit, []).extend(np.abs(vector) for *_, vector in kind.arrows)
    for unit, peak in peaks.items():
        tops = np.nanmax(np.nan_to_num(np.array(peak), posinf=0.0), axis=0)
        sizes[unit] = float(min(tops.max(), _BOUND * np.quantile(tops, _COMMON)))
    return {unit: size for unit, size in sizes.items() if size > 0}


def frames(drawn: DrawnPoses, table: Table, marked: Sequence[float]) -> tuple[Sweep, PoseValues, Table]:
    """The poses that a page draws, and the motion and the table of which these are the rows `Sweep.rows`.

    Parameters
    ----------
    table : Table
        The table with a row for each pose of the study.
    marked : sequence of float
        Places of the motion, in rows, that are drawn as well.
    """
    shown, along = drawn.shown, drawn.along
    some = evenly(len(shown.rows), MAX_POSES)
    sweep = Sweep(shown.study, shown.poses, shown.rows[some], shown.configuration.take(some))
    if along is None or along.curve.spent.any():
        return sweep, drawn.motion, table
    rows = sweep.poses.numbers[sweep.rows]
    begin = np.union1d(rows, along.snapped(np.array(marked, dtype=float)))
    sizes = largest(drawn.vectors(drawn.motion, sweep))
    places = near_the_paths(along.curve, _ways(drawn, along, [*sweep.places], sizes), begin, MAX_POSES)
    if len(places) == len(rows):
        return sweep, drawn.motion, table
    new, motion = _solved(drawn, along, places)
    solved = drawn.table(motion)
    at_rows = np.searchsorted(places, rows)
    columns = []
    for column in table.columns:
        own = column.values[sweep.rows]
        # An error of a target that is given pose by pose is drawn straight between these.
        values = np.array(solved[column.name] if column.name in solved else np.interp(places, rows, own))
        values[at_rows] = own
        columns.append(replace(column, values=values))
    numbers = replace(table, columns=tuple(columns))
    return Sweep.of(new), motion, numbers


def near_the_paths(curve: Curve, ways: Callable[[Floats], Complexes], places: Floats, most: int) -> Floats:
    """Places of motions with more between them, as far as the chords of some ways, such as points' paths, need them.

    Parameters
    ----------
    curve : Curve
        Motions that all get the same places.
    ways : callable
        Ways (lengths of the study) at places, shape (ways, places), nan where they do not count.
    places : ndarray
        In rows of the poses of each motion.
    most : int
        With so many places none is added.
    """
    poses = curve.poses
    if poses.closed:
        places = np.append(places, poses.end)
    for _ in range(_HALVINGS):
        if len(places) >= most:
            break
        middles, ends = (places[:-1] + places[1:]) / 2, ways(places)
        chords = (ends[:, :-1] + ends[:, 1:]) / 2
        far = (np.abs(ways(middles) - chords) > CHORD * curve.mechanism.size).any(axis=0)
        if not far.any():
            break
        places = np.sort(np.append(places, middles[far]))
    return places[: len(places) - poses.closed]


@quiet
def paths_of(curve: Curve, points: Sequence[str], places: Floats) -> Complexes:
    """Where points are at places of all motions."""
    configuration = curve.solve(*curve.grid(places), turning=False).configuration
    return _paths(configuration, points).reshape(-1, len(places))


def _paths(configuration: Configuration, points: Sequence[str]) -> Complexes:
    return np.array([np.where(configuration.valid, configuration.point(point), np.nan) for point in points])


@quiet
def _ways(
    drawn: DrawnPoses, along: KinematicAlong, points: Sequence[str], sizes: Mapping[str, float]
) -> Callable[[Floats], Complexes]:  # fmt: skip
    """Where points and tips of arrows are at places of a motion; `sizes` are those of the longest by their units."""

    def at(places: Floats) -> Complexes:
        shown, motion = _solved(drawn, along, places)
        ways = [_paths(shown.configuration, points)]
        for kind in drawn.vectors(motion, shown) if sizes else ():
            # What is zero throughout, such as forces where nothing acts, has no arrows.
            if kind.unit in sizes:
                values = np.array([vector for *_, vector in kind.arrows]) / sizes[kind.unit]
                ways.append(np.where(np.abs(values) <= 1, _ARROW * along.curve.mechanism.size * values, np.nan))
        return np.concatenate(ways)

    return at


@quiet
def _solved(drawn: DrawnPoses, along: KinematicAlong, places: Floats) -> tuple[Shown, PoseValues]:
    """Poses at places of a motion, and the motion there, without errors of targets."""
    question = along.question
    there = along.curve.solve(np.zeros(len(places), dtype=np.intp), places)
    own = question.at(there.poses)
    motion = PoseValues(own, there.configuration.reason)
    motion.put(there.rows, full(own.moved(there)[0], there.rows.shape))
    return Shown(drawn.shown.study, own.poses, there.rows, there.configuration), motion
