"""Bodies and the contacts between them: the structure that legs are found in.

A telescopic leg is two bodies, the pin of a slot a massless block of its own, and a pin of three or more links, none
of them the ground or the asked body, a massless body to which each is hinged.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from mechdesign.mechanism.graph import GROUND, origin_of, rod_of
from mechdesign.mechanism.mechanism import Mechanism
from mechdesign.mechanism.model import Description, Drive, Fixed, Prismatic
from mechdesign.study.schema.stiffness import StiffnessSection

ASKED = ":asked"
_PIN = "pin:"


@dataclass(frozen=True)
class Contact:
    """A joint between two bodies, or a motor that holds the angle between two that no joint joins (`drive` names it).

    Parameters
    ----------
    slide : int or None
        Index of its slide in the mechanism's graph.
    mount : str or None
        Where it sits on body `a`, if not at `point`: of a motor between links that share no pin.
    give : float
        How many times the compliance of the joint's bearing lies here.
    """

    kind: Literal["hinge", "slide", "clamp", "motor"]
    a: str
    b: str
    point: str
    slide: int | None = None
    mount: str | None = None
    give: float = 1.0
    drive: str | None = None

    def other(self, body: str) -> str:
        """The body on the other side."""
        return self.b if body == self.a else self.a

    def at(self, body: str) -> str:
        """The point at which it sits on a body."""
        return self.mount if self.mount is not None and body == self.a else self.point


@dataclass(frozen=True)
class Bodies:
    """Bodies of a mechanism and their contacts.

    The `asked` one is that of the `link`, or `ASKED` for a pin (without a link) or the end of an elastic link.
    """

    names: tuple[str, ...]
    contacts: tuple[Contact, ...]
    asked: str
    link: str | None
    at: str

    @staticmethod
    def link_of(body: str) -> str:
        """The link that a body belongs to; empty for massless ones."""
        return "" if body.startswith((_PIN, "slot:", ASKED)) else body.removesuffix(":rod")

    @staticmethod
    def is_pin(body: str) -> bool:
        """Whether a body is the massless pin of several links."""
        return body.startswith(_PIN)


def build_bodies(mechanism: Mechanism, link: str | None, at: str, section: StiffnessSection) -> Bodies:
    """Bodies and contacts of a mechanism.

    An elastic asked link is a body of its leg like any other: what is asked is its section at the point. A pin's
    bearing gives between its two links; of more than two, between each and the pin.
    """
    graph, description = mechanism.graph, mechanism.description

    def holder(name: str, point: str) -> str:
        return name if (name, point) in graph.points else rod_of(name)

    holders: dict[str, list[str]] = {}
    for body, point in graph.points:
        if ":" not in point:
            holders.setdefault(point, []).append(body)
    names = list(graph.bodies)
    contacts: list[Contact] = []
    for name, leg in description.links.items():
        if leg.telescopic and leg.ends is not None:
            contacts.append(
                Contact(
                    "slide", name, rod_of(name), leg.ends[1], graph.slides.index(name), drive=_mover(description, name)
                )
            )
    for name, joint in description.joints.items():
        if isinstance(joint, Fixed):
            continue
        line = joint.line
        through = line.through if line.through is not None else origin_of(line.link)
        if isinstance(joint, Prismatic):
            other = holder(joint.slider, joint.point)
        else:
            other = f"slot:{name}"
            names.append(other)
            holders[joint.point].append(other)
        contacts.append(
            Contact("slide", holder(line.link, through), other, joint.point, graph.slides.index(name),
                    drive=_mover(description, name))
        )  # fmt: skip

    clamps = [
        (holder(joint.links[0], joint.point), holder(joint.links[1], joint.point), joint.point)
        for joint in description.joints.values()
        if isinstance(joint, Fixed)
    ]
    asked = ASKED
    if link is not None and link not in section.elastic:
        asked = holder(link, at)
    else:
        names.append(ASKED)
        holders[at].append(ASKED)
        if link is not None:
            clamps.append((holder(link, at), ASKED, at))
    contacts += [Contact("clamp", a, b, point) for a, b, point in clamps]
    pins = {point: _clusters(point, there, clamps) for point, there in holders.items()}
    for point, clusters in pins.items():
        contacts += _hinges(description, point, clusters, asked, names, point in section.bearings)
    held = {contact.drive for contact in contacts}
    contacts += [
        _motor(description, drive, pins)
        for drive in description.drives.values()
        if drive.kind == "angle" and drive.name not in held
    ]
    return Bodies(tuple(names), tuple(contacts), asked, link, at)


def _mover(description: Description, slide: str) -> str | None:
    """The drive of a slide."""
    drives = description.drives.values()
    return next((drive.name for drive in drives if drive.kind != "angle" and drive.target == slide), None)


def _turner(description: Description, first: list[str], second: list[str]) -> str | None:
    """The drive of the angle between two clusters of bodies."""
    one, two = (set(map(Bodies.link_of, cluster)) for cluster in (first, second))
    for drive in description.drives.values():
        target, reference = drive.target, drive.reference
        across = (target in one and reference in two) or (target in two and reference in one)
        if drive.kind == "angle" and across:
            return drive.name
    return None


def _motor(description: Description, drive: Drive, pins: Mapping[str, list[list[str]]]) -> Contact:
    """A motor between two links that no joint joins: at a pin of both, or else at their first points."""
    links = (drive.reference, drive.target)
    for point, clusters in pins.items():
        near, far = (next((b for c in clusters for b in c if Bodies.link_of(b) == link), None) for link in links)
        if near is not None and far is not None:
            return Contact("motor", near, far, point, drive=drive.name)
    first, second = (next(iter(description.links[link].points), origin_of(link)) for link in links)
    return Contact("motor", drive.reference, drive.target, second, mount=first, drive=drive.name)


def _clusters(point: str, there: list[str], clamps: list[tuple[str, str, str]]) -> list[list[str]]:
    """Bodies at a point, those clamped to each other there together."""
    clusters = [[body] for body in there]
    for a, b, place in clamps:
        if place == point:
            joined = [c for c in clusters if a in c or b in c]
            clusters = [c for c in clusters if c not in joined] + [[body for c in joined for body in c]]
    return clusters


def _hinges(
    description: Description, point: str, clusters: list[list[str]], asked: str, names: list[str], bearing: bool
) -> list[Contact]:
    if len(clusters) < 2:
        return []

    def hinge(a: list[str], b: list[str], give: float = 1.0) -> Contact:
        return Contact(
            "hinge", _speaker(a, asked), _speaker(b, asked), point, give=give, drive=_turner(description, a, b)
        )

    fixed = next((cluster for cluster in clusters if GROUND in cluster), None)
    hub = fixed or next((cluster for cluster in clusters if asked in cluster), None)
    if hub is not None and (fixed or hub == [ASKED] or len(clusters) == 2 or not bearing):
        # What is fixed, or asked, holds each of the others by itself; an asked pin lies midway between two links.
        give = {2: 0.0, 3: 0.5}.get(len(clusters), 1.0) if hub == [ASKED] else 1.0
        return [hinge(hub, cluster, give) for cluster in clusters if cluster is not hub]
    if len(clusters) == 2:
        return [hinge(clusters[0], clusters[1])]
    names.append(_PIN + point)
    return [hinge([_PIN + point], cluster) for cluster in clusters]


def _speaker(cluster: list[str], asked: str) -> str:
    """The body of a cluster to which others are hinged: where it is fixed or asked, that one."""
    return next((body for body in (GROUND, asked) if body in cluster), cluster[0])
