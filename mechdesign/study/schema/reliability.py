"""The reliability section of the study file, and its checks against the mechanism.

Where a pin has a clearance its links have that point in places of their own. The clearance moves the pin in one link;
the point's coordinates are those of the other links. An output or a limit may name its link, ``coupler.P.x``, and then
the pin moves in another one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, NamedTuple, Self

import numpy as np
from pydantic import BeforeValidator, Field, ValidationInfo, model_validator

from mechdesign.errors import StudyError
from mechdesign.mechanism.graph import Graph
from mechdesign.numerics.arrays import Floats
from mechdesign.study.building.section import MechanismSection
from mechdesign.study.schema.checker import NO_MOMENT, ORDERS, Checker
from mechdesign.study.schema.methods import METHODS
from mechdesign.study.schema.paths import read_column
from mechdesign.study.schema.poses import MotionSection
from mechdesign.study.text import fields
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.fields import Context, failure, read_number, shown

DISTRIBUTIONS = ("normal", "truncated_normal", "uniform", "triangular", "lognormal")
BETA = "beta"
# Least number of measured values.
MIN_MEASURED = 10
PIN_MODELS = ("normal", "normal_in_disc", "uniform", "contact")
DEFAULT_METHODS = ("analytic", "monte_carlo")
# Components of a random load, and their kinds of quantity.
LOADS = {"load.fx": "force", "load.fy": "force", "load.mz": "moment"}
# What the names of errors of positions, velocities and accelerations end in.
SUFFIXES = ("", "_velocity", "_acceleration")
# Digits of a clearance beyond which its lowest value is zero.
_ROUNDING = 1e-9


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


class Dimension(fields.Model):
    """A dimension's variation: nominal +- tolerance, its standard deviation, or measured values.

    Of a tolerance ``normal`` makes three standard deviations, ``truncated_normal`` the same and cuts there; ``uniform``
    fills it, ``triangular`` peaks at the nominal value, ``lognormal`` has the mean and the deviation of ``normal``,
    ``beta`` has two shape parameters between its ends.

    `measured` is a file of measured values of the dimension, in the study's units: one a line, or a `column`. What they
    deviate from is the dimension's own nominal value (of a drive or a load 0), or `nominal`. What is sampled is drawn
    from their interpolated distribution, beyond whose ends nothing lies.
    """

    bare, short = "tolerance", (fields.NUMBER_FORM, fields.PAIR_FORM)
    one_of = ("a dimension needs either 'tolerance', 'sigma' or 'measured'", "tolerance", "sigma", "measured")
    tolerance: Tolerance | None = None
    sigma: fields.NonNegative | None = None
    distribution: Annotated[str, fields.choice((*DISTRIBUTIONS, BETA))] = "normal"
    shape: (
        Annotated[tuple[fields.Positive, fields.Positive], fields.pair_of("two shape parameters such as [2, 5]")] | None
    ) = Field(None, description="shape parameters of a beta distribution over the tolerance")
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
    """The clearance of a pin joint; exactly one of radial and diametral, to which the tolerance belongs.

    The pin moves in `link` (left out, the last link of the joint that no output is said to be of); the coordinates of
    its point are those of the other links. An output or a limit may name the link that it is about: ``coupler.P.x``.
    """

    one_of = ("a clearance needs either 'radial' or 'diametral'", "radial", "diametral")
    radial: fields.NonNegativeLength | None = None
    diametral: fields.NonNegativeLength | None = None
    tolerance: Tolerance = (0.0, 0.0)
    distribution: Annotated[str, fields.choice(DISTRIBUTIONS)] = "normal"
    pin: PinModel = PinModel()
    link: fields.LinkName | None = None
    effect: Annotated[str, fields.choice(("offset", "length"))] = "offset"

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
    """What an error may be: within [min, max], or (of a point) within a radius; or what the value itself may be.

    `lsl` and `usl` are the lower and upper specification limit of the value, the same at all poses; an angle between
    two of them is counted at the turn nearest to them.
    """

    short = (fields.NUMBER_FORM, fields.PAIR_FORM)
    min: fields.Number | None = None
    max: fields.Number | None = None
    lsl: fields.Number | None = None
    usl: fields.Number | None = None
    radius: fields.NonNegative | None = None

    @model_validator(mode="before")
    @classmethod
    def _long_form(cls, raw: Any, info: ValidationInfo) -> Any:
        if isinstance(raw, list):
            if len(raw) != 2:
                raise failure(f"expected a number, or the lowest and highest error such as [-1, 0.8], not {shown(raw)}")
            return {"min": raw[0], "max": raw[1]}
        if not isinstance(raw, int | float | str) or isinstance(raw, bool):
            return raw
        size = read_number(raw, info.context or Context()).nominal
        if size < 0:
            raise failure(f"must be at least 0, not {size:g}")
        return {"min": -size, "max": size}

    @model_validator(mode="after")
    def _some(self) -> ErrorLimit:
        kinds = [given for keys in (("min", "max"), ("lsl", "usl"), ("radius",)) if (given := self.given(*keys))]
        if not kinds:
            raise failure("a limit needs a number, 'min', 'max', 'lsl', 'usl' or 'radius'")
        if len(kinds) > 1:
            raise failure(
                f"{kinds[0][0]!r} and {kinds[1][0]!r} exclude each other: 'min' and 'max' limit the error, 'lsl' and "
                "'usl' the value itself, 'radius' the place of a point"
            )
        low, high = self.ends
        if low is not None and high is not None and high < low:
            raise failure(f"the maximum {high:g} is below the minimum {low:g}")
        return self

    @property
    def absolute(self) -> bool:
        """Whether it is a limit of the value itself."""
        return self.lsl is not None or self.usl is not None

    @property
    def ends(self) -> tuple[float | None, float | None]:
        """Lowest and highest error, or value where it is absolute."""
        return (self.lsl, self.usl) if self.absolute else (self.min, self.max)


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

    command: ClassVar[str] = "reliability"
    dimensions: dict[str, Dimension] = Field(default_factory=dict)
    clearances: dict[str, Clearance] = Field(default_factory=dict)
    correlation: tuple[Annotated[Correlated, fields.Read(_correlation, _CORRELATION)], ...] = ()
    limits: dict[fields.CoordinateName, ErrorLimit] = Field(default_factory=dict)
    load: tuple[fields.Number, ...] | None = None
    methods: Annotated[
        tuple[Annotated[str, fields.choice(METHODS)], ...], BeforeValidator(fields.as_list), fields.OrShort()
    ] = DEFAULT_METHODS
    samples: Annotated[int, fields.whole(2, 10**15)] = 40_000
    precision: Precision | None = None
    sobol: Annotated[int, fields.whole(0, 10**9)] | None = None
    allocate: Allocate | None = None

    def checked(self, checker: Checker) -> Self:
        """Check what varies and what is limited as well; wildcards and the clearances' links are filled in."""
        meant = _links_of_points(checker, self)
        dimensions = _dimensions(checker, self)
        clearances = {
            point: right
            for point, clearance in self.clearances.items()
            if (right := _clearance(checker, point, clearance, meant.get(point))) is not None
        }
        for name, limit in self.limits.items():
            _limit(checker, self, name, limit)
        for index, correlated in enumerate(self.correlation):
            for place, name in enumerate((correlated.one, correlated.other)):
                checker.known(name, dimensions, "varying dimension", ("reliability", "correlation", index, place))
        pairs = [frozenset(pair[:2]) for pair in self.correlation]
        for index, pair in enumerate(pairs):
            if pair in pairs[:index]:
                checker.report(("reliability", "correlation", index), "this pair is given twice")
        if not self.methods:
            checker.report(("reliability", "methods"), "name at least one method")
        for index, method in enumerate(self.methods):
            if method in self.methods[:index]:
                checker.report(("reliability", "methods", index), f"{method!r} is given twice")
        if self.allocate is not None:
            _allocate(checker, self, dimensions, clearances)
        load = _load(checker, self, dimensions)
        plain = {name: split_link(checker.mechanism, name)[1] for name in (*(self.outputs or ()), *self.limits)}
        limits = {plain[name]: limit for name, limit in self.limits.items()}
        if len(limits) < len(self.limits):
            checker.report(("reliability", "limits"), "the same error is limited twice")
        outputs = None if self.outputs is None else tuple(plain[name] for name in self.outputs)
        checker.outputs(outputs, ("reliability", "outputs"))
        filled = {"dimensions": dimensions, "clearances": clearances, "load": load}
        return super().checked(checker).model_copy(update=filled | {"outputs": outputs, "limits": limits})


