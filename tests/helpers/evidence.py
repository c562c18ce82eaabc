"""Rows of tables against what the same result says of the motion between them."""

from __future__ import annotations

from typing import Any

import numpy as np

# Rounding of a value, of the largest in the columns of its unit.
ROUNDING = 1e-9


def rows_beyond(result: Any) -> list[tuple[str, float, float]]:
    """Columns with a row beyond their extremes: the column, the row's value and the extreme."""
    found: list[tuple[str, float, float]] = []
    if "extremes" not in result.tables:
        return found
    extremes = result.tables["extremes"]
    for k, name in enumerate(map(str, extremes["output"])):
        rows = rows_of(result, name)
        rows = rows[np.isfinite(rows)]
        if not len(rows):
            continue
        low, high = float(extremes["min"][k]), float(extremes["max"][k])
        slack = rounding_of(result, str(extremes["unit"][k]))
        if not low <= rows.min() + slack:
            found.append((f"{name} min", float(rows.min()), low))
        if not high >= rows.max() - slack:
            found.append((f"{name} max", float(rows.max()), high))
    return found


def rounding_of(result: Any, unit: str) -> float:
    """What may be rounding in a column of a unit: of the largest value that any row has in it.

    What turns evenly has accelerations that are the difference of such as the square of its velocity.
    """
    largest = max(1e-3, _largest(result, unit))
    if unit == "deg/s^2":
        largest = max(largest, np.radians(_largest(result, "deg/s") ** 2))
    return ROUNDING * float(largest)


def _largest(result: Any, unit: str) -> float:
    """The largest magnitude that a row of the main table has in a unit."""
    columns = [np.asarray(result.main[name]) for name in result.main.names if result.main.column(name).unit == unit]
    finite = [np.abs(values[np.isfinite(values)]) for values in columns if values.dtype.kind == "f"]
    return float(np.max(np.concatenate([np.zeros(1), *finite])))


def rows_of(result: Any, name: str) -> np.ndarray:
    """Values in the rows that hold of what extremes are told of; none where no table has it."""
    main = result.main
    if name in main.names:
        return np.asarray(main[name], dtype=float)[np.asarray(main["valid"], dtype=bool)]
    forces = result.tables.get("joint_forces")
    if forces is not None and name.endswith("_force"):
        joint = np.asarray(forces["joint"]).astype(str)
        return np.asarray(forces["magnitude"], dtype=float)[
            (joint == name.removesuffix("_force")) & np.asarray(forces["valid"], dtype=bool)
        ]
    if name == "shaking" and "shaking.x" in main.names:
        return np.hypot(main["shaking.x"], main["shaking.y"])[np.asarray(main["valid"], dtype=bool)]
    return np.array([])
