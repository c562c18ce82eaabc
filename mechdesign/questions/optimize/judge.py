"""Designs evaluated and judged, in the order of evaluation: values of goals and conditions, reasons of failure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.family.batch import Evaluated
from mechdesign.family.family import DESIGNS_AT_ONCE
from mechdesign.family.goals import Goal
from mechdesign.family.question import DesignsQuestion
from mechdesign.ground.columns import Column, ColumnKind
from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.ground.progress import Progress
from mechdesign.ground.work.journal import Journal, digest
from mechdesign.questions.optimize.columns import CPI, DESIGNS, EXPRESSION, RESULT, VARIABLE, WORST_ROW
from mechdesign.questions.optimize.explorer import ASSEMBLY, Part, Points
from mechdesign.questions.optimize.variables import Batch, from_cube, shown
from mechdesign.questions.optimize.variables import unit_of as variable_unit
from mechdesign.study import Study

# Designs evaluated together where a design costs much and a search evaluates few at once.
SLOW_DESIGNS_AT_ONCE = 16


@dataclass(frozen=True, eq=False)
class DesignSet:
    """Evaluated designs, compared by the weighted sums of their normalised goals [S1, eqs. 27, 28].

    Arrays are of shape (designs,).

    Parameters
    ----------
    results : dict of Goal to ndarray
        Values of the goals and of the bounded results; nan where a design has none.
    errors : dict of Goal to ndarray
        Estimated errors of goals that have any.
    codes, words : ndarray of int, list of str
        Why a design cannot be built: ``words[code]``, empty where it can.
    shortfall : ndarray
        How far the poses of a design are from assembling; nan where that is not known.
    weights : ndarray, shape (rows, goals)
    meanings : mapping of Goal to (str, str)
        Unit of each goal and condition; what it means, if it is a number of the workspace.
    marks : tuple of str
        What each optimum is, of a front.
    chosen : ndarray of int
        Rows of the first optima, of a front; the others are the best for their weights.
    """

    study: Study
    variables: dict[str, Floats]
    goals: tuple[Goal, ...]
    conditions: tuple[Goal, ...]
    results: dict[Goal, Floats]
    errors: dict[Goal, Floats]
    codes: NDArray[np.int32]
    words: list[str]
    shortfall: Floats
    weights: Floats
    meanings: Mapping[Goal, tuple[str, str]]
    marks: tuple[str, ...] = ()
    chosen: Ints = field(default_factory=lambda: np.empty(0, dtype=np.intp))

    def __len__(self) -> int:
        return len(self.codes)

    def design(self, row: int) -> dict[str, float | str]:
        """The variables of one design: numbers, and words of choices."""
        return {name: self.shown(name)[row].item() for name in self.variables}

    def shown(self, name: str) -> NDArray[Any]:
        """A variable of every design: numbers, or words of choices."""
        return shown(self.study, name, self.variables[name])

    @cached_property
    def failures(self) -> dict[str, Flags]:
        """Infeasible designs by reason: why they cannot be built, else every condition that they miss."""
        reasons = {word: self.codes == code for code, word in enumerate(self.words) if word}
        built = self.codes == 0
        return reasons | {
            f"not {condition.name}": built & ~condition.met(self.results[condition]) for condition in self.conditions
        }

    @cached_property
    def reasons(self) -> NDArray[np.object_]:
        """The first reason of each design, empty where it is feasible."""
        column = np.full(len(self), "", dtype=object)
        for word, rows in reversed(self.failures.items()):
            column[rows] = word
        return column

    @cached_property
    def feasible(self) -> Flags:
        """Which can be built and meet every condition."""
        return np.asarray(self.reasons == "", dtype=bool)

    def counted(self) -> list[tuple[str, int, int]]:
        """Reasons of infeasible designs, the most frequent first: reason, number of designs, and the first design."""
        reasons = [(word, int(rows.sum()), int(rows.argmax())) for word, rows in self.failures.items() if rows.any()]
        return sorted(reasons, key=lambda reason: (-reason[1], reason[0]))

    @cached_property
    def values(self) -> Floats:
        """Values of the goals, shape (designs, goals)."""
        return np.stack([self.results[goal] for goal in self.goals], axis=1)

    @cached_property
    def costs(self) -> Floats:
        """The same with the sign with which less is better."""
        return np.asarray(self.values * [goal.sign for goal in self.goals])

    def normalised(self, values: Floats) -> Floats:
        """Goals of any designs, shape (designs, goals), as fractions of their ranges over the feasible ones.

        1 is the best [S1, eq. 27]; 0 where a goal has no range.
        """
        inside = self.values[self.feasible]
        low, high = inside.min(axis=0, initial=np.inf), inside.max(axis=0, initial=-np.inf)
        share = (values - low) / np.where(high > low, high - low, np.inf)
        return np.where(high > low, np.where([goal.smallest for goal in self.goals], 1 - share, share), 0.0)

    @cached_property
    def shares(self) -> Floats:
        """The goals of all designs so; nan where a design is not feasible."""
        shares = np.full(self.values.shape, np.nan)
        shares[self.feasible] = self.normalised(self.values[self.feasible])
        return shares

    @cached_property
    def cpi(self) -> Floats:
        """Sum of the normalised goals; nan where a design is not feasible."""
        return self.score(np.ones(len(self.goals)))

    @cached_property
    def winners(self) -> Ints:
        """Rows of a front's knee and ends, then of the best design (the first of equals) for each row of weights."""
        scores = [np.where(self.feasible, self.score(row), -np.inf) for row in self.weights[len(self.chosen) :]]
        return np.array([*self.chosen, *(np.argmax(score) for score in scores)], dtype=np.intp)

    def merits(self, row: int) -> str:
        """Which optima a design is, in words: ``knee, best GII, best for (1, 0) (1, 0.5)``."""
        places = np.flatnonzero(self.winners == row).tolist()
        marks = [self.marks[place] for place in places if place < len(self.chosen)]
        weights = [", ".join(f"{w:g}" for w in self.weights[place]) for place in places if place >= len(self.chosen)]
        return ", ".join([*marks, *([f"best for {' '.join(f'({own})' for own in weights)}"] if weights else [])])

    @property
    def best(self) -> int:
        """The optimum with the largest CPI; of a front its knee."""
        winners = self.winners
        return int(winners[0 if len(self.chosen) else np.argmax(self.cpi[winners])])

    def score(self, row: Floats) -> Floats:
        """Weighted sum of the normalised goals of every design; nan where it is not feasible."""
        return weighted(self.shares, row)

    def unit_of(self, name: str) -> str:
        """Unit of a goal or a variable, where it is known."""
        for goal in self.goals:
            if goal.name == name:
                return self._kind(goal)[1]
        return variable_unit(self.study, name)

    def columns(self, rows: Ints | slice, *, errors: bool = False) -> Iterator[Column]:
        """Variables and goals of some designs, with the goals' errors if `errors` is true, and the CPI."""
        for name in self.variables:
            yield VARIABLE.column(self.shown(name)[rows], self.unit_of(name), variable=name)
        for goal in self.goals:
            # A goal that is itself a variable has its column already.
            if goal.name not in self.variables:
                kind, unit, meaning = self._kind(goal)
                words = {"parameter": goal.name, "result": goal.name, "meaning of the result": meaning}
                yield kind.column(self.results[goal][rows], unit, **words)
        for goal, error in self.errors.items() if errors else ():
            if goal in self.goals:
                yield DESIGNS["<result>_error"].column(error[rows], self._kind(goal)[1], result=goal.name)
        for condition in self.conditions:
            if condition.outline is not None:
                words = {"result": condition.column, "meaning of the result": self.meanings[condition][1]}
                yield RESULT.column(self.results[condition][rows], **words)
        yield CPI.column(self.cpi[rows])

    def _kind(self, goal: Goal) -> tuple[ColumnKind, str, str]:
        """Kind of a goal's column, its unit, and the meaning of a number of the workspace."""
        unit, meaning = self.meanings.get(goal, ("", ""))
        return EXPRESSION if goal.expression else RESULT if meaning else WORST_ROW, unit, meaning


