"""Bodies held together by joints and beams: a network, its loops, and what lies on the way to each body.

Vertices are rigid bodies, and the places of elastic links where something sits on their beams; edges are joints and, of
an elastic link, the way along its beams from their beginning to each such place. Motors that hold the angle between two
links that no joint joins are edges of their own: free to shift, held in turning. A tree from the ground reaches every
vertex; every other edge closes a loop.

A telescopic leg is two bodies, the pin of a slot a massless block of its own, and a pin of three or more links, none
of them the ground or the asked body, a massless body to which each is hinged.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from mechdesign.analyses.stiffness.elements import Beam, Bearing, Element, Guide, Hinge, Shift, corners_of
from mechdesign.mechanism.graph import GROUND, origin_of, rod_of
from mechdesign.mechanism.mechanism import Mechanism
from mechdesign.mechanism.model import Drive, Fixed, Prismatic
from mechdesign.numerics.arrays import Floats
from mechdesign.study.schema.stiffness import StiffnessSection

ASKED = ":asked"
_PIN = "pin:"
Way = tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class NetworkEdge:
    """A joint or a beam from vertex `a` to vertex `b`, its freedoms in order from `a`.

    Its `name` is that of the joint's point or slide, or of the link whose beams it goes along; there, `point` is what
    sits at its end.
    """

    a: str
    b: str
    elements: tuple[Element, ...]
    name: str
    point: str

    @property
    def beam(self) -> Beam | None:
        """The way along the beams of a link; None of a joint."""
        return next((element for element in self.elements if isinstance(element, Beam)), None)


@dataclass(frozen=True)
class Bodies:
    """Bodies of a mechanism, by what joins them.

    The `asked` one is that of the `link`, or `ASKED` for a pin (without a link) or the end of an elastic link. `points`
    are those of each link that moves, with the vertices that bear them.
    """

    edges: tuple[NetworkEdge, ...]
    asked: str
    link: str | None
    points: Mapping[str, tuple[tuple[str, str], ...]]


def link_of(body: str) -> str:
    """The link that a body belongs to; empty for massless ones."""
    return "" if body.startswith((_PIN, "slot:", ASKED)) else body.removesuffix(":rod")


def is_pin(body: str) -> bool:
    """Whether a body is the massless pin of several links."""
    return body.startswith(_PIN)


def build_bodies(mechanism: Mechanism, link: str | None, at: str, section: StiffnessSection) -> Bodies:
    """All joints of a mechanism, the motors that sit at no joint, and the ways along the beams of elastic links.

    An elastic asked link is a body of its leg like any other: what is asked is its section at the point.
    """
    graph, description = mechanism.graph, mechanism.description

    def holder(name: str, point: str) -> str:
        return name if (name, point) in graph.points else rod_of(name)

    asked = ASKED if link is None or link in section.elastic else holder(link, at)
    builder = _Builder(mechanism, section, asked)
    holders: dict[str, list[str]] = {}
    for body, point in graph.points:
        if ":" not in point:
            holders.setdefault(point, []).append(body)
    for name, leg in description.links.items():
        if leg.telescopic and leg.ends is not None:
            builder.slide(name, name, rod_of(name), leg.ends[1], base=leg.ends[0])
    clamps = []
    for name, joint in description.joints.items():
        if isinstance(joint, Fixed):
            clamps.append((holder(joint.links[0], joint.point), holder(joint.links[1], joint.point), joint.point))
            continue
        line = joint.line
        through = line.through if line.through is not None else origin_of(line.link)
        if isinstance(joint, Prismatic):
            other = holder(joint.slider, joint.point)
        else:
            other = f"slot:{name}"
            holders[joint.point].append(other)
        builder.slide(name, holder(line.link, through), other, joint.point)
    if asked == ASKED:
        holders[at].append(ASKED)
        if link is not None:
            clamps.append((holder(link, at), ASKED, at))
    for a, b, point in clamps:
        builder.join(a, b, (), point, point)
    pins = {point: _clusters(point, there, clamps) for point, there in holders.items()}
    for point, clusters in pins.items():
        builder.hinges(point, clusters)
    for drive in description.drives.values():
        if drive.kind == "angle" and drive.name not in builder.held:
            builder.motor(drive, pins)
    for name in section.elastic:
        builder.beams(name)
    return Bodies(tuple(builder.edges), asked, link, builder.points())


@dataclass
class _Builder:
    """The edges so far, by slide what rides on each body, and the drives that hold a joint."""

    mechanism: Mechanism
    section: StiffnessSection
    asked: str
    edges: list[NetworkEdge] = field(default_factory=list)
    riding: dict[str, dict[str, str]] = field(default_factory=dict)
    held: set[str | None] = field(default_factory=set)

    def join(
        self, a: str, b: str, elements: tuple[Element, ...], name: str, point: str, seat: str | None = None
    ) -> None:  # fmt: skip
        """A joint between two bodies at a point; on body `a` it sits at `seat`."""
        self.edges.append(NetworkEdge(self._vertex(a, seat or point), self._vertex(b, point), elements, name, point))

    def slide(self, name: str, a: str, b: str, point: str, base: str | None = None) -> None:
        """A slide of body `b` along body `a`; the bearing of a telescopic leg is at its base."""
        slide = self.mechanism.graph.slides.index(name)
        drives = self.mechanism.description.drives.values()
        drive = next((each.name for each in drives if each.kind != "angle" and each.target == name), None)
        elements = (*self._freedom(Guide(slide, drive)), *self._bearing(name, base or point, slide))
        # The beam of the rod of a leg begins at the base.
        end = self._vertex(b, point) if base is None else self._node(b, base)
        self.edges.append(NetworkEdge(self._vertex(a, name), end, elements, name, point))
        self.riding.setdefault(a, {})[name] = point

    def hinges(self, point: str, clusters: list[list[str]]) -> None:
        """The pin of clusters of bodies: its bearing gives between two; of more, between each and the pin."""
        if len(clusters) < 2:
            return
        fixed = next((cluster for cluster in clusters if GROUND in cluster), None)
        hub = fixed or next((cluster for cluster in clusters if self.asked in cluster), None)
        # What is fixed, or asked, holds each of the others by itself; an asked pin lies midway between two links.
        if hub is None or not (fixed or hub == [ASKED] or len(clusters) == 2 or point not in self.section.bearings):
            hub = clusters[0] if len(clusters) == 2 else [_PIN + point]
        give = {2: 0.0, 3: 0.5}.get(len(clusters), 1.0) if hub == [ASKED] else 1.0
        for cluster in clusters:
            if cluster is not hub:
                drive = self._turner(hub, cluster)
                elements = (*self._freedom(Hinge(point, drive)), *self._bearing(point, point, None, give))
                self.join(self._speaker(hub), self._speaker(cluster), elements, point, point)

    def motor(self, drive: Drive, pins: Mapping[str, list[list[str]]]) -> None:
        """A motor between two links that no joint joins: at a pin of both, or else at their first points."""
        links = (drive.reference, drive.target)
        seat, point = (next(iter(self.mechanism.description.links[link].points), origin_of(link)) for link in links)
        a, b = links
        for pin, clusters in pins.items():
            near, far = (next((b for c in clusters for b in c if link_of(b) == link), None) for link in links)
            if near is not None and far is not None:
                a, b, seat, point = near, far, pin, pin
                break
        elements = (Shift(1.0 + 0j), Shift(1j), *self._freedom(Hinge(point, drive.name)))
        self.join(a, b, elements, drive.name, point, seat)

    def beams(self, name: str) -> None:
        """From the beginning of a link's beams to its other points and to what slides on it."""
        link = self.mechanism.description.links[name]
        body = rod_of(name) if link.telescopic else name
        sitting = {point: point for point in corners_of(link)}
        if not link.telescopic:
            sitting |= {point: point for point in link.points} | self.riding.get(name, {})
        root, *others = sitting
        section = self.section.elastic[name]
        for seat in others:
            beam = Beam(link, root, sitting[seat], section)
            self.edges.append(NetworkEdge(f"{body}@{root}", f"{body}@{seat}", (beam,), name, sitting[seat]))

    def points(self) -> dict[str, tuple[tuple[str, str], ...]]:
        """Points of every link that moves, and their vertices."""
        found = {}
        for name, link in self.mechanism.description.links.items():
            if name == GROUND:
                continue
            here = [(point, self._node(name, point)) for point in link.points]
            if link.telescopic and link.ends is not None:
                here.append((link.ends[1], self._node(rod_of(name), link.ends[1])))
            found[name] = tuple(here)
        return found

    def _freedom(self, element: Hinge | Guide) -> tuple[Element, ...]:
        """A joint's freedom, unless a rigid drive holds it."""
        self.held.add(element.drive)
        return (element,) if element.drive is None or element.drive in self.section.actuators else ()

    def _bearing(self, name: str, point: str, slide: int | None, give: float = 1.0) -> tuple[Element, ...]:
        return (Bearing(name, point, slide, give),) if name in self.section.bearings else ()

    def _node(self, body: str, point: str) -> str:
        """The vertex of a body at one of its points."""
        link = link_of(body)
        if body == GROUND or link not in self.section.elastic:
            return body
        telescopic = self.mechanism.description.links[link].telescopic
        # Of a telescopic leg the first body is rigid, and the second the cantilever, from the leg's base to its end.
        return body if telescopic and body == link else f"{body}@{point}"

    def _vertex(self, body: str, point: str) -> str:
        """The vertex of a body at a joint; of the rod of a telescopic leg its end."""
        link = self.mechanism.description.links.get(link_of(body))
        end = link.ends[1] if link is not None and link.telescopic and link.ends is not None else point
        return self._node(body, end)

    def _turner(self, first: list[str], second: list[str]) -> str | None:
        """The drive of the angle between two clusters of bodies."""
        one, two = (set(map(link_of, cluster)) for cluster in (first, second))
        for drive in self.mechanism.description.drives.values():
            target, reference = drive.target, drive.reference
            across = (target in one and reference in two) or (target in two and reference in one)
            if drive.kind == "angle" and across:
                return drive.name
        return None

    def _speaker(self, cluster: list[str]) -> str:
        """The body of a cluster to which others are hinged: where it is fixed or asked, that one."""
        return next((body for body in (GROUND, self.asked) if body in cluster), cluster[0])


