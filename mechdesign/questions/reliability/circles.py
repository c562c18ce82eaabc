"""Probabilities of normal errors and circles, integrated with all digits of small ones."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.special import erfcx, ndtr

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.numerics.statistics import MAX_DEVIATION, outside
from mechdesign.questions.reliability.limits import ErrorBound

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)
# Steps round a circle of radius R, for the least standard deviation b and the largest a: this times max(R, _OVAL a)/b.
_STEPS = 9.0
_OVAL = 4.0
# Number of steps from which on the integral over the width of the circle is used instead.
_MOST_STEPS = 4096
# Least standard deviation across a circle, as a part of that along it: errors along a line are as good as that.
_LINE = 1e-9
# Panels are halved until halves change the sum by less than this part, and this often.
_ENOUGH, _HALVINGS = 1e-13, 60
# Edges of panels beside the place where an error passes its limit, in deviations of what is left of it.
_BESIDE = np.array([0.0, 1.0, 3.0, 9.0, MAX_DEVIATION])


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
    return 0.0 if radius == np.inf else _chance(covariance, radius, np.zeros(2) if mean is None else mean, within=False)


def disc_chance(covariance: Floats, radius: float, mean: Floats) -> float:
    """P(bivariate normal within a circle about zero), to all digits of a small one; see `disc_failure`."""
    return _chance(covariance, radius, mean, within=True)


def _chance(covariance: Floats, radius: float, mean: Floats, *, within: bool) -> float:
    squares, axes = np.linalg.eigh(covariance)
    b, a = np.sqrt(np.maximum(squares, 0.0))
    # Sizes of the mean's parts along the principal axes.
    n, m = np.abs(axes.T @ mean)
    if radius <= 0 or a == 0:
        return float((a == 0 and np.hypot(m, n) <= radius > 0) == within)
    if b < 1e-12 * a:
        half = np.sqrt(radius**2 - n * n) if n <= radius else 0.0
        low, high = (-half - m) / a, (half - m) / a
        return float(ndtr(high) - ndtr(low) if within else outside(low, high) if half else 1.0)
    height, weight = _across(radius, a, b, m, n)
    if within:
        return float(weight @ (ndtr((height - n) / b) - ndtr((-height - n) / b)))
    beyond = outside((-radius - m) / a, (radius - m) / a)
    return float(beyond + weight @ (ndtr((-height - n) / b) + ndtr((n - height) / b)))


def standard_ends(band: ErrorBound, covariance: Floats, mean: Floats) -> tuple[Floats, Floats]:
    """A band's ends in standard deviations from the mean; infinite ones for an error that does not vary."""
    sigma = np.sqrt(np.maximum(covariance[..., band.output, band.output], 0.0))
    low, high = band.low - mean[..., band.output], band.high - mean[..., band.output]
    return (
        np.where(sigma == 0, np.where(low <= 0, -np.inf, np.inf), low / sigma),
        np.where(sigma == 0, np.where(high >= 0, np.inf, -np.inf), high / sigma),
    )


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


