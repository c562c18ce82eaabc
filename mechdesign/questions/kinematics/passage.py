"""One pass over all poses of a motion; of a long one only the poses that tables and pictures need stay in memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mechdesign.numerics.arrays import Flags
from mechdesign.progress import Progress
from mechdesign.questions.kinematics.motion import Motion, move, pieces
from mechdesign.questions.kinematics.picked import Picked
from mechdesign.questions.kinematics.question import MotionQuestion
from mechdesign.questions.poses import POSES_AT_ONCE, Keeper, Shown, SolvedPoses
from mechdesign.results import LongTable, Scope, Table

# Which poses of a motion something is to be said of, by what it is.
Marks = Callable[[Motion], Mapping[str, Flags]]


class Mark(NamedTuple):
    """How many poses of a design something is to be said of, and the row of the first."""

    number: int
    first: int


@dataclass(frozen=True, eq=False)
class Passage:
    """What is known of a motion after one pass over all its poses.

    Attributes
    ----------
    motion : Motion
        Of all poses; of a long motion of those with the extremes of each column, those where validity changes, and as
        many between as a picture needs.
    shown : Shown
        The poses that a picture shows, of those of the motion.
    reason : int8 array, shape (poses,)
        Of all poses; see `mechdesign.mechanism.Reason`.
    marks : list of mapping of str to Mark
        By design, what is to be said of how many of all poses.
    solved : list of SolvedPoses
        The poses themselves, of designs with dimensions of their own; else empty.
    """

    question: MotionQuestion
    motion: Motion
    shown: Shown
    reason: NDArray[np.int8]
    marks: Sequence[Mapping[str, Mark]]
    solved: Sequence[SolvedPoses]

    @property
    def long(self) -> bool:
        """Whether the motion has not all poses."""
        return self.motion.question is not self.question

    def table(self, make: Callable[[Motion], Table], jobs: int | None, scope: Scope | None) -> Table:
        """A table with as many rows for each pose of a long motion; its rows are made anew where they are wanted."""
        like = replace(make(self.motion), scope=scope)
        rows = len(like) // len(self.motion.reason)
        return LongTable(like, rows * self.question.poses.count, partial(self.blocks, make, jobs))

    def blocks(self, make: Callable[[Motion], Table], jobs: int | None) -> Iterator[Table]:
        """A table with a row a pose in parts."""
        return (make(motion) for _, motion in pieces(self.question, jobs))


def pass_over(question: MotionQuestion, marks: Marks, progress: Progress, jobs: int | None) -> Passage:
    """Solve every pose of a question once.

    Raises
    ------
    MechanismError
        If a pose's coordinates do not determine the mechanism.
    """
    poses, keeper = question.poses, Keeper(question.study, question.poses)
    if not _is_long(question):
        solved: list[SolvedPoses] = []

        def keep(part: SolvedPoses) -> None:
            keeper.keep(part)
            if poses.places:
                solved.append(part)

        motion = move(question, progress, jobs, also=keep)
        flags = {name: where.reshape(poses.designs, -1) for name, where in marks(motion).items()}
        counts = [{name: _mark(where[k], 0) for name, where in flags.items()} for k in range(poses.designs)]
        return Passage(question, motion, keeper.shown, motion.reason, counts, solved)
    picked = Picked(question, keeper.rows)
    reason, totals = np.empty(poses.count, dtype=np.int8), dict[str, Mark]()
    for part, motion in pieces(question, jobs):
        reason[part.rows] = motion.reason
        begin = int(part.rows[0])
        for name, where in marks(motion).items():
            new, old = _mark(where, begin), totals.get(name, Mark(0, -1))
            totals[name] = Mark(old.number + new.number, old.first if old.number else new.first)
        picked.add(begin, motion)
        keeper.keep(part)
        progress.update(len(part.rows))
    motion, shown = picked.motion(), keeper.shown
    assert motion.question.poses.rows is not None
    rows = np.searchsorted(motion.question.poses.rows, shown.rows)
    return Passage(question, motion, replace(shown, poses=motion.question.poses, rows=rows), reason, [totals], [])


def _is_long(question: MotionQuestion) -> bool:
    """Whether poses are too many to be held with all their columns, and all of one kind and one design."""
    poses = question.poses
    per_pose = any(t.table is not None and len(t.table) == poses.count for t in question.study.targets.values())
    single = len(poses.groups) == 1 and poses.designs == 1 and not poses.regions
    return poses.count > POSES_AT_ONCE and single and not poses.listed and not per_pose


def _mark(where: Flags, begin: int) -> Mark:
    return Mark(int(np.count_nonzero(where)), begin + int(where.argmax()))
