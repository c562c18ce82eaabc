"""Pictures of a motion: curves, paths, single poses, how force is passed on, and other assemblies of the same links."""

from __future__ import annotations

from mechdesign.report.before import known
from mechdesign.report.figures.kinematics.curves import curves_figure
from mechdesign.report.figures.kinematics.paths import modes_figure, paths_figure
from mechdesign.report.figures.kinematics.poses import poses_figure
from mechdesign.report.figures.kinematics.transmission import transmission_figure
from mechdesign.report.figures.rendering import Gallery
from mechdesign.report.figures.scene import Sweep
from mechdesign.results import Result
from mechdesign.study import Study


def figures(study: Study, result: Result) -> Gallery:
    """``motion``, ``paths``, ``poses``, ``transmission`` and ``modes``.

    They are curves of a sweep or path, poses and point paths, limits or listed poses one by one, how force is passed
    on, and every assembly. Lists of poses have neither curves nor paths, grids have no pictures but their assemblies.
    """
    found = Gallery()
    if result.drawn["poses"].motion:
        found.add("motion", curves_figure, study, result)
        sweep = Sweep.of(result.drawn["motion"])
        if len(sweep.valid):
            centres = result.tables.get("instant_centres")
            found.add("paths", paths_figure, sweep, centres=centres, before=known(result.drawn))
    found.add("poses", poses_figure, study, result)
    if result.drawn["poses"].motion:
        found.add("transmission", transmission_figure, study, result)
    if "modes" in result.tables:
        found.add("modes", modes_figure, study, result)
    return found
