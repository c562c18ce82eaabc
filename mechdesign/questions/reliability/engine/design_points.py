"""Design points: the points of each limit that are nearest to the mean, searched from many starts at once.

A random direction (`Problem.circles`) adds no distance. It is turned to where the limit is nearest (against the slope,
if the margin is linear in its cosine and sine), and the nearest point is searched again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from mechdesign.ground.numerics.arrays import Flags, Floats, Ints, evenly
from mechdesign.questions.reliability.engine.descent import alike, descend, sizes
from mechdesign.questions.reliability.engine.problem import LimitStates, failed

# Standard deviations of the explored samples, among which starts are chosen, and the number of samples of each.
SPREADS = (1.0, 1.5, 2.0, 3.0, 4.5)
_SPREAD_SAMPLES = 160
EXPLORED = len(SPREADS) * _SPREAD_SAMPLES
# Most starts for one limit, enough to leave no wide gap on a limit that is a circle about the mean.
_STARTS = 24
# The same with random directions, which have starts of their own, and where margins end, whose tangents are rough.
_FEW_STARTS = 8
# Starts of each limit near the mean with random directions, each with directions of its own.
_DIRECTED_STARTS = 6
# Halvings of a ray on which the edge of failure is searched.
_HALVINGS = 10
# Rounds in which an edge where margins end is moved nearer to the mean; least number of points drawn about it, and
# their standard deviation.
_WALKS = 3
_WALK_POINTS = 60
_WALK_SPREAD = 0.5
# Two normals with a larger cosine between them count as parallel.
_SAME_COSINE = 0.95
MAX_POINTS = 96
# Rounds of searches from failures that lie beyond no tangent. A failure lies beyond one from this part of its distance
# on.
_SEARCHES = 8
_NEARLY = 0.98
# Factor of a design point's distance with which a point is safely beyond it.
_BEYOND = 1.02
# In place of a limit's number: failure of any kind.
_ANY = -1
# Most turns of the directions towards failure, and the distance on the circle below which they have settled.
_TURNS = 6
_NO_TURN = 0.02
# Design points farther than the nearest one by this many standard deviations are neglected.
_FARTHEST = 4.0
# Distance beyond which nothing fails: the probability is too small a number.
_NEVER = 37.0
# Points, limits, normals and pulls as in `DesignPoints`, the points and normals of shape (dimension, points).
_PointArrays = tuple[Floats, Ints, Floats, Floats]


@dataclass(frozen=True, eq=False)
class DesignPoints:
    """Points of limits that are nearest to the mean, the nearest first.

    Parameters
    ----------
    u : ndarray, shape (points, dimension)
    limit : ndarray of int, shape (points,)
        Number of the limit; -1 where it has no slope, or the margins end.
    normal : ndarray, shape (points, dimension)
        Unit vectors towards failure; zero where the directions alone decide.
    pull : ndarray, shape (points, directions, 2)
        Directions in which the limit is nearest, with the concentration of the failures about them as their length.
    failures : ndarray, shape (dimension, n)
        Failures among the explored samples.
    always : bool
        Whether all explored samples break a limit that has no design point.
    """

    u: Floats
    limit: Ints
    normal: Floats
    pull: Floats
    failures: Floats
    always: bool

    @property
    def distance(self) -> Floats:
        """Distance of the limit's tangent from the mean, negative where the mean itself fails, shape (points,)."""
        return np.asarray((self.u * self.normal).sum(axis=1))

    @property
    def near(self) -> Flags:
        """Which points are not farther than the nearest one by more than `_FARTHEST`."""
        return np.asarray(self.distance <= self.distance.min(initial=np.inf) + _FARTHEST)


