"""Position error of the workspace's point to the first order, from what the reliability section says varies."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mechdesign.mechanism import Configuration
from mechdesign.numerics.arrays import Floats
from mechdesign.questions.workspace.index import Evaluate, Index, length, of_configurations
from mechdesign.questions.workspace.schema import WorkspaceSection

if TYPE_CHECKING:
    from mechdesign.study import Study


def prepare(study: Study) -> Evaluate:
    """sqrt(var x + var y), the drives held [S2, eq. 9]."""
    from mechdesign.questions.kinematics.rates import DriveRates
    from mechdesign.questions.reliability.deflection import elasticity
    from mechdesign.questions.reliability.first_order import linear_errors
    from mechdesign.questions.reliability.question import CoordinateChannel
    from mechdesign.questions.reliability.study_sources import find_sources

    mechanism, point = study.mechanism, WorkspaceSection.of(study).point
    channels = tuple(CoordinateChannel(mechanism.coordinate(f"{point}.{axis}"), 0) for axis in "xy")
    sources, bent = find_sources(study)[0], elasticity(study)[0]

    def evaluate(configuration: Configuration) -> Floats:
        elastic = None if bent is None else bent.at(configuration, channels)
        linear = linear_errors(mechanism, configuration, channels, sources, DriveRates((), ()), elastic)
        return np.asarray(np.sqrt((linear.deviation() ** 2).sum(axis=0)))

    return of_configurations(evaluate)


INDEX = Index(
    "sqrt(sigma_x^2 + sigma_y^2) of the point's first-order error", prepare,
    length, crossing=float("inf"), section="reliability", source="S2, eq. 9",
)  # fmt: skip
