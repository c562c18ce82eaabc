"""The stiffness section of the study file."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from mechdesign.study.build.section import Model
from mechdesign.study.schema.lists import as_list
from mechdesign.study.schema.poses import PoseSection
from mechdesign.study.text.numbers import (
    NUMBER_FORM,
    Angle,
    AnyName,
    Context,
    LinkName,
    Number,
    PointName,
    Positive,
    PositiveArea,
    PositiveInertia,
    PositiveLength,
    PositiveNumber,
    PositiveStress,
    failure,
    or_short,
    read_number,
)

_ELASTIC = (
    "The section of each link that bends; links not named are rigid. A link given by its ends is a beam from the first "
    "to the second, and its other points are brackets: rigid from their foot on the beam, beyond an end from that end. "
    "A link given by its points alone is beams along them in the order listed. A slide on a link rides on its beams at "
    "the foot of its current place. A telescopic leg is a cantilever of its current length from its first end."
)
# Keys of each kind of section.
_FORMS = (("width", "height"), ("diameter",), ("diameter", "inner_diameter"), ("area", "inertia"))


class Profile(Model):
    """A cross-section: a rectangle (its height lies in the plane), a bar or a tube, or its area and inertia.

    ``shear: true`` adds the compliance of shear by Timoshenko's theory, with the factor of the section's form (Cowper
    1966, with Poisson's ratio 0: 5/6 of a rectangle, 6/7 of a round bar, 1/2 of a thin tube), or a given one.
    """

    E: PositiveStress
    G: PositiveStress | None = None
    width: PositiveLength | None = None
    height: PositiveLength | None = None
    diameter: PositiveLength | None = None
    inner_diameter: PositiveLength | None = None
    area: PositiveArea | None = None
    inertia: PositiveInertia | None = None
    shear: bool = False
    shear_factor: Positive | None = None

    @model_validator(mode="after")
    def _one_form(self) -> Profile:
        keys = dict.fromkeys(key for form in _FORMS for key in form)
        if tuple(key for key in keys if getattr(self, key) is not None) not in _FORMS:
            raise failure(
                "a section is {E, width, height}, {E, diameter}, {E, diameter, inner_diameter} or {E, area, inertia}"
            )
        if self.inner_diameter is not None and self.diameter is not None and self.inner_diameter >= self.diameter:
            raise failure(f"the inner diameter {self.inner_diameter:g} is not below the outer one {self.diameter:g}")
        if self.shear and self.G is None:
            raise failure("'shear: true' needs the shear modulus 'G'")
        if self.shear_factor is not None and not self.shear:
            raise failure("a 'shear_factor' counts with 'shear: true' only")
        return self

    @property
    def extent(self) -> tuple[float, float, float]:
        """Area, second moment of area for bending in the plane, and shear factor."""
        if self.width is not None and self.height is not None:
            area, inertia, factor = self.width * self.height, self.width * self.height**3 / 12, 5 / 6
        elif self.diameter is not None:
            m = (self.inner_diameter or 0.0) / self.diameter
            area = math.pi / 4 * self.diameter**2 * (1 - m * m)
            inertia = math.pi / 64 * self.diameter**4 * (1 - m**4)
            factor = 6 * (1 + m * m) ** 2 / (7 * (1 + m * m) ** 2 + 20 * m * m)
        else:
            area, inertia, factor = self.area or 0.0, self.inertia or 0.0, 5 / 6
        return area, inertia, self.shear_factor or factor


class Bearing(Model):
    """Stiffness of a joint itself: across, and of a slide also against turning; what is not given is rigid."""

    radial: PositiveNumber | None = None
    moment: PositiveNumber | None = None

    @model_validator(mode="before")
    @classmethod
    def _bare(cls, raw: Any) -> Any:
        return {"radial": raw} if isinstance(raw, int | float | str) and not isinstance(raw, bool) else raw

    @model_validator(mode="after")
    def _some(self) -> Bearing:
        if self.radial is None and self.moment is None:
            raise failure("a bearing has a 'radial' stiffness, and that of a slide a 'moment' stiffness too")
        return self

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return or_short(schema, handler, NUMBER_FORM)


class _Series:
    """Annotation of a stiffness: a number, or a list of those in series, such as motor, gear and belt."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(self._validate)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return {"anyOf": [NUMBER_FORM, {"type": "array", "items": NUMBER_FORM, "minItems": 1}],
                "description": "a stiffness, or those of what is in series"}  # fmt: skip

    @staticmethod
    def _validate(raw: Any, info: ValidationInfo) -> float:
        parts = [read_number(each, info.context or Context()).nominal for each in as_list(raw)]
        if not parts:
            raise failure("expected a stiffness, or a list of those in series")
        for part in parts:
            if part <= 0:
                raise failure(f"must be positive, not {part:g}")
        return 1.0 / sum(1.0 / part for part in parts)


class StiffnessSection(PoseSection):
    """How stiff is it?"""

    link: LinkName | None = None
    at: PointName = Field(description="the point whose stiffness is asked")
    sections: dict[str, Profile] = Field(default_factory=dict)
    elastic: dict[LinkName, str] = Field(default_factory=dict, description=_ELASTIC)
    actuators: dict[AnyName, Annotated[float, _Series()]] = Field(default_factory=dict)
    bearings: dict[AnyName, Bearing] = Field(default_factory=dict)
    direction: Angle | None = None
    loads: tuple[tuple[Number, ...], ...] = ()
    characteristic_length: PositiveLength | None = None
