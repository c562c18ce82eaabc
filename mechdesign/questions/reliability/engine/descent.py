"""The iteration from a start to the point of a limit that is nearest to the mean, for many starts at once.

[Hasofer & Lind, Exact and invariant second-moment code format, 1974; Zhang & Der Kiureghian, Two improved algorithms
for reliability analysis, 1995, whose merit function makes the iteration converge.]
"""

from __future__ import annotations

import numpy as np

from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.questions.reliability.engine.problem import LimitStates

# Most steps of the iteration.
_ITERATIONS = 30
# Fractions of a step that are tried where the whole step does not improve the merit.
_FRACTIONS = np.array([0.5, 0.25, 0.0625])
# The iteration ends where a step is shorter than this, or nothing improves. The point is on the limit if its margin,
# over the margin at the mean, is this small.
_SHORT_STEP = 5e-3
_ZERO_MARGIN = 1e-2
# Margin, over that at the mean, beyond which a point is off its limit; distance of a limit that is far from the mean.
_OFF_MARGIN = 0.5
_FAR_LIMIT = 8.0
# A step that leaves more than this share of the merit gains little.
_LITTLE_GAIN = 0.95
# Two points differ where their directions are farther apart on the circle than this.
_DIRECTIONS_APART = 0.5


def sizes(problem: LimitStates) -> Floats:
    """Magnitudes of the margins at the mean, by which margins are scaled, shape (limits,); 1 where one is 0 or nan."""
    scale = np.abs(problem.margins(np.zeros((problem.dimension, 1))))[:, 0]
    return np.asarray(np.where((scale > 0) & np.isfinite(scale), scale, 1.0))


def descend(
    problem: LimitStates, limit: Ints, u: Floats, scale: Floats, *, together: bool = True
) -> tuple[Floats, Floats, Flags]:
    """Step all starts to the nearest point of their limits; directions stay as they are.

    Parameters
    ----------
    limit, u : ndarray, shape (starts,) and (dimension, starts)
        Limits, and points to start from.
    scale : ndarray, shape (limits,)
        See `sizes`.
    together : bool
        Whether starts that have come together go on as one.

    Returns
    -------
    u, normal, good
        Points, and unit vectors towards failure, shape (dimension, starts); which starts came to their limit, of those
        that came together one.
    """
    u = u.copy()
    is_normal = problem.is_normal[:, None]
    active = np.ones(len(limit), dtype=bool)
    good = np.zeros(len(limit), dtype=bool)
    normal = np.zeros_like(u)
    for _ in range(_ITERATIONS):
        lanes = np.flatnonzero(active)
        if not lanes.size:
            break
        margins, gradients = problem.gradients(u[:, lanes])
        rows, k = limit[lanes], np.arange(len(lanes))
        # Squares may overflow; such a start is given up below.
        g, slope = margins[rows, k] / scale[rows], is_normal * gradients[rows, :, k].T / scale[rows]
        size = (slope**2).sum(axis=0)
        finite = np.isfinite(g) & np.isfinite(size) & (size > 0)
        active[lanes[~finite]] = False
        if not finite.any():
            continue
        lanes, g, slope, size = lanes[finite], g[finite], slope[:, finite], size[finite]
        at = u[:, lanes]
        step = slope * (((slope * at).sum(axis=0) - g) / size) - is_normal * at
        normal[:, lanes] = -slope / np.sqrt(size)
        trial = at + step
        weight = 2 * np.linalg.norm(at, axis=0) / np.sqrt(size) + 1.0
        # Where the mean fails, or a limit is far, a step to it must count for more than the distance that it costs.
        way = (trial**2).sum(axis=0)
        far_off = (g < -_OFF_MARGIN) | ((g > _OFF_MARGIN) & (way > _FAR_LIMIT**2))
        weight = np.where(far_off, np.maximum(weight, way / np.maximum(np.abs(g), _OFF_MARGIN)), weight)
        before = 0.5 * (at**2).sum(axis=0) + weight * np.abs(g)
        merit = _merit(problem, trial, limit[lanes], scale, weight)
        far = np.linalg.norm(step, axis=0) >= _SHORT_STEP * (1 + np.linalg.norm(at, axis=0))
        # A whole step that gains little would oscillate about the nearest point.
        worse = np.flatnonzero(~(merit < np.where(far, _LITTLE_GAIN, 1.0) * before))
        if worse.size:
            shorter = at[:, None, worse] + _FRACTIONS[:, None] * step[:, None, worse]
            often = np.tile(worse, len(_FRACTIONS))
            merits = _merit(problem, shorter.reshape(len(at), -1), limit[lanes[often]], scale, weight[often])
            merits = merits.reshape(len(_FRACTIONS), -1)
            best, k = np.argmin(merits, axis=0), np.arange(len(worse))
            nearer = merits[best, k] < merit[worse]
            worse, best, k = worse[nearer], best[nearer], k[nearer]
            merit[worse], trial[:, worse] = merits[best, k], shorter[:, best, k]
        done = ~far | ~(merit < before)
        good[lanes[done]] = np.abs(g[done]) < _ZERO_MARGIN
        active[lanes[done]] = False
        better = merit < before
        u[:, lanes[better]] = trial[:, better]
        for i, lane in enumerate(lanes if together else ()):
            others = lanes[:i][active[lanes[:i]] | good[lanes[:i]]]
            if active[lane] and any(limit[lane] == limit[o] and alike(problem, u[:, lane], u[:, o]) for o in others):
                active[lane] = False
    # Starts that are not settled but close to the limit are good enough to sample about.
    lanes = np.flatnonzero(active)
    if lanes.size:
        margins = problem.margins(u[:, lanes])
        good[lanes] = np.abs(margins[limit[lanes], np.arange(len(lanes))] / scale[limit[lanes]]) < _ZERO_MARGIN
    return u, normal, good


def _merit(problem: LimitStates, u: Floats, limit: Ints, scale: Floats, weight: Floats) -> Floats:
    """The merit function that the iteration minimises, shape (n,); infinite where margins are nan."""
    value = problem.margins(u)[limit, np.arange(len(limit))] / scale[limit]
    merit = 0.5 * (u**2).sum(axis=0) + weight * np.abs(value)
    return np.asarray(np.where(np.isfinite(merit), merit, np.inf))


def alike(problem: LimitStates, one: Floats, other: Floats) -> bool:
    """Whether two points count as the same."""
    gap = one - other
    if (np.hypot(*gap[problem.circles.T]) > _DIRECTIONS_APART).any():
        return False
    size, length = float(np.linalg.norm(gap[problem.normals])), float(np.linalg.norm(one[problem.normals]))
    return size < 0.3 or size < 0.2 * length
