"""The mechanism's part of the study file as pydantic models.

Every short form of the format (a link as a list, drives as a list, a measure as an expression) is brought to the one
long form before validation, so that no model is a union and every error has one place.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from mechdesign.errors import suggestion
from mechdesign.expressions import Expression
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.model import Quantity
from mechdesign.study.text import fields
from mechdesign.study.text.fields import FILES, Context, StudyNumber, failure, read_expression, read_rows, shown
from mechdesign.study.text.units import QuantityError, check_unit

LINK_KEYS = ("from", "to", "length", "points", "telescopic")
TARGET_FORMS = "an expression, a number, {file: path.csv}, a list of numbers, of [x, y] or of [drive, x, y]"


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


Point = Annotated[tuple[fields.LengthValue, fields.LengthValue], fields.pair_of("[x, y]")]
PointValues = tuple[StudyNumber, StudyNumber]
TwoLinks = Annotated[tuple[fields.LinkName, fields.LinkName], fields.pair_of("a list of two names")]
TwoPoints = Annotated[tuple[fields.PointName, fields.PointName], fields.pair_of("a list of two names")]


class Link(fields.Model):
    """A link: binary, telescopic, or its points in its own frame; what is None is measured from the sketch."""

    short = (
        {
            "type": "array",
            "prefixItems": [fields.NAME_FORM, fields.NAME_FORM, fields.NUMBER_FORM],
            "minItems": 2,
            "maxItems": 3,
        },
        {
            "type": "object",
            "additionalProperties": {"anyOf": [fields.PAIR_FORM, {"type": "null"}]},
            "not": {"anyOf": [{"required": [key]} for key in LINK_KEYS]},
        },
    )
    from_: fields.PointName | None = Field(None, alias="from")
    to: fields.PointName | None = None
    length: fields.PositiveLengthValue | None = None
    telescopic: bool = False
    points: Annotated[
        dict[fields.PointName, Point | None], BeforeValidator(names_to_mapping), fields.OrShort(fields.NAMES_FORM)
    ] = Field(default_factory=dict)

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


def _through(raw: Any) -> Any:
    if isinstance(raw, str):
        return [raw]
    if not isinstance(raw, list) or len(raw) != 2:
        raise failure(f"expected a point or two points [P, R], not {shown(raw)}")
    return raw


class Joint(fields.Model):
    """A joint that is not a revolute: exactly one of prismatic, slot and fixed."""

    one_of = ("a joint is one of prismatic: [a, b], slot: a, fixed: [a, b]", "prismatic", "slot", "fixed")
    prismatic: TwoLinks | None = None
    slot: fields.LinkName | None = None
    fixed: TwoLinks | None = None
    through: (
        Annotated[tuple[fields.PointName, ...], BeforeValidator(_through), fields.OrShort(fields.NAME_FORM)] | None
    ) = None
    direction: fields.AngleValue | None = None
    point: fields.PointName | None = None
    angle: fields.AngleValue | None = None

    @model_validator(mode="after")
    def _fitting(self) -> Joint:
        foreign = {"prismatic": (), "slot": ("angle",), "fixed": ("through", "direction")}
        for key in self.given(*foreign[self.kind]):
            raise failure(f"a {self.kind} joint has no {key!r}")
        if self.through is not None and len(self.through) == 2 and self.direction is not None:
            raise failure("'through' two points gives the direction; leave 'direction' out")
        return self


class Drive(fields.Model):
    """A driven coordinate: exactly one of angle, length and slide."""

    one_of = ("a drive is one of angle: link, length: leg, slide: joint", "angle", "length", "slide")
    angle: fields.LinkName | None = None
    from_: fields.LinkName | None = Field(None, alias="from")
    length: fields.LinkName | None = None
    slide: fields.JointName | None = None

    @model_validator(mode="after")
    def _of_an_angle(self) -> Drive:
        if self.from_ is not None and self.angle is None:
            raise failure("'from' belongs to an angle")
        return self


class Measure(fields.Model):
    """A named quantity: exactly one of angle, distance and expression."""

    bare, short = "expression", (fields.NAME_FORM,)
    one_of = (
        "a measure is one of {angle: [a, b]}, {distance: [P, Q]} or an expression over coordinates and parameters",
        "angle",
        "distance",
        "expression",
    )
    angle: TwoLinks | None = None
    distance: TwoPoints | None = None
    expression: str | None = None


class Limit(fields.Model):
    """Bounds of a distance, a drive, an angle or a measure."""

    one_of = (
        "a limit is one of distance: [P, Q], drive: name, angle: [a, b], measure: name",
        "distance",
        "drive",
        "angle",
        "measure",
    )
    distance: TwoPoints | None = None
    drive: fields.DriveName | None = None
    angle: TwoLinks | None = None
    measure: fields.MeasureName | None = None
    min: fields.AnyValue | None = None
    max: fields.AnyValue | None = None

    @model_validator(mode="after")
    def _bounded(self) -> Limit:
        if not self.given("min", "max"):
            raise failure("a limit needs 'min', 'max' or both")
        return self


Wanted = Expression | tuple[tuple[float, ...], ...] | str
"""A target as it was written: an expression (a number is one without names), rows, or the name of a file."""


def _target(raw: Any, context: Context) -> Wanted:
    if isinstance(raw, dict) and list(raw) == ["file"] and isinstance(raw["file"], str):
        return raw["file"]
    if isinstance(raw, str) and raw.lower().endswith(FILES):
        return raw
    if raw is None or isinstance(raw, dict):
        raise failure(f"expected {TARGET_FORMS}, not {shown(raw)}")
    if isinstance(raw, list):
        rule = "every row holds the same one, two or three numbers"
        return read_rows(raw, context, 3, rule, "an empty list: no target")
    return read_expression(raw, context)


TargetValue = Annotated[
    Wanted, fields.Read(_target, {"type": ["number", "string", "array", "object"], "description": TARGET_FORMS})
]


class MechanismSection(fields.Model):
    """What the study says about the mechanism."""

    parameters: dict[str, fields.AnyValue] = Field(default_factory=dict)
    links: dict[fields.LinkName, Link]
    joints: dict[fields.JointName, Joint] = Field(default_factory=dict)
    drives: Annotated[
        dict[fields.AnyName, Drive | None], BeforeValidator(names_to_mapping), fields.OrShort(fields.NAMES_FORM)
    ] = Field(default_factory=dict)
    branch: Annotated[str, fields.choice(("side", "follow"))] = "side"
    sketch: dict[fields.PointName, Point] = Field(default_factory=dict)
    measures: dict[fields.MeasureName, Measure] = Field(default_factory=dict)
    limits: tuple[Limit, ...] = ()
    targets: dict[fields.CoordinateName, TargetValue] = Field(default_factory=dict)

    # What the names mean, whether or not the rest of the section is right.

    def points_of(self, link: str) -> list[str]:
        """Names of a link's points, its ends first."""
        section = self.links.get(link)
        if section is None:
            return []
        return [*(end for end in (section.from_, section.to) if end is not None), *section.points]

    @cached_property
    def owners(self) -> Mapping[str, list[str]]:
        """Every point with the links that have it, in the order of the study."""
        found: dict[str, list[str]] = {}
        for link in self.links:
            for point in self.points_of(link):
                found.setdefault(point, []).append(link)
        return found

    def coordinates_of(self, name: str) -> tuple[str, ...]:
        """The coordinates of a point; of what is no point, its name."""
        return (f"{name}.x", f"{name}.y") if name in self.owners else (name,)

    @cached_property
    def moving(self) -> list[str]:
        """Links other than the ground."""
        return [name for name in self.links if name != GROUND]

    @cached_property
    def legs(self) -> list[str]:
        """Telescopic links."""
        return [name for name, link in self.links.items() if link.telescopic]

    @cached_property
    def slides(self) -> list[str]:
        """Joints whose displacement is a coordinate."""
        return [name for name, joint in self.joints.items() if joint.fixed is None]

    def driven(self, drive: str) -> tuple[Literal["angle", "length", "slide"], str]:
        """What a drive changes, and of which link, leg or joint."""
        section = self.drives[drive]
        if section is not None:
            return section.kind, getattr(section, section.kind)
        return "slide" if drive in self.slides else "length" if drive in self.legs else "angle", drive

    @cached_property
    def driven_kinds(self) -> Mapping[str, Quantity]:
        """Drives and the kind of each."""
        return {name: "angle" if self.driven(name)[0] == "angle" else "length" for name in self.drives}

    @cached_property
    def measured_kinds(self) -> Mapping[str, Quantity]:
        """Measures and the kind of each."""
        quantities: dict[str, Quantity] = {"angle": "angle", "distance": "length", "expression": "none"}
        return {name: quantities[measure.kind] for name, measure in self.measures.items()}

    @cached_property
    def coordinates(self) -> Mapping[str, Quantity]:
        """Every coordinate and its kind, measures last."""
        found: dict[str, Quantity] = dict(self.driven_kinds)
        for point in self.owners:
            found[f"{point}.x"] = found[f"{point}.y"] = "length"
        for link in self.moving:
            found[f"{link}.angle"] = "angle"
        for leg in self.legs:
            found[f"{leg}.length"] = "length"
        for slide in self.slides:
            found[f"{slide}.slide"] = "length"
        return found | dict(self.measured_kinds)


def _unit_of(kind: str) -> fields.Read:
    def read(raw: Any, context: Context) -> str:
        if not isinstance(raw, str):
            raise failure(f"expected a text, not {shown(raw)}")
        try:
            check_unit(kind, raw)
        except QuantityError as error:
            raise failure(str(error)) from None
        return raw

    return fields.Read(read, fields.NAME_FORM)


class UnitsSection(fields.Model):
    """Units that bare numbers mean."""

    length: Annotated[str, _unit_of("length")] = "mm"
    angle: Annotated[str, _unit_of("angle")] = "deg"
    time: Annotated[str, _unit_of("time")] = "s"
    force: Annotated[str, _unit_of("force")] = "N"
