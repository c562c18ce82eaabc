"""A mechanism in one pose as places and directions in the plane, and along a motion: what a drawing needs to know."""

from __future__ import annotations

import cmath
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats, evenly
from mechdesign.mechanism import Mechanism, plates
from mechdesign.mechanism.algebra import Vector
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.elements.joints import Fixed, Sliding, Slot
from mechdesign.mechanism.elements.springs import Spring
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.model import Description

_OUTLINE = 241  # places of the drawn profile of a cam
_CIRCLE = np.exp(1j * np.linspace(0, 2 * np.pi, 73))
_RACK = 0.2  # half of the drawn line of a rack, as a part of the mechanism's size
_FACE = 0.15  # by which a flat face is drawn longer at both ends, as a part of what the cam touches


@dataclass(frozen=True)
class Guide:
    """The line of a slide or slot: through `origin` along the unit vector `along`; what slides is at `pin`.

    `travel` are the ends of the part of the line that is drawn, from the origin.
    """

    joint: str
    owner: str
    point: str
    slider: str | None
    origin: complex
    along: complex
    pin: complex
    travel: tuple[float, float]

    @property
    def ends(self) -> tuple[complex, complex]:
        """Ends of the part of the line that is drawn."""
        low, high = self.travel
        return self.origin + low * self.along, self.origin + high * self.along


class RoundPart(NamedTuple):
    """A round part of a link: in a pose its places, shape (n,), in a scene those of all poses, (poses, n).

    Kinds are the ``pitch`` circle of a wheel or line of a rack, the ``rim`` of a pulley, a straight ``strand`` of a
    belt, the ``disc`` or a ``groove`` of a cam, the ``roller`` or flat ``face`` of its follower.
    """

    link: str
    kind: Literal["pitch", "rim", "strand", "disc", "groove", "roller", "face"]
    places: Complexes


@dataclass(frozen=True)
class Still:
    """One pose of a scene: places of the points, unit vectors of the links' x axes, lines of the slides."""

    description: Description
    points: Mapping[str, complex]
    rotations: Mapping[str, complex]
    guides: tuple[Guide, ...]
    span: float
    outlines: tuple[RoundPart, ...] = ()

    def link_points(self, name: str) -> tuple[str, ...]:
        """Names of a link's points, its ends first."""
        return self.description.links[name].all_points

    @property
    def places(self) -> Complexes:
        """Points, ends of the guides, and the round parts."""
        ends = [end for guide in self.guides for end in guide.ends]
        return np.concatenate([[*self.points.values(), *ends], *(outline.places for outline in self.outlines)])

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
        hung = self.sprung & set(self.link_points(GROUND))
        kinds = {}
        for point, count in uses.items():
            if point in slots or point in hung or count - clamps[point] > 1:
                kinds[point] = "pin"
            elif clamps[point]:
                kinds[point] = "clamp"
            elif point in slid or point in self.link_points(GROUND):
                kinds[point] = "none"
            else:
                kinds[point] = "tracer"
        return kinds

    def pivots(self) -> tuple[str, ...]:
        """Points of the ground to which something is pinned, clamped or hung by a spring."""
        moving = {point for name in self.description.links if name != GROUND for point in self.link_points(name)}
        return tuple(point for point in self.link_points(GROUND) if point in moving | self.sprung)

    @property
    def sprung(self) -> set[str]:
        """Points at which springs between points end."""
        springs = self.description.springs.values()
        return {point for spring in springs if not spring.turning for point in spring_points(spring)}


def spring_points(spring: Spring) -> tuple[str, str]:
    """Names of the two points between which a spring is, without those of links."""
    one, other = (end.rpartition(".")[2] for end in spring.between)
    return one, other


