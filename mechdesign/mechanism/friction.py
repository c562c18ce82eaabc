"""Equilibrium with Coulomb friction in joints.

A pin of radius r turns against the moment mu r |F| of its joint force F, a slide moves against mu times the sum of its
normal forces. With the moments and forces of friction m, what the joints bear is affine in them, so that

    m_j + s_j mu_j size_j(V + A m) = 0,  s_j the sign of the relative motion,

is solved for every pose by Newton's method; sizes have corners but are convex. Where the matrix |s_j mu_j A_jk| has a
spectral radius below 1 there is one solution. Elsewhere the coefficients grow from zero to what they are, and the
solution is followed: where it goes to infinity, or turns back, before they are reached, the mechanism jams and there is
no equilibrium.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from mechdesign.mechanism.algebra import Value, largest, quiet
from mechdesign.mechanism.derivatives import Linearization
from mechdesign.mechanism.forces import Forces
from mechdesign.mechanism.model import Friction
from mechdesign.mechanism.outputs import Rates
from mechdesign.mechanism.statics import PIN, Balance, Joints, Reaction, balance, reactions
from mechdesign.mechanism.wheels import Engagement
from mechdesign.numerics.arrays import Complexes, Flags, Floats, Ints

# Members whose relative rate is below this part of the fastest in the mechanism do not move against each other.
AT_REST = 1e-9
# Residual of a solution, as a part of the sum of its terms.
SOLVED = 1e-12
# Most steps of Newton's method; where there is one solution, with steps of the contraction between them.
STEPS = 200
# Following a solution: steps of Newton's method, the longest and the shortest step of the coefficients' growth.
FOLLOWING_STEPS, LONGEST, SHORTEST = 12, 1 / 16, 1e-6
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


def rubbings(joints: Joints, frictions: Mapping[str, Friction]) -> list[Rubbing]:
    """The contacts with friction of a mechanism."""
    graph = joints.graph
    carriers = {
        contact.by: contact.on for contact in reversed(joints.contacts)
        if contact.by.startswith(PIN) and contact.joint == contact.by.removeprefix(PIN)
    }  # fmt: skip
    slides = {name: slide for slide, name in enumerate(graph.slides)}
    found = []
    for k, contact in enumerate(joints.contacts):
        if contact.joint not in frictions:
            continue
        slide = slides.get(contact.joint)
        if slide is not None:
            guide, slider = joints.guides[slide]
            edge = graph.edge_of(slide)
            found.append(Rubbing(contact.joint, k, slider or "", guide, slide, edge, frictions[contact.joint]))
        elif contact.turns and (by := carriers.get(contact.by, contact.by)) != contact.on:
            found.append(Rubbing(contact.joint, k, contact.on, by, None, -1, frictions[contact.joint]))
    return found


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
        self.size, geometry = size or 1.0, linear.geometry
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
        """Relative rates of the contacts, 0 where both members are at rest against each other."""
        bodies = self.linear.graph.bodies
        speed = largest([*(np.abs(node) for node in rates.nodes), *rates.slides])
        turning = np.maximum(largest(rates.angles), speed / self.size)
        values = []
        for contact in self.contacts:
            if contact.slide is None:
                rate = rates.angles[bodies[contact.on][0]] - rates.angles[bodies[contact.by][0]]
                fastest = turning
            else:
                rate, fastest = rates.slides[contact.slide], turning * self.size
            values.append(self._flat(np.where(np.abs(rate) > AT_REST * fastest, rate, 0.0)))
        return np.stack(values)

    @cached_property
    def _free(self) -> tuple[Complexes, Complexes]:
        """What the contacts bear without friction, and its slopes."""
        held = balance(self.linear, self.forces, self.engaged)
        return self._borne(held), self._slopes(held)

    @quiet
    def solve(self, rates: Rates, *, back: bool = False) -> Rubbed:
        """The equilibrium while the mechanism moves at some rates, or `back` against them; their signs count."""
        relative = -self.relative(rates) if back else self.relative(rates)
        strength = np.sign(relative) * self.coefficients
        friction = np.zeros_like(relative)
        borne, slopes = self._free
        for _ in range(ROUNDS):
            system = _System(borne - np.einsum("jwkn,kn->jwn", slopes, friction), slopes, strength, self.weights)
            friction, jams, apart = system.solve(relative)
            held = balance(self.linear, self.forces.plus(self._acting(friction)), self.engaged)
            borne, told = self._borne(held), system.borne(friction)
            wrong = np.abs(borne - told).max(axis=(0, 1)) > 1e-9 * np.abs(borne).max(axis=(0, 1))
            if not self.engaged or not wrong.any():
                break
            slopes = self._slopes(held)
        else:
            friction[:, wrong] = np.nan
            jams[wrong] = np.abs(system.strength).argmax(axis=0)[wrong]
            held = balance(self.linear, self.forces.plus(self._acting(friction)), self.engaged)
        friction, relative = (values.reshape(len(self.contacts), *self.shape) for values in (friction, relative))
        return Rubbed(held, friction, relative, jams.reshape(self.shape), apart.reshape(self.shape))

    def _acting(self, friction: Floats) -> Forces:
        """Moments and forces of friction on the members of all contacts."""
        acting = Forces(self.linear.configuration)
        for contact, values in zip(self.contacts, friction, strict=True):
            value = values.reshape(self.shape)
            if contact.slide is not None:
                acting.on_slide(contact.slide, value)
            else:
                acting.on_body(contact.on, 0.0, value)
                acting.on_body(contact.by, 0.0, -value)
        return acting

    def _slopes(self, held: Balance) -> Complexes:
        """What a unit of friction in each contact changes of what the contacts bear, shape (j, 1 or 2, k, poses)."""
        count, size = len(self.contacts), int(np.prod(self.shape))
        slopes = np.empty((count, self.weights.shape[1], count, size), dtype=complex)
        for k, unit in enumerate(np.eye(count)):
            alone = self._acting(np.broadcast_to(unit[:, None], (count, size)))
            slopes[:, :, k] = self._borne(balance(self.linear, alone, self.engaged, pressed=held.couplings))
        return slopes

    def _borne(self, held: Balance) -> Complexes:
        """The force of each pin, and the force across and the moment of each slide, shape (contacts, 1 or 2, poses)."""
        whole = reactions(self.joints, held)
        borne = np.zeros(self.weights.shape, dtype=complex)
        for row, contact in zip(borne, self.contacts, strict=True):
            reaction = whole[contact.contact]
            if contact.slide is None:
                row[0] = self._flat_force(reaction.force)
                continue
            along, force = self.linear.direction(contact.edge), held.edges[contact.edge]
            row[0] = self._flat(along.real * force.imag - along.imag * force.real)
            if contact.friction.length is not None:
                row[1] = self._flat(reaction.moment)
        return borne

    def _flat_force(self, force: object) -> Complexes:
        return np.broadcast_to(np.asarray(force, dtype=complex), self.shape).reshape(-1)

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


class _System:
    """The equations of friction m + strength size(V + A m) = 0 at a flat batch of poses."""

    def __init__(self, borne: Complexes, slopes: Complexes, strength: Floats, weights: Floats) -> None:
        # Contacts at rest take no part, also where what they bear is not known.
        rest = strength == 0
        if rest.any():
            borne, slopes = np.where(rest[:, None], 0.0, borne), np.where(rest[:, None, None], 0.0, slopes)
        self.start, self.slopes, self.strength, self.weights = borne, slopes, strength, weights
        self.count, self.poses = strength.shape

    def take(self, rows: Ints) -> _System:
        """Some of the poses."""
        return _System(self.start[..., rows], self.slopes[..., rows], self.strength[:, rows], self.weights[..., rows])

    def borne(self, friction: Floats) -> Complexes:
        """What the contacts bear with some friction."""
        borne: Complexes = self.start + np.einsum("jwkn,kn->jwn", self.slopes, friction)
        return borne

    def residual(self, friction: Floats, growth: Floats) -> tuple[Floats, Floats, Floats]:
        """Residuals, shape (contacts, poses), the matrix of their derivatives, and the sizes of friction."""
        borne = self.borne(friction)
        one, weight, slope = borne[:, 0], self.weights[:, 0], self.slopes[:, 0]
        if borne.shape[1] > 1:
            second = self.weights[:, 1] * np.abs(borne[:, 1]) > weight * np.abs(one)
            one, weight = np.where(second, borne[:, 1], one), np.where(second, self.weights[:, 1], weight)
            slope = np.where(second[:, None], self.slopes[:, 1], slope)
        length = np.abs(one)
        pull = self.strength * weight
        toward = growth * pull * np.conj(one) / np.where(length == 0, 1.0, length)
        matrix = toward.real[:, None] * slope.real - toward.imag[:, None] * slope.imag + np.eye(self.count)[:, :, None]
        size = pull * length
        return friction + growth * size, matrix, size

    @cached_property
    def bounds(self) -> Floats:
        """Largest change of each contact's friction by that of another, shape (j, k, poses)."""
        return np.asarray(np.abs(self.strength)[:, None] * (self.weights[:, :, None] * np.abs(self.slopes)).max(axis=1))

    @cached_property
    def _least(self) -> Floats:
        return np.asarray(np.abs(self.strength) * (self.weights * np.abs(self.start)).max(axis=1))

    def tolerance(self, friction: Floats) -> Floats:
        """Residual that is rounding."""
        size = np.abs(friction)
        terms = self._least + np.einsum("jkn,kn->jn", self.bounds, size) + size
        return np.asarray(SOLVED * terms)

    def solve(self, rates: Floats) -> tuple[Floats, Ints, Floats]:
        """Friction, nan where there is no equilibrium; the contact that jams there, else -1; and how far from jamming.

        That is the determinant of the equations' derivatives, from 0, where they jam, to 1.
        """
        friction, jams = np.full((self.count, self.poses), np.nan), np.full(self.poses, -1)
        finite = np.isfinite(self.bounds).all(axis=(0, 1)) & np.isfinite(self._least).all(axis=0)
        # A matrix K >= 0 has a spectral radius below 1 where (I - K) v = 1 has a solution v > 0.
        bounds = np.where(finite, self.bounds, 0.0)
        weights, regular = _solved(np.eye(self.count)[:, :, None] - bounds, np.ones((self.count, self.poses)))
        single = finite & regular & (weights > 0).all(axis=0)
        rows = np.flatnonzero(single)
        friction[:, rows] = self.take(rows)._contracted(weights[:, rows])
        rows = np.flatnonzero(finite & np.isnan(friction).any(axis=0))
        if len(rows):
            friction[:, rows], jams[rows] = self.take(rows)._followed(rates[:, rows])
        # One step more, which is exact beside the corners of the sizes.
        residual, matrix, _ = self.residual(friction, np.ones(self.poses))
        better = friction - _solved(matrix, residual)[0]
        good = (np.abs(self.residual(better, np.ones(self.poses))[0]) <= np.abs(residual)).all(axis=0)
        return np.where(good, better, friction), jams, np.clip(_determinant(matrix), 0.0, 1.0)

    def _contracted(self, scale: Floats) -> Floats:
        """The one solution, where the equations are a contraction in the largest of the residuals over `scale`."""
        friction, growth = np.zeros((self.count, self.poses)), np.ones(self.poses)
        residual, matrix, _ = self.residual(friction, growth)
        for _ in range(STEPS):
            if (np.abs(residual) <= self.tolerance(friction)).all():
                return friction
            newton = friction - _solved(matrix, residual)[0]
            trial, trial_matrix, _ = self.residual(newton, growth)
            before, after = (np.abs(values / scale).max(axis=0) for values in (residual, trial))
            good = after < 0.9 * before
            plain = np.where(good, newton, friction - residual)
            if not good.all():
                trial, trial_matrix, _ = self.residual(plain, growth)
            done = (np.abs(residual) <= self.tolerance(friction)).all(axis=0)
            friction = np.where(done, friction, plain)
            residual = np.where(done, residual, trial)
            matrix = np.where(done, matrix, trial_matrix)
        return np.where((np.abs(residual) <= self.tolerance(friction)).all(axis=0), friction, np.nan)

    def _followed(self, rates: Floats) -> tuple[Floats, Ints]:
        """Solutions followed from no friction on, and which contact jams where they end before the coefficients."""
        friction = np.zeros((self.count, self.poses))
        growth, step = np.zeros(self.poses), np.full(self.poses, LONGEST)
        while len(rows := np.flatnonzero((growth < 1) & (step > SHORTEST))):
            part = self.take(rows)
            ahead = np.minimum(growth[rows] + step[rows], 1.0)
            there, good = part._corrected(friction[:, rows], ahead)
            friction[:, rows[good]], growth[rows[good]] = there[:, good], ahead[good]
            step[rows] = np.where(good, np.minimum(2 * step[rows], LONGEST), step[rows] / 2)
        # What grows fastest where it ends takes most of the power.
        _, matrix, size = self.residual(friction, growth)
        lost = np.abs(_solved(matrix, size)[0] * rates)
        jammed = growth < 1
        return np.where(jammed, np.nan, friction), np.where(jammed, np.nan_to_num(lost).argmax(axis=0), -1)

    def _corrected(self, friction: Floats, growth: Floats) -> tuple[Floats, Flags]:
        """Solutions near to some, and where they are found on the same side of all folds and poles."""
        residual, matrix, _ = self.residual(friction, growth)
        good: Flags = np.zeros(self.poses, dtype=bool)
        for _ in range(FOLLOWING_STEPS):
            friction = friction - _solved(matrix, residual)[0]
            residual, matrix, _ = self.residual(friction, growth)
            good = np.asarray((np.abs(residual) <= self.tolerance(friction)).all(axis=0))
            if good.all():
                break
        return friction, np.asarray(good & (_determinant(matrix) > 0))


def _determinant(matrix: Floats) -> Floats:
    """Determinants of matrices, shape (k, k, poses); 0 where one is not finite."""
    lead = np.moveaxis(matrix, -1, 0)
    good = np.asarray(np.isfinite(lead).all(axis=(1, 2)))
    return np.asarray(np.linalg.det(np.where(good[:, None, None], lead, 0.0)))


def _solved(matrix: Floats, right: Floats) -> tuple[Floats, Flags]:
    """Solutions of linear systems, shape (k, poses), nan where a matrix is singular; and where it is regular."""
    lead, good = np.moveaxis(matrix, -1, 0), np.asarray(_determinant(matrix) != 0)
    safe = np.where(good[:, None, None], lead, np.eye(lead.shape[-1]))
    solution = np.linalg.solve(safe, right.T[..., None])[..., 0].T
    return np.where(good, solution, np.nan), good


class Efficiency(NamedTuple):
    """Power that comes out over power that goes in, 0 to 1; and poses in which loads drive, yet friction holds."""

    value: Value
    holds: Flags


@quiet
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
