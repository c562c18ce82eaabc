"""Moments of slides and clamps in a closed chain, which equilibrium leaves open, by the force method.

Of all moments in equilibrium those of least elastic energy close the chain. What gives are the beams and bearings of
the study's stiffness section.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mechdesign.mechanism.algebra import Value, Vector, cross
from mechdesign.mechanism.forces import Forces
from mechdesign.mechanism.graph import GROUND, Graph, rod_of
from mechdesign.mechanism.loops import nothing
from mechdesign.mechanism.mechanism import Mechanism
from mechdesign.mechanism.statics import Joints, Reaction
from mechdesign.numerics.arrays import Complexes, Floats
from mechdesign.questions.stiffness.force_method import bear, twists_about
from mechdesign.questions.stiffness.network import Network, build_whole
from mechdesign.questions.stiffness.schema import StiffnessSection

# A moment that a rigid chain may bear besides is more than rounding above this part of a unit.
RIGID_MOMENT = 1e-9


def with_open_moments(
    reactions: Sequence[Reaction], joints: Joints, forces: Forces, mechanism: Mechanism, section: StiffnessSection
) -> list[Reaction]:  # fmt: skip
    """Reactions with the moments that elasticity determines; those of a chain in which nothing gives stay nan."""
    nodes, graph = [_complexes(forces, node) for node in forces.configuration.nodes], joints.graph
    # Loads bend a beam where they act on it; of a telescopic leg the rod is the beam.
    links = mechanism.description.links
    beams = {rod_of(name) if links[name].telescopic else name for name in section.elastic}
    seats: dict[str, Complexes] = {}
    on_beams: dict[str, list[str]] = {}
    for k, (body, arm, _, _) in enumerate(forces.acting):
        if body in beams:
            seats[f":{k}"] = nodes[forces.bases[body]] + arm
            on_beams.setdefault(body, []).append(f":{k}")
    network = build_whole(mechanism, section, on_beams)
    origin = nodes[0]
    twists = twists_about(
        origin, 0.0 * origin, network, section, forces.configuration, mechanism.size or 1.0, seats
    )  # fmt: skip
    wrenches, rigid = bear(twists, _through(network, graph, forces, seats, origin))
    completed = list(reactions)
    for position, contact in enumerate(joints.contacts):
        if contact.joint in joints.open and not contact.turns:
            k, sign = _edge(network, contact.on, contact.by, graph.nodes[contact.node])
            arm = nodes[contact.node] - origin
            besides = _moment(rigid[:, k], arm[:, None])
            moment = sign * _moment(wrenches[:, k, :, None], arm[:, None])[:, 0]
            moment[np.abs(besides).max(axis=1) > RIGID_MOMENT] = np.nan
            completed[position] = reactions[position]._replace(moment=moment)
    return completed


def _through(
    network: Network, graph: Graph, forces: Forces, seats: Mapping[str, Complexes], origin: Complexes
) -> Floats:  # fmt: skip
    """Wrench about the origin that each edge would bear if the loops were cut, shape (n, edges, 3)."""
    through = np.zeros((len(origin), len(network.edges), 3))
    nodes = forces.configuration.nodes

    def load(vertex: str, place: Vector, force: Vector, moment: Value) -> None:
        force = _complexes(forces, force)
        turning = cross(_complexes(forces, place) - origin, force) + moment
        wrench = np.stack([force.real, force.imag, np.broadcast_to(turning, force.shape)], axis=-1)
        through[:] += network.signs(network.paths[vertex])[:, None] * wrench[:, None]

    for k, (body, arm, force, moment) in enumerate(forces.acting):
        if body != GROUND:
            vertex = f"{body}@:{k}" if f":{k}" in seats else body
            load(vertex, nodes[forces.bases[body]] + arm, force, moment)
    for node, force in enumerate(forces.nodes):
        point = graph.nodes[node]
        bodies = [body for body, own in graph.points if own == point]
        if GROUND not in bodies and not nothing(force):
            ends = (end for body in bodies for end in (f"{body}@{point}", body))
            load(next(end for end in ends if end in network.paths), nodes[node], force, 0.0)
    return through


def _complexes(forces: Forces, value: Vector) -> Complexes:
    """A vector in each pose."""
    return np.broadcast_to(np.asarray(value, dtype=complex), forces.configuration.shape)


def _moment(wrenches: Floats, arm: Complexes) -> Floats:
    """Moments of wrenches about a point, shape (n, loads); wrenches of shape (n, 3, loads), `arm` to the point."""
    return np.asarray(wrenches[:, 2] - (arm.real * wrenches[:, 1] - arm.imag * wrenches[:, 0]))


def _edge(network: Network, on: str, by: str, point: str) -> tuple[int, int]:
    """The edge between two bodies at a point; 1 where its wrench acts `on` the one, -1 where on the other."""
    for k, edge in enumerate(network.edges):
        ends = [end.partition("@")[0] for end in (edge.a, edge.b)]
        if not edge.beam and edge.point == point and sorted(ends) == sorted((on, by)):
            return k, 1 if ends[0] == on else -1
    raise AssertionError((on, by, point))
