"""From the validated mechanism section to `mechdesign.mechanism.model.Description`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Literal

import numpy as np

from mechdesign.expressions import Expression, ExpressionError
from mechdesign.mechanism.model import Description, Drive, Limit, Measure, Quantity, Term
from mechdesign.study.building import joints as joint_rules
from mechdesign.study.building import section as models
from mechdesign.study.building.builder import ROOT, Builder
from mechdesign.study.building.names import GROUND
from mechdesign.study.text.document import KeyPath


def build(builder: Builder) -> Description:
    """Run all steps; the result is of use only if the reporter has no problems."""
    builder.check_distinct()
    builder.check_sketch()
    builder.build_links()
    joints = joint_rules.build(builder)
    joint_rules.check_connected(builder)
    joint_rules.check_pins(builder)
    drives, measures, limits = _drives(builder), _measures(builder), _limits(builder)
    branch: Literal["side", "follow"] = "follow" if builder.section.branch == "follow" else "side"
    return Description(
        builder.places, builder.links, joints, drives, measures, limits, builder.sketch, branch,
        builder.units.angle_factor,
    )  # fmt: skip


def _drives(builder: Builder) -> dict[str, Drive]:
    """Every drive whose names are right."""
    names = builder.names
    known: Mapping[str, tuple[str, Iterable[str]]] = {
        "angle": ("moving link", names.moving),
        "length": ("telescopic leg", names.legs),
        "slide": ("slide", names.slides),
    }
    found: dict[str, Drive] = {}
    for name, section in builder.section.drives.items():
        kind, item = names.driven(name)
        path: KeyPath = ("drives", name) if section is None else ("drives", name, kind)
        reference = section.from_ or GROUND if section is not None else GROUND
        if section is None:
            right = builder.check_name(name, [*names.moving, *names.slides], "link, leg or slide", path)
        elif kind == "length" and item in names.moving and item not in names.legs:
            builder.report(path, f"link {item!r} is not telescopic: its length is fixed")
            right = False
        else:
            right = builder.check_name(item, known[kind][1], known[kind][0], path)
            if right and kind == "angle":
                right = builder.check_name(reference, builder.section.links, "link", ("drives", name, "from"))
                if reference == item:
                    builder.report(("drives", name, "from"), "the angle of a link from itself never changes")
        if right:
            found[name] = Drive(name, kind, item, reference)
    return found


def _measures(builder: Builder) -> dict[str, Measure]:
    """Every measure whose names are right."""
    # A measure may use those above it.
    known = [name for name in builder.names.coordinates if name not in builder.section.measures]
    found: dict[str, Measure] = {}
    for name, section in builder.section.measures.items():
        path: KeyPath = ("measures", name)
        pair = section.angle or section.distance
        if section.expression is not None:
            try:
                expression = Expression.parse(section.expression, builder.units.angle_factor)
                # Constants alone fail here (1/0), whatever the coordinates come to.
                expression.evaluate(dict.fromkeys(expression.names, np.full(1, np.nan)))
            except ExpressionError as error:
                builder.report(path, str(error))
                continue
            if all(builder.check_name(item, known, "coordinate", path) for item in sorted(expression.names)):
                found[name] = Measure(name, "expression", None, expression)
        elif pair is not None and builder.check_named(section.kind, pair, (*path, section.kind)):
            found[name] = Measure(name, section.kind, pair)
        known.append(name)
    return found


def _limits(builder: Builder) -> tuple[Limit, ...]:
    """Every limit whose names are right; its bounds become places."""
    found = []
    for index, section in enumerate(builder.section.limits):
        path: KeyPath = ("limits", index)
        kind, given = section.kind, getattr(section, section.kind)
        items: tuple[str, ...] = given if isinstance(given, tuple) else (given,)
        right = builder.check_named(kind, items, (*path, kind))
        quantity: Quantity = "angle" if kind == "angle" else "length"
        if kind in ("drive", "measure"):
            quantity = (builder.names.drives if kind == "drive" else builder.names.measures).get(given, "none")
        bounds: list[Term | None] = []
        for end, value in (("min", section.min), ("max", section.max)):
            if quantity != "none":
                builder.reporter.kind((*ROOT, *path, end), quantity)
            bounds.append(None if value is None else builder.place(f"limits.{index}.{end}", value, quantity))
        _check_bounds(builder, section, quantity, path)
        if right:
            found.append(Limit(kind, items, bounds[0], bounds[1], f"limits.{index}"))
    return tuple(found)


def _check_bounds(builder: Builder, section: models.Limit, quantity: Quantity, path: KeyPath) -> None:
    low, high = section.min, section.max
    if low is not None and high is not None and high.nominal < low.nominal:
        mend = "; add a full turn to it" if quantity == "angle" else ""
        builder.report((*path, "max"), f"the maximum {high.nominal:g} is below the minimum {low.nominal:g}{mend}")
    if quantity == "angle" and (low is None or high is None):
        builder.report(path, "an angle needs both 'min' and 'max': angles are judged modulo a turn")
    if section.kind == "distance":
        for end, value in (("min", low), ("max", high)):
            if value is not None and value.nominal < 0:
                builder.report((*path, end), f"a distance is never negative, so not {value.nominal:g}")
