"""From parameters to the numbers of the geometry, for one design or thousands at once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase

import numpy as np
from numpy.typing import ArrayLike

from mechdesign.expressions import Expression, Number


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
    # Places that the study leaves out and that are so measured from its sketch.
    measured: frozenset[str] = frozenset()

    def values(self, changed: Mapping[str, ArrayLike]) -> dict[str, Number]:
        """All parameters where some have other values; those that depend on them follow."""
        env: dict[str, Number] = dict(self.nominal)
        moved = {name for name in changed if name in env}
        for name in moved:
            env[name] = _number(changed[name])
        for name, formula in self.formulas.items():
            if name not in changed and formula.names & moved:
                env[name] = formula.evaluate(env)
                moved.add(name)
        return env

    def places(self, changed: Mapping[str, ArrayLike]) -> dict[str, Number]:
        """Places that differ from the nominal geometry where parameters or places have other values.

        Parameters
        ----------
        changed : mapping of str to array_like
            Values, in the study's units, of parameters or of single places; arrays broadcast against each other.

        Returns
        -------
        dict of str to float or ndarray
            Lengths in the study's unit, angles in radians.

        Raises
        ------
        KeyError
            If a name is neither a parameter nor a place.
        """
        for name in changed:
            if name not in self.nominal and name not in self.factors:
                raise KeyError(name)
        env = self.values(changed)
        moved = {name for name in env if env[name] is not self.nominal[name]}
        result: dict[str, Number] = {
            place: formula.evaluate(env) * self.factors[place]
            for place, formula in self.dependent.items()
            if formula.names & moved
        }
        # A place that is set by itself varies alone, whatever gives its nominal value.
        for name in changed:
            if name in self.factors:
                result[name] = _number(changed[name]) * self.factors[name]
        return result

    def derivatives(self, name: str) -> dict[str, float]:
        """Derivative of every place that depends on a parameter (or is the place `name`), at the nominal values.

        Lengths in the study's unit and angles in radians, per unit of the parameter as the study gives it.
        """
        if name not in self.nominal:
            return {name: self.factors[name]}
        slopes: dict[str, float] = {name: 1.0}
        for other, formula in self.formulas.items():
            slope = self._slope(formula, slopes)
            if other != name and slope is not None:
                slopes[other] = slope
        found: dict[str, float] = {}
        for place, formula in self.dependent.items():
            slope = self._slope(formula, slopes)
            if slope is not None:
                found[place] = slope * self.factors[place]
        return found

    def _slope(self, formula: Expression, slopes: Mapping[str, float]) -> float | None:
        if not formula.names & slopes.keys():
            return None
        partials = formula.derivatives(self.nominal)
        return float(sum(float(partials[name]) * slopes[name] for name in partials if name in slopes))

    def match(self, pattern: str) -> tuple[str, ...]:
        """Places that a pattern such as ``*.length`` names."""
        return tuple(place for place in self.factors if fnmatchcase(place, pattern))

    def known(self) -> Iterable[str]:
        """Names of all parameters and places."""
        return [*self.nominal, *self.factors]


def _number(value: ArrayLike) -> Number:
    return float(value) if isinstance(value, int | float) else np.asarray(value, dtype=float)
