"""A mechanism in one pose as places and directions in the plane: what a drawing needs to know."""

from __future__ import annotations

import cmath
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.model import Description, Fixed, Link, Slot

GROUND = "ground"


@dataclass(frozen=True)
class Guide:
    """The line of a slide or slot: through `origin` along the unit vector `along`; what slides is at `pin`."""

    joint: str
    owner: str
    point: str
    origin: complex
    along: complex
    pin: complex
    slider: str | None

    @property
    def travel(self) -> float:
        """Distance of the pin from the origin along the line."""
        return ((self.pin - self.origin) * self.along.conjugate()).real

    def ends(self, travel: Mapping[str, tuple[float, float]], span: float) -> tuple[complex, complex]:
        """Ends of the part of the line that is drawn: the slide's travel and a tenth of the mechanism's size more."""
        low, high = travel.get(self.joint, (self.travel, self.travel))
        low, high = min(low, self.travel) - 0.1 * span, max(high, self.travel) + 0.1 * span
        return self.origin + low * self.along, self.origin + high * self.along


@dataclass(frozen=True)
class Scene:
    """One pose of a mechanism.

    Parameters
    ----------
    points : mapping of str to complex
        World place of every named point.
    rotations : mapping of str to complex
        Unit vector of every link's x axis.
    span : float
        Width or height of the sketch pose, the larger: what guides are drawn longer by must not change with the pose.
    """

    description: Description
    points: Mapping[str, complex]
    rotations: Mapping[str, complex]
    guides: tuple[Guide, ...]
    span: float

    def link_points(self, name: str) -> tuple[str, ...]:
        """Names of a link's points, its ends first."""
        return link_points(self.description.links[name])

    def pivot(self, link: str, reference: str) -> str:
        """The point about which a link is turned: the one it shares with its reference, else its first."""
        mine = self.link_points(link)
        return next((point for point in mine if point in self.link_points(reference)), mine[0])

    def kinds(self) -> dict[str, str]:
        """What stands at each point: ``pin``, ``clamp``, ``tracer`` (a point of one link only) or ``none``."""
        uses = Counter(point for name in self.description.links for point in self.link_points(name))
        clamps = Counter(joint.point for joint in self.description.joints.values() if isinstance(joint, Fixed))
        slots = {joint.point for joint in self.description.joints.values() if isinstance(joint, Slot)}
        slid = {guide.point for guide in self.guides if guide.slider is not None}
        kinds = {}
        for point, count in uses.items():
            if point in slots or count - clamps[point] > 1:
                kinds[point] = "pin"
            elif clamps[point]:
                kinds[point] = "clamp"
            elif point in slid or point in self.link_points(GROUND):
                kinds[point] = "none"
            else:
                kinds[point] = "tracer"
        return kinds

    def pivots(self) -> tuple[str, ...]:
        """Points of the ground to which something is pinned or clamped."""
        moving = {point for name in self.description.links if name != GROUND for point in self.link_points(name)}
        return tuple(point for point in self.link_points(GROUND) if point in moving)


def link_points(link: Link) -> tuple[str, ...]:
    """Names of a link's points, its ends first; those of a telescopic leg include its tip."""
    return tuple(dict.fromkeys((*(link.ends or ()), *link.points)))


def pose(mechanism: Mechanism, configuration: Configuration, index: int = 0) -> Scene | None:
    """The pose of that index in a (flattened) batch, or None where it cannot be assembled."""
    description = mechanism.description

    def pick(values: Value) -> complex:
        return complex(np.broadcast_to(values, configuration.shape).flat[index])

    names = {point for link in description.links.values() for point in link_points(link)}
    points = {name: pick(configuration.point(name)) for name in sorted(names)}
    rotations = {name: pick(configuration.rotation(name)) for name in description.links}
    if not all(map(cmath.isfinite, (*points.values(), *rotations.values()))):
        return None

    graph, guides = mechanism.graph, []
    edges = {edge.slide: k for k, edge in enumerate(graph.edges)}
    for name, joint in description.joints.items():
        if isinstance(joint, Fixed):
            continue
        k = edges[graph.slides.index(name)]
        origin = pick(configuration.nodes[graph.edges[k].tail])
        along = pick(configuration.rotations[graph.edges[k].frame] * configuration.vectors.d[k])
        slider = None if isinstance(joint, Slot) else joint.slider
        guides.append(Guide(name, joint.line.link, joint.point, origin, along, points[joint.point], slider))
    drawn = np.array([mechanism.sketch_configuration.point(name) for name in points])
    span = max(float(np.ptp(drawn.real)), float(np.ptp(drawn.imag)), 1e-12)
    return Scene(description, points, rotations, tuple(guides), span)


def travels(scenes: Sequence[Scene]) -> dict[str, tuple[float, float]]:
    """Range of each slide over several poses."""
    ranges: dict[str, tuple[float, float]] = {}
    for scene in scenes:
        for guide in scene.guides:
            low, high = ranges.get(guide.joint, (math.inf, -math.inf))
            ranges[guide.joint] = min(low, guide.travel), max(high, guide.travel)
    return ranges


def hull(places: Sequence[complex]) -> list[complex]:
    """Corners of the convex hull, counter-clockwise; two where the places lie on one line."""
    ordered = sorted(set(places), key=lambda place: (place.real, place.imag))
    if len(ordered) < 3:
        return ordered
    width = max(abs(place - ordered[0]) for place in ordered)

    def half(sequence: Sequence[complex]) -> list[complex]:
        chain: list[complex] = []
        for place in sequence:
            while len(chain) > 1 and _area(chain[-2], chain[-1], place) <= 1e-3 * width**2:
                chain.pop()
            chain.append(place)
        return chain[:-1]

    return half(ordered) + half(ordered[::-1])


def _area(a: complex, b: complex, c: complex) -> float:
    return ((b - a).conjugate() * (c - a)).imag
