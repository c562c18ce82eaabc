"""Goals of designs: one evaluation for every question, of thousands of designs at once wherever that is possible."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.look import ask, look
from mechdesign.analyses.optimize import stacked
from mechdesign.analyses.optimize.assembling import assembly_margins, shortfall
from mechdesign.analyses.optimize.objectives import Goal, bounds_of, goal, goals_of
from mechdesign.analyses.poses import solve_poses, study_poses
from mechdesign.analyses.region.panels import BATCH
from mechdesign.analyses.workspace.question import GRID_TOLERANCE, Question, answer, questions, split
from mechdesign.errors import AssemblyError, MechdesignError, Problem, StudyError
from mechdesign.expressions import Number
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.results import Result
from mechdesign.rows import UnknownColumnError, choose
from mechdesign.study import Study
from mechdesign.study.variants import faults, follows, variant

EMPTY = "nothing of the workspace can be reached"
# Tables that may be of some poses only.
SOME = ("extremes",)
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.])")
# By `mechdesign.mechanism.Reason`.
FAILED = (
    "",
    "a pose cannot be assembled",
    "a pose is reached in another assembly only",
    "a pose is outside the limits",
    "a pose does not hold its load",
)


@dataclass(frozen=True, eq=False)
class Evaluated:
    """Values of goals for a batch of designs; nan where there is none, and why.

    Parameters
    ----------
    rows : dict of Goal to ndarray, shape (designs, rows)
        What the goals in `Evaluator.rows` are the worst of, or in `Evaluator.squares` the root mean square.
    shortfall : ndarray, shape (designs,)
        How far each design's poses are from assembling, 0 where they do; nan where there is no such design.
    assembly_margins : ndarray, shape (designs, `Evaluator.assembly_margins`)
        Margins that every pose must have, negative where it does not assemble.
    """

    values: dict[Goal, Floats]
    rows: dict[Goal, Floats]
    shortfall: Floats
    assembly_margins: Floats
    errors: dict[str, Floats]
    reasons: list[str]


class Evaluator:
    """Evaluates goals for designs of one study, which differ in parameters or single places.

    Three ways lead to the same numbers: the workspaces of all designs, and the tables of all designs, are computed
    together; what is left is asked of each design by a variant of the study.

    Parameters
    ----------
    most_rows : int
        How many rows a design may have for them to be given, too, of goals that are the worst of several (or the root
        mean square, in `squares`) and of assembly margins; `rows` and `assembly_margins` have their numbers.

    Raises
    ------
    StudyError
        If a goal names what no result has, or the study lacks what it needs.
    """

    def __init__(self, study: Study, goals: Sequence[Goal], *, most_rows: int = 0) -> None:
        assert study.optimize is not None
        self.study = study
        self.goals = list(dict.fromkeys(goals))
        self.rows: dict[Goal, int] = {}
        self.squares: set[Goal] = set()
        self.assembly_margins = 0
        self.question: Question | None = None
        self._graded = most_rows > 0
        self._columns = tuple(dict.fromkeys(("area", *(g.column for g in self.goals if g.regional))))
        names = study.optimize.variables
        if any(each.regional for each in self.goals):
            asked = questions(study, GRID_TOLERANCE, self._columns)
            if len(asked) > 1:
                message = "an optimisation compares one workspace a design: hold one value of each coordinate"
                raise StudyError([study.problem(message, "workspace", "at")])
            if all(each.index for each in self.goals if each.regional) and not follows(study, names, ("workspace",)):
                self.question = asked[0]
        # Goals of commands and tables whose answers are found for all designs at once; the others.
        self._together: dict[str, dict[str, list[Goal]]] = {}
        self._alone: dict[str, list[Goal]] = {}
        # Outputs whose extremes are asked.
        self._outputs: set[str] = set()
        problems = [problem for command in self._commands() for problem in self._look(command)]
        if problems:
            raise StudyError(problems)
        self._formulas = {command: stacked.formulas_of(study, command) for command in self._together}
        # By command of which every pose must be valid: the columns of its assembly margins.
        self._clear: dict[str, slice] = {}
        for command, tables in self._together.items() if most_rows else ():
            poses = study_poses(study, command)
            if poses.listed or any(table not in SOME for table in tables):
                begin = self.assembly_margins
                self.assembly_margins += assembly_margins(study, poses).shape[1]
                self._clear[command] = slice(begin, self.assembly_margins)
        self.limit_rows(most_rows)

    @property
    def together(self) -> bool:
        """Whether all goals are tables that are found for all designs at once."""
        return not self._alone and not any(each.regional for each in self.goals)

    def limit_rows(self, most: int) -> None:
        """Leave out the rows of goals and the assembly margins where a design has more than so many."""
        if self.assembly_margins + sum(self.rows.values()) > most:
            self.rows.clear()
            self.squares.clear()
            self._clear.clear()
            self.assembly_margins = 0

    def _commands(self) -> list[str]:
        return list(dict.fromkeys(each.command for each in self.goals if not each.regional))

    def _look(self, command: str) -> Iterator[Problem]:
        """Find the tables of a command's goals, before anything is computed but the study's own design."""
        goals = [each for each in self.goals if each.command == command and not each.regional]
        if command == "optimize":
            yield self.study.problem("an optimisation cannot judge itself", *self._key(goals[0]))
            return
        assert self.study.optimize is not None
        if command in stacked.TABLES:
            result = stacked.tables(self.study, command, stacked.TABLES[command], 1, {}, {}).result
            together = stacked.possible(self.study, command, self.study.optimize.variables)
            for each in list(goals):
                try:
                    chosen = choose(result, each.column, dict(each.where))
                    self._count(each, result)
                except UnknownColumnError:
                    continue
                goals.remove(each)
                table = chosen.table.name
                if table == "extremes":
                    self._outputs.update(chosen.table["output"][chosen.counts].tolist())
                if together:
                    self._together.setdefault(command, {}).setdefault(table, []).append(each)
                else:
                    self._alone.setdefault(command, []).append(each)
        if not goals:
            return
        self._alone.setdefault(command, []).extend(goals)
        try:
            result = look(self.study, command)
        except AssemblyError:
            # The study's own design has no such result; others tell.
            return
        for each in goals:
            try:
                self._count(each, result)
            except UnknownColumnError as error:
                yield self.study.problem(str(error), *self._key(each))

    def _count(self, each: Goal, result: Result) -> None:
        """Note how many rows a goal is the worst of, or the root mean square, by the study's own design."""
        if missing := choose(result, each.column, dict(each.where)).missing:
            raise UnknownColumnError(missing)
        rows, residuals = each.judged(result)[1], each.residuals(result)
        if residuals is not None:
            self.rows[each] = residuals.size
            self.squares.add(each)
        elif rows is not None and rows.size > 1:
            self.rows[each] = rows.size

    def _key(self, wanted: Goal) -> tuple[str | int, ...]:
        """Where the study names a goal."""
        section = self.study.optimize
        assert section is not None
        goals = goals_of(section)
        if wanted in goals:
            index = goals.index(wanted)
            first = len(section.maximize)
            return ("optimize", "maximize", index) if index < first else ("optimize", "minimize", index - first)
        for index, condition in enumerate(section.subject_to):
            if any(judged == wanted for judged, _, _ in bounds_of(condition)):
                return "optimize", "subject_to", index
        return ("optimize",)

    def __call__(self, designs: Mapping[str, Floats]) -> Evaluated:
        """Evaluate a batch of designs, given by the values of the variables in the study's units."""
        count = len(next(iter(designs.values())))
        batch = _Batch(self.study, designs, count, self)
        if self.question is not None:
            self._workspaces(batch, np.flatnonzero(batch.feasible))
        for command, tables in self._together.items():
            rows, size = np.flatnonzero(batch.feasible), stacked.size(self.study, command)
            for begin in range(0, len(rows), size):
                self._tables(batch, command, tables, rows[begin : begin + size])
        alone = bool(self._alone) or (self.question is None and any(each.regional for each in self.goals))
        for k in np.flatnonzero(batch.feasible).tolist():
            if alone or k in batch.left:
                batch.reasons[k] = self._one(batch, k)
        reasons = [str(reason) for reason in batch.reasons]
        return Evaluated(batch.values, batch.rows, batch.shortfall, batch.assembly_margins, batch.errors, reasons)

    def _workspaces(self, batch: _Batch, rows: Ints) -> None:
        if not len(rows):
            return
        assert self.question is not None
        try:
            self._regional(batch, rows, self.question, batch.take(batch.places, rows))
        except AssemblyError as error:
            # One design's workspace has no end; the others are still to be told.
            if len(rows) == 1:
                batch.reasons[rows] = _plainly(error)
                return
            for half in np.array_split(rows, 2):
                self._workspaces(batch, half)

    def _regional(self, batch: _Batch, rows: Ints, question: Question, places: dict[str, Floats]) -> None:
        given = answer(question, places, len(rows), BATCH)
        for each in self.goals:
            if each.regional:
                batch.values[each][rows] = given.values[each.column]
                if split(each.column)[1] == "mean":
                    batch.errors.setdefault(each.name, np.full(len(batch.reasons), np.nan))[rows] = given.errors[
                        each.column
                    ]
        batch.reasons[rows[~(given.panels.closes & (given.values["area"] > 0))]] = EMPTY

    def _tables(self, batch: _Batch, command: str, tables: Mapping[str, Sequence[Goal]], rows: Ints) -> None:
        places, parameters = batch.take(batch.places, rows), batch.take(batch.parameters, rows)
        wanted = {*tables, "motion"} if self.squares.intersection(*tables.values()) else set(tables)
        stack = stacked.tables(self.study, command, wanted, len(rows), places, parameters, self._outputs,
                               self._formulas[command], graded=self._graded)  # fmt: skip
        failed = FAILED_ARRAY[_first(stack.reason)]
        wrong = stack.reason != 0
        # The errors of the poses that are left would be the smaller the more of them are lost.
        whole = stack.listed or "targets" in tables
        batch.note(rows, wrong.any(axis=1) if whole else wrong.all(axis=1), failed)
        some = np.ones(len(rows), dtype=bool) if command in self._clear else batch.reasons[rows] != ""
        if stack.assembly_margins is not None:
            self._grade(batch, command, rows, stack.assembly_margins)
        elif self._graded and some.any():
            poses = stacked.poses_of(
                self.study, command, int(some.sum()), batch.take(batch.places, rows[some]),
                batch.take(batch.parameters, rows[some]), self._formulas[command],
            )  # fmt: skip
            self._grade(batch, command, rows[some], assembly_margins(self.study, poses))
        for table, goals in tables.items():
            left = stack.open.get(table, np.zeros(len(rows), dtype=bool))
            for each in goals:
                values = batch.judge(each, stack.result, rows)
                lost = np.isnan(values) & ~left
                batch.note(rows, lost, np.where(failed == "", f"{each.name} has no value", failed))
            for k in rows[left].tolist():
                batch.left.setdefault(k, {}).setdefault(command, []).extend(goals)

    def _grade(self, batch: _Batch, command: str, rows: Ints, margins: Floats) -> None:
        """Note how far some designs are from assembling."""
        batch.shortfall[rows] = shortfall(margins)
        if command in self._clear:
            batch.assembly_margins[rows, self._clear[command]] = margins

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
            if self.question is None and any(each.regional for each in self.goals):
                self._regional(batch, row, questions(other, GRID_TOLERANCE, self._columns)[0], {})
                if batch.reasons[k]:
                    return str(batch.reasons[k])
            left = batch.left.get(k, {})
            other = self._needed(other)
            for command in dict.fromkeys((*self._alone, *left)):
                result, asked = ask(other, command), (*self._alone.get(command, ()), *left.get(command, ()))
                whole = any(choose(result, each.column, dict(each.where)).table.name == "targets" for each in asked)
                if result.failed or (whole and _pose_reason(other, command)):
                    return self._reason(batch, k, other, command)
                for each in asked:
                    if np.isnan(batch.judge(each, result, row)).any():
                        return self._reason(batch, k, other, command) or f"{each.name} has no value"
        except UnknownColumnError as error:
            return str(error)
        except AssemblyError as error:
            return (self._reason(batch, k, other, command) if command else "") or _plainly(error)
        except MechdesignError as error:
            return _plainly(error)
        return ""

    def _reason(self, batch: _Batch, k: int, study: Study, command: str) -> str:
        """Why poses of one design fail, and by how much; empty where none does."""
        if self._graded and command != "workspace":
            (batch.shortfall[k],) = shortfall(assembly_margins(study, study_poses(study, command)))
        return _pose_reason(study, command)


