"""Equilibrium of a mechanism: efforts of its drives and what its joints bear under any forces and moments.

The principle of virtual work for the loop equations of `mechdesign.mechanism.loops`: with a multiplier f of each edge,
the force that it transmits from its head to its tail,

    sum F dX + sum M dtheta + sum S ds + sum f (de - (dX_head - dX_tail)) = 0

for all virtual displacements dX of nodes, dtheta of angle classes and ds of slides. So at each node F is what the edges
take, about each class M + sum(e x f) = 0, and along each slide S + d f = 0. These equations have the transposed matrix
of the positions' derivatives: group by group, backwards through the order in which positions are solved, dyads in
closed form. What is left at the given coordinates are the efforts of the drives. Inertia forces are forces
[d'Alembert].
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from mechdesign.mechanism.algebra import Value, Vector, cross, dot, plus
from mechdesign.mechanism.cams import Engagement
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.derivatives import Linearization
from mechdesign.mechanism.forces import Forces
from mechdesign.mechanism.joint_contacts import Joints
from mechdesign.mechanism.loops import nothing
from mechdesign.mechanism.outputs import pulled
from mechdesign.mechanism.structure import Group
from mechdesign.mechanism.wheels import Pressed


@dataclass(frozen=True, eq=False)
class Balance:
    """A mechanism in equilibrium: `efforts` of the drives, and the force of each edge, from its head to its tail.

    `couplings` are the efforts on the gaps of couplings: what each applies to the coordinate that it sets; 0
    where teeth do that. `pressed` are the same without teeth.
    """

    linear: Linearization
    forces: Forces
    efforts: list[Value]
    edges: list[Vector]
    couplings: list[Value]
    pressing: Mapping[str, Pressed] = field(default_factory=dict)  # forces on the links that follow, by coupling
    pressed: Sequence[Value] = ()  # efforts of the couplings, by which the teeth press


def balance(
    linear: Linearization, forces: Forces, engaged: Sequence[Engagement] = (), *,
    pressed: Sequence[Value] | None = None,
) -> Balance:  # fmt: skip
    """Efforts of the drives that hold forces in equilibrium, and the force that each edge transmits.

    Efforts are moments (per radian) or forces, positive where they drive their coordinate up. At a singularity they are
    not finite. The efforts of couplings are moments alone, but those of links that are `engaged` the forces where these
    touch. Teeth are pressed apart whichever way they drive; as those of the `pressed` efforts where these are given,
    which makes all that they bear linear in the forces.
    """
    held = _balance(linear, forces)
    if not engaged:
        return held
    # The forces of what touches do what the efforts of the couplings do, on any motion: those of the drives stay.
    acting, pressing = Forces(linear.configuration), dict[str, Pressed]()
    for engagement in engaged:
        index = engagement.index
        pressing[engagement.coupling] = push = engagement.press(
            linear.configuration, held.couplings[index], None if pressed is None else pressed[index]
        )
        for link, sign in zip(engagement.links, (1.0, -1.0), strict=True):
            arm = push.place - linear.configuration.nodes[acting.bases[link]]
            acting.on_body(link, sign * push.force, arm=arm)
    return replace(_balance(linear, forces.plus(acting)), pressing=pressing, pressed=held.couplings)


def _balance(linear: Linearization, forces: Forces) -> Balance:
    structure, bodies = linear.structure, linear.graph.bodies
    nodes = list(forces.nodes)
    frames: list[Value] = [0.0] * linear.graph.classes
    slides: list[Value] = [forces.slides.get(slide, 0.0) for slide in range(len(linear.slides))]
    edges: list[Vector] = [0.0] * len(structure.edges)
    for body, (force, moment) in forces.bodies.items():
        base = forces.bases[body]
        nodes[base] = plus(nodes[base], 1, force)
        frames[bodies[body][0]] = frames[bodies[body][0]] + moment

    def transmit(k: int, force: Vector) -> None:
        if nothing(force):
            return
        edge = structure.edges[k]
        edges[k] = plus(edges[k], 1, force)
        frames[edge.frame] = frames[edge.frame] + cross(linear.edge(k), force)
        if edge.slide is not None:
            slides[edge.slide] = slides[edge.slide] + dot(linear.direction(k), force)

    def carry(group: Group, forces: list[Vector]) -> None:
        """Pass forces on a group's nodes on towards the nodes that it starts from."""
        for k, sign in reversed(group.tree):
            edge = structure.edges[k]
            begin, end = (edge.tail, edge.head) if sign > 0 else (edge.head, edge.tail)
            forces[begin] = plus(forces[begin], 1, forces[end])
            transmit(k, sign * forces[end])

    def along(number: int) -> Value:
        """What acts along the coordinate of a value."""
        total: Value = 0.0
        for frame, tie in enumerate(structure.ties):
            for sign, k in tie.given:
                total = plus(total, sign, frames[frame] if k == number else 0.0)
        for slide, k in structure.known_slides:
            total = plus(total, 1, slides[slide] if k == number else 0.0)
        return total

    def pull(coordinate: Coordinate, effort: Value) -> list[Vector]:
        """Add what an effort on a coordinate does to angles and slides; returns its forces at nodes."""
        extra: list[Vector] = [0.0] * len(nodes)
        pulls = pulled(linear.configuration, coordinate, effort)
        for body, moment in pulls.bodies.items():
            frames[bodies[body][0]] = frames[bodies[body][0]] + moment
        for slide, force in pulls.slides.items():
            slides[slide] = slides[slide] + force
        for node, load in pulls.nodes.items():
            extra[node] = load
            on_pins[node] = plus(on_pins[node], 1, load)
        return extra

    couplings: dict[int, Value] = {}
    on_pins = list(forces.nodes)
    for index in reversed(range(len(structure.groups))):
        group = structure.groups[index]
        carry(group, nodes)
        if group.form == "coupled":
            (number,) = group.conditions
            effort = along(number)
            couplings[number] = -1.0 * effort
            nodes = [
                plus(node, 1, extra) for node, extra in zip(nodes, pull(structure.values[number], effort), strict=True)
            ]
        if not group.solved:
            continue
        turning: list[Value] = [0.0] * len(group.angles)
        for frame, tie in enumerate(structure.ties):
            if tie.root in group.angles:
                place = group.angles.index(tie.root)
                turning[place] = turning[place] + frames[frame]
        moving = [*turning, *(slides[slide] for slide in group.slides)]
        moving += [part for base in group.bases for part in (nodes[base].real, nodes[base].imag)]
        held, couples = linear.hold_group(index, group, moving)
        for number, effort in zip(group.conditions, couples, strict=True):
            couplings[number] = effort
            extra = pull(structure.values[number], effort)
            carry(group, extra)
            nodes = [plus(node, 1, force) for node, force in zip(nodes, extra, strict=True)]
        for loop, force in zip(group.loops, held, strict=True):
            nodes[loop.start] = plus(nodes[loop.start], 1, force)
            nodes[loop.end] = plus(nodes[loop.end], -1, force)
            for k, sign in loop.edges:
                transmit(k, sign * force)
    efforts: list[Value] = [plus(0.0, -1, along(k)) for k in range(len(structure.given))]
    acting = replace(forces)
    acting.nodes, acting.bodies, acting.slides = on_pins, forces.bodies, forces.slides
    return Balance(linear, acting, efforts, edges, [couplings[k] for k in structure.numbers])


