"""Motions over time as arrays, of one design or of many: coordinates by laws and splines, with their rates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from mechdesign.ground.motion_laws import PhaseTable
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.motion.paths import bends, between
from mechdesign.motion.rules import TIME, Rows

# Times that differ by less than this part of the whole time are the same.
SAME_TIME = 1e-9


@dataclass(frozen=True, eq=False)
class TimedCourse:
    """A coordinate over time, phase by phase: value + rise s(u).

    u is the time from ``origin`` on, over ``duration``. Arrays are of shape (designs, phases), of one design where all
    are alike. The ``table`` has the s of each phase, and behind them those of phases that fall.
    """

    begin: Floats  # time at which each phase begins
    origin: Floats
    duration: Floats
    value: Floats
    rise: Floats
    table: PhaseTable
    marks: Floats  # times at which segments end, shape (designs, segments); none of what is held

    def at(self, line: Ints, phase: Ints, time: Floats, order: int = 0) -> Floats:
        """Value, velocity (order 1) or acceleration (order 2) of some designs at times of phases, all of shape (n,)."""
        own = _row(self.begin, line), phase
        duration, rise = self.duration[own], self.rise[own]
        u = (time - self.origin[own]) / duration
        s = self.table.take(phase + self.begin.shape[1] * (rise < 0)).rise(u, order)
        return np.asarray(rise * s / duration**order + (self.value[own] if order == 0 else 0.0))

    def take(self, designs: Ints) -> TimedCourse:
        """That of some designs."""
        if len(self.begin) == 1:
            return self
        parts = ("begin", "origin", "duration", "value", "rise", "marks")
        return replace(self, **{name: getattr(self, name)[designs] for name in parts})


@dataclass(frozen=True, eq=False)
class TimedRows(Rows):
    """What coordinates do over time, which is even between the rows.

    Parameters
    ----------
    times : ndarray, shape (designs, rows)
        Time of each pose; of one design where all are alike.
    """

    courses: Mapping[str, TimedCourse]
    times: Floats
    timed: ClassVar[bool] = True

    @property
    def grid(self) -> tuple[int, ...]:
        return (self.times.shape[1],)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.courses)

    @cached_property
    def _places(self) -> dict[str, Floats]:
        """Place in rows at which each phase begins, by coordinate, shape (designs, phases); at a row exactly there."""
        rows, places = np.arange(self.times.shape[1], dtype=float), {}
        for name, course in self.courses.items():
            count = max(len(course.begin), len(self.times))
            table = np.empty((count, course.begin.shape[1]))
            for k in range(count):
                begin, times = course.begin[k % len(course.begin)], self.times[k % len(self.times)]
                place = np.interp(begin, times, rows)
                row = np.round(place)
                near = np.abs(times[row.astype(np.intp)] - begin) <= SAME_TIME * times[-1]
                table[k] = np.where(near, row, place)
            places[name] = table
        return places

    @cached_property
    def corners(self) -> Floats:  # type: ignore[override]
        """Places at which it is not smooth: between its phases, and where steps of time change."""
        phases = [places.ravel() for places in self._places.values()]
        return np.unique(np.concatenate([*phases, bends(self.times)]))

    def at(self, line: Ints, s: Ints | Floats) -> dict[str, Floats]:
        return {TIME: self._time(line, s.astype(float)), **self._derivatives(line, s.astype(float), 0)}

    def rates(self, line: Ints, s: Ints | Floats) -> tuple[dict[str, Floats], dict[str, Floats]]:
        return self._derivatives(line, s.astype(float), 1), self._derivatives(line, s.astype(float), 2)

    def _time(self, line: Ints, s: Floats) -> Floats:
        return between(self.times, _row(self.times, line), s)

    def _derivatives(self, line: Ints, s: Floats, order: int) -> dict[str, Floats]:
        """Coordinates, their velocities (order 1) or accelerations (order 2); at a jump what follows it."""
        time = self._time(line, s)
        return {
            name: course.at(line, _phase(places, _row(places, line), s), time, order)
            for (name, course), places in zip(self.courses.items(), self._places.values(), strict=True)
        }

    def pace(self, line: Ints, s: Floats, swept: str | None) -> Floats:
        """Time a row."""
        row = np.clip(np.floor(s), 0, self.times.shape[1] - 2).astype(np.intp)
        return np.asarray(np.diff(self.times)[_row(self.times, line), row])

    def take(self, designs: Ints) -> TimedRows:
        courses = {name: course.take(designs) for name, course in self.courses.items()}
        return TimedRows(courses, self.times[designs] if len(self.times) > 1 else self.times)


def _row(values: Floats, line: Ints) -> Ints:
    """The row of each design; of one design, that of all."""
    return line if len(values) > 1 else np.zeros_like(line)


def _phase(places: Floats, row: Ints, s: Floats) -> Ints:
    """The last phase that begins at each place or before it, by bisection; the first one before all."""
    low, high = np.zeros(len(s), dtype=np.intp), np.full(len(s), places.shape[1])
    for _ in range(places.shape[1].bit_length()):
        middle = (low + high) // 2
        begun = places[row, middle] <= s
        low, high = np.where(begun, middle, low), np.where(begun, high, middle)
    return low
