"""Where rays about a point run inside the region: intervals between the roots of the margins.

The region is where all margins of a `Field` are positive. Along a ray every margin is followed by itself, not only the
smallest one: two margins that cross zero close together (a cusp of the region) bracket a thin interval exactly, however
coarse the scan, and margins that are differences of squared distances are quadratic, so that few samples find all
their roots.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.field import Field, Places
from mechdesign.analyses.roots import bracketed_roots

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
# Rays traced at once: with 16 samples a ray and complex numbers the temporaries stay in the second-level cache.
BLOCK = 1024
ROUNDING = 1e-14
# Roots nearer than this (relative to the reach) are the same boundary; of several margins the first is named.
SAME = 1e-9


@dataclass(frozen=True, eq=False)
class Designs:
    """Several designs of one mechanism, scanned about one point.

    Parameters
    ----------
    places : mapping of str to ndarray, shape (designs,)
        Dimensions that differ from the nominal ones.
    count : int
        Number of designs.
    about : complex
        Where the rays start.
    """

    field: Field
    places: Places
    count: int
    about: complex

    def of(self, index: Ints) -> Places:
        """Dimensions of the designs `index`, in the shape of `index`."""
        return {name: np.asarray(value)[index] for name, value in self.places.items()}


@dataclass(frozen=True, eq=False)
class Intervals:
    """Inside intervals of rays, ordered by ray and radius.

    Parameters
    ----------
    ray : ndarray of int, shape (n,)
        Ray of each interval.
    inner, outer : ndarray, shape (n,)
        Radii where it begins and ends.
    enters, leaves : ndarray of int, shape (n,)
        Margin that is zero there; -1 where it begins at the centre or is not closed within the reach.
    beyond : ndarray of bool, shape (rays,)
        Rays still inside at their reach.
    crossings : (ray, radius, margin, direction)
        All roots of all margins; direction +1 where the margin becomes positive.
    """

    ray: Ints
    inner: Floats
    outer: Floats
    enters: Ints
    leaves: Ints
    beyond: NDArray[np.bool_]
    crossings: tuple[Ints, Floats, Ints, Ints]

    @property
    def counts(self) -> Ints:
        """Intervals of each ray."""
        return np.bincount(self.ray, minlength=len(self.beyond))


def trace(designs: Designs, design: Ints, theta: Floats, reach: Floats, samples: int, slack: float = 0.0) -> Intervals:
    """Intersect rays with the region.

    Parameters
    ----------
    design, theta, reach : ndarray, shape (rays,)
        Design, direction (radians) and length of each ray.
    samples : int
        Equal steps of the scan along a ray.
    slack : float
        Intervals that rounding closed, up to this fraction of the reach, are kept (for rays through a cusp).
    """
    parts = [
        _trace_block(designs, design[k : k + BLOCK], theta[k : k + BLOCK], reach[k : k + BLOCK], samples, slack)
        for k in range(0, len(theta), BLOCK)
    ]
    if len(parts) == 1:
        return parts[0]
    starts = np.arange(len(parts)) * BLOCK

    def join(name: str) -> NDArray[np.generic]:
        return np.concatenate([getattr(part, name) for part in parts])

    crossings = tuple(np.concatenate([part.crossings[k] for part in parts]) for k in range(4))
    lengths = [len(part.crossings[0]) for part in parts]
    return Intervals(
        join("ray") + np.repeat(starts, [len(part.ray) for part in parts]), join("inner"), join("outer"),
        join("enters"), join("leaves"), join("beyond"),
        (crossings[0] + np.repeat(starts, lengths), *crossings[1:]),
    )  # fmt: skip


def _trace_block(designs: Designs, design: Ints, theta: Floats, reach: Floats, samples: int, slack: float) -> Intervals:
    field, direction = designs.field, np.exp(1j * theta)
    places = designs.of(design)
    fractions = np.linspace(0.0, 1.0, samples + 1)
    # At the centre itself a margin may be exactly zero, which says nothing about the ray.
    fractions[0] = SAME
    radii = fractions[:, None] * reach
    values = field.margins(designs.about + radii * direction, places)
    positive = values > 0

    def evaluate(margin: Ints, ray: Ints, radius: Floats) -> Floats:
        z = designs.about + radius * direction[ray]
        all_margins = field.margins(z, {name: value[ray] for name, value in places.items()})
        return all_margins[margin, np.arange(len(ray))]

    def roots(m: Ints, ray: Ints, *bracket: Floats) -> Floats:
        return bracketed_roots(lambda which, x: evaluate(m[which], ray[which], x), *bracket, ROUNDING * reach[ray])

    # Ordinary changes of sign between neighbouring samples.
    known = np.isfinite(values)
    margin, cell, ray = np.nonzero((positive[:, 1:] != positive[:, :-1]) & known[:, 1:] & known[:, :-1])
    third = np.where(cell > 0, cell - 1, np.minimum(cell + 2, samples))

    def sample(k: Ints) -> tuple[Floats, Floats]:
        return radii[k, ray], values[margin, k, ray]

    found = [(margin, ray, np.where(positive[margin, cell + 1, ray], 1, -1),
              roots(margin, ray, *sample(cell), *sample(cell + 1), *sample(third)))]  # fmt: skip
    found += _dips(values, radii, evaluate, roots)
    if known.all():
        negative = (~positive[:, 0]).sum(axis=0)
    else:
        more, negative = _open_ends(values, radii, found, evaluate, roots)
        found += more
    margin, ray, turn, radius = (np.concatenate([part[k] for part in found]) for k in range(4))
    return _intervals(margin, ray, turn, radius, negative, reach, slack)


def _dips(values, radii, evaluate, roots):  # type: ignore[no-untyped-def]
    """Pairs of roots of one margin between two samples of equal sign, where its parabola crosses zero."""
    low, mid, high = values[:, :-2], values[:, 1:-1], values[:, 2:]
    with np.errstate(invalid="ignore", divide="ignore"):
        bend, tilt = low + high - 2 * mid, 0.5 * (high - low)
        vertex = -tilt / bend
        depth = (mid + 0.5 * tilt * vertex) * mid
        same = (low * mid > 0) & (high * mid > 0)
        near = np.abs(vertex) <= 0.5
        near[:, 0] |= np.abs(vertex[:, 0] + 0.5) <= 0.5
        near[:, -1] |= np.abs(vertex[:, -1] - 0.5) <= 0.5
        margin, cell, ray = np.nonzero(same & near & (depth < 0))
    if not margin.size:
        return []
    step = radii[1, ray]
    cell = cell + 1
    radius = radii[cell, ray] + vertex[margin, cell - 1, ray] * step
    value = evaluate(margin, ray, radius)
    real = (value > 0) != (values[margin, cell, ray] > 0)
    margin, cell, ray, radius, value = margin[real], cell[real], ray[real], radius[real], value[real]
    left = np.where(radius < radii[cell, ray], cell - 1, cell)
    found = []
    for end, other in ((left, left + 1), (left + 1, left)):
        a, fa = radii[end, ray], values[margin, end, ray]
        c, fc = radii[other, ray], values[margin, other, ray]
        order = end < other
        lo, flo, hi, fhi = (np.where(order, p, q) for p, q in ((a, radius), (fa, value), (radius, a), (value, fa)))
        found.append((margin, ray, np.where(fhi > 0, 1, -1), roots(margin, ray, lo, flo, hi, fhi, c, fc)))
    return found


def _open_ends(values, radii, found, evaluate, roots):  # type: ignore[no-untyped-def]
    """Roots of margins that are known at only one end of a cell, because another margin ends the assembly there.

    The margin is followed up to that other root; beyond it the pose cannot be assembled, and its sign does not matter.
    """
    positive, known = values > 0, np.isfinite(values)
    margin, cell, ray = np.nonzero((positive[:, 1:] & ~known[:, :-1]) | (positive[:, :-1] & ~known[:, 1:]))
    first_exit = np.full((values.shape[1] - 1, values.shape[2]), np.inf)
    last_entry = np.full(first_exit.shape, -np.inf)
    for _, other_ray, turn, radius in found:
        where = np.clip((radius / radii[1, other_ray]).astype(int), 0, len(first_exit) - 1)
        down = turn < 0
        np.minimum.at(first_exit, (where[down], other_ray[down]), radius[down])
        np.maximum.at(last_entry, (where[~down], other_ray[~down]), radius[~down])
    rising = positive[margin, cell + 1, ray]
    known_end = np.where(rising, cell + 1, cell)
    stop = np.where(rising, last_entry[cell, ray], first_exit[cell, ray])
    a, fa = radii[known_end, ray], values[margin, known_end, ray]
    blind = ~np.isfinite(stop)
    # Just inside the other root: the square roots there need a distance well above rounding.
    with np.errstate(invalid="ignore"):
        b = np.where(blind, radii[np.where(rising, cell, cell + 1), ray], stop + (a - stop) * 1e-7)
    fb = evaluate(margin, ray, b)
    crossing = ~(fb > 0)
    margin, cell, ray, rising, a, fa, b, fb = (v[crossing] for v in (margin, cell, ray, rising, a, fa, b, fb))
    none = np.full(len(a), np.nan)
    lo, flo, hi, fhi = (np.where(rising, p, q) for p, q in ((b, a), (fb, fa), (a, b), (fa, fb)))
    crossed = np.zeros(positive[:, 1:].shape, dtype=bool)
    crossed[margin, cell, ray] = True
    found = [(margin, ray, np.where(rising, 1, -1), roots(margin, ray, lo, flo, hi, fhi, none, none))]
    gaps, negative = _gaps(positive, known, crossed, radii)
    return [*found, gaps], negative


def _gaps(positive, known, crossed, radii):  # type: ignore[no-untyped-def]
    """Changes of sign across stretches where a margin is unknown, and the margins that are negative at the centre."""
    last = np.maximum.accumulate(np.where(known, np.arange(known.shape[1])[:, None], -1), axis=1)
    margin, cell, ray = np.nonzero(known[:, 1:] & ~known[:, :-1])
    end = cell + 1
    after = positive[margin, end, ray] & ~crossed[margin, cell, ray]
    begin = last[margin, cell, ray]
    before = positive[margin, begin, ray] & ~crossed[margin, np.minimum(begin, crossed.shape[1] - 1), ray]
    start = ~positive[:, 0] & known[:, 0]
    initial = begin < 0
    start[margin[initial], ray[initial]] = ~after[initial]
    change = ~initial & (before != after)
    margin, ray, begin, end, after = (v[change] for v in (margin, ray, begin, end, after))
    middle = 0.5 * (radii[begin, ray] + radii[end, ray])
    return (margin, ray, np.where(after, 1, -1), middle), start.sum(axis=0)


def _intervals(
    margin: Ints, ray: Ints, turn: Ints, radius: Floats, start: Ints, reach: Floats, slack: float
) -> Intervals:
    """Put the roots of each ray in order and keep the stretches where no margin is negative."""
    rays = len(reach)
    key = radius + np.where(turn < 0, slack * reach[ray], 0.0)
    order = np.lexsort((margin, -turn, key, ray))
    margin, ray, turn, radius = margin[order], ray[order], turn[order], radius[order]
    first = np.searchsorted(ray, np.arange(rays))
    total = np.cumsum(-turn)
    before = np.where(first > 0, total[first - 1], 0) if len(total) else np.zeros(rays, dtype=int)
    negative = total - before[ray] + start[ray]
    # An interval begins at a root after which nothing is negative, or at the centre.
    begins = np.nonzero(negative == 0)[0]
    central = np.nonzero(start == 0)[0]
    ends = np.append(ray, -1)
    after = begins + 1
    closed = ends[after] == ray[begins]
    inner = np.concatenate([np.zeros(len(central)), radius[begins]])
    enters = np.concatenate([np.full(len(central), -1), margin[begins]])
    owner = np.concatenate([central, ray[begins]])
    has = ends[np.minimum(first[central], len(ray))] == central
    last = np.concatenate([np.where(has, first[central], -1), np.where(closed, after, -1)]).astype(np.intp)
    outer = np.where(last >= 0, np.append(radius, 0.0)[last], reach[owner])
    leaves = np.where(last >= 0, np.append(margin, -1)[last], -1)
    sort = np.lexsort((inner, owner))
    owner, inner, outer, enters, leaves = (v[sort] for v in (owner, inner, outer, enters, leaves))
    beyond = np.zeros(rays, dtype=bool)
    beyond[owner[leaves < 0]] = True
    tie = SAME * reach
    enters = _first_named(owner, inner, enters, margin[turn > 0], ray[turn > 0], radius[turn > 0], tie)
    leaves = _first_named(owner, outer, leaves, margin[turn < 0], ray[turn < 0], radius[turn < 0], tie)
    return Intervals(owner, inner, np.maximum(outer, inner), enters, leaves, beyond, (ray, radius, margin, turn))


def _first_named(owner: Ints, at: Floats, label: Ints, margin: Ints, ray: Ints, radius: Floats, tie: Floats) -> Ints:
    """The first of the margins that end an interval at the same place, so that rounding does not choose the name."""
    best = label.copy()
    begin = np.searchsorted(ray, owner)
    end = np.searchsorted(ray, owner, side="right")
    for k in range(int(np.max(end - begin, initial=0))):
        at_k = np.minimum(begin + k, max(len(ray) - 1, 0))
        match = (begin + k < end) & (label >= 0)
        match[match] = np.abs(radius[at_k[match]] - at[match]) <= tie[owner[match]]
        best[match] = np.minimum(best[match], margin[at_k[match]])
    return best
