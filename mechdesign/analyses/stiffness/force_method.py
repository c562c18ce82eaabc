"""How a network of joints and beams holds one of its bodies: forces first, then what they deform.

With the free joints' twists A_p and the elastic ones' A_e around all loops, B_p and B_e on the way to the asked body, a
load w is in equilibrium with loop wrenches l where

    A_p^T l = B_p^T w,

elastic joints then bear F = B_e^T w - A_e^T l, and by the principle of virtual forces the compliance is F^T C F. Where
equilibrium leaves wrenches open (states of self-stress), those of least energy are the ones that close the loops. No
compliance is inverted: what is rigid is zero in C. [Argyris & Kelsey, Energy Theorems and Structural Analysis, 1960;
Davies, Circuit actions attributable to active couplings, 1995]
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from mechdesign.analyses.stiffness.compliance import REGULAR, Held, inverses, moved_to, poses_by, scales, stiffness_of
from mechdesign.analyses.stiffness.elements import bending, course_of, freedoms, looked_at_from
from mechdesign.analyses.stiffness.network import Network
from mechdesign.analyses.stiffness.screws import RANK, RIGID
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import Value
from mechdesign.numerics.arrays import Complexes, Flags, Floats
from mechdesign.study.schema.stiffness import StiffnessSection

# Of states of self-stress, those with less than this share of the largest one's energy are rounding: rigid.
SELF_STRESS = 1e-13
# All of them are rounding below this share (squared rounding) of the energy that wrenches of the loops could store.
STORED = 1e-26


@dataclass(frozen=True, eq=False)
class Twists:
    """Freedoms of a network in n poses, with rotations scaled to lengths by `length`.

    Parameters
    ----------
    twist : ndarray, shape (n, 3, freedoms)
        Seen from the asked point, or from the middle of the joints where that is far away.
    compliance : ndarray, shape (n, freedoms)
        0 of free joints, which `free` marks.
    within : ndarray, shape (n or 1, edges, freedoms)
        1 where a freedom is a part of an edge, else 0. Ways along the beams of one link share theirs, as far as they
        go together in each pose.
    arm : complex ndarray, shape (n,)
        From where the twists are seen to the asked point.
    length : float or ndarray, shape (n,)
        What a radian counts as.
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
        """Factors of wrenches, of which the twists and loads are scaled ones, shape (n, 3)."""
        return scales(self.length, len(self.twist))


