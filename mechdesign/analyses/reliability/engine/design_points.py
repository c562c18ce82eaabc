"""Design points: where each limit is broken nearest to the mean, found from many starts at once.

[Hasofer & Lind, Exact and invariant second-moment code format, 1974; Zhang & Der Kiureghian, Two improved algorithms
for reliability analysis, 1995, whose merit function makes the iteration converge.]
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.reliability.engine.problem import Floats, Problem, failed

Ints = NDArray[np.intp]

# Standard deviations of the samples that starts are taken from, how many of each, and starts of one limit.
SPREADS = (1.0, 1.5, 2.0, 3.0, 4.5)
SAMPLES, STARTS = 160, 8
EXPLORED = len(SPREADS) * SAMPLES
HALVINGS, ITERATIONS = 10, 30
# Rounds in which ends of the margins come nearer, by so many points at least about each, of this spread.
WALKS, AROUND, NEAR = 3, 60, 0.5
# Fractions of a step that are tried where the whole of it does not improve.
FRACTIONS = np.array([0.5, 0.25, 0.0625])
# A point is a design point where a step is shorter than this, or nothing improves, and the margin this small.
SHORT, ZERO = 5e-3, 1e-2
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
    seen : ndarray, shape (dimension, n)
        Failures among the samples of all spreads.
    """

    u: Floats
    limit: Ints
    normal: Floats
    seen: Floats

    @property
    def distance(self) -> Floats:
        """Distance of the limit's tangent from the mean, negative where the mean itself fails, shape (points,)."""
        return np.asarray((self.u * self.normal).sum(axis=1))


def find(problem: Problem, rng: np.random.Generator) -> DesignPoints:
    """Look for the design points of all limits."""
    d = problem.dimension
    near = 0.1 * rng.standard_normal((d, 1)) / np.sqrt(d)
    u = np.concatenate([near, *(spread * rng.standard_normal((d, SAMPLES)) for spread in SPREADS)], axis=1)
    margins = problem.margins(u)
    limit, starts = _starts(problem, u, margins)
    ends = starts[:, limit < 0]
    limits = np.arange(len(margins))
    starts = np.concatenate([np.repeat(near, len(limits), axis=1), starts[:, limit >= 0]], axis=1)
    scale = np.abs(problem.margins(np.zeros((d, 1))))[:, 0]
    scale = np.where((scale > 0) & np.isfinite(scale), scale, 1.0)
    found = _descend(problem, np.concatenate([limits, limit[limit >= 0]]), starts, scale)
    ends = _nearer(problem, ends, rng)
    length = np.linalg.norm(ends, axis=0)
    points = _distinct(
        np.concatenate([found[0], ends], axis=1),
        np.concatenate([found[1], np.full(ends.shape[1], -1)]),
        np.concatenate([found[2], ends / np.where(length > 0, length, 1.0)], axis=1),
    )
    return replace(points, seen=u[:, failed(margins)])


def _starts(problem: Problem, u: Floats, margins: Floats) -> tuple[Ints, Floats]:
    """Limits (-1 where margins end) and their edges towards samples, shape (dimension, starts), that lie far apart.

    A limit may be reached in several directions.
    """
    nowhere = np.isnan(margins).any(axis=0)
    broken = [(margin < 0) & ~nowhere for margin in margins]
    chosen = [_apart(u[:, beyond]) for beyond in (*broken, nowhere)]
    limit = np.repeat([*range(len(margins)), -1], [part.shape[1] for part in chosen])
    return limit, _edges(problem, limit, np.concatenate(chosen, axis=1))


def _edges(problem: Problem, limit: Ints, far: Floats) -> Floats:
    """Where limits (-1: where margins end) are on the rays to points beyond them, shape (dimension, points)."""
    low, high = np.zeros(len(limit)), np.ones(len(limit))
    for _ in range(HALVINGS if len(limit) else 0):
        middle = 0.5 * (low + high)
        found = problem.margins(middle * far)
        ended = np.isnan(found).any(axis=0)
        out = np.where(limit < 0, ended, ended | (found[limit, np.arange(len(limit))] < 0))
        high, low = np.where(out, middle, high), np.where(out, low, middle)
    return np.asarray(high * far)


def _nearer(problem: Problem, ends: Floats, rng: np.random.Generator) -> Floats:
    """Ends of the margins nearer to the mean, shape (dimension, ends).

    Where margins end there is no slope: the direction that tells apart the points about an end that have margins and
    that have none stands for it.
    """
    d, count = ends.shape
    about = max(AROUND, 4 * d)
    for _ in range(WALKS if count else 0):
        shift = rng.standard_normal((d, count, about))
        found = problem.margins((ends[:, :, None] + NEAR * shift).reshape(d, -1))
        gone = np.isnan(found).any(axis=0).reshape(count, about)
        steep = np.einsum("dca,ca->dc", shift, gone - gone.mean(axis=1, keepdims=True))
        size = (steep * steep).sum(axis=0)
        # A little farther than where the tangent plane is nearest.
        far = 1.25 * steep * (steep * ends).sum(axis=0) / np.where(size > 0, size, 1.0)
        beyond = np.isnan(problem.margins(far)).any(axis=0)
        near = _edges(problem, np.full(count, -1), far)
        ends = np.where(beyond & ((near * near).sum(axis=0) < (ends * ends).sum(axis=0)), near, ends)
    return ends


