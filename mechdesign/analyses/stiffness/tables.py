"""The tables of a stiffness result: columns, units, meanings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.columns import shared
from mechdesign.analyses.poses import pose_columns
from mechdesign.analyses.stiffness.compliance import Held, directional, scales
from mechdesign.analyses.stiffness.force_method import Effects, joints_of, points_of
from mechdesign.analyses.stiffness.network import Network
from mechdesign.analyses.stiffness.screws import principal
from mechdesign.mechanism.algebra import Value
from mechdesign.numerics.arrays import Complexes, Flags, Floats, Ints, Lanes
from mechdesign.results import Column, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses


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


def _entries(study: Study, letter: str, matrix: Floats, what: str, meaning: str) -> list[Column]:
    """Columns of the upper triangle of stiffness or compliance matrices."""
    prefix = ("", "coupling_", "rotational_")
    return [
        Column(
            f"{letter}{i + 1}{j + 1}", matrix[:, i, j], study.units.label(prefix[(i == 2) + (j == 2)] + what), meaning
        )
        for i in range(matrix.shape[1])
        for j in range(i, matrix.shape[1])
    ]


def stiffness_table(
    study: Study, poses: Poses, held: Held, valid: Flags, method: str, direction: Value | None
) -> Table:
    """``stiffness.csv``; `direction` is in the study's units, one for all poses or each."""
    units, soft = study.units, held.compliance
    size = soft.shape[1]
    low, high, angle = principal(soft)
    with np.errstate(divide="ignore"):
        direct = [1 / soft[:, k, k] for k in range(size)]
    columns = pose_columns(study, poses)
    unit, turning = units.label("stiffness"), units.label("rotational_stiffness")
    for name, values, per in zip(("k_x", "k_y", "k_phi"), direct, (unit, unit, turning), strict=False):
        columns.append(Column(name, values, per, "load over its own displacement, the others free"))
    columns += [
        Column("k_min", low, unit, "stiffness to a force in the softest direction, the body free to turn"),
        Column("k_max", high, unit, "stiffness to a force in the stiffest direction, the body free to turn"),
        Column("k_angle", angle / units.angle_factor, units.label("angle"), "angle of the stiffest direction"),
    ]
    if direction is not None:
        along = directional(soft, direction * units.angle_factor)
        columns.append(Column("k_direction", along, unit, "force in the asked direction over displacement along it"))
    columns += _entries(study, "K", held.stiffness, "stiffness", "stiffness matrix at the asked point; nan where rigid")
    columns.append(Column("rank", held.rank, "", "number of independent wrenches that hold the body"))
    free = zip(("free_x", "free_y", "free_phi"), held.free.T, (units.label("length"),) * 2 + ("",), strict=False)
    for name, values, per in free:
        columns.append(Column(name, values, per, "the free twist, per radian where it turns; nan where none is free"))
    how = "serial legs: reciprocal screws [S4]; force method: any other"
    columns += shared(units, valid=valid)
    columns.append(Column("method", np.full(poses.count, method), "", how))
    return Table("stiffness", tuple(columns), "stiffness at the asked point per pose, axes of the world, per radian")


def eigen_table(study: Study, poses: Poses, soft: Floats, length: Value) -> Table:
    """``eigen.csv``: eigen-stiffnesses of a body, softest first, and the twists along which they act.

    They are those of K with rotations counted as lengths: a twist (dx, dy, length dphi) of unit size causes a wrench
    along itself.
    """
    scale = 1 / scales(length, len(soft))
    finite = np.isfinite(soft).all(axis=(1, 2))
    values, vectors = np.full((len(soft), 3), np.nan), np.full((len(soft), 3, 3), np.nan)
    values[finite], vectors[finite] = np.linalg.eigh((soft * scale[:, :, None] * scale[:, None])[finite])
    with np.errstate(divide="ignore"):
        stiffness = np.where(values > 1e-13 * values[:, -1:], 1 / values, np.where(np.isnan(values), np.nan, np.inf))
    # Softest first; the first entry of a twist that is not zero is positive.
    order = slice(None, None, -1)
    stiffness, twists = stiffness[:, order], vectors.swapaxes(1, 2)[:, order]
    lead = np.argmax(np.abs(twists) > 1e-9, axis=2)
    twists = twists * np.where(np.take_along_axis(twists, lead[:, :, None], axis=2) < 0, -1.0, 1.0)
    repeat = np.repeat(np.arange(poses.count), 3)
    units = study.units
    columns = pose_columns(study, poses, repeat)
    columns += [
        Column("mode", np.tile([1, 2, 3], poses.count), "", "softest first"),
        Column("stiffness", stiffness.ravel(), units.label("stiffness"), "eigenvalue of the scaled stiffness matrix"),
        Column("dx", twists[:, :, 0].ravel(), "", "its twist, of unit size"),
        Column("dy", twists[:, :, 1].ravel(), "", "its twist, of unit size"),
        Column("turn", twists[:, :, 2].ravel(), "", "its twist: the characteristic length times dphi"),
    ]
    return Table("eigen", tuple(columns), "eigen-stiffnesses by the characteristic length")


