"""Elastic elements of a mechanism (joints, bearings, drives, beams), and the twists that they allow in each pose.

An elastic link given by its ends is one beam between them. Its other points are at the ends of rigid brackets, each of
which starts at its foot, the nearest point of the beam. An elastic link given by its points alone is a chain of beams
from point to point, in the order listed. What slides on a link rides on its beams, at the foot of its current place.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.elements.links import Link
from mechdesign.mechanism.elements.springs import Spring
from mechdesign.mechanism.geometry import Geometry
from mechdesign.questions.stiffness.schema import CrossSection, StiffnessSection
from mechdesign.questions.stiffness.screws import RANK, hinge_twist, slide_twist

# Beams whose distances from a slide differ by less than this fraction of the link's length are equally near: the slide
# rides on the first listed.
NEAREST = 1e-9
# A point is far from the joints if its distance exceeds this multiple of theirs from each other.
_FAR_FROM_JOINTS = 10.0


@dataclass(frozen=True)
class Hinge:
    """A revolute joint at a point; driven if `drive` names a drive."""

    point: str
    drive: str | None = None


@dataclass(frozen=True)
class SlideElement:
    """A slide of the mechanism's graph (its index); driven if `drive` names a drive."""

    slide: int
    drive: str | None = None


@dataclass(frozen=True)
class Beam:
    """The beams of an elastic link between the feet of the points `tail` and `head`; `section` names their profile."""

    link: Link
    tail: str
    head: str
    section: str


@dataclass(frozen=True)
class Shift:
    """A free displacement along a direction of the world, between links that only a motor connects."""

    direction: complex


@dataclass(frozen=True)
class JointCompliance:
    """The compliance of a joint itself, `give` times: across its slide, or in all directions at a pin."""

    name: str
    point: str
    slide: int | None = None
    give: float = 1.0


@dataclass(frozen=True, eq=False)
class SpringElement:
    """A spring of the mechanism: it gives along its line, or where it `turns` about its point.

    One of no free length and no preload gives alike in every direction.
    """

    spring: Spring
    geometry: Geometry

    def freedoms(self, configuration: Configuration, at: Complexes) -> Iterator[tuple[Floats, Value]]:
        """Twists (3, n) that it allows, seen from places `at`, and their compliances."""
        spring, places = self.spring, configuration.places
        soft = 1 / spring.pull(lambda term: self.geometry.term(term, places))[1]
        if spring.turning:
            yield hinge_twist(at - at), soft
            return
        one, other = (configuration.point(point.rpartition(".")[2]) for point in spring.between)
        span = other - one
        along: Complexes = np.where(span == 0, 1.0 + 0j, span / np.where(span == 0, 1.0, np.abs(span)))
        yield slide_twist(along), soft
        if self.isotropic:
            across: Complexes = np.asarray(1j * along)
            yield slide_twist(across), soft

    @property
    def isotropic(self) -> bool:
        """Whether it gives alike in every direction."""
        constant, _, free, _ = self.spring.pull(lambda term: self.geometry.term(term, {}))
        return not (constant or free)


Element = Hinge | SlideElement | Beam | Shift | JointCompliance | SpringElement


class Piece(NamedTuple):
    """A straight piece of beams in n poses: distance of its beginning along them, middle, direction and length (n,)."""

    start: Floats
    middle: Complexes
    along: Complexes
    length: Floats


@dataclass(frozen=True, eq=False)
class BeamLine:
    """The beams of one link in n poses, one after another; distances are counted along them from the first corner.

    Parameters
    ----------
    names : tuple of str
        Points at the corners, between which the beams run.
    corners : complex ndarray, shape (corners, n)
        Places of the corners.
    along : complex ndarray, shape (corners - 1, n)
        Unit vectors of the beams.
    starts : ndarray, shape (corners, n)
        Distances of the corners.
    """

    names: tuple[str, ...]
    corners: Complexes
    along: Complexes
    starts: Floats

    def foot(self, point: str, place: Complexes) -> Floats:
        """Distance, shape (n,), of the foot of a point that is at `place`; a corner is its own foot."""
        if point in self.names:
            return np.asarray(self.starts[self.names.index(point)])
        lengths = np.diff(self.starts, axis=0)
        if not len(lengths):
            return np.zeros(place.shape)
        ahead = np.clip(np.real((place - self.corners[:-1]) * self.along.conj()), 0.0, lengths)
        distance = np.abs(place - self.corners[:-1] - ahead * self.along)
        near = np.argmax(distance <= distance.min(axis=0) + NEAREST * self.starts[-1], axis=0)[None]
        return np.asarray(np.take_along_axis(self.starts[:-1] + ahead, near, axis=0)[0])

    def place(self, distance: Floats) -> Complexes:
        """The place, shape (n,), at a distance along the beams."""
        if not len(self.along):
            return np.asarray(self.corners[0])
        beam = np.minimum(np.sum(self.starts[1:] < distance, axis=0), len(self.along) - 1)[None]
        start, corner, along = (np.take_along_axis(v, beam, axis=0)[0] for v in (self.starts, self.corners, self.along))
        return np.asarray(corner + (distance - start) * along)

    def between(self, low: Floats, high: Floats) -> Iterator[Piece]:
        """Each straight piece between two distances.

        Pieces that have no length in any pose are left out.
        """
        for corner, along, (start, end) in zip(self.corners, self.along, pairwise(self.starts), strict=False):
            first, last = np.clip(low, start, end), np.clip(high, start, end)
            if (first != last).any():
                yield Piece(first, corner + ((first + last) / 2 - start) * along, along, last - first)


