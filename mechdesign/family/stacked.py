"""Thousands of designs at once: tables with the same number of rows for each, whole answers, margins of assembly."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.errors import MechdesignError
from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.ground.results import Result, Scope, Table
from mechdesign.ground.statistics import Request
from mechdesign.ground.work.threads import one_thread
from mechdesign.mechanism import Mechanism, Reason
from mechdesign.mechanism.algebra import Value
from mechdesign.motion.along import AlongMotion
from mechdesign.motion.answer import answer
from mechdesign.motion.followed import courses_of
from mechdesign.motion.group import DesignGroup
from mechdesign.motion.motion import SolvedPoses
from mechdesign.motion.question import MotionQuestion, evaluate
from mechdesign.motion.rows import Poses
from mechdesign.questions.dynamics.analysis import Dynamics
from mechdesign.questions.kinematics.along import KinematicAlong
from mechdesign.questions.kinematics.answers import Kinematics
from mechdesign.questions.look import ask
from mechdesign.questions.poses import alike, study_poses
from mechdesign.questions.reliability import analysis as reliability
from mechdesign.questions.stiffness.analysis import ORDER, Stiffness
from mechdesign.study import Study
from mechdesign.study.designs import Designs
from mechdesign.study.text.units import Amount
from mechdesign.study.variants import remeasured

# Tables with a row a pose, or several, that are followed between the poses.
A_ROW_A_POSE = {*Kinematics.a_row_a_pose, *Dynamics.a_row_a_pose, *Stiffness.a_row_a_pose}
TABLES: Mapping[str, Collection[str]] = {
    "kinematics": (*Kinematics.a_row_a_pose, "extremes", "loops", "targets"),
    # A design may have more springs than another.
    "stiffness": tuple(name for name in ORDER if name != "springs"),
    "dynamics": (*Dynamics.a_row_a_pose, "extremes"),
    "reliability": ("moments", "reliability", "capability", "contributions"),
}


# Questions that many designs are asked at once.
TOGETHER: Mapping[str, Callable[[Study, Poses], MotionQuestion]] = {
    "kinematics": Kinematics.of, "stiffness": Stiffness.of, "dynamics": Dynamics.of
}  # fmt: skip


class Stack(NamedTuple):
    """Tables of some designs.

    Parameters
    ----------
    reason : int8 array, shape (designs, poses)
        See `mechdesign.mechanism.Reason`.
    whole : bool array, shape (designs,)
        Whether the motion has no gap between the poses; True where poses are no motion.
    solved : list of SolvedPoses
        The solved poses.
    """

    result: Result
    reason: NDArray[np.int8]
    whole: Flags
    solved: list[SolvedPoses]


def in_time(study: Study, command: str) -> bool:
    """Whether an answer is that of a motion which efforts bring about."""
    return command == "dynamics" and study.dynamics is not None and study.dynamics.forward is not None


def complete(study: Study, command: str) -> bool:
    """Whether `TABLES` has all costly tables of a command's answer: not of what samples, nor of motions in time."""
    if in_time(study, command):
        return False
    return command != "reliability" or (
        study.reliability is not None and set(study.reliability.methods) == {"analytic"}
    )


def shared(study: Study, command: str, names: Collection[str]) -> bool:
    """Whether designs that differ in parameters or places share one mechanism and one set of sections.

    They do not where a parameter decides the structure of the mechanism; each design is then a study of its own.
    """
    if in_time(study, command) or remeasured(study, names):
        return False
    # The nodes of a workspace follow each design's own boundary, change points its own motion, a spline its own points.
    sections = [section for section in (getattr(study, command), study.kinematics) if section is not None]
    splines = [path for section in sections for path in (section.path or {}).values() if path.spline]
    if any(section.at_nodes for section in sections) or any(path.with_numbers(Amount) is not path for path in splines):
        return False
    return not any(study.mechanism.plan(group.names).change_points for group in study_poses(study, command).groups)


def grouped(
    designs: Designs, command: str, rows: Ints, failed: Callable[[Ints, MechdesignError], None]
) -> Iterator[tuple[Ints, Study, Poses]]:
    """Designs in groups that share a study and have the same number of poses: rows, study and poses of each group.

    `failed` is called with the designs whose numbers make no study or no poses.
    """
    if shared(designs.study, command, designs.changed):
        for some in alike(designs, command, rows):
            try:
                yield some, designs.study, study_poses(designs.study, command, designs.take(some).numbers)
            except MechdesignError as error:
                failed(some, error)
        return
    for k in rows.tolist():
        try:
            study = designs.one(k)
            yield np.array([k]), study, study_poses(study, command)
        except MechdesignError as error:
            failed(np.array([k]), error)


