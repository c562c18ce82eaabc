"""Wheels of couplings: the pitch circles that two gears, two pulleys or a pinion and its rack roll on.

They follow from the ratio of two angles against the link that carries both axes (Willis), or from that of slides to
an angle against the link that carries the pinion, on which the rack slides or which slides on the rack. With the rates
w of wheels a and b and of their carrier c, the distance e of the axes, and the rate v of a rack, both against c:

    w_b - w_c = i (w_a - w_c),  r_a = |i| r_b,  r_a + r_b = e for i < 0, |r_a - r_b| = e for i > 0;   v = r (w - w_c)
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from mechdesign.mechanism.algebra import Value, Vector, dot
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.coordinates import Coordinate, Coupled
from mechdesign.mechanism.elements.joints import Prismatic
from mechdesign.mechanism.graph import GROUND, Graph
from mechdesign.mechanism.model import Description
from mechdesign.mechanism.outputs import pulled

# Links of a mesh, its carrier, the nodes of its axes, and of a rack a slide and its sense.
Axes = tuple[tuple[str, str], str, tuple[int, int], int, float]
# Rates that differ by less are one rate.
SAME_RATE = 1e-9
# Radius of the larger pulley of a belt, as a part of the distance of the axes.
PULLEY = 0.2


class Pressed(NamedTuple):
    """The force on the link that follows, its place, and of a cam its part along the normal out of the cam."""

    place: Vector
    force: Vector
    normal: Value = np.nan


@dataclass(frozen=True)
class Mesh:
    """Two wheels that roll on each other, or a wheel and a rack.

    Parameters
    ----------
    coupling, index : str, int
        Name and number of the coupling, whose `gap` is zero.
    links : tuple of str
        The link that follows, a wheel or a rack, then the wheel that it follows.
    carrier : str
        The link that carries the axes, or the pinion of a rack.
    axes : tuple of int
        Nodes of the axes of both wheels; of a rack a point of it.
    slide : int
        A slide by which a rack moves against the carrier; -1 of two wheels.
    sense : float
        1 where the slide counts in the direction in which the rack moves by it, -1 where in the other.
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
    sense: float
    belt: bool
    pressure_angle: float
    radius: float

    @property
    def nodes(self) -> tuple[int, int]:
        """Axes of both wheels; of a rack a point of it."""
        return self.axes

    @property
    def presses(self) -> bool:
        """Whether the forces between its links are known."""
        return not self.belt or self.radius > 0

    def ratio(self, configuration: Configuration) -> Value:
        """Rate of the link that follows per rate of the wheel, both against the carrier; of a rack a length."""
        bodies, by_class = configuration.graph.bodies, _rates(self.gap, configuration)
        if self.slide >= 0:
            return -1.0 * by_class[bodies[self.links[1]][0]] / self.weight(configuration)
        return _ratio(by_class, bodies[self.links[1]][0], bodies[self.carrier][0])

    def weight(self, configuration: Configuration) -> Value:
        """Change of the coupling's gap for each unit of the rack's displacement."""
        return pulled(configuration, self.gap, 1.0).slides[self.slide]

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
            along = self.sense * configuration.direction(configuration.graph.edge_of(self.slide))
            return centre - 1j * along * ratio, along
        driven = configuration.nodes[self.axes[0]]
        way = (driven - centre) / np.abs(driven - centre)
        # A wheel inside of a larger one touches it beyond its own axis.
        side = np.where((ratio > 0) & (ratio < 1), -1.0, 1.0)
        touch = centre + side * self.radii(configuration)[1] * way
        return touch, 1j * (touch - driven) / np.abs(touch - driven)

    def place(self, configuration: Configuration) -> Vector:
        """Where the pitch circles touch."""
        return self.contact(configuration)[0]

    def lever(self, configuration: Configuration) -> Value:
        """How fast they move along the pitch circles or the belt for each unit of what follows: its radius."""
        return 1 / self.weight(configuration) if self.slide >= 0 else self.radii(configuration)[0]

    def press(self, configuration: Configuration, effort: Value, pressed: Value | None = None) -> Pressed:
        """The force on the link that follows of an effort on its coordinate.

        Its direction is that of the `pressed` effort where this is given, which makes it linear in the effort. Teeth
        press each other apart by their pressure angle whichever way they drive, a wheel inside of a ring towards the
        ring's axis; a belt only pulls, and its pretension is not known.
        """
        apart: Value = 1.0 if pressed is None else np.sign(effort * pressed)
        driving = effort if pressed is None else pressed
        tangential = effort / self.lever(configuration)
        if self.belt:
            # Its tight part pulls.
            place, _, along = self.strand(configuration, np.where(driving > 0, -1.0, 1.0))
            return Pressed(place, along * (apart * np.abs(tangential)))
        place, along = self.contact(configuration)
        force = along * tangential
        inside = np.logical_and(self.slide < 0, self.ratio(configuration) > 1)
        outwards = dot(1j * along, place - configuration.nodes[self.axes[1]]) > 0
        away = 1j * along * np.where(outwards != inside, 1.0, -1.0)
        return Pressed(place, force + apart * np.abs(force) * np.tan(self.pressure_angle) * away)

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
        if given.wheels == "none" or given.cam is not None:
            continue
        if not coupling.function.linear:
            continue
        slides = pulled(drawn, coupling.gap, 1.0).slides
        axes = (_rack if slides else _wheels)(description, graph, coupling, drawn)
        if axes is not None:
            mesh = Mesh(coupling.name, index, coupling.gap, *axes, False, given.pressure_angle, given.radius)
            equal = not slides and abs(float(mesh.ratio(drawn)) - 1.0) < SAME_RATE
            wheels.append(replace(mesh, belt=given.wheels == "belt" or equal))
    return wheels


