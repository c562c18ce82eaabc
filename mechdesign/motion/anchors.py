"""Poses along motions from which the poses beside them are continued."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from mechdesign.ground.numerics.arrays import Floats, Ints, distinct, evenly
from mechdesign.mechanism import Configuration, Mechanism
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.configuration import joined
from mechdesign.mechanism.coordinates import Coordinate, angles_of
from mechdesign.mechanism.mechanism import begun
from mechdesign.mechanism.plan import Plan
from mechdesign.motion.motion import Motion
from mechdesign.motion.rows import Poses
from mechdesign.study.text.units import Units

# Largest change of a given angle, and of a given length as a part of the mechanism's size, from step to step.
FIRST_TURN, FIRST_LENGTH = np.pi / 4, 0.25
# A step may be longer by this part of itself.
BEYOND = 1e-9
# Largest number of poses of a motion from which groups without a closed form are continued.
ANCHORS = 721


def units_of(units: Units, coordinates: Sequence[Coordinate]) -> list[float]:
    """The study's unit of each coordinate, in radians or as 1 for a length."""
    return [units.angle_factor if c.quantity == "angle" else 1.0 for c in coordinates]


def inputs(motion: Motion, plan: Plan, line: Ints, s: Floats) -> tuple[Poses, list[Floats]]:
    """Poses at places of lines, and what they give to their plan (radians, lengths)."""
    there = motion.poses.along(line, s)
    columns = zip(there.values.values(), units_of(motion.units, plan.structure.given), strict=True)
    return there, [np.asarray(column * unit, dtype=float) for column, unit in columns]


def steps_of(motion: Motion, plan: Plan) -> tuple[Floats, Floats]:
    """Places between which motions are smooth, and the steps in each part so that given coordinates change little.

    The steps are whole numbers of shape (lines, parts).
    """
    poses, mechanism = motion.poses, motion.mechanism
    end, lines, corners = float(poses.end), poses.count // poses.line, poses.rule.corners
    marks = distinct(np.concatenate([[0.0, end], corners[(corners > 0) & (corners < end)]]))
    count = np.ones((lines, len(marks) - 1))
    units = units_of(motion.units, plan.structure.given)
    for coordinate, column, unit in zip(plan.structure.given, poses.values.values(), units, strict=True):
        size = FIRST_TURN if coordinate.quantity == "angle" else FIRST_LENGTH * mechanism.size
        rows = column.reshape(lines, -1)
        rows = np.concatenate([rows, rows[:, :1]], axis=1) if poses.closed else rows
        way = np.concatenate([np.zeros((lines, 1)), np.cumsum(np.abs(np.diff(rows, axis=1)), axis=1)], axis=1)
        at = np.clip(np.floor(marks), 0, rows.shape[1] - 2).astype(np.intp)
        moved = np.diff(way[:, at] + (marks - at) * (way[:, at + 1] - way[:, at]), axis=1)
        count = np.maximum(count, np.ceil(moved * unit / size - BEYOND))
    return marks, count


