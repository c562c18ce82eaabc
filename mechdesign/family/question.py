"""What is asked of every design: its goals and conditions, and the tables, regions and rows they need."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from typing import Any

from mechdesign.family import stacked
from mechdesign.family.batch import Layout
from mechdesign.family.goals import Goal, unit_of
from mechdesign.ground.columns import Column
from mechdesign.ground.errors import AssemblyError, Problem, StudyError
from mechdesign.ground.results import Result
from mechdesign.ground.rows import ChosenRows, UnknownColumnError
from mechdesign.ground.statistics import Request
from mechdesign.ground.terms import Sum, terms_of
from mechdesign.questions.look import look
from mechdesign.questions.poses import study_poses
from mechdesign.questions.workspace.question import GRID_TOLERANCE, Question, batched, questions, shared
from mechdesign.questions.workspace.tables import index_columns
from mechdesign.study import Study
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.units import Amount, QuantityError
from mechdesign.study.variants import remeasured


class DesignsQuestion:
    """What is asked of every design of a study.

    Attributes
    ----------
    goals : tuple of Goal
        Goals, then conditions, with their bounds in the units of their columns.
    columns : mapping of str to Column
        Columns of the workspace, without values; none where no goal is a number of that.
    regions_together : bool
        Whether the workspaces of all designs are computed at once.
    together : mapping of str to mapping
        Goals by command and table where tables of all designs are computed at once.
    alone : mapping of str to list of Goal
        Goals by command where each design is computed by itself.
    outputs : set of str
        Outputs whose extremes are needed.
    requests : set of Request
        Columns that are followed between the poses.
    graded : bool
        Whether the rows behind the goals are wanted, and how far poses are from assembling.
    squares : set of Goal
        Goals that are the root mean square of their rows.
    places : mapping of Goal to tuple
        Where the study names each goal.
    units : mapping of Goal to str
        Units of the columns of goals, where the study's own design has them.
    """

    def __init__(
        self, study: Study, places: Mapping[Goal, KeyPath], names: Collection[str], *, graded: bool = False
    ) -> None:
        """Read what goals and conditions ask of designs that differ in `names`: parameters or places of the geometry.

        `places` are those of the goals in the study, empty for one that it does not name. What goals need is found in
        the answers of the study's own design.

        Raises
        ------
        StudyError
            If no result has the column of a goal, or the study lacks a section that it needs; every mistake in one go.
        """
        self.study, self.graded = study, graded
        self.columns: Mapping[str, Column] = {}
        self.regions_together = True
        self.together: dict[str, dict[str, list[Goal]]] = {}
        self.alone: dict[str, list[Goal]] = {}
        self.outputs: set[str] = set()
        self.requests: set[Request] = set()
        self.squares: set[Goal] = set()
        self.units: dict[Goal, str] = {}
        self.places = places
        # Goals with their bounds in the unit of their column, how many rows each has, and the number of margins of
        # assembly by the commands of which every pose must be valid.
        self._bounded: dict[Goal, Goal] = {}
        self._rows: dict[Goal, int] = {}
        self._margins: dict[str, int] = {}
        problems: list[Problem] = []
        if regions := regions_of(study, [*places]):
            self.columns = index_columns(study, regions[0])
            together = shared(study, regions, study.parameters.moved(names)) and not remeasured(study, names)
            self.regions_together = together and all(batched(column) for column in regions[0].columns)
            several = f"the workspace has {len(regions)} values where a coordinate is held; name one of them by 'where'"
            single = [goal for goal in places if goal.regional and goal.single] if len(regions) > 1 else []
            problems += [self._problem(goal, several) for goal in single]
        problems += self._misfits()
        for command in dict.fromkeys(goal.command for goal in places if not goal.regional and not goal.expression):
            problems += self._read(command, [goal for goal in places if goal.command == command and not goal.regional])
        if problems:
            # A condition with two bounds has the same problem twice.
            raise StudyError([*dict.fromkeys(problems)])
        self.goals = tuple(self._bounded.get(goal, goal) for goal in places)
        self.places = dict(zip(self.goals, places.values(), strict=True))
        self.layout = Layout(self.goals, self._rows, self._margins)
        if not graded:
            self.limit(0)

    def __getstate__(self) -> dict[str, Any]:
        """State for another process, which computes the regions again."""
        return {name: value for name, value in self.__dict__.items() if name != "regions"}

    @property
    def objectives(self) -> tuple[Goal, ...]:
        """Goals that are maximised or minimised."""
        return tuple(goal for goal in self.goals if not goal.gate)

    @property
    def conditions(self) -> tuple[Goal, ...]:
        """Goals that are bounded."""
        return tuple(goal for goal in self.goals if goal.gate)

    def unit(self, goal: Goal) -> str:
        """Unit of a goal, where the study's own design tells it."""
        if goal.expression is not None:
            return unit_of(self.study, goal.column)
        if goal.regional and goal.column in self.columns:
            return self.columns[goal.column].unit
        return self.units.get(goal, "")

    @cached_property
    def regional(self) -> list[Goal]:
        """Goals that are numbers of the workspace."""
        return [goal for goal in self.goals if goal.regional]

    @cached_property
    def regions(self) -> list[Question]:
        """A question for each value of the held coordinates; a design's worst answer counts. See `regions_of`."""
        return regions_of(self.study, self.goals)

    @property
    def slow(self) -> bool:
        """Whether a design costs as much in a batch as alone: where not all goals are tables of all designs at once."""
        return bool(self.alone) or bool(self.regional)

    def limit(self, most: int) -> None:
        """Leave out rows of goals and margins of assembly where a design has more than `most` of them."""
        if self.layout.width - self.layout.head > most:
            self.squares, self.layout = set(), Layout(self.goals, {}, {})

    @property
    def meanings(self) -> dict[Goal, tuple[str, str]]:
        """Unit of each goal, and what a number of the workspace means; empty of others."""
        at = self.study.workspace.at if self.study.workspace is not None and len(self.regions) > 1 else {}
        held = [f"{name} = {', '.join(f'{value:g}' for value in values)}" for name, values in at.items()]
        meanings = {}
        for goal in self.goals:
            meaning = self.columns[goal.column].meaning if goal.regional and goal.column in self.columns else ""
            if goal.outline is not None:
                shape = goal.column.removeprefix("scale of ")
                meaning = f"largest factor by which the {shape} may be scaled for the workspace to hold it"
                meaning += ": contained from 1 on, negative where its centre lies outside"
            meanings[goal] = self.unit(goal), meaning + f"; the worst at {'; '.join(held)}" * bool(meaning and held)
        return meanings

    def _problem(self, goal: Goal, message: str) -> Problem:
        """What is wrong with a goal, at its place in the study, or by its name."""
        place = self.places.get(goal)
        return self.study.problem(message, *place) if place else Problem(message, goal.name)

    def _misfits(self) -> Iterator[Problem]:
        """Problems of bounds whose unit does not fit the bounded number of the workspace or expression."""
        for goal in self.places:
            known = goal.column in self.columns if goal.regional else goal.expression and self.unit(goal)
            try:
                if known:
                    Amount.of(goal.bound).within(self.unit(goal))
            except QuantityError as error:
                yield self._problem(goal, str(error))

    def _read(self, command: str, goals: list[Goal]) -> Iterator[Problem]:
        """Read what goals of a command need; yields their problems."""
        study = self.study
        if command == "optimize":
            mistake = "an optimisation cannot judge itself; name a result of another command"
            yield self._problem(goals[0], mistake)
            return
        if command in stacked.TABLES and stacked.complete(study, command):
            judged = self._read_together(command, goals)
            goals = [goal for goal in goals if goal not in judged]
        if not goals:
            return
        # Other designs may have a result where the study's own design does not assemble.
        with suppress(AssemblyError):
            result = look(study, command)
            for k, goal in enumerate(goals):
                try:
                    goals[k] = self._count(goal, _named(goal, result), result)
                except UnknownColumnError as error:
                    yield self._problem(goal, str(error))
        self.alone.setdefault(command, []).extend(goals)

    def _read_together(self, command: str, goals: Sequence[Goal]) -> Collection[Goal]:
        """Read the goals that are judged in tables of all designs at once; returns them."""
        study, poses = self.study, study_poses(self.study, command)
        result = stacked.tables(study, command, stacked.TABLES[command], poses).result
        named: dict[Goal, ChosenRows | Sum] = {}
        for goal in goals:
            with suppress(UnknownColumnError):
                named[goal] = _named(goal, result)
        if not named:
            return named
        for goal, terms in named.items():
            for chosen in terms.parts:
                if chosen.table.name == "extremes":
                    self.outputs.update(chosen.table["output"][chosen.counts].tolist())
                else:
                    self.requests.update(goal.requests(chosen))
        tables = {chosen.table.name for terms in named.values() for chosen in terms.parts}
        stack = stacked.tables(study, command, {"motion", *tables}, poses, self.outputs, self.requests)
        judged: dict[str, list[Goal]] = {}
        for named_goal, terms in named.items():
            goal = self._count(named_goal, terms, stack.result)
            for chosen in terms.parts:
                judged.setdefault(chosen.table.name, [])
            judged[terms.parts[0].table.name].append(goal)
        self.together[command] = judged
        # Extremes may be those of a part of the poses.
        if self.graded and (poses.listed or set(judged) != {"extremes"}):
            self._margins[command] = stacked.assembly_margins(study, poses, stack.solved).shape[1]
        return named

    def _count(self, goal: Goal, terms: ChosenRows | Sum, result: Result) -> Goal:
        """A goal with its bound in the unit of its column; notes how many rows the study's own design has for it."""
        self._bounded[goal] = bounded = replace(goal, bound=terms.bound(goal.bound))
        self.units[bounded] = terms.unit
        judgement = bounded.judge(result)
        if judgement.squares:
            self.squares.add(bounded)
        if judgement.rows is not None and (judgement.squares or judgement.rows.size > 1):
            self._rows[bounded] = judgement.rows.size
        return bounded


def regions_of(study: Study, goals: Sequence[Goal]) -> list[Question]:
    """What goals ask of the workspace of a study; nothing where none is a number of that."""
    regional = [goal for goal in goals if goal.regional]
    whole = [goal.column for goal in regional if goal.outline is None]
    return questions(study, GRID_TOLERANCE, tuple(dict.fromkeys(("area", *whole)))) if regional else []


def _named(goal: Goal, result: Result) -> ChosenRows | Sum:
    """The rows, or the sum, that a goal names."""
    terms = terms_of(result, goal.column, dict(goal.where))
    if terms.missing:
        raise UnknownColumnError(terms.missing)
    terms.bound(goal.bound)
    # What is no statistic is one row. Statistics are not taken here: nothing is followed yet.
    for part in terms.parts if isinstance(terms, Sum) or goal.single else ():
        if not part.statistic:
            part.numbers()
    return terms
