"""How dimensions vary, as the study file gives it: by tolerances, classes or measured values."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from mechdesign.ground.errors import StudyError
from mechdesign.ground.expressions import Number
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism.elements.couplings import MEASURED
from mechdesign.mechanism.model import Place
from mechdesign.questions.reliability.laws import LAWS, Distribution, Marginal
from mechdesign.questions.reliability.schema.iso_tolerances import (
    ToleranceClassError,
    angle_deviations,
    deviations,
    is_class,
)
from mechdesign.study.building.parameters import Parameters
from mechdesign.study.schema.checker import Checker
from mechdesign.study.text import fields
from mechdesign.study.text.csv_files import read_column
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.inputs import Folder
from mechdesign.study.text.reading import Context, failure, read_number, shown
from mechdesign.study.text.units import Amount, QuantityError

# Components of a random load, and their kinds of quantity.
LOADS = {"load.fx": "force", "load.fy": "force", "load.mz": "moment"}
# Least number of measured values.
MIN_MEASURED = 10


def millimetre(context: Context, text: str) -> float:
    """A millimetre in the study's unit of length, for a class of an ISO standard."""
    try:
        return context.units.convert("1 mm")
    except QuantityError:
        raise failure(f"{text!r} is of sizes in mm, and this study's lengths are dimensionless; give 'units'") from None


@dataclass(frozen=True)
class ToleranceClass:
    """A tolerance class as written, with a millimetre and a degree in the study's units."""

    text: str
    millimetre: float
    degree: float

    def ends(self, size: Number, leg: Number | None = None) -> tuple[Number, Number]:
        """Lowest and highest deviation of a length, or of an angle whose shorter leg is so long.

        Raises as `deviations`.
        """
        if leg is not None:
            low, high = angle_deviations(self.text, leg / self.millimetre)
            return low * self.degree, high * self.degree
        low, high = deviations(self.text, np.abs(size) / self.millimetre)
        return low * self.millimetre, high * self.millimetre


def _tolerance_or_class(raw: Any, context: Context) -> tuple[float, float] | ToleranceClass:
    """As `_tolerance`, or a tolerance class unless a parameter has that name."""
    if isinstance(raw, str) and is_class(raw) and raw not in context.parameters:
        degree = math.pi / 180.0 / context.units.angle_factor
        return ToleranceClass(raw, millimetre(context, raw), degree)
    return _tolerance(raw, context)


def _tolerance(raw: Any, context: Context) -> tuple[float, float]:
    """A half-width, or the lowest and the highest deviation."""
    if not isinstance(raw, list):
        half = read_number(raw, context)
        if half < 0:
            raise failure(f"must be at least 0, not {half:g}; two bounds are written [-0.1, 0.3]")
        return Amount.by("-half", half=half), half
    if len(raw) != 2:
        raise failure(f"expected a half-width or two bounds such as [-0.1, 0.3], not {shown(raw)}")
    low, high = (read_number(bound, context) for bound in raw)
    if low > high:
        raise failure(f"the lowest deviation {low:g} is above the highest {high:g}")
    return low, high


_TOLERANCE = {"anyOf": [fields.NUMBER_FORM, fields.PAIR_FORM]}
Tolerance = Annotated[tuple[float, float], fields.Read(_tolerance, _TOLERANCE)]
_CLASSED = {"anyOf": [fields.NUMBER_FORM, fields.PAIR_FORM, {**fields.NAME_FORM, "title": "tolerance class"}]}


class _Width(fields.Model):
    """How far a dimension varies."""

    tolerance: Annotated[tuple[float, float] | ToleranceClass, fields.Read(_tolerance_or_class, _CLASSED)] | None = None
    """Half-width of the deviations; two numbers, the lowest and the highest; or a class of ISO 286 or ISO 2768 for the
    dimension's nominal size. Example: 0.03 Example: [-0.1, 0.3] Example: js9 Example: ISO 2768-m
    """
    sigma: fields.NonNegative | None = None
    """Standard deviation, in place of a tolerance; of truncated_normal that of the normal law before it is cut at 3
    sigma, which leaves 0.9866 sigma. Example: 0.01
    """


