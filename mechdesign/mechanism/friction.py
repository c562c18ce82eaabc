"""Equilibrium with Coulomb friction in joints.

A pin of radius r turns against the moment mu r |F| of its joint force F, a slide moves against mu times the sum of its
normal forces. What the joints bear depends on friction in turn: see `mechdesign.mechanism.friction_equations`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.mechanism.algebra import Value, Vector, largest
from mechdesign.mechanism.cams import Engagement
from mechdesign.mechanism.derivatives import Linearization
from mechdesign.mechanism.elements.joints import Friction
from mechdesign.mechanism.forces import Forces
from mechdesign.mechanism.friction_equations import FrictionSystem
from mechdesign.mechanism.graph import Graph
from mechdesign.mechanism.joint_contacts import PIN, Joints
from mechdesign.mechanism.outputs import Rates
from mechdesign.mechanism.statics import Balance, Reaction, balance, reactions

# Members whose relative rate is below this part of the fastest in the mechanism do not move against each other.
AT_REST = 1e-9
# Rounds in which the teeth of wheels, that are pressed apart whichever way they drive, find their sides.
ROUNDS = 8
# Power below this part of the largest is rounding.
NO_POWER = 1e-9


class Rubbing(NamedTuple):
    """A contact with friction: its number among those of `Joints`, what rubs on what, and of a slide its number.

    The pin of several links is fixed in the `by` of their contacts. `edge` is that of the slide.
    """

    joint: str
    contact: int
    on: str
    by: str
    slide: int | None
    edge: int
    friction: Friction

    def rate(self, graph: Graph, rates: Rates) -> Value:
        """How fast the members move against each other."""
        if self.slide is not None:
            return rates.slides[self.slide]
        on, by = (rates.angles[graph.bodies[body][0]] for body in (self.on, self.by))
        return on - by


def rubbings(joints: Joints, frictions: Mapping[str, Friction]) -> Iterator[Rubbing]:
    """The contacts with friction of a mechanism."""
    graph = joints.graph
    carriers = {
        contact.by: contact.on for contact in reversed(joints.contacts)
        if contact.by.startswith(PIN) and contact.joint == contact.by.removeprefix(PIN)
    }  # fmt: skip
    slides = {name: slide for slide, name in enumerate(graph.slides)}
    for k, contact in enumerate(joints.contacts):
        if contact.joint not in frictions:
            continue
        slide = slides.get(contact.joint)
        if slide is not None:
            guide, slider = graph.guides[slide]
            edge = graph.edge_of(slide)
            yield Rubbing(contact.joint, k, slider, guide, slide, edge, frictions[contact.joint])
        elif contact.turns and (by := carriers.get(contact.by, contact.by)) != contact.on:
            yield Rubbing(contact.joint, k, contact.on, by, None, -1, frictions[contact.joint])


@dataclass(frozen=True, eq=False)
class Rubbed:
    """A mechanism in equilibrium with friction.

    Parameters
    ----------
    balance : Balance
        Its forces and efforts; nan where it jams.
    friction : Floats, shape (rubbings, ...)
        Moments on `on` by `by`, of a slide forces along it.
    rates : Floats, likewise
        The relative rates.
    jams : Ints, shape of the poses
        Number of the rubbing that jams, -1 where the mechanism moves.
    apart : Floats, likewise
        How far from jamming it is, from 0 to 1: forces lose so many digits.
    """

    balance: Balance
    friction: Floats
    rates: Floats
    jams: Ints
    apart: Floats

    @property
    def power(self) -> Floats:
        """Power of friction in each contact, never positive."""
        power: Floats = self.friction * self.rates
        return power


class Rubs:
    """A mechanism with friction at some poses, under given forces.

    Parameters
    ----------
    joints : Joints
        The joints of the mechanism.
    contacts : list of Rubbing
        Those of the joints with friction.
    size : float
        Size of the mechanism.
    """

    def __init__(
        self, joints: Joints, contacts: Sequence[Rubbing], linear: Linearization, forces: Forces,
        engaged: Sequence[Engagement], size: float,
    ) -> None:  # fmt: skip
        self.joints, self.contacts, self.linear, self.forces, self.engaged = joints, contacts, linear, forces, engaged
        self.size, geometry = size, linear.geometry
        self.shape = linear.configuration.shape
        places = linear.configuration.places
        self.coefficients = np.stack([self._flat(geometry.term(c.friction.coefficient, places)) for c in contacts])
        weights = []
        for contact in contacts:
            radius, length = (
                None if term is None else geometry.term(term, places)
                for term in (contact.friction.radius, contact.friction.length)
            )
            pair = (1.0 if radius is None else radius, 0.0 if length is None else 2 / length)
            weights.append([self._flat(weight) for weight in pair])
        # The second number of a contact, the moment of a slide, counts where a length is given.
        sides = 2 if any(contact.friction.length is not None for contact in contacts) else 1
        self.weights = np.array(weights)[:, :sides]

    def _flat(self, value: Value) -> Floats:
        return np.broadcast_to(np.asarray(value, dtype=float), self.shape).reshape(-1)

    def relative(self, rates: Rates) -> Floats:
        """Relative rates of the contacts, shape (contacts, poses); 0 where both members rest against each other."""
        speed = largest([*(np.abs(node) for node in rates.nodes), *rates.slides])
        turning = np.maximum(largest(rates.angles), speed / self.size)
        values = []
        for contact in self.contacts:
            rate = contact.rate(self.linear.graph, rates)
            fastest = turning if contact.slide is None else turning * self.size
            values.append(self._flat(np.where(np.abs(rate) > AT_REST * fastest, rate, 0.0)))
        return np.stack(values)

    @cached_property
    def smooth(self) -> Balance:
        """The equilibrium without friction."""
        return balance(self.linear, self.forces, self.engaged)

    @cached_property
    def _free(self) -> tuple[Complexes, Complexes]:
        """What the contacts bear without friction, and its slopes."""
        return self.borne(self.smooth), self._slopes(self.smooth)

    def solve(self, rates: Rates, *, back: bool = False) -> Rubbed:
        """The equilibrium while the mechanism moves at some rates, or `back` against them; their signs count."""
        relative = -self.relative(rates) if back else self.relative(rates)
        strength = np.sign(relative) * self.coefficients
        friction = np.zeros_like(relative)
        borne, slopes = self._free
        for _ in range(ROUNDS):
            system = FrictionSystem(borne - np.einsum("jwkn,kn->jwn", slopes, friction), slopes, strength, self.weights)
            friction, jams, apart = system.solve(relative)
            held = self._with(friction)
            borne, expected = self.borne(held), system.borne(friction)
            wrong = np.abs(borne - expected).max(axis=(0, 1)) > 1e-9 * np.abs(borne).max(axis=(0, 1))
            if not self.engaged or not wrong.any():
                break
            slopes = self._slopes(held)
        else:
            friction[:, wrong] = np.nan
            jams[wrong] = np.abs(system.strength).argmax(axis=0)[wrong]
            held = self._with(friction)
        friction, relative = self.shaped(friction), self.shaped(relative)
        return Rubbed(held, friction, relative, jams.reshape(self.shape), apart.reshape(self.shape))

    def given(self, friction: Floats, rates: Rates) -> Rubbed:
        """The equilibrium with known moments and forces of friction, shape (contacts, poses)."""
        moves, shape = self.shaped(self.relative(rates)), self.shape
        return Rubbed(self._with(friction), self.shaped(friction), moves, np.full(shape, -1), np.ones(shape))

    def shaped(self, values: Floats) -> Floats:
        """Values of contacts in the shape of the poses."""
        return values.reshape(len(self.contacts), *self.shape)

    def _with(self, friction: Floats) -> Balance:
        return balance(self.linear, self.forces.plus(self.acting(self.shaped(friction))), self.engaged)

    def acting(self, friction: Floats) -> Forces:
        """Moments and forces of friction on the members of all contacts, shape (contacts, ...)."""
        acting = Forces(self.linear.configuration)
        for contact, value in zip(self.contacts, friction, strict=True):
            if contact.slide is not None:
                acting.on_slide(contact.slide, value)
            else:
                acting.on_body(contact.on, 0.0, value)
                acting.on_body(contact.by, 0.0, -value)
        return acting

    def _slopes(self, held: Balance) -> Complexes:
        """What a unit of friction in each contact changes of what the contacts bear, shape (j, 1 or 2, k, poses)."""
        count = len(self.contacts)
        units = np.eye(count).reshape(count, count, *(1 for _ in self.shape))
        return self.borne(balance(self.linear, self.acting(units), self.engaged, pressed=held.pressed), (count,))

    def borne(self, held: Balance, cases: tuple[int, ...] = ()) -> Complexes:
        """The force of each pin, and the force across and the moment of each slide.

        Its shape is (contacts, 1 or 2, poses), with an axis of `cases` before that of the poses.
        """
        whole, shape = reactions(self.joints, held), (*cases, *self.shape)
        contacts, sides, size = self.weights.shape
        borne = np.zeros((contacts, sides, *cases, size), dtype=complex)
        for row, contact in zip(borne, self.contacts, strict=True):
            reaction = whole[contact.contact]
            parts: list[Vector] = [reaction.force]
            if contact.slide is not None:
                along, force = self.linear.direction(contact.edge), held.edges[contact.edge]
                parts = [along.real * force.imag - along.imag * force.real]
                parts += [reaction.moment] if contact.friction.length is not None else []
            for side, part in enumerate(parts):
                row[side] = np.broadcast_to(np.asarray(part, dtype=complex), shape).reshape(*cases, size)
        return borne

    def reactions(self, rubbed: Rubbed) -> list[Reaction]:
        """What each contact bears, with the moments of friction in pins."""
        whole = reactions(self.joints, rubbed.balance)
        numbers = {(c.joint, c.on): k for k, c in enumerate(self.joints.contacts)}
        for contact, values in zip(self.contacts, rubbed.friction, strict=True):
            if contact.slide is not None:
                continue
            moment, own = values, contact.contact
            whole[own] = whole[own]._replace(moment=whole[own].moment + moment)
            if self.joints.contacts[own].by != contact.by:
                # The pin passes it on to the link that it is fixed in.
                other = numbers[contact.joint, contact.by]
                whole[other] = whole[other]._replace(moment=whole[other].moment - moment)
        return whole


class Efficiency(NamedTuple):
    """Power that comes out over power that goes in, 0 to 1; and poses in which loads drive, yet friction holds."""

    value: Value
    holds: Flags


def efficiency(efforts: Sequence[Value], rates: Sequence[Value], lost: Floats) -> Efficiency:
    """Efficiency at poses, from efforts and rates of the drives and the (negative) power of friction."""
    powers = np.broadcast_arrays(lost, *(effort * rate for effort, rate in zip(efforts, rates, strict=True)))[1:]
    driven = sum(powers)
    borne = -driven - lost
    largest_power = np.abs(lost) + sum(np.abs(power) for power in powers)
    put_in = np.maximum(driven, 0.0) + np.maximum(borne, 0.0)
    taken = np.maximum(-driven, 0.0) + np.maximum(-borne, 0.0)
    least = NO_POWER * largest_power
    return Efficiency(np.where(put_in > 0, taken / put_in, np.nan), (driven >= -least) & (borne > least))
