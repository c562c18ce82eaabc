"""Wrenches that a network holds without a load: how they follow from the flexibilities of what bears them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.mechanism.algebra import Value
from mechdesign.questions.stiffness.compliance import (
    REGULAR,
    Held,
    inverses,
    poses_by,
    scales,
    stiffness_of,
    without_rounding,
)
from mechdesign.questions.stiffness.network import Network
from mechdesign.questions.stiffness.screws import RANK, RIGID

# States of self-stress with less than this fraction of the largest one's energy are rounding: they are rigid.
SELF_STRESS = 1e-13
# So are those with less than this fraction (rounding squared) of the largest energy that loop wrenches could store.
STORED = 1e-26


def ways_of(network: Network) -> tuple[Floats, Floats]:
    """Directions of the edges around each loop, shape (loops, edges), and on the path to the asked body, (edges,)."""
    loops = np.array([network.signs(loop) for loop in network.loops]).reshape(-1, len(network.edges))
    return loops, network.signs(network.paths[network.target])


@dataclass(frozen=True, eq=False)
class SelfStress:
    """Equilibrium of the free joints.

    Parameters
    ----------
    inverse : ndarray, shape (n, freedoms, loops)
        Pseudo-inverse of the free joints' loop matrix: their motions that close gaps in the loops.
    particular : ndarray, shape (n, loops, loads)
        Loop wrenches in equilibrium with each load.
    stress : ndarray, shape (n, loops, loops), or None
        Projector onto the states of self-stress; None where no pose has any.
    lost : ndarray, shape (n, size, size), or None
        Projector onto the asked body's free displacements; None where no pose has any.
    margin : ndarray, shape (n,)
        Smallest singular value (of unit columns) that is not zero; infinite where it was not computed.
    """

    inverse: Floats
    particular: Floats
    stress: Floats | None
    lost: Floats | None
    margin: Floats

    @staticmethod
    def of(loops: Floats, path: Floats, size: int) -> SelfStress:
        """Solve for the equilibrium of each pose: by the inverse of a regular matrix, or else by singular values."""
        norm = np.sqrt((loops**2).sum(axis=1) + (path[:, :size] ** 2).sum(axis=1))
        norm = np.where(norm > 0, norm, 1.0)[:, None]
        unit, along = loops / norm, path / norm
        n, rows, columns = unit.shape
        inverse, regular = np.zeros((n, columns, rows)), np.zeros(n, dtype=bool)
        if rows == columns:
            inverse, regular = inverses(unit, REGULAR)
        margin, stress, lost = np.full(n, np.inf), None, None
        irregular = np.flatnonzero(~regular)
        if len(irregular):
            left, values, right = np.linalg.svd(unit[irregular])
            keep = values > RANK
            margin[irregular] = np.where(keep, values, np.inf).min(axis=1, initial=np.inf)
            upright, count = right.swapaxes(1, 2), values.shape[1]
            upside = np.where(keep, 1 / np.where(keep, values, 1.0), 0.0)
            inverse[irregular] = (upright[:, :, :count] * upside[:, None]) @ left[:, :, :count].swapaxes(1, 2)
            stresses, free = (_onto_not_kept(vectors, keep) for vectors in (left, upright))
            if stresses.any():
                stress = np.zeros((n, rows, rows))
                stress[irregular] = stresses
            if free.any():
                lost, units = np.zeros((n, size, size)), along[irregular][:, :size]
                lost[irregular] = _onto_range(units @ free @ units.swapaxes(1, 2))
        return SelfStress(
            inverse / norm.swapaxes(1, 2), inverse.swapaxes(1, 2) @ along.swapaxes(1, 2), stress, lost, margin
        )


def _onto_not_kept(vectors: Floats, keep: Flags) -> Floats:
    """Projector onto the singular vectors (columns) whose values are not kept; exactly zero where all are."""
    n, size, _ = vectors.shape
    not_kept = np.ones((n, size), dtype=bool)
    not_kept[:, : keep.shape[1]] = ~keep
    chosen = vectors * not_kept[:, None]
    return np.asarray(chosen @ chosen.swapaxes(1, 2))


def _onto_range(matrix: Floats) -> Floats:
    """Projector onto the range of symmetric matrices whose entries are of order one."""
    values, vectors = np.linalg.eigh(matrix)
    kept = vectors * (values > RANK**2)[:, None]
    return np.asarray(kept @ kept.swapaxes(1, 2))


def least_energy(
    statics: SelfStress, loops: Floats, path: Floats, compliance: Floats, initial: Floats | None
) -> tuple[Floats, Floats, Floats | None]:  # fmt: skip
    """Forces in the elastic joints under all loads, shape (n, joints, loads), and the loops' wrenches.

    The third result projects onto the states of self-stress that store no energy, shape (n, loops, loops).
    """
    stress = statics.particular
    on_path, around = path.swapaxes(1, 2), loops.swapaxes(1, 2)
    bears = on_path - around @ stress
    # Where the loads and the loop wrenches cancel but for rounding, a joint bears exactly nothing, so that rigid
    # directions are exactly rigid.
    largest = np.abs(stress).max(axis=1, keepdims=True, initial=0.0)
    bears[np.abs(bears) <= RIGID * (np.abs(on_path) + np.abs(around).sum(axis=2, keepdims=True) * largest)] = 0.0
    if statics.stress is None:
        return bears, stress, None
    weighted = statics.stress @ loops
    energy = (weighted * compliance[:, None]) @ weighted.swapaxes(1, 2)
    values, vectors = np.linalg.eigh((energy + energy.swapaxes(1, 2)) / 2)
    most = STORED * ((loops**2).sum(axis=1) * compliance).max(axis=1, initial=0.0)
    kept = values > np.maximum(SELF_STRESS * values[:, -1:], most[:, None])
    upright = vectors.swapaxes(1, 2)
    inverse = (vectors * np.where(kept, 1 / np.where(kept, values, 1.0), 0.0)[:, None]) @ upright
    rigid = statics.stress - (vectors * kept[:, None]) @ upright
    self_stress = statics.stress @ inverse @ (weighted @ strained(compliance, bears, initial))
    return bears - loops.swapaxes(1, 2) @ self_stress, stress + self_stress, rigid


def held_of(compliance: Floats, statics: SelfStress, length: Value, size: int) -> Held:
    """Compliance where the body is held, stiffness where it is not rigid, and the free twist, all unscaled."""
    n = len(compliance)
    lost = statics.lost if statics.lost is not None else np.zeros((n, size, size))
    freedom = np.rint(np.trace(lost, axis1=1, axis2=2)).astype(np.intp)
    stiffness = np.full(compliance.shape, np.nan)
    twist = np.full((n, size), np.nan)
    # The last eigenvectors span the free displacements, the others those that are held.
    _, axes = np.linalg.eigh(lost)
    for count, rows in poses_by(freedom):
        basis = axes[rows][:, :, : size - count]
        inner = basis.swapaxes(1, 2) @ compliance[rows] @ basis
        inverse = stiffness_of(inner)
        soft = np.isfinite(inverse).all(axis=(1, 2))
        compliance[rows] = without_rounding(compliance[rows], inverse)
        stiffness[rows[soft]] = basis[soft] @ inverse[soft] @ basis[soft].swapaxes(1, 2)
        if count:
            compliance[rows] = np.nan
            twist[rows] = axes[rows][:, :, -1]
    scale = scales(length, n, size)
    outer = scale[:, :, None] * scale[:, None]
    twist = np.where(np.abs(twist) > RANK, twist, 0.0 * twist) * scale
    if size == 3:
        twist = np.where(twist[:, 2:] != 0, twist / twist[:, 2:], twist)
    return Held(stiffness / outer, compliance * outer, size - freedom, twist, statics.margin)


def strained(compliance: Floats, bears: Floats, initial: Floats | None) -> Floats:
    """Displacements of elastic joints by what they bear, and by loads within them, shape (n, joints, loads)."""
    strain = compliance[:, :, None] * bears
    if initial is not None:
        strain[:, :, -initial.shape[2] :] += initial
    return strain
