"""Probabilities of normal errors within limits.

All are probabilities of failure, summed from positive terms only, so that small ones keep their digits. The reliability
is one minus the probability of failure.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import ndtr, ndtri

from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.ground.numerics.statistics import outside, rectangle_failure, student
from mechdesign.questions.reliability.circles import (
    disc_and_band_failure,
    disc_chance,
    disc_failure,
    disc_failures,
    standard_ends,
)
from mechdesign.questions.reliability.engine.problem import CONFIDENCE
from mechdesign.questions.reliability.first_order import FirstOrder, correlation
from mechdesign.questions.reliability.limits import ErrorBound

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


def made_failure(
    linear: FirstOrder, closing: FirstOrder, limits: Sequence[ErrorBound], mean: Floats | None = None,
    covariance: Floats | None = None,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Probability that a made mechanism breaks a limit or cannot be assembled, by normal errors, shape (poses,).

    With it half the width of its 99.7 % interval, 0 where it is integrated and not sampled.

    Parameters
    ----------
    linear, closing : FirstOrder
        Errors, and margins of assembly.
    mean, covariance : ndarray, optional
        In place of those of the linear model's `whole`, in the shapes of `failure_probability`.
    """
    mean = linear.whole.shift().T if mean is None else mean
    covariance = linear.whole.covariance() if covariance is None else covariance
    failure, doubt = np.full((2, len(mean)), np.nan)
    # The same lengths have a law of their own at all of these poses.
    for rows in linear.alike():
        of_rows = estimated_failure(covariance[rows], linear.limits(limits, rows), mean[rows])
        failure[rows], doubt[rows] = of_rows
    # What is left where a limit breaks almost surely is all that assembly can add.
    parts = np.minimum(ndtr(-closing.distance()), 1.0 - failure)
    counts = parts > np.maximum(_NO_PART * failure, _LEAST_PART)
    count = covariance.shape[-1]
    for pose in np.flatnonzero(counts.any(axis=0)).tolist():
        both = linear.whole.beside(closing).take([pose])
        spread, middle = both.covariance()[0], both.shift()[:, 0]
        spread[:count, :count], middle[:count] = covariance[pose], mean[pose]
        here = [limit.at(0) for limit in linear.limits(limits, [pose])]
        here += [ErrorBound((count + k,), 0.0, np.inf) for k in np.flatnonzero(counts[:, pose]).tolist()]
        failure[pose], doubt[pose] = estimated_failure(spread, here, middle)
    return failure, doubt


def failure_probability(covariance: Floats, limits: Sequence[ErrorBound], mean: Floats | None = None) -> Floats:
    """Probability that normal errors break any limit, as `estimated_failure`."""
    return estimated_failure(covariance, limits, mean)[0]


def estimated_failure(
    covariance: Floats, limits: Sequence[ErrorBound], mean: Floats | None = None
) -> tuple[Floats, Floats]:
    """Probability that normal errors break any limit, shape (...); nan where a limited one's moments are not finite.

    With it half the width of its 99.7 % interval, 0 where it is integrated and not sampled.

    Parameters
    ----------
    covariance : ndarray, shape (..., outputs, outputs)
        May be singular.
    limits
        Their ends may be of shape (...). One or two limited outputs are integrated with a relative error
        of about 1e-14, a circle beside another output with about 1e-10; more by a randomised lattice with about 1e-5,
        or by sampling with about 1e-3 where failures are rare.
    mean : ndarray, shape (..., outputs), optional
        Zero if left out.
    """
    mean = np.zeros(covariance.shape[:-1]) if mean is None else mean
    mean, limits = _about_circles(mean, limits)
    bands, discs = _kinds(limits)
    if len(bands) <= 2 and not discs:
        ends = [standard_ends(band, covariance, mean) for band in bands]
        if len(ends) < 2:
            single = outside(*ends[0])
            return single, np.zeros_like(single)
        pair = [band.output for band in bands]
        low, high = (np.stack([end[k] for end in ends]) for k in (0, 1))
        pair_failure = rectangle_failure(low, high, correlation(covariance[..., pair, :][..., pair]))
        return pair_failure, np.zeros_like(pair_failure)
    limited = [channel for limit in limits for channel in limit.channels]
    finite = np.isfinite(covariance[..., limited, :][..., limited]).all(axis=(-2, -1))
    finite &= np.isfinite(mean[..., limited]).all(axis=-1)
    failure, doubt = np.full(finite.shape, np.nan), np.zeros(finite.shape)
    if len(discs) == 1 and not bands:
        pair = [*discs[0].channels]
        radius, least = (np.broadcast_to(end, finite.shape)[finite] for end in (discs[0].high, discs[0].low))
        spread, middle = covariance[finite][:, pair][..., pair], mean[finite][:, pair]
        beyond = disc_failures(spread, radius, middle)
        for row in np.flatnonzero(least > 0).tolist():
            beyond[row] += disc_chance(spread[row], float(least[row]), middle[row])
        failure[finite] = np.minimum(beyond, 1.0)
        return failure, doubt
    for place in filter(np.asarray(finite).__getitem__, np.ndindex(failure.shape)):
        here = _kinds([limit.at(place) for limit in limits])
        failure[place], doubt[place] = _of_several(covariance[place], *here, mean[place])
    return failure, doubt


