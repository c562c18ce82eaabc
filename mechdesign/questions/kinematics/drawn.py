"""What pictures of a motion need besides its tables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar, Self

import numpy as np

from mechdesign.ground.columns import Column
from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.ground.results import Drawn, Table
from mechdesign.mechanism.derivatives import STALLED, regularity
from mechdesign.mechanism.outputs import first
from mechdesign.motion.finer import asked_at, extremes_of, finer, together
from mechdesign.motion.motion import SolvedPoses
from mechdesign.motion.question import PoseValues
from mechdesign.questions.kinematics import targets
from mechdesign.questions.kinematics.along import KinematicAlong
from mechdesign.questions.kinematics.limits import LimitPlace
from mechdesign.questions.kinematics.loops import Toggle
from mechdesign.questions.kinematics.rates import moving_at
from mechdesign.questions.kinematics.special_poses import SpecialPoses, special_poses
from mechdesign.questions.outputs import default_outputs, expand_outputs
from mechdesign.questions.poses import Shown

# What a vector is of, the point or the places (n,) where it is, and its values (n,), nan where it has none.
Vector = tuple[str, str | Complexes, Complexes]


@dataclass(frozen=True, eq=False)
class DrawnVectors:
    """Vectors of one kind, such as velocities, at places of a mechanism in n poses.

    Parameters
    ----------
    kind : str
        What they are.
    unit : str
        Of their sizes; kinds of one unit are drawn to one scale.
    """

    kind: str
    unit: str
    arrows: Sequence[Vector]


@dataclass(frozen=True, eq=False)
class DrawnPoses(Drawn):
    """The solved poses of a motion: what pictures need of every question about a mechanism that moves.

    Parameters
    ----------
    shown : Shown
        The solved poses; of a long motion some, evenly spread.
    motion : PoseValues
        The motion with a value of every column at each pose.
    along : KinematicAlong or None
        The motion between its poses; None of listed poses and grids.
    """

    shown: Shown
    motion: PoseValues
    along: KinematicAlong | None
    #: Name of the table with a row a pose.
    name: ClassVar[str] = "motion"

    @cached_property
    def finer(self) -> Self:
        """The motion as curves are drawn: at its poses, its ends and the extremes of its columns, and between."""
        along, shown = self.along, self.shown
        if along is None or along.curve.spent.any():
            return self
        question, poses = along.question, shown.poses
        sizes = {**question.parts, **{name: size for name, (size, _) in question.columns.items()}}
        # Errors of targets that are given pose by pose have no values between them.
        at_poses = {targets.error(output) for output in targets.judged(question.study)} - question.errors.keys()
        sizes = {name: size for name, size in sizes.items() if name not in at_poses}

        def columns(motion: PoseValues) -> dict[str, Floats]:
            valid, arrays = motion.valid, motion.arrays
            return {name: np.where(valid, arrays[name], np.nan) for name in sizes if name in arrays}

        # Parts of a force are drawn by its size, whose extremes are known.
        followed = [name for name in sizes if name in along.columns or not name.endswith(".moment")]
        rows = together(poses.numbers[shown.rows], extremes_of(along))
        return self._of(*finer(question, along.curve, rows, self.motion, columns, sizes, followed))

    def at(self, places: Floats) -> Self:
        """The motion at places, in rows; without errors of targets that are given pose by pose."""
        assert self.along is not None
        return self._of(*asked_at(self.along.question, self.along.curve, places))

    def _of(self, there: SolvedPoses, motion: PoseValues) -> Self:
        shown = replace(self.shown, poses=there.poses, rows=there.rows, configuration=there.configuration)
        return replace(self, motion=motion, shown=shown)

    def rows_of(self, table: Table, whole: DrawnPoses) -> Table:
        """A table of the whole motion with its rows at these poses, those of the study as they stand in it.

        An error of a target that is given pose by pose is drawn straight between these.
        """
        if self is whole:
            return table
        solved = self.motion.question.a_row_a_pose[table.name](self.motion)
        rows, places = whole.shown.rows, self.shown.poses.numbers
        numbers, columns = whole.shown.poses.numbers[rows], list[Column]()
        at_rows = np.searchsorted(places, numbers)
        for column in table.columns:
            own = column.values[rows]
            values = np.array(solved[column.name] if column.name in solved else np.interp(places, numbers, own))
            values[at_rows] = own
            columns.append(replace(column, values=values))
        return replace(table, columns=tuple(columns))

    def vectors(self, motion: PoseValues, shown: Shown) -> Iterable[DrawnVectors]:
        """Vectors at shown poses of a motion of this question: velocities of the points, where there are rates."""
        question, configuration = motion.question, shown.configuration
        if not question.section.rated:
            return
        study = question.study
        linear = study.mechanism.linearize(configuration)
        velocity = moving_at(question.section, shown.solved, linear).velocity
        assert velocity is not None
        regular = configuration.valid & (regularity(linear) >= STALLED)
        arrows = []
        for point in default_outputs(study.mechanism):
            if study.mechanism.graph.is_point(point):
                x, y = (first(configuration, coordinate, velocity) for coordinate in expand_outputs(study, (point,)))
                arrows.append((point, point, np.where(regular, x + 1j * y, np.nan)))
        yield DrawnVectors("velocity", study.units.label("velocity"), arrows)


@dataclass(frozen=True, eq=False)
class DrawnMotion(DrawnPoses):
    """The solved poses of a motion, and what makes some of them special.

    Parameters
    ----------
    limits, toggles : sequence of LimitPlace and of Toggle
        Ends of the motion, and poses at which two links come into line.
    modes : mapping of str to Shown
        The same poses in each assembly of the links that has a valid one, by its name; empty unless all were asked for.
    """

    limits: Sequence[LimitPlace]
    toggles: Sequence[Toggle]
    modes: Mapping[str, Shown] = field(default_factory=dict)

    @cached_property
    def special(self) -> SpecialPoses:
        """Limits and toggles, with poses between where these are few; else the listed poses."""
        return special_poses(self.motion, self.shown, self.along, self.limits, self.toggles)
