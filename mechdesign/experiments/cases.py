"""Cases of a study, each the study with some entries changed: its requirements and the named results of each case."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from mechdesign.commands import COMMANDS
from mechdesign.door.report import requirements
from mechdesign.door.report.requirements import command_of
from mechdesign.experiments.answered import Answered, Sheet
from mechdesign.experiments.case_numbers import number_of
from mechdesign.family import stacked
from mechdesign.family.goals import Goal
from mechdesign.family.structures import Form, Structures, Values
from mechdesign.ground.errors import MechdesignError, Problem, StudyError
from mechdesign.ground.numerics.arrays import Ints
from mechdesign.ground.results import Result
from mechdesign.ground.rows import UnknownColumnError
from mechdesign.ground.work.chunks import map_chunks
from mechdesign.ground.work.shards import WHOLE, Shard
from mechdesign.motion.group import DesignGroup
from mechdesign.study import Study
from mechdesign.study.designs import Designs
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.units import QUANTITY, QuantityError
from mechdesign.study.variants import Changes, Judging, judging, split, with_entries

# Cases in one batch where a case costs far less among many, the largest batch, and the batches that are wanted at
# least so that every worker has some.
CASES_AT_ONCE, MOST_AT_ONCE, CHUNKS = 64, 256, 32


def seeded(study: Study, seed: int | None) -> Study:
    """The study with another seed, also in its data, from which cases are loaded; None is its own."""
    return study if seed is None else replace(study, seed=seed, resolved=study.resolved | {"seed": seed})


def answers(
    study: Study, cases: Sequence[Changes], results: Sequence[Goal] = (), *, begin: int = 0, jobs: int | None = 1,
    shard: Shard = WHOLE,
) -> Iterator[Answered]:  # fmt: skip
    """Verdicts on the requirements and the `results` of the cases of a study, batch by batch.

    Each question that they need is asked once for every case, with the study's seed. `Answered.reasons` says why a case
    could not be loaded or answered. A batch has many cases where their questions can be asked of many designs at once,
    else one. Batches before the case `begin` are left out, and those of other shards.
    """
    together = set(commands_of(study, results)) <= stacked.TOGETHER.keys()
    at_once = min(max(len(cases) // CHUNKS, CASES_AT_ONCE), MOST_AT_ONCE) if together else 1
    batches = (cases[k : k + at_once] for k in range(begin, len(cases), at_once))
    yield from map_chunks(CaseRunner(study, tuple(results), cases[0]), shard.share(batches), jobs, travels=True)


class CaseRunner:
    """Answers cases of a study; numbers of entries that it leaves out are those of the `first` of them."""

    def __init__(self, study: Study, results: tuple[Goal, ...], first: Changes) -> None:
        self._study, self._results = study, results
        self._structures = Structures(study, dict(first))

    def __call__(self, cases: Sequence[Changes]) -> Answered:
        """The answers of a batch of cases."""
        sheet = Sheet(self._study, self._results, len(cases))
        alike: dict[tuple[tuple[str, bool], ...], list[int]] = {}
        for k, case in enumerate(cases):
            alike.setdefault(tuple((name, is_number(value)) for name, value in split(case)[0]), []).append(k)
        for members in alike.values():
            self._alike(sheet, np.array(members), [cases[k] for k in members])
        return sheet.answered()

    def _alike(self, sheet: Sheet, rows: Ints, cases: Sequence[Changes]) -> None:
        """Answer cases that change the same entries, those of one structure together."""
        computed, judged = zip(*(split(case) for case in cases), strict=True)
        groups: Iterable[tuple[Ints, Form | MechdesignError, Values]] = ()
        alone = np.ones(len(rows), dtype=bool)
        # Of a quantity in the unit of something else each case tells.
        with suppress(QuantityError):
            groups = self._structures.groups(self._values(computed), len(rows))
        for some, form, own in groups:
            if isinstance(form, MechdesignError):
                continue
            designs = form.designs(own)
            required = [judging(form.study, judged[k]) for k in some.tolist()]
            # A case that is wrong is loaded alone: its error then names the entries that it changes.
            right = np.flatnonzero([self._comparable(case) for case in required] & (designs.faults == ""))
            alone[some[right]] = False
            known = [case for k in right.tolist() if (case := required[k]) is not None]
            there, designs = rows[some[right]], designs.take(right)
            for row, case in zip(there.tolist(), designs.required(known), strict=True):
                sheet.judging[row] = case
            if len(there):
                self._together(sheet, there, designs)
        for k in np.flatnonzero(alone).tolist():
            self._alone(sheet, rows[k : k + 1], cases[k])

    def _values(self, cases: Sequence[Changes]) -> Values:
        """Values of entries that the cases change, numbers in the study's units."""
        study, values = self._study, {}
        for changes in zip(*cases, strict=True):
            name, first = changes[0]
            own = [study.units.convert(value) if isinstance(value, str) and is_number(first) else value
                   for _, value in changes]  # fmt: skip
            parameter = name.removeprefix("mechanism.parameters.")
            name = parameter if parameter in study.parameters.nominal else name
            values[name] = np.fromiter(own, dtype=float if is_number(first) else object, count=len(own))
        return values

    def _comparable(self, own: Judging | None) -> bool:
        """Whether a case is judged on the results on which the study is."""
        results = [requirement.result for requirement in self._study.requirements]
        return own is not None and [requirement.result for requirement in own.requirements] == results

    def _alone(self, sheet: Sheet, row: Ints, case: Changes) -> None:
        """Answer one case, loaded as if its file had the changed entries."""
        try:
            study = with_entries(self._study, case)
            own = Judging.of(study)
            if not self._comparable(own):
                raise StudyError("a case is judged on the results of the study; only limits and rows may be otherwise")
        except Exception as error:
            sheet.failed(int(row[0]), "", error)
            return
        sheet.judging[row[0]] = own
        self._together(sheet, row, Designs(study, {}))

    def _together(self, sheet: Sheet, rows: Ints, designs: Designs) -> None:
        """Answer designs of a study, each a case; a study without changes is that of all the cases."""
        for command in commands_of(designs.study, self._results):
            for group in stacked.answers(designs, command):
                for some in [rows[group.rows]] if designs.changed else rows[:, None]:
                    sheet.note(some, group)


def is_number(value: Any) -> bool:
    """Whether a value is a number or a quantity."""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number or (isinstance(value, str) and QUANTITY.fullmatch(value) is not None)


def commands_of(study: Study, results: Iterable[Goal]) -> tuple[str, ...]:
    """The commands that compute the requirements of a study and some results."""
    needed = {command_of(requirement) for requirement in study.requirements} | {goal.command for goal in results}
    return tuple(command for command in COMMANDS if command in needed)


def foresee(study: Study, results: Mapping[Goal, KeyPath]) -> None:
    """Find results and requirements that no table has, by a short look at each command's answer.

    `results` are with their places in the study.

    Raises
    ------
    StudyError
        Every such mistake in one go, with its place.
    """

    def unknown(result: Result) -> Iterator[Problem]:
        for goal, place in results.items():
            try:
                if goal.command == result.command:
                    number_of(goal, DesignGroup.alone(result))
            except UnknownColumnError as error:
                yield study.problem(str(error), *place)

    requirements.foresee(study, COMMANDS, also={goal.command: unknown for goal in results})
