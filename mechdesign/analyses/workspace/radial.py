"""Integrals of the local indices along rays, refined where an index has a kink or grows without bound."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.analyses.region.rays import Designs, Intervals, clearances
from mechdesign.analyses.region.rules import Rule, cosine
from mechdesign.analyses.workspace.integrands import Integrand
from mechdesign.analyses.workspace.local import Local
from mechdesign.mechanism.algebra import Value
from mechdesign.numerics.arrays import Flags, Floats, Ints

RADII = Rule.of(11, 2, 0.5)
# Pieces evaluated at once (11 nodes each).
BLOCK = 4096
MOST_SPLITS = 12
# Nearer to the boundary than this fraction of the radius, rounding spoils an index that is infinite there.
NEAREST = 3e-14
# Spread of the three places that a ridge is fitted to, as a fraction of the segment.
FIT = 0.01
# A segment is split at a ridge that lies within this share of it, else in the middle.
INSIDE = 0.9

# A ridge is a kink where w = W + B x^2 has W below this share of B.
SHARP = 0.25
# Pieces with w above this everywhere have no ridge that would matter (inverse condition below 0.39).
FLAT = 0.2
NEWTON_STEPS = 3

# A singularity nearer to an interval than this share of its width needs the interval in two halves.
NEAR = 0.5

# Integrals and their estimated errors (integrands, pieces); the place of the kink, in [-1, 1], and whether that is a
# forward singularity (pieces).
Integrals = tuple[Floats, Floats, Floats, Flags]


@dataclass(frozen=True, eq=False)
class Pieces:
    """Parts of intervals of rays, each with a map from v in [start, stop] of [0, 1] to the radius.

    A whole interval has r = inner + (outer - inner) (1 - cos pi v)/2, which makes inverse square roots at its ends
    smooth. Where a further singularity lies just beyond an end, at a distance e, the interval is in two halves, each
    with r = end -+ e sinh(k v)^2: the product of inverse square roots in the distances to both is constant in v.

    Parameters
    ----------
    ray : ndarray of int, shape (n,)
    origin, span : ndarray
        End of the interval and (signed) extent of the part's map from there.
    steep : ndarray
        k above; 0 for the cosine's map.
    start, stop : ndarray
        Range of v.
    """

    ray: Ints
    origin: Floats
    span: Floats
    steep: Floats
    start: Floats
    stop: Floats

    def pick(self, index: Flags | Ints | slice) -> Pieces:
        """Pieces by index."""
        return Pieces(*(getattr(self, name)[index] for name in self.__dataclass_fields__))

    def split(self, at: Floats) -> Pieces:
        """Every piece as two, split at the values `at` of v; all first parts come first."""
        twice = self.pick(np.tile(np.arange(len(at)), 2))
        return replace(twice, start=np.concatenate([self.start, at]), stop=np.concatenate([at, self.stop]))

    def radius(self, v: Floats) -> tuple[Floats, Floats]:
        """Radius at `v` and its slope, without cancellation near the ends; `v` has a leading axis of nodes."""
        bent = np.flatnonzero(self.steep)
        near, slope = cosine(np.minimum(v, 1 - v))
        share = np.where(v < 0.5, near, 0.0)
        # From the far end of a whole interval, from the origin else.
        radius = np.where(v < 0.5, self.origin + self.span * share, self.origin + self.span - self.span * near)
        slope = slope * np.abs(self.span)
        if bent.size:
            k = self.steep[bent]
            rise, scale = np.sinh(k * v[:, bent]), 1 / np.sinh(k) ** 2
            radius[:, bent] = self.origin[bent] + self.span[bent] * scale * rise * rise
            slope[:, bent] = np.abs(self.span[bent]) * 2 * k * scale * rise * np.sqrt(1 + rise * rise)
        return radius, slope

    @property
    def limits(self) -> tuple[Floats, Floats]:
        """Least and largest radius of the maps."""
        return np.minimum(self.origin, self.origin + self.span), np.maximum(self.origin, self.origin + self.span)


def pieces(intervals: Intervals, reach: Floats, singular: Flags) -> Pieces:
    """The intervals of rays, in halves where a further singularity (of the margins `singular`) is near an end."""
    below, above = clearances(intervals, reach, singular)
    inner, outer = intervals.inner, intervals.outer
    width = outer - inner
    # Where intervals are as thin as rounding, nothing is gained.
    halved = (np.minimum(below, above) < NEAR * width) & (width > 1e3 * NEAREST * outer)
    whole, half = np.flatnonzero(~halved), np.flatnonzero(halved)
    length = 0.5 * width[half]
    steep = [np.arcsinh(np.sqrt(length / np.minimum(gap[half], 1e3 * length))) for gap in (below, above)]
    count = len(whole) + 2 * len(half)
    return Pieces(
        np.concatenate([intervals.ray[whole], intervals.ray[half], intervals.ray[half]]),
        np.concatenate([inner[whole], inner[half], outer[half]]),
        np.concatenate([width[whole], length, -length]),
        np.concatenate([np.zeros(len(whole)), *steep]),
        np.zeros(count),
        np.ones(count),
    )


def along(
    designs: Designs,
    integrands: Sequence[Integrand],
    design: Ints,
    theta: Floats,
    parts: Pieces,
    pilot: Integrals,
    allowed: Floats,
) -> tuple[Floats, Floats, Ints]:
    """Integrals along rays and their estimated errors, both of shape (integrands, rays), and the places looked at.

    Parameters
    ----------
    design, theta : ndarray, shape (rays,)
    pilot : Integrals
        Of `parts`, as evaluated by `evaluate`.
    allowed : ndarray, shape (integrands, rays)
        Error that a piece may have; those with a larger one are split: at a forward singularity, at the ridge where
        singular values meet where this is what errs, else in the middle.
    """
    count = len(integrands)
    kinked = np.array([integrand.kinked for integrand in integrands])
    value, error = np.zeros((count, len(theta))), np.zeros((count, len(theta)))
    found, doubt, place, crossed = pilot
    looked = np.bincount(parts.ray, minlength=len(theta))
    low, high = parts.limits
    with np.errstate(divide="ignore", invalid="ignore"):
        # What an inverse square root has within `NEAREST` of the boundary.
        noise = np.sqrt(NEAREST * high / (high - low)) * np.abs(found)
    for splits in range(MOST_SPLITS + 1):
        ray = parts.ray
        rough = doubt > np.maximum(allowed[:, ray], noise)
        split = rough.any(axis=0) & (splits < MOST_SPLITS)
        for k in range(count):
            value[k] += np.bincount(ray[~split], found[k, ~split], len(theta))
            error[k] += np.bincount(ray[~split], doubt[k, ~split], len(theta))
        if not split.any():
            break
        at = crossed | (rough[kinked].any(axis=0) & (np.abs(place) < INSIDE))
        share = np.where(at, place, 0.0)[split]
        parts = parts.pick(split)
        parts = parts.split(_refined(designs, design[parts.ray], theta[parts.ray], parts, share, crossed[split]))
        noise = np.concatenate([noise[:, split]] * 2, axis=1)
        looked += np.bincount(parts.ray, minlength=len(theta))
        found, doubt, place, crossed = evaluate(designs, integrands, design[parts.ray], theta[parts.ray], parts)
    return value, error, looked * len(RADII.nodes)


def _refined(designs: Designs, design: Ints, theta: Floats, parts: Pieces, share: Floats, crossed: Flags) -> Floats:
    """Where to split: the ridge or singularity near `share` (of [-1, 1]) of pieces; the middle where that is 0."""
    at = 0.5 * (parts.start + parts.stop) + 0.5 * (parts.stop - parts.start) * share
    ridges = np.flatnonzero(share)
    if not ridges.size:
        return at
    step = FIT * (parts.stop - parts.start)[ridges]
    around = at[ridges] + step * np.array([-1.0, 0.0, 1.0])[:, None]
    z = designs.about + parts.pick(ridges).radius(around)[0] * np.exp(1j * theta[ridges])
    with np.errstate(divide="ignore", invalid="ignore"):
        local = Local.at(designs.field, z, designs.of(design[ridges]))
        low, middle, high = local.roundness
        shift = 0.5 * (low - high) / (low + high - 2 * middle)
        low, middle, high = np.broadcast_to(1 / local.determinant, z.shape)
        shift = np.where(crossed[ridges], 2 * middle / (low - high), shift)
    at[ridges] += step * np.where(np.abs(shift) < 1, shift, 0.0)
    return at


def evaluate(
    designs: Designs, integrands: Sequence[Integrand], design: Ints, theta: Floats, parts: Pieces
) -> Integrals:
    """Integrals of indices times radius over pieces, their errors (integrands, pieces), and where to split."""
    found, doubt = np.empty((2, len(integrands), len(theta)))
    places, crossed = np.zeros(len(theta)), np.zeros(len(theta), dtype=bool)
    for k in range(0, len(theta), BLOCK):
        at = slice(k, k + BLOCK)
        part = parts.pick(at)
        middle, half = 0.5 * (part.start + part.stop), 0.5 * (part.stop - part.start)
        r, slope = part.radius(middle + half * RADII.nodes[:, None])
        low, high = part.limits
        # In an interval so narrow, rounding leaves nothing of the closures: it only exists at a cusp.
        measure = np.where(high - low > 100 * NEAREST * high, r * slope * half, 0.0)
        gap = np.minimum(NEAREST * high, 0.5 * (high - low))
        z = designs.about + np.clip(r, low + gap, high - gap) * np.exp(1j * theta[at])
        local = Local.at(designs.field, z, designs.of(design[at]))
        ridge: _Ridge | None = None
        for j, integrand in enumerate(integrands):
            value, kink = integrand(local)
            if kink is None:
                found[j, at], doubt[j, at] = RADII.apply(value * measure)
                continue
            if ridge is None:
                ridge = _Ridge.of(local.roundness)
                places[at] = ridge.place
            found[j, at], doubt[j, at] = ridge.integral(value, kink, measure)
        if not designs.field.same_assembly:
            grip = np.broadcast_to(local.determinant, r.shape)
            crossed[at] = (grip > 0).any(axis=0) & (grip < 0).any(axis=0)
            # Where rounding leaves nothing of the determinant, at a cusp, its sign tells no place.
            mixed = np.flatnonzero(crossed[at] & (grip != 0).all(axis=0))
            places[k + mixed] = _sign_change(1 / grip[:, mixed])
    return found, doubt, places, crossed


def _sign_change(values: Floats) -> Floats:
    """A root of the polynomials through `values` at the nodes, by Newton's method from between two nodes."""
    first = np.argmax(np.signbit(values[1:]) != np.signbit(values[:-1]), axis=0)
    lane = np.arange(values.shape[1])
    a, b = values[first, lane], values[first + 1, lane]
    low, high = RADII.nodes[first], RADII.nodes[first + 1]
    spectrum = RADII.spectrum @ values
    with np.errstate(divide="ignore", invalid="ignore"):
        x = low + (high - low) * a / (a - b)
        for _ in range(NEWTON_STEPS):
            value, slope = _series(spectrum, x, 1)
            x = np.clip(x - value / slope, low, high)
    return np.asarray(np.where(np.isfinite(x), x, 0.5 * (low + high)))


