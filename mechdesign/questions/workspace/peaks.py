"""Smallest and largest value of local indices over the region of each design, and whether they are infinite.

The search starts from the best of a grid of nodes and closes in on it by smaller and smaller grids, in the maps of
`quadrature` (a panel's angle and an interval's radius over [0, 1]), in which even a root at the boundary is smooth.
Towards the boundary an index may vanish or grow without bound: how it does is read off two places near it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.questions.workspace.index import Prepared
from mechdesign.questions.workspace.local import Local
from mechdesign.questions.workspace.strips import Integrand
from mechdesign.region.panels import Panels
from mechdesign.region.rules import cosine, cubic, spread

# Places in the maps stay this far from the ends: rounding leaves nothing nearer to corners, or to the boundary.
EDGE_U, EDGE_V = 1e-3, 1e-5
# Nodes of the first grid in the maps: angles of each panel, radii of each interval; the ends look into corners.
ANGLES = np.concatenate([[EDGE_U], np.linspace(0.04, 0.96, 11), [1 - EDGE_U]])
RADII = np.concatenate([[0.01], np.linspace(0.07, 0.93, 8), [0.99]])
# Distances from the boundary, as fractions of the interval, between which the power of an index is read off.
NEAR = np.array([1e-8, 1.6e-7])
# Powers of the distance beyond which an index is said to vanish, or to be infinite, at the boundary.
POWER = 0.25
# A determinant so small, as a part of a design's largest, has the sign that rounding gives it (in the tip of a cusp).
ROUNDING = 1e-12
# A search looks at this grid about its best place, smaller by `SHRINK` in every round.
STENCIL = np.linspace(-1.0, 1.0, 5)
SHRINK = 0.35
MOST_ROUNDS = 40
# An extreme in a corner is compared with the value this many times as far from it, in the map.
BACK = 10.0


@dataclass(frozen=True, eq=False)
class Peaks:
    """Extremes of indices, all of shape (indices, designs).

    Parameters
    ----------
    names : sequence of str
        Names of the indices.
    value, error : ndarray, shape (2, indices, designs)
        Infimum and supremum of each index, and their estimated errors; nan where the region is empty.
    order : ndarray, shape (indices, designs)
        n where the index grows as distance^-n towards a singularity, else 0.
    """

    names: Sequence[str]
    value: Floats
    error: Floats
    order: Floats

    def endless(self, integrands: Sequence[Integrand]) -> Flags:
        """Integrals that are infinite: the integrand grows at least as 1/distance towards a curve.

        Of shape (integrands, designs).
        """
        grows = [integrand.power * self.order[self.names.index(integrand.index.name)] >= 1 for integrand in integrands]
        return np.array(grows, dtype=bool).reshape(-1, self.order.shape[1])

    def of(self, name: str, kind: str) -> tuple[Floats, Floats]:
        """Infimum (``min``) or supremum (``max``) of an index, and its error, both of shape (designs,)."""
        at = ("min", "max").index(kind), self.names.index(name)
        return self.value[at], self.error[at]


# Places of regions: design, panel, interval of the ray, and shares u of the panel's map and v of the interval's.
PLACE = np.dtype([("design", np.intp), ("panel", np.intp), ("slot", np.intp), ("u", float), ("v", float)])
Places = NDArray[Any]


def find_peaks(
    panels: Panels, indices: Sequence[Prepared], tolerance: float, searched: Flags, *, squares: bool
) -> Peaks:  # fmt: skip
    """Extremes of indices over the regions.

    Parameters
    ----------
    tolerance : float
        Relative accuracy at which the search ends.
    searched : ndarray of bool, shape (2, indices)
        Whether the infimum, and the supremum of each index is searched for; else only its order is computed.
    squares : bool
        Whether squares of indices are integrated. Without these an integral may be infinite only where an index grows
        without bound at a crossing: else, and where no extreme is searched for, nothing is computed.
    """
    count, names = len(panels.closes), [index.name for index in indices]
    shape = (len(indices), count)
    value, order = np.stack([np.full(shape, np.inf), np.full(shape, -np.inf)]), np.zeros(shape)
    if not searched.any() and not squares and all(index.index.crossing != np.inf for index in indices):
        return Peaks(names, value, np.zeros(value.shape), order)
    _at_ends(panels, indices, value, order)
    places, local = _grid(panels)
    _at_crossings(indices, places["design"], local, value, order)
    error = np.zeros(value.shape)
    lanes = []
    for sense, k in np.argwhere(searched):
        start = _best(places["design"], (2 * sense - 1) * np.asarray(indices[k].values(local)), count)
        # What lies at the bound of the index already needs no search.
        design = np.flatnonzero((start >= 0) & (value[sense, k] != indices[k].index.bounds[sense]))
        lanes.append((np.full(len(design), sense), np.full(len(design), k), design, start[design]))
    if lanes:
        sense, k, design, start = (np.concatenate(column) for column in zip(*lanes, strict=True))
        peak, doubt = _climb(panels, indices, 2.0 * sense - 1, k, tolerance, places[start])
        sign = 2.0 * sense - 1
        value[sense, k, design] = sign * np.fmax(sign * value[sense, k, design], sign * peak)
        error[sense, k, design] = doubt
    value[:, :, ~panels.closes] = error[:, :, ~panels.closes] = np.nan
    return Peaks(names, value, error, order)


def _at_ends(panels: Panels, indices: Sequence[Prepared], value: Floats, order: Floats) -> None:
    """Note the indices that vanish or have no bound where the region ends in a singularity."""
    u = np.array([0.2, 0.5, 0.8])[:, None]
    theta = (panels.low + u * (panels.high - panels.low)).ravel()
    design = np.tile(panels.design, len(u))
    traced = panels.trace(design, theta)
    singular = np.append([kind != "limit" for kind, _ in panels.designs.field.labels], False)
    for margin, end, side in ((traced.enters, traced.inner, 1.0), (traced.leaves, traced.outer, -1.0)):
        at = np.flatnonzero(singular[margin])
        if not at.size:
            continue
        ray = traced.ray[at]
        radius = end[at] + side * NEAR[:, None] * (traced.outer - traced.inner)[at]
        local = Local.on_rays(panels.designs, design[ray], theta[ray], radius)
        for k, index in enumerate(indices):
            near, far = np.broadcast_to(np.asarray(index.values(local), dtype=float), radius.shape)
            power = np.log(far / near) / np.log(NEAR[1] / NEAR[0])
            vanishes, grows = power > POWER, (power < -POWER) & (index.index.bounds[1] == np.inf)
            value[0, k, design[ray[vanishes]]] = 0.0
            value[1, k, design[ray[grows]]] = np.inf
            np.maximum.at(order[k], design[ray[grows]], np.round(-2 * power[grows]) / 2)


def _at_crossings(indices: Sequence[Prepared], design: Ints, local: Local, value: Floats, order: Floats) -> None:
    """Note them too where a forward singularity lies inside: the determinant has both signs."""
    determinant = np.broadcast_to(local.determinant, design.shape)
    count = value.shape[-1]
    crossed, size = np.ones(count, dtype=bool), np.zeros(count)
    finite = np.flatnonzero(np.isfinite(determinant))
    np.maximum.at(size, design[finite], np.abs(determinant[finite]))
    for sign in (1, -1):
        crossed &= np.bincount(design[sign * determinant > ROUNDING * size[design]], minlength=count) > 0
    for k, index in enumerate(indices):
        limit = index.index.crossing
        if limit is not None:
            sense = int(limit > 0)
            value[sense, k, crossed] = limit
            order[k, crossed] = np.maximum(order[k, crossed], float(sense))


def _grid(panels: Panels) -> tuple[Places, Local]:
    """The first nodes of all regions."""
    u = np.tile(ANGLES[:, None], len(panels.low))
    panel = np.tile(np.arange(len(panels.low)), len(ANGLES))
    theta = spread(panels.low, panels.high, u, cubic)[0].ravel()
    design = panels.design[panel]
    traced = panels.trace(design, theta)
    radius = spread(traced.inner, traced.outer, RADII[:, None], cosine)[0].ravel()
    ray = np.tile(traced.ray, len(RADII))
    places = np.zeros(len(ray), dtype=PLACE)
    places["design"], places["panel"], places["u"] = design[ray], panel[ray], u.ravel()[ray]
    places["slot"], places["v"] = np.tile(traced.slot, len(RADII)), np.repeat(RADII, len(traced.ray))
    return places, Local.on_rays(panels.designs, design[ray], theta[ray], radius)


def _best(design: Ints, height: Floats, count: int) -> Ints:
    """The node of the largest value of each design; -1 where there is none."""
    best = np.full(count, -1, dtype=np.intp)
    good = np.flatnonzero(np.isfinite(height))
    order = good[np.argsort(height[good], kind="stable")]
    best[design[order]] = order
    return best


def _climb(
    panels: Panels, indices: Sequence[Prepared], sign: Floats, which: Ints, tolerance: float, at: Places
) -> tuple[Floats, Floats]:
    """Largest value of `sign` times the index `which` near each place, by shrinking grids, and its error."""
    u, v = at["u"].copy(), at["v"].copy()
    wide, deep = np.full(len(u), 2 / len(ANGLES)), np.full(len(u), 2 / len(RADII))
    best, doubt = np.full(len(u), -np.inf), np.full(len(u), np.inf)

    def look(lanes: Ints, us: Floats, vs: Floats) -> Floats:
        height_at = sign[lanes] * _values(panels, indices, which[lanes], at[lanes], us, vs)
        return np.where(np.isfinite(height_at), height_at, -np.inf).reshape(-1, len(lanes))

    left = np.arange(len(u))
    for _ in range(MOST_ROUNDS):
        if not left.size:
            break
        lane = np.arange(len(left))
        us = np.clip(u[left] + STENCIL[:, None] * wide[left], EDGE_U, 1 - EDGE_U)
        vs = np.clip(v[left] + STENCIL[:, None] * deep[left], EDGE_V, 1 - EDGE_V)
        height = look(left, us, vs)
        top = height.argmax(axis=0)
        new, (i, j) = height[top, lane], np.divmod(top, len(STENCIL))
        doubt[left] = new - np.where(np.isfinite(height), height, np.inf).min(axis=0)
        better = new > best[left]
        u[left], v[left] = np.where(better, us[i, lane], u[left]), np.where(better, vs[j, lane], v[left])
        best[left] = np.maximum(best[left], new)
        # A grid shrinks where its best node is inside it, or at an end of the map.
        for width, step, places, edge in ((wide, i, us, EDGE_U), (deep, j, vs, EDGE_V)):
            place = places[step, lane]
            inner = (step > 0) & (step < len(STENCIL) - 1) | (place <= edge) | (place >= 1 - edge)
            width[left] *= np.where(inner, SHRINK, 1.0)
        left = left[~(doubt[left] <= tolerance * np.abs(best[left]))]
    # In a corner an index may vanish or have no bound.
    corner = np.flatnonzero((u <= EDGE_U) | (u >= 1 - EDGE_U))
    endless = np.zeros(len(u), dtype=bool)
    if corner.size:
        back = np.where(u[corner] < 0.5, BACK * EDGE_U, 1 - BACK * EDGE_U)
        power = np.log(best[corner] / look(corner, back[None], v[corner][None])[0]) / np.log(BACK)
        # What has an upper bound may grow in a corner, but not without end.
        unbounded = np.array([index.index.bounds[1] == np.inf for index in indices])[which[corner]]
        endless[corner] = (sign[corner] * power > POWER) & ((sign[corner] < 0) | unbounded)
    return np.where(endless, np.where(sign > 0, np.inf, 0.0), sign * best), np.where(endless, 0.0, doubt)


def _values(panels: Panels, indices: Sequence[Prepared], which: Ints, at: Places, us: Floats, vs: Floats) -> Floats:
    """Indices `which` on grids, shape (angles, radii, places); nan where the interval is not met."""
    theta = spread(panels.low[at["panel"]], panels.high[at["panel"]], us, cubic)[0].ravel()
    design, slot = np.tile(at["design"], len(us)), np.tile(at["slot"], len(us))
    traced = panels.trace(design, theta)
    met = slot < traced.counts
    place = np.where(met, np.searchsorted(traced.ray, np.arange(len(theta))) + slot, len(traced.ray))
    shape = (len(us), 1, len(at))
    inner, outer = (np.append(end, np.nan)[place].reshape(shape) for end in (traced.inner, traced.outer))
    radius = spread(inner, outer, vs, cosine)[0]
    local = Local.on_rays(panels.designs, at["design"], theta.reshape(shape), radius)
    values_at = np.full(radius.shape, np.nan)
    for k in np.unique(which):
        values_at = np.where(which == k, indices[k].values(local), values_at)
    return values_at
