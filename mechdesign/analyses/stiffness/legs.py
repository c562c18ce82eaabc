"""From links and joints to serial-chain legs: what carries a wrench from the asked body to the ground.

Bodies are the vertices of a graph and joints its edges. Taking away the ground and the asked body leaves one piece a
leg; a leg is serial if its piece, without its dangling ends, is a plain path. No names of mechanisms occur: what is not
such a path is told as such.

[S4, section 2]
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from mechdesign.analyses.stiffness.beams import Beams, beams_of
from mechdesign.analyses.stiffness.bodies import ASKED, Bodies, Contact, build_bodies
from mechdesign.mechanism.graph import GROUND, rod_of
from mechdesign.mechanism.mechanism import Mechanism
from mechdesign.study.schema.stiffness import StiffnessSection


@dataclass(frozen=True)
class Hinge:
    """A revolute joint at a point; driven if `drive` names a drive."""

    point: str
    drive: str | None = None


@dataclass(frozen=True)
class Guide:
    """A slide of the mechanism's graph (its index); driven if `drive` names a drive."""

    slide: int
    drive: str | None = None


@dataclass(frozen=True)
class Beam:
    """The beams of an elastic link between the feet of two points; see `mechdesign.analyses.stiffness.beams`."""

    beams: Beams
    tail: str
    head: str
    section: str


@dataclass(frozen=True)
class Shift:
    """A free displacement along a direction of the world: between links that only a motor holds to each other."""

    direction: complex


@dataclass(frozen=True)
class Bearing:
    """The give of a joint itself, so many times; across its slide, or in all directions of a pin."""

    name: str
    point: str
    slide: int | None = None
    give: float = 1.0


Element = Hinge | Guide | Beam | Shift | Bearing


@dataclass(frozen=True)
class Leg:
    """A serial chain from the ground to the asked body.

    Parameters
    ----------
    name : str
        Its links, from the base, joined by ``+``; that of its joint where it has none.
    links : tuple of str
        Links in the chain.
    drives : tuple of str
        Drives at its joints.
    base, tip : str
        Points of its first and last joint.
    elements : tuple
        Joints and beams in order from the base; rigid drives and rigid links are not among them.
    """

    name: str
    links: tuple[str, ...]
    drives: tuple[str, ...]
    base: str
    tip: str
    elements: tuple[Element, ...]


class NotSerialError(Exception):
    """The body does not stand on serial chains; says why."""


def find_legs(mechanism: Mechanism, link: str | None, at: str, section: StiffnessSection) -> tuple[Leg, ...]:
    """Find the legs that carry a body, by structure alone.

    Parameters
    ----------
    link : str or None
        The asked link; None for the pin `at` itself.
    at : str
        The asked point.
    section : StiffnessSection
        What is elastic.

    Raises
    ------
    NotSerialError
        Where the legs are not serial chains.
    """
    description = mechanism.description
    bodies = build_bodies(mechanism, link, at, section)
    builder = _LegBuilder(mechanism, bodies, section)
    legs = [builder.build(path) for path in _paths(bodies)]
    order = {name: k for k, name in enumerate(description.links)}
    legs.sort(key=lambda leg: min((order[name] for name in leg.links), default=len(order)))
    return tuple(legs)


def _paths(bodies: Bodies) -> Iterator[tuple[list[str], list[Contact]]]:
    """Per leg, bodies from the ground to the asked body and the contacts between them."""
    target = bodies.asked
    contacts = bodies.contacts
    for contact in contacts:
        if {contact.a, contact.b} == {GROUND, target}:
            _no_motor([contact])
            yield [GROUND, target], [contact]
    seen: set[str] = set()
    for root in bodies.names:
        if root in seen or root in (GROUND, target):
            continue
        piece = _piece(root, contacts, target)
        seen |= piece
        mine = [c for c in contacts if c.a in piece or c.b in piece]
        mine = _without_dangling(mine, target)
        ends = {end for c in mine for end in (c.a, c.b)}
        if not {GROUND, target} <= ends:
            continue
        _no_motor(mine)
        yield _as_path(mine, target, bodies)


def _no_motor(contacts: Iterable[Contact]) -> None:
    for contact in contacts:
        if contact.kind == "motor":
            raise NotSerialError(f"drive '{contact.drive}' holds an angle between links that no joint of a leg joins")


def _piece(root: str, contacts: Sequence[Contact], target: str) -> set[str]:
    """Bodies joined to `root` otherwise than through the ground or the asked body."""
    piece, stack = {root}, [root]
    while stack:
        body = stack.pop()
        for contact in contacts:
            if body in (contact.a, contact.b):
                other = contact.other(body)
                if other not in piece and other not in (GROUND, target):
                    piece.add(other)
                    stack.append(other)
    return piece


