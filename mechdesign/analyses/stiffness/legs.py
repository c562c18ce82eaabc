"""The serial chains that a body stands on, found in the network of what carries it.

Taking away the ground and the asked body leaves one piece a leg; a leg is serial if its piece is a plain path.

[S4, section 2]
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from mechdesign.analyses.stiffness.bodies import Bodies
from mechdesign.analyses.stiffness.elements import Beam, Element, Hinge, Shift
from mechdesign.analyses.stiffness.network import Edge
from mechdesign.mechanism.graph import GROUND


@dataclass(frozen=True)
class Leg:
    """A serial chain from the ground to the asked body.

    Parameters
    ----------
    name : str
        Its links, from the base, joined by ``+``; that of its joint where it has none.
    base, tip : str
        Points of its first and last joint.
    elements : tuple
        Joints and beams in order from the base; rigid drives and rigid links are not among them.
    """

    name: str
    base: str
    tip: str
    elements: tuple[Element, ...]


def find_legs(edges: Sequence[Edge], bodies: Bodies, links: Sequence[str]) -> tuple[Leg, ...] | None:
    """The legs that carry a body, in the order of their links; None where they are not serial chains.

    Parameters
    ----------
    edges : sequence of Edge
        Those that carry.
    links : sequence of str
        All links, in the study's order.
    """
    found: list[tuple[int, Leg]] = []
    for piece in _pieces(edges, bodies.asked):
        ends = {end for edge in piece for end in (edge.a, edge.b)}
        if not {GROUND, bodies.asked} <= ends:
            continue
        path = _path(piece, bodies.asked)
        if path is None or any(isinstance(element, Shift) for edge in piece for element in edge.elements):
            return None
        names = [name for end in path[1:-1] if (name := bodies.link_of(end.split("@")[0]))]
        first = min(map(links.index, names), default=len(links))
        name = "+".join(dict.fromkeys(names)) or piece[0].name
        found.append((first, Leg(name, piece[0].point, piece[-1].point, tuple(_elements(piece, path, bodies)))))
    return tuple(leg for _, leg in sorted(found, key=lambda each: each[0]))


def _pieces(edges: Sequence[Edge], asked: str) -> Iterator[list[Edge]]:
    """Edges that hang together otherwise than through the ground or the asked body."""
    left = list(edges)
    while left:
        piece, reached = [left.pop(0)], set[str]()
        while True:
            reached |= {end for edge in piece for end in (edge.a, edge.b)} - {GROUND, asked}
            more = [edge for edge in left if edge.a in reached or edge.b in reached]
            if not more:
                break
            piece += more
            left = [edge for edge in left if edge not in more]
        yield piece


def _path(piece: list[Edge], asked: str) -> list[str] | None:
    """Vertices from the ground to the asked body, the edges put in their order; None where they are no plain path."""
    path, left = [GROUND], list(piece)
    piece.clear()
    while path[-1] != asked:
        onward = [edge for edge in left if path[-1] in (edge.a, edge.b)]
        if len(onward) != 1:
            return None
        piece += onward
        left.remove(onward[0])
        path.append(onward[0].b if onward[0].a == path[-1] else onward[0].a)
    return None if left else path


def _elements(edges: Sequence[Edge], path: Sequence[str], bodies: Bodies) -> Iterator[Element]:
    """What gives along a path: of an elastic link its beams from the one joint to the other."""
    entry: str | None = None
    for k, (edge, vertex) in enumerate(zip(edges, path, strict=False)):
        beam = edge.beam
        if beam is None:
            # The two hinges of a massless pin are one.
            yield from (e for e in edge.elements if not (bodies.is_pin(vertex) and isinstance(e, Hinge)))
            continue
        tail, head = (beam.tail, beam.head) if edge.a == vertex else (beam.head, beam.tail)
        entry = entry or tail
        if edges[k + 1].name != edge.name or not edges[k + 1].beam:
            yield Beam(beam.beams, entry, head, beam.section)
            entry = None
