"""Pictures of a motion: curves, paths, single poses, how force is passed on, and other assemblies of the same links."""

from __future__ import annotations

from mechdesign.questions.kinematics.drawn import DrawnMotion
from mechdesign.questions.kinematics.figures.curves import curves_figure
from mechdesign.questions.kinematics.figures.paths import modes_figure, paths_figure
from mechdesign.questions.kinematics.figures.poses import poses_figure
from mechdesign.questions.kinematics.figures.transmission import transmission_figure
from mechdesign.report.figures.before import Before
from mechdesign.report.figures.rendering import Gallery
from mechdesign.report.figures.scene import Sweep
from mechdesign.results import Result
from mechdesign.study import Study


def figures(study: Study, result: Result, before: Before | None = None) -> Gallery:
    """``motion``, ``paths``, ``poses``, ``transmission`` and ``modes``.

    They are curves of a sweep or path, poses and point paths, limits or listed poses one by one, how force is passed
    on, and every assembly. Lists of poses have neither curves nor paths, grids have no pictures but their assemblies.
    """
    gallery, drawn, tables = Gallery(), DrawnMotion.of(result), result.tables
    sweep = Sweep.of(drawn.shown)
    if sweep.poses.motion:
        gallery.add("motion", curves_figure, study, tables, sweep.poses, before)
        if len(sweep.valid):
            gallery.add("paths", paths_figure, sweep, centres=tables.get("instant_centres"), before=before)
    gallery.add("poses", poses_figure, study, sweep, drawn)
    if sweep.poses.motion:
        gallery.add("transmission", transmission_figure, study, tables, sweep)
    if "modes" in tables:
        gallery.add("modes", modes_figure, study, tables["modes"], drawn.modes, result.counts["modes"])
    return gallery
