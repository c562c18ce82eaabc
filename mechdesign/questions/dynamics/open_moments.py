"""Moments of slides and clamps in a closed chain, which equilibrium leaves open, by the force method.

Of all moments in equilibrium those of least elastic energy close the chain. What gives are the beams and
bearings of the study's stiffness section.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdesign.mechanism.forces import Forces
from mechdesign.mechanism.graph import GROUND, rod_of
from mechdesign.mechanism.loops import nothing
from mechdesign.mechanism.mechanism import Mechanism
from mechdesign.mechanism.statics import Joints, Reaction
from mechdesign.numerics.arrays import Complexes, Floats
from mechdesign.questions.stiffness.force_method import bear, twists_about
from mechdesign.questions.stiffness.network import Network, build_whole
from mechdesign.questions.stiffness.schema import StiffnessSection

# A moment that a rigid chain may bear besides, as a part of the largest, that is not rounding.
RIGID_MOMENT = 1e-9


def with_open_moments(
    reactions: Sequence[Reaction], joints: Joints, forces: Forces, mechanism: Mechanism, section: StiffnessSection
) -> list[Reaction]:  # fmt: skip
    """Reactions with the moments that elasticity determines; those of a chain in which nothing gives stay nan."""
    configuration, shape = forces.configuration, forces.configuration.shape
    acting = [
        (body, *(np.broadcast_to(np.asarray(part), shape) for part in (arm, force, moment)))
        for body, arm, force, moment in forces.acting if body != GROUND
    ]  # fmt: skip
    nodes, links = configuration.nodes, mechanism.description.links
    # Loads on beams bend them where they act; of a telescopic leg the rod alone is a beam.
    beams = {rod_of(name) if links[name].telescopic else name for name in section.elastic}
    seats: dict[str, Complexes] = {}
    on_beams: dict[str, list[str]] = {}
    for k, (body, arm, *_) in enumerate(acting):
        if body in beams:
            seats[f":{k}"] = nodes[forces.bases[body]] + arm
            on_beams.setdefault(body, []).append(f":{k}")
    network = build_whole(mechanism, section, on_beams)
    origin = np.broadcast_to(np.asarray(nodes[0], dtype=complex), shape)
    through = np.zeros((*shape, len(network.edges), 3))

    def load(vertex: str, place: Complexes, force: Complexes, moment: Floats) -> None:
        arm = place - origin
        wrench = np.stack([force.real, force.imag, moment + arm.real * force.imag - arm.imag * force.real], axis=-1)
        through[:] += network.signs(network.paths[vertex])[:, None] * wrench[:, None]

    for k, (body, arm, force, moment) in enumerate(acting):
        vertex = f"{body}@:{k}" if f":{k}" in seats else body
        load(vertex, nodes[forces.bases[body]] + arm, force, moment)
    for node, force in enumerate(forces.nodes):
        vertex = _vertex_at(joints, network, node)
        if vertex is not None and not nothing(force):
            pull = np.broadcast_to(np.asarray(force, dtype=complex), shape)
            load(vertex, np.broadcast_to(nodes[node], shape), pull, np.zeros(shape))
    twists = twists_about(origin, 0 * origin, network, section, configuration, mechanism.size or 1.0, seats)
    wrenches, rigid = bear(twists, through)
    completed = list(reactions)
    for position, contact in enumerate(joints.contacts):
        if contact.joint not in joints.open or contact.turns:
            continue
        k, sign = _edge(network, contact.on, contact.by, joints.graph.nodes[contact.node])
        arm = nodes[contact.node] - origin

        def moment_of(wrench: Floats, arm: Complexes = arm) -> Floats:
            x, y = (np.reshape(part, (-1, *[1] * (wrench.ndim - 2))) for part in (arm.real, arm.imag))
            return wrench[:, 2] - x * wrench[:, 1] + y * wrench[:, 0]

        besides = np.abs(moment_of(rigid[:, k])).max(axis=1)
        moment = np.where(besides > RIGID_MOMENT, np.nan, sign * moment_of(wrenches[:, k]))
        completed[position] = reactions[position]._replace(moment=moment)
    return completed


def _vertex_at(joints: Joints, network: Network, node: int) -> str | None:
    """The vertex that bears a force on the pin at a node; None where it is fixed in the ground."""
    point = joints.graph.nodes[node]
    bodies = [body for body, own in joints.graph.points if own == point]
    if GROUND in bodies:
        return None
    return next(vertex for body in bodies for vertex in (f"{body}@{point}", body) if vertex in network.paths)


def _edge(network: Network, on: str, by: str, point: str) -> tuple[int, int]:
    """The edge between two bodies at a point, and 1 where its wrench acts on the one, -1 where on the other."""
    for k, edge in enumerate(network.edges):
        ends = [end.partition("@")[0] for end in (edge.a, edge.b)]
        if not edge.beam and edge.point == point and sorted(ends) == sorted((on, by)):
            return k, 1 if ends[0] == on else -1
    raise AssertionError((on, by, point))
