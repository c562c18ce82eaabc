"""Cases of a study, each the study with some entries changed: what becomes of its requirements and of named results."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from mechdesign.analyses.look import ask, look
from mechdesign.commands import COMMANDS
from mechdesign.errors import AssemblyError, Problem, StudyError, explain
from mechdesign.numerics.arrays import Floats
from mechdesign.parallel import map_chunks
from mechdesign.report import requirements
from mechdesign.report.requirements import Verdict, command_of
from mechdesign.results import Result
from mechdesign.rows import UnknownColumnError, choose, located
from mechdesign.study import Study
from mechdesign.study.loading import load_document, same_sketch
from mechdesign.study.schema.matrix import Named
from mechdesign.study.schema.study_file import override
from mechdesign.study.text.document import Document, KeyPath, Mark, in_yaml

# What is told of the rows of a result, by the word after its name.
STATISTICS: Mapping[str, Callable[[Floats], Any]] = {"min": np.min, "max": np.max, "mean": np.mean, "range": np.ptp}
# Sections that a case has not.
_OF_CASES = ("matrix", "sensitivities")
# Exit code of a case that the mechanism, or what the case says of it, makes impossible.
IMPOSSIBLE = 3


@dataclass(frozen=True)
class Case:
    """Entries of a study that are otherwise: plain data by the dotted names that ``--set`` takes, in their order."""

    changes: tuple[tuple[str, Any], ...]

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> Case:
        """The case in which these entries have these values."""
        return cls(tuple(values.items()))

    @property
    def overrides(self) -> tuple[str, ...]:
        """The changes as ``a.b.c=value``."""
        return tuple(f"{name}={in_yaml(value)}" for name, value in self.changes)


@dataclass(frozen=True)
class Wanted:
    """A number of a case by the name of a result.

    Parameters
    ----------
    name : str
        ``COMMAND.COLUMN``, ``COMMAND.TABLE.COLUMN`` or ``COMMAND.TABLE.ROW.COLUMN`` as requirements have it, or a
        number of the workspace alone (``GII``); of several rows followed by one of `STATISTICS`.
    where : tuple of (str, value)
        Only rows whose columns have these values count.
    keys : tuple
        Where the study names it.
    """

    name: str
    where: tuple[tuple[str, Any], ...] = ()
    keys: KeyPath = ()

    @property
    def title(self) -> str:
        """The name, and in parentheses which rows count."""
        where = ", ".join(f"{column} {value}" for column, value in self.where)
        return f"{self.name} ({where})" if where else self.name

    @property
    def command(self) -> str:
        """The command whose result it is of."""
        command = self.name.partition(".")[0]
        return command if command in COMMANDS else "workspace"

    def find(self, result: Result) -> Number:
        """The number in a result of the command; nan where a row that counts has none.

        Raises
        ------
        UnknownColumnError
            If there is no such column or row, or several rows count and no statistic is named.
        """
        path = self.name.removeprefix(f"{self.command}.")
        head, _, statistic = path.rpartition(".")
        try:
            located(result, path)
            statistic = ""
        except UnknownColumnError:
            if statistic not in STATISTICS or not head:
                raise
            path = head
        chosen = choose(result, path, dict(self.where))
        if chosen.missing:
            raise UnknownColumnError(chosen.missing)
        values = chosen.values[chosen.counts]
        unit = chosen.unit
        if not values.size:
            return Number(float("nan"), unit)
        if statistic:
            return Number(float(STATISTICS[statistic](values)), unit)
        if values.size > 1:
            forms = [f"{self.name}.{word}" for word in STATISTICS]
            raise UnknownColumnError(
                f"{self.name} has {values.size} rows; ask for {', '.join(forms[:-1])} or {forms[-1]}, or name its row"
            )
        return Number(float(values[0]), unit)


def wanted_in(section: str, results: Iterable[Named]) -> list[Wanted]:
    """What a section of the study names as its results."""
    return [
        Wanted(each.result, tuple(each.where.items()), (section, "results", k)) for k, each in enumerate(results)
    ]  # fmt: skip


def seeded(study: Study, seed: int | None) -> Study:
    """The study with another seed, also in its data, from which cases are loaded; None is its own."""
    return study if seed is None else replace(study, seed=seed, resolved=study.resolved | {"seed": seed})


class Number(NamedTuple):
    """A number and its unit."""

    value: float
    unit: str


@dataclass(frozen=True)
class Answered:
    """What came of a case."""

    numbers: tuple[Number, ...]  #: in the order of what was wanted; nan where there is none
    verdicts: tuple[Verdict, ...]  #: one a requirement of the study, in its order
    warnings: tuple[str, ...] = ()
    exit_code: int = 0  #: 0 done; 1 a requirement is not met; 3 it is impossible; 4 a numerical failure
    failed: str = ""  #: why it, or a part of it, could not be answered


def answers(
    study: Study, cases: Iterable[Case], wanted: Sequence[Wanted] = (), *, jobs: int | None = 1
) -> Iterator[Answered]:
    """What comes of each case of a study, in their order: its requirements, and the numbers that are wanted.

    Every question that one of them needs is answered once a case, with the study's seed. What cannot be loaded or
    answered says why in `Answered.failed`.
    """
    yield from map_chunks(Answer(study, tuple(wanted)), cases, jobs, processes=True, travels=True)


@dataclass(frozen=True, eq=False)
class Answer:
    """Answers a case of a study."""

    study: Study
    wanted: tuple[Wanted, ...]

    def __call__(self, case: Case) -> Answered:
        """What comes of a case."""
        numbers = [Number(float("nan"), "")] * len(self.wanted)
        verdicts = [Verdict(requirements.in_words(each), False, float("nan")) for each in self.study.requirements]
        reasons: dict[str, int] = {}
        warnings: list[str] = []
        try:
            study = variant(self.study, case)
            if len(study.requirements) != len(verdicts):
                raise StudyError("a case has the requirements of the study; only their limits may be otherwise")
        except Exception as error:
            code, why = _explained(error)
            return Answered(tuple(numbers), tuple(verdicts), (), code, why)
        for command in commands_of(study, self.wanted):
            try:
                result = ask(study, command)
            except Exception as error:
                code, why = _explained(error)
                reasons[f"{command}: {why}"] = code
                continue
            warnings += [f"{command}: {warning}" for warning in result.warnings]
            if result.failed:
                reasons[f"{command}: {result.failed}"] = IMPOSSIBLE
            try:
                for k, each in enumerate(self.wanted):
                    if each.command == command:
                        numbers[k] = each.find(result)
                for k, requirement in enumerate(study.requirements):
                    if command_of(requirement) == command:
                        verdicts[k] = requirements.judge(result, requirement, study.mechanism.mobility)
            except UnknownColumnError as error:
                reasons[f"{command}: {error}"] = IMPOSSIBLE
        unmet = int(not all(verdict.met for verdict in verdicts))
        code = max([unmet, *reasons.values()])
        return Answered(tuple(numbers), tuple(verdicts), tuple(warnings), code, "; ".join(reasons))


def _explained(error: Exception) -> tuple[int, str]:
    """The exit code of a case that ended so, and why in one line."""
    code, message = explain(error)
    return max(code, IMPOSSIBLE), "; ".join(message.splitlines())


def commands_of(study: Study, wanted: Iterable[Wanted]) -> tuple[str, ...]:
    """The commands that a study's requirements and what is wanted need."""
    needed = {command_of(each) for each in study.requirements} | {each.command for each in wanted}
    return tuple(command for command in COMMANDS if command in needed)


