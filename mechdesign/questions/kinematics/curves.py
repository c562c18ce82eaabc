"""How near the path of a point passes the points of its target, at whatever time it does."""

from __future__ import annotations

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.ground.numerics.rounding import STILL
from mechdesign.motion.question import PoseValues
from mechdesign.questions.kinematics.along import KinematicAlong
from mechdesign.questions.kinematics.targets import nearest, own_tables
from mechdesign.study.schema.targets import Target

# Rounds in which the place next to a point is sought between poses, the step in each a part of the one before.
_ROUNDS, _FINER = 9, 4.0


def distances(values: PoseValues, along: KinematicAlong | None, target: Target) -> tuple[Floats, Floats]:
    """Distance of each point of a curve from the path of its owner, and the place there; shape (designs, points).

    It is normal to the path, or from an end of it. Places are those of `KinematicAlong.shown`, rows where the motion is
    not followed; nan where a design has no path.
    """
    poses = values.question.poses
    x, y = (values.arrays[name].reshape(poses.designs, -1) for name in target.coordinates)
    paths = np.where(values.valid.reshape(x.shape), x + 1j * y, np.nan)
    rows = np.asarray(poses.places_along[1], dtype=float).reshape(x.shape)
    if poses.closed:
        paths, rows = np.column_stack([paths, paths[:, :1]]), np.column_stack([rows, np.full(len(rows), poses.end)])
    tables = np.broadcast_to(own_tables(target, poses), (poses.designs, *target.table.shape))  # type: ignore[union-attr]
    points = tables[..., 0] + 1j * tables[..., 1]
    feet, places = np.empty(points.shape, dtype=complex), np.empty(points.shape)
    for k, (path, row) in enumerate(zip(paths, rows, strict=True)):
        feet[k], owners = nearest(points[k], path)
        first = np.minimum(owners // 2, max(len(row) - 2, 0))
        sides = path[first + 1] - path[first] if len(row) > 1 else np.ones(1)
        part = np.abs(feet[k] - path[first]) / np.maximum(np.abs(sides), np.finfo(float).tiny)
        places[k] = row[first] + part * (row[np.minimum(first + 1, len(row) - 1)] - row[first])
    if along is None or not np.isfinite(places).any():
        return np.abs(feet - points), places
    # A path that comes back to its begin goes on there.
    whole = np.abs(paths[:, -1] - paths[:, 0]) <= STILL * np.ptp(np.nan_to_num(np.abs(paths)))
    low, high = np.where(whole, -np.inf, 0.0)[:, None], np.where(whole, np.inf, poses.end)[:, None]
    line = np.repeat(np.arange(poses.designs), 3 * points.shape[1])
    mechanism, gaps, step = values.question.study.mechanism, np.abs(feet - points), 1.0
    for _ in range(_ROUNDS):
        around = np.clip(places[..., None] + step * np.array([-1.0, 0.0, 1.0]), low[..., None], high[..., None])
        solved = along.curve.solve(line, np.nan_to_num(around).ravel(), judged=False, turning=False).configuration
        node = np.where(solved.valid, solved.nodes[mechanism.graph.node(target.owner)], np.nan).reshape(around.shape)
        near, at = _foot(node, around, points)
        better = np.isfinite(near)
        gaps, places = np.where(better, near, gaps), np.where(better, at, places)
        step /= _FINER
    shown = along.shown(np.repeat(np.arange(poses.designs), points.shape[1]), np.clip(places, 0, poses.end).ravel())
    return gaps, shown.reshape(places.shape)


def _foot(path: Complexes, at: Floats, points: Complexes) -> tuple[Floats, Floats]:
    """Distance of points from paths by three places each, and the nearest place; nan where these are not assembled.

    It is that of a parabola through the squares, and the distance that from the chord beside it.
    """
    before, here, after = np.moveaxis(np.abs(path - points[..., None]) ** 2, -1, 0)
    bend = before - 2 * here + after
    part = np.where(bend > 0, (before - after) / np.where(bend > 0, 2 * bend, 1.0), np.sign(before - after))
    part = np.clip(part, -1, 1)
    side, upper = np.abs(part), part > 0
    begin, end = path[..., 1], np.where(upper, path[..., 2], path[..., 0])
    gap = np.abs(points - begin - side * (end - begin))
    return gap, at[..., 1] + side * (np.where(upper, at[..., 2], at[..., 0]) - at[..., 1])
