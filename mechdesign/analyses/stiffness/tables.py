"""The tables of a stiffness result: columns, units, meanings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechdesign.analyses.columns import shared
from mechdesign.analyses.poses import pose_columns
from mechdesign.analyses.stiffness.compliance import Held, directional, principal
from mechdesign.analyses.stiffness.legs import Leg
from mechdesign.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.results import Column, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses


@dataclass(frozen=True, eq=False)
class Springs:
    """Rows of the table of springs, in no order."""

    row: Ints
    leg: Ints
    stiffness: Floats
    place: Complexes
    angle: Floats


def _kinds(size: int, what: str) -> dict[tuple[int, int], str]:
    """Kind of quantity of each entry of the upper triangle of a stiffness or compliance matrix."""
    prefix = ("", "coupling_", "rotational_")
    return {(i, j): prefix[(i == 2) + (j == 2)] + what for i in range(size) for j in range(i, size)}


def _entries(study: Study, letter: str, matrix: Floats, what: str, meaning: str) -> list[Column]:
    return [
        Column(f"{letter}{i + 1}{j + 1}", matrix[:, i, j], study.units.label(kind), meaning)
        for (i, j), kind in _kinds(matrix.shape[1], what).items()
    ]


def stiffness_table(
    study: Study, poses: Poses, held: Held, valid: Flags, method: str, direction: float | None
) -> Table:
    """``stiffness.csv``; `direction` in the study's units."""
    units, soft = study.units, held.compliance
    size = soft.shape[1]
    low, high, angle = principal(soft)
    with np.errstate(divide="ignore"):
        direct = [1 / soft[:, k, k] for k in range(size)]
    columns = pose_columns(study, poses)
    columns += [
        Column(name, values, units.label(kind), "load over its own displacement, the others free")
        for name, values, kind in zip(
            ("k_x", "k_y", "k_phi"), direct, ("stiffness", "stiffness", "rotational_stiffness"), strict=False
        )
    ]
    unit = units.label("stiffness")
    columns += [
        Column("k_min", low, unit, "stiffness to a force in the softest direction, the body free to turn"),
        Column("k_max", high, unit, "stiffness to a force in the stiffest direction, the body free to turn"),
        Column("k_angle", angle / units.angle_factor, units.label("angle"), "angle of the stiffest direction"),
    ]
    if direction is not None:
        columns.append(
            Column(
                "k_direction",
                directional(soft, direction * units.angle_factor),
                unit,
                "force in the asked direction over displacement along it",
            )
        )
    columns += _entries(study, "K", held.stiffness, "stiffness", "stiffness matrix at the asked point; nan where rigid")
    columns.append(Column("rank", held.rank, "", "number of independent wrenches that hold the body"))
    for k, name in enumerate(("free_x", "free_y", "free_phi")[:size]):
        per = "" if k == 2 else units.label("length")
        columns.append(
            Column(name, held.free[:, k], per, "the free twist, per radian where it turns; nan where none is free")
        )
    columns += shared(units, valid=valid)
    columns.append(
        Column(
            "method", np.full(poses.count, method), "", "serial legs: reciprocal screws [S4]; force method: any other"
        )
    )
    return Table("stiffness", tuple(columns), "stiffness at the asked point per pose, axes of the world, per radian")


def eigen_table(study: Study, poses: Poses, soft: Floats, length: float) -> Table:
    """``eigen.csv``: eigen-stiffnesses of a body, softest first, and the twists along which they act.

    Of K with rotations counted as lengths: a twist (dx, dy, length dphi) of unit size meets a wrench along itself.
    """
    scale = np.array([1.0, 1.0, length])
    known = np.isfinite(soft).all(axis=(1, 2))
    values, vectors = np.full((len(soft), 3), np.nan), np.full((len(soft), 3, 3), np.nan)
    values[known], vectors[known] = np.linalg.eigh(soft[known] * np.outer(scale, scale))
    with np.errstate(divide="ignore"):
        stiffness = np.where(values > 1e-13 * values[:, -1:], 1 / values, np.where(np.isnan(values), np.nan, np.inf))
    # Softest first; a twist points up, or to the right.
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
    """``compliance.csv``: C11 ... C33."""
    columns = pose_columns(study, poses) + _entries(study, "C", soft, "compliance", "displacement per load")
    return Table(
        "compliance", tuple(columns), "twist (dx, dy, dphi in radians) at the asked point per load, axes of the world"
    )


def springs_table(study: Study, poses: Poses, legs: Sequence[Leg], springs: Sequence[Springs]) -> Table:
    units = study.units
    row = np.concatenate([s.row for s in springs] or [np.zeros(0, dtype=np.intp)])
    leg = np.concatenate([s.leg for s in springs] or [np.zeros(0, dtype=np.intp)])
    order = np.lexsort((leg, row))

    def gather(name: str) -> Any:
        return np.concatenate([getattr(s, name) for s in springs] or [np.zeros(0)])[order]

    names = np.array([leg.name for leg in legs] or [""])
    place, angle = gather("place"), gather("angle")
    per_radian = units.label("rotational_stiffness")
    columns = pose_columns(study, poses, row[order])
    columns += [
        Column("leg", names[leg[order]], "", "links of the leg, from the base"),
        Column("stiffness", gather("stiffness"), units.label("stiffness"),
               f"along its line, inf where rigid; where angle is nan about its point ({per_radian})"),
        Column("x", np.real(place), units.label("length"), "a point on its line"),
        Column("y", np.imag(place), units.label("length"), "a point on its line"),
        Column("angle", angle / units.angle_factor, units.label("angle"), "direction of its line"),
    ]  # fmt: skip
    return Table("springs", tuple(columns), "springs that hold the body as its legs do")


def deflections_table(study: Study, poses: Poses, loads: Floats, soft: Floats) -> Table:
    units = study.units
    size = soft.shape[1]
    moved = np.einsum("nij,lj->nli", soft, loads[:, :size]).reshape(-1, size)
    repeat = np.repeat(np.arange(poses.count), len(loads))
    applied = np.tile(loads, (poses.count, 1))
    columns = pose_columns(study, poses, repeat)
    force, moment, length = units.label("force"), units.label("moment"), units.label("length")
    for k, (name, unit) in enumerate(zip(("fx", "fy", "mz")[:size], (force, force, moment), strict=False)):
        columns.append(Column(name, applied[:, k], unit, "load at the asked point"))
    for k, (name, unit) in enumerate(zip(("dx", "dy", "dphi")[:size], (length, length, "rad"), strict=False)):
        columns.append(Column(name, moved[:, k], unit, "deflection of the asked point"))
    return Table("deflections", tuple(columns), "deflections under the study's loads")
