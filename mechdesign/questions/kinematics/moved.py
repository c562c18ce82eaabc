"""A question about a mechanism that moves, of kinematics or dynamics: coordinates, rates and regularity at each pose.

At a change point that the motion follows, values are interpolated from poses on both sides.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.mechanism import Reason
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.coordinates import Coordinate, angles_of
from mechdesign.mechanism.derivatives import Linearization, regularity
from mechdesign.mechanism.elements.declared import Quantity
from mechdesign.mechanism.forces import Moving
from mechdesign.motion.motion import Motion, SolvedPoses, in_study_units, radians
from mechdesign.motion.question import PoseQuestion, unfilled
from mechdesign.motion.rows import Poses
from mechdesign.motion.rules import GivenRows
from mechdesign.motion.solving import solve_poses
from mechdesign.questions.kinematics import targets
from mechdesign.questions.kinematics.rates import moving_at
from mechdesign.questions.kinematics.schema import KinematicsSection
from mechdesign.questions.loads import coordinates_in
from mechdesign.study import Study
from mechdesign.study.schema.checker import ORDERS
from mechdesign.study.schema.loads import Load

# Poses with a conditioning below this have lost digits.
NEAR_SINGULAR = 1e-3
# Step of the interpolation at change points (radians, or parts of the mechanism's size): its error is about 1e-12, that
# of accelerations this near to a change point about 1e-10.
CHANGE_POINT_STEP = 1e-2
STENCIL = CHANGE_POINT_STEP * np.array([-3, -2, -1, 1, 2, 3])
STENCIL_WEIGHTS = np.array([1, -6, 15, 15, -6, 1]) / 20
# Whether what a cam follows lies beyond its profile: 1 or 0, by pose; followed by the name of the coupling.
OUTSIDE = "outside of cam "
# Poses at a change point whose values are those of the motion that goes through it.
THROUGH = "through change point"


@dataclass(frozen=True)
class Static:
    """A drive's effort or a mechanical advantage: its column's name and unit, and the kind of column that it is."""

    name: str
    unit: str
    kind: str
    words: Mapping[str, str]  # at the places of the kind
    size: float = 0.0  # least size, by which its rounding is judged
    magnitude: bool = False  # whether it is the size of a vector


# What a section without rates leaves out.
AT_REST: Mapping[str, object] = {"rates": {}, "accelerations": {}, "speed": None, "motion": None}


@dataclass(frozen=True, eq=False)
class MovedQuestion(PoseQuestion):
    """A question about a mechanism that moves.

    Parameters
    ----------
    section : KinematicsSection
        Its rates, and what is asked at each pose.
    whole : Poses
        All poses of the motion, where the question is at some of them.
    watched : sequence of Coordinate
        All coordinates whose values are needed: drives, outputs, those that targets depend on, and the angles in
        expressions of these and of limits.
    inverse : bool
        Whether rates and accelerations are those of the given coordinates rather than of the drives.
    outputs : sequence of Coordinate
        Outputs in the tables: those that the study names, then others that have a target.
    errors : mapping of str to Quantity
        Columns of errors that have values between the poses, too.
    """

    study: Study
    section: KinematicsSection
    motion: Motion
    whole: Poses
    watched: Sequence[Coordinate]
    inverse: bool
    outputs: Sequence[Coordinate] = ()
    errors: Mapping[str, Quantity] = field(default_factory=dict)

    @property
    def divisible(self) -> bool:
        tables = [target.table for target in self.study.targets.values() if target.table is not None]
        return not any(len(table) == self.whole.count for table in tables)

    def at(self, poses: Poses) -> Self:
        return replace(self, motion=self.motion.at(poses), whole=poses if poses.picked is None else self.whole)

    @abstractmethod
    def lean(self, names: Collection[str]) -> Self:
        """The question with nothing but what some columns, and the targets of errors among them, need."""

    def positions(self, solved: SolvedPoses) -> tuple[dict[str, Value], Linearization, Moving]:
        """Coordinates at solved poses, and how far these are from singular; with their loop equations and rates."""
        mechanism, units, configuration = solved.motion.mechanism, solved.motion.units, solved.configuration
        arrays: dict[str, Value] = {
            # As the study gives it, not there and back through radians; also where the pose fails.
            coordinate.name: solved.poses.named[coordinate.name]
            if coordinate.name in solved.names
            else in_study_units(units, coordinate, configuration.value(coordinate))
            for coordinate in self.watched
        }
        for cam in mechanism.cams:
            arrays[f"{OUTSIDE}{cam.coupling}"] = np.asarray(cam.outside(configuration), dtype=float)
        linear = mechanism.linearize(configuration)
        assembled = configuration.valid | np.equal(configuration.reason, int(Reason.LIMIT))
        arrays["conditioning"] = np.where(assembled, regularity(linear), np.nan)
        return arrays, linear, moving_at(self.section, solved, linear)

    @abstractmethod
    def moved(self, solved: SolvedPoses) -> tuple[Mapping[str, Value], Linearization]:
        """What it has at solved poses of a motion, between its poses too; and their loop equations."""

    def values(self, part: SolvedPoses) -> Mapping[str, Floats | Flags]:
        arrays = full(self.moved(part)[0], part.rows.shape)
        smooth = _through_change_points(self, part, arrays)
        line, row = part.poses.places_along
        between = row.dtype.kind == "f"
        rows = (line * self.whole.line + (0 if between else row)).astype(np.intp)
        return {**arrays, THROUGH: smooth, **targets.errors(self.study, self.whole, arrays, rows, between=between)}

    @property
    def drives(self) -> list[Coordinate]:
        """The mechanism's drives."""
        return [self.study.mechanism.coordinate(name) for name in self.study.mechanism.drives]

    @property
    def sizes(self) -> dict[Quantity, float]:
        """What values of a quantity are compared with, in the study's units: the mechanism's size, or a turn."""
        return {"length": self.study.mechanism.size, "angle": 2 * np.pi / self.study.units.angle_factor}

    @property
    def statics(self) -> list[Static]:
        """Columns of forces, and of what goes to infinity where the drives hold the mechanism no longer."""
        return []

    @property
    def loads(self) -> tuple[Load, ...]:
        """The loads that act."""
        return self.section.loads

    @property
    def parts(self) -> Mapping[str, float]:
        """Columns of the forces that are followed where one of them is asked, with their sizes."""
        return {}

    @property
    def orders(self) -> dict[str, tuple[Quantity, int]]:
        """Columns of velocities and accelerations, where the study gives rates: of what quantity, and which order."""
        return {}

    @property
    def rates(self) -> dict[str, str]:
        """Units of the columns of velocities and accelerations."""
        label = self.study.units.label
        return {
            name: label(ORDERS[quantity][order]) if quantity in ORDERS else ""
            for name, (quantity, order) in self.orders.items()
        }

    @property
    def clearances(self) -> list[str]:
        """Columns of clearances."""
        return []

    @cached_property
    def columns(self) -> dict[str, tuple[float, str]]:
        """Columns that have extremes: the size by which rounding is judged, and the unit."""
        sizes, label, rates = self.sizes, self.study.units.label, self.rates
        kinds = {output.name: output.quantity for output in self.outputs}
        kinds |= {targets.error(output): kind for output, kind in targets.judged(self.study).items()}
        columns = {name: (sizes.get(kind, 0.0), label(kind)) for name, kind in kinds.items()}
        columns |= {static.name: (static.size, static.unit) for static in self.statics}
        columns |= {name: (sizes["length"], label("length")) for name in self.clearances}
        for name, (kind, order) in self.orders.items():
            columns[name] = sizes.get(kind, 0.0) * self.tempo**order, rates[name]
        return columns

    @property
    def poled(self) -> list[str]:
        """Columns that go to infinity where nothing is singular."""
        return []

    def pole(self, arrays: Mapping[str, Value], linear: Linearization, column: str) -> Value:
        """What is zero where one of these columns goes to infinity."""
        raise KeyError(column)

    @property
    def passes_singularities(self) -> bool:
        """Whether forces are asked of a motion that may lead through places where the drives hold it no longer.

        There the determinant of the loop equations changes its sign, and the size of a force does not.
        """
        return False

    @property
    def evaluated(self) -> list[Coordinate]:
        """Coordinates that it evaluates, or takes rates of."""
        return [*self.watched, *coordinates_in(self.study, self.loads)]

    @property
    def tempo(self) -> float:
        """About how fast the mechanism moves: radians, or sizes of it, in a unit of time."""
        section, mechanism, size = self.section, self.study.mechanism, self.study.mechanism.size
        units = {"angle": self.study.units.angle_factor, "length": 1 / size}
        tempos = [(section.speed or 0.0) / size]
        for rates, order in ((section.rates, 1), (section.accelerations, 2)):
            tempos += [
                abs(rate * units.get(mechanism.quantity(name), 1.0)) ** (1 / order) for name, rate in rates.items()
            ]
        for order, columns in enumerate(self.poses.rates if section.motion is not None else (), 1):
            tempos += [
                float(np.abs(column).max() * units.get(mechanism.quantity(name), 1.0)) ** (1 / order)
                for name, column in columns.items()
            ]
        return max(tempos)


