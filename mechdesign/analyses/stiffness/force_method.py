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

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.stiffness.chains import freedoms
from mechdesign.analyses.stiffness.compliance import Held
from mechdesign.analyses.stiffness.network import Network
from mechdesign.analyses.stiffness.screws import RANK, RIGID, Array
from mechdesign.mechanism import Configuration
from mechdesign.study.stiffness_models import StiffnessSection

# Of states of self-stress, those with less than this share of the largest compliance are rounding: rigid.
SELF_STRESS = 1e-13


@dataclass(frozen=True, eq=False)
class Loaded:
    """A body held by a network in n poses, and what unit loads at it do. Loads and displacements are plain, not scaled.

    Parameters
    ----------
    held : Held
    wrenches : ndarray, shape (n, edges, 3, size)
        Wrench that each edge bears, about the asked point, a column for each unit load.
    displacements : mapping of str to ndarray, shape (n, 3, size)
        Twist of each vertex about the asked point, a column for each unit load; nan where the body is not held.
    """

    held: Held
    wrenches: Array
    displacements: dict[str, Array]


@dataclass(frozen=True, eq=False)
class Twists:
    """Freedoms of a network in n poses, with rotations scaled to lengths.

    Parameters
    ----------
    twist : ndarray, shape (n, 3, freedoms)
    compliance : ndarray, shape (n, freedoms)
        0 of free joints, which `free` marks.
    edge : ndarray of int, shape (freedoms,)
    """

    twist: Array
    compliance: Array
    free: NDArray[np.bool_]
    edge: NDArray[np.intp]


def twists_of(network: Network, section: StiffnessSection, configuration: Configuration, length: float) -> Twists:
    """Freedoms of all edges, seen from the asked point."""
    at, n = configuration.point(section.at), configuration.shape[0]
    found = [(k, *each) for k, edge in enumerate(network.edges)
             for each in freedoms(edge.elements, section, configuration, at)]  # fmt: skip
    twist = np.zeros((n, 3, len(found)))
    compliance = np.zeros((n, len(found)))
    for j, (_, each, soft) in enumerate(found):
        twist[:, :, j] = np.broadcast_to(each, (3, n)).T
        if soft is not None:
            compliance[:, j] = soft
    twist[:, 2] *= length
    return Twists(
        twist, compliance, np.array([soft is None for *_, soft in found], dtype=bool),
        np.array([k for k, *_ in found], dtype=np.intp),
    )  # fmt: skip


def load(network: Network, twists: Twists, length: float, size: int) -> Loaded:
    """Stiffness, compliance, joint wrenches and displacements of all vertices.

    Parameters
    ----------
    size : int
        3 for a body, 2 for a pin, which bears no moment.
    """
    n = len(twists.twist)
    around = np.array([network.signs(loop) for loop in network.loops]).reshape(-1, len(network.edges))
    onward = network.signs(network.paths[network.asked])
    loops = (around[:, twists.edge][:, None] * twists.twist[:, None]).reshape(n, -1, len(twists.edge))
    way = onward[twists.edge] * twists.twist[:, :size]
    free, soft = twists.free, ~twists.free
    compliance = twists.compliance[:, soft]
    statics = _Statics.of(loops[:, :, free], way[:, :, free])
    bears, stress = _least_energy(statics, loops[:, :, soft], way[:, :, soft], compliance)
    strain = compliance[:, :, None] * bears
    total = bears.swapaxes(1, 2) @ strain
    held = _held((total + total.swapaxes(1, 2)) / 2, statics, length, size)
    scale = np.array([1.0, 1.0, 1.0 / length])
    # Wrenches through edges: the load's where it is on the way, less the loops'.
    loads = np.eye(3)[:, :size]
    through = onward[:, None, None] * loads - np.einsum(
        "le,nlis->neis", around, stress.reshape(n, len(around), 3, size)
    )
    shift = np.zeros((n, len(twists.edge), size))
    shift[:, soft] = strain
    shift[:, free] = statics.motion(-loops[:, :, soft] @ strain)
    # What is not held has no answer to a load.
    shift[held.rank < size] = np.nan
    through[held.rank < size] = np.nan
    outer = scale[:size]
    displacements = {
        vertex: (network.signs(path)[twists.edge] * twists.twist) @ shift * scale[:, None] * outer
        for vertex, path in network.paths.items()
    }
    return Loaded(held, through / scale[:, None] * outer, displacements)


