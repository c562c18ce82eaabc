"""Tolerances that an allocation may change: what they are, what they cost, and how a study says others."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any

from mechdesign.analyses.reliability.sources import Sources
from mechdesign.numerics.arrays import Floats
from mechdesign.study import Study
from mechdesign.study.schema.reliability import Clearance, Cost, Dimension
from mechdesign.study.text.document import plain

# Digits that allocated numbers are written with, rounded down: what is tighter keeps what was asked.
DIGITS = 6


@dataclass(frozen=True)
class Tolerance:
    """The tolerance of one source.

    Parameters
    ----------
    name : str
    given : float
        As the study gives it, in its units: half the width of a tolerance, sigma, or a mean radial clearance.
    kind : str
        ``tolerance``, ``sigma`` or ``clearance``.
    cost : Cost or None
        None where it is held.
    """

    name: str
    given: float
    kind: str
    unit: str
    cost: Cost | None

    def price(self, size: float) -> float:
        """What it costs: a/T^exponent; nan where it is held."""
        return float("nan") if self.cost is None else self.cost.a / size**self.cost.exponent

    def size(self, scale: float) -> float:
        """The tolerance so many times as wide, without the dust of the product."""
        return float(f"{self.given * scale:.12g}")

    def rounded(self, scale: float) -> float:
        """The nearest scale, not above, whose tolerance has few digits."""
        size = self.given * scale
        unit = 10.0 ** (math.floor(math.log10(size)) + 1 - DIGITS)
        return float(f"{math.floor(size / unit * (1.0 + 1e-7)) * unit:.{DIGITS}g}") / self.given


def tolerances(study: Study, sources: Sources) -> list[Tolerance]:
    """Of all sources, in their order: dimensions are allocated, and what has a cost; other clearances are held."""
    section = study.reliability
    assert section is not None
    assert section.allocate is not None
    given = section.allocate.cost
    found = []
    for scalar in sources.scalars:
        dimension = section.dimensions[scalar.name]
        unit = "" if scalar.kind == "parameter" else study.units.label(scalar.moves[scalar.name][1])
        half = dimension.sigma
        kind = "sigma"
        if half is None:
            assert dimension.tolerance is not None
            low, high = dimension.tolerance
            half, kind = 0.5 * (high - low), "tolerance"
        asked = half > 0 and (scalar.kind != "load" or scalar.name in given)
        cost = given.get(scalar.name, Cost()) if asked else None
        found.append(Tolerance(scalar.name, half, kind, unit, cost))
    for pin in sources.pins:
        cost = given.get(pin.name) if pin.radius > 0 else None
        found.append(Tolerance(pin.name, pin.radius, "clearance", study.units.label("length"), cost))
    return found


def retold(study: Study, tolerances: Sequence[Tolerance], scales: Floats) -> dict[str, Any]:
    """The study's data where tolerances are as many times as wide.

    What a wildcard gives is written out, place by place, unless all of it stays alike.
    """
    section = study.reliability
    assert section is not None
    data: dict[str, Any] = plain(study.resolved)
    changed = {t.name: (t, scale) for t, scale in zip(tolerances, scales.tolist(), strict=True) if t.cost is not None}
    given = data["reliability"]
    dimensions: dict[str, Any] = {}
    for key, raw in (given.get("dimensions") or {}).items():
        own = {name: _dimension(raw, dimension, *changed[name]) if name in changed else raw
               for name, dimension in _said(section.dimensions, given["dimensions"], key)}  # fmt: skip
        values = list(own.values())
        if key in own or not own:
            dimensions[key] = own.get(key, raw)
        elif all(value == values[0] for value in values):
            dimensions[key] = values[0]
        else:
            dimensions |= own
    if dimensions:
        given["dimensions"] = dimensions
    for point, raw in (given.get("clearances") or {}).items():
        if point in changed:
            given["clearances"][point] = _clearance(raw, section.clearances[point], *changed[point])
    return data


def _said(dimensions: Mapping[str, Dimension], raw: Mapping[str, Any], key: str) -> Iterator[tuple[str, Dimension]]:
    """The dimensions that an entry of the study is about: of several wildcards the last one counts."""
    for name, dimension in dimensions.items():
        matching = [other for other in raw if fnmatchcase(name, other)]
        if (name if name in raw else matching[-1]) == key:
            yield name, dimension


def _dimension(raw: Any, dimension: Dimension, tolerance: Tolerance, scale: float) -> Any:
    size = _number(tolerance.given * scale)
    if isinstance(raw, dict) and raw.get("sigma") is not None:
        return {**raw, "sigma": size}
    assert dimension.tolerance is not None
    width = raw["tolerance"] if isinstance(raw, dict) else raw
    new: Any = size
    if isinstance(width, list):
        middle = 0.5 * sum(dimension.tolerance)
        new = [_number(middle - size, 12), _number(middle + size, 12)]
    return {**raw, "tolerance": new} if isinstance(raw, dict) else new


def _clearance(raw: dict[str, Any], clearance: Clearance, tolerance: Tolerance, scale: float) -> dict[str, Any]:
    """Its radius or diameter, and the tolerance of that, in proportion."""
    key = "radial" if clearance.radial is not None else "diametral"
    size = clearance.radius if clearance.radial is not None else 2.0 * clearance.radius
    new = {**raw, key: _number(size * scale)}
    if isinstance(raw.get("tolerance"), list):
        new["tolerance"] = [_number(scale * end, 12) for end in clearance.tolerance]
    elif raw.get("tolerance") is not None and clearance.tolerance[1]:
        new["tolerance"] = _number(scale * clearance.tolerance[1], 12)
    return new


def _number(value: float, digits: int = DIGITS) -> float:
    return float(f"{value:.{digits}g}")