def _clusters(point: str, there: list[str], clamps: list[tuple[str, str, str]]) -> list[list[str]]:
    """Bodies at a point, those clamped to each other there together."""
    clusters = [[body] for body in there]
    for a, b, place in clamps:
        if place == point:
            joined = [c for c in clusters if a in c or b in c]
            clusters = [c for c in clusters if c not in joined] + [[body for c in joined for body in c]]
    return clusters


@dataclass(frozen=True, eq=False)
class Network:
    """Vertices, of which one is asked, edges and loops.

    Parameters
    ----------
    paths : mapping of str to ((int, int), ...)
        To each vertex, the edges on the way from the ground and whether they are gone along (1) or against (-1).
    loops : tuple of ((int, int), ...)
        Edges of each loop, with their directions.
    points : mapping of str to tuple of (str, str)
        Of each link, its points and the vertices that bear them.
    """

    edges: tuple[NetworkEdge, ...]
    asked: str
    paths: Mapping[str, Way]
    loops: tuple[Way, ...]
    points: Mapping[str, tuple[tuple[str, str], ...]]

    @cached_property
    def ways_along_beams(self) -> tuple[tuple[int, ...], ...]:
        """Of each elastic link that carries, the edges that go along its beams."""
        found: dict[str, tuple[int, ...]] = {}
        for k, edge in enumerate(self.edges):
            if edge.beam:
                found[edge.name] = (*found.get(edge.name, ()), k)
        return tuple(found.values())

    def pin(self, point: str) -> tuple[str, ...]:
        """Vertices of which the pin at a point is the middle, where it gives: itself, or both ends; none elsewhere."""
        for edge in self.edges:
            if edge.name == point and any(isinstance(element, Bearing) for element in edge.elements):
                return (edge.a,) if is_pin(edge.a) else (edge.a, edge.b)
        return ()

    def signs(self, way: Sequence[tuple[int, int]]) -> Floats:
        """Sign of each edge on a way, 0 where it is not on it, shape (edges,)."""
        found = np.zeros(len(self.edges))
        for edge, sign in way:
            found[edge] += sign
        return found