@dataclass(frozen=True, eq=False)
class _Ridge:
    """Where singular values meet, on each segment of a batch.

    There an index f has a kink, but w = ((sigma_max - sigma_min)/(sigma_max + sigma_min))^2 has none, and
    f = s + k sqrt(w) with smooth s and k. So with w about W + B x^2 + C x^3 at the place x = 0 where it is least, and
    q = -k measure, all of the kink but its third order is in g = (q + (q' + q C/2B) x) sqrt(W + B x^2). What the rule
    integrates is f measure + g; the integral of g is closed and taken off again, so that g need not be exact.

    Parameters
    ----------
    rows : ndarray of int
        Segments on which w comes near zero; what follows is theirs.
    at, value, bend, third : ndarray, shape (rows,)
        Place of the least w in [-1, 1], W, and second and third derivative there.
    unseen : ndarray, shape (rows,)
        What W is not known to.
    place : ndarray
        Of all segments; 0 where there is none.
    """

    rows: Ints
    at: Floats
    value: Floats
    bend: Floats
    third: Floats
    unseen: Floats
    place: Floats

    @staticmethod
    def of(roundness: Value) -> _Ridge:
        """The ridges of w at the nodes, shape (nodes, segments)."""
        w = np.where(np.isfinite(roundness), roundness, 1.0)
        rows = np.flatnonzero(w.min(axis=0) < FLAT)
        spectrum = RADII.spectrum @ w[:, rows]
        at = _least(w[:, rows], spectrum)
        value, _, bend, third = _series(spectrum, at, 3)
        last, decay = RADII.tail(spectrum)
        place = np.zeros(w.shape[1])
        place[rows] = at
        return _Ridge(rows, at, value, bend, third, last * decay, place)

    def integral(self, values: Floats, kink: Floats, measure: Floats) -> tuple[Floats, Floats]:
        """Integrals of an index times `measure` over the segments, and their errors."""
        total, doubt = RADII.apply(values * measure)
        if self.rows.size:
            rows = self.rows
            total[rows], doubt[rows] = self._kinked(values[:, rows], kink[:, rows], measure[:, rows])
        return total, doubt

    def _kinked(self, values: Floats, kink: Floats, measure: Floats) -> tuple[Floats, Floats]:
        q, q_slope = _series(RADII.spectrum @ (-kink * measure), self.at, 1)
        b = 0.5 * self.bend
        sharp = (b > 0) & (self.value < SHARP * b)
        b, floor = np.where(sharp, b, 1.0), np.maximum(self.value, 1e-24)
        a0 = np.where(sharp, q, 0.0)
        a1 = np.where(sharp, q_slope + q * self.third / (12 * b), 0.0)
        x = RADII.nodes[:, None] - self.at
        total, doubt = RADII.apply(values * measure + (a0 + a1 * x) * np.sqrt(floor + b * x * x))
        root = np.sqrt(b)
        for sign, end in ((-1, 1 - self.at), (1, -1 - self.at)):
            height = np.sqrt(floor + b * end * end)
            area = 0.5 * (end * height + floor / root * np.arcsinh(end * root / np.sqrt(floor)))
            total = total + sign * (a0 * area + a1 * height**3 / (3 * b))
        # What W is not known to is the height of a tip that may lie between two nodes, unseen.
        return total, doubt + 4 * np.abs(a0) * self.unseen / root


