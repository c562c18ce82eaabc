"""Results of motions from a pass over their poses: tables, warnings and counts, of many designs at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol, TypeVar

import numpy as np

from mechdesign.cautions import Caution
from mechdesign.curve.ends import Change
from mechdesign.errors import AssemblyError
from mechdesign.mechanism.four_bars import FourBar, chains, four_bars
from mechdesign.numerics.arrays import Flags
from mechdesign.progress import NULL
from mechdesign.questions.kinematics.along import Along, along_of
from mechdesign.questions.kinematics.cams import CamSide, cam_table, cautions, profiles
from mechdesign.questions.kinematics.courses import Courses
from mechdesign.questions.kinematics.drawn import DrawnMotion
from mechdesign.questions.kinematics.extremes import extremes, targets_table
from mechdesign.questions.kinematics.limits import Limit, change_points, hidden, limits_of, limits_table, passed
from mechdesign.questions.kinematics.loops import Toggle, loops_table, measured, toggles_of, toggles_table
from mechdesign.questions.kinematics.passage import Passage, pass_over
from mechdesign.questions.kinematics.question import MotionQuestion
from mechdesign.questions.kinematics.remarks import marks_of, remarks, unfollowed, valued, without_centre, without_value
from mechdesign.questions.kinematics.tables import A_ROW_A_POSE, pose_tables
from mechdesign.questions.kinematics.velocity_jumps import jumps_in_words, velocity_jumps
from mechdesign.questions.poses import invalid_in_words, judge_failures
from mechdesign.questions.together import End, Group
from mechdesign.results import Result, Scope

# Tables in the order in which they are shown.
ORDER = ("motion", "extremes", "limits", "loops", "toggles", "targets", "jacobian", "instant_centres", "cam")


class _OnLine(Protocol):
    @property
    def line(self) -> int: ...


Own = TypeVar("Own", bound=_OnLine)


@dataclass(frozen=True, eq=False)
class _Events:
    """Motions between their poses, if they can be followed there; by design limits and change points; and cams."""

    along: Along | None
    limits: Sequence[Sequence[Limit]]
    changes: Sequence[Sequence[Change]]
    cams: Sequence[CamSide]


def answers_of(passage: Passage) -> list[Group]:
    """The answers of all designs, in groups of those of one kind; an error where no pose is valid.

    Of a single design it holds what pictures show.
    """
    question, motion, designs = passage.question, passage.motion, passage.question.poses.designs
    shapes = _shapes(passage)
    loops = max(shapes, key=len)
    along = along_of(question, loops=loops, toggles=True, passages=True)
    kinds = _kinds(shapes, along)
    if len(set(kinds)) > 1:
        return _in_groups(question, kinds)
    tables = pose_tables(motion)
    tables["extremes"] = extremes(motion, along)
    limits: list[Limit] = []
    toggles: list[Toggle] = []
    changes: list[Change] = []
    if along is not None:
        limits, toggles, changes = limits_of(along), toggles_of(loops, along), along.ends.changes()
        tables["limits"] = limits_table(limits, along)
    if loops:
        tables["loops"] = loops_table(question, shapes, loops, along)
        if along is not None:
            tables["toggles"] = toggles_table(toggles, along)
    if motion.errors:
        tables["targets"] = targets_table(motion, along)
    sides = profiles(question.study, question.poses)
    if sides:
        tables["cam"] = cam_table(question.study, sides)
    events = _Events(along, _by_line(limits, designs), _by_line(changes, designs), sides)
    ends = [_end(passage, events, k) for k in range(designs)]
    closely = along is not None and not along.functions.unresolved.any()
    whole = Scope(not closely, ends[0].missing if designs == 1 else "")
    a_pose = replace(whole, follow=Courses(question))
    # Rows of a cam are places of its profile.
    scopes = {**dict.fromkeys(A_ROW_A_POSE, a_pose), "cam": replace(whole, poses_only=True)}
    scoped = {name: replace(tables[name], scope=scopes.get(name, whole)) for name in ORDER if name in tables}
    uneven = {"limits": [*map(len, events.limits)], "toggles": [*map(len, _by_line(toggles, designs))]}
    result = Result("kinematics", scoped, absent=question.absent)
    if designs == 1:
        drawn = DrawnMotion(passage.shown, motion, along, limits, toggles)
        (end,) = ends
        result = replace(result, warnings=end.warnings, counts=end.counts, failed=end.failed, drawn=drawn)
    return [Group(np.arange(designs), result, ends, uneven)]


def _end(passage: Passage, events: _Events, k: int) -> End:
    """How design `k` was answered."""
    question, along, designs = passage.question, events.along, passage.question.poses.designs
    reason = passage.reason.reshape(designs, -1)[k]
    counts = {"poses": len(reason), "invalid": int(np.count_nonzero(reason))}
    own = question if designs == 1 else replace(question, poses=question.poses.some(np.array([k])))
    try:
        warnings, failed = _warnings(own, passage, events, k, reason == 0)
    except AssemblyError as error:
        return End(counts=counts, error=error)
    missing = [invalid_in_words(question.study, reason), along.missing(k) if along is not None else ""]
    return End(warnings, failed, " and ".join(filter(None, missing)), counts)


def _warnings(
    question: MotionQuestion, passage: Passage, events: _Events, k: int, valid: Flags
) -> tuple[list[Caution], str]:  # fmt: skip
    """Warnings of design `k`, the poses of which are those of its own question; and the error where poses fail.

    Raises
    ------
    AssemblyError
        If no pose is valid.
    """
    along, marks = events.along, passage.marks[k]
    reason = passage.reason.reshape(-1, len(valid))[k]
    warnings, failed = judge_failures(question.study, question.poses, reason, table="motion")
    warnings += remarks(question, marks)
    jumps = velocity_jumps(passage.question, question.study.mechanism.description.links, k)
    if len(jumps):
        warnings.append(jumps_in_words(passage.question, jumps, "motion", k))
    if along is None:
        warnings += unfollowed(question.poses)
    else:
        warnings += hidden(events.limits[k], along, valid) + passed(events.limits[k], along)
        warnings += change_points(events.changes[k], along)
        if along.functions.unresolved.any():
            warnings.append(Caution(
                "unconverged",
                "the motion between the poses is too long, or too rough, to be followed closely: its limits are known, "
                "but extremes may lie between the places that were looked at; sweep less of it",
                "extremes",
            ))  # fmt: skip
    names = [name for name in valued(question) if along is not None and name in along.columns]
    between = {} if along is None or along.curve.spent[k] else {name: float(along.lost(name)[k]) for name in names}
    warnings += without_value(question, marks, between)
    return [*warnings, *without_centre(question, marks), *cautions(question.study, events.cams, k)], failed


def _shapes(passage: Passage) -> Sequence[Sequence[FourBar]]:
    """The four-bars and slider-cranks of each design."""
    mechanism, poses = passage.question.study.mechanism, passage.question.poses
    if not poses.places:
        return [four_bars(mechanism)] * poses.designs
    lengths, size = measured(mechanism, chains(mechanism), poses, passage.solved), mechanism.size
    shapes = [[loop for loop in own if loop.whole(size)] for own in lengths]
    # Of a design without a valid pose none is known, and its answer is an error.
    valid = (passage.reason == 0).reshape(poses.designs, -1).any(axis=1)
    return [own if good else shapes[int(valid.argmax())] for own, good in zip(shapes, valid, strict=True)]


def _kinds(shapes: Sequence[Sequence[FourBar]], along: Along | None) -> list[tuple[object, ...]]:
    """By design, what its answer depends on as a whole: which loops it has, and how closely it can be followed."""
    names = [tuple(loop.joints for loop in own) for own in shapes]
    if along is None:
        return [(own,) for own in names]
    spent, unresolved = along.curve.spent.tolist(), along.functions.unresolved.tolist()
    return [*zip(names, spent, unresolved, strict=True)]


def _in_groups(question: MotionQuestion, kinds: Sequence[tuple[object, ...]]) -> list[Group]:
    """Answers of designs of several kinds, those of a kind together."""
    groups = []
    for kind in dict.fromkeys(kinds):
        some = np.array([k for k, own in enumerate(kinds) if own == kind])
        part = replace(question, poses=question.poses.some(some))
        groups += [replace(group, rows=some[group.rows]) for group in answers_of(pass_over(part, marks_of, NULL, 1))]
    return groups


def _by_line(events: Sequence[Own], lines: int) -> list[list[Own]]:
    parts: list[list[Own]] = [[] for _ in range(lines)]
    for one in events:
        parts[one.line].append(one)
    return parts
