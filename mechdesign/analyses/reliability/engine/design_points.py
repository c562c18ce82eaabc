"""Design points: where each limit is broken nearest to the mean, found from many starts at once.

[Hasofer & Lind, Exact and invariant second-moment code format, 1974; Zhang & Der Kiureghian, Two improved algorithms
for reliability analysis, 1995, whose merit function makes the iteration converge.]
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.reliability.engine.problem import Floats, Problem

Ints = NDArray[np.intp]

# Standard deviations of the samples that starts are taken from, how many of each, and of how many failures.
SPREADS = (1.0, 1.5, 2.0, 3.0, 4.5)
SAMPLES, STARTS = 160, 3
ITERATIONS = 40
# Fractions of a step that are tried where the whole of it does not improve.
FRACTIONS = np.array([0.5, 0.25, 0.0625])
# A point is a design point where a step is shorter than this, or nothing improves, and the margin this small.
SHORT, ZERO = 1e-3, 1e-3
# Two points in directions nearer than this (cosine), at like distances, are one.
ALIKE = 0.95
MOST = 24


@dataclass(frozen=True, eq=False)
class DesignPoints:
    """Points where a limit is broken, nearest to the mean, nearest first.

    Parameters
    ----------
    u : ndarray, shape (points, dimension)
    limit : ndarray of int, shape (points,)
        Which limit; -1 where the margins end.
    normal : ndarray, shape (points, dimension)
        Unit vectors into the failure.
    """

    u: Floats
    limit: Ints
    normal: Floats

    @property
    def distance(self) -> Floats:
        """Distance of the limit's tangent from the mean, negative where the mean itself fails, shape (points,)."""
        return np.asarray((self.u * self.normal).sum(axis=1))


def find(problem: Problem, rng: np.random.Generator) -> DesignPoints:
    """Look for the design points of all limits."""
    limits, u, lost = _starts(problem, rng)
    scale = np.abs(problem.margins(np.zeros((problem.dimension, 1))))[:, 0]
    scale = np.where((scale > 0) & np.isfinite(scale), scale, 1.0)
    found = _descend(problem, limits, u, scale)
    # Where margins end there is no slope: the end is bracketed along the ray, and its normal taken to be the ray's.
    ends = _ends(problem, lost)
    points = np.concatenate([found.u, ends])
    limit = np.concatenate([found.limit, np.full(len(ends), -1, dtype=np.intp)])
    length = np.linalg.norm(ends, axis=1, keepdims=True)
    normal = np.concatenate([found.normal, ends / np.where(length > 0, length, 1.0)])
    return _distinct(DesignPoints(points, limit, normal))


def _starts(problem: Problem, rng: np.random.Generator) -> tuple[Ints, Floats, Floats]:
    """Limit and place of each start, and places without margins.

    Of every limit a point by the mean, and the failures that are found nearest to it by samples of growing spread.
    """
    d = problem.dimension
    near = 0.1 * rng.standard_normal((d, 1)) / np.sqrt(d)
    count = len(problem.margins(near))
    limits, places = [np.arange(count)], [np.repeat(near, count, axis=1)]
    seen = np.zeros(count, dtype=int)
    lost: list[Floats] = []
    for spread in SPREADS:
        u = spread * rng.standard_normal((d, SAMPLES))
        margins = problem.margins(u)
        nowhere = np.any(np.isnan(margins), axis=0)
        order = np.argsort((u**2).sum(axis=0), kind="stable")
        lost += [u[:, k] for k in order[nowhere[order]][: STARTS - len(lost)]]
        for limit in np.flatnonzero(seen < STARTS):
            chosen = order[(margins[limit] < 0)[order]][: STARTS - seen[limit]]
            seen[limit] += len(chosen)
            limits.append(np.full(len(chosen), limit))
            places.append(u[:, chosen])
    return np.concatenate(limits), np.concatenate(places, axis=1), np.array(lost).reshape(-1, d)