def build_network(bodies: Bodies) -> Network:
    """The network of a mechanism; parts that carry nothing have no edges and go along with what they hang on."""
    kept = carrying(bodies)
    # Along beams that carry, the way to a place where nothing is borne stays: what is bent before it moves it.
    bent = {edge.name for edge in kept if edge.beam}
    kept = [edge for edge in bodies.edges if edge in kept or (edge.beam and edge.name in bent)]
    network = _looped(tuple(_pinned(kept, bodies)), bodies)
    return replace(network, paths=_with_idle(bodies.edges, network.paths))


def carrying(bodies: Bodies) -> list[NetworkEdge]:
    """Edges that can carry a load from the asked body: what hangs by one edge is taken off, again and again."""
    edges = list(bodies.edges)
    while True:
        degree = Counter(end for edge in edges for end in (edge.a, edge.b))
        loose = {vertex for vertex, count in degree.items() if count == 1 and vertex not in (GROUND, bodies.asked)}
        if not loose:
            return edges
        edges = [edge for edge in edges if edge.a not in loose and edge.b not in loose]


def _pinned(edges: list[NetworkEdge], bodies: Bodies) -> list[NetworkEdge]:
    """Massless pins turn with the first link that they join, so that no motion of theirs is open."""
    found, seen = list[NetworkEdge](), set[str]()
    for edge in edges:
        pins = {end for end in (edge.a, edge.b) if is_pin(end) or (end == ASKED and bodies.link is None)}
        if pins - seen:
            edge = replace(edge, elements=tuple(each for each in edge.elements if not isinstance(each, Hinge)))
        seen |= pins
        found.append(edge)
    return found


