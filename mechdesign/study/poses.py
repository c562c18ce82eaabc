"""Poses at which a question is asked: lists, sweeps, grids and paths as arrays."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mechdesign.errors import StudyError
from mechdesign.mechanism.model import Description
from mechdesign.numerics.arrays import Complexes, Floats, Ints
from mechdesign.study.schema import paths
from mechdesign.study.schema.paths import PointPath, Polyline, between
from mechdesign.study.schema.poses import PoseSection, Sweep
from mechdesign.study.text.inputs import Folder

MAX_POSES = 10_000_000


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
    motion: bool = False  # whether they are passed one after the other: a sweep of one coordinate, or a path
    # Paths of points, by point. Other coordinates change evenly from pose to pose.
    paths: Mapping[str, PointPath] = field(default_factory=dict)
    corners: Floats = field(default_factory=lambda: np.empty(0))  # places of a motion that are not smooth, in rows
    # Along the path of a point, shape (count,): first and second derivative of every coordinate given by the path's
    # length, in the study's units; nan where the path has no direction.
    slopes: Mapping[str, Floats] = field(default_factory=dict)
    bends: Mapping[str, Floats] = field(default_factory=dict)
    # Of a grid of rays over a workspace: one a value of its held coordinates.
    regions: tuple[Sectors, ...] = ()
    rows: Ints | None = None  # of some poses of a long motion or grid: their rows among all

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
            if owner in self.paths and axis in ("x", "y"):
                place = self.paths[owner].at(s)
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
            parameters=parameters,
        )  # fmt: skip
        if not self.slopes:
            return poses
        slopes, bends = _by_length(self.groups[0], self.paths, self.closed, s)
        return replace(poses, slopes=slopes, bends=bends)

    @property
    def followed(self) -> bool:
        """Whether they are those of motions, a line each, of which something can be said between the poses."""
        return not self.listed and len(self.grid) == 1 and self.line > 1 and not self.regions

    @property
    def swept(self) -> str | None:
        """The one coordinate that moves along a motion; None of listed poses, and where several do."""
        if self.listed:
            return None
        moving = [name for name, values in self.values.items() if np.ptp(values) > 0]
        return moving[0] if len(moving) == 1 else None

    def pace(self, line: Ints, s: Floats) -> Floats:
        """How fast a motion passes places, shape (n,): length of a point's path a row, or change of what is swept.

        Means along the motion are by these; where several coordinates move without a path they are by rows.
        """
        moving = _moving(self.paths)
        if len(moving) == 1:
            return moving[0][1].course(s)[2]
        if self.swept is None:
            return np.ones(len(s))
        rows = self.groups[0].values[self.swept].reshape(-1, self.line)
        return np.asarray(np.abs(np.diff(rows, axis=1))[line, np.clip(np.floor(s), 0, self.line - 2).astype(np.intp)])

    @property
    def numbers(self) -> Floats:
        """The row of each pose among those of its design, shape (count,)."""
        if self.rows is not None:
            return self.rows.astype(float)
        return np.tile(np.arange(self.count // self.designs, dtype=float), self.designs)

    def take(self, rows: Ints | slice) -> Poses:
        """Some poses of a motion or a grid of one design, in their order."""
        (group,) = self.groups
        parts = (group.values, self.places, self.parameters, self.slopes, self.bends)
        values, places, parameters, slopes, bends = (
            {name: column[rows] for name, column in part.items()} for part in parts
        )
        taken = np.arange(rows.start, rows.stop) if isinstance(rows, slice) else rows
        count = len(taken)
        return replace(
            self, groups=(PoseGroup(group.names, values, np.arange(count)),), count=count, grid=(count,),
            places=places, parameters=parameters, slopes=slopes, bends=bends, rows=taken,
        )  # fmt: skip


def stacked(poses: Poses, designs: int, places: Mapping[str, ArrayLike], parameters: Mapping[str, ArrayLike]) -> Poses:
    """The same poses of several designs; places and parameters of shape (designs,)."""

    def each(values: Mapping[str, ArrayLike]) -> dict[str, Floats]:
        return {
            name: np.repeat(np.broadcast_to(np.asarray(value, dtype=float), designs), poses.count)
            for name, value in values.items()
        }

    first = poses.count * np.arange(designs)[:, None]
    groups = tuple(
        PoseGroup(
            group.names, {name: np.tile(v, designs) for name, v in group.values.items()}, (first + group.rows).ravel()
        )
        for group in poses.groups
    )
    count = poses.count * designs
    slopes, bends = ({name: np.tile(v, designs) for name, v in part.items()} for part in (poses.slopes, poses.bends))
    return replace(
        poses, groups=groups, count=count, designs=designs, places=each(places), parameters=each(parameters),
        slopes=slopes, bends=bends,
    )  # fmt: skip


def sweep_values(sweep: Sweep) -> Floats:
    """Values of a sweep, both ends included: ``from + k step <= to + 1e-9 step``.

    Raises
    ------
    StudyError
        If they are more than `MAX_POSES`.
    """
    if sweep.number is not None:
        return np.linspace(sweep.from_, sweep.to, sweep.number)
    assert sweep.step is not None
    steps = (sweep.to - sweep.from_) / sweep.step + 1e-9
    if not steps < MAX_POSES:
        raise StudyError(f"a sweep of more than {MAX_POSES} poses")
    return sweep.from_ + sweep.step * np.arange(math.floor(steps) + 1, dtype=np.float64)


def expand(section: PoseSection, folder: Folder) -> Poses | None:
    """Poses of a section, None where it gives none, or those of the workspace; files of paths lie in `folder`.

    Raises
    ------
    StudyError
        Where there are too many, or a path's file or lengths are wrong.
    """
    if section.poses:
        return _listed(section.poses)
    if section.sweep is not None:
        return _grid({name: sweep_values(sweep) for name, sweep in section.sweep.items()})
    if section.path is not None:
        return _path(section.path, folder)
    return None


def _listed(poses: Sequence[Mapping[str, float]]) -> Poses:
    rows: dict[frozenset[str], list[int]] = {}
    for index, pose in enumerate(poses):
        rows.setdefault(frozenset(pose), []).append(index)
    groups = []
    for members in rows.values():
        names = tuple(poses[members[0]])
        values = {name: np.array([poses[index][name] for index in members]) for name in names}
        groups.append(PoseGroup(names, values, np.array(members, dtype=np.intp)))
    return Poses(tuple(groups), len(poses), True, (len(poses),))


def _grid(axes: Mapping[str, Floats]) -> Poses:
    count = math.prod(len(values) for values in axes.values())
    if count > MAX_POSES:
        raise StudyError(f"a grid of {count} poses; at most {MAX_POSES} are possible")
    mesh = np.meshgrid(*axes.values(), indexing="ij")
    values = {name: points.ravel() for name, points in zip(axes, mesh, strict=True)}
    swept = tuple(len(values) for values in axes.values() if len(values) > 1)
    return Poses.single(values, swept or (1,))


def _path(path: Mapping[str, paths.PathSection], folder: Folder) -> Poses:
    if not path:
        raise StudyError("an empty path; give its points, [[x, y], ...]")
    columns: dict[str, Floats] = {}
    points: dict[str, PointPath] = {}
    for name, given in path.items():
        course = paths.course(name, given, folder)
        if isinstance(course, PointPath):
            points[name] = course
            places = course.at(np.arange(course.count, dtype=float))
            columns[f"{name}.x"], columns[f"{name}.y"] = places.real, places.imag
        else:
            columns[name] = course
    count = max(len(column) for column in columns.values())
    for name, column in columns.items():
        if len(column) not in (1, count):
            raise StudyError(f"path: {name!r} has {len(column)} values where another coordinate has {count}")
    values = {name: np.broadcast_to(column, (count,)).copy() for name, column in columns.items()}
    for owner in {name.rpartition(".")[0] for name in columns if name.endswith(".x")} - set(points):
        if f"{owner}.y" in columns:
            points[owner] = Polyline.through(values[f"{owner}.x"] + 1j * values[f"{owner}.y"])
    points = {owner: course for owner, course in points.items() if course.count == count}
    listed = np.array([column for name, column in values.items() if name.rpartition(".")[0] not in points])
    corners = [course.corners for course in points.values()] + ([paths.bends(listed)] if len(listed) else [])
    poses = replace(Poses.single(values), paths=points, corners=np.unique(np.concatenate(corners)))
    if len(_moving(points)) != 1:
        return poses
    slopes, bends = _by_length(poses.groups[0], points, poses.closed, np.arange(count, dtype=float))
    return replace(poses, slopes=slopes, bends=bends)


def _moving(points: Mapping[str, PointPath]) -> list[tuple[str, PointPath]]:
    """Paths that have a length: the way of a point that stays where it is says nothing."""
    return [(owner, course) for owner, course in points.items() if course.way(np.array([course.count - 1.0]))[0] > 0]


def _by_length(
    group: PoseGroup, points: Mapping[str, PointPath], closed: bool, s: Floats
) -> tuple[dict[str, Floats], dict[str, Floats]]:  # fmt: skip
    """Derivatives of what poses give by the length of a point's path, at places in rows: `slopes` and `bends`."""
    count = len(group.rows)
    ((owner, course),) = _moving(points)
    way = np.diff(course.way(np.arange(count + closed, dtype=float)))
    slopes: dict[str, Floats] = {}
    for name, column in group.values.items():
        # What is listed along with the point's path changes evenly between the places.
        with np.errstate(divide="ignore", invalid="ignore"):
            rise = np.diff(np.append(column, column[:1]) if closed else column)
            steps = np.where(rise == 0, 0.0, rise / way)
        slopes[name] = steps[np.clip(np.floor(s), 0, len(steps) - 1).astype(np.intp)]
    slopes_of_point, bends_of_point, _ = course.course(s)
    bends = dict.fromkeys(group.names, np.zeros(len(s)))
    for axis, part in (("x", np.real), ("y", np.imag)):
        slopes[f"{owner}.{axis}"] = part(slopes_of_point).copy()
        bends[f"{owner}.{axis}"] = part(bends_of_point).copy()
    return slopes, bends


def default(description: Description) -> Poses:
    """Poses where a study gives none: a turn of an angle drive in 72 steps, or the drive's limits in 50.

    Raises
    ------
    StudyError
        Where nothing sensible can be assumed.
    """
    if len(description.drives) != 1:
        raise StudyError(
            f"the study says no poses, and with {len(description.drives)} drives none can be assumed; "
            "give 'poses', 'sweep' or 'path'"
        )
    drive = next(iter(description.drives.values()))
    factor = description.angle_unit if drive.kind == "angle" else 1.0
    for limit in description.limits:
        low, high = limit.minimum, limit.maximum
        if limit.kind == "drive" and limit.items[0] == drive.name and low is not None and high is not None:
            ends = [(description.places[end].nominal if isinstance(end, str) else end) / factor for end in (low, high)]
            return _grid({drive.name: np.linspace(ends[0], ends[1], 51)})
    if drive.kind == "angle":
        return _grid({drive.name: np.linspace(0.0, 2.0 * math.pi / factor, 73)})
    raise StudyError(
        f"the study says no poses, and the drive {drive.name!r} has no limits to move between; "
        "give 'poses', 'sweep' or 'path', or limits of the drive"
    )
