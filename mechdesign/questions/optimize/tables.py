"""Tables of an optimisation: the optimum, every design, bounds of normalisation, the best designs, sensitivity."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats
from mechdesign.ground.results import Table
from mechdesign.questions.optimize.columns import BEST, BOUNDS, DESIGNS, NEAREST, OPTIMUM, SENSITIVITY
from mechdesign.questions.optimize.judge import DesignSet, Judge, weighted
from mechdesign.questions.optimize.variables import BOUND_ROUNDING, Batch, bounds, ranges, steps
from mechdesign.study import Study

# Number of best designs that are listed for each row of weights, and their least distance in parts of a variable's
# range.
MAX_BEST = 10
BEST_DISTANCE = 0.05
# Distance from a bound up to which a design is at it, as a fraction of the variable's range, or of a condition's bound.
AT_BOUND = 1e-4
# Part of the mechanism's size below which a coordinate of a shape's place is rounding error.
PLACE_ROUNDING = 1e-9


def optimum_table(designs: DesignSet, places: Mapping[str, Complexes]) -> Table:
    """The best design for each row of weights; `places` are those of the shapes that its workspace contains."""
    study, rows, variables = designs.study, designs.winners, designs.variables
    scores = [designs.score(row)[winner] for row, winner in zip(designs.weights, rows, strict=True)]
    parameters = {name: column[rows] for name, column in variables.items() if name in study.parameters.nominal}
    following = {
        name: np.asarray(value)
        for name, value in study.parameters.values(parameters).items()
        if name not in variables and np.ndim(value) and all(name != goal.name for goal in designs.goals)
    }
    marks = {"what": np.array(designs.marks, dtype=object)} if designs.marks else {}
    weights, length = zip(designs.goals, designs.weights.T, strict=True), study.units.label("length")
    centre_of, parameter = OPTIMUM["x of <shape>"], OPTIMUM["<parameter>"]
    return OPTIMUM.table([
        *OPTIMUM.columns({}, **marks),
        *(OPTIMUM["w_<goal>"].column(column, goal=goal.name) for goal, column in weights),
        *designs.columns(rows),
        *(centre_of.column(_settled(study, part(centre)), length, f"{axis} of <shape>", shape=name)
          for name, centre in places.items() for axis, part in (("x", np.real), ("y", np.imag))),
        *OPTIMUM.columns({}, score=scores),
        *(parameter.column(value, parameter=name) for name, value in following.items()),
        *OPTIMUM.columns({}, active=_active(designs)),
    ])  # fmt: skip


def _settled(study: Study, places: Floats) -> Floats:
    """Places whose rounding errors about zero are removed."""
    return np.where(np.abs(places) < PLACE_ROUNDING * study.mechanism.size, 0.0, places)


def designs_table(designs: DesignSet) -> Table:
    """Every design that was evaluated."""
    ends = DESIGNS.columns({}, feasible=designs.feasible, reason=designs.reasons)
    return DESIGNS.table([*designs.columns(slice(None), errors=True), *ends])


def nearest_table(designs: DesignSet, row: int) -> Table:
    """The value of each condition of an infeasible design, and by how much it misses the bound."""
    if word := designs.words[designs.codes[row]]:
        rows = [(word, np.nan, np.nan, designs.shortfall[row], "")]
    else:
        rows = [
            (condition.name, value := designs.results[condition][row], condition.bound,
             max(0.0, -condition.margin(value)), designs.meanings[condition][0])
            for condition in designs.conditions
        ]  # fmt: skip
    names, values, bounds_of, missing, units = zip(*rows, strict=True)
    return NEAREST.table(NEAREST.columns(
        {}, condition=np.array(names, dtype=object), value=np.array(values), bound=np.array(bounds_of),
        missing=np.array(missing), unit=np.array(units, dtype=object),
    ))  # fmt: skip


def bounds_table(designs: DesignSet) -> Table:
    """Extremes of each goal, by which it is normalised, and where they are."""
    names = [*(goal.name for goal in designs.goals), "CPI"]
    values = np.where(designs.feasible[:, None], np.column_stack([designs.values, designs.cpi]), np.nan)
    low, high = np.nanargmin(values, axis=0), np.nanargmax(values, axis=0)
    numbers = np.arange(len(names))
    columns = BOUNDS.columns({}, index=np.array(names), min=values[low, numbers], max=values[high, numbers])
    for name in designs.variables:
        unit, column = designs.unit_of(name), designs.shown(name)
        for end, rows in (("min", low), ("max", high)):
            columns.append(BOUNDS[f"<variable>_at_{end}"].column(column[rows], unit, variable=name))
    return BOUNDS.table(columns)


def best_table(designs: DesignSet) -> Table:
    """The best designs for each row of weights, without those next to a better one."""
    section = designs.study.optimize
    step = steps(designs.study, {name: column[designs.winners] for name, column in designs.variables.items()})
    gridded = section is not None and section.method == "grid"
    chosen: list[tuple[int, int, int, float]] = []
    for row, weights in enumerate(designs.weights):
        score = np.where(designs.feasible, designs.score(weights), -np.inf)
        for rank in range(MAX_BEST):
            k = int(np.argmax(score) if rank else designs.winners[row])
            if score[k] == -np.inf:
                break
            chosen.append((row + 1, rank + 1, k, float(score[k])))
            near = np.ones(len(score), dtype=bool)
            for name, column in designs.variables.items():
                # Designs with another choice are never next to each other.
                apart = 0.0
                if name in step:
                    apart = max(BEST_DISTANCE * float(np.ptp(column)), gridded * float(step[name][row]) * (1 + 1e-6))
                near &= np.abs(column - column[k]) <= apart
            score[near] = -np.inf
    row_numbers, ranks, picked, scores = (np.array(column) for column in zip(*chosen, strict=True))
    return BEST.table([
        *BEST.columns({}, optimum=row_numbers, rank=ranks), *designs.columns(picked), *BEST.columns({}, score=scores)
    ])  # fmt: skip


def _active(designs: DesignSet) -> NDArray[np.object_]:
    """Bounds and conditions at which each optimum lies, in words: ``l_a from, workspace.area at least 4``.

    On a grid a design is at the upper bound if no further step fits below it.
    """
    study, rows = designs.study, designs.winners
    assert study.optimize is not None
    at = {name: column[rows] for name, column in designs.variables.items()}
    step = steps(study, at)
    held: list[list[str]] = [[] for _ in rows]
    for name in step:
        low, high = bounds(study, at, name, len(rows))
        near = AT_BOUND * (high - low) + BOUND_ROUNDING * np.maximum(np.abs(low), np.abs(high))
        above = np.maximum(near, step[name] * (1 - 1e-6)) if study.optimize.method == "grid" else near
        for k, words in enumerate(held):
            sides = ["from"] * bool(at[name][k] - low[k] <= near[k]) + ["to"] * bool(high[k] - at[name][k] <= above[k])
            words += [f"{name} {' and '.join(sides)}"] if sides else []
    for condition in designs.conditions:
        values = designs.results[condition]
        far = AT_BOUND * max(abs(condition.bound), np.ptp(values[designs.feasible]))
        for words, value in zip(held, values[rows].tolist(), strict=True):
            words += [condition.name] if abs(value - condition.bound) <= far else []
    return np.array([", ".join(words) for words in held], dtype=object)


def sensitivity_table(designs: DesignSet, judge: Judge) -> Table:
    """How the score changes a step down and a step up each variable that has a range, the others held."""
    study, variables, names = designs.study, list(designs.variables), ranges(designs.study)
    at = {name: column[designs.winners] for name, column in designs.variables.items()}
    optima = np.stack([*at.values()], axis=1)
    step = np.array([*steps(study, at).values()]).reshape(len(names), len(optima)).T
    # By optimum, range and direction.
    ranged = [variables.index(name) for name in names]
    moves = np.array([-1.0, 1.0])[:, None] * np.eye(len(variables))[ranged][:, None]
    moved = optima[:, None, None] + moves * step[:, :, None, None]
    neighbours = dict(zip(variables, moved.reshape(-1, len(variables)).T, strict=True))
    inside = _inside(study, neighbours).reshape(moved.shape[:-1])
    inside &= (moved != optima[:, None, None]).any(axis=-1)
    candidates, back = np.unique(moved[inside], axis=0, return_inverse=True)
    judge.progress.start(len(candidates), "neighbours of the optimum")
    results, layout = judge.evaluate(dict(zip(variables, candidates.T, strict=True))), judge.layout
    values, feasible = results[:, layout.values], results[:, layout.code] == 0
    for condition in judge.conditions:
        feasible &= condition.met(values[:, layout.column[condition]])
    which = np.full(inside.shape, len(candidates))
    which[inside] = back.ravel()
    changes = np.empty(inside.shape)
    shares, best = designs.normalised(values[:, : len(designs.goals)]), designs.shares[designs.winners]
    for row, weights in enumerate(designs.weights):
        gained = weighted(shares, weights) - weighted(best[[row]], weights)
        changes[row] = np.append(np.where(feasible, gained, np.nan), np.nan)[which[row]]
    down, up = changes.reshape(-1, 2).T
    return SENSITIVITY.table(SENSITIVITY.columns(
        {}, optimum=np.repeat(np.arange(len(optima)) + 1, len(names)), variable=np.array(names * len(optima)),
        value=optima[:, ranged].ravel(), step=step.ravel(),
        unit=np.array([designs.unit_of(name) for name in names] * len(optima)), score_down=down, score_up=up,
    ))  # fmt: skip


def _inside(study: Study, designs: Batch) -> Flags:
    """Which designs lie inside all bounds."""
    inside = np.ones(len(next(iter(designs.values()))), dtype=bool)
    for name in ranges(study):
        values = designs[name]
        low, high = bounds(study, designs, name, len(values))
        slack = BOUND_ROUNDING * np.maximum(np.abs(low), np.abs(high))
        inside &= (low - slack <= values) & (values <= high + slack)
    return inside
