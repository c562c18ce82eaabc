"""How far rays reach over a range: extremes of radius of what is inside, in the plane of radius and value of the range.

At one radius the values that serve are intervals (a cut). Farther out along the ray an interval becomes shorter until
it vanishes: at an extreme, where one margin and its slope along the range are zero (the boundary is an envelope), or
where the two margins are that end the interval (the ends of the range are margins, too). So a cut tells which two
equations in radius and value have the extreme as their solution, and Newton's method solves them; cuts farther out
tell where it has not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.workspace.rays import Floats, Ints

# Margins (margins + 2, n) of rays at radii and values; the last two are zero at the lower and upper end of the range.
Margins = Callable[[Ints, Floats, Floats], Floats]
# Intervals of the range at radii: ray, ends of shape (2, n), and the margins that are zero there.
Cut = Callable[[Ints, Floats], tuple[Ints, Floats, Ints]]
STEPS, ROUNDS, OPEN = 12, 14, 3
# Steps of differences: of the reach, and of the step between two values.
STEP = (1e-5, 1e-3)
# A step of Newton's method is no longer than this (of reach, and steps between values).
LONGEST = (0.1, 2.0)
# Met where a step is smaller than this (of reach and of the step between two values).
MET = (1e-13, 1e-8)
# Other margins may be so far below zero (of their size) where an end is called one of the region.
BELOW = 1e-9
# Rounding of radii (of the reach).
SLACK = 1e-12
# The first cut is so far inside (of the reach, and of what is known to be inside), a later one so far beyond.
INSET, WITHIN, BEYOND = 1e-8, 0.25, 1e-9
# Places of differences, in steps of radius and value.
STENCIL = ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1))


@dataclass(frozen=True, eq=False)
class Starts:
    """Ends at samples of the range that are to be moved outwards, all of shape (n,).

    Parameters
    ----------
    radius, value : ndarray
    width : ndarray
        How far it is inside from there.
    pair : ndarray of int, shape (2, n)
        The margin that is zero, and that of the range's end; -1 where the sample is not at one.
    limit : ndarray
        Radius beyond which it is inside again, or nothing is looked for.
    outwards : ndarray
        +1 where the largest radius is sought, -1 where the smallest one is.
    reach : ndarray
    step : float
        Between two values.
    """

    radius: Floats
    value: Floats
    width: Floats
    pair: Ints
    limit: Floats
    outwards: Floats
    reach: Floats
    step: float


def extended(margins: Margins, cut: Cut, at: Starts, alone: bool) -> tuple[Floats, Floats, Ints]:
    """Radius and value of the extreme beyond each start, and the two margins that are zero there, shape (2, n).

    The margins are -1 where none was found: then the radius is the farthest that is known to be inside.

    Parameters
    ----------
    alone : bool
        Whether margins other than the two may be negative.
    """
    n, out = len(at.radius), at.outwards
    radius, value, pair = at.radius.copy(), at.value.copy(), at.pair.copy()
    # Known to be inside; known not to be, or the limit; how often nothing has told where to look.
    inside, outside, shut, lost = radius.copy(), at.limit.copy(), np.zeros(n, dtype=bool), np.zeros(n)
    # Whether an extreme is known, just beyond which is looked.
    known, left = np.zeros(n, dtype=bool), np.arange(n)
    probe = radius + out * BEYOND * at.reach
    for attempt in range(ROUNDS):
        if not left.size:
            break
        lane, ends, names = cut(left, probe[left])
        ray = left[lane]
        hit = np.bincount(lane, minlength=len(left)) > 0
        met, missed = left[hit], left[~hit]
        inside[met], outside[missed], shut[missed] = probe[met], probe[missed], True
        done = np.zeros(n, dtype=bool)
        done[missed] = known[missed]
        if attempt == 0:
            # Where the range does not end there is an extreme as near as that.
            done[missed] = (pair[:, missed] >= 0).all(axis=0)
            inside[missed] -= out[missed] * np.minimum(INSET * at.reach, WITHIN * at.width)[missed]
        known[met] = False
        r, v, solved, extreme = _newton(margins, ray, names, probe[ray], ends.mean(axis=0), at)
        solved &= np.abs(v - ends.mean(axis=0)) <= at.step + 2 * (ends[1] - ends[0])
        # Perhaps beyond where a cut has met nothing: what is narrow is easily missed.
        solved &= (out[ray] * (r - probe[ray]) >= -SLACK * at.reach[ray]) & (out[ray] * (at.limit[ray] - r) >= 0)
        clear = _clear(margins, ray, names, r, v, alone)
        best = _farthest(ray, out[ray] * r, solved & clear)
        known[ray[best]] = True
        radius[ray[best]], value[ray[best]], pair[:, ray[best]] = r[best], v[best], names[:, best]
        done[np.setdiff1d(ray[best], ray[~(solved & clear & extreme)])] = True
        # Next just beyond what was found: it is the end if nothing is there. Or half the way to what another margin
        # forbids, or to what is not known.
        ahead = np.where(clear, r + out[ray] * BEYOND * at.reach[ray], 0.5 * (probe[ray] + r))
        next_one = _farthest(ray, out[ray] * ahead, solved)
        probe[left] = 0.5 * (inside + outside)[left]
        probe[ray[next_one]] = ahead[next_one]
        if attempt == 0:
            probe[missed] = inside[missed]
        lost[np.setdiff1d(met, ray[next_one])] += 1
        # Nothing ends there: it goes on as far as is looked.
        open_ended = (lost >= OPEN) & ~shut
        inside[open_ended], known[open_ended] = at.limit[open_ended], False
        done |= open_ended | (np.abs(outside - inside) <= SLACK * at.reach)
        unknown = np.flatnonzero(done & ~known & (attempt > 0))
        radius[unknown], pair[:, unknown] = inside[unknown], -1
        left = left[~done[left]]
    unknown = left[~known[left]]
    radius[unknown], pair[:, unknown] = inside[unknown], -1
    return radius, value, pair


def _farthest(ray: Ints, place: Floats, use: NDArray[np.bool_]) -> Ints:
    """Which is farthest of those to be used of each ray."""
    order = np.lexsort((place, ray))
    order = order[use[order]]
    last: Ints = order[np.append(np.diff(ray[order]) != 0, True)[: len(order)]]
    return last


def _clear(margins: Margins, ray: Ints, names: Ints, r: Floats, v: Floats, alone: bool) -> NDArray[np.bool_]:
    """Whether no other margin is negative; if they may be, those of the range's ends only."""
    found, lane = margins(ray, r, v), np.arange(len(ray))
    size = np.where(np.isfinite(found), np.abs(found), 0.0).max(axis=0, initial=0.0)
    found = np.where(np.isnan(found), -np.inf, found)
    found[names[0], lane] = found[names[1], lane] = np.inf
    return np.asarray(found[-2 if alone else 0 :].min(axis=0, initial=np.inf) >= -BELOW * size)


