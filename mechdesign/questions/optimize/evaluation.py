"""Goals of many designs at once: every question's tables together, or design by design where that is not possible."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechdesign.errors import AssemblyError, MechdesignError, Problem, StudyError
from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.questions.look import ask, look
from mechdesign.questions.optimize import stacked
from mechdesign.questions.optimize.batch import FAILED, Batch, Evaluated, Layout, first_reason, without_numbers
from mechdesign.questions.optimize.goals import Goal, conditions_of, goals_of, shape_of, unit_of
from mechdesign.questions.optimize.stacked import grouped
from mechdesign.questions.optimize.variables import entry_of, shown
from mechdesign.questions.poses import solve_poses, study_poses
from mechdesign.questions.workspace.answer import answer
from mechdesign.questions.workspace.contained import fitting_scale
from mechdesign.questions.workspace.question import GRID_TOLERANCE, Question, batched, questions, shared, split
from mechdesign.questions.workspace.tables import index_columns
from mechdesign.region.rays import BATCH
from mechdesign.results import Result
from mechdesign.rows import Chosen, UnknownColumnError
from mechdesign.statistics import Asked
from mechdesign.study import Study
from mechdesign.study.designs import Designs
from mechdesign.study.poses import Poses
from mechdesign.study.text.units import Amount, QuantityError
from mechdesign.study.variants import remeasured, with_entries
from mechdesign.terms import Sum, terms_of

NO_REGION = "nothing of the workspace can be reached"
BETWEEN = "the motion cannot be assembled between its poses"
# Most studies of other structure that are kept.
MAX_OTHERS = 256


class Evaluator:
    """Evaluates goals for designs of one study, which differ in parameters or single places.

    Without `goals` it evaluates the study's goals and conditions. If `graded`, it also gives the rows whose worst is a
    goal, or whose root mean square is one (goals in `squares`), and how far poses are from assembling.

    Raises
    ------
    StudyError
        If no result has the column of a goal, or the study lacks a section that it needs.
    """

    def __init__(self, study: Study, goals: Sequence[Goal] = (), *, graded: bool = False) -> None:
        assert study.optimize is not None
        # Each goal and the place in the study that names it.
        moved = study.parameters.moved(study.optimize.variables)
        self._keys = goals_of(study.optimize) | conditions_of(study.optimize, moved)
        self.study, self.goals, self._graded = study, tuple(dict.fromkeys(goals or self._keys)), graded
        self.squares: set[Goal] = set()
        self._rows: dict[Goal, int] = {}
        # Goals by command and table where tables of all designs are computed at once; goals by command where they are
        # not.
        self._together: dict[str, dict[str, list[Goal]]] = {}
        self._alone: dict[str, list[Goal]] = {}
        # Outputs whose extremes are needed, and columns that are followed between the poses.
        self._outputs: set[str] = set()
        self._asked: set[Asked] = set()
        # Evaluators of studies of another structure, by the values that decide it.
        self._others: dict[tuple[float, ...], Evaluator] = {}
        # Goals with their bounds in the unit of their column.
        self._bounded: dict[Goal, Goal] = {}
        self._regional = [goal for goal in self.goals if goal.regional]
        whole = [goal for goal in self._regional if goal.outline is None]
        self._columns = tuple(dict.fromkeys(("area", *(goal.column for goal in whole))))
        # One question for each value of the held coordinates; the worst answer of a design counts.
        self.questions: list[Question] = []
        self._regions_together = True
        if self._regional:
            self.questions = questions(study, GRID_TOLERANCE, self._columns)
            together = shared(study, self.questions, moved) and not remeasured(study, study.optimize.variables)
            self._regions_together = together and all(batched(goal.column) for goal in whole)
        commands = dict.fromkeys(goal.command for goal in self.goals if not goal.regional and not goal.expression)
        problems = [*self._misfits(), *(problem for command in commands for problem in self._look(command))]
        if problems:
            # A condition with two bounds has the same problem twice.
            raise StudyError([*dict.fromkeys(problems)])
        self.goals = tuple(self._bounded.get(goal, goal) for goal in self.goals)
        # Number of assembly margins, by the commands of which every pose must be valid.
        clear: dict[str, int] = {}
        for command, tables in self._together.items() if graded else ():
            poses = study_poses(study, command)
            # Extremes may be those of a part of the poses.
            if poses.listed or set(tables) != {"extremes"}:
                clear[command] = stacked.assembly_margins(study, poses, solve_poses(study, poses)).shape[1]
        self.layout = Layout(self.goals, self._rows, clear)
        if not graded:
            self.limit_rows(0)

    def __getstate__(self) -> dict[str, Any]:
        """A copy in another process reads its questions from the study again."""
        return {name: value for name, value in self.__dict__.items() if name not in ("questions", "_others")}

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        self.__dict__.update(state)
        self._others = {}
        self.questions = questions(self.study, GRID_TOLERANCE, self._columns) if self._regional else []

    @property
    def alone(self) -> bool:
        """Whether some goals are computed design by design."""
        return bool(self._alone)

    @property
    def slow(self) -> bool:
        """Whether a design costs as much in a batch as alone: where not all goals are tables of all designs at once."""
        return bool(self._alone) or bool(self._regional)

    def limit_rows(self, most: int) -> None:
        """Leave out the rows of goals and the assembly margins where a design has more than `most` of them."""
        if self.layout.width - self.layout.head > most:
            self.squares.clear()
            self.layout = Layout(self.goals, {}, {})

    def _misfits(self) -> Iterator[Problem]:
        """Problems of bounds whose unit does not fit the bounded number of the workspace or expression."""
        columns = index_columns(self.study, self.questions[0]) if self.questions else {}
        units = {goal: columns[goal.column].unit for goal in self._regional if goal.column in columns}
        units |= {goal: unit for goal in self.goals if goal.expression and (unit := unit_of(self.study, goal.column))}
        for goal, unit in units.items():
            try:
                Amount.of(goal.bound).within(unit)
            except QuantityError as error:
                yield self.study.problem(str(error), *self._keys.get(goal, ()))

    def _look(self, command: str) -> Iterator[Problem]:
        """Problems of a command's goals, whose tables are found by a look at the study's own design."""
        goals = [goal for goal in self.goals if goal.command == command and not goal.regional]
        if command == "optimize":
            mistake = "an optimisation cannot judge itself; name a result of another command"
            yield self.study.problem(mistake, *self._keys.get(goals[0], ()))
            return
        assert self.study.optimize is not None
        together = command in stacked.TABLES and stacked.complete(self.study, command)
        if together:
            poses = study_poses(self.study, command)
            stack = stacked.tables(self.study, command, stacked.TABLES[command], poses)
            named: dict[Goal, Chosen | Sum] = {}
            for goal in goals:
                with suppress(UnknownColumnError):
                    named[goal] = self._named(goal, stack.result)
            for goal, terms in named.items():
                for chosen in terms.parts:
                    if chosen.table.name == "extremes":
                        self._outputs.update(chosen.table["output"][chosen.counts].tolist())
                    elif (asked := goal.asked_of(chosen)) is not None:
                        self._asked.add(asked)
            tables = {chosen.table.name for terms in named.values() for chosen in terms.parts}
            stack = stacked.tables(self.study, command, {"motion", *tables}, poses, self._outputs, self._asked)
            for named_goal, terms in named.items():
                goal = self._count(named_goal, terms, stack.result)
                goals.remove(named_goal)
                tables_of = self._together.setdefault(command, {})
                wanted = [tables_of.setdefault(chosen.table.name, []) for chosen in terms.parts]
                wanted[0].append(goal)
        if not goals:
            return
        # Other designs may have a result where the study's own design does not assemble.
        with suppress(AssemblyError):
            result = look(self.study, command)
            for k, goal in enumerate(goals):
                try:
                    goals[k] = self._count(goal, self._named(goal, result), result)
                except UnknownColumnError as error:
                    yield self.study.problem(str(error), *self._keys.get(goal, ()))
        self._alone.setdefault(command, []).extend(goals)

    def _named(self, goal: Goal, result: Result) -> Chosen | Sum:
        """The rows, or the sum, that a goal names."""
        terms = terms_of(result, goal.column, dict(goal.where))
        if terms.missing:
            raise UnknownColumnError(terms.missing)
        terms.bound(goal.bound)
        if isinstance(terms, Sum):
            terms.numbers()
        return terms

    def _count(self, goal: Goal, terms: Chosen | Sum, result: Result) -> Goal:
        """A goal with its bound in the unit of its column; notes how many rows the study's own design has for it."""
        self._bounded[goal] = bounded = replace(goal, bound=terms.bound(goal.bound))
        judgement = bounded.judge(result)
        if judgement.squares:
            self.squares.add(bounded)
        if judgement.rows is not None and (judgement.squares or judgement.rows.size > 1):
            self._rows[bounded] = judgement.rows.size
        return bounded

    def __call__(self, designs: Mapping[str, Floats]) -> Evaluated:
        """Evaluate a batch of designs, given by the values of the variables in the study's units."""
        forms = [name for name in designs if self._forms_study(name)]
        if not forms:
            return self._alike(designs)
        own = {name: values for name, values in designs.items() if name not in forms}
        kinds, which = np.unique(np.stack([designs[name] for name in forms], axis=1), axis=0, return_inverse=True)
        table = np.full((len(which), self.layout.width), np.nan)
        reasons = np.full(len(which), "", dtype=object)
        for k, kind in enumerate(kinds.tolist()):
            rows = np.flatnonzero(which.ravel() == k)
            try:
                other = self._of(dict(zip(forms, kind, strict=True)))
            except MechdesignError as error:
                reasons[rows] = without_numbers(error)
                continue
            found = other({name: values[rows] for name, values in own.items()})
            # Designs of another structure may have another number of rows behind their goals.
            width = self.layout.width if other.layout.width == self.layout.width else self.layout.head
            table[rows, :width] = found.table[:, :width]
            reasons[rows] = found.reasons if own else found.reasons[0]
        return Evaluated(table, reasons.tolist())

    def _forms_study(self, name: str) -> bool:
        """Whether a variable decides the structure of the study: an entry, or a whole number that is read once."""
        parameters = self.study.parameters
        return name not in parameters.known() or not parameters.moved([name]).isdisjoint(self.study.fixed)

    def _of(self, values: Mapping[str, float]) -> Evaluator:
        """The evaluator of the same goals for the study with these values of entries."""
        key = tuple(values.values())
        if key not in self._others:
            while len(self._others) >= MAX_OTHERS:
                self._others.pop(next(iter(self._others)))
            design = {name: shown(self.study, name, np.array(value)).item() for name, value in values.items()}
            study = with_entries(self.study, [entry_of(self.study, name, value) for name, value in design.items()])
            self._others[key] = Evaluator(study, self.goals, graded=self._graded)
        return self._others[key]

    def _alike(self, designs: Mapping[str, Floats]) -> Evaluated:
        """Evaluate designs of one study that differ in numbers."""
        batch = Batch(Designs(self.study, designs), self.layout)
        values: dict[str, ArrayLike] = {**self.study.parameters.nominal, **batch.designs.parameters}
        for goal in self.goals:
            if goal.expression is not None:
                found = np.asarray(goal.expression.evaluate(values))
                found = np.where(np.isfinite(found), found, np.nan)
                batch.table[:, self.layout.column[goal]] = np.abs(found) if goal.absolute else found
        if self.questions and self._regions_together:
            self._regions(batch, batch.feasible, self.questions)
        for command, tables in self._together.items():
            for rows, study, poses in grouped(batch.designs, command, batch.feasible, batch.failed):
                self._tables(batch, command, tables, rows, study, poses)
        if self._alone or not self._regions_together:
            for k in batch.feasible.tolist():
                batch.reasons[k] = self._one(batch, k)
        for goal, column in zip(self.goals, batch.table[:, self.layout.values].T, strict=True):
            batch.note(slice(None), np.isnan(column), f"{goal.name} has no value")
        return Evaluated(batch.table, [str(reason) for reason in batch.reasons])

    def _regions(self, batch: Batch, rows: Ints, asked: Sequence[Question]) -> None:
        """Numbers of the workspaces of some designs, the worst over all values of the held coordinates.

        `asked` are the questions of the study, or of a single design.
        """
        if not len(rows):
            return
        numbers, own = batch.designs.take(rows).numbers, asked is self.questions
        try:
            given = [answer(question, question.places(numbers) if own else {}, len(rows), BATCH) for question in asked]
        except AssemblyError as error:
            # The workspace of one design has no end.
            for half in batch.halves(rows, error):
                self._regions(batch, half, asked)
            return
        for question, region in zip(asked, given, strict=True):
            there = question.where if len(asked) > 1 else ""
            batch.note(rows, ~(region.panels.closes & (region.values["area"] > 0)), NO_REGION + there)
        lanes = np.arange(len(rows))
        for goal in self._regional:
            column, outline = self.layout.column[goal], goal.outline
            shape = None if outline is None else shape_of(outline, numbers.of)
            values = np.stack([
                region.values[goal.column] if shape is None else fitting_scale(shape, region.panels)[0]
                for region in given
            ])  # fmt: skip
            # A missing value counts as the worst.
            worst = np.where(np.isnan(values), np.inf, values if goal.smallest else -values).argmax(axis=0)
            batch.table[rows, column] = values[worst, lanes]
            if split(goal.column)[1] == "mean":
                errors = np.stack([region.errors[goal.column] for region in given])
                batch.table[rows, len(self.goals) + column] = errors[worst, lanes]

    def _tables(
        self, batch: Batch, command: str, tables: Mapping[str, Sequence[Goal]], rows: Ints, study: Study, poses: Poses
    ) -> None:
        wanted = {*tables, "motion"} if self.squares.intersection(chain(*tables.values())) else set(tables)
        try:
            stack = stacked.tables(study, command, wanted, poses, self._outputs, self._asked)
        except MechdesignError as error:
            for half in batch.halves(rows, error):
                own = study_poses(study, command, batch.designs.take(half).numbers)
                self._tables(batch, command, tables, half, study, own)
            return
        failed = FAILED[first_reason(stack.reason)]
        wrong = stack.reason != 0
        partly = all(goal.unassembled for goals in tables.values() for goal in goals)
        batch.note(rows, wrong.all(axis=1) if partly else wrong.any(axis=1), failed)
        batch.note(rows, ~stack.whole & (not partly), BETWEEN)
        clear = self.layout.assembly.get(command)
        if self._graded and (clear is not None or (batch.reasons[rows] != "").any()):
            margins = stacked.assembly_margins(study, poses, stack.solved or solve_poses(study, poses))
            batch.table[rows, self.layout.shortfall] = stacked.shortfall(margins)
            if clear is not None and margins.shape[1] == clear.stop - clear.start:
                batch.table[rows, clear] = margins
        for goal in [goal for goals in tables.values() for goal in goals]:
            lost = np.isnan(batch.judge(goal, stack.result, rows))
            batch.note(rows, lost & (failed != ""), failed)

    def _needed(self, study: Study) -> Study:
        """The study without costly parts that no goal needs: allocation of tolerances, Sobol' indices."""
        section, columns = study.reliability, [goal.column for goal in self.goals]
        if section is None:
            return study
        if "cost_allocated" not in columns:
            section = section.model_copy(update={"allocate": None})
        if not any(column.startswith("sobol_") for column in columns):
            section = section.model_copy(update={"sobol": 0})
        return replace(study, reliability=section)

    def _one(self, batch: Batch, k: int) -> str:
        """Evaluate the other goals of one design; returns why it is infeasible, empty if it is not."""
        row = np.array([k])
        command = ""
        try:
            other = batch.designs.one(k)
            if not self._regions_together:
                self._regions(batch, row, questions(other, GRID_TOLERANCE, self._columns))
                if batch.reasons[k]:
                    return str(batch.reasons[k])
            other = self._needed(other)
            for command, goals in self._alone.items():
                result = ask(other, command)
                partly = [not goal.unassembled and missing(goal, result) for goal in goals]
                values = [batch.judge(goal, result, row) for goal in goals]
                if result.failed or any(partly) or np.isnan(values).any():
                    return self._pose_reason(batch, k, other, command) or (BETWEEN if any(partly) else "")
        except UnknownColumnError as error:
            return str(error)
        except AssemblyError as error:
            return (self._pose_reason(batch, k, other, command) if command else "") or without_numbers(error)
        except MechdesignError as error:
            return without_numbers(error)
        return ""

    def _pose_reason(self, batch: Batch, k: int, study: Study, command: str) -> str:
        """Why poses of a design fail, empty where none does; notes their shortfall from assembling."""
        if command == "workspace":
            return NO_REGION
        poses = study_poses(study, command)
        solved = list(solve_poses(study, poses))
        if self._graded:
            batch.table[k, self.layout.shortfall] = stacked.shortfall(stacked.assembly_margins(study, poses, solved))[0]
        return str(FAILED[first_reason(np.concatenate([part.configuration.reason for part in solved])[None])[0]])


def missing(goal: Goal, result: Result) -> str:
    """Invalid poses or parts of the motion among those that a goal judges, in words; empty where all are valid."""
    scopes = [chosen.table.scope for chosen in terms_of(result, goal.column, dict(goal.where)).parts]
    return next((scope.missing for scope in scopes if scope is not None and scope.missing), "")
