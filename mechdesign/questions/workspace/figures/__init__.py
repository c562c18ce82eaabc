"""Pictures of a workspace: maps of indices, the boundary with the mechanism in several poses, ranges of the drives."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.figure import Figure

from mechdesign.questions.workspace.drawn import DrawnRegion
from mechdesign.questions.workspace.figures.boundary import (
    drives_figure,
    inscribed_figure,
    side_by_side,
    workspace_figure,
)
from mechdesign.questions.workspace.figures.ellipses import ellipses_figure
from mechdesign.questions.workspace.figures.index_maps import map_figures
from mechdesign.questions.workspace.figures.point_path import path_figures
from mechdesign.questions.workspace.figures.ranged import range_figures
from mechdesign.questions.workspace.figures.regions import regions
from mechdesign.report.figures.before import Before
from mechdesign.report.figures.rendering import Gallery
from mechdesign.results import Result
from mechdesign.study import Study


def figures(study: Study, result: Result, before: Before | None = None) -> Mapping[str, Figure]:
    """A map of each local index, the boundary with poses, the largest shapes inside, the drives along the boundary.

    Several values of held coordinates stand side by side. Of a point with one degree of freedom its path is drawn; over
    a range of a held coordinate, what ends the region.
    """
    if "path" in result.tables:
        return path_figures(study, result, before)
    if "local" not in result.tables:
        return range_figures(study, result, before)
    shown = regions(study, result)
    if not shown:
        return {}
    gallery = Gallery()
    gallery.add("of indices", map_figures, study, shown)
    if len(shown) == 1:
        drawn = DrawnRegion.of(result)
        gallery.add("workspace", workspace_figure, study, drawn, shown[0], before=before)
        gallery.add("ellipses", ellipses_figure, study, shown[0], drawn.ellipses)
    else:
        gallery.add("workspace", side_by_side, study, shown, before)
    gallery.add("inscribed", inscribed_figure, study, result, shown)
    if any(len(region.boundary) for region in shown):
        gallery.add("drives", drives_figure, study, shown)
    return gallery
