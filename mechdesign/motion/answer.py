"""The answers of a question about a motion: asked of every pose and between them, of one design or of many."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np

from mechdesign.cautions import Caution
from mechdesign.errors import AssemblyError
from mechdesign.motion.along import AlongMotion
from mechdesign.motion.followed import Courses
from mechdesign.motion.group import DesignEnd, DesignGroup
from mechdesign.motion.passage import Passage, pass_over
from mechdesign.motion.question import PoseQuestion
from mechdesign.numerics.arrays import Ints
from mechdesign.progress import NULL, Progress
from mechdesign.results import Drawn, Result, Scope, Table
from mechdesign.statistics import Request


@dataclass(frozen=True, eq=False)
class Between:
    """What a question has of motions between their poses; nothing of listed poses, grids and what cannot be followed.

    Parameters
    ----------
    along : AlongMotion, optional
        Its columns that its own tables and warnings follow.
    """

    along: AlongMotion | None


B = TypeVar("B", bound=Between)


class MotionQuestion(PoseQuestion, Generic[B]):
    """A question about motions, with all that `answer` asks of it."""

    #: Whether its columns are followed where they are asked, and not before.
    lazy: ClassVar[bool] = False

    @abstractmethod
    def between(self, passage: Passage) -> B:
        """What it has between the poses, after these were passed."""

    @abstractmethod
    def along(self, requests: Collection[Request]) -> AlongMotion | None:
        """Some of its columns along the motions; None where these cannot be followed."""

    @abstractmethod
    def tables(self, passage: Passage, between: B) -> Mapping[str, Table]:
        """All tables, in their order."""

    @abstractmethod
    def say(self, passage: Passage, between: B, design: int) -> tuple[list[Caution], list[str]]:
        """Warnings about a design, and what of its motion is missing, in words."""

    @abstractmethod
    def drawn(self, passage: Passage, between: B) -> Drawn:
        """What pictures need of a single design."""

    def kinds(self, passage: Passage, between: B) -> Sequence[object]:
        """By design, what its answer depends on as a whole; designs of several kinds are asked again, kind by kind."""
        return [None] * self.poses.designs

    def uneven(self, passage: Passage, between: B) -> Mapping[str, Sequence[int] | Ints]:
        """Numbers of rows of each design in tables of which one may have more than another."""
        return {}


def answer(question: MotionQuestion[Any], progress: Progress = NULL, jobs: int | None = 1) -> list[DesignGroup]:
    """The answers of all designs, in groups of those of one kind; an error where no pose is valid.

    Of a single design it holds what pictures show, and of a long motion tables that make their rows anew.
    """
    passage = pass_over(question, progress, jobs)
    return answer_of(passage, jobs)


def alone(question: MotionQuestion[Any], progress: Progress = NULL, jobs: int | None = 1) -> Result:
    """The answer of a single design; raises where it has none."""
    (group,) = answer(question, progress, jobs)
    result = group.of(0)
    if isinstance(result, Exception):
        raise result
    return result


def answer_of(passage: Passage, jobs: int | None = 1) -> list[DesignGroup]:
    """The answers after a pass over the poses; see `answer`."""
    question, designs = passage.question, passage.question.poses.designs
    between = question.between(passage)
    kinds = question.kinds(passage, between)
    if len({*kinds}) > 1:
        parts = [np.array([k for k, own in enumerate(kinds) if own == kind]) for kind in dict.fromkeys(kinds)]
        return [replace(group, rows=some[group.rows]) for some in parts
                for group in answer(question.at(question.poses.some(some)))]  # fmt: skip
    tables = question.tables(passage, between)
    ends = [_end(passage, between, k) for k in range(designs)]
    along, lazily = between.along, question.lazy and question.poses.followed
    closely = lazily if along is None else not along.functions.unresolved.any()
    whole = Scope(not closely, ends[0].missing if designs == 1 else "")
    a_pose = whole if along is None and not lazily else replace(whole, follow=Courses(question.along))
    scopes = dict.fromkeys(question.a_row_a_pose, a_pose)
    scopes |= dict.fromkeys(question.poses_only, replace(whole, poses_only=True))
    tables = {name: replace(table, scope=scopes.get(name, whole)) for name, table in tables.items()}
    result = Result(question.command, tables, absent=question.absent)
    if designs == 1:
        (end,) = ends
        if passage.long:
            long = {name: passage.table(make, jobs, tables[name].scope)
                    for name, make in question.a_row_a_pose.items() if name in tables}  # fmt: skip
            result = replace(result, tables={**tables, **long})
        if end.error is None:
            result = replace(
                result, warnings=end.warnings, counts=end.counts, failed=end.failed,
                drawn=question.drawn(passage, between),
            )  # fmt: skip
    return [DesignGroup(np.arange(designs), result, ends, question.uneven(passage, between))]


def _end(passage: Passage, between: Between, design: int) -> DesignEnd:
    """How a design was answered."""
    question, along = passage.question, between.along
    motion, reason = question.motion, passage.reason.reshape(question.poses.designs, -1)[design]
    counts = {"poses": len(reason), "invalid": int(np.count_nonzero(reason))}
    try:
        warnings, failed = motion.failures(reason, design * len(reason), question.lead)
    except AssemblyError as error:
        return DesignEnd(counts=counts, error=error)
    more, gaps = question.say(passage, between, design)
    gaps = [motion.invalid_in_words(reason), "" if along is None else along.missing(design), *gaps]
    return DesignEnd([*warnings, *more], failed, " and ".join(filter(None, gaps)), counts)