def _with_idle(edges: Sequence[NetworkEdge], paths: Mapping[str, Way]) -> dict[str, Way]:
    """Ways to all vertices: to those that carry nothing as to what they hang on."""
    found = dict(paths)
    waiting = list(edges)
    while waiting:
        ready = [edge for edge in waiting if edge.a in found or edge.b in found]
        for edge in ready:
            near, far = (edge.a, edge.b) if edge.a in found else (edge.b, edge.a)
            found.setdefault(far, found[near])
        waiting = [edge for edge in waiting if edge not in ready]
    return found


def _looped(edges: tuple[NetworkEdge, ...], bodies: Bodies) -> Network:
    """A tree from the ground, as short ways as possible, and a loop for every other edge."""
    paths: dict[str, Way] = {GROUND: ()}
    queue = deque([GROUND])
    tree: set[int] = set()
    while queue:
        vertex = queue.popleft()
        for k, edge in enumerate(edges):
            for near, far, sign in ((edge.a, edge.b, 1), (edge.b, edge.a, -1)):
                if near == vertex and far not in paths:
                    paths[far] = (*paths[vertex], (k, sign))
                    tree.add(k)
                    queue.append(far)
    loops = []
    for k, edge in enumerate(edges):
        if k not in tree and edge.a in paths and edge.b in paths:
            total: dict[int, int] = {k: 1}
            for way, sign in ((paths[edge.a], 1), (paths[edge.b], -1)):
                for other, direction in way:
                    total[other] = total.get(other, 0) + sign * direction
            loops.append(tuple((e, s) for e, s in total.items() if s))
    return Network(edges, bodies.asked, paths, tuple(loops), bodies.points)
