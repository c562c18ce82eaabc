"""A mechanism in one pose as places and directions in the plane, and along a motion: what a drawing needs to know."""

from __future__ import annotations

import cmath
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from mechdesign.mechanism import Mechanism, plates
from mechdesign.mechanism.algebra import Vector
from mechdesign.mechanism.cams import CamFollower
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.elements.joints import Fixed, Slot
from mechdesign.mechanism.elements.springs import Spring
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.model import Description
from mechdesign.numerics.arrays import Complexes, evenly

_OUTLINE = 241  # places of the drawn profile of a cam
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


@dataclass(frozen=True)
class Wheels:
    """Pitch circles of two links, or of a wheel and the line of a rack, where they touch.

    `radii` and `axes` are those of both links; the radius of a rack is 0, and its axis where it slides. A belt has two
    straight parts, `strands`.
    """

    links: tuple[str, str]
    axes: tuple[complex, complex]
    radii: tuple[float, float]
    touch: complex
    along: complex
    strands: tuple[tuple[complex, complex], ...] = ()

    @property
    def ends(self) -> list[complex]:
        """The rightmost, uppermost, leftmost and lowest places of the circles."""
        pairs = zip(self.axes, self.radii, strict=True)
        return [axis + radius * way for axis, radius in pairs for way in (1, 1j, -1, -1j)]


@dataclass(frozen=True)
class CamPair:
    """Profiles of a cam, and the roller or the ends of the flat face of its follower.

    `links` are follower and cam, which is a `solid` disc, or has a groove or an open profile.
    """

    links: tuple[str, str]
    profiles: tuple[tuple[complex, ...], ...]
    solid: bool
    center: complex
    radius: float
    face: tuple[complex, complex] | None

    @property
    def ends(self) -> list[complex]:
        """Places that they reach."""
        around = [self.center + self.radius * way for way in (1, 1j, -1, -1j)]
        return [*(place for profile in self.profiles for place in profile), *(self.face or around)]


@dataclass(frozen=True)
class Still:
    """One pose of a scene: places of the points, unit vectors of the links' x axes, lines of the slides."""

    description: Description
    points: Mapping[str, complex]
    rotations: Mapping[str, complex]
    guides: tuple[Guide, ...]
    span: float
    wheels: tuple[Wheels, ...] = ()
    cams: tuple[CamPair, ...] = ()

    def link_points(self, name: str) -> tuple[str, ...]:
        """Names of a link's points, its ends first."""
        return self.description.links[name].all_points

    @property
    def places(self) -> Complexes:
        """Points, ends of the guides, and what wheels, cams and rollers reach."""
        return np.array([*self.points.values(), *(end for guide in self.guides for end in guide.ends), *self.round])

    @property
    def round(self) -> list[complex]:
        """Places that wheels, cams and rollers reach."""
        pairs: list[Wheels | CamPair] = [*self.wheels, *self.cams]
        return [end for pair in pairs for end in pair.ends]

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
                 for name, joint in description.joints.items() if not isinstance(joint, Fixed)}  # fmt: skip
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
    def _wheels(self) -> list[tuple[tuple[str, str], bool, list[Complexes]]]:
        """Links of each pair of wheels, whether a belt goes round them, and arrays of what `Wheels` has."""
        pairs = []
        for mesh in self.mechanism.meshes:
            sides = [mesh.strand(self.configuration, side)[:2] for side in (1.0, -1.0) if mesh.belt]
            values = [*(self.configuration.nodes[node] for node in mesh.axes), *mesh.radii(self.configuration),
                      *mesh.contact(self.configuration), *(end for side in sides for end in side)]  # fmt: skip
            pairs.append((mesh.links, mesh.belt, [*map(self._all, values)]))
        return pairs

    @cached_property
    def _cams(self) -> list[list[Complexes]]:
        """Of each cam origin and direction of its frame, centre, radius and direction of the face of its follower."""
        cams = []
        for cam in self.mechanism.cams:
            face = cam.along_face(self.configuration) if cam.flat else 0j
            values = [*self.mechanism.frame(cam.links[1], self.configuration), self.configuration.nodes[cam.node],
                      cam.roller(self.configuration), face]  # fmt: skip
            cams.append([*map(self._all, values)])
        return cams

    def at(self, k: int) -> Still | None:
        """The pose of an index, or None where it cannot be assembled."""
        points, rotations = ({name: complex(values[k]) for name, values in own.items()}
                             for own in (self.points, self.rotations))  # fmt: skip
        if not all(map(cmath.isfinite, (*points.values(), *rotations.values()))):
            return None
        description, guides, room = self.mechanism.description, [], 0.1 * self.span
        for name, (origin, along) in self.lines.items():
            joint, (low, high) = description.joints[name], self.travel[name]
            assert not isinstance(joint, Fixed)
            slider = None if isinstance(joint, Slot) else joint.slider
            guides.append(Guide(name, joint.line.link, joint.point, slider, complex(origin[k]), complex(along[k]),
                                points[joint.point], (low - room, high + room)))  # fmt: skip
        wheels = []
        for links, _, values in self._wheels:
            one, other, first, second, touch, way, *strands = (complex(own[k]) for own in values)
            wheels.append(Wheels(links, (one, other), (first.real, second.real), touch, way,
                                 tuple(zip(strands[::2], strands[1::2], strict=True))))  # fmt: skip
        cams = tuple(_cam_pair(cam, *(complex(own[k]) for own in values))
                     for cam, values in zip(self.mechanism.cams, self._cams, strict=True))  # fmt: skip
        return Still(description, points, rotations, tuple(guides), self.span, tuple(wheels), cams)

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


def _cam_pair(cam: CamFollower, start: complex, turn: complex, center: complex, radius: complex, along: complex
) -> CamPair:  # fmt: skip
    """A cam and its follower in a pose."""
    few = [outline[np.isfinite(outline)] for outline in cam.outlines]
    few = [outline[evenly(len(outline), _OUTLINE)] for outline in few]
    profiles = tuple(tuple((start + turn * outline).tolist()) for outline in few)
    face = None
    if cam.flat:
        first, last = cam.face
        more = _FACE * (last - first)
        face = center + (first - more) * along, center + (last + more) * along
    return CamPair(cam.links, profiles, cam.sides == ("outer",) and cam.closed, center, radius.real, face)


def hull(places: Sequence[complex]) -> list[complex]:
    """Corners of the convex hull, counter-clockwise, as pictures show it; two where the places lie on one line."""
    return plates.hull(places, 1e-3)
