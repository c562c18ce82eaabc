"""Tables of an optimisation: the optimum, every design, the bounds of normalisation, the best distinct designs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.optimize.cube import bounds
from mechdesign.analyses.optimize.designs import best, normalised
from mechdesign.analyses.optimize.goals import Goal
from mechdesign.analyses.optimize.judging import Designs
from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.results import Column, Table
from mechdesign.study import Study

# How many of the best designs are told, and how far apart they are, as a fraction of each variable's range.
BEST, APART = 10, 0.05


@dataclass(frozen=True, eq=False)
class Comparison:
    """Designs compared.

    Parameters
    ----------
    weights : ndarray, shape (rows, goals)
        As the study gives them.
    cpi : ndarray, shape (designs,)
        Sum of the normalised goals; nan where a design is not feasible.
    winners : ndarray of int, shape (rows,)
        The best design for each row of weights.
    meanings : mapping
        Unit and meaning of indices.
    """

    study: Study
    designs: Designs
    weights: Floats
    cpi: Floats
    winners: Ints
    meanings: Mapping[str, tuple[str, str]]

    @classmethod
    def of(cls, study: Study, designs: Designs, weights: Floats, meanings: Mapping[str, tuple[str, str]]) -> Comparison:
        """Compare designs; without a feasible one, all scores are nan."""
        cpi = np.full(len(designs), np.nan)
        if designs.feasible.any():
            cpi = np.zeros(len(designs))
            for each in designs.goals:
                cpi += normalised(designs.values[each], designs.feasible, smallest=each.smallest)
        found = cls(study, designs, weights, cpi, np.zeros(len(weights), dtype=np.intp), meanings)
        winners = [best(found.score(row)) for row in weights]
        return cls(study, designs, weights, cpi, np.array(winners, dtype=np.intp), meanings)

    def score(self, row: Floats) -> Floats:
        """Weighted sum of the normalised goals of every design; nan where it is not feasible."""
        total = np.where(self.designs.feasible, 0.0, np.nan)
        if self.designs.feasible.any():
            for weight, each in zip(row, self.designs.goals, strict=True):
                if weight:
                    total += weight * normalised(self.designs.values[each], self.designs.feasible,
                                                 smallest=each.smallest)  # fmt: skip
        return total

    def score_of(self, values: Floats, row: Floats) -> Floats:
        """Weighted sums of other designs, of values in the shape (designs, goals), normalised by the same bounds."""
        total = np.zeros(len(values))
        for weight, each, column in zip(row, self.designs.goals, values.T, strict=True):
            inside = self.designs.values[each][self.designs.feasible]
            low, high = inside.min(), inside.max()
            if high > low:
                total += weight * ((high - column) if each.smallest else (column - low)) / (high - low)
        return total


def unit_of(study: Study, name: str) -> str:
    """Unit of a place of the geometry; none for a parameter."""
    place = study.mechanism.description.places.get(name)
    return study.units.label(place.quantity) if place is not None else ""


def variable_columns(compared: Comparison, rows: Ints | slice) -> Iterator[Column]:
    """The design variables of some designs."""
    for name, column in compared.designs.variables.items():
        yield Column(name, column[rows], unit_of(compared.study, name), "design variable")


def value_columns(compared: Comparison, rows: Ints | slice) -> Iterator[Column]:
    """The goals' values of some designs."""
    for each in compared.designs.goals:
        unit, meaning = _unit_and_meaning(compared, each)
        yield Column(each.name, compared.designs.values[each][rows], unit, meaning)


def _unit_and_meaning(compared: Comparison, judged: Goal) -> tuple[str, str]:
    worst = ("", f"worst row of {judged.name}")
    return compared.meanings.get(judged.column, worst) if judged.index else worst


def optimum_table(compared: Comparison, active: Sequence[str]) -> Table:
    """The best design for each row of weights."""

    def columns() -> Iterator[Column]:
        study, rows = compared.study, compared.winners
        for each, column in zip(compared.designs.goals, compared.weights.T, strict=True):
            yield Column(f"w_{each.name}", column, "", f"weight of {each.name}")
        yield from variable_columns(compared, rows)
        yield from value_columns(compared, rows)
        yield Column("CPI", compared.cpi[rows], "", "sum of the normalised indices")
        scores = [compared.score(row)[winner] for row, winner in zip(compared.weights, rows, strict=True)]
        yield Column("score", np.array(scores), "", "weighted sum of the normalised indices")
        variables = compared.designs.variables
        parameters = {name: column[rows] for name, column in variables.items() if name in study.parameters.nominal}
        for name, value in study.parameters.values(parameters).items():
            if name not in variables and np.ndim(value):
                yield Column(name, np.asarray(value), "", "parameter that follows from the variables")
        yield Column("active", np.array(active, dtype=object), "", "bounds and conditions that the optimum lies at")

    return Table("optimum", tuple(columns()), "the best design for each set of weights")


