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
    motion: bool = False  # whether one design passes them one after the other: a sweep of one coordinate, or a path
    closed: bool = False  # whether the motion goes on from the last pose to the first
    # Along the path of a point, shape (count,): first and second derivative of every coordinate given by the path's
    # length, in the study's units; nan where the path has no direction.
    slopes: Mapping[str, Floats] = field(default_factory=dict)
    bends: Mapping[str, Floats] = field(default_factory=dict)
    # Of a grid of rays over a workspace: one a value of its held coordinates.
    regions: tuple[Sectors, ...] = ()
    rows: Ints | None = None  # of some poses of a long motion or grid: their rows among all

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
    return Poses(
        groups, count, poses.listed, poses.grid, designs, each(places), each(parameters), slopes=slopes, bends=bends
    )


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
    return _single(values, count, swept or (1,))


def _single(values: Mapping[str, Floats], count: int, grid: tuple[int, ...]) -> Poses:
    group = PoseGroup(tuple(values), values, np.arange(count))
    return Poses((group,), count, False, grid, motion=len(grid) == 1 and count > 1)


def _path(path: Mapping[str, paths.PathSection], folder: Folder) -> Poses:
    if not path:
        raise StudyError("an empty path; give its points, [[x, y], ...]")
    columns: dict[str, Floats] = {}
    found: dict[str, paths.PointPath] = {}
    for name, given in path.items():
        course = paths.course(name, given, folder)
        if isinstance(course, paths.PointPath):
            found[name] = course
            columns[f"{name}.x"], columns[f"{name}.y"] = course.places.real, course.places.imag
        else:
            columns[name] = course
    count = max(len(column) for column in columns.values())
    for name, column in columns.items():
        if len(column) not in (1, count):
            raise StudyError(f"path: {name!r} has {len(column)} values where another coordinate has {count}")
    values = {name: np.broadcast_to(column, (count,)).copy() for name, column in columns.items()}
    for owner in {name.rpartition(".")[0] for name in columns if name.endswith(".x")} - set(found):
        if f"{owner}.y" in columns:
            found[owner] = paths.polyline(values[f"{owner}.x"] + 1j * values[f"{owner}.y"])
    poses = _single(values, count, (count,))
    # The way of a point that stays where it is says nothing.
    moving = [(owner, one) for owner, one in found.items() if len(one.places) == count and one.way[-1] > 0]
    if len(moving) != 1:
        return poses
    ((owner, along),) = moving
    slopes: dict[str, Floats] = {}
    for name, column in values.items():
        # What is listed along with the point's path changes evenly between the places.
        with np.errstate(divide="ignore", invalid="ignore"):
            steps = np.where(np.diff(column) == 0, 0.0, np.diff(column) / np.diff(along.way))
        slopes[name] = np.append(steps, steps[-1:])
    bends = dict.fromkeys(values, np.zeros(count))
    for axis, part in (("x", np.real), ("y", np.imag)):
        slopes[f"{owner}.{axis}"], bends[f"{owner}.{axis}"] = part(along.directions).copy(), part(along.bends).copy()
    return replace(poses, closed=along.closed, slopes=slopes, bends=bends)


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
