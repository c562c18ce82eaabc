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

from mechdesign.analyses.region.breaks import ROOTS, parabola
from mechdesign.numerics.arrays import Flags, Floats, Ints

# Margins (margins + 2, n) of rays at radii and values; the last two are zero at the lower and upper end of the range.
Margins = Callable[[Ints, Floats, Floats], Floats]
# Intervals of the range at radii: ray, ends of shape (2, n), and the margins that are zero there.
Cut = Callable[[Ints, Floats], tuple[Ints, Floats, Ints]]
STEPS, ROUNDS, OPEN = 12, 8, 3
# How much of what is not known is gone into where that is much more than has been gone.
NEARER, SHORT = 4.0, 0.06
# Part of the way to where intervals seem to vanish; so near (of the reach) they do.
SHARE, NARROW = 0.99, 1e-11
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
# Distance from where a margin ends with a square root (of the reach) at which it is looked at: at least and at most.
NEAR = (1e-8, 1e-3)
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
    singular : ndarray of bool, shape (margins + 2,)
        Margins where others end with a square root.
    """

    radius: Floats
    value: Floats
    width: Floats
    pair: Ints
    limit: Floats
    outwards: Floats
    reach: Floats
    step: float
    singular: Flags


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
    # Where a cut was looked at last that had no solution, and how narrow it was there.
    before, breadth = np.full(n, np.nan), np.full(n, np.nan)
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
        wide = _farthest(ray, ends[1] - ends[0], ~np.isin(ray, ray[best]))
        mine, here, width = ray[wide], probe[ray[wide]], (ends[1] - ends[0])[wide]
        # A margin ends with a square root nearby: by how intervals get narrower, quadratically at an envelope.
        width = np.where(names[0, wide] == names[1, wide], width**2, width)
        with np.errstate(invalid="ignore", divide="ignore"):
            top = here + width * (here - before[mine]) / (breadth[mine] - width)
        before[mine], breadth[mine] = here, width
        far = out[mine] * (top - here)
        met_there = (far >= 0) & (far <= NARROW * at.reach[mine])
        done[mine[met_there]] = known[mine[met_there]] = True
        radius[mine[met_there]], value[mine[met_there]] = top[met_there], ends.mean(axis=0)[wide[met_there]]
        pair[:, mine[met_there]] = names[:, wide[met_there]]
        gap, gone = np.abs(outside - inside)[left], np.abs(inside - at.radius)[left]
        share = np.where(shut[left] & (gap > NEARER * gone), SHORT, 0.5)
        probe[left] = inside[left] + out[left] * share * gap
        probe[ray[next_one]] = ahead[next_one]
        towards = (far > 0) & (far < np.abs(outside - inside)[mine])
        probe[mine[towards]] = (here + SHARE * (top - here))[towards]
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


def _farthest(ray: Ints, place: Floats, use: Flags) -> Ints:
    """Which is farthest of those to be used of each ray."""
    order = np.lexsort((place, ray))
    order = order[use[order]]
    last: Ints = order[np.append(np.diff(ray[order]) != 0, True)[: len(order)]]
    return last


def _clear(margins: Margins, ray: Ints, names: Ints, r: Floats, v: Floats, alone: bool) -> Flags:
    """Whether no other margin is negative; if they may be, those of the range's ends only."""
    found, lane = margins(ray, r, v), np.arange(len(ray))
    size = np.where(np.isfinite(found), np.abs(found), 0.0).max(axis=0, initial=0.0)
    found = np.where(np.isnan(found), -np.inf, found)
    found[names[0], lane] = found[names[1], lane] = np.inf
    return np.asarray(found[-2 if alone else 0 :].min(axis=0, initial=np.inf) >= -BELOW * size)


def _newton(
    margins: Margins, rays: Ints, names: Ints, radius: Floats, value: Floats, at: Starts
) -> tuple[Floats, Floats, Flags, Flags]:
    """Radius and value where two margins are zero, or one and its slope over the range; if met; if it is extreme."""
    r, v = radius.copy(), value.copy()
    good, left = np.zeros(len(rays), dtype=bool), np.arange(len(rays))
    # First the one that others end at with a square root.
    swap = at.singular[names[1]] & ~at.singular[names[0]]
    one, two = np.where(swap, names[::-1], names)
    rooted = at.singular[one] & ~at.singular[two] & (two < len(at.singular) - 2)
    # Whether a radius is extreme: its bend over the range, or forces of both margins that hold it (multipliers).
    extreme = np.zeros(len(rays), dtype=bool)
    reach = at.reach[rays]
    for _ in range(STEPS):
        if not left.size:
            break
        h, k, lane = STEP[0] * reach[left], STEP[1] * at.step, np.arange(len(left))
        place = np.stack([r[left] + i * h for i, _ in STENCIL]), np.stack([v[left] + j * k for _, j in STENCIL])
        found = margins(rays[left], *place)
        m, p = (found[name[left], :, lane].T for name in (one, two))
        envelope = (one == two)[left]
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            g1, g1r, g1v = m[0], (m[1] - m[2]) / (2 * h), (m[3] - m[4]) / (2 * k)
            mixed = (m[5] + m[6] + 2 * m[0] - m[1] - m[2] - m[3] - m[4]) / (2 * h * k)
            bend = (m[3] + m[4] - 2 * m[0]) / k**2
            g2 = np.where(envelope, g1v, p[0])
            g2r = np.where(envelope, mixed, (p[1] - p[2]) / (2 * h))
            g2v = np.where(envelope, bend, (p[3] - p[4]) / (2 * k))
            # Of what has a square root where the first is zero: its value there, and its slope in the root.
            root, slope = np.flatnonzero(rooted[left]), np.full(len(left), -1.0)
            if root.size:
                which = left[root]
                curve = r[which] - m[[0, 3, 4]][:, root] / g1r[root]
                near = np.clip(np.abs(g1 / g1r)[root], NEAR[0] * reach[which], NEAR[1] * reach[which])
                values = v[which] + np.array([[0], [1], [-1]]) * k
                end, slope[root] = _at_root(
                    margins, rays[which], (one[which], two[which]), curve, values, near * np.sign(g1r[root])
                )
                g2[root], g2r[root], g2v[root] = end[0], 0.0, (end[1] - end[2]) / (2 * k)
            det = g1r * g2v - g1v * g2r
            dr, dv = -(g1 * g2v - g2 * g1v) / det, -(g1r * g2 - g2r * g1) / det
            out = at.outwards[rays[left]]
            corner = (out * g2v / det <= 0) & (out * g1v / det >= 0) & (slope < 0)
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


def _at_root(
    margins: Margins, rays: Ints, pair: tuple[Ints, Ints], curve: Floats, value: Floats, near: Floats
) -> tuple[Floats, Floats]:
    """What a margin is where another one is zero at radii `curve`, shape (3, n), and its slope in the other's root.

    The slope is of the first of the three, shape (n,).
    """
    lane = np.arange(len(rays))
    found = margins(rays, curve + near * ROOTS[:, None, None], np.broadcast_to(value, (3, *value.shape)))
    leading, led = (np.moveaxis(found[name, :, :, lane], 0, -1) for name in pair)
    end, slope, _ = parabola(np.sqrt(leading), led)
    return end, slope[0]
