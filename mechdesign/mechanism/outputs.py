"""Derivatives of coordinates from those of positions: in time, by a drive, by a dimension, and mixed ones."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from mechdesign.ground.functions import Dual
from mechdesign.mechanism.algebra import Value, Vector, dot, norm2
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.coordinates import Coordinate


class Pulls(NamedTuple):
    """Forces at nodes, moments on bodies and forces along slides, by their indices or names."""

    nodes: dict[int, Vector]
    bodies: dict[str, Value]
    slides: dict[int, Value]


@dataclass(frozen=True, eq=False)
class Rates:
    """One derivative of everything: node positions (complex), angles of classes, slides, offsets of bodies, parameters.

    Parameters of measures that are not named do not change. `ends` has points of links, by link and node, that do not
    move with the pin at the node.
    Arrays broadcast to the batch, with further leading axes where several derivatives are taken at once.
    """

    nodes: Sequence[Vector]
    angles: Sequence[Value]
    slides: Sequence[Value]
    offsets: Mapping[str, Value]
    parameters: Mapping[str, Value] = field(default_factory=dict)
    ends: Mapping[tuple[str, int], Vector] = field(default_factory=dict)


def first(configuration: Configuration, coordinate: Coordinate, rates: Rates) -> Value:
    """First derivative of a coordinate along `rates` (in time, by a drive or by a dimension); angles in radians."""
    kind = coordinate.kind
    if kind in ("x", "y", "distance"):
        moved = [rates.ends.get(end, rates.nodes[end[1]]) for end in coordinate.ends]
        if kind != "distance":
            return moved[0].real if kind == "x" else moved[0].imag
        span = _span(configuration.nodes, coordinate)
        return dot(span, moved[1] - moved[0]) / np.sqrt(norm2(span))
    if kind == "slide":
        return rates.slides[coordinate.slide]
    if kind == "angle":
        total: Value = 0.0
        for sign, body in ((1, coordinate.body), (-1, coordinate.reference)):
            frame = configuration.graph.bodies[body][0]
            total = total + sign * (rates.angles[frame] + rates.offsets.get(body, 0.0))
        return total
    if kind == "parameter":
        return rates.parameters.get(coordinate.name, 0.0)
    gradient = _gradient(coordinate, configuration.user_values(coordinate))
    return _radians(coordinate, sum(g * _user(part, first(configuration, part, rates), coordinate)
                                    for g, part in zip(gradient, coordinate.parts, strict=True)))  # fmt: skip


def pulled(configuration: Configuration, coordinate: Coordinate, effort: Value) -> Pulls:
    """Forces and moments whose work on any `rates` is ``effort * first(coordinate, rates)``: the adjoint of `first`."""
    pulls = Pulls({}, {}, {})
    for part, share in shares(configuration, coordinate, effort):
        for node, force in node_forces(configuration, part, share):
            pulls.nodes[node] = pulls.nodes.get(node, 0.0) + force
        if part.kind == "slide":
            pulls.slides[part.slide] = pulls.slides.get(part.slide, 0.0) + share
        elif part.kind == "angle":
            for body, moment in ((part.body, share), (part.reference, -1.0 * share)):
                pulls.bodies[body] = pulls.bodies.get(body, 0.0) + moment
    return pulls


def shares(configuration: Configuration, coordinate: Coordinate, effort: Value) -> Iterator[tuple[Coordinate, Value]]:
    """The `leaves` of a coordinate, with the effort on each; together they do the work of the effort."""
    if coordinate.kind not in ("expression", "parameter"):
        yield coordinate, effort
    if coordinate.kind != "expression":
        return
    slopes = _gradient(coordinate, configuration.user_values(coordinate))
    for slope, part in zip(slopes, coordinate.parts, strict=True):
        yield from shares(configuration, part, effort * _radians(coordinate, _user(part, slope, coordinate)))


def node_forces(configuration: Configuration, coordinate: Coordinate, effort: Value) -> list[tuple[int, Vector]]:
    """Forces at nodes by an effort on an x, a y or a distance, in the order of its `ends`; none of another."""
    if coordinate.kind == "distance":
        span = _span(configuration.nodes, coordinate)
        along = span * (effort / np.sqrt(norm2(span)))
        return [(coordinate.node, -along), (coordinate.other, along)]
    ways: dict[str, complex] = {"x": 1.0 + 0j, "y": 1j}
    return [(coordinate.node, effort * ways[coordinate.kind])] if coordinate.kind in ways else []


def second(configuration: Configuration, coordinate: Coordinate, one: Rates, other: Rates, both: Rates) -> Value:
    """Second derivative of a coordinate, along `one` and `other`; `both` has those of positions.

    With velocities as `one` and `other` it is the acceleration; with derivatives by dimensions as `other`, the
    derivative of the velocity by these.
    """
    if coordinate.kind == "distance":
        span, a, b, ab = (_span(n, coordinate) for n in (configuration.nodes, one.nodes, other.nodes, both.nodes))
        square = norm2(span)
        return (dot(a, b) + dot(span, ab) - dot(span, a) * dot(span, b) / square) / np.sqrt(square)
    if coordinate.kind == "expression":
        rate, other_rate = (_by_part(coordinate, partial(first, configuration, rates=rates)) for rates in (one, other))
        mixed = _by_part(coordinate, partial(second, configuration, one=one, other=other, both=both))
        total: Value = 0.0
        for name, slope in _gradient_along(configuration, coordinate, rate).items():
            gradient, bend = Dual.parts(slope)
            total = total + gradient * mixed[name] + bend * other_rate[name]
        return _radians(coordinate, total)
    return first(configuration, coordinate, both)


def acceleration_sensitivity(
    configuration: Configuration, coordinate: Coordinate, by_time: Sequence[Rates], by_z: Sequence[Rates]
) -> Value:  # fmt: skip
    """Derivative of a coordinate's acceleration with respect to dimensions z (leading axis).

    `by_time` are velocities and accelerations, `by_z` the derivatives of positions, velocities and accelerations.
    """
    (velocity, acceleration), (position_z, velocity_z, acceleration_z) = by_time, by_z
    if coordinate.kind == "expression":
        return _curved_sensitivity(configuration, coordinate, by_time, by_z)
    if coordinate.kind == "distance":
        rate, rate_z = first(configuration, coordinate, velocity), first(configuration, coordinate, position_z)
        bend = second(configuration, coordinate, velocity, velocity, acceleration)
        mixed = second(configuration, coordinate, velocity, position_z, velocity_z)
        span, speed, span_z = (_span(n, coordinate) for n in (configuration.nodes, velocity.nodes, position_z.nodes))
        top = (
            2 * dot(speed, _span(velocity_z.nodes, coordinate))
            + dot(span_z, _span(acceleration.nodes, coordinate))
            + dot(span, _span(acceleration_z.nodes, coordinate))
        )
        return (top - 2 * rate * mixed - rate_z * bend) / np.sqrt(norm2(span))
    return first(configuration, coordinate, acceleration_z)


def _curved_sensitivity(
    configuration: Configuration, coordinate: Coordinate, by_time: Sequence[Rates], by_z: Sequence[Rates]
) -> Value:  # fmt: skip
    """`acceleration_sensitivity` of an expression f of parts p.

    f''_z = sum_i f_i p_i''_z + 2 sum_ij f_ij p_i' p_j'_z + sum_ij f_ij p_i'' p_j_z + sum_ijk f_ijk p_i' p_j' p_k_z
    """
    (velocity, acceleration), (position_z, velocity_z, _) = by_time, by_z
    by_part = partial(_by_part, coordinate)
    rate, shift = (by_part(partial(first, configuration, rates=rates)) for rates in (velocity, position_z))
    rise, rate_z = (
        by_part(partial(second, configuration, one=velocity, other=other, both=both))
        for other, both in ((velocity, acceleration), (position_z, velocity_z))
    )
    rise_z = by_part(partial(acceleration_sensitivity, configuration, by_time=by_time, by_z=by_z))
    by_rise = _gradient_along(configuration, coordinate, rise)
    total: Value = 0.0
    for name, slope in _gradient_along(configuration, coordinate, rate, twice=True).items():
        start, bends = Dual.parts(slope)
        (gradient, bend), (_, twist), (_, rising) = map(Dual.parts, (start, bends, by_rise[name]))
        total = total + gradient * rise_z[name] + 2 * bend * rate_z[name] + (rising + twist) * shift[name]
    return _radians(coordinate, total)


def _span(nodes: Sequence[Vector], coordinate: Coordinate) -> Vector:
    return nodes[coordinate.other] - nodes[coordinate.node]


def _user(part: Coordinate, value: Value, whole: Coordinate) -> Value:
    return value / whole.formula.angle_unit if part.quantity == "angle" else value


def _radians(coordinate: Coordinate, value: Value) -> Value:
    """The value of an expression, or a derivative of it, in radians if it is an angle."""
    return value * coordinate.formula.angle_unit if coordinate.quantity == "angle" else value


def _gradient(coordinate: Coordinate, values: dict[str, Value]) -> list[Value]:
    partials = coordinate.formula.derivatives(values)
    return [partials.get(part.name, 0.0) for part in coordinate.parts]


def _by_part(coordinate: Coordinate, derivative: Callable[[Coordinate], Value]) -> dict[str, Value]:
    """By name, a derivative of each part of an expression, in the units that its text expects."""
    return {part.name: _user(part, derivative(part), coordinate) for part in coordinate.parts}


def _gradient_along(
    configuration: Configuration, coordinate: Coordinate, rate: Mapping[str, Value], *, twice: bool = False
) -> dict[str, Any]:
    """Gradient of an expression with its slope along a change of its parts, and with that of the slope if `twice`."""
    duals = {name: Dual(value, rate[name]) for name, value in configuration.user_values(coordinate).items()}
    if twice:
        duals = {name: Dual(dual, Dual(rate[name], 0.0)) for name, dual in duals.items()}
    return coordinate.formula.derivatives(duals)
