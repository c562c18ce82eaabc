"""Probabilities of normal variables, and widths of confidence intervals."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr, stdtrit

from mechdesign.ground.numerics.arrays import Floats

# Quadrature nodes and weights of an integration panel, on [-1, 1].
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)
# Standard deviations beyond which the normal density is zero in double precision.
MAX_DEVIATION = 40.0
# Width of an integration panel, in the inverse hyperbolic tangent of the correlation.
_PANEL = 2.0


def student(degrees: int, confidence: float) -> float:
    """Half the width, in standard errors, of Student's confidence interval."""
    return float(-stdtrit(degrees, 0.5 * (1.0 - confidence)))


def outside(low: Floats, high: Floats) -> Floats:
    """P(standard normal variable outside [low, high]); ends of any shape, perhaps infinite."""
    return np.asarray(ndtr(low) + ndtr(-high))


def rectangle_failure(low: Floats, high: Floats, rho: Floats) -> Floats:
    """P(standard bivariate normal variables outside a rectangle) [S2, eqs. 10, 11], to about 1e-14 of it.

    Parameters
    ----------
    low, high : ndarray, shape (2, ...)
        Sides of the rectangle in standard deviations; may be infinite.
    rho : ndarray, shape (...)
        Correlation; rounding may carry it beyond 1.

    Notes
    -----
    The probabilities that either variable is outside, less those of the four corners, where both are. A corner is never
    more likely than either side, so that the smallest probabilities keep their digits. The probability of a corner
    X > h, Y > k is, by Plackett's integral over the correlation r = tanh w [A reduction formula for normal multivariate
    integrals, 1954],

        P(X > h) P(Y > k) + 1/(2 pi) integral exp(-(h^2 + k^2 - 2 h k r) / (2 (1 - r^2))) / cosh w dw
    """
    low, high = np.clip((low, high), -MAX_DEVIATION, MAX_DEVIATION)
    rho = np.clip(np.nan_to_num(rho), -1.0, 1.0)
    # Axes are turned towards each corner, which changes the sign of the correlation in two of them.
    h = np.stack([high[0], -low[0], high[0], -low[0]])
    k = np.stack([high[1], -low[1], -low[1], high[1]])
    sign = np.multiply.outer([1.0, 1.0, -1.0, -1.0], np.sign(rho))
    reach = np.minimum(np.arctanh(np.abs(rho)), MAX_DEVIATION)
    integral, panels = np.zeros(h.shape), np.ceil(reach / _PANEL)
    for count in np.unique(panels[panels > 0]).astype(int).tolist():
        lanes = panels == count
        half = 0.5 * reach[lanes] / count
        rise = np.exp(np.multiply.outer(half, (2 * np.arange(count)[:, None] + 1 + _NODES).ravel()))
        cosh = 0.5 * (rise + 1.0 / rise)
        first, second = h[:, lanes, None], (sign * k)[:, lanes, None]
        values = np.exp(-0.5 * (((first - second) * cosh) ** 2 + first * second * (1.0 + rise**-2))) / cosh
        integral[:, lanes] = half * (values @ np.tile(_WEIGHTS, count))
    corners = ndtr(-h) * ndtr(-k) + sign * integral / (2.0 * np.pi)
    single = outside(low[0], high[0]) + outside(low[1], high[1])
    return np.asarray(np.clip(single - corners.sum(axis=0), 0.0, 1.0))
