"""Columns along motions as `mechdesign.statistics.Course` has them: of all designs together, and of one of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.kinematics.along import Along
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.statistics import Asked


def course_of(along: Along, asked: Asked) -> Followed | None:
    """A column over motions or a part of them that was asked for; None where it is not known between the poses."""
    if not along.knows(asked.columns):
        return None
    along = along.part(asked.part) if asked.part else along
    return Followed(along, asked.column) if asked.column in along.columns else None


@dataclass(frozen=True, eq=False)
class Followed:
    """A column over motions, or the same part of each; see `mechdesign.statistics.Course`."""

    along: Along
    name: str

    @property
    def followed(self) -> Flags:
        """Which motions are followed between their poses, shape (designs,)."""
        return ~self.along.curve.spent

    def worst(self, sign: int, *, absolute: bool = False) -> tuple[Floats, Floats]:
        """The largest value times the sign, and its place in rows, shape (designs,)."""
        return self.along.worst(self.name, sign, absolute=absolute)

    def at(self, parts: Floats) -> Floats:
        """Values at parts of the way of each motion, shape (designs, parts); nan where it is not followed."""
        curve = self.along.curve
        line = np.repeat(np.arange(curve.lines), len(parts))
        s = np.tile(parts * curve.poses.end, curve.lines)
        return self.along.functions.interpolated(self.name, line, s).reshape(curve.lines, -1)

    def shown(self, place: float, design: int = 0) -> str:
        """A place of the motion of a design in words."""
        poses = self.along.question.poses
        given = poses.along(np.array([design]), np.array([place])).values
        moving = [poses.swept] if poses.swept is not None else given
        return ", ".join(f"{name} {float(given[name][0]) + 0.0:.6g}" for name in moving)

    def end(self, sign: int) -> Floats:
        """The largest value, or with the sign -1 the smallest."""
        return self._ends[sign]

    @cached_property
    def _ends(self) -> dict[int, Floats]:
        return {sign: self.worst(sign)[0] for sign in (1, -1)}

    def mean(self, power: int) -> Floats:
        """Mean of a power of the values; with a pole in it one of an even power is infinite, and another is nan."""
        return self._mean(np.inf if power % 2 == 0 else np.nan, power)

    def size(self) -> Floats:
        """Mean of the absolute values."""
        return self._mean(np.inf, 1, absolute=True)

    def of(self, design: int) -> OfDesign | None:
        """The column over the motion of one of the designs; None where it is not followed."""
        return OfDesign(self, design) if self.followed[design] else None

    def _mean(self, at_pole: float, power: int, *, absolute: bool = False) -> Floats:
        mean = self.along.mean(self.name, power, absolute=absolute)
        if not self.along.poled(self.name):
            return mean
        return np.where(np.isinf(self.end(1)) | np.isinf(self.end(-1)), at_pole, mean)


@dataclass(frozen=True, eq=False)
class OfDesign:
    """A column over the motion of one design of several; see `mechdesign.statistics.Course`."""

    course: Followed
    design: int

    @property
    def followed(self) -> Flags:
        """Whether the motion is followed between its poses, shape (1,)."""
        return self._own(self.course.followed)

    def worst(self, sign: int, *, absolute: bool = False) -> tuple[Floats, Floats]:
        """The largest value times the sign, and its place in rows, shape (1,)."""
        value, place = self.course.worst(sign, absolute=absolute)
        return self._own(value), self._own(place)

    def at(self, parts: Floats) -> Floats:
        """Values at parts of the way, shape (1, parts)."""
        return self._own(self.course.at(parts))

    def shown(self, place: float) -> str:
        """A place of the motion in words."""
        return self.course.shown(place, self.design)

    def end(self, sign: int) -> Floats:
        """The largest value, or with the sign -1 the smallest."""
        return self._own(self.course.end(sign))

    def mean(self, power: int) -> Floats:
        """Mean of a power of the values."""
        return self._own(self.course.mean(power))

    def size(self) -> Floats:
        """Mean of the absolute values."""
        return self._own(self.course.size())

    def of(self, design: int) -> OfDesign:
        """Itself: there is one design."""
        return self

    def _own(self, values: NDArray[Any]) -> NDArray[Any]:
        return values[self.design : self.design + 1]
