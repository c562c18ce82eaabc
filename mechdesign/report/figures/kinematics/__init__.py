"""Pictures of a motion: curves over the sweep, the mechanism in several poses, and its other assemblies."""

from __future__ import annotations

from matplotlib.figure import Figure

from mechdesign.report.figures.kinematics.curves import curves_figure
from mechdesign.report.figures.kinematics.paths import modes_figure, paths_figure
from mechdesign.report.figures.rendering import Gallery
from mechdesign.report.figures.sweep import Sweep
from mechdesign.results import Result
from mechdesign.study import Study


def figures(study: Study, result: Result) -> Gallery:
    """``motion`` (curves of a sweep or path), ``paths`` (poses and point paths) and ``modes`` (every assembly).

    Lists and grids of poses have neither curves nor paths.
    """
    found = Gallery()
    if result.drawn["poses"].motion:
        found.add("motion", curves_figure, study, result)
        found.add("paths", _paths, result)
    if "modes" in result.tables:
        found.add("modes", modes_figure, study, result)
    return found


def _paths(result: Result) -> Figure | None:
    sweep = Sweep.of(result.drawn["motion"])
    return paths_figure(sweep) if len(sweep.valid) else None
