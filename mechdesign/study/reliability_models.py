"""The reliability section of the study file."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, GetJsonSchemaHandler, ValidationInfo, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from mechdesign.study.lists import CoordinateNames, one_or_many
from mechdesign.study.models import Model
from mechdesign.study.numbers import (
    NUMBER_FORM,
    Choice,
    Context,
    CoordinateName,
    LinkName,
    NonNegative,
    NonNegativeLength,
    Number,
    OrShort,
    Unavailable,
    Whole,
    failure,
    or_short,
    read_number,
)
from mechdesign.study.pose_models import PoseSection

DISTRIBUTIONS = ("normal", "uniform")
PIN_MODELS = ("normal", "normal_in_disc", "uniform")
METHODS = ("analytic", "monte_carlo")


class Dimension(Model):
    """A dimension's variation: nominal +- tolerance, or its standard deviation."""

    tolerance: NonNegative | None = None
    sigma: NonNegative | None = None
    distribution: Annotated[str, Choice(DISTRIBUTIONS)] = "normal"

    @model_validator(mode="before")
    @classmethod
    def _bare(cls, raw: Any) -> Any:
        if isinstance(raw, dict) and isinstance(raw.get("tolerance"), list):
            raise failure("a tolerance with two bounds is not available in this version; give the half-width")
        return {"tolerance": raw} if isinstance(raw, int | float | str) and not isinstance(raw, bool) else raw

    @model_validator(mode="after")
    def _one_width(self) -> Dimension:
        if (self.tolerance is None) == (self.sigma is None):
            raise failure("a dimension needs either 'tolerance' or 'sigma'")
        return self

    @property
    def standard_deviation(self) -> float:
        """Sigma of the distribution: tolerance/3 (normal), tolerance/sqrt(3) (uniform)  [S2]."""
        if self.sigma is not None:
            return self.sigma
        assert self.tolerance is not None
        return self.tolerance / (3.0 if self.distribution == "normal" else 3.0**0.5)

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return or_short(schema, handler, NUMBER_FORM)


class PinModel(Model):
    """How a pin lies in its hole, for each method."""

    analytic: Annotated[str, Choice(PIN_MODELS)] = "normal"
    monte_carlo: Annotated[str, Choice(PIN_MODELS)] = "normal"

    @model_validator(mode="before")
    @classmethod
    def _both(cls, raw: Any) -> Any:
        return {"analytic": raw, "monte_carlo": raw} if isinstance(raw, str) else raw

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return or_short(schema, handler, {"enum": list(PIN_MODELS)})


class Clearance(Model):
    """The clearance of a pin joint; exactly one of radial and diametral, to which tolerance and sigma belong."""

    radial: NonNegativeLength | None = None
    diametral: NonNegativeLength | None = None
    tolerance: NonNegativeLength = 0.0
    distribution: Annotated[str, Choice(DISTRIBUTIONS)] = "normal"
    pin: PinModel = PinModel()
    link: LinkName | None = None
    effect: Annotated[str, Choice(("offset", "length"))] = "offset"

    @model_validator(mode="after")
    def _one_radius(self) -> Clearance:
        if (self.radial is None) == (self.diametral is None):
            raise failure("a clearance needs either 'radial' or 'diametral'")
        return self

    @property
    def radius(self) -> float:
        """Mean radial clearance, half the difference of the diameters."""
        return self.radial if self.radial is not None else 0.5 * (self.diametral or 0.0)

    @property
    def radius_tolerance(self) -> float:
        """Tolerance of the radial clearance."""
        return self.tolerance if self.radial is not None else 0.5 * self.tolerance


class ErrorLimit(Model):
    """What an error may be: within [min, max], or (of a point) within a radius."""

    min: Number | None = None
    max: Number | None = None
    radius: NonNegativeLength | None = None

    @model_validator(mode="before")
    @classmethod
    def _bare(cls, raw: Any, info: ValidationInfo) -> Any:
        if not isinstance(raw, int | float | str) or isinstance(raw, bool):
            return raw
        size = read_number(raw, info.context or Context()).nominal
        if size < 0:
            raise failure(f"must be at least 0, not {size:g}")
        return {"min": -size, "max": size}

    @model_validator(mode="after")
    def _some(self) -> ErrorLimit:
        if self.radius is None and self.min is None and self.max is None:
            raise failure("a limit needs a number, 'min', 'max' or 'radius'")
        if self.radius is not None and (self.min is not None or self.max is not None):
            raise failure("'radius' excludes 'min' and 'max'")
        if self.min is not None and self.max is not None and self.max < self.min:
            raise failure(f"the maximum {self.max:g} is below the minimum {self.min:g}")
        return self

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return or_short(schema, handler, NUMBER_FORM)


class ReliabilitySection(PoseSection):
    """How precise is it when it is really made?"""

    dimensions: dict[str, Dimension] = Field(default_factory=dict)
    clearances: dict[str, Clearance] = Field(default_factory=dict)
    outputs: CoordinateNames | None = None
    rates: dict[CoordinateName, Number] = Field(default_factory=dict)
    accelerations: dict[CoordinateName, Number] = Field(default_factory=dict)
    limits: dict[CoordinateName, ErrorLimit] = Field(default_factory=dict)
    methods: Annotated[
        tuple[
            Annotated[
                str, Choice(METHODS, ("second_order", "quasi_monte_carlo", "form", "importance_sampling", "auto"))
            ],
            ...,
        ],
        BeforeValidator(one_or_many),
        OrShort(({"enum": list(METHODS)},)),
    ] = METHODS
    samples: Annotated[int, Whole(2, 10**15)] = 40_000
    precision: Unavailable = None
    correlation: Unavailable = None
    allocate: Unavailable = None