def _through_change_points(question: MovedQuestion, solved: SolvedPoses, arrays: Mapping[str, Floats]) -> Flags:
    """Set the values at change points of a motion, where the study follows them, shape (poses, ...); returns which.

    Where two assemblies meet, the equations of the velocities have no one solution, and those of the positions half of
    the digits; but the motion that is followed is smooth there. With S_k = f(k h) + f(-k h) from both sides

        f(0) = (15 S_1 - 6 S_2 + S_3) / 20  + O(h^6).
    """
    mechanism, units, poses = solved.motion.mechanism, solved.motion.units, solved.poses
    plan, smooth = mechanism.plan(solved.names), np.zeros(len(solved.rows), dtype=bool)
    near = np.equal(solved.configuration.reason, Reason.OK) & (arrays["conditioning"] < NEAR_SINGULAR)
    if plan.change_points is None or len(question.poses.groups) > 1 or not near.any():
        return smooth
    lanes, (name,), coordinate = np.flatnonzero(near), solved.names, plan.structure.given[0]
    lane = np.repeat(lanes, len(STENCIL))
    steps = in_study_units(units, coordinate, STENCIL * (1.0 if coordinate.quantity == "angle" else mechanism.size))
    values = (poses.named[name][lanes][:, None] + steps).ravel()
    first, second = ({key: column[lane] for key, column in part.items()} for part in poses.rates)
    around = unfilled(question.at(Poses(GivenRows({name: values}, listed=True, derivatives=(first, second)))))
    angles = [(angle, c) for angle, c in angles_of(question.watched).items() if angle != name]
    for part in solve_poses(around.question.motion):
        turns = {angle: radians(units, c, arrays[angle][lane[part.rows]]) for angle, c in angles}
        configuration = replace(part.configuration, near={**part.configuration.near, **turns})
        around.reason[part.rows] = configuration.reason
        around.put(part.rows, full(question.moved(replace(part, configuration=configuration))[0], part.rows.shape))
    good = around.valid.reshape(-1, len(STENCIL)).all(axis=1)
    for column, array in arrays.items():
        if column not in (name, "conditioning"):
            array[lanes[good]] = (around.arrays[column].reshape(-1, len(STENCIL)) @ STENCIL_WEIGHTS)[good]
    smooth[lanes[good]] = True
    return smooth


def full(arrays: Mapping[str, ArrayLike], shape: tuple[int, ...]) -> dict[str, Floats]:
    """Values of their own at each pose."""
    return {name: np.array(np.broadcast_to(np.asarray(values, dtype=float), shape)) for name, values in arrays.items()}


def watched(study: Study, section: KinematicsSection, names: Iterable[str]) -> list[Coordinate]:
    """The drives, some other coordinates, those in the expressions of loads, and the angles in all of them."""
    mechanism = study.mechanism
    loads = [coordinate.name for coordinate in coordinates_in(study, section.loads)]
    own = {name: mechanism.coordinate(name) for name in [*mechanism.drives, *names, *loads]}
    return list((own | angles_of([*own.values(), *mechanism.counting])).values())