class Dimension(Distribution, _Width):
    """How a dimension varies: one of ``tolerance``, ``sigma`` and ``measured``; a number or two alone are a tolerance,
    normal.
    """

    bare, short = "tolerance", (fields.NUMBER_FORM, fields.PAIR_FORM)
    one_of = ("a dimension needs either 'tolerance', 'sigma' or 'measured'", "tolerance", "sigma", "measured")
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

    def faults(self) -> Iterator[str]:
        yield from super().faults()
        if LAWS[self.distribution].between_ends and self.tolerance is None:
            yield f"a {self.distribution} distribution lies between two ends: give 'tolerance'"
        if self.measured is not None and "distribution" in self.model_fields_set:
            yield "measured values are a distribution of their own: leave 'distribution' out"
        if self.measured is None and (spare := self.given("column", "nominal")):
            yield f"{spare[0]!r} goes with 'measured', the name of a file"

    def ends(self, nominal: Number) -> tuple[Number, Number]:
        """Lowest and highest deviation of the tolerance, none where sigma is given; a class goes by the nominal value.

        Raises
        ------
        ToleranceClassError
            Where the class is not given for the size.
        """
        if not isinstance(self.tolerance, ToleranceClass):
            return self.tolerance or (0.0, 0.0)
        return self.tolerance.ends(nominal, self.leg)

    def varies(self, nominal: Number) -> bool:
        """Whether it has a tolerance above 0; see `ends`."""
        low, high = self.ends(nominal)
        return bool(np.any(low < high))

    def flaw(self, nominal: Number) -> str:
        """The mistake in its numbers at a nominal value, or at any of several; empty if there is none."""
        if LAWS[self.distribution].positive and np.any(nominal <= 0):
            return f"what is {self.distribution} is positive, and so is its nominal value"
        low, high = self.ends(nominal)
        return "the lowest deviation is above the highest" if np.any(low > high) else ""

    def law(self, nominal: Number, factor: float = 1.0) -> Marginal:
        """The law of deviations that are not measured.

        `nominal` is in the core's units (radians, lengths), and `factor` of these are one unit of the study.

        Raises
        ------
        ToleranceClassError
            If the tolerance class does not cover the nominal value.
        """
        law = LAWS[self.distribution]
        low, high = self.ends(nominal)
        if self.sigma is not None:
            low, high = -law.reach * self.sigma, law.reach * self.sigma
        return law(factor * low, factor * high, nominal, **{key: getattr(self, key) for key in law.keys})

    def deviations(self, nominal: Number, folder: Folder) -> tuple[Floats, Number]:
        """Measured values, and what they deviate from, in the study's units, by default `nominal`.

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
        if self.nominal is not None:
            return values, self.nominal
        far = np.max(np.abs(nominal))
        if np.abs(values).max() < 0.5 * far:
            raise StudyError(
                f"{file}: the measured values lie between {values.min():g} and {values.max():g}, and the nominal value "
                f"is {far:g}; where they are deviations, say 'nominal: 0'"
            )
        return values, nominal


def check_dimensions(checker: Checker, dimensions: Mapping[str, Dimension]) -> dict[str, Dimension]:
    """Dimensions with wildcards expanded; a dimension that is named itself wins over a wildcard."""
    checked: dict[str, Dimension] = {}
    parameters, report = checker.parameters, checker.report
    for name, dimension in dimensions.items():
        path: KeyPath = ("reliability", "dimensions", name)
        if "*" in name or "?" in name:
            matching = parameters.match(name)
            if not matching:
                report(
                    path, f"no dimension matches {name!r}; name a parameter, or a place such as rod.length", at_key=True
                )
            for place in matching:
                if place not in dimensions:
                    checked[place] = _check_dimension(checker, place, dimension, path)
            continue
        if name in parameters.formulas:
            message = f"parameter {name!r} follows from others by its expression; give those a tolerance"
            report(path, message, at_key=True)
        names = [*parameters.names(), *checker.mechanism.driven_kinds, *LOADS]
        if checker.check_name(name, names, "parameter, dimension or drive", path, at_key=True):
            checked[name] = _check_dimension(checker, name, dimension, path)
    return checked


def _check_dimension(checker: Checker, name: str, dimension: Dimension, path: KeyPath) -> Dimension:
    """Check a dimension that the section names itself or by a wildcard."""
    if (quantity := LOADS.get(name) or checker.quantity(name)) is not None:
        for key in (dimension.kind, "nominal"):
            checker.kind((*path, key), quantity)
    if dimension.measured is not None:
        _check_measured(checker, name, dimension, path)
    if dimension.leg is not None and not isinstance(dimension.tolerance, ToleranceClass):
        checker.report((*path, "leg"), "the leg is that of an angle with the tolerance ISO 2768-m (or -f, -c, -v)")
    try:
        _check_class(checker, name, dimension.tolerance, dimension.leg)
        flaw = dimension.flaw(checker.size(name))
    except ToleranceClassError as error:
        flaw = str(error) if name == path[-1] else f"{name} has no such tolerance and needs one of its own: {error}"
    if flaw:
        checker.report(path, flaw, at_key=True)
    return dimension


def _check_class(checker: Checker, name: str, tolerance: object, leg: float | None) -> None:
    """Check that a tolerance class stands for a length or an angle."""
    if not isinstance(tolerance, ToleranceClass):
        return
    kinds = quantities(name, checker.parameters, checker.places)
    if len(kinds) != 1 or not kinds <= {"length", "angle"}:
        raise ToleranceClassError(f"{tolerance.text} is of a length or an angle of the drawing; give a number here")
    if kinds == {"length"} and leg is not None:
        raise ToleranceClassError("the leg is that of an angle; a length has its own size")
    if kinds == {"angle"} and leg is None:
        tolerance.ends(0.0, tolerance.millimetre)
        raise ToleranceClassError(
            f"{tolerance.text} of an angle goes by the length of its shorter leg; say which: "
            f"{{tolerance: {tolerance.text}, leg: 50}}"
        )


def quantities(name: str, parameters: Parameters, places: Mapping[str, Place]) -> set[str]:
    """Quantities of the dimensions of parts that a parameter moves, or of the place of this name."""
    slopes = parameters.derivatives(name) if name in parameters.nominal or name in places else {}
    # Limits of motion and numbers in measures are not dimensions of a part.
    return {places[place].quantity for place, slope in slopes.items()
            if slope and not place.startswith(("limits.", MEASURED))}  # fmt: skip


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
