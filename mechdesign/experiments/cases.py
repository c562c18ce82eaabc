"""Cases of a study, each the study with some entries changed: what becomes of its requirements and of named results."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechdesign.analyses.look import look
from mechdesign.analyses.together import Group
from mechdesign.commands import COMMANDS
from mechdesign.errors import AssemblyError, Problem, StudyError
from mechdesign.experiments import batches, compiled
from mechdesign.experiments.answered import Answered, Sheet
from mechdesign.experiments.wanted import Wanted
from mechdesign.numerics.arrays import Ints
from mechdesign.report import requirements
from mechdesign.report.requirements import command_of
from mechdesign.rows import UnknownColumnError
from mechdesign.study import Study
from mechdesign.study.designs import Designs
from mechdesign.study.variants import overrides, with_entries
from mechdesign.work.chunks import map_chunks

# Cases that are answered at once, where one costs far less among many: of few so many that all workers have some.
CASES_AT_ONCE, MOST_AT_ONCE, CHUNKS = 64, 256, 32


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
        return overrides(self.changes)


def seeded(study: Study, seed: int | None) -> Study:
    """The study with another seed, also in its data, from which cases are loaded; None is its own."""
    return study if seed is None else replace(study, seed=seed, resolved=study.resolved | {"seed": seed})


def answers(
    study: Study, cases: Sequence[Case], wanted: Sequence[Wanted] = (), *, begin: int = 0, jobs: int | None = 1
) -> Iterator[Answered]:
    """What comes of the cases of a study, some after others: their requirements, and the numbers that are wanted.

    Every question that one of them needs is answered once a case, with the study's seed. What cannot be loaded or
    answered says why in `Answered.reasons`. Many are answered at a time where their questions are answered for
    many designs at once, else one by one; those before `begin` are left out.
    """
    together = set(commands_of(study, wanted)) <= batches.TOGETHER.keys()
    at_once = min(max(len(cases) // CHUNKS, CASES_AT_ONCE), MOST_AT_ONCE) if together else 1
    if begin >= len(cases):
        return
    # Which cases are answered at once does not depend on where a computation goes on.
    chunks = (cases[max(k, begin) : k + at_once] for k in range(begin - begin % at_once, len(cases), at_once))
    answer = Answer(study, tuple(wanted), cases[0])
    yield from map_chunks(answer, chunks, jobs, processes=True, travels=True)


@dataclass(frozen=True, eq=False)
class Answer:
    """Answers cases of a study, which change the same entries."""

    study: Study
    wanted: tuple[Wanted, ...]
    first: Case  # of all

    def __call__(self, cases: Sequence[Case]) -> Answered:
        """What comes of some cases."""
        sheet = Sheet(self.study, self.wanted, len(cases))
        alike: dict[str, list[int]] = {}
        for k, case in enumerate(cases):
            alike.setdefault(compiled.form_of(case.changes), []).append(k)
        for members in alike.values():
            self._alike(sheet, np.array(members), [cases[k] for k in members])
        return sheet.answered()

    def _alike(self, sheet: Sheet, rows: Ints, cases: Sequence[Case]) -> None:
        """Answer cases that differ in numbers alone."""
        form = compiled.compiled(self.study, cases[0].changes, self.first.changes)
        designs = form.designs([case.changes for case in cases]) if form is not None else None
        if designs is not None and len(designs.study.requirements) != len(self.study.requirements):
            designs = None
        # What is wrong with the others is said of the entries that they change.
        right = designs.faults == "" if designs is not None else np.zeros(len(cases), dtype=bool)
        if designs is not None and right.any():
            self._together(sheet, rows[right], designs.take(np.flatnonzero(right)))
        for k in np.flatnonzero(~right).tolist():
            self._alone(sheet, rows[k : k + 1], cases[k])

    def _alone(self, sheet: Sheet, row: Ints, case: Case) -> None:
        """Answer one case, loaded as if its file had the changed entries."""
        try:
            study = variant(self.study, case)
            if len(study.requirements) != len(self.study.requirements):
                raise StudyError("a case has the requirements of the study; only their limits may be otherwise")
        except Exception as error:
            sheet.failed(int(row[0]), "", error)
            return
        self._together(sheet, row, Designs(study, {}))

    def _together(self, sheet: Sheet, rows: Ints, designs: Designs) -> None:
        """Answer designs of a study."""
        for command in commands_of(designs.study, self.wanted):
            for group in batches.answers(designs, command).groups:
                sheet.note(rows[group.rows], designs, group)


def commands_of(study: Study, wanted: Iterable[Wanted]) -> tuple[str, ...]:
    """The commands that a study's requirements and what is wanted need."""
    needed = {command_of(requirement) for requirement in study.requirements} | {each.command for each in wanted}
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
    return with_entries(study, case.changes)


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
                    each.find(Group.alone(result))
                except UnknownColumnError as error:
                    problems.append(study.problem(str(error), *each.keys))
        try:
            requirements.requirements(study, result, whole=command != "optimize")
        except StudyError as error:
            problems += error.problems
    if problems:
        raise StudyError(problems)
