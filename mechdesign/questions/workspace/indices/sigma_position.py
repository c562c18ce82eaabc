"""Position error of the workspace's point to the first order, from what the reliability section says varies."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism import Configuration
from mechdesign.questions.workspace.index import Evaluate, Index, length, of_configurations
from mechdesign.questions.workspace.schema import WorkspaceSection

if TYPE_CHECKING:
    from mechdesign.study import Study


def prepare(study: Study) -> Evaluate:
    """sqrt(var x + var y), the drives held [S2, eq. 9]."""
    from mechdesign.questions.kinematics.rates import DriveRates
    from mechdesign.questions.reliability.errors import Errors
    from mechdesign.questions.reliability.question import Channel, ReliabilityQuestion

    point = WorkspaceSection.of(study).point
    channels = tuple(Channel.of(study.mechanism.coordinate(f"{point}.{axis}")) for axis in "xy")
    errors = replace(Errors.of(study), question=ReliabilityQuestion(channels))

    def evaluate(configuration: Configuration) -> Floats:
        linear = errors.linearized(configuration, DriveRates((), ()))[1]
        return np.asarray(np.sqrt((linear.deviation()[:2] ** 2).sum(axis=0)))

    return of_configurations(evaluate)


INDEX = Index(
    "sqrt(sigma_x^2 + sigma_y^2) of the point's first-order error", prepare,
    length, crossing=float("inf"), section="reliability", source="S2, eq. 9",
)  # fmt: skip
