"""Designs evaluated and judged: values of goals, conditions, reasons; all that is asked for, in the order of asking."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.optimize.explorer import ASSEMBLY, Part
from mechdesign.analyses.optimize.goals import Evaluated, Evaluator, Goal, bounds_of
from mechdesign.journal import Journal, digest
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.parallel import workers
from mechdesign.progress import Progress
from mechdesign.study import Study

# Designs evaluated together: enough that arrays are long, few enough that the workers end together.
CHUNK, SMALL_CHUNK = 384, 16
Batch = Mapping[str, Floats]


@dataclass(frozen=True, eq=False)
class Designs:
    """Designs and what was found of them.

    Parameters
    ----------
    variables : dict of str to ndarray, shape (designs,)
        Values of the design variables.
    values : dict of Goal to ndarray, shape (designs,)
        Values of the goals and of what the conditions bound; nan where there is none.
    errors : dict of str to ndarray, shape (designs,)
        Estimated errors, by the names of goals.
    feasible : ndarray of bool, shape (designs,)
        Which can be built and meet every condition.
    codes, words : ndarray of int, list of str
        Why a design is not feasible: ``words[code]``, empty where it is.
    """

    variables: dict[str, Floats]
    goals: tuple[Goal, ...]
    conditions: tuple[tuple[Goal, float, bool], ...]
    values: dict[Goal, Floats]
    errors: dict[str, Floats]
    feasible: Flags
    codes: NDArray[np.int32]
    words: list[str]

    def __len__(self) -> int:
        return len(self.codes)

    def reasons(self) -> list[tuple[str, int, int]]:
        """Why designs are infeasible: reason, how many designs (each counted under all its reasons) and the first."""
        found = []
        for code, word in enumerate(self.words):
            if word and (rows := np.flatnonzero(self.codes == code)).size:
                found.append((word, len(rows), int(rows[0])))
        assembled = self.codes == 0
        for judged, bound, upper in self.conditions:
            if (rows := np.flatnonzero(assembled & ~met(self.values[judged], bound, upper))).size:
                found.append((f"not {judged.name}", len(rows), int(rows[0])))
        return sorted(found, key=lambda each: (-each[1], each[0]))

    def reason_column(self) -> NDArray[np.object_]:
        """The first reason of each design, empty where it is feasible."""
        column = np.array(self.words, dtype=object)[self.codes]
        pending = self.codes == 0
        for judged, bound, upper in self.conditions:
            fails = pending & ~met(self.values[judged], bound, upper)
            column[fails] = f"not {judged.name}"
            pending &= ~fails
        return column


class Judge:
    """Evaluates designs in chunks and keeps what is found; what a journal holds is not computed again."""

    def __init__(
        self, study: Study, goals: tuple[Goal, ...], jobs: int | None, progress: Progress, journal: Journal | None,
        *, most_rows: int = 0,
    ) -> None:  # fmt: skip
        assert study.optimize is not None
        self.goals = goals
        self.conditions = tuple(bound for each in study.optimize.subject_to for bound in bounds_of(each))
        self.wanted: list[Goal] = list(dict.fromkeys((*goals, *(judged for judged, _, _ in self.conditions))))
        self.progress = progress
        self._evaluator = Evaluator(study, self.wanted, most_rows=most_rows)
        self._names = tuple(study.optimize.variables)
        self._jobs = jobs
        self._journal = journal
        # Words of an earlier run keep their numbers: this one meets them in the same order.
        self._words = {word: k for k, word in enumerate(journal.words if journal and journal.words else [""])}
        self._asked: list[Floats] = []
        self._rows: list[Floats] = []

    def limit_rows(self, most: int) -> None:
        """Leave out the rows behind the values where a design has more than so many."""
        self._evaluator.limit_rows(most)

    @property
    def slow(self) -> bool:
        """Whether each design costs as much alone as among others."""
        return not self._evaluator.together

    @property
    def rough(self) -> bool:
        """Whether values are known to a tolerance only."""
        return any(each.regional for each in self.wanted)

    @property
    def chunk(self) -> int:
        """Designs of a batch where few are asked at once: of tables, many cost little more than one."""
        return SMALL_CHUNK if self.slow else CHUNK

    @property
    def width(self) -> int:
        """Columns of what `evaluate` gives."""
        return 2 * (len(self.wanted) + 1) + sum(self._evaluator.rows.values()) + self._evaluator.assembly_margins

    def parts(self) -> list[Part]:
        """Which rows, after the other columns, belong to which goal or condition; those of assembly come last."""
        sizes, squares = self._evaluator.rows, self._evaluator.squares
        ends = pairwise(np.cumsum([0, *sizes.values()]).tolist())
        places = {each: slice(*pair) for each, pair in zip(sizes, ends, strict=True)}
        judged = [*((each, 0.0) for each in self.goals), *((each, bound) for each, bound, _ in self.conditions)]
        found = [
            Part(column, 1.0 if each.smallest else -1.0, each.absolute, places[each], bound, each in squares)
            for column, (each, bound) in enumerate(judged)
            if each in places and (column < len(self.goals) or each not in squares)
        ]
        if self._evaluator.assembly_margins:
            begin = sum(sizes.values())
            found.append(Part(ASSEMBLY, -1.0, False, slice(begin, begin + self._evaluator.assembly_margins)))
        return found

    def open(self) -> AbstractContextManager[Callable[[Iterable[Batch]], Iterator[Evaluated]]]:
        """The workers, for as long as designs are asked for."""
        return workers(self._evaluator, self._jobs, processes=True)

    def evaluate(self, compute: Callable[[Iterable[Batch]], Iterator[Evaluated]], chunks: Iterable[Batch]) -> Floats:
        """Evaluate designs chunk by chunk; the result depends neither on the workers nor on the journal.

        Returns
        -------
        ndarray, shape (designs, columns)
            Values of `wanted`, a code that is 0 where the design can be built, estimated errors of `wanted`, the
            shortfall, and the rows that `parts` tells of.
        """
        begun = len(self._rows)
        source = iter(chunks)
        for chunk in source:
            key = digest([chunk[name] for name in self._names])
            known = self._journal.recall(key) if self._journal is not None else None
            if known is None:
                self._compute(compute, _before(chunk, source))
                break
            self._keep(chunk, key, known)
        found = self._rows[begun:]
        # Only who asked needs the rows behind the values.
        self._rows[begun:] = [rows[:, : 2 * len(self.wanted) + 1].copy() for rows in found]
        return np.concatenate(found) if found else np.empty((0, self.width))

    def _compute(self, compute: Callable[[Iterable[Batch]], Iterator[Evaluated]], chunks: Iterator[Batch]) -> None:
        waiting: list[Batch] = []

        def noted() -> Iterator[Batch]:
            for chunk in chunks:
                waiting.append(chunk)
                yield chunk

        for found in compute(noted()):
            chunk = waiting.pop(0)
            self._keep(chunk, digest([chunk[name] for name in self._names]), self._row_block(found))

    def _row_block(self, found: Evaluated) -> Floats:
        none = np.full(len(found.reasons), np.nan)
        values = [found.values[each] for each in self.wanted]
        reasons = list(found.reasons)
        for each, column in zip(self.wanted, values, strict=True):
            for k in np.flatnonzero(np.isnan(column)):
                reasons[k] = reasons[k] or f"{each.name} has no value"
        codes = [self._words.setdefault(reason, len(self._words)) for reason in reasons]
        errors = [found.errors.get(each.name, none) for each in self.wanted]
        code, rows = np.array(codes, dtype=float), found.rows.values()
        return np.column_stack([*values, code, *errors, found.shortfall, *rows, found.assembly_margins])

    def _keep(self, chunk: Batch, key: bytes, rows: Floats) -> None:
        self._asked.append(np.column_stack([chunk[name] for name in self._names]))
        self._rows.append(rows)
        if self._journal is not None:
            self._journal.add(key, rows, [*self._words])
        self.progress.update(len(rows))

    def designs(self) -> Designs:
        """Everything evaluated so far."""
        width = len(self.wanted)
        rows = np.concatenate(self._rows) if self._rows else np.empty((0, 2 * width + 1))
        asked = np.concatenate(self._asked) if self._asked else np.empty((0, len(self._names)))
        values = {each: rows[:, k] for k, each in enumerate(self.wanted)}
        errors = {each.name: rows[:, width + 1 + k] for k, each in enumerate(self.wanted)}
        codes = rows[:, width].astype(np.int32)
        feasible = codes == 0
        for judged, bound, upper in self.conditions:
            feasible &= met(values[judged], bound, upper)
        return Designs(
            {name: asked[:, k] for k, name in enumerate(self._names)}, self.goals, self.conditions, values,
            {name: column for name, column in errors.items() if not np.isnan(column).all()},
            feasible, codes, [*self._words],
        )  # fmt: skip


def met(values: Floats, bound: float, upper: bool) -> Flags:
    """Which values satisfy a condition; nan never does."""
    return values <= bound if upper else values >= bound


def _before(first: Batch, rest: Iterator[Batch]) -> Iterator[Batch]:
    yield first
    yield from rest
