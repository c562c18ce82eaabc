"""How parts vary, as the study file gives it: dimensions by tolerances, classes or measured values; clearances."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, NamedTuple, Self

import numpy as np
from pydantic import model_validator

from mechdesign.errors import StudyError
from mechdesign.mechanism.model import MEASURED
from mechdesign.numerics.arrays import Floats
from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.iso_tolerances import (
    ToleranceClassError,
    angle_deviations,
    deviations,
    fit_deviations,
    is_class,
)
from mechdesign.study.schema.paths import read_column
from mechdesign.study.text import fields
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.fields import Context, failure, read_number, shown
from mechdesign.study.text.inputs import Folder
from mechdesign.study.text.units import QuantityError

# Components of a random load, and their kinds of quantity.
LOADS = {"load.fx": "force", "load.fy": "force", "load.mz": "moment"}
DISTRIBUTIONS = {
    "normal": "normal; the tolerance is three standard deviations",
    "truncated_normal": "as normal, and cut at the ends of the tolerance",
    "uniform": "equally likely over the whole tolerance",
    "triangular": "over the tolerance, most likely at the nominal value",
    "lognormal": "mean and deviation of normal; the value itself is lognormal and stays positive",
}
BETA = "beta"
_OF_DIMENSIONS = {**DISTRIBUTIONS, BETA: "beta over the tolerance, with two shape parameters, 'shape'"}
# Least number of measured values.
MIN_MEASURED = 10
PIN_MODELS = {
    "normal": "x and y of the pin normal, the clearance three standard deviations; of a slider each end",
    "normal_in_disc": "as normal, and cut at the circle of the clearance; of a slider at its walls",
    "uniform": "anywhere in the circle of the clearance alike; of a slider each end between its walls",
    "contact": "pin at the hole's wall, in any direction alike; of a slider each end at one wall or the other",
}
_EFFECTS = {
    "offset": "moves the joint's point in the link's frame, by x and y",
    "length": "changes the length r of a binary link alone, to sqrt((r + x)^2 + y^2)",
}
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


_TOLERANCE = {"anyOf": [fields.NUMBER_FORM, fields.PAIR_FORM]}
Tolerance = Annotated[tuple[float, float], fields.Read(_tolerance, _TOLERANCE)]
_CLASSED = {"anyOf": [fields.NUMBER_FORM, fields.PAIR_FORM, {**fields.NAME_FORM, "title": "tolerance class"}]}


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


_FIT = {**fields.NAME_FORM, "title": "fit"}


class Dimension(fields.Model):
    """How a dimension varies: one of ``tolerance``, ``sigma`` and ``measured``; a number or two alone are a tolerance,
    normal.
    """

    bare, short = "tolerance", (fields.NUMBER_FORM, fields.PAIR_FORM)
    one_of = ("a dimension needs either 'tolerance', 'sigma' or 'measured'", "tolerance", "sigma", "measured")
    tolerance: Annotated[tuple[float, float] | ToleranceClass, fields.Read(_tolerance_or_class, _CLASSED)] | None = None
    """Half-width of the deviations; two numbers, the lowest and the highest; or a class of ISO 286 or ISO 2768 for the
    dimension's nominal size. Example: 0.03 Example: [-0.1, 0.3] Example: js9 Example: ISO 2768-m
    """
    sigma: fields.NonNegative | None = None
    """Standard deviation, in place of a tolerance; of truncated_normal that of the normal law before it is cut at 3
    sigma, which leaves 0.9866 sigma. Example: 0.01
    """
    distribution: Annotated[str, fields.choice(_OF_DIMENSIONS, "distribution")] = "normal"
    """Distribution of the deviations."""
    shape: (
        Annotated[tuple[fields.Positive, fields.Positive], fields.pair_of("two shape parameters such as [2, 5]")] | None
    ) = None
    """The two shape parameters of a beta distribution. Example: [2, 5]"""
    leg: fields.PositiveLength | None = None
    """Length of an angle's shorter leg, by which ISO 2768 gives its tolerance. Example: 50 mm"""
    measured: str | None = None
    """CSV file beside the study with measured values of the dimension, in the study's units, |MIN_MEASURED| or more:
    one a line or a ``column``. Samples follow their distribution. Example: lengths.csv
    """
    column: str | None = None
    """Column of measured values, by its name in the first line. Left out: the file's only one. Example: L1"""
    nominal: fields.Number | None = None
    """What measured values deviate from; 0 where they are deviations. Left out: the dimension's own nominal value (of a
    drive or load 0). Example: 0
    """

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

    def deviations(self, nominal: float, folder: Folder) -> Floats:
        """Measured values less what they deviate from, in the study's units, by default `nominal`.

        Raises
        ------
        StudyError
            Where the file has no such numbers, too few of them, or only one and the same.
        """
        assert self.measured is not None
        file = self.measured
        values = read_column(folder, file, self.column)
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
    """How a pin lies in its hole, for each kind of method; a word alone is for both."""

    short = ({"enum": list(PIN_MODELS), "title": "pin model"},)
    analytic: Annotated[str, fields.choice(PIN_MODELS, "pin model")] = "normal"
    """Model of the methods that compute: analytic, second_order."""
    monte_carlo: Annotated[str, fields.choice(PIN_MODELS, "pin model")] = "normal"
    """Model of the methods that sample, and of form."""

    @model_validator(mode="before")
    @classmethod
    def _long_form(cls, raw: Any) -> Any:
        return {"analytic": raw, "monte_carlo": raw} if isinstance(raw, str) else raw


