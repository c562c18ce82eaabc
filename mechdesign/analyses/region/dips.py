"""Sign changes of functions between their samples: dips below zero and humps above it that no sample met."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mechdesign.numerics.arrays import Floats, Ints

# Steps of the search for the lowest place between three samples.
STEPS = 24
GOLDEN = 0.5 * (3 - np.sqrt(5))
# A step of the search this small (as a part of the bracket's place) has met the bottom.
BOTTOM = 1e-9
# A function may fall this many times as far as one that is convex.
ROOM = 2.0


def rounded(values: Floats, rounding: Floats) -> tuple[Floats, Floats]:
    """Samples whose value is but rounding given the sign of both neighbours, and what rounding is (functions, lanes).

    Parameters
    ----------
    values : ndarray, shape (functions, samples, lanes)
    rounding : ndarray, shape (functions,)
        Values below it have no sign of their own.
    """
    noise = np.broadcast_to(rounding[:, None], (len(values), values.shape[2]))
    beside = np.sign(values[:, :-2])
    with np.errstate(invalid="ignore"):
        doubtful = (np.abs(values[:, 1:-1]) <= noise[:, None]) & (beside == np.sign(values[:, 2:]))
    if not doubtful.any():
        return values, noise
    values = values.copy()
    values[:, 1:-1] = np.where(doubtful, beside * noise[:, None], values[:, 1:-1])
    return values, noise


def hidden_places(
    evaluate: Callable[[Ints, Ints, Floats], Floats], x: Floats, values: Floats, noise: Floats
) -> tuple[Ints, Ints, Floats, Floats]:
    """Places between samples at which a function has the other sign than at the samples on both sides.

    A local minimum above zero (or maximum below) is searched by golden sections where the slopes beside it admit a
    zero.

    Parameters
    ----------
    evaluate : callable
        ``evaluate(function, lane, x)``: values of some functions in some lanes.
    x : ndarray, shape (samples, lanes)
        Samples, ascending.
    values : ndarray, shape (functions, samples, lanes)
        The functions there; nan is no sample.
    noise : ndarray, shape (functions, lanes)
        Values of the other sign that are no larger are rounding.

    Returns
    -------
    (function, lane, x, value)
    """
    before, here, after = values[:, :-2], values[:, 1:-1], values[:, 2:]
    left, right = x[1:-1] - x[:-2], x[2:] - x[1:-1]
    with np.errstate(invalid="ignore", divide="ignore"):
        sign = np.sign(here)
        height, fall, rise = np.abs(here), sign * (before - here), sign * (after - here)
        lowest = (fall >= 0) & (rise >= 0) & (sign * before > 0) & (sign * after > 0)
        slope = np.maximum(fall / left, rise / right)
        lowest &= (height <= slope * np.maximum(left, right)) & np.isfinite(height)
    function, row, lane = np.nonzero(lowest)
    if not len(function):
        return function, lane, np.zeros(0), np.zeros(0)
    turn = sign[function, row, lane]
    a, b, c = x[row, lane], x[row + 1, lane], x[row + 2, lane]
    fa, fb, fc = (turn * values[function, row + k, lane] for k in range(3))
    found = np.zeros(len(function), dtype=bool)
    alive = np.arange(len(function))
    for _ in range(STEPS):
        al, bl, cl = a[alive], b[alive], c[alive]
        upper = cl - bl > bl - al
        trial = np.where(upper, bl + GOLDEN * (cl - bl), bl - GOLDEN * (bl - al))
        value = turn[alive] * evaluate(function[alive], lane[alive], trial)
        fal, fbl, fcl = fa[alive], fb[alive], fc[alive]
        better = value < fbl
        # The new bracket begins at the lowest place so far or at the trial, or still where it did; and ends likewise.
        begins, ends = better == upper, better != upper
        inner, f_inner = np.where(better, bl, trial), np.where(better, fbl, value)
        b[alive], fb[alive] = np.where(better, trial, bl), np.where(better, value, fbl)
        a[alive], fa[alive] = np.where(begins, inner, al), np.where(begins, f_inner, fal)
        c[alive], fc[alive] = np.where(ends, inner, cl), np.where(ends, f_inner, fcl)
        al, bl, cl, fal, fbl, fcl = a[alive], b[alive], c[alive], fa[alive], fb[alive], fc[alive]
        with np.errstate(invalid="ignore", divide="ignore"):
            # What is convex stays above the line from either end through the lowest place.
            fall = np.maximum((fal - fbl) / (bl - al) * (cl - bl), (fcl - fbl) / (cl - bl) * (bl - al))
            hopeless = fbl > ROOM * fall
        found[alive] = fbl < -noise[function[alive], lane[alive]]
        alive = alive[~(found[alive] | hopeless | (cl - al <= BOTTOM * np.abs(cl)))]
        if not len(alive):
            break
    return function[found], lane[found], b[found], (turn * fb)[found]


@dataclass(frozen=True, eq=False)
class Brackets:
    """Brackets of sign changes: places and values at both ends, and of a third sample."""

    function: Ints
    lane: Ints
    low: tuple[Floats, Floats]
    high: tuple[Floats, Floats]
    third: tuple[Floats, Floats]


def sign_changes(x: Floats, values: Floats, hidden: tuple[Ints, Ints, Floats, Floats]) -> Brackets:
    """Brackets of every change of sign between samples, and of those at hidden places; nan counts as negative.

    Parameters
    ----------
    x, values, hidden
        As `hidden_places` takes and gives them.
    """
    positive = values > 0
    function, cell, lane = np.nonzero(positive[:, 1:] != positive[:, :-1])
    other = np.where(cell > 0, cell - 1, np.minimum(cell + 2, len(x) - 1))

    def sample(k: Ints) -> tuple[Floats, Floats]:
        return x[k, lane], values[function, k, lane]

    plain = Brackets(function, lane, sample(cell), sample(cell + 1), sample(other))
    if not len(hidden[0]):
        return plain
    function, lane, place, value = hidden
    cell = (x[:, lane] < place).sum(axis=0) - 1
    low, high, nan = sample(cell), sample(cell + 1), np.full(len(cell), np.nan)
    parts = (
        plain,
        Brackets(function, lane, low, (place, value), (nan, nan)),
        Brackets(function, lane, (place, value), high, (nan, nan)),
    )

    def join(name: str) -> tuple[Floats, Floats]:
        places, found = (np.concatenate([getattr(part, name)[k] for part in parts]) for k in range(2))
        return places, found

    return Brackets(
        np.concatenate([part.function for part in parts]), np.concatenate([part.lane for part in parts]),
        join("low"), join("high"), join("third"),
    )  # fmt: skip