def designs_table(compared: Comparison) -> Table:
    """Every design that was evaluated."""

    def columns() -> Iterator[Column]:
        designs = compared.designs
        yield from variable_columns(compared, slice(None))
        yield from value_columns(compared, slice(None))
        for each in designs.goals:
            if each.name in designs.errors:
                unit = _unit_and_meaning(compared, each)[0]
                yield Column(f"{each.name}_error", designs.errors[each.name], unit, f"estimated error of {each.name}")
        yield Column("CPI", compared.cpi, "", "sum of the normalised indices")
        yield Column("feasible", designs.feasible, "", "1 where the design can be built and meets every requirement")
        yield Column("reason", designs.reason_column(), "", "why it is not feasible")

    return Table("designs", tuple(columns()), "every design that was evaluated")


def bounds_table(compared: Comparison) -> Table:
    """Extremes of each goal, by which it is normalised, and where they are."""

    def columns() -> Iterator[Column]:
        designs = compared.designs
        named = {**{each.name: designs.values[each] for each in designs.goals}, "CPI": compared.cpi}
        inside = [np.where(designs.feasible, column, np.nan) for column in named.values()]
        low = np.array([np.nanargmin(column) for column in inside], dtype=np.intp)
        high = np.array([np.nanargmax(column) for column in inside], dtype=np.intp)
        yield Column("index", np.array(list(named)), "", "index")
        for name, rows, meaning in (("min", low, "smallest value"), ("max", high, "largest value")):
            values = [column[k] for column, k in zip(named.values(), rows, strict=True)]
            yield Column(name, np.array(values), "", meaning)
        for name, column in designs.variables.items():
            unit = unit_of(compared.study, name)
            yield Column(f"{name}_at_min", column[low], unit, f"{name} of the design with the smallest value")
            yield Column(f"{name}_at_max", column[high], unit, f"{name} of the design with the largest value")

    return Table("bounds", tuple(columns()), "extremes of each index over the feasible designs")


def steps(study: Study, compared: Comparison) -> dict[str, Floats]:
    """A step of each variable at each optimum: of the grid, else a hundredth of its range there; shape (rows,)."""
    assert study.optimize is not None
    at = {name: column[compared.winners] for name, column in compared.designs.variables.items()}
    found = {}
    for name, variable in study.optimize.variables.items():
        low, high = bounds(study, at, name, len(compared.winners))
        intervals = 100 if variable.number is None else max(variable.number - 1, 1)
        found[name] = (high - low) / intervals if variable.step is None else np.full(len(low), variable.step)
    return found


def best_table(study: Study, compared: Comparison) -> Table:
    """The best designs for each row of weights, of which none is next to a better one."""
    designs, step = compared.designs, steps(study, compared)
    gridded = study.optimize is not None and study.optimize.method == "grid"
    chosen: list[tuple[int, int, int, float]] = []
    for row, weights in enumerate(compared.weights):
        score = np.where(designs.feasible, compared.score(weights), -np.inf)
        for rank in range(BEST):
            k = int(np.argmax(score))
            if score[k] == -np.inf:
                break
            chosen.append((row + 1, rank + 1, k, float(score[k])))
            near = np.ones(len(score), dtype=bool)
            for name, column in designs.variables.items():
                apart = APART * float(np.ptp(column))
                if gridded:
                    apart = max(apart, float(step[name][row]) * (1 + 1e-6))
                near &= np.abs(column - column[k]) <= apart
            score[near] = -np.inf
    row_numbers, ranks, picked, scores = (np.array(column) for column in zip(*chosen, strict=True))
    rows = picked.astype(np.intp)
    columns = (
        Column("optimum", row_numbers, "", "row of optimum.csv whose weights are taken"),
        Column("rank", ranks, "", "1 is the optimum"),
        *variable_columns(compared, rows),
        *value_columns(compared, rows),
        Column("CPI", compared.cpi[rows], "", "sum of the normalised indices"),
        Column("score", scores, "", "weighted sum of the normalised indices"),
    )
    return Table("best", columns, "the best designs for each set of weights, none of them next to a better one")
