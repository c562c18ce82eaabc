"""What loads do to a network: forces in its joints, and displacements of all points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.mechanism import Configuration
from mechdesign.questions.stiffness.force_method import Loaded, moments_about
from mechdesign.questions.stiffness.network import Network


@dataclass(frozen=True, eq=False)
class Effects:
    """Effects of loads in n poses.

    Parameters
    ----------
    forces : ndarray, shape (n, joints, loads, 3)
        Force and moment about the joint's place, exerted on the first body by the second; joints as in `joints_of`, and
        after them the teeth, belts and cams of couplings, whose moment is 0.
    places : complex ndarray, shape (n, points)
        Places without a load of the points that `points_of` lists.
    moves : complex ndarray, shape (n, points, loads)
        Displacements of these points.
    moved : ndarray, shape (n, loads, size)
        Displacement of the asked point beyond its compliance times the load on it: by loads elsewhere, and because the
        flanks of teeth that a load presses are not all of them.
    """

    forces: Floats
    places: Complexes
    moves: Complexes
    moved: Floats

    @staticmethod
    def unknown(network: Network, poses: int, loads: int, size: int) -> Effects:
        """A record of effects to be filled, all nan."""
        nowhere = np.full((poses, len(points_of(network)), loads), complex(np.nan, np.nan))
        count = len(joints_of(network)) + sum(network.pressing)
        forces, moved = np.full((poses, count, loads, 3), np.nan), np.zeros((poses, loads, size))
        return Effects(forces, nowhere[:, :, 0].copy(), nowhere, moved)

    @staticmethod
    def joined(parts: Sequence[Effects]) -> Effects:
        """The effects of all loads from those of some of them each, in order."""
        forces = np.concatenate([part.forces for part in parts], axis=2)
        moves = np.concatenate([part.moves for part in parts], axis=2)
        return Effects(forces, parts[0].places, moves, np.concatenate([part.moved for part in parts], axis=1))


def joints_of(network: Network) -> list[int]:
    """Numbers of the network's edges that are joints, not beams."""
    return [k for k, edge in enumerate(network.edges) if not edge.beam]


def points_of(network: Network) -> list[tuple[str, str, str]]:
    """Link, point and vertex of every point of the moving links."""
    return [(link, point, vertex) for link, points in network.points.items() for point, vertex in points]


def effects_of(
    network: Network, loaded: Loaded, at: str, configuration: Configuration, applied: Floats, soft: Floats
) -> Effects:  # fmt: skip
    """Effects of loads in a batch of poses, each a sum of those of `Loaded`, shape (n, its loads, loads).

    `soft` is the compliance of the asked body or pin in general.
    """
    size = loaded.size
    origin = configuration.point(at)
    effects = Effects.unknown(network, len(applied), applied.shape[2], size)
    joints, couplings = joints_of(network), loaded.twists.couplings
    for row, k in enumerate(joints):
        wrench = loaded.wrenches[:, k] @ applied
        moment = moments_about(configuration.point(network.edges[k].point) - origin, wrench)
        effects.forces[:, row] = np.stack([wrench[:, 0], wrench[:, 1], moment], axis=-1)
    if couplings is not None:
        teeth = (couplings.teeth[:, :, None] * (loaded.efforts @ applied))[:, network.pressing]
        effects.forces[:, len(joints) :] = np.stack([teeth.real, teeth.imag, np.zeros(teeth.shape)], axis=-1)
    for row, (_, point, vertex) in enumerate(points_of(network)):
        dx, dy, turn = np.moveaxis(loaded.displacements[vertex] @ applied, 1, 0)
        effects.places[:, row] = configuration.point(point)
        effects.moves[:, row] = dx + 1j * dy + 1j * turn * (effects.places[:, row] - origin)[:, None]
    others = loaded.displacements[network.target][:, :size, size:] @ applied[:, size:]
    own = (loaded.held.compliance - soft) @ applied[:, :size]
    effects.moved[:] = (others + own).swapaxes(1, 2)
    return effects
