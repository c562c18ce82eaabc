"""A mechanism in one pose as places and directions in the plane, and along a motion: what a drawing needs to know."""

from __future__ import annotations

import cmath
import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
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
from mechdesign.motion.motion import radians
from mechdesign.motion.solving import anchors_of
from mechdesign.numerics.arrays import Complexes, Floats, Ints, evenly
from mechdesign.questions.poses import Shown, pose_in_words
from mechdesign.report.figures.framing import extent
from mechdesign.study import Study

_TRAVEL_POSES = 100  # poses from which the travel of the slides is taken
# Two poses are one where no point is farther apart than this part of the mechanism's size.
_SAME_POSE = 1e-3
_FEW_POSES = 60  # fewer would show a curve as chords
_TRACE_POSES = 240  # of a curve between few poses, about
_OUTLINE = 241  # places of the drawn profile of a cam
_FACE = 0.15  # by which a flat face is drawn longer at both ends, as a part of what the cam touches


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
class Scene:
    """One pose of a mechanism: places of the points, unit vectors of the links' x axes, lines of the slides.

    `span` is the width or height of the sketch pose, the larger: guides must not change their length with the pose.
    """

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

    def places(self, travel: Mapping[str, tuple[float, float]]) -> list[complex]:
        """Points, wheels, cams, and ends of the guides for a range of each slide (see `Guide.ends`)."""
        guides = [end for guide in self.guides for end in guide.ends(travel, self.span)]
        return [*self.points.values(), *guides, *self.round]

    @property
    def round(self) -> list[complex]:
        """Places that wheels, cams and rollers reach."""
        wheels = (end for wheels in self.wheels for end in wheels.ends)
        return [*wheels, *(end for pair in self.cams for end in pair.ends)]

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


def pose(mechanism: Mechanism, configuration: Configuration, index: int = 0) -> Scene | None:
    """The pose of that index in a (flattened) batch, or None where it cannot be assembled."""
    description = mechanism.description

    def pick(values: Vector) -> complex:
        return complex(np.broadcast_to(values, configuration.shape).flat[index])

    names = {point for link in description.links.values() for point in link.all_points}
    points = {name: pick(configuration.point(name)) for name in sorted(names)}
    rotations = {name: pick(configuration.rotation(name)) for name in description.links}
    if not all(map(cmath.isfinite, (*points.values(), *rotations.values()))):
        return None

    graph, guides = mechanism.graph, []
    for name, joint in description.joints.items():
        if isinstance(joint, Fixed):
            continue
        k = graph.edge_of(graph.slides.index(name))
        origin = pick(configuration.nodes[graph.edges[k].tail])
        along = pick(configuration.direction(k))
        slider = None if isinstance(joint, Slot) else joint.slider
        guides.append(Guide(name, joint.line.link, joint.point, origin, along, points[joint.point], slider))
    drawn = np.array([mechanism.sketch_configuration.point(name) for name in points])
    span = max(float(np.ptp(drawn.real)), float(np.ptp(drawn.imag))) or 1.0  # of slides alone one unit of length
    wheels = []
    for mesh in mechanism.meshes:
        touch, along = (pick(value) for value in mesh.contact(configuration))
        one, other = (pick(configuration.nodes[node]) for node in mesh.axes)
        first, second = (float(pick(radius).real) for radius in mesh.radii(configuration))
        sides = [mesh.strand(configuration, side) for side in (1.0, -1.0) if mesh.belt]
        strands = [(pick(begin), pick(end)) for begin, end, _ in sides]
        wheels.append(Wheels(mesh.links, (one, other), (first, second), touch, along, tuple(strands)))
    cams = tuple(_cam_pair(mechanism, cam, configuration, pick) for cam in mechanism.cams)
    return Scene(description, points, rotations, tuple(guides), span, tuple(wheels), cams)


