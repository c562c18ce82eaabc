"""Where smooth functions of one variable change their sign, also where they do so twice within an interval.

All intervals are worked at once. The functions come in an order: one is nan where another before it is negative, so
that the roots of the first divide the interval within which the second is looked at.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.numerics.minima import GOLDEN, lowest
from mechdesign.numerics.roots import bracketed_roots

# Values of all functions in intervals `lane` at `x`: shape (functions, n).
Evaluate = Callable[[Ints, Floats], Floats]
# Values of one function in parts of intervals at `x`.
One = Callable[[Ints, Floats], Floats]

# Where each part of an interval is looked at: near its ends too, so that the slope there is seen, and off the round
# numbers at which roots like to lie.
LOOKS = np.array([0.0, 1e-4, *((np.arange(8) + GOLDEN) / 8), 1 - 1e-4, 1.0])


@dataclass(frozen=True, eq=False)
class Found:
    """Places within intervals: the interval, the place, and the function it belongs to with its value there."""

    lane: Ints
    place: Floats
    function: Ints
    value: Floats

    @staticmethod
    def joined(parts: list[Found]) -> Found:
        """All of several; none of an empty list."""
        none = np.zeros(0, dtype=np.intp)
        parts = [Found(none, np.zeros(0), none, np.zeros(0)), *parts]
        return Found(
            np.concatenate([p.lane for p in parts]), np.concatenate([p.place for p in parts]),
            np.concatenate([p.function for p in parts]), np.concatenate([p.value for p in parts]),
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Probes:
    """Intervals divided at all roots.

    Parameters
    ----------
    lane, place : ndarray
        Interval and middle of each part between two roots, in order.
    roots, lows : Found
        Changes of sign, and smallest absolute values inside the intervals.
    """

    lane: Ints
    place: Floats
    roots: Found
    lows: Found


def probe(evaluate: Evaluate, begin: Floats, end: Floats, precision: Floats) -> Probes:
    """Divide intervals from `begin` to `end` at the roots of all functions, one function after another.

    Parameters
    ----------
    precision : ndarray, shape (functions,)
        To which each function's roots are wanted, as a part of the distance between two looks.
    """
    lane = np.arange(len(begin))
    low, high = begin.astype(float), end.astype(float)
    roots: list[Found] = []
    lows: list[Found] = []
    grid, values = _look(evaluate, lane, low, high)
    for j in range(len(values)):

        def one(part: Ints, x: Floats, j: int = j, lane: Ints = lane) -> Floats:
            found: Floats = evaluate(lane[part], x)[j]
            return found

        bottoms = _bottoms(one, grid, values[j], 1)
        tops = _bottoms(one, grid, values[j], -1)
        lows += [Found(lane[part], place, np.full(len(part), j), value) for part, place, value in (bottoms, tops)]
        part, root = _roots(
            one,
            float(precision[j]),
            grid,
            values[j],
            *(np.concatenate(pair) for pair in zip(bottoms, tops, strict=True)),
        )
        if len(root):
            roots.append(Found(lane[part], root, np.full(len(root), j), np.zeros(len(root))))
            lane, low, high = _divided(lane, low, high, part, root)
            grid, values = _look(evaluate, lane, low, high)
    return Probes(lane, low + (high - low) / 2, Found.joined(roots), Found.joined(lows))


def _look(evaluate: Evaluate, lane: Ints, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Places at which the parts are looked at, shape (looks, parts), and the functions there."""
    grid = low + (high - low) * LOOKS[:, None]
    grid[-1] = high
    values = evaluate(np.tile(lane, len(LOOKS)), grid.ravel())
    return grid, values.reshape(len(values), *grid.shape)


def _bottoms(one: One, grid: Floats, values: Floats, sign: int) -> tuple[Ints, Floats, Floats]:
    """Part, place and value of each smallest positive value (`sign` 1) or largest negative one (-1) between looks."""
    v = sign * values
    inner = v[1:-1]
    seen = (inner > 0) & (inner <= v[:-2]) & (inner <= v[2:]) & ((inner < v[:-2]) | (inner < v[2:]))
    look, part = np.nonzero(seen)
    a, b = grid[look, part], grid[look + 2, part]
    if not len(part):
        return part, a, a

    def height(x: Floats) -> Floats:
        value = sign * one(part, x)
        # What is not a number lies beyond a root.
        return np.where(np.isnan(value), -np.inf, value)

    place, _ = lowest(height, a, b)
    return part, place, one(part, place)


def _roots(
    one: One, precision: float, grid: Floats, values: Floats, part: Ints, place: Floats, value: Floats
) -> tuple[Ints, Floats]:
    """Part and place of each change of sign between the looks and the places added to them."""
    parts = np.concatenate([np.tile(np.arange(grid.shape[1]), len(grid)), part])
    places = np.concatenate([grid.ravel(), place])
    height = np.concatenate([values.ravel(), value])
    forward = np.where(grid[-1] >= grid[0], 1.0, -1.0)[parts]
    order = np.lexsort((places * forward, parts))
    parts, places, height = parts[order], places[order], height[order]
    positive, known = height >= 0, np.isfinite(height)
    change = np.flatnonzero((parts[1:] == parts[:-1]) & (positive[1:] != positive[:-1]) & known[1:] & known[:-1])
    which, a, b = parts[change], places[change], places[change + 1]
    none = np.full(len(change), np.nan)
    tolerance = np.abs(b - a) * precision
    return which, bracketed_roots(
        lambda left, x: one(which[left], x), a, height[change], b, height[change + 1], none, none, tolerance
    )


def _divided(lane: Ints, low: Floats, high: Floats, part: Ints, root: Floats) -> tuple[Ints, Floats, Floats]:
    """The parts divided at further roots, in order."""
    owner = np.concatenate([np.arange(len(lane)), part])
    begin = np.concatenate([low, root])
    forward = np.where(high >= low, 1.0, -1.0)
    order = np.lexsort((begin * forward[owner], owner))
    owner, begin = owner[order], begin[order]
    last = np.append(owner[1:] != owner[:-1], True)
    end = np.where(last, high[owner], np.append(begin[1:], 0.0))
    return lane[owner], begin, end
