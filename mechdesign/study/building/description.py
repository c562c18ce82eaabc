"""From the validated mechanism section to `Description`: names checked, defaults filled in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Literal

import numpy as np

from mechdesign.ground.expressions import Expression
from mechdesign.ground.notation import ExpressionError
from mechdesign.mechanism.elements.declared import Quantity
from mechdesign.mechanism.elements.drives import Drive
from mechdesign.mechanism.elements.measures import Limit, Measure
from mechdesign.mechanism.elements.springs import Spring
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.model import Description
from mechdesign.study.building.builder import ROOT, Builder
from mechdesign.study.building.couplings import build_couplings, with_phases
from mechdesign.study.building.elements import Written
from mechdesign.study.building.joints import build_friction, build_joints, check_connected, check_pins
from mechdesign.study.building.plates import build_plates
from mechdesign.study.text.document import KeyPath


def build(builder: Builder) -> Description:
    """Run all steps; the result is of use only if the reporter has no problems."""
    builder.check_distinct()
    builder.check_sketch()
    builder.build_links()
    joints = build_joints(builder)
    check_connected(builder)
    check_pins(builder)
    drives, measures, limits = _drives(builder), _measures(builder), _limits(builder)
    springs = _springs(builder)
    branch: Literal["side", "follow"] = "follow" if builder.section.branch == "follow" else "side"
    couplings = build_couplings(builder)
    description = Description(
        builder.places, builder.links, joints, drives, measures, limits, builder.sketch, branch,
        builder.units.angle_factor, builder.masses, springs, couplings, build_friction(builder),
        build_plates(builder),
    )  # fmt: skip
    return with_phases(builder, description)


def _drives(builder: Builder) -> dict[str, Drive]:
    """Drives without mistakes in their names."""
    mechanism = builder.section
    candidates: Mapping[str, tuple[str, Iterable[str]]] = {
        "angle": ("moving link", mechanism.moving),
        "length": ("telescopic leg", mechanism.legs),
        "slide": ("slide", mechanism.slides),
    }
    drives: dict[str, Drive] = {}
    for name, section in mechanism.drives.items():
        kind, item = mechanism.driven(name)
        path: KeyPath = ("drives", name) if section is None else ("drives", name, kind)
        reference = section.from_ or GROUND if section is not None else GROUND
        if item == GROUND:
            builder.report(path, "there is no moving link 'ground': the ground never moves; name what is driven")
            right = False
        elif section is None:
            right = builder.check_name(name, [*mechanism.moving, *mechanism.slides], "link, leg or slide", path)
        elif kind == "length" and item in mechanism.moving and item not in mechanism.legs:
            builder.report(
                path, f"link {item!r} is not telescopic: its length is fixed; write 'telescopic: true' in its place"
            )
            right = False
        else:
            right = builder.check_name(item, candidates[kind][1], candidates[kind][0], path)
            if right and kind == "angle":
                right = builder.check_name(reference, builder.section.links, "link", ("drives", name, "from"))
                if reference == item:
                    mistake = "the angle of a link from itself never changes; name another link"
                    builder.report(("drives", name, "from"), mistake)
        if right:
            drives[name] = Drive(name, **{kind: item, "from_": reference})
    return drives


def _measures(builder: Builder) -> dict[str, Measure]:
    """Measures without mistakes in their names."""
    # A measure may use those above it.
    above = [name for name in builder.section.coordinates if name not in builder.section.measures]
    measures: dict[str, Measure] = {}
    for name, section in builder.section.measures.items():
        path: KeyPath = ("measures", name)
        pair = section.angle or section.distance
        if section.expression is not None:
            try:
                expression = Expression.parse(section.expression, builder.units.angle_factor)
                # A failure here comes from constants alone (1/0), not from coordinates.
                expression.evaluate(dict.fromkeys(expression.names, np.full(1, np.nan)))
            except ExpressionError as error:
                builder.report(path, str(error))
                continue
            noun, listed = "coordinate or parameter", [*above, *builder.parameter_values]
            if all(builder.check_name(item, listed, noun, path) for item in sorted(expression.names)):
                builder.parameters_in(expression)
                measures[name] = Measure(name, expression=expression)
        elif pair is not None and builder.check_named(section.kind, pair, (*path, section.kind)):
            measures[name] = Measure(name, **{section.kind: pair})
            one, other = (item.rpartition(".")[2] for item in pair)
            if section.distance is not None and one == other:
                message = f"{one!r} twice is one place, whose distance has no sign: give {pair[1]}.x - {pair[0]}.x"
                builder.report((*path, "distance"), message)
        above.append(name)
    return measures


def _springs(builder: Builder) -> dict[str, Spring]:
    """Springs without mistakes in their names; their numbers become places."""
    section, springs = builder.section, dict[str, Spring]()
    for name, spring in section.springs.items():
        path = ("springs", name)
        one, other = spring.between
        turning = any(end in section.links for end in spring.between)
        turning &= not any(end in section.owners or end in section.ends for end in spring.between)
        if not builder.check_named("link" if turning else "point", spring.between, (*path, "between")):
            continue
        if one.rpartition(".")[2] == other.rpartition(".")[2]:
            pair = f"{one!r} and itself" if one == other else f"{one!r} and {other!r}, which are one place,"
            builder.report((*path, "between"), f"a spring between {pair} does nothing")
            continue
        for key in spring.given(*Spring.foreign(turning=turning)):
            kind, right = ("links", "free_angle") if turning else ("points", "free_length")
            builder.report((*path, key), f"between two {kind} there is no {key!r}; its stiffness counts from {right!r}",
                           at_key=True)  # fmt: skip
        numbers = builder.numbers(spring, *path, turning=turning)
        for key in numbers:
            builder.reporter.kind((*ROOT, *path, key), builder.places[f"{name}.{key}"].quantity)
        springs[name] = Spring(name, spring.between, turning=turning, **numbers)
    return springs


def _limits(builder: Builder) -> tuple[Limit, ...]:
    """Limits without mistakes in their names; their bounds become places."""
    limits = []
    for index, section in enumerate(builder.section.limits):
        path: KeyPath = ("limits", index)
        kind, items = section.kind, section.items
        right = builder.check_named(kind, items, (*path, kind))
        quantity: Quantity = "angle" if kind == "angle" else "length"
        if kind in ("drive", "measure"):
            quantity = (builder.section.driven_kinds if kind == "drive" else builder.section.measured_kinds).get(
                items[0], "none"
            )
        bounds: dict[str, Any] = {}
        for end, value in (("min", section.min), ("max", section.max)):
            if quantity != "none":
                builder.reporter.kind((*ROOT, *path, end), quantity)
            if value is not None:
                bounds[end] = builder.place((*path, end), value, quantity)
        expression = (
            kind == "measure" and items[0] in builder.section.measures and builder.section.measures[items[0]].expression
        )
        _check_bounds(builder, section, "none" if expression else quantity, path)
        if right:
            limits.append(Limit(f"limits.{index}", **{kind: getattr(section, kind)}, **bounds))
    return tuple(limits)


def _check_bounds(builder: Builder, section: Written[Limit], quantity: Quantity, path: KeyPath) -> None:
    low, high = section.min, section.max
    if low is not None and high is not None and high < low:
        also = "; add a full turn to it" if quantity == "angle" else ""
        builder.report((*path, "max"), f"the maximum {high:g} is below the minimum {low:g}{also}")
    if quantity == "angle" and (low is None or high is None):
        builder.report(path, "an angle needs both 'min' and 'max': angles are judged modulo a turn")
    if section.kind == "distance":
        for end, value in (("min", low), ("max", high)):
            if value is not None and value < 0:
                builder.report((*path, end), f"a distance is never negative, so not {value:g}")
