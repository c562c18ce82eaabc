"""Efforts and forces among the outputs: columns of dynamics at poses, of the nominal mechanism and of made ones.

Made mechanisms have the nominal rates of the drives. Their own masses, springs and dimensions count, and parameters
that the loads, gravity or the sections of beams follow.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from mechdesign.ground.expressions import Expression, Number
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.mechanism import Configuration, Mechanism
from mechdesign.mechanism.algebra import Value, Vector
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.derivatives import STALLED, Linearization, regularity
from mechdesign.mechanism.forces import Forces, Moving
from mechdesign.mechanism.outputs import Rates
from mechdesign.motion.rows import PoseNumbers, Poses
from mechdesign.questions.dynamics.question import ForceQuestion
from mechdesign.questions.dynamics.schema import column_kinds
from mechdesign.questions.kinematics.rates import DriveRates
from mechdesign.questions.loads import Loading, coordinates_in
from mechdesign.questions.reliability.corners import Bend, bends, bends_of
from mechdesign.questions.reliability.laws import at_rows
from mechdesign.questions.reliability.schema.section import ReliabilitySection, pace_of
from mechdesign.study import Study
from mechdesign.study.schema.poses import MotionSection
from mechdesign.study.text.units import Amount

# Prefix of the names of parameters that the numbers of dynamics follow; no name in a study has a colon.
FOLLOWED = "dynamics:"
# Step of the difference quotients by places and drives, in radians, sizes of the mechanism, or largest numbers of the
# same kind. Their error is about 1e-10 of the force, over the cube of the distance from a singularity (at most 1).
STEP = 6e-6


def kinds_of_forces(study: Study) -> dict[str, str]:
    """Kinds of quantity of the columns of dynamics among the outputs and limits; coordinates go before them."""
    section, mechanism = study.reliability, study.mechanism
    if study.dynamics is None or section is None:
        return {}
    kinds = column_kinds(mechanism, study.dynamics.joints(mechanism), moving=True)
    names = dict.fromkeys([*(section.outputs or ()), *section.limits])
    coordinates = {*mechanism.coordinates, *mechanism.points}
    return {name: kinds[name] for name in names if name in kinds and name not in coordinates}


def pace(study: Study) -> MotionSection:
    """The section whose rates the mechanism has."""
    section = ReliabilitySection.of(study)
    return pace_of(section, study.dynamics, study.kinematics) if kinds_of_forces(study) else section


def followed(study: Study) -> set[str]:
    """Parameters that the numbers of dynamics follow, where forces are among the outputs."""
    if study.dynamics is None or not kinds_of_forces(study):
        return set()
    names: set[str] = set()

    def note(number: Amount) -> Amount:
        names.update(number.expression.names if number.expression is not None else ())
        return number

    study.dynamics.with_numbers(note)
    for load in study.dynamics.loads:
        names.update(*(part.names for _, part, _ in load.numbers if isinstance(part, Expression)))
    if study.stiffness is not None:
        for section in study.stiffness.sections.values():
            if section.density is not None:
                section.with_numbers(note)
    return {name for name in study.parameters.nominal if study.parameters.moved([name]) & names}


def argument_name(argument: Expression) -> str:
    """A name of a column that no column of dynamics has."""
    return f"argument: {argument.program}"


def load_bends(study: Study) -> list[Bend]:
    """Where the loads of dynamics are not smooth: in their variables, and in the coordinates that they follow."""
    loads = study.dynamics.loads if study.dynamics is not None else ()
    numbers = [part for load in loads for _, part, _ in load.numbers]
    expressions = (part.expression if isinstance(part, Amount) else part for part in numbers)
    own = [bend for part in expressions if isinstance(part, Expression) for bend in bends_of(part)]
    return [*dict.fromkeys([*own, *(bend for part in coordinates_in(study, loads) for bend in bends(part))])]


@dataclass(frozen=True, eq=False)
class ForceModel(PoseNumbers):
    """The forces of a mechanism in motion, of designs or made mechanisms with parameters of their `own`.

    Those that are `changed` themselves follow nothing. `times` are those of poses over time.
    """

    question: ForceQuestion
    own: Mapping[str, Floats]
    changed: frozenset[str] = frozenset()
    times: Floats | None = None

    @property
    def parameters(self) -> Mapping[str, Floats]:
        return self.own

    @property
    def nominal(self) -> Mapping[str, float]:
        return self.question.study.parameters.nominal

    @property
    def coordinates(self) -> list[Coordinate]:
        """Coordinates that the loads and springs follow."""
        study = self.question.study
        return [*coordinates_in(study, self.question.section.loads), *study.mechanism.windings.values()]

    def take(self, rows: Sequence[int] | Ints) -> ForceModel:
        """The model at some of many poses."""
        own = {name: np.asarray(at_rows(value, rows)) for name, value in self.own.items()}
        return replace(self, own=own, times=None if self.times is None else self.times[rows])

    def made(self, deviations: Mapping[str, Number]) -> ForceModel:
        """The model of made mechanisms, from deviations of parameters by their `FOLLOWED` names."""
        if not deviations:
            return self
        nominal, parameters = self.nominal, self.question.study.parameters
        changed: dict[str, Number] = {name: self.parameters[name] for name in self.changed if name in self.parameters}
        for key, deviation in deviations.items():
            name = key.removeprefix(FOLLOWED)
            changed[name] = self.parameters.get(name, nominal[name]) + deviation
        values = parameters.values(changed)
        moved = {name: np.asarray(values[name]) for name in parameters.moved(changed)}
        return replace(self, own={**self.own, **moved})

    def values(self, names: Sequence[str], linear: Linearization, rates: DriveRates) -> list[Value]:
        """Columns of dynamics at poses, in the study's units; nan where the drives do not hold the mechanism."""
        moving = Moving()
        if self.question.moves:
            velocity = linear.velocity(rates.velocities)
            moving = Moving(velocity, linear.acceleration(velocity, rates.accelerations))
        held = regularity(linear) >= STALLED
        columns = dict(self.question.lean(names).columns(self, linear, moving))
        loading, acting = Loading(self.question.study, (), self), Forces(linear.configuration)
        for name, argument in self.arguments.items():
            if name in names:
                columns[name] = loading.value(argument, acting, moving)
        return [np.where(held, columns[name], np.nan) for name in names]

    @cached_property
    def arguments(self) -> Mapping[str, Expression]:
        """What the corners of the loads are judged by, by the names of columns of its own."""
        parts = (part for bend in load_bends(self.question.study) for part in bend.arguments)
        return {argument_name(part): part for part in parts if isinstance(part, Expression)}

    def slopes(
        self, names: Sequence[str], mechanism: Mechanism, configuration: Configuration, position: Rates,
        by: Sequence[str], rates: DriveRates,
    ) -> Floats:  # fmt: skip
        """Derivatives of columns by places, drives and followed parameters, shape (names, by, n), at a flat batch.

        They are central differences of the columns along the derivatives of the positions, `position`.
        """
        steps = np.array([STEP * self._scale(mechanism, name) for name in by])
        shifts = np.stack([steps, -steps])[:, :, None]
        moved = self.made({
            name: shifts * _one_of(by, name) for name in by if name.startswith(FOLLOWED)
        })  # fmt: skip
        shifted = _shifted(mechanism, configuration, position, by, shifts)
        values = moved.values(names, mechanism.linearize(shifted), rates)
        whole = np.stack([np.broadcast_to(value, (2, len(by), *configuration.shape)) for value in values])
        return np.asarray((whole[:, 0] - whole[:, 1]) / (2 * steps[:, None]))

    def _scale(self, mechanism: Mechanism, name: str) -> float:
        """What a number is measured by: a radian, the size of the mechanism, or the largest number of its kind."""
        places = mechanism.description.places
        if name.startswith(FOLLOWED):
            return abs(self.nominal[name.removeprefix(FOLLOWED)]) or 1.0
        kind: str = places[name].quantity if name in places else "length"
        kind = mechanism.quantity(name) if name in mechanism.drives else kind
        if kind in ("angle", "length"):
            return 1.0 if kind == "angle" else mechanism.size
        return max(abs(place.nominal) for place in places.values() if place.quantity == kind) or 1.0


