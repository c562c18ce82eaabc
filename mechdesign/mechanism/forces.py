"""What acts on a mechanism in motion: inertia and weight of its bodies, springs and dampers, and given loads.

Forces of masses m with their centre at X + r U, X the base of their body (its first point), are m (g - a) there, and
-J alpha about it [d'Alembert]; a = a_X + (i alpha - omega^2) r U.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from mechdesign.mechanism.algebra import Value, Vector, cross, dot, norm2, plus
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.coordinates import Coordinate, winding
from mechdesign.mechanism.elements.links import Mass
from mechdesign.mechanism.elements.springs import Spring
from mechdesign.mechanism.geometry import Geometry
from mechdesign.mechanism.outputs import Rates, first, pulled


@dataclass(eq=False)
class Forces:
    """Forces and moments that act on a mechanism from outside of its joints, in a batch of poses.

    Parameters
    ----------
    configuration : Configuration
        The poses.
    nodes : list of Vector
        Force on the pin at each node.
    bodies : dict
        By body, the force on it at its base, and the moment about that.
    slides : dict
        By slide, the force along it on its slider, and against that on its guide.
    parts : list of (str, Vector, Value, Vector)
        What these add up: the body, the force, the moment about where it acts, and the arm from the base to there.
    """

    configuration: Configuration
    nodes: list[Vector] = field(default_factory=list)
    bodies: dict[str, tuple[Vector, Value]] = field(default_factory=dict)
    slides: dict[int, Value] = field(default_factory=dict)
    parts: list[tuple[str, Vector, Value, Vector]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.nodes = [0.0] * len(self.configuration.nodes)
        self.bases = self.configuration.graph.bases

    def on_pin(self, node: int, force: Vector) -> None:
        """Add a force on the pin at a node."""
        self.nodes[node] = plus(self.nodes[node], 1, force)

    def on_body(self, body: str, force: Vector, moment: Value = 0.0, arm: Vector = 0.0) -> None:
        """Add a force on a body at an arm from its base, and a moment."""
        self.parts.append((body, force, moment, arm))
        before = self.bodies.get(body, (0.0, 0.0))
        self.bodies[body] = plus(before[0], 1, force), before[1] + moment + cross(arm, force)

    def on_slide(self, slide: int, force: Value) -> None:
        """Add a force along a slide, on its slider and against that on its guide."""
        self.slides[slide] = self.slides.get(slide, 0.0) + force

    def at(self, point: str, force: Vector) -> None:
        """Add a force at a point: on the pin there, or as ``rod.B`` on the link alone."""
        graph = self.configuration.graph
        node, link = graph.node(point), point.rpartition(".")[0]
        if not link:
            self.on_pin(node, force)
            return
        body = graph.holder(link, graph.nodes[node])
        nodes = self.configuration.nodes
        self.on_body(body, force, arm=nodes[node] - nodes[self.bases[body]])

    def on_coordinate(self, coordinate: Coordinate, effort: Value) -> None:
        """Add an effort on a coordinate: forces and moments that do its work on any motion."""
        pulls = pulled(self.configuration, coordinate, effort)
        for body, moment in pulls.bodies.items():
            self.on_body(body, 0.0, moment)
        for slide, force in pulls.slides.items():
            self.on_slide(slide, force)
        for node, pull in pulls.nodes.items():
            self.on_pin(node, pull)

    def pull(self, ends: tuple[str, str], force: Vector) -> None:
        """Add forces that pull two points together: this one at the first, the opposite at the second."""
        self.at(ends[0], force)
        self.at(ends[1], -1.0 * force)

    def span(self, ends: tuple[str, str]) -> Vector:
        """Vector from one point to another."""
        one, other = (self.configuration.nodes[self.configuration.graph.node(end)] for end in ends)
        between: Vector = other - one
        return between

    def plus(self, other: Forces) -> Forces:
        """The sum of two systems of forces."""
        both = Forces(self.configuration)
        both.nodes = [plus(one, 1, more) for one, more in zip(self.nodes, other.nodes, strict=True)]
        for part in (*self.parts, *other.parts):
            both.on_body(*part)
        both.slides = dict(self.slides)
        for slide, along in other.slides.items():
            both.on_slide(slide, along)
        return both

    @property
    def total(self) -> tuple[Vector, Value]:
        """Sum of all forces, and of their moments about the origin."""
        whole: Vector = 0.0
        moment: Value = 0.0
        nodes = self.configuration.nodes
        for node, force in enumerate(self.nodes):
            whole, moment = plus(whole, 1, force), moment + cross(nodes[node], force)
        for body, (force, own) in self.bodies.items():
            whole, moment = plus(whole, 1, force), moment + own + cross(nodes[self.bases[body]], force)
        return whole, moment

    def power(self, velocity: Rates) -> Value:
        """What all forces together do per time."""
        total: Value = 0.0
        for force, speed in zip(self.nodes, velocity.nodes, strict=True):
            total = total + dot(force + 0j, speed)
        for body, (force, moment) in self.bodies.items():
            frame = self.configuration.graph.bodies[body][0]
            total = total + dot(force + 0j, velocity.nodes[self.bases[body]]) + moment * velocity.angles[frame]
        return total


@dataclass(frozen=True, eq=False)
class Moving:
    """Velocities and accelerations of a mechanism; None where it stands still."""

    velocity: Rates | None = None
    acceleration: Rates | None = None


@dataclass(frozen=True)
class Energy:
    """Energies, and the power that dampers take."""

    kinetic: Value = 0.0
    potential: Value = 0.0
    lost: Value = 0.0

    def __add__(self, other: Energy) -> Energy:
        return Energy(self.kinetic + other.kinetic, self.potential + other.potential, self.lost + other.lost)


def inertia(
    forces: Forces, geometry: Geometry, masses: Mapping[str, Mass], moving: Moving, gravity: complex, factor: float
) -> Energy:
    """Add weights and inertia forces of bodies.

    Parameters
    ----------
    masses : mapping of str to Mass
        By body.
    gravity : complex
        Acceleration of free fall.
    factor : float
        Force that gives a unit of mass a unit of acceleration.
    """
    configuration, places = forces.configuration, forces.configuration.places
    kinetic: Value = 0.0
    potential: Value = 0.0
    for body, given in masses.items():
        mass = factor * geometry.term(given.mass, places)
        moment = factor * inertia_about_center(geometry, body, given, places)
        base = forces.bases[body]
        arm = _arm(forces, geometry, body, given) * configuration.body_rotation(body)
        frame = configuration.graph.bodies[body][0]
        turning: Value = 0.0
        if moving.velocity is not None:
            omega = moving.velocity.angles[frame]
            speed = moving.velocity.nodes[base] + 1j * omega * arm
            kinetic = kinetic + 0.5 * (mass * norm2(speed) + moment * omega * omega)
            if moving.acceleration is not None:
                turning = -1.0 * moment * moving.acceleration.angles[frame]
        forces.on_body(body, inertia_force(forces, moving, body, mass, gravity, arm), turning, arm)
        potential = potential - mass * dot(gravity, configuration.nodes[base] + arm)
    return Energy(kinetic, potential)


def inertia_force(
    forces: Forces, moving: Moving, body: str, mass: Value, gravity: Vector, arm: Vector
) -> Vector:  # fmt: skip
    """Weight and inertia force of a mass (force per acceleration) at an arm from the base of its body."""
    force: Vector = mass * gravity
    if moving.velocity is not None and moving.acceleration is not None:
        frame = forces.configuration.graph.bodies[body][0]
        omega, alpha = moving.velocity.angles[frame], moving.acceleration.angles[frame]
        force = force - mass * (moving.acceleration.nodes[forces.bases[body]] + (1j * alpha - omega * omega) * arm)
    return force


def center(forces: Forces, geometry: Geometry, body: str, given: Mass) -> Vector:
    """Place of a body's centre of mass."""
    arm = _arm(forces, geometry, body, given) * forces.configuration.body_rotation(body)
    return forces.configuration.nodes[forces.bases[body]] + arm