class Reaction(NamedTuple):
    """What a contact bears: the force on `on` by `by`, the moment about its node, and the normal force.

    That is the force across a slide, or of a cam on its follower.
    """

    force: Vector
    moment: Value
    normal: Value


def reactions(joints: Joints, balance: Balance) -> list[Reaction]:
    """What each contact bears; nan for moments of chains of slides and clamps that equilibrium leaves open."""
    linear, outside = balance.linear, balance.forces.bodies
    forces: list[Vector] = []
    turning: dict[str, Value] = {body: moment for body, (_, moment) in outside.items()}

    def turn(body: str, moment: Value) -> None:
        turning[body] = turning.get(body, 0.0) + moment

    for drive, effort in zip(linear.structure.given, balance.efforts, strict=True):
        if drive.kind == "angle":
            turn(drive.body, effort)
            turn(drive.reference, -1.0 * effort)
    for coupling, effort in zip(joints.couplings, balance.couplings, strict=True):
        for body, moment in pulled(linear.configuration, coupling.gap, effort).bodies.items():
            turn(body, moment)
    for node, body in joints.sole.items():
        if not nothing(force := balance.forces.nodes[node]):
            turn(body, cross(linear.nodes[node] - linear.nodes[joints.bases[body]], force))
    for contact in joints.contacts:
        if contact.engaged is not None:
            # What it does is among the forces on the bodies already.
            forces.append(balance.pressing[contact.joint].force)
            continue
        force = 0.0
        for k, sign in contact.edges:
            force = plus(force, sign, balance.edges[k])
        for body in contact.bodies:
            force = plus(force, -1, outside[body][0] if body in outside else 0.0)
        forces.append(force)
        for body, sign in ((contact.on, 1), (contact.by, -1)):
            if body in joints.bases and not nothing(force):
                arm = linear.nodes[contact.node] - linear.nodes[joints.bases[body]]
                turn(body, sign * cross(arm, force))
    # Moments on the second body of each tie.
    moments: dict[str, Value] = dict.fromkeys(joints.open, np.nan)
    for name, body in joints.order:
        one, other = joints.ties[name]
        moment = turning.get(body, 0.0)
        moments[name] = -1.0 * moment if body == other else moment
        turn(one if body == other else other, moment)
    contact_reactions = []
    for contact, force in zip(joints.contacts, forces, strict=True):
        normal: Value = np.nan
        if contact.slides:
            normal = cross(linear.direction(contact.edges[0][0]), force)
        elif contact.engaged is not None:
            normal = balance.pressing[contact.joint].normal
        moment = 0.0 if contact.turns else moments[contact.joint]
        if contact.joint in joints.ties and contact.on == joints.ties[contact.joint][0]:
            moment = -1.0 * moment
        contact_reactions.append(Reaction(force, moment, normal))
    return contact_reactions
