"""Angles of a scan at which the signature changes: which margins bound the intervals of a ray."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.region.meetings import Meetings
from mechdesign.analyses.region.rays import Designs, Intervals, trace
from mechdesign.errors import AssemblyError
from mechdesign.numerics.arrays import Floats, Ints

# Panel ends nearer to each other than this are one (radians): what lies between them is lost in rounding.
TOGETHER = 1e-7
# A break is looked at from either side, this part of its cell away, or so far (radians) that boundaries that touch
# there have different names: if the signature there is not that of the cell's end, there is another break between.
BESIDE, APART = 1e-3, 1.5e-4
# In a cell so small (as a part of it) nothing is looked at from farther away.
WITHIN = 0.1
# Rays of one design that may be traced; what is still not resolved by as many is rounding.
BUDGET = 10_000
# A ray is also looked at from so near (radians), as it may be the break itself.
AT_END = 1e-9


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

        What may meet between two rays is solved for, and believed where the rays on both sides of it differ. Pairs
        between which nothing is found so are halved.

        Parameters
        ----------
        intervals, left
            What was traced, and the first ray of each pair; the second follows it.
        design, low, high
            Design and angles of each pair.

        Returns
        -------
        (design, angle)

        Raises
        ------
        AssemblyError
            If rounding makes rays differ however near they are.
        """
        field, centre = self.designs.field, self.designs.about
        spent = np.zeros(self.designs.count, dtype=np.intp)
        owners, places = [np.zeros(0, dtype=np.intp)], [np.zeros(0)]
        codes, doubted = signatures(intervals, len(field.labels)), np.zeros(len(design), dtype=bool)
        while True:
            small = high - low <= self.designs.field.accuracy
            owners.append(design[small])
            places.append(0.5 * (low + high)[small])
            left, design, doubted = left[~small], design[~small], doubted[~small]
            low, high = low[~small], high[~small]
            if not design.size:
                return np.concatenate(owners), np.concatenate(places)
            meetings = Meetings.between(intervals, codes, left, field.singular)
            pair, angle = meetings.solve(self.designs, design, low, high, self.reach)
            pair, angle = pair[~doubted[pair]], angle[~doubted[pair]]
            width, every = high - low, np.arange(len(design))
            step = np.minimum(np.maximum(BESIDE * width, APART), WITHIN * width)[pair]
            # Where nothing is found one of the two rays may be the break.
            none = np.setdiff1d(every, pair)
            at_end = np.minimum(AT_END, WITHIN * width)[none]
            pair, angle = np.concatenate([pair, none, none]), np.concatenate([angle, low[none], high[none]])
            step = np.concatenate([step, at_end, at_end])
            order = np.lexsort((angle, pair))
            pair, angle, step = pair[order], angle[order], step[order]
            # What is found so near to each other is looked at together.
            new = np.append(True, (pair[1:] != pair[:-1]) | (np.diff(angle) > 2 * step[1:]))[: len(pair)]
            group = np.cumsum(new) - 1
            first, last = np.flatnonzero(new), np.flatnonzero(np.append(new[1:], True))[: new.sum()]
            owner = pair[first]
            start, stop = np.maximum(angle - step, low[pair])[first], np.minimum(angle + step, high[pair])[last]
            rays = np.concatenate([low, high, 0.5 * (low + high)[none], start, stop])
            of = np.concatenate([every, every, none, owner, owner])
            about = np.concatenate([np.full(2 * len(every) + len(none), -1), np.arange(len(first)), -1 - 0 * owner])
            order = np.lexsort((rays, of))
            rays, of, about = rays[order], of[order], about[order]
            both = design[of]
            spent += np.bincount(both, minlength=len(spent))
            if spent.max() > BUDGET:
                raise AssemblyError(
                    f"seen from ({centre.real:g}, {centre.imag:g}) the boundary of the region is lost in rounding: "
                    "move scan.about nearer to the region or into it"
                )
            intervals = trace(self.designs, both, rays, self.reach[both], self.samples)
            codes = signatures(intervals, len(field.labels))
            left = np.flatnonzero((codes[1:] != codes[:-1]) & (of[1:] == of[:-1]))
            believed = np.isin(group, about[left])
            owners.append(design[pair[believed]])
            places.append(angle[believed])
            left = left[about[left] < 0]
            fruitless = np.setdiff1d(np.setdiff1d(pair, none), pair[believed])
            doubted = np.isin(of[left], fruitless)
            design, low, high = both[left], rays[left], rays[left + 1]
