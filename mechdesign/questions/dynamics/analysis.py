"""What drives it, what does it bear? Efforts of the drives, joint forces, shaking forces and energies of a motion.

The motion is that of `mechdesign.questions.kinematics`, whose passage over the poses, and whose functions between them,
carry the forces along.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from mechdesign.cautions import Caution
from mechdesign.errors import AssemblyError, counted
from mechdesign.mechanism.derivatives import STALLED
from mechdesign.mechanism.graph import GROUND
from mechdesign.numerics.arrays import Flags
from mechdesign.progress import NULL, Progress
from mechdesign.questions.dynamics import lift_off
from mechdesign.questions.dynamics.assumed import assumed
from mechdesign.questions.dynamics.forward import forward
from mechdesign.questions.dynamics.free_bodies import actions_on
from mechdesign.questions.dynamics.further import further_tables
from mechdesign.questions.dynamics.question import force_question
from mechdesign.questions.dynamics.schema import EFFICIENCIES
from mechdesign.questions.dynamics.tables import dynamics_table, extremes_table, joint_table, question_of
from mechdesign.questions.kinematics.along import Along, along_of
from mechdesign.questions.kinematics.cams import beyond_profile, outside
from mechdesign.questions.kinematics.courses import Courses
from mechdesign.questions.kinematics.drawn import DrawnPoses, Vector, Vectors
from mechdesign.questions.kinematics.motion import Motion
from mechdesign.questions.kinematics.passage import Passage, pass_over
from mechdesign.questions.kinematics.question import MotionQuestion
from mechdesign.questions.kinematics.velocity_jumps import jumps_in_words, velocity_jumps
from mechdesign.questions.poses import Shown, invalid_in_words, judge_failures, solve_rows, study_poses
from mechdesign.questions.together import Answers, End, Group
from mechdesign.results import Result, Scope, Table
from mechdesign.statistics import Request
from mechdesign.study import Study
from mechdesign.study.poses import Poses
from mechdesign.work.threads import one_thread

# Tables with a row a pose, or several.
A_ROW_A_POSE = {"dynamics": dynamics_table, "joint_forces": joint_table}
TABLES = (*A_ROW_A_POSE, "extremes")
# Before the name of a cam: the poses in which its follower lifts off.
_LIFTED = "lifted off "


@dataclass(frozen=True, eq=False)
class DrawnForces(DrawnPoses):
    """The solved poses of a motion, and what acts on the mechanism in them."""

    name: ClassVar[str] = "dynamics"

    def table(self, motion: Motion) -> Table:
        """``dynamics.csv``."""
        return dynamics_table(motion)

    def vectors(self, motion: Motion, shown: Shown) -> Iterator[Vectors]:
        """Velocities, and forces by what exerts them.

        A joint's force is that on its first body. The shaking force stands in the middle of the ground's points.
        """
        yield from super().vectors(motion, shown)
        unit, forces = question_of(motion).study.units.label("force"), dict[str, list[Vector]]()
        for action in actions_on(motion, shown):
            if not action.reaction and np.nan_to_num(action.force).any():
                words = action.name if action.kind == action.name else f"{action.name} on {action.link or 'the pin'}"
                forces.setdefault(action.kind, []).append((words, action.place, action.force))
        x, y = (motion.arrays[f"shaking.{axis}"][shown.rows] for axis in "xy")
        frame = [point for owner, point in shown.configuration.graph.points if owner == GROUND and ":" not in point]
        place = sum(shown.configuration.point(point) for point in frame) / len(frame) if frame else 0j
        forces["shaking"] = [("on the frame", np.broadcast_to(place, shown.rows.shape), x + 1j * y)]
        yield from (Vectors(kind, unit, vectors) for kind, vectors in forces.items())


@one_thread()
def dynamics(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Result:
    """Efforts and forces at every pose of the study's dynamics; see `mechdesign.dynamics`."""
    if study.dynamics is not None and study.dynamics.forward is not None:
        course, motion, shown = forward(study, progress)
        return replace(course, drawn=DrawnForces(shown, motion, None))
    poses = study_poses(study, "dynamics")
    progress.start(poses.count, "poses")
    passage = pass_over(force_question(study, poses), _marks, progress, jobs)
    result = _group(passage).of(0)
    if isinstance(result, Exception):
        raise result
    if not passage.long:
        return result
    long = {name: passage.table(make, jobs, result.tables[name].scope) for name, make in A_ROW_A_POSE.items()}
    return replace(result, tables={**result.tables, **long})


