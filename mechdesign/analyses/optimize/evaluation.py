"""Goals of many designs at once: every question's tables together, or design by design where that is not possible."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.kinematics.along import Along
from mechdesign.analyses.kinematics.analysis import A_ROW_A_POSE
from mechdesign.analyses.look import ask, look
from mechdesign.analyses.optimize import stacked
from mechdesign.analyses.optimize.goals import Goal, conditions_of, goals_of, unit_of
from mechdesign.analyses.poses import POSES_AT_ONCE, solve_poses, study_poses
from mechdesign.analyses.region.rays import BATCH
from mechdesign.analyses.workspace.analysis import index_meanings
from mechdesign.analyses.workspace.contained import fitting_scale
from mechdesign.analyses.workspace.question import GRID_TOLERANCE, Question, answer, batched, questions, split
from mechdesign.analyses.workspace.ranged import Ranged
from mechdesign.analyses.workspace.tables import where
from mechdesign.errors import AssemblyError, MechdesignError, Problem, StudyError
from mechdesign.expressions import Number
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.results import Result
from mechdesign.rows import Chosen, UnknownColumnError, choose
from mechdesign.study import Study
from mechdesign.study.text.units import Amount, QuantityError
from mechdesign.study.variants import faults, follows, variant

NO_REGION = "nothing of the workspace can be reached"
BETWEEN = "the motion cannot be assembled between its poses"
_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.])")
# Why a pose fails, by `mechdesign.mechanism.Reason`.
FAILED = np.array([
    "",
    "a pose cannot be assembled",
    "a pose is reached in another assembly only",
    "a pose is outside the limits",
    "a pose does not hold its load",
], dtype=object)  # fmt: skip


class Layout:
    """Columns of what is found of designs.

    Values of the goals and their estimated errors (nan where there is none); how far the poses are from assembling
    (`mechdesign.analyses.optimize.stacked.shortfall`, nan where there is no such design); a code that is 0 where the
    design can be built; then `rows` that goals are made of, and `assembly` margins of commands.
    """

    def __init__(self, goals: Sequence[Goal], rows: Mapping[Goal, int], assembly: Mapping[str, int]) -> None:
        count = len(goals)
        self.column = {each: k for k, each in enumerate(goals)}
        self.values, self.errors = slice(0, count), slice(count, 2 * count)
        self.shortfall, self.code, self.head = 2 * count, 2 * count + 1, 2 * count + 2
        ends = np.cumsum([self.head, *rows.values(), *assembly.values()]).tolist()
        places = [slice(begin, end) for begin, end in pairwise(ends)]
        self.rows = dict(zip(rows, places, strict=False))
        self.assembly = dict(zip(assembly, places[len(rows) :], strict=True))
        self.margins = slice(ends[len(rows)], ends[-1])
        self.width = ends[-1]


class Evaluated(NamedTuple):
    """A row of a `Layout` for each design, and why it cannot be built (empty where it can); its code is still nan."""

    table: Floats
    reasons: list[str]


class Evaluator:
    """Evaluates goals for designs of one study, which differ in parameters or single places.

    Goals that are left out are those of the study, and its conditions. Graded, it also gives the rows that goals are
    the worst of, or the root mean square of (those in `squares`), and how far poses are from assembling.

    Raises
    ------
    StudyError
        If a goal names what no result has, or the study lacks what it needs.
    """

    def __init__(self, study: Study, goals: Sequence[Goal] = (), *, graded: bool = False) -> None:
        assert study.optimize is not None
        # Where the study names each.
        self._keys = goals_of(study.optimize) | conditions_of(study.optimize)
        self.study, self.goals, self._graded = study, tuple(dict.fromkeys(goals or self._keys)), graded
        self.squares: set[Goal] = set()
        self._rows: dict[Goal, int] = {}
        # Goals of commands and tables whose answers are found for all designs at once; those asked of each design.
        self._together: dict[str, dict[str, list[Goal]]] = {}
        self._alone: dict[str, list[Goal]] = {}
        # Outputs whose extremes are asked, and columns whose worst value counts between the poses, too.
        self._outputs: set[str] = set()
        self._columns_between: set[str] = set()
        # Goals with their bounds in the unit of their column.
        self._bounded: dict[Goal, Goal] = {}
        self._regional = [each for each in self.goals if each.regional]
        whole = [each for each in self._regional if each.shape is None]
        self._columns = tuple(dict.fromkeys(("area", *(each.column for each in whole))))
        # One for each value of the held coordinates; of each design the worst counts.
        self.questions: list[Question] = []
        self._regions_together = True
        if self._regional:
            self.questions = questions(study, GRID_TOLERANCE, self._columns)
            one_by_one = follows(study, study.optimize.variables, ("workspace",))
            one_by_one |= isinstance(self.questions[0].field, Ranged)
            self._regions_together = not one_by_one and all(batched(each.column) for each in whole)
        commands = dict.fromkeys(each.command for each in self.goals if not each.regional and not each.expression)
        problems = [*self._misfits(), *(problem for command in commands for problem in self._look(command))]
        if problems:
            # A condition of two bounds would be named twice.
            raise StudyError([*dict.fromkeys(problems)])
        self.goals = tuple(self._bounded.get(each, each) for each in self.goals)
        self._poses = {command: stacked.poses_of(study, command) for command in self._together}
        # By command of which every pose must be valid: the number of its assembly margins.
        clear: dict[str, int] = {}
        for command, tables in self._together.items() if graded else ():
            poses = self._poses[command](1, {}, {})
            # Extremes may be of some of the poses only.
            if poses.listed or set(tables) != {"extremes"}:
                clear[command] = stacked.assembly_margins(study, poses, solve_poses(study, poses)).shape[1]
        self.layout = Layout(self.goals, self._rows, clear)
        if not graded:
            self.limit_rows(0)

    def __getstate__(self) -> dict[str, Any]:
        """What the study gives again, where it travels to."""
        return {name: value for name, value in self.__dict__.items() if name not in ("questions", "_poses")}

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        self.__dict__.update(state)
        self.questions = questions(self.study, GRID_TOLERANCE, self._columns) if self._regional else []
        self._poses = {command: stacked.poses_of(self.study, command) for command in self._together}

    @property
    def slow(self) -> bool:
        """Whether a design costs as much alone as among others: not where all goals are tables found at once."""
        return bool(self._alone) or bool(self._regional)

    def limit_rows(self, most: int) -> None:
        """Leave out the rows of goals and the assembly margins where a design has more than so many."""
        if self.layout.width - self.layout.head > most:
            self.squares.clear()
            self.layout = Layout(self.goals, {}, {})

    def _misfits(self) -> Iterator[Problem]:
        """Bounds that are of another kind than the number of the workspace, or the expression, that they bound."""
        meanings = index_meanings(self.study, self.questions[0]) if self.questions else {}
        units = {each: meanings[each.column][0] for each in self._regional if each.column in meanings}
        units |= {each: unit for each in self.goals if each.expression and (unit := unit_of(self.study, each.column))}
        for each, unit in units.items():
            try:
                Amount.of(each.bound).within(unit)
            except QuantityError as error:
                yield self.study.problem(str(error), *self._keys.get(each, ()))

    def _look(self, command: str) -> Iterator[Problem]:
        """Find the tables of a command's goals, before anything is computed but the study's own design."""
        goals = [each for each in self.goals if each.command == command and not each.regional]
        if command == "optimize":
            mistake = "an optimisation cannot judge itself; name a result of another command"
            yield self.study.problem(mistake, *self._keys.get(goals[0], ()))
            return
        assert self.study.optimize is not None
        together = command in stacked.TABLES and stacked.possible(self.study, command, self.study.optimize.variables)
        if command in stacked.TABLES:
            poses = stacked.poses_of(self.study, command)(1, {}, {})
            gates = [each.column for each in goals if each.gate and not each.where]
            columns = [column.removeprefix(f"{table}.") for column in gates for table in A_ROW_A_POSE]
            stack = stacked.tables(self.study, command, stacked.TABLES[command], poses, columns=columns)
            for each in list(goals):
                with suppress(UnknownColumnError):
                    goal, chosen = self._count(each, stack.result, stack.along)
                    goals.remove(each)
                    if chosen.table.name == "extremes":
                        self._outputs.update(chosen.table["output"][chosen.counts].tolist())
                    elif chosen.table.name in A_ROW_A_POSE and each.gate and not each.where:
                        self._columns_between.add(chosen.column)
                    if together:
                        self._together.setdefault(command, {}).setdefault(chosen.table.name, []).append(goal)
                    else:
                        self._alone.setdefault(command, []).append(goal)
        if not goals:
            return
        # Where the study's own design has no such result, other designs may.
        with suppress(AssemblyError):
            result = look(self.study, command)
            for k, each in enumerate(goals):
                try:
                    goals[k], _ = self._count(each, result)
                except UnknownColumnError as error:
                    yield self.study.problem(str(error), *self._keys.get(each, ()))
        self._alone.setdefault(command, []).extend(goals)

    def _count(self, each: Goal, result: Result, along: Along | None = None) -> tuple[Goal, Chosen]:
        """A goal with its bound in the unit of its column.

        How many rows it is the worst of, or the root mean square, by the study's own design, is noted.
        """
        chosen = choose(result, each.column, dict(each.where))
        if chosen.missing:
            raise UnknownColumnError(chosen.missing)
        self._bounded[each] = each = replace(each, bound=chosen.bound(each.bound))
        judgement = each.judge(result, 1, along)
        if judgement.squares:
            self.squares.add(each)
        if judgement.rows is not None and (judgement.squares or judgement.rows.size > 1):
            self._rows[each] = judgement.rows.size
        return each, chosen

    def __call__(self, designs: Mapping[str, Floats]) -> Evaluated:
        """Evaluate a batch of designs, given by the values of the variables in the study's units."""
        batch = _Batch(self, designs)
        values = {**self.study.parameters.nominal, **batch.parameters}
        for each in self.goals:
            if each.expression is not None:
                found = np.asarray(each.expression.evaluate(values))
                found = np.where(np.isfinite(found), found, np.nan)
                batch.table[:, self.layout.column[each]] = np.abs(found) if each.absolute else found
        if self.questions and self._regions_together:
            self._regions(batch, batch.feasible, self.questions, batch.places)
        for command, tables in self._together.items():
            rows, size = batch.feasible, max(1, POSES_AT_ONCE // self._poses[command](1, {}, {}).count)
            for begin in range(0, len(rows), size):
                self._tables(batch, command, tables, rows[begin : begin + size])
        if self._alone or not self._regions_together:
            for k in batch.feasible.tolist():
                batch.reasons[k] = self._one(batch, k)
        for each, values in zip(self.goals, batch.table[:, self.layout.values].T, strict=True):
            batch.note(slice(None), np.isnan(values), f"{each.name} has no value")
        return Evaluated(batch.table, [str(reason) for reason in batch.reasons])

    def _regions(
        self, batch: _Batch, rows: Ints, asked: Sequence[Question], places: Mapping[str, Number]
    ) -> None:  # fmt: skip
        """Numbers of the workspaces of some designs, the worst of all values of the held coordinates."""
        if not len(rows):
            return
        try:
            given = [answer(question, batch.take(places, rows), len(rows), BATCH) for question in asked]
        except AssemblyError as error:
            # One design's workspace has no end; the others are asked in halves.
            if len(rows) == 1:
                batch.reasons[rows] = _plainly(error)
                return
            for half in np.array_split(rows, 2):
                self._regions(batch, half, asked, places)
            return
        for question, each in zip(asked, given, strict=True):
            there = where(question) if len(asked) > 1 else ""
            batch.note(rows, ~(each.panels.closes & (each.values["area"] > 0)), NO_REGION + there)
        lanes = np.arange(len(rows))
        for goal in self._regional:
            column, shape = self.layout.column[goal], goal.shape
            values = np.stack([
                each.values[goal.column] if shape is None else fitting_scale(shape, each.panels)[0] for each in given
            ])  # fmt: skip
            # Where one has no value none is worse.
            worst = np.where(np.isnan(values), np.inf, values if goal.smallest else -values).argmax(axis=0)
            batch.table[rows, column] = values[worst, lanes]
            if split(goal.column)[1] == "mean":
                errors = np.stack([each.errors[goal.column] for each in given])
                batch.table[rows, len(self.goals) + column] = errors[worst, lanes]

    def _tables(self, batch: _Batch, command: str, tables: Mapping[str, Sequence[Goal]], rows: Ints) -> None:
        poses = self._poses[command](len(rows), batch.take(batch.places, rows), batch.take(batch.parameters, rows))
        wanted = {*tables, "motion"} if self.squares.intersection(*tables.values()) else set(tables)
        stack = stacked.tables(self.study, command, wanted, poses, self._outputs, self._columns_between)
        failed = FAILED[_first(stack.reason)]
        wrong = stack.reason != 0
        partly = all(each.unassembled for goals in tables.values() for each in goals)
        batch.note(rows, wrong.all(axis=1) if partly else wrong.any(axis=1), failed)
        batch.note(rows, ~stack.whole & (not partly), BETWEEN)
        clear = self.layout.assembly.get(command)
        if self._graded and (clear is not None or (batch.reasons[rows] != "").any()):
            margins = stacked.assembly_margins(self.study, poses, stack.solved or solve_poses(self.study, poses))
            batch.table[rows, self.layout.shortfall] = stacked.shortfall(margins)
            if clear is not None:
                batch.table[rows, clear] = margins
        for each in [each for goals in tables.values() for each in goals]:
            lost = np.isnan(batch.judge(each, stack.result, rows, stack.along))
            batch.note(rows, lost & (failed != ""), failed)

    def _needed(self, study: Study) -> Study:
        """The study without what no goal asks and costs much more than the goals: tolerances, Sobol' indices."""
        section, columns = study.reliability, [each.column for each in self.goals]
        if section is None:
            return study
        if "cost_allocated" not in columns:
            section = section.model_copy(update={"allocate": None})
        if not any(column.startswith("sobol_") for column in columns):
            section = section.model_copy(update={"sobol": 0})
        return replace(study, reliability=section)

    def _one(self, batch: _Batch, k: int) -> str:
        """Ask what is left of one design; returns why it is infeasible."""
        row = np.array([k])
        command = ""
        try:
            other = variant(self.study, {name: float(column[k]) for name, column in batch.designs.items()})
            if not self._regions_together:
                self._regions(batch, row, questions(other, GRID_TOLERANCE, self._columns), {})
                if batch.reasons[k]:
                    return str(batch.reasons[k])
            other = self._needed(other)
            for command, goals in self._alone.items():
                result = ask(other, command)
                partly = [not each.unassembled and missing(each, result) for each in goals]
                values = [batch.judge(each, result, row) for each in goals]
                if result.failed or any(partly) or np.isnan(values).any():
                    return self._pose_reason(batch, k, other, command) or (BETWEEN if any(partly) else "")
        except UnknownColumnError as error:
            return str(error)
        except AssemblyError as error:
            return (self._pose_reason(batch, k, other, command) if command else "") or _plainly(error)
        except MechdesignError as error:
            return _plainly(error)
        return ""

    def _pose_reason(self, batch: _Batch, k: int, study: Study, command: str) -> str:
        """Why poses of one design fail, empty where none does; notes how far they are from assembling."""
        if command == "workspace":
            return NO_REGION
        poses = study_poses(study, command)
        solved = list(solve_poses(study, poses))
        if self._graded:
            batch.table[k, self.layout.shortfall] = stacked.shortfall(stacked.assembly_margins(study, poses, solved))[0]
        return str(FAILED[_first(np.concatenate([each.configuration.reason for each in solved])[None])[0]])


class _Batch:
    """Designs of one call, and what is found of them."""

    def __init__(self, evaluator: Evaluator, designs: Mapping[str, Floats]) -> None:
        count = len(next(iter(designs.values())))
        parameters = evaluator.study.parameters
        self.designs, self._layout = designs, evaluator.layout
        self.parameters = {name: value for name, value in parameters.values(designs).items() if np.ndim(value)}
        self.places = parameters.places(designs)
        self.reasons = np.array(faults(evaluator.study, self.parameters, self.places, count), dtype=object)
        self.table = np.full((count, self._layout.width), np.nan)
        self.table[self.feasible, self._layout.shortfall] = 1.0

    @property
    def feasible(self) -> Ints:
        """Rows of the designs that have no reason to be infeasible so far."""
        return np.flatnonzero(self.reasons == "")

    def take(self, values: Mapping[str, Number], rows: Ints) -> dict[str, Floats]:
        """Values of some designs."""
        count = len(self.reasons)
        return {name: np.broadcast_to(np.asarray(v, dtype=float), count)[rows] for name, v in values.items()}

    def judge(self, each: Goal, result: Result, rows: Ints, along: Along | None = None) -> Floats:
        """Note the values of a goal by a result of some designs; returns them."""
        values, listed, _ = each.judge(result, len(rows), along)
        self.table[rows, self._layout.column[each]] = values
        place = self._layout.rows.get(each, slice(0))
        if listed is not None and listed.shape[1] == place.stop - (place.start or 0):
            self.table[rows, place] = listed
        return values

    def note(self, rows: Ints | slice, wrong: Flags, reasons: NDArray[np.object_] | str) -> None:
        """Say what is wrong with some of the rows, where nothing has been said yet."""
        self.reasons[rows] = np.where(wrong & (self.reasons[rows] == ""), reasons, self.reasons[rows])


def missing(goal: Goal, result: Result) -> str:
    """Which poses or parts of the motion that a goal is of are not valid, in words; empty where all are."""
    scope = choose(result, goal.column, dict(goal.where)).table.scope
    return scope.missing if scope is not None else ""


def _first(reason: NDArray[np.int8]) -> Ints:
    """The first reason of each design's poses, shape (designs,); 0 where none fails."""
    worst = np.where(reason == 0, len(FAILED), reason).min(axis=1, initial=len(FAILED))
    return np.where(worst == len(FAILED), 0, worst).astype(np.intp)


def _plainly(error: MechdesignError) -> str:
    """An error without its numbers and the file's name, so that designs with one mistake count together."""
    text = str(error).splitlines()[0]
    if isinstance(error, StudyError):
        first = error.problems[0]
        text = ": ".join(part for part in (first.key, first.message) if part)
    return _NUMBER.sub("...", text)
