"""The answers of a question about a motion: asked of every pose and between them, of one design or of many."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechdesign.ground.errors import AssemblyError
from mechdesign.ground.progress import NULL, Progress
from mechdesign.ground.results import Result, Scope
from mechdesign.motion.failures import failures
from mechdesign.motion.followed import Courses
from mechdesign.motion.group import DesignEnd, DesignGroup
from mechdesign.motion.passage import pass_over
from mechdesign.motion.question import MotionQuestion, Passage


def answer(question: MotionQuestion, progress: Progress = NULL, jobs: int | None = 1) -> list[DesignGroup]:
    """The answers of all designs, in groups of those of one kind; an error where no pose is valid.

    Of a single design it holds what pictures show, and of a long motion tables that make their rows anew.
    """
    passage = pass_over(question, progress, jobs)
    return answer_of(passage, jobs)


def alone(question: MotionQuestion, progress: Progress = NULL, jobs: int | None = 1) -> Result:
    """The answer of a single design; raises where it has none."""
    (group,) = answer(question, progress, jobs)
    result = group.of(0)
    if isinstance(result, Exception):
        raise result
    return result


def answer_of(passage: Passage, jobs: int | None = 1) -> list[DesignGroup]:
    """The answers after a pass over the poses; see `answer`."""
    question, designs = passage.question, passage.question.poses.designs
    along, between = question.between(passage)
    passage = replace(passage, along=along, between=between)
    kinds = question.kinds(passage)
    if len({*kinds}) > 1:
        parts = [np.array([k for k, own in enumerate(kinds) if own == kind]) for kind in dict.fromkeys(kinds)]
        return [replace(group, rows=some[group.rows]) for some in parts
                for group in answer(question.at(question.poses.some(some)))]  # fmt: skip
    tables = question.tables(passage)
    ends = [_end(passage, k) for k in range(designs)]
    lazily = question.lazy and question.poses.followed
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
                drawn=question.drawn(passage),
            )  # fmt: skip
    return [DesignGroup(np.arange(designs), result, ends, question.uneven(passage))]


def _end(passage: Passage, design: int) -> DesignEnd:
    """How a design was answered."""
    question, along = passage.question, passage.along
    motion, reason = question.motion, passage.reason.reshape(question.poses.designs, -1)[design]
    counts = {"poses": len(reason), "invalid": int(np.count_nonzero(reason))}
    try:
        warnings, failed = failures(motion, reason, design * len(reason), question.lead)
    except AssemblyError as error:
        return DesignEnd(counts=counts, error=error)
    more, gaps = question.say(passage, design)
    gaps = [motion.invalid_in_words(reason), "" if along is None else along.missing(design), *gaps]
    return DesignEnd([*warnings, *more], failed, " and ".join(filter(None, gaps)), counts)