@one_thread()
def answers(study: Study, poses: Poses) -> Answers:
    """Answer `dynamics` for the poses of several designs, each as if it were asked alone, without pictures."""
    return Answers([_group(pass_over(force_question(study, poses), _marks, NULL, 1))])


def _marks(motion: Motion) -> Mapping[str, Flags]:
    """Poses of which something is to be said: where the drives hold the mechanism no longer, or a load is nan."""
    (effort, *_) = (static.name for static in question_of(motion).statics)
    unknown = ~np.isfinite(sum(motion.arrays[name] for name in (effort, "shaking", "shaking_moment")))
    regular = motion.arrays["conditioning"] >= STALLED
    marks: dict[str, Flags] = {}
    if (friction := question_of(motion).friction) is not None:
        marks = {name: motion.valid & where for name, where in friction.marks(motion.arrays).items()}
        unknown &= ~friction.jammed(motion.arrays)
    singular, undefined = motion.valid & unknown & ~regular, motion.valid & unknown & regular
    return {"singular": singular, "undefined": undefined, **marks, **outside(motion)} | {
        f"{_LIFTED}{coupling}": where for coupling, where in lift_off.lifted(motion)
    }  # fmt: skip


def tables(
    motion: Motion, question: MotionQuestion, chosen: Collection[str], outputs: Collection[str] | None = None,
    requests: Collection[Request] = (),
) -> tuple[dict[str, Table], Along | None]:  # fmt: skip
    """Some tables of a motion, and the motion between its poses, which is that of the question.

    Of the extremes those of some `outputs`, or all; the columns of `requests` are followed besides.
    """
    names = [static.name for static in question_of(motion).statics if outputs is None or static.name in outputs]
    followed = [name for name in names if name not in EFFICIENCIES]
    integrals = [Request(name, integral=True) for name in followed] if "extremes" in chosen else []
    friction = question_of(motion).friction
    # Towards a pose in which the mechanism jams forces grow without end: nothing is said between the poses.
    jams = friction is not None and bool(friction.jammed(motion.arrays).any())
    along = None if jams else along_of(question, followed, requests=[*requests, *integrals])
    parts = {name: make(motion) for name, make in A_ROW_A_POSE.items() if name in chosen}
    if "extremes" in chosen:
        parts["extremes"] = extremes_table(motion, along, names)
    return parts, along


def _group(passage: Passage) -> Group:
    """The answers of all designs."""
    question, poses = passage.question, passage.question.poses
    normals = [Request(name, end=-1) for name in lift_off.contacts(question_of(passage.motion)).values()]
    answers, along = tables(passage.motion, question, TABLES, requests=normals)
    further, warnings = further_tables(passage.motion, along)
    answers |= further
    closely = along is not None and not along.functions.unresolved.any()
    ends = [_end(passage, along, k) for k in range(poses.designs)]
    whole = Scope(not closely, ends[0].missing if poses.designs == 1 else "")
    # Between poses of which one jams nothing is said.
    a_pose = whole if along is None else replace(whole, follow=Courses(question))
    scopes = {**dict.fromkeys(A_ROW_A_POSE, a_pose), "modes": replace(whole, poses_only=True)}
    scoped = {name: replace(table, scope=scopes.get(name, whole)) for name, table in answers.items()}
    result = Result("dynamics", scoped)
    if poses.designs == 1:
        (end,) = ends
        drawn = DrawnForces(passage.shown, passage.motion, along)
        result = replace(result, warnings=[*end.warnings, *warnings], counts=end.counts, failed=end.failed, drawn=drawn)
    return Group(np.arange(poses.designs), result, ends)


