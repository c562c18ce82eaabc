"""Curves on which a function of a grid is zero, and curves whose ends meet put together."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from mechdesign.numerics.arrays import Complexes, Floats, Ints
from mechdesign.numerics.roots import bracketed_roots

# Accuracy of roots, as a part of the spacing of the grid's lines.
ACCURACY = 1e-13
# A point this near to a node, as a part of the spacing, is on it.
NODE = 1e-9
# A sign change where the function stays larger than this part of its values beside it is a jump, and no root.
JUMP = 1e-6
# Ends of curves belong together when nearer to each other than this many of their last steps.
LAST_STEPS = 1.5


def zero_curves(values: Floats, function: Callable[[Floats, Floats], Floats]) -> list[Floats]:
    """Curves on which a function changes its sign, on the lines of a grid.

    A curve that is touched but not crossed, and one that lies within a cell of the grid, are not found.

    Parameters
    ----------
    values : ndarray, shape (m, n)
        The function at the grid's nodes; nan where it has none.
    function : callable
        The function at fractional rows and columns of the grid.

    Returns
    -------
    list of ndarray, shape (2, points)
        Rows and columns; a closed curve ends where it begins.
    """
    from contourpy import contour_generator

    found = contour_generator(z=np.ma.masked_invalid(values), corner_mask=False).lines(0.0)
    lines = [np.asarray(line, dtype=float) for line in found]
    if not lines:
        return []
    # Each point lies on a line of the grid, between two nodes or on one.
    place = np.concatenate(lines)[:, ::-1].T
    low, high = np.floor(place + NODE), np.ceil(place - NODE)
    at_low, at_high = (values[tuple(node.astype(np.intp))] for node in (low, high))

    def evaluate(which: Ints, t: Floats) -> Floats:
        return function(*(low[:, which] + t * (high - low)[:, which]))

    zero, nan, every = np.zeros(len(at_low)), np.full(len(at_low), np.nan), np.arange(len(at_low))
    t = bracketed_roots(evaluate, zero, at_low, zero + 1, at_high, nan, nan, zero + ACCURACY)
    with np.errstate(invalid="ignore"):
        root = np.abs(evaluate(every, t)) <= JUMP * np.fmax(np.abs(at_low), np.abs(at_high))
    place = np.where(root | (low == high).all(axis=0), low + t * (high - low), np.nan)
    curves = []
    for curve in np.split(place, np.cumsum([len(line) for line in lines])[:-1], axis=1):
        jumps = np.flatnonzero(np.isnan(curve[0]))
        parts = [part[:, ~np.isnan(part[0])] for part in np.split(curve, jumps, axis=1)]
        curves += [part for part in parts if part.shape[1] > 1]
    return curves


def joined(curves: Sequence[Complexes], exact: float) -> list[Complexes]:
    """Curves with those whose ends meet put together, the nearest first; one whose own ends meet is closed.

    Ends nearer than `exact` meet whatever the spacing of the points.
    """
    curves = [curve for curve in curves if len(curve) > 1]
    if not curves:
        return []
    # Ends 2k and 2k + 1 are the first and the last point of curve k.
    ends = np.array([curve[[0, -1]] for curve in curves]).ravel()
    steps = np.abs([curve[[0, -1]] - curve[[1, -2]] for curve in curves]).ravel()
    gaps = np.abs(ends[:, None] - ends)
    reach = np.maximum(exact, LAST_STEPS * np.maximum(steps[:, None], steps))
    own = np.arange(len(ends))
    reach[own, own ^ 1] = exact
    one, other = np.nonzero((gaps <= reach) & (own[:, None] < own))
    partner: dict[int, int] = {}
    for k in np.argsort(gaps[one, other], kind="stable").tolist():
        a, b = int(one[k]), int(other[k])
        if a not in partner and b not in partner:
            partner[a], partner[b] = b, a
    left = set(range(len(curves)))
    found = []
    for start in [end for end in own.tolist() if end not in partner] + own.tolist():
        if start // 2 not in left:
            continue
        parts: list[Complexes] = []
        at: int | None = start
        while at is not None and at // 2 in left:
            left.discard(at // 2)
            curve = curves[at // 2] if at % 2 == 0 else curves[at // 2][::-1]
            meets = bool(parts) and abs(parts[-1][-1] - curve[0]) <= exact
            parts.append(curve[1:] if meets else curve)
            at = partner.get(at ^ 1)
        whole = np.concatenate(parts)
        if at == start:
            whole = np.append(whole[:-1] if abs(whole[-1] - whole[0]) <= exact else whole, whole[0])
        found.append(whole)
    return found
