"""The tables of a stiffness result: columns, units, meanings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.ground.columns import Column
from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats, Ints, Lanes
from mechdesign.ground.results import Table, TableKind
from mechdesign.mechanism.algebra import Value
from mechdesign.motion.motion import Motion
from mechdesign.questions.stiffness.columns import (
    COMPLIANCE,
    DEFLECTIONS,
    DISPLACEMENTS,
    EIGEN,
    FORCES,
    LOAD,
    SPRINGS,
    STIFFNESS,
)
from mechdesign.questions.stiffness.compliance import Held, directional, scales
from mechdesign.questions.stiffness.effects import Effects, joints_of, points_of
from mechdesign.questions.stiffness.network import Network
from mechdesign.questions.stiffness.screws import principal


@dataclass(frozen=True, eq=False)
class Springs(Lanes):
    """Rows of the table of springs: pose and leg (numbers), stiffness, a place on the line and its angle (radians)."""

    row: Ints
    leg: Ints
    stiffness: Floats
    place: Complexes
    angle: Floats

    @staticmethod
    def sorted(parts: Sequence[Springs]) -> Springs:
        """All springs, ordered by pose and leg."""
        empty = Springs(*(np.zeros(0, dtype) for dtype in (np.intp, np.intp, float, complex, float)))
        springs = Springs.joined([empty, *parts])
        return springs.take(np.lexsort((springs.leg, springs.row)))

    def counts(self, designs: int, poses: int) -> Ints:
        """Number of springs of each design; `poses` is the number of poses of a design."""
        return np.bincount(self.row // poses, minlength=designs)


def _entries(motion: Motion, table: TableKind, letter: str, matrix: Floats) -> list[Column]:
    """Columns of the upper triangle of stiffness or compliance matrices."""
    size = range(matrix.shape[1])
    entries = {f"{letter}{i + 1}{j + 1}": matrix[:, i, j] for i in size for j in size if i <= j}
    return table.columns(motion.units.labels, **entries)


def stiffness_table(motion: Motion, held: Held, valid: Flags, method: str, direction: Value | None) -> Table:
    """``stiffness.csv``; `direction` in the study's units, of all poses or of each."""
    units, labels, soft = motion.units, motion.units.labels, held.compliance
    low, high, angle = principal(soft)
    direct = {f"k_{axis}": 1 / soft[:, k, k] for k, axis in enumerate(("x", "y", "phi")[: soft.shape[1]])}
    columns = [
        *motion.columns(),
        *STIFFNESS.columns(labels, **direct, k_min=low, k_max=high, k_angle=angle / units.angle_factor),
    ]
    if direction is not None:
        columns += STIFFNESS.columns(labels, k_direction=directional(soft, direction * units.angle_factor))
    free = dict(zip(("free_x", "free_y", "free_phi"), held.free.T, strict=False))
    columns += _entries(motion, STIFFNESS, "K", held.stiffness)
    columns += STIFFNESS.columns(
        labels, rank=held.rank, **free, valid=valid, method=np.full(motion.poses.count, method)
    )
    return STIFFNESS.table(columns)


def eigen_table(motion: Motion, soft: Floats, length: Value) -> Table:
    """``eigen.csv``: eigen-stiffnesses of a body, softest first, and the twists along which they act.

    They are those of K with rotations counted as lengths: a twist (dx, dy, length dphi) of unit size causes a wrench
    along itself.
    """
    scale = 1 / scales(length, len(soft))
    finite = np.isfinite(soft).all(axis=(1, 2))
    values, vectors = np.full((len(soft), 3), np.nan), np.full((len(soft), 3, 3), np.nan)
    values[finite], vectors[finite] = np.linalg.eigh((soft * scale[:, :, None] * scale[:, None])[finite])
    stiffness = np.where(values > 1e-13 * values[:, -1:], 1 / values, np.where(np.isnan(values), np.nan, np.inf))
    # Softest first; the first entry of a twist that is not zero is positive.
    order = slice(None, None, -1)
    stiffness, twists = stiffness[:, order], vectors.swapaxes(1, 2)[:, order]
    lead = np.argmax(np.abs(twists) > 1e-9, axis=2)
    twists = twists * np.where(np.take_along_axis(twists, lead[:, :, None], axis=2) < 0, -1.0, 1.0)
    repeat = np.repeat(np.arange(motion.poses.count), 3)
    dx, dy, turn = twists.reshape(-1, 3).T
    return EIGEN.table(motion.columns(repeat) + EIGEN.columns(
        motion.units.labels, mode=np.tile([1, 2, 3], len(soft)), stiffness=stiffness.ravel(), dx=dx, dy=dy, turn=turn
    ))  # fmt: skip


