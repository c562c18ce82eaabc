"""What loads at the asked point do to the whole mechanism: displacements of all points, forces in all joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.stiffness.force_method import Loaded
from mechdesign.analyses.stiffness.network import Network
from mechdesign.mechanism import Configuration
from mechdesign.numerics.arrays import Complexes, Floats


@dataclass(frozen=True, eq=False)
class Effects:
    """Effects of loads in n poses.

    Parameters
    ----------
    forces : ndarray, shape (n, joints, loads, 3)
        Force and moment about the joint's place, on the first body by the second, in the order of `joints_of`.
    twists : ndarray, shape (n, vertices, 3, loads)
        How the vertices of `Network.paths` shift and turn, about the asked point.
    places : complex ndarray, shape (n, points)
        Where the points that `points_of` names are without a load.
    origin : complex ndarray, shape (n,)
        Where the asked point is.
    """

    forces: Floats
    twists: Floats
    places: Complexes
    origin: Complexes

    @staticmethod
    def unknown(network: Network, poses: int, loads: int) -> Effects:
        """Room for effects, all nan."""
        joints, points = len(joints_of(network)), len(points_of(network))
        return Effects(
            np.full((poses, joints, loads, 3), np.nan),
            np.full((poses, len(network.paths), 3, loads), np.nan),
            np.full((poses, points), complex(np.nan, np.nan)),
            np.full(poses, complex(np.nan, np.nan)),
        )

    def moved(self, network: Network) -> Complexes:
        """Displacements of the points that `points_of` names, shape (n, points, loads)."""
        vertices = list(network.paths)
        dx, dy, turn = np.moveaxis(self.twists[:, [vertices.index(v) for _, _, v in points_of(network)]], 2, 0)
        return np.asarray(dx + 1j * dy + 1j * turn * (self.places - self.origin[:, None])[:, :, None])


def joints_of(network: Network) -> list[int]:
    """Edges of the network that are joints, not beams, and bear something."""
    return [k for k, edge in enumerate(network.edges) if not edge.beam]


def points_of(network: Network) -> list[tuple[str, str, str]]:
    """Link, point and vertex of every point of the moving links."""
    return [(link, point, vertex) for link, points in network.points.items() for point, vertex in points]


def effects_of(
    network: Network, loaded: Loaded, at: str, configuration: Configuration, loads: tuple[tuple[float, ...], ...]
) -> Effects:
    """What each load (fx, fy, mz) does in a batch of poses."""
    size = loaded.wrenches.shape[3]
    applied = np.array(loads)[:, :size].T
    origin = configuration.point(at)
    effects = Effects.unknown(network, len(origin), len(loads))
    effects.origin[:] = origin
    for row, k in enumerate(joints_of(network)):
        wrench = loaded.wrenches[:, k] @ applied
        arm = (configuration.point(network.edges[k].point) - origin)[:, None]
        moment = wrench[:, 2] - (arm.real * wrench[:, 1] - arm.imag * wrench[:, 0])
        effects.forces[:, row] = np.stack([wrench[:, 0], wrench[:, 1], moment], axis=-1)
    for row, vertex in enumerate(network.paths):
        effects.twists[:, row] = loaded.displacements[vertex] @ applied
    for row, (_, point, _) in enumerate(points_of(network)):
        effects.places[:, row] = configuration.point(point)
    return effects
