"""Zero curves of a function on a grid: crossings of its lines are found by root finding, then put in order."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.roots import bracketed_roots

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
# Roots are found to this part of a grid line's piece; one where the function does not vanish is a gap in its domain.
ACCURACY, VANISHES = 1e-13, 1e-6
# Ends of curves nearer than this many of their last steps belong together.
NEAR = 1.5


def zero_curves(
    values: Floats, place: Callable[[Floats, Floats], Complex], function: Callable[[Complex], Floats]
) -> list[Complex]:
    """Curves on which a function is zero, each a row of points.

    Parameters
    ----------
    values : ndarray, shape (m, n)
        The function at the grid's nodes.
    place : callable
        Point of the plane at (fractional) row and column of the grid.
    function : callable
        The function at points of the plane.
    """
    m, n = values.shape
    row, column = np.nonzero((values[1:] > 0) != (values[:-1] > 0))
    across = (row, column, np.ones(len(row)), np.zeros(len(row)))
    row, column = np.nonzero((values[:, 1:] > 0) != (values[:, :-1] > 0))
    along = (row, column, np.zeros(len(row)), np.ones(len(row)))
    at_row, at_column, down, right = (np.concatenate([a, b]) for a, b in zip(across, along, strict=True))
    if not len(at_row):
        return []

    def evaluate(which: NDArray[np.intp], t: Floats) -> Floats:
        return function(place(at_row[which] + t * down[which], at_column[which] + t * right[which]))

    low = values[at_row, at_column]
    high = values[at_row + down.astype(int), at_column + right.astype(int)]
    zero, nan = np.zeros(len(low)), np.full(len(low), np.nan)
    t = bracketed_roots(evaluate, zero, low, zero + 1, high, nan, nan, zero + ACCURACY)
    z = place(at_row + t * down, at_column + t * right)
    with np.errstate(invalid="ignore"):
        good = np.abs(function(z)) <= VANISHES * np.maximum(np.abs(low), np.abs(high))
    number = {
        (int(i), int(j), bool(d)): k
        for k, (i, j, d, g) in enumerate(zip(at_row, at_column, down, good, strict=True))
        if g
    }
    links: dict[int, list[int]] = defaultdict(list)
    cells = {(i - (not d), j - d) for i, j, d in number} | {(i, j) for i, j, _ in number}
    for i, j in sorted(cells):
        if not (0 <= i < m - 1 and 0 <= j < n - 1):
            continue
        # Left, lower, right, upper side of the cell, in turn.
        sides = [number.get(key) for key in ((i, j, True), (i + 1, j, False), (i, j + 1, True), (i, j, False))]
        met = [side for side in sides if side is not None]
        if len(met) == 4:
            middle = float(function(place(np.array([i + 0.5]), np.array([j + 0.5])))[0])
            first = (middle > 0) == (values[i, j] > 0)
            pairs = [(met[0], met[1]), (met[2], met[3])] if first else [(met[0], met[3]), (met[1], met[2])]
        else:
            pairs = [(met[0], met[1])] if len(met) == 2 else []
        for a, b in pairs:
            links[a].append(b)
            links[b].append(a)
    return [z[np.array(chain)] for chain in _chains(links)]


def _chains(links: dict[int, list[int]]) -> list[list[int]]:
    """Walks along links, open ones from their ends first; a closed one ends where it began."""
    left = set(links)
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
        found.append(chain)
    return found


def joined(curves: Sequence[Complex], exact: float) -> list[Complex]:
    """Curves with those whose ends meet put together; one whose own ends meet is closed.

    Parameters
    ----------
    exact : float
        Distance at which ends meet, whatever the spacing of the points.
    """
    rest = [curve for curve in curves if len(curve) > 1]
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
            return rest
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
