"""How parts vary, as the study file gives it: dimensions by tolerances, classes or measured values; clearances."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from mechdesign.errors import StudyError
from mechdesign.numerics.arrays import Floats
from mechdesign.study.schema.iso_tolerances import (
    ToleranceClassError,
    angle_deviations,
    deviations,
    fit_deviations,
    is_class,
)
from mechdesign.study.schema.paths import read_column
from mechdesign.study.text import fields
from mechdesign.study.text.fields import Context, failure, read_number, shown
from mechdesign.study.text.units import QuantityError

DISTRIBUTIONS = ("normal", "truncated_normal", "uniform", "triangular", "lognormal")
BETA = "beta"
# Least number of measured values.
MIN_MEASURED = 10
PIN_MODELS = ("normal", "normal_in_disc", "uniform", "contact")
# A lowest clearance so little below zero counts as zero.
CLEARANCE_ROUNDING = 1e-9


def _millimetre(context: Context, text: str) -> float:
    """A millimetre in the study's unit of length, for a class of an ISO standard."""
    try:
        return context.units.convert("1 mm")
    except QuantityError:
        raise failure(f"{text!r} is of sizes in mm, and this study's lengths are dimensionless") from None


@dataclass(frozen=True)
class ToleranceClass:
    """A tolerance class as it is written, a millimetre and a degree as the study counts them.

    `ends`, its lowest and highest deviation, follow from the size of what it is of.
    """

    text: str
    millimetre: float
    degree: float
    ends: tuple[float, float] = (0.0, 0.0)

    def of_length(self, size: float) -> tuple[float, float]:
        """Lowest and highest deviation of a length; raises as `deviations`."""
        low, high = deviations(self.text, abs(size) / self.millimetre)
        return low * self.millimetre, high * self.millimetre

    def of_angle(self, leg: float) -> tuple[float, float]:
        """Lowest and highest deviation of an angle whose shorter leg is so long; raises as `angle_deviations`."""
        low, high = angle_deviations(self.text, leg / self.millimetre)
        return low * self.degree, high * self.degree


def _tolerance_or_class(raw: Any, context: Context) -> tuple[float, float] | ToleranceClass:
    """As `_tolerance`, or a tolerance class; a parameter of its name counts first."""
    if isinstance(raw, str) and is_class(raw) and raw not in context.parameters:
        degree = math.pi / 180.0 / context.units.angle_factor
        return ToleranceClass(raw, _millimetre(context, raw), degree)
    return _tolerance(raw, context)


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
_CLASSED = {**_TOLERANCE, "description": "a half-width, the lowest and highest deviation, or a class: js9, ISO 2768-m"}


class Fit(NamedTuple):
    """A fit as it is written, its mean diametral clearance, and half the tolerances of its hole and of its shaft."""

    text: str
    diametral: float
    hole: float
    shaft: float


def _fit(raw: Any, context: Context) -> Fit:
    if not isinstance(raw, str):
        raise failure(f"expected a fit such as 20 H7/g6, not {shown(raw)}")
    millimetre = _millimetre(context, raw)
    try:
        _, hole, shaft = fit_deviations(raw)
    except ToleranceClassError as error:
        raise failure(str(error)) from None
    least, most = hole[0] - shaft[1], hole[1] - shaft[0]
    if least < -CLEARANCE_ROUNDING:
        kind = "an interference" if most <= CLEARANCE_ROUNDING else "a transition"
        raise failure(
            f"{raw} is {kind} fit, from {least:+.4g} to {most:+.4g} mm, and no clearance is negative; a pin that is "
            "pressed in has none: leave it out, or take a clearance fit such as H7/g6 or H7/h6"
        )
    halves = [0.5 * (high - low) * millimetre for low, high in (hole, shaft)]
    return Fit(raw, 0.5 * (least + most) * millimetre, *halves)


_FIT = {**fields.NAME_FORM, "description": "such as 20 H7/g6"}


