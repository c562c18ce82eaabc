"""The random sources of a made mechanism: dimensions, clearances, drives and loads, mapped onto the geometry."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from mechdesign.analyses.reliability.copula import Correlation
from mechdesign.analyses.reliability.laws import (
    PIN_LAWS,
    SLIDE_LAWS,
    Marginal,
    Measured,
    PinLaw,
    SlideLaw,
    fit_law,
    marginal,
    taken,
)
from mechdesign.cautions import Caution
from mechdesign.errors import StudyError
from mechdesign.expressions import Number
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.geometry import offset_names, slide_offset
from mechdesign.mechanism.model import MEASURED, Joint, Prismatic
from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.study import Study
from mechdesign.study.poses import Poses
from mechdesign.study.schema.clearances import Clearance
from mechdesign.study.schema.iso_tolerances import ToleranceClassError
from mechdesign.study.schema.reliability import ReliabilitySection
from mechdesign.study.schema.variation import LOADS, Dimension

# Largest deviation, in radians or in sizes of the mechanism.
MAX_DEVIATION = 1e6
# Largest deviation of a force or moment, in the study's units.
MAX_LOAD = 1e100


@dataclass(frozen=True)
class Scalar:
    """A dimension that varies: by `kind` a ``parameter`` (in its own unit), a ``place``, a ``drive`` or a ``load``.

    `moves` maps each place, drive or load that it changes onto the derivative (radians, lengths) and the quantity.
    `factor` is one `unit` of the study in radians, lengths or loads; the unit of a parameter may be unknown (None).
    """

    name: str
    kind: str
    law: Marginal
    moves: Mapping[str, tuple[Number, str]]
    factor: float
    unit: str | None

    def take(self, rows: Sequence[int] | Ints) -> Scalar:
        """At some of many poses."""
        moves = {name: (taken(slope, rows), quantity) for name, (slope, quantity) in self.moves.items()}
        return replace(self, law=self.law.take(rows), moves=moves)

    @property
    def directions(self) -> list[dict[str, Number]]:
        """Derivatives of places, drives and loads by the single component."""
        return [{name: slope for name, (slope, _) in self.moves.items()}]

    @property
    def spread(self) -> tuple[Number, Number]:
        """Mean and variance of the deviation."""
        return self.law.moments[:2]

    @property
    def ends(self) -> tuple[Number, Number]:
        """Lowest and highest deviation: the tolerance."""
        return self.law.low, self.law.high


@dataclass(frozen=True)
class Pin:
    """A clearance of a pin or a slide: its mean radius, and the law of its deviation.

    `analytic` and `sampled` name the laws of its place for the analytic methods and for those that sample. The place
    has two components: x and y of a pin, or the two ends of a slider. `directions` has, for each component that changes
    the geometry, the derivatives of the places: of the offsets of the pin's point in its link, of the link's length, or
    of the slide's offset and angle. `kind` is ``offset``, ``length`` or ``slide``.
    """

    name: str
    radius: Number
    law: Marginal | None
    analytic: str
    sampled: str
    kind: str
    directions: tuple[Mapping[str, Number], ...]

    def take(self, rows: Sequence[int] | Ints) -> Pin:
        """At some of many poses."""
        directions = tuple(
            {name: taken(slope, rows) for name, slope in direction.items()} for direction in self.directions
        )
        law = None if self.law is None else self.law.take(rows)
        return replace(self, radius=taken(self.radius, rows), law=law, directions=directions)

    @property
    def laws(self) -> Mapping[str, PinLaw] | Mapping[str, SlideLaw]:
        """Laws of the place by name."""
        return SLIDE_LAWS if self.kind == "slide" else PIN_LAWS

    @property
    def directed(self) -> bool:
        """Whether its place has only a random direction: a pin in contact."""
        return self.sampled == "contact" and self.kind != "slide"

    @property
    def moments(self) -> tuple[Number, Number, Number, Number]:
        """Mean of the radial clearance, and its second to fourth central moment."""
        mean, second, third, fourth = self.law.moments if self.law is not None else (0.0,) * 4
        return self.radius + mean, second, third, fourth

    @property
    def spread(self) -> tuple[Number, Number]:
        """Mean and variance of each component [S2, eqs. 5, 6]."""
        mean, variance, _, _ = self.moments
        return 0.0, self.laws[self.analytic].variance * (variance + mean**2)

    @property
    def ends(self) -> tuple[Number, Number]:
        """Lowest and highest deviation: the largest clearance, in any direction or at each end of a slider."""
        largest = self.radius + (0.0 if self.law is None else self.law.high)
        return -largest, largest


class Made(NamedTuple):
    """Made mechanisms: varying places (radians, lengths), errors of drives and of loads, by name, shape (count,)."""

    places: dict[str, Floats]
    drives: dict[str, Floats]
    loads: dict[str, Floats]


@dataclass(frozen=True)
class Sources:
    """All random sources of a study; for the first order at poses of many designs their numbers are arrays of poses.

    Draws have the shape (variables, count): deviations of the scalars in their order (parameters first, then places,
    drives and loads), then each pin's radial clearance, and x and y of its place for a radial clearance of 1.
    """

    study: Study
    scalars: tuple[Scalar, ...]
    pins: tuple[Pin, ...]
    correlation: Correlation | None

    @property
    def all(self) -> tuple[Scalar | Pin, ...]:
        """Scalars, then pins, in the order of components."""
        return *self.scalars, *self.pins

    @property
    def owners(self) -> list[str]:
        """The source of each standard normal variable of `at`: scalars, then each pin's radius, x and y."""
        pins = [pin.name for pin in self.pins for _ in range(2 + (pin.law is not None))]
        return [scalar.name for scalar in self.scalars] + pins

    @property
    def circles(self) -> list[tuple[int, int]]:
        """Pairs of variables of `at` that are random directions: the places of pins in contact."""
        owners = self.owners
        ends = [len(owners) - owners[::-1].index(pin.name) for pin in self.pins if pin.directed]
        return [(end - 2, end - 1) for end in ends]

    def take(self, rows: Sequence[int] | Ints) -> Sources:
        """At some of many poses."""
        scalars, pins = tuple(s.take(rows) for s in self.scalars), tuple(pin.take(rows) for pin in self.pins)
        correlation = None if self.correlation is None else self.correlation.take(rows)
        return replace(self, scalars=scalars, pins=pins, correlation=correlation)

    def widened(self, factors: Sequence[Number] | Floats) -> Sources:
        """The sources with tolerances times factors, shape (sources,); of a clearance the radius and its tolerance.

        Factors of shape (sources, poses) give sources at these poses.
        """
        numbers: list[Number] = [float(factor) if np.ndim(factor) == 0 else np.asarray(factor) for factor in factors]
        scalars = tuple(replace(s, law=s.law.widened(f)) for s, f in zip(self.scalars, numbers, strict=False))
        pins = tuple(
            replace(p, radius=f * p.radius, law=None if p.law is None else p.law.scaled(f))
            for p, f in zip(self.pins, numbers[len(scalars) :], strict=True)
        )
        return replace(self, scalars=scalars, pins=pins)

    def correlated(self) -> Floats | None:
        """Correlation coefficients of the components of `all`, shape (components, components) or (poses, ...).

        None where all are independent.
        """
        if self.correlation is None:
            return None
        coefficients, count = self.correlation.coefficients, len(self.scalars)
        size = count + sum(len(pin.directions) for pin in self.pins)
        matrix = np.array(np.broadcast_to(np.eye(size), (*coefficients.shape[:-2], size, size)))
        matrix[..., :count, :count] = coefficients
        return matrix

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        """Draws of `count` mechanisms, shape (variables, count)."""
        if self.correlation is None:
            rows: list[Floats | float] = [scalar.law.draw(rng, count) for scalar in self.scalars]
        else:
            normal = self.correlation.root @ rng.standard_normal((len(self.scalars), count))
            rows = [scalar.law.at(u) for scalar, u in zip(self.scalars, normal, strict=True)]
        for pin in self.pins:
            radius = pin.radius if pin.law is None else pin.radius + pin.law.draw(rng, count)
            rows += [radius, *pin.laws[pin.sampled].draw(rng, count)]
        return np.array([np.broadcast_to(row, (count,)) for row in rows])

    def redraw_pins(self, drawn: Floats, rng: np.random.Generator) -> Floats:
        """Draws of the same mechanisms with new places of their pins in their holes."""
        drawn = drawn.copy()
        for pin, (_, *place) in zip(self.pins, self._by_pin(drawn), strict=True):
            place[0][:], place[1][:] = pin.laws[pin.sampled].draw(rng, drawn.shape[1])
        return drawn

    def at(self, u: Floats, *, directed: bool = False) -> Floats:
        """Draws at values of independent standard normal variables, shape (len(owners), count).

        If `directed`, the two variables of a pin in contact are the cosine and sine of its direction.
        """
        count = len(self.scalars)
        normal = u[:count] if self.correlation is None else self.correlation.root @ u[:count]
        rows: list[Floats | float] = [scalar.law.at(row) for scalar, row in zip(self.scalars, normal, strict=True)]
        rest = iter(u[count:])
        for pin in self.pins:
            rows.append(pin.radius if pin.law is None else pin.radius + pin.law.at(next(rest)))
            place = next(rest), next(rest)
            rows += place if directed and pin.directed else pin.laws[pin.sampled].at(*place)
        return np.array([np.broadcast_to(row, (u.shape[1],)) for row in rows])

    def _by_pin(self, drawn: Floats) -> Floats:
        """Radial clearances and places of the pins, shape (pins, 3, count)."""
        return drawn[len(self.scalars) :].reshape(-1, 3, drawn.shape[1])

    def components(self, drawn: Floats) -> Floats:
        """Deviations of the components of `all`, shape (components, count)."""
        pins = [radius * part for pin, (radius, *place) in zip(self.pins, self._by_pin(drawn), strict=True)
                for _, part in zip(pin.directions, place, strict=False)]  # fmt: skip
        return np.array([*drawn[: len(self.scalars)], *pins])

    def made(self, drawn: Floats) -> Made:
        """The made mechanisms of these draws, shape (variables, count)."""
        study, nominal = self.study, self.study.mechanism.nominal
        by_kind: dict[str, dict[str, Floats]] = {"parameter": {}, "place": {}, "drive": {}, "load": {}}
        for scalar, deviation in zip(self.scalars, drawn, strict=False):
            by_kind[scalar.kind][scalar.name] = deviation
        changed = {name: study.parameters.nominal[name] + value for name, value in by_kind["parameter"].items()}
        places: dict[str, Floats] = {
            name: np.asarray(value, dtype=float) for name, value in _geometric(study.parameters.places(changed)).items()
        }
        for name, deviation in by_kind["place"].items():
            places[name] = places.get(name, nominal[name]) + deviation
        for pin, (radius, x, y) in zip(self.pins, self._by_pin(drawn), strict=True):
            parts = radius * x, radius * y
            if pin.kind == "length":
                (name,) = pin.directions[0]
                places[name] = np.sqrt((places.get(name, nominal[name]) + parts[0]) ** 2 + parts[1] ** 2)
                continue
            for direction, part in zip(pin.directions, parts, strict=False):
                for name, slope in direction.items():
                    places[name] = places.get(name, nominal.get(name, 0.0)) + slope * part
        return Made(places, by_kind["drive"], by_kind["load"])


