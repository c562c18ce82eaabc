"""Panels of a scan: ranges of the ray's angle over which the same margins bound the same intervals.

Within a panel the ends of the intervals are smooth functions of the angle. Where the bounding margins change (corners),
or intervals appear (cusps, tangents), a panel ends, so that quadrature rules keep their order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.rays import Designs, Floats, Intervals, Ints, trace
from mechdesign.analyses.roots import bracketed_roots
from mechdesign.errors import AssemblyError

PROBES = 4
DOUBLINGS = 16
# Angles of panel ends are wanted to this accuracy (radians).
ACCURACY = 1e-13
# Panel ends nearer to each other than this are one (radians): what lies between them is lost in rounding.
TOGETHER = 1e-7


@dataclass(frozen=True)
class Effort:
    """How finely the region is looked for: rays over the scan, samples along each ray."""

    rays: int
    samples: int


@dataclass(frozen=True, eq=False)
class Panels:
    """Panels of all designs, ordered by design and angle.

    Parameters
    ----------
    design, low, high : ndarray, shape (panels,)
        Design and range of angle of each panel.
    reach : ndarray, shape (designs,)
        Radius beyond the whole region of each design.
    closes : ndarray of bool, shape (designs,)
        Whether any ray met the region.
    """

    design: Ints
    low: Floats
    high: Floats
    reach: Floats
    closes: NDArray[np.bool_]


def find_panels(designs: Designs, scan: tuple[float, float], effort: Effort, cuts: tuple[float, ...] = ()) -> Panels:
    """Divide the scan of every design into panels; `cuts` are further angles where panels end.

    Raises
    ------
    AssemblyError
        If the region has no end.
    """
    count = designs.count
    reach = _extent(designs, np.linspace(*scan, PROBES + 1), _first_guess(designs), effort.samples)[0]
    angles = np.linspace(*scan, effort.rays + 1)
    reach, intervals = _extent(designs, angles, reach, effort.samples)
    codes = _signatures(intervals, len(designs.field.labels)).reshape(count, -1)
    design, cell = np.nonzero(codes[:, 1:] != codes[:, :-1])
    breaks = _breaks(designs, intervals, angles, design, cell, reach, effort)
    inside = intervals.counts.reshape(count, -1) > 0
    fixed = np.tile([*scan, *cuts], count)
    owner = np.concatenate([np.repeat(np.arange(count), 2 + len(cuts)), design])
    place, firm = np.concatenate([fixed, breaks]), np.arange(len(fixed) + len(breaks)) < len(fixed)
    order = np.lexsort((place, owner))
    owner, place, firm = owner[order], place[order], firm[order]
    # Breaks that rounding sets beside each other, or beside the end of the scan, are one.
    near = (owner[1:] == owner[:-1]) & (np.diff(place) < TOGETHER)
    drop = np.zeros(len(place), dtype=bool)
    drop[1:] |= near & ~firm[1:]
    drop[:-1] |= near & firm[1:] & ~firm[:-1]
    owner, place = owner[~drop], place[~drop]
    keep = owner[1:] == owner[:-1]
    owner, low, high = owner[:-1][keep], place[:-1][keep], place[1:][keep]
    # A panel is empty where every ray that was traced inside it met nothing.
    first, last = np.searchsorted(angles, low, side="right"), np.searchsorted(angles, high, side="left")
    met = np.concatenate([np.zeros((count, 1), dtype=int), np.cumsum(inside, axis=1)], axis=1)
    full = (last <= first) | (met[owner, np.maximum(last, first)] > met[owner, first])
    return Panels(owner[full], low[full], high[full], reach, np.asarray(inside.any(axis=1)))


def _first_guess(designs: Designs) -> Floats:
    """The sum of all rigid vectors: more than a mechanism without slides can reach."""
    mechanism = designs.field.mechanism
    vectors = mechanism.geometry.vectors(designs.places)
    drawn = sum(float(np.abs(z)) for z in mechanism.sketch_configuration.nodes)
    total = sum(np.abs(w) for w in vectors.w) + abs(designs.about)
    return np.broadcast_to(np.asarray(total + drawn, dtype=float), (designs.count,)).copy()


def _extent(designs: Designs, angles: Floats, reach: Floats, samples: int) -> tuple[Floats, Intervals]:
    """Trace rays, doubling the reach until no ray ends inside; returns the reach needed and the intervals."""
    count, rays = designs.count, len(angles)
    design, theta = np.repeat(np.arange(count), rays), np.tile(angles, count)
    for _ in range(DOUBLINGS):
        intervals = trace(designs, design, theta, reach[design], samples)
        beyond = intervals.beyond.reshape(count, rays).any(axis=1)
        if not beyond.any():
            break
        reach = np.where(beyond, 2 * reach, reach)
    else:
        raise AssemblyError(
            "the workspace has no end: a ray from "
            f"({designs.about.real:g}, {designs.about.imag:g}) stays inside; give the drives limits"
        )
    farthest = np.zeros(count)
    np.maximum.at(farthest, design[intervals.ray], intervals.outer)
    return np.where(farthest > 0, 1.2 * farthest, reach), intervals


def _signatures(intervals: Intervals, margins: int) -> Ints:
    """One number a ray for the margins that bound its intervals, in order."""
    code = np.zeros(len(intervals.beyond), dtype=np.int64)
    slot = np.arange(len(intervals.ray)) - np.searchsorted(intervals.ray, intervals.ray)
    own = 1 + (intervals.enters + 1) * (margins + 1) + intervals.leaves + 1
    for k in range(int(slot.max(initial=-1)) + 1):
        here = slot == k
        code[intervals.ray[here]] = code[intervals.ray[here]] * ((margins + 1) ** 2 + 1) + own[here]
    return code


def _breaks(
    designs: Designs, intervals: Intervals, angles: Floats, design: Ints, cell: Ints, reach: Floats, effort: Effort
) -> Floats:
    """Angles at which the signature changes, one for each pair of neighbouring rays that differ."""
    if not design.size:
        return np.zeros(0)
    margins = len(designs.field.labels)
    left = design * len(angles) + cell
    pairs = _rivals(intervals, left)
    codes = _signatures(intervals, margins)[left]

    def lead(traced: Intervals, ray: Ints, which: Ints) -> Floats:
        """How far one rival is ahead of the other; the sign alone where they cannot be compared."""
        side = np.where(_signatures(traced, margins)[ray] == codes[which], 1.0, -1.0)
        one, other, turn_one, turn_other = (pair[which] for pair in pairs[:4])
        near = pairs[4][which]
        ahead = _nearest(traced, ray, one, turn_one, near) - _nearest(traced, ray, other, turn_other, near)
        ahead = np.abs(ahead) * side
        return np.where(np.isfinite(ahead), ahead, side * reach[design[which]])

    every = np.arange(len(design))
    low, high = angles[cell], angles[cell + 1]

    def evaluate(which: Ints, theta: Floats) -> Floats:
        owner = design[which]
        traced = trace(designs, owner, theta, reach[owner], effort.samples)
        return lead(traced, np.arange(len(which)), which)

    at_low, at_high = lead(intervals, left, every), lead(intervals, left + 1, every)
    none = np.full(len(design), np.nan)
    return bracketed_roots(evaluate, low, at_low, high, at_high, none, none, np.full(len(design), ACCURACY))


def _rivals(intervals: Intervals, left: Ints) -> tuple[Ints, Ints, Ints, Ints, Floats]:
    """Of each pair of rays (left, left + 1) the two roots that meet where the signature changes.

    They are the first ends that the two rays name differently, or the two ends of an interval that only one ray has;
    margin -1 where neither applies. Returns their margins, directions, and the radius near which they meet.
    """
    begin = np.searchsorted(intervals.ray, left)
    middle = np.searchsorted(intervals.ray, left + 1)
    end = np.searchsorted(intervals.ray, left + 2)
    one, other = np.full(len(left), -1), np.full(len(left), -1)
    turn_one, turn_other = np.ones(len(left), dtype=int), np.ones(len(left), dtype=int)
    near = np.zeros(len(left))
    for k in range(len(left)):
        mine, theirs = slice(begin[k], middle[k]), slice(middle[k], end[k])
        if middle[k] - begin[k] == end[k] - middle[k]:
            for labels, radii, turn in (
                (intervals.enters, intervals.inner, 1),
                (intervals.leaves, intervals.outer, -1),
            ):
                differ = np.nonzero(labels[mine] != labels[theirs])[0]
                if differ.size and one[k] < 0:
                    i = differ[0]
                    one[k], other[k] = labels[mine][i], labels[theirs][i]
                    turn_one[k] = turn_other[k] = turn
                    near[k] = 0.5 * (radii[mine][i] + radii[theirs][i])
        else:
            longer, shorter = (mine, theirs) if middle[k] - begin[k] > end[k] - middle[k] else (theirs, mine)
            if shorter.start == shorter.stop and longer.stop - longer.start == 1:
                one[k], other[k] = intervals.leaves[longer][0], intervals.enters[longer][0]
                turn_one[k], turn_other[k] = -1, 1
                near[k] = 0.5 * (intervals.inner[longer][0] + intervals.outer[longer][0])
    return one, other, turn_one, turn_other, near


def _nearest(intervals: Intervals, ray: Ints, margin: Ints, turn: Ints, near: Floats) -> Floats:
    """The root of a margin in one direction nearest to a radius on each of the rays; nan where there is none."""
    rays, radii, margins, turns = intervals.crossings
    begin, end = np.searchsorted(rays, ray), np.searchsorted(rays, ray, side="right")
    best = np.full(len(ray), np.nan)
    for k in range(int(np.max(end - begin, initial=0))):
        at = np.minimum(begin + k, max(len(rays) - 1, 0))
        match = (begin + k < end) & (margins[at] == margin) & (turns[at] == turn)
        closer = ~(np.abs(best - near) <= np.abs(radii[at] - near))
        best = np.where(match & closer, radii[at], best)
    return best
