"""The equations of Coulomb friction in several contacts at once.

With the moments and forces of friction m, what the contacts bear is affine in them, so that

    m_j + s_j mu_j size_j(V + A m) = 0,  s_j the sign of the relative motion,

is solved for every pose by Newton's method; sizes have corners but are convex. Where the matrix |s_j mu_j A_jk| has a
spectral radius below 1 there is one solution. Elsewhere the coefficients grow from zero to what they are, and the
solution is followed: where it goes to infinity, or turns back, before they are reached, the mechanism jams and there is
no equilibrium.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.ground.numerics.linear import solved

# Residual of a solution, as a part of the sum of its terms.
SOLVED = 1e-12
# Part of the largest force that counts as borne by every contact, so that its rounding is a solution.
ROUNDING = 1e-3
# Following a solution: steps of Newton's method, the longest and the shortest step of the coefficients' growth.
FOLLOWING_STEPS, LONGEST, SHORTEST = 12, 1 / 16, 1e-6


class FrictionSystem:
    """The equations of friction m + strength size(V + A m) = 0 at a flat batch of poses."""

    def __init__(self, borne: Complexes, slopes: Complexes, strength: Floats, weights: Floats) -> None:
        # Contacts at rest take no part, also where what they bear is not known.
        rest = strength == 0
        if rest.any():
            borne, slopes = np.where(rest[:, None], 0.0, borne), np.where(rest[:, None, None], 0.0, slopes)
        self.start, self.slopes, self.strength, self.weights = borne, slopes, strength, weights
        self.count, self.poses = strength.shape

    def take(self, rows: Ints) -> FrictionSystem:
        """Some of the poses."""
        return FrictionSystem(
            self.start[..., rows], self.slopes[..., rows], self.strength[:, rows], self.weights[..., rows]
        )

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
        # A contact that bears nothing has the rounding of the others' forces.
        rounding = ROUNDING * self.weights[:, 0] * np.abs(self.start[:, 0]).max(axis=0)
        return np.asarray(np.abs(self.strength) * np.maximum((self.weights * np.abs(self.start)).max(axis=1), rounding))

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
        weights = _solved(np.eye(self.count)[:, :, None] - bounds, np.ones((self.count, self.poses)))
        # One step leads to a solution that is the only one.
        step = np.where((weights > 0).all(axis=0), 1.0, LONGEST)
        if len(rows := np.flatnonzero(finite)):
            friction[:, rows], jams[rows] = self.take(rows)._followed(rates[:, rows], step[rows])
        # One step more, which is exact beside the corners of the sizes.
        residual, matrix, _ = self.residual(friction, np.ones(self.poses))
        better = friction - _solved(matrix, residual)
        good = (np.abs(self.residual(better, np.ones(self.poses))[0]) <= np.abs(residual)).all(axis=0)
        return np.where(good, better, friction), jams, np.clip(_determinant(matrix), 0.0, 1.0)

    def _followed(self, rates: Floats, step: Floats) -> tuple[Floats, Ints]:
        """Solutions followed from no friction on, and which contact jams where they end before the coefficients.

        The coefficients first grow by the part `step`.
        """
        friction, growth = np.zeros((self.count, self.poses)), np.zeros(self.poses)
        while len(rows := np.flatnonzero((growth < 1) & (step > SHORTEST))):
            part = self.take(rows)
            ahead = np.minimum(growth[rows] + step[rows], 1.0)
            there, good = part._corrected(friction[:, rows], ahead)
            friction[:, rows[good]], growth[rows[good]] = there[:, good], ahead[good]
            step[rows] = np.where(good, np.minimum(2 * step[rows], LONGEST), step[rows] / 2)
        # What grows fastest where it ends takes most of the power.
        _, matrix, size = self.residual(friction, growth)
        lost = np.abs(_solved(matrix, size) * rates)
        jammed = growth < 1
        return np.where(jammed, np.nan, friction), np.where(jammed, np.nan_to_num(lost).argmax(axis=0), -1)

    def _corrected(self, friction: Floats, growth: Floats) -> tuple[Floats, Flags]:
        """Solutions near to some, and where they are found on the same side of all folds and poles."""
        residual, matrix, _ = self.residual(friction, growth)
        good: Flags = np.zeros(self.poses, dtype=bool)
        for _ in range(FOLLOWING_STEPS):
            friction = friction - _solved(matrix, residual)
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


def _solved(matrix: Floats, right: Floats) -> Floats:
    """Solutions of linear systems, shape (k, poses), nan where a matrix is singular."""
    return solved(np.moveaxis(matrix, -1, 0), right.T[..., None])[0][..., 0].T