class Clearance(fields.Model):
    """Clearance of a pin or slide: one of ``radial``, ``diametral`` and ``fit``. Coordinates of a pin's point are those
    of the links in which it does not move; an output may name its link, coupler.P.x.
    """

    one_of = ("a clearance needs either 'radial' or 'diametral', or a 'fit'", "radial", "diametral", "fit")
    radial: fields.NonNegativeLength | None = None
    """Mean radial clearance: half the difference of the diameters; of a slide its play on either side. Example: 0.03"""
    diametral: fields.NonNegativeLength | None = None
    """Mean difference of the diameters of hole and pin. Example: 0.06"""
    fit: Annotated[Fit, fields.Read(_fit, _FIT)] | None = None
    """Fit of ISO 286-1 with its size in mm; tolerances of hole and shaft follow. Example: 20 H7/g6"""
    tolerance: Tolerance = (0.0, 0.0)
    """How far the clearance given (radial or diametral) deviates: a half-width, or the lowest and highest. A fit has
    its own. Example: 0.01
    """
    distribution: Annotated[str, fields.choice(DISTRIBUTIONS, "distribution")] = "normal"
    """Distribution of the clearance over its tolerance; of a fit normal or uniform."""
    pin: PinModel = PinModel()
    link: fields.LinkName | None = None
    """Link in which the pin moves. Left out: the last link at the joint that no output is said to be of. Example:
    forearm
    """
    effect: Annotated[str, fields.choice(_EFFECTS, "effect of a clearance")] = "offset"
    """What the pin's place changes."""
    length: fields.PositiveLength | None = None
    """Length of a slider in its guide, centred on the joint's point: it shifts and tilts. Prismatic joints need it; no
    others have it. Example: 40
    """

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


def check_dimensions(checker: Checker, dimensions: Mapping[str, Dimension]) -> dict[str, Dimension]:
    """Dimensions with wildcards expanded; a dimension that is named itself wins over a wildcard."""
    found: dict[str, Dimension] = {}
    parameters, report = checker.parameters, checker.report
    for name, dimension in dimensions.items():
        path: KeyPath = ("reliability", "dimensions", name)
        if "*" in name or "?" in name:
            matching = parameters.match(name)
            if not matching:
                report(path, f"no dimension matches {name!r}", at_key=True)
            for place in matching:
                if place not in dimensions:
                    found[place] = _check_dimension(checker, place, dimension, path)
            continue
        if name in parameters.formulas:
            message = f"parameter {name!r} follows from others by its expression; give those a tolerance"
            report(path, message, at_key=True)
        known = [*parameters.known(), *checker.mechanism.driven_kinds, *LOADS]
        if checker.known(name, known, "parameter, dimension or drive", path, at_key=True):
            found[name] = _check_dimension(checker, name, dimension, path)
    return found


def _check_dimension(checker: Checker, name: str, dimension: Dimension, path: KeyPath) -> Dimension:
    """Check a dimension and give it the deviations of its class."""
    if dimension.distribution == "lognormal":
        nominal = checker.parameters.nominal.get(name)
        if name in checker.mechanism.driven_kinds or name in LOADS or (nominal is not None and nominal <= 0):
            checker.report(path, "what is lognormal is positive, and so is its nominal value", at_key=True)
    if (quantity := LOADS.get(name) or checker.quantity(name)) is not None:
        for key in (dimension.kind, "nominal"):
            checker.kind((*path, key), quantity)
    if dimension.measured is not None:
        _check_measured(checker, name, dimension, path)
    if not isinstance(dimension.tolerance, ToleranceClass):
        if dimension.leg is not None:
            checker.report((*path, "leg"), "the leg is that of an angle with the tolerance ISO 2768-m (or -f, -c, -v)")
        return dimension
    given = dimension.tolerance
    try:
        given = replace(given, ends=_of_class(checker, name, given, dimension.leg))
    except ToleranceClassError as error:
        alone = "" if name == path[-1] else f"{name} has no such tolerance and needs one of its own: "
        checker.report(path, f"{alone}{error}", at_key=True)
    return dimension.model_copy(update={"tolerance": given})


