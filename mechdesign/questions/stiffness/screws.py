"""Screws in the plane: reciprocal wrenches of a serial leg, its constraint-space compliance, its equivalent springs.

Twists are (dx, dy, dphi) of the body at the origin (axis coordinates), wrenches (fx, fy, mz) about it (ray
coordinates), so that power is their plain product. Arrays have components first and poses last, which keeps every
operation a pass over contiguous poses. Every elastic element is a joint with a spring: an actuator at its joint, and a
beam of length L three of them at mid-span, where its compliance is diagonal: a slide along it (EA/L), a slide across
(12 EI/L^3, with shear in series) and a hinge (EI/L); carried to the tip they are the beam's matrix [S4, eq. 24].
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats, Ints
from mechdesign.mechanism.algebra import Value, cross, picked, vector

# Singular values below this fraction of the largest one count as zero. Elbows at full stretch, which are found through
# the root of a difference, are straight to 1e-8 only.
RANK = 1e-7
# Compliances below this fraction of a leg's largest one are rounding: the leg is rigid there.
RIGID = 1e-12


def hinge_twist(place: Complexes) -> Floats:
    """Twist (3, n) of a revolute joint at places (n,) seen from the origin: [py, -px, 1]  [S4, eq. 6]."""
    return np.stack([place.imag, -place.real, np.ones(place.shape)])


def slide_twist(direction: Complexes) -> Floats:
    """Twist (3, n) of a prismatic joint along unit vectors (n,): [ax, ay, 0]."""
    return np.stack([direction.real, direction.imag, np.zeros(direction.shape)])


def screw_product(a: Floats, b: Floats) -> Floats:
    """Cross product over the leading axis (3): the wrench on which two twists do no work, or the other way round."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


@dataclass(frozen=True, eq=False)
class LegScrews:
    """A serial leg in n poses.

    Parameters
    ----------
    passive, elastic : sequence of ndarray, shape (3, n)
        Twists of its free joints, and of its elastic ones.
    compliance : sequence of float or ndarray, shape (n,)
        Compliances of the elastic joints.
    base, tip : complex ndarray, shape (n,)
        Places of its first and last joint, seen from the origin.
    """

    passive: Sequence[Floats]
    elastic: Sequence[Floats]
    compliance: Sequence[Value]
    base: Complexes
    tip: Complexes

    def take(self, index: Ints) -> LegScrews:
        """The leg in the poses `index`."""
        return LegScrews(
            [twist[:, index] for twist in self.passive],
            [twist[:, index] for twist in self.elastic],
            [picked(c, index) for c in self.compliance],
            self.base[index],
            self.tip[index],
        )


def joint_rank(passive: Sequence[Floats], length: Value) -> Ints | int:
    """Rank of the free joints' twists in each pose; rotations are scaled by `length`, one for all poses or one each."""
    count = len(passive)
    if count < 2:
        return count
    units = [_scaled(twist, length) for twist in passive]
    if count == 2:
        return 1 + np.asarray(np.linalg.norm(screw_product(*units), axis=0) > RANK, dtype=np.intp)
    matrices = np.moveaxis(np.stack(units), 2, 0)
    values = np.linalg.svd(matrices, compute_uv=False)
    return np.asarray((values > RANK * values[:, :1]).sum(axis=1), dtype=np.intp)


def reciprocal_wrenches(passive: Sequence[Floats], rank: int, length: Value, count: int) -> Floats:
    """Wrenches on which free joints of a given rank do no work, a basis (3, 3 - rank, n)  [S4, eqs. 13-15].

    Closed form for up to two independent joints; the null space by singular values where joints depend on each other.
    """
    if rank == 0:
        return np.repeat(np.eye(3)[:, :, None], count, axis=2)
    if rank == len(passive) == 1:
        return _one_joint(passive[0])
    if rank == len(passive) == 2:
        wrench = screw_product(*passive)
        size = np.sqrt(wrench[0] ** 2 + wrench[1] ** 2 + (wrench[2] / length) ** 2)
        return np.asarray((wrench / size)[:, None])
    matrices = np.moveaxis(np.stack([_scaled(twist, length) for twist in passive]), 2, 0)
    _, _, rows = np.linalg.svd(matrices)
    basis = np.moveaxis(rows[:, rank:], 0, -1).swapaxes(0, 1).copy()
    basis[2] *= length
    return np.asarray(basis)


def _one_joint(twist: Floats) -> Floats:
    """Two wrenches, shape (3, 2, n), on which the twist of a single joint does no work."""
    dx, dy, turn = twist
    one, zero = np.ones(dx.shape), np.zeros(dx.shape)
    if turn.all():
        # A hinge: all forces through its pin.
        return np.stack([np.stack([one, zero]), np.stack([zero, one]), np.stack([-dx / turn, -dy / turn])])
    return np.stack([np.stack([-dy, zero]), np.stack([dx, zero]), np.stack([zero, one])])


def constraint_compliance(wrenches: Floats, chain: LegScrews) -> Floats:
    """C_c = W^T C W, shape (m, m, n), as the sum over elastic joints of c (W^T s)(W^T s)^T  [S4, eq. 20]."""
    _, m, n = wrenches.shape
    total = np.zeros((m, m, n))
    for twist, compliance in zip(chain.elastic, chain.compliance, strict=True):
        work = wrenches[0] * twist[0] + wrenches[1] * twist[1] + wrenches[2] * twist[2]
        total += (work * compliance)[:, None] * work
    return total


