"""What a study asks of every pose of a motion: outputs, Jacobian, rates, efforts, targets."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from mechdesign.curve.corners import curve_of
from mechdesign.curve.motion import Curve
from mechdesign.errors import counted
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.cams import Cam
from mechdesign.mechanism.coordinates import Coordinate, angles_of
from mechdesign.mechanism.derivatives import Linearization
from mechdesign.mechanism.forces import Moving
from mechdesign.mechanism.jacobians import mixes
from mechdesign.mechanism.model import Quantity
from mechdesign.mechanism.plates import CLEARANCE, Pair, pairs_of, plate_of
from mechdesign.numerics.arrays import Ints
from mechdesign.questions.dynamics.schema import EFFICIENCIES
from mechdesign.questions.friction import JointFriction
from mechdesign.questions.kinematics.instant_centres import Centre
from mechdesign.questions.kinematics.schema import KinematicsSection
from mechdesign.questions.kinematics.targets import followed, needed
from mechdesign.questions.loads import coordinates_in
from mechdesign.questions.outputs import default_outputs, expand_outputs
from mechdesign.questions.poses import followed_angles
from mechdesign.study import Study
from mechdesign.study.poses import Poses
from mechdesign.study.schema.checker import ORDERS
from mechdesign.study.schema.loads import Load, joints_of

# Columns of a cam behind the name of its coupling, and their kinds of quantity.
CAM_COLUMNS: Mapping[str, Quantity] = {"pressure_angle": "angle", "curvature_radius": "length"}


def characteristic_length(study: Study) -> float | None:
    """Length that turns angles into lengths, from the section of kinematics or workspace."""
    for section in (study.kinematics, study.workspace):
        if section is not None and section.characteristic_length is not None:
            return section.characteristic_length
    return None


@dataclass(frozen=True)
class Static:
    """A drive's effort or a mechanical advantage: its column's name and unit, and the kind of column that it is."""

    name: str
    unit: str
    kind: str
    words: Mapping[str, str]  # at the places of the kind
    size: float = 0.0  # least size, by which its rounding is judged
    magnitude: bool = False  # whether it is the size of a vector


class Borne(Protocol):
    """What is computed of the forces of a motion, besides: its columns, and their values at solved poses."""

    @property
    def statics(self) -> list[Static]:
        """The columns."""
        ...

    @property
    def loads(self) -> tuple[Load, ...]:
        """The loads that it bears."""
        ...

    @property
    def parts(self) -> Mapping[str, float]:
        """Columns that are followed where one of them is asked, with their sizes."""
        ...

    def columns(self, poses: Poses, linear: Linearization, rows: Ints, moving: Moving) -> Mapping[str, Value]:
        """Values by their columns; `rows` are those of the poses."""
        ...

    def lean(self, names: Collection[str]) -> Borne:
        """The same with nothing but what some columns need."""
        ...


@dataclass(frozen=True, eq=False)
class MotionQuestion:
    """What a study asks of every pose.

    Parameters
    ----------
    outputs : list of Coordinate
        Outputs in the tables: those that the study names, then others that have a target.
    listed : list of Coordinate
        Rows of the Jacobian, which is wanted where it is `square`: where the study names as many of them (or of the
        outputs) as drives.
    watched : list of Coordinate
        All coordinates whose values are needed: drives, outputs, those that targets depend on, and the angles in
        expressions of these and of limits.
    inverse : bool
        Whether rates and accelerations are those of the given coordinates rather than of the drives.
    targeted : tuple of str
        Coordinates whose values the errors need.
    errors : mapping of str to Quantity
        Columns of errors that have values between the poses, too.
    borne : Borne or None
        What else is computed of the forces.
    cams : sequence of Cam
        Cams whose pressure angle and radius of curvature are computed.
    """

    study: Study
    section: KinematicsSection
    poses: Poses
    outputs: list[Coordinate]
    listed: list[Coordinate]
    square: bool
    watched: list[Coordinate]
    inverse: bool
    targeted: tuple[str, ...]
    errors: Mapping[str, Quantity]
    borne: Borne | None = None
    cams: Sequence[Cam] = ()

    @property
    def drives(self) -> list[Coordinate]:
        """The mechanism's drives."""
        return [self.study.mechanism.coordinate(name) for name in self.study.mechanism.drives]

    @property
    def sizes(self) -> dict[Quantity, float]:
        """What values of a quantity are compared with, in the study's units: the mechanism's size, or a turn."""
        return {"length": self.study.mechanism.size, "angle": 2 * np.pi / self.study.units.angle_factor}

    @property
    def centres(self) -> list[Centre]:
        """Pairs of links whose instant centres are asked."""
        return [Centre(*pair) for pair in self.section.instant_centres]

    @cached_property
    def pairs(self) -> dict[str, Pair]:
        """Plates and pins whose clearances are asked, by the column of each."""
        chosen = self.section.collisions
        if chosen is None:
            return {}
        named = [Pair(plate_of(one), plate_of(other)) for one, other in chosen]
        pairs = named or pairs_of(self.study.mechanism.description)
        return {pair.name: pair for pair in pairs}

    @property
    def clearances(self) -> list[str]:
        """Columns of clearances: of every pair, and the smallest."""
        return [*self.pairs, CLEARANCE] if self.pairs else []

    @property
    def statics(self) -> list[Static]:
        """Efforts of the drives, where there are loads, mechanical advantages, and what cams have."""
        label, statics = self.study.units.label, []
        for drive in self.drives if self.section.loads else ():
            unit = label("moment" if drive.quantity == "angle" else "force")
            statics.append(Static(f"{drive.name}_effort", unit, "<drive>_effort", {"drive": drive.name}))
        statics += [Static(name, "", name, {}) for name in EFFICIENCIES if self.friction is not None]
        for name, input_name in self.section.mechanical_advantage.items():
            units = {"length": label("length"), "angle": ""}
            above, below = (units[self.study.mechanism.quantity(coordinate)] for coordinate in (input_name, name))
            unit = "" if above == below else above or f"1/{below}"
            words = {"output": name, "input": input_name}
            statics.append(Static(f"{name}_advantage", unit, "<output>_advantage", words))
        for cam in self.cams:
            for word, kind in CAM_COLUMNS.items():
                words = {"coupling": cam.coupling}
                name = f"{cam.coupling}_{word}"
                statics.append(Static(name, label(kind), f"<coupling>_{word}", words, self.sizes[kind]))
        return [*statics, *(self.borne.statics if self.borne is not None else ())]

    @property
    def loads(self) -> tuple[Load, ...]:
        """Loads of the drives' efforts, and of what else is computed of the forces."""
        return (*self.section.loads, *(self.borne.loads if self.borne is not None else ()))

    @property
    def parts(self) -> Mapping[str, float]:
        """Columns of the forces that are followed where one of them is asked, with their sizes."""
        return self.borne.parts if self.borne is not None else {}

    @property
    def poled(self) -> list[str]:
        """Columns that go to infinity where nothing is singular."""
        advantages = [f"{name}_advantage" for name in self.section.mechanical_advantage]
        centres = [column for centre in self.centres for column in centre.columns]
        return [*advantages, *(f"{cam.coupling}_curvature_radius" for cam in self.cams), *centres]

    @cached_property
    def friction(self) -> JointFriction | None:
        """Friction in the joints under the loads, if the study gives any."""
        mechanism, loads = self.study.mechanism, self.section.loads
        if not loads or not mechanism.description.friction:
            return None
        return JointFriction(mechanism, joints_of(mechanism, loads))

    @property
    def rated(self) -> dict[str, Coordinate]:
        """What has velocities and accelerations, where rates are asked: outputs, and drives whose rates change."""
        drives = self.drives if self.inverse or self.section.motion is not None else []
        return {output.name: output for output in [*drives, *self.outputs]}

    @property
    def orders(self) -> dict[str, tuple[Quantity, int]]:
        """Columns of velocities and accelerations, where the study gives rates: of what quantity, and which order."""
        return {
            f"{output.name}_{word}": (output.quantity, order)
            for output in (self.rated.values() if self.section.rated else ())
            for order, word in ((1, "velocity"), (2, "acceleration"))
        }

    @property
    def rates(self) -> dict[str, str]:
        """Units of the columns of velocities and accelerations."""
        label = self.study.units.label
        return {
            name: label(ORDERS[quantity][order]) if quantity in ORDERS else ""
            for name, (quantity, order) in self.orders.items()
        }

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
        timed = ((self.poses.slopes, 1), (self.poses.bends, 2)) if section.motion is not None else ()
        for columns, order in timed:
            tempos += [
                float(np.abs(column).max() * units.get(mechanism.quantity(name), 1.0)) ** (1 / order)
                for name, column in columns.items()
            ]
        return max(tempos)

    @cached_property
    def curve(self) -> Curve | None:
        """The motion that the poses are, with its angles; None of listed poses and grids."""
        if not self.poses.followed:
            return None
        mechanism = self.study.mechanism
        plan = mechanism.plan(self.poses.groups[0].names)
        return curve_of(self.study, self.poses, followed_angles(mechanism, plan, self.watched))

    def lean(self, names: Collection[str]) -> MotionQuestion:
        """The question with nothing but what some columns, and the targets of errors among them, need."""
        section, unasked = self.section, dict[str, object]()
        centres = [
            pair for pair in section.instant_centres if any(name.startswith(Centre(*pair).name) for name in names)
        ]
        rates = bool(centres) or any(name.endswith(("_velocity", "_acceleration")) for name in names)
        statics = [static.name for static in self.borne.statics] if self.borne is not None else []
        needed = self.borne is not None and any(name in names for name in (*statics, *self.parts))
        borne = self.borne.lean(names) if self.borne is not None and needed else None
        directed = self.friction is not None and any(static.name in names for static in self.statics)
        if not (rates or directed) and borne is None and not coordinates_in(self.study, section.loads):
            unasked |= {"rates": {}, "accelerations": {}, "speed": None, "motion": None}
        if not any(name in names for name in self.clearances):
            unasked |= {"collisions": None}
        if not any(static.name in names for static in self.statics):
            unasked |= {"loads": (), "mechanical_advantage": {}}
        square = self.square and any(name in ("det_J", "inverse_condition") or "_by_" in name for name in names)
        errors = any(name.endswith("_error") for name in names)
        values = {*names, *(self.targeted if errors else ())}
        return replace(
            self, section=section.model_copy(update={**unasked, "instant_centres": tuple(centres)}), square=square,
            watched=[coordinate for coordinate in self.watched if borne is not None or coordinate.name in values],
            inverse=self.inverse and (rates or borne is not None), borne=borne,
            cams=[cam for cam in self.cams if any(f"{cam.coupling}_{word}" in names for word in CAM_COLUMNS)],
        )  # fmt: skip

    @property
    def mixed(self) -> bool:
        """Whether the Jacobian mixes lengths and angles, and the study gives no length that makes them comparable."""
        return self.square and mixes(self.listed, self.drives) and characteristic_length(self.study) is None

    @property
    def absent(self) -> Mapping[str, str]:
        """Columns and tables of the Jacobian that have no values: why, and what to write for them."""
        if self.square:
            words = "J mixes lengths and angles; give kinematics.characteristic_length"
            return {"inverse_condition": words} if self.mixed else {}
        study, drives = self.study, self.study.mechanism.drives
        # One point, then angles; of outputs that are left out the last, as the end of a chain.
        named, others = self.section.outputs or (), default_outputs(study.mechanism)[::-1]
        parts = {c.name: c for c in expand_outputs(study, (*named, *others)) if c.name not in drives}
        node = next((c.node for c in parts.values() if c.kind in ("x", "y")), -1)
        picked = sorted(parts, key=lambda name: (parts[name].node != node, parts[name].kind != "angle"))[: len(drives)]
        points = {name[:-2] for name in picked if name.endswith(".x") and f"{name[:-2]}.y" in picked}
        rows = dict.fromkeys(name[:-2] if name[:-2] in points else name for name in picked)
        listing = f"{counted(len(self.listed), 'output')} ({', '.join(c.name for c in self.listed)})"
        words = f"{listing} for {counted(len(drives), 'drive')}; name as many"
        if not named:
            words = f"no outputs are named; name as many as there are drives, {len(drives)},"
        words += f" by kinematics.jacobian: [{', '.join(rows)}]"
        return dict.fromkeys(("det_J", "inverse_condition", "jacobian"), words)


def motion_question(study: Study, poses: Poses) -> MotionQuestion:
    """Read what a study asks of its motion at some poses.

    Raises
    ------
    MechanismError
        If an output does not exist.
    """
    section, mechanism = KinematicsSection.of(study), study.mechanism
    outputs = expand_outputs(study, section.outputs or default_outputs(mechanism))
    listed = outputs if section.jacobian is None else expand_outputs(study, section.jacobian)
    shown = {output.name: output for output in outputs}
    for target in study.targets.values():
        shown |= {name: mechanism.coordinate(name) for name in target.coordinates if name not in shown}
    between, targeted = dict(followed(study, poses)), needed(study, poses)
    loads = [coordinate.name for coordinate in coordinates_in(study, section.loads)]
    names = dict.fromkeys([*mechanism.drives, *shown, *targeted, *loads])
    watched = {name: mechanism.coordinate(name) for name in names}
    return MotionQuestion(
        study,
        section,
        poses,
        list(shown.values()),
        listed,
        (section.outputs or section.jacobian) is not None and len(listed) == len(mechanism.drives),
        list((watched | angles_of([*watched.values(), *mechanism.counting])).values()),
        section.inverse(study.mechanism.drives),
        targeted,
        between,
        cams=mechanism.cams,
    )
