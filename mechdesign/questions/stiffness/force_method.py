"""How a network of joints and beams holds one of its bodies, by the force method: forces first, then displacements.

A_p and A_e are the twists of the free and the elastic joints around all loops; B_p and B_e those on the path to the
asked body. A load w is in equilibrium with loop wrenches l where

    A_p^T l = B_p^T w.

Elastic joints then bear F = B_e^T w - A_e^T l, and by the principle of virtual forces the compliance is F^T C F. Where
equilibrium does not determine the loop wrenches (states of self-stress), those of least energy close the loops. No
compliance is inverted: rigid joints are zeros in C. [Argyris & Kelsey, Energy Theorems and Structural Analysis, 1960;
Davies, Circuit actions attributable to active couplings, 1995]
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import Value
from mechdesign.numerics.arrays import Complexes, Flags, Floats
from mechdesign.questions.stiffness.compliance import REGULAR, Held, inverses, moved_to, poses_by, scales, stiffness_of
from mechdesign.questions.stiffness.elements import beam_line, bending, freedoms, screw_origin
from mechdesign.questions.stiffness.network import Network
from mechdesign.questions.stiffness.schema import StiffnessSection
from mechdesign.questions.stiffness.screws import RANK, RIGID

# States of self-stress with less than this fraction of the largest one's energy are rounding: they are rigid.
SELF_STRESS = 1e-13
# So are those with less than this fraction (rounding squared) of the largest energy that loop wrenches could store.
STORED = 1e-26


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
    """

    network: Network
    twist: Floats
    compliance: Floats
    free: Flags
    within: Floats
    arm: Complexes
    length: Value

    @property
    def scale(self) -> Floats:
        """Factors that scale forces and moments, shape (n, 3)."""
        return scales(self.length, len(self.twist))


@dataclass(frozen=True, eq=False)
class Loaded:
    """A body held by a network in n poses, and the effects of unit loads on it; nan where the body is not held.

    Parameters
    ----------
    stress : ndarray, shape (n, 3 loops, size)
        Wrenches of the loops under scaled unit loads.
    shift : ndarray, shape (n, freedoms, size)
        Displacements in all freedoms under the same loads.
    """

    held: Held
    twists: Twists
    stress: Floats
    shift: Floats

    @cached_property
    def wrenches(self) -> Floats:
        """Wrench that each edge bears about the asked point, a column for each unit load, shape (n, edges, 3, size)."""
        network, size = self.twists.network, self.stress.shape[2]
        around, onward = _ways(network)
        stress = self.stress.reshape(len(self.stress), len(around), 3, size)
        # The load on the edges of its path to the ground, less the wrenches of the loops.
        through = onward[:, None, None] * np.eye(3)[:, :size] - np.einsum("le,nlis->neis", around, stress)
        scale = self.twists.scale
        unscaled = through / scale[:, None, :, None] * scale[:, None, None, :size]
        back = moved_to(-self.twists.arm).swapaxes(1, 2)
        return np.asarray(back[:, None] @ unscaled @ self._loads[:, None])

    @cached_property
    def displacements(self) -> dict[str, Floats]:
        """Twist of each vertex about the asked point, a column for each unit load, shape (n, 3, size)."""
        twists, size = self.twists, self.stress.shape[2]
        scale = twists.scale
        to_point, shift = moved_to(twists.arm) * scale[:, None], (self.shift * scale[:, None, :size]) @ self._loads
        twists_of_vertices = {}
        for vertex, path in twists.network.paths.items():
            signs = twists.network.signs(path) @ twists.within
            on = np.flatnonzero(signs.any(axis=0))
            twists_of_vertices[vertex] = to_point @ ((signs[:, None, on] * twists.twist[:, :, on]) @ shift[:, on])
        return twists_of_vertices

    @property
    def _loads(self) -> Floats:
        """Unit loads at the asked point, moved to the origin of the twists, shape (n, size, size)."""
        size = self.stress.shape[2]
        return moved_to(self.twists.arm).swapaxes(1, 2)[:, :size, :size]


def twists_of(network: Network, section: StiffnessSection, configuration: Configuration, length: Value) -> Twists:
    """Freedoms of all edges; a radian counts as `length`, one for all poses or each."""
    at = configuration.point(section.at)
    joints = [edge.point for edge in network.edges]
    origin = at if section.link is None else screw_origin(joints, at, configuration, length)
    return twists_about(origin, at - origin, network, section, configuration, length)


