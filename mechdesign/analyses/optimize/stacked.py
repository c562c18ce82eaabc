"""Thousands of designs at once: tables with as many rows of each, and how far their poses are from assembling."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechdesign.analyses.kinematics import analysis as kinematics
from mechdesign.analyses.kinematics.along import Along
from mechdesign.analyses.kinematics.extremes import extremes, targets_table
from mechdesign.analyses.kinematics.loops import loops_table
from mechdesign.analyses.kinematics.motion import Motion, motion_question, move
from mechdesign.analyses.kinematics.targets import followed
from mechdesign.analyses.poses import SolvedPoses, study_poses
from mechdesign.analyses.reliability import analysis as reliability
from mechdesign.analyses.stiffness import analysis as stiffness
from mechdesign.expressions import Expression
from mechdesign.mechanism import Mechanism, Reason
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.four_bars import four_bars
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.results import Result, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses, stacked
from mechdesign.study.text.units import QUANTITY
from mechdesign.study.variants import follows

_OF_MOTION: Mapping[str, Callable[[Motion], Table]] = {
    "motion": kinematics.motion_table,
    "jacobian": kinematics.jacobian_table,
    "instant_centres": kinematics.centres_table,
}
TABLES: Mapping[str, Collection[str]] = {
    "kinematics": (*_OF_MOTION, "extremes", "loops", "targets"),
    "stiffness": ("stiffness", "compliance", "deflections"),
    "reliability": ("moments", "reliability", "capability", "contributions"),
}
# Sections beside a command's own whose numbers it reads.
ALSO_READ: Mapping[str, Collection[str]] = {
    "kinematics": ("workspace",), "stiffness": ("kinematics",), "reliability": ("kinematics", "stiffness"),
}  # fmt: skip


class Stack(NamedTuple):
    """Tables of some designs.

    Parameters
    ----------
    reason : int8 array, shape (designs, poses)
        See `mechdesign.mechanism.Reason`.
    whole : bool array, shape (designs,)
        Whether the motion has no gap between the poses, as far as they are those of one.
    along : Along, optional
        The motions of the designs between their poses.
    solved : list of SolvedPoses
        The poses, where the command solves them as they are; else empty.
    """

    result: Result
    reason: NDArray[np.int8]
    whole: Flags
    along: Along | None
    solved: list[SolvedPoses]


def possible(study: Study, command: str, names: Collection[str]) -> bool:
    """Whether a command's answers for designs that differ in parameters or places are found at once.

    They are not where more than the geometry of the poses depends on them.
    """
    mechanism, section = study.mechanism, getattr(study, command)
    graph, joints, links = mechanism.graph, mechanism.description.joints, mechanism.description.links
    places = study.parameters.moved_places(names)
    if follows(_without_poses(study), names, (command, *ALSO_READ[command])):
        return False
    # Angles of slides and clamps in a ring may contradict each other, which is found design by design.
    turned = any(place.rpartition(".")[0] in joints or place.endswith((".x", ".y")) for place in places)
    if turned and len(graph.ties) > len(graph.bodies) - graph.classes:
        return False
    asked_of = [each for each in (section, study.kinematics) if each is not None]
    # Without poses the drive moves between its limits.
    given = any(each.poses or each.sweep or each.path for each in asked_of)
    if not given and any(place.startswith("limits.") for place in places):
        return False
    # The nodes of a workspace follow each design's own boundary, change points its own motion.
    if any(each.at_nodes for each in asked_of) or any(
        mechanism.plan(group.names).change_points for group in study_poses(study, command).groups
    ):
        return False
    if command == "reliability" and not _first_order(study, names):
        return False
    # The order of the points along an elastic link is found once; loads deflect what is made, too.
    elastic = study.stiffness.elastic if command != "kinematics" and study.stiffness is not None else ()
    bent = tuple(f"{name}." for name in elastic if len(links[name].points) > 2)
    return not any(place.startswith(bent) for place in places)


def _without_poses(study: Study) -> Study:
    """The study without its listed poses, whose numbers may differ from design to design."""
    resolved = dict(study.resolved)
    for name, part in resolved.items():
        if isinstance(part, dict) and part.get("poses", "workspace") != "workspace":
            resolved[name] = {key: value for key, value in part.items() if key != "poses"}
    return dataclasses.replace(study, resolved=resolved)


def _first_order(study: Study, names: Collection[str]) -> bool:
    """Whether only the first order is asked, and what a source moves does not depend on parameters or places."""
    section = study.reliability
    if section is None or set(section.methods) != {"analytic"}:
        return False
    reached = {name for name in section.dimensions if name in study.parameters.nominal}
    for name, formula in {**study.parameters.formulas, **study.parameters.dependent}.items():
        if formula.names & reached:
            if not formula.is_linear() or name in names:
                return False
            reached.add(name)
    return True


def poses_of(
    study: Study, command: str
) -> Callable[[int, Mapping[str, ArrayLike], Mapping[str, ArrayLike]], Poses]:  # fmt: skip
    """A function of a number of designs and their places and parameters, of shape (designs,), to a command's poses."""
    one, formulas = study_poses(study, command), _formulas(study, command)

    def of(designs: int, places: Mapping[str, ArrayLike], parameters: Mapping[str, ArrayLike]) -> Poses:
        poses = stacked(one, designs, places, parameters)
        values: Mapping[str, Any] = {**study.parameters.nominal, **parameters}
        for group in poses.groups if formulas else ():
            which = group.rows.reshape(designs, -1)[0]
            for column, k in enumerate(which.tolist()):
                for name in group.names:
                    if (k, name) in formulas:
                        group.values[name].reshape(designs, -1)[:, column] = formulas[k, name].evaluate(values)
        return poses

    return of


