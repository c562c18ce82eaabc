"""Integrals over the region of many designs at once, adaptive and with an error estimate.

In polar coordinates about the scan's centre, with each panel's angle and each interval's radius written as

    theta = low + (high - low) q(u),   r = inner + (outer - inner) (1 - cos pi v)/2,   0 <= u, v <= 1

where q has threefold points at 0 and 1: inverse square roots at the boundary (resistivity where a leg is stretched or
folded) become smooth in v, and cusps, tangent rays and the logarithms that two such boundaries leave in their corner
nearly so in u. The rule is Gauss-Legendre in u and in v. Cells of panels and segments of rays are halved until their
estimated errors are small; a segment that crosses a forward singularity is divided there.

The error estimate adds the errors along each ray by absolute value to those in the angle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.region.panels import Panels
from mechdesign.analyses.region.rays import Designs
from mechdesign.analyses.region.rules import Rule, cosine, cubic, spread
from mechdesign.analyses.workspace.index import Local, Prepared
from mechdesign.numerics.arrays import Flags, Floats, Ints

ANGLES = Rule.of(20, 4, 6.0)
RADII = Rule.of(11, 2, 2.0)
MOST_PASSES = 24
# Cells and segments are not halved more often than this.
MOST_HALVINGS = 12
# Share of the tolerance for the errors along all rays.
ALONG = 0.6
# Share of the tolerance for the area, the divisor of every mean; and its relative tolerance at most.
AREA = 0.1
FINEST_AREA = 1e-6
# A piece smaller than this part of the whole region is measured by the whole: its boundary may be rough all over.
SLIVER = 1e-3
# Cells of one design at most; what is in doubt then stays so, and its error tells.
MOST_CELLS = 256
# Share of the errors along rays that any ray may have: those at the ends of panels weigh little.
SINGLE_RAY = 0.01
# Rays, and nodes of each, of the rules of comparison unless the study says how many.
RAYS, RADIAL_NODES = {"sector_mean": 101, "midpoint": 300}, {"sector_mean": 49, "midpoint": 200}
# Segments evaluated at once (11 nodes each).
BLOCK = 4096
# Nearer to the boundary than this fraction of the radius, rounding spoils an index that is infinite there.
NEAREST = 3e-14
# Step of the difference that finds a forward singularity, as a fraction of the segment.
STEP = 0.01

# Parts of panels: which of [low, high] for u in [start, stop], and whether the means count it.
CELL = np.dtype([("design", np.intp), *((name, float) for name in ("low", "high", "start", "stop", "counted"))])
# Parts of intervals of rays: those of [inner, outer] for v in [start, stop].
SEGMENT = np.dtype([
    ("ray", np.intp), ("design", np.intp), *((name, float) for name in ("theta", "inner", "outer", "start", "stop"))
])  # fmt: skip
Parts = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Integrand:
    """An index, or its square (for the standard deviation)."""

    index: Prepared
    power: int = 1

    def values(self, local: Local) -> Floats:
        """Values at points; 0 where there is none: on the boundary itself rounding leaves an interval of no width."""
        found = np.broadcast_to(np.asarray(self.index.values(local), dtype=float), local.configuration.shape)
        with np.errstate(over="ignore", invalid="ignore"):
            found = found**self.power
        return np.where(np.isfinite(found), found, 0.0)


@dataclass(frozen=True, eq=False)
class Integral:
    """Integrals of each design.

    Parameters
    ----------
    area, area_error : ndarray, shape (designs,)
        Area of the region.
    mean, mean_error : ndarray, shape (integrands, designs)
        Means over the region within the margins of the scan; nan where empty, infinite where the integral is.
    boundary : (design, angle, radius)
        Points of the boundary that were met.
    """

    area: Floats
    area_error: Floats
    mean: Floats
    mean_error: Floats
    boundary: tuple[Ints, Floats, Floats]


def _divided(parts: Parts, at: Floats) -> Parts:
    """Every part as two, divided at `at`; all first parts come first."""
    lower, upper = parts.copy(), parts.copy()
    lower["stop"] = upper["start"] = at
    return np.concatenate([lower, upper])


def integrate(
    panels: Panels, tolerance: float, counted: tuple[float, float], integrands: Sequence[Integrand], endless: Flags,
    whole: float = 0.0,
) -> Integral:  # fmt: skip
    """Area and means of local indices of every design, to a relative tolerance.

    Parameters
    ----------
    counted : (float, float)
        Range of angle that the means are taken over; panels must end there.
    integrands : sequence of Integrand
        None for the area alone.
    endless : ndarray of bool, shape (integrands, designs)
        Integrals that are infinite, for which nothing is refined.
    whole : float
        Where the region is a piece of a larger one, the area of that: of a sliver it is wanted to `SLIVER` of it only.
    """
    count = len(panels.closes)
    middle = 0.5 * (panels.low + panels.high)
    fresh = np.zeros(len(middle), dtype=CELL)
    fresh["design"], fresh["low"], fresh["high"], fresh["stop"] = panels.design, panels.low, panels.high, 1.0
    fresh["counted"] = (middle > counted[0]) & (middle < counted[1])
    span = np.bincount(panels.design, panels.high - panels.low, count).astype(float)
    done = fresh[:0]
    # Rows: area, area within the margins, and the integrands; of the values and of their errors.
    values = errors = np.zeros((2 + len(integrands), 0))
    each = np.where(endless, np.inf, tolerance)
    of_area = min(AREA * tolerance, FINEST_AREA)
    allowed: Floats | None = None
    boundary: tuple[Ints, Floats, Floats] | None = None
    for _ in range(MOST_PASSES):
        value, error, allowed, met = _evaluate(panels, integrands, fresh, each, allowed, span)
        boundary = met if boundary is None else boundary
        done = np.concatenate([done, fresh])
        values, errors = np.concatenate([values, value], axis=1), np.concatenate([errors, error], axis=1)
        owner = done["design"]
        total, doubt = (np.stack([np.bincount(owner, row, count) for row in rows]) for rows in (values, errors))
        with np.errstate(invalid="ignore"):
            area_wanted = np.maximum(of_area * total[:2], of_area * SLIVER * whole)
            wanted = np.concatenate([area_wanted, np.where(endless, np.inf, np.fmax(each * total[2:], 0.0))])
        cells = np.bincount(owner, minlength=count)
        late = (doubt > wanted).any(axis=0) & (cells < MOST_CELLS)
        if not late.any():
            break
        # What is left of errors along rays looks like roughness in the angle: they get smaller with the cells.
        allowed = np.where(late, 0.5, 1.0) * allowed
        share = errors / np.maximum(wanted, 1e-300)[:, owner]
        worst = np.zeros((len(wanted), count))
        for row in range(len(wanted)):
            np.maximum.at(worst[row], owner, share[row])
        # The worst cell, and those that exceed their equal share of the tolerance.
        equal = 1 / np.maximum(cells, 1)
        over = (share >= np.minimum(worst, equal)[:, owner]) & (doubt > wanted)[:, owner]
        split = over.any(axis=0) & (done["stop"] - done["start"] > 2.0**-MOST_HALVINGS) & late[owner]
        if not split.any():
            break
        fresh = _divided(done[split], 0.5 * (done["start"] + done["stop"])[split])
        done, values, errors = done[~split], values[:, ~split], errors[:, ~split]
    assert boundary is not None
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = total[2:] / total[1]
        mean_error = (doubt[2:] + np.abs(mean) * doubt[1]) / total[1]
    mean[endless & (total[1] > 0)], mean_error[endless] = np.inf, 0.0
    return Integral(total[0], doubt[0], mean, mean_error, boundary)


def _evaluate(
    panels: Panels, integrands: Sequence[Integrand], cells: Parts, tolerance: Floats, allowed: Floats | None,
    span: Floats,
) -> tuple[Floats, Floats, Floats, tuple[Ints, Floats, Floats]]:  # fmt: skip
    """Values and errors (rows, cells) of new cells, the error allowed along rays (integrands, designs), the boundary.

    `tolerance` is of each integrand and design.
    """
    nodes, count = len(ANGLES.nodes), len(cells)
    middle, half = 0.5 * (cells["start"] + cells["stop"]), 0.5 * (cells["stop"] - cells["start"])
    place, density = spread(cells["low"], cells["high"], middle + half * ANGLES.nodes[:, None], cubic)
    theta, weight = place.ravel(), (half * density).ravel()
    design, counted = np.tile(cells["design"], nodes), np.tile(cells["counted"], nodes)
    intervals = panels.trace(design, theta)
    ray, inner, outer = intervals.ray, intervals.inner, intervals.outer
    area = np.bincount(ray, 0.5 * (outer - inner) * (outer + inner), len(theta))
    value = error = np.zeros((len(integrands), len(theta)))
    if integrands:
        segments = np.zeros(len(ray), dtype=SEGMENT)
        for name, part in (("design", design[ray]), ("theta", theta[ray]), ("stop", 1.0)):
            segments[name] = part
        segments["ray"], segments["inner"], segments["outer"] = ray, inner, outer
        first = _segments(panels.designs, integrands, segments)
        if allowed is None:
            share = weight * np.repeat(ANGLES.weights, count)
            sums = [np.bincount(design[ray], row * share[ray], len(panels.closes)) for row in first[0]]
            allowed = np.asarray(ALONG * tolerance * np.maximum(sums, np.finfo(float).tiny), dtype=float)
        each = allowed[:, design] * np.maximum(1 / span[design], SINGLE_RAY / weight)
        value, error = _along(panels.designs, integrands, segments, first, each)
    rows = (area, area * counted, *(value * counted))
    total, doubt = np.empty((2, len(rows), count))
    for k, row in enumerate(rows):
        total[k], doubt[k] = ANGLES.apply((row * weight).reshape(nodes, -1))
    for k in range(len(integrands)):
        doubt[2 + k] += ANGLES.weights @ (error[k] * weight * counted).reshape(nodes, -1)
    met = (np.tile(design[ray], 2), np.tile(theta[ray], 2), np.concatenate([inner, outer]))
    return total, doubt, np.zeros_like(tolerance) if allowed is None else allowed, met


def _along(
    designs: Designs, integrands: Sequence[Integrand], segments: Parts, evaluated: tuple[Floats, Floats, Floats],
    allowed: Floats,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Integrals along rays and their estimated errors, both of shape (integrands, rays).

    `evaluated` is what `_segments` gives. A segment is divided if its error is larger than `allowed` on its ray.
    """
    value, error = np.zeros((2, *allowed.shape))
    found, doubt, crossing = evaluated
    with np.errstate(divide="ignore", invalid="ignore"):
        # What an inverse square root has within `NEAREST` of the boundary.
        noise = np.sqrt(NEAREST * segments["outer"] / (segments["outer"] - segments["inner"])) * np.abs(found)
    for halvings in range(MOST_HALVINGS + 1):
        ray = segments["ray"]
        split = (doubt > np.maximum(allowed[:, ray], noise)).any(axis=0) & (halvings < MOST_HALVINGS)
        for k in range(len(integrands)):
            value[k] += np.bincount(ray[~split], found[k, ~split], allowed.shape[1])
            error[k] += np.bincount(ray[~split], doubt[k, ~split], allowed.shape[1])
        if not split.any():
            break
        rough, at = segments[split], 0.5 * (segments["start"] + segments["stop"])[split]
        crossed = np.flatnonzero(np.isfinite(crossing[split]))
        if crossed.size:
            at[crossed] = _crossing(designs, rough[crossed], crossing[split][crossed])
        segments, noise = _divided(rough, at), np.tile(noise[:, split], 2)
        found, doubt, crossing = _segments(designs, integrands, segments)
    return value, error


