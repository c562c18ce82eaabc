"""The optimize section of the study file, and conditions on results."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, model_validator

from mechdesign.study.lists import CoordinateNames
from mechdesign.study.models import Model
from mechdesign.study.numbers import (
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


class Condition(Model):
    """A result and its bounds."""

    result: CoordinateName
    where: dict[str, str | float | int] = Field(default_factory=dict)
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
    goals: tuple[str, ...] = info.data["maximize"] + info.data["minimize"]
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


class OptimizeSection(Model):
    """Which dimensions are best?"""

    method: Annotated[str, Choice(("grid", "search", "pareto"))] = "grid"
    variables: dict[CoordinateName, Variable]
    maximize: CoordinateNames = ()
    minimize: CoordinateNames = ()
    weights: tuple[WeightRow, ...] | None = None
    subject_to: tuple[Condition, ...] = ()
    evaluations: Annotated[int, Whole(10, 10_000_000)] | None = None

    @model_validator(mode="after")
    def _goals(self) -> OptimizeSection:
        goals = self.maximize + self.minimize
        twice = [goal for goal in goals if goals.count(goal) > 1]
        if twice:
            raise failure(f"{twice[0]!r} is named twice among the goals")
        return self
