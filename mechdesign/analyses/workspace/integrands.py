"""What is integrated over a region: powers of indices, with what makes their kinks integrable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.workspace.index import Prepared
from mechdesign.analyses.workspace.local import Local
from mechdesign.mechanism.algebra import Value, quiet
from mechdesign.numerics.arrays import Floats


@dataclass(frozen=True, eq=False)
class Integrand:
    """An index, or its square (for the standard deviation)."""

    index: Prepared
    power: int = 1

    @property
    def kinked(self) -> bool:
        """Whether it has a kink where singular values meet."""
        return self.index.index.kink is not None

    def values(self, local: Local) -> Floats:
        """Values at points; 0 where there is none: on the boundary itself rounding leaves an interval of no width."""
        found = self.index.values(local)
        return _finite(local, found if self.power == 1 else found * found)

    @quiet
    def __call__(self, local: Local) -> tuple[Floats, Floats | None]:
        """Values at points, and k where the integrand is a smooth function plus k sqrt(w); None without a kink."""
        kink = self.index.index.kink
        # Where more than two singular values may meet, the kinks are not of that form.
        if kink is None or (len(local.homogeneous) > 2 and self.index.name != "inverse_condition"):
            return self.values(local), None
        slope = kink(local)
        if self.power == 2:
            # (s + k sqrt w)^2 = s^2 + k^2 w + 2 s k sqrt w
            slope = 2 * slope * (self.index.values(local) - slope * np.sqrt(local.roundness))
        return self.values(local), _finite(local, slope)


def _finite(local: Local, value: Value) -> Floats:
    value = np.broadcast_to(np.asarray(value, dtype=float), local.configuration.shape)
    return np.where(np.isfinite(value), value, 0.0)
