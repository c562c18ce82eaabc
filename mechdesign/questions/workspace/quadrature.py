"""Integrals over the region of many designs at once, adaptive and with an error estimate.

In polar coordinates about the scan's centre, with each panel's angle and each interval's radius written as

    theta = low + (high - low) q(u),   r = inner + (outer - inner) (1 - cos pi v)/2,   0 <= u, v <= 1

where q has threefold points at 0 and 1: inverse square roots at the boundary (resistivity where a leg is stretched or
folded) become smooth in v, and cusps, tangent rays and the logarithms that two such boundaries leave in their corner
nearly so in u. The rule is Gauss-Legendre in u and in v: one pass over the panels is enough for most designs. Of the
others panels end, and intervals are divided, where isotropic points are; then cells of panels and strips of rays are
halved, the worst first, until the estimated errors are small.

The error is that in the angle, of the integrals along rays, and that along the rays, of the sums of neighbouring rays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.questions.workspace.local import Local
from mechdesign.questions.workspace.strips import (
    BLOCK,
    RADII,
    SEGMENT,
    Integrand,
    Parts,
    Strips,
    along,
    divided,
    evaluate,
)  # fmt: skip
from mechdesign.questions.workspace.tips import ended_at, isotropic_points, through_points
from mechdesign.region.intervals import Intervals
from mechdesign.region.panels import Panels
from mechdesign.region.rules import Rule, cubic, spread

ANGLES = Rule.of(20, 4, 6.0)
MOST_PASSES = 24
# Cells are not halved more often than this.
MOST_HALVINGS = 12
# Share of the tolerance that the errors along all rays may use up; it shrinks by `LESS` from pass to pass.
ALONG, LESS = 0.6, 0.85
# A cell is halved if its error is so many times its equal share of the tolerance.
FAR = 2.0
# The area divides every mean: it is wanted to this share of the tolerance, and to `FINEST_AREA` of itself at least.
AREA = 0.1
FINEST_AREA = 1e-6
# Of a piece smaller than this part of the region the area is wanted as closely as of a piece of this size: its boundary
# may be rough all over.
SLIVER = 1e-3
# Cells of one design at most; with so many the error stays as it is.
MOST_CELLS = 256
# Rays, and nodes of each, of the rules of comparison unless the study says how many.
RAYS, RADIAL_NODES = {"sector_mean": 101, "midpoint": 300}, {"sector_mean": 49, "midpoint": 200}

# Parts of panels: which of [low, high] for u in [start, stop], whether the means count it, and its share of the errors
# allowed along rays; the isotropic points at either end, if any (`TIP`).
CELL = np.dtype([
    *((name, np.intp) for name in ("design", "low_slot", "high_slot")),
    *((name, float) for name in ("low", "high", "low_part", "high_part", "start", "stop", "counted", "share")),
])  # fmt: skip


@dataclass(frozen=True, eq=False)
class Integral:
    """Integrals of each design.

    Parameters
    ----------
    area, area_error : ndarray, shape (designs,)
        Area of the region.
    mean, mean_error : ndarray, shape (integrands, designs)
        Means over the region within the margins of the scan; nan where empty, infinite where the integral is.
    boundary : (design, angle, intervals)
        Rays on which it was met.
    """

    area: Floats
    area_error: Floats
    mean: Floats
    mean_error: Floats
    boundary: tuple[Ints, Floats, Intervals]


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
    cells = np.zeros(len(middle), dtype=CELL)
    cells["design"], cells["low"], cells["high"], cells["stop"] = panels.design, panels.low, panels.high, 1.0
    cells["low_slot"] = cells["high_slot"] = -1
    cells["counted"] = (middle > counted[0]) & (middle < counted[1])
    cells["share"] = (1 / np.maximum(np.bincount(panels.design, minlength=count), 1))[panels.design]
    tolerances = np.where(endless, np.inf, tolerance)
    of_area = min(AREA * tolerance, FINEST_AREA)

    def allowance(total: Floats) -> Floats:
        area = np.maximum(of_area * total[:2], of_area * SLIVER * whole)
        return np.concatenate([area, np.where(endless, np.inf, np.fmax(tolerances * total[2:], 0.0))])

    first = Fan.of(panels, integrands, cells)
    new = first.integrals(integrands, np.full_like(tolerances, np.inf))
    total, doubt = new.of_designs(count)
    allowed = ALONG * np.maximum(allowance(total)[2:], np.finfo(float).tiny)
    rough = np.asarray((doubt > allowance(total))[2:].any(axis=0))
    tips = isotropic_points(panels, cells, first.strips, rough[cells["design"]])
    plain = np.ones(len(cells), dtype=bool)
    plain[tips["cell"]] = False
    new = first.integrals(integrands, allowed, plain)
    if len(tips):
        new = new.joined(Fan.of(panels, integrands, ended_at(cells, tips)).integrals(integrands, allowed))
    done = new
    for _ in range(MOST_PASSES):
        owner = done.cells["design"]
        total, doubt = done.of_designs(count)
        # Narrower cells leave as much undecided along their rays, and no error need be smaller than that.
        undecided = done.undecided(count)
        most, number = allowance(total), np.bincount(owner, minlength=count)
        most[:2] = np.maximum(most[:2], undecided)
        most[2:] = np.fmax(most[2:], undecided[1] * np.abs(total[2:]) / total[1])
        late = (doubt > most).any(axis=0) & (number < MOST_CELLS)
        # What is left of errors along rays looks like roughness in the angle: they get smaller with the cells.
        allowed = np.where(late, LESS, 1.0) * allowed
        share = done.error / np.maximum(most, 1e-300)[:, owner]
        worst = np.zeros((len(most), count))
        for row in range(len(most)):
            np.maximum.at(worst[row], owner, share[row])
        # The worst cell, and those that exceed their equal share of the tolerance by far.
        over = (share >= np.minimum(worst, FAR / np.maximum(number, 1))[:, owner]) & (doubt > most)[:, owner]
        split = over.any(axis=0) & (done.cells["stop"] - done.cells["start"] > 2.0**-MOST_HALVINGS) & late[owner]
        if not split.any():
            break
        rough_cells = done.cells[split]
        fresh = divided(rough_cells, 0.5 * (rough_cells["start"] + rough_cells["stop"]))
        done = done.kept(~split).joined(Fan.of(panels, integrands, fresh).integrals(integrands, allowed))
    total, doubt = done.of_designs(count)
    doubt[:2] += done.undecided(count)
    mean = total[2:] / total[1]
    mean_error = (doubt[2:] + np.abs(mean) * doubt[1]) / total[1]
    mean[endless & (total[1] > 0)], mean_error[endless] = np.inf, 0.0
    return Integral(total[0], doubt[0], mean, mean_error, first.boundary)


@dataclass(frozen=True, eq=False)
class Integrals:
    """Integrals over cells: of 1, of 1 within the margins of the scan, of the integrands; (rows, cells), and errors.

    `open` is the area, shape (cells,), of what stays undecided along rays: it adds to the errors.
    """

    cells: Parts
    value: Floats
    error: Floats
    open: Floats

    def kept(self, keep: Flags) -> Integrals:
        """Those of some cells."""
        return Integrals(self.cells[keep], self.value[:, keep], self.error[:, keep], self.open[keep])

    def joined(self, other: Integrals) -> Integrals:
        """Those of all cells of both."""
        values = np.concatenate([self.value, other.value], axis=1)
        errors = np.concatenate([self.error, other.error], axis=1)
        cells, areas = (np.concatenate(both) for both in ((self.cells, other.cells), (self.open, other.open)))
        return Integrals(cells, values, errors, areas)

    def undecided(self, count: int) -> Floats:
        """Area of what stays undecided of each design, and of that within the margins of the scan; (2, designs)."""
        weights = self.open, self.open * self.cells["counted"]
        return np.array([np.bincount(self.cells["design"], weight, count) for weight in weights])

    def of_designs(self, count: int) -> tuple[Floats, Floats]:
        """Sums over the cells of each design, and of their errors; (rows, designs)."""
        owner = self.cells["design"]
        value, error = (np.array([np.bincount(owner, row, count) for row in rows]) for rows in (self.value, self.error))
        return value, error


@dataclass(frozen=True, eq=False)
class Fan:
    """The rays of cells.

    Parameters
    ----------
    weight : ndarray, shape (nodes, cells)
        Slope of the angle, per unit of the rule's variable.
    area : ndarray, shape (nodes, cells)
        Integral of the radius along each ray.
    strips : Strips
        Of the whole intervals, but that those with an isotropic point are divided.
    boundary : (design, angle, intervals)
        All rays.
    """

    panels: Panels
    cells: Parts
    weight: Floats
    area: Floats
    strips: Strips
    boundary: tuple[Ints, Floats, Intervals]

    @staticmethod
    def of(panels: Panels, integrands: Sequence[Integrand], cells: Parts) -> Fan:
        """Trace the rays at the nodes of cells and evaluate the integrands along them."""
        shape = nodes, count = len(ANGLES.nodes), len(cells)
        middle, half = 0.5 * (cells["start"] + cells["stop"]), 0.5 * (cells["stop"] - cells["start"])
        place, density = spread(cells["low"], cells["high"], middle + half * ANGLES.nodes[:, None], cubic)
        theta, weight = place.ravel(), half * density
        design = np.tile(cells["design"], nodes)
        traced = panels.trace(design, theta)
        ray, inner, outer = traced.ray, traced.inner, traced.outer
        area = np.asarray(np.bincount(ray, 0.5 * (outer - inner) * (outer + inner), len(theta)), dtype=float)
        segments = np.zeros(len(ray) if integrands else 0, dtype=SEGMENT)
        if integrands:
            cell, slot = ray % count, traced.slot
            by = (weight * ANGLES.weights[:, None] * cells["counted"]).ravel()[ray]
            for name, part in (("ray", ray), ("design", design[ray]), ("cell", cell), ("slot", slot),
                               ("strip", 2 * (cell * (int(slot.max(initial=0)) + 1) + slot)), ("theta", theta[ray]),
                               ("inner", inner), ("outer", outer), ("stop", 1.0), ("weight", by)):  # fmt: skip
                segments[name] = part
            segments = through_points(cells[cell], segments)
        strips = evaluate(panels.designs, integrands, segments)
        return Fan(panels, cells, weight, area.reshape(shape), strips, (design, theta, traced))

    def integrals(self, integrands: Sequence[Integrand], allowed: Floats, keep: Flags | None = None) -> Integrals:
        """Integrals over the cells, or some; their errors along rays are no more than is allowed a whole design."""
        cells, count = self.cells, len(self.cells)
        keep = np.ones(count, dtype=bool) if keep is None else keep
        width = cells["share"] * (cells["stop"] - cells["start"]) * keep
        part = np.bincount(cells["design"], width, allowed.shape[1])
        strips = self.strips.of_cells(keep)
        # A design without cells may err as it likes.
        share = np.where(part > 0, allowed * np.where(part > 0, part, 1.0), np.inf)
        value, error = along(self.panels.designs, integrands, strips, share, self.area.size, count)
        value = value.reshape(-1, *self.area.shape) * cells["counted"]
        rows = self.area, self.area * cells["counted"], *value
        values, errors = np.stack([ANGLES.apply(row * self.weight) for row in rows], axis=1)
        doubt = ANGLES.weights @ (self.boundary[2].doubt.reshape(self.area.shape) * self.weight)
        errors[2:] += error + self._lost(value)
        return Integrals(cells, values, errors, doubt).kept(keep)

    def _lost(self, value: Floats) -> Floats:
        """What integrands may have on rays whose interval rounding closes, at a cusp: as much as on the next ray."""
        met, node = self.area > 0, np.arange(len(self.area))[:, None]
        before = np.maximum.accumulate(np.where(met, node, -1))
        after = np.minimum.accumulate(np.where(met, node, len(node))[::-1])[::-1]
        nearest = np.where((before >= 0) & (node - before <= after - node), before, after) % len(node)
        weight = ANGLES.weights[:, None] * self.weight * ~met
        return np.asarray((np.abs(np.take_along_axis(value, nearest[None], axis=1)) * weight).sum(axis=1))


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
    return np.array([np.bincount(owner, row * sector, count) for row in total]).reshape(-1, count) / area
