"""Results of a batch of designs: a row of numbers each, and why a design cannot be built."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mechdesign.family.goals import Goal
from mechdesign.ground.errors import MechdesignError, StudyError
from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.ground.results import Result
from mechdesign.mechanism import Reason
from mechdesign.study.designs import Designs

_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.])")
# Why a pose fails, by `mechdesign.mechanism.Reason`.
FAILED = np.array([
    "",
    "a pose cannot be assembled",
    "a pose is reached in another assembly only",
    "a pose is outside the limits",
    "a pose does not hold its load",
    "a pose is not determined",
    "a coupling has no value at a pose",
], dtype=object)  # fmt: skip


class Layout:
    """Columns of the results of designs.

    They are the values of the goals and their estimated errors (nan where there is none); the shortfall of the poses
    from assembling (`mechdesign.family.stacked.shortfall`, nan where the numbers make no design); a code
    that is 0 where the design can be built; then the `rows` behind the goals, and the `assembly` margins of commands.
    """

    def __init__(self, goals: Sequence[Goal], rows: Mapping[Goal, int], assembly: Mapping[str, int]) -> None:
        count = len(goals)
        self.column = {goal: k for k, goal in enumerate(goals)}
        self.values, self.errors = slice(0, count), slice(count, 2 * count)
        self.shortfall, self.code, self.head = 2 * count, 2 * count + 1, 2 * count + 2
        ends = np.cumsum([self.head, *rows.values(), *assembly.values()]).tolist()
        places = [slice(begin, end) for begin, end in pairwise(ends)]
        self.rows = dict(zip(rows, places, strict=False))
        self.assembly = dict(zip(assembly, places[len(rows) :], strict=True))
        self.margins = slice(ends[len(rows)], ends[-1])
        self.width = ends[-1]


class Evaluated(NamedTuple):
    """A row of a `Layout` for each design, its code still nan, and why it cannot be built (empty where it can)."""

    table: Floats
    reasons: list[str]


class Batch:
    """Designs of one call, and their results."""

    def __init__(self, designs: Designs, layout: Layout) -> None:
        self.designs, self._layout = designs, layout
        self.reasons = self.designs.faults.copy()
        self.table = np.full((self.designs.count, self._layout.width), np.nan)
        self.table[self.feasible, self._layout.shortfall] = 1.0

    @property
    def feasible(self) -> Ints:
        """Rows of the designs that have no reason to be infeasible so far."""
        return np.flatnonzero(self.reasons == "")

    def judge(self, goal: Goal, result: Result, rows: Ints) -> Floats:
        """Read the values of a goal from a result of some designs; returns them."""
        values, listed, _ = goal.judge(result, len(rows))
        self.table[rows, self._layout.column[goal]] = values
        place = self._layout.rows.get(goal, slice(0))
        if listed is not None and listed.shape[1] == place.stop - (place.start or 0):
            self.table[rows, place] = listed
        return values

    def failed(self, rows: Ints, error: MechdesignError) -> None:
        """Note why designs make no study, or have no answer."""
        self.reasons[rows] = without_numbers(error)

    def halves(self, rows: Ints, error: MechdesignError) -> Iterator[Ints]:
        """Designs in halves, as the numbers of one of them give an error; a single design gets it as its reason."""
        if len(rows) == 1:
            self.failed(rows, error)
        else:
            yield from np.array_split(rows, 2)

    def note(self, rows: Ints | slice, wrong: Flags, reasons: NDArray[np.object_] | str) -> None:
        """Note reasons of the designs in `rows` that are `wrong`, where they have none yet."""
        self.reasons[rows] = np.where(wrong & (self.reasons[rows] == ""), reasons, self.reasons[rows])


def first_reason(reason: NDArray[np.int8]) -> Ints:
    """The first reason of each design's poses, shape (designs,); 0 where none fails."""
    reason = np.minimum(reason, Reason.NO_VALUE)
    worst = np.where(reason == 0, len(FAILED), reason).min(axis=1, initial=len(FAILED))
    return np.where(worst == len(FAILED), 0, worst).astype(np.intp)


def without_numbers(error: MechdesignError) -> str:
    """An error without its numbers and the file's name, so that designs with one mistake count together."""
    text = str(error).splitlines()[0]
    if isinstance(error, StudyError):
        first = error.problems[0]
        text = ": ".join(part for part in (first.key, first.message) if part)
    return _NUMBER.sub("...", text)
