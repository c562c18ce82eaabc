"""Probabilities of normal errors within limits.

All are probabilities of failure, summed from positive terms only, so that small ones keep their digits. The reliability
is one minus the probability of failure.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.special import erfcx, ndtr, ndtri

from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.numerics.statistics import MAX_DEVIATION, outside, rectangle_failure
from mechdesign.questions.reliability.first_order import FirstOrder, correlation
from mechdesign.questions.reliability.question import Band, Disc, limits_at

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)
# Points of a lattice.
_LATTICE_POINTS = 8191
# Random shifts of the lattice.
_LATTICE_SHIFTS = 8
# Sum of the limits' probabilities below which too few lattice points fail, and points are drawn beyond the limits
# instead.
_RARE = 0.05
# Number of points that are drawn beyond the limits.
_RARE_POINTS = 20_000
# Probability of no assembly that is neglected, as a share of the probability of failure.
_NO_PART = 1e-6
# Probability of no assembly that is neglected in any case.
_LEAST_PART = 1e-15
# Sides of the polygon inside a circle, beyond whose sides points are drawn.
_POLYGON_SIDES = 64
# Steps round a circle of radius R, for the least standard deviation b and the largest a: this times max(R, _OVAL a)/b.
_STEPS = 9.0
_OVAL = 4.0
# Number of steps from which on the integral over the width of the circle is used instead.
_MOST_STEPS = 4096


def made_failure(
    linear: FirstOrder, closing: FirstOrder, bands: Sequence[Band], discs: Sequence[Disc],
    mean: Floats | None = None, covariance: Floats | None = None,
) -> Floats:  # fmt: skip
    """Probability that a made mechanism breaks a limit or cannot be assembled, by normal errors, shape (poses,).

    Parameters
    ----------
    linear, closing : FirstOrder
        Errors, and margins of assembly.
    mean, covariance : ndarray, optional
        In place of those of the linear model's `whole`, in the shapes of `failure_probability`.
    """
    mean = linear.whole.shift().T if mean is None else mean
    covariance = linear.whole.covariance() if covariance is None else covariance
    failure = np.full(len(mean), np.nan)
    # The same lengths have a law of their own at all of these poses.
    for rows in linear.alike():
        failure[rows] = failure_probability(covariance[rows], *linear.limits(bands, discs, rows), mean[rows])
    # What is left where a limit breaks almost surely is all that assembly can add.
    parts = np.minimum(ndtr(-closing.distance()), 1.0 - failure)
    counts = parts > np.maximum(_NO_PART * failure, _LEAST_PART)
    count = covariance.shape[-1]
    for pose in np.flatnonzero(counts.any(axis=0)).tolist():
        both = linear.whole.beside(closing).take([pose])
        spread, middle = both.covariance()[0], both.shift()[:, 0]
        spread[:count, :count], middle[:count] = covariance[pose], mean[pose]
        limits, circles = linear.limits(bands, discs, [pose])
        limits, circles = limits_at(limits, circles, 0)
        margins = [Band(count + k, 0.0, np.inf) for k in np.flatnonzero(counts[:, pose]).tolist()]
        failure[pose] = failure_probability(spread, [*limits, *margins], circles, middle)
    return failure


def failure_probability(
    covariance: Floats, bands: Sequence[Band], discs: Sequence[Disc], mean: Floats | None = None
) -> Floats:
    """Probability that normal errors break any limit, shape (...); nan where a limited one's moments are not finite.

    Parameters
    ----------
    covariance : ndarray, shape (..., outputs, outputs)
        May be singular.
    bands, discs
        The limits; ends of bands may be of shape (...). One or two limited outputs are integrated with a relative error
        of about 1e-14; more by a randomised lattice with about 1e-5, or by sampling with about 1e-3 where failures are
        rare.
    mean : ndarray, shape (..., outputs), optional
        Zero if left out.
    """
    mean = np.zeros(covariance.shape[:-1]) if mean is None else mean
    if len(bands) <= 2 and not discs:
        ends = [_standard(band, covariance, mean) for band in bands]
        if len(ends) < 2:
            return outside(*ends[0])
        pair = [band.output for band in bands]
        low, high = (np.stack([end[k] for end in ends]) for k in (0, 1))
        return rectangle_failure(low, high, correlation(covariance[..., pair, :][..., pair]))
    limited = [band.output for band in bands] + [axis for disc in discs for axis in (disc.x, disc.y)]
    finite = np.isfinite(covariance[..., limited, :][..., limited]).all(axis=(-2, -1))
    finite &= np.isfinite(mean[..., limited]).all(axis=-1)
    failure = np.full(finite.shape, np.nan)
    if len(discs) == 1 and not bands:
        pair = [discs[0].x, discs[0].y]
        radius, least = (np.broadcast_to(end, finite.shape)[finite] for end in (discs[0].radius, discs[0].least))
        spread, middle = covariance[finite][:, pair][..., pair], mean[finite][:, pair]
        beyond = disc_failures(spread, radius, middle)
        for row in np.flatnonzero(least > 0).tolist():
            beyond[row] += disc_chance(spread[row], float(least[row]), middle[row])
        failure[finite] = np.minimum(beyond, 1.0)
        return failure
    for place in filter(np.asarray(finite).__getitem__, np.ndindex(failure.shape)):
        failure[place] = _of_several(covariance[place], *limits_at(bands, discs, place), mean[place])
    return failure


def _standard(band: Band, covariance: Floats, mean: Floats) -> tuple[Floats, Floats]:
    """A band's ends in standard deviations from the mean; infinite ones for an error that does not vary."""
    sigma = np.sqrt(np.maximum(covariance[..., band.output, band.output], 0.0))
    low, high = band.low - mean[..., band.output], band.high - mean[..., band.output]
    with np.errstate(divide="ignore", invalid="ignore"):
        return (
            np.where(sigma == 0, np.where(low <= 0, -np.inf, np.inf), low / sigma),
            np.where(sigma == 0, np.where(high >= 0, np.inf, -np.inf), high / sigma),
        )


