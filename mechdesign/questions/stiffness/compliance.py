"""How a body is held, and its stiffness on serial legs that bear as many wrenches as it has freedoms.

With W the wrenches of all legs and C_c their compliances (block diagonal), a wrench w on the body gives the legs
lambda = W^-1 w and the body the twist W^-T C_c lambda: no inverse of C_c is needed, rigid directions are zeros in it.
[S4, eqs. 17-22]
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.mechanism.algebra import Value
from mechdesign.questions.stiffness.screws import RIGID, screw_product

# Determinant of the unit wrenches above which their matrix is inverted in closed form; others need singular values.
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
        Smallest singular value of the wrenches (unit columns, moments scaled); infinite where it was not computed.
    """

    stiffness: Floats
    compliance: Floats
    rank: Ints
    free: Floats
    margin: Floats

    @staticmethod
    def unknown(n: int, size: int) -> Held:
        """A record for n poses to be filled: rank 0, all else nan."""
        matrix = np.full((n, size, size), np.nan)
        return Held(matrix, matrix.copy(), np.zeros(n, dtype=np.intp), matrix[:, 0].copy(), np.full(n, np.inf))

    def seen_from(self, arm: Complexes) -> Held:
        """The same body seen from points at a distance `arm`, shape (n,), of the present ones; a pin stays as it is.

        C' = M C M^T and K' = M^-T K M^-1 [S4]; as no matrix is inverted, the points may be far away.
        """
        if self.compliance.shape[1] == 2 or not arm.any():
            return self
        forth, back = moved_to(arm), moved_to(-arm)
        return replace(
            self,
            stiffness=back.swapaxes(1, 2) @ self.stiffness @ back,
            compliance=forth @ self.compliance @ forth.swapaxes(1, 2),
            free=(forth @ self.free[:, :, None])[:, :, 0],
        )


def put(whole: object, rows: Ints, part: object) -> None:
    """Write the arrays of `part` into the rows `rows` of the arrays of `whole`."""
    for name, values in vars(part).items():
        getattr(whole, name)[rows] = values


def poses_by(values: Ints) -> Iterator[tuple[int, Ints]]:
    """Each different value of `values`, shape (n,), with the poses that have it."""
    for value in np.unique(values).tolist():
        yield value, np.flatnonzero(values == value)


def moved_to(arm: Complexes) -> Floats:
    """M, shape (n, 3, 3), which takes a body's twist to a point `arm` away; its inverse is the M of `-arm`."""
    matrix = np.tile(np.eye(3), (len(arm), 1, 1))
    matrix[:, 0, 2], matrix[:, 1, 2] = -arm.imag, arm.real
    return matrix


def scales(length: Value, count: int, size: int = 3) -> Floats:
    """Factors of forces and moments, shape (count, size), that count a radian as `length`, of all poses or of each."""
    factors = np.ones((count, size))
    factors[:, 2:] /= np.reshape(length, (-1, 1))
    return factors


def by_wrenches(
    wrenches: Sequence[Floats], compliances: Sequence[Floats], length: Value, size: int = 3
) -> tuple[Floats, Floats, Flags]:
    """Stiffness and compliance, shape (n, size, size), of a body held by `size` wrenches, and where these are regular.

    Wrenches and compliances are those of each leg, shapes (3, m, n) and (m, m, n). Moments are divided by `length`
    wherever sizes are compared; on a pin (`size` 2) no leg exerts a moment.
    """
    scale = scales(length, wrenches[0].shape[2], size)
    outer = scale[:, :, None] * scale[:, None]
    inverse, regular = _inverse(np.concatenate([w[:size] for w in wrenches], axis=1) * scale.T[:, None])
    total, first = np.zeros_like(inverse), 0
    for block in compliances:
        rows = inverse[first : first + len(block)]
        first += len(block)
        total += np.einsum("ian,ijn,jbn->abn", rows, block, rows)
    compliance = np.moveaxis((total + total.swapaxes(0, 1)) / 2, 2, 0)
    stiffness = stiffness_of(compliance)
    return stiffness / outer, without_rounding(compliance, stiffness) * outer, regular


def stiffness_of(compliance: Floats) -> Floats:
    """Inverses of compliances, shape (n, size, size); nan where the body is rigid in some direction."""
    inverse, soft = inverses(compliance, RIGID)
    return np.where(soft[:, None, None], (inverse + inverse.swapaxes(1, 2)) / 2, np.nan)


def without_rounding(compliance: Floats, stiffness: Floats) -> Floats:
    """Compliances with zeros for entries that are only rounding, where the body is rigid in some direction."""
    size = np.abs(compliance)
    rigid = np.isnan(stiffness).any(axis=(1, 2), keepdims=True)
    return np.where(rigid & (size <= RIGID * size.max(axis=(1, 2), keepdims=True, initial=0.0)), 0.0, compliance)


def inverses(matrix: Floats, limit: float) -> tuple[Floats, Flags]:
    """Inverses where the smallest singular value is certainly above `limit` times the largest, else 0; and where so."""
    inverse, regular = np.zeros(matrix.shape), np.ones(len(matrix), dtype=bool)
    try:
        inverse[:] = np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        # Some pose is exactly singular: invert the others, so that they do not depend on it.
        regular = np.linalg.det(matrix) != 0
        inverse[regular] = np.linalg.inv(matrix[regular])
    inverse_norm, matrix_norm = (np.einsum("nij,nij->n", part, part) for part in (inverse, matrix))
    regular &= inverse_norm * matrix_norm < 1 / limit**2
    inverse[~regular] = 0.0
    return inverse, regular


def directional(soft: Floats, direction: Value) -> Floats:
    """Stiffness to a force in a direction (radians, of all poses or of each), by the displacement along it."""
    x, y = np.cos(direction), np.sin(direction)
    return np.asarray(1 / (x * x * soft[:, 0, 0] + 2 * x * y * soft[:, 0, 1] + y * y * soft[:, 1, 1]))


def _inverse(matrix: Floats) -> tuple[Floats, Flags]:
    """Inverse (size, size, n) of the square wrench matrix, and where that is regular: elsewhere it is no inverse."""
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
