"""Rays through a region over a range: intervals at many values of the range, put together."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mechdesign.analyses.region.field import Field, Places
from mechdesign.analyses.region.rays import Intervals
from mechdesign.numerics.arrays import Complexes, Floats, Ints

# The name among the dimensions by which a value of the range is given.
VALUE = "value of the range"
# A near miss may be a hit between two values where parabolas gain so many times what they seem to, or a little.
ROOM, SLACK = 2.0, 0.02
# Nothing is sought nearer to a lane than this part of the way between those beside it.
LEAST = 1e-4
# Stretches so near to each other (of the reach) overlap: rounding parts them.
ROUNDING = 1e-15


@dataclass(frozen=True, eq=False)
class Sliced(Field):
    """A field whose held coordinate `which` differs from point to point: it is given among the places."""

    which: int = 0

    def margins(self, z: Complexes, places: Places, *, assembly: bool = True) -> Floats:
        """All margins at points `z`, shape (margins, *z.shape); nan where unknown."""
        sizes = dict(places)
        held: list[object] = list(self.held)
        held[self.which] = sizes.pop(VALUE)
        assert self.labels is not None
        # What is known of the sketch is copied, too.
        field = copy.copy(self)
        object.__setattr__(field, "held", tuple(held))
        return Field.margins(field, z, sizes, assembly=assembly)


@dataclass(frozen=True, eq=False)
class Lanes:
    """Rays at single values of the range.

    Parameters
    ----------
    ray : ndarray of int, shape (lanes,)
    value : ndarray, shape (lanes,)
    """

    ray: Ints
    value: Floats

    @cached_property
    def order(self) -> Ints:
        """Lanes by ray and value."""
        return np.lexsort((self.value, self.ray))

    @cached_property
    def beside(self) -> Ints:
        """The lane of the same ray with the next lower value, and with the next higher one, shape (2, lanes); or -1."""
        found = np.full((2, len(self.ray)), -1)
        one, two = self.order[:-1], self.order[1:]
        same = self.ray[one] == self.ray[two]
        found[1, one[same]], found[0, two[same]] = two[same], one[same]
        return found


@dataclass(frozen=True, eq=False)
class Stretches:
    """Stretches of lanes, inside the region or outside.

    Parameters
    ----------
    lane : ndarray of int, shape (n,)
    ends : ndarray, shape (2, n)
        Radii of both ends.
    labels : ndarray of int, shape (2, n)
        Margins that are zero there; -1 at the centre and at the end of the ray.
    """

    lane: Ints
    ends: Floats
    labels: Ints

    @staticmethod
    def inside(found: Intervals) -> Stretches:
        """The intervals of lanes."""
        return Stretches(found.ray, np.stack([found.inner, found.outer]), np.stack([found.enters, found.leaves]))

    @staticmethod
    def outside(found: Intervals, reach: Floats) -> Stretches:
        """What lies between the intervals of lanes; `reach` is of each lane."""
        lanes = np.arange(len(found.beyond))
        # Every lane begins with a gap at the centre, and every interval is followed by one.
        lane = np.concatenate([lanes, found.ray])
        start = np.concatenate([np.zeros(len(lanes)), found.outer])
        after = np.concatenate([np.full(len(lanes), -1), found.leaves])
        order = np.lexsort((start, lane))
        lane, start, after = lane[order], start[order], after[order]
        last = np.append(lane[1:] != lane[:-1], True)
        stop, before = np.empty(len(lane)), np.full(len(lane), -1)
        stop[last] = reach[lane[last]]
        stop[~last], before[~last] = found.inner, found.enters
        # No gap where an interval begins at the centre or goes on.
        some = ~((before < 0) & ~last) & ~((after < 0) & (start > 0))
        return Stretches(lane[some], np.stack([start, stop])[:, some], np.stack([after, before])[:, some])

    def joined(self, other: Stretches, lanes: int) -> Stretches:
        """These and those of further lanes, which are numbered from `lanes`."""
        return Stretches(
            np.concatenate([self.lane, other.lane + lanes]), np.concatenate([self.ends, other.ends], axis=1),
            np.concatenate([self.labels, other.labels], axis=1),
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Misses:
    """Where lanes nearly meet the region: one margin becomes negative just before another becomes positive.

    Parameters
    ----------
    lane, pair : ndarray of int, shape (n,)
        Lane, and a number for the two margins.
    width : ndarray
        How far the interval is from being one, negative.
    """

    lane: Ints
    pair: Ints
    width: Floats

    @staticmethod
    def of(found: Intervals, margins: int) -> Misses:
        """Near misses of lanes."""
        lane, radius, margin, turn = found.crossings
        miss = np.flatnonzero((lane[1:] == lane[:-1]) & (turn[:-1] < 0) & (turn[1:] > 0) & (margin[1:] != margin[:-1]))
        return Misses(lane[miss], margin[miss] * margins + margin[miss + 1], radius[miss] - radius[miss + 1])

    def joined(self, other: Misses, lanes: int) -> Misses:
        """These and those of further lanes, which are numbered from `lanes`."""
        return Misses(np.concatenate([self.lane, other.lane + lanes]), np.concatenate([self.pair, other.pair]),
                      np.concatenate([self.width, other.width]))  # fmt: skip

    def hidden(self, lanes: Lanes) -> tuple[Ints, Floats]:
        """Rays and values at which something may be met between lanes that nearly meet it."""
        pairs = int(self.pair.max(initial=0)) + 1
        key = self.lane * pairs + self.pair
        order = np.argsort(key, kind="stable")
        ordered = key[order]
        width, place = np.empty((2, len(key))), np.empty((2, len(key)))
        known = np.ones(len(key), dtype=bool)
        for side in range(2):
            lane = lanes.beside[side, self.lane]
            wanted = lane * pairs + self.pair
            begin, stop = np.searchsorted(ordered, wanted), np.searchsorted(ordered, wanted, side="right")
            known &= (lane >= 0) & (stop == begin + 1)
            at = order[np.minimum(begin, max(len(order) - 1, 0))] if len(order) else begin
            width[side], place[side] = self.width[at], lanes.value[lane]
        use = np.flatnonzero(known & (self.width > width[0]) & (self.width >= width[1]))
        here, value = self.width[use], lanes.value[self.lane[use]]
        before, after = place[0, use] - value, place[1, use] - value
        left, right = (width[0, use] - here) / before, (width[1, use] - here) / after
        bend = (right - left) / (after - before)
        slope = left - bend * before
        ahead = -0.5 * slope / bend
        gain = -0.25 * slope**2 / bend
        some = here + ROOM * gain + SLACK * np.maximum(here - width[0, use], here - width[1, use]) >= 0
        some &= (ahead > before) & (ahead < after) & (np.abs(ahead) > LEAST * (after - before))
        return lanes.ray[self.lane[use[some]]], (value + ahead)[some]


def merged(ray: Ints, ends: Floats) -> tuple[Ints, Floats, Ints]:
    """Stretches of rays with those that overlap made one.

    Returns
    -------
    ray, ends
        Of what results; ends of shape (2, m).
    source : ndarray of int, shape (2, m)
        The stretches that reach farthest, whose ends these are.
    """
    order = np.lexsort((ends[0], ray))
    owner, low, high = ray[order], ends[0, order], ends[1, order]
    # The farthest end so far on the ray: a running maximum of what is put beyond all earlier rays.
    room = 2.0 * np.max(high, initial=1.0)
    farthest = np.maximum.accumulate(high + room * owner) - room * owner
    tie = ROUNDING * room * (1 + owner[:-1])
    first = np.append(True, (owner[1:] != owner[:-1]) | (low[1:] > farthest[:-1] + tie))[: len(owner)]
    group, begin = np.cumsum(first) - 1, np.flatnonzero(first)
    top = np.full(len(begin), -np.inf)
    np.maximum.at(top, group, high)
    last = np.zeros(len(begin), dtype=np.intp)
    at_top = np.flatnonzero(high == top[group])
    last[group[at_top]] = at_top
    return owner[begin], np.stack([low[begin], high[last]]), order[np.stack([begin, last])]


def as_intervals(
    ray: Ints, ends: Floats, labels: Ints, value: Floats, reach: Floats, outside: bool
) -> tuple[Intervals, Floats]:
    """Stretches that do not overlap as the intervals of rays; or, of stretches outside, what lies between them.

    `value` belongs to `ends`, and so does what is returned to the intervals.
    """
    if outside:
        rays = np.arange(len(reach))
        owner = np.concatenate([rays, ray])
        low = np.concatenate([np.zeros(len(rays)), ends[1]])
        order = np.lexsort((low, owner))
        owner, low = owner[order], low[order]
        start = np.concatenate([np.full(len(rays), -1), labels[1]])[order]
        first = np.concatenate([np.full(len(rays), np.nan), value[1]])[order]
        last = np.append(owner[1:] != owner[:-1], True)
        high, stop, then = reach[owner].copy(), np.full(len(owner), -1), np.full(len(owner), np.nan)
        high[~last], stop[~last], then[~last] = ends[0], labels[0], value[0]
        some = high > low
        ray, ends = owner[some], np.stack([low, high])[:, some]
        labels, value = np.stack([start, stop])[:, some], np.stack([first, then])[:, some]
    beyond = np.zeros(len(reach), dtype=bool)
    beyond[ray[labels[1] < 0]] = True
    turn = np.repeat([[1], [-1]], len(ray), axis=1)
    met = (labels >= 0).T
    crossings = np.stack([ray, ray]).T[met], ends.T[met], labels.T[met], turn.T[met]
    return Intervals(ray, ends[0], ends[1], labels[0], labels[1], beyond, crossings), value