def twists_about(
    origin: Complexes, arm: Complexes, network: Network, section: StiffnessSection, configuration: Configuration,
    length: Value, seats: Mapping[str, Complexes] | None = None,
) -> Twists:  # fmt: skip
    """Freedoms of all edges about an origin; `seats` are places on beams that are no points of the mechanism."""
    n = configuration.shape[0]
    # A row for each freedom: the edges that have it (1 or 0), the twist and the compliance.
    rows = [(np.eye(len(network.edges))[k][:, None], *freedom) for k, edge in enumerate(network.edges) if not edge.beam
            for freedom in freedoms(edge.elements, section, configuration, origin)]  # fmt: skip
    for edges in network.edges_along_beams:
        rows += _beam_freedoms(network, edges, section, configuration, origin, seats or {})
    twist = np.zeros((n, 3, len(rows)))
    compliance = np.zeros((n, len(rows)))
    within = np.zeros((max((over.shape[1] for over, *_ in rows), default=1), len(network.edges), len(rows)))
    for j, (over, allowed, soft) in enumerate(rows):
        within[:, :, j] = over.T
        twist[:, :, j] = np.broadcast_to(allowed, (3, n)).T
        if soft is not None:
            compliance[:, j] = soft
    twist[:, 2] *= np.reshape(length, (-1, 1))
    free = np.array([soft is None for *_, soft in rows], dtype=bool)
    return Twists(network, twist, compliance, free, within, arm, length)


def _beam_freedoms(
    network: Network, edges: Sequence[int], section: StiffnessSection, configuration: Configuration,
    origin: Complexes, seats: Mapping[str, Complexes],
) -> Iterator[tuple[Floats, Floats, Value]]:  # fmt: skip
    """Freedoms of the beams of one link, cut wherever something is attached.

    Yields of each freedom the edges that run over its part of the beams (1 or 0), shape (edges, n) or (edges, 1), its
    twist and its compliance. As slides change their order along the beams, parts are sorted in each pose.
    """
    beams = [beam for k in edges if (beam := network.edges[k].beam)]
    line = beam_line(beams[0].link, configuration)
    heads = [seats[beam.head] if beam.head in seats else configuration.point(beam.head) for beam in beams]
    feet = np.array([line.foot(beam.head, head) for beam, head in zip(beams, heads, strict=True)])
    cuts = np.sort(np.concatenate([np.zeros((1, feet.shape[1])), feet]), axis=0)
    for low, high in pairwise(cuts):
        over = np.zeros((len(network.edges), feet.shape[1]))
        over[list(edges)] = feet > low
        if (over == over[:, :1]).all():
            over = over[:, :1]
        for twist, compliance in bending(line, low, high, section.sections[beams[0].section], origin):
            yield over, twist, compliance


def load(twists: Twists, size: int) -> Loaded:
    """Stiffness and compliance of a body or (`size` 2) a pin, with wrenches and displacements under unit loads."""
    n, (_, onward) = len(twists.twist), _ways(twists.network)
    through = np.broadcast_to(onward[:, None, None] * np.eye(3)[:size], (n, len(onward), size, 3))
    statics, loops, compliance = _equilibrium(twists, through)
    bears, stress, _ = _least_energy(statics, *loops, compliance)
    strain = compliance[:, :, None] * bears
    total = bears.swapaxes(1, 2) @ strain
    shift = np.zeros((n, len(twists.free), size))
    shift[:, ~twists.free] = strain
    shift[:, twists.free] = -statics.inverse @ (loops[0] @ strain)
    held = _held((total + total.swapaxes(1, 2)) / 2, statics, twists.length, size)
    stress[held.rank < size], shift[held.rank < size] = np.nan, np.nan
    return Loaded(held.seen_from(twists.arm), twists, stress, shift)