class _Batch:
    """Designs of one call, and what is found of them."""

    def __init__(self, study: Study, designs: Mapping[str, Floats], count: int, evaluator: Evaluator) -> None:
        self.designs = {name: np.broadcast_to(np.asarray(v, dtype=float), count) for name, v in designs.items()}
        values = study.parameters.values(self.designs)
        self.parameters = {name: value for name, value in values.items() if np.ndim(value)}
        self.places = study.parameters.places(self.designs)
        self.values: dict[Goal, Floats] = {each: np.full(count, np.nan) for each in evaluator.goals}
        self.rows = {each: np.full((count, size), np.nan) for each, size in evaluator.rows.items()}
        self._squares = evaluator.squares
        self.assembly_margins = np.full((count, evaluator.assembly_margins), np.nan)
        self.errors: dict[str, Floats] = {}
        # What is still to be asked of single designs, by their row and by command.
        self.left: dict[int, dict[str, list[Goal]]] = {}
        self.reasons = np.array(faults(study, self.parameters, self.places, count), dtype=object)
        self.shortfall = np.where(self.feasible, 1.0, np.nan)

    @property
    def feasible(self) -> Flags:
        """Designs that nothing is said against."""
        return np.asarray(self.reasons == "", dtype=bool)

    def take(self, values: Mapping[str, Number], rows: Ints) -> dict[str, Floats]:
        """Values of some designs."""
        return {
            name: np.broadcast_to(np.asarray(value, dtype=float), len(self.reasons))[rows]
            for name, value in values.items()
        }

    def judge(self, each: Goal, result: Result, rows: Ints) -> Floats:
        """Note the values of a goal by a result of some designs; returns them."""
        values, listed = each.judged(result, len(rows))
        self.values[each][rows] = values
        if each in self._squares:
            listed = each.residuals(result, len(rows))
        if each in self.rows and listed is not None and listed.shape[1] == self.rows[each].shape[1]:
            self.rows[each][rows] = listed
        return values

    def note(self, rows: Ints, wrong: Flags, reasons: NDArray[np.object_]) -> None:
        """Say what is wrong with some of the rows, where nothing has been said yet."""
        new = wrong & (self.reasons[rows] == "")
        self.reasons[rows[new]] = reasons[new]


FAILED_ARRAY = np.array(FAILED, dtype=object)


def _first(reason: NDArray[np.int8]) -> Ints:
    """The first reason of each design's poses, shape (designs,); 0 where none fails."""
    worst = np.where(reason == 0, len(FAILED), reason).min(axis=1, initial=len(FAILED))
    return np.where(worst == len(FAILED), 0, worst).astype(np.intp)


def _pose_reason(study: Study, command: str) -> str:
    """Why poses of a command fail; empty where none does, or where it is not asked of poses."""
    if command == "workspace":
        return EMPTY
    found = [solved.configuration.reason for solved in solve_poses(study, study_poses(study, command))]
    return FAILED[int(_first(np.concatenate(found)[None])[0])]


def _plainly(error: MechdesignError) -> str:
    """An error without its numbers and the file's name, so that designs with one mistake count together."""
    text = str(error).splitlines()[0]
    if isinstance(error, StudyError):
        first = error.problems[0]
        text = ": ".join(part for part in (first.key, first.message) if part)
    return NUMBER.sub("...", text)


__all__ = ["Evaluated", "Evaluator", "Goal", "bounds_of", "goal", "goals_of"]
