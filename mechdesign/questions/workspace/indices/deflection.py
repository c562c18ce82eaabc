"""How far the loads of the stiffness section move its point."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mechdesign.ground.errors import StudyError
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.questions.stiffness.schema import StiffnessSection
from mechdesign.questions.workspace.index import Evaluate, Index, length, of_compliance

if TYPE_CHECKING:
    from mechdesign.study import Study


def prepare(study: Study) -> Evaluate:
    """The largest displacement over the loads; infinite where the point is free.

    Raises
    ------
    StudyError
        If the section has no loads, or one that does not act on the asked point alone.
    """
    wrenches = StiffnessSection.of(study).wrenches
    loads = np.array([wrench for wrench in wrenches if wrench is not None])
    if not len(loads) or None in wrenches:
        message = "the index 'deflection' needs loads on the asked point, for example {loads: [[100, 0, 0]]}"
        raise StudyError((study.problem(message, "stiffness", "loads"),))

    def evaluate(soft: Floats) -> Floats:
        moved = np.einsum("nij,lj->nli", soft, loads[:, : soft.shape[1]])
        return np.asarray(np.hypot(moved[:, :, 0], moved[:, :, 1]).max(axis=1))

    return of_compliance(study, evaluate, np.inf)


INDEX = Index(
    "largest displacement of the stiffness section's point under its loads", prepare,
    length, crossing=float("inf"), section="stiffness",
)  # fmt: skip
