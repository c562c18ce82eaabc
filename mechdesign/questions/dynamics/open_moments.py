"""Moments of slides and clamps in a closed chain, which equilibrium leaves open, by the force method.

Of all moments in equilibrium those of least elastic energy close the chain. What gives are the beams and bearings of
the study's stiffness section.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.joint_contacts import Joints
from mechdesign.mechanism.mechanism import Mechanism
from mechdesign.mechanism.statics import Reaction
from mechdesign.questions.stiffness.applied import Applied
from mechdesign.questions.stiffness.bodies import build_bodies
from mechdesign.questions.stiffness.elements import SpringElement
from mechdesign.questions.stiffness.force_method import load, moments_about, twists_of
from mechdesign.questions.stiffness.network import Network, build_network
from mechdesign.questions.stiffness.schema import StiffnessSection

# A moment that a rigid chain may bear besides is rounding below this part of a unit of force on the length of a radian.
RIGID_MOMENT = 1e-9


def chain_network(joints: Joints, mechanism: Mechanism, section: StiffnessSection) -> Network:
    """All bodies of a mechanism, without its springs, whose forces are among the loads."""
    graph = joints.graph
    base = next(point for body, point in graph.points if body == GROUND)
    bodies = build_bodies(mechanism, GROUND, base, section, [graph.nodes[node] for node in joints.loaded])
    edges = [edge for edge in bodies.edges if not any(isinstance(element, SpringElement) for element in edge.elements)]
    return build_network(replace(bodies, edges=tuple(edges)), whole=True)


def with_open_moments(
    reactions: Sequence[Reaction], joints: Joints, applied: Applied, section: StiffnessSection, length: float,
    efforts: Sequence[Value],
) -> list[Reaction]:  # fmt: skip
    """Reactions with the moments that elasticity determines; those of a chain in which nothing gives stay nan.

    A radian counts as `length`; `efforts` are those of the couplings, whose signs say which flanks of teeth press.
    """
    network, configuration = applied.network, applied.configuration
    signs = [np.broadcast_to(np.sign(effort), configuration.shape) for effort in efforts]
    sides = np.stack(signs, axis=-1) * network.one_sided if signs else None
    twists = twists_of(network, section, configuration, length, applied, sides)
    # Poses that are not known are solved as if nothing moved.
    finite = np.isfinite(twists.twist).all(axis=(1, 2))
    twist, compliance = (np.where(finite, part.T, 0.0).T for part in (twists.twist, twists.compliance))
    couplings = twists.couplings
    if couplings is not None:
        through, acting = (np.where(finite, part.T, 0.0).T for part in (couplings.through, couplings.acting))
        couplings = replace(couplings, through=through, acting=acting)
    loaded = load(replace(twists, twist=twist, compliance=compliance, couplings=couplings), 3)
    origin, completed = configuration.point(section.at), list(reactions)
    for position, contact in enumerate(joints.contacts):
        if contact.joint in joints.open and not contact.turns:
            k, sign = _edge(network, contact.on, contact.by, joints.graph.nodes[contact.node])
            arm = configuration.nodes[contact.node] - origin
            besides = np.abs(moments_about(arm, loaded.open_wrenches[:, k])).max(axis=1, initial=0.0)
            moment = sign * moments_about(arm, loaded.wrenches[:, k, :, -1:])[:, 0]
            moment = np.where(finite & (besides <= RIGID_MOMENT * length), moment, np.nan)
            completed[position] = reactions[position]._replace(moment=moment)
    return completed


def _edge(network: Network, on: str, by: str, point: str) -> tuple[int, int]:
    """The edge between two bodies at a point; 1 where its wrench acts `on` the one, -1 where on the other."""
    for k, edge in enumerate(network.edges):
        ends = [end.partition("@")[0] for end in (edge.a, edge.b)]
        if not edge.beam and edge.point == point and sorted(ends) == sorted((on, by)):
            return k, 1 if ends[0] == on else -1
    raise AssertionError((on, by, point))
