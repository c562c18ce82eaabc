"""What gives in a mechanism, element by element: joints, beams of elastic links, bearings.

[S4, section 2]
"""

from __future__ import annotations

from dataclasses import dataclass

from mechdesign.analyses.stiffness.beams import Beams
from mechdesign.analyses.stiffness.bodies import Contact
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