def _segments(designs: Designs, integrands: Sequence[Integrand], segments: Parts) -> tuple[Floats, Floats, Floats]:
    """Integrals of indices times radius over segments, and their errors, both of shape (integrands, segments).

    And v near which a forward singularity divides a segment; nan where none does.
    """
    found, doubt = np.empty((2, len(integrands), len(segments)))
    crossing = np.full(len(segments), np.nan)
    for k in range(0, len(segments), BLOCK):
        at = slice(k, k + BLOCK)
        part = segments[at]
        inner, outer = part["inner"], part["outer"]
        half = 0.5 * (part["stop"] - part["start"])
        v = part["start"] + half * (1 + RADII.nodes[:, None])
        r, slope = spread(inner, outer, v, cosine)
        # In an interval so narrow, rounding leaves nothing of the closures: it only exists at a cusp.
        measure = np.where(outer - inner > 100 * NEAREST * outer, r * slope * half, 0.0)
        gap = np.minimum(NEAREST * outer, 0.5 * (outer - inner))
        local = Local.on_rays(designs, part["design"], part["theta"], np.clip(r, inner + gap, outer - gap))
        for j, integrand in enumerate(integrands):
            found[j, at], doubt[j, at] = RADII.apply(integrand.values(local) * measure)
        if not designs.field.same_assembly:
            crossing[at] = _sign_change(v, _inverse_determinant(local, r.shape))
    return found, doubt, crossing


