"""Pictures of a motion: curves over the sweep, the mechanism in several poses, and its other assemblies."""

from __future__ import annotations

from matplotlib.figure import Figure

from mechdesign.report.figures.curves import curves_figure
from mechdesign.report.figures.modes import modes_figure
from mechdesign.report.figures.paths import paths_figure
from mechdesign.report.figures.sweep import is_motion, solve_sweep
from mechdesign.results import Result
from mechdesign.study import Study


def figures(study: Study, result: Result) -> dict[str, Figure]:
    """``motion`` (curves of a sweep or path), ``paths`` (poses and point paths) and ``modes`` (every assembly).

    Lists and grids of poses have neither curves nor paths.
    """
    found: dict[str, Figure] = {}
    if is_motion(study.poses("kinematics")):
        curves = curves_figure(study, result)
        if curves is not None:
            found["motion"] = curves
        sweep = solve_sweep(study)
        if len(sweep.valid):
            found["paths"] = paths_figure(sweep)
    if "modes" in result.tables:
        found["modes"] = modes_figure(study)
    return found
