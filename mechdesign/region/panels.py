"""Panels of a scan: ranges of the ray angle over which the same margins bound the same intervals.

Within a panel the ends of the intervals are smooth functions of the angle, so that quadrature rules keep their order. A
panel ends where the bounding margins change (corners), or intervals appear or vanish (cusps, tangents).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechdesign.errors import AssemblyError
from mechdesign.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.region.breaks import TOGETHER, all_breaks
from mechdesign.region.raster import Raster
from mechdesign.region.rays import FARTHEST_TURN, SAME_ROOT, Designs, Intervals, joined, ray_through, trace

# Largest number of times that the reach is doubled.
DOUBLINGS = 16
# Largest number of rounds that add rays (where the raster shows hidden pieces and holes) or divide panels again.
ROUNDS = 4
# Place of the ray that stands for a panel, as a fraction of the panel. In symmetric mechanisms the ray at exactly half
# of it may pass through a single point that divides its interval.
MIDDLE = 0.4871
# Rays that test a panel, as fractions of it: where they meet unequal numbers of intervals, the panel is divided.
PROBES = np.array([0.01, 0.13, 0.31, MIDDLE, 0.69, 0.87, 0.99])
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
        Area of the cells of which the raster neither found a point inside nor excludes one.
    """

    designs: Designs
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


def find_panels(designs: Designs, cuts: tuple[float, ...] = ()) -> Panels:
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
    broken, breaks, jumped, jumps = design[:0], angle[:0], design[:0], angle[:0]
    for rounds in range(ROUNDS + 1):
        split, angles = all_breaks(designs, reach, intervals, design, angle)
        split, angles = np.concatenate([split, jumped]), np.concatenate([angles, jumps])
        broken, breaks = np.concatenate([broken, split]), np.concatenate([breaks, angles])
        owner, low, high = _between(*fixed, broken, breaks)
        if rounds == ROUNDS:
            break
        # Rays at both ends of a panel may be alike though two breaks lie between: rays between them differ, or a link
        # jumps from one to the next.
        tested = np.flatnonzero(np.isin(owner, split) | (rounds == 0))
        probed, rays = np.tile(owner[tested], (len(PROBES), 1)), low[tested] + (high - low)[tested] * PROBES[:, None]
        wide = (high - low)[tested] > TOGETHER / PROBES[0]
        traced = trace(designs, probed.ravel(), rays.ravel(), reach[probed.ravel()])
        cut |= np.bincount(probed.ravel(), traced.cut, count) > 0
        differ = (np.ptp(traced.counts.reshape(rays.shape), axis=0) > 0) & wide
        panel, between, jump = _split_by_turns(designs, probed, rays, traced, reach, wide & ~differ)
        differ[panel] = True
        if not differ.any():
            break
        turned = owner[tested[panel]]
        jumped, jumps = turned[jump], between[jump]
        design = np.concatenate([probed[:, differ].ravel(), turned])
        angle = np.concatenate([rays[:, differ].ravel(), between])
        order = np.lexsort((angle, design))
        design, angle = design[order], angle[order]
        intervals = trace(designs, design, angle, reach[design])
    # A panel whose middle ray meets nothing is empty, unless it is narrow: it may hold a tip that is lost in rounding.
    middle = low + MIDDLE * (high - low)
    counts = trace(designs, owner, middle, reach[owner]).counts
    full = (counts > 0) | (high - low < NARROW)
    area, error = raster.area
    return Panels(designs, owner[full], low[full], high[full], cut, reach, closes, counts[full], area - error,
                  raster.undecided)  # fmt: skip


def _rays(designs: Designs, raster: Raster) -> tuple[Ints, Floats, Floats, Intervals]:
    """Rays that miss no piece and no hole that the raster shows: design and angle of each, reach, and intervals.

    The reach is of shape (designs,).
    """
    scan, least, number, searched = designs.scan, raster.farthest, designs.effort.rays + 1, np.arange(designs.count)
    design, angle = np.repeat(searched, number), np.tile(np.linspace(*scan, number), designs.count)
    owner, hole = raster.holes
    through = ray_through(hole - designs.about, scan[0])
    design, angle = _with_rays(design, angle, owner[through < scan[1]], through[through < scan[1]])
    reach = np.where(least > 0, least, raster.reach)
    for rounds in range(ROUNDS + 1):
        reach, intervals = _extent(designs, design, angle, reach, least)
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


