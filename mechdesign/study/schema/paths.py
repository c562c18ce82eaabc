"""A path as the study file gives it: points or numbers one after another, a circle, an arc, or a line."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from mechdesign.study.build.section import Model
from mechdesign.study.text.numbers import (
    Angle,
    Context,
    Length,
    PositiveLength,
    Reader,
    Whole,
    failure,
    or_short,
    read_number,
    shown,
)

FILES = (".csv", ".txt", ".dat")
# Number of poses where a study does not say it: a circle in steps of 5 deg, and both ends of a line or an arc.
ROUND, STRAIGHT = 72, 51

Speed = Annotated[
    float,
    Reader("velocity", 0.0, True),
    Field(
        description="speed of the path's point along it, constant: velocities and accelerations of drives and outputs "
        "follow from the path's direction and curvature. On a polyline each segment is passed at this speed without "
        "acceleration; a corner has the direction of the segment that begins there, the last point of an open one "
        "that of the segment that ends there"
    ),
]


def _pair(raw: Any) -> Any:
    if not isinstance(raw, list) or len(raw) != 2:
        raise failure(f"expected [x, y], not {shown(raw)}")
    return raw


def _two_points(raw: Any) -> Any:
    if not isinstance(raw, list) or len(raw) != 2:
        raise failure(f"expected a line from [x, y] to [x, y], as a list of the two, not {shown(raw)}")
    return raw


Point = Annotated[tuple[Length, Length], BeforeValidator(_pair)]


class Circle(Model):
    """A whole circle, counter-clockwise unless it says otherwise; it ends one step before it closes."""

    center: Point
    radius: PositiveLength
    from_: Angle = Field(0.0, alias="from")
    clockwise: bool = False


class Arc(Model):
    """Part of a circle between two angles from the x axis, both ends included; clockwise where they fall."""

    center: Point
    radius: PositiveLength
    from_: Angle = Field(alias="from")
    to: Angle

    @model_validator(mode="after")
    def _some(self) -> Arc:
        if self.from_ == self.to:
            raise failure("an arc needs two different angles 'from' and 'to'")
        return self


class _Through:
    """Values one after another: numbers or [x, y]; a number alone is held."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(self._validate)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return {"type": ["array", "string", "number"]}

    @staticmethod
    def _validate(raw: Any, info: ValidationInfo) -> tuple[Any, ...]:
        context = info.context or Context()
        if not isinstance(raw, list):
            return (read_number(raw, context).nominal,)
        values: list[Any] = []
        for index, item in enumerate(raw):
            try:
                if isinstance(item, list) and len(item) == 2:
                    values.append(tuple(read_number(part, context).nominal for part in item))
                else:
                    values.append(read_number(item, context).nominal)
            except PydanticCustomError as error:
                raise failure(f"entry {index}: {error.message()}") from None
        if not values:
            raise failure("an empty path")
        if len({isinstance(value, tuple) for value in values}) > 1:
            raise failure("a path is a list of [x, y] (of a point) or a list of numbers, not a mixture")
        return tuple(values)


class Path(Model):
    """What one coordinate or point passes; a list, a CSV file's name or a number alone are short forms."""

    through: Annotated[tuple[Any, ...], _Through()] | None = None
    file: str | None = None
    circle: Circle | None = None
    arc: Arc | None = None
    line: Annotated[tuple[Point, Point], BeforeValidator(_two_points)] | None = None
    points: Annotated[int, Whole(2, 10_000_000)] | None = Field(
        None, description=f"number of poses, evenly spaced: {ROUND} on a circle, else {STRAIGHT}, where left out"
    )
    spline: bool = Field(
        False, description="whether a smooth curve (a cubic spline) is laid through the points, closed where they are"
    )

    @property
    def shape(self) -> str | None:
        """Which figure of the plane it is; None for what is listed."""
        return next((key for key in ("circle", "arc", "line") if getattr(self, key) is not None), None)

    @model_validator(mode="before")
    @classmethod
    def _short(cls, raw: Any) -> Any:
        if isinstance(raw, str) and raw.lower().endswith(FILES):
            return {"file": raw}
        return raw if isinstance(raw, dict | Path) else {"through": raw}

    @model_validator(mode="after")
    def _one(self) -> Path:
        shapes = ("through", "file", "circle", "arc", "line")
        given = [key for key in shapes if getattr(self, key) is not None]
        if len(given) != 1:
            raise failure(f"a path is one of {', '.join(shapes)}, not {' and '.join(given) or 'none of them'}")
        listed = given[0] in ("through", "file")
        if self.spline and not listed:
            raise failure(f"{given[0]!r} is smooth already: 'spline' is for a list of points")
        if self.points is not None and listed and not self.spline:
            raise failure(
                "a list of points has its own number; 'points' goes with a spline, a circle, an arc or a line"
            )
        return self

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return or_short(schema, handler, {"type": ["array", "string", "number"]})