def _of_several(covariance: Floats, bands: Sequence[Band], discs: Sequence[Disc], mean: Floats) -> float:
    """Probability that normal errors at one pose break any of several limits."""
    rare = _rare(covariance, bands, discs, mean)
    if rare is not None:
        return rare
    about_mean = [replace(b, low=b.low - float(mean[b.output]), high=b.high - float(mean[b.output])) for b in bands]
    return _lattice(covariance, about_mean, discs, mean)


def _rare(covariance: Floats, bands: Sequence[Band], discs: Sequence[Disc], mean: Floats) -> float | None:
    """Probability outside any of several limits where it is small; None where a lattice is better."""
    total = sum(float(outside(*_standard(band, covariance, mean))) for band in bands)
    nearer = []
    for disc in discs:
        pair = [disc.x, disc.y]
        total += disc_failure(covariance[np.ix_(pair, pair)], disc.radius, mean[pair])
        if disc.least > 0:
            # A point within the circle is nearer to its middle than a line that touches it.
            away = mean[pair] / (np.hypot(*mean[pair]) or 1.0)
            sigma = np.sqrt(max(float(away @ covariance[np.ix_(pair, pair)] @ away), 0.0))
            depth = disc.least - float(away @ mean[pair])
            total += float(ndtr(depth / sigma)) if sigma > 0 else float(depth > 0)
            nearer.append((disc, away))
    if total > _RARE:
        return None
    squares, axes = np.linalg.eigh(covariance)
    rows = axes * np.sqrt(np.maximum(squares, 0.0))
    slopes = [sign * rows[band.output] for band in bands for sign in (1.0, -1.0)]
    ends = [end for b in bands for end in (b.high - mean[b.output], mean[b.output] - b.low)]
    # A point outside a circle is beyond a side of the polygon in it.
    turns = 2 * np.pi * np.arange(_POLYGON_SIDES) / _POLYGON_SIDES
    for disc in discs:
        for x, y in zip(np.cos(turns), np.sin(turns), strict=True):
            slopes.append(x * rows[disc.x] + y * rows[disc.y])
            ends.append(disc.radius * np.cos(np.pi / _POLYGON_SIDES) - x * mean[disc.x] - y * mean[disc.y])
    for disc, (x, y) in nearer:
        slopes.append(-x * rows[disc.x] - y * rows[disc.y])
        ends.append(x * mean[disc.x] + y * mean[disc.y] - disc.least)
    size = np.linalg.norm(slopes, axis=1)
    used = (size > 0) & np.isfinite(ends)
    flat = np.count_nonzero(used[: 2 * len(bands)])

    def broken(u: Floats, held: Flags) -> Flags:
        outside_any = np.asarray(held[:flat].any(axis=0))
        for disc in discs:
            size = np.hypot(*(mean[k] + rows[k] @ u for k in (disc.x, disc.y)))
            outside_any |= (size > disc.radius) | (size < disc.least)
        return outside_any

    return half_spaces(
        np.array(slopes)[used] / size[used, None], np.array(ends)[used] / size[used], broken if discs else None
    )


