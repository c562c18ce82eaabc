"""What moves: a mechanism through poses, of one design or of many."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.columns import Column, ColumnKind
from mechdesign.ground.numerals import numeral
from mechdesign.ground.numerics.arrays import Ints
from mechdesign.ground.results import Scope, Table
from mechdesign.mechanism import Configuration, Mechanism, Reason
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.motion.rows import Poses
from mechdesign.motion.rules import TIME
from mechdesign.study.text.units import Units

TIMED = ColumnKind("time", "time from the begin of the motion", "time")
GIVEN = ColumnKind("<coordinate>", "given", "as the coordinate")


@dataclass(frozen=True, eq=False)
class Motion:
    """A mechanism, the units of what is said about it, and its poses."""

    mechanism: Mechanism
    units: Units
    poses: Poses

    def at(self, poses: Poses) -> Motion:
        """The mechanism in other poses."""
        return replace(self, poses=poses)

    def unit_of(self, name: str) -> str:
        """Unit of time, or of a coordinate."""
        return self.units.label("time" if name == TIME else self.mechanism.quantity(name))

    def columns(self, rows: Ints | slice = slice(None)) -> list[Column]:
        """The time of a motion and the coordinates that the study gives, as columns; of these rows of the poses."""
        times, values = self.poses.times, self.poses.values.items()
        timed = [TIMED.column(times[rows], self.unit_of(TIME))] if times is not None else []
        return timed + [GIVEN.column(column[rows], self.unit_of(name), coordinate=name) for name, column in values]

    def in_words(self, row: int, digits: int = 6) -> str:
        """``theta1 = 30 deg, theta2 = 60 deg`` for the pose of a row, with its time along a motion over time."""
        return ", ".join(
            f"{name} = {numeral(values[row], digits)} {self.unit_of(name)}".rstrip()
            for name, values in self.poses.named.items()
            if np.isfinite(values[row])
        )

    def invalid_in_words(self, reason: NDArray[np.int8]) -> str:
        """How many poses are not valid, and why; empty where all are."""
        numbers, counts = np.unique(reason[reason != Reason.OK], return_counts=True)
        whys = [self.mechanism.why(number).partition(":")[0] for number in numbers.tolist()]
        words = [f"{count} {why}" for why, count in zip(whys, counts.tolist(), strict=True)]
        return f"{sum(counts)} of {len(reason)} poses are not valid ({', '.join(words)})" if words else ""

    def of_poses(self, tables: Iterable[Table], reason: NDArray[np.int8]) -> dict[str, Table]:
        """Tables by their names, whose rows speak of the poses alone and not of the motion between them."""
        scope = Scope(poses_only=True, missing=self.invalid_in_words(reason))
        return {table.name: replace(table, scope=scope) for table in tables}


@dataclass(frozen=True, eq=False)
class SolvedPoses:
    """Poses that give the same coordinates, solved; and their rows among all poses of the question."""

    motion: Motion
    rows: Ints
    configuration: Configuration

    @property
    def poses(self) -> Poses:
        """The poses."""
        return self.motion.poses

    @property
    def names(self) -> tuple[str, ...]:
        """What they give."""
        return self.poses.groups[0].names

    def take(self, index: Ints) -> SolvedPoses:
        """Some of the poses."""
        return SolvedPoses(
            self.motion.at(self.poses.take(index)), self.rows[index], self.configuration.take(index)
        )  # fmt: skip


def radians(units: Units, coordinate: Coordinate, value: Value) -> Value:
    """A value in the study's units as the core takes it."""
    return value * units.angle_factor if coordinate.quantity == "angle" else value


def in_study_units(units: Units, coordinate: Coordinate, value: Value) -> Value:
    """A value of the core in the study's units."""
    return value / units.angle_factor if coordinate.quantity == "angle" else value
