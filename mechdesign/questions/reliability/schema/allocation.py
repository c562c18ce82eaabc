"""Allocation of tolerances: the cheapest for a reliability or a Cpk, in any numbers or in standard grades."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from typing import Annotated, Any

from pydantic import Field

from mechdesign.mechanism.model import Place
from mechdesign.questions.reliability.schema.clearances import Clearance
from mechdesign.questions.reliability.schema.iso_tolerances import ToleranceClassError, standard_tolerance
from mechdesign.questions.reliability.schema.limits import ErrorLimit
from mechdesign.questions.reliability.schema.variation import LOADS, Dimension, quantities
from mechdesign.study.building.parameters import Parameters
from mechdesign.study.schema.checker import Checker
from mechdesign.study.text import fields
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.reading import Context, failure, shown
from mechdesign.study.text.units import QuantityError

# Grades used by default, and the largest grade.
USUAL = tuple(f"IT{number}" for number in range(5, 13))
_MOST_GRADE = 18
_GRADE = re.compile(r"IT([1-9]\d?)")


class Cost(fields.Model):
    """What a tolerance T costs: a/T^exponent, T in the study's units; a number alone is ``a``."""

    bare, short = "a", (fields.NUMBER_FORM,)
    a: fields.Positive = 1.0
    """Cost of a tolerance of 1. Example: 2"""
    exponent: fields.Positive = 1.0
    """How steeply the cost rises as the tolerance falls. Example: 1.5"""


def _grades(raw: Any, context: Context) -> tuple[str, ...]:
    if isinstance(raw, bool):
        raw = list(USUAL) if raw else []
    names = fields.as_list(raw)
    for name in names:
        match = _GRADE.fullmatch(name) if isinstance(name, str) else None
        if match is None or int(match[1]) > _MOST_GRADE:
            raise failure(
                f"expected true, or grades from IT1 to IT{_MOST_GRADE} such as [IT6, IT7, IT8], not {shown(name)}"
            )
    if names and context.units.length == "dimensionless":
        raise failure("grades are of sizes in mm, and this study's lengths are dimensionless; give 'units'")
    return tuple(sorted(dict.fromkeys(names), key=_number))


def _number(grade: str) -> int:
    return int(grade.removeprefix("IT"))


_GRADES = {"anyOf": [{"type": "boolean"}, fields.NAME_FORM, fields.NAMES_FORM], "title": "grades"}


class Allocate(fields.Model):
    """The cheapest tolerances that reach a reliability or a Cpk at every pose, each by itself (not over a cycle).

    ``requirements`` on the reliability are judged with these tolerances.
    """

    one_of = ("tolerances are allocated to reach either a 'reliability' or a 'cpk'", "reliability", "cpk")
    reliability: fields.Positive | None = None
    """Reliability that every pose must reach, between 0 and 1. Example: 0.999"""
    cpk: fields.Positive | None = None
    """Cpk that every limited output must reach at every pose, as of the table ``capability``. Example: 1.33"""
    grades: Annotated[tuple[str, ...], fields.Read(_grades, _GRADES)] = ()
    """Allocates lengths in standard grades of ISO 286-1 for their nominal sizes: true for IT5 to IT12, or those that
    may be chosen. A tolerance is then half the grade to either side (js). What is no length, or has no grade, keeps
    its tolerance. Left out: any numbers. Example: true Example: [IT6, IT7, IT8, IT9]
    """
    cost: dict[str, Cost] = Field(default_factory=dict)
    """Cost of each tolerance, a/T^exponent, T half its width, sigma or the mean radial clearance. Dimensions that are
    not named cost 1/T; clearances and loads that are not named are held. Example: {r1: 2, rod.length: {a: 1, exponent:
    2}}
    """

    def misfits(self) -> Iterator[fields.Misfit]:
        if self.reliability is not None:
            yield fields.Misfit(
                self.reliability >= 1, "a reliability lies between 0 and 1, not {}", (self.reliability,)
            )


def half_widths(
    name: str, dimension: Dimension, grades: Collection[str], parameters: Parameters, places: Mapping[str, Place],
    millimetre: float,
) -> dict[str, float]:  # fmt: skip
    """Half the standard tolerance of a dimension by grade, in the study's units, `millimetre` of which are one.

    Raises
    ------
    ToleranceClassError
        Where the dimension has no grades: it is no length with a tolerance, or one of no standard size.
    """
    if dimension.tolerance is None:
        raise ToleranceClassError(f"it is given by its {dimension.kind}, and a grade is a tolerance")
    if quantities(name, parameters, places) != {"length"}:
        raise ToleranceClassError("it is no length, and grades are of lengths")
    nominal = parameters.nominal[name] if name in parameters.nominal else places[name].nominal
    size = abs(nominal) / millimetre
    return {grade: 0.5 * float(standard_tolerance(_number(grade), size)) * millimetre for grade in grades}


def check_allocation(
    checker: Checker, allocate: Allocate, dimensions: Mapping[str, Dimension], clearances: Mapping[str, Clearance],
    limits: Mapping[str, ErrorLimit],
) -> None:  # fmt: skip
    """Check that something can be allocated, and what is named in `cost`."""
    root: KeyPath = ("reliability", "allocate")
    graded = set()
    for name, dimension in dimensions.items() if allocate.grades else ():
        try:
            places, millimetre = checker.places, checker.units.convert("1 mm")
            half_widths(name, dimension, allocate.grades, checker.parameters, places, millimetre)
            graded.add(name)
        except (ToleranceClassError, QuantityError) as error:
            if name in allocate.cost:
                checker.report(
                    (*root, "cost", name), f"has no grade: {error}; leave it out, and it is held", at_key=True
                )
    for name in allocate.cost:
        path: KeyPath = (*root, "cost", name)
        if name in dimensions and dimensions[name].measured is not None:
            checker.report(path, "what is measured is held as it is: its tolerance is not allocated", at_key=True)
        checker.check_name(name, [*dimensions, *clearances], "dimension or clearance that varies,", path, at_key=True)
        if name in clearances and allocate.grades:
            checker.report(path, "a clearance has no grade; leave it out, and it is held", at_key=True)
        elif name in clearances and clearances[name].fit is not None:
            message = "a fit is not allocated: its classes come in steps; give 'radial' or 'diametral', or no cost"
            checker.report(path, message, at_key=True)
    if not limits:
        checker.report(root, "tolerances are allocated to keep 'limits'; give some")
    if allocate.cpk is not None:
        for name in (name for name, limit in limits.items() if limit.radius is not None):
            message = f"a circle has no Cpk; limit {name}.x and {name}.y, or allocate to a 'reliability'"
            checker.report(("reliability", "limits", name), message, at_key=True)
    wide = any(d.sigma if d.tolerance is None else d.varies(checker.size(name))
               for name, d in dimensions.items() if name not in LOADS)  # fmt: skip
    if not wide and not allocate.cost:
        message = "nothing to allocate: no dimension has a tolerance, and a clearance is held unless 'cost' names it"
        checker.report(root, message)
    elif allocate.grades and not graded:
        checker.report((*root, "grades"), "nothing to allocate: no dimension is a length with a tolerance")