def _inverse_determinant(local: Local, shape: tuple[int, ...]) -> Floats:
    """One by the determinant of the Jacobian, which changes its sign at a forward singularity."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.broadcast_to(1 / local.determinant, shape)


def _sign_change(x: Floats, values: Floats) -> Floats:
    """A root between two nodes (first axis), by a straight line; nan where there is none."""
    # Where rounding leaves nothing of a determinant, at a cusp, its sign tells no place.
    known = np.isfinite(values).all(axis=0)
    change = (values[1:] > 0) != (values[:-1] > 0)
    first, lane = change.argmax(axis=0), np.arange(values.shape[1])
    a, b = values[first, lane], values[first + 1, lane]
    with np.errstate(divide="ignore", invalid="ignore"):
        root = x[first, lane] + (x[first + 1, lane] - x[first, lane]) * a / (a - b)
    return np.where(known & change.any(axis=0), root, np.nan)


def _crossing(designs: Designs, segments: Parts, v: Floats) -> Floats:
    """Where a forward singularity divides segments, by a step of Newton's method from `v`."""
    step = STEP * (segments["stop"] - segments["start"])
    around = v + step * np.array([-1.0, 0.0, 1.0])[:, None]
    r = spread(segments["inner"], segments["outer"], around, cosine)[0]
    local = Local.on_rays(designs, segments["design"], segments["theta"], r)
    low, middle, high = _inverse_determinant(local, r.shape)
    with np.errstate(divide="ignore", invalid="ignore"):
        shift = 2 * middle / (low - high)
    return np.asarray(v + step * np.where(np.abs(shift) < 1, shift, 0.0))


