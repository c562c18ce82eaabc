"""One pass over all poses of a motion; of a long one only the poses that tables and pictures need stay in memory."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mechdesign.ground.numerics.arrays import Flags, Ints, evenly
from mechdesign.ground.progress import Progress
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.configuration import joined
from mechdesign.motion.motion import Motion, SolvedPoses
from mechdesign.motion.question import Mark, MotionQuestion, Passage, PoseValues, Remark, evaluate, pieces
from mechdesign.motion.rows import Poses
from mechdesign.motion.solving import POSES_AT_ONCE

# Poses of a motion that a picture can show.
MAX_SHOWN_POSES = 2001


def pass_over(question: MotionQuestion, progress: Progress, jobs: int | None) -> Passage:
    """Ask a question at every pose once; of a long motion only some of what it has is kept.

    Raises
    ------
    MechanismError
        If a pose's coordinates do not determine the mechanism.
    """
    poses, kept = question.poses, _Kept(question.motion)
    progress.start(poses.count, "poses")
    if not _long(question):
        solved: list[SolvedPoses] = []

        def keep(part: SolvedPoses) -> None:
            kept.keep(part)
            if poses.places:
                solved.append(part)
            progress.update(len(part.rows))

        values = evaluate(question, jobs, keep)
        flags = {remark: where.reshape(poses.designs, -1) for remark, where in question.marks(values).items()}
        counts = [{remark: Mark.of(where[k]) for remark, where in flags.items()} for k in range(poses.designs)]
        return Passage(question, values, kept.shown, values.reason, counts, solved)
    reason, totals = np.empty(poses.count, dtype=np.int8), dict[Remark, Mark]()
    rows, parts = list[Ints](), list[PoseValues]()
    for part, values in pieces(question, jobs):
        reason[part.rows] = values.reason
        begin = int(part.rows[0])
        for remark, where in question.marks(values).items():
            new, old = Mark.of(where, begin), totals.get(remark, Mark(0, -1))
            totals[remark] = Mark(old.number + new.number, old.first if old.number else new.first)
        some = _notable(values, np.isin(part.rows, kept.rows))
        rows.append(part.rows[some])
        parts.append(PoseValues(question, values.reason[some], _taken(values.arrays, some), values.totals))
        kept.keep(part)
        progress.update(len(part.rows))
    own = question.at(poses.take(np.concatenate(rows)))
    arrays = {name: np.concatenate([part.arrays[name] for part in parts]) for name in parts[0].arrays}
    totalled = sum((part.totals for part in parts), np.zeros(()))
    whole = PoseValues(own, np.concatenate([part.reason for part in parts]), arrays, totalled)
    shown = replace(kept.shown, rows=np.searchsorted(np.concatenate(rows), kept.rows))
    return Passage(question, whole, shown, reason, [totals], [])


def _long(question: MotionQuestion) -> bool:
    """Whether poses are too many to be held with all their columns, and all of one kind and one design."""
    poses = question.poses
    single = len(poses.groups) == 1 and poses.designs == 1 and not poses.rule.regions
    return question.divisible and poses.count > POSES_AT_ONCE and single and not poses.listed


def _notable(values: PoseValues, shown: Flags) -> Ints:
    """Poses of a part that are kept: those shown, where validity changes, and with the extremes of each column."""
    some, valid = shown, values.valid
    # Changes between two parts lie between their ends.
    some[[0, -1]] = True
    changes = valid[1:] != valid[:-1]
    some[1:] |= changes
    some[:-1] |= changes
    for column in values.arrays.values():
        finite = valid & np.isfinite(column)
        if finite.any():
            low, high = np.where(finite, column, np.inf), np.where(finite, column, -np.inf)
            some[[low.argmin(), high.argmax(), finite.argmax()]] = True
        if (lost := valid & np.isnan(column)).any():
            some[lost.argmax()] = True
    return np.flatnonzero(some)


def _taken(arrays: Mapping[str, Any], rows: Ints) -> dict[str, Any]:
    return {name: column[rows] for name, column in arrays.items()}


class _Kept:
    """What pictures show of the poses that are solved, part by part: evenly spread ones of the first group."""

    def __init__(self, motion: Motion) -> None:
        self.motion, self.parts = motion, list[Configuration]()
        self.rows = shown_rows(motion.poses)

    def keep(self, part: SolvedPoses) -> None:
        """Take over the shown ones of some solved poses."""
        index = np.flatnonzero(np.isin(part.rows, self.rows))
        if len(index):
            self.parts.append(part.configuration.take(index))

    @property
    def shown(self) -> SolvedPoses:
        """All that was kept."""
        whole = self.parts[0]
        if len(self.parts) > 1:
            whole = joined(self.parts, self.rows.shape, whole.take(0).vectors, {})
        return SolvedPoses(self.motion.at(self.motion.poses.take(self.rows)), self.rows, whole)


def shown_rows(poses: Poses, most: int = MAX_SHOWN_POSES) -> Ints:
    """Rows of the poses that a picture shows."""
    rows = poses.groups[0].rows
    return rows[evenly(len(rows), most)]