def weighted(shares: Floats, row: Floats) -> Floats:
    """Sums of normalised goals, shape (designs, goals), times their weights [S1, eq. 28]."""
    return sum((shares[:, k] * row[k] for k in np.flatnonzero(row).tolist()), np.zeros(len(shares)))


class Judge:
    """Evaluates designs in chunks and keeps the results; those that a journal holds are not computed again.

    `compute` evaluates chunks in their order: ``map(evaluator, chunks)``, or workers that do so.
    """

    def __init__(
        self, question: DesignsQuestion, compute: Callable[[Iterable[Batch]], Iterator[Evaluated]],
        progress: Progress, journal: Journal | None,
    ) -> None:  # fmt: skip
        study = question.study
        assert study.optimize is not None
        self.study, self.progress, self.layout = study, progress, question.layout
        self.goals, self.conditions = question.objectives, question.conditions
        self._names = tuple(study.optimize.variables)
        # Values of a workspace are known to a tolerance only.
        self.rough = bool(question.regional)
        self._squares, self._compute, self._journal = question.squares, compute, journal
        self._chunk = SLOW_DESIGNS_AT_ONCE if question.slow and study.optimize.method != "grid" else DESIGNS_AT_ONCE
        # A search is led by the worst rows, which are smooth in the design; what is told is the worst of the motion.
        objectives = [part for part in self.parts() if 0 <= part.column < len(self.goals) and not part.squares]
        self._leading = objectives if study.optimize.method == "search" else []
        # Reasons of an earlier run keep their numbers, as this run meets them in the same order.
        self._words = {word: k for k, word in enumerate(journal.words if journal and journal.words else [""])}
        self._variables: list[Floats] = []
        self._rows: list[Floats] = []

    def parts(self) -> list[Part]:
        """The rows of a result that belong to each goal or condition; the margins of assembly come last."""
        head, margins = self.layout.head, self.layout.margins
        places = {goal: slice(at.start - head, at.stop - head) for goal, at in self.layout.rows.items()}
        parts = [
            Part(column, goal.sign, goal.absolute, places[goal], goal.bound, goal in self._squares)
            for column, goal in enumerate((*self.goals, *self.conditions))
            if goal in places and (column < len(self.goals) or goal not in self._squares)
        ]
        if margins.start < margins.stop:
            parts.append(Part(ASSEMBLY, -1.0, False, slice(margins.start - head, margins.stop - head)))
        return parts

    def points(self, u: Floats) -> Points:
        """Evaluate points of the unit cube."""
        designs, given, _ = from_cube(self.study, u)
        rows = np.full((len(u), self.layout.width), np.nan)
        if given.any():
            rows[given] = self.evaluate({name: column[given] for name, column in designs.items()})
        return self._points(u, rows)

    def _points(self, u: Floats, rows: Floats) -> Points:
        values = np.where(rows[:, [self.layout.code]] > 0, np.nan, rows[:, self.layout.values])
        behind = rows[:, self.layout.head :]
        for part in self._leading if behind.shape[1] == self.layout.width - self.layout.head else ():
            leading = part.sign * part.pieces(behind).max(axis=1)
            told = values[:, part.column]
            values[:, part.column] = np.where(np.isnan(leading + told), told, leading)
        margins = [condition.margin(values[:, self.layout.column[condition]]) for condition in self.conditions]
        return Points(
            u, values[:, : len(self.goals)], np.stack(margins, axis=1) if margins else np.empty((len(u), 0)), behind,
            rows[:, self.layout.shortfall],
        )  # fmt: skip

    def nearest(self) -> int | None:
        """The infeasible design with the smallest violation; None where no violation is known."""
        rows = np.concatenate([np.empty((0, self.layout.head)), *self._rows])
        merit = self._points(np.empty((len(rows), 0)), rows).merit(np.zeros(len(self.goals)))
        return int(merit.argmin()) if np.isfinite(merit).any() else None

    def evaluate(self, designs: Batch) -> Floats:
        """Results of designs, in rows of `layout`, evaluated chunk by chunk unless the journal has them."""
        count, begun = len(designs[self._names[0]]), len(self._rows)
        chunks = [
            {name: column[k : k + self._chunk] for name, column in designs.items()}
            for k in range(0, count, self._chunk)
        ]
        keys = [digest([chunk[name] for name in self._names]) for chunk in chunks]
        recalled: list[Floats] = []
        while self._journal is not None and len(recalled) < len(keys):
            rows = self._journal.recall(keys[len(recalled)])
            if rows is None:
                break
            recalled.append(rows)
        new = map(self._coded, self._compute(chunks[len(recalled) :]))
        for chunk, key, rows in zip(chunks, keys, chain(recalled, new), strict=True):
            self._variables.append(np.column_stack([chunk[name] for name in self._names]))
            self._rows.append(rows)
            if self._journal is not None:
                self._journal.add(key, rows, [*self._words])
            self.progress.update(len(rows))
        results = self._rows[begun:]
        # The rows behind the goals are returned, but not kept.
        self._rows[begun:] = [rows[:, : self.layout.head].copy() for rows in results]
        return np.concatenate(results) if results else np.empty((0, self.layout.width))

    def _coded(self, evaluated: Evaluated) -> Floats:
        codes = [self._words.setdefault(reason, len(self._words)) for reason in evaluated.reasons]
        evaluated.table[:, self.layout.code] = codes
        return evaluated.table

    def designs(self, weights: Floats, meanings: Mapping[Goal, tuple[str, str]]) -> DesignSet:
        """Everything evaluated so far; see `DesignSet` of the arguments."""
        head = self.layout.head
        rows = np.concatenate([np.empty((0, head)), *(part[:, :head] for part in self._rows)])
        variables = np.concatenate([np.empty((0, len(self._names))), *self._variables])
        errors = zip(self.layout.column, rows[:, self.layout.errors].T, strict=True)
        return DesignSet(
            self.study, dict(zip(self._names, variables.T, strict=True)), self.goals, self.conditions,
            dict(zip(self.layout.column, rows[:, self.layout.values].T, strict=True)),
            {goal: column for goal, column in errors if not np.isnan(column).all()},
            rows[:, self.layout.code].astype(np.int32), [*self._words], rows[:, self.layout.shortfall], weights,
            meanings,
        )  # fmt: skip