def split_link(mechanism: MechanismSection, name: str) -> tuple[str, str, str]:
    """The link that a coordinate or point is said to be of, or nothing, the name without it, and the point."""
    link, _, rest = name.partition(".")
    points = {part: point for point in mechanism.owners for part in (point, *mechanism.coordinates_of(point))}
    base, _ = split_order(rest, points.__contains__)
    if name in mechanism.coordinates or link not in mechanism.links or base not in points:
        return "", name, ""
    return link, rest, points[base]


def _links_of_points(checker: Checker, section: ReliabilitySection) -> dict[str, str]:
    """The link that outputs and limits mean by each point, where they say; what contradicts itself is noted."""
    found: dict[str, str] = {}
    given: list[tuple[KeyPath, str, bool]] = [
        *((("reliability", "outputs", k), name, False) for k, name in enumerate(section.outputs or ())),
        *((("reliability", "limits", name), name, True) for name in section.limits),
    ]
    for path, name, at_key in given:
        link, _, point = split_link(checker.mechanism, name)
        if not link:
            continue
        links = checker.mechanism.owners[point]
        if link not in links:
            message = f"link {link!r} has no point {point!r}; it belongs to {' and '.join(links)}"
            checker.report(path, message, at_key=at_key)
        elif found.setdefault(point, link) != link:
            message = f"{point!r} is that of link {found[point]!r} elsewhere; all outputs and limits mean one of them"
            checker.report(path, message, at_key=at_key)
        own = section.clearances.get(point)
        if own is not None and link in links and (own.link == link or len(links) < 2):
            message = (
                f"the clearance of {point!r} moves its pin in link {link!r}, and the coordinates of {point!r} are "
                "those of what else it joins; give reliability.clearances another 'link', or none"
            )
            checker.report(path, message, at_key=at_key)
    return found