def _apart(u: Floats) -> Floats:
    """The nearest point, and one after the other the one whose direction is farthest from those chosen."""
    if not u.shape[1]:
        return u
    size = np.linalg.norm(u, axis=0)
    directions = u / np.where(size > 0, size, 1.0)
    chosen = [int(np.argmin(size))]
    cosine = directions[:, chosen[0]] @ directions
    while len(chosen) < STARTS and cosine.min() < ALIKE:
        chosen.append(int(np.argmin(cosine)))
        cosine = np.maximum(cosine, directions[:, chosen[-1]] @ directions)
    return u[:, chosen]


def _descend(problem: Problem, limit: Ints, u: Floats, scale: Floats) -> tuple[Floats, Ints, Floats]:
    """Step all starts, shape (dimension, starts), to the nearest point of their limits: points, limits, normals."""
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
        if not known.any():
            continue
        lanes, g, slope, size = lanes[known], g[known], slope[:, known], size[known]
        at = u[:, lanes]
        step = slope * (((slope * at).sum(axis=0) - g) / size) - at
        normal[:, lanes] = -slope / np.sqrt(size)
        weight = 2 * np.linalg.norm(at, axis=0) / np.sqrt(size) + 1.0
        before = 0.5 * (at**2).sum(axis=0) + weight * np.abs(g)
        trial = at + step
        merit = _merit(problem, trial, limit[lanes], scale, weight)
        worse = np.flatnonzero(~(merit < before))
        if worse.size:
            shorter = at[:, None, worse] + FRACTIONS[:, None] * step[:, None, worse]
            often = np.tile(worse, len(FRACTIONS))
            merits = _merit(problem, shorter.reshape(len(at), -1), limit[lanes[often]], scale, weight[often])
            merits = merits.reshape(len(FRACTIONS), -1)
            best, k = np.argmin(merits, axis=0), np.arange(len(worse))
            merit[worse], trial[:, worse] = merits[best, k], shorter[:, best, k]
        done = (np.linalg.norm(step, axis=0) < SHORT * (1 + np.linalg.norm(at, axis=0))) | ~(merit < before)
        good[lanes[done]] = np.abs(g[done]) < ZERO
        active[lanes[done]] = False
        better = merit < before
        u[:, lanes[better]] = trial[:, better]
        # Starts that have come together go on as one.
        for i, lane in enumerate(lanes):
            others = lanes[:i][active[lanes[:i]] | good[lanes[:i]]]
            if active[lane] and any(limit[lane] == limit[o] and _alike(u[:, lane], u[:, o]) for o in others):
                active[lane] = False
    # Those that came near in the time that they had are good enough to sample about.
    lanes = np.flatnonzero(active)
    if lanes.size:
        margins = problem.margins(u[:, lanes])
        good[lanes] = np.abs(margins[limit[lanes], np.arange(len(lanes))] / scale[limit[lanes]]) < ZERO
    return u[:, good], limit[good], normal[:, good]


def _merit(problem: Problem, u: Floats, limit: Ints, scale: Floats, weight: Floats) -> Floats:
    """What the iteration makes smaller, shape (n,); infinite where there are no margins."""
    value = problem.margins(u)[limit, np.arange(len(limit))] / scale[limit]
    merit = 0.5 * (u**2).sum(axis=0) + weight * np.abs(value)
    return np.asarray(np.where(np.isfinite(merit), merit, np.inf))


def _distinct(u: Floats, limit: Ints, normal: Floats) -> DesignPoints:
    """Nearest first, each place once."""
    order = np.argsort((u * normal).sum(axis=0), kind="stable")
    kept: list[int] = []
    for k in order.tolist():
        if len(kept) == MOST:
            break
        if not any(_alike(u[:, k], u[:, j]) and normal[:, k] @ normal[:, j] > ALIKE for j in kept):
            kept.append(k)
    return DesignPoints(u.T[kept], limit[kept], normal.T[kept], u[:, :0])


def _alike(one: Floats, other: Floats) -> bool:
    gap = float(np.linalg.norm(one - other))
    return gap < 0.3 or gap < 0.2 * float(np.linalg.norm(one))


def explored_weights(u: Floats) -> Floats:
    """Standard normal density over that of the samples of all spreads, at `u` of shape (dimension, n): shape (n,)."""
    half, d = 0.5 * (u * u).sum(axis=0), len(u)
    logs = np.stack([half * (1 - spread**-2) - d * np.log(spread) for spread in SPREADS])
    most = logs.max(axis=0, initial=-np.inf)
    return np.asarray(len(SPREADS) * np.exp(-most) / np.exp(logs - most).sum(axis=0))
