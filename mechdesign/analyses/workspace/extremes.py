"""Extremes over a range of where rays cross a region's boundary, each by Newton's method on what is active there.

At an extreme inside the range one margin m and its slope along the range vanish (the boundary is an envelope), or two
margins do. Both are two equations in radius and value.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.workspace.rays import Floats, Ints

# Margins (margins, n) of lanes at radii and values.
Margins = Callable[[Ints, Floats, Floats], Floats]
STEPS = 12
# Steps of differences: of the reach, and of the step between two values.
STEP = (1e-5, 1e-3)
# Met where a step is smaller than this (of reach and of the step between two values).
MET = (1e-13, 1e-8)
# Other margins may be so far below zero (of their size) where an end is called one of the region.
BELOW = 1e-9
# Rounding of radii (of the reach).
SLACK = 1e-12
# Places of differences, in steps of radius and value.
STENCIL = ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1))


@dataclass(frozen=True, eq=False)
class Starts:
    """Ends at samples of the range that are to be improved, all of shape (n,).

    Parameters
    ----------
    radius, value : ndarray
    label, beside : ndarray of int
        The margin that is zero, and the one that is zero at the sample on either side, shape (2, n); -1 if unknown.
    outwards : ndarray
        +1 where the largest radius is sought, -1 where the smallest one is.
    reach : ndarray
    low, high, step : float
        The range, and the step between values.
    """

    radius: Floats
    value: Floats
    label: Ints
    beside: Ints
    outwards: Floats
    reach: Floats
    low: float
    high: float
    step: float


def improved(margins: Margins, at: Starts, count: int, every: bool) -> tuple[Floats, Floats, Ints, Ints]:
    """Radius and value of the extreme near each start, its label (see `Endings`), and the starts without one.

    Parameters
    ----------
    every : bool
        Whether other margins may be negative there: a stretch outside the region is looked at.
    """
    n = len(at.radius)
    radius, value, label = at.radius.copy(), at.value.copy(), at.label.copy()
    tiny = 1e-9 * at.step
    lower, upper = value - at.low <= tiny, at.high - value <= tiny
    label[lower] += count
    label[upper] += 2 * count
    slope = _slope(margins, np.arange(n), at) * at.outwards
    with np.errstate(invalid="ignore"):
        fixed = (lower & ~(slope > 0)) | (upper & ~(slope < 0))
    left = np.flatnonzero(~fixed)
    label[left] = at.label[left]
    ahead = np.where(slope > 0, 1, 0)
    worst = np.full(n, -1)
    for attempt in range(1 if every else 3):
        if not left.size:
            break
        mine = at.label[left]
        # First the envelope, then a corner with the margin of the sample ahead, then with the one that was negative.
        beside = at.beside[ahead[left], left]
        known = (attempt == 1) & (beside >= 0) & (beside != mine)
        other = mine if attempt == 0 else np.where(known, beside, worst[left])
        r, v, good = _newton(margins, left, mine, other, at)
        good &= (np.abs(v - at.value[left]) <= at.step + tiny) & (v >= at.low - tiny) & (v <= at.high + tiny)
        v = np.clip(v, at.low, at.high)
        good &= at.outwards[left] * (r - at.radius[left]) >= -SLACK * at.reach[left]
        if not every:
            found, lane = margins(left, r, v), np.arange(len(left))
            size = np.where(np.isfinite(found), np.abs(found), 0.0).max(axis=0)
            found = np.where(np.isnan(found), -np.inf, found)
            found[mine, lane] = found[other, lane] = np.inf
            worst[left] = found.argmin(axis=0)
            good &= found.min(axis=0) >= -BELOW * size
        done = left[good]
        radius[done], value[done] = r[good], v[good]
        one, two = np.minimum(mine, other)[good], np.maximum(mine, other)[good]
        label[done] = np.where(one == two, one, (3 + one) * count + two)
        left = left[~good]
    return radius, value, label, left


def _slope(margins: Margins, lanes: Ints, at: Starts) -> Floats:
    """Slope of the radius over the range, following the margin that is zero."""
    lane = np.arange(len(lanes))
    h, k = STEP[0] * at.reach, STEP[1] * at.step
    one = [margins(lanes, at.radius + i * h, at.value + j * k)[at.label, lane]
           for i, j in ((1, 0), (-1, 0), (0, 1), (0, -1))]  # fmt: skip
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(-((one[2] - one[3]) / k) / ((one[0] - one[1]) / h))


def _newton(
    margins: Margins, lanes: Ints, mine: Ints, other: Ints, at: Starts
) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Radius and value where two margins are zero, or one and its slope over the range; and whether that is met."""
    r, v = at.radius[lanes].copy(), at.value[lanes].copy()
    good, left = np.zeros(len(lanes), dtype=bool), np.arange(len(lanes))
    # Whether a radius is extreme: its bend over the range, or forces of both margins that hold it (multipliers).
    extreme = np.zeros(len(lanes), dtype=bool)
    reach = at.reach[lanes]
    for _ in range(STEPS):
        if not left.size:
            break
        h, k, lane = STEP[0] * reach[left], STEP[1] * at.step, np.arange(len(left))

        place = np.stack([r[left] + i * h for i, _ in STENCIL]), np.stack([v[left] + j * k for _, j in STENCIL])
        found = margins(lanes[left], *place)
        m, p = found[mine[left], :, lane].T, found[other[left], :, lane].T
        envelope = (mine == other)[left]
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            g1, g1r, g1v = m[0], (m[1] - m[2]) / (2 * h), (m[3] - m[4]) / (2 * k)
            mixed = (m[5] + m[6] + 2 * m[0] - m[1] - m[2] - m[3] - m[4]) / (2 * h * k)
            bend = (m[3] + m[4] - 2 * m[0]) / k**2
            g2 = np.where(envelope, g1v, p[0])
            g2r = np.where(envelope, mixed, (p[1] - p[2]) / (2 * h))
            g2v = np.where(envelope, bend, (p[3] - p[4]) / (2 * k))
            det = g1r * g2v - g1v * g2r
            dr, dv = -(g1 * g2v - g2 * g1v) / det, -(g1r * g2 - g2r * g1) / det
            out = at.outwards[lanes[left]]
            corner = (out * g2v / det <= 0) & (out * g1v / det >= 0)
            extreme[left] = np.where(envelope, out * bend / g1r > 0, corner)
            short = np.minimum(1.0, at.step / np.abs(dv))
            dr, dv = dr * short, dv * short
        usable = np.isfinite(dr) & np.isfinite(dv)
        left, dr, dv = left[usable], dr[usable], dv[usable]
        r[left] += dr
        v[left] += dv
        met = (np.abs(dr) <= MET[0] * reach[left]) & (np.abs(dv) <= MET[1] * at.step)
        good[left[met]] = True
        left = left[~met]
    return r, v, good & extreme
