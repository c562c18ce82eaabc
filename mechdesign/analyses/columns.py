"""Columns that several tables have: the kind of quantity and the meaning of each are declared here alone."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from mechdesign.indices import REGIONAL
from mechdesign.results import Column
from mechdesign.study import Units

# Kind of quantity in `mechdesign.study.text.units.KINDS`, and meaning.
SHARED: Mapping[str, tuple[str, str]] = {
    "valid": ("none", "1 where the pose is assembled and within its limits"),
    "x": ("length", "place of the point"),
    "y": ("length", "place of the point"),
    "SUI": ("none", REGIONAL["SUI"].meaning),
    "area": ("area", REGIONAL["area"].meaning),
    "box_area": ("area", REGIONAL["box_area"].meaning),
    "kind": ("none", "what ends the region: limit or singularity"),
    "at": ("none", "which limit or singularity"),
    "side": ("none", "which end of the ray's interval"),
    "curve": ("none", "smooth part of the boundary"),
    "piece": ("none", "piece of the region: 1 is the sketch's, or else the largest"),
    "output": ("none", "coordinate"),
    "order": ("none", "position, velocity or acceleration"),
    "method": ("none", "how it was computed"),
    "evaluations": ("none", "mechanisms that were solved for it"),
    "score": ("none", "weighted sum of the normalised indices"),
    "CPI": ("none", "sum of the normalised indices"),
}


def shared(units: Units, **values: ArrayLike) -> list[Column]:
    """Columns that `SHARED` declares, by their names."""
    return [
        Column(name, np.asarray(column), units.label(SHARED[name][0]), SHARED[name][1])
        for name, column in values.items()
    ]


def power_of_length(units: Units, power: int) -> str:
    """The study's unit of length to a power."""
    name = "" if units.length == "dimensionless" else units.length
    text = name if abs(power) == 1 else f"{name}^{abs(power)}"
    return "" if power == 0 or not name else text if power > 0 else f"1/{text}"
