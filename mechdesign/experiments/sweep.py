"""The question ``sweep``: the table of a study's cases."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.door.report.cases import FRONT, RANK, text_of
from mechdesign.door.report.requirements import DrawnCases, in_words, over_cases
from mechdesign.experiments.answered import IMPOSSIBLE, NOT_MET, Answered
from mechdesign.experiments.case_numbers import goals_in
from mechdesign.experiments.cases import answers, commands_of, foresee, seeded
from mechdesign.experiments.columns import SWEEP
from mechdesign.experiments.design import Design, cases_of, tried
from mechdesign.experiments.ranking import ranked
from mechdesign.family.goals import Goal
from mechdesign.ground.cautions import Caution
from mechdesign.ground.columns import Column
from mechdesign.ground.errors import Interrupted, StudyError, counted
from mechdesign.ground.numerics.arrays import Flags
from mechdesign.ground.progress import NULL, Progress
from mechdesign.ground.results import Result
from mechdesign.ground.work.journal import Journal, digest
from mechdesign.ground.work.shards import Block, Shard
from mechdesign.ground.work.threads import one_thread
from mechdesign.study import Study
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.fields import own_numbers
from mechdesign.study.text.units import QUANTITY, Units
from mechdesign.study.variants import entry_unit, is_judged, with_entries

_SECTION = "matrix"


def prepared(study: Study) -> tuple[Design, list[Goal]]:
    """The cases of a study and the results to compute of each, checked by a short look at the study's answers.

    Raises
    ------
    StudyError
        If there is no matrix, no result or requirement, or an unknown name.
    """
    matrix = study.matrix
    if matrix is None:
        raise StudyError(
            "a sweep needs cases: --vary mechanism.parameters.r=30:50:5, or a section 'matrix' in the study"
        )
    places = goals_in((_SECTION, "results"), matrix.results) | _goals(study)
    # A goal stands for the result of its name.
    results = {goal: places[goal] for goal in {goal.name: goal for goal in places}.values()}
    if not commands_of(study, results):
        message = "what is to be found of each case? name 'results', such as kinematics.mu.min, or give 'requirements'"
        raise StudyError([study.problem(message, _SECTION)])
    cases = cases_of(study)
    foresee(study, results)
    _foresee_limits(study, cases)
    # A number with a requirement has a column already.
    required = requirement_names(study, [*cases.columns])
    return cases, [goal for goal in results if goal.name not in required]


def _foresee_limits(study: Study, cases: Design) -> None:
    """Find quantities among the limits of cases that are of another kind than the result that they judge.

    Raises
    ------
    StudyError
        With the entry, its value and the reason.
    """
    for name, value in tried(study, cases):
        if is_judged(name) and QUANTITY.fullmatch(str(value)):
            try:
                foresee(with_entries(study, [(name, value)]), {})
            except StudyError as error:
                message = f"{name}={value}: {'; '.join(problem.message for problem in error.problems)}"
                raise StudyError([study.problem(message, _SECTION)]) from None


@one_thread()
def sweep(
    study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL,
    journal: Journal | None = None,
) -> Result:  # fmt: skip
    """Answer every case of a study's matrix; see `mechdesign.sweep`."""
    study = seeded(study, seed)
    cases, results = prepared(study)
    progress.start(len(cases), "cases")
    whole = Answered()
    # What is no number of each batch in the journal.
    texts = [] if journal is None else [*journal.words]
    number = 0
    while journal is not None and (table := journal.recall(_key(whole))) is not None:
        journal.add(_key(whole), table, texts)
        whole.add(Answered.read(table, texts[number]))
        progress.update(len(table))
        number += 1
    del texts[number:]
    try:
        for answered in answers(study, cases, results, begin=len(whole), jobs=jobs):
            if journal is not None:
                texts.append(answered.texts)
                journal.add(_key(whole), answered.table, texts)
            whole.add(answered)
            progress.update(len(answered))
    except KeyboardInterrupt:
        if journal is not None:
            journal.save()
        if not len(whole):
            raise
        raise Interrupted(_result(study, cases, whole, results)) from None
    return _result(study, cases, whole, results)


def _key(before: Answered) -> bytes:
    """The key of the batch after some cases."""
    return digest([np.array([len(before)], dtype=float)])


