"""Poses of a question as the study file gives them: a list, a sweep, or a path."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from mechdesign.study.build.section import Model
from mechdesign.study.schema.paths import Path
from mechdesign.study.text.numbers import (
    NUMBER_FORM,
    CoordinateName,
    Number,
    OrShort,
    Whole,
    failure,
    or_short,
)


class Sweep(Model):
    """Values of one coordinate, both ends included; a bare number is held (``number`` 1)."""

    from_: Number = Field(alias="from")
    to: Number
    step: Number | None = None
    number: Annotated[int, Whole(1, 10_000_000)] | None = None

    @model_validator(mode="before")
    @classmethod
    def _held(cls, raw: Any) -> Any:
        return {"from": raw, "to": raw, "number": 1} if isinstance(raw, int | float | str) else raw

    @model_validator(mode="after")
    def _spacing(self) -> Sweep:
        if (self.step is None) == (self.number is None):
            raise failure("a sweep needs either 'step' or 'number'")
        if self.step is not None and (self.step == 0 or self.step * (self.to - self.from_) < 0):
            raise failure(f"a step of {self.step:g} never leads from {self.from_:g} to {self.to:g}")
        return self

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return or_short(schema, handler, NUMBER_FORM)


def _poses(raw: Any) -> Any:
    if raw == "workspace":
        return ()
    if isinstance(raw, list) and not raw:
        raise failure("an empty list of poses")
    return raw


class PoseSection(Model):
    """Where a question is asked: listed poses, a sweep, a path, or the nodes of the workspace section.

    The list is empty where the study says ``poses: workspace``.
    """

    poses: (
        Annotated[tuple[dict[CoordinateName, Number], ...], BeforeValidator(_poses), OrShort(({"const": "workspace"},))]
        | None
    ) = None
    sweep: dict[CoordinateName, Sweep] | None = None
    path: dict[CoordinateName, Path] | None = None

    @property
    def at_nodes(self) -> bool:
        """Whether the poses are the nodes of the workspace section."""
        return self.poses == ()

    @model_validator(mode="after")
    def _one_source(self) -> PoseSection:
        given = [key for key in ("poses", "sweep", "path") if getattr(self, key) is not None]
        if len(given) > 1:
            raise failure(f"{' and '.join(given)} are both given; poses come from one of them")
        return self
