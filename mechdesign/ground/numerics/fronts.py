"""Pareto fronts: points that no other dominates, their crowding distances and hypervolume."""

from __future__ import annotations

import numpy as np

from mechdesign.ground.numerics.arrays import Flags, Floats


def front(values: Floats) -> Flags:
    """Which rows of values, shape (points, goals), are on the front; smaller values are better.

    A row is on it where no other is as small in every goal and smaller in one.
    """
    from moocore import is_nondominated

    return np.asarray(is_nondominated(values, keep_weakly=True))


def hypervolume(values: Floats, corner: float) -> float:
    """Volume that points, shape (points, goals), dominate, up to a corner with the same number in each goal.

    Smaller values are better [Zitzler & Thiele, 1999]; 0 for no points.
    """
    import moocore

    return float(moocore.hypervolume(values, ref=np.full(values.shape[1], corner))) if len(values) else 0.0


def crowding(values: Floats) -> Floats:
    """Crowding distance of each row of a front: the sum over goals of the normalised gap between its neighbours.

    Infinite at the ends [Deb et al., 2002]; a goal in which all rows are equal adds nothing between them.
    """
    order = np.argsort(values, axis=0, kind="stable")
    ranked = np.take_along_axis(values, order, axis=0)
    span = np.ptp(values, axis=0)
    gaps = np.full(values.shape, np.inf)
    gaps[1:-1] = (ranked[2:] - ranked[:-2]) / np.where(span > 0, span, 1.0)
    distances = np.empty(values.shape)
    np.put_along_axis(distances, order, gaps, axis=0)
    return np.asarray(distances.sum(axis=1))
