"""Parts of regions between the rays of a scan, and holes, that the scan has not met: seen from other centres."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.workspace.rays import Designs, Floats, Intervals, Ints, trace

# Where else a region is looked at from (parts of its reach about the scan's centre).
VIEWS = (0.37 * np.exp(1.1j), 0.61 * np.exp(4.2j))
# Designs whose reaches agree to such a part of an octave are looked at together.
OCTAVE = 4


def overlooked(
    designs: Designs, some: Ints, reach: Floats, samples: int, rays: int, scan: tuple[float, float], design: Ints,
    angle: Floats, intervals: Intervals,
) -> tuple[Ints, Floats]:  # fmt: skip
    """Design and angle of further rays that meet what those of a scan have missed.

    Parameters
    ----------
    some : ndarray of int
        Designs that are looked at.
    reach : ndarray, shape (designs,)
    rays : int
        Rays about each other centre.
    scan : (float, float)
    design, angle, intervals
        The rays of the scan, ascending by both, and what they have met.
    """
    seen = [(np.zeros(0, dtype=np.intp), np.zeros(0, dtype=complex), np.zeros(0, dtype=bool))]
    size = np.round(OCTAVE * np.log2(reach[some]))
    for each in np.unique(size):
        group = some[size == each]
        for view in VIEWS:
            centre = designs.about + 2 ** (each / OCTAVE) * view
            seen += _seen(replace(designs, places=designs.of(group), count=len(group), about=centre),
                          2 * reach[group], rays, samples, group)  # fmt: skip
    owner, place, within = (np.concatenate(parts) for parts in zip(*seen, strict=True))
    place = place - designs.about
    theta = scan[0] + (np.angle(place) - scan[0]) % (2 * np.pi)
    known = theta < scan[1]
    owner, place, within, theta = owner[known], place[known], within[known], theta[known]
    cell = np.searchsorted(design + 1j * angle, owner + 1j * theta, side="right") - 1
    before, after = (_holds(intervals, cell + k, np.abs(place)) for k in (0, 1))
    missed = np.where(within, ~before & ~after, before & after)
    return owner[missed], theta[missed]


def _seen(
    designs: Designs, reach: Floats, rays: int, samples: int, group: Ints
) -> list[tuple[Ints, NDArray[np.complex128], NDArray[np.bool_]]]:
    """Places halfway along the intervals of rays and along the gaps between them: owner, place, whether inside."""
    theta = np.tile(np.linspace(0.0, 2 * np.pi, rays, endpoint=False), designs.count)
    design = np.repeat(np.arange(designs.count), rays)
    found = trace(designs, design, theta, reach[design], samples)
    gap = np.flatnonzero(found.ray[1:] == found.ray[:-1])
    parts = []
    for ray, low, high, inside in (
        (found.ray, found.inner, found.outer, True), (found.ray[gap], found.outer[gap], found.inner[gap + 1], False),
    ):  # fmt: skip
        place = designs.about + 0.5 * (low + high) * np.exp(1j * theta[ray])
        parts.append((group[design[ray]], place, np.full(len(ray), inside)))
    return parts


def _holds(intervals: Intervals, ray: Ints, radius: Floats) -> NDArray[np.bool_]:
    """Whether rays are inside the region at some radius."""
    begin, end = np.searchsorted(intervals.ray, ray), np.searchsorted(intervals.ray, ray, side="right")
    held = np.zeros(len(ray), dtype=bool)
    for k in range(int(np.max(end - begin, initial=0))):
        at = np.minimum(begin + k, len(intervals.ray) - 1)
        held |= (begin + k < end) & (intervals.inner[at] <= radius) & (radius <= intervals.outer[at])
    return held
