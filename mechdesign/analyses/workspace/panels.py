"""Panels of a scan: ranges of the ray's angle over which the same margins bound the same intervals.

Within a panel the ends of the intervals are smooth functions of the angle. Where the bounding margins change (corners),
or intervals appear (cusps, tangents), a panel ends, so that quadrature rules keep their order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.workspace.breaks import TOGETHER, Search, signatures
from mechdesign.analyses.workspace.overlooked import overlooked
from mechdesign.analyses.workspace.rays import Designs, Floats, Intervals, Ints, trace
from mechdesign.errors import AssemblyError

PROBES = 4
DOUBLINGS = 16


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
    intervals : ndarray of int, shape (panels,)
        Intervals of a ray inside each panel; 0 where none has been traced there.
    """

    design: Ints
    low: Floats
    high: Floats
    reach: Floats
    closes: NDArray[np.bool_]
    intervals: Ints


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
    if count == 1:
        missed = overlooked(designs, float(reach[0]), effort.samples, angles, intervals)
        if missed.size:
            angles = np.unique(np.concatenate([angles, missed]))
            reach, intervals = _extent(designs, angles, reach, effort.samples)
    codes = signatures(intervals, len(designs.field.labels)).reshape(count, -1)
    design, cell = np.nonzero(codes[:, 1:] != codes[:, :-1])
    search = Search(designs, reach, effort.samples)
    design, breaks = search.all_breaks(intervals, design * len(angles) + cell, design, angles[cell], angles[cell + 1])
    counts = intervals.counts.reshape(count, -1)
    inside = counts > 0
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
    first, last = np.searchsorted(angles, low + TOGETHER, side="right"), np.searchsorted(angles, high - TOGETHER)
    # Not at half of the panel: by symmetry a single point may divide the ray there.
    usual = np.where(last > first, counts[owner, np.minimum(first + (last - first) // 4, len(angles) - 1)], 0)
    return Panels(owner[full], low[full], high[full], reach, np.asarray(inside.any(axis=1)), usual[full])


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