def _without_dangling(contacts: list[Contact], target: str) -> list[Contact]:
    """Contacts that can carry a wrench: bodies held in one place only are taken off, again and again."""
    while True:
        degree: dict[str, int] = {}
        for contact in contacts:
            for end in (contact.a, contact.b):
                degree[end] = degree.get(end, 0) + 1
        loose = {body for body, count in degree.items() if count == 1 and body not in (GROUND, target)}
        if not loose:
            return contacts
        contacts = [c for c in contacts if c.a not in loose and c.b not in loose]


def _as_path(contacts: list[Contact], target: str, bodies: Bodies) -> tuple[list[str], list[Contact]]:
    path, used = [GROUND], list[Contact]()
    while path[-1] != target:
        onward = [c for c in contacts if path[-1] in (c.a, c.b) and c not in used]
        if len(onward) != 1:
            break
        used.append(onward[0])
        path.append(onward[0].other(path[-1]))
    if path[-1] != target or len(used) != len(contacts):
        links = sorted({bodies.link_of(end) for c in contacts for end in (c.a, c.b)} - {GROUND, ""})
        what = f"link '{bodies.link}'" if bodies.link else f"pin '{bodies.at}'"
        raise NotSerialError(
            f"links {', '.join(links)} between the ground and {what} branch or form a loop, so they are no serial chain"
        )
    return path, used


@dataclass(frozen=True)
class _LegBuilder:
    mechanism: Mechanism
    bodies: Bodies
    section: StiffnessSection

    def build(self, path: tuple[list[str], list[Contact]]) -> Leg:
        names, contacts = self._without_pins(*path)
        drives = [contact.drive for contact in contacts]
        elements: list[Element] = []
        for k, contact in enumerate(contacts):
            if k:
                elements += self._beams(names[k], contacts[k - 1], contact)
            elements += joint_elements(self.mechanism, contact, self.section)
        links = tuple(dict.fromkeys(filter(None, map(self.bodies.link_of, names[1:]))))
        if names[-1] != ASKED:
            links = tuple(link for link in links if link != self.bodies.link)
        slide = contacts[0].slide
        joint = contacts[0].point if slide is None else self.mechanism.graph.slides[slide]
        return Leg(
            "+".join(links) or joint, links, tuple(filter(None, drives)), contacts[0].point,
            contacts[-1].point, tuple(elements),
        )  # fmt: skip

    def _without_pins(self, names: list[str], contacts: list[Contact]) -> tuple[list[str], list[Contact]]:
        """Join the two contacts of a compound pin, of which only two links carry, into one."""
        kept, joints = [names[0]], [contacts[0]]
        for k in range(1, len(names) - 1):
            if self.bodies.is_pin(names[k]):
                joints[-1] = joints[-1].through(names[k], contacts[k])
            else:
                kept.append(names[k])
                joints.append(contacts[k])
        return [*kept, names[-1]], joints

    def _beams(self, body: str, entry: Contact, leave: Contact) -> list[Element]:
        """Beams of one body between its two contacts; of a telescopic leg, its whole length at its second body."""
        name = self.bodies.link_of(body)
        section = self.section.elastic.get(name)
        if section is None:
            return []
        link = self.mechanism.description.links[name]
        if link.telescopic and link.ends is not None:
            if body != name:
                return []
            own = {c.other(body) == rod_of(name): c for c in (entry, leave)}
            if True not in own or own[False].point != link.ends[0]:
                raise NotSerialError(f"elastic leg '{name}' is joined elsewhere than at its ends")
            return [Beam(beams_of(link), *link.ends, section)]
        return [Beam(beams_of(link), entry.at(body), leave.at(body), section)]


def joint_elements(mechanism: Mechanism, contact: Contact, section: StiffnessSection) -> list[Element]:
    """What gives at a joint: its freedom, unless a rigid drive holds it, and its bearing, that of a leg at its base."""
    found: list[Element] = []
    drive = contact.drive
    if contact.kind == "clamp":
        return found
    if contact.kind == "motor":
        found += [Shift(1.0 + 0j), Shift(1j)]
    if drive is None or drive in section.actuators:
        found.append(Hinge(contact.point, drive) if contact.slide is None else Guide(contact.slide, drive))
    description = mechanism.description
    name = contact.point if contact.slide is None else mechanism.graph.slides[contact.slide]
    if name in section.bearings and contact.kind != "motor":
        ends = description.links[name].ends if name in description.links else None
        found.append(Bearing(name, contact.point if ends is None else ends[0], contact.slide, contact.give))
    return found
