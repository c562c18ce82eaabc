"""Position error of the workspace's point to the first order, from what the reliability section says varies."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from mechdesign.analyses.kinematics.rates import DriveRates
from mechdesign.analyses.reliability.deflection import Elasticity, elasticity
from mechdesign.analyses.reliability.error_limits import Channel
from mechdesign.analyses.reliability.first_order import linear_errors
from mechdesign.analyses.reliability.sources import Sources, find_sources
from mechdesign.analyses.workspace.indices.assembled import assembled_only
from mechdesign.analyses.workspace.indices.index import Evaluate, Index
from mechdesign.mechanism import Configuration, Mechanism
from mechdesign.numerics.arrays import Floats

if TYPE_CHECKING:
    from mechdesign.study import Study

STILL = DriveRates((), ())


def prepare(study: Study) -> Evaluate:
    """Find what varies."""
    assert study.workspace is not None
    mechanism, point = study.mechanism, study.workspace.point
    channels = tuple(Channel(mechanism.coordinate(f"{point}.{axis}"), 0) for axis in "xy")
    return assembled_only(partial(evaluate, mechanism, channels, find_sources(study)[0], elasticity(study)[0]))


def evaluate(
    mechanism: Mechanism,
    channels: tuple[Channel, ...],
    sources: Sources,
    bent: Elasticity | None,
    configuration: Configuration,
) -> Floats:
    """sqrt(var x + var y), the drives held [S2, eq. 9]."""
    elastic = None if bent is None else bent.at(configuration, channels)
    linear = linear_errors(mechanism, configuration, channels, sources, STILL, elastic)
    return np.asarray(np.sqrt((linear.deviation() ** 2).sum(axis=0)))


INDEX = Index(
    "sigma_position", "sqrt(sigma_x^2 + sigma_y^2) of the point's first-order error", prepare,
    lambda study, field: study.units.label("length"), crossing=float("inf"), section="reliability",
)  # fmt: skip
