"""Integrals over the region of many designs at once, adaptive and with an error estimate.

In polar coordinates about the scan's centre, with each panel's angle and each interval's radius written as

    theta = low + (high - low) q(u),   r = inner + (outer - inner) (1 - cos pi t)/2,   0 <= u, t <= 1

where q has threefold points at 0 and 1: inverse square roots at the boundary (resistivity where a leg is stretched or
folded) become smooth in t, and cusps, tangent rays and the logarithms that two such boundaries leave in their corner
nearly so in u. The rule is Gauss-Legendre in u and in t. Kinks inside (isotropic points and curves) are met by
splitting the intervals of rays and the panels.

The error estimate adds the errors along each ray by absolute value to those in the angle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.region.panels import Panels
from mechdesign.analyses.region.rays import Designs, trace
from mechdesign.analyses.region.rules import Rule, cubic, spread
from mechdesign.analyses.workspace.integrands import Integrand
from mechdesign.analyses.workspace.local import Local
from mechdesign.analyses.workspace.radial import BLOCK, RADII, along, evaluate, pieces
from mechdesign.numerics.arrays import Flags, Floats, Ints

ANGLES = Rule.of(20, 4, 6.0)
MOST_PASSES = 24
# Cells are not halved more often than this.
MOST_HALVINGS = 12
# Shares of the tolerance: of errors along all rays, and of the area (the divisor of every mean).
ALONG, AREA = 0.6, 0.1
# The area is integrated at least to this relative tolerance.
FINEST_AREA = 1e-6
# A piece smaller than this part of the whole region is measured by the whole: its boundary may be rough all over.
SLIVER = 1e-3
# Places at which the integrals of one design may look; what is in doubt then stays so, and its error tells.
BUDGET = 2_000_000
# Share of the errors along rays that any ray may have: those at the ends of panels weigh little.
SINGLE = 0.01


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
    designs: Designs,
    panels: Panels,
    tolerance: float,
    samples: int,
    counted: tuple[float, float],
    integrands: Sequence[Integrand],
    endless: Flags,
    whole: float = 0.0,
) -> Integral:
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
    count = designs.count
    middle = 0.5 * (panels.low + panels.high)
    inside = ((middle > counted[0]) & (middle < counted[1])).astype(float)
    zero = np.zeros(len(panels.low))
    fresh = _Cells(panels.design, panels.low, panels.high, zero, zero + 1, inside)
    span = np.bincount(panels.design, panels.high - panels.low, count).astype(float)
    done: _Cells | None = None
    # Rows: area, area within the margins, and the integrands; of the values and of their errors.
    values = errors = np.zeros((2 + len(integrands), 0))
    of_area = min(AREA * tolerance, FINEST_AREA)
    each = np.where(endless, np.inf, tolerance)
    allowed: Floats | None = None
    boundary: tuple[Ints, Floats, Floats] | None = None
    spent = np.zeros(count)
    for _ in range(MOST_PASSES):
        value, error, allowed, met, looked = _evaluate(
            designs, integrands, fresh, panels.reach, samples, each, allowed, span
        )
        boundary = met if boundary is None else boundary
        spent += looked
        done = fresh if done is None else _join(done, fresh)
        values, errors = np.concatenate([values, value], axis=1), np.concatenate([errors, error], axis=1)
        total, doubt = (np.stack([np.bincount(done.design, row, count) for row in rows]) for rows in (values, errors))
        with np.errstate(invalid="ignore"):
            least = of_area * SLIVER * whole
            wanted = np.stack([*np.maximum(of_area * total[:2], least), *np.fmax(each * total[2:], 0.0)])
            wanted[2:][endless] = np.inf
        late = (doubt > wanted).any(axis=0) & (spent < BUDGET)
        if not late.any():
            break
        # What is left of errors along rays looks like roughness in the angle: they get smaller with the cells.
        allowed = np.where(late, 0.5, 1.0) * allowed
        cells = np.bincount(done.design, minlength=count)
        share = errors / np.maximum(wanted, 1e-300)[:, done.design]
        worst = np.zeros((len(wanted), count))
        for row in range(len(wanted)):
            np.maximum.at(worst[row], done.design, share[row])
        # The worst cell, and those that exceed their equal share of the tolerance.
        over = (share >= np.minimum(worst, 1 / np.maximum(cells, 1))[:, done.design]) & (doubt > wanted)[:, done.design]
        split = over.any(axis=0) & (done.stop - done.start > 2.0**-MOST_HALVINGS) & late[done.design]
        if not split.any():
            break
        fresh = done.pick(np.nonzero(split)[0]).halves()
        done, values, errors = done.pick(np.nonzero(~split)[0]), values[:, ~split], errors[:, ~split]
    assert boundary is not None
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = total[2:] / total[1]
        mean_error = (doubt[2:] + np.abs(mean) * doubt[1]) / total[1]
    mean[endless & (total[1] > 0)], mean_error[endless] = np.inf, 0.0
    return Integral(total[0], doubt[0], mean, mean_error, boundary)


def _evaluate(
    designs: Designs,
    integrands: Sequence[Integrand],
    cells: _Cells,
    reach: Floats,
    samples: int,
    tolerance: Floats,
    allowed: Floats | None,
    span: Floats,
) -> tuple[Floats, Floats, Floats, tuple[Ints, Floats, Floats], Floats]:
    """Values and errors (rows, cells) of new cells, the error allowed along rays (integrands, designs), the boundary.

    And how many places of each design were looked at. `tolerance` is of each integrand and design.
    """
    nodes, count = len(ANGLES.nodes), len(cells.low)
    middle, half = 0.5 * (cells.start + cells.stop), 0.5 * (cells.stop - cells.start)
    place, density = spread(cells.low, cells.high, middle + half * ANGLES.nodes[:, None], cubic)
    theta, weight = place.ravel(), (half * density).ravel()
    design, counted = np.tile(cells.design, nodes), np.tile(cells.counted, nodes)
    intervals = trace(designs, design, theta, reach[design], samples)
    ray, inner, outer = intervals.ray, intervals.inner, intervals.outer
    area = np.bincount(ray, 0.5 * (outer - inner) * (outer + inner), len(theta))
    value = error = np.zeros((len(integrands), len(theta)))
    looked: Floats = samples * np.bincount(design, minlength=designs.count).astype(float)
    if integrands:
        parts = pieces(intervals, reach[design], designs.field.singular)
        at = parts.ray
        pilot = evaluate(designs, integrands, design[at], theta[at], parts)
        if allowed is None:
            share = weight * np.repeat(ANGLES.weights, count)
            sums = [np.bincount(design[at], row * share[at], designs.count) for row in pilot[0]]
            allowed = np.asarray(ALONG * tolerance * np.maximum(sums, np.finfo(float).tiny), dtype=float)
        each = allowed[:, design] * np.maximum(1 / span[design], SINGLE / weight)
        value, error, places = along(designs, integrands, design, theta, parts, pilot, each)
        looked += np.bincount(design, places, designs.count)
    rows = (area, area * counted, *(value * counted))
    total, doubt = np.empty((2, len(rows), count))
    for k, row in enumerate(rows):
        total[k], doubt[k] = ANGLES.apply((row * weight).reshape(nodes, -1))
    for k in range(len(integrands)):
        doubt[2 + k] += ANGLES.weights @ (error[k] * weight * counted).reshape(nodes, -1)
    met = (np.tile(design[ray], 2), np.tile(theta[ray], 2), np.concatenate([inner, outer]))
    return total, doubt, np.zeros_like(tolerance) if allowed is None else allowed, met, looked


def simple_means(
    designs: Designs,
    integrands: Sequence[Integrand],
    reach: Floats,
    samples: int,
    theta: Floats,
    fractions: Floats,
    by_area: bool,
) -> Floats:
    """Means of indices (integrands, designs) by fixed nodes: the sums that papers use, for comparison.

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
    total = np.zeros((len(integrands), len(owner)))
    block = max(1, BLOCK * len(RADII.nodes) // len(fractions))
    for k in range(0, len(owner), block):
        at = slice(k, k + block)
        r = intervals.inner[at] + fractions[:, None] * (intervals.outer - intervals.inner)[at]
        z = designs.about + r * np.exp(1j * angle[intervals.ray[at]])
        weight = r / r.sum(axis=0) if by_area else np.full(r.shape, 1 / len(fractions))
        local = Local.at(designs.field, z, designs.of(owner[at]))
        for index, integrand in enumerate(integrands):
            total[index, at] = (integrand.values(local) * weight).sum(axis=0)
    area = np.bincount(owner, sector, designs.count)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.array([np.bincount(owner, row * sector, designs.count) for row in total]) / area
