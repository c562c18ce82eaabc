"""Pareto fronts of many points: those that no other surpasses."""

from __future__ import annotations

import numpy as np

from mechdesign.numerics.arrays import Flags, Floats, Ints

# So few points, or pairs of points, are compared one with another.
_FEW_POINTS, _FEW_PAIRS = 64, 4096


def front(values: Floats) -> Flags:
    """Which rows of values, shape (points, goals), are on the front, less being better; of equals all or none.

    A row is on it where no other is as small in every goal and smaller in one. Of two goals by sorting, of more by
    dividing the points, in ``n log(n)^(goals - 2)`` steps [Kung, Luccio & Preparata, On finding the maxima of a set of
    vectors, 1975].
    """
    order = np.lexsort(values.T[::-1])
    ranked = values[order]
    first = np.concatenate([[True], (ranked[1:] != ranked[:-1]).any(axis=1)])[: len(order)]
    unique = ranked[first]
    on_front = np.zeros(len(unique), dtype=bool)
    on_front[_front(unique, np.arange(len(unique)))] = True
    found = np.empty(len(order), dtype=bool)
    found[order] = on_front[np.cumsum(first) - 1]
    return found


def _front(values: Floats, rows: Ints) -> Ints:
    """Which of some rows are on their front; rows differ, and are sorted by the first goal, then by the next."""
    if values.shape[1] == 1:
        return rows[:1]
    if values.shape[1] == 2:
        last = values[rows, 1]
        before = np.concatenate([[np.inf], np.minimum.accumulate(last)])[: len(last)]
        return np.asarray(rows[(last < before) | (np.arange(len(rows)) == 0)])
    if len(rows) <= _FEW_POINTS:
        # Of two rows that differ the later one never surpasses the earlier.
        worse = (values[rows][:, None] <= values[rows]).all(axis=2)
        return np.asarray(rows[~np.triu(worse, 1).any(axis=0)])
    half = len(rows) // 2
    low, high = _front(values, rows[:half]), _front(values, rows[half:])
    return np.concatenate([low, high[~_surpassed(values, low, high, values.shape[1] - 1)]])


def _surpassed(values: Floats, by: Ints, rows: Ints, goal: int) -> Flags:
    """Which rows are nowhere smaller than one of the others, from the second goal to a last one.

    Parameters
    ----------
    values : ndarray, shape (points, goals)
    by, rows : ndarray of int
        Points of which those in `by` are as small or smaller in all goals that are left out.
    goal : int
        The last of the goals that are compared.
    """
    if not len(by) or not len(rows):
        return np.zeros(len(rows), dtype=bool)
    if goal == 1:
        return np.asarray(values[rows, 1] >= values[by, 1].min())
    if len(by) * len(rows) <= _FEW_PAIRS:
        return np.asarray((values[by][:, None, 1 : goal + 1] <= values[rows, 1 : goal + 1]).all(axis=2).any(axis=0))
    if goal == 2:
        order = by[np.argsort(values[by, 1], kind="stable")]
        least = np.concatenate([[np.inf], np.minimum.accumulate(values[order, 2])])
        place = np.searchsorted(values[order, 1], values[rows, 1], side="right")
        return np.asarray((place > 0) & (least[place] <= values[rows, 2]))
    others, own = values[by, goal], values[rows, goal]
    if others.max() <= own.min():
        return _surpassed(values, by, rows, goal - 1)
    if others.min() > own.max():
        return np.zeros(len(rows), dtype=bool)
    # Divided so that both parts are smaller: some number lies above the limit, or all would be equal.
    both = np.sort(np.concatenate([others, own]))
    limit = both[(len(both) - 1) // 2]
    limit = limit if limit < both[-1] else both[np.searchsorted(both, limit) - 1]
    found = np.zeros(len(rows), dtype=bool)
    low, high = own <= limit, own > limit
    found[low] = _surpassed(values, by[others <= limit], rows[low], goal)
    found[high] = _surpassed(values, by[others > limit], rows[high], goal)
    left = np.flatnonzero(high)[~found[high]]
    found[left] = _surpassed(values, by[others <= limit], rows[left], goal - 1)
    return found
