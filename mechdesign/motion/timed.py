"""Motions over time as arrays, of one design or of many: coordinates by laws and splines, with their rates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mechdesign.motion.paths import bends, between
from mechdesign.numerics.arrays import Complexes, Floats, Ints

# Times that differ by less than this part of the whole time are the same.
SAME_TIME = 1e-9


@dataclass(frozen=True, eq=False)
class TimedCourse:
    """A coordinate over time, phase by phase: value + rise s(u), by a law's phases `schema.motion_laws.Phase`.

    u is the time from ``origin`` on, over ``duration``. Arrays are of shape (designs, phases), of one design where all
    are alike.
    """

    begin: Floats  # time at which each phase begins
    origin: Floats
    duration: Floats
    value: Floats
    rise: Floats
    powers: Floats  # shape (phases, powers)
    waves: Complexes  # shape (phases,)
    frequencies: Floats
    marks: Floats  # times at which segments end, shape (designs, segments); none of what is held

    def at(self, line: Ints, phase: Ints, time: Floats, order: int = 0) -> Floats:
        """Value, velocity (order 1) or acceleration (order 2) of some designs at times of phases, all of shape (n,)."""
        own = _row(self.begin, line), phase
        duration, powers = self.duration[own], self.powers[phase]
        u = (time - self.origin[own]) / duration
        for _ in range(order):
            powers = powers[:, 1:] * np.arange(1, powers.shape[1])
        s = np.zeros(len(u))
        for column in powers.T[::-1]:
            s = s * u + column
        if self.waves.any():
            frequency = self.frequencies[phase]
            s += (self.waves[phase] * 1j**order * np.exp(1j * frequency * u)).imag * frequency ** (order - 1.0)
        return np.asarray(self.rise[own] * s / duration**order + (self.value[own] if order == 0 else 0.0))

    def take(self, designs: Ints) -> TimedCourse:
        """That of some designs."""
        if len(self.begin) == 1:
            return self
        parts = ("begin", "origin", "duration", "value", "rise", "marks")
        return replace(self, **{name: getattr(self, name)[designs] for name in parts})


@dataclass(frozen=True, eq=False)
class MotionProgram:
    """What coordinates do over time; functions of the place along the motion, in rows from 0, which is even in time
    between the rows.

    Parameters
    ----------
    times : ndarray, shape (designs, rows)
        Time of each pose; of one design where all are alike.
    """

    courses: Mapping[str, TimedCourse]
    times: Floats

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
    def corners(self) -> Floats:
        """Places at which a motion is not smooth: between its phases, and where steps of time change."""
        phases = [places.ravel() for places in self._places.values()]
        return np.unique(np.concatenate([*phases, bends(self.times)]))

    def time(self, line: Ints, s: Floats) -> Floats:
        """Time at places of some designs, both of shape (n,)."""
        return between(self.times, _row(self.times, line), s)

    def at(self, name: str, line: Ints, s: Floats, order: int = 0) -> Floats:
        """A coordinate, its velocity (order 1) or acceleration (order 2) there; of a jump what follows."""
        places = self._places[name]
        return self.courses[name].at(line, _phase(places, _row(places, line), s), self.time(line, s), order)

    def pace(self, line: Ints, s: Floats) -> Floats:
        """Time a row."""
        row = np.clip(np.floor(s), 0, self.times.shape[1] - 2).astype(np.intp)
        return np.asarray(np.diff(self.times)[_row(self.times, line), row])

    def take(self, designs: Ints) -> MotionProgram:
        """That of some designs."""
        courses = {name: course.take(designs) for name, course in self.courses.items()}
        return MotionProgram(courses, self.times[designs] if len(self.times) > 1 else self.times)


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
