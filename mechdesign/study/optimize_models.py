"""The optimize section of the study file, and conditions on results."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field, model_validator

from mechdesign.study.lists import CoordinateNames, as_list
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
    """A design variable; its bounds are expressions over parameters and the variables above it."""

    from_: Bound = Field(alias="from")
    to: Bound
    step: PositiveNumber | None = None
    number: Annotated[int, Whole(1, 10_000_000)] | None = None

    @model_validator(mode="after")
    def _spacing(self) -> Variable:
        if (self.step is None) == (self.number is None):
            raise failure("a variable of a grid needs either 'step' or 'number'")
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


class OptimizeSection(Model):
    """Which dimensions are best?"""

    variables: dict[CoordinateName, Variable]
    maximize: CoordinateNames = ()
    minimize: CoordinateNames = ()
    weights: (
        tuple[Annotated[tuple[Pure, ...], OrShort(({"type": "object", "additionalProperties": NUMBER_FORM},))], ...]
        | None
    ) = None
    subject_to: tuple[Condition, ...] = ()
    method: Annotated[str, Choice(("grid",), later=("search", "pareto"))] = "grid"

    @model_validator(mode="before")
    @classmethod
    def _weights_by_name(cls, raw: Any) -> Any:
        """Bring ``{GII: 1, SUI: 1}`` to a list in the order maximize then minimize."""
        if not isinstance(raw, dict) or not isinstance(raw.get("weights"), list):
            return raw
        goals = [goal for key in ("maximize", "minimize") for goal in as_list(raw.get(key))]
        rows = []
        for index, row in enumerate(raw["weights"]):
            if isinstance(row, Mapping):
                unknown = [name for name in row if name not in goals]
                if unknown:
                    hint = suggestion(unknown[0], [str(goal) for goal in goals])
                    raise failure(f"weights, row {index + 1}: {unknown[0]!r} is neither maximised nor minimised{hint}")
                row = [row.get(goal, 0) for goal in goals]
            elif isinstance(row, list) and len(row) != len(goals):
                raise failure(f"weights, row {index + 1}: {len(row)} weights for {len(goals)} goals")
            rows.append(row)
        return {**raw, "weights": rows}

    @model_validator(mode="after")
    def _goals(self) -> OptimizeSection:
        goals = self.maximize + self.minimize
        twice = [goal for goal in goals if goals.count(goal) > 1]
        if twice:
            raise failure(f"{twice[0]!r} is named twice among the goals")
        return self