def _load(checker: Checker, section: ReliabilitySection, dimensions: dict[str, Dimension]) -> tuple[float, ...] | None:
    """The load as fx, fy, mz."""
    path: KeyPath = ("reliability", "load")
    report, stiffness = checker.report, checker.parts.get("stiffness")
    random = [name for name in LOADS if name in dimensions]
    if checker.reporter.raw(("stiffness",)) is None:
        missing = "a load acts at the point of the stiffness section, and the study has none"
        if section.load is not None:
            report(path, missing)
        for name in random:
            report(("reliability", "dimensions", name), missing, at_key=True)
    on_pin = stiffness is not None and stiffness.link is None
    if on_pin and "load.mz" in random:
        report(("reliability", "dimensions", "load.mz"), NO_MOMENT, at_key=True)
    return None if section.load is None else checker.load(section.load, path, on_pin=on_pin)


def _allocate(
    checker: Checker, section: ReliabilitySection, dimensions: dict[str, Dimension], clearances: dict[str, Clearance]
) -> None:
    assert section.allocate is not None
    for name in section.allocate.cost:
        if name in dimensions and dimensions[name].measured is not None:
            message = "what is measured is held as it is: its tolerance is not allocated"
            checker.report(("reliability", "allocate", "cost", name), message, at_key=True)
        known = [*dimensions, *clearances]
        checker.known(name, known, "dimension or clearance that varies,", ("reliability", "allocate", "cost", name),
                      at_key=True)  # fmt: skip
    if not section.limits:
        checker.report(("reliability", "allocate"), "tolerances are allocated to keep 'limits'; give some")
    wide = any(d.sigma if d.tolerance is None else d.tolerance[0] < d.tolerance[1]
               for name, d in dimensions.items() if name not in LOADS)  # fmt: skip
    if not wide and not section.allocate.cost:
        message = "nothing to allocate: no dimension has a tolerance, and a clearance is held unless 'cost' names it"
        checker.report(("reliability", "allocate"), message)