def force_model(study: Study, poses: Poses) -> ForceModel | None:
    """The model of a study, or of designs at their poses; None where no force is asked."""
    if study.dynamics is None or not kinds_of_forces(study):
        return None
    question = ForceQuestion.of(study, moves=pace(study).rated)
    return ForceModel(question, poses.parameters, poses.own.changed, poses.times)


def _one_of(names: Sequence[str], name: str) -> Floats:
    """1 at one of the names, else 0, shape (names, 1)."""
    return np.array([[float(other == name)] for other in names])


def _shifted(
    mechanism: Mechanism, configuration: Configuration, position: Rates, by: Collection[str], shifts: Floats
) -> Configuration:
    """Configurations a step along each derivative of the positions, and one back, shape (2, by, n).

    Their loops are open by the square of the step, which drops out of the central difference.
    """

    def along(value: Any, slope: Vector) -> Any:
        return value + shifts * slope if np.ndim(slope) or slope else value

    nominal, own = mechanism.nominal, configuration.places
    names = [name for name in by if name not in mechanism.drives and not name.startswith(FOLLOWED)]
    places = {**own} | {
        name: own.get(name, nominal.get(name, 0.0)) + shifts * _one_of([*by], name) for name in names
    }  # fmt: skip
    turns = [np.exp(1j * shifts * slope) if np.ndim(slope) or slope else 1.0 for slope in position.angles]
    shape = (2, len(by), *configuration.shape)
    return replace(
        configuration, vectors=mechanism.geometry.vectors(places), shape=shape,
        nodes=[along(x, slope) for x, slope in zip(configuration.nodes, position.nodes, strict=True)],
        rotations=[u * turn for u, turn in zip(configuration.rotations, turns, strict=True)],
        slides=[along(s, slope) for s, slope in zip(configuration.slides, position.slides, strict=True)],
        reason=np.broadcast_to(configuration.reason, shape), places=places,
    )  # fmt: skip
