"""What pictures of an optimisation read from its tables: variables, goals, scores, and which designs are best."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.optimize.tables import normalised
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.report.figures import style
from mechdesign.results import Result, Table
from mechdesign.study import Study


@dataclass(frozen=True, eq=False)
class Designs:
    """The designs that were evaluated, in their order.

    Parameters
    ----------
    names : sequence of str
        Design variables.
    goals : mapping of str to bool
        Whether each goal is minimised.
    feasible : ndarray of bool
    """

    table: Table
    optimum: Table
    names: Sequence[str]
    goals: Mapping[str, bool]
    feasible: Flags

    def __getitem__(self, name: str) -> Floats:
        """A column, of every design."""
        return np.asarray(self.table[name], dtype=float)

    def label(self, name: str) -> str:
        """Name and unit of a column, for an axis."""
        unit = next(column.unit for column in self.table.columns if column.name == name)
        return style.axis_label(name, unit)

    def share(self, goal: str) -> Floats:
        """A goal as a fraction of its range over the feasible designs, 1 the best; nan for the others."""
        values = self[goal]
        inside = values[self.feasible]
        low, high = inside.min(initial=np.inf), inside.max(initial=-np.inf)
        return np.where(self.feasible, normalised(values, low, high, smallest=self.goals[goal]), np.nan)

    def score(self, row: int) -> Floats:
        """Weighted sum of the goals' shares, with the weights of a row of the table of optima."""
        weights = [float(self.optimum[f"w_{goal}"][row]) for goal in self.goals]
        return np.asarray(sum(w * self.share(goal) for w, goal in zip(weights, self.goals, strict=True)))

    def total(self) -> Floats:
        """Sum of the goals' shares."""
        return np.asarray(sum(self.share(goal) for goal in self.goals))

    def chosen(self) -> int:
        """Row of the optimum that is shown where only one can be: the best on the whole."""
        return int(np.argmax(self.optimum["CPI"])) if "CPI" in self.optimum else 0

    def in_words(self, table: Table, row: int) -> str:
        """``l_a = 1, l_b = 2.15`` of a row of a table with the variables."""
        return ", ".join(f"{name} = {float(table[name][row]):.4g}" for name in self.names)


def designs_of(study: Study, result: Result) -> Designs:
    """The designs of an optimisation's result."""
    section = study.optimize
    assert section is not None
    goals = {**{goal.name: False for goal in section.maximize}, **{goal.name: True for goal in section.minimize}}
    table = result.tables["designs"]
    return Designs(
        table, result.tables["optimum"], list(section.variables), goals, np.asarray(table["feasible"]).astype(bool)
    )