def variant(study: Study, case: Case) -> Study:
    """The study of a case, as if its file had the changed entries; its matrix is not its own.

    Where only numbers of the mechanism are otherwise its assembly is that of the study's sketch, unless the sketch is
    changed itself.

    Raises
    ------
    StudyError
        If the entries make no study; every mistake in one go.
    """
    data = copy.deepcopy({key: value for key, value in study.resolved.items() if key not in _OF_CASES})
    document = Document("", data, values={(): Mark("")})
    override(document, case.overrides)
    return load_document(
        document, study.path, study.folder, study.text, study.text_sha256, (*study.overrides, *case.overrides),
        original=study.mechanism if same_sketch(data, study.resolved) else None,
    )  # fmt: skip


def foresee(study: Study, wanted: Iterable[Wanted]) -> None:
    """Find, at a look, what is wanted or required and no result has.

    Raises
    ------
    StudyError
        Every such mistake in one go, with its place.
    """
    wanted = tuple(wanted)
    problems: list[Problem] = []
    for command in commands_of(study, wanted):
        try:
            result = look(study, command)
        except AssemblyError:
            # The study's own numbers need not be those of a case.
            continue
        for each in wanted:
            if each.command == command:
                try:
                    each.find(result)
                except UnknownColumnError as error:
                    problems.append(study.problem(str(error), *each.keys))
        try:
            requirements.requirements(study, result, whole=command != "optimize")
        except StudyError as error:
            problems += error.problems
    if problems:
        raise StudyError(problems)
