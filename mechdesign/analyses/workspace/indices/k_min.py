"""Smallest stiffness of the point of the stiffness section, in its weakest direction."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from mechdesign.analyses.workspace.indices.assembled import assembled_only
from mechdesign.analyses.workspace.indices.index import Evaluate, Index
from mechdesign.analyses.workspace.indices.local import Floats
from mechdesign.mechanism.configuration import Configuration

if TYPE_CHECKING:
    from mechdesign.analyses.stiffness.analysis import Asked
    from mechdesign.study import Study


def prepare(study: Study) -> Evaluate:
    """Find the legs that hold the point."""
    # Here, for the poses of a stiffness question may themselves be nodes of a workspace.
    from mechdesign.analyses.stiffness.analysis import ask

    return assembled_only(partial(evaluate, ask(study)))


def evaluate(asked: Asked, configuration: Configuration) -> Floats:
    """Stiffness to a force in the softest direction, as ``k_min`` of stiffness.csv; 0 where the point is free [S4]."""
    from mechdesign.analyses.stiffness.analysis import evaluate as hold

    soft = hold(asked, configuration)[0].compliance
    mean, half = 0.5 * (soft[:, 0, 0] + soft[:, 1, 1]), 0.5 * (soft[:, 0, 0] - soft[:, 1, 1])
    with np.errstate(divide="ignore"):
        least = 1 / (mean + np.hypot(half, soft[:, 0, 1]))
    return np.where(np.isnan(mean), 0.0, least)


INDEX = Index(
    "k_min", "stiffness to a force in the softest direction, at the point of the stiffness section", prepare,
    lambda study, field: study.units.label("stiffness"), crossing=0.0, section="stiffness",
)  # fmt: skip
