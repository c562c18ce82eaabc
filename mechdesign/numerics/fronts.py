"""Pareto fronts: the points among many that no other dominates."""

from __future__ import annotations

import numpy as np

from mechdesign.numerics.arrays import Flags, Floats, Ints

# Largest number of points, and of pairs of points, that are compared directly.
_FEW_POINTS, _FEW_PAIRS = 64, 4096


def front(values: Floats) -> Flags:
    """Which rows of values, shape (points, goals), are on the front; smaller values are better.

    A row is on the front if no other row is at most as large in every goal and smaller in one; of equal rows
    all are on it or none. Two goals are sorted; with more the points are divided, in ``n log(n)^(goals - 2)`` steps
    [Kung, Luccio & Preparata, On finding the maxima of a set of vectors, 1975].
    """
    order = np.lexsort(values.T[::-1])
    ranked = values[order]
    first = np.concatenate([[True], (ranked[1:] != ranked[:-1]).any(axis=1)])[: len(order)]
    unique = ranked[first]
    unique_on_front = np.zeros(len(unique), dtype=bool)
    unique_on_front[_front(unique, np.arange(len(unique)))] = True
    on_front = np.empty(len(order), dtype=bool)
    on_front[order] = unique_on_front[np.cumsum(first) - 1]
    return on_front


def _front(values: Floats, rows: Ints) -> Ints:
    """The rows that are on their own front; they differ, and are sorted by the first goal, then the next, and so on."""
    if values.shape[1] == 1:
        return rows[:1]
    if values.shape[1] == 2:
        last = values[rows, 1]
        before = np.concatenate([[np.inf], np.minimum.accumulate(last)])[: len(last)]
        return np.asarray(rows[(last < before) | (np.arange(len(rows)) == 0)])
    if len(rows) <= _FEW_POINTS:
        # As rows are sorted, a later one never dominates an earlier one.
        worse = (values[rows][:, None] <= values[rows]).all(axis=2)
        return np.asarray(rows[~np.triu(worse, 1).any(axis=0)])
    half = len(rows) // 2
    low, high = _front(values, rows[:half]), _front(values, rows[half:])
    return np.concatenate([low, high[~_dominated(values, low, high, values.shape[1] - 1)]])


def _dominated(values: Floats, by: Ints, rows: Ints, goal: int) -> Flags:
    """Which of `rows` are dominated: in no goal from the second to `goal` smaller than some row of `by`.

    Parameters
    ----------
    values : ndarray, shape (points, goals)
    by, rows : ndarray of int
        Points; in the goals that are not compared those of `by` are at most as large as those of `rows`.
    goal : int
        Index of the last goal that is compared.
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
    by_values, row_values = values[by, goal], values[rows, goal]
    if by_values.max() <= row_values.min():
        return _dominated(values, by, rows, goal - 1)
    if by_values.min() > row_values.max():
        return np.zeros(len(rows), dtype=bool)
    # The limit is below the largest number, so that both parts are smaller than the whole.
    all_values = np.sort(np.concatenate([by_values, row_values]))
    limit = all_values[(len(all_values) - 1) // 2]
    limit = limit if limit < all_values[-1] else all_values[np.searchsorted(all_values, limit) - 1]
    dominated = np.zeros(len(rows), dtype=bool)
    low, high = row_values <= limit, row_values > limit
    dominated[low] = _dominated(values, by[by_values <= limit], rows[low], goal)
    dominated[high] = _dominated(values, by[by_values > limit], rows[high], goal)
    open_rows = np.flatnonzero(high)[~dominated[high]]
    dominated[open_rows] = _dominated(values, by[by_values <= limit], rows[open_rows], goal - 1)
    return dominated
