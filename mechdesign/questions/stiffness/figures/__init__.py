"""Pictures of a stiffness: equivalent springs [S4, Fig. 6], directions, curves or maps, deflections, free motion."""

from __future__ import annotations

from mechdesign.questions.stiffness.analysis import DrawnStiffness
from mechdesign.questions.stiffness.figures.deflections import deflections_figure, directions_figure
from mechdesign.questions.stiffness.figures.joint_forces import joint_force_figures
from mechdesign.questions.stiffness.figures.over_poses import curves_figure, map_figure
from mechdesign.questions.stiffness.figures.springs import free_motion_figure, springs_figure
from mechdesign.report.figures.panels import along, plane
from mechdesign.report.figures.rendering import Gallery
from mechdesign.results import Result
from mechdesign.study import Study


def figures(study: Study, result: Result) -> Gallery:
    """``springs`` (first pose), ``directions`` (a few poses), and over many poses ``stiffness``, curves or a map.

    Under loads ``deflections`` (first pose), and along a sweep or path what the joints bear.
    """
    gallery, drawn, tables = Gallery(), DrawnStiffness.of(result), result.tables
    poses = drawn.shown.poses
    if drawn.first is not None:
        gallery.add("springs", springs_figure, study, poses, drawn.first)
        gallery.add("deflections", deflections_figure, study, poses, drawn.first)
    if drawn.loose is not None:
        gallery.add("free", free_motion_figure, study, tables["stiffness"], poses, drawn.loose)
    gallery.add("directions", directions_figure, study, tables, drawn.shown)
    if (over := plane(study, poses)) is not None:
        gallery.add("stiffness", map_figure, study, tables["stiffness"], over)
    if (swept := along(study, poses)) is not None:
        gallery.add("stiffness", curves_figure, study, tables["stiffness"], swept)
        if "forces" in tables:
            gallery.add("joint_forces", joint_force_figures, study, tables["forces"], poses.count, swept)
    return gallery
