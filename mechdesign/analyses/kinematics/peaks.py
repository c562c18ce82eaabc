"""Smallest and largest values of functions along a line of poses: at its limits, and where their slopes are zero."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.kinematics.lines import Line
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.numerics.minima import lowest
from mechdesign.numerics.roots import bracketed_roots

# Value and slope of a function from the values and slopes of a line's leaves, shape (leaves, n).
Curve = Callable[[Floats, Floats], tuple[Floats, Floats]]
# Values of functions, shape (functions, n), beside poses of a line with the swept coordinate elsewhere.
Along = Callable[[Ints, Floats], Floats]

# How far from its place an extreme may be found, as a part of its segment.
PRECISION = 1e-13
# A range below this part of a function's size is rounding.
STILL = 1e-12
# Where a segment that may hold an extreme is looked at first.
LOOKS = np.array([0.25, 0.5, 0.75])


@dataclass(frozen=True, eq=False)
class Peak:
    """The smallest value of each function over each design's line, between its poses of the sweep.

    Arrays have the shape (functions, designs); values are nan where there is nothing but poses of the sweep.

    Parameters
    ----------
    value : ndarray
        Times the sign that was asked.
    place, position : ndarray
        Swept coordinate (core's units), and place along the sweep in rows.
    node : ndarray of int
        The line's pose at or beside it.
    """

    value: Floats
    place: Floats
    position: Floats
    node: Ints

    def better(
        self, value: Floats, row: Ints, still: Floats, moving: Flags
    ) -> Flags:  # fmt: skip
        """Where it is smaller than at the best pose of the sweep, or is that pose's extreme but beside it.

        Parameters
        ----------
        value, row : ndarray, shape (functions, designs)
            Smallest value over the poses of the sweep, and the pose.
        still : ndarray
            What is rounding.
        moving : bool array
            Whether the function moves between the poses of the sweep.
        """
        away = np.abs(self.position - row)
        with np.errstate(invalid="ignore"):
            beside = (np.abs(self.value - value) <= still) & (away < 1) & (away > 1e-9)
            return np.isfinite(self.value) & ((self.value < value - still) | (moving & beside))


def peaks(
    line: Line, curves: Sequence[Curve], still: Floats, told: Sequence[Curve] | None = None
) -> list[Peak]:  # fmt: skip
    """Smallest values of curves, and of them times -1, where a slope is zero or the motion ends.

    A segment cannot hold a value below both its ends by more than half its length times its largest slope: links
    hardly turn within it. Those that may hold the smallest of all are divided where their slope does not change evenly,
    so that it might be zero twice: by its parabola, in the middle by a quarter of its larger end.

    Parameters
    ----------
    still : ndarray, shape (curves, designs)
        What is rounding.
    told : sequence of callable, optional
        Rising functions of the curves whose values are wanted instead; then those of the sweep's own poses too.
    """
    signs = (1, -1)
    for looks in (LOOKS, None):
        values, slopes = _curves(curves, line.values, line.slopes)
        length = line.place[line.end] - line.place[line.begin]
        design = line.row[line.begin] // line.each
        one, other = slopes[:, line.begin] * length, slopes[:, line.end] * length
        drop = np.nan_to_num(np.fmax(np.abs(one), np.abs(other)), nan=0.0) / 2
        likely = []
        for sign in signs:
            best = line.least(sign * values)[:, design]
            least = np.fmin(sign * values[:, line.begin], sign * values[:, line.end]) - drop
            likely.append(least < best)
        rise = values[:, line.end] - values[:, line.begin]
        with np.errstate(invalid="ignore"):
            bent = ~(6 * np.abs(rise - (one + other) / 2) <= np.fmax(np.abs(one), np.abs(other)))
        if looks is not None and len(design):
            line.divide(np.flatnonzero((np.logical_or.reduce(likely) & bent).any(axis=0)), looks)
    which, curve, segment = np.nonzero([
        some & (sign * one < 0) & (sign * other > 0) for sign, some in zip(signs, likely, strict=True)
    ])  # fmt: skip
    times = np.array(signs)[which]

    def at(which: Sequence[Curve], lane: Ints, x: Floats) -> tuple[Floats, Floats]:
        return _at(line, which, curve[lane], line.begin[segment[lane]], x)

    low, high = line.place[line.begin[segment]], line.place[line.end[segment]]
    none = np.full(len(segment), np.nan)
    # Along the sweep, whichever way it goes.
    ahead = times * np.sign(high - low)
    place = bracketed_roots(
        lambda lane, x: ahead[lane] * at(curves, lane, x)[1],
        low, times * one[curve, segment], high, times * other[curve, segment], none, none,
        PRECISION * np.abs(high - low),
    )  # fmt: skip
    value = times * at(told or curves, np.arange(len(segment)), place)[0]
    first = line.position[line.begin[segment]]
    position = first + (place - low) / (high - low) * (line.position[line.end[segment]] - first)
    if told is not None:
        values, _ = _curves(told, line.values, line.slopes)
    found = []
    for k, this in enumerate(signs):
        mine = np.flatnonzero((which == k) & np.isfinite(value))
        here, node = _best_poses(line, this * values, still, told is not None)
        found.append(_first_smallest(
            line, still,
            np.concatenate([here, curve[mine]]),
            np.concatenate([node, line.begin[segment[mine]]]),
            np.concatenate([this * values[here, node], value[mine]]),
            np.concatenate([line.place[node], place[mine]]),
            np.concatenate([line.position[node], position[mine]]),
        ))  # fmt: skip
    return found


def _best_poses(line: Line, values: Floats, still: Floats, rows: bool) -> tuple[Ints, Ints]:
    """Function and pose where a pose of the line is the best; those of the sweep itself only if `rows`."""
    design = line.row // line.each
    with np.errstate(invalid="ignore"):
        best = values <= (line.least(values) + still)[:, design]
    if not rows:
        best &= line.position != np.round(line.position)
    if line.followed:
        sharp = ~np.isnan(line.slopes).all(axis=0)
        sharp[line.limits] = True
        best &= sharp
    function, node = np.nonzero(best)
    return function, node


def searched(line: Line, along: Along, table: Floats, still: Floats) -> Peak:
    """Smallest values of functions without slopes, by golden section beside the poses that are below their neighbours.

    Parameters
    ----------
    along : callable
        Values, of shape (functions, n), at places beside poses of the line (indices); nan where there are none.
    table : ndarray, shape (functions, n)
        Values at the poses of the line.
    """
    before, after = np.arange(len(line.row)), np.arange(len(line.row))
    before[line.end], after[line.begin] = line.begin, line.end
    known = np.where(np.isnan(table), np.inf, table)
    best = line.least(known)[:, line.row // line.each]
    with np.errstate(invalid="ignore"):
        around = [np.where(np.isfinite(known[:, side]), known[:, side] - known, 0.0) for side in (before, after)]
        fall = np.maximum(*around)
        function, node = np.nonzero(np.isfinite(known) & (around[0] >= 0) & (around[1] >= 0) & (known - fall <= best))

    def value(x: Floats) -> Floats:
        one = along(node, x)[function, np.arange(len(node))]
        return np.where(np.isnan(one), np.inf, one)

    at = np.stack([line.place[before[node]], line.place[node], line.place[after[node]]])
    low, high = at.min(axis=0), at.max(axis=0)
    place, least = lowest(value, low, high) if len(node) else (low, low)
    least = np.where(np.isfinite(least), least, np.nan)
    # Which of the two segments beside the pose it lies in.
    ahead = (place - line.place[node]) * (line.place[after[node]] - line.place[node]) > 0
    side = np.where(ahead, after[node], before[node])
    span = line.place[side] - line.place[node]
    part = np.where(span != 0, (place - line.place[node]) / np.where(span != 0, span, 1.0), 0.0)
    position = line.position[node] + part * (line.position[side] - line.position[node])
    here, inner = _best_poses(line, table, still, False)
    good = np.isfinite(least)
    return _first_smallest(
        line, still,
        np.concatenate([here, function[good]]),
        np.concatenate([inner, node[good]]),
        np.concatenate([table[here, inner], least[good]]),
        np.concatenate([line.place[inner], place[good]]),
        np.concatenate([line.position[inner], position[good]]),
    )  # fmt: skip


def _curves(curves: Sequence[Curve], values: Floats, slopes: Floats) -> tuple[Floats, Floats]:
    found = [curve(values, slopes) for curve in curves]
    shape = (len(curves), values.shape[1])
    return (
        np.array([np.broadcast_to(value, shape[1]) for value, _ in found]).reshape(shape),
        np.array([np.broadcast_to(slope, shape[1]) for _, slope in found]).reshape(shape),
    )


def _at(line: Line, curves: Sequence[Curve], which: Ints, node: Ints, place: Floats) -> tuple[Floats, Floats]:
    """Value and slope of curve `which` of each lane at `place`, beside a pose of the line."""
    values, slopes, _ = line.sample(line.row[node], place)
    values = line.near(values, node)
    value, slope = np.empty(len(which)), np.empty(len(which))
    for k in np.unique(which):
        mine = which == k
        value[mine], slope[mine] = curves[k](values[:, mine], slopes[:, mine])
    return value, slope


def _first_smallest(
    line: Line, still: Floats, function: Ints, node: Ints, value: Floats, place: Floats, position: Floats
) -> Peak:  # fmt: skip
    """Of many candidates, the first along the sweep of those that are the smallest but for rounding."""
    shape = still.shape
    lane = function * shape[1] + line.row[node] // line.each
    least = np.full(still.size, np.inf)
    np.minimum.at(least, lane, np.where(np.isnan(value), np.inf, value))
    tie = np.flatnonzero(value <= (least + still.ravel())[lane])
    tie = tie[np.lexsort((position[tie], lane[tie]))]
    lanes, chosen = np.unique(lane[tie], return_index=True)
    best = tie[chosen]
    found = [np.full(still.size, np.nan) for _ in range(3)]
    nodes = np.zeros(still.size, dtype=np.intp)
    for table, column in zip(found, (value, place, position), strict=True):
        table[lanes] = column[best]
    nodes[lanes] = node[best]
    best_value, best_place, best_position = (table.reshape(shape) for table in found)
    return Peak(best_value, best_place, best_position, nodes.reshape(shape))
