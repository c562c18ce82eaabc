"""The loads of a question at solved poses, as forces on its mechanism."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdesign.ground.expressions import Corner, Expression, Number
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import norm2
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.forces import Forces, Moving
from mechdesign.mechanism.outputs import first
from mechdesign.motion.motion import in_study_units
from mechdesign.motion.rows import PoseNumbers
from mechdesign.motion.rules import TIME
from mechdesign.study import Study
from mechdesign.study.schema.loads import VELOCITY, Load, Quantity
from mechdesign.study.text.reading import MAX_NUMBER
from mechdesign.study.text.units import Amount

# Directions in which a mechanism may move, and instants, in which loads show how large they are.
BOTH_WAYS, INSTANTS = np.array([[-1.0], [1.0]]), 33


def coordinates_in(study: Study, loads: Sequence[Load]) -> list[Coordinate]:
    """Coordinates in the expressions of loads, also those whose velocities stand there."""
    names = {name.removesuffix(VELOCITY): name for load in loads for _, quantity, _ in load.numbers
             if isinstance(quantity, Expression) for name in quantity.names}  # fmt: skip
    return [study.mechanism.coordinate(name) for name in names if name != TIME and name not in study.parameters.nominal]


def corners_in(loads: Sequence[Load]) -> list[Corner]:
    """The corners of the expressions of loads."""
    numbers = [quantity for load in loads for _, quantity, _ in load.numbers if isinstance(quantity, Expression)]
    return [corner for expression in numbers for corner in expression.corners()]


class Loading:
    """Loads at some poses."""

    def __init__(self, study: Study, loads: Sequence[Load], poses: PoseNumbers) -> None:
        self.study, self.loads, self.poses = study, loads, poses

    def add(self, forces: Forces, moving: Moving) -> None:
        """Add the loads to forces."""
        configuration = forces.configuration
        for load in self.loads:
            values = [self.value(part, forces, moving) for _, part, _ in load.numbers]
            if load.at is not None:
                force = values[0] + 1j * values[1]
                if load.in_ is not None:
                    force = force * configuration.body_rotation(load.in_)
                forces.at(load.at, force)
            elif load.between is not None:
                span = forces.span(load.between)
                forces.pull(load.between, values[0] * span / np.sqrt(norm2(span)))
            if load.link is not None:
                forces.on_body(load.link, 0.0, values[-1])

    def value(self, quantity: Quantity, forces: Forces, moving: Moving) -> Number:
        """A number of a load or an effort; nan where an expression has no value."""
        if isinstance(quantity, Expression):
            value = quantity.evaluate({
                name: variable(self.study, name, self.poses, forces.configuration, moving) for name in quantity.names
            })  # fmt: skip
            # Beyond what a study takes as a number it has no value.
            return np.where(np.abs(value) <= MAX_NUMBER, value, np.nan)
        return quantity


def variable(study: Study, name: str, poses: PoseNumbers, configuration: Configuration, moving: Moving) -> Number:
    """Value of a variable of a load at some poses: a parameter, the time, a coordinate or its velocity."""
    if name in study.parameters.nominal:
        return poses.of(Amount(study.parameters.nominal[name], "", Expression.parse(name)))
    if name == TIME:
        assert poses.times is not None
        return poses.times
    coordinate = study.mechanism.coordinate(name.removesuffix(VELOCITY))
    if coordinate.name == name:
        return np.asarray(in_study_units(study.units, coordinate, configuration.value(coordinate)), dtype=np.float64)
    assert moving.velocity is not None
    rate = first(configuration, coordinate, moving.velocity)
    return np.asarray(in_study_units(study.units, coordinate, rate), dtype=np.float64)


def size_in_sketch(study: Study, quantity: Quantity, tempo: float, span: float) -> float:
    """About how large a number of a load is: where it follows the motion, its largest size in the sketch.

    Parameters
    ----------
    tempo : float
        How fast the mechanism moves there, either way: radians, or sizes of it, in a unit of time.
    span : float
        The times from 0 on that count.
    """
    if not isinstance(quantity, Expression):
        return abs(quantity)
    mechanism, values = study.mechanism, dict[str, Number]()
    for name in quantity.names:
        if name == TIME:
            values[name] = np.linspace(0.0, span, INSTANTS)
        elif name in study.parameters.nominal:
            values[name] = study.parameters.nominal[name]
        else:
            coordinate = mechanism.coordinate(name.removesuffix(VELOCITY))
            speed = tempo * (mechanism.size if coordinate.quantity == "length" else 1.0)
            at_rest = coordinate.name == name
            value = mechanism.sketch_configuration.value(coordinate) if at_rest else BOTH_WAYS * speed
            values[name] = np.asarray(in_study_units(study.units, coordinate, value), dtype=np.float64)
    sizes = np.abs(np.asarray(quantity.evaluate(values)))
    return float(sizes.max(initial=0.0, where=sizes <= MAX_NUMBER))
