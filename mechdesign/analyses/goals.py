"""Results by which designs are compared: workspace indices of whole batches, any other result design by design."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module

import numpy as np

from mechdesign.analyses.rays import Floats
from mechdesign.analyses.region import BRISK, GRID_TOLERANCE, Answer, Question, answer, batched, questions
from mechdesign.errors import MechdesignError, Problem, StudyError
from mechdesign.results import Result
from mechdesign.study import Study, load
from mechdesign.study.optimize_models import Condition
from mechdesign.study.sections import COMMANDS


@dataclass(frozen=True)
class Goal:
    """A result that is maximised, minimised or bounded: a workspace index, or the worst row of a column.

    Parameters
    ----------
    command, column : str
        Where it is found.
    smallest : bool
        Whether the largest row is the worst one.
    absolute : bool
        Judge absolute values.
    """

    name: str
    command: str
    column: str
    smallest: bool = False
    absolute: bool = False
    where: tuple[tuple[str, object], ...] = ()

    @property
    def index(self) -> bool:
        """Whether it is an index of the workspace, evaluated for many designs at once."""
        return self.command == "workspace" and batched(self.column) and not self.where

    def worst(self, result: Result) -> float:
        """The value of the worst row; nan where a row has none.

        Raises
        ------
        KeyError
            If no table has the column.
        """
        for table in result.tables.values():
            if self.column in table:
                rows = np.ones(len(table), dtype=bool)
                for column, wanted in self.where:
                    rows &= np.asarray([str(value) == str(wanted) for value in table[column].tolist()])
                values = np.asarray(table[self.column], dtype=float)[rows]
                values = np.abs(values) if self.absolute else values
                if not values.size:
                    return float("nan")
                return float(np.max(values) if self.smallest else np.min(values))
        raise KeyError(self.column)


def goal(name: str, *, smallest: bool = False) -> Goal:
    """Read a result's name, such as ``GII``, ``workspace.area``, ``stiffness.k_min`` or ``kinematics.C.y_error``.

    Of an error the absolute value counts.
    """
    command, _, column = name.partition(".")
    if command not in COMMANDS:
        command, column = "workspace", name
    return Goal(name, command, column, smallest, absolute=column.endswith("_error"))


def bounds_of(condition: Condition) -> Iterator[tuple[Goal, float, bool]]:
    """The worst rows that a condition judges, with the bound and whether it is an upper one."""
    command, _, column = condition.result.partition(".")
    if command not in COMMANDS:
        command, column = "workspace", condition.result
    for bound, upper in ((condition.at_least, False), (condition.at_most, True)):
        if bound is not None:
            name = f"{condition.result} {'at most' if upper else 'at least'} {bound:g}"
            yield Goal(name, command, column, upper, condition.abs, tuple(condition.where.items())), bound, upper


@dataclass(frozen=True, eq=False)
class Evaluated:
    """Values of goals for a batch of designs; nan where there is none, and why."""

    values: dict[Goal, Floats]
    errors: dict[str, Floats]
    reasons: list[str]


class Evaluator:
    """Evaluates goals for designs of one study."""

    def __init__(self, study: Study, goals: Sequence[Goal]) -> None:
        self.study = study
        self.goals = list(goals)
        self.question: Question | None = None
        if any(goal.index for goal in goals):
            columns = dict.fromkeys(("area", *(goal.column for goal in goals if goal.index)))
            asked = questions(study, GRID_TOLERANCE, tuple(columns))
            if len(asked) > 1:
                message = "an optimisation compares one workspace a design: hold one value of each coordinate"
                raise StudyError((Problem(message, "workspace.at", str(study.path or "")),))
            self.question = asked[0]
        if not all(goal.index for goal in goals):
            self._check_parameters()

    def _check_parameters(self) -> None:
        assert self.study.optimize is not None
        for name in self.study.optimize.variables:
            if name not in self.study.parameters.nominal:
                message = "only parameters can be varied for results other than the workspace's; give it a name there"
                raise StudyError((Problem(message, f"optimize.variables.{name}", str(self.study.path or "")),))

    def __call__(self, designs: Mapping[str, Floats]) -> Evaluated:
        """Evaluate a batch of designs, given by the values of the variables."""
        count = len(next(iter(designs.values())))
        values: dict[Goal, Floats] = {}
        errors: dict[str, Floats] = {}
        reasons = [""] * count
        if self.question is not None:
            places = {
                name: np.broadcast_to(np.asarray(value, dtype=float), count)
                for name, value in self.study.parameters.places(designs).items()
            }
            given = answer(self.question, places, count, BRISK)
            values = {goal: given.values[goal.column] for goal in self.goals if goal.index}
            errors = {goal.name: given.errors[goal.column] for goal in values if goal.column in ("GII", "GRI")}
            reasons = _why(given)
        others = [goal for goal in self.goals if not goal.index]
        values |= {goal: np.full(count, np.nan) for goal in others}
        for k in range(count if others else 0):
            if not reasons[k]:
                reasons[k] = self._one({name: column[k] for name, column in designs.items()}, values, k)
        return Evaluated(values, errors, reasons)

    def _one(self, design: Mapping[str, float], values: Mapping[Goal, Floats], k: int) -> str:
        """Ask the other questions of one design; returns why it is infeasible."""
        assert self.study.path is not None
        changes = [f"mechanism.parameters.{name}={float(value)!r}" for name, value in design.items()]
        others = [goal for goal in self.goals if not goal.index]
        try:
            variant = load(self.study.path, [*self.study.overrides, *changes], self.study.seed)
            for command in dict.fromkeys(goal.command for goal in others):
                result: Result = getattr(import_module(f"mechdesign.analyses.{command}"), command)(variant)
                if result.failed:
                    return result.failed
                for goal in others:
                    if goal.command == command:
                        values[goal][k] = goal.worst(result)
                        if np.isnan(values[goal][k]):
                            return f"{goal.name} has no value"
        except KeyError as error:
            raise StudyError((_unknown(self.study, str(error.args[0])),)) from None
        except MechdesignError as error:
            return str(error).splitlines()[0].removeprefix(f"{self.study.path}: ")
        return ""


def _unknown(study: Study, column: str) -> Problem:
    return Problem(f"no result has a column '{column}'", "optimize", str(study.path or ""))


def _why(given: Answer) -> list[str]:
    closes = given.panels.closes & (given.values["area"] > 0)
    return ["" if well else "nothing of the workspace can be reached" for well in closes]