def _least(w: Floats, spectrum: Floats) -> Floats:
    """Where the polynomials through `w` at the nodes are least, by Newton's method from the lowest node."""
    x = RADII.nodes[w.argmin(axis=0)]
    begun, span = x, 0.6 * np.diff(RADII.nodes).max()
    with np.errstate(divide="ignore", invalid="ignore"):
        for _ in range(NEWTON_STEPS):
            _, slope, bend = _series(spectrum, x, 2)
            x = np.clip(x - slope / np.abs(bend), begun - span, begun + span)
    return np.asarray(np.where(np.isfinite(x), x, begun))


def _series(spectrum: Floats, x: Floats, orders: int) -> list[Floats]:
    """Values and derivatives at `x` of Legendre series, one a column, up to the order asked for.

    By P'(k+1) = P'(k-1) + (2k + 1) P(k), differentiated as often as needed.
    """
    zeros = [np.zeros_like(x) for _ in range(orders - 1)]
    before, now = [np.ones_like(x), np.zeros_like(x), *zeros], [x, np.ones_like(x), *zeros]
    sums = [spectrum[0] + spectrum[1] * x, spectrum[1].copy(), *(zero.copy() for zero in zeros)]
    for k in range(1, len(spectrum) - 1):
        after = [((2 * k + 1) / (k + 1)) * (x * now[0]) - (k / (k + 1)) * before[0]]
        after += [before[j] + (2 * k + 1) * now[j - 1] for j in range(1, orders + 1)]
        for total, term in zip(sums, after, strict=True):
            total += spectrum[k + 1] * term
        before, now = now, after
    return sums
