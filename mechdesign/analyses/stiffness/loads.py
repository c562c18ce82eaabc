"""What loads at the asked point do to the whole mechanism: displacements of all points, forces in all joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.poses import pose_columns
from mechdesign.analyses.stiffness.force_method import Loaded
from mechdesign.analyses.stiffness.network import Network
from mechdesign.mechanism import Configuration
from mechdesign.numerics.arrays import Complexes, Floats, Ints
from mechdesign.results import Column, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses


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

    def put(self, rows: Ints, part: Effects) -> None:
        """Fill in some poses."""
        for name, values in vars(part).items():
            getattr(self, name)[rows] = values

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


def forces_table(study: Study, poses: Poses, network: Network, effects: Effects) -> Table:
    """``forces.csv``: what every joint bears, a row a pose, load and joint."""
    edges = [network.edges[k] for k in joints_of(network)]
    count, joints, loads, _ = effects.forces.shape
    values = effects.forces.swapaxes(1, 2).reshape(-1, 3)
    units = study.units
    body = "a link, 'asked' (the asked point), or the pin of a slot ('slot:') or of several links ('pin:')"
    columns = _of_loads(study, poses, loads, joints)
    columns += [
        Column("joint", np.tile([edge.name for edge in edges], count * loads), "", "point or slide"),
        Column("on", np.tile([_link(edge.a) for edge in edges], count * loads), "", f"what the force acts on: {body}"),
        Column(
            "by",
            np.tile([_link(edge.b) for edge in edges], count * loads),
            "",
            "what exerts it; in a telescopic leg its rod, on the part at its first end",
        ),
        Column("fx", values[:, 0], units.label("force"), "force on the one by the other, axes of the world"),
        Column("fy", values[:, 1], units.label("force"), "force on the one by the other, axes of the world"),
        Column("mz", values[:, 2], units.label("moment"), "moment likewise, about the joint's point"),
    ]
    return Table("forces", tuple(columns), "what the joints bear under the study's loads")


def displacements_table(study: Study, poses: Poses, network: Network, effects: Effects) -> Table:
    """``displacements.csv``: where every point goes, a row a pose, load and point of a link."""
    points = points_of(network)
    moves = effects.moved(network)
    count, number, loads = moves.shape
    moved = moves.swapaxes(1, 2).ravel()
    places = np.repeat(effects.places[:, None], loads, axis=1).ravel()
    length = study.units.label("length")
    columns = _of_loads(study, poses, loads, number)
    columns += [
        Column("link", np.tile([link for link, _, _ in points], count * loads), "", "link"),
        Column("point", np.tile([point for _, point, _ in points], count * loads), "", "its point"),
        Column("x", places.real, length, "place without a load"),
        Column("y", places.imag, length, "place without a load"),
        Column("dx", moved.real, length, "displacement"),
        Column("dy", moved.imag, length, "displacement"),
    ]
    return Table("displacements", tuple(columns), "displacements of all points under the study's loads")


def _of_loads(study: Study, poses: Poses, loads: int, rows: int) -> list[Column]:
    """Pose columns and the number of the load, for so many rows of each."""
    repeat = np.repeat(np.arange(poses.count), loads * rows)
    return [
        *pose_columns(study, poses, repeat),
        Column(
            "load", np.tile(np.repeat(np.arange(1, loads + 1), rows), poses.count), "", "which of the study's loads"
        ),
    ]


def _link(vertex: str) -> str:
    """The link that a vertex is a part of; of massless ones their kind."""
    return vertex.split("@")[0].removesuffix(":rod").removeprefix(":")
