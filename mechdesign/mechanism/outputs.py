"""Derivatives of coordinates from the derivatives of positions: velocity, acceleration, and their sensitivities."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import numpy as np

from mechdesign.errors import MechanismError
from mechdesign.mechanism.algebra import Value, dot, norm2, quiet
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.rates import Rates

# Step of the central difference of an expression's exact gradient, relative to its arguments' scale.
STEP = 1e-6


@quiet
def first(configuration: Configuration, coordinate: Coordinate, rates: Rates) -> Value:
    """First derivative of a coordinate along `rates` (in time, by a drive or by a dimension); angles in radians."""
    kind = coordinate.kind
    if kind == "x":
        return np.real(rates.nodes[coordinate.node])
    if kind == "y":
        return np.imag(rates.nodes[coordinate.node])
    if kind == "slide":
        return rates.slides[coordinate.slide]
    if kind == "angle":
        total: Value = 0.0
        for sign, body in ((1, coordinate.body), (-1, coordinate.reference)):
            frame = configuration.graph.bodies[body][0]
            total = total + sign * (rates.angles[frame] + rates.offsets.get(body, 0.0))
        return total
    if kind == "distance":
        span, change = _span(configuration, coordinate), _difference(coordinate, rates)
        return dot(span, change) / np.sqrt(norm2(span))
    gradient = _gradient(coordinate, configuration.user_values(coordinate))
    return sum(g * _user(part, first(configuration, part, rates), coordinate)
               for g, part in zip(gradient, coordinate.parts, strict=True))  # fmt: skip


@quiet
def second(configuration: Configuration, coordinate: Coordinate, velocity: Rates, acceleration: Rates) -> Value:
    """Second time derivative of a coordinate."""
    if coordinate.kind == "distance":
        span, speed = _span(configuration, coordinate), _difference(coordinate, velocity)
        length = np.sqrt(norm2(span))
        rate = dot(span, speed) / length
        return (norm2(speed) + dot(span, _difference(coordinate, acceleration)) - rate * rate) / length
    if coordinate.kind == "expression":
        speeds = [_user(p, first(configuration, p, velocity), coordinate) for p in coordinate.parts]
        bends = [_user(p, second(configuration, p, velocity, acceleration), coordinate) for p in coordinate.parts]
        values = configuration.user_values(coordinate)
        gradient = _gradient(coordinate, values)
        curved = _directional(coordinate, values, speeds)
        return sum(g * b + c * v for g, b, c, v in zip(gradient, bends, curved, speeds, strict=True))
    return first(configuration, coordinate, acceleration)


@dataclass(frozen=True, eq=False)
class Motion:
    """Time derivatives at a configuration and their derivatives with respect to dimensions."""

    velocity: Rates
    acceleration: Rates
    position_z: Rates
    velocity_z: Rates
    acceleration_z: Rates


@quiet
def velocity_sensitivity(configuration: Configuration, coordinate: Coordinate, motion: Motion) -> Value:
    """Derivative of a coordinate's velocity with respect to dimensions (leading axis)."""
    if coordinate.kind == "distance":
        span, length, rate, _ = _distance_rates(configuration, coordinate, motion)
        speed, span_z = _difference(coordinate, motion.velocity), _difference(coordinate, motion.position_z)
        length_z = dot(span, span_z) / length
        return (dot(span_z, speed) + dot(span, _difference(coordinate, motion.velocity_z)) - length_z * rate) / length
    if coordinate.kind == "expression":
        values = configuration.user_values(coordinate)
        speeds = [_user(p, first(configuration, p, motion.velocity), coordinate) for p in coordinate.parts]
        changes = [_user(p, first(configuration, p, motion.position_z), coordinate) for p in coordinate.parts]
        mixed = [_user(p, velocity_sensitivity(configuration, p, motion), coordinate) for p in coordinate.parts]
        curved = _directional(coordinate, values, speeds)
        gradient = _gradient(coordinate, values)
        return sum(g * m + c * z for g, m, c, z in zip(gradient, mixed, curved, changes, strict=True))
    return first(configuration, coordinate, _plain(motion.velocity_z))


@quiet
def acceleration_sensitivity(configuration: Configuration, coordinate: Coordinate, motion: Motion) -> Value:
    """Derivative of a coordinate's acceleration with respect to dimensions (leading axis).

    Raises
    ------
    MechanismError
        For a measure given by an expression.
    """
    if coordinate.kind == "expression":
        raise MechanismError(
            f"the acceleration error of '{coordinate.name}' is not available analytically: it is an expression; "
            "use monte_carlo, or name its parts as outputs",
            "reliability.outputs",
        )
    if coordinate.kind == "distance":
        span, length, rate, bend = _distance_rates(configuration, coordinate, motion)
        speed, span_z = _difference(coordinate, motion.velocity), _difference(coordinate, motion.position_z)
        length_z = dot(span, span_z) / length
        rate_z = velocity_sensitivity(configuration, coordinate, motion)
        top = (
            2 * dot(speed, _difference(coordinate, motion.velocity_z))
            + dot(span_z, _difference(coordinate, motion.acceleration))
            + dot(span, _difference(coordinate, motion.acceleration_z))
        )
        return (top - 2 * rate * rate_z - length_z * bend) / length
    return first(configuration, coordinate, _plain(motion.acceleration_z))


def _plain(rates: Rates) -> Rates:
    # A body's constant offset changes its angle with a dimension, but not its angular velocity.
    return Rates(rates.nodes, rates.angles, rates.slides, {})


def _span(configuration: Configuration, coordinate: Coordinate) -> Value:
    return configuration.nodes[coordinate.other] - configuration.nodes[coordinate.node]


def _difference(coordinate: Coordinate, rates: Rates) -> Value:
    return rates.nodes[coordinate.other] - rates.nodes[coordinate.node]


def _distance_rates(
    configuration: Configuration, coordinate: Coordinate, motion: Motion
) -> tuple[Value, Value, Value, Value]:
    span = _span(configuration, coordinate)
    rate = first(configuration, coordinate, motion.velocity)
    bend = second(configuration, coordinate, motion.velocity, motion.acceleration)
    return span, np.sqrt(norm2(span)), rate, bend


def _user(part: Coordinate, value: Value, whole: Coordinate) -> Value:
    assert whole.expression is not None
    return value / whole.expression.angle_unit if part.quantity == "angle" else value


def _gradient(coordinate: Coordinate, values: dict[str, Value]) -> list[Value]:
    assert coordinate.expression is not None
    partials = coordinate.expression.derivatives(values)
    return [partials.get(part.name, 0.0) for part in coordinate.parts]


def _directional(coordinate: Coordinate, values: dict[str, Value], direction: list[Value]) -> list[Value]:
    """Derivative of an expression's gradient along a direction, by a central difference of the exact gradient."""
    largest = reduce(np.maximum, [np.abs(v) for v in direction], 0.0)
    scale = reduce(np.maximum, [np.abs(v) for v in values.values()], 1.0)
    # A pose that does not move takes any step: both sides are the same.
    step = STEP * scale / np.where(largest > 0, largest, 1.0)
    sides = [
        _gradient(
            coordinate, {p.name: values[p.name] + h * v for p, v in zip(coordinate.parts, direction, strict=True)}
        )
        for h in (step, -step)
    ]
    return [(a - b) / (2 * step) for a, b in zip(*sides, strict=True)]
