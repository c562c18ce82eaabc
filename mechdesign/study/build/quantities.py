"""Drives, measures and limits of a mechanism section: their names checked, their kinds found."""

from __future__ import annotations

from typing import Literal

import numpy as np

from mechdesign.expressions import Expression, ExpressionError
from mechdesign.mechanism.model import Drive, Limit, Measure, Quantity, Term
from mechdesign.study.build import section as models
from mechdesign.study.build.builder import Builder
from mechdesign.study.text.document import Path
from mechdesign.study.build.names import GROUND
from mechdesign.study.text.numbers import Value
from mechdesign.study.text.units import KINDS, describe


def drives(builder: Builder) -> dict[str, Drive]:
    """Build every drive of the section whose names are right."""
    slides, legs, moving = builder.names.slides, builder.names.legs, builder.names.moving
    found: dict[str, Drive] = {}
    for name, section in builder.section.drives.items():
        path: Path = ("drives", name)
        if section is None:
            if builder.check_name(name, [*moving, *slides], "link, leg or slide", path):
                kind: Literal["angle", "length", "slide"] = (
                    "slide" if name in slides else "length" if name in legs else "angle"
                )
                found[name] = Drive(name, kind, name)
        elif section.angle is not None:
            reference = section.from_ or GROUND
            right = builder.check_name(section.angle, moving, "moving link", (*path, "angle"))
            if right and builder.check_name(reference, builder.section.links, "link", (*path, "from")):
                if reference == section.angle:
                    builder.report((*path, "from"), "the angle of a link from itself never changes")
                found[name] = Drive(name, "angle", section.angle, reference)
        elif section.length is not None:
            if section.length in moving and section.length not in legs:
                builder.report((*path, "length"), f"link {section.length!r} is not telescopic: its length is fixed")
            elif builder.check_name(section.length, legs, "telescopic leg", (*path, "length")):
                found[name] = Drive(name, "length", section.length)
        elif section.slide is not None and builder.check_name(section.slide, slides, "slide", (*path, "slide")):
            found[name] = Drive(name, "slide", section.slide)
    return found


def measures(builder: Builder) -> dict[str, Measure]:
    """Build every measure of the section whose names are right."""
    # A measure may use those above it.
    known = [name for name in builder.names.coordinates if name not in builder.section.measures]
    found: dict[str, Measure] = {}
    for name, section in builder.section.measures.items():
        path: Path = ("measures", name)
        if section.angle is not None:
            if builder.check_names(section.angle, builder.section.links, "link", (*path, "angle")):
                found[name] = Measure(name, "angle", section.angle)
        elif section.distance is not None:
            pair = section.distance
            if builder.check_names(pair, builder.names.owners, "point", (*path, "distance")):
                found[name] = Measure(name, "distance", pair)
        elif section.expression is not None:
            try:
                expression = Expression.parse(section.expression, builder.units.angle_factor)
                # Constants alone fail here (1/0), whatever the coordinates come to.
                expression.evaluate(dict.fromkeys(expression.names, np.full(1, np.nan)))
            except ExpressionError as error:
                builder.report(path, str(error))
                continue
            if all(builder.check_name(item, known, "coordinate", path) for item in sorted(expression.names)):
                found[name] = Measure(name, "expression", None, expression)
        known.append(name)
    return found


def limits(builder: Builder) -> tuple[Limit, ...]:
    """Build every limit of the section whose names are right, and register its bounds as places."""
    found = []
    for index, section in enumerate(builder.section.limits):
        path: Path = ("limits", index)
        quantity: Quantity = "length"
        kind: Literal["distance", "drive", "angle", "measure"]
        items: tuple[str, ...]
        if section.distance is not None:
            kind, items = "distance", section.distance
            right = builder.check_names(items, builder.names.owners, "point", (*path, "distance"))
        elif section.angle is not None:
            kind, items, quantity = "angle", section.angle, "angle"
            right = builder.check_names(items, builder.section.links, "link", (*path, "angle"))
        elif section.drive is not None:
            kind, items = "drive", (section.drive,)
            right = builder.check_name(section.drive, builder.section.drives, "drive", (*path, "drive"))
            quantity = builder.names.drives.get(section.drive, "none")
        else:
            kind, items = "measure", (section.measure or "",)
            right = builder.check_name(items[0], builder.section.measures, "measure", (*path, "measure"))
            quantity = builder.names.measures.get(items[0], "none")
        bounds: list[Term | None] = []
        for end, value in (("min", section.min), ("max", section.max)):
            _check_kind(builder, value, quantity, (*path, end))
            bounds.append(None if value is None else builder.place(f"limits.{index}.{end}", value, quantity))
        _check_bounds(builder, section, kind, quantity, path)
        if right:
            found.append(Limit(kind, items, bounds[0], bounds[1], f"limits.{index}"))
    return tuple(found)


def _check_kind(builder: Builder, value: Value | None, quantity: Quantity, path: Path) -> None:
    if value is not None and value.powers is not None and quantity != "none" and value.powers != KINDS[quantity]:
        builder.report(path, f"is {describe(value.powers)}, where {describe(KINDS[quantity])} is expected")


def _check_bounds(builder: Builder, section: models.Limit, kind: str, quantity: Quantity, path: Path) -> None:
    low, high = section.min, section.max
    if low is not None and high is not None and high.nominal < low.nominal:
        mend = "; add a full turn to it" if quantity == "angle" else ""
        builder.report((*path, "max"), f"the maximum {high.nominal:g} is below the minimum {low.nominal:g}{mend}")
    if quantity == "angle" and (low is None or high is None):
        builder.report(path, "an angle needs both 'min' and 'max': angles are judged modulo a turn")
    if kind == "distance":
        for end, value in (("min", low), ("max", high)):
            if value is not None and value.nominal < 0:
                builder.report((*path, end), f"a distance is never negative, so not {value.nominal:g}")
