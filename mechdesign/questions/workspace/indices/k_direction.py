"""Stiffness of the point of the stiffness section in the direction that it names."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mechdesign.ground.errors import StudyError
from mechdesign.questions.stiffness.compliance import directional
from mechdesign.questions.stiffness.schema import StiffnessSection
from mechdesign.questions.workspace.index import Evaluate, Index, of_compliance, stiffness

if TYPE_CHECKING:
    from mechdesign.study import Study


def prepare(study: Study) -> Evaluate:
    """As ``k_direction`` of stiffness.csv; 0 where the point is free.

    Raises
    ------
    StudyError
        If the section names no direction.
    """
    direction = StiffnessSection.of(study).direction
    if direction is None:
        message = "the index 'k_direction' needs a direction, for example {direction: 90}"
        raise StudyError((study.problem(message, "stiffness", "direction"),))
    turn = direction * study.units.angle_factor
    return of_compliance(study, lambda soft: directional(soft, turn), 0.0)


INDEX = Index(
    "stiffness to a force in the stiffness section's direction, at its point", prepare,
    stiffness, crossing=0.0, section="stiffness", formula="1/(d^T C d)",
)  # fmt: skip