def _cam_pair(
    mechanism: Mechanism, cam: CamFollower, configuration: Configuration, pick: Callable[[Vector], complex]
) -> CamPair:
    """A cam and its follower in the pose that `pick` takes."""
    start, turn = (pick(value) for value in mechanism.frame(cam.links[1], configuration))
    few = [outline[np.isfinite(outline)] for outline in cam.outlines]
    few = [outline[evenly(len(outline), _OUTLINE)] for outline in few]
    profiles = tuple(tuple((start + turn * outline).tolist()) for outline in few)
    solid = cam.sides == ("outer",) and cam.closed
    center, radius, face = pick(configuration.nodes[cam.node]), pick(cam.roller(configuration)).real, None
    if cam.flat:
        along, (first, last) = pick(cam.along_face(configuration)), cam.face
        more = _FACE * (last - first)
        face = center + (first - more) * along, center + (last + more) * along
    return CamPair(cam.links, profiles, solid, center, radius, face)


def travels(scenes: Sequence[Scene | None]) -> dict[str, tuple[float, float]]:
    """Range of each slide over those of several poses that can be assembled."""
    ranges: dict[str, tuple[float, float]] = {}
    for scene in filter(None, scenes):
        for guide in scene.guides:
            low, high = ranges.get(guide.joint, (math.inf, -math.inf))
            ranges[guide.joint] = min(low, guide.travel), max(high, guide.travel)
    return ranges


def hull(places: Sequence[complex]) -> list[complex]:
    """Corners of the convex hull, counter-clockwise, as pictures show it; two where the places lie on one line."""
    return plates.hull(places, 1e-3)


