"""Motions over time from the sections of a study, of one design or of many: laws, splines of files, dwells."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from mechdesign.ground.errors import StudyError
from mechdesign.ground.motion_laws import LAWS, Phase, PhaseTable
from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.motion.timed import SAME_TIME, TimedCourse, TimedRows
from mechdesign.study.schema.motions import CourseText
from mechdesign.study.text.csv_files import read_table
from mechdesign.study.text.inputs import Folder
from mechdesign.study.text.reading import APART
from mechdesign.study.text.tables import table_of

# Part of the whole time below which that of a segment is a slip.
SHORTEST = 1e-6


def program(
    motion: Mapping[str, CourseText], instants: int, folder: Folder, value: Callable[[float], Floats]
) -> TimedRows:
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
    return TimedRows(courses, times[:, : counts[0]])


def number_of_instants(
    motion: Mapping[str, CourseText], instants: int, folder: Folder, value: Callable[[float], Floats]
) -> Ints:
    """How many poses the motion of each design has, shape (designs,) or (1,); -1 where it is none."""
    courses = _courses(motion, folder, value)
    wrong = np.zeros(1, dtype=bool)
    for fault, _ in _faults(courses):
        wrong = wrong | fault
    return np.where(wrong, -1, _times(courses, instants)[1])


def _courses(
    motion: Mapping[str, CourseText], folder: Folder, value: Callable[[float], Floats]
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
            courses[name] = TimedCourse(none, none, one, held, none, PhaseTable.of_powers(none[:1]), none[:, :0])
    return courses


def _by_laws(name: str, given: CourseText, value: Callable[[float], Floats]) -> TimedCourse:
    """Moves and dwells one after another."""
    segments = given.segments or ()
    moves = [segment.to for segment in segments if segment.to is not None]
    begin = segments[0].from_
    places = [moves[-1] if begin is None else begin]
    for segment in segments:
        places.append(places[-1] if segment.to is None else segment.to)
    table = table_of([[0.0, places[0]], *([s.duration, to] for s, to in zip(segments, places[1:], strict=True))], value)
    durations, ends = table[:, 1:, 0], np.cumsum(table[..., 0], axis=1)
    which, parts, falling = list[int](), list[Phase](), list[Phase]()
    for k, segment in enumerate(segments):
        rising, other = LAWS[segment.law if segment.to is not None else "constant"].ways
        which += [k] * len(rising)
        parts += rising
        falling += other
    origin: Floats = ends[:, which]
    duration: Floats = durations[:, which]
    begins: Floats = np.array([part.begin for part in parts])
    return TimedCourse(
        origin + begins * duration, origin, duration, table[:, which, 1], np.diff(table[..., 1])[:, which],
        PhaseTable.of([*parts, *falling]), ends[:, 1:],
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
    return TimedCourse(
        begin, begin, steps[None], 0 * one, one, PhaseTable.of_powers(powers), times[None, -1:]
    )  # fmt: skip


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
