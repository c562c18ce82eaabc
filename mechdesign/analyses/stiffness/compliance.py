"""Stiffness and compliance of a body on serial legs, from their reciprocal wrenches.

With W the wrenches of all legs and C_c their compliances (block diagonal), the body's twist X under a wrench w solves

    [[0, W], [W^T, -C_c]] [X; lambda] = [w; 0],

which needs no inverse of C_c: rigid directions are zeros in it. Where W is square and regular (a body held by exactly
as many wrenches as it has freedoms) the solution is lambda = W^-1 w, X = W^-T C_c lambda, in closed form. Everything
else (over- or under-constrained, nearly singular) goes through singular values: first what rigid legs leave free, then
the system on that space. [S4, eqs. 17-22]
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.analyses.stiffness.screws import RANK, RIGID, screw_product
from mechdesign.numerics.arrays import Complexes, Flags, Floats, Ints

# Wrenches of unit size with a determinant above this are solved in closed form, the others by singular values.
REGULAR = 1e-4


@dataclass(frozen=True, eq=False)
class Held:
    """How a body is held in n poses; `size` is 3, or 2 for a pin.

    Parameters
    ----------
    stiffness : ndarray, shape (n, size, size)
        nan where a direction is rigid (the compliance is singular).
    compliance : ndarray, shape (n, size, size)
        nan where a twist is free.
    rank : ndarray of int, shape (n,)
        Number of independent wrenches.
    free : ndarray, shape (n, size)
        The free twist where there is one, else nan: per radian where it turns, else of unit length.
    margin : ndarray, shape (n,)
        Smallest singular value of the wrenches (unit columns, moments scaled); infinite where not needed.
    """

    stiffness: Floats
    compliance: Floats
    rank: Ints
    free: Floats
    margin: Floats

    def seen_from(self, arm: Complexes) -> Held:
        """The same body asked at points that are `arm` (n,) away; a pin is asked where it is.

        Nothing is inverted, so that a point may be far away: C' = M C M^T, K' = M^-T K M^-1  [S4].
        """
        if self.compliance.shape[1] == 2:
            return self
        there, back = moved_to(arm), moved_to(-arm)
        return replace(
            self,
            stiffness=back.swapaxes(1, 2) @ self.stiffness @ back,
            compliance=there @ self.compliance @ there.swapaxes(1, 2),
            free=(there @ self.free[:, :, None])[:, :, 0],
        )


def moved_to(arm: Complexes) -> Floats:
    """M, shape (n, 3, 3), that takes a body's twist to that at a point `arm` away; its inverse is that of `-arm`."""
    found = np.tile(np.eye(3), (len(arm), 1, 1))
    found[:, 0, 2], found[:, 1, 2] = -arm.imag, arm.real
    return found


def hold(wrenches: Sequence[Floats], compliances: Sequence[Floats], length: float, size: int = 3) -> Held:
    """Stiffness and compliance from the wrenches (3, m, n) and compliances (m, m, n) of all legs.

    Parameters
    ----------
    length : float
        Moments are divided by it wherever sizes are compared.
    size : int
        3 for a body; 2 for a pin, on which no leg exerts a moment.
    """
    n = wrenches[0].shape[2]
    scale = np.array([1.0, 1.0, 1.0 / length])[:size]
    legs = [w[:size] * scale[:, None, None] for w in wrenches]
    full = np.concatenate(legs, axis=1)
    stiffness = np.full((n, size, size), np.nan)
    compliance = np.full((n, size, size), np.nan)
    rank = np.full(n, size, dtype=np.intp)
    free = np.full((n, size), np.nan)
    margin = np.full(n, np.inf)
    regular = np.zeros(n, dtype=bool)
    if full.shape[1] == size:
        inverse, regular = _inverse(full)
        compliance[:] = _exact(inverse, compliances)
        stiffness[:] = _sum_of_legs(legs, compliances)
    rest = np.flatnonzero(~regular)
    if len(rest):
        found = _general([leg[:, :, rest] for leg in legs], [c[:, :, rest] for c in compliances], size)
        stiffness[rest], compliance[rest], rank[rest], margin[rest] = found[:3] + found[4:]
        free[rest] = found[3] * scale
        if size == 3:
            with np.errstate(divide="ignore", invalid="ignore"):
                free = np.where(free[:, 2:] != 0, free / free[:, 2:], free)
    outer = np.outer(scale, scale)
    return Held(stiffness / outer, compliance * outer, rank, free, margin)