def carrier_of(description: Description, graph: Graph, wheels: Sequence[str]) -> str | None:
    """The link that carries the axes of two wheels, at two places; None where no one does."""
    for carrier in description.links:
        axes = [_axis(graph, wheel, carrier) for wheel in wheels]
        if carrier not in wheels and min(axes) >= 0 and axes[0] != axes[1]:
            return carrier
    return None


def _wheels(description: Description, graph: Graph, coupling: Coupled, drawn: Configuration) -> Axes | None:
    follower, rates = coupling.follower, _rates(coupling.gap, drawn)
    class_of = {body: frame for body, (frame, _) in graph.bodies.items()}
    others = [body for body in pulled(drawn, coupling.gap, 1.0).bodies if body not in (follower.body, GROUND)]
    for driving in (*others, GROUND):
        for carrier in description.links:
            axes = _axis(graph, follower.body, carrier), _axis(graph, driving, carrier)
            if carrier in (follower.body, driving) or min(axes) < 0 or axes[0] == axes[1]:
                continue
            ratio = float(_ratio(rates, class_of[driving], class_of[carrier]))
            # Against the carrier nothing else may turn.
            rolling = {class_of[follower.body]: 1.0, class_of[carrier]: ratio - 1.0}
            rolling[class_of[driving]] = rolling.get(class_of[driving], 0.0) - ratio
            if _same(rates, rolling):
                return (follower.body, driving), carrier, axes, -1, 1.0
    return None


def _rack(description: Description, graph: Graph, coupling: Coupled, drawn: Configuration) -> Axes | None:
    """A pinion on a carrier, against which the rack moves by the slides of the coupling, all along one line."""
    rates, moved = _rates(coupling.gap, drawn), pulled(drawn, coupling.gap, 1.0)
    class_of = {body: frame for body, (frame, _) in graph.bodies.items()}
    first, *_ = moved.slides
    for wheel in moved.bodies:
        turning = float(rates[class_of[wheel]])
        for carrier in description.links:
            axis = _axis(graph, wheel, carrier)
            if axis < 0 or turning == 0.0 or not _same(rates, {class_of[wheel]: turning, class_of[carrier]: -turning}):
                continue
            rack, senses = _along(description, graph, carrier, moved.slides)
            lines = [
                complex(sense * drawn.direction(graph.edge_of(slide)) / moved.slides[slide])
                for slide, sense in senses.items()
            ]
            if lines and all(abs(line - lines[0]) < SAME_RATE * abs(lines[0]) for line in lines):
                last, sense = [*senses.items()][-1]
                edge = graph.edges[graph.edge_of(last)]
                node = edge.head if sense > 0 else edge.tail
                return (rack, wheel), carrier, (node, axis), first, senses[first]
    return None


def _along(
    description: Description, graph: Graph, carrier: str, slides: Collection[int]
) -> tuple[str, dict[int, float]]:  # fmt: skip
    """The link to which slides lead from a carrier, one after the other, and the sense of each on this way.

    There are no senses where they lead to no link.
    """
    link, senses = carrier, dict[int, float]()
    joints = {slide: description.joints.get(graph.slides[slide]) for slide in slides}
    while len(senses) < len(slides):
        rest = [(k, j) for k, j in joints.items() if k not in senses and isinstance(j, Prismatic) and link in j.links]
        if not rest:
            return link, {}
        slide, joint = rest[0]
        senses[slide], link = (1.0, joint.slider) if joint.line.link == link else (-1.0, joint.line.link)
    return link, senses


def _same(rates: Mapping[int, Value], rolling: Mapping[int, float]) -> bool:
    """Whether rates are those of rolling, by class of angles; the ground does not turn."""
    classes = {*rates, *rolling} - {0}
    return all(abs(float(rates.get(k, 0.0)) - rolling.get(k, 0.0)) < SAME_RATE for k in classes)


def _axis(graph: Graph, wheel: str, carrier: str) -> int:
    """Node of the pin that two links share; -1 of those that share none."""
    nodes = [
        graph.nodes.index(point) for link, point in graph.points if link == wheel and (carrier, point) in graph.points
    ]
    return nodes[0] if nodes else -1


def _rates(gap: Coordinate, configuration: Configuration) -> dict[int, Value]:
    """By class of angles, the derivative of a coupling's gap with respect to the angle (radians)."""
    rates: dict[int, Value] = {}
    for body, rate in pulled(configuration, gap, 1.0).bodies.items():
        frame = configuration.graph.bodies[body][0]
        rates[frame] = rates.get(frame, 0.0) + rate
    return rates


def _ratio(rates: Mapping[int, Value], driving: int, carrier: int) -> Value:
    """Ratio of wheels by the classes of the one that drives and of the carrier; class 0 is the ground's."""
    return 1.0 + rates.get(carrier, 0.0) if driving == 0 else -1.0 * rates.get(driving, 0.0)
