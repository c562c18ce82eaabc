"""Angles of a scan at which the margins change that bound the intervals of a ray.

There two ends of a ray's intervals meet: either one margin takes the place of another along the boundary, or an
interval, or a gap between two, closes. The first happens where two margins are zero at one point (a corner); the other
there too, or where a margin and its slope along the ray are zero (the ray touches the boundary). Both are one equation
in the angle, followed along a curve r(theta): the other margin where the one is zero, or the margin where it is
extreme. No ray needs to be traced for it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.region.field import Places
from mechdesign.analyses.region.rays import Designs, Intervals, trace
from mechdesign.errors import AssemblyError
from mechdesign.mechanism.algebra import picked
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.numerics.roots import bracketed_roots

# Panel ends nearer to each other than this are one (radians): what lies between them is lost in rounding.
TOGETHER = 1e-7
# A break is looked at from either side, this part of its cell away, or so far (radians) that boundaries that touch
# there have different names: if the signature there is not that of the cell's end, there is another break between.
BESIDE = 1e-3
APART = 1.5e-4
# In a cell so small (as a part of it) nothing is looked at from farther away.
WITHIN = 0.1
# Rays of one design that may be traced; what is still not resolved by as many is rounding.
BUDGET = 10_000
# A ray is also looked at from so near (radians), as it may be the break itself.
AT_END = 1e-9
# Residual ratio below which the break lies on one of the two rays.
ZERO = 1e-11
# Sampling distances from a curve on which a margin is zero, step by step (parts of the reach).
TO_ZERO = (3e-3, 1e-8, 1e-5, 1e-8)
# Sampling distances from a touching place (parts of the width of what closes there, and of the reach at least).
TO_EXTREME = (0.25, 0.01, 0.05, 0.01)
LEAST = 1e-5
# A step this small (as a part of the sampling distance) needs no further ones.
SETTLED = 1e-3
# Longest step along the ray (part of the reach).
FARTHEST = 0.5
# Samples beside a curve: equally spaced in the square root of the distance, in which margins that end there are smooth.
ROOTS = np.array([1.0, 4.0, 9.0])
AROUND = np.array([-1.0, 0.0, 1.0])

# Ends that may meet between a pair of neighbouring rays: the margin `curve` whose zeros are followed, and the `other`
# one that is zero there too (the same where the ray touches; -1 at the centre of the rays); the direction along the ray
# in which the followed margin is positive (of a touching ray +1 where an interval closes, -1 where a gap does); the
# radius near which the curve is on either ray; the width of what closes.
MEETING = np.dtype([
    ("pair", np.intp), ("curve", np.intp), ("other", np.intp), ("side", np.intp),
    ("low", float), ("high", float), ("span", float),
])  # fmt: skip
Meetings = NDArray[Any]


def signatures(intervals: Intervals, margins: int) -> Ints:
    """One number a ray for the margins that bound its intervals, in order."""
    code, slot = np.zeros(len(intervals.beyond), dtype=np.int64), intervals.slot
    own = 1 + (intervals.enters + 1) * (margins + 1) + intervals.leaves + 1
    for k in range(int(slot.max(initial=-1)) + 1):
        here = slot == k
        code[intervals.ray[here]] = code[intervals.ray[here]] * ((margins + 1) ** 2 + 1) + own[here]
    return code


def all_breaks(
    designs: Designs, reach: Floats, intervals: Intervals, design: Ints, angle: Floats
) -> tuple[Ints, Floats]:
    """All breaks between neighbouring rays of a design that differ, also where several lie between two rays.

    What may meet between two rays is solved for, and believed where the rays on both sides of it differ. Pairs
    between which nothing is found so are halved.

    Parameters
    ----------
    reach : ndarray, shape (designs,)
    intervals, design, angle
        What was traced: rays ascending by design and angle.

    Returns
    -------
    (design, angle)

    Raises
    ------
    AssemblyError
        If rounding makes rays differ however near they are.
    """
    field, centre = designs.field, designs.about
    spent = np.zeros(designs.count, dtype=np.intp)
    owners, places = [np.zeros(0, dtype=np.intp)], [np.zeros(0)]
    codes = signatures(intervals, len(field.labels))
    left = np.flatnonzero((codes[1:] != codes[:-1]) & (design[1:] == design[:-1]))
    design, low, high, doubted = design[left], angle[left], angle[left + 1], np.zeros(len(left), dtype=bool)
    while True:
        small = high - low <= field.accuracy
        owners.append(design[small])
        places.append(0.5 * (low + high)[small])
        left, design, doubted = left[~small], design[~small], doubted[~small]
        low, high = low[~small], high[~small]
        if not design.size:
            return np.concatenate(owners), np.concatenate(places)
        pair, angle = _solve(designs, _meetings(intervals, codes, left, field.singular), design, low, high, reach)
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
        about = np.full(len(rays), -1)
        about[len(rays) - 2 * len(first) : len(rays) - len(first)] = np.arange(len(first))
        order = np.lexsort((rays, of))
        rays, of, about = rays[order], of[order], about[order]
        both = design[of]
        spent += np.bincount(both, minlength=len(spent))
        if spent.max() > BUDGET:
            raise AssemblyError(
                f"seen from ({centre.real:g}, {centre.imag:g}) the boundary of the region is lost in rounding: "
                "move scan.about nearer to the region or into it"
            )
        intervals = trace(designs, both, rays, reach[both])
        codes = signatures(intervals, len(field.labels))
        left = np.flatnonzero((codes[1:] != codes[:-1]) & (of[1:] == of[:-1]))
        believed = np.isin(group, about[left])
        owners.append(design[pair[believed]])
        places.append(angle[believed])
        left = left[about[left] < 0]
        doubted = np.isin(of[left], np.setdiff1d(np.setdiff1d(pair, none), pair[believed]))
        design, low, high = both[left], rays[left], rays[left + 1]


def _meetings(intervals: Intervals, codes: Ints, left: Ints, leading: Flags) -> Meetings:
    """What may meet between the rays `left` and those that follow them, by how their signatures `codes` differ.

    Margins that are `leading` are followed rather than others, which may end at them.
    """
    found = [np.zeros(0, dtype=MEETING)]
    kinds = np.unique(np.stack([codes[left], codes[left + 1]]), axis=1, return_inverse=True)[1].ravel()
    for kind in range(int(kinds.max(initial=-1)) + 1):
        pair = np.flatnonzero(kinds == kind)
        found += _differences(pair, _ends(intervals, left[pair]), _ends(intervals, left[pair] + 1), leading)
    return np.concatenate(found)


def _meeting(pair: Ints, *values: float | Floats) -> Meetings:
    """The same meeting of several pairs; `values` in the order of `MEETING`."""
    found = np.zeros(len(pair), dtype=MEETING)
    for name, value in zip(MEETING.names or (), (pair, *values), strict=True):
        found[name] = value
    return found


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
            yield _meeting(pair[at], curve, other, 1 - 2 * (j % 2), low, high, 0.0)
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


def _solve(
    designs: Designs, meetings: Meetings, design: Ints, begin: Floats, end: Floats, reach: Floats
) -> tuple[Ints, Floats]:
    """Pairs and angles of those that meet between `begin` and `end`, which are of each pair, as is `design`."""
    pair = meetings["pair"]
    if not pair.size:
        return pair, np.zeros(0)
    begin, end, owner = begin[pair], end[pair], design[pair]
    reach, places = reach[owner], designs.of(owner)
    # Margins of the assembly cost as much as all others.
    of_assembly = np.array([*(name.startswith("assembly") for _, name in designs.field.labels), False])
    dear = of_assembly[meetings["curve"]] | of_assembly[meetings["other"]]

    def ahead(which: Ints, theta: Floats) -> Floats:
        share = (theta - begin[which]) / (end - begin)[which]
        low, high = meetings["low"][which], meetings["high"][which]
        radius, found = low + share * (high - low), np.empty(len(which))
        for assembly in (False, True):
            some = np.flatnonzero(dear[which] == assembly)
            at = which[some]
            if some.size:
                local = {name: picked(value, at) for name, value in places.items()}
                found[some] = _ahead(designs, meetings[at], theta[some], radius[some], reach[at], local, assembly)
        return found

    every = np.arange(len(pair))
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
    return pair[use], angles


def _ahead(
    designs: Designs, meetings: Meetings, theta: Floats, radius: Floats, reach: Floats, places: Places, assembly: bool
) -> Floats:
    """What is zero where ends meet, at some angles; the curve is near `radius` there.

    `assembly` says whether margins of the assembly are among theirs.
    """
    curve, other, side = meetings["curve"], meetings["other"], meetings["side"]
    touching, central = curve == other, other < 0
    lane, turn = np.arange(len(theta)), np.exp(1j * theta)
    radius, near, settled = np.where(central, 0.0, radius), reach, np.zeros(len(theta), dtype=bool)
    for zero, extreme in zip(TO_ZERO, TO_EXTREME, strict=True):
        step = np.where(touching, np.maximum(extreme * meetings["span"], LEAST * reach), zero * reach)
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


def parabola(x: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
    """Coefficients of a + b x + c x^2 through three points (first axis)."""
    with np.errstate(invalid="ignore", divide="ignore"):
        one, two = (y[1] - y[0]) / (x[1] - x[0]), (y[2] - y[1]) / (x[2] - x[1])
        c = (two - one) / (x[2] - x[0])
        b = one - c * (x[0] + x[1])
        return y[0] - x[0] * (b + c * x[0]), b, c
