"""Rules of poses: what each gives follows from its place; lists, grids, paths, of one design or of many."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import ClassVar, NamedTuple

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats, Ints, distinct
from mechdesign.motion.paths import EvenValues, PointPath, bends, between

# What is swept along a motion over time.
TIME = "time"


class Sector(NamedTuple):
    """Rays of one patch of a workspace, which turn on from one to the next, and the nodes of a finer map over it."""

    rays: slice  # of the poses' grid
    about: complex  # where the rays begin
    nodes: Complexes  # of the finer map, shape (n, nodes), on rays that begin and end with the patch


class Sectors(NamedTuple):
    """The patches of a region of the workspace, and the curves of its boundary."""

    patches: tuple[Sector, ...]
    outline: tuple[Complexes, ...]


class Rows(ABC):
    """Poses as a rule: what each gives follows from its place, in the study's units.

    Poses that follow one another are a line: those of a motion, or of a grid along its last coordinate. Lines are
    numbered design by design; a place on a line is in rows from 0.
    """

    #: Whether a person listed these very poses, so that one that fails is an error.
    listed: bool = False
    #: Whether they are those of a motion over time.
    timed: ClassVar[bool] = False
    #: The different sets of coordinates that listed poses give, and the number of that of each row.
    kinds: Sequence[tuple[str, ...]] = ()
    number: Ints | None = None
    #: The patches of a workspace over which they lie, one a value of its held coordinates.
    regions: Sequence[Sectors] = ()
    #: Paths of points, by point.
    paths: Mapping[str, PointPath] = MappingProxyType({})
    #: Places of a motion that are not smooth, in rows.
    corners: Floats = np.empty(0)

    @property
    @abstractmethod
    def grid(self) -> tuple[int, ...]:
        """Numbers of values of each swept coordinate of a design, the last fastest; one number for lists and paths."""

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Every coordinate that some pose gives, in the order of the study."""

    @abstractmethod
    def at(self, line: Ints, s: Ints | Floats) -> dict[str, Floats]:
        """What poses give at rows of lines, or at places between these, of shape (n,); the time of a motion first."""

    def rates(self, line: Ints, s: Ints | Floats) -> tuple[dict[str, Floats], dict[str, Floats]]:
        """First and second derivatives of it by the length of a point's path or by time, where the motion has these."""
        return {}, {}

    @abstractmethod
    def take(self, designs: Ints) -> Rows:
        """The poses of some designs."""

    @property
    def path(self) -> str | None:
        """The point along the length of whose path means are; None where there is no one such point."""
        return None

    @property
    def closed(self) -> bool:
        """Whether the motion goes on from the last pose to the first."""
        return any(path.closed for path in self.paths.values())

    def pace(self, line: Ints, s: Floats, swept: str | None) -> Floats:
        """How fast a motion passes places, shape (n,): change of what is swept, a row."""
        if swept is None:
            return np.ones(len(s))
        k = np.clip(np.floor(s), 0, self.grid[-1] - 2).astype(np.intp)
        return np.abs(self.at(line, k + 1)[swept] - self.at(line, k)[swept])


@dataclass(frozen=True, eq=False)
class GivenRows(Rows):
    """Poses one by one.

    Parameters
    ----------
    values : mapping of str to ndarray, shape (poses,)
        nan where a pose does not give it. The time may be among them.
    shape : tuple of int, optional
        Those of a grid, or how many each design has; left out: they are one line.
    derivatives : pair of mapping of str to ndarray, shape (poses,)
        First and second derivatives.
    """

    values: Mapping[str, Floats]
    listed: bool = False
    shape: tuple[int, ...] = ()
    derivatives: tuple[Mapping[str, Floats], Mapping[str, Floats]] = ({}, {})
    kinds: Sequence[tuple[str, ...]] = ()
    number: Ints | None = None
    regions: Sequence[Sectors] = ()

    @property
    def grid(self) -> tuple[int, ...]:
        return self.shape or (len(next(iter(self.values.values()), ())),)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(name for name in self.values if name != TIME)

    def at(self, line: Ints, s: Ints | Floats) -> dict[str, Floats]:
        return self._between(self.values, line, s)

    def rates(self, line: Ints, s: Ints | Floats) -> tuple[dict[str, Floats], dict[str, Floats]]:
        first, second = self.derivatives
        return self._between(first, line, s), self._between(second, line, s)

    def _between(self, columns: Mapping[str, Floats], line: Ints, s: Ints | Floats) -> dict[str, Floats]:
        return {name: between(values.reshape(-1, max(self.grid[-1], 1)), line, s) for name, values in columns.items()}

    def take(self, designs: Ints) -> GivenRows:
        count = math.prod(self.grid)
        return replace(self, values={name: v.reshape(-1, count)[designs].ravel() for name, v in self.values.items()})


