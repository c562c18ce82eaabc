"""Breaks: angles of a scan at which the margins that bound the intervals of a ray change.

At a break two ends of a ray's intervals meet: either one margin replaces another along the boundary, or an interval, or
the gap between two, closes. A margin replaces another at a corner, where both are zero. An interval or a gap closes at
a corner as well, or where the ray touches the boundary: there a margin and its slope along the ray are zero. Each break
is a root of one equation in the angle along a curve r(theta): of the second margin where the first is zero, or of the
margin where it is extreme along the ray. Solving it traces no rays.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.errors import AssemblyError
from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.ground.numerics.roots import bracketed_roots
from mechdesign.mechanism.algebra import picked
from mechdesign.region.field import Places
from mechdesign.region.intervals import Intervals
from mechdesign.region.rays import Scanned, trace

# Panel ends nearer to each other than this angle (radians) are one: rounding hides what lies between them.
TOGETHER = 1e-7
# Each break is confirmed by a ray on either side of it, as far away as this fraction of the distance between the two
# rays that enclose the break. A ray beside it that differs from the enclosing ray on its side shows one more break.
BESIDE = 1e-3
# The least distance of these rays (radians): boundaries that touch at the break have different names there.
APART = 1.5e-4
# Their largest distance, as a fraction of the distance between the enclosing rays.
WITHIN = 0.1
# Largest number of rays traced for one design; differences that remain then are rounding.
BUDGET = 10_000
# Distance (radians) at which an enclosing ray is compared with a ray beside it, as it may be the break itself.
AT_END = 1e-9
# Ratio of the residuals on the two enclosing rays below which the break is the ray with the smaller one.
ZERO = 1e-11
# Sampling distances, step by step, from a curve on which a margin is zero (fractions of the reach).
TO_ZERO = (3e-3, 1e-8, 1e-5, 1e-8)
# Sampling distances, step by step, from a touching point (fractions of the width of the interval or gap that closes).
TO_EXTREME = (0.25, 0.01, 0.05, 0.01)
# The least sampling distance from a touching point (fraction of the reach).
LEAST = 1e-5
# Steps shorter than this fraction of the sampling distance are the last.
SETTLED = 1e-3
# Longest step along the ray (fraction of the reach).
FARTHEST = 0.5
# Samples beside a curve (sampling distances): equally spaced in the square root of the distance, in which margins that
# end on the curve are smooth.
ROOTS = np.array([1.0, 4.0, 9.0])
# Samples about a touching point (sampling distances).
AROUND = np.array([-1.0, 0.0, 1.0])

# Two ends of intervals that may meet between a pair of neighbouring rays:
# `pair`: number of the pair of rays;
# `curve`: margin whose zeros are followed;
# `other`: margin that is zero at the break too (`curve` itself where the ray touches; -1 at the centre of the rays);
# `side`: direction along the ray in which `curve` is positive (where the ray touches +1 if an interval closes, -1 if a
# gap does);
# `low`, `high`: radius of the curve, about, on the first ray and on the second;
# `span`: width of the interval or gap that closes.
MEETING = np.dtype([
    ("pair", np.intp), ("curve", np.intp), ("other", np.intp), ("side", np.intp),
    ("low", float), ("high", float), ("span", float),
])  # fmt: skip
Meetings = NDArray[Any]


def signatures(intervals: Intervals, margins: int) -> Ints:
    """A number for each ray that encodes the margins bounding its intervals, in order."""
    code, slot = np.zeros(len(intervals.beyond), dtype=np.int64), intervals.slot
    ends = 1 + (intervals.enters + 1) * (margins + 1) + intervals.leaves + 1
    for k in range(int(slot.max(initial=-1)) + 1):
        rows = slot == k
        code[intervals.ray[rows]] = code[intervals.ray[rows]] * ((margins + 1) ** 2 + 1) + ends[rows]
    return code


def all_breaks(
    designs: Scanned, reach: Floats, intervals: Intervals, design: Ints, angle: Floats
) -> tuple[Ints, Floats]:
    """All breaks between neighbouring rays of a design that differ, also where several lie between two rays.

    A candidate is solved for where two ends may meet between two rays, and counts if the rays on both sides of it
    differ. Pairs of rays without a confirmed candidate are halved.

    Parameters
    ----------
    reach : ndarray, shape (designs,)
    intervals : Intervals
        Those of the rays.
    design, angle : ndarray, shape (rays,)
        Design and angle of each ray, ascending by both.

    Returns
    -------
    (design, angle)
        Of each break, in no order.

    Raises
    ------
    AssemblyError
        If rounding makes rays differ however near they are.
    """
    field, centre = designs.field, designs.about
    spent = np.zeros(designs.count, dtype=np.intp)
    owners, places = [np.zeros(0, dtype=np.intp)], [np.zeros(0)]
    codes = signatures(intervals, len(field.labels))
    lower = np.flatnonzero((codes[1:] != codes[:-1]) & (design[1:] == design[:-1]))
    design, low, high, refuted = design[lower], angle[lower], angle[lower + 1], np.zeros(len(lower), dtype=bool)
    while True:
        resolved = high - low <= field.accuracy
        owners.append(design[resolved])
        places.append(0.5 * (low + high)[resolved])
        lower, design, refuted = lower[~resolved], design[~resolved], refuted[~resolved]
        low, high = low[~resolved], high[~resolved]
        if not design.size:
            return np.concatenate(owners), np.concatenate(places)
        meetings = _meetings(intervals, codes, lower, field.singular)
        pair, angle = _solve(designs, meetings, design, low, high, reach)
        pair, angle = pair[~refuted[pair]], angle[~refuted[pair]]
        width, every = high - low, np.arange(len(design))
        step = np.minimum(np.maximum(BESIDE * width, APART), WITHIN * width)[pair]
        # Where a pair has no candidate one of its two rays may be the break.
        idle = np.setdiff1d(every, pair)
        at_end = np.minimum(AT_END, WITHIN * width)[idle]
        pair, angle = np.concatenate([pair, idle, idle]), np.concatenate([angle, low[idle], high[idle]])
        step = np.concatenate([step, at_end, at_end])
        order = np.lexsort((angle, pair))
        pair, angle, step = pair[order], angle[order], step[order]
        # Candidates of a pair whose rays beside them would overlap are confirmed together.
        new = np.append(True, (pair[1:] != pair[:-1]) | (np.diff(angle) > 2 * step[1:]))[: len(pair)]
        group = np.cumsum(new) - 1
        first, last = np.flatnonzero(new), np.flatnonzero(np.append(new[1:], True))[: new.sum()]
        group_pair = pair[first]
        start, stop = np.maximum(angle - step, low[pair])[first], np.minimum(angle + step, high[pair])[last]
        rays = np.concatenate([low, high, 0.5 * (low + high)[idle], start, stop])
        owner_pair = np.concatenate([every, every, idle, group_pair, group_pair])
        group_of = np.full(len(rays), -1)
        group_of[len(rays) - 2 * len(first) : len(rays) - len(first)] = np.arange(len(first))
        order = np.lexsort((rays, owner_pair))
        rays, owner_pair, group_of = rays[order], owner_pair[order], group_of[order]
        ray_design = design[owner_pair]
        spent += np.bincount(ray_design, minlength=len(spent))
        if spent.max() > BUDGET:
            raise AssemblyError(
                f"seen from ({centre.real:g}, {centre.imag:g}) the boundary of the region is lost in rounding: "
                "move scan.about nearer to the region or into it"
            )
        intervals = trace(designs, ray_design, rays, reach[ray_design])
        codes = signatures(intervals, len(field.labels))
        lower = np.flatnonzero((codes[1:] != codes[:-1]) & (owner_pair[1:] == owner_pair[:-1]))
        confirmed = np.isin(group, group_of[lower])
        owners.append(design[pair[confirmed]])
        places.append(angle[confirmed])
        lower = lower[group_of[lower] < 0]
        refuted = np.isin(owner_pair[lower], np.setdiff1d(np.setdiff1d(pair, idle), pair[confirmed]))
        design, low, high = ray_design[lower], rays[lower], rays[lower + 1]


def _meetings(intervals: Intervals, codes: Ints, lower: Ints, leading: Flags) -> Meetings:
    """Ends that may meet between the rays `lower` and the next ones, by the difference of their signatures `codes`.

    Of two margins the one that is `leading` is followed: the other may end where the leading one is zero.
    """
    meetings = [np.zeros(0, dtype=MEETING)]
    kinds = np.unique(np.stack([codes[lower], codes[lower + 1]]), axis=1, return_inverse=True)[1].ravel()
    for kind in range(int(kinds.max(initial=-1)) + 1):
        pair = np.flatnonzero(kinds == kind)
        meetings += _differences(pair, _ends(intervals, lower[pair]), _ends(intervals, lower[pair] + 1), leading)
    return np.concatenate(meetings)


def _meeting(pair: Ints, *values: float | Floats) -> Meetings:
    """Meetings of the same kind for several pairs; `values` in the order of `MEETING`."""
    meetings = np.zeros(len(pair), dtype=MEETING)
    for name, value in zip(MEETING.names or (), (pair, *values), strict=True):
        meetings[name] = value
    return meetings


def _ends(intervals: Intervals, rays: Ints) -> tuple[list[int], Floats]:
    """Margins at the ends of the intervals of rays that share a signature, and the radii, shape (rays, ends)."""
    first = np.searchsorted(intervals.ray, rays)
    count = int(np.searchsorted(intervals.ray, rays[0], side="right") - first[0])
    at = first[:, None] + np.arange(count)
    names = np.stack([intervals.enters[at[0]], intervals.leaves[at[0]]], axis=1).ravel()
    radii = np.stack([intervals.inner[at], intervals.outer[at]], axis=2).reshape(len(rays), -1)
    return [int(name) for name in names], radii


def _differences(
    pair: Ints, first_ends: tuple[list[int], Floats], second_ends: tuple[list[int], Floats], leading: Flags
) -> Iterator[Meetings]:
    """Ends that may meet between rays with the ends `first_ends` and their neighbours with the ends `second_ends`.

    Ends are the margins, the same for all rays, and the radii, shape (rays, ends).
    """
    forward = len(first_ends[0]) <= len(second_ends[0])
    (few, near), (many, far) = (first_ends, second_ends) if forward else (second_ends, first_ends)
    lost = len(many) - len(few)
    if lost > 2:
        return

    def first_followed(first_margin: int, second_margin: int) -> bool:
        return second_margin < 0 or (first_margin >= 0 and (bool(leading[first_margin]) or not leading[second_margin]))

    for first, at in _closing((many, far), (few, near)) if lost else [(len(many), np.arange(len(pair)))]:
        rest = [j for j in range(len(many)) if not first <= j < first + lost]
        for k, j in enumerate(rest):
            if few[k] == many[j]:
                continue
            curve, other = (few[k], many[j]) if first_followed(few[k], many[j]) else (many[j], few[k])
            low, high = (near[at, k], far[at, j]) if forward else (far[at, j], near[at, k])
            yield _meeting(pair[at], curve, other, 1 - 2 * (j % 2), low, high, 0.0)
        if lost:
            first_margin, second_margin = many[first], many[first + 1]
            inner, outer = far[at, first], far[at, first + 1]
            if first_margin == second_margin:
                middle = 0.5 * (inner + outer)
                yield _meeting(pair[at], first_margin, first_margin, 1 - 2 * (first % 2), middle, middle, outer - inner)
            elif first_followed(first_margin, second_margin):
                yield _meeting(pair[at], first_margin, second_margin, 1 - 2 * (first % 2), inner, inner, outer - inner)
            else:
                yield _meeting(pair[at], second_margin, first_margin, 2 * (first % 2) - 1, outer, outer, outer - inner)


def _closing(longer: tuple[list[int], Floats], shorter: tuple[list[int], Floats]) -> list[tuple[int, Ints]]:
    """The two neighbouring ends that the rays with fewer ends lack: number of the first, and the pairs of rays.

    The remaining ends should be of the same margins; among several choices their radii should agree best.
    """
    names, radii = longer
    count = len(names)
    rest = [[j for j in range(count) if j not in (first, first + 1)] for first in range(count - 1)]
    mismatches = np.array([sum(names[j] != name for j, name in zip(row, shorter[0], strict=True)) for row in rest])
    distance = np.stack([np.abs(radii[:, row] - shorter[1]).sum(axis=1) for row in rest])
    best = np.where((mismatches == mismatches.min())[:, None], distance, np.inf).argmin(axis=0)
    return [(int(first), np.flatnonzero(best == first)) for first in np.unique(best)]


def _solve(
    designs: Scanned, meetings: Meetings, design: Ints, begin: Floats, end: Floats, reach: Floats
) -> tuple[Ints, Floats]:
    """Pairs and angles of the meetings that take place between their two rays.

    `design`, `begin` and `end` are the design and the angles of both rays of each pair.
    """
    pair = meetings["pair"]
    if not pair.size:
        return pair, np.zeros(0)
    begin, end, owner = begin[pair], end[pair], design[pair]
    reach, places = reach[owner], designs.of(owner)
    # Margins of the assembly cost as much as all others together: they are computed only where they meet.
    of_assembly = np.array([*(name.startswith("assembly") for _, name in designs.field.labels), False])
    with_assembly = of_assembly[meetings["curve"]] | of_assembly[meetings["other"]]

    def residual_at(which: Ints, theta: Floats) -> Floats:
        share = (theta - begin[which]) / (end - begin)[which]
        low, high = meetings["low"][which], meetings["high"][which]
        radius, residual = low + share * (high - low), np.empty(len(which))
        for assembly in (False, True):
            rows = np.flatnonzero(with_assembly[which] == assembly)
            of = which[rows]
            if rows.size:
                local = {name: picked(value, of) for name, value in places.items()}
                residual[rows] = _residual(designs, meetings[of], theta[rows], radius[rows], reach[of], local, assembly)
        return residual

    every = np.arange(len(pair))
    at_begin, at_end = residual_at(every, begin), residual_at(every, end)
    on_begin, on_end = np.abs(at_begin) <= ZERO * np.abs(at_end), np.abs(at_end) <= ZERO * np.abs(at_begin)
    at_begin, at_end = np.where(on_begin, 0.0, at_begin), np.where(on_end, 0.0, at_end)
    use = np.flatnonzero(((at_begin > 0) != (at_end > 0)) | on_begin | on_end)
    unknown = np.full(len(use), np.nan)
    angles = bracketed_roots(
        lambda which, theta: residual_at(use[which], theta), begin[use], at_begin[use], end[use], at_end[use],
        unknown, unknown, np.full(len(use), designs.field.accuracy),
    )  # fmt: skip
    return pair[use], angles


def _residual(
    designs: Scanned, meetings: Meetings, theta: Floats, radius: Floats, reach: Floats, places: Places, assembly: bool
) -> Floats:
    """Residuals at angles `theta` that are zero where the two ends meet, shape (meetings,).

    The followed curve is near `radius`; `assembly` says whether margins of the assembly are computed.
    """
    curve, other, side = meetings["curve"], meetings["other"], meetings["side"]
    touching, central = curve == other, other < 0
    lane, turn = np.arange(len(theta)), np.exp(1j * theta)
    radius, near, settled = np.where(central, 0.0, radius), reach, np.zeros(len(theta), dtype=bool)
    for zero_step, touching_step in zip(TO_ZERO, TO_EXTREME, strict=True):
        step = np.where(touching, np.maximum(touching_step * meetings["span"], LEAST * reach), zero_step * reach)
        near = np.where(settled, near, step)
        x = near * np.where(touching, AROUND[:, None], ROOTS[:, None] * side)
        margins = designs.field.margins(designs.about + (radius + x) * turn, places, assembly=assembly)
        value, other_value = margins[curve, :, lane].T, margins[other, :, lane].T
        a, b, c = parabola(x, value)
        extreme = np.where(c * side < 0, -0.5 * b / c, np.nan)
        root = -2 * a / (b + np.copysign(np.sqrt(b * b - 4 * a * c), b))
        step = np.where(touching, extreme, np.where(central, 0.0, root))
        if zero_step == TO_ZERO[-1]:
            # Each meeting settles on its own, so that its root does not depend on the others.
            settled |= ~(np.abs(step) > SETTLED * near)
            if settled.all():
                break
        step = np.where(settled, 0.0, step)
        radius = radius + np.clip(step, -FARTHEST * reach, FARTHEST * reach)
    zero_too = parabola(np.sqrt(value), other_value)[0]
    residual: Floats = np.where(touching, side * (a + 0.5 * b * extreme), np.where(central, b * reach, zero_too))
    return residual


def parabola(x: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
    """Coefficients of a + b x + c x^2 through three points (first axis)."""
    first_slope, second_slope = (y[1] - y[0]) / (x[1] - x[0]), (y[2] - y[1]) / (x[2] - x[1])
    c = (second_slope - first_slope) / (x[2] - x[0])
    b = first_slope - c * (x[0] + x[1])
    return y[0] - x[0] * (b + c * x[0]), b, c
