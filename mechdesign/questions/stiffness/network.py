"""Bodies connected by joints and beams: a network, its loops, and the path from the ground to each body.

Vertices are rigid bodies, and the places of elastic links at which something is attached to their beams. Edges are
joints and, for an elastic link, the stretch of its beams from their beginning to each such place. A motor that holds
the angle between two links without a common joint is an edge of its own, free to shift. A tree from the ground reaches
every vertex; each other edge closes a loop.

A telescopic leg is two bodies. The pin of a slot is a massless block. A pin of three or more links is a massless body
to which each of them is hinged, unless one of them is the ground or the asked body.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism.cams import CamFollower
from mechdesign.mechanism.graph import GROUND
from mechdesign.questions.stiffness.bodies import TARGET, Bodies, NetworkEdge, is_pin
from mechdesign.questions.stiffness.elements import Hinge, JointCompliance

# Edges along a path, each with its direction: 1 from `a` to `b`, -1 from `b` to `a`.
EdgePath = tuple[tuple[int, int], ...]


@dataclass(frozen=True, eq=False)
class Network(Bodies):
    """Bodies with the paths and loops of the edges that carry the `target` body.

    Parameters
    ----------
    paths : mapping of str to EdgePath
        The path from the ground to each vertex.
    loops : tuple of EdgePath
        The edges around each loop.
    """

    paths: Mapping[str, EdgePath]
    loops: tuple[EdgePath, ...]

    @cached_property
    def pressing(self) -> list[bool]:
        """Of each coupling whether the force between its links is known."""
        pairs = [transmission.engagement for transmission in self.transmissions]
        return [pair is not None and pair.presses for pair in pairs]

    @cached_property
    def one_sided(self) -> list[bool]:
        """Of each coupling whether the sign of its effort says which flanks of teeth press, or which strand pulls.

        A cam presses along its normal whatever the sign.
        """
        cams = [isinstance(transmission.engagement, CamFollower) for transmission in self.transmissions]
        return [presses and not cam for presses, cam in zip(self.pressing, cams, strict=True)]

    @cached_property
    def edges_along_beams(self) -> tuple[tuple[int, ...], ...]:
        """The edges along the beams of each elastic link that carries a load."""
        edges: dict[str, tuple[int, ...]] = {}
        for k, edge in enumerate(self.edges):
            if edge.beam:
                edges[edge.name] = (*edges.get(edge.name, ()), k)
        return tuple(edges.values())

    def pin(self, point: str) -> tuple[str, ...]:
        """Vertices whose mean displacement is that of the elastic pin at a point; none where the pin is rigid."""
        for edge in self.edges:
            if edge.name == point and any(isinstance(element, JointCompliance) for element in edge.elements):
                return (edge.a,) if is_pin(edge.a) else (edge.a, edge.b)
        return ()

    def signs(self, path: Sequence[tuple[int, int]]) -> Floats:
        """Direction of each edge along a path, 0 for the others, shape (edges,)."""
        signs = np.zeros(len(self.edges))
        for edge, sign in path:
            signs[edge] += sign
        return signs


def build_network(bodies: Bodies, *, whole: bool = False) -> Network:
    """The network of a mechanism; parts that carry no load have no edges and move with the vertex they hang on.

    It is `whole` where loads act anywhere.
    """
    if whole:
        return _looped(tuple(_pinned(list(bodies.edges), bodies)), bodies)
    carrying = bodies.carrying
    # On a link that carries, an edge to an unloaded place stays: the beams before that place bend and move it.
    bent = {edge.name for edge in carrying if edge.beam}
    kept = [edge for edge in bodies.edges if edge in carrying or (edge.beam and edge.name in bent)]
    network = _looped(tuple(_pinned(kept, bodies)), bodies)
    return replace(network, paths=_with_idle(bodies.edges, network.paths))


def _pinned(edges: list[NetworkEdge], bodies: Bodies) -> list[NetworkEdge]:
    """Edges with each massless pin clamped to the first link that it joins, so that the pin cannot turn freely."""
    pinned, done = list[NetworkEdge](), set[str]()
    for edge in edges:
        pins = {end for end in (edge.a, edge.b) if is_pin(end) or (end == TARGET and bodies.link is None)}
        if pins - done:
            edge = replace(edge, elements=tuple(element for element in edge.elements if not isinstance(element, Hinge)))
        done |= pins
        pinned.append(edge)
    return pinned


def _with_idle(edges: Sequence[NetworkEdge], paths: Mapping[str, EdgePath]) -> dict[str, EdgePath]:
    """Paths to all vertices: a vertex that carries no load has the path of the vertex on which it hangs."""
    all_paths = dict(paths)
    waiting = list(edges)
    while waiting:
        ready = [edge for edge in waiting if edge.a in all_paths or edge.b in all_paths]
        for edge in ready:
            near, far = (edge.a, edge.b) if edge.a in all_paths else (edge.b, edge.a)
            all_paths.setdefault(far, all_paths[near])
        waiting = [edge for edge in waiting if edge not in ready]
    return all_paths


def _looped(edges: tuple[NetworkEdge, ...], bodies: Bodies) -> Network:
    """The network of the shortest paths from the ground, and of a loop for every other edge."""
    paths: dict[str, EdgePath] = {GROUND: ()}
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
            for path, sign in ((paths[edge.a], 1), (paths[edge.b], -1)):
                for other, direction in path:
                    total[other] = total.get(other, 0) + sign * direction
            loops.append(tuple((e, s) for e, s in total.items() if s))
    given = bodies.target, bodies.link, bodies.points, bodies.pins, bodies.transmissions
    return Network(edges, *given, paths, tuple(loops))