def find_sources(study: Study, poses: Poses | None = None) -> tuple[Sources, list[Caution]]:
    """Sources of a study, and warnings about parameters that vary several places together.

    `poses` of designs give numbers that are arrays of poses, for the first order.

    Raises
    ------
    StudyError
        If nothing varies, the correlations contradict each other, or the numbers of a design give no tolerance.
    """
    section = study.reliability
    if section is None or not (section.dimensions or section.clearances):
        message = "asks what varies: give 'dimensions' or 'clearances'"
        raise StudyError((study.problem(message, "reliability"),))
    mechanism: Mechanism = study.mechanism
    poses = Poses.single({}) if poses is None else poses
    section = poses.section(section)
    sizes: dict[str, Number] = {**study.sizes, **poses.places, **poses.parameters}
    scalars = []
    slopes: Mapping[str, Number]
    warnings: list[Caution] = []
    together: list[str] = []
    for name, dimension in section.dimensions.items():
        nominal = sizes.get(name, 0.0)
        if name in study.parameters.nominal:
            kind = "parameter"
            slopes = _geometric(study.parameters.derivatives(name, poses.parameters, poses.changed))
            moved = [place for place, slope in slopes.items() if np.any(slope)]
            dimensions = [place for place in moved if not place.startswith(MEASURED)]
            if not moved:
                idle = f"parameter '{name}' changes no dimension of the mechanism"
                warnings.append(Caution("ignored", idle))
            elif len(dimensions) > 1:
                together.append(f"'{name}' {', '.join(dimensions)}")
        else:
            kind, slopes = "load" if name in LOADS else "drive" if name in mechanism.drives else "place", {name: 1.0}
            if kind == "place":
                warnings += _twice(study, name, section.dimensions)
        moves = {place: (slope, _quantity(mechanism, place)) for place, slope in slopes.items()}
        turned = kind != "parameter" and moves[name][1] == "angle"
        factor = study.units.angle_factor if turned else 1.0
        unit = study.units.label(LOADS[name]) if kind == "load" else study.unit_of(name)
        scalars.append(Scalar(name, kind, _law(study, name, dimension, nominal, factor), moves, factor, unit))
    if together:
        parameters = "parameter that moves" if len(together) == 1 else "parameters that move"
        words = f"{parameters} several dimensions together: {'; '.join(together)}"
        warnings.append(Caution("assumed", words))
    scalars.sort(key=lambda scalar: ("parameter", "place", "drive", "load").index(scalar.kind))
    pins = tuple(_pin(study, name, clearance) for name, clearance in section.clearances.items())
    sources = Sources(study, tuple(scalars), pins, _correlation(section, scalars))
    _check_sizes(sources)
    return sources, warnings