def bear(twists: Twists, through: Floats) -> tuple[Floats, Floats]:
    """Wrenches that all edges bear under the loads of each pose, and what rigid loops may bear besides.

    Parameters
    ----------
    through : ndarray, shape (n, edges, 3)
        Wrench about the origin of the twists that each edge would bear if the loops were cut.

    Returns
    -------
    wrenches : ndarray, shape (n, edges, 3)
        nan where free joints give way, and in poses that are not known.
    open_wrenches : ndarray, shape (n, edges, 3, 3 loops)
        States of self-stress that store no energy.
    """
    scale = twists.scale[:, None]
    unknown = ~np.isfinite(twists.twist).all(axis=(1, 2)) | ~np.isfinite(through).all(axis=(1, 2))
    kept = np.where(unknown, 0.0, 1.0)[:, None, None]
    twist, compliance = np.nan_to_num(twists.twist) * kept, np.nan_to_num(twists.compliance) * kept[:, 0]
    twists = replace(twists, twist=twist, compliance=compliance)
    scaled = np.nan_to_num(through) * kept * scale
    size = np.abs(scaled).max(axis=(1, 2), keepdims=True, initial=0.0)
    size[size == 0] = 1.0
    unit = scaled / size
    statics, loops, compliance = _equilibrium(twists, unit[:, :, None])
    _, stress, rigid = _least_energy(statics, *loops, compliance)
    around, _ = _ways(twists.network)

    def of_edges(wrenches: Floats) -> Floats:
        around_loops = wrenches.reshape(len(unit), len(around), 3, wrenches.shape[2])
        return np.asarray(np.einsum("le,nlik->neik", around, around_loops))

    wrenches = unit - of_edges(stress)[..., 0]
    if statics.lost is not None:
        unknown = unknown | (np.trace(statics.lost, axis1=1, axis2=2) > 0.5)
    wrenches[unknown] = np.nan
    return wrenches * size / scale, of_edges(rigid) / scale[..., None]


def _equilibrium(twists: Twists, through: Floats) -> tuple[_Statics, tuple[Floats, Floats], Floats]:
    """Equilibrium of the free joints, and loops, paths and compliances of the elastic ones.

    `through` are the scaled wrenches that each edge would bear under each load if the loops were cut, of shape
    (n, edges, loads, 3).
    """
    n, (around, _) = len(twists.twist), _ways(twists.network)
    carried = through.transpose(0, 2, 3, 1).reshape(n, -1, through.shape[1])

    def matrices(chosen: Flags) -> tuple[Floats, Floats]:
        within, twist = twists.within[:, :, chosen], twists.twist[:, :, chosen]
        loops = (around @ within)[:, :, None] * twist[:, None]
        on_path = carried @ within
        path = (on_path.reshape(n, through.shape[2], 3, twist.shape[2]) * twist[:, None]).sum(axis=2)
        return loops.reshape(n, 3 * len(around), twist.shape[2]), path

    return _Statics.of(*matrices(twists.free)), matrices(~twists.free), twists.compliance[:, ~twists.free]


def _ways(network: Network) -> tuple[Floats, Floats]:
    """Directions of the edges around each loop, shape (loops, edges), and on the path to the asked body, (edges,)."""
    loops = np.array([network.signs(loop) for loop in network.loops]).reshape(-1, len(network.edges))
    return loops, network.signs(network.paths[network.asked])