def _split_by_turns(
    designs: Designs, design: Ints, theta: Floats, traced: Intervals, reach: Floats, alike: Flags
) -> tuple[Ints, Floats, Flags]:
    """Further rays of panels whose rays are `alike`, where a link turns far from one interval end to the next ray's.

    Two such rays are halved until the rays between have other intervals, or no link turns far from ray to ray, or they
    are `TOGETHER`: there the link jumps.

    Parameters
    ----------
    design, theta : ndarray, shape (rays, panels)
        Design and angle of the rays of each panel.
    traced : Intervals
        Those of all these rays.

    Returns
    -------
    (panel, angle, jumps)
        Of each further ray; `jumps` where a link jumps at it.
    """
    counts = traced.counts.reshape(theta.shape)[0]
    panel = np.flatnonzero(alike & (counts > 1))
    most = int(counts[panel].max(initial=0))

    def ends(traced: Intervals) -> Floats:
        """Inner and outer radii of each ray, shape (2 largest count, rays); nan beyond its last interval."""
        radii = np.full((2, most, len(traced.beyond)), np.nan)
        of_rays = traced.by_ray(traced.inner, traced.outer)[:, :most]
        radii[:, : of_rays.shape[1]] = of_rays
        return radii.reshape(2 * most, -1)

    def turned(panel: Ints, theta: Floats, radii: Floats) -> Flags:
        """Whether a link turns far from each ray to the next, shape (rays - 1, panels)."""
        z = designs.about + radii * np.exp(1j * theta[:, None])
        owner = np.tile(design[0, panel], z.shape[1])
        turns = designs.field.sampled(z.reshape(len(z), -1), designs.of(owner))[1].reshape(len(z) - 1, *z.shape[1:])
        return np.asarray((turns > FARTHEST_TURN).any(axis=1))

    panels, angles, jumps = [panel[:0]], [theta[0, :0]], [alike[:0]]
    if panel.size:
        radii = ends(traced).reshape(2 * most, *theta.shape).swapaxes(0, 1)[:, :, panel]
        ray, which = np.nonzero(turned(panel, theta[:, panel], radii))
        panel = panel[which]
        pair, radii = theta[[ray, ray + 1], panel], radii[[ray, ray + 1], :, which].swapaxes(1, 2)
    while panel.size:
        middle, last = 0.5 * (pair[0] + pair[1]), pair[1] - pair[0] < TOGETHER
        panels.append(panel)
        angles.append(middle)
        jumps.append(last)
        panel, middle, pair, radii = panel[~last], middle[~last], pair[:, ~last], radii[:, :, ~last]
        traced = trace(designs, design[0, panel], middle, reach[design[0, panel]])
        same = traced.counts == counts[panel]
        pair, radii = np.insert(pair, 1, middle, axis=0)[:, same], np.insert(radii, 1, ends(traced), axis=0)[:, :, same]
        panel = panel[same]
        half, which = np.nonzero(turned(panel, pair, radii))
        panel = panel[which]
        pair, radii = pair[[half, half + 1], which], radii[[half, half + 1], :, which].swapaxes(1, 2)
    return np.concatenate(panels), np.concatenate(angles), np.concatenate(jumps)


def _between(every: Ints, fixed: Floats, broken: Ints, breaks: Floats) -> tuple[Ints, Floats, Floats]:
    """Design and both ends of the panels between `fixed` angles of the designs `every` and `breaks` of `broken`."""
    owner, place = np.concatenate([every, broken]), np.concatenate([fixed, breaks])
    firm = np.arange(len(place)) < len(fixed)
    order = np.lexsort((place, owner))
    owner, place, firm = owner[order], place[order], firm[order]
    # Breaks that rounding sets beside each other, or beside a fixed end, are one.
    near = (owner[1:] == owner[:-1]) & (np.diff(place) < TOGETHER)
    drop = np.zeros(len(place), dtype=bool)
    drop[1:] |= near & ~firm[1:]
    drop[:-1] |= near & firm[1:] & ~firm[:-1]
    owner, place = owner[~drop], place[~drop]
    keep = owner[1:] == owner[:-1]
    return owner[:-1][keep], place[:-1][keep], place[1:][keep]


def _extent(designs: Designs, design: Ints, theta: Floats, reach: Floats, least: Floats) -> tuple[Floats, Intervals]:
    """Trace rays, doubling the reach until no ray ends inside.

    Returns
    -------
    (reach, intervals)
        The reach that each design needs, at least `least`, and the intervals of all rays.
    """
    for _ in range(DOUBLINGS):
        intervals = trace(designs, design, theta, reach[design])
        beyond = np.bincount(design, intervals.beyond, designs.count) > 0
        if not beyond.any():
            break
        reach = np.where(beyond, 2 * reach, reach)
    else:
        raise AssemblyError(
            "the workspace has no end: a ray from "
            f"({designs.about.real:g}, {designs.about.imag:g}) stays inside; give the drives limits"
        )
    farthest = np.zeros(designs.count)
    np.maximum.at(farthest, design[intervals.ray], intervals.outer)
    return np.where(farthest > 0, 1.2 * np.maximum(farthest, least), reach), intervals