def find(problem: LimitStates, rng: np.random.Generator) -> DesignPoints:
    """Design points of all limits; the search is repeated from failures that lie beyond no tangent so far."""
    d = problem.dimension
    near = problem.draw(rng, _DIRECTED_STARTS if len(problem.circles) else 1, 0.1 / np.sqrt(d))
    u = np.concatenate([near, _explored(problem, rng)], axis=1)
    margins = problem.margins(u)
    limit, starts = _starts(problem, u, margins)
    ends = starts[:, limit < 0]
    limits = np.arange(len(margins))
    starts = np.concatenate([np.tile(near, len(limits)), starts[:, limit >= 0]], axis=1)
    limit = np.concatenate([np.repeat(limits, near.shape[1]), limit[limit >= 0]])
    parts = [_worst(problem, limit, starts, sizes(problem)), _ended(problem, ends, rng)]
    failures, lost = u[:, failed(margins)], np.flatnonzero(~(margins >= 0).any(axis=1))
    points = _distinct(problem, parts, failures, lost)
    for _ in range(0 if len(problem.circles) else _SEARCHES):
        u = np.concatenate([u[:, failed(margins)], _exchanged(problem, points)], axis=1)
        starts = _apart(problem, u[:, ~_explained(points, u)], _STARTS)
        if not starts.shape[1] or len(points.u) == MAX_POINTS:
            break
        starts = _edges(problem, np.full(starts.shape[1], _ANY), starts)
        margins = problem.margins(starts)
        limit = np.argmin(np.nan_to_num(margins, nan=np.inf), axis=0)
        nearest, normal, good = descend(problem, limit, starts, sizes(problem), together=False)
        # Where margins jump, the way to the mean is not along their slope.
        good &= (nearest * normal).sum(axis=0) >= _SAME_COSINE * np.linalg.norm(nearest, axis=0)
        parts.append((nearest[:, good], limit[good], normal[:, good], np.zeros((int(good.sum()), 0, 2))))
        good |= _explained(_distinct(problem, parts, failures, lost), starts)
        parts.append(_ended(problem, starts[:, ~good], rng))
        before, points = points, _distinct(problem, parts, failures, lost)
        if points.near.sum() == before.near.sum():
            break
        u = _explored(problem, rng)
        margins = problem.margins(u)
    return points


def _explored(problem: LimitStates, rng: np.random.Generator) -> Floats:
    """The explored samples: points of all spreads."""
    return np.concatenate([problem.draw(rng, _SPREAD_SAMPLES, spread) for spread in SPREADS], axis=1)


def _exchanged(problem: LimitStates, points: DesignPoints) -> Floats:
    """Failures among design points with two variables exchanged: of parts that are alike either may fail."""
    u = _BEYOND * points.u[points.near]
    first, second = np.triu_indices(problem.dimension, 1)
    point, pair = (index.ravel() for index in np.indices((len(u), len(first))))
    some = evenly(len(point), EXPLORED)
    point, pair, lane = point[some], pair[some], np.arange(len(some))
    u = u[point]
    u[lane, first[pair]], u[lane, second[pair]] = u[lane, second[pair]], u[lane, first[pair]]
    return np.asarray(u.T[:, failed(problem.margins(u.T))] if len(u) else u.T)


def _explained(points: DesignPoints, u: Floats) -> Flags:
    """Which failures `u` of shape (dimension, n) lie beyond the tangent of a design point."""
    return np.asarray((points.normal @ u >= _NEARLY * points.distance[:, None]).any(axis=0))


def _ended(problem: LimitStates, ends: Floats, rng: np.random.Generator) -> _PointArrays:
    """Design points on edges where margins end, moved nearer to the mean without a slope."""
    ends = _nearer(problem, ends, rng)
    at = np.where(problem.is_normal[:, None], ends, 0.0)
    length = np.linalg.norm(at, axis=0)
    count = ends.shape[1]
    normal = at / np.where(length > 0, length, 1.0)
    return ends, np.full(count, _ANY), normal, np.zeros((count, len(problem.circles), 2))


def _starts(problem: LimitStates, u: Floats, margins: Floats) -> tuple[Ints, Floats]:
    """Starts far apart, shape (dimension, starts), on the rays to samples that fail, and their limits.

    The limit is `_ANY` where margins end.
    """
    nowhere = np.isnan(margins).any(axis=0)
    broken = [(margin < 0) & ~nowhere for margin in margins]
    most = _FEW_STARTS if len(problem.circles) else _STARTS
    chosen = [*(_apart(problem, u[:, beyond], most) for beyond in broken), _apart(problem, u[:, nowhere], _FEW_STARTS)]
    limit = np.repeat([*range(len(margins)), _ANY], [part.shape[1] for part in chosen])
    return limit, _edges(problem, limit, np.concatenate(chosen, axis=1))


