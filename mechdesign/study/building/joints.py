"""Joints of a validated mechanism section, their friction, and what joins the links."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from typing import NoReturn

from mechdesign.ground.errors import suggestion
from mechdesign.ground.numerics.graphs import pieces
from mechdesign.mechanism.elements.joints import AnyJoint, Fixed, Friction, Joint, LinkLine, Prismatic, Slot
from mechdesign.mechanism.elements.links import Link
from mechdesign.mechanism.graph import GROUND
from mechdesign.study.building.builder import ROOT, Builder
from mechdesign.study.building.elements import Written
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.units import Amount


class WrongJoint(Exception):
    """A mistake of a joint, already reported."""


def build_joints(builder: Builder) -> dict[str, AnyJoint]:
    """Build every joint of the section whose names are right."""
    makers: dict[str, Callable[..., AnyJoint]] = {"prismatic": _prismatic, "slot": _slot, "fixed": _fixed}
    joints: dict[str, AnyJoint] = {}
    for name, section in builder.section.joints.items():
        with contextlib.suppress(WrongJoint):
            joints[name] = makers[section.kind](builder, name, section, getattr(section, section.kind))
    return joints


def refuse(builder: Builder, path: KeyPath, message: str) -> NoReturn:
    builder.report(path, message)
    raise WrongJoint


def check_named(builder: Builder, noun: str, names: Sequence[str], path: KeyPath) -> None:
    if not builder.check_named(noun, names, path):
        raise WrongJoint
    if len(names) == 2 and names[0] == names[1]:
        refuse(builder, path, f"a joint of link {names[0]!r} with itself")


def _check_on_link(builder: Builder, link: str, point: str, path: KeyPath) -> None:
    points = builder.section.points_of(link)
    if point not in points:
        hint = suggestion(point, points) or f"; it has {', '.join(points)}"
        refuse(builder, path, f"link {link!r} has no point {point!r}{hint}")


def line_of(builder: Builder, through: Sequence[str], direction: Amount | None, link: str, path: KeyPath) -> LinkLine:
    """A line of a link through one point or two, which stand at `path`."""
    for k, point in enumerate(through):
        _check_on_link(builder, link, point, (*path, k))
    if len(through) == 2:
        points = builder.links[link].points
        far = [point for point in through if point not in points]
        if far:
            message = f"{far[0]!r} moves along leg {link!r}: a line needs two points of one body; give 'direction'"
            refuse(builder, path, message)
        first, second = ([builder.nominal(term) for term in points[point]] for point in through)
        if first == second:
            refuse(builder, path, f"{' and '.join(map(repr, through))} are one place: no direction")
        return LinkLine(link, through[0], 0.0, through[1])
    angle = builder.place((*path[:-1], "direction"), 0.0 if direction is None else direction, "angle")
    return LinkLine(link, through[0] if through else None, angle)


def _line_of_joint(builder: Builder, name: str, section: Written[Joint], link: str) -> LinkLine:
    return line_of(builder, section.through or (), section.direction, link, ("joints", name, "through"))


def _prismatic(builder: Builder, name: str, section: Written[Joint], pair: tuple[str, str]) -> Prismatic:
    path: KeyPath = ("joints", name)
    check_named(builder, "link", pair, (*path, "prismatic"))
    guide, slider = pair
    points = builder.section.points_of(slider)
    if section.point is not None:
        _check_on_link(builder, slider, section.point, (*path, "point"))
    elif len(points) != 1:
        refuse(builder, path, f"link {slider!r} has points {', '.join(points)}: say which one slides, as 'point'")
    line = _line_of_joint(builder, name, section, guide)
    angle = builder.place((*path, "angle"), 0.0 if section.angle is None else section.angle, "angle")
    return Prismatic(name, line, slider, section.point or points[0], angle)


def _slot(builder: Builder, name: str, section: Written[Joint], guide: str) -> Slot:
    path: KeyPath = ("joints", name)
    check_named(builder, "link", (guide,), (*path, "slot"))
    if section.point is None:
        refuse(builder, path, "a slot needs the 'point' of another link that slides in it")
    check_named(builder, "point", (section.point,), (*path, "point"))
    if builder.section.owners[section.point] == [guide]:
        message = f"point {section.point!r} is on link {guide!r} itself, which has the slot"
        refuse(builder, (*path, "point"), message)
    return Slot(name, _line_of_joint(builder, name, section, guide), section.point)


def _fixed(builder: Builder, name: str, section: Written[Joint], pair: tuple[str, str]) -> Fixed:
    path: KeyPath = ("joints", name)
    check_named(builder, "link", pair, (*path, "fixed"))
    shared = [point for point in builder.section.points_of(pair[0]) if point in builder.section.points_of(pair[1])]
    if section.point is not None:
        for link in pair:
            _check_on_link(builder, link, section.point, (*path, "point"))
    elif len(shared) != 1:
        message = f"links {pair[0]!r} and {pair[1]!r} share {len(shared)} points: say which, as 'point'"
        refuse(builder, path, message)
    point = section.point or shared[0]
    if section.angle is not None:
        return Fixed(name, pair, point, builder.place((*path, "angle"), section.angle, "angle"))
    one, other = (builder.link_direction(link) for link in pair)
    if one is None or other is None:
        lost = pair[0] if one is None else pair[1]
        message = f"its angle is left out and so measured from the sketch, which does not show how link {lost!r} lies"
        refuse(builder, path, message)
    angle = (other - one) / builder.units.angle_factor
    return Fixed(name, pair, point, builder.place((*path, "angle"), angle, "angle", measured=True))


def check_pins(builder: Builder) -> None:
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


def check_connected(builder: Builder) -> None:
    """Report links that are not connected to the ground by shared points or joints."""
    section, owners = builder.section, builder.section.owners
    ties = [set(links) for links in owners.values()]
    for joint in section.joints.values():
        ties.append({*(joint.prismatic or ()), *(joint.fixed or ())})
        if joint.slot and joint.point:
            ties.append({joint.slot, *owners.get(joint.point, ())})
    (reached,) = (piece for piece in pieces([{GROUND}, *ties]) if GROUND in piece)
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


def build_friction(builder: Builder) -> dict[str, Friction]:
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


def _clamped_at(builder: Builder, clamp: Written[Joint], point: str) -> bool:
    one, other = (builder.section.points_of(link) for link in clamp.fixed)
    return point == (clamp.point or next((shared for shared in one if shared in other), None))