class EquivalentSpring(NamedTuple):
    """One equivalent spring of a leg in n poses.

    Parameters
    ----------
    stiffness : ndarray, shape (n,)
        Force per length along its line, or moment per radian; infinite where rigid.
    place : complex ndarray, shape (n,)
        A point on its line, from the origin.
    angle : ndarray, shape (n,)
        Direction of its line in [0, pi); nan for a rotational spring.
    """

    stiffness: Floats
    place: Complexes
    angle: Floats


def equivalent_springs(wrenches: Floats, chain: LegScrews, length: Value) -> list[EquivalentSpring]:
    """Springs that hold the body as a leg does: one along a single wrench, two for two wrenches, none for three.

    Two wrenches reciprocal to a slide give two parallel springs at +-a along it from the tip, a = sqrt(c11/c22), the
    one away from the base first [S4, eqs. 40-42]; two reciprocal to a hinge the principal springs through its pin, the
    stiffer first.
    """
    count = wrenches.shape[1]
    if count == 1:
        return [_single(wrenches[:, 0], chain, length)]
    if count != 2:
        return []
    twist = screw_product(wrenches[:, 0], wrenches[:, 1])
    sliding = np.hypot(twist[0], twist[1]) > np.abs(twist[2]) * length / RANK
    slides, pins = _parallel_springs(twist, chain), _pin_springs(twist, chain)
    return [
        EquivalentSpring(*(np.where(sliding, a, b) for a, b in zip(slide, pin, strict=True)))
        for slide, pin in zip(slides, pins, strict=True)
    ]


def _single(wrench: Floats, chain: LegScrews, length: Value) -> EquivalentSpring:
    """The spring along one wrench (3, n): linear, or rotational where the wrench is a pure moment."""
    compliance = constraint_compliance(wrench[:, None], chain)[0, 0]
    force = vector(wrench[0], wrench[1])
    size = np.abs(force)
    turning = size * length <= RANK * np.abs(wrench[2])
    norm = np.where(turning, np.abs(wrench[2]), size)
    about_tip = wrench[2] - cross(chain.tip, force)
    foot = chain.tip - 1j * force * about_tip / size**2
    stiffness = norm**2 / compliance
    return EquivalentSpring(
        stiffness, np.where(turning, chain.tip, foot), np.where(turning, np.nan, np.mod(np.angle(force), np.pi))
    )


def _parallel_springs(twist: Floats, chain: LegScrews) -> Iterator[EquivalentSpring]:
    """The two springs of wrenches that are reciprocal to the slide `twist`, shape (3, n)."""
    along = vector(twist[0], twist[1])
    along = along / np.abs(along)
    outward = np.real((chain.tip - chain.base) * np.conj(along)) < 0
    along = np.where(outward, -along, along)
    across = 1j * along
    basis = np.zeros((3, 2, len(along)))
    basis[0, 0], basis[1, 0], basis[2, 0], basis[2, 1] = across.real, across.imag, cross(chain.tip, across), 1.0
    compliance = constraint_compliance(basis, chain)
    c11, c22, c12 = compliance[0, 0], compliance[1, 1], compliance[0, 1]
    arm = np.sqrt(c11 / c22)
    angle = np.mod(np.angle(across), np.pi)
    # Rigid in force or in moment: a pair of parallel springs would lie at the tip or infinitely far away.
    apart = (c11 > 0) & (c22 > 0)
    for sign in (1.0, -1.0):
        total = 2 * (c11 + sign * arm * c12)
        stiffness = np.where(total > 4 * RIGID * c11, 1 / total, np.inf)
        force, moment = 1 / c11, 1 / c22
        yield EquivalentSpring(
            np.where(apart, stiffness, force if sign > 0 else moment),
            np.where(apart, chain.tip + sign * arm * along, chain.tip),
            np.where(apart, angle, angle if sign > 0 else np.nan),
        )


def _pin_springs(twist: Floats, chain: LegScrews) -> list[EquivalentSpring]:
    """The two springs of wrenches that are reciprocal to the hinge `twist`, shape (3, n)."""
    place = vector(-twist[1] / twist[2], twist[0] / twist[2])
    basis = _one_joint(np.stack([place.imag, -place.real, np.ones(place.shape)]))
    low, high, angle = principal(np.moveaxis(constraint_compliance(basis, chain), 2, 0))
    return [EquivalentSpring(high, place, angle), EquivalentSpring(low, place, np.mod(angle + np.pi / 2, np.pi))]


def principal(soft: Floats) -> tuple[Floats, Floats, Floats]:
    """Smallest and largest stiffness to a force over all directions, and the angle of the largest in [0, pi).

    `soft` are compliances, shape (n, 2 or more, 2 or more).
    """
    mean, half = (soft[:, 0, 0] + soft[:, 1, 1]) / 2, (soft[:, 0, 0] - soft[:, 1, 1]) / 2
    radius = np.hypot(half, soft[:, 0, 1])
    stiffest = mean - radius
    high = np.where(stiffest > 1e-13 * mean, 1 / stiffest, np.where(np.isnan(mean), np.nan, np.inf))
    low = 1 / (mean + radius)
    angle = np.mod(np.arctan2(soft[:, 0, 1], half) / 2 + np.pi / 2, np.pi)
    return low, high, angle


def _scaled(twist: Floats, length: Value) -> Floats:
    """Twists (3, n) with rotations scaled by `length`, of unit size."""
    unit = twist.copy()
    unit[2] *= length
    return np.asarray(unit / np.linalg.norm(unit, axis=0))
