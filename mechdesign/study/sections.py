"""The questions of the study file as pydantic models; attributes bear the names of the study format.

Numbers are floats in the study's units. Keys named ``from`` are the attribute ``from_``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, GetJsonSchemaHandler, ValidationInfo, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from mechdesign.study.models import MechanismSection, Model, UnitsSection
from mechdesign.study.numbers import (
    NAME_FORM,
    NUMBER_FORM,
    Angle,
    AnyName,
    Bound,
    Choice,
    Context,
    CoordinateName,
    Force,
    Length,
    LinkName,
    Moment,
    NonNegative,
    NonNegativeAngle,
    NonNegativeLength,
    Number,
    OrShort,
    PointName,
    Positive,
    PositiveArea,
    PositiveInertia,
    PositiveLength,
    PositiveNumber,
    PositiveStress,
    Pure,
    Unavailable,
    Whole,
    failure,
    or_short,
    read_number,
    suggestion,
)
from mechdesign.study.pose_models import PoseSection

DISTRIBUTIONS = ("normal", "uniform")
PIN_MODELS = ("normal", "normal_in_disc", "uniform")
METHODS = ("analytic", "monte_carlo")
COMMANDS = ("kinematics", "workspace", "optimize", "reliability", "stiffness")


def _one_or_many(raw: Any) -> Any:
    return [raw] if isinstance(raw, str) else raw


def _as_list(raw: Any) -> list[Any]:
    return raw if isinstance(raw, list) else [] if raw is None else [raw]


CoordinateNames = Annotated[tuple[CoordinateName, ...], BeforeValidator(_one_or_many), OrShort((NAME_FORM,))]


Numbers = Annotated[tuple[Number, ...], BeforeValidator(_as_list), OrShort((NUMBER_FORM,))]
Weights = Annotated[tuple[Pure, ...], OrShort(({"type": "object", "additionalProperties": NUMBER_FORM},))]


class Load(Model):
    """A force at a point, or a moment on a link."""

    at: PointName | None = None
    force: tuple[Force, Force] | None = None
    link: LinkName | None = None
    moment: Moment | None = None

    @model_validator(mode="after")
    def _whole(self) -> Load:
        if (self.at is None) != (self.force is None) or (self.moment is not None and self.link is None):
            raise failure("a load is {at: point, force: [fx, fy]} or {link: name, moment: m}")
        if self.force is None and self.moment is None:
            raise failure("a load needs a force or a moment")
        return self


class KinematicsSection(PoseSection):
    """How does it move?"""

    rates: dict[CoordinateName, Number] = Field(default_factory=dict)
    accelerations: dict[CoordinateName, Number] = Field(default_factory=dict)
    outputs: CoordinateNames | None = None
    loads: tuple[Load, ...] = ()
    characteristic_length: PositiveLength | None = None


class Scan(Model):
    """Rays about a point; angles in the study's unit."""

    about: tuple[Length, Length] | None = None
    from_: Angle | None = Field(None, alias="from")
    to: Angle | None = None
    rays: Annotated[int, Whole(2, 1_000_000)] | None = None


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


class WorkspaceSection(Model):
    """Where can it work?"""

    point: PointName
    at: dict[CoordinateName, Annotated[tuple[Number, ...], BeforeValidator(_as_list), OrShort((NUMBER_FORM,))]] = Field(
        default_factory=dict
    )
    scan: Scan = Field(default_factory=lambda: Scan.model_validate({}))
    integrate: Integrate = Integrate()
    margin: NonNegativeAngle = 0.0
    assembly: Annotated[str, Choice(("same", "any"))] = "same"
    characteristic_length: PositiveLength | None = None


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
        goals = [goal for key in ("maximize", "minimize") for goal in _as_list(raw.get(key))]
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
        BeforeValidator(_one_or_many),
        OrShort(({"enum": list(METHODS)},)),
    ] = METHODS
    samples: Annotated[int, Whole(2, 10**15)] = 40_000
    precision: Unavailable = None
    correlation: Unavailable = None
    allocate: Unavailable = None


class Profile(Model):
    """A cross-section: width and height (in the plane), or area and inertia."""

    E: PositiveStress
    G: PositiveStress | None = None
    width: PositiveLength | None = None
    height: PositiveLength | None = None
    area: PositiveArea | None = None
    inertia: PositiveInertia | None = None
    shear: bool = False

    @model_validator(mode="after")
    def _one_form(self) -> Profile:
        rectangle = self.width is not None and self.height is not None
        general = self.area is not None and self.inertia is not None
        given = sum(getattr(self, key) is not None for key in ("width", "height", "area", "inertia"))
        if rectangle == general or given != 2:
            raise failure("a section is {E, width, height} or {E, area, inertia}")
        if self.shear and self.G is None:
            raise failure("'shear: true' needs the shear modulus 'G'")
        return self


class StiffnessSection(PoseSection):
    """How stiff is it?"""

    link: LinkName | None = None
    at: PointName
    sections: dict[str, Profile] = Field(default_factory=dict)
    elastic: dict[LinkName, str] = Field(default_factory=dict)
    actuators: dict[AnyName, PositiveNumber] = Field(default_factory=dict)
    loads: tuple[tuple[Number, ...], ...] = ()
    characteristic_length: PositiveLength | None = None


class Requirement(Condition):
    """A gate: the worst row of a result against its bounds."""


class StudyFile(Model):
    """The whole study file."""

    name: str | None = None
    units: UnitsSection = UnitsSection()
    seed: Annotated[int, Whole(0)] = 0
    mechanism: MechanismSection
    kinematics: KinematicsSection | None = None
    workspace: WorkspaceSection | None = None
    optimize: OptimizeSection | None = None
    reliability: ReliabilitySection | None = None
    stiffness: StiffnessSection | None = None
    requirements: tuple[Requirement, ...] = ()
