"""Laws of the clearances of fits: hole minus shaft, both of the same law over their tolerances."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mechdesign.ground.expressions import Number
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.questions.reliability.laws import Marginal, Normal, Uniform, normal_cdf, normal_quantile


@dataclass(frozen=True)
class _OfFit(Marginal):
    """Hole minus shaft, both of the same law over their tolerances; `hole` is the hole's share of the sum of both."""

    hole: float = 0.5

    @property
    def sigma(self) -> Number:
        return super().sigma * math.hypot(self.hole, 1.0 - self.hole)


class NormalFit(_OfFit, Normal):
    """Clearance of a fit whose hole and shaft are normal."""


class UniformFit(_OfFit):
    """Clearance of a fit whose hole and shaft are uniform: trapezoidal."""

    reach = Uniform.reach

    @property
    def moments(self) -> tuple[Number, Number, Number, Number]:
        hole, shaft = (0.5 * (self.high - self.low) * part / self.reach for part in (self.hole, 1.0 - self.hole))
        return self.mean, self.sigma**2, 0.0, Uniform.fourth * (hole**4 + shaft**4) + 6.0 * (hole * shaft) ** 2

    @property
    def kinks(self) -> Floats:
        edge = 0.5 * min(self.hole, 1.0 - self.hole) / max(self.hole, 1.0 - self.hole)
        return normal_quantile(np.array([edge, 1.0 - edge]))

    def at(self, u: Floats) -> Floats:
        width, wider, narrower = self.high - self.low, max(self.hole, 1.0 - self.hole), min(self.hole, 1.0 - self.hole)
        tail = normal_cdf(-np.abs(u))
        rising = np.sqrt(2.0 * wider * narrower * tail)
        inward = width * np.where(2.0 * wider * tail < narrower, rising, 0.5 * narrower + wider * tail)
        return self.from_ends(u, inward)


# Laws of fits, by the law of both the hole and the shaft.
FITS: Mapping[str, type[_OfFit]] = {Normal.name: NormalFit, Uniform.name: UniformFit}


def fit_law(distribution: str, hole: float, shaft: float, nominal: float) -> Marginal:
    """Law of a radial clearance about its mean, from half the diameter tolerances of the hole and the shaft."""
    reach = 0.5 * (hole + shaft)
    return FITS[distribution](-reach, reach, nominal, hole / (hole + shaft))
