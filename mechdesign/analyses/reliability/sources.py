"""What varies when a mechanism is made: dimensions, clearances and drives, mapped onto places of the geometry."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.reliability.sampling import PIN_VARIANCE, deviations, pins
from mechdesign.errors import StudyError
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.geometry import offset_names
from mechdesign.study import Study
from mechdesign.study.reliability_models import Clearance, Dimension

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Source:
    """One random source as the first-order analysis sees it.

    Parameters
    ----------
    name : str
        As the study names it: a parameter, a place, a drive or a joint.
    directions : tuple of mapping
        Per independent component (one, or a pin's x and y), derivatives of places and drives (radians, lengths).
    variance : float
        Of each component (a parameter's in its own unit, an angle's in radians).
    reach : float
        Largest magnitude, over all directions: the tolerance, or the largest radial clearance.
    """

    name: str
    directions: tuple[Mapping[str, float], ...]
    variance: float
    reach: float


@dataclass(frozen=True)
class Sources:
    """All that varies in a study.

    Parameters
    ----------
    parameters, places, drives : mapping of str to Dimension
        Dimensions by what they vary.
    clearances : mapping of str to Clearance
        By joint; each names its link.
    """

    study: Study
    parameters: Mapping[str, Dimension]
    places: Mapping[str, Dimension]
    drives: Mapping[str, Dimension]
    clearances: Mapping[str, Clearance]

    def first_order(self) -> tuple[Source, ...]:
        """Sources with the pins' variances of the analytic method [S2, eqs. 5, 6]."""
        found = []
        for name, dimension in self.parameters.items():
            slopes = _geometric(self.study.parameters.derivatives(name))
            found.append(Source(name, (slopes,), dimension.standard_deviation**2, _half_width(dimension)))
        for name, dimension in {**self.places, **self.drives}.items():
            factor = self._factor(name)
            sigma, reach = factor * dimension.standard_deviation, factor * _half_width(dimension)
            found.append(Source(name, ({name: 1.0},), sigma**2, reach))
        for point, clearance in self.clearances.items():
            spread = PIN_VARIANCE[clearance.pin.analytic] * (_radius_sigma(clearance) ** 2 + clearance.radius**2)
            link = _link(point, clearance)
            # Along a binary link the pin changes its length; across it, only in the second order.
            names = (f"{link}.length",) if clearance.effect == "length" else offset_names(link, point)
            reach = clearance.radius + clearance.radius_tolerance
            found.append(Source(point, tuple({name: 1.0} for name in names), spread, reach))
        return tuple(found)

    def draw(self, rng: np.random.Generator, count: int) -> tuple[dict[str, Floats], dict[str, Floats]]:
        """Draw made mechanisms.

        Returns
        -------
        places : dict of str to ndarray, shape (count,)
            Places that vary (radians, lengths).
        drives : dict of str to ndarray, shape (count,)
            Errors of drives (radians, lengths).
        """
        study, nominal = self.study, self.study.mechanism.nominal
        changed = {
            name: study.parameters.nominal[name] + deviations(rng, d.distribution, d.standard_deviation, count)
            for name, d in self.parameters.items()
        }
        places: dict[str, Floats] = {
            name: np.asarray(value, dtype=float) for name, value in _geometric(study.parameters.places(changed)).items()
        }
        for name, d in self.places.items():
            deviation = deviations(rng, d.distribution, d.standard_deviation * self._factor(name), count)
            places[name] = places.get(name, nominal[name]) + deviation
        drives = {
            name: deviations(rng, d.distribution, d.standard_deviation * self._factor(name), count)
            for name, d in self.drives.items()
        }
        for point, clearance in self.clearances.items():
            x, y = _pin(rng, clearance, count)
            link = _link(point, clearance)
            if clearance.effect == "length":
                length = places.get(f"{link}.length", nominal[f"{link}.length"])
                x += length
                x *= x
                y *= y
                x += y
                places[f"{link}.length"] = np.sqrt(x, out=x)
            else:
                for name, value in zip(offset_names(link, point), (x, y), strict=True):
                    places[name] = value
        return places, drives

    def _factor(self, name: str) -> float:
        mechanism = self.study.mechanism
        angle = mechanism.quantity(name) if name in mechanism.drives else mechanism.description.places[name].quantity
        return self.study.units.angle_factor if angle == "angle" else 1.0


def find_sources(study: Study) -> tuple[Sources, list[str]]:
    """Sources of a study, and warnings about parameters that vary several places together.

    Raises
    ------
    StudyError
        If nothing varies.
    """
    section = study.reliability
    if section is None or not (section.dimensions or section.clearances):
        raise StudyError(
            "reliability asks what varies, and the study does not say: give reliability.dimensions or "
            "reliability.clearances"
        )
    mechanism: Mechanism = study.mechanism
    kinds: dict[str, dict[str, Dimension]] = {"parameter": {}, "place": {}, "drive": {}}
    warnings = []
    for name, dimension in section.dimensions.items():
        if name in study.parameters.nominal:
            kinds["parameter"][name] = dimension
            moved = [place for place, slope in _geometric(study.parameters.derivatives(name)).items() if slope]
            if not moved:
                warnings.append(f"parameter '{name}' changes no dimension of the mechanism")
            elif len(moved) > 1:
                warnings.append(f"parameter '{name}' varies {', '.join(moved)} together")
        else:
            kinds["drive" if name in mechanism.drives else "place"][name] = dimension
    return Sources(study, kinds["parameter"], kinds["place"], kinds["drive"], section.clearances), warnings


def _geometric(values: Mapping[str, object]) -> dict[str, float]:
    """Leave out the limits of motion: they are judged on the nominal mechanism."""
    return {name: value for name, value in values.items() if not name.startswith("limits.")}  # type: ignore[misc]


def _half_width(dimension: Dimension) -> float:
    if dimension.tolerance is not None:
        return dimension.tolerance
    return dimension.standard_deviation * (3.0 if dimension.distribution == "normal" else math.sqrt(3.0))


def _radius_sigma(clearance: Clearance) -> float:
    return clearance.radius_tolerance / (3.0 if clearance.distribution == "normal" else math.sqrt(3.0))


def _link(point: str, clearance: Clearance) -> str:
    if clearance.link is None:
        raise StudyError(f"reliability.clearances.{point}: name the 'link' whose pin moves")
    return clearance.link


def _pin(rng: np.random.Generator, clearance: Clearance, count: int) -> tuple[Floats, Floats]:
    radius: float | Floats = clearance.radius
    if clearance.radius_tolerance > 0:
        # A negative radius is not clipped: the pin's law is symmetric, so it is harmless, and clipping biases [S3].
        radius = deviations(rng, clearance.distribution, _radius_sigma(clearance), count)
        radius += clearance.radius
    x, y = pins(rng, clearance.pin.monte_carlo, count)
    x *= radius
    y *= radius
    return x, y
