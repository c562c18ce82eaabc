"""Smallest stiffness of the point of the stiffness section, in its weakest direction."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mechdesign.analyses.stiffness.compliance import principal
from mechdesign.analyses.workspace.indices.compliance import of_compliance
from mechdesign.analyses.workspace.indices.index import Evaluate, Index

if TYPE_CHECKING:
    from mechdesign.study import Study


def prepare(study: Study) -> Evaluate:
    """As ``k_min`` of stiffness.csv; 0 where the point is free [S4]."""
    return of_compliance(study, lambda soft: principal(soft)[0], 0.0)


INDEX = Index(
    "k_min", "stiffness to a force in the softest direction, at the point of the stiffness section", prepare,
    lambda study, field: study.units.label("stiffness"), crossing=0.0, section="stiffness",
)  # fmt: skip
