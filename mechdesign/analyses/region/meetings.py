"""Where two ends of a ray's intervals meet: the angles at which the margins that bound the intervals change.

Either one margin takes the place of another along the boundary, or an interval, or a gap between two, closes. The
first happens where two margins are zero at one point (a corner); the other there too, or where a margin and its slope
along the ray are zero (the ray touches the boundary). Both are one equation in the angle, followed along a curve
r(theta): the other margin where the one is zero, or the margin where it is extreme. No ray needs to be traced for it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np

from mechdesign.analyses.region.field import Places
from mechdesign.analyses.region.rays import Designs, Intervals
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.numerics.roots import bracketed_roots

# They meet on a ray itself where what should be zero is this small a part of what it is on the other ray.
ZERO = 1e-11
# Distances between the samples by which a curve is approached, step by step: parts of the reach; where a ray touches,
# parts of what closes there, but no less than a part of the reach. The last are tried second: often they do already,
# that is where a step further is no more than a small part of the distance.
TO_ZERO, TO_EXTREME, LEAST = (3e-3, 1e-8, 1e-5, 1e-8), (0.25, 0.01, 0.05, 0.01), 1e-5
SETTLED = 1e-3
# A step along the ray at most (as a part of the reach).
FARTHEST = 0.5
# Samples beside a curve: equally spaced in the square root of the distance, in which margins that end there are smooth.
ROOTS = np.array([1.0, 4.0, 9.0])
AROUND = np.array([-1.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Meetings:
    """Ends that may meet between two neighbouring rays.

    Parameters
    ----------
    pair : ndarray of int, shape (n,)
        Which pair of rays.
    curve, other : ndarray of int
        The margin whose zeros are followed, and the one that is zero there too: the same where the ray touches, -1
        where the boundary goes through the centre of the rays.
    side : ndarray of int
        Direction along the ray in which the followed margin is positive; of a touching ray +1 where an interval
        closes, -1 where a gap does.
    low, high : ndarray
        Radius at either ray near which the curve is.
    span : ndarray
        Width of what closes; 0 if nothing does.
    """

    pair: Ints
    curve: Ints
    other: Ints
    side: Ints
    low: Floats
    high: Floats
    span: Floats

    @staticmethod
    def between(intervals: Intervals, codes: Ints, left: Ints, leading: Flags) -> Meetings:
        """What may meet between the rays `left` and those that follow them, by how they differ.

        Parameters
        ----------
        codes : ndarray of int, shape (rays,)
            Signatures.
        leading : ndarray of bool, shape (margins,)
            Margins to be followed rather than others, which may end at them.
        """
        found = [_meeting(np.zeros(0, dtype=np.intp), 0, 0, 1, np.zeros(0), np.zeros(0), np.zeros(0))]
        kinds = np.unique(np.stack([codes[left], codes[left + 1]]), axis=1, return_inverse=True)[1].ravel()
        for kind in range(int(kinds.max(initial=-1)) + 1):
            pair = np.flatnonzero(kinds == kind)
            here, there = _ends(intervals, left[pair]), _ends(intervals, left[pair] + 1)
            found += _differences(pair, here, there, leading)
        return Meetings(*(np.concatenate([getattr(part, f.name) for part in found]) for f in fields(Meetings)))

    def solve(self, designs: Designs, design: Ints, begin: Floats, end: Floats, reach: Floats) -> tuple[Ints, Floats]:
        """Pairs and angles of those that meet between `begin` and `end`, which are of each pair, as is `design`."""
        if not self.pair.size:
            return self.pair, np.zeros(0)
        begin, end, owner = begin[self.pair], end[self.pair], design[self.pair]
        reach, places = reach[owner], designs.of(owner)
        of_assembly = np.array([name.startswith("assembly") for _, name in designs.field.labels])
        # Those margins cost as much as all others.
        dear = of_assembly[self.curve] | (of_assembly[self.other] & (self.other >= 0))

        def ahead(which: Ints, theta: Floats) -> Floats:
            share = (theta - begin[which]) / (end - begin)[which]
            radius = self.low[which] + share * (self.high - self.low)[which]
            found = np.empty(len(which))
            for assembly in (False, True):
                some = np.flatnonzero(dear[which] == assembly)
                at, local = which[some], {name: value[which[some]] for name, value in places.items()}
                if some.size:
                    found[some] = self._ahead(designs, at, theta[some], radius[some], reach[at], local, assembly)
            return found

        every = np.arange(len(self.pair))
        at_begin, at_end = ahead(every, begin), ahead(every, end)
        with np.errstate(invalid="ignore"):
            on_begin, on_end = np.abs(at_begin) <= ZERO * np.abs(at_end), np.abs(at_end) <= ZERO * np.abs(at_begin)
        at_begin, at_end = np.where(on_begin, 0.0, at_begin), np.where(on_end, 0.0, at_end)
        use = np.flatnonzero(((at_begin > 0) != (at_end > 0)) | on_begin | on_end)
        none = np.full(len(use), np.nan)
        angles = bracketed_roots(
            lambda which, theta: ahead(use[which], theta), begin[use], at_begin[use], end[use], at_end[use],
            none, none, np.full(len(use), designs.field.accuracy),
        )  # fmt: skip
        return self.pair[use], angles

    def _ahead(
        self, designs: Designs, which: Ints, theta: Floats, radius: Floats, reach: Floats, places: Places,
        assembly: bool,
    ) -> Floats:  # fmt: skip
        """What is zero where the ends `which` meet, at some angles; the curve is near `radius` there.

        `assembly` says whether margins of the assembly are among theirs.
        """
        curve, other, side = self.curve[which], self.other[which], self.side[which]
        touching, central = curve == other, other < 0
        lane, turn = np.arange(len(which)), np.exp(1j * theta)
        radius, near, settled = np.where(central, 0.0, radius), reach, np.zeros(len(which), dtype=bool)
        for zero, extreme in zip(TO_ZERO, TO_EXTREME, strict=True):
            step = np.where(touching, np.maximum(extreme * self.span[which], LEAST * reach), zero * reach)
            near = np.where(settled, near, step)
            x = near * np.where(touching, AROUND[:, None], ROOTS[:, None] * side)
            margins = designs.field.margins(designs.about + (radius + x) * turn, places, assembly=assembly)
            value, rival = margins[curve, :, lane].T, margins[other, :, lane].T
            a, b, c = parabola(x, value)
            with np.errstate(invalid="ignore", divide="ignore"):
                top = np.where(c * side < 0, -0.5 * b / c, np.nan)
                nearest = -2 * a / (b + np.copysign(np.sqrt(b * b - 4 * a * c), b))
            step = np.where(touching, top, np.where(central, 0.0, nearest))
            if zero == TO_ZERO[-1]:
                # Each by itself, so that what else is looked at changes nothing.
                settled |= ~(np.abs(step) > SETTLED * near)
                if settled.all():
                    break
            step = np.where(settled, 0.0, step)
            radius = radius + np.clip(step, -FARTHEST * reach, FARTHEST * reach)
        with np.errstate(invalid="ignore"):
            zero_too = parabola(np.sqrt(value), rival)[0]
        found: Floats = np.where(touching, side * (a + 0.5 * b * top), np.where(central, b * reach, zero_too))
        return found


def _meeting(pair: Ints, curve: int, other: int, side: int, low: Floats, high: Floats, span: Floats) -> Meetings:
    """The same meeting of several pairs."""
    names = [np.full(len(pair), value, dtype=np.intp) for value in (curve, other, side)]
    return Meetings(pair, names[0], names[1], names[2], low, high, span)


def _ends(intervals: Intervals, rays: Ints) -> tuple[list[int], Floats]:
    """Margins at the ends of the intervals of rays of one signature, and the radii (rays, ends)."""
    first = np.searchsorted(intervals.ray, rays)
    count = int(np.searchsorted(intervals.ray, rays[0], side="right") - first[0])
    at = first[:, None] + np.arange(count)
    names = np.stack([intervals.enters[at[0]], intervals.leaves[at[0]]], axis=1).ravel()
    radii = np.stack([intervals.inner[at], intervals.outer[at]], axis=2).reshape(len(rays), -1)
    return [int(name) for name in names], radii


def _differences(
    pair: Ints, here: tuple[list[int], Floats], there: tuple[list[int], Floats], leading: Flags
) -> Iterator[Meetings]:
    """What may meet between rays that all have the ends `here` and rays that have the ends `there`."""
    forward = len(here[0]) <= len(there[0])
    (few, near), (many, far) = (here, there) if forward else (there, here)
    lost = len(many) - len(few)
    if lost > 2:
        return

    def first_followed(one: int, two: int) -> bool:
        return two < 0 or (one >= 0 and (bool(leading[one]) or not leading[two]))

    for first, at in _closing((many, far), (few, near)) if lost else [(len(many), np.arange(len(pair)))]:
        rest = [j for j in range(len(many)) if not first <= j < first + lost]
        for k, j in enumerate(rest):
            if few[k] == many[j]:
                continue
            curve, other = (few[k], many[j]) if first_followed(few[k], many[j]) else (many[j], few[k])
            low, high = (near[at, k], far[at, j]) if forward else (far[at, j], near[at, k])
            yield _meeting(pair[at], curve, other, 1 - 2 * (j % 2), low, high, 0 * low)
        if lost:
            one, two = many[first], many[first + 1]
            inner, outer = far[at, first], far[at, first + 1]
            if one == two:
                middle = 0.5 * (inner + outer)
                yield _meeting(pair[at], one, one, 1 - 2 * (first % 2), middle, middle, outer - inner)
            elif first_followed(one, two):
                yield _meeting(pair[at], one, two, 1 - 2 * (first % 2), inner, inner, outer - inner)
            else:
                yield _meeting(pair[at], two, one, 2 * (first % 2) - 1, outer, outer, outer - inner)


def _closing(longer: tuple[list[int], Floats], shorter: tuple[list[int], Floats]) -> list[tuple[int, Ints]]:
    """Which two neighbouring ends the shorter of two kinds of rays lacks, and of which pairs of rays.

    The others should bear the same names; of several such, those that are nearest where the other ray has them.
    """
    names, radii = longer
    count = len(names)
    rest = [[j for j in range(count) if j not in (first, first + 1)] for first in range(count - 1)]
    strange = np.array([sum(names[j] != name for j, name in zip(row, shorter[0], strict=True)) for row in rest])
    away = np.stack([np.abs(radii[:, row] - shorter[1]).sum(axis=1) for row in rest])
    best = np.where((strange == strange.min())[:, None], away, np.inf).argmin(axis=0)
    return [(int(first), np.flatnonzero(best == first)) for first in np.unique(best)]


def parabola(x: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
    """Coefficients of a + b x + c x^2 through three points (first axis)."""
    with np.errstate(invalid="ignore", divide="ignore"):
        one, two = (y[1] - y[0]) / (x[1] - x[0]), (y[2] - y[1]) / (x[2] - x[1])
        c = (two - one) / (x[2] - x[0])
        b = one - c * (x[0] + x[1])
        return y[0] - x[0] * (b + c * x[0]), b, c
