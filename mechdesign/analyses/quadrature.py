"""Integrals over the region of many designs at once, adaptive and with an error estimate.

In polar coordinates about the scan's centre, with each panel's angle and each interval's radius written as

    theta = middle - half cos u,   r = middle - half cos t,   0 <= u, t <= pi

so that inverse square roots at the boundary (resistivity where a leg is stretched), square roots at the ends of panels
(tangent rays) and cusps become smooth. The rule is Gauss-Legendre in u and in t. Kinks inside (isotropic points
and curves) are met by bisection, of intervals along each ray and of panels.

The error estimate adds the errors along each ray by absolute value to those in the angle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.panels import Panels
from mechdesign.analyses.rays import Designs, Floats, Intervals, Ints, trace


@dataclass(frozen=True, eq=False)
class Rule:
    """Gauss-Legendre rule on [-1, 1] and the matrix that gives the Legendre coefficients of the integrand."""

    nodes: Floats
    weights: Floats
    spectrum: Floats
    window: int
    power: float
    safety: float

    @staticmethod
    def of(count: int, window: int, safety: float) -> Rule:
        """Rule of `count` nodes that judges the decay of coefficients by groups of `window`, with a factor of safety."""
        nodes, weights = np.polynomial.legendre.leggauss(count)
        degrees = np.arange(count)
        basis = np.polynomial.legendre.legvander(nodes, count - 1).T
        middle = count - 0.5 * (window + 1)
        power = np.log(2) / np.log(middle / (middle - window))
        return Rule(nodes, weights, (degrees[:, None] + 0.5) * weights * basis, window, power, safety)

    def apply(self, values: Floats) -> tuple[Floats, Floats]:
        """Integral and its estimated error for values at the nodes (first axis).

        The error is about the first Legendre coefficient that the rule takes for a constant, of degree 2n. It is
        extrapolated from the slowest decay between the last groups of degree below n, as a power of the degree: the
        decay of what is not analytic (isotropic points), and safe for what is.
        """
        size = np.abs(self.spectrum[-(len(self.nodes) // self.window) * self.window :] @ values)
        groups = size.reshape(-1, self.window, values.shape[1]).max(axis=1)[-4:]
        with np.errstate(divide="ignore", invalid="ignore"):
            decay = np.minimum((groups[1:] / groups[:-1]).max(axis=0), 1.0)
        decay = np.where(np.isfinite(decay), decay, 1.0)
        return self.weights @ values, self.safety * groups[-1] * decay**self.power


ANGLES, RADII = Rule.of(22, 4, 6.0), Rule.of(9, 2, 2.0)


def _end_values(rule: Rule) -> Floats:
    """Matrix from values at the nodes to value, slope and curvature of the interpolant at -1 and at 1."""
    k = np.arange(len(rule.nodes))
    up = np.stack([np.ones(len(k)), k * (k + 1) / 2, (k - 1) * k * (k + 1) * (k + 2) / 8])
    down = up * np.array([1, -1, 1])[:, None] * (-1.0) ** k
    return np.concatenate([down, up]) @ rule.spectrum


_ENDS = _end_values(RADII)

# Segments of rays evaluated at once (15 nodes each).
BLOCK = 1024
MOST_PASSES = 24
MOST_HALVINGS = 12
# Nearer to the boundary than this fraction of the radius, rounding spoils an index that is infinite there.
NEAREST = 3e-14
# Shares of the tolerance for errors along rays, and for the area (which is the divisor of every mean).
ALONG, AREA = 0.4, 0.1


@dataclass(frozen=True, eq=False)
class Integral:
    """Integrals of each design.

    Parameters
    ----------
    area, area_error : ndarray, shape (designs,)
        Area of the region.
    mean, mean_error : ndarray, shape (2, designs)
        Means of inverse condition and resistivity over the region within the margins of the scan; nan where empty.
    boundary : (design, angle, radius)
        Points of the boundary that were met.
    """

    area: Floats
    area_error: Floats
    mean: Floats
    mean_error: Floats
    boundary: tuple[Ints, Floats, Floats]


@dataclass(frozen=True, eq=False)
class _Cells:
    """Parts of panels: design, panel, range of u within [0, pi], and whether the means count it."""

    design: Ints
    low: Floats
    high: Floats
    start: Floats
    stop: Floats
    counted: Floats

    def pick(self, index: Ints) -> _Cells:
        return _Cells(*(getattr(self, name)[index] for name in self.__dataclass_fields__))

    def halves(self) -> _Cells:
        middle = 0.5 * (self.start + self.stop)
        return _join(_Cells(self.design, self.low, self.high, self.start, middle, self.counted),
                     _Cells(self.design, self.low, self.high, middle, self.stop, self.counted))  # fmt: skip


def _join(one: _Cells, other: _Cells) -> _Cells:
    return _Cells(*(np.concatenate([getattr(one, n), getattr(other, n)]) for n in one.__dataclass_fields__))


def integrate(
    designs: Designs, panels: Panels, tolerance: float, samples: int, counted: tuple[float, float], means: bool = True
) -> Integral:
    """Area and means of the local indices of every design, to a relative tolerance.

    Parameters
    ----------
    counted : (float, float)
        Range of angle that the means are taken over; panels must end there.
    means : bool
        False for the area alone.
    """
    count = designs.count
    middle = 0.5 * (panels.low + panels.high)
    inside = ((middle > counted[0]) & (middle < counted[1])).astype(float)
    zero = np.zeros(len(panels.low))
    fresh = _Cells(panels.design, panels.low, panels.high, zero, zero + 1, inside)
    span = np.bincount(panels.design, panels.high - panels.low, count)
    done: _Cells | None = None
    # Rows: area, area within the margins, and the indices; of the values and of their errors.
    values = errors = np.zeros((4, 0))
    allowed: Floats | None = None
    boundary: tuple[Ints, Floats, Floats] | None = None
    for _ in range(MOST_PASSES):
        value, error, allowed, met = _evaluate(designs, fresh, panels.reach, samples, tolerance, allowed, span, means)
        boundary = met if boundary is None else boundary
        done = fresh if done is None else _join(done, fresh)
        values, errors = np.concatenate([values, value], axis=1), np.concatenate([errors, error], axis=1)
        total, doubt = (np.stack([np.bincount(done.design, row, count) for row in rows]) for rows in (values, errors))
        wanted = np.stack([AREA * tolerance * total[0], AREA * tolerance * total[1], *(tolerance * total[2:])])
        late = (doubt > wanted).any(axis=0)
        if not late.any():
            break
        cells = np.bincount(done.design, minlength=count)
        share = errors / np.maximum(wanted, 1e-300)[:, done.design]
        worst = np.zeros((4, count))
        for row in range(4):
            np.maximum.at(worst[row], done.design, share[row])
        # The worst cell, and those that exceed their equal share of the tolerance.
        over = (share >= np.minimum(worst, 1 / np.maximum(cells, 1))[:, done.design]) & (doubt > wanted)[:, done.design]
        split = over.any(axis=0) & (done.stop - done.start > 2.0**-MOST_HALVINGS)
        if not split.any():
            break
        fresh = done.pick(np.nonzero(split)[0]).halves()
        done, values, errors = done.pick(np.nonzero(~split)[0]), values[:, ~split], errors[:, ~split]
    assert boundary is not None
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = total[2:] / total[1]
        mean_error = (doubt[2:] + np.abs(mean) * doubt[1]) / total[1]
    return Integral(total[0], doubt[0], mean, mean_error, boundary)


def _evaluate(designs, cells, reach, samples, tolerance, allowed, span, means):  # type: ignore[no-untyped-def]
    """Values and errors (4, cells) of new cells, the error allowed along rays, and the boundary points met."""
    nodes = len(ANGLES.nodes)
    middle, half = 0.5 * (cells.start + cells.stop), 0.5 * (cells.stop - cells.start)
    theta, density = _spread(cells.low, cells.high, middle + half * ANGLES.nodes[:, None], ANGLE_MAP)
    theta, weight = theta.ravel(), (half * density).ravel()
    design, counted = np.tile(cells.design, nodes), np.tile(cells.counted, nodes)
    intervals = trace(designs, design, theta, reach[design], samples)
    ray, inner, outer = intervals.ray, intervals.inner, intervals.outer
    area = np.bincount(ray, 0.5 * (outer - inner) * (outer + inner), len(theta))
    rows, error = [area, area * counted], np.zeros((2, len(theta)))
    if means:
        share = weight * np.repeat(ANGLES.weights, len(cells.low))
        value, error, allowed = _along(designs, design, theta, intervals, tolerance, allowed, share, span)
        rows += [*(value * counted)]
    else:
        rows += [np.zeros_like(area)] * 2
    total, doubt = np.empty((4, len(cells.low))), np.empty((4, len(cells.low)))
    for k, row in enumerate(rows):
        total[k], doubt[k] = ANGLES.apply((row * weight).reshape(nodes, -1))
    for k in range(2):
        doubt[2 + k] += ANGLES.weights @ (error[k] * weight * counted).reshape(nodes, -1)
    met = (np.tile(design[ray], 2), np.tile(theta[ray], 2), np.concatenate([inner, outer]))
    return total, doubt, allowed, met


def _cosine(v: Floats) -> tuple[Floats, Floats]:
    """Map of [0, 1] onto itself with a double point at 0 (and, mirrored, at 1): (1 - cos pi v)/2, and its slope."""
    return np.sin(0.5 * np.pi * v) ** 2, 0.5 * np.pi * np.sin(np.pi * v)


def _quartic(v: Floats) -> tuple[Floats, Floats]:
    """Map of [0, 1] onto itself with a fourfold point at either end, and its slope."""
    w = v * (1 - v)
    return v**4 * (35 + v * (-84 + v * (70 - 20 * v))), 140 * w**3


def _spread(low: Floats, high: Floats, v: Floats, bend) -> tuple[Floats, Floats]:  # type: ignore[no-untyped-def]
    """Points of [low, high] at `v` of [0, 1] and their density, without cancellation near either end."""
    near, slope = bend(np.minimum(v, 1 - v))
    width = high - low
    return np.where(v < 0.5, low + width * near, high - width * near), width * slope


def _along(  # type: ignore[no-untyped-def]
    designs: Designs, design: Ints, theta: Floats, intervals: Intervals, tolerance: float, allowed, weight: Floats, span
):
    """Integrals of the indices along rays (2, rays), their errors, and the error allowed per radian (2, designs)."""
    value, error = np.zeros((2, len(theta))), np.zeros((2, len(theta)))
    ray, inner, outer = intervals.ray, intervals.inner, intervals.outer
    start, stop = np.zeros(len(ray)), np.ones(len(ray))
    for halving in range(MOST_HALVINGS):
        found, doubt, smooth = segments(designs, design[ray], theta[ray], inner, outer, start, stop)
        if allowed is None:
            share = np.stack([np.bincount(design[ray], row * weight[ray], designs.count) for row in found])
            with np.errstate(invalid="ignore", divide="ignore"):
                allowed = ALONG * tolerance * share
        if halving == 0:
            most = allowed[:, design] * np.maximum(1 / span[design], 0.01 / weight)
            with np.errstate(divide="ignore", invalid="ignore"):
                # What an inverse square root has within `NEAREST` of the boundary.
                noise = np.sqrt(NEAREST * outer / (outer - inner)) * np.abs(found)
        rough = doubt > np.maximum(most[:, ray], noise)
        split = rough.any(axis=0) & (halving < MOST_HALVINGS - 1)
        for k in range(2):
            value[k] += np.bincount(ray[~split], found[k, ~split], len(theta))
            error[k] += np.bincount(ray[~split], doubt[k, ~split], len(theta))
        if not split.any():
            break
        ray, inner, outer, start, stop = (v[split] for v in (ray, inner, outer, start, stop))
        at = np.where(rough[0, split], _ridge(smooth[:, split]), 0.0)
        at = 0.5 * (start + stop) + 0.5 * (stop - start) * at
        step = 0.01 * (stop - start)
        around = at + step * np.array([-1.0, 0.0, 1.0])[:, None]
        z = designs.about + _spread(inner, outer, around, RADIUS_MAP)[0] * np.exp(1j * theta[ray])
        low, mid, high = _isotropy(designs.field.indices(z, designs.of(design[ray]))[0])
        with np.errstate(divide="ignore", invalid="ignore"):
            shift = 0.5 * (low - high) / (low + high - 2 * mid)
        at = np.where((np.abs(shift) < 1) & (np.abs(at - 0.5 * (start + stop)) > 0), at + step * shift, at)
        ray, inner, outer, noise = (np.concatenate([v, v], axis=-1) for v in (ray, inner, outer, noise[:, split]))
        start, stop = np.concatenate([start, at]), np.concatenate([at, stop])
    return value, error, allowed


def segments(
    designs: Designs, design: Ints, theta: Floats, inner: Floats, outer: Floats, start: Floats, stop: Floats
) -> tuple[Floats, Floats, Floats]:
    """Integrals of index times radius over parts of intervals and their errors (2, segments), and what shows ridges."""
    found, doubt = np.empty((2, len(theta))), np.empty((2, len(theta)))
    smooth = np.empty((len(RADII.nodes), len(theta)))
    for k in range(0, len(theta), BLOCK):
        at = slice(k, k + BLOCK)
        middle, half = 0.5 * (start[at] + stop[at]), 0.5 * (stop[at] - start[at])
        r, density = _spread(inner[at], outer[at], middle + half * RADII.nodes[:, None], RADIUS_MAP)
        # In an interval so narrow, rounding leaves nothing of the closures: it only exists at a cusp.
        measure = np.where(outer[at] - inner[at] > 100 * NEAREST * outer[at], r * density * half, 0.0)
        gap = np.minimum(NEAREST * outer[at], 0.5 * (outer[at] - inner[at]))
        r = np.clip(r, inner[at] + gap, outer[at] - gap)
        z = designs.about + r * np.exp(1j * theta[at])
        condition, resistivity, _ = designs.field.indices(z, designs.of(design[at]))
        for index, values in enumerate((condition, resistivity)):
            # On the boundary itself, where rounding leaves an interval of no width, an index has no value.
            product = np.where(np.isfinite(values), values, 0.0) * measure
            found[index, at], doubt[index, at] = RADII.apply(product)
        smooth[:, at] = _isotropy(condition)
        doubt[0, at] += _hidden(smooth[:, at], measure)
    return found, doubt, smooth


def _ridge(smooth: Floats) -> Floats:
    """Where the inverse condition c is largest along segments, within (-1, 1) of each; the middle if at an end.

    At isotropy c has a kink (the singular values cross), but ((1 - c)/(1 + c))^2, of which `smooth` holds the values at
    the nodes, has none: the least value of its polynomial is found by Newton's method, begun at the lowest node. A kink
    that the split misses by a little would hide between a segment's end and its last node, where no rule can see it.
    """
    degrees = len(RADII.nodes)
    spectrum = RADII.spectrum @ smooth
    x = RADII.nodes[np.clip(smooth.argmin(axis=0), 1, degrees - 2)]
    span = 0.5 * (RADII.nodes[2:] - RADII.nodes[:-2]).max()
    begun = x
    with np.errstate(divide="ignore", invalid="ignore"):
        for _ in range(6):
            slope, bend = _derivatives(spectrum, x)
            x = np.clip(x - slope / np.abs(bend), begun - span, begun + span)
    return np.where(np.abs(x) < 0.9, x, 0.0)


def _hidden(smooth: Floats, measure: Floats) -> Floats:
    """What a ridge of the inverse condition at either end of segments may hide from the rule.

    With w = ((1 - c)/(1 + c))^2 about W + B x^2 near the ridge, c is about 1 - 2 sqrt(w), a hyperbola whose rounded tip
    (of width sqrt(W/B)), and whose part beyond a tip that the split missed, lie between the end and the nearest node.
    """
    total = np.zeros(smooth.shape[1])
    values = _ENDS @ smooth
    for end, (w, slope, curve) in enumerate((values[:3], values[3:])):
        with np.errstate(divide="ignore", invalid="ignore"):
            bend = np.maximum(0.5 * curve, 0.0)
            tip = (np.abs(w) + 0.25 * slope * slope / bend) / np.sqrt(bend)
            unseen = (w < 0.02 * bend) & np.isfinite(tip)
        total += 4 * np.where(unseen, tip, 0.0) * measure[-end]
    return total


def _isotropy(condition: Floats) -> Floats:
    distance = (1 - condition) / (1 + condition)
    return np.where(np.isfinite(distance), distance * distance, 1.0)


def _derivatives(spectrum: Floats, x: Floats) -> tuple[Floats, Floats]:
    """First and second derivatives at `x` of Legendre series, one a column."""
    before, now = np.ones_like(x), x
    slope_before, slope_now = np.zeros_like(x), np.ones_like(x)
    bend_before, bend_now = np.zeros_like(x), np.zeros_like(x)
    slope, bend = spectrum[1].copy(), np.zeros_like(x)
    for k in range(1, len(spectrum) - 1):
        # P'(k+1) = P'(k-1) + (2k + 1) P(k), and the same once more.
        before, now = now, ((2 * k + 1) * x * now - k * before) / (k + 1)
        bend_before, bend_now = bend_now, bend_before + (2 * k + 1) * slope_now
        slope_before, slope_now = slope_now, slope_before + (2 * k + 1) * before
        slope += spectrum[k + 1] * slope_now
        bend += spectrum[k + 1] * bend_now
    return slope, bend


ANGLE_MAP, RADIUS_MAP = _quartic, _cosine


def simple_means(
    designs: Designs, reach: Floats, samples: int, theta: Floats, fractions: Floats, by_area: bool
) -> Floats:
    """Means of the indices (2, designs) by fixed nodes: the sums that papers use, for comparison.

    Parameters
    ----------
    theta : ndarray
        Directions of equal weight.
    fractions : ndarray
        Nodes of each interval, as fractions of its width.
    by_area : bool
        Nodes weighted by their radius (the midpoint rule for the area integral), or equally within each sector
        [S1, Tables 1 and 2]; sectors are weighted by outer^2 - inner^2 either way.
    """
    design, angle = np.repeat(np.arange(designs.count), len(theta)), np.tile(theta, designs.count)
    intervals = trace(designs, design, angle, reach[design], samples)
    owner = design[intervals.ray]
    sector = (intervals.outer - intervals.inner) * (intervals.outer + intervals.inner)
    total = np.zeros((2, len(owner)))
    block = max(1, BLOCK * len(RADII.nodes) // len(fractions))
    for k in range(0, len(owner), block):
        at = slice(k, k + block)
        r = intervals.inner[at] + fractions[:, None] * (intervals.outer - intervals.inner)[at]
        z = designs.about + r * np.exp(1j * angle[intervals.ray[at]])
        weight = r / r.sum(axis=0) if by_area else np.full(r.shape, 1 / len(fractions))
        for index, found in enumerate(designs.field.indices(z, designs.of(owner[at]))[:2]):
            product = found * weight
            total[index, at] = np.where(np.isfinite(product), product, 0.0).sum(axis=0)
    area = np.bincount(owner, sector, designs.count)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.stack([np.bincount(owner, row * sector, designs.count) for row in total]) / area
