"""The mechanism's part of the study file, and the whole file, as pydantic models.

Every short form of the format (a link as a list, drives as a list, a measure as an expression) is brought to the one
long form before validation, so that no model is a union and every error has one place.
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from mechdesign.study.text.numbers import (
    NAME_FORM,
    NAMES_FORM,
    NUMBER_FORM,
    AngleValue,
    AnyName,
    AnyValue,
    Choice,
    CoordinateName,
    DriveName,
    JointName,
    LengthValue,
    LinkName,
    MeasureName,
    OrShort,
    PointName,
    PositiveLengthValue,
    Value,
    failure,
    or_short,
    shown,
    suggestion,
)
from mechdesign.study.build.target_models import TargetValue

LINK_KEYS = ("from", "to", "length", "points", "telescopic")


class Model(BaseModel):
    """Base of all sections: frozen, unknown keys are errors, values come in study units."""

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)


def _pair(raw: Any) -> Any:
    if not isinstance(raw, list) or len(raw) != 2:
        raise failure(f"expected [x, y], not {shown(raw)}")
    return raw


def _two(raw: Any) -> Any:
    if not isinstance(raw, list) or len(raw) != 2:
        raise failure(f"expected a list of two names, not {shown(raw)}")
    return raw


def names_to_mapping(raw: Any) -> Any:
    """Bring ``[A, B]`` to ``{A: null, B: null}``; anything else passes."""
    if not isinstance(raw, list):
        return raw
    for name in raw:
        if not isinstance(name, str):
            raise failure(f"expected a name, not {shown(name)}")
        if raw.count(name) > 1:
            raise failure(f"{name!r} is listed twice")
    return dict.fromkeys(raw)


Point = Annotated[tuple[LengthValue, LengthValue], BeforeValidator(_pair)]
PointValues = tuple[Value, Value]
TwoLinks = Annotated[tuple[LinkName, LinkName], BeforeValidator(_two)]
TwoPoints = Annotated[tuple[PointName, PointName], BeforeValidator(_two)]


class Link(Model):
    """A link: binary, telescopic, or its points in its own frame; what is None is measured from the sketch."""

    from_: PointName | None = Field(None, alias="from")
    to: PointName | None = None
    length: PositiveLengthValue | None = None
    telescopic: bool = False
    points: Annotated[dict[PointName, Point | None], BeforeValidator(names_to_mapping), OrShort((NAMES_FORM,))] = {}

    @model_validator(mode="before")
    @classmethod
    def _long_form(cls, raw: Any) -> Any:
        if isinstance(raw, list):
            if len(raw) not in (2, 3):
                raise failure("expected [from, to, length], {from, to, length} or the link's points {A: [x, y], ...}")
            return dict(zip(("from", "to", "length"), raw, strict=False))
        if not isinstance(raw, dict):
            expected = "[from, to, length], {from, to, length} or its points {A: [x, y], ...}"
            raise failure(f"expected a link, {expected}, not {shown(raw)}")
        if any(key in raw for key in LINK_KEYS):
            for key, value in raw.items():
                if key not in LINK_KEYS and isinstance(value, list):
                    raise failure(f"beside 'from', 'to' and 'length' a point stands under 'points': {{{key}: [x, y]}}")
            return raw
        for key, value in raw.items():
            if not isinstance(value, list) and value is not None:
                hint = suggestion(key, LINK_KEYS)
                raise failure(f"{key!r} is neither a key of a link nor a point [x, y]{hint}")
        return {"points": raw}

    @model_validator(mode="after")
    def _consistent(self) -> Link:
        if (self.from_ is None) != (self.to is None):
            raise failure("a binary link needs both 'from' and 'to'")
        if self.from_ is None:
            if self.length is not None or self.telescopic:
                raise failure("a length belongs to a link with 'from' and 'to'")
            if not self.points:
                raise failure("a link needs at least one point")
        elif self.from_ == self.to:
            raise failure(f"a link from {self.from_!r} to itself")
        elif self.telescopic and self.length is not None:
            raise failure("a telescopic leg has no fixed length; leave out 'length', or 'telescopic'")
        for end in (self.from_, self.to):
            if end in self.points:
                raise failure(f"point {end!r} is an end of the link; its place in the frame is not given twice")
        return self

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        place = {"type": "array", "items": NUMBER_FORM, "minItems": 2, "maxItems": 2}
        short = {"type": "array", "prefixItems": [NAME_FORM, NAME_FORM, NUMBER_FORM], "minItems": 2, "maxItems": 3}
        own_frame = {
            "type": "object",
            "additionalProperties": {"anyOf": [place, {"type": "null"}]},
            "not": {"anyOf": [{"required": [key]} for key in LINK_KEYS]},
        }
        return or_short(schema, handler, short, own_frame)


def _through(raw: Any) -> Any:
    if isinstance(raw, str):
        return [raw]
    if not isinstance(raw, list) or len(raw) != 2:
        raise failure(f"expected a point or two points [P, R], not {shown(raw)}")
    return raw


class Joint(Model):
    """A joint that is not a revolute: exactly one of prismatic, slot and fixed."""

    prismatic: TwoLinks | None = None
    slot: LinkName | None = None
    fixed: TwoLinks | None = None
    through: Annotated[tuple[PointName, ...], BeforeValidator(_through), OrShort((NAME_FORM,))] | None = None
    direction: AngleValue | None = None
    point: PointName | None = None
    angle: AngleValue | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Joint:
        kinds = [kind for kind in ("prismatic", "slot", "fixed") if getattr(self, kind) is not None]
        if len(kinds) != 1:
            raise failure("a joint is one of prismatic: [a, b], slot: a, fixed: [a, b]")
        foreign = {"prismatic": (), "slot": ("angle",), "fixed": ("through", "direction")}[kinds[0]]
        for key in foreign:
            if getattr(self, key) is not None:
                raise failure(f"a {kinds[0]} joint has no {key!r}")
        if self.through is not None and len(self.through) == 2 and self.direction is not None:
            raise failure("'through' two points gives the direction; leave 'direction' out")
        return self


class Drive(Model):
    """A driven coordinate: exactly one of angle, length and slide."""

    angle: LinkName | None = None
    from_: LinkName | None = Field(None, alias="from")
    length: LinkName | None = None
    slide: JointName | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Drive:
        given = [key for key in ("angle", "length", "slide") if getattr(self, key) is not None]
        if len(given) != 1:
            raise failure("a drive is one of angle: link, length: leg, slide: joint")
        if self.from_ is not None and self.angle is None:
            raise failure("'from' belongs to an angle")
        return self


class Measure(Model):
    """A named quantity: exactly one of angle, distance and expression."""

    angle: TwoLinks | None = None
    distance: TwoPoints | None = None
    expression: str | None = None

    @model_validator(mode="before")
    @classmethod
    def _long_form(cls, raw: Any) -> Any:
        return {"expression": raw} if isinstance(raw, str) else raw

    @model_validator(mode="after")
    def _one_kind(self) -> Measure:
        if sum(item is not None for item in (self.angle, self.distance, self.expression)) != 1:
            raise failure("a measure is one of {angle: [a, b]}, {distance: [P, Q]} or an expression over coordinates")
        return self

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return or_short(schema, handler, NAME_FORM)


class Limit(Model):
    """Bounds of a distance, a drive, an angle or a measure."""

    distance: TwoPoints | None = None
    drive: DriveName | None = None
    angle: TwoLinks | None = None
    measure: MeasureName | None = None
    min: AnyValue | None = None
    max: AnyValue | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Limit:
        given = [key for key in ("distance", "drive", "angle", "measure") if getattr(self, key) is not None]
        if len(given) != 1:
            raise failure("a limit is one of distance: [P, Q], drive: name, angle: [a, b], measure: name")
        if self.min is None and self.max is None:
            raise failure("a limit needs 'min', 'max' or both")
        return self


class MechanismSection(Model):
    """What the study says about the mechanism."""

    parameters: dict[str, AnyValue] = {}
    links: dict[LinkName, Link]
    joints: dict[JointName, Joint] = {}
    drives: Annotated[dict[AnyName, Drive | None], BeforeValidator(names_to_mapping), OrShort((NAMES_FORM,))] = {}
    branch: Annotated[str, Choice(("side", "follow"))] = "side"
    sketch: dict[PointName, Point] = {}
    measures: dict[MeasureName, Measure] = {}
    limits: tuple[Limit, ...] = ()
    targets: dict[CoordinateName, TargetValue] = {}


class UnitsSection(Model):
    """Units that bare numbers mean."""

    length: str = "mm"
    angle: str = "deg"
    time: str = "s"
    force: str = "N"
