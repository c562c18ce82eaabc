"""The random sources of a made mechanism: dimensions, clearances, drives and loads, mapped onto the geometry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from mechdesign.ground.expressions import Number
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.mechanism.algebra import times
from mechdesign.mechanism.elements.declared import Quantity
from mechdesign.questions.reliability.copula import Correlation
from mechdesign.questions.reliability.forces import FOLLOWED
from mechdesign.questions.reliability.laws import Marginal, at_rows
from mechdesign.questions.reliability.pin_laws import PIN_LAWS, SLIDE_LAWS, PlaceLaw
from mechdesign.study import Study


@dataclass(frozen=True)
class Scalar:
    """A dimension that varies: by `kind` a ``parameter`` (in its own unit), a ``place``, a ``drive`` or a ``load``.

    `moves` maps each place, drive or load that it changes onto the derivative (radians, lengths) and the quantity; a
    parameter that forces follow stands among them by its `FOLLOWED` name. `factor` is one `unit` of the study in
    radians, lengths or loads; the unit of a parameter may be unknown (None).
    """

    name: str
    kind: str
    law: Marginal
    moves: Mapping[str, tuple[Number, str]]
    factor: float
    unit: str | None

    def take(self, rows: Sequence[int] | Ints) -> Scalar:
        """At some of many poses."""
        moves = {name: (at_rows(slope, rows), quantity) for name, (slope, quantity) in self.moves.items()}
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

    @property
    def reaches(self) -> list[tuple[str, Number]]:
        """Largest deviation of each place, drive or load, with its quantity."""
        return [(quantity, np.maximum(*(np.abs(slope * end) for end in self.ends)))
                for slope, quantity in self.moves.values()]  # fmt: skip


@dataclass(frozen=True)
class Pin:
    """A clearance of a pin or a slide, or the backlash of a coupling: its mean radius, and the law of its deviation.

    `analytic` and `sampled` name the laws of its place for the analytic methods and for those that sample. The place
    has two components: x and y of a pin, or the two ends of a slider; a coupling, or a pin in a slot, has the first
    alone. `directions` has, for each component that changes
    the geometry, the derivatives of the places: of the offsets of the pin's point in its link, of the link's length, or
    of the slide's offset and angle, or of the coupling's play. `kind` is ``offset``, ``length``, or ``slide`` of all
    that lies between two ends. Its radius is a length, or an angle (radians) by its `quantity`.
    """

    name: str
    radius: Number
    law: Marginal | None
    analytic: str
    sampled: str
    kind: str
    directions: tuple[Mapping[str, Number], ...]
    quantity: Quantity = "length"

    def take(self, rows: Sequence[int] | Ints) -> Pin:
        """At some of many poses."""
        directions = tuple(
            {name: at_rows(slope, rows) for name, slope in direction.items()} for direction in self.directions
        )
        law = None if self.law is None else self.law.take(rows)
        return replace(self, radius=at_rows(self.radius, rows), law=law, directions=directions)

    @property
    def laws(self) -> Mapping[str, PlaceLaw]:
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

    @property
    def reaches(self) -> list[tuple[str, Number]]:
        """The largest clearance, with its quantity."""
        return [(self.quantity, self.ends[1])]


class Made(NamedTuple):
    """Made mechanisms: varying places (radians, lengths), errors of drives and of loads, by name, shape (count,).

    `parameters` are deviations of those that the numbers of dynamics follow, by their `FOLLOWED` names.
    """

    places: dict[str, Floats]
    drives: dict[str, Floats]
    loads: dict[str, Floats]
    parameters: dict[str, Floats]


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

    @cached_property
    def directions(self) -> tuple[list[str], Floats]:
        """Names of places, drives and loads, and their derivatives by the components, shape (components, names).

        Of shape (components, names, poses) where poses differ in them.
        """
        directions = [direction for source in self.all for direction in source.directions]
        names = list(dict.fromkeys(name for direction in directions for name in direction))
        slopes = np.stack(np.broadcast_arrays(*(part.get(name, 0.0) for part in directions for name in names)))
        return names, slopes.reshape(len(directions), len(names), *slopes.shape[1:])

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
        drawn = np.empty((len(self.scalars) + 3 * len(self.pins), count))
        if self.correlation is None:
            for scalar, row in zip(self.scalars, drawn, strict=False):
                scalar.law.draw(rng, row)
        else:
            normal = self.correlation.root @ rng.standard_normal((len(self.scalars), count))
            for scalar, row, u in zip(self.scalars, drawn, normal, strict=False):
                row[:] = scalar.law.at(u)
        for pin, parts in zip(self.pins, self._by_pin(drawn), strict=True):
            if pin.law is None:
                parts[0] = pin.radius
            else:
                pin.law.draw(rng, parts[0])
                parts[0] += pin.radius
            pin.laws[pin.sampled].draw(rng, parts[1:])
        return drawn

    def redraw_pins(self, drawn: Floats, rng: np.random.Generator) -> Floats:
        """Draws of the same mechanisms with new places of their pins in their holes."""
        drawn = drawn.copy()
        for pin, parts in zip(self.pins, self._by_pin(drawn), strict=True):
            pin.laws[pin.sampled].draw(rng, parts[1:])
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
        values = geometric(study.parameters.places(changed))
        places: dict[str, Any] = {name: np.asarray(value, dtype=float) for name, value in values.items()}

        def shift(direction: Mapping[str, Number], deviation: Floats) -> None:
            for name, slope in direction.items():
                places[name] = places.get(name, nominal.get(name, 0.0)) + times(slope, deviation)

        for name, deviation in by_kind["place"].items():
            shift({name: 1.0}, deviation)
        for pin, (radius, x, y) in zip(self.pins, self._by_pin(drawn), strict=True):
            if pin.kind == "length":
                (name,) = pin.directions[0]
                places[name] = np.sqrt((places.get(name, nominal[name]) + radius * x) ** 2 + (radius * y) ** 2)
                continue
            for direction, part in zip(pin.directions, (x, y), strict=False):
                shift(direction, radius * part)
        parameters = {f"{FOLLOWED}{name}": value for name, value in by_kind["parameter"].items()}
        followed = {name for scalar in self.scalars for name in scalar.moves}
        parameters = {name: value for name, value in parameters.items() if name in followed}
        return Made(places, by_kind["drive"], by_kind["load"], parameters)


def geometric(values: Mapping[str, Number]) -> dict[str, Number]:
    """Values without the limits of motion, which apply to the nominal mechanism only."""
    return {name: value for name, value in values.items() if not name.startswith("limits.")}
