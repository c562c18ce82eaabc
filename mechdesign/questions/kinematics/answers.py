"""What kinematics has of a motion: tables, warnings and pictures, of many designs at once."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mechdesign.ground.cautions import Caution
from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.ground.results import Table
from mechdesign.ground.statistics import Request, no_value_along
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.derivatives import Linearization
from mechdesign.mechanism.four_bars import FourBar, chains, four_bars
from mechdesign.motion.ends import Change
from mechdesign.motion.motion import SolvedPoses
from mechdesign.motion.question import MotionQuestion, Passage, PoseValues, Remark
from mechdesign.questions.kinematics.along import KinematicAlong, along_of
from mechdesign.questions.kinematics.cams import CamSide, cam_table, cautions, profiles
from mechdesign.questions.kinematics.collisions import collision
from mechdesign.questions.kinematics.drawn import DrawnMotion
from mechdesign.questions.kinematics.extremes import extremes, targets_table
from mechdesign.questions.kinematics.limits import LimitPlace, interruptions, limits_of, limits_table
from mechdesign.questions.kinematics.loops import Toggle, loops_table, measured, toggles_of, toggles_table
from mechdesign.questions.kinematics.question import KinematicQuestion
from mechdesign.questions.kinematics.remarks import astray, marks_of, unfollowed, valued, without_value
from mechdesign.questions.kinematics.tables import A_ROW_A_POSE, pose_tables
from mechdesign.questions.kinematics.targets import totals
from mechdesign.questions.kinematics.values import pole_of, values_of
from mechdesign.questions.kinematics.velocity_jumps import jumps_in_words, velocity_jumps
from mechdesign.questions.poses import shown_of

# Tables in the order in which they are shown.
ORDER = ("motion", "extremes", "limits", "loops", "toggles", "targets", "jacobian", "instant_centres", "cam")


@dataclass(frozen=True, eq=False)
class Events:
    """Limits, toggles and change points of motions that can be followed; and the loops and cams of each design."""

    shapes: Sequence[Sequence[FourBar]]
    limits: Sequence[LimitPlace]
    toggles: Sequence[Toggle]
    changes: Sequence[Change]
    cams: Sequence[CamSide]

    @property
    def loops(self) -> Sequence[FourBar]:
        """The loops of all designs, whatever their lengths."""
        return max(self.shapes, key=len)


class Kinematics(KinematicQuestion, MotionQuestion):
    """How does it move?"""

    command: ClassVar[str] = "kinematics"
    lead: ClassVar[str] = "motion"
    a_row_a_pose: ClassVar = A_ROW_A_POSE
    # Rows of a cam are places of its profile.
    poses_only: ClassVar[Sequence[str]] = ("cam",)

    def moved(self, solved: SolvedPoses) -> tuple[dict[str, Value], Linearization]:
        return values_of(self, solved)

    def pole(self, arrays: Mapping[str, Value], linear: Linearization, column: str) -> Value:
        return pole_of(self, arrays, linear, column)

    def marks(self, values: PoseValues) -> Mapping[Remark, Flags]:
        return marks_of(values)

    def totals(self, values: PoseValues) -> Floats:
        return totals(values)

    def along(self, requests: Collection[Request]) -> KinematicAlong | None:
        return along_of(self, (), requests=requests)

    def chosen(
        self, values: PoseValues, names: Collection[str], outputs: Collection[str] | None = None,
        requests: Collection[Request] = (), solved: Sequence[SolvedPoses] = (),
    ) -> tuple[dict[str, Table], KinematicAlong | None]:  # fmt: skip
        """Some tables with as many rows for each design, and the motions between their poses with some columns besides.

        Of the extremes those of some `outputs`, or all; `solved` are the poses, of designs with dimensions.
        """
        mechanism = self.motion.mechanism
        loops = four_bars(mechanism) if "loops" in names else ()
        along = along_of(self, outputs, loops, also=self.errors if "targets" in names else (), requests=requests)
        shapes = measured(mechanism, loops, self.poses, solved)
        return self._tables(values, names, along, loops, shapes, outputs), along

    def _tables(
        self, values: PoseValues, names: Collection[str], along: KinematicAlong | None, loops: Sequence[FourBar],
        shapes: Sequence[Sequence[FourBar]], outputs: Collection[str] | None = None,
    ) -> dict[str, Table]:  # fmt: skip
        """Tables with as many rows for each design; `shapes` are the loops of each."""
        tables = pose_tables(values, names)
        if "extremes" in names:
            tables["extremes"] = extremes(values, along, outputs)
        if loops:
            tables["loops"] = loops_table(self, shapes, loops, along)
        if (self.study.targets or self.study.curves) and "targets" in names:
            tables["targets"] = targets_table(values, along)
        return tables

    def between(self, passage: Passage) -> tuple[KinematicAlong | None, Events]:
        shapes = _shapes(passage)
        loops = max(shapes, key=len)
        along = along_of(self, loops=loops, toggles=True, passages=True)
        cams = profiles(self.study, self.poses)
        if along is None:
            return None, Events(shapes, (), (), (), cams)
        return along, Events(shapes, limits_of(along), toggles_of(loops, along), along.ends.changes(), cams)

    def kinds(self, passage: Passage) -> Sequence[object]:
        """By design which loops it has, and how closely it can be followed."""
        names = [tuple(loop.joints for loop in own) for own in passage.between.shapes]
        if (along := passage.along) is None:
            return names
        spent, unresolved = along.curve.spent.tolist(), along.functions.unresolved.tolist()
        return [*zip(names, spent, unresolved, strict=True)]

    def tables(self, passage: Passage) -> dict[str, Table]:
        between: Events = passage.between
        along, loops = passage.along, between.loops
        tables = self._tables(passage.values, ORDER, along, loops, between.shapes)
        if along is not None:
            tables["limits"] = limits_table(between.limits, along)
        if loops and along is not None:
            tables["toggles"] = toggles_table(between.toggles, along)
        if between.cams:
            tables["cam"] = cam_table(self.study, between.cams)
        return {name: tables[name] for name in ORDER if name in tables}

    def uneven(self, passage: Passage) -> Mapping[str, Sequence[int]]:
        events = {"limits": passage.between.limits, "toggles": passage.between.toggles}
        return {name: [*map(len, _by_line(own, self.poses.designs))] for name, own in events.items()}

    def say(self, passage: Passage, design: int) -> tuple[list[Caution], list[str]]:
        designs, along, between = self.poses.designs, passage.along, passage.between
        own = self if designs == 1 else self.at(self.poses.some(np.array([design])))
        valid = passage.reason.reshape(designs, -1)[design] == 0
        warnings = [*passage.cautions(design), *astray(own)]
        jumps = velocity_jumps(self, self.study.mechanism.description.links, design)
        if len(jumps):
            warnings.append(jumps_in_words(self, jumps, "motion", design))
        if along is None:
            warnings += unfollowed(own.poses)
        else:
            warnings += interruptions(between.limits, between.changes, along, design, valid)
            if along.functions.unresolved.any():
                warnings.append(Caution(
                    "unconverged",
                    "the motion between the poses is too long, or too rough, to be followed closely: its limits are "
                    "known, but extremes may lie between the places that were looked at; sweep less of it",
                    "extremes",
                ))  # fmt: skip
        if along is not None and not along.curve.spent[design]:
            for name in valued(own):
                lost = along.lost(name)[design] if name in along.columns else 0.0
                if lost and not passage.marks[design][without_value(name)].number:
                    words = f"{name} has {no_value_along(lost)}, between its poses"
                    warnings.append(Caution("undefined", words, "motion"))
        warnings += collision(passage.values, along, design, self.study.units.label("length"))
        return [*warnings, *cautions(self.study, between.cams, design)], []

    def drawn(self, passage: Passage) -> DrawnMotion:
        shown, events = shown_of(self.study, passage), passage.between
        return DrawnMotion(shown, passage.values, passage.along, events.limits, events.toggles)


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


def _by_line(events: Sequence[Any], lines: int) -> list[list[Any]]:
    """Events of each design."""
    parts: list[list[Any]] = [[] for _ in range(lines)]
    for one in events:
        parts[one.line].append(one)
    return parts