@dataclass(frozen=True, eq=False)
class _Statics:
    """Equilibrium of the free joints.

    Parameters
    ----------
    inverse : ndarray, shape (n, freedoms, loops)
        Pseudo-inverse of the free joints' loop matrix: their motions that close gaps in the loops.
    particular : ndarray, shape (n, loops, size)
        Loop wrenches in equilibrium with each unit load.
    stress : ndarray, shape (n, loops, loops), or None
        Projector onto the states of self-stress; None where no pose has any.
    lost : ndarray, shape (n, size, size), or None
        Projector onto the asked body's free displacements; None where no pose has any.
    margin : ndarray, shape (n,)
        Smallest singular value (of unit columns) that is not zero; infinite where it was not computed.
    """

    inverse: Floats
    particular: Floats
    stress: Floats | None
    lost: Floats | None
    margin: Floats

    @staticmethod
    def of(loops: Floats, path: Floats) -> _Statics:
        """Solve for the equilibrium of each pose: by the inverse of a regular matrix, or else by singular values."""
        norm = np.sqrt((loops**2).sum(axis=1) + (path**2).sum(axis=1))
        norm = np.where(norm > 0, norm, 1.0)[:, None]
        unit, along = loops / norm, path / norm
        n, rows, columns = unit.shape
        inverse, regular = np.zeros((n, columns, rows)), np.zeros(n, dtype=bool)
        if rows == columns:
            inverse, regular = inverses(unit, REGULAR)
        margin, stress, lost = np.full(n, np.inf), None, None
        irregular = np.flatnonzero(~regular)
        if len(irregular):
            left, values, right = np.linalg.svd(unit[irregular])
            keep = values > RANK
            margin[irregular] = np.where(keep, values, np.inf).min(axis=1, initial=np.inf)
            upright, count = right.swapaxes(1, 2), values.shape[1]
            upside = np.where(keep, 1 / np.where(keep, values, 1.0), 0.0)
            inverse[irregular] = (upright[:, :, :count] * upside[:, None]) @ left[:, :, :count].swapaxes(1, 2)
            stresses, free = (_onto_not_kept(vectors, keep) for vectors in (left, upright))
            if stresses.any():
                stress = np.zeros((n, rows, rows))
                stress[irregular] = stresses
            if free.any():
                lost = np.zeros((n, path.shape[1], path.shape[1]))
                lost[irregular] = _onto_range(along[irregular] @ free @ along[irregular].swapaxes(1, 2))
        return _Statics(
            inverse / norm.swapaxes(1, 2), inverse.swapaxes(1, 2) @ along.swapaxes(1, 2), stress, lost, margin
        )


def _onto_not_kept(vectors: Floats, keep: Flags) -> Floats:
    """Projector onto the singular vectors (columns) whose values are not kept; exactly zero where all are."""
    n, size, _ = vectors.shape
    not_kept = np.ones((n, size), dtype=bool)
    not_kept[:, : keep.shape[1]] = ~keep
    chosen = vectors * not_kept[:, None]
    return np.asarray(chosen @ chosen.swapaxes(1, 2))


def _onto_range(matrix: Floats) -> Floats:
    """Projector onto the range of symmetric matrices whose entries are of order one."""
    values, vectors = np.linalg.eigh(matrix)
    kept = vectors * (values > RANK**2)[:, None]
    return np.asarray(kept @ kept.swapaxes(1, 2))


