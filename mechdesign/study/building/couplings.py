"""Couplings of a validated mechanism section, their cams, tables and phases."""

from __future__ import annotations

import contextlib
import math
from dataclasses import replace
from decimal import Decimal

import numpy as np

from mechdesign.ground.errors import MechanismError, StudyError
from mechdesign.ground.expressions import Expression
from mechdesign.ground.functions import Tabulated
from mechdesign.ground.notation import Step
from mechdesign.mechanism.coordinates import coupled
from mechdesign.mechanism.elements.couplings import STEPS, Cam, Coupling, play
from mechdesign.mechanism.elements.declared import Quantity
from mechdesign.mechanism.elements.joints import LinkLine
from mechdesign.mechanism.geometry import Geometry
from mechdesign.mechanism.graph import build_graph
from mechdesign.mechanism.model import Description
from mechdesign.mechanism.sketch import locate
from mechdesign.study.building import section as models
from mechdesign.study.building.builder import ROOT, Builder
from mechdesign.study.building.cam_laws import law_of, span_of
from mechdesign.study.building.elements import Written
from mechdesign.study.building.joints import WrongJoint, check_named, line_of, refuse
from mechdesign.study.text.csv_files import read_table
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.reading import APART

# Rows from which a cubic spline is told.
FEWEST_ROWS = 4
# A table spans a turn where it misses one by less than this in its last decimal, and by less than this part of a turn:
# 2 pi is written 6.283, or cut off as 6.2831.
LAST_DIGIT, LIKE_A_TURN = 0.9, 1e-3
# A step divides a range that it misses by this part of it.
ROUNDING = 1e-9


def build_couplings(builder: Builder) -> dict[str, Coupling]:
    """Couplings without mistakes in their names."""
    section, couplings = builder.section, dict[str, Coupling]()
    listed = [*section.coordinates, *section.moving, *section.slides]
    for name, given in section.couplings.items():
        path: KeyPath = ("couplings", name)
        sets = section.coordinate_named(given.set_)
        if not builder.check_name(given.set_, listed, "coordinate", (*path, "set")):
            continue
        kind = section.coordinates.get(sets, "none")
        if sets in section.measures or sets.endswith((".x", ".y")):
            message = f"{given.set_!r} cannot follow others: that can an angle of a link, a slide or a length"
            builder.report((*path, "set"), message)
            continue
        function = _function(builder, name, given, path, kind)
        if function is None:
            continue
        if sets in function.names:
            builder.report(path, f"{given.set_!r} cannot follow itself")
            continue
        angle = given.pressure_angle
        pressure = Coupling.pressure_angle if angle is None else angle * builder.units.angle_factor
        if not 0 <= pressure < np.pi / 2:
            builder.report((*path, "pressure_angle"), "a pressure angle lies between 0 and 90 degrees")
        builder.place((play(name),), 0.0, kind)
        cam = None
        if given.cam is not None:
            with contextlib.suppress(WrongJoint):
                cam = _cam(builder, name, given, sets, function)
        module = None if given.module is None else builder.place((*path, "module"), given.module)
        couplings[name] = Coupling(
            name, sets, function, wheels=given.wheels, pressure_angle=pressure, radius=given.radius or 0.0, cam=cam,
            module=module,
        )  # fmt: skip
    return couplings


def _cam(builder: Builder, name: str, coupling: Written[Coupling], sets: str, function: Expression) -> Cam:
    """The cam of a coupling; `sets` is the coordinate that follows."""
    section, given, path = builder.section, coupling.cam, ("couplings", name, "cam")
    check_named(builder, "link", [given.link], (*path, "link"))
    followed = sorted(function.names & section.coordinates.keys())
    if len(followed) != 1:
        refuse(builder, path, f"a cam follows one coordinate, not {', '.join(followed) or 'none'}")
    through = given.flat or (given.roller or "",)
    key = (*path, given.kind)
    check_named(builder, "point", through[:1], key)
    owners = [link for link in section.owners[through[0]] if link != given.link]
    if not owners:
        refuse(builder, key, f"point {through[0]!r} is on the cam {given.link!r} itself; give one of its follower")
    link = next((link for link in _moved(section, sets) if link in owners), owners[0])
    if given.flat is None:
        face = LinkLine(link, through[0])
        radius = builder.place((*path, "radius"), given.radius or 0.0)
    else:
        face, radius = line_of(builder, through, given.direction, link, key), None
    span, kind = given.range, section.coordinates[followed[0]]
    builder.reporter.kind((*ROOT, *path, "range"), kind)
    builder.reporter.kind((*ROOT, *path, "step"), kind)
    if span is None and coupling.law is not None:
        span = span_of(builder, ("couplings", name, "law"), coupling, followed[0], profile=True)
    if span is None:
        table = function.table
        if table is None and kind != "angle":
            refuse(builder, path, f"the profile needs the 'range' of {followed[0]!r}, [first, last]")
        span = (0.0, 2 * np.pi / builder.units.angle_factor) if table is None else (table.rows[0][0], table.rows[-1][0])
    steps = given.steps if given.step is None else math.ceil((span[1] - span[0]) / given.step * (1 - ROUNDING))
    if not STEPS[0] <= steps <= STEPS[1]:
        refuse(builder, (*path, "step"), f"makes {steps} steps of the range; {STEPS[0]} to {STEPS[1]} are possible")
    factor = builder.units.angle_factor if kind == "angle" else 1.0
    span = span[0] * factor, span[1] * factor
    return Cam(name, given.link, radius=radius, side=given.side, range=span, steps=steps, face=face)


