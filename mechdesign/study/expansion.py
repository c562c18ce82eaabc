"""Poses as arrays, from lists, sweeps, grids and paths of a study, for its own design or many."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mechdesign.errors import StudyError
from mechdesign.mechanism.elements.declared import Term
from mechdesign.mechanism.model import Description
from mechdesign.motion.paths import PointPath, Polyline, Round, Spline, SplineOfEach
from mechdesign.motion.paths import bends as bends_of
from mechdesign.motion.rows import MAX_POSES, PoseGroup, Poses, by_length, by_time, with_length
from mechdesign.numerics.arrays import Floats, Ints, distinct
from mechdesign.study.schema.motions import Course
from mechdesign.study.schema.paths import CIRCLE_POSES, LINE_POSES, PathSection
from mechdesign.study.schema.poses import INSTANTS, MotionSection, PoseSection, Sweep
from mechdesign.study.text.csv_files import read_table
from mechdesign.study.text.fields import APART
from mechdesign.study.text.inputs import Folder
from mechdesign.study.text.tables import table_of
from mechdesign.study.text.units import Amount
from mechdesign.study.timed import number_of_instants, program


@dataclass(frozen=True, eq=False)
class DesignNumbers:
    """The numbers of a study for some designs."""

    count: int = 1
    # Values that differ from the study's own design, shape (count,): parameters, and places (lengths, radians).
    parameters: Mapping[str, Floats] = field(default_factory=dict)
    places: Mapping[str, Floats] = field(default_factory=dict)
    nominal: Mapping[str, float] = field(default_factory=dict)  # every parameter of the study's own design
    changed: frozenset[str] = frozenset()  # names with values of their own, which no longer follow parameters

    def of(self, number: float) -> Floats:
        """A number of each design, shape (count,)."""
        expression = Amount.of(number).expression
        moved = expression is not None and self.moves(number)
        value = expression.evaluate({**self.nominal, **self.parameters}) if expression and moved else float(number)
        return np.broadcast_to(np.asarray(value, dtype=float), self.count)

    def moves(self, number: float) -> bool:
        """Whether designs differ in a number."""
        expression = Amount.of(number).expression
        return expression is not None and not expression.names.isdisjoint(self.parameters)


OWN = DesignNumbers()
"""Those of the study's own design."""


def sweep_values(sweep: Sweep, numbers: DesignNumbers = OWN) -> Floats:
    """Values of a sweep, both ends included: ``from + k step <= to + 1e-9 step``; shape (designs, poses).

    Raises
    ------
    StudyError
        If they are more than `MAX_POSES`, or a step does not lead from one end to the other.
    """
    begin, end = numbers.of(sweep.from_), numbers.of(sweep.to)
    if sweep.number is not None:
        return np.linspace(begin, end, sweep.number, axis=1)
    assert sweep.step is not None
    step = numbers.of(sweep.step)
    with np.errstate(all="ignore"):
        steps = (end - begin) / step + 1e-9
    if not (steps < MAX_POSES).all():
        raise StudyError(f"a sweep of more than {MAX_POSES} poses; take a larger step")
    if not (steps >= 0).all():
        raise StudyError(f"a step of {step[0]:g} never leads from {begin[0]:g} to {end[0]:g}")
    return begin[:, None] + step[:, None] * np.arange(math.floor(steps.min()) + 1, dtype=np.float64)


def number_of_poses(section: PoseSection, folder: Folder, numbers: DesignNumbers) -> Ints:
    """Numbers of poses that differ from design to design, shape (designs, n); -1 where there is none.

    They are those of each swept coordinate that has a step, or of a motion over time.
    """
    if isinstance(section, MotionSection) and section.motion is not None:
        count = number_of_instants(section.motion, section.instants or INSTANTS, folder, numbers.of)
        return np.broadcast_to(count, numbers.count)[:, None]
    counts = []
    for sweep in (section.sweep or {}).values():
        if sweep.step is not None:
            with np.errstate(all="ignore"):
                span = (numbers.of(sweep.to) - numbers.of(sweep.from_)) / numbers.of(sweep.step)
            counts.append(np.where((span >= -1e-9) & (span < MAX_POSES), np.floor(span + 1e-9), -1.0).astype(np.intp))
    return np.stack(counts, axis=1) if counts else np.zeros((numbers.count, 0), dtype=np.intp)


def expand(section: PoseSection, folder: Folder, numbers: DesignNumbers = OWN) -> Poses | None:
    """Poses of a section for some designs, each as many; None where it gives none, or those of the workspace.

    Files of paths lie in `folder`.

    Raises
    ------
    StudyError
        Where there are too many, or a path's file or lengths are wrong.
    """
    if section.poses:
        poses = _listed(section.poses, numbers)
    elif section.sweep is not None:
        poses = _grid({name: sweep_values(sweep, numbers) for name, sweep in section.sweep.items()})
    elif section.path is not None:
        poses = _path(section.path, folder, numbers)
    elif isinstance(section, MotionSection) and section.motion is not None:
        poses = _timed(section.motion, section.instants or INSTANTS, folder, numbers)
    else:
        return None
    return of_designs(poses, numbers)


def of_designs(poses: Poses, numbers: DesignNumbers) -> Poses:
    """The poses of some designs with the dimensions and parameters in which these differ."""
    per_design = poses.count // numbers.count
    places, parameters = (
        {name: np.repeat(values, per_design) for name, values in part.items()}
        for part in (numbers.places, numbers.parameters)
    )
    return replace(
        poses, designs=numbers.count, places=places, parameters=parameters, nominal=numbers.nominal,
        changed=numbers.changed,
    )  # fmt: skip


