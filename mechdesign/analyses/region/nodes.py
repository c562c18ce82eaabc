"""Poses at the nodes of the workspace's grid, so that other questions can be asked all over it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from mechdesign.analyses.region.curves import GRID, patches
from mechdesign.analyses.region.panels import SINGLE, find_panels
from mechdesign.analyses.region.pieces import Pieces
from mechdesign.analyses.region.rays import Designs
from mechdesign.analyses.region.regions import RAYS, Region, regions
from mechdesign.errors import AssemblyError
from mechdesign.numerics.arrays import Complexes
from mechdesign.study import Study
from mechdesign.study.poses import PoseGroup, Poses

# About so many poses of all regions together (a question may cost much at each), and so many rays of a patch at least.
MOST, _FEWEST = 2000, 3


def workspace_nodes(study: Study) -> Poses:
    """Nodes of a grid that follows the boundary, as that of ``local.csv`` but with fewer rays.

    Returns
    -------
    Poses
        The point's x and y, then the held coordinates; a grid of rays by nodes.

    Raises
    ------
    StudyError
        If the workspace section lacks what cannot be assumed.
    AssemblyError
        If nothing is reachable.
    """
    asked = regions(study)
    parts = [(region, grid) for region in asked for grid in _grids(region, MOST // GRID // len(asked))]
    if not parts:
        raise AssemblyError("poses: workspace has no node: nothing is reachable")
    z = np.concatenate([grid.ravel() for _, grid in parts])
    ends = np.cumsum([0, *(len(grid) for _, grid in parts)]).tolist()
    point = study.workspace.point if study.workspace is not None else ""
    values = {f"{point}.x": z.real, f"{point}.y": z.imag}
    for name in asked[0].held:
        values[name] = np.concatenate([np.full(grid.size, region.held[name]) for region, grid in parts])
    group = PoseGroup(tuple(values), values, np.arange(len(z)))
    patches = tuple(slice(begin, end) for begin, end in pairwise(ends))
    return Poses((group,), len(z), False, (len(z) // GRID, GRID), patches=patches)


def _grids(region: Region, most: int) -> list[Complexes]:
    """Nodes of the patches of one region, shape (rays, GRID), on about `most` rays."""
    designs = Designs(region.field, {}, 1, region.about)
    panels = find_panels(designs, region.scan, SINGLE)
    if region.field.same_assembly:
        designs, panels = Pieces.of(designs, panels, region.scan, SINGLE.samples).only(0)
    if not panels.closes[0]:
        return []
    found = list(patches(designs, panels, min(region.rays or RAYS, most), SINGLE.samples))
    # Every panel has a fewest number of rays: of too many some are left out, never the ends of a patch: others begin.
    total = sum(float(np.ptp(patch.theta)) for patch in found)
    grids = []
    for patch in found:
        number = max(_FEWEST, round(most * float(np.ptp(patch.theta)) / total))
        kept = np.unique(np.linspace(0, len(patch.theta) - 1, min(number, len(patch.theta))).round().astype(int))
        grids.append(patch.grid(region.about)[kept])
    return grids
