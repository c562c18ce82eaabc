"""Dips of a function's magnitude between the nodes of a grid: does it reach zero there, or change its sign?"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mechdesign.numerics.arrays import Floats, Ints

# Values of the function of some lanes (indices) at places of shape (axes, lanes, samples).
Sample = Callable[[Ints, Floats], Floats]
# Samples along an axis about the lowest one, and the share of their range that is left after each round: on a line,
# and in the plane, where a valley may lie askew.
SAMPLES, LEFT = {1: 9, 2: 5}, {1: 0.25, 2: 0.5}
# Ranges are made smaller until they are this part of the first: a square is then lost in rounding.
NARROW = 1e-7
# A dip below this part of the values beside it is zero.
ZERO = 1e-11
NOTHING, TOUCHED, CROSSED = 0, 1, 2


def dips(sample: Sample, centre: Floats, beside: Floats, noise: float) -> tuple[Ints, Floats]:
    """What becomes of a positive function near low nodes: ``NOTHING``, ``TOUCHED`` or ``CROSSED``, and where.

    A smooth function lies above its minimum, at the lowest sample, by less than it varies over all samples: one that is
    higher than it varies does not reach zero.

    Parameters
    ----------
    centre : ndarray, shape (axes, lanes)
        Nodes, one apart from their neighbours.
    beside : ndarray, shape (lanes,)
        The larger values next to them.
    noise : float
        Values below it are rounding.

    Returns
    -------
    kind : ndarray of int, shape (lanes,)
    place : ndarray, shape (axes, lanes)
        The lowest place; one where the function is negative, if it is crossed.
    """
    axes, lanes = centre.shape
    steps = np.linspace(-1, 1, SAMPLES[axes])
    pattern = np.stack([mesh.ravel() for mesh in np.meshgrid(*[steps] * axes, indexing="ij")])
    kind, place = np.full(lanes, NOTHING), centre.copy()
    # What is left to be looked at, and half the range.
    zero, left, half = np.maximum(ZERO * beside, noise), np.arange(lanes), 1.0
    lowest = np.full(lanes, np.inf)
    while left.size and half > NARROW:
        around = place[:, left, None] + half * pattern[:, None, :]
        values = sample(left, around)
        values = np.where(np.isnan(values), np.inf, values)
        spread = values.max(axis=1) - values.min(axis=1)
        best = np.argmin(values, axis=1)
        rows = np.arange(len(left))
        lowest[left] = values[rows, best]
        place[:, left] = around[:, rows, best]
        crossed = lowest[left] < -zero[left]
        kind[left[crossed]] = CROSSED
        left = left[~crossed & (lowest[left] <= spread)]
        half *= LEFT[axes]
    kind[left[lowest[left] <= zero[left]]] = TOUCHED
    return kind, place
