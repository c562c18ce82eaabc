"""The poses of a motion that a page draws: those of its table, and more between two that are far apart."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from mechdesign.drawing.sweep import Sweep
from mechdesign.ground.numerics.arrays import Complexes, Floats, evenly
from mechdesign.ground.results import Table
from mechdesign.motion.finer import CHORD, MAX_POSES, near_chords, paths_of, together
from mechdesign.motion.question import PoseValues
from mechdesign.questions.kinematics.drawn import DrawnPoses, DrawnVectors

_ARROW = 0.2  # length of the longest arrow, as a part of the mechanism's size, as far as its tip is followed
_COMMON, _BOUND = 0.9, 3.0  # quantile of the largest vectors of the poses, and how much longer the longest arrow may be


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
    some = replace(drawn, shown=shown.take(evenly(len(shown.rows), MAX_POSES)))
    if along is None or along.curve.spent.any():
        return Sweep.of(some.shown), drawn.motion, table
    finer = drawn.finer
    rows = finer.shown.poses.numbers
    rows = rows[rows < shown.poses.end + 1 - shown.poses.closed]
    begin = together(rows if len(rows) <= MAX_POSES else some.shown.poses.numbers[some.shown.rows], np.array(marked))
    sizes = largest(drawn.vectors(drawn.motion, some.shown))
    points = [*Sweep.of(some.shown).places]

    def ways(places: Floats) -> Complexes:
        """Where points and tips of arrows are; `sizes` are those of the longest by their units."""
        there = finer if np.array_equal(places, finer.shown.poses.numbers) else drawn.at(places)
        size = CHORD * along.curve.mechanism.size
        rows = [paths_of(there.shown.configuration, points) / size]
        for kind in drawn.vectors(there.motion, there.shown) if sizes else ():
            # What is zero throughout, such as forces where nothing acts, has no arrows.
            if kind.unit in sizes:
                values = np.array([vector for *_, vector in kind.arrows]) / sizes[kind.unit]
                rows.append(np.where(np.abs(values) <= 1, _ARROW / CHORD * values, np.nan))
        return np.concatenate(rows)

    places, _ = near_chords(along.curve, ways, begin)
    page = drawn.at(places[: len(places) - shown.poses.closed])
    return Sweep.of(page.shown), page.motion, page.rows_of(table, some)
