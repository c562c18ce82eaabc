"""Jacobians and their scalars: determinant and inverse condition, with a length where lengths and angles mix."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.derivatives import Linearization
from mechdesign.mechanism.outputs import first
from mechdesign.mechanism.rates import Rates
from mechdesign.numerics.arrays import Floats


def jacobian(linear: Linearization, rates: Rates, rows: Sequence[Coordinate]) -> Floats:
    """Derivatives of coordinates by the drives, per radian; shape (..., rows, drives).

    Parameters
    ----------
    rates : Rates
        Derivatives of everything by each drive, ``linear.drives()``.
    """
    full = (len(linear.structure.given), *linear.configuration.shape)
    found = np.stack([np.broadcast_to(first(linear.configuration, c, rates), full) for c in rows])
    return np.moveaxis(found, (0, 1), (-2, -1))


def mixes(rows: Sequence[Coordinate], columns: Sequence[Coordinate]) -> bool:
    """Whether a Jacobian's rows, or its columns, have different units, so that its norm means nothing."""
    return len({c.quantity for c in rows}) > 1 or len({c.quantity for c in columns}) > 1


def homogeneous(jacobian: Floats, rows: Sequence[Coordinate], columns: Sequence[Coordinate], length: float) -> Floats:
    """The Jacobian with angles turned into lengths by a characteristic length.

    Parameters
    ----------
    jacobian : ndarray, shape (..., rows, columns)
    length : float
        Arc of one radian.
    """
    up = np.array([length if c.quantity == "angle" else 1.0 for c in rows])
    down = np.array([length if c.quantity == "angle" else 1.0 for c in columns])
    return np.asarray(jacobian * up[:, None] / down)


def determinant(jacobian: Floats) -> Floats:
    """Determinant; nan where an entry is."""
    if jacobian.shape[-1] == 2:
        return np.asarray(jacobian[..., 0, 0] * jacobian[..., 1, 1] - jacobian[..., 0, 1] * jacobian[..., 1, 0])
    finite = np.asarray(np.isfinite(jacobian).all(axis=(-1, -2)))
    safe = np.where(finite[..., None, None], jacobian, 0.0)
    return np.where(finite, np.linalg.det(safe), np.nan)


def of_two(twice: Value) -> Value:
    """Inverse condition c of a 2 x 2 matrix from c + 1/c = ||J||_F^2 / |det J| [S1, eq. 8]."""
    # (s - 2)(s + 2) rather than s^2 - 4 keeps the digits near isotropy; rounding may leave s just below 2.
    return 2 / (twice + np.sqrt(np.maximum(twice - 2, 0) * (twice + 2)))


def inverse_condition(jacobian: Floats) -> Floats:
    """Smallest over largest singular value, 0 at a singularity; nan where an entry is.

    2 x 2 needs no decomposition, see `of_two`.
    """
    if jacobian.shape[-1] == 2:
        squares = np.einsum("...ij,...ij->...", jacobian, jacobian)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(of_two(squares / np.abs(determinant(jacobian))))
    finite = np.asarray(np.isfinite(jacobian).all(axis=(-1, -2)))
    safe = np.where(finite[..., None, None], jacobian, 0.0)
    values = np.linalg.svd(safe, compute_uv=False)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(values[..., 0] > 0, values[..., -1] / values[..., 0], 0.0)
    return np.where(finite, ratio, np.nan)