def principal(soft: Floats) -> tuple[Floats, Floats, Floats]:
    """Smallest and largest stiffness to a force over all directions, and the angle of the largest in [0, pi)."""
    mean, half = (soft[:, 0, 0] + soft[:, 1, 1]) / 2, (soft[:, 0, 0] - soft[:, 1, 1]) / 2
    radius = np.hypot(half, soft[:, 0, 1])
    with np.errstate(divide="ignore"):
        stiffest = mean - radius
        high = np.where(stiffest > 1e-13 * mean, 1 / stiffest, np.where(np.isnan(mean), np.nan, np.inf))
        low = 1 / (mean + radius)
    angle = np.mod(np.arctan2(soft[:, 0, 1], half) / 2 + np.pi / 2, np.pi)
    return low, high, angle


def directional(soft: Floats, direction: float) -> Floats:
    """Stiffness to a force in a direction (radians), the displacement counted along it."""
    along = np.array([np.cos(direction), np.sin(direction)])
    with np.errstate(divide="ignore"):
        return np.asarray(1 / np.einsum("i,nij,j->n", along, soft[:, :2, :2], along))


def _inverse(matrix: Floats) -> tuple[Floats, Flags]:
    """Inverse (size, size, n) of the square wrench matrix where it is regular, and where that is."""
    norms = np.sqrt((matrix**2).sum(axis=0)).prod(axis=0)
    if len(matrix) == 2:
        (a, b), (c, d) = matrix
        determinant = a * d - b * c
        adjugate = np.stack([np.stack([d, -b]), np.stack([-c, a])])
    else:
        x, y, z = matrix[:, 0], matrix[:, 1], matrix[:, 2]
        adjugate = np.stack([screw_product(y, z), screw_product(z, x), screw_product(x, y)])
        determinant = (x * adjugate[0]).sum(axis=0)
    regular = np.abs(determinant) > REGULAR * norms
    return adjugate / np.where(regular, determinant, 1.0), regular


def _exact(inverse: Floats, compliances: Sequence[Floats]) -> Floats:
    """C = W^-T C_c W^-1, poses first."""
    size, n = inverse.shape[0], inverse.shape[2]
    total = np.zeros((size, size, n))
    first = 0
    for block in compliances:
        rows = inverse[first : first + len(block)]
        first += len(block)
        _add_congruence(total, rows.swapaxes(0, 1), block)
    return np.moveaxis((total + total.swapaxes(0, 1)) / 2, 2, 0)


def _sum_of_legs(legs: Sequence[Floats], compliances: Sequence[Floats]) -> Floats:
    """K = sum W C_c^-1 W^T, poses first; nan where a C_c is singular  [S4, eq. 22]."""
    size, n = legs[0].shape[0], legs[0].shape[2]
    total = np.zeros((size, size, n))
    for wrenches, block in zip(legs, compliances, strict=True):
        if len(block) == 1:
            with np.errstate(divide="ignore"):
                inverse = np.where(block > 0, 1 / block, np.nan)
        elif len(block) == 2:
            determinant = block[0, 0] * block[1, 1] - block[0, 1] ** 2
            good = determinant > RIGID * block[0, 0] * block[1, 1]
            adjugate = np.stack([np.stack([block[1, 1], -block[0, 1]]), np.stack([-block[0, 1], block[0, 0]])])
            with np.errstate(divide="ignore", invalid="ignore"):
                inverse = np.where(good, adjugate / determinant, np.nan)
        elif len(block):
            inverse = _inverse_of_three(block)
        if len(block):
            _add_congruence(total, wrenches, inverse)
    return np.moveaxis((total + total.swapaxes(0, 1)) / 2, 2, 0)


def _add_congruence(total: Floats, outer: Floats, inner: Floats) -> None:
    """Add outer inner outer^T to `total` in place; the last axis runs over poses."""
    size = len(total)
    for i, j in np.ndindex(len(inner), len(inner)):
        for a in range(size):
            weighted = outer[a, i] * inner[i, j]
            for b in range(size):
                total[a, b] += weighted * outer[b, j]


def _inverse_of_three(block: Floats) -> Floats:
    values, vectors = np.linalg.eigh(np.moveaxis(block, 2, 0))
    with np.errstate(divide="ignore"):
        inverse = np.where(values > RIGID * values[:, -1:], 1 / values, np.nan)
    return np.moveaxis(np.einsum("nij,nj,nkj->nik", vectors, inverse, vectors), 0, 2)