def _listed(poses: Sequence[Mapping[str, float]], numbers: DesignNumbers) -> Poses:
    rows: dict[frozenset[str], list[int]] = {}
    for index, pose in enumerate(poses):
        rows.setdefault(frozenset(pose), []).append(index)
    groups = []
    first = len(poses) * np.arange(numbers.count)[:, None]
    for members in rows.values():
        names = tuple(poses[members[0]])
        tables = {name: table_of([[poses[index][name]] for index in members], numbers.of) for name in names}
        values = {name: np.broadcast_to(table[..., 0], (numbers.count, len(members))).ravel()
                  for name, table in tables.items()}  # fmt: skip
        groups.append(PoseGroup(names, values, (first + np.array(members, dtype=np.intp)).ravel()))
    return Poses(tuple(groups), len(poses) * numbers.count, True, (len(poses),))


def _grid(axes: Mapping[str, Floats]) -> Poses:
    """Poses at every combination of values, each of shape (designs, n)."""
    shape = tuple(values.shape[1] for values in axes.values())
    designs, count = next((len(values) for values in axes.values()), 1), math.prod(shape)
    if count > MAX_POSES:
        raise StudyError(f"a grid of {count} poses; at most {MAX_POSES} are possible")
    values = {
        name: np.broadcast_to(column.reshape(designs, *(n if k == axis else 1 for k, n in enumerate(shape))),
                              (designs, *shape)).ravel()
        for axis, (name, column) in enumerate(axes.items())
    }  # fmt: skip
    return Poses.single(values, tuple(n for n in shape if n > 1) or (1,))


def _path(path: Mapping[str, PathSection], folder: Folder, numbers: DesignNumbers) -> Poses:
    if not path:
        raise StudyError("an empty path; give its points, [[x, y], ...]")
    columns: dict[str, Floats] = {}
    points: dict[str, PointPath] = {}
    for name, section in path.items():
        course = _course(name, section, folder, numbers.of)
        if isinstance(course, PointPath):
            points[name] = course
            design = np.repeat(np.arange(numbers.count), course.count)
            places = course.at(design, np.tile(np.arange(course.count, dtype=float), numbers.count))
            places = places.reshape(numbers.count, -1)
            columns[f"{name}.x"], columns[f"{name}.y"] = places.real, places.imag
        else:
            columns[name] = course
    count = max(column.shape[1] for column in columns.values())
    for name, column in columns.items():
        if column.shape[1] not in (1, count):
            raise StudyError(f"path: {name!r} has {column.shape[1]} values where another coordinate has {count}")
    rows = {name: np.broadcast_to(column, (numbers.count, count)) for name, column in columns.items()}
    for owner in {name.rpartition(".")[0] for name in columns if name.endswith(".x")} - set(points):
        if f"{owner}.y" in columns:
            points[owner] = Polyline.through(rows[f"{owner}.x"] + 1j * rows[f"{owner}.y"])
    points = {owner: course for owner, course in points.items() if course.count == count}
    listed = [column for name, column in rows.items() if name.rpartition(".")[0] not in points]
    corners = [course.corners for course in points.values()]
    corners += [bends_of(np.concatenate(listed))] if listed else []
    values = {name: column.ravel() for name, column in rows.items()}
    poses = replace(
        Poses.single(values, (count,)), designs=numbers.count, paths=points,
        corners=distinct(np.concatenate(corners)), motion=count > 1,
    )  # fmt: skip
    if len(with_length(points)) != 1:
        return poses
    line, row = np.divmod(np.arange(poses.count), count)
    slopes, bends = by_length(poses, line, row.astype(float))
    return replace(poses, slopes=slopes, bends=bends)


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
        splines = [Spline.through(place, given.points) for place in places]
        return splines[0] if len(splines) == 1 else SplineOfEach(splines[0].count, splines)
    if table.shape[2] == 1:
        return np.asarray(table[..., 0])
    raise StudyError(f"path: {name!r} needs a list of " + ("[x, y]" if point else "numbers"))


def _timed(motion: Mapping[str, Course], instants: int, folder: Folder, numbers: DesignNumbers) -> Poses:
    """Poses of a motion over time."""
    timed = program(motion, instants, folder, numbers.of)
    count = timed.times.shape[1]
    line = np.repeat(np.arange(numbers.count), count)
    place = np.tile(np.arange(count, dtype=float), numbers.count)
    slopes, bends = by_time(timed, line, place)
    return replace(
        Poses.single({name: timed.at(name, line, place) for name in motion}, (count,)), designs=numbers.count,
        motion=True, corners=timed.corners, program=timed, times=timed.time(line, place), slopes=slopes, bends=bends,
    )  # fmt: skip


def default(description: Description, numbers: DesignNumbers = OWN) -> Poses:
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
            return of_designs(_grid({drive.name: np.linspace(ends[0], ends[1], 51, axis=1)}), numbers)
    if drive.kind == "angle":
        turn = np.broadcast_to(np.linspace(0.0, 2.0 * math.pi / factor, 73), (numbers.count, 73))
        return of_designs(_grid({drive.name: turn}), numbers)
    raise StudyError(
        f"the study says no poses, and the drive {drive.name!r} has no limits to move between; "
        "give 'poses', 'sweep', 'path' or 'motion', or limits of the drive"
    )


def _place(description: Description, term: Term, numbers: DesignNumbers) -> Floats:
    """A number of the geometry of each design, shape (designs,)."""
    value: Floats | float = term if not isinstance(term, str) else description.places[term].nominal
    given = numbers.places.get(term, value) if isinstance(term, str) else value
    return np.broadcast_to(np.asarray(given, dtype=float), numbers.count)
