"""Small linear systems, one for each of many poses."""

from __future__ import annotations

import numpy as np

from mechdesign.ground.numerics.arrays import Floats


def solved(matrix: Floats, right: Floats) -> tuple[Floats, Floats]:
    """Solutions, shape (..., n, r), of matrices (..., n, n), and the determinants; 0 of what is not finite.

    Where a matrix is singular or something is not finite the solution is nan.
    """
    good = np.asarray(np.isfinite(matrix).all(axis=(-1, -2)) & np.isfinite(right).all(axis=(-1, -2)))
    identity = np.eye(matrix.shape[-1])
    determinant = np.where(good, np.linalg.det(np.where(good[..., None, None], matrix, identity)), 0.0)
    regular = (determinant != 0)[..., None, None]
    return np.where(regular, np.linalg.solve(np.where(regular, matrix, identity), right), np.nan), determinant