def _undefined(study: Study, poses: Poses, row: int) -> str:
    """What leaves the forces at a row without a value: the slope of a coupling, or else a load."""
    configuration = solve_rows(study, poses, np.array([row]))
    for coupling in study.mechanism.couplings:
        function = coupling.function
        if function.expression is not None:
            slopes = function.expression.derivatives(configuration.user_values(function)).values()
            if not all(np.isfinite(slope).all() for slope in slopes):
                return f"the slope of coupling '{coupling.name}' is infinite"
    return "an expression of the loads has no value"


def _end(passage: Passage, along: Along | None, k: int) -> End:
    """How design `k` was answered."""
    poses, study = passage.question.poses, passage.question.study
    count = poses.count // poses.designs
    reason = passage.reason.reshape(poses.designs, -1)[k]
    counts = {"poses": count, "invalid": int(np.count_nonzero(reason))}
    try:
        warnings, failed = judge_failures(study, poses, reason, k * count, "dynamics")
    except AssemblyError as error:
        return End(counts=counts, error=error)
    mark = passage.marks[k]["singular"]
    if mark.number:
        warnings.append(Caution(
            "singular", f"{mark.number} of {count} poses are singular: the drives hold the mechanism no longer, and "
            "efforts and joint forces are nan there", "dynamics", mark.first,
        ))  # fmt: skip
    mark = passage.marks[k]["undefined"]
    if mark.number:
        message = f"{_undefined(study, poses, mark.first)} at {mark.number} of {count} poses: forces are nan there"
        warnings.append(Caution("undefined", message, "dynamics", mark.first))
    warnings += beyond_profile(study, poses, passage.marks[k], "dynamics", k)
    for name, mark in passage.marks[k].items():
        coupling = name.removeprefix(_LIFTED)
        if name.startswith(_LIFTED) and mark.number:
            warnings.append(lift_off.caution(study, poses, coupling, mark, k))
        elif name.startswith(_LIFTED) and along is not None:
            warnings += lift_off.between(question_of(passage.motion), along, coupling, k)
    friction = question_of(passage.motion).friction
    if friction is not None:
        warnings += friction.cautions(study, poses, passage.marks[k], "dynamics")
    missing = [invalid_in_words(study, reason), along.missing(k) if along is not None else ""]
    jumps = velocity_jumps(passage.question, study.mechanism.description.masses, k)
    if len(jumps):
        warnings.append(jumps_in_words(passage.question, jumps, "dynamics", k))
        missing.append(f"the impulses of {counted(len(jumps), 'velocity jump')} are missing")
    if chains := ", ".join(_open_moments(passage.motion, slice(k * count, (k + 1) * count))):
        settled = "beams or bearings with 'moment' in 'stiffness' settle it"
        if friction is not None:
            settled = "with friction they do not follow from 'stiffness' either"
        shares = "equilibrium leaves open how a chain of slides and clamps shares them"
        message = f"moments of {chains} are nan: {shares}; {settled}"
        warnings.append(Caution("undefined", message, "joint_forces"))
    warnings += assumed(study)
    return End(warnings, failed, " and ".join(filter(None, missing)), counts)


def _open_moments(motion: Motion, rows: slice) -> list[str]:
    """Joints whose moment neither equilibrium nor elasticity determines where their force is known."""
    question, arrays = question_of(motion), motion.arrays
    joints = question.joints
    return sorted({
        contact.joint for name, contact in zip(question.forces, joints.contacts, strict=True)
        if contact.joint in joints.open
        and (np.isnan(arrays[f"{name}.moment"][rows]) & np.isfinite(arrays[f"{name}.fx"][rows])).any()
    })  # fmt: skip
