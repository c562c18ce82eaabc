"""Couplings of a network: the wrenches by which they act on its vertices, and how much they give.

An effort on the gap of a coupling does the work of these wrenches on any displacement of the network [virtual work]. Of
gears and a rack they are the forces between their teeth, of a belt the pulls of its strands, of a cam the contact force
along its normal; of others the moments, forces along slides and forces at points whose work is that of the effort. A
wheel is a rigid disc on its link at its axis, a rack at its joint's point, a cam at the first point of its link, a
roller or a flat face at its point.

Which flank of the teeth, or strand of a belt, takes an effort depends on its sign. Those of a side 1 or -1 take it
alone. A side 0 is their mean, which is linear: teeth that touch on both flanks, a belt whose pretension keeps both
strands tight. Their mean is along the pitch circles.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.outputs import node_forces, shares
from mechdesign.questions.stiffness.applied import Wrench, borne
from mechdesign.questions.stiffness.bodies import BodyCoupling
from mechdesign.questions.stiffness.elements import slide_direction
from mechdesign.questions.stiffness.network import Network
from mechdesign.questions.stiffness.schema import StiffnessSection


@dataclass(frozen=True, eq=False)
class Efforts:
    """What unit efforts on the couplings of a network do in n poses; a radian counts as a length, which makes them
    forces.

    Parameters
    ----------
    through : ndarray, shape (n, edges, 3, couplings)
        Wrench about the origin of the twists on each edge of the tree.
    acting : ndarray, shape (n, freedoms, couplings)
        What they put on each freedom, and on that of the coupling itself where it gives.
    teeth : complex ndarray, shape (n, couplings)
        Force of teeth, of a belt or of a cam on the link that follows; 0 of other couplings.
    """

    through: Floats
    acting: Floats
    teeth: Complexes


def efforts_on(
    network: Network, configuration: Configuration, origin: Complexes, length: Value, sides: Floats | None
) -> tuple[Floats, Complexes]:
    """Wrenches about an origin on each edge of the tree, and forces of teeth, of `Efforts`.

    `sides` are those of each coupling in each pose, shape (n, couplings); None where all are 0.
    """
    vertices: list[tuple[str, Wrench]] = []
    teeth = np.zeros((*configuration.shape, len(network.transmissions)), dtype=complex)
    for case, transmission in enumerate(network.transmissions):
        side = np.zeros(configuration.shape) if sides is None else sides[:, case]
        wrenches = list(_wrenches(transmission, configuration, case, _unit(transmission, length), side))
        vertices += wrenches
        if transmission.engagement is not None:
            # Those on the link that follows come first of each pair.
            teeth[:, case] = sum(wrench.force for _, wrench in wrenches[::2])
    return borne(network, vertices, len(network.transmissions), origin), teeth


def compliance_of(
    transmission: BodyCoupling, section: StiffnessSection, configuration: Configuration, length: Value
) -> Value | None:
    """Compliance of a coupling to its unit effort; None where it is rigid."""
    given = section.couplings.get(transmission.coupling.name)
    if given is None:
        return None
    soft: list[Value] = []
    if given.force is not None:
        pair = transmission.engagement
        lever: Value = 1.0 if pair is None else pair.lever(configuration)
        soft.append((1 / lever) ** 2 / given.force)
    if given.moment is not None:
        soft.append(1 / given.moment)
    return sum(soft) * _unit(transmission, length) ** 2


def _unit(transmission: BodyCoupling, length: Value) -> Value:
    """The effort that counts as a force of 1: a moment on an angle."""
    return length if transmission.coupling.gap.quantity == "angle" else 1.0


def _wrenches(
    transmission: BodyCoupling, configuration: Configuration, case: int, effort: Value, side: Floats
) -> Iterator[tuple[str, Wrench]]:
    """Wrenches on vertices by an effort on the gap of a coupling."""
    pair = transmission.engagement
    if pair is not None:
        follower, driving = transmission.seats[pair.coupling]
        for way in (1.0, -1.0):
            push = pair.press(configuration, effort * (1 + way * side) / 2, way)
            yield follower, Wrench(case, push.place, push.force)
            yield driving, Wrench(case, push.place, -1.0 * push.force)
        return
    for part, share in shares(configuration, transmission.coupling.gap, effort):
        seats = transmission.seats[part.name]
        for seat, (node, force) in zip(seats, node_forces(configuration, part, share), strict=False):
            yield seat, Wrench(case, configuration.nodes[node], force)
        for seat, sign in zip(seats, (1.0, -1.0), strict=False):
            if part.kind == "angle":
                yield seat, Wrench(case, 0.0, 0.0, sign * share)
            elif part.kind == "slide":
                head = next(edge.head for edge in configuration.graph.edges if edge.slide == part.slide)
                along = slide_direction(part.slide, configuration)
                yield seat, Wrench(case, configuration.nodes[head], sign * share * along)
