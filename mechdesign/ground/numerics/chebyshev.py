"""Smooth functions on intervals by Chebyshev series: from values at nodes to values, slopes, zeros and integrals.

Source: Trefethen, "Approximation Theory and Approximation Practice", SIAM 2013, chapters 3, 8 and 18.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mechdesign.ground.numerics.arrays import Flags, Floats, Ints

# Number of nodes of an interval. They are the zeros of T_16, which omit both ends, where a function may be singular.
COUNT = 16
_ORDERS = np.arange(COUNT)
_ANGLES = np.pi * (np.arange(COUNT)[::-1] + 0.5) / COUNT
NODES = np.cos(_ANGLES)
_TO_SERIES = np.cos(np.outer(_ANGLES, _ORDERS)) * np.where(_ORDERS == 0, 1.0, 2.0) / COUNT
# Places, both ends included, at which series are evaluated, so dense that no two turning points lie between neighbours.
PLACES = -np.cos(np.linspace(0.0, np.pi, 3 * COUNT + 1))
# Integrals of the polynomials through the nodes (Fejer's first rule), over [-1, 1].
WEIGHTS = _TO_SERIES @ np.where(_ORDERS % 2 == 0, 2.0 / (1.0 - _ORDERS**2.0 + (_ORDERS == 1)), 0.0)
# Newton step, as a length in [-1, 1], after which a root is exact.
_LAST_STEP = 1e-8
# Largest number of steps: as many as bisection needs.
_STEPS = 60


def basis(x: Floats) -> Floats:
    """T_k at places in [-1, 1], shape (COUNT, ...), by T_{m + n} = 2 T_m T_n - T_{m - n}."""
    table = np.empty((COUNT, *np.shape(x)))
    table[0], table[1] = 1.0, x
    m = 1
    while m < COUNT - 1:
        last = min(2 * m, COUNT - 1)
        np.multiply(table[1 : last - m + 1], 2.0 * table[m], out=table[m + 1 : last + 1])
        table[m + 1 : last + 1] -= table[m - 1 : 2 * m - last - 1 if last < 2 * m else None : -1]
        m = last
    return table


def _slope_basis(x: Floats) -> Floats:
    """Derivatives of T_k, k U_{k-1}, at places, shape (..., COUNT)."""
    table = np.zeros((*np.shape(x), COUNT))
    before, last = np.zeros(np.shape(x)), np.ones(np.shape(x))
    for k in range(1, COUNT):
        table[..., k] = k * last
        before, last = last, 2.0 * x * last - before
    return table


_AT_NODES, _AT_PLACES, _SLOPES_AT_PLACES = basis(NODES), basis(PLACES), _slope_basis(PLACES).T
# Takes the coefficients of series to those of their derivatives.
_DERIVATIVE = _slope_basis(NODES).T @ _TO_SERIES


def series(values: Floats) -> Floats:
    """Coefficients of the polynomials through values at the nodes, shape (..., COUNT); nan through infinite ones."""
    return np.asarray(values @ _TO_SERIES)


def remainder(coefficients: Floats) -> Floats:
    """Estimated truncation error of series, shape (...): the next coefficients, extrapolated from their decay.

    Coefficients are compared in pairs, as every other one of an even or odd function is zero.
    """
    before, last = (np.abs(coefficients[..., pair]).max(axis=-1) for pair in (slice(-4, -2), slice(-2, None)))
    return np.asarray(np.where(last < before, last * (last / before), last))


def at_places(coefficients: Floats) -> Floats:
    """Values at `PLACES`, shape (..., places)."""
    return np.asarray(coefficients @ _AT_PLACES)


def at_nodes(coefficients: Floats) -> Floats:
    """Values at the nodes, shape (..., COUNT)."""
    return np.asarray(coefficients @ _AT_NODES)


def nearest_node(x: Floats) -> Ints:
    """Index of the node nearest to each place x in [-1, 1], measured in arccos x."""
    node: Ints = (COUNT - 1 - np.floor(np.arccos(x) * (COUNT / np.pi))).astype(np.intp)
    return np.maximum(node, 0)


def slopes_at_places(coefficients: Floats) -> Floats:
    """Slopes at `PLACES`, shape (..., places)."""
    return np.asarray(coefficients @ _SLOPES_AT_PLACES)


def value(coefficients: Floats, x: Floats) -> Floats:
    """Values of series of shape (n, COUNT) at a place of each, shape (n,)."""
    return total(coefficients, basis(x))


def total(coefficients: Floats, table: Floats) -> Floats:
    """Values of series of shape (n, COUNT) at places whose `basis` is `table`, shape (n,)."""
    return np.asarray(np.einsum("nk,kn->n", coefficients, table))


def slope(coefficients: Floats, x: Floats) -> Floats:
    """Slopes of series of shape (n, COUNT) at a place of each, shape (n,)."""
    return value(coefficients @ _DERIVATIVE, x)


def primitive(coefficients: Floats, x: Floats) -> Floats:
    """Integrals of series of shape (n, COUNT) from -1 to a place of each, shape (n,)."""
    angle, orders = np.arccos(np.clip(x, -1.0, 1.0))[..., None], np.arange(COUNT + 1)
    raised = np.zeros((*coefficients.shape[:-1], COUNT + 1))
    raised[..., 1:] += coefficients / (2.0 * orders[1:]) * np.where(_ORDERS == 0, 2.0, 1.0)
    raised[..., 1 : COUNT - 1] -= coefficients[..., 2:] / (2.0 * orders[1 : COUNT - 1])
    return np.asarray((raised * (np.cos(angle * orders) - (-1.0) ** orders)).sum(axis=-1))


def turning_points(coefficients: Floats) -> tuple[Ints, Floats, Floats]:
    """Places at which series of shape (n, COUNT) turn back: which series, the place in [-1, 1], the value there."""
    slopes = slopes_at_places(coefficients)
    which, cell = np.nonzero((slopes[:, 1:] >= 0) != (slopes[:, :-1] >= 0))
    turning = coefficients[which]
    x = _root(turning @ _DERIVATIVE, PLACES[cell], slopes[which, cell], PLACES[cell + 1], slopes[which, cell + 1])
    return which, x, value(turning, x)


def zeros(coefficients: Floats, turning: tuple[Ints, Floats, Floats]) -> tuple[Ints, Floats]:
    """Places at which series of shape (n, COUNT) change their sign: which series, and the place in [-1, 1].

    `turning` are their `turning_points`.
    """
    values = at_places(coefficients)
    which, cell = np.nonzero((values[:, 1:] >= 0) != (values[:, :-1] >= 0))
    low, high = PLACES[cell], PLACES[cell + 1]
    at_low, at_high = values[which, cell], values[which, cell + 1]
    # Between two places with values of one sign a series may cross zero and turn back.
    turned, place, extreme = turning
    beside = np.clip(np.searchsorted(PLACES, place) - 1, 0, len(PLACES) - 2)
    below, above = values[turned, beside], values[turned, beside + 1]
    hidden = ((below >= 0) == (above >= 0)) & ((below >= 0) != (extreme >= 0))
    turned, place, extreme, beside = turned[hidden], place[hidden], extreme[hidden], beside[hidden]
    which = np.concatenate([which, turned, turned])
    low = np.concatenate([low, PLACES[beside], place])
    high = np.concatenate([high, place, PLACES[beside + 1]])
    at_low = np.concatenate([at_low, below[hidden], extreme])
    at_high = np.concatenate([at_high, extreme, above[hidden]])
    x = _root(coefficients[which], low, at_low, high, at_high)
    order = np.lexsort((x, which))
    return which[order], x[order]


def _root(coefficients: Floats, low: Floats, at_low: Floats, high: Floats, at_high: Floats) -> Floats:
    """Zeros of series between places with values of opposite signs."""
    slopes = coefficients @ _DERIVATIVE

    def value_and_slope(x: Floats) -> tuple[Floats, Floats]:
        table = basis(x)
        return total(coefficients, table), total(slopes, table)

    return root(value_and_slope, low, at_low, high, at_high)


def root(
    function: Callable[[Floats], tuple[Floats, Floats]], low: Floats, at_low: Floats, high: Floats, at_high: Floats
) -> Floats:
    """Zeros of functions between places in [-1, 1] with values of opposite signs, by Newton's method kept in between.

    `function` gives all values and slopes at places of shape (n,).
    """
    low, high = low.copy(), high.copy()
    x = low - at_low * (high - low) / (at_high - at_low)
    x = np.where((x >= low) & (x <= high), x, (low + high) / 2)
    for _ in range(_STEPS):
        values, slopes = function(x)
        on_low_side = (values >= 0) == (at_low >= 0)
        low, high = np.where(on_low_side, x, low), np.where(on_low_side, high, x)
        step = x - values / slopes
        step = np.where((step >= low) & (step <= high), step, (low + high) / 2)
        change, x = np.abs(step - x), step
        if not (change > _LAST_STEP).any():
            break
    return x


def slope_series(coefficients: Floats) -> Floats:
    """Coefficients of the derivatives of series, shape (..., COUNT)."""
    return np.asarray(coefficients @ _DERIVATIVE)


def filled(values: Floats, good: Flags) -> Floats:
    """Values at the nodes, shape (nodes,); those not `good` come from the polynomial through the others."""
    table = np.polynomial.chebyshev.chebvander(NODES, np.count_nonzero(good) - 1)
    return np.where(good, values, table @ np.linalg.solve(table[good], values[good]))
