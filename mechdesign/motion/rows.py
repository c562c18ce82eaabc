"""Poses at which a question is asked: lists, sweeps, grids and paths as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, TypeVar

import numpy as np

from mechdesign.expressions import Number
from mechdesign.motion.paths import PointPath, between
from mechdesign.motion.timed import MotionProgram
from mechdesign.numerics.arrays import Complexes, Floats, Ints
from mechdesign.study.text import fields
from mechdesign.study.text.units import Amount

MAX_POSES = 10_000_000
# What is swept along a motion over time.
TIME = "time"
_Section = TypeVar("_Section", bound=fields.Model)


@dataclass(frozen=True, eq=False)
class PoseGroup:
    """Poses that give the same coordinates, as many as the mobility."""

    names: tuple[str, ...]
    values: Mapping[str, Floats]  # in the study's units, shape (n,)
    rows: Ints  # place of each pose in the study's order, shape (n,)

    def columns(self) -> list[Floats]:
        """Values in the order of the names."""
        return [self.values[name] for name in self.names]


class Sector(NamedTuple):
    """Rays of one patch of a workspace, which turn on from one to the next, and the nodes of a finer map over it."""

    rays: slice  # of the poses' grid
    about: complex  # where the rays begin
    nodes: Complexes  # of the finer map, shape (n, nodes), on rays that begin and end with the patch


class Sectors(NamedTuple):
    """The patches of a region of the workspace, and the curves of its boundary."""

    patches: tuple[Sector, ...]
    outline: tuple[Complexes, ...]


@dataclass(frozen=True, eq=False)
class Poses:
    """All poses of a question; of several designs, one design's after the other's."""

    groups: tuple[PoseGroup, ...]  # one, unless listed poses give different coordinates
    count: int  # number of poses over all groups
    listed: bool  # whether a person listed these very poses, so that one that fails is an error
    grid: tuple[int, ...]  # number of values of each swept coordinate, the last fastest; one number for lists and paths
    designs: int = 1  # each has as many poses
    # Where designs differ from the study's own, shape (count,): dimensions (lengths, radians), and parameters in the
    # study's units.
    places: Mapping[str, Floats] = field(default_factory=dict)
    parameters: Mapping[str, Floats] = field(default_factory=dict)
    nominal: Mapping[str, float] = field(default_factory=dict)  # every parameter of the study's own design
    changed: frozenset[str] = frozenset()  # names of what is changed itself, and so follows nothing
    motion: bool = False  # whether they are passed one after the other: a sweep of one coordinate, or a path
    # Paths of points, by point. Other coordinates change evenly from pose to pose.
    paths: Mapping[str, PointPath] = field(default_factory=dict)
    corners: Floats = field(default_factory=lambda: np.empty(0))  # places of a motion that are not smooth, in rows
    program: MotionProgram | None = None  # of a motion over time
    times: Floats | None = None  # of its poses, in the study's unit, shape (count,)
    # Along the path of a point, or over time, shape (count,): first and second derivative of every coordinate given by
    # the path's length or by time, in the study's units; nan where the path has no direction.
    slopes: Mapping[str, Floats] = field(default_factory=dict)
    bends: Mapping[str, Floats] = field(default_factory=dict)
    # Of a grid of rays over a workspace: one a value of its held coordinates.
    regions: tuple[Sectors, ...] = ()
    # Of some poses of a motion or grid: their rows among all, or their places between these.
    rows: Ints | Floats | None = None

    @classmethod
    def single(cls, values: Mapping[str, Floats], grid: tuple[int, ...] = ()) -> Poses:
        """Poses of one motion, or of a grid, that give the same coordinates, each of shape (count,)."""
        count = len(next(iter(values.values()), (0,)))
        group, grid = PoseGroup(tuple(values), values, np.arange(count)), grid or (count,)
        return cls((group,), count, False, grid, motion=len(grid) == 1 and count > 1)

    @property
    def names(self) -> tuple[str, ...]:
        """Every coordinate that some pose gives, in the order of the study."""
        return tuple(dict.fromkeys(name for group in self.groups for name in group.names))

    @property
    def values(self) -> dict[str, Floats]:
        """Every coordinate over all poses, shape (count,); nan where a pose does not give it."""
        if len(self.groups) == 1:
            return dict(self.groups[0].values)
        columns = {name: np.full(self.count, np.nan) for name in self.names}
        for group in self.groups:
            for name in group.names:
                columns[name][group.rows] = group.values[name]
        return columns

    @property
    def named(self) -> dict[str, Floats]:
        """Time along a motion over time, and every coordinate, over all poses, shape (count,)."""
        return {**({} if self.times is None else {TIME: self.times}), **self.values}

    @property
    def line(self) -> int:
        """Poses that follow one another: those of a motion, or of a line of a grid along its last coordinate."""
        return self.grid[-1]

    @property
    def closed(self) -> bool:
        """Whether the motion goes on from the last pose to the first."""
        return any(path.closed for path in self.paths.values())

    @property
    def end(self) -> int:
        """Last place of a motion or a line, in rows."""
        return self.line - 1 + self.closed

    def along(self, line: Ints, s: Floats) -> Poses:
        """Poses at places of some lines, in rows from 0 to `end`; beyond these the motion goes on straight or round.

        Parameters
        ----------
        line, s : ndarray, shape (n,)
            The lines are numbered design by design.
        """
        (group,) = self.groups
        values = {}
        for name in group.names:
            owner, _, axis = name.rpartition(".")
            if self.program is not None:
                values[name] = self.program.at(name, line, s)
            elif owner in self.paths and axis in ("x", "y"):
                place = self.paths[owner].at(line, s)
                values[name] = place.real if axis == "x" else place.imag
            else:
                rows = group.values[name].reshape(-1, self.line)
                rows = np.concatenate([rows, rows[:, :1]], axis=1) if self.closed else rows
                values[name] = between(rows, line, s)
        first = line * self.line
        places, parameters = (
            {name: column[first] for name, column in part.items()} for part in (self.places, self.parameters)
        )
        poses = Poses(
            (PoseGroup(group.names, values, np.arange(len(s))),), len(s), False, (len(s),), places=places,
            parameters=parameters, nominal=self.nominal,
        )  # fmt: skip
        if self.program is not None:
            poses = replace(poses, times=self.program.time(line, s))
            slopes, bends = by_time(self.program, line, s)
        elif self.slopes:
            slopes, bends = by_length(self, line, s)
        else:
            return poses
        return replace(poses, slopes=slopes, bends=bends)

    def of(self, number: float, rows: Ints | slice = slice(None)) -> Number:
        """A number of the study at some poses: an array where it follows parameters in which designs differ."""
        expression = number.expression if isinstance(number, Amount) else None
        if expression is None or expression.names.isdisjoint(self.parameters):
            return float(number)
        env = {name: self.parameters[name][rows] if name in self.parameters else self.nominal[name]
               for name in expression.names}  # fmt: skip
        return expression.evaluate(env)

    def section(self, section: _Section, rows: Ints | slice = slice(None)) -> _Section:
        """A section of the study with the numbers of some poses, arrays where designs differ in them."""
        return section.with_numbers(lambda number: self.of(number, rows)) if self.parameters else section

    @property
    def followed(self) -> bool:
        """Whether they are those of motions, a line each, of which something can be said between the poses."""
        return not self.listed and len(self.grid) == 1 and self.line > 1 and not self.regions

    @property
    def swept(self) -> str | None:
        """Time, or the one coordinate that moves along a motion; None of listed poses, and where several do."""
        if self.listed:
            return None
        if self.times is not None:
            return TIME
        moving = self.moving
        return moving[0] if len(moving) == 1 else None

    @property
    def abscissa(self) -> Floats:
        """What is swept, at each pose, or the row of the pose; shape (count,)."""
        if self.times is not None:
            return self.times
        return self.numbers if self.swept is None else self.values[self.swept]

    @property
    def moving(self) -> list[str]:
        """Coordinates that change from pose to pose of a design."""
        columns = {name: values.reshape(self.designs, -1) for name, values in self.values.items()}
        return [name for name, values in columns.items() if (np.ptp(values, axis=1) > 0).any()]

    @property
    def path(self) -> str | None:
        """The point along the length of whose path means are; None where there is no one such point."""
        moving = with_length(self.paths)
        return moving[0][0] if len(moving) == 1 and self.program is None else None

    def pace(self, line: Ints, s: Floats, of: str | None = None) -> Floats:
        """How fast a motion passes places, shape (n,): change of time, of a path's length or of what is swept, a row.

        Means along the motion are by these; where several coordinates move without a path they are by rows, unless `of`
        says which of them counts.
        """
        swept = self.swept or of
        if self.program is not None:
            return self.program.pace(line, s)
        if self.path is not None:
            return self.paths[self.path].course(line, s)[2]
        if swept is None:
            return np.ones(len(s))
        rows = self.groups[0].values[swept].reshape(-1, self.line)
        return np.asarray(np.abs(np.diff(rows, axis=1))[line, np.clip(np.floor(s), 0, self.line - 2).astype(np.intp)])

    @property
    def numbers(self) -> Floats:
        """The row of each pose among those of its design, shape (count,)."""
        if self.rows is not None:
            return self.rows.astype(float)
        return np.tile(np.arange(self.count // self.designs, dtype=float), self.designs)

    def some(self, designs: Ints) -> Poses:
        """The poses of some designs."""
        per_design = self.count // self.designs
        rows = (per_design * designs[:, None] + np.arange(per_design)).ravel()
        first = per_design * np.arange(len(designs))[:, None]
        groups = []
        for group in self.groups:
            values = {name: v.reshape(self.designs, -1)[designs].ravel() for name, v in group.values.items()}
            own = group.rows[: len(group.rows) // self.designs]
            groups.append(PoseGroup(group.names, values, (first + own).ravel()))
        return replace(
            self, groups=tuple(groups), count=len(rows), designs=len(designs),
            paths={owner: path.take(designs) for owner, path in self.paths.items()},
            program=None if self.program is None else self.program.take(designs), **self._columns(rows),
        )  # fmt: skip

    def take(self, rows: Ints | slice) -> Poses:
        """Some poses of a motion or a grid of one design, in their order."""
        (group,) = self.groups
        taken = np.arange(rows.start, rows.stop) if isinstance(rows, slice) else rows
        values, count = {name: column[rows] for name, column in group.values.items()}, len(taken)
        return replace(
            self, groups=(PoseGroup(group.names, values, np.arange(count)),), count=count, grid=(count,), rows=taken,
            **self._columns(rows),
        )  # fmt: skip

    def _columns(self, rows: Ints | slice) -> dict[str, Any]:
        """What some poses have besides the coordinates that they give."""
        parts = {key: getattr(self, key) for key in ("places", "parameters", "slopes", "bends")}
        columns = {key: {name: column[rows] for name, column in part.items()} for key, part in parts.items()}
        return {**columns, "times": self.times[rows] if self.times is not None else None}


def with_length(points: Mapping[str, PointPath]) -> list[tuple[str, PointPath]]:
    """Paths that have a length: the way of a point that stays where it is says nothing."""
    first = np.zeros(1, dtype=np.intp)
    return [(owner, course) for owner, course in points.items()
            if course.way(first, np.array([course.count - 1.0]))[0] > 0]  # fmt: skip


def by_length(poses: Poses, line: Ints, s: Floats) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Derivatives of what poses give by the length of a point's path, at places in rows: `slopes` and `bends`."""
    (group,) = poses.groups
    ((owner, course),) = with_length(poses.paths)
    way = course.lengths(poses.designs)
    slopes: dict[str, Floats] = {}
    for name, column in group.values.items():
        rows = column.reshape(poses.designs, -1)
        # What is listed along with the point's path changes evenly between the places.
        with np.errstate(divide="ignore", invalid="ignore"):
            rise = np.diff(np.concatenate([rows, rows[:, :1]], axis=1) if poses.closed else rows, axis=1)
            steps = np.where(rise == 0, 0.0, rise / way)
        slopes[name] = steps[line, np.clip(np.floor(s), 0, steps.shape[1] - 1).astype(np.intp)]
    slopes_of_point, bends_of_point, _ = course.course(line, s)
    bends = dict.fromkeys(group.names, np.zeros(len(s)))
    for axis, part in (("x", np.real), ("y", np.imag)):
        slopes[f"{owner}.{axis}"] = part(slopes_of_point).copy()
        bends[f"{owner}.{axis}"] = part(bends_of_point).copy()
    return slopes, bends


def by_time(program: MotionProgram, line: Ints, s: Floats) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Derivatives of what poses give by time, at places in rows: `slopes` and `bends`."""
    slopes, bends = ({name: program.at(name, line, s, order) for name in program.courses} for order in (1, 2))
    return slopes, bends