def beam_line(link: Link, configuration: Configuration) -> BeamLine:
    """The beams of a link in a batch of poses; a telescopic link has a direction even where its length is zero."""
    names = link.corners
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
    """Largest distance of joints from the first one, shape (n,); `size` where they all coincide, but for rounding."""
    places = [configuration.point(point) for point in dict.fromkeys(points)]
    distance = np.zeros(configuration.shape)
    for place in places[1:]:
        np.maximum(distance, np.abs(place - places[0]), out=distance)
    return np.where(distance > RANK * size, distance, size)


def screw_origin(points: Iterable[str], at: Complexes, configuration: Configuration, length: Value) -> Complexes:
    """Origin of the joints' screws, shape (n,): the place `at`, or the middle of the joints where `at` is far away.

    Seen from far away, the twists of different joints are equal but for rounding. `length` is the joints' spread.
    """
    places = [configuration.point(point) for point in dict.fromkeys(points)]
    if not places:
        return at
    middle = sum(places[1:], places[0]) / len(places)
    return np.asarray(np.where(np.abs(at - middle) > _FAR_FROM_JOINTS * length, middle, at))


def freedoms(
    elements: Iterable[Element], section: StiffnessSection, configuration: Configuration, at: Complexes
) -> Iterator[tuple[Floats, Value | None]]:
    """Twists (3, n) that elements allow, seen from places `at`, and their compliances; None for a free joint."""
    for element in elements:
        if isinstance(element, Beam):
            yield from _beam_freedoms(element, section, configuration, at)
        elif isinstance(element, Shift):
            yield slide_twist(np.full(configuration.shape, element.direction)), None
        elif isinstance(element, SpringElement):
            yield from element.freedoms(configuration, at)
        elif isinstance(element, JointCompliance):
            yield from _bearing_freedoms(element, section, configuration, at)
        else:
            twist = (
                slide_twist(slide_direction(element.slide, configuration))
                if isinstance(element, SlideElement)
                else hinge_twist(configuration.point(element.point) - at)
            )
            yield twist, None if element.drive is None else sum(1 / part for part in section.actuators[element.drive])


def _bearing_freedoms(
    bearing: JointCompliance, section: StiffnessSection, configuration: Configuration, at: Complexes
) -> Iterator[tuple[Floats, Value]]:
    """Twists and compliances of a joint's own displacements and rotation."""
    stiffness = section.bearings[bearing.name]
    across = [1.0 + 0j, 1j] if bearing.slide is None else [1j * slide_direction(bearing.slide, configuration)]
    if stiffness.radial is not None:
        for direction in across:
            yield slide_twist(np.broadcast_to(direction, configuration.shape)), bearing.give / stiffness.radial
    if stiffness.moment is not None:
        yield hinge_twist(configuration.point(bearing.point) - at), bearing.give / stiffness.moment


def slide_direction(slide: int, configuration: Configuration) -> Complexes:
    """Unit vector of a slide of the graph in each pose, shape (n,)."""
    direction = configuration.direction(configuration.graph.edge_of(slide))
    return np.broadcast_to(np.asarray(direction, dtype=complex), configuration.shape)


def _beam_freedoms(
    beam: Beam, section: StiffnessSection, configuration: Configuration, at: Complexes
) -> Iterator[tuple[Floats, Value]]:
    """Twists and compliances of the beams between the feet of two points."""
    line = beam_line(beam.link, configuration)
    tail, head = (line.foot(point, configuration.point(point)) for point in (beam.tail, beam.head))
    profile = section.sections[beam.section]
    for piece in line.between(np.minimum(tail, head), np.maximum(tail, head)):
        yield from piece_freedoms(piece, profile, at)


def piece_freedoms(piece: Piece, profile: CrossSection, at: Complexes) -> Iterator[tuple[Floats, Value]]:
    """Twists (3, n) and compliances of a straight piece of beams: stretch, shear, bending."""
    _, middle, along, length = piece
    area, inertia, factor = profile.extent
    # Shear compliance per length.
    shear = 1 / (factor * profile.G * area) if profile.shear and profile.G is not None else 0.0
    stretching, bent = profile.E * area, profile.E * inertia
    yield slide_twist(along), length / stretching
    yield slide_twist(1j * along), length**3 / (12 * bent) + length * shear
    yield hinge_twist(middle - at), length / bent
