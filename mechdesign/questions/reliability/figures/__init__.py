"""Pictures of errors: over a sweep or a map, densities, histograms, convergence, contributions, and the reliability."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from matplotlib.figure import Figure

from mechdesign.questions.reliability.figures.bars import allocation_figure, contributions_figure
from mechdesign.questions.reliability.figures.densities import density_figures
from mechdesign.questions.reliability.figures.errors import MAX_LISTED, estimate_figure, map_figures, sweep_figures
from mechdesign.questions.reliability.figures.samples import convergence_figure, histogram_figure, trend_figure
from mechdesign.questions.reliability.tables import DrawnErrors, Samples
from mechdesign.report.figures.looks import Sampled, look
from mechdesign.report.figures.panels import along, plane
from mechdesign.report.figures.rendering import Gallery
from mechdesign.results import Result, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses


def figures(study: Study, result: Result) -> Gallery:
    """Pictures of errors and failures that the tables of the result have data for."""
    drawn, tables = DrawnErrors.of(result), result.tables
    poses, samples = drawn.poses, drawn.samples
    swept, over = along(study, poses), plane(study, poses)
    gallery = Gallery()
    if swept is not None:
        gallery.add("of errors along the motion", sweep_figures, study, tables, swept)
    if over is not None:
        gallery.add("of errors over the poses", map_figures, study, result, over)
    few = poses.listed or (over is None and poses.count <= MAX_LISTED)
    if "reliability" in tables and (few or swept is not None):
        gallery.add("reliability", estimate_figure, study, tables["reliability"], poses, swept)
    if samples is not None:
        gallery.add("of samples", _sampled, study, tables, poses, samples)
    worst = samples.pose if samples is not None else 0
    gallery.add("contributions", contributions_figure, study, tables["contributions"], poses, worst)
    if "allocation" in tables:
        gallery.add("allocation", allocation_figure, study, tables)
    return gallery


def _sampled(study: Study, tables: Mapping[str, Table], poses: Poses, samples: Samples) -> Gallery:
    """Pictures of the tables that only methods which draw samples give."""
    gallery = Gallery()
    # The tables are those of the first sampling method, which the moments name.
    method = next(name for name in tables["moments"]["method"].tolist() if look(name).sampled)
    makers: dict[str, Callable[[Sampled], Figure | Mapping[str, Figure]]] = {
        "density": density_figures, "histogram": histogram_figure, "convergence": convergence_figure,
        "estimate": trend_figure,
    }  # fmt: skip
    for name, make in makers.items():
        if name in tables:
            gallery.add(name, make, Sampled(study, tables, method, samples, poses))
    return gallery
