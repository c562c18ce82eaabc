"""Panels of a scan: ranges of the ray's angle over which the same margins bound the same intervals.

Within a panel the ends of the intervals are smooth functions of the angle. Where the bounding margins change (corners),
or intervals appear (cusps, tangents), a panel ends, so that quadrature rules keep their order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.region.breaks import TOGETHER, all_breaks
from mechdesign.analyses.region.raster import Raster
from mechdesign.analyses.region.rays import FARTHEST_TURN, SAME_ROOT, Designs, Intervals, joined, ray_through, trace
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
    cut : ndarray of bool, shape (designs,)
        Whether margins of the assembly leave out anything of a region that the others bound.
    reach : ndarray, shape (designs,)
        Radius beyond the whole region of each design.
    closes : ndarray of bool, shape (designs,)
        Whether any ray met the region.
    intervals : ndarray of int, shape (panels,)
        Intervals of a ray inside each panel.
    seen : ndarray, shape (designs,)
        Area that the raster is sure of: that of its cells inside, less what it is not known to.
    unseen : ndarray, shape (designs,)
        Area of places that the raster cannot exclude though none of them was met.
    """

    designs: Designs
    design: Ints
    low: Floats
    high: Floats
    cut: Flags
    reach: Floats
    closes: Flags
    intervals: Ints
    seen: Floats
    unseen: Floats

    def trace(self, design: Ints, theta: Floats, slack: float = 0.0) -> Intervals:
        """Rays of designs, as long as they need be; `slack` as in `mechdesign.analyses.region.rays.trace`.

        Margins of the assembly are only looked at where they are known to cut something.
        """
        cut = self.cut[design]
        parts = [(self.designs, np.flatnonzero(cut)), (self.designs.in_any_assembly, np.flatnonzero(~cut))]
        parts = [(designs, own) for designs, own in parts if own.size] or parts[:1]
        found = [trace(designs, design[own], theta[own], self.reach[design[own]], slack) for designs, own in parts]
        return joined([own for _, own in parts], found)

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
    every, (owner, hole) = np.arange(count), raster.holes
    design, angle = np.repeat(every, number), np.tile(np.linspace(*scan, number), count)
    if owner.size:
        through = ray_through(hole - designs.about, scan[0])
        met = through < scan[1]
        rays = np.unique(np.concatenate([design + 1j * angle, (owner + 1j * through)[met]]))
        design, angle = rays.real.astype(np.intp), rays.imag
    reach = np.where(least > 0, least, raster.reach)
    reach, intervals = _extent(designs, design, angle, reach, least)
    owner = every
    for _ in range(LOOKS):
        owner, hidden = raster.hidden(np.unique(owner), design, angle, intervals)
        rays = np.unique(np.concatenate([design + 1j * angle, owner + 1j * hidden]))
        if len(rays) == len(design):
            break
        design, angle = rays.real.astype(np.intp), rays.imag
        reach, intervals = _extent(designs, design, angle, reach, least)
    found, breaks = all_breaks(designs, reach, intervals, design, angle)
    every, fixed = np.repeat(every, 2 + len(cuts)), np.tile([*scan, *cuts], count)
    owner, low, high = _between(every, fixed, found, breaks)
    some, cut = np.arange(len(low)), raster.cut | (np.bincount(design, intervals.cut, count) > 0)
    for _ in range(LOOKS):
        # Two rays may be alike though two breaks lie between them: then others between them are not, or links jump.
        of, rays = np.tile(owner[some], (len(PROBES), 1)), low[some] + (high - low)[some] * PROBES[:, None]
        wide = (high - low)[some] > TOGETHER / PROBES[0]
        traced = trace(designs, of.ravel(), rays.ravel(), reach[of.ravel()])
        cut |= np.bincount(of.ravel(), traced.cut, count) > 0
        counts = traced.counts.reshape(rays.shape)
        unlike = (np.ptp(counts, axis=0) > 0) & wide
        panel, between, jumps = _turn_by_turn(designs, of, rays, traced, reach, wide & ~unlike)
        unlike[panel] = True
        if not unlike.any():
            break
        of = np.concatenate([of[:, unlike].ravel(), owner[some[panel]]])
        rays = np.concatenate([rays[:, unlike].ravel(), between])
        order = np.lexsort((rays, of))
        of, rays = of[order], rays[order]
        more, angles = all_breaks(designs, reach, trace(designs, of, rays, reach[of]), of, rays)
        more, angles = np.concatenate([more, owner[some[panel[jumps]]]]), np.concatenate([angles, between[jumps]])
        found, breaks = np.concatenate([found, more]), np.concatenate([breaks, angles])
        owner, low, high = _between(every, fixed, found, breaks)
        some = np.flatnonzero(np.isin(owner, more))
    # A panel is empty where a ray inside it meets nothing; a narrow one may hold a tip that is lost in rounding.
    middle = low + MIDDLE * (high - low)
    counts = trace(designs, owner, middle, reach[owner]).counts
    full = (counts > 0) | (high - low < NARROW)
    closes = np.bincount(design, intervals.counts, count) > 0
    area, doubt = raster.area
    return Panels(designs, owner[full], low[full], high[full], cut, reach, closes, counts[full], area - doubt,
                  raster.unseen)  # fmt: skip


def _turn_by_turn(
    designs: Designs, design: Ints, theta: Floats, traced: Intervals, reach: Floats, alike: Flags
) -> tuple[Ints, Floats, Flags]:
    """Further rays of panels whose rays are `alike`, where links lie otherwise at the ends of their intervals.

    So many that from one of them to the next either the intervals are others or no link turns far, or else until they
    are one: then the link jumps there. Rays of shape (rays, panels).

    Returns
    -------
    (panel, angle, jumps)
    """
    counts = traced.counts.reshape(theta.shape)[0]
    panel = np.flatnonzero(alike & (counts > 1))
    most = int(counts[panel].max(initial=0))

    def ends(traced: Intervals) -> Floats:
        found = np.full((2, most, len(traced.beyond)), np.nan)
        radii = traced.by_ray(traced.inner, traced.outer)[:, :most]
        found[:, : radii.shape[1]] = radii
        return found.reshape(2 * most, -1)

    def turned(panel: Ints, theta: Floats, radii: Floats) -> Flags:
        """Whether a link turns far from each ray to the next."""
        z = designs.about + radii * np.exp(1j * theta[:, None])
        owner = np.tile(design[0, panel], z.shape[1])
        found = designs.field.sampled(z.reshape(len(z), -1), designs.of(owner))[1].reshape(len(z) - 1, *z.shape[1:])
        return np.asarray((found > FARTHEST_TURN).any(axis=1))

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
        like = traced.counts == counts[panel]
        pair, radii = np.insert(pair, 1, middle, axis=0)[:, like], np.insert(radii, 1, ends(traced), axis=0)[:, :, like]
        panel = panel[like]
        half, which = np.nonzero(turned(panel, pair, radii))
        panel = panel[which]
        pair, radii = pair[[half, half + 1], which], radii[[half, half + 1], :, which].swapaxes(1, 2)
    return np.concatenate(panels), np.concatenate(angles), np.concatenate(jumps)


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