def _general(legs: Sequence[Floats], compliances: Sequence[Floats], size: int) -> tuple[Floats, ...]:
    """Stiffness, compliance, rank, free twist and margin by singular values, in scaled coordinates."""
    n = legs[0].shape[2]
    wrenches, values = _independent(legs, compliances)
    left, singular, _ = np.linalg.svd(wrenches)
    singular = np.concatenate([singular, np.zeros((n, max(0, size - singular.shape[1])))], axis=1)
    rank = (singular > RANK * np.maximum(singular[:, :1], RANK)).sum(axis=1)
    free = np.where(np.abs(left[:, :, -1]) > RANK, left[:, :, -1], 0.0)
    free[rank == size] = np.nan
    rigid = values <= 0
    stiffness = np.full((n, size, size), np.nan)
    soft = ~rigid.any(axis=1)
    stiffness[soft] = np.einsum("nai,ni,nbi->nab", wrenches[soft], 1 / values[soft], wrenches[soft])
    compliance = np.full((n, size, size), np.nan)
    for rows in _alike(rigid, np.flatnonzero(rank == size)):
        fixed = rigid[rows[0]]
        compliance[rows] = _compliance(
            wrenches[rows][:, :, fixed], wrenches[rows][:, :, ~fixed], values[rows][:, ~fixed]
        )
    return stiffness, compliance, rank, free, singular[:, size - 1]


def _independent(legs: Sequence[Floats], compliances: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Wrenches (n, size, M) of unit length on which C_c is diagonal, and its diagonal (n, M), zero where rigid."""
    wrenches, values = [], []
    for leg, block in zip(legs, compliances, strict=True):
        unit = 1 / np.linalg.norm(leg, axis=0)
        value, vectors = np.linalg.eigh(np.moveaxis(block * unit[:, None] * unit[None], 2, 0))
        wrench = np.moveaxis(leg * unit, 2, 0) @ vectors
        norm = np.linalg.norm(wrench, axis=1)
        rigid = value <= RIGID * value[:, -1:]
        wrenches.append(wrench / norm[:, None])
        values.append(np.where(rigid, 0.0, value / norm**2))
    return np.concatenate(wrenches, axis=2), np.concatenate(values, axis=1)


def _alike(pattern: Flags, rows: Ints) -> Iterator[Ints]:
    """Rows of equal patterns together."""
    if len(rows):
        _, which = np.unique(pattern[rows], axis=0, return_inverse=True)
        for k in range(which.max() + 1):
            yield rows[which.reshape(-1) == k]


def _compliance(fixed: Floats, elastic: Floats, values: Floats) -> Floats:
    """Compliance where `fixed` wrenches are rigid and `elastic` ones have compliances `values` > 0."""
    n, size, _ = fixed.shape
    left, singular, _ = (
        np.linalg.svd(fixed) if fixed.shape[2] else (np.tile(np.eye(size), (n, 1, 1)), np.zeros((n, 0)), 0)
    )
    lost = (singular > RANK).sum(axis=1)
    result = np.zeros((n, size, size))
    for count in np.unique(lost):
        rows = np.flatnonzero(lost == count)
        if count == size:
            continue
        moves = left[rows][:, :, count:]
        result[rows] = moves @ _saddle(moves.swapaxes(1, 2) @ elastic[rows], values[rows]) @ moves.swapaxes(1, 2)
    return result


def _saddle(wrenches: Floats, values: Floats) -> Floats:
    """X of [[0, W], [W^T, -C_c]] [X; lambda] = [w; 0] for unit wrenches w, where W has full rank and C_c is regular."""
    n, size, count = wrenches.shape
    largest = values.max(axis=1)
    matrix = np.zeros((n, size + count, size + count))
    matrix[:, :size, size:] = wrenches
    matrix[:, size:, :size] = wrenches.swapaxes(1, 2)
    matrix[:, np.arange(size, size + count), np.arange(size, size + count)] = -values / largest[:, None]
    right = np.zeros((size + count, size))
    right[:size] = np.eye(size)
    solution = np.linalg.solve(matrix, np.broadcast_to(right, (n, *right.shape)))[:, :size]
    return np.asarray((solution + solution.swapaxes(1, 2)) / 2 * largest[:, None, None])