@dataclass(frozen=True, eq=False)
class GridRows(Rows):
    """Every combination of values of some coordinates."""

    axes: Mapping[str, EvenValues]

    @property
    def grid(self) -> tuple[int, ...]:
        return tuple(axis.count for axis in self.axes.values() if axis.count > 1) or (1,)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.axes)

    def at(self, line: Ints, s: Ints | Floats) -> dict[str, Floats]:
        design, line = np.divmod(line, math.prod(self.grid[:-1]))
        values, along = dict.fromkeys(self.axes, np.empty(0)), True
        for name, axis in reversed([*self.axes.items()]):
            if along and axis.count > 1:
                values[name], along = between(axis, design, s), False
            else:
                line, k = np.divmod(line, axis.count)
                values[name] = axis[design, k]
        return values

    def take(self, designs: Ints) -> GridRows:
        return GridRows({
            name: EvenValues(axis.begin[designs], axis.step[designs], axis.end[designs], axis.count)
            for name, axis in self.axes.items()
        })  # fmt: skip


@dataclass(frozen=True, eq=False)
class PathRows(Rows):
    """What points and coordinates pass, of some designs."""

    designs: int
    count: int
    names: tuple[str, ...] = ()
    paths: Mapping[str, PointPath] = field(default_factory=dict)
    #: Coordinates that are listed, shape (designs, count); without the path of a point they change evenly between.
    columns: Mapping[str, Floats] = field(default_factory=dict)

    @property
    def grid(self) -> tuple[int, ...]:
        return (self.count,)

    @cached_property
    def corners(self) -> Floats:  # type: ignore[override]
        listed = [column for name, column in self.columns.items() if name.rpartition(".")[0] not in self.paths]
        corners = [path.corners for path in self.paths.values()]
        return distinct(np.concatenate([*corners, bends(np.concatenate(listed))] if listed else corners))

    @cached_property
    def path(self) -> str | None:
        first, end = np.zeros(1, dtype=np.intp), np.array([self.count - 1.0])
        # The way of a point that stays where it is says nothing.
        moving = [owner for owner, path in self.paths.items() if path.way(first, end)[0] > 0]
        return moving[0] if len(moving) == 1 else None

    def at(self, line: Ints, s: Ints | Floats) -> dict[str, Floats]:
        values, places = dict.fromkeys(self.names, np.empty(0)), dict[str, Complexes]()
        for name in self.names:
            owner = name.rpartition(".")[0]
            if name in self.columns and (owner not in self.paths or s.dtype.kind == "i"):
                values[name] = between(self._round(self.columns[name]), line, s)
                continue
            if owner not in places:
                places[owner] = self.paths[owner].at(line, s.astype(float))
            values[name] = places[owner].real if name.endswith(".x") else places[owner].imag
        return values

    def rates(self, line: Ints, s: Ints | Floats) -> tuple[dict[str, Floats], dict[str, Floats]]:
        if self.path is None:
            return {}, {}
        row = np.clip(np.floor(s), 0, self.count - 2 + self.closed).astype(np.intp)
        slopes = {name: steps[line, row] for name, steps in self._steps.items()}
        bends = dict.fromkeys(self.names, np.zeros(len(s)))
        slope, bend, _ = self.paths[self.path].course(line, s.astype(float))
        for axis, part in (("x", np.real), ("y", np.imag)):
            slopes[f"{self.path}.{axis}"], bends[f"{self.path}.{axis}"] = part(slope).copy(), part(bend).copy()
        return slopes, bends

    @cached_property
    def _steps(self) -> dict[str, Floats]:
        """By how much coordinates change from pose to pose, over the length of the path there."""
        assert self.path is not None
        line, row = np.divmod(np.arange(self.designs * self.count), self.count)
        way, steps = self.paths[self.path].lengths(self.designs), dict[str, Floats]()
        for name, column in self.at(line, row).items():
            rise = np.diff(self._round(column.reshape(self.designs, -1)), axis=1)
            steps[name] = np.where(rise == 0, 0.0, rise / way)
        return steps

    def _round(self, rows: Floats) -> Floats:
        """Values of rows, and where the path closes those of the first again."""
        return np.concatenate([rows, rows[:, :1]], axis=1) if self.closed else rows

    def way(self, line: Ints, s: Floats) -> Floats:
        """Length of the point's path from its first pose."""
        assert self.path is not None
        return self.paths[self.path].way(line, s)

    def take(self, designs: Ints) -> PathRows:
        paths = {owner: path.take(designs) for owner, path in self.paths.items()}
        columns = {name: column[designs] for name, column in self.columns.items()}
        return replace(self, designs=len(designs), paths=paths, columns=columns)

    def pace(self, line: Ints, s: Floats, swept: str | None) -> Floats:
        return super().pace(line, s, swept) if self.path is None else self.paths[self.path].course(line, s)[2]