def half_spaces(normals: Floats, distances: Floats, broken: Callable[[Floats, Flags], Flags] | None = None) -> float:
    """Probability that a standard normal point lies in any half-space ``normal . u > distance``, to about 1e-3 of it.

    Parameters
    ----------
    normals, distances : ndarray, shape (half-spaces, dimension) and (half-spaces,)
        Unit vectors, and distances from the mean.
    broken : callable, optional
        Which points of the half-spaces are failures, all if left out: from points, shape (dimension, n), and whether
        each half-space holds them, shape (half-spaces, n).

    Notes
    -----
    The sum of the half-spaces' probabilities, times the mean of 1/m over points drawn in one of them, where m is the
    number of half-spaces that hold the point [Owen, Maximov & Chertkov, Importance sampling the union of rare events,
    2019].
    """
    chances = ndtr(-distances)
    total = float(chances.sum())
    if total == 0 or (len(chances) < 2 and broken is None):
        return total
    rng = np.random.Generator(np.random.SFC64(0))
    half = rng.choice(len(chances), _RARE_POINTS, p=chances / total)
    normal = normals[half].T
    u = rng.standard_normal(normal.shape)
    depth = -ndtri(chances[half] * (1.0 - rng.random(_RARE_POINTS)))
    u += normal * (depth - (normal * u).sum(axis=0))
    held = normals @ u > distances[:, None]
    # A point lies in the half-space it is drawn from, whatever its rounding.
    held[half, np.arange(_RARE_POINTS)] = True
    weights = 1.0 / held.sum(axis=0)
    if broken is not None:
        weights = np.where(broken(u, held), weights, 0.0)
    return min(total * float(np.mean(weights)), 1.0)


def disc_failures(covariance: Floats, radius: Floats, mean: Floats) -> Floats:
    """P(bivariate normal outside a circle about zero) for n covariances, shape (n,); see `disc_failure`.

    Notes
    -----
    In polar coordinates r, phi in principal axes the density beyond the circle, with A r^2 - 2 B r + C in the exponent,
    is integrated over r in closed form, and over phi by as many equal steps as its narrowest part needs: the integrand
    is periodic and analytic, and the error of the trapezoidal rule falls exponentially [Trefethen & Weideman, 2014].
    """
    failure = np.full(len(radius), np.nan)
    squares, axes = np.linalg.eigh(covariance)
    b, a = np.sqrt(np.maximum(squares, 0.0)).T
    n, m = np.einsum("pij,pi->pj", axes, mean).T
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = _STEPS * np.maximum((radius + np.hypot(n, m)) / b, _OVAL * a / b) + _STEPS
    steps = np.exp2(np.ceil(np.log2(np.where((radius > 0) & (steps < _MOST_STEPS), steps, _MOST_STEPS))))
    for count in np.unique(steps[steps < _MOST_STEPS]).tolist():
        rows = steps == count
        size, wide, narrow, x, y = (part[rows, None] for part in (radius, a, b, m, n))
        phi = 2 * np.pi * np.arange(count) / count
        along, across = np.cos(phi) / wide, np.sin(phi) / narrow
        root = np.hypot(along, across)
        nearest = (along * x / wide + across * y / narrow) / root
        beyond = size * root - nearest
        # exp(-C/2 + B^2/(2A) - beyond^2/2) is that of the distance of the circle's point from the mean.
        apart = np.exp(-0.5 * ((size * np.cos(phi) - x) ** 2 / wide**2 + (size * np.sin(phi) - y) ** 2 / narrow**2))
        with np.errstate(over="ignore", invalid="ignore"):
            tail = apart * (1.0 + nearest * np.sqrt(0.5 * np.pi) * erfcx(beyond / np.sqrt(2.0)))
            failure[rows] = (tail / root**2).sum(axis=1) / (count * (a * b)[rows])
    # Errors nearly along a line, or with a mean far outside the circle.
    for row in np.flatnonzero(np.isnan(failure)).tolist():
        failure[row] = disc_failure(covariance[row], float(radius[row]), mean[row])
    return np.asarray(np.minimum(failure, 1.0))


