"""The smallest axis-parallel rectangle around each region."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.ground.numerics.roots import dips
from mechdesign.region.intervals import SAME_ROOT, Intervals
from mechdesign.region.panels import Panels
from mechdesign.region.rays import Scanned

# Rays through the ends of panels may meet an interval that rounding has closed (a cusp): it still bounds the region.
SLACK = 1e-9
# Rays beside the ends of panels, as parts of half a panel.
BESIDE = np.array([0.0, 1e-8, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2])
# Between two rays a curve rises above the farther one by this part of their difference at most.
RISE = 0.5
# Rises below this part of the reach are not climbed.
FLAT = 0.1 * SAME_ROOT
# A tip is recognised by a fall on its far side that is so many times the fall on the near side. Both are measured at
# this part of the angle to the end of the panel.
SHARP, TOWARDS = 4.0, 0.5
# Largest error of a tip's place, in lengths of the way to it from the last ray that meets it.
TIP = 2.0
# Directions in which the rectangle around a region is measured: right, left, up, down.
SIDES = np.array([1, -1, -1j, 1j])
EVERY: Any = slice(None)


def bounding_box(panels: Panels, boundary: tuple[Ints, Floats, Intervals]) -> tuple[Floats, Floats]:
    """Areas of the rectangles and their errors, shape (designs,) [S1, eq. 26]; 0 where the region is empty.

    The farthest place in a direction is a corner or cusp at the end of a panel, where rays are traced at several
    angles beside the end, or lies on a smooth curve, where parabolas through boundary points lead to it. A cusp may be
    too thin to be met at its tip, which is then at the end of the line through the places met beside it.
    """
    count, (design, theta, met) = len(panels.closes), boundary
    width = 0.5 * (panels.high - panels.low)
    ends = np.stack([panels.low + width * BESIDE[:, None], panels.high - width * BESIDE[:, None]], axis=1)
    owner = np.broadcast_to(panels.design, ends.shape).ravel()
    traced = panels.trace(owner, ends.ravel(), SLACK)
    beside = _farthest(panels.designs, ends.ravel(), traced)
    some = np.flatnonzero(met.counts)
    within = _farthest(panels.designs, theta, met)[:, some]
    design, theta = np.concatenate([owner, design[some]]), np.concatenate([ends.ravel(), theta[some]])
    away, at_end = np.concatenate([beside, within], axis=1), np.arange(len(design)) < 2 * len(width)
    order = np.lexsort((theta, design))
    # Neighbouring panels end at one ray.
    order = order[np.append(True, (np.diff(design[order]) > 0) | (np.diff(theta[order]) > 0))]
    design, theta, away, at_end = design[order], theta[order], away[:, order], at_end[order]
    best = np.full((2, len(SIDES), count), -np.inf)
    np.maximum.at(best, (EVERY, EVERY, design), away)
    same = (design[2:] == design[:-2]) & ~at_end[1:-1]
    before, here, after = away[:, :-2], away[:, 1:-1], away[:, 2:]
    fall = np.maximum(*(np.where(np.isfinite(other), here - other, 0.0) for other in (before, after)))
    top = same & (here >= before) & (here >= after) & (here + RISE * fall >= best[0][:, design[1:-1]])
    # Where a curve cannot rise by more than two ends of an interval that are one, there is nothing to climb.
    top &= RISE * fall > FLAT * panels.reach[design[1:-1]]
    side, middle = np.nonzero(top)
    if len(side):
        near = middle + np.arange(3)[:, None]
        lane = design[near[1]]
        np.maximum.at(best, (EVERY, side, lane), _climb(panels, side, lane, theta[near], away[side, near]))
    # A tip that was not climbed to may lie as far as the lines through rays on either side of it say.
    beside, step = beside.reshape(len(SIDES), len(BESIDE), -1), np.diff(BESIDE)[:, None]
    here = beside[:, 1:-1]
    nearer, farther = here - beside[:, :-2], here - beside[:, 2:]
    more = np.minimum(nearer * step[1:] / step[:-1], farther * step[:-1] / step[1:])
    more = np.where((more > 0) & np.isfinite(more), more, 0.0)
    np.maximum.at(best[1], (EVERY, owner[: 2 * len(width)]), (here + more).max(axis=1))
    size = (best[:, 0] + best[:, 1]) * (best[:, 2] + best[:, 3])
    area, most = np.where(np.isfinite(size), size, 0.0)
    return area, most - area + SAME_ROOT * area


def _farthest(designs: Scanned, theta: Floats, traced: Intervals) -> Floats:
    """How far rays reach in each direction of the rectangle, shape (directions, rays); -inf where they meet nothing."""
    places = designs.about + traced.by_ray(traced.inner, traced.outer) * np.exp(1j * theta)
    away = (places * SIDES[:, None, None, None]).real
    return np.asarray(np.fmax.reduce(away, axis=(1, 2), initial=-np.inf))


def _climb(panels: Panels, side: Ints, design: Ints, theta: Floats, away: Floats) -> Floats:
    """Largest distances in some directions, between the outer two of three rays each, shape (3, n), and their bounds.

    Of shape (2, n). Where rays nearer to the end of a panel meet less there is a tip: the line through rays beyond
    tells its place.
    """

    def depth(lane: Ints, angle: Floats) -> Floats:
        away_at = _farthest(panels.designs, angle, panels.trace(design[lane], angle, SLACK))
        return np.asarray(-away_at[side[lane], np.arange(len(lane))])

    every = np.arange(len(side))
    place, low = dips(depth, theta, -away, np.full(len(side), -np.inf))
    ends = np.sort(np.concatenate([panels.design + 1j * panels.low, panels.design + 1j * panels.high]))
    after = np.clip(np.searchsorted(ends, design + 1j * place), 1, len(ends) - 1)
    gaps = np.stack([ends[after - 1].imag, ends[after].imag]) - place
    # The tip may be at the farther of the two ends.
    nearer, beside, farther = (
        np.stack([-depth(every, place + part * gap) for gap in gaps]) for part in (TOWARDS, -TOWARDS, -1.0)
    )
    tip = (-low - nearer > SHARP * np.abs(-low - beside)) & np.isfinite(farther)
    tip &= np.abs(gaps) < theta[2] - theta[0]
    more = np.where(tip, np.maximum(-low - farther, 0.0), 0.0).max(axis=0)
    return np.stack([-low + more, -low + (1 + TIP) * more])
