"""Where margins change their signs along lanes, the stretches of rays that are sampled.

Between two samples a margin whose slope changes no more than by its bend has one sign change at most, if it rises or
falls by more than half of that, and none, if it is farther from zero at both than an eighth of that. Bends are bounded
by second differences of neighbouring samples. Whatever is not decided so is divided: dips below zero, bumps above it,
and the neighbourhoods of places at which a link turns fast.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mechdesign.mechanism.algebra import norm2
from mechdesign.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.numerics.roots import bracketed_roots

# Margins, shape (margins, ...), and rotations of links, shape (links, ...), on some lanes at places between 0 and 1.
Look = Callable[[Ints, Floats], tuple[Floats, Complexes]]
# Lane, place, margins and rotations of samples, in order.
Samples = tuple[Ints, Floats, Floats, Complexes]
# Lane of cells, and places of both ends, shape (2, cells).
Cells = tuple[Ints, Floats]
# Bends are taken so many times as large along rays as second differences tell: cells with a kink are then divided until
# the kink cannot reach zero.
SAFETY = 4.0
# Largest turn of a link from one sample to the next (chord of the unit circle).
FARTHEST_TURN = 0.5
# Where a cell is divided, as parts of it.
DIVIDED = np.array([0.25, 0.5, 0.75])
# Where a margin may dip below zero, or rise above it, samples are so far on either side of its parabola's vertex (part
# of the cell); the third is in the middle of what is left.
BESIDE = 0.02
# Cells of one lane that are divided at once; where more are in doubt, they are rounding's.
MOST_CELLS = 96


def sign_changes(
    look: Look, lanes: int, count: int, tolerance: Floats, nearest: Floats, noise: Floats, legs: Flags
) -> tuple[Ints, Ints, Ints, Floats, Ints, Cells]:
    """Roots of margins on several lanes.

    Parameters
    ----------
    count : int
        First samples of each lane.
    tolerance, nearest : ndarray, shape (lanes,)
        Accuracy of the places of roots; distance of samples that are not divided further.
    noise : ndarray, shape (margins,)
        Size below which a margin has no sign of its own.
    legs : ndarray of bool, shape (margins,)
        Rows that are no margins but positive functions with which links turn, and which samples are to resolve.

    Returns
    -------
    (margin, lane, direction, place, negative, open)
        Of each root its margin, lane, direction (1 rising, -1 falling) and place; of each lane the number of margins
        that are negative at its begin; and what is in doubt still.
    """
    lane, place = np.repeat(np.arange(lanes), count), np.tile(np.linspace(0.0, 1.0, count), lanes)
    lane, place, values, left = resolved(look, (lane, place, *look(lane, place)), nearest, noise, legs)
    positive = _without_rounding(values, lane, noise) > 0
    negative = np.zeros(lanes, dtype=np.intp)
    first = np.flatnonzero(np.diff(lane, prepend=-1))
    negative[lane[first]] = (~positive[:, first]).sum(axis=0)
    same = lane[1:] == lane[:-1]
    margin, cell = np.nonzero((positive[:, 1:] != positive[:, :-1]) & same)
    # Where another margin is negative at both ends of the cell no interval ends: the middle is near enough.
    root = 0.5 * (place[cell] + place[cell + 1])
    bounding = np.flatnonzero((positive[:, cell] | positive[:, cell + 1]).all(axis=0))
    margins, cells = margin[bounding], cell[bounding]
    before = np.maximum(cells - 1, 0)
    third = np.where(lane[before] == lane[cells], before, np.minimum(cells + 2, len(lane) - 1))
    third = np.where((lane[third] == lane[cells]) & (third != cells), third, cells)
    at = np.stack([cells, cells + 1, third])
    x, f = place[at], values[margins, at]
    x[2], f[2] = np.where(third == cells, np.nan, [x[2], f[2]])

    def evaluate(which: Ints, where: Floats) -> Floats:
        return look(lane[cells[which]], where)[0][margins[which], np.arange(len(which))]

    root[bounding] = bracketed_roots(evaluate, x[0], f[0], x[1], f[1], x[2], f[2], tolerance[lane[cells]])
    return margin, lane[cell], np.where(positive[margin, cell + 1], 1, -1), root, negative, left


def resolved(
    look: Look, first: Samples, nearest: Floats, noise: Floats, legs: Flags, safety: float = SAFETY
) -> tuple[Ints, Floats, Floats, Cells]:
    """Samples of lanes that leave no sign change inside the region between two of them, in order.

    Parameters
    ----------
    first : (lane, place, margins, rotations)
        Samples to begin with, in order.
    nearest, noise, legs
        As in `sign_changes`.
    safety : float
        Bends are taken so many times as large as second differences tell.

    Returns
    -------
    (lane, place, margins, open)
        Of all samples; and the cells in doubt still, as nothing is divided further.
    """
    lane, place, values, rotations = first
    done: list[tuple[Ints, Floats, Floats]] = []
    lanes, left = len(nearest), [(lane[:0], np.zeros((2, 0)))]
    while True:
        undecided, parts = _open(lane, place, values, rotations, noise, legs, safety)
        cell = np.flatnonzero(undecided)
        number = np.bincount(lane[cell], minlength=lanes)
        wide = (place[cell + 1] - place[cell] > nearest[lane[cell]]) & (number[lane[cell]] <= MOST_CELLS)
        left.append((lane[cell[~wide]], np.stack([place[cell], place[cell + 1]])[:, ~wide]))
        cell = cell[wide]
        again = np.zeros(lanes, dtype=bool)
        again[lane[cell]] = True
        ready = ~again[lane]
        done.append((lane[ready], place[ready], values[:, ready]))
        if not cell.size:
            break
        between = place[cell] + parts[:, cell] * (place[cell + 1] - place[cell])
        more = np.tile(lane[cell], len(DIVIDED)), between.ravel()
        at_more = look(*more)
        lane, place, values, rotations = (
            np.concatenate([table[..., ~ready], new], axis=-1)
            for table, new in zip((lane, place, values, rotations), (*more, *at_more), strict=True)
        )
        order = np.lexsort((place, lane))
        lane, place, values, rotations = lane[order], place[order], values[:, order], rotations[:, order]
    lane, place, values = (np.concatenate(part, axis=-1) for part in zip(*done, strict=True))
    order = np.argsort(lane, kind="stable")
    doubt_lane, doubt = (np.concatenate(part, axis=-1) for part in zip(*left, strict=True))
    return lane[order], place[order], values[:, order], (doubt_lane, doubt)


def _open(
    lane: Ints, place: Floats, values: Floats, rotations: Complexes, noise: Floats, legs: Flags, safety: float
) -> tuple[Flags, Floats]:
    """Which cells between neighbouring samples may hide sign changes inside the region; and where to divide each."""
    same = lane[1:] == lane[:-1]
    parts = np.tile(DIVIDED[:, None], len(same))
    if not same.size:
        return same, parts
    width = np.where(same, np.diff(place), 1.0)
    positive, size, noise = values > 0, np.abs(values), noise[:, None]
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        change = np.diff(values)
        second = np.zeros(values.shape)
        second[:, 1:-1] = np.diff(change / width) / (0.5 * (width[1:] + width[:-1]))
        # At the ends of lanes second differences go on as they do beside them.
        for at, step in ((np.flatnonzero(np.append(True, ~same)), 1), (np.flatnonzero(np.append(~same, True)), -1)):
            one, two = at + step, at + 2 * step
            share = (place[one] - place[at]) / (place[two] - place[one])
            second[:, at] = second[:, one] + share * (second[:, one] - second[:, two])
        bend = np.fmax(np.abs(second[:, 1:]), np.abs(second[:, :-1]))
        # Where bends hardly change from sample to sample they are known the better.
        varies = np.abs(np.diff(second))
        beside = varies.copy()
        beside[:, 1:] = np.where(same[:-1], np.fmax(beside[:, 1:], varies[:, :-1]), beside[:, 1:])
        beside[:, :-1] = np.where(same[1:], np.fmax(beside[:, :-1], varies[:, 1:]), beside[:, :-1])
        bend = np.fmin(safety * bend, bend + safety * beside) * width**2
        least = np.minimum(size[:, 1:], size[:, :-1])
        doubtful = (2 * np.abs(change) <= bend) & ((positive[:, 1:] != positive[:, :-1]) | (8 * least <= bend))
        # A margin that touches zero changes no sign.
        doubtful &= (bend > safety * noise) & (least > noise)
        doubtful[legs] = 4 * np.maximum(size[legs, 1:], size[legs, :-1]) <= bend[legs]
        row, cell = np.nonzero(doubtful & (positive[:, 1:] == positive[:, :-1]) & same)
        curved = 0.5 * (second[row, cell] + second[row, cell + 1]) * width[cell] ** 2
        vertex = np.clip(np.nan_to_num(0.5 - change[row, cell] / curved, nan=0.5), 2 * BESIDE, 1 - 2 * BESIDE)
        middle = np.where(vertex < 0.5, 1 + vertex, vertex) / 2
        parts[:, cell] = np.sort([vertex - BESIDE, vertex + BESIDE, middle], axis=0)
        turned = np.asarray(norm2(np.diff(rotations)) > FARTHEST_TURN**2).any(axis=0)
    outside = ~(positive[:, 1:] | positive[:, :-1] | doubtful).all(axis=0)
    return np.asarray(((doubtful.any(axis=0) & ~outside) | turned) & same), parts


def _without_rounding(values: Floats, lane: Ints, noise: Floats) -> Floats:
    """Margins of samples with the sign of both nearest samples that are above its `noise`, where these agree."""
    for row in np.flatnonzero(noise > 0):
        sure = np.flatnonzero(~(np.abs(values[row]) <= noise[row]))
        doubtful = np.flatnonzero(np.abs(values[row]) <= noise[row])
        if not (sure.size and doubtful.size):
            continue
        after = np.searchsorted(sure, doubtful)
        two = sure[np.clip([after - 1, after], 0, len(sure) - 1)]
        signs = np.where(lane[two] == lane[doubtful], np.sign(values[row, two]), 0.0)
        agree = signs[0] == signs[1]
        values[row, doubtful[agree]] = (signs[0] * noise[row])[agree]
    return values