def _law(study: Study, name: str, dimension: Dimension, nominal: Number, factor: float) -> Marginal:
    """The law of a dimension, in the core's units."""
    if dimension.measured is not None:
        values, about = dimension.deviations(nominal / factor, study.folder)
        return Measured.of(factor * values, factor * about, nominal)
    try:
        flaw = dimension.flaw(nominal)
        if not flaw:
            return marginal(dimension, nominal, factor)
    except ToleranceClassError as error:
        flaw = str(error)
    raise StudyError((study.problem(flaw, "reliability", "dimensions", name),))


def _quantity(mechanism: Mechanism, name: str) -> str:
    """Quantity of a place, a drive or a load."""
    places = mechanism.description.places
    return LOADS[name] if name in LOADS else places[name].quantity if name in places else mechanism.quantity(name)


def _check_sizes(sources: Sources) -> None:
    """Raise a StudyError for deviations so large that their squares overflow."""
    study, size = sources.study, sources.study.mechanism.size or 1.0
    loads = (MAX_LOAD, "1e100")
    most = {"angle": (MAX_DEVIATION, "a million radians"), "force": loads, "moment": loads, "none": loads}
    for scalar in sources.scalars:
        for slope, quantity in scalar.moves.values():
            allowed, words = most.get(quantity, (MAX_DEVIATION * size, "a million times the size of the mechanism"))
            if not max(np.max(np.abs(slope * end)) for end in scalar.ends) <= allowed:
                message = f"varies by more than {words}; look at its unit"
                raise StudyError((study.problem(message, "reliability", "dimensions", scalar.name),))
    for pin in sources.pins:
        if not np.max(pin.ends[1]) <= MAX_DEVIATION * size:
            message = "is more than a million times the size of the mechanism; look at its unit"
            raise StudyError((study.problem(message, "reliability", "clearances", pin.name),))