def disc_failure(covariance: Floats, radius: float, mean: Floats | None = None) -> float:
    """P(bivariate normal outside a circle about zero); `covariance` of shape (2, 2), `mean` of shape (2,), else zero.

    Notes
    -----
    In principal axes with standard deviations a >= b, over x = radius sin t, which removes the root at the rim.
    """
    if radius == np.inf:
        return 0.0
    a, b, m, n = _principal(covariance, mean)
    if radius <= 0 or a == 0:
        return 0.0 if a == 0 and np.hypot(m, n) <= radius > 0 else 1.0
    if b < 1e-12 * a:
        half = np.sqrt(radius**2 - n * n) if n <= radius else 0.0
        return float(outside((-half - m) / a, (half - m) / a)) if half else 1.0
    height, weight = _across(radius, a, b, m, n)
    return float(outside((-radius - m) / a, (radius - m) / a)
                 + weight @ (ndtr((-height - n) / b) + ndtr((n - height) / b)))  # fmt: skip


def disc_chance(covariance: Floats, radius: float, mean: Floats) -> float:
    """P(bivariate normal within a circle about zero), to all digits of a small one; see `disc_failure`."""
    a, b, m, n = _principal(covariance, mean)
    if radius <= 0 or a == 0:
        return float(np.hypot(m, n) <= radius > 0)
    if b < 1e-12 * a:
        half = np.sqrt(radius**2 - n * n) if n <= radius else 0.0
        return float(ndtr((half - m) / a) - ndtr((-half - m) / a))
    height, weight = _across(radius, a, b, m, n)
    return float(weight @ (ndtr((height - n) / b) - ndtr((-height - n) / b)))


def _principal(covariance: Floats, mean: Floats | None) -> tuple[Any, Any, Any, Any]:
    """Standard deviations along the principal axes, the larger first, and the sizes of the mean's parts along them."""
    squares, axes = np.linalg.eigh(covariance)
    b, a = np.sqrt(np.maximum(squares, 0.0))
    n, m = (0.0, 0.0) if mean is None else np.abs(axes.T @ mean)
    return a, b, m, n


def _across(radius: float, a: Any, b: Any, m: Any, n: Any) -> tuple[Floats, Floats]:
    """Half the heights of a circle at places x along the first axis, and their weights by the density of x."""
    begin, end = (np.arcsin(np.clip((m + sign * MAX_DEVIATION * a) / radius, -1.0, 1.0)) for sign in (-1, 1))
    if begin == end:
        return np.zeros(0), np.zeros(0)
    # The chance that y is outside changes within b of where the circle is as high as y's mean: panels shrink there.
    spread = np.array([0.0, 1e-3, 1e-2, 0.1, 1.0, 4.0, 16.0, 40.0]) * b
    near = np.arccos(np.clip(np.concatenate([n + spread, n - spread]) / radius, 0.0, 1.0))
    count = min(int(np.ceil((end - begin) * radius / a)) + 8, 800)
    edges = np.unique(np.concatenate([np.linspace(begin, end, count), near, -near]))
    t, weight = _panels(edges[(edges >= begin) & (edges <= end)])
    x, height = radius * np.sin(t), radius * np.cos(t)
    density = np.exp(-0.5 * ((x - m) / a) ** 2) / (a * np.sqrt(2 * np.pi))
    return height, weight * density * height


