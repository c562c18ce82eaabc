"""Poses at the nodes of a grid that follows the boundary of a workspace."""

from __future__ import annotations

import numpy as np

from mechdesign.ground.errors import AssemblyError
from mechdesign.ground.numerics.arrays import Complexes, Floats, evenly
from mechdesign.motion.rows import Poses
from mechdesign.motion.rules import GivenRows, Sector, Sectors
from mechdesign.region.patches import GRID, patches
from mechdesign.region.pieces import counted
from mechdesign.region.rays import SINGLE, Scanned
from mechdesign.region.regions import RAYS, regions
from mechdesign.study import Study

# Approximate number of poses of all regions together: a question may be costly at each pose.
MAX_POSES = 2000
# Least number of rays of a patch.
MIN_RAYS = 3
# Least number of rays of a region: with fewer a map does not show its levels.
ENOUGH_RAYS = 36


def workspace_nodes(study: Study) -> Poses:
    """Poses at the nodes of a grid that follows the boundary, as that of ``local.csv`` but with fewer rays.

    Returns
    -------
    Poses
        The point's x and y, then the held coordinates; a grid of rays by nodes.

    Raises
    ------
    StudyError
        If the workspace section lacks a key that has no default.
    AssemblyError
        If nothing is reachable.
    """
    all_regions = regions(study)
    most = max(ENOUGH_RAYS, MAX_POSES // GRID // len(all_regions))
    grids: list[Complexes] = []
    all_sectors: list[Sectors] = []
    held: dict[str, list[Floats]] = {name: [] for name in all_regions[0].held}
    for region in all_regions:
        # Poses of other questions keep the sketch's elbows, in any assembly as well.
        panels, _ = counted(Scanned(region.field.members[0], {}, 1, region.about, region.scan, SINGLE))
        if not panels.closes[0]:
            continue
        rays = region.rays or RAYS
        coarse, finer = list(patches(panels, min(rays, most))), list(patches(panels, rays))
        # Each panel has at least `FEWEST` rays; of too many, some between the first and the last are left out.
        total = sum(float(np.ptp(patch.theta)) for patch in coarse)
        sectors = []
        for patch, fine in zip(coarse, finer if len(finer) == len(coarse) else coarse, strict=True):
            kept = evenly(len(patch.theta), max(MIN_RAYS, round(most * float(np.ptp(patch.theta)) / total)))
            begin = sum(len(grid) for grid in grids)
            grids.append(patch.grid[kept])
            sectors.append(Sector(slice(begin, begin + len(kept)), region.about, fine.grid))
            for name, value in region.held.items():
                held[name].append(np.full(grids[-1].size, value))
        outline = tuple(edge.places for patch in finer for edge in patch.edges)
        all_sectors.append(Sectors(tuple(sectors), outline))
    if not grids:
        raise AssemblyError("poses: workspace has no node: nothing is reachable")
    z = np.concatenate([grid.ravel() for grid in grids])
    point = study.workspace.point if study.workspace is not None else ""
    values = {f"{point}.x": z.real, f"{point}.y": z.imag}
    values |= {name: np.concatenate(parts) for name, parts in held.items()}
    return Poses(GivenRows(values, shape=(len(z) // GRID, GRID), regions=all_sectors))
