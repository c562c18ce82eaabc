"""Poses from the sections of a study: lists, sweeps, grids, paths, motions over time; for its own design or many."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from mechdesign.ground.errors import StudyError
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.mechanism.elements.declared import Term
from mechdesign.mechanism.model import Description
from mechdesign.motion.paths import EvenValues, PointPath, Polyline, Round, Spline
from mechdesign.motion.rows import MAX_POSES, OWN, DesignNumbers, Poses
from mechdesign.motion.rules import GivenRows, GridRows, PathRows, Rows
from mechdesign.study.schema.paths import CIRCLE_POSES, LINE_POSES, PathSection
from mechdesign.study.schema.poses import INSTANTS, MotionSection, PoseSection, SweepText
from mechdesign.study.text.csv_files import read_table
from mechdesign.study.text.inputs import Folder
from mechdesign.study.text.reading import APART
from mechdesign.study.text.tables import table_of
from mechdesign.study.timed import number_of_instants, program


class Motions(dict[str, Poses]):
    """Poses of a study's questions by their commands, each found when it is first asked for.

    A section that gives none has those of the sections that it falls back on, and at last a turn of the drive or its
    limits. Those of the nodes of a workspace are found by who asks for them.
    """

    def __init__(self, sections: Mapping[str, Any], description: Description, folder: Folder) -> None:
        super().__init__()
        self._sections, self._description, self._folder = sections, description, folder

    def __missing__(self, command: str) -> Poses:
        owner = self.owner(command)
        self[command] = self[owner] if owner not in (None, command) else self.of(command)
        return self[command]

    def owner(self, command: str) -> str | None:
        """The section that gives the poses of a command; None where they are assumed."""
        own: PoseSection | None = self._sections.get(command)
        names = (command, *(own.fallbacks if own is not None else ("kinematics",)))
        sections = ((name, self._sections.get(name)) for name in names)
        return next((name for name, section in sections if section is not None and section.source is not None), None)

    def of(self, command: str, numbers: DesignNumbers = OWN) -> Poses:
        """Poses of a command for some designs, each as many.

        Raises
        ------
        StudyError
            Where there are too many, a path's file or lengths are wrong, or nothing sensible can be assumed.
        """
        section = self._sections.get(self.owner(command) or "")
        if section is None:
            rule: Rows = _assumed(self._description, numbers)
        elif section.poses:
            rule = _listed(section.poses, numbers)
        elif section.sweep is not None:
            rule = _grid({name: _axis(sweep, numbers) for name, sweep in section.sweep.items()})
        elif section.path is not None:
            rule = _path(section.path, self._folder, numbers)
        else:
            rule = program(section.motion, section.instants or INSTANTS, self._folder, numbers.of)
        return Poses(rule, numbers)

    def counts(self, command: str, numbers: DesignNumbers) -> Ints:
        """Numbers of poses that differ from design to design, shape (designs, n); -1 where there is none.

        They are those of each swept coordinate that has a step, or of a motion over time.
        """
        section = self._sections.get(self.owner(command) or "")
        if isinstance(section, MotionSection) and section.motion is not None:
            count = number_of_instants(section.motion, section.instants or INSTANTS, self._folder, numbers.of)
            return np.broadcast_to(count, numbers.count)[:, None]
        counts = []
        for sweep in (getattr(section, "sweep", None) or {}).values():
            if sweep.step is not None:
                span = (numbers.of(sweep.to) - numbers.of(sweep.from_)) / numbers.of(sweep.step)
                count = np.where((span >= -1e-9) & (span < MAX_POSES), np.floor(span + 1e-9), -1.0)
                counts.append(count.astype(np.intp))
        return np.stack(counts, axis=1) if counts else np.zeros((numbers.count, 0), dtype=np.intp)


def _axis(sweep: SweepText, numbers: DesignNumbers) -> EvenValues:
    """Values of a sweep, both ends included: ``from + k step <= to + 1e-9 step``.

    Raises
    ------
    StudyError
        If they are more than `MAX_POSES`, or a step does not lead from one end to the other.
    """
    begin, end = numbers.of(sweep.from_), numbers.of(sweep.to)
    if sweep.number is not None:
        return EvenValues.from_to(begin, end, sweep.number)
    assert sweep.step is not None
    step = numbers.of(sweep.step)
    steps = (end - begin) / step + 1e-9
    if not (steps < MAX_POSES).all():
        raise StudyError(f"a sweep of more than {MAX_POSES} poses; take a larger step")
    if not (steps >= 0).all():
        raise StudyError(f"a step of {step[0]:g} never leads from {begin[0]:g} to {end[0]:g}")
    last = math.floor(steps.min())
    return EvenValues(begin, step, begin + last * step, last + 1)


def _listed(poses: Sequence[Mapping[str, float]], numbers: DesignNumbers) -> GivenRows:
    members: dict[frozenset[str], list[int]] = {}
    for index, pose in enumerate(poses):
        members.setdefault(frozenset(pose), []).append(index)
    kinds, number = [tuple(poses[rows[0]]) for rows in members.values()], np.empty(len(poses), dtype=np.intp)
    values = {name: np.full((numbers.count, len(poses)), np.nan) for names in kinds for name in names}
    for k, rows in enumerate(members.values()):
        number[rows] = k
        for name in kinds[k]:
            values[name][:, rows] = table_of([[poses[row][name]] for row in rows], numbers.of)[..., 0]
    columns = {name: column.ravel() for name, column in values.items()}
    return GivenRows(columns, listed=True, shape=(len(poses),), kinds=kinds, number=number)


def _grid(axes: Mapping[str, EvenValues]) -> GridRows:
    """Poses at every combination of values."""
    count = math.prod(axis.count for axis in axes.values())
    if count > MAX_POSES:
        raise StudyError(f"a grid of {count} poses; at most {MAX_POSES} are possible")
    return GridRows(axes)


def _path(path: Mapping[str, PathSection], folder: Folder, numbers: DesignNumbers) -> PathRows:
    if not path:
        raise StudyError("an empty path; give its points, [[x, y], ...]")
    columns: dict[str, Floats] = {}
    points: dict[str, PointPath] = {}
    for name, section in path.items():
        course = _course(name, section, folder, numbers.of)
        if isinstance(course, PointPath):
            points[name] = course
            design, row = np.divmod(np.arange(numbers.count * course.count), course.count)
            places = course.at(design, row.astype(float)).reshape(numbers.count, -1)
            columns[f"{name}.x"], columns[f"{name}.y"] = places.real, places.imag
        else:
            columns[name] = course
    count = max(column.shape[1] for column in columns.values())
    for name, column in columns.items():
        if column.shape[1] not in (1, count):
            raise StudyError(f"path: {name!r} has {column.shape[1]} values where another coordinate has {count}")
    rows = {name: np.broadcast_to(column, (numbers.count, count)) for name, column in columns.items()}
    points = {owner: course for owner, course in points.items() if course.count == count}
    listed = {name: column for name, column in rows.items() if name.rpartition(".")[0] not in points}
    for owner in {name.rpartition(".")[0] for name in listed if name.endswith(".x")}:
        if f"{owner}.y" in listed:
            points[owner] = Polyline.through(rows[f"{owner}.x"] + 1j * rows[f"{owner}.y"])
    return PathRows(numbers.count, count, tuple(columns), points, listed)


def _course(name: str, given: PathSection, folder: Folder, value: Callable[[float], Floats]) -> PointPath | Floats:
    """The path of a point, or the values of a coordinate, shape (designs, count), by the numbers of each design.

    Raises
    ------
    StudyError
        Where a file cannot be read, or what is listed is no such path.
    """
    for form, count, whole in ((given.circle, CIRCLE_POSES, True), (given.arc, LINE_POSES, False)):
        if form is not None:
            x, y, radius, begin, end = map(value, (*form.center, form.radius, form.from_, form.to))
            return Round(given.points or count, x + 1j * y, radius, begin, end, whole)
    if given.line is not None:
        start, stop = (value(x) + 1j * value(y) for x, y in given.line)
        if (start == stop).all():
            raise StudyError(f"path: the line of {name!r} needs two different places")
        return Polyline.through(np.linspace(start, stop, given.points or LINE_POSES, axis=1, dtype=np.complex128))
    point = "." not in name
    if given.file is not None:
        table = read_table(folder, given.file)[None]
    else:
        assert given.through is not None
        table = table_of(given.through, value)
    if point and table.shape[2] == 2:
        places = table[..., 0] + 1j * table[..., 1]
        if not given.spline:
            return Polyline.through(places)
        chords = np.abs(np.diff(places, axis=1))
        if places.shape[1] < 3 or not (chords > APART * chords.sum(axis=1, keepdims=True)).all():
            raise StudyError(f"path: the spline of {name!r} needs three points or more, no two in succession the same")
        # Designs whose points differ are studies of their own.
        return Spline.through(places[0], given.points)
    if table.shape[2] == 1:
        return np.asarray(table[..., 0])
    raise StudyError(f"path: {name!r} needs a list of " + ("[x, y]" if point else "numbers"))


def _assumed(description: Description, numbers: DesignNumbers) -> GridRows:
    """Poses where a study gives none: a turn of an angle drive in 72 steps, or the drive's limits in 50.

    Raises
    ------
    StudyError
        Where nothing sensible can be assumed.
    """
    if len(description.drives) != 1:
        raise StudyError(
            f"the study says no poses, and with {len(description.drives)} drives none can be assumed; "
            "give 'poses', 'sweep', 'path' or 'motion'"
        )
    drive = next(iter(description.drives.values()))
    factor = description.angle_unit if drive.kind == "angle" else 1.0
    for limit in description.limits:
        low, high = limit.min, limit.max
        if limit.kind == "drive" and limit.items[0] == drive.name and low is not None and high is not None:
            ends = [_place(description, end, numbers) / factor for end in (low, high)]
            return GridRows({drive.name: EvenValues.from_to(ends[0], ends[1], 51)})
    if drive.kind == "angle":
        turn = numbers.of(2.0 * math.pi / factor)
        return GridRows({drive.name: EvenValues.from_to(numbers.of(0.0), turn, 73)})
    raise StudyError(
        f"the study says no poses, and the drive {drive.name!r} has no limits to move between; "
        "give 'poses', 'sweep', 'path' or 'motion', or limits of the drive"
    )


def _place(description: Description, term: Term, numbers: DesignNumbers) -> Floats:
    """A number of the geometry of each design, shape (designs,)."""
    value: Floats | float = term if not isinstance(term, str) else description.places[term].nominal
    given = numbers.places.get(term, value) if isinstance(term, str) else value
    return np.broadcast_to(np.asarray(given, dtype=float), numbers.count)
