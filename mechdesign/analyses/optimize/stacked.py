"""Tables of thousands of designs at once: as many rows of each, one design after the other."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechdesign.analyses.kinematics import analysis as kinematics
from mechdesign.analyses.kinematics.motion import Motion, motion_question
from mechdesign.analyses.kinematics.moving import move
from mechdesign.analyses.optimize.assembling import assembly_margins
from mechdesign.analyses.poses import SolvedPoses, study_poses
from mechdesign.analyses.reliability import analysis as reliability
from mechdesign.analyses.stiffness import analysis as stiffness
from mechdesign.expressions import Expression, is_linear
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.results import Result, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses, stacked
from mechdesign.study.text.units import QUANTITY
from mechdesign.study.variants import follows, places_of

Formulas = Mapping[tuple[int, str], Expression]

# Poses of all designs that are solved together: their arrays fit the cache.
BLOCK = 65536

_OF_MOTION: Mapping[str, Callable[[Motion], Table]] = {
    "motion": kinematics.motion_table,
    "targets": kinematics.targets_table,
    "jacobian": kinematics.jacobian_table,
}
TABLES: Mapping[str, Collection[str]] = {
    "kinematics": (*_OF_MOTION, "extremes", "loops"),
    "stiffness": ("stiffness", "compliance", "deflections"),
    "reliability": ("moments", "reliability", "contributions"),
}
# Sections whose numbers a command reads.
READ: Mapping[str, Collection[str]] = {
    "kinematics": ("kinematics", "workspace"),
    "stiffness": ("stiffness", "kinematics"),
    "reliability": ("reliability", "kinematics"),
}


@dataclass(frozen=True, eq=False)
class Stack:
    """Tables of some designs.

    Parameters
    ----------
    reason : int8 array, shape (designs, poses)
        See `mechdesign.mechanism.Reason`.
    listed : bool
        Whether a person listed the poses, so that each of them must be valid.
    open : mapping of str to bool array, shape (designs,)
        By table, the designs that it does not answer for.
    assembly_margins : ndarray, shape (designs, margins), or None
        As `assembling.assembly_margins` gives them; None where they were not asked for, or would have to be solved for.
    """

    result: Result
    reason: NDArray[np.int8]
    listed: bool
    open: Mapping[str, Flags]
    assembly_margins: Floats | None = None


def possible(study: Study, command: str, names: Collection[str]) -> bool:
    """Whether a command's answers for designs that differ in parameters or places are found at once.

    They are not where more than the geometry of the poses depends on them.
    """
    mechanism = study.mechanism
    places = places_of(study, names)
    if command not in TABLES or follows(_without_poses(study), names, READ[command]):
        return False
    graph = mechanism.graph
    # Angles of slides and clamps in a ring may contradict each other, which is found design by design.
    if len(graph.ties) > len(graph.bodies) - graph.classes and _turned(study, places):
        return False
    if _poses_from_limits(study, command) and any(place.startswith("limits.") for place in places):
        return False
    if any(s is not None and s.at_nodes for s in (getattr(study, command), study.kinematics)):
        return False  # The nodes follow each design's own boundary.
    if any(mechanism.plan(group.names).change_points for group in study_poses(study, command).groups):
        return False
    if command == "reliability":
        return _first_order(study, names)
    if command == "stiffness" and study.stiffness is not None:
        # The order of the points along an elastic link is found once.
        links = [name for name in study.stiffness.elastic if len(mechanism.description.links[name].points) > 2]
        return not any(place.startswith(f"{link}.") for link in links for place in places)
    return True


def _without_poses(study: Study) -> Study:
    """The study without its listed poses, whose numbers may differ from design to design."""
    return dataclasses.replace(
        study,
        resolved={
            name: {k: v for k, v in part.items() if k != "poses" or v == "workspace"}
            if isinstance(part, dict)
            else part
            for name, part in study.resolved.items()
        },
    )


def formulas_of(study: Study, command: str) -> Formulas:
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


def poses_of(
    study: Study, command: str, designs: int, places: Mapping[str, ArrayLike], parameters: Mapping[str, ArrayLike],
    formulas: Formulas,
) -> Poses:  # fmt: skip
    """Poses of a command for designs whose places and parameters have the given values, of shape (designs,)."""
    one = study_poses(study, command)
    poses = stacked(one, designs, places, parameters)
    values: Mapping[str, Any] = {**study.parameters.nominal, **parameters}
    for group in poses.groups if formulas else ():
        which = group.rows.reshape(designs, -1)[0]
        for column, k in enumerate(which.tolist()):
            for name in group.names:
                if (k, name) in formulas:
                    group.values[name].reshape(designs, -1)[:, column] = formulas[k, name].evaluate(values)
    return poses


def _first_order(study: Study, names: Collection[str]) -> bool:
    """Whether only the first order is asked, and what a source moves does not depend on parameters or places."""
    section = study.reliability
    if section is None or set(section.methods) != {"analytic"}:
        return False
    formulas = {**study.parameters.formulas, **study.parameters.dependent}
    reached = {name for name in section.dimensions if name in study.parameters.nominal}
    for name, formula in formulas.items():
        if formula.names & reached:
            if not is_linear(formula) or name in names:
                return False
            reached.add(name)
    return True


def _turned(study: Study, places: Collection[str]) -> bool:
    """Whether angles of slides and clamps change."""
    joints = study.mechanism.description.joints
    return any(place.rpartition(".")[0] in joints or place.endswith((".x", ".y")) for place in places)


def _poses_from_limits(study: Study, command: str) -> bool:
    """Whether the study gives no poses, and so moves its drive between its limits."""
    sections = [getattr(study, name) for name in dict.fromkeys((command, "kinematics"))]
    return not any(s is not None and (s.poses or s.sweep or s.path) for s in sections)


def size(study: Study, command: str) -> int:
    """Number of designs that are solved together."""
    return max(1, BLOCK // study_poses(study, command).count)


def tables(
    study: Study, command: str, wanted: Collection[str], designs: int,
    places: Mapping[str, ArrayLike], parameters: Mapping[str, ArrayLike], outputs: Collection[str] | None = None,
    formulas: Formulas | None = None, *, graded: bool = False,
) -> Stack:  # fmt: skip
    """Answers of a command for designs whose places and parameters have the given values, of shape (designs,).

    Parameters
    ----------
    wanted : collection of str
        Names of tables.
    formulas : mapping, optional
        As `formulas_of` gives them.
    outputs : collection of str, optional
        Of the extremes; all where left out.
    graded : bool
        Whether the assembly margins are wanted, too.
    """
    one = study_poses(study, command)
    poses = poses_of(study, command, designs, places, parameters, formulas or {})
    torn = np.zeros(designs, dtype=bool)
    solved: list[SolvedPoses] = []
    if command == "kinematics":
        found, reason, torn = _motion(study, wanted, poses, outputs, solved.append if graded else None)
    elif command == "reliability":
        found, reason = reliability.first_order_tables(study, poses, wanted)
    else:
        question = stiffness.ask(study)
        held = stiffness.solve(study, question, poses)
        found, reason = stiffness.tables(study, question, poses, held), held.reason
        found = {name: table for name, table in found.items() if name in TABLES[command]}
    reason = reason.reshape(designs, one.count)
    opened = {"loops": torn | reason.any(axis=1), "extremes": torn}
    margins = assembly_margins(study, poses, solved) if solved else None
    return Stack(Result(command, found), reason, one.listed, opened, margins)


def _motion(
    study: Study, wanted: Collection[str], poses: Poses, outputs: Collection[str] | None,
    also: Callable[[SolvedPoses], object] | None,
) -> tuple[dict[str, Table], NDArray[np.int8], Flags]:  # fmt: skip
    """Tables, reasons, and the designs whose motion ends where no limit is known."""
    question = dataclasses.replace(motion_question(study), poses=poses)
    motion = move(question, also=also)
    made = {name: make for name, make in _OF_MOTION.items() if name in wanted}
    if not motion.errors:
        made.pop("targets", None)
    if not question.square:
        made.pop("jacobian", None)
    found = {name: make(motion) for name, make in made.items()}
    between, torn = kinematics.tables_between(motion, (), wanted, outputs)
    return found | between, motion.reason, torn
