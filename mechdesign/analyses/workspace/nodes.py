"""Poses at the nodes of the workspace's grid, so that other questions can be asked all over it."""

from __future__ import annotations

import numpy as np

from mechdesign.analyses.workspace.curves import GRID, patches
from mechdesign.analyses.workspace.panels import find_panels
from mechdesign.analyses.workspace.pieces import Pieces
from mechdesign.analyses.workspace.rays import Designs
from mechdesign.analyses.workspace.region import CLOSE, RAYS, Question, questions
from mechdesign.errors import AssemblyError
from mechdesign.mechanism.algebra import Value
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
    asked = questions(study, wanted=())
    parts = [(question, _grid(question, MOST // GRID // len(asked))) for question in asked]
    z = np.concatenate([grid.ravel() for _, grid in parts])
    if not z.size:
        raise AssemblyError("poses: workspace has no node: nothing is reachable")
    point = study.workspace.point if study.workspace is not None else ""
    values = {f"{point}.x": z.real, f"{point}.y": z.imag}
    for name in asked[0].held:
        values[name] = np.concatenate([np.full(grid.size, question.held[name]) for question, grid in parts])
    group = PoseGroup(tuple(values), values, np.arange(len(z)))
    return Poses((group,), len(z), False, (len(z) // GRID, GRID))


def _grid(question: Question, most: int) -> Value:
    """Nodes of one region, shape (rays, GRID), on about `most` rays."""
    designs = Designs(question.field, {}, 1, question.about)
    panels = find_panels(designs, question.scan, CLOSE)
    if question.field.same_assembly:
        designs, panels = Pieces.of(designs, panels, question.scan, CLOSE.samples).only(0)
    if not panels.closes[0]:
        return np.zeros((0, GRID), dtype=complex)
    found = list(patches(designs, panels, min(question.rays or RAYS, most), CLOSE.samples))
    # Every panel has a fewest number of rays: of too many some are left out, never the ends of a patch: others begin.
    total = sum(float(np.ptp(patch.theta)) for patch in found)
    grids = []
    for patch in found:
        number = max(_FEWEST, round(most * float(np.ptp(patch.theta)) / total))
        kept = np.unique(np.linspace(0, len(patch.theta) - 1, min(number, len(patch.theta))).round().astype(int))
        grids.append(patch.grid(question.about)[kept])
    return np.asarray(np.concatenate(grids))