@dataclass(frozen=True, eq=False)
class Sweep(Shown):
    """The poses of a motion that a result carries, in their order, with paths of points and travel of slides."""

    @classmethod
    def of(cls, shown: Shown) -> Sweep:
        """What a result carries."""
        return cls(shown.study, shown.poses, shown.rows, shown.configuration)

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism that moves."""
        return self.study.mechanism

    @cached_property
    def valid(self) -> Ints:
        """Indices of the valid poses."""
        return np.flatnonzero(self.configuration.valid)

    @cached_property
    def places(self) -> dict[str, Complexes]:
        """Path of every moving point, nan where a pose is not valid."""
        still = self.mechanism.description.links[GROUND].all_points
        valid = self.configuration.valid
        return {
            point: np.where(valid, self.configuration.point(point), complex(np.nan, np.nan))
            for point in self.mechanism.points
            if point not in still
        }

    @cached_property
    def traces(self) -> dict[str, Complexes]:
        """Path of every moving point as a curve: solved between the poses, too, where these are few."""
        count = len(self.rows)
        if count < 2 or count >= _FEW_POSES or not self.poses.followed or self.poses.places:
            # A closed path is listed without its begin at its end.
            return {
                name: np.append(path, path[:1]) if self.poses.closed else path for name, path in self.places.items()
            }
        names = self.poses.groups[0].names
        plan = self.mechanism.plan(names)
        parts = -(-_TRACE_POSES // count)
        values = [radians(self.study.units, coordinate, self._between(name, parts))
                 for coordinate, name in zip(plan.structure.given, names, strict=True)]  # fmt: skip
        anchors = anchors_of(self.study.motion(self.poses), plan)
        ends = np.append(self.rows, self.poses.line) if self.poses.closed else self.rows
        s = np.interp(np.arange((len(ends) - 1) * parts + 1) / parts, np.arange(len(ends)), ends)
        solved = plan.solve(values, start=None if anchors is None else anchors.at(np.zeros(len(s), dtype=np.intp), s))
        return {name: np.where(solved.valid, solved.point(name), complex(np.nan, np.nan)) for name in self.places}

    def _between(self, name: str, parts: int) -> Floats:
        """Values of a given coordinate at the poses and evenly between each two; on a bent path by cubics."""
        poses, ends = self.poses, self.rows[np.arange(len(self.rows) + self.poses.closed) % len(self.rows)]
        values = poses.values[name][ends]
        begin = end = steps = np.diff(values)
        if poses.times is None and np.any(poses.bends.get(name, 0.0)):
            bent = [poses.values[coordinate][ends] for coordinate, bends in poses.bends.items() if np.any(bends)]
            slopes, length = poses.slopes[name][ends], np.linalg.norm(np.diff(bent), axis=0)
            begin, end = slopes[:-1] * length, slopes[1:] * length
        t = np.arange(parts)[:, None] / parts
        cubic = values[:-1] + t * steps + t * (1 - t) * ((1 - t) * (begin - steps) - t * (end - steps))
        return np.append(cubic.T.ravel(), values[-1])

    @cached_property
    def travel(self) -> dict[str, tuple[float, float]]:
        """Range of each slide."""
        return travels([pose(self.mechanism, self.configuration, int(index)) for index in self._some])

    @property
    def _some(self) -> Ints:
        """Some of the poses that can be assembled."""
        some: Ints = self.valid[np.unique(np.linspace(0, len(self.valid) - 1, _TRAVEL_POSES).astype(int))]
        return some

    @cached_property
    def extent(self) -> Complexes:
        """Everything the motion reaches: points, their paths and the ends of guides."""
        mechanism, configuration = self.mechanism, self.configuration
        ground = [configuration.point(point)[:1] for point in mechanism.description.links[GROUND].all_points]
        reached = [np.empty(0, dtype=complex), *ground, *self.traces.values()]
        for index in self.valid[[0, -1]] if len(self.valid) else ():
            scene = pose(mechanism, configuration, int(index))
            if scene is not None:
                reached += [np.array(guide.ends(self.travel, scene.span)) for guide in scene.guides]
        if mechanism.meshes or mechanism.cams:
            scenes = [pose(mechanism, configuration, int(index)) for index in self._some]
            reached += [np.array(scene.round) for scene in scenes if scene is not None]
        return np.concatenate(reached)

    @property
    def returns(self) -> bool:
        """Whether the first and the last pose are one."""
        if self.poses.closed:
            return True
        _, wide, tall = extent(self.extent)
        return all(abs(path[-1] - path[0]) <= _SAME_POSE * max(wide, tall) for path in self.places.values())

    @property
    def closed(self) -> bool:
        """Whether the motion ends where it began, every pose valid."""
        return len(self.valid) == len(self.rows) and self.returns

    def words(self, index: int) -> str:
        """``crank = 60 deg`` for one pose; a line may be broken between coordinates only."""
        words = pose_in_words(self.study, self.poses, int(self.rows[index]), digits=4)
        return words.replace(" ", "\N{NO-BREAK SPACE}").replace(",\N{NO-BREAK SPACE}", ", ")


def ranks(study: Study) -> dict[str, int]:
    """How boldly the path of each moving point is drawn.

    2 for points that are asked for and points of one link only (a coupler point, a tool), 1 for joints between moving
    links, 0 for points that turn about a pivot of the ground or slide along a line of it.
    """
    mechanism, section = study.mechanism, study.kinematics
    links = mechanism.description.links
    ground = set(links[GROUND].all_points)
    uses = Counter(point for link in links.values() for point in link.all_points)
    simple = {
        joint.point
        for joint in mechanism.description.joints.values()
        if not isinstance(joint, Fixed) and joint.line.link == GROUND
    }
    for name, link in links.items():
        points = link.all_points
        if name != GROUND and not link.telescopic and ground & set(points):
            simple |= set(points)
    outputs = {name.split(".")[0] for name in (section and section.outputs) or ()}
    rank = {}
    for point in mechanism.points:
        if point in ground:
            continue
        if point in outputs or (uses[point] == 1 and point not in simple):
            rank[point] = 2
        else:
            rank[point] = 0 if point in simple else 1
    return rank
