"""Pictures of a stiffness: equivalent springs [S4, Fig. 6], directions, curves or maps, deflections, free motion."""

from __future__ import annotations

from mechdesign.report.figures.panels import along, plane
from mechdesign.report.figures.rendering import Gallery
from mechdesign.report.figures.stiffness.deflections import deflections_figure, directions_figure
from mechdesign.report.figures.stiffness.joint_forces import joint_force_figures
from mechdesign.report.figures.stiffness.over_poses import curves_figure, map_figure
from mechdesign.report.figures.stiffness.springs import free_motion_figure, springs_figure
from mechdesign.results import Result
from mechdesign.study import Study


def figures(study: Study, result: Result) -> Gallery:
    """``springs`` (first pose), ``directions`` (a few poses), and over many poses ``stiffness``, curves or a map.

    Under loads ``deflections`` (first pose), and along a sweep or path what the joints bear.
    """
    found = Gallery()
    drawn, poses = result.drawn, result.drawn["poses"]
    if "first" in drawn:
        found.add("springs", springs_figure, study, poses, drawn["first"])
        found.add("deflections", deflections_figure, study, poses, drawn["first"])
    if "loose" in drawn:
        found.add("free", free_motion_figure, study, result, drawn["loose"])
    found.add("directions", directions_figure, study, result)
    if (over := plane(study, poses)) is not None:
        found.add("stiffness", map_figure, study, result, over)
    if (swept := along(study, poses)) is not None:
        found.add("stiffness", curves_figure, study, result, swept)
    if "forces" in result.tables:
        found.add("joint_forces", joint_force_figures, study, result)
    return found
