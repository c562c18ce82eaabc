"""Joints that are not pins, and friction in joints."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

from mechdesign.mechanism.elements import declared
from mechdesign.mechanism.elements.declared import Element, Term

Points = Annotated[tuple[declared.PointName, ...], declared.Notation("points of a line")]


@dataclass(frozen=True)
class LinkLine:
    """A line fixed in a link: through a point, at an angle to the link's x axis or towards a second point."""

    link: str
    through: str | None
    direction: Term = 0.0
    toward: str | None = None


@dataclass(frozen=True)
class Joint(Element):
    """A joint that is not a pin: exactly one of ``prismatic``, ``slot`` and ``fixed``."""

    one_of = ("a joint is one of prismatic: [a, b], slot: a, fixed: [a, b]", "prismatic", "slot", "fixed")

    prismatic: declared.TwoLinks | None = None
    """Slide between links [a, b]: ``point`` of b moves along a line of a, and b does not turn against a. Example:
    [ground, slider]
    """
    slot: declared.LinkName | None = None
    """Link with a straight slot in which ``point`` of another link slides and turns. Example: yoke"""
    fixed: declared.TwoLinks | None = None
    """Links [a, b] clamped to each other at a point that both have. Example: [leg_1, platform]"""
    through: Points | None = None
    """Point of the first link that the line goes through, where the slide is 0; two points [P, R] give the direction as
    well. Left out: the origin of the link's frame. Example: G Example: [P, R]
    """
    direction: declared.Angle | None = None
    """Angle of the line from the first link's x axis, counter-clockwise: the way in which the slide counts. Left out:
    0, unless ``through`` has two points. Example: 90
    """
    point: declared.PointName | None = None
    """The point of the other link that moves along the line; of a clamp the shared point. Left out: the only one there
    is; a slot needs it. Example: B
    """
    angle: declared.Angle | None = None
    """Of a slide, angle from the line's direction to b's x axis, which stays (left out: 0). Of a clamp, from a's x axis
    to b's (left out: measured from the sketch). Example: 90
    """

    @classmethod
    def faults(cls, given: Any) -> Iterator[str]:
        """Sentences about keys that do not go together."""
        foreign = {"prismatic": (), "slot": ("angle",), "fixed": ("through", "direction")}
        for key in given.given(*foreign[given.kind]):
            yield f"a {given.kind} joint has no {key!r}"
        if given.through is not None and len(given.through) == 2 and given.direction is not None:
            yield "'through' two points gives the direction; leave 'direction' out"


@dataclass(frozen=True)
class Prismatic:
    """Point `point` of `slider` slides along `line`; the slider's x axis stays at `angle` to the line."""

    name: str
    line: LinkLine
    slider: str
    point: str
    angle: Term = 0.0

    @property
    def links(self) -> tuple[str, ...]:
        """The link that carries the line, and the slider."""
        return self.line.link, self.slider


@dataclass(frozen=True)
class Slot:
    """A pin, `point` of another link, slides along `line` and is free to turn."""

    name: str
    line: LinkLine
    point: str

    @property
    def links(self) -> tuple[str, ...]:
        """The link that carries the line."""
        return (self.line.link,)


@dataclass(frozen=True)
class Fixed:
    """Links clamped at a shared point, the x axis of the second at `angle` to the first's."""

    name: str
    links: tuple[str, str]
    point: str
    angle: Term = 0.0


Sliding = Prismatic | Slot
AnyJoint = Sliding | Fixed


@dataclass(frozen=True)
class Friction(Element):
    """Coulomb friction of a pin, a slide, a slot or a telescopic link."""

    coefficient: Annotated[Term, declared.Size("none", 0.0)]
    """Coefficient of friction. Example: 0.1"""
    radius: declared.NonNegativeLength | None = None
    """Radius of the pin: friction turns against coefficient times radius times joint force. Example: 5"""
    length: declared.PositiveLength | None = None
    """Of a slide whose slider does not turn, the distance of the ends of the guide that bear it, from one side of its
    point to the other: the force across it and its moment press on both. Left out: the force across alone counts.
    Example: 40
    """
