"""What a designer asks next of an optimum: which bounds hold it, and what a step of each variable costs."""

from __future__ import annotations

import numpy as np

from mechdesign.analyses.optimize.judge import Judge
from mechdesign.analyses.optimize.tables import Comparison
from mechdesign.analyses.optimize.variables import ROUNDING, Batch, bounds, steps
from mechdesign.numerics.arrays import Flags
from mechdesign.results import Column, Table
from mechdesign.study import Study

# How near a bound is at it, as a fraction of the variable's range, or of a condition's bound.
AT_BOUND = 1e-4


def active_bounds(study: Study, compared: Comparison) -> list[str]:
    """Which bounds and conditions each optimum lies at, in words: ``l_a from, workspace.area at least 4``.

    On a grid an upper bound holds a design that it leaves no further step.
    """
    assert study.optimize is not None
    designs, rows = compared.designs, compared.winners
    at = {name: column[rows] for name, column in designs.variables.items()}
    step = steps(study, at)
    held: list[list[str]] = [[] for _ in rows]
    for name in at:
        low, high = bounds(study, at, name, len(rows))
        near = AT_BOUND * (high - low) + ROUNDING * np.maximum(np.abs(low), np.abs(high))
        above = np.maximum(near, step[name] * (1 - 1e-6)) if study.optimize.method == "grid" else near
        for k, words in enumerate(held):
            sides = ["from"] * bool(at[name][k] - low[k] <= near[k]) + ["to"] * bool(high[k] - at[name][k] <= above[k])
            words += [f"{name} {' and '.join(sides)}"] if sides else []
    for each in designs.conditions:
        values = designs.values[each]
        far = AT_BOUND * max(abs(each.bound), np.ptp(values[designs.feasible]))
        for words, value in zip(held, values[rows].tolist(), strict=True):
            words += [each.name] if abs(value - each.bound) <= far else []
    return [", ".join(words) for words in held]


def sensitivity_table(study: Study, compared: Comparison, judge: Judge) -> Table:
    """How the score changes a step down and a step up each variable, the others held."""
    names = list(compared.designs.variables)
    at = {name: column[compared.winners] for name, column in compared.designs.variables.items()}
    step = np.stack([*steps(study, at).values()], axis=1)
    optima = np.stack([*at.values()], axis=1)
    # By optimum, variable and direction.
    moves = np.array([-1.0, 1.0])[:, None] * np.eye(len(names))[:, None]
    moved = optima[:, None, None] + moves * step[:, None, None]
    inside = _inside(study, dict(zip(names, moved.reshape(-1, len(names)).T, strict=True))).reshape(moved.shape[:-1])
    inside &= (moved != optima[:, None, None]).any(axis=-1)
    asked, back = np.unique(moved[inside], axis=0, return_inverse=True)
    judge.progress.start(len(asked), "neighbours of the optimum")
    found, layout = judge.evaluate(dict(zip(names, asked.T, strict=True))), judge.layout
    values, feasible = found[:, layout.values], found[:, layout.code] == 0
    for each in judge.conditions:
        feasible &= each.met(values[:, layout.column[each]])
    which = np.full(inside.shape, len(asked))
    which[inside] = back.ravel()
    changes = np.empty(inside.shape)
    for row, (weights, winner) in enumerate(zip(compared.weights, compared.winners, strict=True)):
        gained = compared.score_of(values, weights) - compared.score_of(compared.values[[winner]], weights)
        changes[row] = np.append(np.where(feasible, gained, np.nan), np.nan)[which[row]]
    down, up = changes.reshape(-1, 2).T
    meaning = "change of the score one step {}, nan where that leaves the bounds or is infeasible"
    columns = (
        Column("optimum", np.repeat(np.arange(len(optima)) + 1, len(names)), "", "row of optimum.csv"),
        Column("variable", np.array(names * len(optima)), "", "design variable; the others are held"),
        Column("value", optima.ravel(), "", "at the optimum"),
        Column("step", step.ravel(), "", "the grid's, else a hundredth of the range"),
        Column("score_down", down, "", meaning.format("down")),
        Column("score_up", up, "", meaning.format("up")),
    )
    return Table("sensitivity", columns, "how the score changes a step from each optimum")


def _inside(study: Study, designs: Batch) -> Flags:
    """Which designs lie inside all bounds."""
    found = np.ones(len(next(iter(designs.values()))), dtype=bool)
    for name, values in designs.items():
        low, high = bounds(study, designs, name, len(values))
        slack = ROUNDING * np.maximum(np.abs(low), np.abs(high))
        found &= (low - slack <= values) & (values <= high + slack)
    return found
