"""What varies when a mechanism is made: dimensions, clearances, drives and loads, mapped onto the geometry."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

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
class Scalar:
    """A dimension that varies: a ``parameter``, a ``place``, a ``drive`` or a ``load``.

    Parameters
    ----------
    law : Marginal
        Of a parameter in its own unit, of an angle in radians.
    moves : mapping of str to (float, str)
        Derivative of each place, drive or load that it changes (radians, lengths), and the quantity of that.
    """

    name: str
    kind: str
    law: Marginal
    moves: Mapping[str, tuple[float, str]]

    @property
    def directions(self) -> list[dict[str, float]]:
        """Of the single component, derivatives of places, drives and loads."""
        return [{name: slope for name, (slope, _) in self.moves.items()}]

    @property
    def spread(self) -> tuple[float, float]:
        """Mean and variance."""
        return self.law.moments[:2]

    @property
    def ends(self) -> tuple[float, float]:
        """Lowest and highest deviation: the tolerance."""
        return self.law.ends


@dataclass(frozen=True)
class Pin:
    """A clearance.

    Parameters
    ----------
    radius : float
        Mean radial clearance.
    law : Marginal or None
        Of its deviation.
    analytic, sampled : str
        Laws of the pin's place, of the analytic methods and of those that sample.
    places : tuple of str
        What the pin moves: the offsets of its point in its link, or the link's length.
    factor : float
        Of the radial clearance, its mean and its deviation alike.
    """

    name: str
    radius: float
    law: Marginal | None
    analytic: str
    sampled: str
    places: tuple[str, ...]
    factor: float = 1.0

    @property
    def moments(self) -> tuple[float, float, float, float]:
        """Mean of the radial clearance, and its second to fourth central moment."""
        mean, *central = (0.0,) * 4 if self.law is None else self.law.moments
        second, third, fourth = (self.factor**k * moment for k, moment in enumerate(central, start=2))
        return self.factor * (self.radius + mean), second, third, fourth

    @property
    def directions(self) -> list[dict[str, float]]:
        """Of the components x and y. Along a binary link the pin changes its length; across it, in the second order."""
        return [{name: 1.0} for name in self.places]

    @property
    def spread(self) -> tuple[float, float]:
        """Mean and variance of each component [S2, eqs. 5, 6]."""
        mean, variance, _, _ = self.moments
        return 0.0, PIN_LAWS[self.analytic].variance * (variance + mean**2)

    @property
    def ends(self) -> tuple[float, float]:
        """The largest radial clearance in any direction."""
        largest = self.factor * (self.radius + (0.0 if self.law is None else self.law.ends[1]))
        return -largest, largest


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
    def all(self) -> tuple[Scalar | Pin, ...]:
        """Each with its name, as the study gives it."""
        return *self.scalars, *self.pins

    @property
    def owners(self) -> list[str]:
        """The source of each standard normal variable of `at`: scalars, then each pin's radius, x and y."""
        pins = [pin.name for pin in self.pins for _ in range(2 + (pin.law is not None))]
        return [scalar.name for scalar in self.scalars] + pins

    def widened(self, factors: Sequence[float] | Floats) -> Sources:
        """The same where tolerances are as many times as wide; of a clearance, the radius and its tolerance."""
        each = [float(factor) for factor in factors]
        scalars = tuple(replace(s, law=s.law.widened(f)) for s, f in zip(self.scalars, each, strict=False))
        pins = tuple(replace(p, factor=f) for p, f in zip(self.pins, each[len(scalars) :], strict=True))
        return replace(self, scalars=scalars, pins=pins)

    def correlated(self) -> Floats | None:
        """Correlation coefficients of the components of `all`; None where all are independent."""
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
            radii.append(pin.factor * (pin.radius if pin.law is None else pin.radius + pin.law.draw(rng, count)))
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
            row += 2 + (pin.law is not None)
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
            radii.append(pin.factor * (pin.radius if pin.law is None else pin.radius + pin.law.at(next(rest))))
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
        nominal = 0.0
        if name in study.parameters.nominal:
            kind, nominal = "parameter", study.parameters.nominal[name]
            slopes = _geometric(study.parameters.derivatives(name))
            moved = [place for place, slope in slopes.items() if slope]
            if not moved:
                warnings.append(f"parameter '{name}' changes no dimension of the mechanism")
            elif len(moved) > 1:
                warnings.append(f"parameter '{name}' varies {', '.join(moved)} together")
        else:
            kind, slopes = "load" if name in LOADS else "drive" if name in mechanism.drives else "place", {name: 1.0}
            if kind == "place":
                nominal = mechanism.nominal[name]
                warnings += _twice(study, name, section.dimensions)
        moves = {place: (slope, _quantity(mechanism, place)) for place, slope in slopes.items()}
        turned = kind != "parameter" and moves[name][1] == "angle"
        law = marginal(dimension, nominal, study.units.angle_factor if turned else 1.0)
        scalars.append(Scalar(name, kind, law, moves))
    scalars.sort(key=lambda scalar: ("parameter", "place", "drive", "load").index(scalar.kind))
    pins = tuple(_pin(point, clearance) for point, clearance in section.clearances.items())
    sources = Sources(study, tuple(scalars), pins, _correlation(study, scalars))
    _check_sizes(sources)
    return sources, warnings


def _quantity(mechanism: Mechanism, name: str) -> str:
    """Quantity of a place, a drive or a load."""
    places = mechanism.description.places
    return LOADS[name] if name in LOADS else places[name].quantity if name in places else mechanism.quantity(name)


def _check_sizes(sources: Sources) -> None:
    """Refuse what no mechanism of this size varies by: its squares are no numbers any more."""
    study, size = sources.study, sources.study.mechanism.size or 1.0
    most = {"angle": (MOST, "a million radians"), "force": (HEAVY, "1e100"), "moment": (HEAVY, "1e100")}
    for scalar in sources.scalars:
        for slope, quantity in scalar.moves.values():
            allowed, words = most.get(quantity, (MOST * size, "a million times the size of the mechanism"))
            if not max(abs(slope * end) for end in scalar.law.ends) <= allowed:
                message = f"varies by more than {words}"
                raise StudyError((study.problem(message, "reliability", "dimensions", scalar.name),))
    for pin in sources.pins:
        if not pin.ends[1] <= MOST * size:
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
