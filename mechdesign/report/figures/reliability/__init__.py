"""Pictures of errors: over a sweep or a map, densities, histograms, convergence, contributions, and the reliability."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from matplotlib.figure import Figure

from mechdesign.analyses.poses import pose_in_words
from mechdesign.report.figures.panels import along, plane
from mechdesign.report.figures.reliability.bars import allocation_figure, contributions_figure
from mechdesign.report.figures.reliability.errors import MAX_LISTED, estimate_figure, map_figures, sweep_figures
from mechdesign.report.figures.reliability.looks import Sampled, look
from mechdesign.report.figures.reliability.samples import (
    convergence_figure,
    density_figures,
    histogram_figure,
    trend_figure,
)
from mechdesign.report.figures.rendering import Gallery
from mechdesign.results import Result, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses


def figures(study: Study, result: Result) -> Gallery:
    """Whatever the result holds enough of to draw."""
    poses, tables = result.drawn["poses"], result.tables
    swept, over = along(study, poses), plane(study, poses)
    found = Gallery()
    if swept is not None:
        found.add("of errors along the motion", sweep_figures, study, tables, swept)
    if over is not None:
        found.add("of errors over the poses", map_figures, study, result, over)
    few = poses.listed or (over is None and poses.count <= MAX_LISTED)
    if "reliability" in tables and (few or swept is not None):
        found.add("reliability", estimate_figure, study, tables["reliability"], poses, swept)
    found.add("of samples", _sampled, study, result, poses)
    found.add("contributions", contributions_figure, study, tables["contributions"], poses)
    if "allocation" in tables:
        found.add("allocation", allocation_figure, study, tables["allocation"])
    return found


def _sampled(study: Study, result: Result, poses: Poses) -> Gallery:
    """Pictures of the tables that only methods which draw samples give."""
    tables, moments = result.tables, result.tables["moments"]
    found = Gallery()
    # The tables are of the first method that samples errors; the moments hold its name.
    method = next((name for name in moments["method"].tolist() if look(name).sampled), None)
    if method is None:
        return found
    makers: dict[str, Callable[[Sampled], Figure | Mapping[str, Figure]]] = {
        "density": density_figures, "histogram": histogram_figure, "convergence": convergence_figure,
        "estimate": trend_figure,
    }  # fmt: skip
    for name, make in makers.items():
        if name in tables:
            found.add(name, make, Sampled(study, tables, method, *_pose(study, poses, tables[name])))
    return found


def _pose(study: Study, poses: Poses, table: Table) -> tuple[int, str]:
    """Row and words of the pose that a table begins with."""
    first = [table[name][0] for name in poses.names]
    rows = [np.array_equal(row, first, equal_nan=True) for row in zip(*poses.values.values(), strict=True)]
    pose = rows.index(True)
    return pose, pose_in_words(study, poses, pose)
