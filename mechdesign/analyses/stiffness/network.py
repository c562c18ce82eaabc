"""How bodies hang together: the loops of what carries, and what lies on the way to each body.

A tree from the ground reaches every vertex; every other edge closes a loop.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mechdesign.analyses.stiffness.bodies import ASKED, Bodies, NetworkEdge, is_pin
from mechdesign.analyses.stiffness.elements import Hinge
from mechdesign.mechanism.graph import GROUND
from mechdesign.numerics.arrays import Floats

Way = tuple[tuple[int, int], ...]


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
