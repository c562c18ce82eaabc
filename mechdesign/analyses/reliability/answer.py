"""All that the tables of reliability are made from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.poses import pose_columns
from mechdesign.analyses.reliability.first_order import ORDERS, FirstOrder
from mechdesign.analyses.reliability.question import Question
from mechdesign.analyses.reliability.simulation import Sums
from mechdesign.analyses.reliability.sobol import Indices
from mechdesign.analyses.reliability.task import Found
from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.results import Column
from mechdesign.study import Study
from mechdesign.study.poses import Poses

_KINDS = {
    "length": ("length", "velocity", "acceleration"),
    "angle": ("angle", "angular_velocity", "angular_acceleration"),
    "none": ("none", "none", "none"),
}


@dataclass(frozen=True, eq=False)
class Answer:
    """All that the tables are made from.

    Parameters
    ----------
    reason : int8 array, shape (poses,)
    nominal : ndarray, shape (channels, poses)
        In study units.
    found : sequence of Found
        What each method says.
    first_order : Found
        What the analytic method says, whose moments stand in where no method gives any.
    indices : dict of int to Indices
        Sobol' indices by pose, where they are asked.
    """

    study: Study
    poses: Poses
    question: Question
    reason: NDArray[np.int8]
    nominal: Floats
    linear: FirstOrder
    found: Sequence[Found]
    first_order: Found
    indices: Mapping[int, Indices] = field(default_factory=dict)

    @property
    def sums(self) -> dict[int, Sums]:
        """By pose, of the first method that samples the errors."""
        return next((each.sums for each in self.found if each.sums), {})

    @property
    def scale(self) -> Floats:
        """Study units in one unit of the core, shape (channels,)."""
        turn = 1.0 / self.study.units.angle_factor
        return np.array([turn if c.coordinate.quantity == "angle" else 1.0 for c in self.question.channels])

    @property
    def labels(self) -> tuple[list[str], list[str], list[str]]:
        """Output, order and unit of each channel."""
        channels = self.question.channels
        return (
            [c.coordinate.name for c in channels],
            [ORDERS[c.order] for c in channels],
            [self.study.units.label(_KINDS[c.coordinate.quantity][c.order]) for c in channels],
        )

    def at(self, rows: Ints) -> list[Column]:
        """Columns of the poses of these rows."""
        return [Column(c.name, c.values[rows], c.unit, c.meaning) for c in pose_columns(self.study, self.poses)]
