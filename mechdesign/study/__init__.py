"""The study file: reading, validation, and the mechanism and questions it describes."""

from mechdesign.study.loading import Study, load
from mechdesign.study.poses import PoseGroup, Poses
from mechdesign.study.schema.study_file import schema
from mechdesign.study.templates import template, template_path, templates
from mechdesign.study.text.units import Units

HELP_PAGE = "reference/study/index"

__all__ = ["PoseGroup", "Poses", "Study", "Units", "load", "schema", "template", "template_path", "templates"]