def compliance_table(study: Study, poses: Poses, soft: Floats) -> Table:
    """``compliance.csv``: C11 to C33, a row for each pose."""
    columns = pose_columns(study, poses) + _entries(study, "C", soft, "compliance", "displacement per load")
    return Table(
        "compliance", tuple(columns), "twist (dx, dy, dphi in radians) at the asked point per load, axes of the world"
    )


def springs_table(study: Study, poses: Poses, legs: Sequence[str], springs: Springs) -> Table:
    """``springs.csv``: a row for each pose, leg and spring."""
    units = study.units
    per_radian = units.label("rotational_stiffness")
    columns = [
        *pose_columns(study, poses, springs.row),
        Column("leg", np.array([*legs, ""])[springs.leg], "", "links of the leg, from the base"),
        Column("stiffness", springs.stiffness, units.label("stiffness"),
               f"along its line, inf where rigid; where angle is nan about its point ({per_radian})"),
        Column("x", springs.place.real, units.label("length"), "a point on its line"),
        Column("y", springs.place.imag, units.label("length"), "a point on its line"),
        Column("angle", springs.angle / units.angle_factor, units.label("angle"), "direction of its line"),
    ]  # fmt: skip
    return Table("springs", tuple(columns), "springs that hold the body as its legs do")


def deflections_table(study: Study, poses: Poses, loads: Floats, soft: Floats) -> Table:
    """``deflections.csv``: a row for each pose and load; `loads` of shape (poses, loads, 3)."""
    units = study.units
    size = soft.shape[1]
    moved = np.einsum("nij,nlj->nli", soft, loads[:, :, :size]).reshape(-1, size)
    repeat = np.repeat(np.arange(poses.count), loads.shape[1])
    applied = loads.reshape(-1, 3)
    columns = pose_columns(study, poses, repeat)
    force, moment, length = units.label("force"), units.label("moment"), units.label("length")
    for name, values, unit in zip(("fx", "fy", "mz")[:size], applied.T, (force, force, moment), strict=False):
        columns.append(Column(name, values, unit, "load at the asked point"))
    for name, values, unit in zip(("dx", "dy", "dphi")[:size], moved.T, (length, length, "rad"), strict=False):
        columns.append(Column(name, values, unit, "deflection of the asked point"))
    return Table("deflections", tuple(columns), "deflections under the study's loads")


def forces_table(study: Study, poses: Poses, network: Network, effects: Effects) -> Table:
    """``forces.csv``: what every joint bears, a row for each pose, load and joint."""
    edges = [network.edges[k] for k in joints_of(network)]
    count, joints, loads, _ = effects.forces.shape
    values = effects.forces.swapaxes(1, 2).reshape(-1, 3)
    units = study.units
    body = "a link, 'asked' (the asked point), or the pin of a slot ('slot:') or of several links ('pin:')"
    columns = _of_loads(study, poses, loads, joints)
    for name, words, meaning in (
        ("joint", [edge.name for edge in edges], "point or slide"),
        ("on", [_link(edge.a) for edge in edges], f"what the force acts on: {body}"),
        ("by", [_link(edge.b) for edge in edges],
         "what exerts it; in a telescopic leg its rod, on the part at its first end"),
    ):  # fmt: skip
        columns.append(Column(name, np.tile(words, count * loads), "", meaning))
    columns += [
        Column("fx", values[:, 0], units.label("force"), "force on the one by the other, axes of the world"),
        Column("fy", values[:, 1], units.label("force"), "force on the one by the other, axes of the world"),
        Column("mz", values[:, 2], units.label("moment"), "moment likewise, about the joint's point"),
    ]
    return Table("forces", tuple(columns), "what the joints bear under the study's loads")


def displacements_table(study: Study, poses: Poses, network: Network, effects: Effects) -> Table:
    """``displacements.csv``: displacements of all points, a row for each pose, load and point of a link."""
    points = points_of(network)
    count, number, loads = effects.moves.shape
    moved = effects.moves.swapaxes(1, 2).ravel()
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
    """Columns of the pose and of the load's number, for `rows` rows of each pose and load."""
    repeat = np.repeat(np.arange(poses.count), loads * rows)
    numbers = np.tile(np.repeat(np.arange(1, loads + 1), rows), poses.count)
    return [*pose_columns(study, poses, repeat), Column("load", numbers, "", "which of the study's loads")]


def _link(vertex: str) -> str:
    """The link to which a vertex belongs; of a massless body its name."""
    return vertex.split("@")[0].removesuffix(":rod").removeprefix(":")
