"""The mechanism as rigid bodies for a simulator: a tree of joints, the joints that close its loops, in SI units.

Slides and clamps come first into the tree, then pins that are drives, then other pins; each joint that would close a
loop stands among the `closures`. A pin in a slot is pinned to a block of its own that slides there. Where a slide
closes a loop, such a block is clamped to its slider instead. A joint's coordinate is the angle of its child against its
parent, or the displacement of its slide, so that every angle of a link is a sum of coordinates along the tree.
"""

from __future__ import annotations

import cmath
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Literal

import numpy as np
from scipy.cluster.hierarchy import DisjointSet

from mechdesign.door.exporting.view import PosedStudy
from mechdesign.ground.cautions import Caution
from mechdesign.mechanism.algebra import TURN
from mechdesign.mechanism.coordinates import Coordinate, winding
from mechdesign.mechanism.core import Bound
from mechdesign.mechanism.elements.links import Mass
from mechdesign.mechanism.elements.springs import Spring
from mechdesign.mechanism.forces import Forces, center, inertia_about_center
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.outputs import pulled
from mechdesign.study.text.units import measure

# Mass of a body without one, as a part of the smallest mass that the study gives, or in kg where it gives none.
SMALL_MASS = 1e-2
# Radius of gyration of a body without moment of inertia, as a part of the mechanism's size.
GYRATION = 0.15
# Natural frequency of a position servo on all masses of the mechanism (1/s).
SERVO = 20.0
# A side of a range that is left open (rad, m).
OPEN = 1e6
# A coefficient of a coordinate that is smaller is none.
NONE = 1e-9

# By the name of a joint, its coefficient in a sum of coordinates.
Sum = dict[str, float]


@dataclass(frozen=True)
class Scales:
    """The study's units in SI units."""

    length: float
    mass: float
    force: float
    time: float

    @classmethod
    def of(cls, view: PosedStudy) -> Scales:
        """Those of a study; a dimensionless length counts as a metre."""
        units = view.study.units
        names = (units.length, units.mass, units.force, units.time)
        return cls(*(1.0 if name == "dimensionless" else measure(f"1 {name}")[2] for name in names))


@dataclass(frozen=True)
class BodyJoint:
    """A joint of two bodies in the pose that is shown; with `parent` and `child` of the tree, or those it closes.

    `place` is where it is in the world (m), `along` the direction of a slide there, in which it moves its `child`
    against its `parent` where its coordinate grows; `value` is its coordinate (rad, m).
    """

    name: str
    kind: Literal["hinge", "slide", "fixed"]
    parent: str
    child: str
    place: complex
    along: complex = 0j
    value: float = 0.0


@dataclass(frozen=True)
class RigidBody:
    """A body in the pose that is shown: its frame, points and centre of mass in this, and its inertia about the centre.

    `link` is the link that it is a part of, `weighed` says that the study gives its mass. All in m, rad and kg.
    """

    name: str
    link: str
    origin: complex
    turn: complex
    points: Mapping[str, complex]
    mass: float
    center: complex
    inertia: float
    weighed: bool

    def local(self, place: complex) -> complex:
        """A place of the world in its frame."""
        return (place - self.origin) * self.turn.conjugate()


@dataclass(frozen=True)
class Pull:
    """A spring and damper between two points, or with `terms` on a sum of coordinates x, in SI units.

    It pulls back with ``stiffness (x - rest) + damping x' + constant``, x without terms the distance of the points.
    """

    terms: Sum | None
    stiffness: float
    rest: float
    damping: float
    constant: float


