"""A motion between its poses as curves need it: at its ends, at extremes, and wherever chords would be seen."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.mechanism import Configuration
from mechdesign.motion.along import AlongMotion
from mechdesign.motion.curve import INSET, Curve
from mechdesign.motion.motion import SolvedPoses
from mechdesign.motion.question import PoseQuestion, PoseValues, unfilled

# Of more poses none are added for the sake of curves.
MAX_POSES = 721
# A curve leaves its chord by this part of its range at most, the path of a point by this part of the mechanism's size.
CHORD = 1e-3
# Of the way from one pose to the next at most: a jump is never short enough.
HALVINGS = 8
# Places nearer to each other than this, in rows, are one.
SAME_PLACE = 1e-6
# Quantile beyond which values are peaks, and how many times the range of the others these may widen what is seen.
_PEAKS, _BEYOND = 0.05, 10.0
# Part of its size by which a column changes that stands still.
_STILL = 1e-9


def near_chords(
    curve: Curve, ways: Callable[[Floats], Complexes], places: Floats, most: int = MAX_POSES
) -> tuple[Floats, Complexes]:
    """Places of motions with more between them, until no way leaves its chords by one; and the ways there.

    Where the motion closes they end with its begin.

    Parameters
    ----------
    curve : Curve
        Motions that all get the same places.
    ways : callable
        Ways at places, such as points' paths, shape (ways, places), nan where they do not count.
    places : ndarray
        In rows of the poses of each motion.
    most : int
        With so many places none is added.
    """
    if curve.poses.closed:
        places = np.append(places, curve.poses.end)
    if curve.lines == 1:
        places = together(places, _ends(curve))
    ends = ways(places)
    open_ = np.ones(len(places) - 1, dtype=bool)
    for _ in range(HALVINGS):
        if len(places) >= most or not open_.any():
            break
        # Beyond the ends of a motion there is nothing to be drawn.
        before = np.flatnonzero(open_ & np.isfinite(ends[:, :-1] + ends[:, 1:]).any(axis=0))
        middles = (places[before] + places[before + 1]) / 2
        between, one, other = ways(middles), ends[:, before], ends[:, before + 1]
        far = np.abs(between - (one + other) / 2) > 1.0
        new = far.any(axis=0)
        at = before[new] + 1
        places, ends = np.insert(places, at, middles[new]), np.insert(ends, at, between[:, new], axis=1)
        open_ = np.zeros(len(places) - 1, dtype=bool)
        halves = at + np.arange(len(at))
        open_[halves - 1] = open_[halves] = True
    return places, ends


def ways_of(curve: Curve, points: Sequence[str]) -> Callable[[Floats], Complexes]:
    """Paths of points as ways, of which chords are seen from one on; along all motions of a curve."""

    def ways(places: Floats) -> Complexes:
        line, s = curve.grid(places)
        held = np.flatnonzero(curve.holds(line, s, INSET * curve.poses.end))
        drawn = np.full((len(points), len(s)), np.nan, dtype=complex)
        if len(held):
            there = curve.solve(line[held], s[held]).configuration
            drawn[:, held] = paths_of(there, points) / (CHORD * curve.mechanism.size)
        return drawn.reshape(len(points) * curve.lines, len(places))

    return ways


def paths_of(configuration: Configuration, points: Sequence[str]) -> Complexes:
    """Where points are in solved poses, shape (points, poses)."""
    places = [np.where(configuration.valid, configuration.point(point), np.nan) for point in points]
    return np.array(places, dtype=complex).reshape(len(points), *configuration.shape)


def seen(columns: Mapping[str, Floats], sizes: Mapping[str, float]) -> dict[str, tuple[float, float, float]]:
    """What is seen of columns of poses: by how much they change, and between which values they are drawn.

    Of those that grow without bound it is a part. What stands still is left out; `sizes` are least sizes, by which
    rounding is judged.
    """
    ranges = dict[str, tuple[float, float, float]]()
    for name, values in columns.items():
        finite = values[np.isfinite(values)]
        if not len(finite):
            continue
        low, high = np.quantile(finite, (_PEAKS, 1 - _PEAKS)).tolist()
        whole = float(np.ptp(finite))
        if whole > _STILL * max(float(np.abs(finite).max()), sizes.get(name, 0.0)):
            size = min(whole, _BEYOND * (high - low)) or whole
            ranges[name] = size, low - size, high + size
    return ranges


def together(places: Floats, marked: Floats) -> Floats:
    """Places in rows, and those that are marked; such that nearly fall together with another are left out."""
    marked = np.sort(marked[np.isfinite(marked)])
    marked = marked[np.append(True, np.diff(marked) > SAME_PLACE)[: len(marked)]]
    after = np.clip(np.searchsorted(places, marked), 1, len(places) - 1)
    apart = np.minimum(np.abs(marked - places[after - 1]), np.abs(marked - places[after])) > SAME_PLACE
    return np.sort(np.append(places, marked[apart]))


def _ends(curve: Curve) -> Floats:
    """Where a motion begins, ends before a gap, goes on behind it, and ends, in rows."""
    pieces = curve.pieces
    if not len(pieces.line):
        return np.empty(0)
    joined = pieces.joined_to_next
    ends = np.append(pieces.begin[np.append(True, ~joined)], pieces.end[np.append(~joined, True)])
    return curve.inside(np.zeros(len(ends), dtype=np.intp), ends)


def extremes_of(along: AlongMotion) -> Floats:
    """Where the columns of a motion have their extremes, in rows."""
    places = along.peaks.place.ravel()
    return along.snapped(places[np.isfinite(places)])


def asked_at(question: PoseQuestion, curve: Curve, places: Floats) -> tuple[SolvedPoses, PoseValues]:
    """Solved poses at places of a motion, in rows, and what a question has there."""
    there = curve.solve(np.zeros(len(places), dtype=np.intp), places)
    values = unfilled(question.at(there.poses))
    values.fill(there)
    return there, values


def finer(
    question: PoseQuestion, curve: Curve, rows: Floats, values: PoseValues,
    columns: Callable[[PoseValues], Mapping[str, Floats]], sizes: Mapping[str, float] | None = None,
    followed: Collection[str] = (),
) -> tuple[SolvedPoses, PoseValues]:  # fmt: skip
    """Solved poses at places of a motion as curves need it, and what a question has there.

    Parameters
    ----------
    rows : ndarray
        Places that are among them: those of the poses that are shown, others that are marked.
    values : PoseValues
        At the poses.
    columns : callable
        What is drawn of values; beyond the limits of the motion, where poses take long to be sought, it is not asked.
    sizes : mapping of str to float
        Least sizes of columns, by which rounding is judged.
    followed : collection of str
        Columns whose extremes are among the places already.
    """
    ranges = seen(columns(values), sizes or {})

    def ways(places: Floats) -> Complexes:
        drawn = np.full((len(ranges), len(places)), np.nan, dtype=complex)
        held = np.flatnonzero(curve.holds(np.zeros(len(places), dtype=np.intp), places, INSET * curve.poses.end))
        if len(held):
            there = columns(asked_at(question, curve, places[held])[1])
            for row, (name, (size, low, high)) in zip(drawn, ranges.items(), strict=True):
                row[held] = np.clip(there[name], low, high) / (CHORD * size)
        return drawn

    places, drawn = near_chords(curve, ways, rows)
    own = [k for k, name in enumerate(ranges) if name not in followed]
    return asked_at(question, curve, together(places, _tops(places, drawn.real[own])))


def _tops(places: Floats, values: Floats) -> Floats:
    """Places of the largest and the smallest of values, shape (columns, places), by parabolas through three of them."""
    if len(places) < 3:
        return np.empty(0)
    inner = np.where(np.isnan(values[:, :-2] + values[:, 1:-1] + values[:, 2:]), np.nan, values[:, 1:-1])
    both = np.concatenate([inner, -inner])
    row = np.nan_to_num(both, nan=-np.inf).argmax(axis=1) if both.shape[1] else np.zeros(len(both), dtype=np.intp)
    lane = np.tile(np.arange(len(values)), 2)
    one, middle, other = (values[lane, row + k] for k in range(3))
    before, after = places[row + 1] - places[row], places[row + 2] - places[row + 1]
    rise, fall = (middle - one) / before, (middle - other) / after
    top = places[row + 1] + (rise * after - fall * before) / (rise + fall) / 2
    turns = (rise * fall > 0) & (top > places[row]) & (top < places[row + 2])
    return np.asarray(top[turns])