def _edges(problem: LimitStates, limit: Ints, far: Floats) -> Floats:
    """Points of limits on the rays from the mean to failures `far`, shape (dimension, points); `_ANY` is any limit."""
    low, high = np.zeros(len(limit)), np.ones(len(limit))
    is_normal = problem.is_normal[:, None]
    for _ in range(_HALVINGS if len(limit) else 0):
        middle = 0.5 * (low + high)
        margins = problem.margins(np.where(is_normal, middle * far, far))
        out = np.where(
            limit < 0, failed(margins), np.isnan(margins).any(axis=0) | (margins[limit, np.arange(len(limit))] < 0)
        )
        high, low = np.where(out, middle, high), np.where(out, low, middle)
    return np.where(is_normal, high * far, far)


def _nearer(problem: LimitStates, ends: Floats, rng: np.random.Generator) -> Floats:
    """Points on an edge where margins end, moved nearer to the mean, shape (dimension, ends).

    The direction that separates failures from the other points about an edge takes the place of the slope.
    """
    d, count = ends.shape
    about = max(_WALK_POINTS, 4 * d)
    for _ in range(_WALKS if count else 0):
        shift = rng.standard_normal((d, count, about)) * problem.is_normal[:, None, None]
        margins = problem.margins((ends[:, :, None] + _WALK_SPREAD * shift).reshape(d, -1))
        gone = failed(margins).reshape(count, about)
        steep = np.einsum("dca,ca->dc", shift, gone - gone.mean(axis=1, keepdims=True))
        size = (steep * steep).sum(axis=0)
        # A little beyond the nearest point of the tangent plane.
        far = 1.25 * steep * (steep * ends).sum(axis=0) / np.where(size > 0, size, 1.0)
        far = np.where(problem.is_normal[:, None], far, ends)
        beyond = failed(problem.margins(far))
        near = _edges(problem, np.full(count, _ANY), far)
        ends = np.where(beyond & ((near * near).sum(axis=0) < (ends * ends).sum(axis=0)), near, ends)
    return ends


def _apart(problem: LimitStates, u: Floats, most: int) -> Floats:
    """The nearest point, then each time the one whose direction is farthest from all chosen, up to `most`."""
    if not u.shape[1]:
        return u
    size = np.linalg.norm(u[problem.normals], axis=0)
    directions = np.where(problem.is_normal[:, None], u / np.where(size > 0, size, 1.0), u)
    directions /= np.linalg.norm(directions, axis=0)
    chosen = [int(np.argmin(size))]
    cosine = directions[:, chosen[0]] @ directions
    while len(chosen) < most and cosine.min() < _SAME_COSINE:
        chosen.append(int(np.argmin(cosine)))
        cosine = np.maximum(cosine, directions[:, chosen[-1]] @ directions)
    return u[:, chosen]


def _distinct(problem: LimitStates, parts: Sequence[_PointArrays], failures: Floats, lost: Ints) -> DesignPoints:
    """Design points, the nearest first and each once; `lost` are limits that every explored sample breaks."""
    u, normal = (np.concatenate([part[k] for part in parts], axis=1) for k in (0, 2))
    limit, pull = (np.concatenate([part[k] for part in parts]) for k in (1, 3))
    distance = (u * normal).sum(axis=0)
    order = np.argsort(distance, kind="stable")
    kept: list[int] = []
    for k in order.tolist():
        if len(kept) == MAX_POINTS or distance[k] > _NEVER:
            break
        if not any(alike(problem, u[:, k], u[:, j]) and _along(normal[:, k], normal[:, j]) for j in kept):
            kept.append(k)
    always = bool(np.setdiff1d(lost, limit[kept]).size)
    return DesignPoints(u.T[kept], limit[kept], normal.T[kept], pull[kept], failures, always)


