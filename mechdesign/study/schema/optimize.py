"""The optimize section of the study file, and conditions on results."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, model_validator

from mechdesign.study.build.section import Model
from mechdesign.study.text.numbers import (
    NAME_FORM,
    NUMBER_FORM,
    Bound,
    Choice,
    CoordinateName,
    Number,
    OrShort,
    PositiveNumber,
    Pure,
    Whole,
    failure,
    suggestion,
)


class Variable(Model):
    """A design variable; its bounds are expressions over parameters and the variables above it.

    The step is that of a grid, and of the sensitivities told with an optimum.
    """

    from_: Bound = Field(alias="from")
    to: Bound
    step: PositiveNumber | None = None
    number: Annotated[int, Whole(1, 10_000_000)] | None = None

    @model_validator(mode="after")
    def _spacing(self) -> Variable:
        if self.step is not None and self.number is not None:
            raise failure("either 'step' or 'number', not both")
        return self


class Judged(Model):
    """A result, and the rows of it that count."""

    result: CoordinateName
    where: dict[str, str | float | int] = Field(default_factory=dict)

    @property
    def name(self) -> str:
        """The result, and in parentheses which rows count."""
        where = ", ".join(f"{column} {wanted}" for column, wanted in self.where.items())
        return f"{self.result} ({where})" if where else self.result


class Condition(Judged):
    """A result and its bounds."""

    abs: bool = False
    at_least: Number | None = None
    at_most: Number | None = None

    @model_validator(mode="after")
    def _bounded(self) -> Condition:
        if self.at_least is None and self.at_most is None:
            raise failure("a condition needs 'at_least', 'at_most' or both")
        if self.at_least is not None and self.at_most is not None and self.at_most < self.at_least:
            raise failure(f"nothing is at least {self.at_least:g} and at most {self.at_most:g}")
        return self


def _weight_row(raw: Any, info: ValidationInfo) -> Any:
    """Bring ``{GII: 1, SUI: 1}`` to a list in the order maximize then minimize; say what is wrong with a row."""
    if "maximize" not in info.data or "minimize" not in info.data:
        # What is wrong with the goals is told; their weights cannot be judged.
        return ()
    goals = [goal.name for goal in info.data["maximize"] + info.data["minimize"]]
    if isinstance(raw, Mapping):
        for name in raw:
            if name not in goals:
                raise failure(f"{name!r} is neither maximised nor minimised{suggestion(str(name), goals)}")
        return [raw.get(goal, 0) for goal in goals]
    if isinstance(raw, list) and len(raw) != len(goals):
        raise failure(f"{len(raw)} weights for {len(goals)} goals: {', '.join(goals)}")
    return raw


def _weights_that_choose(row: tuple[float, ...]) -> tuple[float, ...]:
    if any(weight < 0 for weight in row):
        raise failure("a weight is not negative: name the goal under 'minimize' instead of 'maximize', or the reverse")
    if row and not any(row):
        raise failure("all weights are zero: no design would be better than another")
    return row


WeightRow = Annotated[
    tuple[Pure, ...],
    BeforeValidator(_weight_row),
    AfterValidator(_weights_that_choose),
    OrShort(({"type": "object", "additionalProperties": NUMBER_FORM},)),
]


def _goal(raw: Any) -> Any:
    return {"result": raw} if isinstance(raw, str) else raw


# Names of results, or with `where` which of their rows count.
Goals = Annotated[
    tuple[Annotated[Judged, BeforeValidator(_goal), OrShort((NAME_FORM,))], ...],
    BeforeValidator(lambda raw: [raw] if isinstance(raw, str | Mapping) else raw),
    OrShort((NAME_FORM,)),
]


class OptimizeSection(Model):
    """Which dimensions are best?"""

    method: Annotated[str, Choice(("grid", "search", "pareto"))] = "grid"
    variables: dict[CoordinateName, Variable]
    maximize: Goals = ()
    minimize: Goals = ()
    weights: tuple[WeightRow, ...] | None = None
    subject_to: tuple[Condition, ...] = ()
    evaluations: Annotated[int, Whole(10, 10_000_000)] | None = None

    @model_validator(mode="after")
    def _goals(self) -> OptimizeSection:
        goals = [goal.name for goal in self.maximize + self.minimize]
        twice = [goal for goal in goals if goals.count(goal) > 1]
        if twice:
            raise failure(f"{twice[0]!r} is named twice among the goals")
        return self
