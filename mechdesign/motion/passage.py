"""One pass over all poses of a motion; of a long one only the poses that tables and pictures need stay in memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mechdesign.cautions import Caution
from mechdesign.errors import counted
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.configuration import joined
from mechdesign.motion.motion import Motion, SolvedPoses
from mechdesign.motion.question import PoseQuestion, PoseValues, evaluate, pieces
from mechdesign.motion.rows import Poses
from mechdesign.motion.solving import POSES_AT_ONCE
from mechdesign.numerics.arrays import Flags, Ints, evenly
from mechdesign.progress import Progress
from mechdesign.results import LongTable, Scope, Table

# Poses of a motion that a picture can show.
MAX_SHOWN_POSES = 2001


@dataclass(frozen=True)
class Remark:
    """What is to be said of some poses of a design: a kind of warning, and its sentence.

    Parameters
    ----------
    words : str
        ``{number}`` of ``{count}`` poses, or of ``{poses}``; ``{are}`` and ``{lie}`` are their number with the verb.
    table : str
        Whose rows are the poses; left out: that of the question.
    least : float
        Part of the poses below which nothing is said.
    first : bool
        Whether the sentence names the first of the poses.
    """

    kind: str
    words: str
    table: str = ""
    least: float = 0.0
    first: bool = True


class Mark(NamedTuple):
    """How many poses of a design something is to be said of, and the row of the first."""

    number: int
    first: int

    @classmethod
    def of(cls, where: Flags, begin: int = 0) -> Mark:
        """The mark of some poses; the first has the row `begin`."""
        return cls(int(np.count_nonzero(where)), begin + int(where.argmax()))

    def caution(self, remark: Remark, question: PoseQuestion, design: int = 0) -> Caution | None:
        """The warning about these poses; None where they are too few."""
        number, row = self
        count = question.poses.count // question.poses.designs
        if number < max(remark.least * count, 1):
            return None
        pose = question.motion.in_words(row + design * count)
        are, lie = ("1 pose is", "1 pose lies") if number == 1 else (f"{number} poses are", f"{number} poses lie")
        words = remark.words.format(number=number, count=count, poses=counted(count, "pose"), are=are, lie=lie)
        words += f"; the first: {pose}" if remark.first else ""
        return Caution(remark.kind, words, remark.table or question.lead, row, pose)


@dataclass(frozen=True, eq=False)
class Passage:
    """What is known of a motion after one pass over all its poses.

    Attributes
    ----------
    values : PoseValues
        At all poses; of a long motion at those with the extremes of each column, those where validity changes, and as
        many between as a picture needs.
    shown : SolvedPoses
        The poses that a picture shows, of those of the values.
    reason : int8 array, shape (poses,)
        Of all poses; see `mechdesign.mechanism.Reason`.
    marks : list of mapping of Remark to Mark
        By design, what is to be said of how many of all poses.
    solved : list of SolvedPoses
        The poses themselves, of designs with dimensions of their own; else empty.
    """

    question: Any
    values: PoseValues
    shown: SolvedPoses
    reason: NDArray[np.int8]
    marks: Sequence[Mapping[Remark, Mark]]
    solved: Sequence[SolvedPoses]

    def cautions(self, design: int) -> list[Caution]:
        """Warnings about poses of a design."""
        marks = self.marks[design].items()
        said = (mark.caution(remark, self.question, design) for remark, mark in marks if remark.words)
        return [caution for caution in said if caution is not None]

    @property
    def long(self) -> bool:
        """Whether the values are not those of all poses."""
        return self.values.question is not self.question

    def table(self, make: Callable[[PoseValues], Table], jobs: int | None, scope: Scope | None) -> Table:
        """A table with as many rows for each pose of a long motion; its rows are made anew where they are wanted."""
        like = replace(make(self.values), scope=scope)
        rows = len(like) // len(self.values.reason)
        return LongTable(like, rows * self.question.poses.count, partial(self.blocks, make, jobs))

    def blocks(self, make: Callable[[PoseValues], Table], jobs: int | None) -> Iterator[Table]:
        """A table with a row a pose in parts."""
        return (make(values) for _, values in pieces(self.question, jobs))


def pass_over(question: PoseQuestion, progress: Progress, jobs: int | None) -> Passage:
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


def _long(question: PoseQuestion) -> bool:
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