def _of_class(checker: Checker, name: str, given: ToleranceClass, leg: float | None) -> tuple[float, float]:
    """Deviations of a parameter or place by its class."""
    parameters, places = checker.parameters, checker.places
    slopes = parameters.derivatives(name) if name in parameters.nominal or name in places else {}
    # Bounds of the motion and numbers in measures are no dimensions of a part.
    kinds = {places[place].quantity for place, slope in slopes.items()
             if slope and not place.startswith(("limits.", MEASURED))}  # fmt: skip
    if len(kinds) != 1 or "none" in kinds:
        raise ToleranceClassError(f"{given.text} is of a length or an angle of the drawing; give a number here")
    if kinds == {"length"}:
        if leg is not None:
            raise ToleranceClassError("the leg is that of an angle; a length has its own size")
        return given.of_length(parameters.nominal[name] if name in parameters.nominal else places[name].nominal)
    found = given.of_angle(leg or given.millimetre)
    if leg is None:
        raise ToleranceClassError(
            f"{given.text} of an angle goes by the length of its shorter leg; say which: "
            f"{{tolerance: {given.text}, leg: 50}}"
        )
    return found


def _check_measured(checker: Checker, name: str, dimension: Dimension, path: KeyPath) -> None:
    parameters, optimize = checker.parameters, checker.parts.get("optimize")
    nominal = parameters.nominal.get(name, 0.0)
    if name in checker.places:
        nominal = checker.places[name].nominal / parameters.factors[name]
    try:
        dimension.deviations(nominal, checker.folder)
    except StudyError as error:
        checker.report((*path, "measured"), str(error))
    designed = optimize.variables if optimize is not None else ()
    if dimension.nominal is None and name in parameters.moved(designed) | parameters.moved_places(designed):
        message = (
            f"optimize changes {name!r}: say by 'nominal' what the measured values deviate from, so that the "
            "deviations are those of every design"
        )
        checker.report(path, message, at_key=True)


def check_clearance(checker: Checker, point: str, clearance: Clearance, meant: str | None) -> Clearance | None:
    """A clearance with the link that its pin moves in, which is not that `meant` by outputs; None without its joint."""
    path: KeyPath = ("reliability", "clearances", point)
    mechanism, report = checker.mechanism, checker.report
    _check_radius(checker, clearance, path)
    if point in mechanism.slides:
        return _check_slide_clearance(checker, clearance, path, tilts=mechanism.joints[point].prismatic is not None)
    if not checker.known(point, [*mechanism.owners, *mechanism.slides], "point or slide", path, at_key=True):
        return None
    if clearance.length is not None:
        report((*path, "length"), "is that of a slider in its guide; a pin's clearance has none")
    links = mechanism.owners[point]
    held = [*links, *(j.slot for j in mechanism.joints.values() if j.slot and j.point == point)]
    if len(held) < 2:
        report(path, f"only link {links[0]!r} has point {point!r}: no pin, no clearance", at_key=True)
    # Where the study does not say, the pin moves in the last link that no output or limit means.
    link = clearance.link or ([link for link in links if link != meant] or links)[-1]
    if link not in links:
        checker.known(link, links, f"link at point {point!r} named", (*path, "link"))
    elif clearance.effect == "length":
        binary = mechanism.links[link]
        if point not in (binary.from_, binary.to) or binary.telescopic:
            message = f"changes a binary link's length, and {point!r} is no end of such a link in {link!r}"
            report((*path, "effect"), message)
    return clearance.model_copy(update={"link": link})


def _check_slide_clearance(checker: Checker, clearance: Clearance, path: KeyPath, *, tilts: bool) -> Clearance:
    for key in {"link", "effect"} & clearance.model_fields_set:
        checker.report((*path, key), f"a slide's clearance has no {key!r}: its slider shifts across the line")
    if tilts and clearance.length is None:
        message = "the slider tilts in its guide as far as its 'length' along the line lets it; give that too"
        checker.report(path, message, at_key=True)
    elif not tilts and clearance.length is not None:
        checker.report((*path, "length"), "a pin in a slot does not tilt; leave it out")
    return clearance


def _check_radius(checker: Checker, clearance: Clearance, path: KeyPath) -> None:
    """Check how the clearance's size varies."""
    report = checker.report
    checker.kind((*path, "tolerance"), "length")
    if clearance.fit is not None:
        if "tolerance" in clearance.model_fields_set:
            report((*path, "tolerance"), "a fit has the tolerances of its hole and shaft; leave it out")
        if clearance.distribution not in ("normal", "uniform"):
            report((*path, "distribution"), "hole and shaft of a fit are normal or uniform within their tolerances")
    spread = clearance.radius_spread
    if spread is not None and clearance.radius + spread.ends[0] < -CLEARANCE_ROUNDING:
        factor = 1.0 if clearance.radial is not None else 2.0
        size, lowest = factor * clearance.radius, clearance.tolerance[0]
        message = f"a clearance of {size:g} that is {-lowest:g} smaller is negative: such a pin does not go in its hole"
        report((*path, "tolerance"), message)
    if spread is not None and spread.distribution == "lognormal" and clearance.radius <= 0:
        report((*path, "distribution"), "what is lognormal is positive, and so is its nominal value")
