"""Local performance indices of a Jacobian: inverse condition, resistivity, determinant."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdesign.analyses import jacobians
from mechdesign.mechanism.algebra import Value


def local_indices(jacobian: Sequence[Sequence[Value]]) -> tuple[Value, Value, Value]:
    """Inverse condition number, resistivity and determinant of a square Jacobian given by its entries.

    Parameters
    ----------
    jacobian : n rows of n arrays
        Derivatives of outputs with respect to drives; entries broadcast.

    Returns
    -------
    inverse_condition : ndarray
        sigma_min/sigma_max, between 0 (singular) and 1 (isotropic) [S1, eq. 23].
    resistivity : ndarray
        1/abs(det J) [S1, eq. 25]; infinite where the drives lose their grip on the output.
    determinant : ndarray

    Notes
    -----
    For n = 2 no singular values are needed: kappa + 1/kappa = norm(J)_F^2 / abs(det J).
    """
    if len(jacobian) == 2:
        (a, b), (c, d) = jacobian
        determinant = a * d - b * c
        size = np.abs(determinant)
        twice = (a * a + b * b + c * c + d * d) / size
        return jacobians.of_two(twice), 1 / size, determinant
    shape = np.broadcast_shapes(*(np.shape(entry) for row in jacobian for entry in row))
    matrix = np.stack([np.stack([np.broadcast_to(e, shape) for e in row], axis=-1) for row in jacobian], axis=-2)
    determinant = jacobians.determinant(matrix)
    return jacobians.inverse_condition(matrix), 1 / np.abs(determinant), determinant
