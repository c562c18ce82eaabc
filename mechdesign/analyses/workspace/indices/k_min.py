"""Smallest stiffness of the point of the stiffness section, in its weakest direction."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mechdesign.analyses.workspace.indices.compliance import of_compliance
from mechdesign.analyses.workspace.indices.index import Evaluate, Index
from mechdesign.analyses.workspace.indices.local import Floats

if TYPE_CHECKING:
    from mechdesign.study import Study


def prepare(study: Study) -> Evaluate:
    """As ``k_min`` of stiffness.csv; 0 where the point is free [S4]."""
    return of_compliance(study, evaluate, 0.0)


def evaluate(soft: Floats) -> Floats:
    """Stiffness to a force in the softest direction."""
    mean, half = 0.5 * (soft[:, 0, 0] + soft[:, 1, 1]), 0.5 * (soft[:, 0, 0] - soft[:, 1, 1])
    return np.asarray(1 / (mean + np.hypot(half, soft[:, 0, 1])))


INDEX = Index(
    "k_min", "stiffness to a force in the softest direction, at the point of the stiffness section", prepare,
    lambda study, field: study.units.label("stiffness"), crossing=0.0, section="stiffness",
)  # fmt: skip
