"""How a network of joints and beams holds one of its bodies, by the force method: forces first, then displacements.

A_p and A_e are the twists of the free and the elastic joints around all loops; B_p and B_e those on the path to the
asked body. A coupling is one more row of A_p and A_e: how much its gap closes by each freedom, and by a freedom of its
own where it gives; its entry of l is its effort. A load w is in equilibrium with loop wrenches and efforts l where

    A_p^T l = B_p^T w.

Elastic joints then bear F = B_e^T w - A_e^T l, and by the principle of virtual forces the compliance is F^T C F. Where
equilibrium does not determine the loop wrenches (states of self-stress), those of least energy close the loops. No
compliance is inverted: rigid joints are zeros in C. [Argyris & Kelsey, Energy Theorems and Structural Analysis, 1960;
Davies, Circuit actions attributable to active couplings, 1995]
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import Value
from mechdesign.questions.stiffness.applied import Applied, borne
from mechdesign.questions.stiffness.compliance import Held, moved_to, scales
from mechdesign.questions.stiffness.couplings import Efforts, compliance_of, efforts_on
from mechdesign.questions.stiffness.elements import beam_line, freedoms, piece_freedoms, screw_origin
from mechdesign.questions.stiffness.network import Network
from mechdesign.questions.stiffness.schema import StiffnessSection
from mechdesign.questions.stiffness.screws import RANK
from mechdesign.questions.stiffness.self_stress import SelfStress, held_of, least_energy, strained, ways_of


class _Freedom(NamedTuple):
    """A freedom of a network in n poses.

    Attributes
    ----------
    within : ndarray, shape (edges, n or 1)
        1 for the edges that have it, else 0.
    twist : ndarray, shape (3, n)
        Its twist.
    compliance : float or ndarray, shape (n,), or None
        None of a free joint.
    acting, strain : ndarray, shape (n, cases), or 0
        Effort on it and strain of it by loads on beams.
    """

    within: Floats
    twist: Floats
    compliance: Value | None
    acting: Floats | float = 0.0
    strain: Floats | float = 0.0


@dataclass(frozen=True, eq=False)
class Elsewhere:
    """Loads that act anywhere on a network in n poses, each a case of its own.

    Parameters
    ----------
    through : ndarray, shape (n, edges, 3, cases)
        Wrench about the origin of the twists on each edge of the tree; on beams that of loads beyond their beginning.
    acting, initial : ndarray, shape (n, freedoms, cases)
        What the loads put on each freedom of the tree, and strains by loads within a piece of a beam.
    """

    through: Floats
    acting: Floats
    initial: Floats


@dataclass(frozen=True, eq=False)
class Twists:
    """Freedoms of a network in n poses, with rotations scaled to lengths by `length`.

    Parameters
    ----------
    twist : ndarray, shape (n, 3, freedoms)
        Twists about an origin: the asked point, or the middle of the joints where that point is far away.
    compliance : ndarray, shape (n, freedoms)
        Compliances; 0 for free joints.
    free : ndarray of bool, shape (freedoms,)
        Which freedoms belong to free joints.
    within : ndarray, shape (n or 1, edges, freedoms)
        1 where a freedom is a part of an edge, else 0. Edges along the beams of one link share the freedoms of the
        stretch that they have in common in each pose.
    arm : complex ndarray, shape (n,)
        From the origin of the twists to the asked point.
    length : float or ndarray, shape (n,)
        Length as which a radian counts.
    elsewhere : Elsewhere or None
        What loads that act anywhere do to edges and freedoms.
    couplings : Efforts or None
        What unit efforts on couplings do to edges and freedoms; None without couplings.
    """

    network: Network
    twist: Floats
    compliance: Floats
    free: Flags
    within: Floats
    arm: Complexes
    length: Value
    elsewhere: Elsewhere | None = None
    couplings: Efforts | None = None

    @property
    def scale(self) -> Floats:
        """Factors that scale forces and moments, shape (n, 3)."""
        return scales(self.length, len(self.twist))


@dataclass(frozen=True, eq=False)
class Loaded:
    """A body held by a network in n poses, and the effects of unit loads on it; nan where the body is not held.

    Loads are the unit loads, as many as the size, and after them the cases of loads anywhere.

    Parameters
    ----------
    stress : ndarray, shape (n, 3 loops and couplings, loads)
        Wrenches of the loops and efforts of couplings under scaled unit loads, and under the others.
    shift : ndarray, shape (n, freedoms, loads)
        Displacements in all freedoms under the same loads.
    rigid : ndarray, shape (n, 3 loops and couplings, as many), or None
        Projector onto the states of self-stress that store no energy; None where no pose has any.
    """

    held: Held
    twists: Twists
    stress: Floats
    shift: Floats
    rigid: Floats | None

    @property
    def size(self) -> int:
        """Number of unit loads."""
        return int(self.held.compliance.shape[1])

    @cached_property
    def wrenches(self) -> Floats:
        """Wrench that each edge bears about the asked point, a column for each load, shape (n, edges, 3, loads)."""
        size, scale = self.size, self.twists.scale
        _, onward = ways_of(self.twists.network)
        around = self._around(self.stress)
        # The load on the edges of its path to the ground, less the wrenches of the loops and couplings.
        through = onward[:, None, None] * np.eye(3)[:, :size] - around[..., :size]
        unscaled = through / scale[:, None, :, None] * scale[:, None, None, :size]
        units = np.asarray(self._back @ unscaled @ self._loads[:, None])
        if self.twists.elsewhere is None:
            return units
        others = self.twists.elsewhere.through - around[..., size:] / scale[:, None, :, None]
        return np.concatenate([units, self._back @ others], axis=3)

    @property
    def efforts(self) -> Floats:
        """Effort of each coupling on the coordinate that it sets, a column for each load, shape (n, couplings, loads).

        A moment is divided by the length as which a radian counts.
        """
        size, (around, _) = self.size, ways_of(self.twists.network)
        efforts = self.stress[:, 3 * len(around) :]
        units = (efforts[:, :, :size] * self.twists.scale[:, None, :size]) @ self._loads
        return np.concatenate([units, efforts[:, :, size:]], axis=2)

    @cached_property
    def open_wrenches(self) -> Floats:
        """Wrenches of each edge about the asked point that nothing determines, shape (n, edges, 3, states)."""
        if self.rigid is None:
            return np.zeros((len(self.stress), len(self.twists.network.edges), 3, 0))
        return np.asarray(self._back @ (self._around(self.rigid) / self.twists.scale[:, None, :, None]))

    @cached_property
    def displacements(self) -> dict[str, Floats]:
        """Twist of each vertex about the asked point, a column for each load, shape (n, 3, loads)."""
        twists, size = self.twists, self.size
        scale = twists.scale
        to_point = moved_to(twists.arm) * scale[:, None]
        shift = (self.shift[:, :, :size] * scale[:, None, :size]) @ self._loads
        shift = np.concatenate([shift, self.shift[:, :, size:]], axis=2)
        twists_of_vertices = {}
        for vertex, path in twists.network.paths.items():
            signs = twists.network.signs(path) @ twists.within
            on = np.flatnonzero(signs.any(axis=0))
            twists_of_vertices[vertex] = to_point @ ((signs[:, None, on] * twists.twist[:, :, on]) @ shift[:, on])
        return twists_of_vertices

    def _around(self, stress: Floats) -> Floats:
        """What each edge takes of the scaled wrenches of its loops and of couplings, shape (n, edges, 3, loads)."""
        around, _ = ways_of(self.twists.network)
        rows = 3 * len(around)
        of_loops = stress[:, :rows].reshape(len(stress), len(around), 3, stress.shape[2])
        taken = np.asarray(np.einsum("le,nlis->neis", around, of_loops))
        if self.twists.couplings is not None:
            through = self.twists.couplings.through * self.twists.scale[:, None, :, None]
            taken -= through @ stress[:, None, rows:]
        return taken

    @property
    def _back(self) -> Floats:
        """What moves wrenches from the origin of the twists to the asked point, shape (n, 1, 3, 3)."""
        return moved_to(-self.twists.arm).swapaxes(1, 2)[:, None]

    @property
    def _loads(self) -> Floats:
        """Unit loads at the asked point, moved to the origin of the twists, shape (n, size, size)."""
        size = self.size
        return moved_to(self.twists.arm).swapaxes(1, 2)[:, :size, :size]


def twists_of(
    network: Network, section: StiffnessSection, configuration: Configuration, length: Value,
    applied: Applied | None = None, sides: Floats | None = None,
) -> Twists:  # fmt: skip
    """Freedoms of all edges and couplings, and what loads do to them; a radian counts as `length`, one for all poses or
    each.

    `sides` of couplings, shape (n, couplings), are those of `mechdesign.questions.stiffness.couplings`.
    """
    at, n = configuration.point(section.at), configuration.shape[0]
    joints = [edge.point for edge in network.edges]
    origin = at if section.link is None else screw_origin(joints, at, configuration, length)
    rows = [
        _Freedom(np.eye(len(network.edges))[k][:, None], *freedom)
        for k, edge in enumerate(network.edges) if not edge.beam
        for freedom in freedoms(edge.elements, section, configuration, origin)
    ]  # fmt: skip
    for edges in network.edges_along_beams:
        rows += _beam_freedoms(network, edges, section, configuration, origin, applied)
    giving = [compliance_of(coupling, section, configuration, length) for coupling in network.transmissions]
    first = len(rows)
    nowhere = np.zeros((len(network.edges), 1)), np.zeros((3, 1))
    rows += [_Freedom(*nowhere, soft) for soft in giving if soft is not None]
    twist = np.zeros((n, 3, len(rows)))
    compliance = np.zeros((n, len(rows)))
    within = np.zeros((max((row.within.shape[1] for row in rows), default=1), len(network.edges), len(rows)))
    for j, row in enumerate(rows):
        within[:, :, j] = row.within.T
        twist[:, :, j] = np.broadcast_to(row.twist, (3, n)).T
        compliance[:, j] = 0.0 if row.compliance is None else row.compliance

    def put_on(through: Floats) -> Floats:
        parts = np.broadcast_to(within, (n, *within.shape[1:]))
        return np.asarray(np.einsum("nej,neic,nij->njc", parts, through, twist))

    elsewhere = couplings = None
    if network.transmissions:
        through, teeth = efforts_on(network, configuration, origin, length, sides)
        couplings = Efforts(through, put_on(through), teeth)
        soft_ones = [k for k, soft in enumerate(giving) if soft is not None]
        couplings.acting[:, first + np.arange(len(soft_ones)), soft_ones] = 1.0
    if applied is not None:
        through = borne(network, applied.vertices, applied.cases, origin)
        acting = put_on(through)
        initial = np.zeros(acting.shape)
        for j, row in enumerate(rows):
            acting[:, j] += row.acting
            initial[:, j] = row.strain
        elsewhere = Elsewhere(through, acting, initial)
    twist[:, 2] *= np.reshape(length, (-1, 1))
    free = np.array([row.compliance is None for row in rows], dtype=bool)
    return Twists(network, twist, compliance, free, within, at - origin, length, elsewhere, couplings)


def _beam_freedoms(
    network: Network, edges: Sequence[int], section: StiffnessSection, configuration: Configuration,
    origin: Complexes, applied: Applied | None,
) -> Iterator[_Freedom]:  # fmt: skip
    """Freedoms of the beams of one link, cut wherever something is attached.

    As slides change their order along the beams, the parts of the beams are sorted in each pose.
    """
    beams = [beam for k in edges if (beam := network.edges[k].beam)]
    line, profile = beam_line(beams[0].link, configuration), section.sections[beams[0].section]
    feet = np.array([line.foot(beam.head, configuration.point(beam.head)) for beam in beams])
    cuts = np.sort(np.concatenate([np.zeros((1, feet.shape[1])), feet]), axis=0)
    for low, high in pairwise(cuts):
        over = np.zeros((len(network.edges), feet.shape[1]))
        over[list(edges)] = feet > low
        if (over == over[:, :1]).all():
            over = over[:, :1]
        for piece in line.between(low, high):
            three = list(piece_freedoms(piece, profile, origin))
            if applied is None:
                yield from (_Freedom(over, *freedom) for freedom in three)
                continue
            own, strain = np.zeros((2, 3, len(piece.length), applied.cases))
            ways = piece.along, 1j * piece.along
            for case, wrench, twist in applied.on_beams(beams[0].link.name, piece, profile, origin):
                for j, (allowed, _) in enumerate(three):
                    own[j, :, case] += np.sum(np.broadcast_to(allowed, wrench.shape) * wrench, axis=0)
                at_middle = twist[0] + 1j * twist[1] + 1j * twist[2] * (piece.middle - origin)
                for j, way in enumerate(ways):
                    strain[j, :, case] += np.real(at_middle * np.conj(way))
                strain[2, :, case] += twist[2]
            yield from (_Freedom(over, *freedom, own[j], strain[j]) for j, freedom in enumerate(three))


def load(twists: Twists, size: int) -> Loaded:
    """Stiffness and compliance of a body or (`size` 2) a pin, with wrenches and displacements under all loads."""
    n, (around, onward), others = len(twists.twist), ways_of(twists.network), twists.elsewhere

    def matrices(chosen: Flags) -> tuple[Floats, Floats]:
        within, twist = twists.within[:, :, chosen], twists.twist[:, :, chosen]
        loops = (around @ within)[:, :, None] * twist[:, None]
        path = (onward @ within)[:, None] * twist[:, :size]
        if others is not None:
            path = np.concatenate([path, others.acting[:, chosen].swapaxes(1, 2)], axis=1)
        loops = loops.reshape(n, 3 * len(around), twist.shape[2])
        if twists.couplings is not None:
            loops = np.concatenate([loops, -twists.couplings.acting[:, chosen].swapaxes(1, 2)], axis=1)
        return loops, path

    compliance = twists.compliance[:, ~twists.free]
    initial = None if others is None else others.initial[:, ~twists.free]
    free_loops, free_path = matrices(twists.free)
    statics = SelfStress.of(free_loops, free_path, size)
    loops, path = matrices(~twists.free)
    bears, stress, rigid = least_energy(statics, loops, path, compliance, initial)
    strain = strained(compliance, bears, initial)
    total = bears[:, :, :size].swapaxes(1, 2) @ strain[:, :, :size]
    shift = np.zeros((n, len(twists.free), path.shape[1]))
    shift[:, ~twists.free] = strain
    shift[:, twists.free] = -statics.inverse @ (loops @ strain)
    held = held_of((total + total.swapaxes(1, 2)) / 2, statics, twists.length, size)
    stress[held.rank < size], shift[held.rank < size] = np.nan, np.nan
    if others is not None:
        # Loads that move the mechanism are in no equilibrium.
        rest = np.abs(free_path[:, size:] - stress[:, :, size:].swapaxes(1, 2) @ free_loops).max(axis=2, initial=0.0)
        moves = rest > RANK * np.abs(others.acting).max(axis=1, initial=0.0)
        for part in (stress, shift):
            part[:, :, size:][np.broadcast_to(moves[:, None], part[:, :, size:].shape)] = np.nan
    return Loaded(held.seen_from(twists.arm), twists, stress, shift, rigid)


def moments_about(arm: Complexes, wrenches: Floats) -> Floats:
    """Moments, shape (n, loads), of wrenches (n, 3, loads) about a place at an arm (n,) from where they are taken."""
    return np.asarray(wrenches[:, 2] - (arm.real[:, None] * wrenches[:, 1] - arm.imag[:, None] * wrenches[:, 0]))
