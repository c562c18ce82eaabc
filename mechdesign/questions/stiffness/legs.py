"""A body on serial legs: how their reciprocal wrenches hold it, and the springs to which they are equivalent  [S4].

The carrying part of the network falls into legs where the ground and the asked body are taken out; a leg is serial if
it is a plain path.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats, Ints
from mechdesign.ground.numerics.graphs import pieces
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.graph import GROUND
from mechdesign.questions.stiffness.bodies import Bodies, NetworkEdge, is_pin, link_of
from mechdesign.questions.stiffness.compliance import Held, by_wrenches, poses_by, stiffness_of
from mechdesign.questions.stiffness.elements import Beam, Element, Hinge, Shift, freedoms, screw_origin
from mechdesign.questions.stiffness.schema import StiffnessSection
from mechdesign.questions.stiffness.screws import (
    LegScrews,
    constraint_compliance,
    equivalent_springs,
    joint_rank,
    reciprocal_wrenches,
)
from mechdesign.questions.stiffness.tables import Springs


@dataclass(frozen=True)
class Leg:
    """A serial chain from the ground to the asked body, its joints and beams in order from the base.

    Its `name` is that of its links, joined by ``+``, or else of its joint; `base` and `tip` are the points of its first
    and last joint. Rigid drives and links are not among its elements.
    """

    name: str
    base: str
    tip: str
    elements: tuple[Element, ...]


def find_legs(bodies: Bodies, links: Sequence[str]) -> tuple[Leg, ...] | None:
    """The legs that carry the asked body, in the order of their `links`; None where they are not serial, or coupled."""
    if bodies.transmissions:
        return None
    legs: list[tuple[int, Leg]] = []
    for piece in _pieces(bodies.carrying, bodies.target):
        ends = {end for edge in piece for end in (edge.a, edge.b)}
        if not {GROUND, bodies.target} <= ends:
            continue
        path = _path(piece, bodies.target)
        if path is None or any(isinstance(element, Shift) for edge in piece for element in edge.elements):
            return None
        names = [name for end in path[1:-1] if (name := link_of(end.split("@")[0]))]
        first = min(map(links.index, names), default=len(links))
        name = "+".join(dict.fromkeys(names)) or piece[0].name
        legs.append((first, Leg(name, piece[0].point, piece[-1].point, tuple(_elements(piece, path)))))
    return tuple(leg for _, leg in sorted(legs, key=lambda numbered: numbered[0]))


def _pieces(edges: Sequence[NetworkEdge], body: str) -> Iterator[list[NetworkEdge]]:
    """Edges by the pieces into which the network falls without the ground and the body."""
    inner: list[set[int | str]] = [{k, *{edge.a, edge.b} - {GROUND, body}} for k, edge in enumerate(edges)]
    for piece in pieces(inner):
        yield [edge for k, edge in enumerate(edges) if k in piece]


def _path(piece: list[NetworkEdge], body: str) -> list[str] | None:
    """Vertices from the ground to the body; None unless they are a plain path. Sorts `piece` in this order."""
    path, remaining = [GROUND], list(piece)
    piece.clear()
    while path[-1] != body:
        onward = [edge for edge in remaining if path[-1] in (edge.a, edge.b)]
        if len(onward) != 1:
            return None
        piece += onward
        remaining.remove(onward[0])
        path.append(onward[0].b if onward[0].a == path[-1] else onward[0].a)
    return None if remaining else path


def _elements(edges: Sequence[NetworkEdge], path: Sequence[str]) -> Iterator[Element]:
    """Elements along a path; those of an elastic link are its beams between the two joints on the path."""
    entry: str | None = None
    for k, (edge, vertex) in enumerate(zip(edges, path, strict=False)):
        beam = edge.beam
        if beam is None:
            # A massless pin has a hinge on either side, which act as one.
            yield from (e for e in edge.elements if not (is_pin(vertex) and isinstance(e, Hinge)))
            continue
        tail, head = (beam.tail, beam.head) if edge.a == vertex else (beam.head, beam.tail)
        entry = entry or tail
        if edges[k + 1].name != edge.name or not edges[k + 1].beam:
            yield Beam(beam.link, entry, head, beam.section)
            entry = None


def hold_by_legs(
    legs: Sequence[Leg], section: StiffnessSection, configuration: Configuration, length: Floats, size: int,
    condensed: bool,
) -> tuple[Held, Iterator[Springs]]:  # fmt: skip
    """How legs hold the body in a batch of assembled poses of shape (n,), and their equivalent springs.

    The rank is 0 where there is no closed form. `length` (n,), `size` and `condensed` are those of the `Body`.
    """
    n, body = configuration.shape[0], 3 if condensed else size
    at = configuration.point(section.at)
    ends = [point for leg in legs for point in (leg.base, leg.tip)]
    origin = at if body == 2 else screw_origin(ends, at, configuration, length)
    chains = [_chain(leg, section, configuration, origin) for leg in legs]
    ranks = [np.broadcast_to(joint_rank(chain.passive, length), (n,)) for chain in chains]
    held = Held.unknown(n, body)
    leg_wrenches: list[tuple[Ints, int, Floats, LegScrews]] = []
    # Poses are grouped by the ranks of all legs, each at most 3 and so a digit to the base 4.
    for _, rows in poses_by(np.array(ranks).T @ 4 ** np.arange(len(legs))):
        signature = [int(rank[rows[0]]) for rank in ranks]
        group = chains if len(rows) == n else [chain.take(rows) for chain in chains]
        wrenches = [
            reciprocal_wrenches(chain.passive, rank, length[rows], len(rows))
            for chain, rank in zip(group, signature, strict=True)
        ]
        if sum(w.shape[1] for w in wrenches) == body:
            blocks = [constraint_compliance(w, chain) for w, chain in zip(wrenches, group, strict=True)]
            held.stiffness[rows], held.compliance[rows], regular = by_wrenches(wrenches, blocks, length[rows], body)
            held.rank[rows] = body * regular
        leg_wrenches += [(rows, k, w, chain) for k, (w, chain) in enumerate(zip(wrenches, group, strict=True))]
    springs = (
        Springs(rows, np.full(len(rows), k), spring.stiffness, spring.place + origin[rows], spring.angle)
        for rows, k, w, chain in leg_wrenches
        for spring in equivalent_springs(w, chain, length[rows])
    )
    held = held.seen_from(at - origin)
    if condensed:
        # Only the displacements of the point count, as the link is free to turn.
        soft = held.compliance[:, :2, :2]
        held = Held(stiffness_of(soft), soft, np.minimum(held.rank, 2), held.free[:, :2], held.margin)
    return held, springs


def _chain(leg: Leg, section: StiffnessSection, configuration: Configuration, at: Complexes) -> LegScrews:
    """A leg's free and elastic joints in each pose, seen from places `at`."""
    joints = list(freedoms(leg.elements, section, configuration, at))
    return LegScrews(
        [twist for twist, compliance in joints if compliance is None],
        [twist for twist, compliance in joints if compliance is not None],
        [compliance for _, compliance in joints if compliance is not None],
        configuration.point(leg.base) - at,
        configuration.point(leg.tip) - at,
    )
