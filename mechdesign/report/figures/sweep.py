"""Pictures of the cases of a matrix."""

from __future__ import annotations

from mechdesign.report.figures.rendering import Gallery
from mechdesign.results import Result
from mechdesign.study import Study


def figures(study: Study, result: Result) -> Gallery:
    """``main_effects`` and ``scatter``."""
    return Gallery()
