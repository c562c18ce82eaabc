"""The curves on which centre points and circle points of four positions lie, followed around."""

from __future__ import annotations

import numpy as np

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.questions.synthesize import dyads
from mechdesign.questions.synthesize.body import Positions
from mechdesign.questions.synthesize.dyads import LINK, Dyads

# Largest and smallest step between two points (the unknowns have the length 1), and largest turn of its direction.
_STEP, _LEAST, _BEND = 0.02, 1e-4, 0.05
_MOST, _NEWTON = 4000, 3
# Links that are longer, in sizes of the task, are slides within rounding.
_LONGEST = 1e4
# Lines from which each branch is begun: directions, and distances from the middle in sizes of the task.
_LINES = [(np.exp(1j * angle), away) for angle in np.arange(0, 3, 0.5) for away in (-2.0, -0.5, 0.1, 1.0)]


def centre_points(task: Positions, reach: float) -> list[Dyads]:
    """The links of four positions along the curve of their pivots, in parts within a reach of the task's middle."""
    centre, size = task.centre, task.size
    known = dyads.independent(dyads.rows((task.places - centre) / size, task.rotations))
    normals, away = (np.array(part, dtype=complex) for part in zip(*_LINES, strict=True))
    wishes = dyads.on_lines(dyads.FRAME, normals, normals * away)
    starts = dyads.unknowns(np.concatenate([np.broadcast_to(known, (len(wishes), *known.shape)), wishes], axis=1))
    free = np.linalg.svd(known)[2][len(known) :].T
    forms = dyads.quadrics(free[None])[0]
    branches = list[Floats]()
    for start in starts @ free:
        start = start / np.linalg.norm(start)
        if all(np.abs(branch @ start).max() < np.cos(_STEP) for branch in branches):
            branches.append(_followed(forms, start))
    parts = list[Dyads]()
    for branch in branches:
        branch = branch[np.abs(branch @ free[0]) > dyads.NOTHING]
        link = dyads.links(branch @ free.T)
        far = (np.abs(link.pivot) > reach / size) | (link.length > _LONGEST)
        # A branch is closed, and passes the infinite where its weight changes its sign.
        side = np.where(far, 0.0, np.sign(branch @ free[0]))
        first = int((side != np.roll(side, 1)).argmax())
        order = np.roll(np.arange(len(side)), -first)
        breaks = np.flatnonzero(np.diff(side[order])) + 1
        parts += [link.take(rows) for rows in np.split(order, breaks) if len(rows) and not far[rows[0]]]
    return [Dyads(LINK, part.pivot * size + centre, part.pin * size, part.normal, part.length * size) for part in parts]


def _followed(forms: Floats, start: Floats) -> Floats:
    """Points around a branch of the curve in which two quadrics meet, shape (points, 4), of length 1."""
    point, ahead, step = start, _tangent(forms, start), _STEP
    points = [start]
    while len(points) < _MOST:
        there = point + step * ahead
        for _ in range(_NEWTON):
            slope = np.concatenate([2 * forms @ there, there[None] * 2])
            missed = np.append(there @ forms @ there, there @ there - 1)
            there = there - np.linalg.lstsq(slope, missed, rcond=None)[0]
        on = _tangent(forms, there)
        on *= np.sign(on @ ahead) or 1.0
        if on @ ahead < np.cos(_BEND) and step > _LEAST:
            step /= 2
            continue
        if len(points) > 2 and np.abs(there @ start) > np.cos(step) and np.abs(on @ _tangent(forms, start)) > 0.9:
            break
        point, ahead, step = there, on, min(2 * step, _STEP)
        points.append(there)
    return np.array([*points, start])


def _tangent(forms: Floats, point: Floats) -> Floats:
    """The direction of the curve at a point."""
    return np.asarray(np.linalg.svd(np.concatenate([forms @ point, point[None]]))[2][-1])
