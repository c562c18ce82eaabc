"""The smallest axis-parallel rectangle around the region of each design."""

from __future__ import annotations

import numpy as np

from mechdesign.analyses.region.panels import Panels
from mechdesign.analyses.region.rays import Designs, trace
from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.numerics.roots import dips

# Rays through the ends of panels may meet an interval that rounding has closed (a cusp): it still bounds the region.
SLACK = 1e-9
ROUNDING = 1e-12
STEPS = 8
# Directions in which the region is widest: right, left, up, down.
_TURNS = np.array([1, -1, -1j, 1j])


def bounding_box(designs: Designs, panels: Panels, boundary: tuple[Ints, Floats, Floats], samples: int) -> Floats:
    """Areas of the rectangles, shape (designs,) [S1, eq. 26]; 0 where the region is empty.

    The farthest point in each direction is either at the end of a panel (a corner or cusp), where a ray is traced, or
    on a smooth curve, where parabolas through the nearest boundary points lead to it.
    """
    count = designs.count
    owner, ends = np.tile(panels.design, 2), np.concatenate([panels.low, panels.high])
    traced = trace(designs, owner, ends, panels.reach[owner], samples, SLACK)
    corner = np.tile(traced.ray, 2)
    design = np.concatenate([boundary[0], owner[corner]])
    theta = np.concatenate([boundary[1], ends[corner]])
    radius = np.concatenate([boundary[2], traced.inner, traced.outer])
    place = designs.about + radius * np.exp(1j * theta)
    at_end = np.arange(len(place)) >= len(boundary[0])
    farthest = np.zeros((4, count))
    for side, turn in enumerate(_TURNS):
        best, low, middle, high = _best((place * turn).real, design, theta, count)
        smooth = (low < middle) & (middle < high)
        # As far at the end of a panel, but for rounding: a corner.
        corners = at_end & ((place * turn).real >= (best - ROUNDING * np.abs(best))[design])
        smooth[design[corners]] = False
        if smooth.any():
            climbed = _climb(designs, panels.reach, np.nonzero(smooth)[0], low, middle, high, turn, samples)
            best[smooth] = np.maximum(best[smooth], climbed)
        farthest[side] = best
    size = (farthest[0] + farthest[1]) * (farthest[2] + farthest[3])
    return np.where(np.isfinite(size), size, 0.0)


def _best(distance: Floats, design: Ints, theta: Floats, count: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Per design the largest distance, the angle where it is, and the angles of the rays on either side of it."""
    top = np.full(count, -np.inf)
    np.maximum.at(top, design, distance)
    middle = np.full(count, np.nan)
    here = distance == top[design]
    middle[design[here]] = theta[here]
    low, high = np.full(count, -np.inf), np.full(count, np.inf)
    below, above = theta < middle[design], theta > middle[design]
    np.maximum.at(low, design[below], theta[below])
    np.minimum.at(high, design[above], theta[above])
    low, high = np.where(np.isfinite(low), low, middle), np.where(np.isfinite(high), high, middle)
    return top, low, middle, high


def _climb(
    designs: Designs, reach: Floats, which: Ints, low: Floats, middle: Floats, high: Floats, turn: complex, samples: int
) -> Floats:
    """Largest distance of designs between two rays."""

    def depth(lane: Ints, theta: Floats) -> Floats:
        traced = trace(designs, which[lane], theta, reach[which[lane]], samples, SLACK)
        found = np.full(len(lane), np.inf)
        for radius in (traced.inner, traced.outer):
            place = designs.about + radius * np.exp(1j * theta[traced.ray])
            np.minimum.at(found, traced.ray, -(place * turn).real)
        return found

    rays = np.stack([low, middle, high])[:, which]
    depths = np.stack([depth(np.arange(len(which)), theta) for theta in rays])
    return -dips(depth, rays, depths, np.full(len(which), -np.inf), STEPS)[1]
