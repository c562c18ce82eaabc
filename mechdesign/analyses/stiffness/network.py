"""Any mechanism as bodies held together by joints and beams: its loops, and what lies on the way to each body.

Vertices are rigid bodies, and the places of elastic links where something sits on their beams; edges are joints and, of
an elastic link, the way along its beams from their beginning to each such place. A tree from the ground reaches every
vertex; every other edge closes a loop. Motors that hold the angle between two links that no joint joins are edges
of their own: free to shift, held in turning.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mechdesign.analyses.stiffness.bodies import ASKED, Bodies, Contact
from mechdesign.analyses.stiffness.elements import Beam, Bearing, Element, Guide, Hinge, Shift, beams_of
from mechdesign.mechanism.graph import GROUND, rod_of
from mechdesign.mechanism.mechanism import Mechanism
from mechdesign.numerics.arrays import Floats
from mechdesign.study.schema.stiffness import StiffnessSection

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

    def signs(self, way: Sequence[tuple[int, int]]) -> Floats:
        """Sign of each edge on a way, 0 where it is not on it, shape (edges,)."""
        found = np.zeros(len(self.edges))
        for edge, sign in way:
            found[edge] += sign
        return found


def build_network(mechanism: Mechanism, bodies: Bodies, section: StiffnessSection) -> Network:
    """The network of a mechanism; parts that carry nothing have no edges and go along with what they hang on."""
    builder = _Builder(mechanism, bodies, section)
    edges = builder.edges()
    kept = _carrying(edges, bodies.asked)
    # Along beams that carry, the way to a place where nothing is borne stays: what is bent before it moves it.
    bent = {edge.name for edge in kept if edge.beam}
    kept = [edge for edge in edges if edge in kept or (edge.beam and edge.name in bent)]
    network = _looped(tuple(_pinned(kept, bodies)), bodies.asked, builder.points())
    return replace(network, paths=_with_idle(edges, network.paths))


def carrying_edges(mechanism: Mechanism, bodies: Bodies, section: StiffnessSection) -> list[NetworkEdge]:
    """Joints and beams that can carry a load from the asked body."""
    return _carrying(_Builder(mechanism, bodies, section).edges(), bodies.asked)


@dataclass(frozen=True)
class _Builder:
    mechanism: Mechanism
    bodies: Bodies
    section: StiffnessSection

    def edges(self) -> list[NetworkEdge]:
        """All joints, the motors that sit at no joint, and the ways along the beams of elastic links."""
        found: list[NetworkEdge] = []
        for contact in self.bodies.contacts:
            elements = tuple(_joint_elements(self.mechanism, contact, self.section))
            name = contact.point if contact.slide is None else self.mechanism.graph.slides[contact.slide]
            if contact.kind == "motor":
                name = contact.drive or ""
            a, b = (self._vertex(contact, body) for body in (contact.a, contact.b))
            found.append(NetworkEdge(a, b, elements, name, contact.point))
        for name in self.section.elastic:
            found += self._beams(name)
        return found

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

    def _node(self, body: str, point: str) -> str:
        """The vertex of a body at one of its points."""
        link = self.bodies.link_of(body)
        if body == GROUND or link not in self.section.elastic:
            return body
        telescopic = self.mechanism.description.links[link].telescopic
        # Of a telescopic leg the first body is rigid, and the second the cantilever, from the leg's base to its end.
        if telescopic and body == link:
            return body
        return f"{body}@{point}"

    def _vertex(self, contact: Contact, body: str) -> str:
        """The vertex of a body at a contact; what slides on an elastic link sits on its beams."""
        link = self.mechanism.description.links.get(self.bodies.link_of(body))
        if link is not None and link.telescopic and link.ends is not None:
            inner = contact.slide is not None and contact.other(body) == link.name
            return self._node(body, link.ends[0 if inner else 1])
        rides = contact.slide is not None and body == contact.a
        return self._node(body, self.mechanism.graph.slides[contact.slide or 0] if rides else contact.at(body))

    def _beams(self, name: str) -> list[NetworkEdge]:
        """From the beginning of a link's beams to its other points and to what slides on it."""
        link = self.mechanism.description.links[name]
        beams, body = beams_of(link), rod_of(name) if link.telescopic else name
        sitting = {point: point for point in beams.corners}
        if not link.telescopic:
            sitting |= {point: point for point in link.points}
            riding = [c for c in self.bodies.contacts if c.slide is not None and c.a == name]
            sitting |= {self.mechanism.graph.slides[contact.slide or 0]: contact.point for contact in riding}
        root, *_ = sitting
        section = self.section.elastic[name]
        return [
            NetworkEdge(f"{body}@{root}", f"{body}@{seat}", (Beam(beams, root, point, section),), name, point)
            for seat, point in sitting.items()
            if seat != root
        ]  # fmt: skip


def _joint_elements(mechanism: Mechanism, contact: Contact, section: StiffnessSection) -> list[Element]:
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


def _carrying(edges: list[NetworkEdge], asked: str) -> list[NetworkEdge]:
    """Edges that can carry a load from the asked vertex: what hangs by one edge is taken off, again and again."""
    while True:
        degree = Counter(end for edge in edges for end in (edge.a, edge.b))
        loose = {vertex for vertex, count in degree.items() if count == 1 and vertex not in (GROUND, asked)}
        if not loose:
            return edges
        edges = [edge for edge in edges if edge.a not in loose and edge.b not in loose]


def _pinned(edges: list[NetworkEdge], bodies: Bodies) -> list[NetworkEdge]:
    """Massless pins turn with the first link that they join, so that no motion of theirs is open."""
    found, seen = list[NetworkEdge](), set[str]()
    for edge in edges:
        pins = {end for end in (edge.a, edge.b) if bodies.is_pin(end) or (end == ASKED and bodies.link is None)}
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


def _looped(edges: tuple[NetworkEdge, ...], asked: str, points: Mapping[str, tuple[tuple[str, str], ...]]) -> Network:
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
    return Network(edges, asked, paths, tuple(loops), points)
