"""Joints that are not revolutes: their names checked, their defaults filled in."""

from __future__ import annotations

from collections.abc import Callable

from mechdesign.mechanism.model import Fixed, Line, Prismatic, Slot
from mechdesign.mechanism.model import Joint as JointModel
from mechdesign.mechanism.model import Link as LinkModel
from mechdesign.study.build import section as models
from mechdesign.study.build.builder import Builder
from mechdesign.study.text.document import KeyPath
from mechdesign.study.build.names import GROUND
from mechdesign.errors import suggestion


def build(builder: Builder) -> dict[str, JointModel]:
    """Build every joint of the section whose names are right."""
    makers: dict[str, Callable[..., JointModel | None]] = {"prismatic": _prismatic, "slot": _slot, "fixed": _fixed}
    joints = {
        name: makers[section.kind](builder, name, section, getattr(section, section.kind))
        for name, section in builder.section.joints.items()
    }
    return {name: joint for name, joint in joints.items() if joint is not None}


def _pair(builder: Builder, path: KeyPath, pair: tuple[str, str]) -> bool:
    if not builder.check_named("link", pair, path):
        return False
    if pair[0] == pair[1]:
        builder.report(path, f"a joint of link {pair[0]!r} with itself")
        return False
    return True


def _on_link(builder: Builder, link: str, point: str, path: KeyPath) -> bool:
    points = builder.names.points_of(link)
    if point in points:
        return True
    hint = suggestion(point, points) or f"; it has {', '.join(points)}"
    builder.report(path, f"link {link!r} has no point {point!r}{hint}")
    return False


def _line(builder: Builder, name: str, section: models.Joint, link: str) -> Line | None:
    path: KeyPath = ("joints", name)
    through = section.through or ()
    if not all(_on_link(builder, link, point, (*path, "through", k)) for k, point in enumerate(through)):
        return None
    if len(through) == 2:
        points = builder.links[link].points
        far = [point for point in through if point not in points]
        if far:
            message = f"{far[0]!r} moves along leg {link!r}: a line needs two points of one body; give 'direction'"
            builder.report((*path, "through"), message)
            return None
        first, second = ([builder.nominal(term) for term in points[point]] for point in through)
        if first == second:
            builder.report((*path, "through"), f"{' and '.join(map(repr, through))} are one place: no direction")
            return None
        return Line(link, through[0], 0.0, through[1])
    direction = builder.place(f"{name}.direction", section.direction or 0.0, "angle")
    return Line(link, through[0] if through else None, direction)


def _prismatic(builder: Builder, name: str, section: models.Joint, pair: tuple[str, str]) -> Prismatic | None:
    path: KeyPath = ("joints", name)
    if not _pair(builder, (*path, "prismatic"), pair):
        return None
    guide, slider = pair
    point = section.point
    if point is None:
        points = builder.names.points_of(slider)
        if len(points) != 1:
            builder.report(path, f"link {slider!r} has points {', '.join(points)}: say which one slides, as 'point'")
            return None
        point = points[0]
    elif not _on_link(builder, slider, point, (*path, "point")):
        return None
    line = _line(builder, name, section, guide)
    if line is None:
        return None
    return Prismatic(name, line, slider, point, builder.place(f"{name}.angle", section.angle or 0.0, "angle"))


def _slot(builder: Builder, name: str, section: models.Joint, guide: str) -> Slot | None:
    path: KeyPath = ("joints", name)
    if not builder.check_name(guide, builder.section.links, "link", (*path, "slot")):
        return None
    if section.point is None:
        builder.report(path, "a slot needs the 'point' of another link that slides in it")
        return None
    if not builder.check_name(section.point, builder.names.owners, "point", (*path, "point")):
        return None
    if builder.names.owners[section.point] == [guide]:
        builder.report((*path, "point"), f"point {section.point!r} is on link {guide!r} itself, which has the slot")
        return None
    line = _line(builder, name, section, guide)
    return None if line is None else Slot(name, line, section.point)


def _fixed(builder: Builder, name: str, section: models.Joint, pair: tuple[str, str]) -> Fixed | None:
    path: KeyPath = ("joints", name)
    if not _pair(builder, (*path, "fixed"), pair):
        return None
    shared = [point for point in builder.names.points_of(pair[0]) if point in builder.names.points_of(pair[1])]
    point = section.point
    if point is None:
        if len(shared) != 1:
            builder.report(path, f"links {pair[0]!r} and {pair[1]!r} share {len(shared)} points: say which, as 'point'")
            return None
        point = shared[0]
    elif not all(_on_link(builder, link, point, (*path, "point")) for link in pair):
        return None
    if section.angle is not None:
        return Fixed(name, pair, point, builder.place(f"{name}.angle", section.angle, "angle"))
    directions = [builder.link_direction(link) for link in pair]
    if directions[0] is None or directions[1] is None:
        lost = pair[0] if directions[0] is None else pair[1]
        message = f"its angle is left out and so measured from the sketch, which does not show how link {lost!r} lies"
        builder.report(path, message)
        return None
    angle = (directions[1] - directions[0]) / builder.units.angle_factor
    return Fixed(name, pair, point, builder.place(f"{name}.angle", angle, "angle", measured=True))


def check_pins(builder: Builder) -> None:
    """Note links that share two points, and slides between links that a shared point pins together."""
    section, names = builder.section, builder.names
    for index, (name, link) in enumerate(builder.links.items()):
        for other in list(builder.links.values())[:index]:
            shared = [point for point in link.points if point in other.points]
            if len(shared) > 1:
                builder.report(("links", name), _shared_twice(builder, link, other, shared), at_key=True)
    for name, joint in section.joints.items():
        pair = joint.prismatic or ((joint.slot, joint.point) if joint.slot and joint.point else None)
        if pair is None:
            continue
        points = names.points_of(pair[0])
        pinned = [point for point in points if point in (names.points_of(pair[1]) if joint.prismatic else [pair[1]])]
        if pinned and (joint.prismatic or names.owners[pinned[0]] != [pair[0]]):
            what = (
                "a point that two links name pins them together" if joint.prismatic else "a pin holds it to that link"
            )
            mend = "give the slider's point a name of its own" if joint.prismatic else "leave it out there"
            message = f"point {pinned[0]!r} is on link {pair[0]!r} too, so that it cannot slide: {what}; {mend}"
            builder.report(("joints", name), message)


def _shared_twice(builder: Builder, link: LinkModel, other: LinkModel, shared: list[str]) -> str:
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
    """Note links that neither shared points nor joints lead to from the ground."""
    section, owners = builder.section, builder.names.owners
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
        points = builder.names.points_of(name)
        mates = sorted({link for tie in ties if name in tie for link in tie} - {name})
        if mates:
            message = f"nothing joins it to the ground: only to {', '.join(mates)}"
        else:
            others = [point for point, links in owners.items() if links != [name]]
            hint = next((text for text in (suggestion(point, others) for point in points) if text), "")
            message = f"no other link shares a point of it ({', '.join(points)}){hint}"
        builder.report(("links", name), message, at_key=True)
