"""Which dimensions are best? Every design of a grid, compared by normalised and weighted indices."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.designs import best, grid, in_words, most_common, normalised
from mechdesign.analyses.goals import Evaluated, Evaluator, Goal, bounds_of, goal
from mechdesign.analyses.rays import Floats
from mechdesign.analyses.region import GRID_TOLERANCE, questions
from mechdesign.analyses.workspace import index_meanings
from mechdesign.errors import AssemblyError, Problem, StudyError
from mechdesign.parallel import map_chunks
from mechdesign.progress import NULL, Progress
from mechdesign.results import Column, Result, Table
from mechdesign.study import Study

# Designs evaluated together: enough that arrays are long, few enough that the workers end together.
CHUNK = 384


@dataclass(frozen=True, eq=False)
class _Designs:
    """All designs: the variables, the values of goals and bounds, and which designs are feasible."""

    variables: dict[str, Floats]
    goals: tuple[Goal, ...]
    values: dict[Goal, Floats]
    errors: dict[str, Floats]
    feasible: NDArray[np.bool_]
    reasons: list[str]


def optimize(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Result:
    """Evaluate every design of the grid, and find the best one for each set of weights [S1, eqs. 27, 28].

    Parameters
    ----------
    study : Study
        With an optimize section.
    seed
        Not used: a grid is not random.
    jobs : int or None
        Threads; the result does not depend on their number.

    Raises
    ------
    StudyError
        If there is nothing to vary or to compare.
    AssemblyError
        If no design is feasible; the message says why.
    """
    goals = _goals(study)
    designs = _evaluate(study, goals, jobs, progress)
    if not designs.feasible.any():
        told = "; ".join(f"{reason} ({count} designs)" for reason, count in most_common(designs.reasons))
        raise AssemblyError(f"no design of {len(designs.reasons)} is feasible: {told}")
    shares = np.stack([normalised(designs.values[g], designs.feasible, smallest=g.smallest) for g in goals])
    weights = _weights(study, len(goals))
    cpi, scores = shares.sum(axis=0), weights @ shares
    winners = [best(score) for score in scores]
    meanings = _meanings(study, goals)
    tables = [
        Table("optimum", tuple(_optimum(study, designs, weights, winners, cpi, scores, meanings)),
              "the best design for each set of weights"),
        Table("designs", tuple(_all(study, designs, cpi, meanings)), "every design of the grid"),
        Table("bounds", tuple(_bounds(study, designs, cpi)), "extremes of each index over the feasible designs"),
    ]  # fmt: skip
    return Result("optimize", {table.name: table for table in tables}, tuple(_warnings(study, designs)),
                  {"designs": len(designs.reasons), "infeasible": int((~designs.feasible).sum())})  # fmt: skip


def _goals(study: Study) -> tuple[Goal, ...]:
    section = study.optimize
    file = str(study.path or "")
    if section is None or not section.variables:
        raise StudyError((Problem("an optimisation needs variables", "optimize.variables", file),))
    goals = (*(goal(name) for name in section.maximize), *(goal(name, smallest=True) for name in section.minimize))
    if not goals:
        message = "what is to be best? e.g. maximize: [GII, GRI, SUI], or minimize"
        raise StudyError((Problem(message, "optimize.maximize", file),))
    return goals


def _weights(study: Study, goals: int) -> Floats:
    assert study.optimize is not None
    rows = study.optimize.weights
    return np.array(rows if rows else [[1.0] * goals], dtype=float).reshape(-1, goals)


def _evaluate(study: Study, goals: tuple[Goal, ...], jobs: int | None, progress: Progress) -> _Designs:
    assert study.optimize is not None
    conditions = [bound for condition in study.optimize.subject_to for bound in bounds_of(condition)]
    wanted = [*goals, *(judged for judged, _, _ in conditions)]
    evaluator = Evaluator(study, wanted)
    variables = grid(study)
    count = len(next(iter(variables.values())))
    progress.start(count, "designs")
    values = {each: np.empty(count) for each in wanted}
    errors: dict[str, Floats] = {}
    reasons: list[str] = []

    def chunks() -> Iterator[dict[str, Floats]]:
        for k in range(0, count, CHUNK):
            yield {name: column[k : k + CHUNK] for name, column in variables.items()}

    found: Evaluated
    for found in map_chunks(evaluator, chunks(), jobs, processes=True):
        at = slice(len(reasons), len(reasons) + len(found.reasons))
        for each, column in found.values.items():
            values[each][at] = column
        for name, column in found.errors.items():
            errors.setdefault(name, np.empty(count))[at] = column
        reasons += found.reasons
        progress.update(len(found.reasons))
    feasible = np.array([not reason for reason in reasons])
    for judged, bound, upper in conditions:
        met = values[judged] <= bound if upper else values[judged] >= bound
        for k in np.flatnonzero(feasible & ~met):
            reasons[k] = f"not {judged.name}"
        feasible &= met
    return _Designs(variables, goals, values, errors, feasible, reasons)


def _meanings(study: Study, goals: Sequence[Goal]) -> dict[str, tuple[str, str]]:
    if not any(each.index for each in goals):
        return {}
    question = Evaluator(study, [each for each in goals if each.index]).question
    assert question is not None
    return index_meanings(study, question)


def _unit(study: Study, name: str) -> str:
    for place in study.mechanism.description.places.values():
        if place.name == name:
            return study.units.label(place.quantity)
    return ""


def _variables(study: Study, designs: _Designs, rows: NDArray[np.intp]) -> Iterator[Column]:
    for name, column in designs.variables.items():
        yield Column(name, column[rows], _unit(study, name), "design variable")


def _values(designs: _Designs, rows: NDArray[np.intp], meanings: Mapping[str, tuple[str, str]]) -> Iterator[Column]:
    for each in designs.goals:
        unit, meaning = meanings.get(each.column, ("", f"worst row of {each.name}")) if each.index else (
            "", f"worst row of {each.name}")  # fmt: skip
        yield Column(each.name, designs.values[each][rows], unit, meaning)


def _optimum(
    study: Study,
    designs: _Designs,
    weights: Floats,
    winners: Sequence[int],
    cpi: Floats,
    scores: Floats,
    meanings: Mapping[str, tuple[str, str]],
) -> Iterator[Column]:
    rows = np.array(winners, dtype=np.intp)
    for each, column in zip(designs.goals, weights.T, strict=True):
        yield Column(f"w_{each.name}", column, "", f"weight of {each.name}")
    yield from _variables(study, designs, rows)
    yield from _values(designs, rows, meanings)
    yield Column("CPI", cpi[rows], "", "sum of the normalised indices")
    yield Column("score", scores[np.arange(len(rows)), rows], "", "weighted sum of the normalised indices")
    parameters = {name: column[rows] for name, column in designs.variables.items() if name in study.parameters.nominal}
    for name, value in study.parameters.values(parameters).items():
        if name not in designs.variables and np.ndim(value):
            yield Column(name, np.asarray(value), "", "parameter that follows from the variables")


def _all(study: Study, designs: _Designs, cpi: Floats, meanings: Mapping[str, tuple[str, str]]) -> Iterator[Column]:
    every = np.arange(len(designs.reasons))
    yield from _variables(study, designs, every)
    yield from _values(designs, every, meanings)
    for name, column in designs.errors.items():
        yield Column(f"{name}_error", column, meanings[goal(name).column][0], f"estimated error of {name}")
    yield Column("CPI", cpi, "", "sum of the normalised indices")
    yield Column("feasible", designs.feasible, "", "1 where the design can be built and meets every requirement")
    yield Column("reason", np.array(designs.reasons, dtype=object), "", "why it is not feasible")


def _bounds(study: Study, designs: _Designs, cpi: Floats) -> Iterator[Column]:
    named = {**{each.name: designs.values[each] for each in designs.goals}, "CPI": cpi}
    lowest, highest = [], []
    for column in named.values():
        inside = np.where(designs.feasible, column, np.nan)
        lowest.append(int(np.nanargmin(inside)))
        highest.append(int(np.nanargmax(inside)))
    low, high = np.array(lowest, dtype=np.intp), np.array(highest, dtype=np.intp)
    columns = list(named.values())
    yield Column("index", np.array(list(named)), "", "index")
    yield Column("min", np.array([c[k] for c, k in zip(columns, low, strict=True)]), "", "smallest value")
    yield Column("max", np.array([c[k] for c, k in zip(columns, high, strict=True)]), "", "largest value")
    for name, column in designs.variables.items():
        unit = _unit(study, name)
        yield Column(f"{name}_at_min", column[low], unit, f"{name} of the design with the smallest value")
        yield Column(f"{name}_at_max", column[high], unit, f"{name} of the design with the largest value")


def _warnings(study: Study, designs: _Designs) -> Iterator[str]:
    for reason, count in most_common(designs.reasons):
        first = designs.reasons.index(reason)
        row = {name: float(column[first]) for name, column in designs.variables.items()}
        yield f"{count} of {len(designs.reasons)} designs are infeasible: {reason} (first at {in_words(row)})"
    if study.workspace is None or study.workspace.integrate.rule != "gauss":
        return
    tolerance = questions(study, GRID_TOLERANCE)[0].tolerance
    for name, error in designs.errors.items():
        value = next(designs.values[each] for each in designs.goals if each.name == name)
        loose = designs.feasible & (error > 2 * tolerance * np.abs(value))
        if loose.any():
            yield f"{name} of {int(loose.sum())} designs is not known to the tolerance asked for; see {name}_error"


__all__ = ["optimize"]