@one_thread()
def shard_of(
    study: Study, shard: Shard, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL
) -> list[Block]:
    """The answers of a shard's batches of cases, for `merged`."""
    study = seeded(study, seed)
    cases, results = prepared(study)
    progress.start(-(-len(cases) // shard.count), "cases")
    blocks = []
    for answered in answers(study, cases, results, jobs=jobs, shard=shard):
        blocks.append((answered.table, answered.texts))
        progress.update(len(answered))
    return blocks


def merged(study: Study, blocks: Sequence[Block], *, seed: int | None = None) -> Result:
    """What `sweep` gives, from the blocks of all shards."""
    study = seeded(study, seed)
    cases, results = prepared(study)
    whole = Answered()
    for table, texts in blocks:
        whole.add(Answered.read(table, texts))
    return _result(study, cases, whole, results)


def _result(study: Study, cases: Design, whole: Answered, results: Sequence[Goal]) -> Result:
    """The result with the table of the answered cases."""
    count, total, failed = len(whole), len(cases), np.flatnonzero(whole.table[:, 0] >= IMPOSSIBLE).tolist()
    counts = {"cases": count, "not_met": int((whole.table[:, 0] == NOT_MET).sum()), "failed": len(failed)}
    message = ""
    if failed:
        first = f"{cases.named(failed[0])}: {whole.reason(failed[0])}"
        message = f"{len(failed)} of {counted(count, 'case')} failed; the first, {first}"
    part = f"{count} of {total} cases were answered; this is what they are" if count < total else ""
    table = SWEEP.table(_columns(study, cases, whole, results))
    with_rank = None
    if goals := _goals(study):
        costs = np.stack([goal.sign * table[goal.name] for goal in goals], axis=1)
        rank, front = ranked(costs, table["exit_code"] == 0)
        with_rank = np.isfinite(rank)
        table = replace(table, columns=(*table.columns, *SWEEP.columns({}, **{RANK: rank, FRONT: front})))
        if study.matrix and study.matrix.best and study.matrix.best.sort:
            table = table.take(np.argsort(rank, kind="stable"))
    return Result(
        "sweep", {"sweep": table}, tuple(_warnings(study, cases, whole, with_rank)), counts, message, interrupted=part,
        drawn=_drawn(study, cases, whole, results),
    )  # fmt: skip


def _drawn(study: Study, cases: Design, whole: Answered, numbers: Sequence[Goal]) -> DrawnCases:
    """The entries that vary, the results with what is required of them, and which are goals."""
    entries = [*cases.columns]
    verdicts = tuple(
        over_cases(worst.verdict, cases.named(worst.case), worst.unmet, len(whole), cases.called(worst.first))
        for worst in whole.worst
    )
    own = _limits_of_cases(study, entries)
    bounds = [(None, None) if k in own else (requirement.at_least, requirement.at_most)
              for k, requirement in enumerate(study.requirements)]  # fmt: skip
    limits = dict(zip(requirement_names(study, entries), bounds, strict=True))
    results = limits | {goal.name: (None, None) for goal in numbers}
    goals = {goal.name: int(goal.sign) for goal in _goals(study)}
    return DrawnCases(entries, results, goals, verdicts, partial(_study_of, study, cases))


def _study_of(study: Study, cases: Design, number: int) -> Study:
    """The study of a case by its number, from 1."""
    return with_entries(study, cases[number - 1])


def _limits_of_cases(study: Study, entries: Sequence[str]) -> set[int]:
    """Requirements whose limits differ from case to case."""
    moved = study.parameters.moved([name.removeprefix("mechanism.parameters.") for name in entries])
    return {
        k for k, requirement in enumerate(study.requirements)
        if _varies(entries, k) or any(not number.expression.names.isdisjoint(moved)
                                      for number in own_numbers(requirement) if number.expression)
    }  # fmt: skip


def _varies(entries: Sequence[str], k: int, key: str = "") -> bool:
    """Whether one of the entries is requirement `k`, is in it (of a key: in that), or holds it."""
    place = f"requirements.{k}.{key}".rstrip(".")
    return any(f"{place}.".startswith(f"{name}.") or f"{name}.".startswith(f"{place}.") for name in entries)


def _goals(study: Study) -> dict[Goal, KeyPath]:
    """What is best of the cases, large before small, with its places in the study."""
    best, goals = study.matrix and study.matrix.best, dict[Goal, KeyPath]()
    for key in ("maximize", "minimize") if best else ():
        goals |= goals_in((_SECTION, "best", key), getattr(best, key), smallest=key == "minimize", whole=True)
    return goals


def _columns(study: Study, cases: Design, whole: Answered, numbers: Sequence[Goal]) -> Iterator[Column]:
    """Columns: number and exit code of the case, varied entries, requirements, results, warnings and the reason."""
    count, table = len(whole), whole.table
    labels = {"label": np.array(cases.labels[:count])} if cases.labels else {}
    yield from SWEEP.columns({}, case=np.arange(1, count + 1), **labels, exit_code=table[:, 0].astype(np.intp))
    for name, values in cases.columns.items():
        yield SWEEP["<entry>"].column(_array(study.units, values[:count]), entry_unit(study, name), entry=name)
    own = _limits_of_cases(study, [*cases.columns])
    for k, name in enumerate(requirement_names(study, [*cases.columns])):
        limit = "what the case requires" if k in own else str(whole.worst[k].verdict.requirement)
        yield SWEEP["<requirement>"].column(*whole.number(len(numbers) + k), requirement=name, limit=limit)
        yield SWEEP["<requirement>_met"].column(table[:, k - len(whole.worst)] == 1, requirement=name)
    for k, goal in enumerate(numbers):
        yield SWEEP["<result>"].column(*whole.number(k), result=goal.name)
    reasons = np.array([*whole.reasons], dtype=object)[table[:, 2].astype(np.intp)]
    yield from SWEEP.columns({}, warnings=table[:, 1].astype(np.intp), reason=reasons)


def _array(units: Units, values: NDArray[Any]) -> NDArray[Any]:
    """Values as numbers, in these units, where each is one; else as words."""
    numbers = [
        units.convert(value) if isinstance(value, str) and QUANTITY.fullmatch(value) else value for value in values
    ]
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in numbers):
        return np.array(numbers, dtype=float)
    return np.array([text_of(value) for value in values])


def requirement_names(study: Study, entries: Sequence[str]) -> list[str]:
    """Columns of the requirements: the result that each judges, with its bounds where another judges the same.

    Of several in the same words the later ones have their numbers in the study. Rows that count are named where they
    are the same in all cases, of which `entries` vary.
    """
    names = [str(requirement.result) if _varies(entries, k, "where") else requirement.name
             for k, requirement in enumerate(study.requirements)]  # fmt: skip
    names = [f"|{name}|" if requirement.abs else name
             for name, requirement in zip(names, study.requirements, strict=True)]  # fmt: skip
    several = Counter(names)
    names = [in_words(requirement) if several[name] > 1 else name
             for requirement, name in zip(study.requirements, names, strict=True)]  # fmt: skip
    first = {name: k for k, name in reversed([*enumerate(names)])}
    return [name if first[name] == k else f"{name}, requirement {k + 1}" for k, name in enumerate(names)]


def _warnings(study: Study, cases: Design, whole: Answered, ranked: Flags | None) -> Iterator[Caution]:
    matrix = study.matrix
    assert matrix is not None
    samples = len(cases)
    if matrix.method == "sobol" and matrix.vary is not None and samples & (samples - 1):
        near = 1 << samples.bit_length()
        words = f"{samples} samples of a Sobol' sequence are less even than a power of two: {near // 2} or {near}"
        yield Caution("suspect", words)
    if matrix.vary is None:
        first: dict[str, int] = {}
        twice = [(k, prior) for k, case in enumerate(cases) if (prior := first.setdefault(json.dumps(case), k)) != k]
        if twice:
            k, prior = twice[0]
            words = (
                f"{len(twice)} of {len(cases)} cases are repeated; {cases.named(k)} is {cases.called(prior)} once more"
            )
            yield Caution("suspect", words, "sweep", pose=cases.named(k))
    for kind, warned in whole.warned.items():
        case = cases.named(warned.case)
        words = f"{warned.cases} of {counted(len(whole), 'case')} have warnings; the first, {case}: {warned.message}"
        yield Caution(kind, words, "sweep", pose=case)
    met = whole.table[:, 0] == 0
    if ranked is not None and len(without := np.flatnonzero(met & ~ranked)):
        answered = counted(int(met.sum()), "case")
        case = cases.named(int(without[0]))
        words = (f"{len(without)} of {answered} that meet every requirement have no rank: a goal is no finite number, "
                 f"or part of the motion is missing; the first is {case}")  # fmt: skip
        yield Caution("undefined", words, "sweep", pose=case)
    elif ranked is not None and not met.any():
        yield Caution("infeasible", "no case is ranked: none was answered and meets every requirement", "sweep")