@dataclass(frozen=True, eq=False)
class _Statics:
    """Equilibrium of the free joints.

    Parameters
    ----------
    inverse : ndarray, shape (n, freedoms, loops)
        Pseudo-inverse of the loops' matrix.
    particular : ndarray, shape (n, loops, size)
        Loop wrenches of each unit load.
    stress : ndarray, shape (n, loops, loops)
        Projector onto the states of self-stress.
    lost : ndarray, shape (n, size, size)
        Projector onto the asked body's free displacements.
    margin : ndarray, shape (n,)
        Smallest singular value that is not lost.
    """

    inverse: Array
    particular: Array
    stress: Array
    lost: Array
    margin: Array

    @staticmethod
    def of(loops: Array, way: Array) -> _Statics:
        norm = np.sqrt((loops**2).sum(axis=1) + (way**2).sum(axis=1))
        norm = np.where(norm > 0, norm, 1.0)[:, None]
        unit, along = loops / norm, way / norm
        left, values, right = np.linalg.svd(unit)
        keep = values > RANK
        smallest = np.where(keep, values, np.inf).min(axis=1, initial=np.inf)
        upright, count = right.swapaxes(1, 2), values.shape[1]
        inverses = np.where(keep, 1 / np.where(keep, values, 1.0), 0.0)
        inverse = (upright[:, :, :count] * inverses[:, None]) @ left[:, :, :count].swapaxes(1, 2)
        stress, idle = (_unkept(vectors, keep) for vectors in (left, upright))
        return _Statics(
            inverse / norm.swapaxes(1, 2), inverse.swapaxes(1, 2) @ along.swapaxes(1, 2), stress,
            _onto(along @ idle @ along.swapaxes(1, 2)), smallest,
        )  # fmt: skip

    def motion(self, gaps: Array) -> Array:
        """Displacements of the free joints that close gaps in the loops, shape (n, freedoms, size)."""
        return np.asarray(self.inverse @ gaps)


def _unkept(vectors: Array, keep: NDArray[np.bool_]) -> Array:
    """Projector onto the singular vectors (columns) that are not kept; exactly zero where all are."""
    n, size, _ = vectors.shape
    others = np.ones((n, size), dtype=bool)
    others[:, : keep.shape[1]] = ~keep
    chosen = vectors * others[:, None]
    return np.asarray(chosen @ chosen.swapaxes(1, 2))


def _onto(matrix: Array) -> Array:
    """Projector onto the range of symmetric matrices of order one."""
    values, vectors = np.linalg.eigh(matrix)
    kept = vectors * (values > RANK**2)[:, None]
    return np.asarray(kept @ kept.swapaxes(1, 2))


def _least_energy(statics: _Statics, loops: Array, way: Array, compliance: Array) -> tuple[Array, Array]:
    """What elastic joints bear under unit loads, shape (n, joints, size), and the loops' wrenches."""
    stress = statics.particular
    onward, around = way.swapaxes(1, 2), loops.swapaxes(1, 2)
    bears = onward - around @ stress
    # What loads and loops together do not load bears nothing, but for rounding: rigid is rigid exactly.
    largest = np.abs(stress).max(axis=(1, 2), keepdims=True, initial=0.0)
    bears[np.abs(bears) <= RIGID * (np.abs(onward) + np.abs(around).sum(axis=2, keepdims=True) * largest)] = 0.0
    if not statics.stress.any():
        return bears, stress
    weighted = statics.stress @ loops
    energy = (weighted * compliance[:, None]) @ weighted.swapaxes(1, 2)
    values, vectors = np.linalg.eigh((energy + energy.swapaxes(1, 2)) / 2)
    kept = values > SELF_STRESS * values[:, -1:]
    inverse = (vectors * np.where(kept, 1 / np.where(kept, values, 1.0), 0.0)[:, None]) @ vectors.swapaxes(1, 2)
    more = statics.stress @ inverse @ (weighted @ (compliance[:, :, None] * bears))
    return bears - loops.swapaxes(1, 2) @ more, stress + more


def _held(compliance: Array, statics: _Statics, length: float, size: int) -> Held:
    """Compliance where the body is held, stiffness where it is not rigid, and what is free, unscaled."""
    n = len(compliance)
    freedom = np.rint(np.trace(statics.lost, axis1=1, axis2=2)).astype(np.intp)
    stiffness = np.full(compliance.shape, np.nan)
    twist = np.full((n, size), np.nan)
    # Of the displacements that are not free: an orthonormal basis.
    _, axes = np.linalg.eigh(statics.lost)
    for count, rows in _by(freedom):
        basis = axes[rows][:, :, : size - count]
        inner = basis.swapaxes(1, 2) @ compliance[rows] @ basis
        values, vectors = np.linalg.eigh(inner)
        soft = (values > RIGID * values[:, -1:]).all(axis=1) & (values > 0).all(axis=1)
        # What is rigid in some direction is so in a corner of the matrix: rounding there is no softness.
        stiff = rows[~soft]
        largest = np.abs(compliance[stiff]).max(axis=(1, 2), keepdims=True, initial=0.0)
        compliance[stiff] = np.where(np.abs(compliance[stiff]) > RIGID * largest, compliance[stiff], 0.0)
        turned = basis[soft] @ vectors[soft]
        stiffness[rows[soft]] = (turned / values[soft][:, None]) @ turned.swapaxes(1, 2)
        if count:
            compliance[rows] = np.nan
            twist[rows] = axes[rows][:, :, -1]
    scale = np.array([1.0, 1.0, 1.0 / length])[:size]
    outer = np.outer(scale, scale)
    twist = np.where(np.abs(twist) > RANK, twist, 0.0 * twist) * scale
    if size == 3:
        with np.errstate(divide="ignore", invalid="ignore"):
            twist = np.where(twist[:, 2:] != 0, twist / twist[:, 2:], twist)
    return Held(stiffness / outer, compliance * outer, size - freedom, twist, statics.margin)


def _by(values: NDArray[np.intp]) -> Iterator[tuple[int, NDArray[np.intp]]]:
    for value in np.unique(values):
        yield int(value), np.flatnonzero(values == value)
