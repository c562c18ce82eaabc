"""Linkages whose point passes given points exactly, whatever their assembly at each.

Newton's method in the dimensions, and in the angles of all links at each point, whose loops need not close before the
end. So a linkage may pass from one assembly to another at any point, which one that is solved in an assembly cannot.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism.open_loops import OpenLoops
from mechdesign.questions.synthesize.bounds import Bounds
from mechdesign.questions.synthesize.kinds import Kind
from mechdesign.questions.synthesize.paths import PathPoints, Starts

_ROUNDS = 60
# Steps are shortened to this part of a dimension, but of small ones of this part of the task, and to a radian.
_LARGEST, _SMALL = 0.3, 0.3
# Gaps below this part of the task's size are rounding.
_CLOSED = 1e-13
# Part of a matrix's diagonal that keeps it regular where points leave a dimension free.
_LEAST = 1e-9


def passing(kind: Kind, task: PathPoints, starts: Sequence[Starts], bound: Bounds) -> Starts:
    """The linkages to which starts in each of the assemblies lead."""
    values, numbers = (np.concatenate([getattr(part, name) for part in starts]) for name in ("values", "numbers"))
    poses = np.concatenate([_poses(kind, modes, part) for modes, part in zip(kind.begun, starts, strict=True)], axis=1)
    open_, closed, count = np.arange(len(values)), np.zeros(len(values), dtype=bool), values.shape[1]
    for _ in range(_ROUNDS):
        missed, by_pose, by_value = _equations(kind, task, values[open_], poses[:, open_])
        gap = np.abs(missed).max(axis=(1, 2), initial=0.0)
        closed[open_] = gap <= _CLOSED * task.size
        going = np.isfinite(gap) & (gap > _CLOSED * task.size)
        open_, missed, by_pose, by_value = (part[going] for part in (open_, missed, by_pose, by_value))
        if not len(open_):
            break
        now = values[open_]
        by_value = np.moveaxis(bound.left(now, np.moveaxis(by_value, -1, 0)), 0, -1)
        if task.timing is not None:
            # The drive turns by the same at all points.
            by_value = np.concatenate([by_value, by_pose[..., :1]], axis=-1)
            by_pose = by_pose[..., 1:]
        # What no pose can mend is left to the dimensions.
        across = np.linalg.qr(by_pose, mode="complete")[0][..., by_pose.shape[-1] :]
        left = np.einsum("npek,npe->npk", across, missed).reshape(len(open_), -1)
        matrix = np.einsum("npek,npei->npki", across, by_value).reshape(*left.shape, -1)
        step = _least(matrix, left)
        part = np.abs(step[:, :count]) / kind.scale(now, _SMALL * task.size)
        step *= np.minimum(1.0, _LARGEST / np.maximum(part.max(axis=1), np.finfo(float).tiny))[:, None]
        values[open_] = bound(now + step[:, :count])
        step[:, :count] = values[open_] - now
        turned = _least(by_pose, missed + np.einsum("npei,ni->npe", by_value, step))
        if task.timing is not None:
            turned = np.concatenate([np.broadcast_to(step[:, None, -1:], (*turned.shape[:2], 1)), turned], axis=-1)
        poses[:, open_] += np.moveaxis(np.clip(turned, -1, 1), -1, 0)
    return Starts(values[closed], poses[0, closed], numbers[closed])


def _poses(kind: Kind, modes: tuple[int, ...], start: Starts) -> Floats:
    """Drive, angles and slides of the poses of linkages in an assembly, shape (unknowns, count, points)."""
    poses = kind.solve(start.values, start.angles, modes)
    return np.concatenate([start.angles[None], OpenLoops.closed(kind.mechanism.forward.structure, poses)])


def _equations(kind: Kind, task: PathPoints, values: Floats, poses: Floats) -> tuple[Floats, Floats, Floats]:
    """What point and loops miss at each point, shape (count, points, equations), and its derivatives.

    Those by drive, angles and slides, and those by values have a last axis more.
    """
    loops = kind.opened(values, poses)
    by_place = loops.by_places([kind.drive, *kind.places])
    missed = loops.values
    missed[..., 0] -= task.points.real
    missed[..., 1] -= task.points.imag
    return missed, np.concatenate([by_place[..., :1], loops.by_unknowns()], axis=-1), by_place[..., 1:]


def _least(matrix: Floats, missed: Floats) -> Floats:
    """The steps after which least is missed, shape (..., unknowns)."""
    normal = np.einsum("...ei,...ej->...ij", matrix, matrix)
    size = np.einsum("...ii->...i", normal)
    size += _LEAST * np.maximum(size, _LEAST * size.max(axis=-1, keepdims=True)) + np.finfo(float).tiny
    return -np.linalg.solve(normal, np.einsum("...ei,...e->...i", matrix, missed)[..., None])[..., 0]
