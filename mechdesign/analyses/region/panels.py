"""Panels of a scan: ranges of the ray's angle over which the same margins bound the same intervals.

Within a panel the ends of the intervals are smooth functions of the angle. Where the bounding margins change (corners),
or intervals appear (cusps, tangents), a panel ends, so that quadrature rules keep their order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.region.breaks import TOGETHER, all_breaks
from mechdesign.analyses.region.raster import Raster
from mechdesign.analyses.region.rays import SAME_ROOT, Designs, Intervals, ray_through, trace
from mechdesign.errors import AssemblyError
from mechdesign.numerics.arrays import Complexes, Flags, Floats, Ints

# Times that the reach is doubled at most.
DOUBLINGS = 16
# Rounds in which rays are put where the raster shows what others pass by.
LOOKS = 4
# A ray inside a panel, not at half of it: by symmetry a single point may divide the ray there.
MIDDLE = 0.4871
# Rays of a panel, as parts of it, that have to meet as many intervals: between those that do not is another break.
PROBES = np.array([0.01, 0.13, 0.31, MIDDLE, 0.69, 0.87, 0.99])
# Width (radians) below which a panel may hold nothing but a tip.
NARROW = 1e-3


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
    intervals : ndarray of int, shape (panels,)
        Intervals of a ray inside each panel.
    seen : ndarray, shape (designs,)
        Area that the raster is sure of: that of its cells inside, less what it is not known to.
    """

    designs: Designs
    design: Ints
    low: Floats
    high: Floats
    reach: Floats
    closes: Flags
    intervals: Ints
    seen: Floats

    def trace(self, design: Ints, theta: Floats, slack: float = 0.0) -> Intervals:
        """Rays of designs, as long as they need be; `slack` as in `mechdesign.analyses.region.rays.trace`."""
        return trace(self.designs, design, theta, self.reach[design], slack)

    def through(self, design: Ints, z: Complexes) -> tuple[Floats, Intervals, Flags]:
        """Angles of rays through places, their intervals, and which of these hold the place; none does off the scan."""
        (begin, end), way = self.designs.scan, z - self.designs.about
        # At the centre of the scan one ray is as good as another.
        centre = np.abs(way) <= SAME_ROOT * self.reach[design]
        theta = np.where(centre, begin + MIDDLE * (end - begin), ray_through(way, begin))
        known = np.isfinite(way) & (theta <= end)
        theta, radius = np.where(known, theta, begin), np.where(centre, 0.0, np.abs(way))
        found = self.trace(design, theta)
        at = radius[found.ray]
        return theta, found, known[found.ray] & (found.inner <= at) & (at <= found.outer)


def find_panels(designs: Designs, cuts: tuple[float, ...] = ()) -> Panels:
    """Divide the scan of every design into panels; `cuts` are further angles where panels end.

    Raises
    ------
    AssemblyError
        If the region has no end.
    """
    count, scan, number = designs.count, designs.scan, designs.effort.rays + 1
    raster = Raster.of(designs)
    least = raster.farthest
    design = np.repeat(np.arange(count), number)
    angle = np.tile(np.linspace(*scan, number), count)
    reach = np.where(least > 0, least, raster.reach)
    reach, intervals = _extent(designs, design, angle, reach, least)
    owner = np.arange(count)
    for _ in range(LOOKS):
        owner, hidden = raster.hidden(np.unique(owner), design, angle, intervals)
        rays = np.unique(np.concatenate([design + 1j * angle, owner + 1j * hidden]))
        if len(rays) == len(design):
            break
        design, angle = rays.real.astype(np.intp), rays.imag
        reach, intervals = _extent(designs, design, angle, reach, least)
    found, breaks = all_breaks(designs, reach, intervals, design, angle)
    every, fixed = np.repeat(np.arange(count), 2 + len(cuts)), np.tile([*scan, *cuts], count)
    owner, low, high = _between(every, fixed, found, breaks)
    some = np.arange(len(low))
    for _ in range(LOOKS):
        # Two rays may be alike though two breaks lie between them: then others between them are not.
        of, rays = np.repeat(owner[some], len(PROBES)), (low[some, None] + (high - low)[some, None] * PROBES).ravel()
        counts = trace(designs, of, rays, reach[of]).counts.reshape(-1, len(PROBES))
        unlike = (np.ptp(counts, axis=1) > 0) & ((high - low)[some] > NARROW)
        if not unlike.any():
            break
        of, rays = (each.reshape(counts.shape)[unlike].ravel() for each in (of, rays))
        more, angles = all_breaks(designs, reach, trace(designs, of, rays, reach[of]), of, rays)
        found, breaks = np.concatenate([found, more]), np.concatenate([breaks, angles])
        owner, low, high = _between(every, fixed, found, breaks)
        some = np.flatnonzero(np.isin(owner, more))
    # A panel is empty where a ray inside it meets nothing; a narrow one may hold a tip that is lost in rounding.
    middle = low + MIDDLE * (high - low)
    counts = trace(designs, owner, middle, reach[owner]).counts
    full = (counts > 0) | (high - low < NARROW)
    closes = np.bincount(design, intervals.counts, count) > 0
    area, doubt = raster.area
    return Panels(designs, owner[full], low[full], high[full], reach, closes, counts[full], area - doubt)


def _between(every: Ints, fixed: Floats, found: Ints, breaks: Floats) -> tuple[Ints, Floats, Floats]:
    """Design and ends of the panels between `fixed` ends of the designs `every` and breaks of the designs `found`."""
    owner, place = np.concatenate([every, found]), np.concatenate([fixed, breaks])
    firm = np.arange(len(place)) < len(fixed)
    order = np.lexsort((place, owner))
    owner, place, firm = owner[order], place[order], firm[order]
    # Breaks that rounding sets beside each other, or beside the end of the scan, are one.
    near = (owner[1:] == owner[:-1]) & (np.diff(place) < TOGETHER)
    drop = np.zeros(len(place), dtype=bool)
    drop[1:] |= near & ~firm[1:]
    drop[:-1] |= near & firm[1:] & ~firm[:-1]
    owner, place = owner[~drop], place[~drop]
    keep = owner[1:] == owner[:-1]
    return owner[:-1][keep], place[:-1][keep], place[1:][keep]


def _extent(designs: Designs, design: Ints, theta: Floats, reach: Floats, least: Floats) -> tuple[Floats, Intervals]:
    """Trace rays, doubling the reach until no ray ends inside; returns the reach needed and the intervals.

    The reach of a design is `least` at least.
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