@dataclass(frozen=True, eq=False)
class Loaded:
    """A body held by a network in n poses, and what unit loads at it do; nan where the body is not held.

    Parameters
    ----------
    stress : ndarray, shape (n, 3 loops, size)
        Wrenches of the loops under scaled unit loads.
    shift : ndarray, shape (n, freedoms, size)
        Displacements in all freedoms under the same.
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
        # The load's where the edge is on its way, less the loops'.
        through = onward[:, None, None] * np.eye(3)[:, :size] - np.einsum("le,nlis->neis", around, stress)
        scale = self.twists.scale
        plain = through / scale[:, None, :, None] * scale[:, None, None, :size]
        back = moved_to(-self.twists.arm).swapaxes(1, 2)
        return np.asarray(back[:, None] @ plain @ self._loads[:, None])

    @cached_property
    def displacements(self) -> dict[str, Floats]:
        """Twist of each vertex about the asked point, a column for each unit load, shape (n, 3, size)."""
        twists, size = self.twists, self.stress.shape[2]
        scale = twists.scale
        there, shift = moved_to(twists.arm) * scale[:, None], (self.shift * scale[:, None, :size]) @ self._loads
        found = {}
        for vertex, path in twists.network.paths.items():
            signs = twists.network.signs(path) @ twists.within
            on = np.flatnonzero(signs.any(axis=0))
            found[vertex] = there @ ((signs[:, None, on] * twists.twist[:, :, on]) @ shift[:, on])
        return found

    @property
    def _loads(self) -> Floats:
        """Loads at the asked point as loads where the twists are seen from, shape (n, size, size)."""
        size = self.stress.shape[2]
        return moved_to(self.twists.arm).swapaxes(1, 2)[:, :size, :size]


def twists_of(network: Network, section: StiffnessSection, configuration: Configuration, length: Value) -> Twists:
    """Freedoms of all edges, with rotations counted as lengths by `length`, one or one a pose."""
    at, n = configuration.point(section.at), configuration.shape[0]
    joints = [edge.point for edge in network.edges]
    origin = at if section.link is None else looked_at_from(joints, at, configuration, length)
    found = [(np.eye(len(network.edges))[k][:, None], *each) for k, edge in enumerate(network.edges) if not edge.beam
             for each in freedoms(edge.elements, section, configuration, origin)]  # fmt: skip
    for ways in network.ways_along_beams:
        found += _beam_freedoms(network, ways, section, configuration, origin)
    twist = np.zeros((n, 3, len(found)))
    compliance = np.zeros((n, len(found)))
    within = np.zeros((max((edges.shape[1] for edges, *_ in found), default=1), len(network.edges), len(found)))
    for j, (edges, each, soft) in enumerate(found):
        within[:, :, j] = edges.T
        twist[:, :, j] = np.broadcast_to(each, (3, n)).T
        if soft is not None:
            compliance[:, j] = soft
    twist[:, 2] *= np.reshape(length, (-1, 1))
    free = np.array([soft is None for *_, soft in found], dtype=bool)
    return Twists(network, twist, compliance, free, within, at - origin, length)


def _beam_freedoms(
    network: Network, ways: Sequence[int], section: StiffnessSection, configuration: Configuration,
    origin: Complexes,
) -> Iterator[tuple[Floats, Floats, Value]]:  # fmt: skip
    """Of the beams of one link, cut wherever something sits: edges (edges, n) that go over a part, twist, compliance.

    What slides changes its order along the beams from pose to pose: the parts are sorted in each.
    """
    beams = [beam for k in ways if (beam := network.edges[k].beam)]
    course = course_of(beams[0].link, configuration)
    feet = np.array([course.foot(beam.head, configuration.point(beam.head)) for beam in beams])
    cuts = np.sort(np.concatenate([np.zeros((1, feet.shape[1])), feet]), axis=0)
    for low, high in pairwise(cuts):
        over = np.zeros((len(network.edges), feet.shape[1]))
        over[list(ways)] = feet > low
        if (over == over[:, :1]).all():
            over = over[:, :1]
        for twist, compliance in bending(course, low, high, section.sections[beams[0].section], origin):
            yield over, twist, compliance


def load(twists: Twists, size: int) -> Loaded:
    """Stiffness and compliance, and what bears and moves under unit loads, of a body or (`size` 2) a pin."""
    n, (around, onward) = len(twists.twist), _ways(twists.network)

    def of(chosen: Flags) -> tuple[Floats, Floats]:
        within, twist = twists.within[:, :, chosen], twists.twist[:, :, chosen]
        loops = (around @ within)[:, :, None] * twist[:, None]
        return loops.reshape(n, 3 * len(around), twist.shape[2]), (onward @ within)[:, None] * twist[:, :size]

    compliance = twists.compliance[:, ~twists.free]
    statics = _Statics.of(*of(twists.free))
    loops, way = of(~twists.free)
    bears, stress = _least_energy(statics, loops, way, compliance)
    strain = compliance[:, :, None] * bears
    total = bears.swapaxes(1, 2) @ strain
    shift = np.zeros((n, len(twists.free), size))
    shift[:, ~twists.free] = strain
    shift[:, twists.free] = -statics.inverse @ (loops @ strain)
    held = _held((total + total.swapaxes(1, 2)) / 2, statics, twists.length, size)
    stress[held.rank < size], shift[held.rank < size] = np.nan, np.nan
    return Loaded(held.seen_from(twists.arm), twists, stress, shift)


def _ways(network: Network) -> tuple[Floats, Floats]:
    """Signs of the edges around each loop, shape (loops, edges), and on the way to the asked body, shape (edges,)."""
    loops = np.array([network.signs(loop) for loop in network.loops]).reshape(-1, len(network.edges))
    return loops, network.signs(network.paths[network.asked])


@dataclass(frozen=True, eq=False)
class _Statics:
    """Equilibrium of the free joints.

    Parameters
    ----------
    inverse : ndarray, shape (n, freedoms, loops)
        Pseudo-inverse of the loops' matrix: motions of the free joints that close gaps in the loops.
    particular : ndarray, shape (n, loops, size)
        Loop wrenches of each unit load.
    stress : ndarray, shape (n, loops, loops), or None
        Projector onto the states of self-stress; None where there are none in any pose.
    lost : ndarray, shape (n, size, size), or None
        Projector onto the asked body's free displacements; None likewise.
    margin : ndarray, shape (n,)
        Smallest singular value (of unit columns) that is not lost; infinite where not needed.
    """

    inverse: Floats
    particular: Floats
    stress: Floats | None
    lost: Floats | None
    margin: Floats

    @staticmethod
    def of(loops: Floats, way: Floats) -> _Statics:
        """Square and regular matrices are inverted; the others go through singular values."""
        norm = np.sqrt((loops**2).sum(axis=1) + (way**2).sum(axis=1))
        norm = np.where(norm > 0, norm, 1.0)[:, None]
        unit, along = loops / norm, way / norm
        n, rows, columns = unit.shape
        inverse, regular = np.zeros((n, columns, rows)), np.zeros(n, dtype=bool)
        if rows == columns:
            inverse, regular = inverses(unit, REGULAR)
        margin, stress, lost = np.full(n, np.inf), None, None
        rest = np.flatnonzero(~regular)
        if len(rest):
            left, values, right = np.linalg.svd(unit[rest])
            keep = values > RANK
            margin[rest] = np.where(keep, values, np.inf).min(axis=1, initial=np.inf)
            upright, count = right.swapaxes(1, 2), values.shape[1]
            upside = np.where(keep, 1 / np.where(keep, values, 1.0), 0.0)
            inverse[rest] = (upright[:, :, :count] * upside[:, None]) @ left[:, :, :count].swapaxes(1, 2)
            stresses, idle = (_unkept(vectors, keep) for vectors in (left, upright))
            if stresses.any():
                stress = np.zeros((n, rows, rows))
                stress[rest] = stresses
            if idle.any():
                lost = np.zeros((n, way.shape[1], way.shape[1]))
                lost[rest] = _onto(along[rest] @ idle @ along[rest].swapaxes(1, 2))
        return _Statics(
            inverse / norm.swapaxes(1, 2), inverse.swapaxes(1, 2) @ along.swapaxes(1, 2), stress, lost, margin
        )


def _unkept(vectors: Floats, keep: Flags) -> Floats:
    """Projector onto the singular vectors (columns) that are not kept; exactly zero where all are."""
    n, size, _ = vectors.shape
    others = np.ones((n, size), dtype=bool)
    others[:, : keep.shape[1]] = ~keep
    chosen = vectors * others[:, None]
    return np.asarray(chosen @ chosen.swapaxes(1, 2))


def _onto(matrix: Floats) -> Floats:
    """Projector onto the range of symmetric matrices of order one."""
    values, vectors = np.linalg.eigh(matrix)
    kept = vectors * (values > RANK**2)[:, None]
    return np.asarray(kept @ kept.swapaxes(1, 2))


def _least_energy(statics: _Statics, loops: Floats, way: Floats, compliance: Floats) -> tuple[Floats, Floats]:
    """What elastic joints bear under unit loads, shape (n, joints, size), and the loops' wrenches."""
    stress = statics.particular
    onward, around = way.swapaxes(1, 2), loops.swapaxes(1, 2)
    bears = onward - around @ stress
    # What loads and loops together do not load bears nothing, but for rounding: rigid is rigid exactly.
    largest = np.abs(stress).max(axis=(1, 2), keepdims=True, initial=0.0)
    bears[np.abs(bears) <= RIGID * (np.abs(onward) + np.abs(around).sum(axis=2, keepdims=True) * largest)] = 0.0
    if statics.stress is None:
        return bears, stress
    weighted = statics.stress @ loops
    energy = (weighted * compliance[:, None]) @ weighted.swapaxes(1, 2)
    values, vectors = np.linalg.eigh((energy + energy.swapaxes(1, 2)) / 2)
    most = STORED * ((loops**2).sum(axis=1) * compliance).max(axis=1, initial=0.0)
    kept = values > np.maximum(SELF_STRESS * values[:, -1:], most[:, None])
    inverse = (vectors * np.where(kept, 1 / np.where(kept, values, 1.0), 0.0)[:, None]) @ vectors.swapaxes(1, 2)
    more = statics.stress @ inverse @ (weighted @ (compliance[:, :, None] * bears))
    return bears - loops.swapaxes(1, 2) @ more, stress + more


