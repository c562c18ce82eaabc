"""From parameters to the numbers of the geometry, for one design or thousands at once."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from mechdesign.ground.expressions import Expression, Number
from mechdesign.mechanism.elements.couplings import MEASURED
from mechdesign.mechanism.model import Place


@dataclass(frozen=True)
class Parameters:
    """Parameters of a study and the places of the geometry that depend on them."""

    # Values of the parameters, as the study gives them: numbers without a unit.
    nominal: Mapping[str, float] = field(default_factory=dict)
    # Parameters that depend on parameters above them, in the study's order; places that depend on parameters.
    formulas: Mapping[str, Expression] = field(default_factory=dict)
    dependent: Mapping[str, Expression] = field(default_factory=dict)
    # Every place; radians per study unit for an angle, 1 for a length.
    factors: Mapping[str, float] = field(default_factory=dict)
    # Places without numbers in the study, which are measured in its sketch.
    measured: frozenset[str] = frozenset()
    # Parameters that are written with a unit, and the kinds of their quantities.
    kinds: Mapping[str, str] = field(default_factory=dict)
    # Parameters in the expressions of the sketch's points.
    sketched: frozenset[str] = frozenset()

    def moved(self, names: Collection[str]) -> set[str]:
        """Those of the names that are parameters, and the parameters that follow from them."""
        moving = {name for name in names if name in self.nominal}
        for name, formula in self.formulas.items():
            if formula.names & moving:
                moving.add(name)
        return moving

    def moved_places(self, names: Collection[str]) -> set[str]:
        """Places that are among the names, or follow from one of them."""
        parameters = self.moved(names)
        followers = {place for place, formula in self.dependent.items() if formula.names & parameters}
        return {*followers, *(name for name in names if name in self.factors)}

    def values(self, changed: Mapping[str, ArrayLike]) -> dict[str, Number]:
        """All parameters where some have other values; those that depend on them follow."""
        env: dict[str, Number] = dict(self.nominal)
        moved = self.moved(changed)
        env |= {name: _number(changed[name]) for name in moved if name in changed}
        for name, formula in self.formulas.items():
            if name in moved and name not in changed:
                env[name] = formula.evaluate(env)
        return env

    def places(self, changed: Mapping[str, ArrayLike]) -> dict[str, Number]:
        """Places that differ from the nominal geometry where parameters or places have other values.

        Values are given in the study's units, and broadcast against each other; places come as lengths in the study's
        unit and angles in radians.

        Raises
        ------
        KeyError
            If a name is neither a parameter nor a place.
        """
        for name in changed:
            if name not in self.nominal and name not in self.factors:
                raise KeyError(name)
        env, moved = self.values(changed), self.moved_places(changed)
        # A place with a value of its own no longer follows parameters.
        return {
            place: (_number(changed[place]) if place in changed else self.dependent[place].evaluate(env)) * factor
            for place, factor in self.factors.items()
            if place in moved
        }

    def derivatives(
        self, name: str, values: Mapping[str, Number] = MappingProxyType({}), changed: Collection[str] = ()
    ) -> dict[str, Number]:
        """Derivative of every place that depends on a parameter (or is the place `name`).

        Lengths in the study's unit and angles in radians, per unit of the parameter as the study gives it; at the
        nominal values, or other `values` of parameters. What is `changed` itself follows nothing.
        """
        if name not in self.nominal:
            return {name: self.factors[name]}
        env: dict[str, Number] = {**self.nominal, **values}
        slopes: dict[str, Number] = {name: 1.0}
        for other, formula in self.formulas.items():
            if other != name and other not in changed and formula.names & slopes.keys():
                slopes[other] = _slope(formula, env, slopes)
        return {place: _slope(formula, env, slopes) * self.factors[place] for place, formula in self.dependent.items()
                if place not in changed and formula.names & slopes.keys()}  # fmt: skip

    def kind(self, name: str, places: Mapping[str, Place]) -> str | None:
        """Kind of quantity of a parameter: the only one of `needed`, or else that of its unit; None where not known."""
        needed = self.needed(name, places)
        return needed.pop() if len(needed) == 1 else self.kinds.get(name)

    def needed(self, name: str, places: Mapping[str, Place]) -> set[str]:
        """Quantities of the numbers of the geometry (`places`) that change as much as a parameter does."""
        slopes = self.derivatives(name).items()
        kinds: set[str] = {places[place].quantity for place, slope in slopes if abs(slope) == self.factors[place]}
        return kinds - {"none"}

    def match(self, pattern: str) -> tuple[str, ...]:
        """Places that a pattern such as ``*.length`` names."""
        return tuple(place for place in self._dimensions() if fnmatchcase(place, pattern))

    def names(self) -> Iterable[str]:
        """Names of all parameters and dimensions."""
        return [*self.nominal, *self._dimensions()]

    def _dimensions(self) -> Iterator[str]:
        """Places of the geometry, without those of parameters in measures."""
        return (place for place in self.factors if not place.startswith(MEASURED))


def _slope(formula: Expression, values: Mapping[str, Number], slopes: Mapping[str, Number]) -> Number:
    partials = formula.derivatives(values)
    return sum((partials[name] * slopes[name] for name in partials if name in slopes), start=0.0)


def _number(value: ArrayLike) -> Number:
    return float(value) if isinstance(value, int | float) else np.asarray(value, dtype=float)
