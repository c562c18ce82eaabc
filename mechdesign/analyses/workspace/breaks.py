"""Angles of a scan at which the signature changes: which margins bound the intervals of a ray."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.roots import bracketed_roots
from mechdesign.analyses.workspace.rays import Designs, Floats, Intervals, Ints, trace

# Angles of panel ends are wanted to this accuracy (radians).
ACCURACY = 1e-13
# Panel ends nearer to each other than this are one (radians): what lies between them is lost in rounding.
TOGETHER = 1e-7
# A break is looked at from this part of its cell beside it: if the signature there is not that of the cell's end,
# there is another break between. So often again.
BESIDE = 1e-3
ROUNDS = 6


def signatures(intervals: Intervals, margins: int) -> Ints:
    """One number a ray for the margins that bound its intervals, in order."""
    code = np.zeros(len(intervals.beyond), dtype=np.int64)
    slot = np.arange(len(intervals.ray)) - np.searchsorted(intervals.ray, intervals.ray)
    own = 1 + (intervals.enters + 1) * (margins + 1) + intervals.leaves + 1
    for k in range(int(slot.max(initial=-1)) + 1):
        here = slot == k
        code[intervals.ray[here]] = code[intervals.ray[here]] * ((margins + 1) ** 2 + 1) + own[here]
    return code


@dataclass(frozen=True, eq=False)
class Search:
    """Search for breaks between rays of different signature.

    Parameters
    ----------
    reach : ndarray, shape (designs,)
    samples : int
        Samples along each ray.
    """

    designs: Designs
    reach: Floats
    samples: int

    def all_breaks(
        self, intervals: Intervals, left: Ints, design: Ints, low: Floats, high: Floats
    ) -> tuple[Ints, Floats]:
        """All breaks between pairs of rays that differ, also where several lie between two rays.

        Parameters
        ----------
        intervals, left
            What was traced, and the first ray of each pair; the second follows it.
        design, low, high
            Design and angles of each pair.

        Returns
        -------
        (design, angle)
        """
        owners, places = [np.zeros(0, dtype=np.intp)], [np.zeros(0)]
        for _ in range(ROUNDS):
            if not design.size:
                break
            found = self.breaks(intervals, left, design, low, high)
            owners.append(design)
            places.append(found)
            step = BESIDE * (high - low)
            begin, end = np.concatenate([low, found + step]), np.concatenate([found - step, high])
            owner = np.concatenate([design, design])
            wide = end - begin > TOGETHER
            begin, end, owner = begin[wide], end[wide], owner[wide]
            rays = np.stack([begin, end], axis=1).ravel()
            both = np.repeat(owner, 2)
            intervals = trace(self.designs, both, rays, self.reach[both], self.samples)
            code = signatures(intervals, len(self.designs.field.labels))
            left = 2 * np.flatnonzero(code[::2] != code[1::2])
            design, low, high = both[left], rays[left], rays[left + 1]
        return np.concatenate(owners), np.concatenate(places)

    def breaks(self, intervals: Intervals, left: Ints, design: Ints, begin: Floats, end: Floats) -> Floats:
        """One angle of each pair of neighbouring rays at which the signature changes."""
        margins = len(self.designs.field.labels)
        pairs = _rivals(intervals, left)
        codes = signatures(intervals, margins)[left]

        def lead(traced: Intervals, ray: Ints, which: Ints) -> Floats:
            """How far one rival is ahead of the other; the sign alone where they cannot be compared."""
            side = np.where(signatures(traced, margins)[ray] == codes[which], 1.0, -1.0)
            one, other, turn_one, turn_other = (pair[which] for pair in pairs[:4])
            near = pairs[4][which]
            ahead = _nearest(traced, ray, one, turn_one, near) - _nearest(traced, ray, other, turn_other, near)
            ahead = np.abs(ahead) * side
            return np.where(np.isfinite(ahead), ahead, side * self.reach[design[which]])

        def evaluate(which: Ints, theta: Floats) -> Floats:
            owner = design[which]
            traced = trace(self.designs, owner, theta, self.reach[owner], self.samples)
            return lead(traced, np.arange(len(which)), which)

        every = np.arange(len(design))
        at_low, at_high = lead(intervals, left, every), lead(intervals, left + 1, every)
        none = np.full(len(design), np.nan)
        return bracketed_roots(evaluate, begin, at_low, end, at_high, none, none, np.full(len(design), ACCURACY))


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
