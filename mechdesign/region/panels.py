"""Panels of a scan: ranges of the ray angle over which the same margins bound the same intervals.

Within a panel the ends of the intervals are smooth functions of the angle, so that quadrature rules keep their order. A
panel ends where the bounding margins change (corners), or intervals appear or vanish (cusps, tangents).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechdesign.ground.errors import AssemblyError
from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.region.breaks import TOGETHER, all_breaks, signatures
from mechdesign.region.crossings import resolved
from mechdesign.region.field import ROUNDING
from mechdesign.region.intervals import SAME_ROOT, Intervals, joined
from mechdesign.region.raster import Raster
from mechdesign.region.rays import Scanned, ray_through, trace
from mechdesign.region.rules import cubic, spread

# Largest number of times that the reach is doubled.
DOUBLINGS = 16
# Largest number of rounds that add rays (where the raster shows hidden pieces and holes) or divide panels again.
ROUNDS = 4
# Place of the ray that stands for a panel, as a fraction of the panel. In symmetric mechanisms the ray at exactly half
# of it may pass through a single point that divides its interval.
MIDDLE = 0.4871
# Rays that test a panel, by the variable of `cubic`: they are dense near its ends, where a boundary may have a notch.
PROBES = np.array([0.02, 0.15, 0.3, 0.49, 0.7, 0.85, 0.98])
# A margin that ends an interval jumps there if it is more than this part of its largest value. That near to the end, as
# a part of the radius, but no farther than the middle of the interval, margins are those inside.
JUMPS, INSIDE = 1e-4, 1e-11
# Width (radians) below which a panel may hold nothing but the tip of a cusp.
NARROW = 1e-3


@dataclass(frozen=True, eq=False)
class Panels:
    """Panels of all designs, ordered by design and angle.

    Parameters
    ----------
    design, low, high : ndarray, shape (panels,)
        Design and range of angle of each panel.
    cut : ndarray of bool, shape (designs,)
        Whether margins of the assembly take anything from the region that the other margins bound.
    reach : ndarray, shape (designs,)
        Radius about the centre of the rays that holds the whole region of each design.
    closes : ndarray of bool, shape (designs,)
        Whether any ray meets the region.
    intervals : ndarray of int, shape (panels,)
        Number of intervals of each ray in a panel.
    raster_area : ndarray, shape (designs,)
        Lower bound of the area by the raster: its inside cells, less the error of that sum.
    undecided : ndarray, shape (designs,)
        Area between rays of which it stays undecided whether their intervals go on between them.
    """

    designs: Scanned
    design: Ints
    low: Floats
    high: Floats
    cut: Flags
    reach: Floats
    closes: Flags
    intervals: Ints
    raster_area: Floats
    undecided: Floats

    def trace(self, design: Ints, theta: Floats, slack: float = 0.0) -> Intervals:
        """Intersect rays, as long as the reach, with the region; `slack` as in `mechdesign.region.rays.trace`.

        Margins of the assembly are computed only for the designs whose region they `cut`.
        """
        cut = self.cut[design]
        parts = [(self.designs, np.flatnonzero(cut)), (self.designs.in_any_assembly, np.flatnonzero(~cut))]
        parts = [(designs, rays) for designs, rays in parts if rays.size] or parts[:1]
        traced = [trace(designs, design[rays], theta[rays], self.reach[design[rays]], slack) for designs, rays in parts]
        return joined([rays for _, rays in parts], traced)

    def through(self, design: Ints, z: Complexes) -> tuple[Floats, Intervals, Flags]:
        """Angles of rays through places, their intervals, and whether each holds the place; none does off the scan."""
        (begin, end), offset = self.designs.scan, z - self.designs.about
        # All rays pass through the centre of the scan: any will do.
        centre = np.abs(offset) <= SAME_ROOT * self.reach[design]
        theta = np.where(centre, begin + MIDDLE * (end - begin), ray_through(offset, begin))
        on_scan = np.isfinite(offset) & (theta <= end)
        theta, radius = np.where(on_scan, theta, begin), np.where(centre, 0.0, np.abs(offset))
        traced = self.trace(design, theta)
        distance = radius[traced.ray]
        return theta, traced, on_scan[traced.ray] & (traced.inner <= distance) & (distance <= traced.outer)


def find_panels(designs: Scanned, cuts: tuple[float, ...] = ()) -> Panels:
    """Divide the scan of every design into panels; `cuts` are further angles where panels end.

    Raises
    ------
    AssemblyError
        If the region is unbounded, or its boundary is lost in rounding.
    """
    count, raster = designs.count, Raster.of(designs)
    design, angle, reach, intervals = _rays(designs, raster)
    closes = np.bincount(design, intervals.counts, count) > 0
    cut = raster.cut | (np.bincount(design, intervals.cut, count) > 0)
    fixed = np.repeat(np.arange(count), 2 + len(cuts)), np.tile([*designs.scan, *cuts], count)
    # Breaks are one, and rays tell nothing beside them, where they are no farther apart than their accuracy.
    together = max(TOGETHER, 2 * designs.field.accuracy)
    broken, breaks, jumped, jumps, undecided = design[:0], angle[:0], design[:0], angle[:0], np.zeros(count)
    for rounds in range(ROUNDS + 1):
        split, angles = all_breaks(designs, reach, intervals, design, angle)
        split, angles = np.concatenate([split, jumped]), np.concatenate([angles, jumps])
        broken, breaks = np.concatenate([broken, split]), np.concatenate([breaks, angles])
        owner, low, high = _between(*fixed, broken, breaks, together)
        if rounds == ROUNDS:
            break
        # Rays at both ends of a panel may be alike though two breaks lie between: rays between them differ, or a link
        # jumps from one to the next.
        tested = np.flatnonzero(np.isin(owner, split) | (rounds == 0))
        begin, end = low[tested], high[tested]
        probed, wide = np.tile(owner[tested], (len(PROBES), 1)), end - begin > 100 * together
        rays = np.clip(spread(begin, end, PROBES[:, None], cubic)[0], begin + together, end - together)
        traced = trace(designs, probed.ravel(), rays.ravel(), reach[probed.ravel()])
        cut |= np.bincount(probed.ravel(), traced.cut, count) > 0
        codes = signatures(traced, len(designs.field.labels)).reshape(rays.shape)
        differ = (codes != codes[0]).any(axis=0) & wide
        # What closes within a hair of a break is no interval of the panel. Names may be rounding's there.
        ends, each = np.stack([begin + together, end - together]), np.tile(owner[tested], 2)
        near = np.flatnonzero(~np.isin([begin, end], fixed[1]) & wide)
        counts = traced.counts.reshape(rays.shape)[[0, -1]].ravel()
        if near.size:
            at_ends = trace(designs, each[near], ends.ravel()[near], reach[each[near]]).counts
            differ[near[at_ends != counts[near]] % len(wide)] = True
        panel, between, jump, undecided = _along_ends(designs, probed[0], rays, traced, reach, wide & ~differ)
        differ[panel] = True
        if not differ.any():
            break
        turned = owner[tested[panel]]
        jumped, jumps = turned[jump], between[jump]
        rays = np.concatenate([ends[:1], rays, ends[1:]])[:, differ]
        design = np.concatenate([np.tile(probed[0, differ], len(rays)), turned])
        angle = np.concatenate([rays.ravel(), between])
        order = np.lexsort((angle, design))
        design, angle = design[order], angle[order]
        intervals = trace(designs, design, angle, reach[design])
    # A panel whose middle ray meets nothing is empty, unless it is narrow: it may hold a tip that is lost in rounding.
    middle = low + MIDDLE * (high - low)
    counts = trace(designs, owner, middle, reach[owner]).counts
    full = (counts > 0) | (high - low < NARROW)
    area, error = raster.area
    return Panels(designs, owner[full], low[full], high[full], cut, reach, closes, counts[full], area - error,
                  undecided)  # fmt: skip


def _rays(designs: Scanned, raster: Raster) -> tuple[Ints, Floats, Floats, Intervals]:
    """Rays that miss no piece and no hole that the raster shows: design and angle of each, reach, and intervals.

    The reach is of shape (designs,).
    """
    scan, reach, number, searched = designs.scan, raster.reach, designs.effort.rays + 1, np.arange(designs.count)
    design, angle = np.repeat(searched, number), np.tile(np.linspace(*scan, number), designs.count)
    owner, hole = raster.holes
    through = ray_through(hole - designs.about, scan[0])
    design, angle = _with_rays(design, angle, owner[through < scan[1]], through[through < scan[1]])
    for rounds in range(ROUNDS + 1):
        reach, intervals = _extent(designs, design, angle, reach)
        before = len(design)
        if rounds < ROUNDS:
            searched, hidden = raster.hidden(np.unique(searched), design, angle, intervals)
            design, angle = _with_rays(design, angle, searched, hidden)
        if len(design) == before:
            break
    return design, angle, reach, intervals


def _with_rays(design: Ints, angle: Floats, owner: Ints, place: Floats) -> tuple[Ints, Floats]:
    """Rays and more of them at angles `place` of designs `owner`, each once, ascending by design and angle."""
    rays = np.unique(np.concatenate([design + 1j * angle, owner + 1j * place]))
    return rays.real.astype(np.intp), rays.imag


def _along_ends(
    designs: Scanned, design: Ints, theta: Floats, traced: Intervals, reach: Floats, alike: Flags
) -> tuple[Ints, Floats, Flags, Floats]:
    """Further rays of panels whose rays are `alike`, where the ends of their intervals may not go on between them.

    Along an end every other margin is positive and links turn little from ray to ray. Where a margin may dip below
    zero between two rays (a notch in the boundary), or a link turns far, rays between them are traced.

    Parameters
    ----------
    design : ndarray, shape (panels,)
    theta : ndarray, shape (rays, panels)
        Angles of the rays of each panel.
    traced : Intervals
        Those of all these rays.

    Returns
    -------
    (panel, angle, jumps, undecided)
        Of each ray that is unlike those of its panel, and of those (`jumps`) at which a link jumps; the area of each
        design between rays in doubt that are no farther divided.
    """
    field = designs.field
    labels, size = len(field.labels), len(field.members[0].labels)
    counts = traced.counts.reshape(theta.shape)[0] * alike
    codes = signatures(traced, labels).reshape(theta.shape)[0]
    owner = np.repeat(np.arange(len(counts)), 2 * counts)
    end = np.arange(len(owner)) - np.repeat(np.cumsum(2 * counts) - 2 * counts, 2 * counts)
    panels, angles = [owner[:0]], [theta[0, :0]]

    def sampled(lane: Ints, radius: Floats, angle: Floats) -> tuple[Floats, Floats, Complexes]:
        z = designs.about + radius * np.exp(1j * angle)
        return field.sampled(z, designs.of(design[owner[lane]]))

    def at_ends(lane: Ints, angle: Floats, ray: Ints, traced: Intervals) -> tuple[Floats, Floats, Complexes]:
        """Margins but that of the end itself, and rotations, at ends of rays; nan where a ray is unlike its panel."""
        like = signatures(traced, labels)[ray] == codes[owner[lane]]
        slot = np.where(like, np.searchsorted(traced.ray, ray) + end[lane] // 2, -1)
        last = end[lane] % 2 == 1
        radius = np.where(last, np.append(traced.outer, np.nan)[slot], np.append(traced.inner, np.nan)[slot])
        name = np.where(last, np.append(traced.leaves, -1)[slot], np.append(traced.enters, -1)[slot])
        margins, away, rotations = sampled(lane, radius, angle)
        own = np.flatnonzero(name >= 0)
        # Where the margin that ends an interval is not zero it jumps, as others do with it; those inside count.
        value, most = np.abs(margins[name[own], own]), np.nan_to_num(np.abs(margins)).max(axis=1, initial=0.0)
        at = own[value > JUMPS * most[name[own]]]
        if at.size:
            step = np.minimum(INSIDE * radius[at], 0.5 * (traced.outer - traced.inner)[slot[at]])
            inside = radius[at] + np.where(last[at], -step, step)
            for table, there in zip((margins, away, rotations), sampled(lane[at], inside, angle[at]), strict=True):
                table[:, at] = there
        margins[name[own], own] = 1.0
        # Of several assembly modes that of the end counts.
        margins[name // size != np.arange(labels)[:, None] // size] = 1.0
        # Where a link jumps while a ray's only interval goes on, another margin bounds it.
        rotations[:, counts[owner[lane]] == 1] = 1.0
        return margins, away, rotations

    def look(lane: Ints, angle: Floats) -> tuple[Floats, Floats, Complexes]:
        rays, ray = np.unique(owner[lane] + 1j * angle, return_inverse=True)
        panel, directions = rays.real.astype(np.intp), rays.imag
        traced = trace(designs, design[panel], directions, reach[design[panel]])
        unlike = signatures(traced, labels) != codes[panel]
        panels.append(panel[unlike])
        angles.append(directions[unlike])
        return at_ends(lane, angle, ray.ravel(), traced)

    lane, row = np.repeat(np.arange(len(owner)), len(theta)), np.tile(np.arange(len(theta)), len(owner))
    angle = theta[row, owner[lane]]
    first = (lane, angle, *at_ends(lane, angle, row * theta.shape[1] + owner[lane], traced))
    # Two margins may be zero all along an end: which of them is positive there is rounding's.
    sizes = np.where(np.isfinite(first[2]), np.abs(first[2]), 0.0).max(axis=1, initial=0.0)
    nearest, noise = np.full(len(owner), TOGETHER), ROUNDING * sizes
    _, _, _, (lane, ends) = resolved(look, first, nearest, noise, np.zeros(labels, dtype=bool), designs.effort.bends)
    jumps = np.arange(sum(map(len, panels)) + len(lane)) >= sum(map(len, panels))
    panel, width, at = owner[lane], ends[1] - ends[0], np.searchsorted(traced.ray, owner[lane]) + end[lane] // 2
    area = 0.5 * width * (traced.outer[at] ** 2 - traced.inner[at] ** 2) * (width > TOGETHER)
    undecided = np.bincount(design[panel], area, designs.count).astype(float)
    return np.concatenate([*panels, panel]), np.concatenate([*angles, ends.mean(axis=0)]), jumps, undecided


def _between(every: Ints, fixed: Floats, broken: Ints, breaks: Floats, together: float) -> tuple[Ints, Floats, Floats]:
    """Design and both ends of the panels between `fixed` angles of the designs `every` and `breaks` of `broken`."""
    owner, place = np.concatenate([every, broken]), np.concatenate([fixed, breaks])
    firm = np.arange(len(place)) < len(fixed)
    order = np.lexsort((place, owner))
    owner, place, firm = owner[order], place[order], firm[order]
    # Breaks that rounding sets beside each other, or beside a fixed end, are one.
    near = (owner[1:] == owner[:-1]) & (np.diff(place) < 1.001 * together)
    drop = np.zeros(len(place), dtype=bool)
    drop[1:] |= near & ~firm[1:]
    drop[:-1] |= near & firm[1:] & ~firm[:-1]
    owner, place = owner[~drop], place[~drop]
    keep = owner[1:] == owner[:-1]
    return owner[:-1][keep], place[:-1][keep], place[1:][keep]


def _extent(designs: Scanned, design: Ints, theta: Floats, reach: Floats) -> tuple[Floats, Intervals]:
    """The reach that each design needs, doubled until no ray ends inside, and the intervals of all rays."""
    for _ in range(DOUBLINGS):
        intervals = trace(designs, design, theta, reach[design])
        beyond = np.bincount(design, intervals.beyond, designs.count) > 0
        if not beyond.any():
            return reach, intervals
        reach = np.where(beyond, 2 * reach, reach)
    raise AssemblyError(
        "the workspace has no end: a ray from "
        f"({designs.about.real:g}, {designs.about.imag:g}) stays inside; give the drives limits"
    )
