"""Angles without jumps along a motion, however coarse its steps are."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.poses import CHUNK, dimensions, radians, starts
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.algebra import wrap
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.plan import Plan
from mechdesign.study import Study
from mechdesign.study.poses import Poses

Array = NDArray[np.float64]

# What an angle may turn between neighbouring poses so that the way round is certain.
SURE = np.pi / 2
# What is given moves at most this far between poses before any angle is looked at: an angle, and a length as a part of
# the mechanism's size. A link could turn nearly round within one longer step and seem to stand still.
STEP = np.pi / 4
PART = 0.25
# Poses between two of the motion, at most: more than these only a jump needs, and it has no way round.
MOST = 4096


def continuous(
    study: Study, poses: Poses, coordinates: Sequence[Coordinate], arrays: Mapping[str, Array]
) -> dict[str, Array]:
    """Values of angles without jumps along a sweep, a path or the last axis of a grid; its other axes after it.

    Between poses that are far apart the mechanism is solved on the way, twice as finely until no angle turns by a
    right angle or more in one step. Poses without a value are stepped over.

    Parameters
    ----------
    coordinates : sequence of Coordinate
        Angles.
    arrays : mapping of str to ndarray, shape (poses,)
        Their values in the study's unit, and perhaps others.
    """
    if not coordinates:
        return {}
    factor = study.units.angle_factor
    angles = np.stack([arrays[c.name] for c in coordinates]) * factor
    group, line = poses.groups[0], poses.grid[-1]
    known = np.flatnonzero(np.isfinite(angles).all(axis=0))
    if not len(known):
        return {}
    begins, ends = known[:-1], known[1:]
    together = begins // line == ends // line
    moved = wrap(angles[:, ends] - angles[:, begins])
    neighbours = together & (ends == begins + 1)
    mechanism = study.mechanism
    plan = mechanism.plan(group.names)
    given = [
        np.asarray(radians(study, c, v), dtype=float)
        for c, v in zip(plan.structure.given, group.columns(), strict=True)
    ]
    parts = _parts(plan, given, begins, ends)
    coarse = np.flatnonzero(neighbours & ((parts > 1) | (np.abs(moved) >= SURE).any(axis=0)))
    if len(coarse):
        moved[:, coarse] = _on_the_way(
            mechanism, plan, coordinates, poses, given, begins[coarse], ends[coarse], parts[coarse]
        )
    turns = np.round((angles[:, begins] + moved - angles[:, ends]) / (2 * np.pi))
    turns = np.concatenate([np.zeros((len(angles), 1)), np.where(together, turns, 0.0)], axis=1)
    total = np.cumsum(turns, axis=1)
    # Every line of a grid starts anew.
    starts = np.concatenate([[True], ~together])
    heads = np.maximum.accumulate(np.where(starts, np.arange(len(known)), 0))
    total -= total[:, heads]
    turn = 2 * np.pi / factor
    found = {}
    for coordinate, whole in zip(coordinates, total, strict=True):
        values = arrays[coordinate.name].copy()
        values[known] += turn * whole
        found[coordinate.name] = _across(values, turn, poses.grid)
    return found


def _parts(plan: Plan, given: Sequence[Array], begins: NDArray[np.intp], ends: NDArray[np.intp]) -> NDArray[np.intp]:
    """In how many parts (a power of two) each step is made, so that what is given moves little in each."""
    longest = np.ones(len(begins))
    for coordinate, values in zip(plan.structure.given, given, strict=True):
        step = {"angle": STEP, "length": PART * plan.core.size}.get(coordinate.quantity)
        if step:
            longest = np.maximum(longest, np.abs(values[ends] - values[begins]) / step)
    # A step that is just one part must not become two by rounding.
    powers = np.ceil(np.log2(longest) - 1e-9)
    return np.asarray(2 ** np.clip(powers, 0, math.log2(MOST)), dtype=np.intp)


def _on_the_way(
    mechanism: Mechanism, plan: Plan, coordinates: Sequence[Coordinate], poses: Poses, given: Sequence[Array],
    begins: NDArray[np.intp], ends: NDArray[np.intp], parts: NDArray[np.intp],
) -> Array:  # fmt: skip
    """How far each angle turns between pairs of poses, shape (angles, pairs); nearest where the way does not close."""
    found = np.empty((len(coordinates), len(begins)))
    number = np.maximum(parts, 2)
    pending = np.arange(len(begins))
    while len(pending):
        count = int(number[pending].min())
        at = pending[number[pending] == count]
        left = [pending[number[pending] > count]]
        for first in range(0, len(at), max(1, CHUNK // (count + 1))):
            pairs = at[first : first + max(1, CHUNK // (count + 1))]
            way = np.linspace(0.0, 1.0, count + 1)
            between = [v[begins[pairs], None] * (1 - way) + v[ends[pairs], None] * way for v in given]
            rows = begins[pairs, None]
            start = starts(mechanism, poses, rows) if plan.iterative else None
            configuration = plan.solve(between, dimensions(poses, rows), start=start, limits=False)
            shape = configuration.shape
            angles = np.stack([np.broadcast_to(configuration.value(c), shape) for c in coordinates])
            steps = wrap(np.diff(angles, axis=-1))
            closed = np.isfinite(steps).all(axis=(0, 2))
            sure = (np.abs(steps) < SURE).all(axis=(0, 2))
            straight = wrap(angles[..., -1] - angles[..., 0])
            found[:, pairs] = np.where(closed, steps.sum(axis=-1), straight)
            finer = pairs[closed & ~sure & (count < MOST)]
            number[finer] = 2 * count
            left.append(finer)
        pending = np.concatenate(left)
    return found


def _across(values: Array, turn: float, grid: Sequence[int]) -> Array:
    """Whole turns between the lines of a grid taken out, its last axis being continuous already."""
    for axis in range(len(grid) - 2, -1, -1):
        # Each design of several has a grid of its own.
        for stack in values.reshape(-1, grid[axis], math.prod(grid[axis + 1 :])):
            for before, block in pairwise(stack):
                jump = (block - before)[np.isfinite(block - before)][:1]
                block -= turn * np.round(jump / turn).sum()
    return values
