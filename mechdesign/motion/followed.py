"""Columns along motions, of all designs together and of one of them: as requirements, goals and pictures see them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mechdesign.ground.numerals import numeral
from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.ground.numerics.rounding import STILL, cleared
from mechdesign.ground.statistics import Request
from mechdesign.motion.along import AlongMotion


def courses_of(along: AlongMotion, requests: Sequence[Request]) -> list[Followed | None]:
    """Columns along motions or parts of them; None for each without values between the poses."""
    return [_course_of(along, request) for request in requests]


def _course_of(along: AlongMotion, request: Request) -> Followed | None:
    if request.column in along.of_poses or not along.knows(request.columns):
        return None
    along = along.part(request.part) if request.part else along
    return Followed(along, request.column) if request.column in along.columns else None


@dataclass(frozen=True, eq=False)
class Courses:
    """Columns along motions, each followed once for all designs; can be sent to another process.

    Those that are asked together are followed together. `along` gives their functions; None of a motion that cannot be
    followed.
    """

    along: Callable[[Sequence[Request]], AlongMotion | None]
    _followed: dict[Request, Followed | None] = field(default_factory=dict)

    def __call__(self, requests: Sequence[Request]) -> list[Followed | None]:
        """Columns along the motions; None for each without values between the poses."""
        if new := [request for request in requests if request not in self._followed]:
            along = self.along(new)
            courses = [None] * len(new) if along is None else courses_of(along, new)
            self._followed.update(zip(new, courses, strict=True))
        return [self._followed[request] for request in requests]


@dataclass(frozen=True, eq=False)
class Followed:
    """A column over motions of all designs or of one, or the same part of each.

    `largest` has, by sign, the largest values of all designs times the sign, once they are asked for.
    """

    along: AlongMotion
    name: str
    design: int | None = None
    largest: dict[int, Floats] = field(default_factory=dict)

    @property
    def _designs(self) -> slice:
        return slice(None) if self.design is None else slice(self.design, self.design + 1)

    @property
    def followed(self) -> Flags:
        """Which motions are followed between their poses, shape (designs,)."""
        return ~self.along.curve.spent[self._designs]

    @property
    def rounding(self) -> float:
        """Values up to this are rounding."""
        return STILL * self.along.functions.size(self.name)

    @property
    def lost(self) -> Floats:
        """Part of each motion on which it has no value, shape (designs,)."""
        return self.along.lost(self.name)[self._designs]

    def worst(self, sign: int, *, absolute: bool = False) -> tuple[Floats, Floats]:
        """The largest value times the sign, and its place in rows, shape (designs,)."""
        value, place = self.along.worst(self.name, sign, absolute=absolute)
        return value[self._designs], place[self._designs]

    def at(self, parts: Floats) -> Floats:
        """Values at parts of the way of each motion, shape (designs, parts); nan where it is not followed."""
        curve = self.along.curve
        lines = np.arange(curve.lines)[self._designs]
        line, s = np.repeat(lines, len(parts)), np.tile(parts * curve.poses.end, len(lines))
        return self.along.functions.interpolated(self.name, line, s).reshape(-1, len(parts))

    def pose(self, place: float) -> dict[str, float]:
        """What the poses give at a place of the motion of the first design; 0 for rounding beside the other poses."""
        every = self.along.curve.poses
        poses = every.along(np.array([self.design or 0]), np.array([place]))
        largest = {name: np.fmax.reduce(np.abs(values), initial=0.0) for name, values in every.named.items()}
        return {name: float(cleared(value[:1], STILL * largest[name])[0]) + 0.0 for name, value in poses.named.items()}

    def shown(self, place: float) -> str:
        """A place of the motion of the first design in words."""
        swept, coordinates = self.along.curve.poses.swept, self.pose(place)
        return ", ".join(f"{name} {numeral(coordinates[name])}" for name in (coordinates if swept is None else [swept]))

    def end(self, sign: int) -> Floats:
        """The largest value, or with the sign -1 the smallest."""
        if sign not in self.largest:
            self.largest[sign] = self.along.worst(self.name, sign)[0]
        return self.largest[sign][self._designs]

    def mean(self, power: int) -> Floats:
        """Mean of a power of the values; where it has no integral an even one is infinite, and another nan."""
        return self.along.mean(self.name, power)[self._designs]

    def size(self) -> Floats:
        """Mean of the absolute values; infinite where they have no integral."""
        return self.along.mean(self.name, absolute=True)[self._designs]

    @property
    def means_over(self) -> str:
        """What means are over, in words; empty where it is time, or there is none."""
        return self.along.means_over

    def of(self, design: int) -> Followed | None:
        """The column over the motion of one of the designs; None where it is not followed."""
        return replace(self, design=(self.design or 0) + design) if self.followed[design] else None
