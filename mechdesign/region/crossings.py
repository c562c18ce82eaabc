"""Where margins change their signs along lanes, the stretches of rays that are sampled.

Between two samples a margin whose slope changes no more than by its bend has one sign change at most, if it rises or
falls by more than half of that, and none, if it is farther from zero at both than an eighth of that. Bends are bounded
by second differences of neighbouring samples. Whatever is not decided so is divided: dips below zero, bumps above it,
and the neighbourhoods of places at which a link turns fast.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.ground.numerics.roots import bracketed_roots
from mechdesign.mechanism.algebra import norm2

# Margins, shape (margins, ...), how far angles are from the middle of their limits, of that shape too, and rotations of
# links, shape (links, ...), on some lanes at places between 0 and 1.
Look = Callable[[Ints, Floats], tuple[Floats, Floats, Complexes]]
# Lane, place, and what `Look` tells of samples, in order.
Samples = tuple[Ints, Floats, Floats, Floats, Complexes]
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
# A margin at the end of a lane has gone to zero as the square of the distance if it is this part of what it is beside.
TOUCHING = 1e-6
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
        Rows that are no margins but positive functions with which links turn, and which samples are to resolve where
        they are above their `noise`.

    Returns
    -------
    (margin, lane, direction, place, negative, open)
        Of each root its margin, lane, direction (1 rising, -1 falling) and place; of each lane the number of margins
        that are negative at its begin; and what is in doubt still.
    """
    even = np.linspace(0.0, 1.0, count)
    values, away, rotations = look(np.arange(lanes), even[:, None])
    some = np.flatnonzero(~_plain(values, rotations, noise, legs))
    lane, place = np.repeat(some, count), np.tile(even, len(some))
    values, away = (table[..., some].swapaxes(1, 2).reshape(len(table), -1) for table in (values, away))
    rotations = rotations[..., some].swapaxes(1, 2).reshape(len(rotations), -1)
    lane, place, values, left = resolved(look, (lane, place, values, away, rotations), nearest, noise, legs)
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
    first : Samples
        Those to begin with.
    nearest, noise, legs
        As in `sign_changes`.
    safety : float
        Bends are taken so many times as large as second differences tell.

    Returns
    -------
    (lane, place, margins, open)
        Of all samples; and the cells in doubt still, as nothing is divided further.
    """
    lane, place, values, away, rotations = first
    done: list[tuple[Ints, Floats, Floats]] = []
    lanes, left = len(nearest), [(lane[:0], np.zeros((2, 0)))]
    while True:
        cell, parts = _open(lane, place, values, away, rotations, noise, legs, safety)
        number = np.bincount(lane[cell], minlength=lanes)
        wide = (place[cell + 1] - place[cell] > nearest[lane[cell]]) & (number[lane[cell]] <= MOST_CELLS)
        left.append((lane[cell[~wide]], np.stack([place[cell], place[cell + 1]])[:, ~wide]))
        cell, parts = cell[wide], parts[:, wide]
        again = np.zeros(lanes, dtype=bool)
        again[lane[cell]] = True
        ready = ~again[lane]
        done.append((lane[ready], place[ready], values[:, ready]))
        if not cell.size:
            break
        between = place[cell] + parts * (place[cell + 1] - place[cell])
        more = np.tile(lane[cell], len(DIVIDED)), between.ravel()
        at_more = look(*more)
        lane, place, values, away, rotations = (
            np.concatenate([table[..., ~ready], new], axis=-1)
            for table, new in zip((lane, place, values, away, rotations), (*more, *at_more), strict=True)
        )
        order = np.lexsort((place, lane))
        lane, place, values, away = lane[order], place[order], values[:, order], away[:, order]
        rotations = rotations[:, order]
    lane, place, values = (np.concatenate(part, axis=-1) for part in zip(*done, strict=True))
    order = np.argsort(lane, kind="stable")
    doubt_lane, doubt = (np.concatenate(part, axis=-1) for part in zip(*left, strict=True))
    return lane[order], place[order], values[:, order], (doubt_lane, doubt)


def _plain(values: Floats, rotations: Complexes, noise: Floats, legs: Flags) -> Flags:
    """Lanes of even samples, shape (rows, samples, lanes), along which margins are too large for their bends to reach
    zero and links turn little.
    """
    second = np.diff(values, 2, axis=1)
    ends = np.abs(2 * second[:, [0, -1]] - second[:, [1, -2]])
    bend = SAFETY * np.maximum(np.abs(second).max(axis=1), ends.max(axis=1))
    far = 8 * values.min(axis=1) > bend
    far[legs] = 4 * np.maximum(values[legs, 1:], values[legs, :-1]).min(axis=1) > bend[legs]
    far[legs] |= values[legs].max(axis=1) <= noise[legs, None]
    near = np.asarray(norm2(np.diff(rotations, axis=1)) <= FARTHEST_TURN**2)
    return np.asarray(far.all(axis=0) & near.all(axis=(0, 1)))


def passed(before: Floats, after: Floats) -> Flags:
    """Whether angles lie on different sides of the middle of their limits, so that they pass these on the way."""
    return np.asarray((before * after < 0) & (np.abs(after - before) < np.pi))


def _open(
    lane: Ints, place: Floats, values: Floats, away: Floats, rotations: Complexes, noise: Floats, legs: Flags,
    safety: float,
) -> tuple[Ints, Floats]:  # fmt: skip
    """Cells between neighbouring samples that may hide sign changes inside the region; and where to divide each."""
    same = lane[1:] == lane[:-1]
    if not same.any():
        return np.flatnonzero(same), np.zeros((len(DIVIDED), 0))
    width = np.where(same, np.diff(place), 1.0)
    positive, size = values > 0, np.abs(values)
    change = np.diff(values)
    second = np.zeros(values.shape)
    second[:, 1:-1] = np.diff(change / width) / (0.5 * (width[1:] + width[:-1]))
    # At the ends of lanes second differences go on as they do beside them, and away from zero.
    for at, step in ((np.flatnonzero(np.append(True, ~same)), 1), (np.flatnonzero(np.append(~same, True)), -1)):
        one, two = at + step, at + 2 * step
        share = (place[one] - place[at]) / (place[two] - place[one])
        more = share * np.abs(second[:, one] - second[:, two])
        second[:, at] = second[:, one] + np.copysign(more, second[:, one])
    bend = np.abs(second)
    bend = np.fmax(bend[:, 1:], bend[:, :-1]) * (safety * width**2)
    # A margin that touches zero changes no sign.
    doubtful = same & (bend > np.maximum(2 * np.abs(change), safety * noise[:, None]))
    doubtful &= (8 * np.minimum(size[:, 1:], size[:, :-1]) <= bend) | (positive[:, 1:] != positive[:, :-1])
    most = np.maximum(size[legs, 1:], size[legs, :-1])
    doubtful[legs] = same & (4 * most <= bend[legs]) & (most > noise[legs, None])
    row, cell = np.nonzero(doubtful)
    sure = ~legs[row] & ~_curved(row, cell, lane, place, values, second, noise, safety)
    doubtful[row[sure], cell[sure]] = False
    # An angle outside its limits at both samples is within them on the way from one side to the other.
    between = same & passed(away[:, :-1], away[:, 1:]) & ~(positive[:, 1:] | positive[:, :-1])
    doubtful |= between
    # A leg that closes at one of two samples, by rounding, hides what lies between them.
    closes = ~np.isnan(values)
    doubtful |= same & legs.any() & (closes[:, 1:] != closes[:, :-1])
    turned = np.asarray(norm2(np.diff(rotations)) > FARTHEST_TURN**2).any(axis=0)
    outside = ~(positive[:, 1:] | positive[:, :-1] | doubtful).all(axis=0)
    undecided = np.flatnonzero((doubtful.any(axis=0) & ~outside) | (turned & same))
    parts = np.tile(DIVIDED[:, None], len(undecided))
    row, which = np.nonzero((doubtful & (positive[:, 1:] == positive[:, :-1]))[:, undecided])
    cell = undecided[which]
    curved = 0.5 * (second[row, cell] + second[row, cell + 1]) * width[cell] ** 2
    vertex = 0.5 - change[row, cell] / curved
    middle = away[row, cell] / (away[row, cell] - away[row, cell + 1])
    vertex = np.nan_to_num(np.where(between[row, cell], middle, vertex), nan=0.5)
    vertex = np.clip(vertex, 2 * BESIDE, 1 - 2 * BESIDE)
    middle = np.where(vertex < 0.5, 1 + vertex, vertex) / 2
    parts[:, which] = np.sort([vertex - BESIDE, vertex + BESIDE, middle], axis=0)
    return undecided, parts


def _curved(
    row: Ints, cell: Ints, lane: Ints, place: Floats, values: Floats, second: Floats, noise: Floats, safety: float
) -> Flags:  # fmt: skip
    """Which margins may curve so far between two samples that they change their sign once more."""
    width, last = place[cell + 1] - place[cell], len(lane) - 1
    low, high = values[row, cell], values[row, cell + 1]
    # Where bends hardly change from sample to sample they are known the better.
    at = cell + np.arange(-1, 3)[:, None]
    of_lane = (at >= 0) & (at <= last) & (lane[np.clip(at, 0, last)] == lane[cell])
    around = second[row, np.where(of_lane, at, cell + (at > cell))]
    varies = np.fmax.reduce(np.abs(np.diff(around, axis=0)), axis=0)
    # Where they change by more than they are, samples do not resolve the margin: by so much it may bend, too.
    bend = np.fmax(*np.abs(around[1:3]))
    bend = np.fmin(np.fmax(safety * bend, bend + varies), bend + safety * varies) * width**2
    change, least = np.abs(high - low), np.minimum(np.abs(low), np.abs(high))
    may = (2 * change < bend) & (bend > safety * noise[row]) & (least > noise[row])
    may &= ((low > 0) != (high > 0)) | ((bend - 2 * change) ** 2 >= 8 * least * bend)
    # A margin that touches zero at the end of a lane goes from there as the square of the distance; others may go
    # linearly, where a leg is stretched or folded.
    begins, touches = ~of_lane[0], least <= TOUCHING * np.maximum(np.abs(low), np.abs(high))
    some = np.flatnonzero(may & touches & ~(of_lane[0] & of_lane[3]))
    if some.size:
        at = np.where(begins[some], cell[some] + np.arange(4)[:, None], cell[some] + 1 - np.arange(4)[:, None])
        square, f = (place[at] - place[at[0]]) ** 2, values[row[some], at]
        slope = np.diff(f, axis=0) / np.diff(square, axis=0)
        bent = 2 * np.diff(slope, axis=0) / (square[2:] - square[:-2])
        bent = (np.abs(bent[0]) + np.abs(np.diff(bent, axis=0)[0])) * safety * square[1] ** 2
        may[some] = 2 * change[some] <= bent
    return np.asarray(may)


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