@dataclass(frozen=True, eq=False)
class Scene:
    """A mechanism in some poses as places and directions, an array over the poses of each; a pose is an index.

    Guides are as long as the slides travel over all poses; `more` are further travels.
    """

    mechanism: Mechanism
    configuration: Configuration
    more: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def _all(self, values: Vector) -> Complexes:
        return np.broadcast_to(values, self.configuration.shape).ravel()

    @cached_property
    def points(self) -> dict[str, Complexes]:
        """Places of the points."""
        links = self.mechanism.description.links.values()
        return {
            name: self._all(self.configuration.point(name))
            for name in sorted({point for link in links for point in link.all_points})
        }

    @cached_property
    def rotations(self) -> dict[str, Complexes]:
        """Unit vectors of the links' x axes."""
        return {name: self._all(self.configuration.rotation(name)) for name in self.mechanism.description.links}

    @cached_property
    def span(self) -> float:
        """Width or height of the sketch pose, the larger: guides must not change their length with the pose."""
        drawn = np.array([self.mechanism.sketch_configuration.point(name) for name in self.points])
        return max(float(np.ptp(drawn.real)), float(np.ptp(drawn.imag))) or 1.0  # of slides alone one unit of length

    @cached_property
    def lines(self) -> dict[str, tuple[Complexes, Complexes]]:
        """Origins and directions of the lines of the slides."""
        graph, description = self.mechanism.graph, self.mechanism.description
        edges = {name: graph.edge_of(graph.slides.index(name))
                 for name, joint in description.joints.items() if isinstance(joint, Sliding)}  # fmt: skip
        return {name: (self._all(self.configuration.nodes[graph.edges[k].tail]),
                       self._all(self.configuration.direction(k))) for name, k in edges.items()}  # fmt: skip

    @cached_property
    def travel(self) -> dict[str, tuple[float, float]]:
        """Range of each slide from the origin of its line, over all poses."""
        ranges = {}
        for name, (origin, along) in self.lines.items():
            pins = self.points[self.mechanism.description.joints[name].point]
            way = ((pins - origin) * along.conj()).real
            ends = [*way[np.isfinite(way)].tolist(), *self.more.get(name, ())]
            ranges[name] = min(ends, default=0.0), max(ends, default=0.0)
        return ranges

    @cached_property
    def outlines(self) -> list[RoundPart]:
        """Pitch circles, racks and belts of wheels, cams and what touches them."""
        configuration, outlines = self.configuration, list[RoundPart]()

        def along(place: Vector, way: Vector, shares: Complexes | Floats) -> Complexes:
            return self._all(place)[:, None] + self._all(way)[:, None] * shares

        for mesh in self.mechanism.meshes:
            touch, way = mesh.contact(configuration)
            for link, node, radius in zip(mesh.links, mesh.axes, mesh.radii(configuration), strict=True):
                drawn = along(configuration.nodes[node], radius, _CIRCLE) if np.any(radius) else along(
                    touch, way, _RACK * self.span * np.array([-1.0, 1.0]))  # fmt: skip
                outlines.append(RoundPart(link, "rim" if mesh.belt else "pitch", drawn))
            for side in (1.0, -1.0) if mesh.belt else ():
                begin, end, _ = mesh.strand(configuration, side)
                outlines.append(RoundPart(GROUND, "strand", along(begin, end - begin, np.array([0.0, 1.0]))))
        for cam in self.mechanism.cams:
            follower, disc = cam.links
            kind: Literal["disc", "groove"] = "disc" if cam.sides == ("outer",) and cam.closed else "groove"
            for profile in cam.outlines:
                finite = profile[np.isfinite(profile)]
                few = finite[evenly(len(finite), _OUTLINE)]
                outlines.append(RoundPart(disc, kind, along(*self.mechanism.frame(disc, configuration), few)))
            center, radius = configuration.nodes[cam.node], cam.roller(configuration)
            if cam.flat:
                ends = np.array(cam.face) + _FACE * (cam.face[1] - cam.face[0]) * np.array([-1.0, 1.0])
                outlines.append(RoundPart(follower, "face", along(center, cam.along_face(configuration), ends)))
            elif np.any(radius):
                outlines.append(RoundPart(follower, "roller", along(center, radius, _CIRCLE)))
        return outlines

    def at(self, k: int) -> Still | None:
        """The pose of an index, or None where it cannot be assembled."""
        points, rotations = ({name: complex(values[k]) for name, values in own.items()}
                             for own in (self.points, self.rotations))  # fmt: skip
        if not all(map(cmath.isfinite, (*points.values(), *rotations.values()))):
            return None
        description, guides, room = self.mechanism.description, [], 0.1 * self.span
        for name, (origin, along) in self.lines.items():
            joint, (low, high) = description.joints[name], self.travel[name]
            assert isinstance(joint, Sliding)
            slider = None if isinstance(joint, Slot) else joint.slider
            guides.append(Guide(name, joint.line.link, joint.point, slider, complex(origin[k]), complex(along[k]),
                                points[joint.point], (low - room, high + room)))  # fmt: skip
        outlines = (outline._replace(places=outline.places[k]) for outline in self.outlines)
        return Still(description, points, rotations, tuple(guides), self.span, tuple(outlines))

    def some(self, indices: Iterable[int]) -> list[Still]:
        """Those of some poses that can be assembled."""
        return [still for k in indices if (still := self.at(k)) is not None]


def pose(mechanism: Mechanism, configuration: Configuration, index: int = 0) -> Still | None:
    """The pose of that index in a (flattened) batch, or None where it cannot be assembled."""
    return Scene(mechanism, configuration.take(np.array([index])) if configuration.shape else configuration).at(0)


def sketched(mechanism: Mechanism) -> Still:
    """The pose of the sketch."""
    still = pose(mechanism, mechanism.sketch_configuration)
    assert still is not None
    return still


def hull(places: Sequence[complex]) -> list[complex]:
    """Corners of the convex hull, counter-clockwise, as pictures show it; two where the places lie on one line."""
    return plates.hull(places, 1e-3)
