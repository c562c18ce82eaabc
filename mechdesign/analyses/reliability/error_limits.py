"""Quantities whose errors are asked, limits of errors, and the correlation of two errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.numerics.arrays import Floats
from mechdesign.study.schema.reliability import SUFFIXES


@dataclass(frozen=True)
class Channel:
    """One quantity whose error is asked: a coordinate, or its velocity or acceleration (`order` 0, 1, 2)."""

    coordinate: Coordinate
    order: int

    @property
    def name(self) -> str:
        """As a study's limits name it: ``P.x``, ``P.x_velocity``."""
        return self.coordinate.name + SUFFIXES[self.order]


@dataclass(frozen=True)
class Band:
    """Error number `output` within [low, high]; either may be infinite."""

    output: int
    low: float
    high: float


@dataclass(frozen=True)
class Disc:
    """Errors number `x` and `y` within a circle about zero."""

    x: int
    y: int
    radius: float


def correlation(covariance: Floats) -> Floats:
    """Correlation of two errors, of shape (..., 2, 2); nan where one does not vary [S2, eq. 11, prints its inverse]."""
    with np.errstate(invalid="ignore", divide="ignore"):
        product = np.sqrt(covariance[..., 0, 0] * covariance[..., 1, 1])
        return np.asarray(np.where(product > 0, covariance[..., 0, 1] / product, np.nan))
