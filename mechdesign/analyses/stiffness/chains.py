"""From joints and elastic elements and solved poses to their screws."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from mechdesign.analyses.stiffness.beams import Course, course_of
from mechdesign.analyses.stiffness.network import Beam, Bearing, Element, Guide, Shift
from mechdesign.analyses.stiffness.screws import hinge_twist, slide_twist
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import Value
from mechdesign.numerics.arrays import Complexes, Floats
from mechdesign.study.schema.stiffness import Profile, StiffnessSection

# A point this many times as far from the joints as they lie apart is far away.
FAR = 10.0


def looked_at_from(points: Iterable[str], at: Complexes, configuration: Configuration, length: float) -> Complexes:
    """From where joints are seen: the asked point, or their middle where that is far from them, and would hide them."""
    places = [configuration.point(point) for point in dict.fromkeys(points)]
    if not places:
        return at
    middle = sum(places[1:], places[0]) / len(places)
    return np.asarray(np.where(np.abs(at - middle) > FAR * length, middle, at))


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
    course = course_of(beam.beams, configuration)
    tail, head = (course.foot(point, configuration.point(point)) for point in (beam.tail, beam.head))
    profile = section.sections[beam.section]
    yield from bending(course, np.minimum(tail, head), np.maximum(tail, head), profile, at)


def bending(
    course: Course, low: Floats, high: Floats, profile: Profile, at: Complexes
) -> Iterator[tuple[Floats, Value]]:
    """Twists (3, n) of what lies between two distances along the beams of a link, and their compliances."""
    area, inertia, factor = profile.extent
    # Shear compliance per length.
    shear = 1 / (factor * profile.G * area) if profile.shear and profile.G is not None else 0.0
    for middle, along, length in course.between(low, high):
        yield slide_twist(along), length / (profile.E * area)
        yield slide_twist(1j * along), length**3 / (12 * profile.E * inertia) + length * shear
        yield hinge_twist(middle - at), length / (profile.E * inertia)
