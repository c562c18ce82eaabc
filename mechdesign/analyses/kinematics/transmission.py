"""Smallest and largest transmission angles of the four-bars of many designs at once, where their motions are whole."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.kinematics.loops import BEYOND, SQUARE
from mechdesign.analyses.kinematics.probing import Floats, Indices
from mechdesign.analyses.poses import dimensions, radians, solve_poses, starts
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import quiet
from mechdesign.mechanism.four_bars import FourBar, four_bars
from mechdesign.mechanism.golden import lowest
from mechdesign.results import Column, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses


def transmission_table(study: Study, poses: Poses, swept: str | None, whole: NDArray[np.bool_]) -> Table | None:
    """The part of table ``loops`` that a design's dimensions do not name otherwise; None without such loops.

    Parameters
    ----------
    swept : str or None
        The one coordinate that moves; between the poses of its sweep the extremes are found by golden section.
    whole : bool array, shape (designs,)
        Designs all of whose poses are valid; rows of the others are nan, as their limits of motion are not known here.
    """
    loops = four_bars(study.mechanism)
    if not loops:
        return None
    angle = np.empty((len(loops), poses.count))
    for solved in solve_poses(study, poses):
        angle[:, solved.rows] = _angles(loops, solved.configuration)
    # Lanes are designs by loops, as the rows of the table.
    line = poses.count // poses.designs
    values = np.moveaxis(angle.reshape(len(loops), poses.designs, line), 0, 1).reshape(-1, line)
    keep = np.repeat(whole, len(loops))
    found = np.full((2, len(values)), np.nan)
    if keep.any():
        found[:, keep] = _extremes(study, loops, poses, swept, np.flatnonzero(keep), values[keep])
    words = [np.tile(np.array(names), poses.designs) for names in (
        [loop.kind for loop in loops],
        *([loop.links[k] for loop in loops] for k in range(4)),
        [" ".join(joint.name for joint in loop.joints) for loop in loops],
    )]  # fmt: skip
    names = ("kind", "frame", "input", "coupler", "output", "joints")
    unit = study.units.label("angle")
    columns = [Column(name, column) for name, column in zip(names, words, strict=True)]
    for name, row in zip(("transmission_min", "transmission_max"), found, strict=True):
        columns.append(Column(name, row / study.units.angle_factor, unit))
    return Table("loops", tuple(columns))


@quiet
def _angles(loops: tuple[FourBar, ...], configuration: Configuration) -> Floats:
    angle = np.array([np.broadcast_to(loop.transmission(configuration), configuration.shape) for loop in loops])
    return np.where(configuration.valid, angle, np.nan)


def _extremes(
    study: Study, loops: tuple[FourBar, ...], poses: Poses, swept: str | None, lanes: Indices, values: Floats
) -> Floats:
    """Smallest and largest value of each lane, shape (2, lanes), also between poses; as `kinematics.loops`."""
    signs = np.array([1.0, -1.0])[:, None]
    values = signs[:, :, None] * values
    best = (values <= values.min(axis=2, keepdims=True) + BEYOND).argmax(axis=2)
    found = np.take_along_axis(values, best[:, :, None], axis=2)[:, :, 0]
    last = values.shape[2] - 1
    if swept is not None and last > 0:
        # Beside the best pose, and beside the ends of the sweep, which may be the two sides of one.
        middle = np.stack([best, np.zeros_like(best), np.full_like(best, last)])
        shape = middle.shape
        which, sign = (np.broadcast_to(x, shape).ravel() for x in (lanes, signs))
        between = _golden(study, loops, poses, swept, which, middle.ravel(), last, sign).reshape(shape).min(axis=0)
        found = np.where(between < found - BEYOND, between, found)
    found = signs * found
    for corner in (0.0, np.pi / 2):
        found = np.where(np.abs(found - corner) <= SQUARE, corner, found)
    return np.asarray(found)


def _golden(
    study: Study, loops: tuple[FourBar, ...], poses: Poses, swept: str, lanes: Indices, middle: Indices, last: int,
    sign: Floats,
) -> Floats:  # fmt: skip
    """Smallest value of each lane, times its sign, beside a pose of its sweep."""
    group = poses.groups[0]
    plan = study.mechanism.plan(group.names)
    loop, row = lanes % len(loops), lanes // len(loops) * (last + 1) + middle
    given = [
        np.asarray(radians(study, c, v[row]), dtype=float)
        for c, v in zip(plan.structure.given, group.columns(), strict=True)
    ]
    which = group.names.index(swept)
    at = np.asarray(radians(study, plan.structure.given[which], group.values[swept]), dtype=float)
    places = dimensions(poses, row)
    start = None
    if plan.iterative:
        start = plan.solve(given, places, start=starts(study.mechanism, poses, row))
    every = np.arange(len(lanes))

    def angle(x: Floats) -> Floats:
        held = list(given)
        held[which] = x
        value = sign * _angles(loops, plan.solve(held, places, start=start))[loop, every]
        return np.where(np.isnan(value), np.inf, value)

    a, b = at[row - (middle > 0)], at[row + (middle < last)]
    return lowest(angle, a, b)[1]