def _moved(section: models.MechanismSection, name: str) -> tuple[str, ...]:
    """Links of which a coordinate is the angle, or that it slides."""
    target = section.driven(name)[1] if name in section.drives else name.rpartition(".")[0]
    joint = section.joints.get(target)
    return (target,) if joint is None else (joint.prismatic or ())[::-1]


def _function(
    builder: Builder, name: str, given: Written[Coupling], path: KeyPath, kind: Quantity
) -> Expression | None:  # fmt: skip
    """The function of a coupling; None where it has a mistake, which is reported."""
    section, unit = builder.section, builder.units.angle_factor
    to: Expression | None = given.to
    if to is not None:
        parameters = builder.parameter_values
        names = sorted(to.names)
        listed = [*section.coordinates, *section.moving, *section.slides, *parameters]
        if not all(builder.check_name(item, listed, "coordinate or parameter", (*path, "to")) for item in names):
            return None
        builder.parameters_in(to)
        coordinates = {item: item if item in parameters else section.coordinate_named(item) for item in names}
        named = {item: Expression(item, (("name", coordinate),), unit) for item, coordinate in coordinates.items()}
        return replace(to.substituted(named), angle_unit=unit)
    listed = [*section.coordinates, *section.moving, *section.slides]
    if not builder.check_name(given.of, listed, "coordinate", (*path, "of")):
        return None
    of = section.coordinate_named(given.of)
    if given.law is not None:
        if given.cam is None:
            span_of(builder, (*path, "law"), given, of, profile=False)
        return law_of(builder, name, given.law, of, kind)
    if given.table is not None:
        table = _table(builder, given.table, section.coordinates[of], (*path, "table"))
        return None if table is None else Expression.of_table(f"the table of {name}", table, of, unit)
    if float(given.ratio) == 0.0:
        message = f"with a ratio of 0 {given.set_!r} would stand still: give it a value by 'to', or clamp its link"
        builder.report((*path, "ratio"), message)
    # Per radian a length is the radius of a pinion; per degree it is none.
    if section.coordinates[of] == kind or unit != 1.0:
        builder.reporter.kind((*ROOT, *path, "ratio"), "none")
    builder.reporter.kind((*ROOT, *path, "phase"), kind)
    ratio = builder.place((*path, "ratio"), given.ratio, "none", in_coupling=True)
    phase = builder.place((*path, "phase"), 0.0 if given.phase is None else given.phase, kind, in_coupling=True)
    steps: tuple[Step, ...] = (("name", ratio), ("name", of), ("call", "*"), ("name", phase), ("call", "+"))
    return Expression(f"{ratio}*{of} + {phase}", steps, unit)


def _table(
    builder: Builder, given: str | tuple[tuple[float, ...], ...], kind: Quantity, path: KeyPath
) -> Tabulated | None:  # fmt: skip
    """The spline through a table, which repeats if it spans a turn and ends as it begins."""
    try:
        rows = read_table(builder.folder, given) if isinstance(given, str) else np.array(given)
    except StudyError as error:
        builder.report(path, str(error))
        return None
    if rows.shape[1] != 2 or len(rows) < FEWEST_ROWS or not (np.diff(rows[:, 0]) > APART * np.ptp(rows[:, 0])).all():
        builder.report(path, f"a table has two columns and at least {FEWEST_ROWS} rows, the first column rising")
        return None
    turn, span = 2 * np.pi / builder.units.angle_factor, rows[-1] - rows[0]
    size = np.ptp(rows[:, 1])
    typed = max(_last_digit(float(x)) for x in rows[[0, -1], 0])
    near = abs(span[0] - turn) <= max(1e-9 * turn, min(LAST_DIGIT * typed, LIKE_A_TURN * turn))
    repeats = kind == "angle" and near and abs(span[1]) <= 1e-9 * size
    if repeats:
        rows[-1] = rows[0, 0] + turn, rows[0, 1]
    return Tabulated(tuple((float(x), float(y)) for x, y in rows), float(turn) if repeats else 0.0)


def _last_digit(number: float) -> float:
    """One in the last decimal with which a number is written; 0 of a whole number, which is exact."""
    return 0.0 if number.is_integer() else 10.0 ** -len(f"{Decimal(repr(number)):f}".partition(".")[2])


def with_phases(builder: Builder, description: Description) -> Description:
    """A description with the phases of couplings that are left out, as the sketch shows them."""
    left_out = [
        name for name, given in builder.section.couplings.items() if given.ratio is not None and given.phase is None
    ]
    if not left_out or builder.reporter.problems:
        return description
    try:
        graph = build_graph(description)
        sketch = locate(description, graph, Geometry(graph, description.places))
    except MechanismError:
        # It is reported where the mechanism is compiled.
        return description
    for name in left_out:
        pair = coupled(description.couplings[name], description, graph)
        of = next(part for part in pair.function.parts if part.kind != "parameter")
        drawn = [sketch.value(c) if c.kind in ("angle", "slide") else None for c in (pair.follower, of)]
        units = [builder.units.angle_factor if c.quantity == "angle" else 1.0 for c in (pair.follower, of)]
        follower, followed = (0.0 if value is None else value / unit for value, unit in zip(drawn, units, strict=True))
        if drawn[0] is not None:
            phase = follower - description.places[f"{name}.ratio"].nominal * followed
            builder.place(("couplings", name, "phase"), phase, pair.follower.quantity, measured=True, in_coupling=True)
    return description