def disc_and_band_failure(covariance: Floats, disc: ErrorBound, band: ErrorBound, mean: Floats) -> float:
    """Probability that normal errors at one pose leave a circle, or a ring, or that one other leaves its band.

    Notes
    -----
    That of the circle, and that the error leaves the band while the place is within the circle. In standard axes u, v
    of the place, of which u is the one that the error e = mean + slope u + rest goes with, this is

        integral phi(u) P(v within the circle | u) P(e beyond the band | u) du

    over u = middle + half sin t, in which both roots at the rim are smooth.
    """
    pair = [*disc.channels]
    spread, centre, radius, least = covariance[np.ix_(pair, pair)], mean[pair], float(disc.high), float(disc.low)
    beyond = disc_failure(spread, radius, centre) + (disc_chance(spread, least, centre) if least > 0 else 0.0)
    squares, axes = np.linalg.eigh(spread)
    wide = np.sqrt(max(float(squares[1]), 0.0))
    if beyond >= 1 or wide == 0:
        alone = float(outside(*standard_ends(band, covariance, mean)))
        return beyond if beyond >= 1 else alone
    sizes = np.maximum(np.sqrt(np.maximum(squares, 0.0)), _LINE * wide)
    slopes = (axes.T @ covariance[band.output, pair]) / sizes
    slope = float(np.hypot(*slopes))
    rest = np.sqrt(max(float(covariance[band.output, band.output]) - slope**2, 0.0))
    along = slopes / slope if slope > 0 else np.array([1.0, 0.0])
    u_way, v_way = axes @ (sizes * along), axes @ (sizes * [-along[1], along[0]])
    low, high = float(band.low - mean[band.output]), float(band.high - mean[band.output])
    # The circle spans those u for which the line of all v comes near enough to its middle.
    radius = min(radius, float(np.hypot(*centre)) + 2 * MAX_DEVIATION * wide)
    size, turn = float(np.hypot(*v_way)), _cross(u_way, v_way)
    shift, half = _cross(centre, v_way) / turn, radius * size / abs(turn)

    def integrand(t: Floats) -> Floats:
        u = half * np.sin(t) - shift
        place = centre[:, None] + u_way[:, None] * u
        middle, away = -(v_way @ place) / size**2, np.abs((u + shift) * turn) / size
        inside = _between(middle, np.sqrt(np.maximum(radius**2 - away**2, 0.0)) / size)
        if least > 0:
            inside = np.maximum(inside - _between(middle, np.sqrt(np.maximum(least**2 - away**2, 0.0)) / size), 0.0)
        ends = np.nan_to_num((low - slope * u) / rest, nan=0.0), np.nan_to_num((high - slope * u) / rest, nan=0.0)
        density = np.exp(-0.5 * u**2) / np.sqrt(2 * np.pi)
        return np.asarray(density * inside * outside(*ends) * half * np.cos(t))

    u = [np.arange(-MAX_DEVIATION, MAX_DEVIATION + 1), [-shift], -shift + half * least / radius * np.array([-1.0, 1.0])]
    if slope > 0:
        u += [(end + side * rest * _BESIDE) / slope for end in (low, high) if np.isfinite(end) for side in (-1.0, 1.0)]
    t = np.arcsin(np.clip((np.concatenate(u) + shift) / half, -1.0, 1.0))
    begin, end = np.arcsin(np.clip((MAX_DEVIATION * np.array([-1.0, 1.0]) + shift) / half, -1.0, 1.0))
    return min(beyond + _integral(integrand, np.unique(np.clip(t, begin, end)), beyond), 1.0)


def _cross(one: Floats, other: Floats) -> float:
    return float(one[0] * other[1] - one[1] * other[0])


def _between(middle: Floats, half: Floats) -> Floats:
    """P(standard normal variable within `half` of a place `middle`)."""
    middle = np.abs(middle)
    return np.asarray(ndtr(half - middle) - ndtr(-half - middle))


def _integral(integrand: Callable[[Floats], Floats], edges: Floats, besides: float) -> float:
    """Integral over panels, halved until what they change is little of the sum and of what comes `besides`."""

    def sums(low: Floats, high: Floats) -> Floats:
        half = 0.5 * (high - low)
        at = 0.5 * (low + high) + half * _NODES[:, None]
        return np.asarray(half * (_WEIGHTS @ integrand(at.ravel()).reshape(at.shape)))

    low, high, total = edges[:-1], edges[1:], 0.0
    value = sums(low, high)
    for _ in range(_HALVINGS):
        if not len(low):
            break
        middle = 0.5 * (low + high)
        halves = np.stack([sums(low, middle), sums(middle, high)])
        rough = np.abs(halves.sum(axis=0) - value) > _ENOUGH * (besides + total + value.sum())
        total += float(halves[:, ~rough].sum())
        low, high = np.concatenate([low[rough], middle[rough]]), np.concatenate([middle[rough], high[rough]])
        value = halves[:, rough].ravel()
    return total + float(value.sum())
