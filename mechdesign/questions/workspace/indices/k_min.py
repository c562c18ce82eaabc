"""Smallest stiffness of the point of the stiffness section, in its weakest direction."""

from mechdesign.questions.stiffness.screws import principal
from mechdesign.questions.workspace.index import Index, of_compliance, stiffness

# As ``k_min`` of stiffness.csv; 0 where the point is free.
INDEX = Index(
    "stiffness to a force in the softest direction, at the point of the stiffness section",
    lambda study: of_compliance(study, lambda soft: principal(soft)[0], 0.0),
    stiffness, crossing=0.0, section="stiffness", source="S4",
)  # fmt: skip