def _panels(edges: Floats) -> tuple[Floats, Floats]:
    """Gauss-Legendre nodes and weights over all panels between `edges`."""
    half = 0.5 * np.diff(edges)[:, None]
    middle = 0.5 * (edges[1:] + edges[:-1])[:, None]
    return (middle + half * _NODES).ravel(), (half * _WEIGHTS).ravel()


def _lattice(covariance: Floats, bands: Sequence[Band], discs: Sequence[Disc], centre: Floats) -> float:
    """Sequential conditioning (Genz 1992) over a shifted Richtmyer lattice; a disc limits y by the x before it."""
    order: list[tuple[int, float, float, float, float]] = [(b.output, b.low, b.high, 0.0, 0.0) for b in bands]
    for disc in discs:
        low, high = (sign * disc.radius - float(centre[disc.x]) for sign in (-1, 1))
        order += [(disc.x, low, high, 0.0, 0.0), (disc.y, low, high, disc.radius, disc.least)]
    chosen = [output for output, *_ in order]
    root = _pivot_free_cholesky(covariance[np.ix_(chosen, chosen)])
    primes = np.array([2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71], dtype=float)
    if len(order) > len(primes):
        primes = np.arange(2, len(order) + 2) + np.pi
    rng = np.random.Generator(np.random.SFC64(20))
    means = []
    steps = np.arange(1, _LATTICE_POINTS + 1)[:, None] * np.sqrt(primes[: len(order)])
    for _ in range(_LATTICE_SHIFTS):
        points = np.abs(2.0 * np.mod(steps + rng.random(len(order)), 1.0) - 1.0)
        drawn = np.zeros((len(order), _LATTICE_POINTS))
        log_success = np.zeros(_LATTICE_POINTS)
        before = np.zeros(_LATTICE_POINTS)
        for k, (output, low, high, radius, least) in enumerate(order):
            mean = root[k, :k] @ drawn[:k]
            lower, upper = low - mean, high - mean
            # Half the chord of the circle within which y is too near to the middle.
            hole = np.sqrt(np.maximum(least * least - before * before, 0.0)) if least > 0 else None
            if radius:
                chord = np.sqrt(np.maximum(radius * radius - before * before, 0.0))
                lower, upper = (sign * chord - centre[output] - mean for sign in (-1, 1))
            if root[k, k] > 0:
                a, b = ndtr(lower / root[k, k]), ndtr(-upper / root[k, k])
                begin, gap = 1.0, 0.0
                if hole is not None:
                    begin, end = (ndtr((sign * hole - centre[output] - mean) / root[k, k]) for sign in (-1, 1))
                    gap = end - begin
                with np.errstate(divide="ignore"):
                    log_success += np.log1p(-np.minimum(a + b + gap, 1.0))
                share = a + points[:, k] * (1.0 - a - b - gap)
                drawn[k] = ndtri(np.clip(share + np.where(share > begin, gap, 0.0), 1e-300, 1.0 - 1e-16))
            else:
                within = (lower <= 0) & (upper >= 0)
                if hole is not None:
                    within &= np.abs(centre[output] + mean) >= hole
                log_success = np.where(within, log_success, -np.inf)
            before = mean + root[k, k] * drawn[k] + centre[output]
        means.append(-np.expm1(log_success).mean())
    return float(np.mean(means))


def _pivot_free_cholesky(matrix: Floats) -> Floats:
    """Lower factor of a positive semidefinite matrix, in its order; a row that depends on others gets a zero pivot."""
    size = len(matrix)
    root = np.zeros((size, size))
    for k in range(size):
        for j in range(k):
            if root[j, j] > 0:
                root[k, j] = (matrix[k, j] - root[k, :j] @ root[j, :j]) / root[j, j]
        rest = matrix[k, k] - root[k, :k] @ root[k, :k]
        root[k, k] = np.sqrt(rest) if rest > 1e-12 * matrix[k, k] else 0.0
    return root
