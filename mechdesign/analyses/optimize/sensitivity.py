"""What a designer asks next of an optimum: which bounds hold it, and what a step of each variable costs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.optimize.cube import bounds
from mechdesign.analyses.optimize.designs import ROUNDING
from mechdesign.analyses.optimize.judging import met
from mechdesign.analyses.optimize.tables import Comparison, steps
from mechdesign.numerics.arrays import Floats
from mechdesign.results import Column, Table
from mechdesign.study import Study

# How near a bound is at it, as a fraction of the variable's range, or of a condition's bound.
AT = 1e-4


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Designs a step from each optimum.

    Parameters
    ----------
    designs : dict of str to ndarray
        Values of the variables.
    places : dict of (int, str, int) to int
        By row of weights, variable and direction (-1 or 1): which of `designs`; absent beyond the bounds.
    """

    designs: dict[str, Floats]
    places: dict[tuple[int, str, int], int]

    def __len__(self) -> int:
        return len(next(iter(self.designs.values())))


def neighbours(study: Study, compared: Comparison) -> Neighbours:
    """Designs a step from each optimum along each variable, the others held, as far as they lie inside all bounds."""
    names = list(compared.designs.variables)
    step = steps(study, compared)
    found: dict[tuple[float, ...], int] = {}
    places: dict[tuple[int, str, int], int] = {}
    for row, winner in enumerate(compared.winners.tolist()):
        at = {name: float(column[winner]) for name, column in compared.designs.variables.items()}
        for name in names:
            for direction in (-1, 1):
                moved = at | {name: at[name] + direction * float(step[name][row])}
                if moved != at and _inside(study, moved):
                    places[row, name, direction] = found.setdefault(tuple(moved.values()), len(found))
    values = np.array(list(found), dtype=float).reshape(-1, len(names))
    return Neighbours({name: values[:, k] for k, name in enumerate(names)}, places)


def _inside(study: Study, design: dict[str, float]) -> bool:
    columns = {name: np.array([value]) for name, value in design.items()}
    for name, value in design.items():
        low, high = (float(bound[0]) for bound in bounds(study, columns, name, 1))
        slack = ROUNDING * max(abs(low), abs(high))
        if not low - slack <= value <= high + slack:
            return False
    return True


def active_bounds(study: Study, compared: Comparison) -> list[str]:
    """Which bounds and conditions each optimum lies at, in words: ``l_a from, workspace.area at least 4``.

    On a grid an upper bound holds a design that it leaves no further step.
    """
    assert study.optimize is not None
    section, rows = study.optimize, compared.winners
    at = {name: column[rows] for name, column in compared.designs.variables.items()}
    step = steps(study, compared)
    held: list[list[str]] = [[] for _ in rows]
    for name in at:
        low, high = bounds(study, at, name, len(rows))
        near = AT * (high - low) + ROUNDING * np.maximum(np.abs(low), np.abs(high))
        above = np.maximum(near, step[name] * (1 - 1e-6)) if section.method == "grid" else near
        for k in range(len(rows)):
            sides = [*(["from"] if at[name][k] - low[k] <= near[k] else []),
                     *(["to"] if high[k] - at[name][k] <= above[k] else [])]  # fmt: skip
            held[k] += [f"{name} {' and '.join(sides)}"] if sides else []
    for judged, bound, _ in compared.designs.conditions:
        inside = compared.designs.values[judged][compared.designs.feasible]
        near_bound = np.abs(compared.designs.values[judged][rows] - bound) <= AT * max(abs(bound), np.ptp(inside))
        for k in np.flatnonzero(near_bound).tolist():
            held[k].append(judged.name)
    return [", ".join(words) for words in held]


def sensitivity_table(study: Study, compared: Comparison, near: Neighbours, found: Floats) -> Table:
    """How the score changes a step down and a step up each variable.

    Parameters
    ----------
    found : ndarray, shape (neighbours, goals and conditions + 1)
        As `Judge.evaluate` gives it for `near`.
    """
    designs, step = compared.designs, steps(study, compared)
    wanted = list(designs.values)
    feasible = found[:, len(wanted)] == 0
    for judged, bound, upper in designs.conditions:
        feasible &= met(found[:, wanted.index(judged)], bound, upper)
    optimum, variables, values, widths, changes = [], [], [], [], []
    for row, winner in enumerate(compared.winners):
        weights = compared.weights[row]
        own = np.array([[designs.values[each][winner] for each in designs.goals]])
        score = np.where(feasible, compared.score_of(found[:, : len(designs.goals)], weights), np.nan)
        score -= compared.score_of(own, weights)
        for name, column in designs.variables.items():
            sides = [near.places.get((row, name, direction)) for direction in (-1, 1)]
            optimum.append(row + 1)
            variables.append(name)
            values.append(column[winner])
            widths.append(step[name][row])
            changes.append([np.nan if k is None else score[k] for k in sides])
    down, up = np.array(changes).T
    meaning = "change of the score one step {}, nan where that leaves the bounds or is infeasible"
    columns = (
        Column("optimum", np.array(optimum), "", "row of optimum.csv"),
        Column("variable", np.array(variables), "", "design variable; the others are held"),
        Column("value", np.array(values), "", "at the optimum"),
        Column("step", np.array(widths), "", "the grid's, else a hundredth of the range"),
        Column("score_down", down, "", meaning.format("down")),
        Column("score_up", up, "", meaning.format("up")),
    )
    return Table("sensitivity", columns, "how the score changes a step from each optimum")