def _formulas(study: Study, command: str) -> Mapping[tuple[int, str], Expression]:
    """Expressions of a command's listed poses, by the pose's number and the coordinate."""
    for name in dict.fromkeys((command, "kinematics")):
        section = getattr(study, name)
        if section is not None and section.poses:
            given = enumerate(study.resolved[name]["poses"])
            texts = {(k, c): text for k, pose in given for c, text in pose.items() if isinstance(text, str)}
            factor = study.units.angle_factor
            parsed = {at: Expression.parse(text, factor) for at, text in texts.items() if not QUANTITY.fullmatch(text)}
            return {at: formula for at, formula in parsed.items() if formula.names}
        if section is not None and (section.sweep or section.path):
            break
    return {}


def tables(
    study: Study, command: str, wanted: Collection[str], poses: Poses, outputs: Collection[str] | None = None,
    columns: Collection[str] = (),
) -> Stack:  # fmt: skip
    """Answers of a command for the poses of several designs.

    Parameters
    ----------
    wanted : collection of str
        Names of tables.
    outputs : collection of str, optional
        Of the extremes; all where left out.
    columns : collection of str
        Others that are followed between the poses.
    """
    solved: list[SolvedPoses] = []
    absent: Mapping[str, str] = {}
    along = None
    if command == "kinematics":
        motion = move(dataclasses.replace(motion_question(study), poses=poses), also=solved.append)
        question, absent = motion.question, motion.question.absent
        known = {"motion": True, "jacobian": question.square, "instant_centres": bool(question.centres)}
        found = {name: make(motion) for name, make in _OF_MOTION.items() if name in wanted and known[name]}
        loops = four_bars(study.mechanism) if "loops" in wanted else ()
        errors = [name for name, _ in followed(study, poses)] if "targets" in wanted else []
        along = kinematics.along_of(question, outputs, loops, also=[*columns, *errors])
        if "extremes" in wanted:
            found["extremes"] = extremes(motion, along, outputs)
        if loops:
            found["loops"] = loops_table(question, loops, along)
        if motion.errors and "targets" in wanted:
            found["targets"] = targets_table(motion, along)
        reason = motion.reason
    elif command == "reliability":
        found, reason = reliability.first_order_tables(study, poses, wanted)
    else:
        body = stiffness.ask(study)
        held = stiffness.solve(study, body, poses)
        found, reason = stiffness.tables(study, body, poses, held), held.reason
        found = {name: table for name, table in found.items() if name in TABLES[command]}
    whole = np.ones(poses.designs, dtype=bool) if along is None else along.whole | along.curve.spent
    return Stack(Result(command, found, absent=absent), reason.reshape(poses.designs, -1), whole, along, solved)


def assembly_margins(study: Study, poses: Poses, solved: Iterable[SolvedPoses]) -> Floats:
    """Margins of every pose in parts of the mechanism's size, shape (designs, margins): negative where one is missed.

    Squares of lengths and angles in radians, smooth in the dimensions; nan where what comes before does not assemble.
    `solved` are the poses as `mechdesign.analyses.poses.solve_poses` gives them.
    """
    return np.concatenate([_margins(study.mechanism, each).reshape(poses.designs, -1) for each in solved], axis=1)


def shortfall(margins: Floats) -> Floats:
    """By how much designs miss their margins together, shape (designs,): each counts from 0 to 1, nan as 1."""
    missed = np.maximum(-margins, 0.0)
    return np.asarray(np.where(np.isnan(missed), 1.0, missed / (1.0 + missed)).sum(axis=1))


def _margins(mechanism: Mechanism, solved: SolvedPoses) -> Floats:
    """Margins of some poses, shape (poses, margins)."""
    configuration, size = solved.configuration, mechanism.size
    found: list[Value] = [closure / size**2 for closure in configuration.closures]
    if mechanism.plan(solved.given).iterative:
        assembled = (configuration.reason == Reason.OK) | (configuration.reason == Reason.LIMIT)
        found.append(np.where(assembled, 1.0, -1.0))
    found += [configuration.slides[slide] / size for slide in sorted(mechanism.graph.telescopic)]
    places = {**mechanism.nominal, **configuration.places}
    with np.errstate(all="ignore"):
        found += [
            margin / bound.scale(size)
            for bound in mechanism.bounds
            for _, margin in bound.margins(configuration, places)
        ]
    columns = [np.broadcast_to(np.asarray(each, dtype=float), configuration.shape) for each in found]
    return np.stack(columns, axis=1) if columns else np.empty((*configuration.shape, 0))