def _newton(
    margins: Margins, rays: Ints, names: Ints, radius: Floats, value: Floats, at: Starts
) -> tuple[Floats, Floats, NDArray[np.bool_], NDArray[np.bool_]]:
    """Radius and value where two margins are zero, or one and its slope over the range; if met; if it is extreme."""
    r, v = radius.copy(), value.copy()
    good, left = np.zeros(len(rays), dtype=bool), np.arange(len(rays))
    # Whether a radius is extreme: its bend over the range, or forces of both margins that hold it (multipliers).
    extreme = np.zeros(len(rays), dtype=bool)
    reach = at.reach[rays]
    for _ in range(STEPS):
        if not left.size:
            break
        h, k, lane = STEP[0] * reach[left], STEP[1] * at.step, np.arange(len(left))
        place = np.stack([r[left] + i * h for i, _ in STENCIL]), np.stack([v[left] + j * k for _, j in STENCIL])
        found = margins(rays[left], *place)
        m, p = (found[name[left], :, lane].T for name in names)
        envelope = names[0, left] == names[1, left]
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            g1, g1r, g1v = m[0], (m[1] - m[2]) / (2 * h), (m[3] - m[4]) / (2 * k)
            mixed = (m[5] + m[6] + 2 * m[0] - m[1] - m[2] - m[3] - m[4]) / (2 * h * k)
            bend = (m[3] + m[4] - 2 * m[0]) / k**2
            g2 = np.where(envelope, g1v, p[0])
            g2r = np.where(envelope, mixed, (p[1] - p[2]) / (2 * h))
            g2v = np.where(envelope, bend, (p[3] - p[4]) / (2 * k))
            det = g1r * g2v - g1v * g2r
            dr, dv = -(g1 * g2v - g2 * g1v) / det, -(g1r * g2 - g2r * g1) / det
            out = at.outwards[rays[left]]
            corner = (out * g2v / det <= 0) & (out * g1v / det >= 0)
            extreme[left] = np.where(envelope, (out * g1r < 0) & (bend < 0), corner)
            short = np.minimum(1.0, LONGEST[1] * at.step / np.abs(dv))
            short = np.minimum(short, LONGEST[0] * reach[left] / np.abs(dr))
            dr, dv = dr * short, dv * short
        usable = np.isfinite(dr) & np.isfinite(dv)
        left, dr, dv = left[usable], dr[usable], dv[usable]
        r[left] += dr
        v[left] += dv
        met = (np.abs(dr) <= MET[0] * reach[left]) & (np.abs(dv) <= MET[1] * at.step)
        good[left[met]] = True
        left = left[~met]
    return r, v, good, extreme
