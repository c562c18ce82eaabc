"""What varies when a mechanism is made: dimensions, clearances, drives and loads, mapped onto the geometry."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mechdesign.analyses.reliability.correlation import Correlation
from mechdesign.analyses.reliability.marginals import Marginal, marginal
from mechdesign.analyses.reliability.pins import PIN_LAWS
from mechdesign.errors import StudyError
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.geometry import offset_names
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.study import Study
from mechdesign.study.schema.reliability import LOADS, Clearance

# Of all that varies, in radians or in sizes of the mechanism; of loads.
MOST, HEAVY = 1e6, 1e100


@dataclass(frozen=True)
class Source:
    """One random source as the first-order analysis sees it.

    Parameters
    ----------
    name : str
        As the study names it: a parameter, a place, a drive, a load or a joint.
    directions : tuple of mapping
        Per independent component (one, or a pin's x and y), derivatives of places, drives and loads (radians, lengths).
    mean, variance : float
        Of each component (a parameter's in its own unit, an angle's in radians).
    ends : (float, float)
        Lowest and highest deviation: the tolerance, or of a pin the largest radial clearance in any direction.
    """

    name: str
    directions: tuple[Mapping[str, float], ...]
    mean: float
    variance: float
    ends: tuple[float, float]


@dataclass(frozen=True)
class Scalar:
    """A dimension that varies: a ``parameter``, a ``place``, a ``drive`` or a ``load``."""

    name: str
    kind: str
    law: Marginal


@dataclass(frozen=True)
class Pin:
    """A clearance.

    Parameters
    ----------
    radius : float
        Mean radial clearance.
    spread : Marginal or None
        Law of its deviation.
    places : tuple of str
        What the pin moves: the offsets of its point in its link, or the link's length.
    """

    name: str
    radius: float
    spread: Marginal | None
    analytic: str
    sampled: str
    places: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Drawn:
    """Values of all that varies, each array of shape (count,) or a number.

    Parameters
    ----------
    scalars : list of ndarray
        Deviations, in the order of `Sources.scalars`.
    radii : list of (ndarray or float)
        Radial clearances, in the order of `Sources.pins`.
    pins : list of (ndarray, ndarray)
        Places of the pins for a radial clearance of 1.
    """

    scalars: list[Floats]
    radii: list[Floats | float]
    pins: list[tuple[Floats, Floats]]

    def take(self, chosen: Flags) -> Drawn:
        """Some of them."""
        return Drawn(
            [values[chosen] for values in self.scalars],
            [radius if isinstance(radius, float) else radius[chosen] for radius in self.radii],
            [(x[chosen], y[chosen]) for x, y in self.pins],
        )


@dataclass(frozen=True, eq=False)
class Made:
    """Made mechanisms.

    Parameters
    ----------
    places : dict of str to ndarray, shape (count,)
        Places that vary (radians, lengths).
    drives, loads : dict of str to ndarray, shape (count,)
        Errors of drives (radians, lengths), and of components of the load.
    """

    places: dict[str, Floats]
    drives: dict[str, Floats]
    loads: dict[str, Floats]


@dataclass(frozen=True)
class Sources:
    """All that varies in a study.

    Parameters
    ----------
    scalars : tuple of Scalar
        Parameters first, then places, drives and loads.
    correlation : Correlation or None
        Of the scalars.
    """

    study: Study
    scalars: tuple[Scalar, ...]
    pins: tuple[Pin, ...]
    correlation: Correlation | None

    @property
    def owners(self) -> tuple[str, ...]:
        """The source of each standard normal variable of `at`: scalars, then each pin's radius, x and y."""
        return (*(scalar.name for scalar in self.scalars),
                *(pin.name for pin in self.pins for _ in range(2 + (pin.spread is not None))))  # fmt: skip

    @cached_property
    def first_order(self) -> tuple[Source, ...]:
        """Sources with the pins' variances of the analytic method [S2, eqs. 5, 6]."""
        found = []
        for scalar in self.scalars:
            mean, variance, _, _ = scalar.law.moments
            slopes = {scalar.name: 1.0}
            if scalar.kind == "parameter":
                # Of one that changes nothing there are none.
                slopes = _geometric(self.study.parameters.derivatives(scalar.name))
            found.append(Source(scalar.name, (slopes,), mean, variance, scalar.law.ends))
        for pin in self.pins:
            mean, variance, _, _ = (0.0, 0.0, 0.0, 0.0) if pin.spread is None else pin.spread.moments
            spread = PIN_LAWS[pin.analytic].variance * (variance + (pin.radius + mean) ** 2)
            reach = pin.radius + (0.0 if pin.spread is None else pin.spread.ends[1])
            # Along a binary link the pin changes its length; across it, only in the second order.
            found.append(Source(pin.name, tuple({name: 1.0} for name in pin.places), 0.0, spread, (-reach, reach)))
        return tuple(found)

    def correlated(self) -> Floats | None:
        """Correlation coefficients of the components of `first_order`; None where all are independent."""
        if self.correlation is None:
            return None
        count = len(self.scalars) + sum(len(pin.places) for pin in self.pins)
        found = np.eye(count)
        found[: len(self.scalars), : len(self.scalars)] = self.correlation.coefficients
        return found

    def draw(self, rng: np.random.Generator, count: int) -> Drawn:
        """Draw what varies in `count` mechanisms."""
        if self.correlation is None:
            scalars = [scalar.law.draw(rng, count) for scalar in self.scalars]
        else:
            normal = self.correlation.mix(rng.standard_normal((len(self.scalars), count)))
            scalars = [scalar.law.at(u) for scalar, u in zip(self.scalars, normal, strict=True)]
        radii: list[Floats | float] = []
        pins = []
        for pin in self.pins:
            radii.append(pin.radius if pin.spread is None else pin.radius + pin.spread.draw(rng, count))
            pins.append(PIN_LAWS[pin.sampled].draw(rng, count))
        return Drawn(scalars, radii, pins)

    def redraw_pins(self, drawn: Drawn, rng: np.random.Generator, count: int) -> Drawn:
        """The same mechanisms with their pins elsewhere in their holes."""
        return Drawn(drawn.scalars, drawn.radii, [PIN_LAWS[pin.sampled].draw(rng, count) for pin in self.pins])

    @property
    def circles(self) -> list[tuple[int, int]]:
        """The variables of `at` of which the direction alone counts: the places of pins in contact."""
        found, row = [], len(self.scalars)
        for pin in self.pins:
            row += 2 + (pin.spread is not None)
            if pin.sampled == "contact":
                found.append((row - 2, row - 1))
        return found

    def at(self, u: Floats, *, directed: bool = False) -> Drawn:
        """What varies at values of independent standard normal variables, shape (len(owners), count).

        Where `directed`, the two of a pin in contact are the cosine and sine of its direction.
        """
        count = len(self.scalars)
        normal = u[:count] if self.correlation is None else self.correlation.mix(u[:count])
        scalars = [scalar.law.at(row) for scalar, row in zip(self.scalars, normal, strict=True)]
        rest = iter(u[count:])
        radii: list[Floats | float] = []
        pins = []
        for pin in self.pins:
            radii.append(pin.radius if pin.spread is None else pin.radius + pin.spread.at(next(rest)))
            place = next(rest), next(rest)
            given = directed and pin.sampled == "contact"
            pins.append(place if given else PIN_LAWS[pin.sampled].at(*place))
        return Drawn(scalars, radii, pins)

    def made(self, drawn: Drawn) -> Made:
        """The mechanisms that are made so."""
        study, nominal = self.study, self.study.mechanism.nominal
        by_kind: dict[str, dict[str, Floats]] = {"parameter": {}, "place": {}, "drive": {}, "load": {}}
        for scalar, deviation in zip(self.scalars, drawn.scalars, strict=True):
            by_kind[scalar.kind][scalar.name] = deviation
        changed = {name: study.parameters.nominal[name] + value for name, value in by_kind["parameter"].items()}
        places: dict[str, Floats] = {
            name: np.asarray(value, dtype=float) for name, value in _geometric(study.parameters.places(changed)).items()
        }
        for name, deviation in by_kind["place"].items():
            places[name] = places.get(name, nominal[name]) + deviation
        for pin, radius, (x, y) in zip(self.pins, drawn.radii, drawn.pins, strict=True):
            along, across = radius * x, radius * y
            if len(pin.places) == 1:
                (name,) = pin.places
                along += places.get(name, nominal[name])
                along *= along
                across *= across
                along += across
                places[name] = np.sqrt(along, out=along)
            else:
                places.update(zip(pin.places, (along, across), strict=True))
        return Made(places, by_kind["drive"], by_kind["load"])


def find_sources(study: Study) -> tuple[Sources, list[str]]:
    """Sources of a study, and warnings about parameters that vary several places together.

    Raises
    ------
    StudyError
        If nothing varies, or the correlations do not go together.
    """
    section = study.reliability
    if section is None or not (section.dimensions or section.clearances):
        message = "asks what varies: give 'dimensions' or 'clearances'"
        raise StudyError((study.problem(message, "reliability"),))
    mechanism: Mechanism = study.mechanism
    scalars = []
    warnings = []
    for name, dimension in section.dimensions.items():
        nominal, factor = 0.0, 1.0
        if name in study.parameters.nominal:
            kind, nominal = "parameter", study.parameters.nominal[name]
            moved = [place for place, slope in _geometric(study.parameters.derivatives(name)).items() if slope]
            if not moved:
                warnings.append(f"parameter '{name}' changes no dimension of the mechanism")
            elif len(moved) > 1:
                warnings.append(f"parameter '{name}' varies {', '.join(moved)} together")
        elif name in LOADS:
            kind = "load"
        else:
            kind = "drive" if name in mechanism.drives else "place"
            quantity = mechanism.quantity(name) if kind == "drive" else mechanism.description.places[name].quantity
            factor = study.units.angle_factor if quantity == "angle" else 1.0
            nominal = mechanism.nominal[name] if kind == "place" else 0.0
            if kind == "place":
                warnings += _twice(study, name, section.dimensions)
        scalars.append(Scalar(name, kind, marginal(dimension, nominal, factor)))
    scalars.sort(key=lambda scalar: ("parameter", "place", "drive", "load").index(scalar.kind))
    pins = tuple(_pin(point, clearance) for point, clearance in section.clearances.items())
    sources = Sources(study, tuple(scalars), pins, _correlation(study, scalars))
    _check_sizes(sources)
    return sources, warnings


def _check_sizes(sources: Sources) -> None:
    """Refuse what no mechanism of this size varies by: its squares are no numbers any more."""
    study, mechanism = sources.study, sources.study.mechanism
    for scalar in sources.scalars:
        slopes = {scalar.name: 1.0}
        if scalar.kind == "parameter":
            slopes = _geometric(study.parameters.derivatives(scalar.name))
        for name, slope in slopes.items():
            drive = scalar.kind == "drive"
            angle = (
                scalar.kind != "load"
                and (mechanism.quantity(name) if drive else mechanism.description.places[name].quantity) == "angle"
            )
            most = HEAVY if scalar.kind == "load" else MOST * (1.0 if angle else mechanism.size or 1.0)
            if not max(abs(slope * end) for end in scalar.law.ends) <= most:
                size = "a million radians" if angle else "a million times the size of the mechanism"
                message = f"varies by more than {'1e100' if scalar.kind == 'load' else size}"
                raise StudyError((study.problem(message, "reliability", "dimensions", scalar.name),))
    for pin in sources.pins:
        if not pin.radius + (0.0 if pin.spread is None else pin.spread.ends[1]) <= MOST * (mechanism.size or 1.0):
            message = "is more than a million times the size of the mechanism"
            raise StudyError((study.problem(message, "reliability", "clearances", pin.name),))


def _twice(study: Study, place: str, varying: Collection[str]) -> list[str]:
    """What is to be known of a place that varies by itself and with a parameter that sets it."""
    both = [name for name in study.parameters.nominal
            if name in varying and study.parameters.derivatives(name).get(place)]  # fmt: skip
    return [
        f"'{place}' varies by its own tolerance, and with parameter '{name}': both count, as independent errors that "
        "add up; leave one of them out if they are the same error"
        for name in both
    ]


def _correlation(study: Study, scalars: Sequence[Scalar]) -> Correlation | None:
    assert study.reliability is not None
    given = study.reliability.correlation
    if not given:
        return None
    place = {scalar.name: k for k, scalar in enumerate(scalars)}
    pairs = {(place[pair.one], place[pair.other]): pair.coefficient for pair in given}
    return Correlation.of([scalar.law for scalar in scalars], pairs)


def _pin(point: str, clearance: Clearance) -> Pin:
    link = clearance.link
    if link is None:
        raise StudyError(f"reliability.clearances.{point}: name the 'link' whose pin moves")
    spread = clearance.radius_spread
    return Pin(
        point, clearance.radius, None if spread is None else marginal(spread, clearance.radius),
        clearance.pin.analytic, clearance.pin.monte_carlo,
        (f"{link}.length",) if clearance.effect == "length" else offset_names(link, point),
    )  # fmt: skip


def _geometric(values: Mapping[str, object]) -> dict[str, float]:
    """Leave out the limits of motion: they are judged on the nominal mechanism."""
    return {name: value for name, value in values.items() if not name.startswith("limits.")}  # type: ignore[misc]
