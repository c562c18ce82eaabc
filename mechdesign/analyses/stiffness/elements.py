"""What gives in a mechanism: joints, bearings, drives and beams, and the twists that they allow in each pose.

An elastic link given by its ends is one beam from the first to the second; its other points are brackets, rigid from
their foot on the beam, beyond an end from that end. One given by its points alone is beams along them in the order
listed. What slides on it rides on these beams at the foot of its current place, the nearest of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mechdesign.analyses.stiffness.screws import RANK, hinge_twist, slide_twist
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.model import Link
from mechdesign.numerics.arrays import Complexes, Floats
from mechdesign.study.schema.stiffness import Profile, StiffnessSection

# Of beams that come equally near to a slide, but for this share of the link's length, it rides on the first listed.
NEAREST = 1e-9
# A point this many times as far from the joints as they lie apart is far away.
_FAR_FROM_JOINTS = 10.0


def corners_of(link: Link) -> tuple[str, ...]:
    """The points between which the beams of an elastic link run; a telescopic one is a single beam."""
    return link.ends or tuple(link.points)


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
    """The beams of an elastic link between the feet of two points."""

    link: Link
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


@dataclass(frozen=True, eq=False)
class BeamLine:
    """The beams of one link in n poses, one after another; distances are counted along them from the first corner.

    Names and places (corners, n) of the corners, unit vectors (corners - 1, n) of the beams, and the corners' distances
    (corners, n).
    """

    names: tuple[str, ...]
    corners: Complexes
    along: Complexes
    starts: Floats

    def foot(self, point: str, place: Complexes) -> Floats:
        """Distance, shape (n,), at which a point that is at `place` is borne: a corner by itself."""
        if point in self.names:
            return np.asarray(self.starts[self.names.index(point)])
        lengths = np.diff(self.starts, axis=0)
        if not len(lengths):
            return np.zeros(place.shape)
        ahead = np.clip(np.real((place - self.corners[:-1]) * self.along.conj()), 0.0, lengths)
        away = np.abs(place - self.corners[:-1] - ahead * self.along)
        near = np.argmax(away <= away.min(axis=0) + NEAREST * self.starts[-1], axis=0)[None]
        return np.asarray(np.take_along_axis(self.starts[:-1] + ahead, near, axis=0)[0])

    def place(self, distance: Floats) -> Complexes:
        """The place, shape (n,), at a distance along the beams."""
        if not len(self.along):
            return np.asarray(self.corners[0])
        last = np.minimum(np.sum(self.starts[1:] < distance, axis=0), len(self.along) - 1)[None]
        start, corner, along = (np.take_along_axis(v, last, axis=0)[0] for v in (self.starts, self.corners, self.along))
        return np.asarray(corner + (distance - start) * along)

    def between(self, low: Floats, high: Floats) -> Iterator[tuple[Complexes, Complexes, Floats]]:
        """Middle, direction and length of each straight piece between two distances; none that is empty everywhere."""
        for corner, along, (start, end) in zip(self.corners, self.along, pairwise(self.starts), strict=False):
            first, last = np.clip(low, start, end), np.clip(high, start, end)
            if (first != last).any():
                yield corner + ((first + last) / 2 - start) * along, along, last - first


def course_of(link: Link, configuration: Configuration) -> BeamLine:
    """The beams of a link in any batch of poses; a telescopic one has a direction however short it is."""
    names = corners_of(link)
    corners = np.array([configuration.point(name) for name in names])
    spans = np.diff(corners, axis=0)
    lengths = np.abs(spans)
    if link.telescopic:
        along = configuration.rotation(link.name)[None]
    else:
        along = np.divide(spans, lengths, out=np.ones(spans.shape, dtype=complex), where=lengths > 0)
    starts = np.concatenate([np.zeros((1, *corners.shape[1:])), np.cumsum(lengths, axis=0)])
    return BeamLine(names, corners, along, starts)


def spread(points: Iterable[str], configuration: Configuration, size: float) -> Floats:
    """How far joints lie apart in each pose, shape (n,); `size` where they lie in one place, but for rounding."""
    places = [configuration.point(point) for point in dict.fromkeys(points)]
    apart = np.zeros(configuration.shape)
    for place in places[1:]:
        np.maximum(apart, np.abs(place - places[0]), out=apart)
    return np.where(apart > RANK * size, apart, size)


def looked_at_from(points: Iterable[str], at: Complexes, configuration: Configuration, length: Value) -> Complexes:
    """From where joints are seen: the asked point, or their middle where that is far from them, and would hide them."""
    places = [configuration.point(point) for point in dict.fromkeys(points)]
    if not places:
        return at
    middle = sum(places[1:], places[0]) / len(places)
    return np.asarray(np.where(np.abs(at - middle) > _FAR_FROM_JOINTS * length, middle, at))


def freedoms(
    elements: Iterable[Element], section: StiffnessSection, configuration: Configuration, at: Complexes
) -> Iterator[tuple[Floats, Value | None]]:
    """Twists (3, n) that elements allow, seen from places `at`, and their compliances; None where they are free."""
    for element in elements:
        if isinstance(element, Beam):
            yield from _beam(element, section, configuration, at)
        elif isinstance(element, Shift):
            yield slide_twist(np.full(configuration.shape, element.direction)), None
        elif isinstance(element, Bearing):
            yield from _bearing(element, section, configuration, at)
        else:
            twist = (
                slide_twist(_slide_direction(element.slide, configuration))
                if isinstance(element, Guide)
                else hinge_twist(configuration.point(element.point) - at)
            )
            yield twist, None if element.drive is None else 1 / section.actuators[element.drive]


def _bearing(
    bearing: Bearing, section: StiffnessSection, configuration: Configuration, at: Complexes
) -> Iterator[tuple[Floats, Value]]:
    given = section.bearings[bearing.name]
    across = [1.0 + 0j, 1j] if bearing.slide is None else [1j * _slide_direction(bearing.slide, configuration)]
    if given.radial is not None:
        for direction in across:
            yield slide_twist(np.broadcast_to(direction, configuration.shape)), bearing.give / given.radial
    if given.moment is not None:
        yield hinge_twist(configuration.point(bearing.point) - at), bearing.give / given.moment


def _slide_direction(slide: int, configuration: Configuration) -> Complexes:
    k = next(k for k, edge in enumerate(configuration.graph.edges) if edge.slide == slide)
    direction = configuration.vectors.d[k] * configuration.rotations[configuration.graph.edges[k].frame]
    return np.broadcast_to(np.asarray(direction, dtype=complex), configuration.shape)


def _beam(
    beam: Beam, section: StiffnessSection, configuration: Configuration, at: Complexes
) -> Iterator[tuple[Floats, Value]]:
    course = course_of(beam.link, configuration)
    tail, head = (course.foot(point, configuration.point(point)) for point in (beam.tail, beam.head))
    profile = section.sections[beam.section]
    yield from bending(course, np.minimum(tail, head), np.maximum(tail, head), profile, at)


def bending(
    course: BeamLine, low: Floats, high: Floats, profile: Profile, at: Complexes
) -> Iterator[tuple[Floats, Value]]:
    """Twists (3, n) of what lies between two distances along the beams of a link, and their compliances."""
    area, inertia, factor = profile.extent
    # Shear compliance per length.
    shear = 1 / (factor * profile.G * area) if profile.shear and profile.G is not None else 0.0
    stretching, bent = profile.E * area, profile.E * inertia
    for middle, along, length in course.between(low, high):
        yield slide_twist(along), length / stretching
        yield slide_twist(1j * along), length**3 / (12 * bent) + length * shear
        yield hinge_twist(middle - at), length / bent
