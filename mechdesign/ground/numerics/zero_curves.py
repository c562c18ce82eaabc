"""Curves on which a function sampled on a grid is zero, and curves joined where their ends meet."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats, Ints
from mechdesign.ground.numerics.roots import bracketed_roots

# Accuracy of roots, as a fraction of the grid's spacing.
ACCURACY = 1e-13
# Distance within which a point is on a node, as a fraction of the spacing.
NODE = 1e-9
# A sign change is a jump, not a root, if the function there is larger than this fraction of its values at the nodes.
JUMP = 1e-6
# Largest distance of ends that meet, as a multiple of the longer of the last steps of their curves.
LAST_STEPS = 1.5


def zero_curves(values: Floats, function: Callable[[Floats, Floats], Floats]) -> list[Floats]:
    """Points where a function changes its sign on the lines of a grid, in order along curves.

    Curves at which the function touches zero without changing its sign are missed, and those within a cell of the grid.

    Parameters
    ----------
    values : ndarray, shape (m, n)
        The function at the grid's nodes; nan where it has no value.
    function : callable
        The function at fractional rows and columns of the grid.

    Returns
    -------
    list of ndarray, shape (2, points)
        Rows and columns; a closed curve ends where it begins.
    """
    from contourpy import contour_generator

    contours = contour_generator(z=np.ma.masked_invalid(values), corner_mask=False).lines(0.0)
    lines = [np.asarray(line, dtype=float) for line in contours]
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
    root = np.abs(evaluate(every, t)) <= JUMP * np.fmax(np.abs(at_low), np.abs(at_high))
    place = np.where(root | (low == high).all(axis=0), low + t * (high - low), np.nan)
    curves = []
    for curve in np.split(place, np.cumsum([len(line) for line in lines])[:-1], axis=1):
        jumps = np.flatnonzero(np.isnan(curve[0]))
        parts = [part[:, ~np.isnan(part[0])] for part in np.split(curve, jumps, axis=1)]
        curves += [part for part in parts if part.shape[1] > 1]
    return curves


def joined(curves: Sequence[Complexes], exact: float) -> list[Complexes]:
    """Curves joined where their ends meet, the nearest ends first; a curve whose own ends meet is closed.

    Ends nearer than `exact` meet, whatever the spacing of the points.
    """
    curves = [curve for curve in curves if len(curve) > 1]
    if not curves:
        return []
    # Ends 2k and 2k + 1 are the first and the last point of curve k.
    ends = np.array([curve[[0, -1]] for curve in curves]).ravel()
    steps = np.abs([curve[[0, -1]] - curve[[1, -2]] for curve in curves]).ravel()
    gaps = np.abs(ends[:, None] - ends)
    reach = np.maximum(exact, LAST_STEPS * np.maximum(steps[:, None], steps))
    numbers = np.arange(len(ends))
    reach[numbers, numbers ^ 1] = exact
    first, second = np.nonzero((gaps <= reach) & (numbers[:, None] < numbers))
    partner: dict[int, int] = {}
    for k in np.argsort(gaps[first, second], kind="stable").tolist():
        a, b = int(first[k]), int(second[k])
        if a not in partner and b not in partner:
            partner[a], partner[b] = b, a
    unused = set(range(len(curves)))
    chains = []
    for start in [free_end for free_end in numbers.tolist() if free_end not in partner] + numbers.tolist():
        if start // 2 not in unused:
            continue
        parts: list[Complexes] = []
        end: int | None = start
        while end is not None and end // 2 in unused:
            unused.discard(end // 2)
            curve = curves[end // 2] if end % 2 == 0 else curves[end // 2][::-1]
            meets = bool(parts) and abs(parts[-1][-1] - curve[0]) <= exact
            parts.append(curve[1:] if meets else curve)
            end = partner.get(end ^ 1)
        chain = np.concatenate(parts)
        if end == start:
            chain = np.append(chain[:-1] if abs(chain[-1] - chain[0]) <= exact else chain, chain[0])
        chains.append(chain)
    return chains
