"""Isotropic points: there both singular values of the Jacobian are the same, and their indices have the tip of a cone.

A rule converges slowly about such a tip. Cells end at its angle, and intervals are divided at its radius, so that it
lies in their corners, where the nodes are dense. Between the tips at both ends of a cell the singular values stay near
each other, and the curve that divides the intervals leads from one tip to the other.
"""

from __future__ import annotations

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.mechanism.algebra import cross
from mechdesign.questions.workspace.local import Local
from mechdesign.questions.workspace.strips import Parts, Strips
from mechdesign.region.panels import Panels
from mechdesign.region.rays import ray_through

# Newton's method starts from places whose squared unevenness is below this.
SEED = 0.1
# A place with a smaller unevenness is isotropic.
ISOTROPIC = 1e-6
# It starts from the most even rays, and from every second one of the others.
EVERY = 2
# Isotropic places form a curve where the two ways to them are parallel: the sine of their angle is below this.
ALONG = 1e-2
# Steps of Newton's method; the longest step and that of its differences, as parts of the reach.
STEPS, LONGEST, DIFFERENCE = 6, 0.2, 1e-6
# Part of a cell within which a point lies at its end.
AT_END = 1e-6
# Points beside an interval count that are no farther than this part of it; a curve to them stays within these parts.
BESIDE, WITHIN = 0.5, (0.02, 0.98)

# A point: of which cell and interval, at which angle, and which part of the way from inner to outer.
TIP = np.dtype([("cell", np.intp), ("slot", np.intp), ("theta", float), ("part", float)])


def isotropic_points(panels: Panels, cells: Parts, strips: Strips, some: Flags) -> Parts:
    """The isotropic points in `some` of the cells, from the nodes of their rays that are nearest to isotropy.

    `strips` holds the whole intervals of all rays of the cells.
    """
    uneven, segments = strips.uneven, strips.segments
    same = np.diff(segments["strip"]) == 0
    before = np.append(np.inf, np.where(same, uneven[:-1], np.inf))
    after = np.append(np.where(same, uneven[1:], np.inf), np.inf)
    # By their place on the ray, not in the batch: a design's points are the same alone and beside others.
    node = segments["ray"] // len(cells)
    chosen = (uneven <= np.minimum(before, after)) | (node % EVERY == 0)
    seed = np.flatnonzero(chosen & (uneven < SEED) & some[segments["cell"]])
    tips = np.zeros(len(seed), dtype=TIP)
    if not len(seed):
        return tips
    from_, about = segments[seed], panels.designs.about
    way: Complexes = np.exp(1j * from_["theta"])
    place, size = _solved(panels, from_["design"], about + strips.place[seed] * way)
    cell = cells[from_["cell"]]
    width = cell["high"] - cell["low"]
    theta = ray_through(place - about, panels.designs.scan[0])
    for end in ("low", "high"):
        theta = np.where(np.abs(theta - cell[end]) < AT_END * width, cell[end], theta)
    inside = np.clip(theta, cell["low"] + AT_END * width, cell["high"] - AT_END * width)
    good = (size < ISOTROPIC) & (theta >= cell["low"]) & (theta <= cell["high"])
    traced = panels.trace(from_["design"], np.where(good, inside, cell["low"]))
    mine = traced.slot == from_["slot"][traced.ray]
    part = np.full(len(seed), np.nan)
    ray, inner, outer = traced.ray[mine], traced.inner[mine], traced.outer[mine]
    part[ray] = (np.abs(place - about)[ray] - inner) / (outer - inner)
    tips["cell"], tips["slot"], tips["theta"], tips["part"] = from_["cell"], from_["slot"], theta, part
    tips = tips[good & (part > -BESIDE) & (part < 1 + BESIDE)]
    tips = tips[np.lexsort((tips["theta"], tips["cell"]))]
    near = np.diff(tips["theta"]) < AT_END * (cells["high"] - cells["low"])[tips["cell"][1:]]
    first = np.append(True, (np.diff(tips["cell"]) > 0) | ~near)[: len(tips)]
    return np.asarray(tips[first])


def _solved(panels: Panels, design: Ints, z: Complexes) -> tuple[Complexes, Floats]:
    """Places by Newton's method, from `z`, where Jacobians are a turning or a reflection; their unevenness there.

    It is 1 where such places are no single points but a curve, as the circle of an arm's.
    """
    designs, reach = panels.designs, panels.reach[design]
    step = DIFFERENCE * reach * np.array([0, 1, 1j])[:, None]
    places = designs.of(design)
    for _ in range(STEPS):
        (a, b), (c, d) = Local.at(designs.field, z + step, places).homogeneous
        # Every matrix is the sum of a turning and a reflection, each times a size.
        turning, reflection = np.asarray((a + d) + 1j * (c - b)), np.asarray((a - d) + 1j * (c + b))
        less = np.where(np.abs(turning[0]) > np.abs(reflection[0]), reflection / turning, turning / reflection)
        here, by_x, by_y = less[0], less[1] - less[0], less[2] - less[0]
        det = cross(by_x, by_y)
        way = -(cross(here, by_y) + 1j * cross(by_x, here)) / det * np.abs(step[1])
        way *= np.minimum(1.0, LONGEST * reach / np.abs(way))
        size, z = np.abs(here), np.where(np.isfinite(way), z + way, z)
    single = np.abs(det) > ALONG * np.abs(by_x) * np.abs(by_y)
    return z, np.where(np.isfinite(size) & single, size, 1.0)


def ended_at(cells: Parts, tips: Parts) -> Parts:
    """Cells that end at their points, instead of those that have some."""
    owner = np.unique(tips["cell"])
    ends = np.zeros(len(tips) + 2 * len(owner), dtype=TIP)
    ends[: len(tips)], ends[len(tips) :]["slot"] = tips, -1
    for k, name in enumerate(("low", "high")):
        added = ends[len(tips) + k * len(owner) :][: len(owner)]
        added["cell"], added["theta"] = owner, cells[name][owner]
    ends = ends[np.lexsort((-ends["slot"], ends["theta"], ends["cell"]))]
    # A point at the end of a cell stands for it.
    begins = np.diff(ends["cell"], prepend=-1) > 0
    ends = ends[begins | (np.diff(ends["theta"], prepend=-np.inf) > 0)]
    pair = np.flatnonzero(np.diff(ends["cell"]) == 0)
    divided_cells = cells[ends["cell"][pair]]
    for side, which in (("low", pair), ("high", pair + 1)):
        for key, field in ((side, "theta"), (f"{side}_slot", "slot"), (f"{side}_part", "part")):
            divided_cells[key] = ends[field][which]
    divided_cells["share"] /= np.bincount(ends["cell"][pair])[ends["cell"][pair]]
    return np.asarray(divided_cells)


def through_points(cells: Parts, segments: Parts) -> Parts:
    """Segments with those divided that meet the curve through the points of their cells, which are given for each."""
    low, high = (cells[side] == segments["slot"] for side in ("low_slot", "high_slot"))
    share = (segments["theta"] - cells["low"]) / (cells["high"] - cells["low"])
    one, two = cells["low_part"], cells["high_part"]
    part = np.where(low & high, np.clip(one + share * (two - one), *WITHIN), np.where(low, one, two))
    some = (low | high) & (part > 0) & (part < 1)
    inner, outer = segments["inner"][some], segments["outer"][some]
    below, above = segments[some], segments[some]
    below["outer"] = above["inner"] = inner + part[some] * (outer - inner)
    above["strip"] += 1
    below["kink"], above["kink"] = (low & high)[some], -1 * (low & high)[some]
    return np.concatenate([segments[~some], below, above])
