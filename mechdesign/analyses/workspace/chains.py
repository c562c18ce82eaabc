"""Points put in order as curves, and curves whose ends meet put together."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Complex = NDArray[np.complex128]
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


def joined(curves: Sequence[Complex], exact: float) -> list[Complex]:
    """Curves with those whose ends meet put together; one whose own ends meet is closed. Single points come last.

    Parameters
    ----------
    exact : float
        Distance at which ends meet, whatever the spacing of the points.
    """
    rest, points = [curve for curve in curves if len(curve) > 1], [curve for curve in curves if len(curve) == 1]
    while True:
        best: tuple[float, int, int, int, int] | None = None
        for a, one in enumerate(rest):
            for b in range(a, len(rest)):
                for at, to in (0, 0), (0, -1), (-1, 0), (-1, -1):
                    if a == b and (at, to) != (0, -1):
                        continue
                    gap = abs(one[at] - rest[b][to])
                    step = max(_last(one, at), _last(rest[b], to))
                    ends = gap == 0 and a == b
                    if (
                        not ends
                        and gap <= max(exact, NEAR * step if a != b else 0.0)
                        and (best is None or gap < best[0])
                    ):
                        best = (gap, a, b, at, to)
        if best is None:
            return rest + points
        gap, a, b, at, to = best
        if a == b:
            rest[a] = np.append(rest[a][:-1] if gap <= exact else rest[a], rest[a][0])
            continue
        one = rest[a] if at else rest[a][::-1]
        other = rest[b][::-1] if to else rest[b]
        rest[a] = np.concatenate([one, other[1:] if gap <= exact else other])
        del rest[b]


def _last(curve: Complex, end: int) -> float:
    return float(abs(curve[1] - curve[0]) if end == 0 else abs(curve[-1] - curve[-2]))
