"""From the validated mechanism section to `Description`: names checked, defaults of joints filled in."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from decimal import Decimal
from typing import Any, Literal, NoReturn

import numpy as np

from mechdesign.errors import MechanismError, StudyError, suggestion
from mechdesign.expressions import Expression
from mechdesign.functions import Tabulated
from mechdesign.mechanism.coordinates import coupled
from mechdesign.mechanism.elements.couplings import MEASURED, Cam, Coupling, play
from mechdesign.mechanism.elements.declared import Quantity
from mechdesign.mechanism.elements.drives import Drive
from mechdesign.mechanism.elements.joints import AnyJoint, Fixed, Friction, Joint, LinkLine, Prismatic, Slot
from mechdesign.mechanism.elements.links import Link
from mechdesign.mechanism.elements.measures import Limit, Measure
from mechdesign.mechanism.elements.plates import Plates
from mechdesign.mechanism.elements.springs import Spring
from mechdesign.mechanism.geometry import Geometry
from mechdesign.mechanism.graph import GROUND, build_graph
from mechdesign.mechanism.model import Description
from mechdesign.mechanism.sketch import locate
from mechdesign.notation import ExpressionError, Step
from mechdesign.study.building import section as models
from mechdesign.study.building.builder import ROOT, Builder
from mechdesign.study.building.elements import Written
from mechdesign.study.text.csv_files import read_table
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.fields import APART
from mechdesign.study.text.units import Amount

# Rows from which a cubic spline is told.
FEWEST_ROWS = 4
# A table spans a turn where it misses one by less than this in its last decimal, and by less than this part of a turn:
# 2 pi is written 6.283, or cut off as 6.2831.
LAST_DIGIT, LIKE_A_TURN = 0.9, 1e-3


def build(builder: Builder) -> Description:
    """Run all steps; the result is of use only if the reporter has no problems."""
    builder.check_distinct()
    builder.check_sketch()
    builder.build_links()
    joints = _joints(builder)
    _check_connected(builder)
    _check_pins(builder)
    drives, measures, limits = _drives(builder), _measures(builder), _limits(builder)
    springs = _springs(builder)
    branch: Literal["side", "follow"] = "follow" if builder.section.branch == "follow" else "side"
    couplings = _couplings(builder)
    description = Description(
        builder.places, builder.links, joints, drives, measures, limits, builder.sketch, branch,
        builder.units.angle_factor, builder.masses, springs, couplings, _friction(builder),
        _plates(builder),
    )  # fmt: skip
    return _with_phases(builder, description)


class _WrongJoint(Exception):
    """A mistake of a joint, already reported."""


def _joints(builder: Builder) -> dict[str, AnyJoint]:
    """Build every joint of the section whose names are right."""
    makers: dict[str, Callable[..., AnyJoint]] = {"prismatic": _prismatic, "slot": _slot, "fixed": _fixed}
    joints: dict[str, AnyJoint] = {}
    for name, section in builder.section.joints.items():
        with contextlib.suppress(_WrongJoint):
            joints[name] = makers[section.kind](builder, name, section, getattr(section, section.kind))
    return joints


def _refuse(builder: Builder, path: KeyPath, message: str) -> NoReturn:
    builder.report(path, message)
    raise _WrongJoint


def _check_named(builder: Builder, noun: str, names: Sequence[str], path: KeyPath) -> None:
    if not builder.check_named(noun, names, path):
        raise _WrongJoint
    if len(names) == 2 and names[0] == names[1]:
        _refuse(builder, path, f"a joint of link {names[0]!r} with itself")


def _check_on_link(builder: Builder, link: str, point: str, path: KeyPath) -> None:
    points = builder.section.points_of(link)
    if point not in points:
        hint = suggestion(point, points) or f"; it has {', '.join(points)}"
        _refuse(builder, path, f"link {link!r} has no point {point!r}{hint}")


def _line(builder: Builder, through: Sequence[str], direction: Amount | None, link: str, path: KeyPath) -> LinkLine:
    """A line of a link through one point or two, which stand at `path`."""
    for k, point in enumerate(through):
        _check_on_link(builder, link, point, (*path, k))
    if len(through) == 2:
        points = builder.links[link].points
        far = [point for point in through if point not in points]
        if far:
            message = f"{far[0]!r} moves along leg {link!r}: a line needs two points of one body; give 'direction'"
            _refuse(builder, path, message)
        first, second = ([builder.nominal(term) for term in points[point]] for point in through)
        if first == second:
            _refuse(builder, path, f"{' and '.join(map(repr, through))} are one place: no direction")
        return LinkLine(link, through[0], 0.0, through[1])
    angle = builder.place((*path[:-1], "direction"), 0.0 if direction is None else direction, "angle")
    return LinkLine(link, through[0] if through else None, angle)


def _line_of_joint(builder: Builder, name: str, section: Written[Joint], link: str) -> LinkLine:
    return _line(builder, section.through or (), section.direction, link, ("joints", name, "through"))


def _prismatic(builder: Builder, name: str, section: Written[Joint], pair: tuple[str, str]) -> Prismatic:
    path: KeyPath = ("joints", name)
    _check_named(builder, "link", pair, (*path, "prismatic"))
    guide, slider = pair
    points = builder.section.points_of(slider)
    if section.point is not None:
        _check_on_link(builder, slider, section.point, (*path, "point"))
    elif len(points) != 1:
        _refuse(builder, path, f"link {slider!r} has points {', '.join(points)}: say which one slides, as 'point'")
    line = _line_of_joint(builder, name, section, guide)
    angle = builder.place((*path, "angle"), 0.0 if section.angle is None else section.angle, "angle")
    return Prismatic(name, line, slider, section.point or points[0], angle)


def _slot(builder: Builder, name: str, section: Written[Joint], guide: str) -> Slot:
    path: KeyPath = ("joints", name)
    _check_named(builder, "link", (guide,), (*path, "slot"))
    if section.point is None:
        _refuse(builder, path, "a slot needs the 'point' of another link that slides in it")
    _check_named(builder, "point", (section.point,), (*path, "point"))
    if builder.section.owners[section.point] == [guide]:
        message = f"point {section.point!r} is on link {guide!r} itself, which has the slot"
        _refuse(builder, (*path, "point"), message)
    return Slot(name, _line_of_joint(builder, name, section, guide), section.point)


def _fixed(builder: Builder, name: str, section: Written[Joint], pair: tuple[str, str]) -> Fixed:
    path: KeyPath = ("joints", name)
    _check_named(builder, "link", pair, (*path, "fixed"))
    shared = [point for point in builder.section.points_of(pair[0]) if point in builder.section.points_of(pair[1])]
    if section.point is not None:
        for link in pair:
            _check_on_link(builder, link, section.point, (*path, "point"))
    elif len(shared) != 1:
        message = f"links {pair[0]!r} and {pair[1]!r} share {len(shared)} points: say which, as 'point'"
        _refuse(builder, path, message)
    point = section.point or shared[0]
    if section.angle is not None:
        return Fixed(name, pair, point, builder.place((*path, "angle"), section.angle, "angle"))
    one, other = (builder.link_direction(link) for link in pair)
    if one is None or other is None:
        lost = pair[0] if one is None else pair[1]
        message = f"its angle is left out and so measured from the sketch, which does not show how link {lost!r} lies"
        _refuse(builder, path, message)
    angle = (other - one) / builder.units.angle_factor
    return Fixed(name, pair, point, builder.place((*path, "angle"), angle, "angle", measured=True))


def _check_pins(builder: Builder) -> None:
    """Report links that share two points, and slides between links that a shared point pins together."""
    section = builder.section
    for index, (name, link) in enumerate(builder.links.items()):
        for other in list(builder.links.values())[:index]:
            shared = [point for point in link.points if point in other.points]
            if len(shared) > 1:
                builder.report(("links", name), _shared_twice(builder, link, other, shared), at_key=True)
    for name, joint in section.joints.items():
        pair = joint.prismatic or ((joint.slot, joint.point) if joint.slot and joint.point else None)
        if pair is None:
            continue
        points = section.points_of(pair[0])
        pinned = [point for point in points if point in (section.points_of(pair[1]) if joint.prismatic else [pair[1]])]
        if pinned and (joint.prismatic or section.owners[pinned[0]] != [pair[0]]):
            mend = "a pin holds it to that link; leave it out there"
            if joint.prismatic:
                mend = "a point that two links name pins them together; give the slider's point a name of its own"
            message = f"point {pinned[0]!r} is on link {pair[0]!r} too, so that it cannot slide: {mend}"
            builder.report(("joints", name), message)


def _shared_twice(builder: Builder, link: Link, other: Link, shared: list[str]) -> str:
    places = [[complex(*map(builder.nominal, body.points[point])) for point in shared[:2]] for body in (link, other)]
    one, two = (abs(b - a) for a, b in places)
    pins = f"{shared[0]!r} and {shared[1]!r}"
    if abs(one - two) > 1e-9 * max(one, two):
        return (
            f"{pins} are on link {other.name!r} too, but {two:.9g} apart there and {one:.9g} here; keep one of the two"
        )
    mend = "leave it out" if other.name == GROUND else "make the two one link that has all their points"
    return f"{pins} are on link {other.name!r} too: the two are one rigid body; {mend}"


def _check_connected(builder: Builder) -> None:
    """Report links that are not connected to the ground by shared points or joints."""
    section, owners = builder.section, builder.section.owners
    ties = [set(links) for links in owners.values()]
    for joint in section.joints.values():
        ties.append({*(joint.prismatic or ()), *(joint.fixed or ())})
        if joint.slot and joint.point:
            ties.append({joint.slot, *owners.get(joint.point, ())})
    reached, before = {GROUND}, 0
    while len(reached) > before:
        before = len(reached)
        reached.update(*(tie for tie in ties if tie & reached))
    for name in section.links:
        if name in reached or GROUND not in section.links:
            continue
        points = builder.section.points_of(name)
        mates = sorted({link for tie in ties if name in tie for link in tie} - {name})
        if mates:
            message = f"nothing joins it to the ground: only to {', '.join(mates)}"
        else:
            others = [point for point, links in owners.items() if links != [name]]
            hint = next((text for text in (suggestion(point, others) for point in points) if text), "")
            message = f"no other link shares a point of it ({', '.join(points)}){hint}"
        builder.report(("links", name), message, at_key=True)


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
            parameters = builder.parameter_values
            noun, listed = "coordinate or parameter", [*above, *parameters]
            if all(builder.check_name(item, listed, noun, path) for item in sorted(expression.names)):
                for item in expression.names & parameters.keys():
                    builder.place((MEASURED + item,), Amount(parameters[item], "", Expression.parse(item)), "none")
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


def _friction(builder: Builder) -> dict[str, Friction]:
    """Friction of joints without mistakes in their names; its numbers become places."""
    section, friction = builder.section, dict[str, Friction]()
    names = [*section.owners, *section.slides, *section.legs]
    for name, given in section.friction.items():
        path = ("friction", name)
        joint = section.joints.get(name)
        if joint is not None and joint.fixed is not None:
            builder.report(path, f"{name!r} is a clamp, in which nothing moves: leave it out", at_key=True)
            continue
        if not builder.reporter.check_name(name, names, "pin, slide or telescopic link", (*ROOT, *path), at_key=True):
            continue
        if name in section.owners:
            clamps = [clamp for clamp in section.joints.values() if clamp.fixed and _clamped_at(builder, clamp, name)]
            if len(section.owners[name]) - len(clamps) < 2:
                slots = [slot for slot, other in section.joints.items() if other.slot and other.point == name]
                mend = f"; it slides in {slots[0]!r}: give the friction of that" if slots else "; leave it out"
                builder.report(path, f"no pin turns at {name!r}{mend}", at_key=True)
            if given.radius is None:
                builder.report(path, f"friction of the pin {name!r} turns against its radius: give 'radius'")
            if given.length is not None:
                builder.report((*path, "length"), "a pin has no 'length'; give its 'radius'", at_key=True)
        else:
            if given.radius is not None:
                message = f"{name!r} slides: its friction has no 'radius'"
                builder.report((*path, "radius"), message, at_key=True)
            if given.length is not None and joint is not None and joint.slot:
                message = "the pin in a slot bears no moment: its friction has no 'length'"
                builder.report((*path, "length"), message, at_key=True)
        friction[name] = Friction(name, **builder.numbers(given, *path))
    return friction


def _plates(builder: Builder) -> Plates | None:
    """Plates without mistakes in their names, where the study gives a width; their numbers become places."""
    given, links = builder.section.plates, builder.section.links
    widths = {
        name: builder.place(("links", name, "width"), link.width)
        for name, link in links.items()
        if link.width is not None
    }
    layers = {name: link.layer for name, link in links.items() if link.layer is not None}
    lengths = builder.numbers(given, "plates") if given is not None else {}
    if "width" not in lengths and not widths:
        if given is not None:
            builder.report(("plates",), "plates need a 'width', of all or of a link", at_key=True)
        for name in layers:
            builder.report(("links", name), "a 'layer' belongs to plates; give mechanism.plates.width", at_key=True)
        return None
    lengths.setdefault("width", min(widths.values(), key=builder.nominal, default=0.0))
    pins = {
        name: builder.place(("plates", "pins", name), diameter)
        for name, diameter in (given.pins if given is not None else {}).items()
        if builder.reporter.check_name(
            name, builder.section.owners, "point", (*ROOT, "plates", "pins", name), at_key=True
        )
    }
    plates = Plates("plates", **lengths, widths=widths, pins=pins, layers=layers)
    _check_holes(builder, plates)
    return plates


def _check_holes(builder: Builder, plates: Plates) -> None:
    """Check that the holes of every given diameter are narrower than their links and wider than the kerf."""
    faults: dict[KeyPath, str] = {}
    for point, links in builder.section.owners.items():
        diameter = plates.pins.get(point, plates.pin)
        if len(links) < 2 or diameter is None:
            continue
        pin, kerf = builder.nominal(diameter), builder.nominal(plates.kerf)
        path: KeyPath = ("plates", "pins", point) if point in plates.pins else ("plates", "pin")
        widths = {link: builder.nominal(plates.widths.get(link, plates.width)) for link in links}
        link = min(widths, key=lambda name: widths[name])
        head = f"the pin at {point!r} has a diameter of {pin:g}"
        if pin >= widths[link]:
            message = f"{head}, and link {link!r} is {widths[link]:g} wide: its hole would cut the link through"
            faults.setdefault(path, message)
        if kerf >= pin:
            faults.setdefault(("plates", "kerf"), f"{head}, and the kerf is {kerf:g}: no hole would be left")
    for key, message in faults.items():
        builder.report(key, message, at_key=True)


def _clamped_at(builder: Builder, clamp: Written[Joint], point: str) -> bool:
    assert clamp.fixed is not None
    one, other = (builder.section.points_of(link) for link in clamp.fixed)
    return point == (clamp.point or next((shared for shared in one if shared in other), None))


def _couplings(builder: Builder) -> dict[str, Coupling]:
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
            with contextlib.suppress(_WrongJoint):
                cam = _cam(builder, name, given, sets, function)
        couplings[name] = Coupling(
            name, sets, function, wheels=given.wheels, pressure_angle=pressure, radius=given.radius or 0.0, cam=cam
        )
    return couplings


def _cam(builder: Builder, name: str, coupling: Written[Coupling], sets: str, function: Expression) -> Cam:
    """The cam of a coupling; `sets` is the coordinate that follows."""
    section, given, path = builder.section, coupling.cam, ("couplings", name, "cam")
    assert given is not None
    _check_named(builder, "link", [given.link], (*path, "link"))
    followed = sorted(function.names - builder.parameter_values.keys() - {f"{name}.ratio", f"{name}.phase"})
    if len(followed) != 1:
        _refuse(builder, path, f"a cam follows one coordinate, not {', '.join(followed) or 'none'}")
    through = given.flat or (given.roller or "",)
    key = (*path, given.kind)
    _check_named(builder, "point", through[:1], key)
    owners = [link for link in section.owners[through[0]] if link != given.link]
    if not owners:
        _refuse(builder, key, f"point {through[0]!r} is on the cam {given.link!r} itself; give one of its follower")
    link = next((link for link in _moved(section, sets) if link in owners), owners[0])
    if given.flat is None:
        face = LinkLine(link, through[0])
        radius = builder.place((*path, "radius"), given.radius or 0.0)
    else:
        face, radius = _line(builder, through, given.direction, link, key), None
    span, kind = given.range, section.coordinates[followed[0]]
    builder.reporter.kind((*ROOT, *path, "range"), kind)
    if span is None:
        table = function.table
        if table is None and kind != "angle":
            _refuse(builder, path, f"the profile needs the 'range' of {followed[0]!r}, [first, last]")
        span = (0.0, 2 * np.pi / builder.units.angle_factor) if table is None else (table.rows[0][0], table.rows[-1][0])
    factor = builder.units.angle_factor if kind == "angle" else 1.0
    span = span[0] * factor, span[1] * factor
    return Cam(name, given.link, radius=radius, side=given.side, range=span, steps=given.steps, face=face)


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
        for item in to.names & parameters.keys():
            builder.place((MEASURED + item,), Amount(parameters[item], "", Expression.parse(item)), "none")
        coordinates = {item: item if item in parameters else section.coordinate_named(item) for item in names}
        named = {item: Expression(item, (("name", coordinate),), unit) for item, coordinate in coordinates.items()}
        return replace(to.substituted(named), angle_unit=unit)
    assert given.of is not None
    listed = [*section.coordinates, *section.moving, *section.slides]
    if not builder.check_name(given.of, listed, "coordinate", (*path, "of")):
        return None
    of = section.coordinate_named(given.of)
    if given.table is not None:
        table = _table(builder, given.table, section.coordinates[of], (*path, "table"))
        return None if table is None else Expression.of_table(f"the table of {name}", table, of, unit)
    assert given.ratio is not None
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


def _with_phases(builder: Builder, description: Description) -> Description:
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