def simple_means(
    panels: Panels, integrands: Sequence[Integrand], rule: str, nodes: int | None, rays: int | None,
    counted: tuple[float, float],
) -> Floats:  # fmt: skip
    """Means of indices (integrands, designs) by the sums that papers use, for comparison.

    Rays of equal weight and nodes of equal steps along each interval, weighted by their radius as the area integral is
    (``midpoint``) or equally within each sector (``sector_mean``) [S1, Tables 1 and 2]. Sectors are weighted by
    outer^2 - inner^2 either way.
    """
    by_area, (low, high) = rule == "midpoint", counted
    nodes, rays = nodes or RADIAL_NODES[rule], rays or RAYS[rule]
    if by_area:
        theta, fractions = low + (high - low) * (np.arange(rays) + 0.5) / rays, (np.arange(nodes) + 0.5) / nodes
    else:
        theta, fractions = np.linspace(low, high, rays), np.arange(1, nodes + 1) / (nodes + 1)
    count = len(panels.closes)
    design, angle = np.repeat(np.arange(count), len(theta)), np.tile(theta, count)
    intervals = panels.trace(design, angle)
    owner = design[intervals.ray]
    sector = (intervals.outer - intervals.inner) * (intervals.outer + intervals.inner)
    total = np.zeros((len(integrands), len(owner)))
    block = max(1, BLOCK * len(RADII.nodes) // len(fractions))
    for k in range(0, len(owner), block):
        at = slice(k, k + block)
        r = intervals.inner[at] + fractions[:, None] * (intervals.outer - intervals.inner)[at]
        weight = r / r.sum(axis=0) if by_area else np.full(r.shape, 1 / len(fractions))
        local = Local.on_rays(panels.designs, owner[at], angle[intervals.ray[at]], r)
        for index, integrand in enumerate(integrands):
            total[index, at] = (integrand.values(local) * weight).sum(axis=0)
    area = np.bincount(owner, sector, count)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.array([np.bincount(owner, row * sector, count) for row in total]).reshape(-1, count) / area
