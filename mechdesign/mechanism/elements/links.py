"""Links and their masses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.elements import declared
from mechdesign.mechanism.elements.declared import Element, Term

NonNegativeMass = Annotated[Term, declared.Size("mass", 0.0)]
TwoLengths = Annotated[tuple[declared.Length, declared.Length], declared.Two("[x, y]")]


@dataclass(frozen=True)
class Rod(Element):
    """Mass of the second body of a telescopic link, whose frame has its origin at ``to`` and the link's direction."""

    mass: NonNegativeMass
    """Mass of this body. Example: 1.2 kg"""
    center: TwoLengths | None = None
    """Centre of mass, [x, y] from ``to``, x along the link. Left out: at ``to``. Example: [-100, 0]"""
    inertia: Annotated[Term, declared.Size("moment_of_inertia", 0.0)] | None = None
    """Moment of inertia about the centre of mass. Left out: 0. Example: 0.004 kg*m^2"""


@dataclass(frozen=True)
class Link(Element):
    """A rigid body: [from, to, length], a telescopic leg, or its points in its own frame, {Q: [0, 0], S: [3, 1]}."""

    # Of a mechanism `points` has all points but the second end of a telescopic leg; its masses and its sizes as a plate
    # are in `Mass` and `Plates`.

    from_: declared.PointName | None = None
    """First end of a binary link: origin of its frame, whose x axis leads to ``to``."""
    to: declared.PointName | None = None
    """Second end of a binary link."""
    length: declared.PositiveLength | None = None
    """Distance from ``from`` to ``to``. Left out: measured from the sketch. Example: 90 Example: 90 mm"""
    telescopic: Annotated[bool, declared.Notation("flag")] = False
    """Whether the length is a coordinate, NAME.length: two bodies and a slide. Further points belong to the body at
    ``from``; ``length`` is left out.
    """
    points: Annotated[Mapping[str, tuple[Term, Term]], declared.Notation("points")] = field(default_factory=dict)
    """Points in the link's own frame, [x, y]; of a binary link those besides its ends. A list of names, or a point
    without a place, is measured from the sketch. Example: {P: [60, 15]}
    """

    mass: NonNegativeMass | None = None
    """Mass; of a telescopic link that of the body at ``from``. Left out: that of its beams where stiffness has a
    ``density``, else massless. Example: 0.5 kg
    """
    center: TwoLengths | None = None
    """Centre of mass in the coordinates of the link's points, [x, y]. Left out: the middle of its joints; of a link
    with a single joint, of its ends, or of all its points. Example: [45, 0]
    """
    inertia: Annotated[Term, declared.Notation("BarInertiaPlace")] | None = None
    """Moment of inertia about the centre of mass; 'rod' is that of a slender bar between its two joints, m l^2/12. Left
    out: 0, a point mass. Example: 0.002 kg*m^2 Example: rod
    """
    rod: Annotated[Rod, declared.Notation("part")] | None = None
    """Mass of the second body of a telescopic link, the one with ``to``. Example: {mass: 1.2 kg, center: [-100, 0]}"""
    width: declared.PositiveLength | None = None
    """Width of the link as a plate: its ends are round with half of it. Left out: that of ``plates``. Example: 12 mm"""
    layer: Annotated[int, declared.Whole(1, 1000)] | None = None
    """Layer in which the link lies as a plate, counted from the bottom. Left out: `mechdesign export --to layers.csv`
    finds one. Example: 2
    """

    @classmethod
    def faults(cls, given: Any) -> Iterator[str]:
        """Sentences about keys that do not go together."""
        if (given.from_ is None) != (given.to is None):
            yield "a binary link needs both 'from' and 'to'"
        if given.from_ is None:
            if given.length is not None or given.telescopic:
                yield "a length belongs to a link with 'from' and 'to'"
            if not given.points:
                yield "a link needs at least one point, such as {A: [0, 0]}"
        elif given.from_ == given.to:
            yield f"a link from {given.from_!r} to itself"
        elif given.telescopic and given.length is not None:
            yield "a telescopic leg has no fixed length; leave out 'length', or 'telescopic'"
        for extra in given.given("center", "inertia") if given.mass is None else ():
            yield f"{extra!r} belongs to a mass; give 'mass'"
        if given.rod is not None and not given.telescopic:
            yield "'rod' is the second body of a telescopic link; give 'mass'"
        for end in (given.from_, given.to):
            if end in given.points:
                yield f"point {end!r} is an end of the link; its place in the frame is not given twice"

    @property
    def ends(self) -> tuple[str, str] | None:
        """The ends of a binary link: its x axis runs from the first, at (0, 0), to the second, at (length, 0)."""
        return None if self.from_ is None or self.to is None else (self.from_, self.to)

    @property
    def corners(self) -> tuple[str, ...]:
        """The points between which its beams run where it bends; of a telescopic link a single beam."""
        return self.ends or tuple(self.points)

    @property
    def tip(self) -> str | None:
        """The second end of a telescopic leg, which is on its rod; None of a rigid link."""
        return self.ends[1] if self.telescopic and self.ends is not None else None

    @property
    def all_points(self) -> tuple[str, ...]:
        """Names of its points, its ends first, with the tip of a telescopic leg."""
        return tuple(dict.fromkeys((*(self.ends or ()), *self.points)))


@dataclass(frozen=True)
class Mass:
    """Mass of a body, its centre in the body's frame, and its moment of inertia about this centre.

    Without a centre it is the middle of some `points` of the body, its joints. A `slender` one is a bar between these,
    two, whose inertia follows; one that is `left_out` is 0, of a point mass.
    """

    mass: Term | Value
    center: tuple[Term | Value, Term | Value] | None = None
    inertia: Term | Value = 0.0
    points: tuple[str, ...] = ()
    slender: bool = False
    left_out: bool = False
