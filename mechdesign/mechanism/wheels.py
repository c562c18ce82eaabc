"""Wheels of couplings: the pitch circles that two gears, two pulleys or a pinion and its rack roll on.

They follow from the ratio of two angles against the link that carries both axes (Willis), or from that of a slide to
an angle. With the rates w of wheels a and b and of their carrier c, the distance e of the axes, and the rate v of a
rack:

    w_b - w_c = i (w_a - w_c),  r_a = |i| r_b,  r_a + r_b = e for i < 0, |r_a - r_b| = e for i > 0;   v = r w
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mechdesign.mechanism.algebra import Value, Vector
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.coordinates import Coordinate, Coupled
from mechdesign.mechanism.graph import GROUND, Graph
from mechdesign.mechanism.model import Description
from mechdesign.mechanism.outputs import pulled

if TYPE_CHECKING:
    from mechdesign.mechanism.core import Core

# Links of a mesh, its carrier and the nodes of its axes.
Axes = tuple[tuple[str, str], str, tuple[int, int]]
# Rates that differ by less are one rate.
SAME_RATE = 1e-9
# Radius of the larger pulley of a belt, as a part of the distance of the axes.
PULLEY = 0.2


@dataclass(frozen=True)
class Mesh:
    """Two wheels that roll on each other, or a wheel and a rack.

    Parameters
    ----------
    coupling, index : str, int
        Name and number of the coupling, whose `gap` is zero.
    links : tuple of str
        The link that follows, a wheel or what slides with a rack, then the wheel that it follows.
    carrier : str
        The link that carries the axes, or the guide of a rack.
    axes : tuple of int
        Nodes of the axes of both wheels; of a rack a point of it.
    slide : int
        The slide of a rack; -1 of two wheels.
    belt : bool
        Whether a belt joins the wheels.
    pressure_angle : float
        Of their teeth (radians).
    radius : float
        Of a belt's pulley that follows; 0 where it is not known.
    """

    coupling: str
    index: int
    gap: Coordinate
    links: tuple[str, str]
    carrier: str
    axes: tuple[int, int]
    slide: int
    belt: bool
    pressure_angle: float
    radius: float

    @property
    def presses(self) -> bool:
        """Whether the forces between its links are known."""
        return not self.belt or self.radius > 0

    def ratio(self, configuration: Configuration) -> Value:
        """Rate of the link that follows per rate of the wheel, both against the carrier; of a rack a length."""
        return _ratio(_rates(self.gap, configuration), self.links[1], self.carrier)

    def radii(self, configuration: Configuration) -> tuple[Value, Value]:
        """Radii of the pitch circles of both links; 0 of a rack."""
        ratio = self.ratio(configuration)
        size = np.abs(ratio)
        if self.slide >= 0:
            return 0.0, size
        apart: Value = np.abs(configuration.nodes[self.axes[0]] - configuration.nodes[self.axes[1]])
        if self.belt:
            radius = self.radius or PULLEY * apart / np.maximum(1.0, size)
            return radius, size * radius
        driven = apart / np.where(ratio < 0, 1.0 + size, np.abs(1.0 - size))
        return driven, size * driven

    def contact(self, configuration: Configuration) -> tuple[Vector, Vector]:
        """Where the pitch circles touch, and the unit vector in which the link that follows moves there by its rate."""
        centre, ratio = configuration.nodes[self.axes[1]], self.ratio(configuration)
        if self.slide >= 0:
            along = configuration.direction(
                next(k for k, edge in enumerate(configuration.graph.edges) if edge.slide == self.slide)
            )
            return centre - 1j * along * ratio, along
        driven = configuration.nodes[self.axes[0]]
        way = (driven - centre) / np.abs(driven - centre)
        # A wheel inside of a larger one touches it beyond its own axis.
        side = np.where((ratio > 0) & (ratio < 1), -1.0, 1.0)
        touch = centre + side * self.radii(configuration)[1] * way
        return touch, 1j * (touch - driven) / np.abs(touch - driven)

    def strand(self, configuration: Configuration, side: Value) -> tuple[Vector, Vector, Vector]:
        """Where a belt's straight part leaves both wheels, and its direction from the one that follows to the other.

        `side` is 1 for the part on the left of the way from axis to axis, -1 on the right. Belts of a negative ratio
        are crossed.
        """
        driven, centre = (configuration.nodes[axis] for axis in self.axes)
        radius, other = self.radii(configuration)
        other = np.where(self.ratio(configuration) > 0, other, -other)
        apart = np.abs(centre - driven)
        normal = (centre - driven) / apart * np.exp(1j * side * np.arccos((radius - other) / apart))
        return driven + radius * normal, centre + other * normal, -1j * side * normal


def meshes(description: Description, graph: Graph, couplings: Sequence[Coupled], drawn: Configuration) -> list[Mesh]:
    """The wheels of all couplings that wheels can make: those linear in angles about axes on one carrier."""
    wheels = []
    for index, coupling in enumerate(couplings):
        given = description.couplings[coupling.name]
        if given.wheels == "none":
            continue
        if coupling.follower.kind == "slide":
            axes = _rack(description, graph, coupling)
        else:
            axes = _wheels(description, graph, coupling, drawn)
        if axes is not None:
            links, carrier, nodes = axes
            slide = coupling.follower.slide
            equal = slide < 0 and abs(float(_ratio(_rates(coupling.gap, drawn), links[1], carrier)) - 1.0) < SAME_RATE
            belt = given.wheels == "belt" or equal
            looks = belt, given.pressure_angle, given.radius
            wheels.append(Mesh(coupling.name, index, coupling.gap, links, carrier, nodes, slide, *looks))
    return wheels


def pitch_radius(mechanism: Core, coupling: str, places: Mapping[str, Value]) -> Value | None:
    """Radius of the pitch circle of the wheel that follows by a coupling, at dimensions that are not all nominal.

    None where it is not known.
    """
    mesh = next((mesh for mesh in mechanism.pressing if mesh.coupling == coupling), None)
    if mesh is None:
        return None
    # Where the carrier's frame is the world, its axes are where its points are.
    graph, nodes = mechanism.graph, list(mechanism.sketch_configuration.nodes)
    for axis in mesh.axes:
        if (mesh.carrier, graph.nodes[axis]) in graph.points:
            nodes[axis] = mechanism.geometry.place(mesh.carrier, graph.nodes[axis], places)
    vectors = mechanism.geometry.vectors(places)
    radii = mesh.radii(replace(mechanism.sketch_configuration, vectors=vectors, nodes=nodes))
    follower = mechanism.couplings[mesh.index].follower.body
    return dict(zip(mesh.links, radii, strict=True)).get(follower)


def _wheels(description: Description, graph: Graph, coupling: Coupled, drawn: Configuration) -> Axes | None:
    follower = coupling.follower
    if follower.kind != "angle" or not coupling.function.linear:
        return None
    rates = _rates(coupling.gap, drawn)
    others = [body for body in rates if body not in (follower.body, GROUND)]
    for driving in (*others, GROUND):
        for carrier in description.links:
            axes = _axis(graph, follower.body, carrier), _axis(graph, driving, carrier)
            if carrier in (follower.body, driving) or min(axes) < 0 or axes[0] == axes[1]:
                continue
            ratio = _ratio(rates, driving, carrier)
            # Against the carrier nothing else may turn.
            left = {body: float(rates.get(body, 0.0)) for body in {*others, carrier} - {GROUND}}
            left[driving] = left.get(driving, 0.0) + float(ratio)
            left[carrier] = left.get(carrier, 0.0) + 1.0 - float(ratio)
            if all(abs(rate) < SAME_RATE for body, rate in left.items() if body != GROUND):
                return (follower.body, driving), carrier, axes
    return None


def _rack(description: Description, graph: Graph, coupling: Coupled) -> Axes | None:
    angles = [part for part in coupling.function.parts if part.kind != "parameter"]
    name = graph.slides[coupling.follower.slide]
    if len(angles) != 1 or angles[0].kind != "angle" or name not in description.joints or not coupling.function.linear:
        return None
    wheel, (guide, *sliders) = angles[0], description.joints[name].links
    axis = _axis(graph, wheel.body, guide)
    if axis < 0 or wheel.reference != guide or not sliders:
        return None
    edge = next(edge for edge in graph.edges if edge.slide == coupling.follower.slide)
    return (sliders[0], wheel.body), guide, (edge.head, axis)


def _axis(graph: Graph, wheel: str, carrier: str) -> int:
    """Node of the pin that two links share; -1 of those that share none."""
    nodes = [
        graph.nodes.index(point) for link, point in graph.points if link == wheel and (carrier, point) in graph.points
    ]
    return nodes[0] if nodes else -1


def _rates(gap: Coordinate, configuration: Configuration) -> dict[str, Value]:
    """By link, the derivative of a coupling's gap with respect to the link's angle (radians)."""
    return pulled(configuration, gap, 1.0).bodies


def _ratio(rates: Mapping[str, Value], driving: str, carrier: str) -> Value:
    return 1.0 + rates.get(carrier, 0.0) if driving == GROUND else -1.0 * rates.get(driving, 0.0)
