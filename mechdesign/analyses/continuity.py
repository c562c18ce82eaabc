"""Angles without jumps along a motion, however coarse its steps are."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import TURN, wrap
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.plan import Plan
from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.study.poses import Poses

# Solves poses with given values near rows of a study's, both of one shape.
Solve = Callable[[Sequence[Floats], Ints], Configuration]

# An angle this near to the cut at half a turn begins above it, whatever rounding says (radians).
ON_THE_CUT = 1e-9
# Poses on the way that are solved at once.
AT_ONCE = 65536
# What an angle may turn between neighbouring poses so that the way round is certain.
SURE = np.pi / 2
# What is given moves at most this far between poses before any angle is looked at: an angle, and a length as a part of
# the mechanism's size. A link could turn nearly round within one longer step and seem to stand still.
STEP = np.pi / 4
PART = 0.25
# Poses between two of the motion, at most: more than these only a jump needs, and it has no way round.
MOST = 4096


def continuous(
    poses: Poses, plan: Plan, given: Sequence[Floats], angles: Sequence[Coordinate], values: Floats, solve: Solve
) -> Floats:
    """Angles without jumps along a sweep, a path or the last axis of a grid; its other axes after it.

    Between poses that are far apart the mechanism is solved on the way, twice as finely until no angle turns by a
    right angle or more in one step. Poses without a value are stepped over.

    Parameters
    ----------
    given : sequence of ndarray, shape (poses,)
        Values of the plan's coordinates (radians, lengths).
    values : ndarray, shape (angles, poses)
        The angles at the poses (radians), nan where a pose has none.
    """
    line = poses.grid[-1]
    known = np.flatnonzero(np.isfinite(values).all(axis=0))
    if not len(known):
        return values
    seen = values if len(known) == values.shape[1] else values[:, known]
    starts = known // line != np.append(-1, known[:-1]) // line
    rises = np.diff(seen, axis=1)
    far = ~starts[1:] & (np.abs(rises) >= SURE).any(axis=0)
    parts = _parts(plan, given, known)
    at = np.flatnonzero(far | (parts > 1) & ~starts[1:])
    moved = wrap(rises[:, at])
    coarse = np.flatnonzero((known[at + 1] == known[at] + 1) & ((parts[at] > 1) | (np.abs(moved) >= SURE).any(axis=0)))
    if len(coarse):
        begins = known[at[coarse]]
        moved[:, coarse] = _on_the_way(angles, given, begins, begins + 1, parts[at[coarse]], solve)
    # Whole turns from each of some poses on, counted anew on every line of a grid.
    heads = np.flatnonzero(starts)
    begins = np.concatenate([heads, at + 1])
    order = np.argsort(begins, kind="stable")
    more = np.concatenate([np.zeros((len(values), len(heads))), np.round((moved - rises[:, at]) / TURN)], axis=1)
    total = np.cumsum(more[:, order], axis=1)
    line_of = np.cumsum(order < len(heads)) - 1
    total += ((seen[:, heads] < ON_THE_CUT - np.pi) - total[:, order < len(heads)])[:, line_of]
    found = values
    if total.any():
        found = values.copy()
        found[:, known] += TURN * np.repeat(total, np.diff(np.append(begins[order], len(known))), axis=1)
    return found if len(poses.grid) == 1 else np.stack([_across(row, poses.grid) for row in found])


def _parts(plan: Plan, given: Sequence[Floats], known: Ints) -> Ints:
    """In how many parts (a power of two) each step is made, so that what is given moves little in each."""
    longest = np.ones(len(known) - 1)
    for coordinate, values in zip(plan.structure.given, given, strict=True):
        step = {"angle": STEP, "length": PART * plan.core.size}.get(coordinate.quantity)
        if step:
            longest = np.maximum(longest, np.abs(np.diff(values[known])) / step)
    parts = np.ones(len(longest), dtype=np.intp)
    # A step that is just one part must not become two by rounding.
    long = np.flatnonzero(longest > 1 + 1e-9)
    powers = np.ceil(np.log2(longest[long]) - 1e-9)
    parts[long] = 2 ** np.clip(powers, 0, math.log2(MOST)).astype(np.intp)
    return parts


def _on_the_way(
    angles: Sequence[Coordinate], given: Sequence[Floats], begins: Ints, ends: Ints,
    parts: Ints, solve: Solve,
) -> Floats:  # fmt: skip
    """How far each angle turns between pairs of poses, shape (angles, pairs); nearest where the way does not close."""
    found = np.empty((len(angles), len(begins)))
    number = np.maximum(parts, 2)
    pending = np.arange(len(begins))
    while len(pending):
        count = int(number[pending].min())
        at = pending[number[pending] == count]
        left = [pending[number[pending] > count]]
        for first in range(0, len(at), max(1, AT_ONCE // (count + 1))):
            pairs = at[first : first + max(1, AT_ONCE // (count + 1))]
            way = np.linspace(0.0, 1.0, count + 1)
            between = [v[begins[pairs], None] * (1 - way) + v[ends[pairs], None] * way for v in given]
            configuration = solve(between, begins[pairs, None])
            turned = np.stack([np.broadcast_to(configuration.value(c), configuration.shape) for c in angles])
            steps = wrap(np.diff(turned, axis=-1))
            closed = np.isfinite(steps).all(axis=(0, 2))
            sure = (np.abs(steps) < SURE).all(axis=(0, 2))
            straight = wrap(turned[..., -1] - turned[..., 0])
            found[:, pairs] = np.where(closed, steps.sum(axis=-1), straight)
            finer = pairs[closed & ~sure & (count < MOST)]
            number[finer] = 2 * count
            left.append(finer)
        pending = np.concatenate(left)
    return found


def _across(values: Floats, grid: Sequence[int]) -> Floats:
    """Whole turns between the lines of a grid taken out, its last axis being continuous already."""
    for axis in range(len(grid) - 2, -1, -1):
        # Each design of several has a grid of its own.
        for stack in values.reshape(-1, grid[axis], math.prod(grid[axis + 1 :])):
            for before, block in pairwise(stack):
                jump = (block - before)[np.isfinite(block - before)][:1]
                block -= TURN * np.round(jump / TURN).sum()
    return values
