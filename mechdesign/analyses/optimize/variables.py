"""Design variables, whose bounds may depend on each other: their grid, and their map to the unit cube."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mechdesign.errors import StudyError
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.study import Study

# A step that ends this little (as a fraction of it) beyond the bound is still taken, as in sweeps.
BOUND_ROUNDING = 1e-9
MAX_DESIGNS = 50_000_000

# Designs by the values of their variables, each of shape (designs,).
Batch = Mapping[str, Floats]


def bounds(study: Study, designs: Batch, name: str, count: int) -> tuple[Floats, Floats]:
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


def grid(study: Study) -> dict[str, Floats]:
    """Values of each variable for every design, the last variable varying fastest.

    Raises
    ------
    StudyError
        If the grid is empty, or larger than any computer would finish.
    """
    assert study.optimize is not None
    columns: dict[str, Floats] = {}
    for name, variable in study.optimize.variables.items():
        rows = len(next(iter(columns.values()), [0]))
        low, high = bounds(study, columns, name, rows)
        with np.errstate(invalid="ignore"):
            if variable.step is not None:
                counts, step = np.floor((high - low) / variable.step + BOUND_ROUNDING) + 1, np.full(rows, variable.step)
            else:
                counts = np.where(high >= low, float(variable.number or 1), 0.0)
                step = (high - low) / np.maximum(counts - 1, 1)
        counts = np.where(np.isfinite(counts), np.maximum(counts, 0), 0)
        total = int(counts.sum())
        if not 0 < total <= MAX_DESIGNS:
            message = "no value lies between 'from' and 'to' for any design"
            if total:
                message = f"the grid has {total} designs; {MAX_DESIGNS} is the limit: take larger steps"
            raise StudyError((study.problem(message, "optimize", "variables", name),))
        counts = counts.astype(int)
        index = np.arange(total) - np.repeat(np.cumsum(counts) - counts, counts)
        columns = {key: np.repeat(values, counts) for key, values in columns.items()}
        columns[name] = np.repeat(low, counts) + index * np.repeat(step, counts)
    return columns


def steps(study: Study, at: Batch) -> dict[str, Floats]:
    """A step of each variable at some designs: of the grid, else a hundredth of its range there."""
    assert study.optimize is not None
    found = {}
    for name, variable in study.optimize.variables.items():
        low, high = bounds(study, at, name, len(at[name]))
        intervals = 100 if variable.number is None else max(variable.number - 1, 1)
        found[name] = (high - low) / intervals if variable.step is None else np.full(len(low), variable.step)
    return found


def in_words(row: Mapping[str, float]) -> str:
    """``l_min = 1.15, l_a = 1``."""
    return ", ".join(f"{name} = {value:g}" for name, value in row.items())