def inertia_about_center(geometry: Geometry, body: str, given: Mass, places: Mapping[str, Value]) -> Value:
    """Moment of inertia of a body about its centre of mass, in units of mass times length squared."""
    if not given.slender:
        return geometry.term(given.inertia, places)
    one, other = (geometry.place(body, point, places) for point in given.points)
    return geometry.term(given.mass, places) * norm2(other - one) / 12


def local_center(geometry: Geometry, body: str, given: Mass, places: Mapping[str, Value]) -> Vector:
    """Centre of mass of a body in its frame."""
    if given.center is None:
        middle: Vector = sum(geometry.place(body, point, places) for point in given.points) / len(given.points)
        return middle
    x, y = (geometry.term(term, places) for term in given.center)
    return x + 1j * y


def _arm(forces: Forces, geometry: Geometry, body: str, given: Mass) -> Vector:
    """From the base of a body to its centre of mass, in its frame."""
    places = forces.configuration.places
    base = geometry.local(body, geometry.graph.nodes[forces.bases[body]], places)
    return local_center(geometry, body, given, places) - base


def springs(forces: Forces, geometry: Geometry, elements: Sequence[Spring], moving: Moving) -> Energy:
    """Add the forces of springs and dampers; those of no length pull in no direction.

    Of the angle between two links its turns count as the configuration has them.
    """
    configuration, places = forces.configuration, forces.configuration.places
    potential: Value = 0.0
    lost: Value = 0.0
    for spring in elements:
        constant, stiffness, free, damping = spring.pull(lambda term: geometry.term(term, places))
        rate: Value = 0.0
        if spring.turning:
            angle = winding(spring)
            stretch = configuration.value(angle) - free
            if moving.velocity is not None:
                rate = first(configuration, angle, moving.velocity)
            forces.on_coordinate(angle, -1.0 * (constant + stiffness * stretch + damping * rate))
        else:
            span = forces.span(spring.between)
            length = np.sqrt(norm2(span))
            stretch = length - free
            along = np.where(length > 0, span / np.where(length > 0, length, 1.0), 0.0)
            if moving.velocity is not None:
                ends = [configuration.graph.node(point) for point in spring.between]
                rate = dot(along, moving.velocity.nodes[ends[1]] - moving.velocity.nodes[ends[0]])
            # Of a free length 0 the pull is the span itself, also where it has no direction.
            pull = stiffness * span + (constant - stiffness * free + damping * rate) * along
            forces.pull(spring.between, pull)
        potential = potential + constant * stretch + 0.5 * stiffness * stretch * stretch
        lost = lost + damping * rate * rate
    return Energy(0.0, potential, lost)
