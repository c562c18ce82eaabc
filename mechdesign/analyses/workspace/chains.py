"""Points put in order as curves, and curves whose ends meet put together."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from mechdesign.numerics.arrays import Complexes, Floats, Ints

# Places nearer than this (rows or columns of a grid) are one: that of a dip is known to about half the digits.
SAME = 1e-6
# Ends of curves nearer than this many of their last steps belong together.
NEAR = 1.5


def chains(places: Floats, pairs: Ints) -> list[Floats]:
    """Walks along links between points, open ones from their ends first; a closed one ends where it began.

    Parameters
    ----------
    places : ndarray, shape (2, points)
        Rows and columns.
    pairs : ndarray of int, shape (2, links)
        Numbers of the points that are linked.
    """
    from scipy.spatial import cKDTree

    # Points that two grids share are one.
    one = np.arange(places.shape[1])
    for a, b in sorted(cKDTree(places.T).query_pairs(SAME)) if places.size else ():
        one[one == one[b]] = one[a]
    links: dict[int, list[int]] = defaultdict(list)
    for a, b in one[pairs].T.tolist():
        if a != b and b not in links[a]:
            links[a].append(b)
            links[b].append(a)
    left = {k for k in links if links[k]}
    found = []
    for start in [k for k in links if len(links[k]) == 1] + list(links):
        if start not in left:
            continue
        chain = [start]
        left.discard(start)
        while step := [k for k in links[chain[-1]] if k in left]:
            chain.append(step[0])
            left.discard(step[0])
        if len(chain) > 2 and start in links[chain[-1]]:
            chain.append(start)
        found.append(places[:, chain])
    return found


def joined(curves: Sequence[Complexes], exact: float) -> list[Complexes]:
    """Curves with those whose ends meet put together; one whose own ends meet is closed. Single points come last.

    Parameters
    ----------
    exact : float
        Distance at which ends meet, whatever the spacing of the points.
    """
    rest, points = [curve for curve in curves if len(curve) > 1], [curve for curve in curves if len(curve) == 1]
    ends = np.array([[curve[0], curve[-1]] for curve in rest]).reshape(-1, 2)
    steps = np.array([[_last(curve, 0), _last(curve, -1)] for curve in rest]).reshape(-1, 2)
    left = np.ones(len(rest), dtype=bool)
    # By the first curve and the second, the end of the first and of the second; infinite where they do not meet.
    gaps = np.full((len(rest), len(rest), 2, 2), np.inf)

    def measure(k: int) -> None:
        gap = np.abs(ends[k][:, None] - ends[:, None, :])
        gap[gap > np.maximum(exact, NEAR * np.maximum(steps[k][:, None], steps[:, None, :]))] = np.inf
        own = abs(ends[k, 0] - ends[k, 1])
        gap[k], gap[~left] = np.inf, np.inf
        gap[k, 0, 1] = own if 0 < own <= exact else np.inf
        gaps[k, k:], gaps[:k, k] = gap[k:], gap[:k].transpose(0, 2, 1)

    for k in range(len(rest)):
        measure(k)
    while gaps.size:
        a, b, at, to = (int(i) for i in np.unravel_index(gaps.argmin(), gaps.shape))
        gap = gaps[a, b, at, to]
        if gap == np.inf:
            break
        if a == b:
            rest[a] = np.append(rest[a][:-1], rest[a][0])
        else:
            one, other = rest[a] if at else rest[a][::-1], rest[b][::-1] if to else rest[b]
            rest[a] = np.concatenate([one, other[1:] if gap <= exact else other])
            left[b], gaps[b], gaps[:, b] = False, np.inf, np.inf
        ends[a], steps[a] = rest[a][[0, -1]], (_last(rest[a], 0), _last(rest[a], -1))
        measure(a)
    return [curve for curve, keep in zip(rest, left, strict=True) if keep] + points


def _last(curve: Complexes, end: int) -> float:
    return float(abs(curve[1] - curve[0]) if end == 0 else abs(curve[-1] - curve[-2]))
