"""The workspace section of the study file."""

from __future__ import annotations

import math
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, Discriminator, Field, Tag, ValidationInfo, field_validator, model_validator

from mechdesign.indices import INDEX_NAMES, needed_section
from mechdesign.study.schema.checker import Checker
from mechdesign.study.text import fields
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.fields import failure

# A turn written with few digits (6.2832 rad) is one, as far as so small a part of it.
WHOLE = 3e-6


class Scan(fields.Model):
    """Rays about a point; angles in the study's unit."""

    about: tuple[fields.Length, fields.Length] | None = None
    from_: fields.Angle | None = Field(None, alias="from")
    to: fields.Angle | None = None
    rays: Annotated[int, fields.whole(2, 1_000_000)] | None = None

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


class Integrate(fields.Model):
    """The rule of integration over the workspace."""

    rule: Annotated[str, fields.choice(("gauss", "midpoint", "sector_mean"))] = "gauss"
    tolerance: fields.Positive = 1e-5
    nodes: Annotated[int, fields.whole(1, 100_000)] | None = None

    @model_validator(mode="after")
    def _fitting(self) -> Integrate:
        if self.rule == "gauss" and self.nodes is not None:
            raise failure("rule 'gauss' chooses its nodes by 'tolerance'; 'nodes' belongs to midpoint and sector_mean")
        return self


class Over(fields.Model):
    """A range of a held coordinate: the region in which some value of it is reached, or every one."""

    from_: fields.Number = Field(alias="from")
    to: fields.Number
    all: bool = False


def _form(raw: Any) -> str:
    return "over" if isinstance(raw, dict | Over) else "values"


At = Annotated[Annotated[Over, Tag("over")] | Annotated[fields.Numbers, Tag("values")], Discriminator(_form)]


class WorkspaceSection(fields.Model):
    """Where can it work?"""

    point: fields.PointName
    at: dict[fields.CoordinateName, At] = Field(default_factory=dict)
    scan: Scan = Field(default_factory=lambda: Scan.model_validate({}))
    integrate: Integrate = Integrate()
    margin: fields.NonNegativeAngle = 0.0
    assembly: Annotated[str, fields.choice(("same", "any"))] = "same"
    characteristic_length: fields.PositiveLength | None = None
    indices: (
        Annotated[tuple[Annotated[str, fields.choice(INDEX_NAMES)], ...], BeforeValidator(fields.as_list)] | None
    ) = None

    def checked(self, checker: Checker) -> Self:
        """Check names, units and ranges against the mechanism."""
        root: KeyPath = ("workspace",)
        checker.known(self.point, checker.mechanism.owners, "point", (*root, "point"))
        checker.coordinates(self.at, (*root, "at"))
        ranges = [name for name, values in self.at.items() if isinstance(values, Over)]
        if len(ranges) > 1:
            checker.report((*root, "at", ranges[1]), "only one held coordinate can range", at_key=True)
        for name, values in self.at.items():
            if isinstance(values, Over):
                checker.range(values.from_, values.to, (*root, "at", name))
            elif not values:
                checker.report((*root, "at", name), "an empty list of values")
        for index, name in enumerate(self.indices or ()):
            checker.needs(needed_section(name), f"the index {name!r}", (*root, "indices", index))
        if (self.scan.from_ is None) != (self.scan.to is None):
            checker.report((*root, "scan"), "'from' and 'to' belong together")
        checker.range(self.scan.from_, self.scan.to, (*root, "scan"))
        return self