class Dimension(fields.Model):
    """A dimension's variation: nominal +- tolerance, its standard deviation, or measured values.

    Of a tolerance ``normal`` makes three standard deviations, ``truncated_normal`` the same and cuts there; ``uniform``
    fills it, ``triangular`` peaks at the nominal value, ``lognormal`` has the mean and the deviation of ``normal``,
    ``beta`` has two shape parameters between its ends. A class, ``h7`` of ISO 286-1 or ``ISO 2768-m``, gives the
    deviations for the dimension's nominal size; for an angle by the length of its shorter `leg`.

    `measured` is a file of measured values of the dimension, in the study's units: one a line, or a `column`. What they
    deviate from is the dimension's own nominal value (of a drive or a load 0), or `nominal`. What is sampled is drawn
    from their interpolated distribution, beyond whose ends nothing lies.
    """

    bare, short = "tolerance", (fields.NUMBER_FORM, fields.PAIR_FORM)
    one_of = ("a dimension needs either 'tolerance', 'sigma' or 'measured'", "tolerance", "sigma", "measured")
    tolerance: Annotated[tuple[float, float] | ToleranceClass, fields.Read(_tolerance_or_class, _CLASSED)] | None = None
    sigma: fields.NonNegative | None = None
    distribution: Annotated[str, fields.choice((*DISTRIBUTIONS, BETA))] = "normal"
    shape: (
        Annotated[tuple[fields.Positive, fields.Positive], fields.pair_of("two shape parameters such as [2, 5]")] | None
    ) = Field(None, description="shape parameters of a beta distribution over the tolerance")
    leg: fields.PositiveLength | None = None
    measured: str | None = Field(None, description="a file of measured values, one a line or a column")
    column: str | None = Field(None, description="the column of measured values, by its name in the first line")
    nominal: fields.Number | None = Field(None, description="what measured values deviate from; 0 of deviations")

    @model_validator(mode="after")
    def _fitting(self) -> Self:
        if (self.distribution == BETA) != (self.shape is not None):
            raise failure("'distribution: beta' and its 'shape', such as [2, 5], go together")
        if self.shape is not None and self.tolerance is None:
            raise failure("a beta distribution lies between two ends: give 'tolerance'")
        if self.measured is not None and "distribution" in self.model_fields_set:
            raise failure("measured values are a distribution of their own: leave 'distribution' out")
        if self.measured is None and (spare := self.given("column", "nominal")):
            raise failure(f"{spare[0]!r} goes with 'measured', the name of a file")
        return self

    @property
    def ends(self) -> tuple[float, float]:
        """Lowest and highest deviation of the tolerance; none where sigma is given."""
        return self.tolerance.ends if isinstance(self.tolerance, ToleranceClass) else self.tolerance or (0.0, 0.0)

    def deviations(self, nominal: float, folder: Path) -> Floats:
        """Measured values less what they deviate from, in the study's units, by default `nominal`.

        Raises
        ------
        StudyError
            Where the file has no such numbers, too few of them, or only one and the same.
        """
        assert self.measured is not None
        file = folder / self.measured
        values = read_column(file, self.column)
        if len(values) < MIN_MEASURED:
            raise StudyError(f"{file}: {len(values)} measured values are too few: give {MIN_MEASURED} or more")
        if np.ptp(values) == 0:
            raise StudyError(f"{file}: all {len(values)} measured values are {values[0]:g}: nothing varies")
        if self.nominal is None and np.abs(values).max() < 0.5 * abs(nominal):
            raise StudyError(
                f"{file}: the measured values lie between {values.min():g} and {values.max():g}, and the nominal value "
                f"is {nominal:g}; where they are deviations, say 'nominal: 0'"
            )
        return np.asarray(values - (nominal if self.nominal is None else self.nominal))


class PinModel(fields.Model):
    """How a pin lies in its hole, for each method."""

    short = ({"enum": list(PIN_MODELS)},)
    analytic: Annotated[str, fields.choice(PIN_MODELS)] = "normal"
    monte_carlo: Annotated[str, fields.choice(PIN_MODELS)] = "normal"

    @model_validator(mode="before")
    @classmethod
    def _long_form(cls, raw: Any) -> Any:
        return {"analytic": raw, "monte_carlo": raw} if isinstance(raw, str) else raw


class Clearance(fields.Model):
    """The clearance of a pin joint or a slide; exactly one of radial and diametral, to which the tolerance belongs, or
    a fit of ISO 286-1, which has the tolerances of its hole and shaft.

    The pin moves in `link` (left out, the last link of the joint that no output is said to be of); the coordinates of
    its point are those of the other links. An output or a limit may name the link that it is about: ``coupler.P.x``.
    A slider of a `length`, centred on the joint's point, shifts and tilts: each end lies within the radial clearance
    across the line. A pin in a slot shifts only.
    """

    one_of = ("a clearance needs either 'radial' or 'diametral', or a 'fit'", "radial", "diametral", "fit")
    radial: fields.NonNegativeLength | None = None
    diametral: fields.NonNegativeLength | None = None
    fit: Annotated[Fit, fields.Read(_fit, _FIT)] | None = None
    tolerance: Tolerance = (0.0, 0.0)
    distribution: Annotated[str, fields.choice(DISTRIBUTIONS)] = "normal"
    pin: PinModel = PinModel()
    link: fields.LinkName | None = None
    effect: Annotated[str, fields.choice(("offset", "length"))] = "offset"
    length: fields.PositiveLength | None = None

    @property
    def radius(self) -> float:
        """Mean radial clearance, half the difference of the diameters."""
        diametral = self.fit.diametral if self.fit is not None else self.diametral
        return self.radial if self.radial is not None else 0.5 * (diametral or 0.0)

    @property
    def radius_spread(self) -> Dimension | None:
        """Variation of the radial clearance; None where it has none, and of a fit."""
        if self.tolerance == (0.0, 0.0):
            return None
        factor = 1.0 if self.radial is not None else 0.5
        low, high = (factor * end for end in self.tolerance)
        return Dimension.model_construct(tolerance=(low, high), sigma=None, distribution=self.distribution)
