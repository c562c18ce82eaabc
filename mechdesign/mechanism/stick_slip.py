"""Accelerations of a mechanism with Coulomb friction in its joints, which slide or rest.

A contact that slides with the sign s of its velocity has the friction m = -s c, where c, its limit, is the coefficient
times what it bears. One at rest has any |m| <= c; its relative acceleration is 0 inside of these limits, and against m
at them. For given limits this is the minimum of a convex quadratic function of m,

    m' D m / 2 + alpha' m,  |m_j| <= c_j,

with the relative accelerations alpha + D m. Limits follow from friction and accelerations: they are found by
iteration, where nothing rests by Newton's method. Accelerations are unique; how joints that rest share a load is not,
and theirs is the least friction, as a part of the limits.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.ground.numerics.linear import solved
from mechdesign.mechanism.friction import ROUNDS, Rubs
from mechdesign.mechanism.friction_equations import FrictionSystem
from mechdesign.mechanism.statics import balance

# Most rounds in which limits are found, and the change of friction, as a part of the largest, that ends them.
LIMIT_ROUNDS, CONVERGED = 400, 1e-13
# Most changes of contacts between rest and limit.
SHARING_ROUNDS = 1000
# Motions of contacts at rest that others prevent are rounding, below this part of the others.
ROUNDING = 1e-10
# An acceleration below this part of what it is the sum of is 0: what rests stays where it is.
NOTHING = 1e-13


class Accelerations(NamedTuple):
    """What friction makes of the accelerations.

    Parameters
    ----------
    values : Floats, shape (mobility, poses)
        Accelerations of the coordinates; nan where no friction agrees with them.
    friction : Floats, shape (contacts, poses)
        Moments on `on` by `by`, of a slide forces along it.
    jams : Ints, shape (poses,)
        Number of the contact that jams, -1 where the mechanism moves or rests.
    slack : Floats, shape (contacts, poses)
        Of contacts at rest what is left of their limit, as a part of it; where it is used up, less by how fast friction
        lets them begin to slide, as a part of how fast they would without it. 1 where contacts slide.
    """

    values: Floats
    friction: Floats
    jams: Ints
    slack: Floats


def accelerate(rubs: Rubs, signs: Floats, rates: Floats, offsets: Floats) -> Accelerations:
    """Accelerations of the given coordinates, and friction.

    Parameters
    ----------
    rubs : Rubs
        The mechanism under forces of 1 + mobility + contacts cases: without acceleration, the same with each unit
        acceleration, and the same with none as often as there are contacts.
    signs : Floats, shape (contacts,)
        Of the contacts' velocities, 0 of those at rest.
    rates : Floats, shape (contacts, poses)
        The velocities.
    offsets : Floats, likewise
        The relative accelerations while the given coordinates have none.
    """
    contacts, count = len(rubs.contacts), len(rubs.linear.structure.given)
    cases = 1 + count + contacts
    units = np.eye(cases)[1 + count :].reshape(contacts, cases, 1)
    forces = rubs.forces.plus(rubs.acting(units))
    held = balance(rubs.linear, forces, rubs.engaged)
    table = np.array([np.broadcast_to(effort, (cases, rates.shape[1])) for effort in held.efforts])
    slopes = np.moveaxis(table[:, 1:] - table[:, :1], -1, 0)
    # What a unit of friction takes off the efforts is how fast the coordinate moves the contact.
    matrix, moves = slopes[:, :, :count], -slopes[:, :, count:]
    right = np.concatenate([-table[:, 0].T[..., None], moves], axis=2)
    solution = np.moveaxis(solved(matrix, right)[0], 0, -1)
    free, gains = solution[:, 0], solution[:, 1:]
    freely = offsets + np.einsum("nkp,np->kp", np.moveaxis(moves, 0, -1), free)
    mobility = np.einsum("njp,nkp->jkp", np.moveaxis(moves, 0, -1), gains)
    values, friction, jams = free, np.zeros_like(rates), np.full(rates.shape[1], -1)
    slack = np.ones_like(rates)
    pressed = held.pressed
    for _ in range(ROUNDS):
        if rubs.engaged:
            pressed = [_along(effort, values, friction, cases) for effort in held.pressed]
            borne = rubs.borne(balance(rubs.linear, forces, rubs.engaged, pressed=pressed), (cases,))
        else:
            borne = rubs.borne(held, (cases,))
        start, changes = borne[:, :, 0], borne[:, :, 1:] - borne[:, :, :1]
        start = start + np.einsum("jwnp,np->jwp", changes[:, :, :count], free)
        changes = changes[:, :, count:] + np.einsum("jwnp,nkp->jwkp", changes[:, :, :count], gains)
        if signs.all():
            strength = signs[:, None] * rubs.coefficients
            friction, jams, _ = FrictionSystem(start, changes, strength, rubs.weights).solve(rates)
        else:
            limits = FrictionSystem(start, changes, rubs.coefficients, rubs.weights)
            friction, jams, slack = _resting(limits, signs, mobility, freely)
        parts = gains * friction
        values = free + parts.sum(axis=1)
        values = np.where(np.abs(values) <= NOTHING * (np.abs(free) + np.abs(parts).sum(axis=1)), 0.0, values)
        sides = [np.sign(_along(effort, values, friction, cases)) for effort in held.pressed]
        if all(np.array_equal(np.sign(side), now) for side, now in zip(pressed, sides, strict=True)):
            break
    else:
        values = np.full_like(values, np.nan)
    return Accelerations(values, friction, jams, slack)


def _along(effort: object, accelerations: Floats, friction: Floats, cases: int) -> Floats:
    """An effort with some accelerations and friction, from those of all cases."""
    table = np.broadcast_to(np.asarray(effort, dtype=float), (cases, accelerations.shape[1]))
    total: Floats = table[0] + np.sum((table[1:] - table[0]) * np.concatenate([accelerations, friction]), axis=0)
    return total


def _resting(limits: FrictionSystem, signs: Floats, mobility: Floats, freely: Floats) -> tuple[Floats, Ints, Floats]:
    """Friction where some contacts rest, nan where there is none, the contact with most of it there, and slack."""
    whole, slack, poses = np.zeros_like(freely), np.ones_like(freely), freely.shape[1]
    jams = np.full(poses, -1)
    for pose in range(poses):
        one = limits.take(np.array([pose]))
        friction, growth = np.zeros((len(signs), 1)), np.ones(1)
        for _ in range(LIMIT_ROUNDS):
            before, size = friction, one.residual(friction, growth)[2]
            friction = np.full_like(friction, np.nan)
            if not np.isfinite(size).all():
                break
            friction = _shared(size[:, 0], signs, mobility[..., pose], freely[:, pose])[:, None]
            if np.abs(friction - before).max() <= CONVERGED * np.abs(friction).max():
                break
        else:
            jams[pose] = int(np.abs(friction[:, 0]).argmax())
            friction = np.full_like(friction, np.nan)
        whole[:, pose] = friction[:, 0]
        left, begun = (
            np.where(size > 0, 1.0 - np.abs(friction / size), 0.0)[:, 0],
            freely[:, pose] + mobility[..., pose] @ friction[:, 0],
        )
        slides = (signs == 0) & (left <= ROUNDING)
        slack[:, pose] = np.where(slides, -np.abs(begun / freely[:, pose]), np.where(signs == 0, left, 1.0))
    return whole, jams, slack


def _shared(limits: Floats, signs: Floats, mobility: Floats, freely: Floats) -> Floats:
    """Friction within limits: the least as parts of them, u, that keeps contacts at rest, or -s where they slide.

    A little friction in proportion to u makes the function strictly convex. Then changing one contact a time, the first
    on the wrong side, ends [Murty].
    """
    matrix, right = limits[:, None] * mobility * limits, limits * freely
    convex = matrix + ROUNDING * np.trace(matrix) * np.eye(len(limits))
    parts, resting = -signs, np.flatnonzero((signs == 0) & (limits > 0))
    free = np.isin(np.arange(len(limits)), resting)
    for _ in range(SHARING_ROUNDS):
        parts[free] = 0.0
        parts[free] = np.linalg.solve(convex[np.ix_(free, free)], -(right + matrix @ parts)[free])
        speeds = right + convex @ parts
        outside = free & (np.abs(parts) > 1.0)
        held = np.zeros_like(free)
        held[resting] = parts[resting] * speeds[resting] > 0
        wrong = np.flatnonzero(outside | (held & ~free))
        if not len(wrong):
            break
        first = wrong[0]
        free[first] = not free[first]
        parts[first] = np.sign(parts[first])
    parts[free] = 0.0
    inverse = np.linalg.pinv(matrix[np.ix_(free, free)], rcond=ROUNDING, hermitian=True)
    parts[free] = -inverse @ (right + matrix @ parts)[free]
    share: Floats = parts * limits
    return share