def tables(
    study: Study, command: str, names: Collection[str], poses: Poses, outputs: Collection[str] | None = None,
    requests: Collection[Request] = (),
) -> Stack:  # fmt: skip
    """Answers of a command for the poses of several designs.

    Parameters
    ----------
    names : collection of str
        Names of tables.
    outputs : collection of str, optional
        Of the extremes; all where left out.
    requests : collection of Request
        Columns that are followed between the poses.
    """
    solved: list[SolvedPoses] = []
    along: KinematicAlong | None = None
    if command == "reliability":
        built, reason, solved = reliability.first_order_tables(study, poses, names)
        result = Result(command, built)
    elif command == "stiffness":
        stiff = replace(Stiffness.of(study, poses), names=names)
        held = evaluate(stiff, also=solved.append)
        result, reason = Result(command, _followed(stiff.chosen(held, names), stiff.along(requests))), held.reason
    else:
        question = (Kinematics if command == "kinematics" else Dynamics).of(study, poses)
        values = evaluate(question, also=solved.append)
        built, along = question.chosen(values, names, outputs, requests, solved)
        result = Result(command, _followed(built, along), absent=question.absent)
        reason = values.reason
    whole = np.ones(poses.designs, dtype=bool) if along is None else along.whole | along.curve.spent
    return Stack(result, reason.reshape(poses.designs, -1), whole, solved)


def _followed(tables: Mapping[str, Table], along: AlongMotion | None) -> dict[str, Table]:
    """Tables of which those with a row a pose are followed along the motions."""
    scope = Scope(follow=None if along is None else partial(courses_of, along))
    return {name: replace(table, scope=scope) if name in A_ROW_A_POSE else table for name, table in tables.items()}


@one_thread()
def at_poses(study: Study, command: str, poses: Poses) -> list[DesignGroup]:
    """Answers for the poses of several designs, each as if it were asked alone, without pictures.

    The poses are solved together: their arrays are held as a whole. A design without a valid pose has an error.
    """
    return [*answer(TOGETHER[command](study, poses))]


def answers(designs: Designs, command: str) -> list[DesignGroup]:
    """A command's answers for designs, in groups of one kind; a design that has none has its error."""
    answered: list[DesignGroup] = []
    if designs.count > 1 and command in TOGETHER and shared(designs.study, command, designs.changed):
        # Where a group has an error, its designs are answered one by one.
        for rows, study, poses in grouped(designs, command, np.arange(designs.count), lambda *_: None):
            with suppress(MechdesignError):
                groups = at_poses(study, command, poses)
                answered += [replace(group, rows=rows[group.rows]) for group in groups]
    left = set(range(designs.count)).difference(*(group.rows.tolist() for group in answered))
    return [*answered, *(_alone(designs, k, command) for k in sorted(left))]


def _alone(designs: Designs, k: int, command: str) -> DesignGroup:
    try:
        group = DesignGroup.alone(ask(designs.one(k), command))
    except Exception as error:
        group = DesignGroup.failed(command, error)
    return replace(group, rows=np.array([k]))


def assembly_margins(study: Study, poses: Poses, solved: Iterable[SolvedPoses]) -> Floats:
    """Margins of every pose in parts of the mechanism's size, shape (designs, margins): negative where one is missed.

    They are squares of lengths, or angles in radians, smooth in the dimensions; nan where a group before does not
    assemble. `solved` are the poses as `mechdesign.questions.poses.solve_poses` gives them.
    """
    return np.concatenate([_margins(study.mechanism, part).reshape(poses.designs, -1) for part in solved], axis=1)


def shortfall(margins: Floats) -> Floats:
    """Sum of the missed margins of designs, shape (designs,): each counts from 0 to 1, nan as 1."""
    missed = np.maximum(-margins, 0.0)
    return np.asarray(np.where(np.isnan(missed), 1.0, missed / (1.0 + missed)).sum(axis=1))


def _margins(mechanism: Mechanism, solved: SolvedPoses) -> Floats:
    """Margins of some poses, shape (poses, margins)."""
    configuration, size = solved.configuration, mechanism.size
    margins: list[Value] = [closure / size**2 for closure in configuration.closures]
    if mechanism.plan(solved.names).iterative:
        assembled = (configuration.reason == Reason.OK) | (configuration.reason == Reason.LIMIT)
        margins.append(np.where(assembled, 1.0, -1.0))
    margins += [configuration.slides[slide] / size for slide in sorted(mechanism.graph.telescopic)]
    places = {**mechanism.nominal, **configuration.places}
    margins += [
        margin / bound.scale(size) for bound in mechanism.bounds for _, margin in bound.margins(configuration, places)
    ]
    columns = [np.broadcast_to(np.asarray(margin, dtype=float), configuration.shape) for margin in margins]
    return np.stack(columns, axis=1) if columns else np.empty((*configuration.shape, 0))
