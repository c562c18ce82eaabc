"""Motions over time as arrays, of one design or of many: coordinates by laws and splines, with their rates."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mechdesign.errors import StudyError
from mechdesign.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.study.point_paths import bends, between, table_of
from mechdesign.study.schema.motion_laws import LAWS, Phase
from mechdesign.study.schema.motions import Course
from mechdesign.study.text.csv_files import read_table
from mechdesign.study.text.fields import APART
from mechdesign.study.text.inputs import Folder

# Times that differ by less than this part of the whole time are the same.
SAME_TIME = 1e-9
# Part of the whole time below which that of a segment is a slip.
SHORTEST = 1e-6


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


def program(
    motion: Mapping[str, Course], instants: int, folder: Folder, value: Callable[[float], Floats]
) -> MotionProgram:
    """The motion of coordinates at so many instants evenly in time, and at the ends of their segments.

    Parameters
    ----------
    value : callable
        A number of the study for each design, shape (designs,), all with as many poses.

    Raises
    ------
    StudyError
        Where a file cannot be read, nothing moves, or the coordinates do not end together.
    """
    courses = _courses(motion, folder, value)
    for wrong, message in _faults(courses):
        if wrong.any():
            raise StudyError(message)
    times, counts = _times(courses, instants)
    return MotionProgram(courses, times[:, : counts[0]])


def number_of_instants(
    motion: Mapping[str, Course], instants: int, folder: Folder, value: Callable[[float], Floats]
) -> Ints:
    """How many poses the motion of each design has, shape (designs,) or (1,); -1 where it is none."""
    courses = _courses(motion, folder, value)
    wrong = np.zeros(1, dtype=bool)
    for fault, _ in _faults(courses):
        wrong = wrong | fault
    return np.where(wrong, -1, _times(courses, instants)[1])


def _courses(
    motion: Mapping[str, Course], folder: Folder, value: Callable[[float], Floats]
) -> dict[str, TimedCourse]:  # fmt: skip
    courses = {}
    for name, given in motion.items():
        if given.segments is not None:
            courses[name] = _by_laws(name, given, value)
        elif given.file is not None:
            courses[name] = _spline(folder, given.file)
        else:
            assert given.held is not None
            held = table_of([[given.held]], value)[..., 0]
            one, none = np.ones_like(held), np.zeros_like(held)
            courses[name] = TimedCourse(none, none, one, held, none, none[:1], *_still(1), none[:, :0])
    return courses


def _by_laws(name: str, given: Course, value: Callable[[float], Floats]) -> TimedCourse:
    """Moves and dwells one after another."""
    segments = given.segments or ()
    moves = [segment.to for segment in segments if segment.to is not None]
    begin = segments[0].from_
    places = [moves[-1] if begin is None else begin]
    for segment in segments:
        places.append(places[-1] if segment.to is None else segment.to)
    table = table_of([[0.0, places[0]], *([s.duration, to] for s, to in zip(segments, places[1:], strict=True))], value)
    durations, ends = table[:, 1:, 0], np.cumsum(table[..., 0], axis=1)
    which, parts = list[int](), list[Phase]()
    for k, segment in enumerate(segments):
        own = LAWS[segment.law].phases if segment.to is not None else LAWS["constant"].phases
        which += [k] * len(own)
        parts += own
    widest = max(len(part.powers) for part in parts)
    powers = np.array([[*part.powers, *[0.0] * (widest - len(part.powers))] for part in parts])
    waves = np.array([part.wave for part in parts], dtype=complex)
    frequencies = np.array([part.frequency for part in parts], dtype=float)
    origin: Floats = ends[:, which]
    duration: Floats = durations[:, which]
    begins: Floats = np.array([part.begin for part in parts])
    return TimedCourse(
        origin + begins * duration, origin, duration, table[:, which, 1], np.diff(table[..., 1])[:, which], powers,
        waves, frequencies, ends[:, 1:],
    )  # fmt: skip


def _spline(folder: Folder, file: str) -> TimedCourse:
    """A cubic spline through the times and values of a file, periodic where the last value is the first."""
    from scipy.interpolate import CubicSpline

    table = read_table(folder, file)
    if table.shape[1] != 2 or len(table) < 3:
        raise StudyError(f"{file} is no motion over time: that has a time and a value a line, and three lines or more")
    times, values = table[:, 0] - table[0, 0], table[:, 1]
    late = np.flatnonzero(~(np.diff(times) > APART * times[-1]))
    if len(late):
        k = int(late[0])
        raise StudyError(f"{file}: the times do not rise, {table[k, 0]:.12g} is followed by {table[k + 1, 0]:.12g}")
    curve = CubicSpline(times, values, bc_type="periodic" if values[0] == values[-1] else "not-a-knot")
    steps = np.diff(times)
    powers = curve.c[::-1].T * steps[:, None] ** np.arange(4)
    begin, one = times[None, :-1], np.ones((1, len(steps)))
    return TimedCourse(begin, begin, steps[None], 0 * one, one, powers, *_still(len(steps)), times[None, -1:])


def _still(phases: int) -> tuple[Complexes, Floats]:
    """Waves, and their frequencies, of phases without any."""
    return np.zeros(phases, dtype=complex), np.ones(phases)


def _faults(courses: Mapping[str, TimedCourse]) -> Iterator[tuple[Flags, str]]:
    """What keeps courses from being one motion: in which designs, shape (designs,) or (1,), and why."""
    moving = {name: course for name, course in courses.items() if course.marks.shape[1]}
    if not moving:
        text = f"{' and '.join(courses)} stand still: a motion has a coordinate that moves, or a file"
        yield np.ones(1, dtype=bool), text
        return
    (first, one), *others = moving.items()
    end = one.marks[:, -1]
    for name, course in others:
        last = course.marks[:, -1]
        yield (
            np.asarray(np.abs(last - end) > SAME_TIME * end),
            f"{first!r} ends after {end[0]:.9g} and {name!r} after {last[0]:.9g}, and all of a motion end at the same "
            "time; a dwell fills what is missing",
        )
    for name, course in moving.items():
        steps = np.diff(course.marks, axis=1, prepend=0.0)
        yield (
            np.asarray((steps < SHORTEST * course.marks[:, -1:]).any(axis=1)),
            f"{name!r} has a segment of less than {SHORTEST:g} of the whole time, {course.marks[0, -1]:.9g}",
        )


def _times(courses: Mapping[str, TimedCourse], instants: int) -> tuple[Floats, Ints]:
    """Times of the poses of each design, shape (designs, n), and how many they are; others are infinite."""
    marks = _aligned([course.marks for course in courses.values() if course.marks.shape[1]])
    marks = np.sort(np.concatenate([np.zeros((len(marks), 1)), marks], axis=1), axis=1)
    end = marks[:, -1:].copy()
    marks[:, 1:][np.diff(marks, axis=1) <= SAME_TIME * end] = np.inf
    even = np.linspace(0.0, 1.0, instants) * end
    near = np.clip(np.round(np.where(np.isfinite(marks), marks, 0.0) / end * (instants - 1)), 0, instants - 1)
    lane, mark = np.nonzero(np.isfinite(marks))
    row = near[lane, mark].astype(np.intp)
    same = np.abs(even[lane, row] - marks[lane, mark]) <= SAME_TIME * end[lane, 0]
    even[lane[same], row[same]] = np.inf
    times = np.sort(np.concatenate([even, marks], axis=1), axis=1)
    counts = np.count_nonzero(np.isfinite(times), axis=1)
    return times, counts


def _aligned(parts: Sequence[Floats]) -> Floats:
    """Arrays of shape (designs, n) side by side; those of one design are that of all."""
    count = max(map(len, parts))
    return np.concatenate([np.broadcast_to(part, (count, part.shape[1])) for part in parts], axis=1)
