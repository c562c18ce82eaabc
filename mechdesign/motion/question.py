"""What a question says at poses of a motion: it declares this once, and `answer` asks it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from mechdesign.mechanism import Reason
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.motion.curve import Curve
from mechdesign.motion.motion import Motion, SolvedPoses
from mechdesign.motion.rows import Poses
from mechdesign.motion.solving import curve_with, solve_poses
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.results import Table
from mechdesign.work.chunks import map_chunks


class PoseQuestion(ABC):
    """A question at poses of a motion."""

    command: ClassVar[str]
    #: The table whose rows are the poses, which warnings name.
    lead: ClassVar[str]
    #: Tables that are made of values at poses alone, row by row; their columns are followed between the poses.
    a_row_a_pose: ClassVar[Mapping[str, Callable[[PoseValues], Table]]]
    #: Tables whose rows have nothing between them.
    poses_only: ClassVar[Sequence[str]] = ()
    #: Coordinates whose turns are followed along the motion.
    watched: Sequence[Coordinate]

    motion: Motion

    @property
    def absent(self) -> Mapping[str, str]:
        """Columns and tables that have no values: why, and what to write for them."""
        return {}

    @property
    def together(self) -> int:
        """How many assembled poses it takes at once, on several threads; 0: all that are solved, failed ones too."""
        return 0

    @property
    def divisible(self) -> bool:
        """Whether what it has at poses of a long motion need not be held as a whole."""
        return False

    @property
    def poses(self) -> Poses:
        """The poses of the motion."""
        return self.motion.poses

    @cached_property
    def curve(self) -> Curve | None:
        """The motion between its poses; None of listed poses and grids."""
        return curve_with(self.motion, self.watched) if self.poses.followed else None

    @abstractmethod
    def at(self, poses: Poses) -> Self:
        """The question at other poses."""

    def unknown(self) -> Mapping[str, Any]:
        """What it has at no pose: arrays of length 0 and empty lists, where it is not asked at failed poses."""
        return {}

    @abstractmethod
    def values(self, part: SolvedPoses) -> Mapping[str, Any]:
        """What it has at solved poses: arrays of shape (poses, ...), or lists of lanes with the `row` of a pose."""

    def marks(self, values: PoseValues) -> Mapping[Any, Flags]:
        """Poses of which something is to be said, by the `Remark`."""
        return {}

    def totals(self, values: PoseValues) -> Floats:
        """What is added up over the poses, design by design."""
        return np.zeros(())


@dataclass(eq=False)
class PoseValues:
    """What a question has at its poses: arrays by name, nan or 0 where it has no value; and why poses fail."""

    question: Any
    reason: NDArray[np.int8]
    arrays: dict[str, Any] = field(default_factory=dict)
    totals: Floats = field(default_factory=lambda: np.zeros(()))

    @property
    def valid(self) -> Flags:
        """Whether each pose is assembled and within its limits."""
        return np.equal(self.reason, Reason.OK)

    def fill(self, part: SolvedPoses, jobs: int | None = 1) -> None:
        """Ask the question at solved poses."""
        configuration, size = part.configuration, self.question.together
        self.reason[part.rows] = configuration.reason
        if not size:
            self.put(part.rows, self.question.values(part))
            return
        assembled = np.flatnonzero(np.isin(configuration.reason, (Reason.OK, Reason.LIMIT)))
        chunks = [part.take(assembled[k : k + size]) for k in range(0, len(assembled), size)]
        for chunk, values in zip(chunks, map_chunks(self.question.values, chunks, jobs), strict=True):
            self.put(chunk.rows, values)

    def put(self, rows: Ints, new: Mapping[str, Any]) -> None:
        """Set values at some poses."""
        for name, values in new.items():
            if isinstance(values, list):
                self.arrays.setdefault(name, []).extend(replace(lanes, row=rows[lanes.row]) for lanes in values)
                continue
            values = np.asarray(values)
            if name not in self.arrays:
                kind = values.dtype
                blank = 0 if kind.kind in "iub" else complex(np.nan, np.nan) if kind.kind == "c" else np.nan
                self.arrays[name] = np.full((len(self.reason), *values.shape[1:]), blank, dtype=kind)
            self.arrays[name][rows] = values


def unfilled(question: PoseQuestion) -> PoseValues:
    """Values of a question at none of its poses yet."""
    values = PoseValues(question, np.zeros(question.poses.count, dtype=np.int8))
    values.put(np.zeros(0, dtype=np.intp), question.unknown())
    return values


def solved(question: PoseQuestion, jobs: int | None = 1) -> Iterator[SolvedPoses]:
    """The poses of a question, solved."""
    return solve_poses(question.motion, question.watched, jobs, question.curve)


def evaluate(
    question: PoseQuestion, jobs: int | None = 1, also: Callable[[SolvedPoses], object] = lambda part: None
) -> PoseValues:
    """Ask a question at every pose; `also` is called with the solved poses, part by part.

    Raises
    ------
    MechanismError
        If a pose's coordinates do not determine the mechanism.
    """
    values = unfilled(question)
    for part in solved(question, jobs):
        values.fill(part, jobs)
        also(part)
    values.totals = question.totals(values)
    return values


def pieces(question: PoseQuestion, jobs: int | None = 1) -> Iterator[tuple[SolvedPoses, PoseValues]]:
    """Solved poses of one kind, and what the question has there, part by part; what is held is a few parts."""
    for part in solved(question, jobs):
        own = question.at(part.poses)
        values = unfilled(own)
        values.fill(replace(part, rows=np.arange(len(part.rows))), jobs)
        values.totals = own.totals(values)
        yield part, values