def _clearance(checker: Checker, point: str, clearance: Clearance, meant: str | None) -> Clearance | None:
    path: KeyPath = ("reliability", "clearances", point)
    mechanism, report = checker.mechanism, checker.report
    if not checker.known(point, mechanism.owners, "point", path, at_key=True):
        return None
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
    checker.kind((*path, "tolerance"), "length")
    spread = clearance.radius_spread
    if spread is not None and spread.tolerance is not None and clearance.radius + spread.tolerance[0] < -_ROUNDING:
        factor = 1.0 if clearance.radial is not None else 2.0
        size, lowest = factor * clearance.radius, clearance.tolerance[0]
        message = f"a clearance of {size:g} that is {-lowest:g} smaller is negative: such a pin does not go in its hole"
        report((*path, "tolerance"), message)
    if spread is not None and spread.distribution == "lognormal" and clearance.radius <= 0:
        report((*path, "distribution"), "what is lognormal is positive, and so is its nominal value")
    return clearance.model_copy(update={"link": link})


def _limit(checker: Checker, section: ReliabilitySection, name: str, limit: ErrorLimit) -> None:
    path: KeyPath = ("reliability", "limits", name)
    mechanism, report = checker.mechanism, checker.report
    known = mechanism.owners if limit.radius is not None else {**mechanism.coordinates, **mechanism.owners}
    name = split_link(mechanism, name)[1]
    base, order = split_order(name, known.__contains__)
    if order and not (section.rates or section.accelerations or section.speed):
        report(path, "a limit of a velocity or an acceleration needs 'rates' or a 'speed'", at_key=True)
    if limit.radius is not None:
        if checker.known(base, mechanism.owners, "point", path, at_key=True):
            checker.kind(path, ORDERS["length"][order])
    elif base in mechanism.owners:
        report(path, f"{name!r} is a point: limit {name}.x and {name}.y, or {{radius: r}}", at_key=True)
    else:
        checker.coordinate(base, path, at_key=True, order=order)


def _dimensions(checker: Checker, section: ReliabilitySection) -> dict[str, Dimension]:
    """Dimensions with wildcards expanded; a dimension that is named itself wins over a wildcard."""
    found: dict[str, Dimension] = {}
    parameters, report = checker.parameters, checker.report
    for name, dimension in section.dimensions.items():
        path: KeyPath = ("reliability", "dimensions", name)
        if "*" in name or "?" in name:
            matching = parameters.match(name)
            if not matching:
                report(path, f"no dimension matches {name!r}", at_key=True)
            for place in matching:
                _dimension(checker, place, dimension, path)
                if place not in section.dimensions:
                    found[place] = dimension
            continue
        if name in parameters.formulas:
            message = f"parameter {name!r} follows from others by its expression; give those a tolerance"
            report(path, message, at_key=True)
        known = [*parameters.known(), *checker.mechanism.driven_kinds, *LOADS]
        if checker.known(name, known, "parameter, dimension or drive", path, at_key=True):
            _dimension(checker, name, dimension, path)
            found[name] = dimension
    return found


def _dimension(checker: Checker, name: str, dimension: Dimension, path: KeyPath) -> None:
    if dimension.distribution == "lognormal":
        nominal = checker.parameters.nominal.get(name)
        if name in checker.mechanism.driven_kinds or name in LOADS or (nominal is not None and nominal <= 0):
            checker.report(path, "what is lognormal is positive, and so is its nominal value", at_key=True)
    if dimension.measured is not None:
        _measured(checker, name, dimension, path)
    if name in checker.parameters.nominal:
        return
    kinds = {**checker.mechanism.driven_kinds, **LOADS}
    checker.kind(path, checker.places[name].quantity if name in checker.places else kinds[name])


def _measured(checker: Checker, name: str, dimension: Dimension, path: KeyPath) -> None:
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


def others(section: ReliabilitySection | None, graph: Graph) -> Mapping[str, tuple[str, list[str]]]:
    """Of each point with a clearance the link that its pin moves in, and those whose point its coordinates are."""
    found: dict[str, tuple[str, list[str]]] = {}
    for point, clearance in (section.clearances if section is not None else {}).items():
        links = [body.removesuffix(":rod") for body, name in graph.points if name == point]
        found[point] = clearance.link or "", [link for link in dict.fromkeys(links) if link != clearance.link]
    return found


def in_words(section: ReliabilitySection | None, graph: Graph) -> list[str]:
    """One line for each clearance."""
    return [
        f"clearance: the pin {point} moves in {link}; {point}.x and {point}.y are those of "
        f"{' and '.join(rest) or 'the joint'}"
        for point, (link, rest) in others(section, graph).items()
    ]
