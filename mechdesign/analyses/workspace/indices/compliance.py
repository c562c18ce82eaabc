"""Indices that follow from the compliance at the point of the stiffness section."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from mechdesign.analyses.workspace.indices.assembled import assembled_only
from mechdesign.analyses.workspace.indices.index import Evaluate
from mechdesign.errors import StudyError
from mechdesign.mechanism.configuration import Configuration
from mechdesign.numerics.arrays import Floats

if TYPE_CHECKING:
    from mechdesign.analyses.stiffness.analysis import Body
    from mechdesign.study import Study


def of_compliance(study: Study, value: Callable[[Floats], Floats], free: float) -> Evaluate:
    """An index from compliances, shape (n, size, size), to values, shape (n,); `free` where a twist is free.

    Raises
    ------
    StudyError
        If nothing gives: every stiffness would be infinite.
    """
    # Here, for the poses of a stiffness question may themselves be nodes of a workspace.
    from mechdesign.analyses.stiffness.analysis import ask

    section = study.stiffness
    assert section is not None
    if not (section.elastic or section.actuators or section.bearings):
        message = "indices of stiffness need something that gives: elastic links, actuators or bearings"
        raise StudyError((study.problem(message, "stiffness"),))
    return assembled_only(partial(_evaluate, ask(study), value, free))


def _evaluate(asked: Body, value: Callable[[Floats], Floats], free: float, configuration: Configuration) -> Floats:
    from mechdesign.analyses.stiffness.analysis import hold

    soft = hold(asked, configuration)[0].compliance
    with np.errstate(divide="ignore", invalid="ignore"):
        found = value(soft)
    return np.where(np.isnan(soft).any(axis=(1, 2)), free, found)