def _twice(study: Study, place: str, varying: Collection[str]) -> list[Caution]:
    """What is to be known of a place that varies by itself and with a parameter that sets it."""
    both = [name for name in study.parameters.nominal
            if name in varying and study.parameters.derivatives(name).get(place)]  # fmt: skip
    return [
        Caution(
            "assumed",
            f"'{place}' varies by its own tolerance, and with parameter '{name}': both count, as independent errors "
            "that add up; leave one of them out if they are the same error",
        )
        for name in both
    ]


def _correlation(section: ReliabilitySection, scalars: Sequence[Scalar]) -> Correlation | None:
    if not section.correlation:
        return None
    place = {scalar.name: k for k, scalar in enumerate(scalars)}
    pairs = {(place[pair.one], place[pair.other]): pair.coefficient for pair in section.correlation}
    return Correlation.of([scalar.law for scalar in scalars], pairs)


def _pin(study: Study, name: str, clearance: Clearance) -> Pin:
    if flaw := clearance.flaw():
        raise StudyError((study.problem(flaw, "reliability", "clearances", name),))
    joints, spread, radius = study.mechanism.description.joints, clearance.radius_spread, clearance.radius
    law = None if spread is None else marginal(spread, radius)
    if clearance.fit is not None:
        law = fit_law(clearance.distribution, clearance.fit.hole, clearance.fit.shaft, radius)
    kind = "slide" if name in joints else clearance.effect
    pin = Pin(name, radius, law, clearance.pin.analytic, clearance.pin.monte_carlo, kind, ())
    if kind == "slide":
        return replace(pin, directions=_slider(joints[name], clearance.length))
    if clearance.link is None:
        raise StudyError(f"reliability.clearances.{name}: name the 'link' whose pin moves")
    moved = (f"{clearance.link}.length",) if kind == "length" else offset_names(clearance.link, name)
    return replace(pin, directions=tuple({place: 1.0} for place in moved))


def _slider(joint: Joint, length: Number | None) -> tuple[dict[str, Number], ...]:
    """Directions of the rear and front end of a slider: it shifts by their mean and tilts by their difference/length.

    A pin in a slot only shifts.
    """
    offset = slide_offset(joint.name)
    if length is None or not isinstance(joint, Prismatic):
        return ({offset: 1.0},)
    return tuple({offset: 0.5, str(joint.angle): slope} for slope in (-1.0 / length, 1.0 / length))


def _geometric(values: Mapping[str, Number]) -> dict[str, Number]:
    """Values without the limits of motion, which apply to the nominal mechanism only."""
    return {name: value for name, value in values.items() if not name.startswith("limits.")}