def _least_energy(
    statics: _Statics, loops: Floats, path: Floats, compliance: Floats
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """Forces in the elastic joints under unit loads, shape (n, joints, size), and the loops' wrenches.

    The third result projects onto the states of self-stress that store no energy, shape (n, loops, loops).
    """
    stress = statics.particular
    on_path, around = path.swapaxes(1, 2), loops.swapaxes(1, 2)
    bears = on_path - around @ stress
    # Where the loads and the loop wrenches cancel but for rounding, a joint bears exactly nothing, so that rigid
    # directions are exactly rigid.
    largest = np.abs(stress).max(axis=(1, 2), keepdims=True, initial=0.0)
    bears[np.abs(bears) <= RIGID * (np.abs(on_path) + np.abs(around).sum(axis=2, keepdims=True) * largest)] = 0.0
    if statics.stress is None:
        return bears, stress, np.zeros((len(loops), loops.shape[1], loops.shape[1]))
    weighted = statics.stress @ loops
    energy = (weighted * compliance[:, None]) @ weighted.swapaxes(1, 2)
    values, vectors = np.linalg.eigh((energy + energy.swapaxes(1, 2)) / 2)
    most = STORED * ((loops**2).sum(axis=1) * compliance).max(axis=1, initial=0.0)
    kept = values > np.maximum(SELF_STRESS * values[:, -1:], most[:, None])
    upright = vectors.swapaxes(1, 2)
    inverse = (vectors * np.where(kept, 1 / np.where(kept, values, 1.0), 0.0)[:, None]) @ upright
    rigid = statics.stress - (vectors * kept[:, None]) @ upright
    self_stress = statics.stress @ inverse @ (weighted @ (compliance[:, :, None] * bears))
    return bears - loops.swapaxes(1, 2) @ self_stress, stress + self_stress, rigid


def _held(compliance: Floats, statics: _Statics, length: Value, size: int) -> Held:
    """Compliance where the body is held, stiffness where it is not rigid, and the free twist, all unscaled."""
    n = len(compliance)
    lost = statics.lost if statics.lost is not None else np.zeros((n, size, size))
    freedom = np.rint(np.trace(lost, axis1=1, axis2=2)).astype(np.intp)
    stiffness = np.full(compliance.shape, np.nan)
    twist = np.full((n, size), np.nan)
    # The last eigenvectors span the free displacements, the others those that are held.
    _, axes = np.linalg.eigh(lost)
    for count, rows in poses_by(freedom):
        basis = axes[rows][:, :, : size - count]
        inner = basis.swapaxes(1, 2) @ compliance[rows] @ basis
        inverse = stiffness_of(inner)
        soft = np.isfinite(inverse).all(axis=(1, 2))
        # Where the body is rigid in some direction, entries of the compliance that are only rounding become zero.
        stiff = rows[~soft]
        largest = np.abs(compliance[stiff]).max(axis=(1, 2), keepdims=True, initial=0.0)
        compliance[stiff] = np.where(np.abs(compliance[stiff]) > RIGID * largest, compliance[stiff], 0.0)
        stiffness[rows[soft]] = basis[soft] @ inverse[soft] @ basis[soft].swapaxes(1, 2)
        if count:
            compliance[rows] = np.nan
            twist[rows] = axes[rows][:, :, -1]
    scale = scales(length, n, size)
    outer = scale[:, :, None] * scale[:, None]
    twist = np.where(np.abs(twist) > RANK, twist, 0.0 * twist) * scale
    if size == 3:
        with np.errstate(divide="ignore", invalid="ignore"):
            twist = np.where(twist[:, 2:] != 0, twist / twist[:, 2:], twist)
    return Held(stiffness / outer, compliance * outer, size - freedom, twist, statics.margin)


@dataclass(frozen=True, eq=False)
class Effects:
    """Effects of loads in n poses.

    Parameters
    ----------
    forces : ndarray, shape (n, joints, loads, 3)
        Force and moment about the joint's place, exerted on the first body by the second; joints as in `joints_of`.
    places : complex ndarray, shape (n, points)
        Places without a load of the points that `points_of` lists.
    moves : complex ndarray, shape (n, points, loads)
        Displacements of these points.
    """

    forces: Floats
    places: Complexes
    moves: Complexes

    @staticmethod
    def unknown(network: Network, poses: int, loads: int) -> Effects:
        """A record of effects to be filled, all nan."""
        nowhere = np.full((poses, len(points_of(network)), loads), complex(np.nan, np.nan))
        return Effects(np.full((poses, len(joints_of(network)), loads, 3), np.nan), nowhere[:, :, 0].copy(), nowhere)


def joints_of(network: Network) -> list[int]:
    """Numbers of the network's edges that are joints, not beams."""
    return [k for k, edge in enumerate(network.edges) if not edge.beam]


def points_of(network: Network) -> list[tuple[str, str, str]]:
    """Link, point and vertex of every point of the moving links."""
    return [(link, point, vertex) for link, points in network.points.items() for point, vertex in points]


def effects_of(network: Network, loaded: Loaded, at: str, configuration: Configuration, loads: Floats) -> Effects:
    """Effects of each load (fx, fy, mz) in a batch of poses; `loads` of shape (n, loads, 3)."""
    size = loaded.wrenches.shape[3]
    applied = loads[:, :, :size].swapaxes(1, 2)
    origin = configuration.point(at)
    effects = Effects.unknown(network, *loads.shape[:2])
    for row, k in enumerate(joints_of(network)):
        wrench = loaded.wrenches[:, k] @ applied
        arm = (configuration.point(network.edges[k].point) - origin)[:, None]
        moment = wrench[:, 2] - (arm.real * wrench[:, 1] - arm.imag * wrench[:, 0])
        effects.forces[:, row] = np.stack([wrench[:, 0], wrench[:, 1], moment], axis=-1)
    for row, (_, point, vertex) in enumerate(points_of(network)):
        dx, dy, turn = np.moveaxis(loaded.displacements[vertex] @ applied, 1, 0)
        effects.places[:, row] = configuration.point(point)
        effects.moves[:, row] = dx + 1j * dy + 1j * turn * (effects.places[:, row] - origin)[:, None]
    return effects
