"""The workspace section of the study file."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import BeforeValidator, Discriminator, Field, Tag, ValidationInfo, field_validator, model_validator

from mechdesign.indices import index_names
from mechdesign.study.build.section import Model
from mechdesign.study.schema.lists import Numbers, as_list
from mechdesign.study.text.numbers import (
    Angle,
    Choice,
    CoordinateName,
    Length,
    NonNegativeAngle,
    Number,
    PointName,
    Positive,
    PositiveLength,
    Whole,
    failure,
)

# A turn written with few digits (6.2832 rad) is one, as far as so small a part of it.
WHOLE = 3e-6


class Scan(Model):
    """Rays about a point; angles in the study's unit."""

    about: tuple[Length, Length] | None = None
    from_: Angle | None = Field(None, alias="from")
    to: Angle | None = None
    rays: Annotated[int, Whole(2, 1_000_000)] | None = None

    @field_validator("to")
    @classmethod
    def _within_a_turn(cls, to: float | None, info: ValidationInfo) -> float | None:
        start, context = info.data.get("from_"), info.context
        if to is not None and start is not None and context is not None:
            turn = 2 * math.pi / context.units.angle_factor
            if to - start > turn * (1 + WHOLE):
                raise failure(
                    f"{to:g} is more than a turn beyond 'from', {start:g}: rays would meet the region more than once; "
                    f"at most {start + turn:g}"
                )
        return to


class Integrate(Model):
    """The rule of integration over the workspace."""

    rule: Annotated[str, Choice(("gauss", "midpoint", "sector_mean"))] = "gauss"
    tolerance: Positive = 1e-5
    nodes: Annotated[int, Whole(1, 100_000)] | None = None

    @model_validator(mode="after")
    def _fitting(self) -> Integrate:
        if self.rule == "gauss" and self.nodes is not None:
            raise failure("rule 'gauss' chooses its nodes by 'tolerance'; 'nodes' belongs to midpoint and sector_mean")
        return self


class Over(Model):
    """A range of a held coordinate: the region in which some value of it is reached, or every one."""

    from_: Number = Field(alias="from")
    to: Number
    all: bool = False


def _form(raw: Any) -> str:
    return "over" if isinstance(raw, dict | Over) else "values"


At = Annotated[Annotated[Over, Tag("over")] | Annotated[Numbers, Tag("values")], Discriminator(_form)]


class WorkspaceSection(Model):
    """Where can it work?"""

    point: PointName
    at: dict[CoordinateName, At] = Field(default_factory=dict)
    scan: Scan = Field(default_factory=lambda: Scan.model_validate({}))
    integrate: Integrate = Integrate()
    margin: NonNegativeAngle = 0.0
    assembly: Annotated[str, Choice(("same", "any"))] = "same"
    characteristic_length: PositiveLength | None = None
    indices: Annotated[tuple[Annotated[str, Choice(index_names)], ...], BeforeValidator(as_list)] | None = None
