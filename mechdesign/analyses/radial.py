"""Integrals of the local indices along rays, refined where an index has a kink or grows without bound."""

from __future__ import annotations

import numpy as np

from mechdesign.analyses.rays import Designs, Floats, Intervals, Ints
from mechdesign.analyses.rules import Rule, cosine, end_values, spread

RADII = Rule.of(9, 2, 0.5)
_ENDS = end_values(RADII)
# Segments of rays evaluated at once (9 nodes each).
BLOCK = 4096
MOST_SPLITS = 12
# Nearer to the boundary than this fraction of the radius, rounding spoils an index that is infinite there.
NEAREST = 3e-14
# Spread of the three places that a ridge is fitted to, as a fraction of the segment.
FIT = 0.01

# Integrals and their estimated errors (2, segments), and what shows ridges (nodes, segments).
Segments = tuple[Floats, Floats, Floats]


def along(
    designs: Designs, design: Ints, theta: Floats, intervals: Intervals, pilot: Segments, allowed: Floats
) -> tuple[Floats, Floats]:
    """Integrals of the indices along rays and their estimated errors, both of shape (2, rays).

    Parameters
    ----------
    design, theta : ndarray, shape (rays,)
    pilot : Segments
        The whole intervals, as evaluated by `segments`.
    allowed : ndarray, shape (2, rays)
        Error that a segment may have; those with a larger one are split, at the ridge of the inverse condition where
        this is what errs, else in the middle.
    """
    value, error = np.zeros((2, len(theta))), np.zeros((2, len(theta)))
    ray, inner, outer = intervals.ray, intervals.inner, intervals.outer
    start, stop = np.zeros(len(ray)), np.ones(len(ray))
    found, doubt, smooth = pilot
    with np.errstate(divide="ignore", invalid="ignore"):
        # What an inverse square root has within `NEAREST` of the boundary.
        noise = np.sqrt(NEAREST * outer / (outer - inner)) * np.abs(found)
    for splits in range(MOST_SPLITS + 1):
        rough = doubt > np.maximum(allowed[:, ray], noise)
        split = rough.any(axis=0) & (splits < MOST_SPLITS)
        for k in range(2):
            value[k] += np.bincount(ray[~split], found[k, ~split], len(theta))
            error[k] += np.bincount(ray[~split], doubt[k, ~split], len(theta))
        if not split.any():
            break
        ray, inner, outer, start, stop = (v[split] for v in (ray, inner, outer, start, stop))
        share = np.where(rough[0, split], _ridge(smooth[:, split]), 0.0)
        at = _refined(designs, design[ray], theta[ray], inner, outer, start, stop, share)
        ray, inner, outer, noise = (np.concatenate([v, v], axis=-1) for v in (ray, inner, outer, noise[:, split]))
        start, stop = np.concatenate([start, at]), np.concatenate([at, stop])
        found, doubt, smooth = segments(designs, design[ray], theta[ray], inner, outer, start, stop)
    return value, error


def _refined(
    designs: Designs,
    design: Ints,
    theta: Floats,
    inner: Floats,
    outer: Floats,
    start: Floats,
    stop: Floats,
    share: Floats,
) -> Floats:
    """Where to split: the ridges near `share` (of [-1, 1]) of segments by a parabola; the middle where that is 0."""
    at = 0.5 * (start + stop) + 0.5 * (stop - start) * share
    ridges = np.flatnonzero(share)
    if not ridges.size:
        return at
    step = FIT * (stop - start)[ridges]
    around = at[ridges] + step * np.array([-1.0, 0.0, 1.0])[:, None]
    z = designs.about + spread(inner[ridges], outer[ridges], around, cosine)[0] * np.exp(1j * theta[ridges])
    low, middle, high = _isotropy(designs.field.indices(z, designs.of(design[ridges]))[0])
    with np.errstate(divide="ignore", invalid="ignore"):
        shift = 0.5 * (low - high) / (low + high - 2 * middle)
    at[ridges] += step * np.where(np.abs(shift) < 1, shift, 0.0)
    return at


def segments(
    designs: Designs, design: Ints, theta: Floats, inner: Floats, outer: Floats, start: Floats, stop: Floats
) -> Segments:
    """Integrals of index times radius over parts of intervals and their errors (2, segments), and what shows ridges."""
    found, doubt = np.empty((2, len(theta))), np.empty((2, len(theta)))
    smooth = np.empty((len(RADII.nodes), len(theta)))
    for k in range(0, len(theta), BLOCK):
        at = slice(k, k + BLOCK)
        middle, half = 0.5 * (start[at] + stop[at]), 0.5 * (stop[at] - start[at])
        r, density = spread(inner[at], outer[at], middle + half * RADII.nodes[:, None], cosine)
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
