"""Grids of design variables, and the comparison of designs by normalised, weighted indices."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mechdesign.errors import Problem, StudyError
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.study import Study

# A step that ends this little (as a fraction of it) beyond the bound is still taken, as in sweeps.
ROUNDING = 1e-9
MOST_DESIGNS = 50_000_000


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
        rows = len(next(iter(columns.values()))) if columns else 1
        parameters = {key: value for key, value in columns.items() if key in study.parameters.nominal}
        env = {**study.parameters.values(parameters), **columns}
        low, high = (
            np.broadcast_to(np.asarray(bound.evaluate(env), dtype=float), rows)
            for bound in (variable.from_, variable.to)
        )
        with np.errstate(invalid="ignore"):
            if variable.step is not None:
                counts = np.floor((high - low) / variable.step + ROUNDING) + 1
                step = np.full(rows, variable.step)
            else:
                counts = np.where(high >= low, float(variable.number or 1), 0.0)
                step = (high - low) / np.maximum(counts - 1, 1)
        counts = np.where(np.isfinite(counts), np.maximum(counts, 0), 0)
        total = int(counts.sum())
        if total == 0 or total > MOST_DESIGNS:
            raise StudyError((_size(study, name, total),))
        counts = counts.astype(int)
        index = np.arange(total) - np.repeat(np.cumsum(counts) - counts, counts)
        columns = {key: np.repeat(values, counts) for key, values in columns.items()}
        columns[name] = np.repeat(low, counts) + index * np.repeat(step, counts)
    return columns


def _size(study: Study, name: str, total: int) -> Problem:
    message = (
        "no value lies between 'from' and 'to' for any design" if total == 0
        else f"the grid has {total} designs; {MOST_DESIGNS} is the limit: take larger steps"
    )  # fmt: skip
    return study.problem(message, "optimize", "variables", name)


def normalised(values: Floats, feasible: Flags, *, smallest: bool) -> Floats:
    """Values as fractions of their range over the feasible designs, 1 the best [S1, eq. 27]; nan for the others.

    An index that is the same for all designs counts 0.
    """
    low, high = values[feasible].min(), values[feasible].max()
    share = (values - low) / (high - low) if high > low else np.zeros_like(values)
    return np.where(feasible, 1 - share if smallest and high > low else share, np.nan)


def best(score: Floats) -> int:
    """The design with the highest score, the first of equals; nan never wins."""
    return int(np.argmax(np.where(np.isnan(score), -np.inf, score)))


def in_words(row: Mapping[str, float]) -> str:
    """``l_min = 1.15, l_a = 1``."""
    return ", ".join(f"{name} = {value:g}" for name, value in row.items())