def _about_circles(mean: Floats, limits: Sequence[ErrorBound]) -> tuple[Floats, list[ErrorBound]]:
    """Means and limits of errors that count from the middle of the circle that holds them."""
    away = {k: part for limit in limits if limit.round for k, part in zip(limit.channels, limit.middle, strict=True)}
    if not any(np.any(part) for part in away.values()):
        return mean, [*limits]
    mean = mean.copy()
    for channel, part in away.items():
        mean[..., channel] -= part
    return mean, [
        replace(limit, middle=(0.0, 0.0)) if limit.round
        else replace(limit, low=limit.low - away.get(limit.output, 0.0), high=limit.high - away.get(limit.output, 0.0))
        for limit in limits
    ]  # fmt: skip


def _kinds(limits: Sequence[ErrorBound]) -> tuple[list[ErrorBound], list[ErrorBound]]:
    """Limits of single errors, and circles."""
    return [limit for limit in limits if not limit.round], [limit for limit in limits if limit.round]


def _of_several(
    covariance: Floats, bands: Sequence[ErrorBound], discs: Sequence[ErrorBound], mean: Floats
) -> tuple[float, float]:  # fmt: skip
    """Probability that normal errors at one pose break any of several limits, and half its interval."""
    if len(bands) == len(discs) == 1:
        return disc_and_band_failure(covariance, discs[0], bands[0], mean), 0.0
    rare = _rare(covariance, bands, discs, mean)
    if rare is not None:
        return rare
    about_mean = [replace(b, low=b.low - float(mean[b.output]), high=b.high - float(mean[b.output])) for b in bands]
    return _lattice(covariance, about_mean, discs, mean)


def _rare(
    covariance: Floats, bands: Sequence[ErrorBound], discs: Sequence[ErrorBound], mean: Floats
) -> tuple[float, float] | None:  # fmt: skip
    """Probability outside any of several limits where it is small; None where a lattice is better."""
    total = sum(float(outside(*standard_ends(band, covariance, mean))) for band in bands)
    nearer = []
    for disc in discs:
        pair = [*disc.channels]
        total += disc_failure(covariance[np.ix_(pair, pair)], disc.high, mean[pair])
        if disc.low > 0:
            # A point within the circle is nearer to its middle than a line that touches it.
            away = mean[pair] / (np.hypot(*mean[pair]) or 1.0)
            sigma = np.sqrt(max(float(away @ covariance[np.ix_(pair, pair)] @ away), 0.0))
            depth = disc.low - float(away @ mean[pair])
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
        (one, other), apothem = disc.channels, disc.high * np.cos(np.pi / _POLYGON_SIDES)
        for x, y in zip(np.cos(turns), np.sin(turns), strict=True):
            slopes.append(x * rows[one] + y * rows[other])
            ends.append(apothem - x * mean[one] - y * mean[other])
    for disc, (x, y) in nearer:
        one, other = disc.channels
        slopes.append(-x * rows[one] - y * rows[other])
        ends.append(x * mean[one] + y * mean[other] - disc.low)
    size = np.linalg.norm(slopes, axis=1)
    used = (size > 0) & np.isfinite(ends)
    flat = np.count_nonzero(used[: 2 * len(bands)])

    def broken(u: Floats, held: Flags) -> Flags:
        outside_any = np.asarray(held[:flat].any(axis=0))
        for disc in discs:
            size = np.hypot(*(mean[k] + rows[k] @ u for k in disc.channels))
            outside_any |= (size > disc.high) | (size < disc.low)
        return outside_any

    return half_spaces(
        np.array(slopes)[used] / size[used, None], np.array(ends)[used] / size[used], broken if discs else None
    )


def half_spaces(
    normals: Floats, distances: Floats, broken: Callable[[Floats, Flags], Flags] | None = None
) -> tuple[float, float]:
    """Probability that a standard normal point lies in any half-space ``normal . u > distance``, to about 1e-3 of it.

    With it half the width of its 99.7 % interval.

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
        return total, 0.0
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
    doubt = student(_RARE_POINTS - 1, CONFIDENCE) * float(np.std(weights)) / np.sqrt(_RARE_POINTS)
    return min(total * float(np.mean(weights)), 1.0), total * doubt


def _lattice(
    covariance: Floats, bands: Sequence[ErrorBound], discs: Sequence[ErrorBound], centre: Floats
) -> tuple[float, float]:  # fmt: skip
    """Sequential conditioning (Genz 1992) over a shifted Richtmyer lattice; a disc limits y by the x before it.

    With half the interval that the shifts show.
    """
    order: list[tuple[int, float, float, float, float]] = [(b.output, b.low, b.high, 0.0, 0.0) for b in bands]
    for disc in discs:
        low, high = (sign * disc.high - float(centre[disc.output]) for sign in (-1, 1))
        order += [(disc.output, low, high, 0.0, 0.0), (disc.channels[1], low, high, disc.high, disc.low)]
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
    doubt = student(_LATTICE_SHIFTS - 1, CONFIDENCE) * np.std(means, ddof=1) / np.sqrt(_LATTICE_SHIFTS)
    return float(np.mean(means)), float(doubt)


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