def _along(one: Floats, other: Floats) -> bool:
    return bool(one @ other >= _SAME_COSINE * np.linalg.norm(one) * np.linalg.norm(other))


def explored_weights(problem: LimitStates, u: Floats) -> Floats:
    """Density of the law over that of the explored samples, at `u` of shape (dimension, n): shape (n,)."""
    normal = u[problem.normals]
    half, d = 0.5 * (normal * normal).sum(axis=0), len(normal)
    logs = np.stack([half * (1 - spread**-2) - d * np.log(spread) for spread in SPREADS])
    most = logs.max(axis=0, initial=-np.inf)
    return np.asarray(len(SPREADS) * np.exp(-most) / np.exp(logs - most).sum(axis=0))


def _worst(problem: LimitStates, limit: Ints, u: Floats, scale: Floats) -> _PointArrays:
    """Descend with fixed directions and turn these towards failure, in turns until they settle.

    Arguments are those of `descend`, results those of `DesignPoints`, but `u` and `normal` of shape (dimension,
    points). Where the directions alone break a limit, all normal variables of the point are at their means.
    """
    points, at, normal = _points(problem, limit, _turned(problem, limit, u)[0], scale)
    if not len(problem.circles):
        return points, at, normal, np.zeros((len(at), 0, 2))
    for _ in range(_TURNS):
        turned = _turned(problem, at, points)[0]
        moved = np.linalg.norm(turned - points, axis=0).max(initial=0.0)
        points, at, normal = _points(problem, at, turned, scale)
        if moved < _NO_TURN:
            break
    # Failures by the directions alone, all normal variables at their means.
    alone = np.where(problem.is_normal[:, None], 0.0, u)
    for _ in range(_TURNS):
        alone, margin, _ = _turned(problem, limit, alone)
    alone, by = alone[:, margin < 0], limit[margin < 0]
    points, at = np.concatenate([points, alone], axis=1), np.concatenate([at, by])
    normal = np.concatenate([normal, np.zeros_like(alone)], axis=1)
    _, margin, slope = _turned(problem, at, points)
    steep = np.linalg.norm(slope[problem.normals], axis=0)
    # The concentration of failures about a direction is the slope of the logarithm of their probability by the
    # direction: the margin's slope by the direction over that by the distance, times the logarithm's slope by the
    # distance.
    away = (points * normal).sum(axis=0)
    width = np.where(away > 0, steep / _hazard(away), steep * (1.0 - away) + np.maximum(-margin, 0.0))
    pull = np.moveaxis(-slope[problem.circles], 2, 0) / np.where(width > 0, width, 1.0)[:, None, None]
    return points, at, normal, pull


def _points(problem: LimitStates, limit: Ints, u: Floats, scale: Floats) -> tuple[Floats, Ints, Floats]:
    """Points, limits and normals of the starts that came to their limits."""
    u, normal, good = descend(problem, limit, u, scale)
    return u[:, good], limit[good], normal[:, good]


def _turned(problem: LimitStates, limit: Ints, u: Floats) -> tuple[Floats, Floats, Floats]:
    """Points with their directions turned against the slope of their limits; margins and slopes before the turn."""
    if not len(problem.circles) or not len(limit):
        return u, np.zeros(len(limit)), np.zeros_like(u)
    margins, gradients = problem.gradients(u)
    lanes = np.arange(len(limit))
    slope = np.nan_to_num(gradients[limit, :, lanes].T, posinf=0.0, neginf=0.0)
    turned = u.copy()
    for pair in problem.circles:
        size = np.hypot(*slope[pair])
        turned[pair] = np.where(size > 0, -slope[pair] / np.where(size > 0, size, 1.0), u[pair])
    return turned, margins[limit, lanes], slope


def _hazard(distance: Floats) -> Floats:
    """Derivative of -log P(a standard normal variable is beyond)."""
    return np.asarray(np.exp(-0.5 * distance**2 - scipy.special.log_ndtr(-distance)) / np.sqrt(2.0 * np.pi))
