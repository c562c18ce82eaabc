"""Design variables whose bounds depend on each other, mapped to the unit cube."""

from __future__ import annotations

import numpy as np

from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.study import Study


def bounds(study: Study, designs: dict[str, Floats], name: str, count: int) -> tuple[Floats, Floats]:
    """Bounds of a variable where those above it have these values; each of shape (count,)."""
    assert study.optimize is not None
    variable = study.optimize.variables[name]
    parameters = {key: value for key, value in designs.items() if key in study.parameters.nominal}
    env = {**study.parameters.values(parameters), **designs}
    with np.errstate(all="ignore"):
        low, high = (np.asarray(bound.evaluate(env), dtype=float) for bound in (variable.from_, variable.to))
    return np.broadcast_to(low, count), np.broadcast_to(high, count)


def from_cube(study: Study, u: Floats) -> tuple[dict[str, Floats], Flags]:
    """Designs at points of the unit cube, and which of them have a range for every variable.

    Parameters
    ----------
    u : ndarray, shape (designs, variables)
        Fractions of the way from each lower bound to the upper one.
    """
    assert study.optimize is not None
    designs: dict[str, Floats] = {}
    given = np.ones(len(u), dtype=bool)
    for k, name in enumerate(study.optimize.variables):
        low, high = bounds(study, designs, name, len(u))
        well = np.isfinite(low) & np.isfinite(high) & (high >= low)
        given &= well
        low, high = np.where(well, low, 0.0), np.where(well, high, 0.0)
        # The upper bound itself, not what rounding makes of it.
        designs[name] = np.where(u[:, k] == 1, high, low + u[:, k] * (high - low))
    return designs, given