def _descend(problem: Problem, limit: Ints, u: Floats, scale: Floats) -> DesignPoints:
    """Step all starts, shape (dimension, starts), to the nearest point of their limits."""
    active = np.ones(len(limit), dtype=bool)
    good = np.zeros(len(limit), dtype=bool)
    normal = np.zeros_like(u)
    for _ in range(ITERATIONS):
        lanes = np.flatnonzero(active)
        if not lanes.size:
            break
        margins, gradients = problem.gradients(u[:, lanes])
        rows, k = limit[lanes], np.arange(len(lanes))
        g, slope = margins[rows, k] / scale[rows], gradients[rows, :, k].T / scale[rows]
        size = (slope**2).sum(axis=0)
        known = np.isfinite(g) & np.isfinite(size) & (size > 0)
        active[lanes[~known]] = False
        lanes, g, slope, size = lanes[known], g[known], slope[:, known], size[known]
        at = u[:, lanes]
        step = slope * (((slope * at).sum(axis=0) - g) / size) - at
        normal[:, lanes] = -slope / np.sqrt(size)
        weight = 2 * np.linalg.norm(at, axis=0) / np.sqrt(size) + 1.0
        before = 0.5 * (at**2).sum(axis=0) + weight * np.abs(g)
        trial, merit = at + step, np.full(len(lanes), np.inf)
        merit[:] = _merit(problem, trial, limit[lanes], scale, weight)
        worse = np.flatnonzero(~(merit < before))
        if worse.size:
            shorter = at[:, worse] + FRACTIONS[:, None, None] * step[:, worse]
            merits = np.stack([_merit(problem, each, limit[lanes[worse]], scale, weight[worse]) for each in shorter])
            best = np.argmin(merits, axis=0)
            merit[worse] = merits[best, np.arange(len(worse))]
            trial[:, worse] = shorter[best, :, np.arange(len(worse))].T
        done = (np.linalg.norm(step, axis=0) < SHORT * (1 + np.linalg.norm(at, axis=0))) | ~(merit < before)
        good[lanes[done]] = np.abs(g[done]) < ZERO
        active[lanes[done]] = False
        u[:, lanes[~done]] = trial[:, ~done]
        # Starts that have come together go on as one.
        for i, lane in enumerate(lanes):
            others = lanes[:i][active[lanes[:i]] | good[lanes[:i]]]
            if active[lane] and any(limit[lane] == limit[o] and _alike(u[:, lane], u[:, o]) for o in others):
                active[lane] = False
    # Those that came near in the time that they had are good enough to sample about.
    lanes = np.flatnonzero(active)
    if lanes.size:
        margins = problem.margins(u[:, lanes])
        good[lanes] = np.abs(margins[limit[lanes], np.arange(len(lanes))] / scale[limit[lanes]]) < 10 * ZERO
    return DesignPoints(u.T[good], limit[good], normal.T[good])


def _merit(problem: Problem, u: Floats, limit: Ints, scale: Floats, weight: Floats) -> Floats:
    """What the iteration makes smaller, shape (n,); infinite where there are no margins."""
    value = problem.margins(u)[limit, np.arange(len(limit))] / scale[limit]
    merit = 0.5 * (u**2).sum(axis=0) + weight * np.abs(value)
    return np.asarray(np.where(np.isfinite(merit), merit, np.inf))


def _ends(problem: Problem, lost: Floats) -> Floats:
    """The first points without margins on the rays to `lost`, shape (points, dimension)."""
    if not len(lost):
        return lost
    low, high = np.zeros(len(lost)), np.ones(len(lost))
    for _ in range(12):
        middle = 0.5 * (low + high)
        nowhere = np.isnan(problem.margins((middle[:, None] * lost).T)).any(axis=0)
        high, low = np.where(nowhere, middle, high), np.where(nowhere, low, middle)
    return np.asarray(high[:, None] * lost)


def _distinct(points: DesignPoints) -> DesignPoints:
    """Nearest first, each place once."""
    order = np.argsort(points.distance, kind="stable")
    kept: list[int] = []
    for k in order.tolist():
        if len(kept) == MOST:
            break
        same = [j for j in kept if _alike(points.u[k], points.u[j]) and points.normal[k] @ points.normal[j] > ALIKE]
        if not same:
            kept.append(k)
    return DesignPoints(points.u[kept], points.limit[kept], points.normal[kept])


def _alike(one: Floats, other: Floats) -> bool:
    gap = float(np.linalg.norm(one - other))
    return gap < 0.3 or gap < 0.2 * float(np.linalg.norm(one))
