"""Bodies and the contacts between them: the structure that legs are found in.

A telescopic leg is two bodies, the pin of a slot a massless block of its own, and a pin of three or more links, none
of them the ground or the asked body, a massless body to which each is hinged.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

from mechdesign.errors import Problem, StudyError
from mechdesign.mechanism.graph import GROUND, origin_of, rod_of
from mechdesign.mechanism.mechanism import Mechanism
from mechdesign.mechanism.model import Fixed, Prismatic

ASKED = ":asked"
_PIN = "pin:"


@dataclass(frozen=True)
class Contact:
    """A joint between two bodies.

    Parameters
    ----------
    point : str
        Where it is.
    slide : int or None
        Index of its slide in the mechanism's graph.
    reach_a, reach_b : tuple of str
        From the body's own point to the contact; a slide lies beyond the points of the body that bears its line.
    links_a, links_b : frozenset of str
        Links that are one body there (clamped at the point), for the drive that sits at the joint.
    """

    kind: Literal["hinge", "slide", "clamp"]
    a: str
    b: str
    point: str
    slide: int | None = None
    reach_a: tuple[str, ...] = ()
    reach_b: tuple[str, ...] = ()
    links_a: frozenset[str] = frozenset()
    links_b: frozenset[str] = frozenset()

    def other(self, body: str) -> str:
        """The body on the other side."""
        return self.b if body == self.a else self.a

    def reach(self, body: str) -> tuple[str, ...]:
        """From the body's own point to the contact."""
        return (self.reach_a if body == self.a else self.reach_b) or (self.point,)

    def joins(self, first: str, second: str) -> bool:
        """Whether it is a hinge between two links."""
        if self.kind != "hinge":
            return False
        return (first in self.links_a and second in self.links_b) or (second in self.links_a and first in self.links_b)

    def through(self, pin: str, onward: Contact) -> Contact:
        """The hinge between the two bodies that this contact and `onward` join to a massless pin."""
        near, far = self.other(pin), onward.other(pin)
        links = [c.links_a if c.a == body else c.links_b for c, body in ((self, near), (onward, far))]
        return replace(self, a=near, b=far, reach_a=(), reach_b=(), links_a=links[0], links_b=links[1])


@dataclass(frozen=True)
class Bodies:
    """Bodies of a mechanism, the asked one among them, and their contacts.

    Parameters
    ----------
    asked : str
        Name of the asked body: a link's, or `ASKED` for a pin or the end of an elastic link.
    link : str or None
        The asked link; None for a pin.
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


def build_bodies(mechanism: Mechanism, link: str | None, at: str, elastic: Mapping[str, str]) -> Bodies:
    """Bodies and contacts of a mechanism.

    An elastic asked link is a body of its leg like any other: what is asked is its section at the point.

    Raises
    ------
    StudyError
        If the asked point is fixed to the ground.
    """
    graph, description = mechanism.graph, mechanism.description

    def holder(name: str, point: str) -> str:
        return name if (name, point) in graph.points else rod_of(name)

    holders: dict[str, list[str]] = {}
    for body, point in graph.points:
        if ":" not in point:
            holders.setdefault(point, []).append(body)
    if link is None and GROUND in holders[at]:
        raise StudyError([Problem(f"point '{at}' belongs to the ground and does not move", "stiffness.at")])
    names = list(graph.bodies)
    contacts: list[Contact] = []
    for name, leg in description.links.items():
        if leg.telescopic and leg.ends is not None:
            contacts.append(Contact("slide", name, rod_of(name), leg.ends[1], graph.slides.index(name)))
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
        reach = (through, joint.point) if through != joint.point else (through,)
        contacts.append(
            Contact("slide", holder(line.link, through), other, joint.point, graph.slides.index(name), reach)
        )

    clamps = [
        (holder(joint.links[0], joint.point), holder(joint.links[1], joint.point), joint.point)
        for joint in description.joints.values()
        if isinstance(joint, Fixed)
    ]
    asked = ASKED
    if link is not None and link not in elastic:
        asked = holder(link, at)
    else:
        names.append(ASKED)
        holders[at].append(ASKED)
        if link is not None:
            clamps.append((holder(link, at), ASKED, at))
    contacts += [Contact("clamp", a, b, point) for a, b, point in clamps]
    for point, there in holders.items():
        contacts += _hinges(point, _clusters(point, there, clamps), asked, names)
    return Bodies(tuple(names), tuple(contacts), asked, link, at)


def _clusters(point: str, there: list[str], clamps: list[tuple[str, str, str]]) -> list[list[str]]:
    """Bodies at a point, those clamped to each other there together."""
    clusters = [[body] for body in there]
    for a, b, place in clamps:
        if place == point:
            joined = [c for c in clusters if a in c or b in c]
            clusters = [c for c in clusters if c not in joined] + [[body for c in joined for body in c]]
    return clusters


def _hinges(point: str, clusters: list[list[str]], asked: str, names: list[str]) -> list[Contact]:
    if len(clusters) < 2:
        return []

    def hinge(a: list[str], b: list[str]) -> Contact:
        links = (frozenset(map(Bodies.link_of, cluster)) for cluster in (a, b))
        return Contact("hinge", _speaker(a, asked), _speaker(b, asked), point, None, (), (), *links)

    for centre in (GROUND, asked):
        hub = next((cluster for cluster in clusters if centre in cluster), None)
        if hub is not None:
            # What is fixed, or asked, holds each of the others by itself.
            return [hinge(hub, cluster) for cluster in clusters if cluster is not hub]
    if len(clusters) == 2:
        return [hinge(*clusters)]
    names.append(_PIN + point)
    return [hinge([_PIN + point], cluster) for cluster in clusters]


def _speaker(cluster: list[str], asked: str) -> str:
    """The body of a cluster to which others are hinged: where it is fixed or asked, that one."""
    return next((body for body in (GROUND, asked) if body in cluster), cluster[0])
