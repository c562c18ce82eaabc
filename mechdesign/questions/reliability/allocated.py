"""The data of a study file with its allocated tolerances."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import Any

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.questions.reliability.cheapest import DIGITS, Allotment
from mechdesign.questions.reliability.schema.clearances import Clearance
from mechdesign.questions.reliability.schema.section import ReliabilitySection
from mechdesign.study import Study
from mechdesign.study.text.document import plain
from mechdesign.study.text.units import kind_of


def allocated_data(study: Study, tolerances: Sequence[Allotment], scales: Floats) -> dict[str, Any]:
    """The study's data with its tolerances times the factors `scales`, shape (tolerances,).

    A wildcard is written out, dimension by dimension, unless all its dimensions keep equal tolerances. `allocate` is
    left out, unless a requirement judges its tables.
    """
    section = ReliabilitySection.of(study)
    data: dict[str, Any] = plain(study.resolved)
    changed = {t.name: (t, scale) for t, scale in zip(tolerances, scales.tolist(), strict=True) if t.cost is not None}
    written = data["reliability"]
    if not any(of_allocation(requirement.result) for requirement in study.requirements):
        del written["allocate"]
    entries = written.get("dimensions") or {}
    # Of several wildcards the last one counts.
    key_of = {name: name if name in entries else [key for key in entries if fnmatchcase(name, key)][-1]
              for name in section.dimensions}  # fmt: skip
    dimensions: dict[str, Any] = {}
    for key, raw in entries.items():
        by_name = {name: _dimension(raw, *changed[name], study) if name in changed else raw
                   for name, origin in key_of.items() if origin == key}  # fmt: skip
        values = [*by_name.values(), raw]
        dimensions |= by_name if any(value != values[0] for value in values[:-1]) else {key: values[0]}
    if entries:
        written["dimensions"] = dimensions
    for point, raw in (written.get("clearances") or {}).items():
        if point in changed:
            written["clearances"][point] = _clearance(raw, section.clearances[point], *changed[point])
    return data


def of_allocation(result: str) -> bool:
    """Whether a result that a requirement names stands in the tables of an allocation."""
    return result.split(".")[1:2] in (["allocation"], ["confirmation"])


def _dimension(raw: Any, tolerance: Allotment, scale: float, study: Study) -> Any:
    size = _number(tolerance.given * scale)
    if isinstance(raw, dict) and raw.get("sigma") is not None:
        return {**raw, "sigma": size}
    width = raw["tolerance"] if isinstance(raw, dict) else raw
    new: Any = size
    grade = tolerance.grade(scale).replace("IT", "js")
    if grade and not tolerance.middle and grade not in study.parameters.nominal:
        new = grade
    elif isinstance(width, list) or tolerance.middle:
        new = [_number(tolerance.middle - size, 12), _number(tolerance.middle + size, 12)]
    # A study gives a leg only beside a tolerance class, which a number replaces.
    return {**{key: raw[key] for key in raw if key != "leg"}, "tolerance": new} if isinstance(raw, dict) else new


def _clearance(raw: dict[str, Any], clearance: Clearance, tolerance: Allotment, scale: float) -> dict[str, Any]:
    """A clearance with its radius or diameter times a factor, and the tolerance of that in proportion."""
    size = _number(clearance.size * scale)
    new = {**raw, clearance.kind: size}
    if clearance.backlash is not None and kind_of(clearance.backlash) is not None:
        # A length along a pitch circle is told from an angle by its unit.
        new["backlash"] = f"{size:.12g} {tolerance.unit}"
    if isinstance(raw.get("tolerance"), list):
        new["tolerance"] = [_number(scale * end, 12) for end in clearance.tolerance]
    elif raw.get("tolerance") is not None and clearance.tolerance[1]:
        new["tolerance"] = _number(scale * clearance.tolerance[1], 12)
    return new


def _number(value: float, digits: int = DIGITS) -> float:
    return float(f"{value:.{digits}g}")