def _held(compliance: Floats, statics: _Statics, length: Value, size: int) -> Held:
    """Compliance where the body is held, stiffness where it is not rigid, and what is free, unscaled."""
    n = len(compliance)
    lost = statics.lost if statics.lost is not None else np.zeros((n, size, size))
    freedom = np.rint(np.trace(lost, axis1=1, axis2=2)).astype(np.intp)
    stiffness = np.full(compliance.shape, np.nan)
    twist = np.full((n, size), np.nan)
    # Of the displacements that are not free: an orthonormal basis.
    _, axes = np.linalg.eigh(lost)
    for count, rows in poses_by(freedom):
        basis = axes[rows][:, :, : size - count]
        inner = basis.swapaxes(1, 2) @ compliance[rows] @ basis
        inverse = stiffness_of(inner)
        soft = np.isfinite(inverse).all(axis=(1, 2))
        # What is rigid in some direction is so in a corner of the matrix: rounding there is no softness.
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
        Force and moment about the joint's place, on the first body by the second, in the order of `joints_of`.
    places : complex ndarray, shape (n, points)
        Where the points that `points_of` names are without a load.
    moves : complex ndarray, shape (n, points, loads)
        Their displacements.
    """

    forces: Floats
    places: Complexes
    moves: Complexes

    @staticmethod
    def unknown(network: Network, poses: int, loads: int) -> Effects:
        """Room for effects, all nan."""
        nowhere = np.full((poses, len(points_of(network)), loads), complex(np.nan, np.nan))
        return Effects(np.full((poses, len(joints_of(network)), loads, 3), np.nan), nowhere[:, :, 0].copy(), nowhere)


def joints_of(network: Network) -> list[int]:
    """Edges of the network that are joints, not beams, and bear something."""
    return [k for k, edge in enumerate(network.edges) if not edge.beam]


def points_of(network: Network) -> list[tuple[str, str, str]]:
    """Link, point and vertex of every point of the moving links."""
    return [(link, point, vertex) for link, points in network.points.items() for point, vertex in points]


def effects_of(network: Network, loaded: Loaded, at: str, configuration: Configuration, loads: Floats) -> Effects:
    """What each load (fx, fy, mz) does in a batch of poses; `loads` of shape (n, loads, 3)."""
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
