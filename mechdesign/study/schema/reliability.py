"""The reliability section of the study file."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, NamedTuple, Protocol

from pydantic import BeforeValidator, Field, ValidationInfo, model_validator

from mechdesign.study.schema.methods import METHODS
from mechdesign.study.schema.poses import MotionSection
from mechdesign.study.text import fields
from mechdesign.study.text.numbers import Context, failure, read_number, shown

DISTRIBUTIONS = ("normal", "truncated_normal", "uniform", "triangular", "lognormal")
PIN_MODELS = ("normal", "normal_in_disc", "uniform", "contact")
DEFAULT_METHODS = ("analytic", "monte_carlo")
# Components of a random load, and their kinds of quantity.
LOADS = {"load.fx": "force", "load.fy": "force", "load.mz": "moment"}
# What the names of errors of positions, velocities and accelerations end in.
SUFFIXES = ("", "_velocity", "_acceleration")


def split_order(name: str, known: Callable[[str], bool]) -> tuple[str, int]:
    """The coordinate (or point) that a name is about, and whether it means the position, velocity or acceleration."""
    for order, suffix in enumerate(SUFFIXES):
        if not known(name) and name.endswith(suffix) and known(name.removesuffix(suffix)):
            return name.removesuffix(suffix), order
    return name, 0


def _tolerance(raw: Any, context: Context) -> tuple[float, float]:
    """A half-width, or the lowest and the highest deviation."""
    if not isinstance(raw, list):
        half = read_number(raw, context).nominal
        if half < 0:
            raise failure(f"must be at least 0, not {half:g}; two bounds are written [-0.1, 0.3]")
        return -half, half
    if len(raw) != 2:
        raise failure(f"expected a half-width or two bounds such as [-0.1, 0.3], not {shown(raw)}")
    low, high = (read_number(each, context).nominal for each in raw)
    if low > high:
        raise failure(f"the lowest deviation {low:g} is above the highest {high:g}")
    return low, high


_TOLERANCE = {
    "anyOf": [fields.NUMBER_FORM, fields.PAIR_FORM],
    "description": "a half-width, or the lowest and highest deviation",
}
Tolerance = Annotated[tuple[float, float], fields.Read(_tolerance, _TOLERANCE)]


class Spread(Protocol):
    """How far something varies, and how."""

    @property
    def tolerance(self) -> tuple[float, float] | None:
        """Lowest and highest deviation."""

    @property
    def sigma(self) -> float | None:
        """Standard deviation, where there is no tolerance."""

    @property
    def distribution(self) -> str:
        """One of `DISTRIBUTIONS`."""


class Dimension(fields.Model):
    """A dimension's variation: nominal +- tolerance, or its standard deviation.

    Of a tolerance ``normal`` makes three standard deviations, ``truncated_normal`` the same and cuts there; ``uniform``
    fills it, ``triangular`` peaks at the nominal value, ``lognormal`` has the mean and the deviation of ``normal``.
    """

    bare, short = "tolerance", (fields.NUMBER_FORM, fields.PAIR_FORM)
    one_of = ("a dimension needs either 'tolerance' or 'sigma'", "tolerance", "sigma")
    tolerance: Tolerance | None = None
    sigma: fields.NonNegative | None = None
    distribution: Annotated[str, fields.Choice(DISTRIBUTIONS)] = "normal"


class PinModel(fields.Model):
    """How a pin lies in its hole, for each method."""

    short = ({"enum": list(PIN_MODELS)},)
    analytic: Annotated[str, fields.Choice(PIN_MODELS)] = "normal"
    monte_carlo: Annotated[str, fields.Choice(PIN_MODELS)] = "normal"

    @model_validator(mode="before")
    @classmethod
    def _long_form(cls, raw: Any) -> Any:
        return {"analytic": raw, "monte_carlo": raw} if isinstance(raw, str) else raw


class Clearance(fields.Model):
    """The clearance of a pin joint; exactly one of radial and diametral, to which the tolerance belongs.

    The pin moves in `link` (left out, the last link of the joint that no output is said to be of); the coordinates of
    its point are those of the other links. An output or a limit may name the link that it is about: ``coupler.P.x``.
    """

    one_of = ("a clearance needs either 'radial' or 'diametral'", "radial", "diametral")
    radial: fields.NonNegativeLength | None = None
    diametral: fields.NonNegativeLength | None = None
    tolerance: Tolerance = (0.0, 0.0)
    distribution: Annotated[str, fields.Choice(DISTRIBUTIONS)] = "normal"
    pin: PinModel = PinModel()
    link: fields.LinkName | None = None
    effect: Annotated[str, fields.Choice(("offset", "length"))] = "offset"

    @property
    def radius(self) -> float:
        """Mean radial clearance, half the difference of the diameters."""
        return self.radial if self.radial is not None else 0.5 * (self.diametral or 0.0)

    @property
    def radius_spread(self) -> Dimension | None:
        """Variation of the radial clearance; None where it has none."""
        if self.tolerance == (0.0, 0.0):
            return None
        factor = 1.0 if self.radial is not None else 0.5
        low, high = (factor * end for end in self.tolerance)
        return Dimension.model_construct(tolerance=(low, high), sigma=None, distribution=self.distribution)


class ErrorLimit(fields.Model):
    """What an error may be: within [min, max], or (of a point) within a radius."""

    short = (fields.NUMBER_FORM,)
    min: fields.Number | None = None
    max: fields.Number | None = None
    radius: fields.NonNegative | None = None

    @model_validator(mode="before")
    @classmethod
    def _long_form(cls, raw: Any, info: ValidationInfo) -> Any:
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


class Precision(fields.Model):
    """How precise a failure probability is wanted.

    ``relative`` is its coefficient of variation, standard error over value: half of its 99.7 % interval is about three
    times that. ``half_width`` is half the interval itself.
    """

    bare, short = "relative", (fields.NUMBER_FORM,)
    one_of = (
        "give either 'relative', a coefficient of variation, or 'half_width', half the 99.7 % interval",
        "relative",
        "half_width",
    )
    relative: fields.Positive | None = None
    half_width: fields.Positive | None = None


class Cost(fields.Model):
    """What a tolerance T costs: a/T^exponent.

    T is as the study gives it, in its units: half the width of the tolerance, sigma, or the mean radial clearance.
    """

    bare, short = "a", (fields.NUMBER_FORM,)
    a: fields.Positive = 1.0
    exponent: fields.Positive = 1.0


class Allocate(fields.Model):
    """The cheapest tolerances that reach a reliability at every pose, each by itself (not over a cycle).

    All dimensions are allocated, random loads and clearances (radius and its tolerance together) where `cost` names
    them; what it does not name costs 1/T.
    """

    reliability: fields.Positive
    cost: dict[str, Cost] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _possible(self) -> Allocate:
        if not 0.0 < self.reliability < 1.0:
            raise failure(f"a reliability lies between 0 and 1, not {self.reliability:g}")
        return self


class Correlated(NamedTuple):
    """Two dimensions and the correlation coefficient of their deviations."""

    one: str
    other: str
    coefficient: float


def _correlation(raw: Any, context: Context) -> Correlated:
    if not isinstance(raw, list) or len(raw) != 3 or not all(isinstance(name, str) for name in raw[:2]):
        raise failure(f"a correlation is [name, name, coefficient], for example [r1, r2, 0.5], not {shown(raw)}")
    coefficient = read_number(raw[2], context, "none").nominal
    if abs(coefficient) >= 1.0:
        raise failure(f"a correlation lies between -1 and 1, not {coefficient:g}; what is the same is one parameter")
    if raw[0] == raw[1]:
        raise failure(f"{raw[0]!r} is correlated with itself")
    return Correlated(raw[0], raw[1], coefficient)


_CORRELATION = {
    "type": "array",
    "prefixItems": [fields.NAME_FORM, fields.NAME_FORM, fields.NUMBER_FORM],
    "minItems": 3,
    "maxItems": 3,
}


class ReliabilitySection(MotionSection):
    """How precise is it when it is really made?"""

    dimensions: dict[str, Dimension] = Field(default_factory=dict)
    clearances: dict[str, Clearance] = Field(default_factory=dict)
    correlation: tuple[Annotated[Correlated, fields.Read(_correlation, _CORRELATION)], ...] = ()
    limits: dict[fields.CoordinateName, ErrorLimit] = Field(default_factory=dict)
    load: tuple[fields.Number, ...] | None = None
    methods: Annotated[
        tuple[Annotated[str, fields.Choice(METHODS)], ...],
        BeforeValidator(fields.as_list),
        fields.OrOne(),
    ] = DEFAULT_METHODS
    samples: Annotated[int, fields.Whole(2, 10**15)] = 40_000
    precision: Precision | None = None
    sobol: Annotated[int, fields.Whole(0, 10**9)] | None = None
    allocate: Allocate | None = None