def compliance_table(motion: Motion, soft: Floats) -> Table:
    """``compliance.csv``: C11 ... C33."""
    return COMPLIANCE.table(motion.columns() + _entries(motion, COMPLIANCE, "C", soft))


def springs_table(motion: Motion, legs: Sequence[str], springs: Springs) -> Table:
    """``springs.csv``: a row for each pose, leg and spring."""
    units = motion.units
    return SPRINGS.table(motion.columns(springs.row) + SPRINGS.columns(
        units.labels | {"unit": units.label("rotational_stiffness")}, leg=np.array([*legs, ""])[springs.leg],
        stiffness=springs.stiffness, x=springs.place.real, y=springs.place.imag,
        angle=springs.angle / units.angle_factor,
    ))  # fmt: skip


def deflections(loads: Floats, soft: Floats, others: Floats | None) -> Floats:
    """Twists of the asked point, shape (poses, loads, 2 or 3).

    `loads` are those on it, shape (poses, loads, 3), `others` what loads elsewhere move it, if there are such.
    """
    moved = np.einsum("nij,nlj->nli", soft, loads[:, :, : soft.shape[1]])
    return np.asarray(moved if others is None else moved + others)


def deflections_table(motion: Motion, loads: Floats, soft: Floats, others: Floats | None) -> Table:
    """``deflections.csv``: a row a pose and load, which are those of `deflections`."""
    size = soft.shape[1]
    moved = deflections(loads, soft, others).reshape(-1, size)
    repeat = np.repeat(np.arange(motion.poses.count), loads.shape[1])
    names = (*("fx", "fy", "mz")[:size], *("dx", "dy", "dphi")[:size])
    values = (*loads.reshape(-1, 3).T[:size], *moved.T)
    columns = DEFLECTIONS.columns(motion.units.labels | {"as radians": "rad"}, **dict(zip(names, values, strict=True)))
    if others is not None:
        return DEFLECTIONS.table([*_of_loads(motion, loads.shape[1], 1), *columns])
    return DEFLECTIONS.table([*motion.columns(repeat), *columns])


def forces_table(motion: Motion, network: Network, effects: Effects) -> Table:
    """``forces.csv``: what every joint bears, a row for each pose, load and joint, and for teeth, belts and cams."""
    edges = (network.edges[k] for k in joints_of(network))
    engagements = (transmission.engagement for transmission in network.transmissions)
    pairs = [(edge.name, _link(edge.a), _link(edge.b)) for edge in edges]
    pairs += [(pair.coupling, *pair.links) for pair in engagements if pair is not None and pair.presses]
    count, joints, loads, _ = effects.forces.shape
    fx, fy, mz = effects.forces.swapaxes(1, 2).reshape(-1, 3).T
    words = dict(zip(("joint", "on", "by"), zip(*pairs, strict=True), strict=True))
    tiled = {name: np.tile(texts, count * loads) for name, texts in words.items()}
    columns = FORCES.columns(motion.units.labels, **tiled, fx=fx, fy=fy, mz=mz)
    return FORCES.table([*_of_loads(motion, loads, joints), *columns])


def displacements_table(motion: Motion, network: Network, effects: Effects) -> Table:
    """``displacements.csv``: displacements of all points, a row for each pose, load and point of a link."""
    points = points_of(network)
    count, number, loads = effects.moves.shape
    moved = effects.moves.swapaxes(1, 2).ravel()
    places = np.repeat(effects.places[:, None], loads, axis=1).ravel()
    return DISPLACEMENTS.table(_of_loads(motion, loads, number) + DISPLACEMENTS.columns(
        motion.units.labels, link=np.tile([link for link, _, _ in points], count * loads),
        point=np.tile([point for _, point, _ in points], count * loads), x=places.real, y=places.imag, dx=moved.real,
        dy=moved.imag,
    ))  # fmt: skip


def _of_loads(motion: Motion, loads: int, rows: int) -> list[Column]:
    """Columns of the pose and of the load's number, for `rows` rows of each pose and load."""
    repeat = np.repeat(np.arange(motion.poses.count), loads * rows)
    numbers = np.tile(np.repeat(np.arange(1, loads + 1), rows), motion.poses.count)
    return [*motion.columns(repeat), LOAD.column(numbers)]


def _link(vertex: str) -> str:
    """The link to which a vertex belongs; of a massless body its name."""
    return vertex.split("@")[0].removesuffix(":rod").removeprefix(":")