class RigidBodies:
    """The rigid bodies of a view's mechanism and their joints; `left_out` tells what a simulator does not get."""

    def __init__(self, view: PosedStudy) -> None:
        self.view, self.mechanism, self.scales = view, view.mechanism, Scales.of(view)
        self.graph, self.description = self.mechanism.graph, self.mechanism.description
        self.left_out: list[Caution] = []
        self._blocks: dict[str, tuple[str, str]] = {}
        joints = self._joints()
        self.closures = [joint for joint, closing in joints if closing]
        self.joints = self._tree([joint for joint, closing in joints if not closing])
        self.bodies = {name: self._body(name) for name in (*self.graph.bodies, *self._blocks)}
        if view.study.units.length == "dimensionless":
            self._say("assumed", "lengths are dimensionless: a unit of length is taken as 1 m")
        if self.description.friction:
            self.leave_out("friction", "that of a simulator's joints does not grow with their forces")
        if view.study.dynamics is not None and view.study.dynamics.loads:
            self.leave_out("dynamics.loads", "loads follow time and motion; apply them from your program")

    def _say(self, kind: str, message: str) -> None:
        self.left_out.append(Caution(kind, message))

    def leave_out(self, name: str, why: str) -> None:
        """Tell that a part of the study is not in the file."""
        self._say("incomplete", f"{name} is left out: {why}")

    @property
    def gravity(self) -> complex:
        """Acceleration of free fall that the study gives for dynamics (m/s^2)."""
        section = self.view.study.dynamics
        return 0j if section is None else complex(*section.gravity) * self.scales.length / self.scales.time**2

    @cached_property
    def size(self) -> float:
        """Size of the mechanism (m)."""
        return self.scales.length * self.mechanism.size

    @cached_property
    def small_mass(self) -> float:
        """Mass of bodies without one (kg)."""
        places = self.mechanism.geometry
        given = [float(places.term(mass.mass, {})) for mass in self.description.masses.values()]
        return SMALL_MASS * min((self.scales.mass * mass for mass in given if mass > 0), default=1.0)

    def children(self, parent: str) -> list[BodyJoint]:
        """Joints of the tree by which a body carries others."""
        return [joint for joint in self.joints.values() if joint.parent == parent]

    def angle(self, body: str) -> Sum:
        """The angle of a body as a sum of coordinates, without a constant."""
        above, terms = {joint.child: joint for joint in self.joints.values()}, Sum()
        while body != GROUND:
            joint = above[body]
            if joint.kind == "hinge":
                terms[joint.name] = 1.0
            body = joint.parent
        return terms

    def sum_of(self, coordinate: Coordinate) -> Sum | None:
        """A coordinate or coupling's gap as a sum of joint coordinates without its constant; None where it is none.

        The rate of the sum is that of the coordinate, lengths in m.
        """
        linear = coordinate.linear or coordinate.kind in ("angle", "slide")
        if not linear:
            return None
        pulls, terms = pulled(self.view.pose, coordinate, 1.0), Sum()
        parts = [(float(effort), self.angle(body)) for body, effort in pulls.bodies.items()]
        parts += [
            (float(effort) / self.scales.length, {slide_name(self.graph.slides[slide]): 1.0})
            for slide, effort in pulls.slides.items()
        ]
        for factor, part in parts:
            for name, rate in part.items():
                terms[name] = terms.get(name, 0.0) + factor * rate
        scale = self.scales.length if coordinate.quantity == "length" else 1.0
        return {name: scale * rate for name, rate in terms.items() if abs(rate) > NONE}

    def value(self, terms: Sum) -> float:
        """Value of a sum of coordinates in the pose that is shown."""
        return sum(rate * self.joints[name].value for name, rate in terms.items())

    def range_of(self, bound: Bound, terms: Sum) -> tuple[float, float]:
        """Range of the sum of joint coordinates that a limit bounds."""
        coordinate = bound.coordinate
        scale = self.scales.length if coordinate.quantity == "length" else 1.0
        low, high = (
            side * OPEN if end is None else scale * float(end)
            for side, end in zip((-1, 1), bound.ends(self.mechanism.nominal), strict=True)
        )
        value = scale * float(self.view.pose.value(coordinate))
        if bound.of_angle:
            turn = TURN * round((value - (low + high) / 2) / TURN)
            low, high = low + turn, high + turn
        away = self.value(terms) - value
        return low + away, high + away

    def pull_of(self, spring: Spring) -> Pull:
        """A spring and damper in SI units."""
        scales, geometry = self.scales, self.mechanism.geometry
        pull, stiffness, free, damping = spring.pull(lambda term: float(geometry.term(term, {})))
        # Of a moment per radian, or of a force per length.
        arm = scales.length if spring.turning else 1.0 / scales.length
        pull = pull * scales.force * (arm if spring.turning else 1.0)
        stiffness, damping = stiffness * scales.force * arm, damping * scales.force * scales.time * arm
        terms, rest = None, free * scales.length
        if spring.turning:
            one, other = (self.angle(link) for link in spring.between)
            terms = {name: other.get(name, 0.0) - one.get(name, 0.0) for name in {**other, **one}}
            terms = {name: rate for name, rate in terms.items() if rate}
            rest = self.value(terms) - (float(self.view.pose.value(winding(spring))) - free)
        if stiffness:
            rest, pull = rest - pull / stiffness, 0.0
        return Pull(terms, stiffness, rest, damping, pull)

    @property
    def free(self) -> bool:
        """Whether the study gives efforts of the drives, so that motors move them; servos hold them elsewhere."""
        section = self.view.study.dynamics
        return section is not None and section.forward is not None

    def servo(self, drive: Coordinate) -> tuple[float, float]:
        """Stiffness and damping of a position servo, critically damped with all masses of the mechanism at its size."""
        mass = sum(body.mass for name, body in self.bodies.items() if name != GROUND)
        inertia = mass * (self.size**2 if drive.quantity == "angle" else 1.0)
        return inertia * SERVO**2, 2 * inertia * SERVO

    def place(self, node: int) -> complex:
        """Place of a node in the world (m)."""
        return self.scales.length * complex(self.view.pose.nodes[node])

    def _body(self, name: str) -> RigidBody:
        length, mass, pose = self.scales.length, self.scales.mass, self.view.pose
        geometry, graph = self.mechanism.geometry, self.graph
        body, point = self._blocks.get(name, (name, ""))
        turn = complex(pose.body_rotation(body))
        gyration = (GYRATION * self.size) ** 2
        if point:
            origin = self.place(graph.node(point))
            return RigidBody(name, body, origin, turn, {}, self.small_mass, 0j, self.small_mass * gyration, False)
        local = {at: length * complex(geometry.local(body, at, {})) for owner, at in graph.points if owner == body}
        base = next(iter(local))
        origin = self.place(graph.node(base)) - turn * local[base]
        points = {point: place for point, place in local.items() if ":" not in point}
        given: Mass | None = self.description.masses.get(body)
        weight = 0.0 if given is None else mass * float(geometry.term(given.mass, {}))
        middle = sum(points.values()) / max(len(points), 1)
        if given is not None:
            middle = (length * complex(center(Forces(pose), geometry, body, given)) - origin) * turn.conjugate()
        moment = 0.0 if given is None else mass * length**2 * float(inertia_about_center(geometry, body, given, {}))
        inertia = moment or (weight or self.small_mass) * gyration
        if weight and not moment:
            inertia = min(inertia, SMALL_MASS * weight * gyration)
        link = body.removesuffix(":rod")
        return RigidBody(name, link, origin, turn, points, weight or self.small_mass, middle, inertia, weight > 0)

    def _joints(self) -> list[tuple[BodyJoint, bool]]:
        """Every joint, and whether it closes a loop; those of the tree have no direction yet."""
        graph, whole = self.graph, DisjointSet(self.graph.bodies)
        joints: list[tuple[BodyJoint, bool]] = []
        at_nodes = {graph.node(point): [*bodies] for point, bodies in graph.holders.items()}

        def add(joint: BodyJoint) -> None:
            joints.append((joint, not whole.merge(joint.parent, joint.child)))

        for name, (one, other, point) in graph.clamps.items():
            add(BodyJoint(f"fixed.{name}", "fixed", one, other, self.place(graph.node(point))))
        for number, (name, (guide, slider)) in enumerate(zip(graph.slides, graph.guides, strict=True)):
            edge, value = graph.edge_of(number), self.scales.length * float(self.view.pose.slides[number])
            node, along = graph.edges[edge].head, complex(self.view.pose.direction(edge))
            moved = slider
            if not slider or whole.connected(guide, slider):
                moved = f"{name}:block"
                self._blocks[moved] = (guide, graph.nodes[node])
                whole.add(moved)
            add(BodyJoint(slide_name(name), "slide", guide, moved, self.place(node), along, value))
            if not slider:
                at_nodes[node].append(moved)
            elif moved != slider:
                add(BodyJoint(f"fixed.{name}", "fixed", moved, slider, self.place(node)))
        clamped = {node: DisjointSet(bodies) for node, bodies in at_nodes.items()}
        for one, other, point in graph.clamps.values():
            clamped[graph.node(point)].merge(one, other)
        driven = {frozenset((drive.target, drive.reference)) for drive in self.description.drives.values()}
        pins = [(node, pair) for node, bodies in at_nodes.items() for pair in combinations(bodies, 2)]
        links = {body: body.removesuffix(":rod") for body in graph.bodies}
        pins.sort(key=lambda pin: (frozenset(links.get(body, body) for body in pin[1]) not in driven,
                                   GROUND not in pin[1]))  # fmt: skip
        for node, (one, other) in pins:
            if clamped[node].merge(one, other):
                several = len(at_nodes[node]) > 2
                name = f"pin.{graph.nodes[node]}" + f".{other if one == GROUND else f'{one}.{other}'}" * several
                add(BodyJoint(name.replace(":", "."), "hinge", one, other, self.place(node)))
        return joints

    def _tree(self, joints: Iterable[BodyJoint]) -> dict[str, BodyJoint]:
        """Joints of the tree by name, each with its parent nearer to the ground, and the value of its coordinate."""
        left, tree, reached = [*joints], dict[str, BodyJoint](), [GROUND]
        for body in reached:
            for joint in [joint for joint in left if body in (joint.parent, joint.child)]:
                left.remove(joint)
                child = joint.child if joint.parent == body else joint.parent
                along = joint.along if child == joint.child else -joint.along
                tree[joint.name] = replace(joint, parent=body, child=child, along=along)
                reached.append(child)
        return self._valued(tree)

    def _valued(self, tree: dict[str, BodyJoint]) -> dict[str, BodyJoint]:
        """Give pins the angles that they have, in the turns in which sums of them are the values of the drives."""
        self.joints, pose, fixed = tree, self.view.pose, set[str]()

        def rotation(body: str) -> complex:
            return complex(pose.body_rotation(self._blocks.get(body, (body, ""))[0]))

        for joint in [*tree.values()]:
            if joint.kind == "hinge":
                turn = rotation(joint.child) * rotation(joint.parent).conjugate()
                tree[joint.name] = replace(joint, value=cmath.phase(turn))
        for drive in map(self.mechanism.coordinate, self.mechanism.drives):
            terms = self.sum_of(drive) if drive.kind == "angle" else None
            free = next((name for name in terms or () if name not in fixed and tree[name].kind == "hinge"), None)
            if terms is not None and free is not None:
                away = float(np.asarray(pose.value(drive))) - self.value(terms)
                turns = TURN * round(away / TURN) / terms[free]
                tree[free] = replace(tree[free], value=tree[free].value + turns)
                fixed |= terms.keys()
        return tree


def slide_name(slide: str) -> str:
    """Name of the joint of a slide."""
    return f"slide.{slide}"
