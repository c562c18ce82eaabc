"""What drives it, what does it bear? Efforts of the drives, joint forces, shaking forces and energies of a motion.

The motion is that of `mechdesign.questions.kinematics`, whose functions between the poses carry the forces along.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple

import numpy as np

from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import counted
from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.ground.progress import NULL, Progress
from mechdesign.ground.results import Result, Table
from mechdesign.ground.statistics import Request
from mechdesign.ground.work.threads import one_thread
from mechdesign.mechanism.derivatives import STALLED
from mechdesign.mechanism.graph import GROUND
from mechdesign.motion.answer import alone
from mechdesign.motion.ends import Change
from mechdesign.motion.motion import SolvedPoses
from mechdesign.motion.question import MotionQuestion, Passage, PoseValues, Remark
from mechdesign.motion.solving import solve_rows
from mechdesign.questions.dynamics import lift_off
from mechdesign.questions.dynamics.assumed import assumed
from mechdesign.questions.dynamics.forward import forward
from mechdesign.questions.dynamics.free_bodies import actions_on, body_in_words
from mechdesign.questions.dynamics.further import further_tables
from mechdesign.questions.dynamics.question import DynamicQuestion, ForceQuestion
from mechdesign.questions.dynamics.tables import dynamics_table, extremes_table, joint_table
from mechdesign.questions.kinematics.along import KinematicAlong, along_of
from mechdesign.questions.kinematics.cams import outside
from mechdesign.questions.kinematics.drawn import DrawnPoses, DrawnVectors, Vector
from mechdesign.questions.kinematics.limits import LimitPlace, interruptions, limits_of
from mechdesign.questions.kinematics.velocity_jumps import jumps_in_words, velocity_jumps
from mechdesign.questions.poses import Shown, shown_of, study_poses
from mechdesign.study import Study
from mechdesign.study.schema.loads import EFFICIENCIES

# Tables with a row a pose, or several.
A_ROW_A_POSE = {"dynamics": dynamics_table, "joint_forces": joint_table}
TABLES = (*A_ROW_A_POSE, "extremes")
_SINGULAR = Remark(
    "singular",
    "{number} of {count} poses are singular: the drives hold the mechanism no longer, and efforts and joint forces are "
    "nan there",
    first=False,
)  # fmt: skip
_UNDEFINED = Remark("undefined", "")  # whose sentence depends on what has no value in the first pose


@dataclass(frozen=True, eq=False)
class DrawnForces(DrawnPoses):
    """The solved poses of a motion, and what acts on the mechanism in them."""

    name: ClassVar[str] = "dynamics"

    def vectors(self, motion: PoseValues, shown: Shown) -> Iterator[DrawnVectors]:
        """Velocities, and forces by what exerts them.

        A joint's force is that on its first body. The shaking force stands in the middle of the ground's points.
        """
        yield from super().vectors(motion, shown)
        unit, forces = motion.question.study.units.label("force"), dict[str, list[Vector]]()
        for action in actions_on(motion, shown):
            if not action.reaction and np.nan_to_num(action.force).any():
                words = action.name if action.kind == action.name else f"{action.name} on {body_in_words(action.link)}"
                forces.setdefault(action.kind, []).append((words, action.place, action.force))
        x, y = (motion.arrays[f"shaking.{axis}"][shown.rows] for axis in "xy")
        frame = [point for owner, point in shown.configuration.graph.points if owner == GROUND and ":" not in point]
        place = sum(shown.configuration.point(point) for point in frame) / len(frame) if frame else 0j
        forces["shaking"] = [("on the frame", np.broadcast_to(place, shown.rows.shape), x + 1j * y)]
        yield from (DrawnVectors(kind, unit, vectors) for kind, vectors in forces.items())


class Between(NamedTuple):
    """All tables, warnings about what follows from the forces, and where motions end, are singular or may part."""

    tables: Mapping[str, Table]
    warnings: Sequence[Caution]
    limits: Sequence[LimitPlace] = ()
    changes: Sequence[Change] = ()


class Dynamics(DynamicQuestion, MotionQuestion):
    """What drives it, what does it bear?"""

    command: ClassVar[str] = "dynamics"
    lead: ClassVar[str] = "dynamics"
    a_row_a_pose: ClassVar = A_ROW_A_POSE
    poses_only: ClassVar[Sequence[str]] = ("modes",)

    def marks(self, values: PoseValues) -> Mapping[Remark, Flags]:
        """Poses of which something is to be said: where the drives hold it no longer, or a load is nan."""
        (effort, *_) = (static.name for static in self.statics)
        unknown = ~np.isfinite(sum(values.arrays[name] for name in (effort, "shaking", "shaking_moment")))
        regular = values.arrays["conditioning"] >= STALLED
        marks = dict[Remark, Flags]()
        if (friction := self.acting.friction) is not None:
            marks = {remark: values.valid & where for remark, where in friction.marks(values.arrays).items()}
            unknown &= ~friction.jammed(values.arrays)
        singular, undefined = values.valid & unknown & ~regular, values.valid & unknown & regular
        lifted = {remark: where for _, remark, where in lift_off.lifted(values)}
        return {_SINGULAR: singular, _UNDEFINED: undefined, **dict(outside(values)), **lifted, **marks}

    def along(self, requests: Collection[Request]) -> KinematicAlong | None:
        return along_of(self, (), requests=requests)

    def chosen(
        self, values: PoseValues, names: Collection[str], outputs: Collection[str] | None = None,
        requests: Collection[Request] = (), solved: Sequence[SolvedPoses] = (), passages: bool = False,
    ) -> tuple[dict[str, Table], KinematicAlong | None]:  # fmt: skip
        """Some tables, and the motions between their poses with the columns of `requests` besides.

        Of the extremes those of some `outputs`, or all.
        """
        extremes = [static.name for static in self.statics if outputs is None or static.name in outputs]
        followed = [name for name in extremes if name not in EFFICIENCIES]
        integrals = [Request(name, integral=True) for name in followed] if "extremes" in names else []
        # Towards a pose in which the mechanism jams forces grow without end: nothing is said between the poses.
        jams = self.acting.friction is not None and bool(self.acting.friction.jammed(values.arrays).any())
        along = None if jams else along_of(self, followed, requests=[*requests, *integrals], passages=passages)
        tables = {name: make(values) for name, make in A_ROW_A_POSE.items() if name in names}
        if "extremes" in names:
            tables["extremes"] = extremes_table(values, along, extremes)
        return tables, along

    def between(self, passage: Passage) -> tuple[KinematicAlong | None, Between]:
        normals = [Request(name, end=-1) for name in lift_off.contacts(self.acting).values()]
        tables, along = self.chosen(passage.values, (*A_ROW_A_POSE, "extremes"), requests=normals, passages=True)
        further, warnings = further_tables(passage.values, along)
        between = Between({**tables, **further}, warnings)
        if along is not None:
            between = between._replace(limits=limits_of(along), changes=along.ends.changes())
        return along, between

    def tables(self, passage: Passage) -> Mapping[str, Table]:
        between: Between = passage.between
        return between.tables

    def say(self, passage: Passage, design: int) -> tuple[list[Caution], list[str]]:
        poses, study, marks = self.poses, self.study, passage.marks[design]
        count, friction, gaps = poses.count // poses.designs, self.acting.friction, list[str]()
        between: Between = passage.between
        warnings = passage.cautions(design)
        if passage.along is not None:
            valid = passage.reason.reshape(poses.designs, -1)[design] == 0
            warnings += interruptions(between.limits, between.changes, passage.along, design, valid)
        if (mark := marks[_UNDEFINED]).number:
            message = f"{self._undefined(mark.first)} at {mark.number} of {count} poses: forces are nan there"
            warnings.append(Caution("undefined", message, "dynamics", mark.first))
        for coupling, remark, _ in lift_off.lifted(passage.values):
            if passage.along is not None and not marks[remark].number:
                warnings += lift_off.between(self.acting, passage.along, coupling, design)
        jumps = velocity_jumps(self, study.mechanism.description.masses, design)
        if len(jumps):
            warnings.append(jumps_in_words(self, jumps, "dynamics", design))
            gaps.append(f"the impulses of {counted(len(jumps), 'velocity jump')} are missing")
        rows = slice(design * count, (design + 1) * count)
        if chains := ", ".join(_open_moments(self.acting, passage.values.arrays, rows)):
            settled = "beams or bearings with 'moment' in 'stiffness' settle it"
            if friction is not None:
                settled = "with friction they do not follow from 'stiffness' either"
            shares = "equilibrium leaves open how a chain of slides and clamps shares them"
            message = f"moments of {chains} are nan: {shares}; {settled}"
            warnings.append(Caution("undefined", message, "joint_forces"))
        return [*warnings, *assumed(study), *between.warnings], gaps

    def drawn(self, passage: Passage) -> DrawnForces:
        return DrawnForces(shown_of(self.study, passage), passage.values, passage.along)

    def _undefined(self, row: int) -> str:
        """What leaves the forces at a row without a value: the slope of a coupling, or else a load."""
        configuration = solve_rows(self.motion, np.array([row]))
        for coupling in self.motion.mechanism.couplings:
            function = coupling.function
            if function.expression is not None:
                slopes = function.expression.derivatives(configuration.user_values(function)).values()
                if not all(np.isfinite(slope).all() for slope in slopes):
                    return f"the slope of coupling '{coupling.name}' is infinite"
        return "an expression of the loads has no value"


@one_thread()
def dynamics(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Result:
    """Efforts and forces at every pose of the study's dynamics; see `mechdesign.dynamics`."""
    if study.dynamics is not None and study.dynamics.forward is not None:
        course, motion, shown = forward(study, progress)
        return replace(course, drawn=DrawnForces(shown, motion, None))
    return alone(Dynamics.of(study, study_poses(study, "dynamics")), progress, jobs)


def _open_moments(question: ForceQuestion, arrays: Mapping[str, Floats], rows: slice) -> list[str]:
    """Joints whose moment neither equilibrium nor elasticity determines where their force is known."""
    joints = question.joints
    return sorted({
        contact.joint for name, contact in zip(question.forces, joints.contacts, strict=True)
        if contact.joint in joints.open
        and (np.isnan(arrays[f"{name}.moment"][rows]) & np.isfinite(arrays[f"{name}.fx"][rows])).any()
    })  # fmt: skip
