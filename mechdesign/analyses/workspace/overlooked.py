"""Parts of a region between the rays of a scan, and holes, that the scan has not met: seen from other centres."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.workspace.rays import Designs, Floats, Intervals, trace

# Where else the region is looked at from (parts of its reach about the scan's centre), and by how many rays.
VIEWS = (0.37 * np.exp(1.1j), 0.61 * np.exp(4.2j))
RAYS = 96


def overlooked(designs: Designs, reach: float, samples: int, angles: Floats, intervals: Intervals) -> Floats:
    """Angles of further rays that meet what those of a scan have missed.

    Parameters
    ----------
    designs : Designs
        A single design.
    angles, intervals
        The rays of the scan, ascending, and what they have met.
    """
    places, inside = [np.zeros(0, dtype=complex)], [np.zeros(0, dtype=bool)]
    for view in VIEWS:
        seen = replace(designs, about=designs.about + reach * view)
        theta = np.linspace(0.0, 2 * np.pi, RAYS, endpoint=False)
        zero = np.zeros(RAYS, dtype=np.intp)
        found = trace(seen, zero, theta, np.full(RAYS, 2 * reach), samples)
        turn = np.exp(1j * theta)
        places.append(seen.about + 0.5 * (found.inner + found.outer) * turn[found.ray])
        inside.append(np.ones(len(found.ray), dtype=bool))
        gap = np.flatnonzero(found.ray[1:] == found.ray[:-1])
        places.append(seen.about + 0.5 * (found.outer[gap] + found.inner[gap + 1]) * turn[found.ray[gap]])
        inside.append(np.zeros(len(gap), dtype=bool))
    place, within = np.concatenate(places) - designs.about, np.concatenate(inside)
    theta = angles[0] + (np.angle(place) - angles[0]) % (2 * np.pi)
    known = theta < angles[-1]
    place, within, theta = place[known], within[known], theta[known]
    cell = np.clip(np.searchsorted(angles, theta, side="right") - 1, 0, len(angles) - 2)
    before, after = (_holds(intervals, cell + k, np.abs(place)) for k in (0, 1))
    missed: Floats = theta[np.where(within, ~before & ~after, before & after)]
    return missed


def _holds(intervals: Intervals, ray: NDArray[np.intp], radius: Floats) -> NDArray[np.bool_]:
    """Whether rays are inside the region at some radius."""
    begin, end = np.searchsorted(intervals.ray, ray), np.searchsorted(intervals.ray, ray, side="right")
    held = np.zeros(len(ray), dtype=bool)
    for k in range(int(np.max(end - begin, initial=0))):
        at = np.minimum(begin + k, len(intervals.ray) - 1)
        held |= (begin + k < end) & (intervals.inner[at] <= radius) & (radius <= intervals.outer[at])
    return held