class Anchors:
    """Poses of motions in their order, a line each; those that are not valid are left out.

    Where the turns of angles count, each anchor is continued from the one before it, so that they are counted along the
    motion; else each is continued from the sketch.
    """

    def __init__(self, motion: Motion, plan: Plan) -> None:
        self.motion, self.poses, self.plan = motion, motion.poses, plan
        self.mechanism: Mechanism = motion.mechanism
        self.lines = self.poses.count // self.poses.line

    def at(self, line: Ints, s: Ints | Floats) -> Configuration:
        """The anchor nearest to each place of a line; the sketch where the line has none."""
        every, places, nearest = self._every
        beside = np.clip(np.searchsorted(places, s), 1, max(len(places) - 1, 1))
        before = np.minimum(beside, len(places) - 1) - (len(places) > 1)
        after = np.minimum(beside, len(places) - 1)
        nearer = np.where(s - places[before] <= places[after] - s, before, after)
        return every.take(nearest[line, nearer])

    @cached_property
    def _every(self) -> tuple[Configuration, Floats, Ints]:
        """Anchors of all lines and then the sketches, their places, and the number of the nearest valid one to each."""
        lines = np.arange(self.lines)
        sketch = begun(self.mechanism, self.poses.along(lines, lines * 0).places)
        if not sketch.shape:
            sketch = replace(sketch, shape=(1,), reason=sketch.reason.reshape(1)).take(np.zeros_like(lines))
        places = self._places
        solved = self._one_by_one(sketch, places) if self.plan.angles else self._at_once(sketch, places)
        anchors = self._joined([solved, sketch])
        # For each line and anchor the nearest valid anchor, or the sketch if the line has none.
        valid = np.asarray(solved.valid).reshape(self.lines, -1)
        numbers = np.arange(valid.shape[1])
        away = np.where(valid[:, None, :], np.abs(numbers[:, None] - numbers), len(numbers))
        nearest = away.argmin(axis=2) + len(numbers) * lines[:, None]
        lost = np.broadcast_to(~valid.any(axis=1, keepdims=True), nearest.shape)
        return anchors, places, np.where(lost, valid.size + lines[:, None], nearest)

    @property
    def _places(self) -> Floats:
        if not self.plan.angles or not self.poses.end > 0:
            return evenly(self.poses.line, ANCHORS).astype(float)
        marks, count = steps_of(self.motion, self.plan)
        parts = [np.linspace(low, high, int(steps), endpoint=False)
                 for low, high, steps in zip(marks[:-1], marks[1:], count.max(axis=0), strict=True)]  # fmt: skip
        return np.concatenate([*parts, marks[-1:]])

    def _at_once(self, sketch: Configuration, places: Floats) -> Configuration:
        line = np.repeat(np.arange(self.lines), len(places))
        return self._solved(line, np.tile(places, self.lines), sketch.take(line))

    def _one_by_one(self, sketch: Configuration, places: Floats) -> Configuration:
        lines, last, every = np.arange(self.lines), sketch, list[Configuration]()
        for place in places:
            there = self._solved(lines, np.full(self.lines, place), last)
            lost = ~there.valid
            if self.plan.iterative and lost.any() and every:
                again = self._solved(
                    lines[lost], np.full(np.count_nonzero(lost), place), sketch.take(lost.nonzero()[0])
                )
                number = lines.copy()
                number[lost] = self.lines + np.arange(np.count_nonzero(lost))
                there = self._joined([there, again]).take(number)
            every.append(there)
            last = there if there.valid.all() else self._joined([last, there]).take(lines + self.lines * there.valid)
        order = np.arange(len(places) * self.lines).reshape(len(places), self.lines).T.ravel()
        return self._joined(every).take(order)

    def _solved(self, line: Ints, s: Floats, start: Configuration) -> Configuration:
        poses, values = inputs(self.motion, self.plan, line, s)
        return self.plan.solve(values, poses.places, start=start, limits=False)

    def _joined(self, parts: Sequence[Configuration]) -> Configuration:
        """Poses one after the other; those of the sketch were solved by another plan, whose closures are others."""

        nominal, names = self.mechanism.nominal, dict.fromkeys(name for part in parts for name in part.places)
        places: dict[str, Value] = {
            name: _whole(parts, [part.places.get(name, nominal[name]) for part in parts]) for name in names
        }
        count = sum(len(part.reason) for part in parts)
        vectors = self.mechanism.geometry.vectors(places)
        anchors = joined([replace(part, closures=()) for part in parts], (count,), vectors, places)
        angles = {angle.name: angle for angle in self.plan.angles} | angles_of(self.plan.structure.given)
        near: dict[str, Value] = {
            name: _whole(parts, [part.value(angle) for part in parts]) for name, angle in angles.items()
        }
        return replace(anchors, near=near)


def _whole(parts: Sequence[Configuration], values: Sequence[Value]) -> Floats:
    """Values of poses, of some parts one after the other."""
    return np.concatenate([np.broadcast_to(value, part.shape) for value, part in zip(values, parts, strict=True)])
