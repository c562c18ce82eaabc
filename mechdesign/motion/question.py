"""What a question says at poses of a motion: it declares this once, and `answer` asks it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import counted
from mechdesign.ground.long_tables import LongTable
from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.ground.results import Drawn, Scope, Table
from mechdesign.ground.statistics import Request
from mechdesign.ground.work.chunks import map_chunks
from mechdesign.mechanism import Reason
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.motion.along import AlongMotion
from mechdesign.motion.curve import Curve
from mechdesign.motion.motion import Motion, SolvedPoses
from mechdesign.motion.rows import Poses
from mechdesign.motion.solving import curve_with, solve_poses


class PoseQuestion(ABC):
    """A question at poses of a motion."""

    command: ClassVar[str]
    #: The table whose rows are the poses, which warnings name.
    lead: ClassVar[str]
    #: Tables that are made of values at poses alone, row by row; their columns are followed between the poses.
    a_row_a_pose: ClassVar[Mapping[str, Callable[[PoseValues], Table]]]
    #: Tables whose rows have nothing between them.
    poses_only: ClassVar[Sequence[str]] = ()
    #: Whether its columns are followed where they are asked, and not before.
    lazy: ClassVar[bool] = False
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

    def marks(self, values: PoseValues) -> Mapping[Remark, Flags]:
        """Poses of which something is to be said, by the `Remark`."""
        return {}

    def totals(self, values: PoseValues) -> Floats:
        """What is added up over the poses, design by design."""
        return np.zeros(())


class MotionQuestion(PoseQuestion):
    """A question about a motion, with all that `mechdesign.motion.answer` asks of it."""

    @abstractmethod
    def along(self, requests: Collection[Request]) -> AlongMotion | None:
        """Some of its columns along the motions; None where these cannot be followed."""

    def between(self, passage: Passage) -> tuple[AlongMotion | None, Any]:
        """Columns along the motions that its own tables and warnings follow, and what else it needs between the poses.

        Nothing of listed poses, grids and what cannot be followed.
        """
        return None, None

    @abstractmethod
    def tables(self, passage: Passage) -> Mapping[str, Table]:
        """All tables, in their order."""

    @abstractmethod
    def say(self, passage: Passage, design: int) -> tuple[list[Caution], list[str]]:
        """Warnings about a design, and what of its motion is missing, in words."""

    @abstractmethod
    def drawn(self, passage: Passage) -> Drawn:
        """What pictures need of a single design."""

    def kinds(self, passage: Passage) -> Sequence[object]:
        """By design, what its answer depends on as a whole; designs of several kinds are asked again, kind by kind."""
        return [None] * self.poses.designs

    def uneven(self, passage: Passage) -> Mapping[str, Sequence[int] | Ints]:
        """Numbers of rows of each design in tables of which one may have more than another."""
        return {}


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


@dataclass(frozen=True)
class Remark:
    """What is to be said of some poses of a design: a kind of warning, and its sentence.

    Parameters
    ----------
    words : str
        ``{number}`` of ``{count}`` poses, or of ``{poses}``; ``{are}`` and ``{lie}`` are their number with the verb.
    table : str
        Whose rows are the poses; left out: that of the question.
    least : float
        Part of the poses below which nothing is said.
    first : bool
        Whether the sentence names the first of the poses.
    """

    kind: str
    words: str
    table: str = ""
    least: float = 0.0
    first: bool = True


class Mark(NamedTuple):
    """How many poses of a design something is to be said of, and the row of the first."""

    number: int
    first: int

    @classmethod
    def of(cls, where: Flags, begin: int = 0) -> Mark:
        """The mark of some poses; the first has the row `begin`."""
        return cls(int(np.count_nonzero(where)), begin + int(where.argmax()))

    def caution(self, remark: Remark, question: MotionQuestion, design: int = 0) -> Caution | None:
        """The warning about these poses; None where they are too few."""
        number, row = self
        count = question.poses.count // question.poses.designs
        if number < max(remark.least * count, 1):
            return None
        pose = question.motion.in_words(row + design * count)
        are, lie = ("1 pose is", "1 pose lies") if number == 1 else (f"{number} poses are", f"{number} poses lie")
        words = remark.words.format(number=number, count=count, poses=counted(count, "pose"), are=are, lie=lie)
        words += f"; the first: {pose}" if remark.first else ""
        return Caution(remark.kind, words, remark.table or question.lead, row, pose)


@dataclass(frozen=True, eq=False)
class Passage:
    """What is known of a motion after one pass over all its poses.

    Attributes
    ----------
    values : PoseValues
        At all poses; of a long motion at those with the extremes of each column, those where validity changes, and as
        many between as a picture needs.
    shown : SolvedPoses
        The poses that a picture shows, of those of the values.
    reason : int8 array, shape (poses,)
        Of all poses; see `mechdesign.mechanism.Reason`.
    marks : list of mapping of Remark to Mark
        By design, what is to be said of how many of all poses.
    solved : list of SolvedPoses
        The poses themselves, of designs with dimensions of their own; else empty.
    along, between : AlongMotion, object
        What the question has between the poses; see `MotionQuestion.between`.
    """

    question: Any
    values: PoseValues
    shown: SolvedPoses
    reason: NDArray[np.int8]
    marks: Sequence[Mapping[Remark, Mark]]
    solved: Sequence[SolvedPoses]
    along: Any = None
    between: Any = None

    def cautions(self, design: int) -> list[Caution]:
        """Warnings about poses of a design."""
        marks = self.marks[design].items()
        said = (mark.caution(remark, self.question, design) for remark, mark in marks if remark.words)
        return [caution for caution in said if caution is not None]

    @property
    def long(self) -> bool:
        """Whether the values are not those of all poses."""
        return self.values.question is not self.question

    def table(self, make: Callable[[PoseValues], Table], jobs: int | None, scope: Scope | None) -> Table:
        """A table with as many rows for each pose of a long motion; its rows are made anew where they are wanted."""
        like = replace(make(self.values), scope=scope)
        rows = len(like) // len(self.values.reason)
        return LongTable(like, rows * self.question.poses.count, partial(self.blocks, make, jobs))

    def blocks(self, make: Callable[[PoseValues], Table], jobs: int | None) -> Iterator[Table]:
        """A table with a row a pose in parts."""
        return (make(values) for _, values in pieces(self.question, jobs))
