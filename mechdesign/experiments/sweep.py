"""The question ``sweep``: the table of a study's cases."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.errors import Interrupted, StudyError, counted
from mechdesign.experiments.cases import (
    IMPOSSIBLE,
    Answered,
    Case,
    Number,
    Wanted,
    answers,
    commands_of,
    foresee,
    seeded,
    wanted_in,
)
from mechdesign.experiments.design import cases_of
from mechdesign.journal import Journal, digest
from mechdesign.parallel import one_thread
from mechdesign.progress import NULL, Progress
from mechdesign.report.requirements import Verdict, in_words
from mechdesign.results import VARIED, Column, Result, Table
from mechdesign.study import Study
from mechdesign.study.schema.study_file import entry, kinds_of
from mechdesign.study.text.document import in_yaml
from mechdesign.study.text.units import QUANTITY, Units

_SECTION = "matrix"


@dataclass(frozen=True, eq=False)
class Cases:
    """Cases of a study and what came of them, in their order."""

    cases: Sequence[Case]
    answers: Sequence[Answered]
    wanted: Sequence[Wanted]

    @property
    def verdicts(self) -> list[dict[str, Verdict]]:
        """Of each requirement the verdicts by the cases in words."""
        count = len(self.answers[0].verdicts)
        return [{self.named(k): each.verdicts[i] for k, each in enumerate(self.answers)} for i in range(count)]

    def named(self, k: int) -> str:
        """A case in words: its number, from 1, and its values."""
        values = ", ".join(f"{short(name)} {_text(value)}" for name, value in self.cases[k].changes)
        return f"case {k + 1} ({values})"


def short(name: str) -> str:
    """An entry's name without what goes without saying."""
    return name.removeprefix("mechanism.parameters.").removeprefix("mechanism.")


def prepared(study: Study) -> tuple[list[Case], list[Wanted]]:
    """The cases of a study and what is wanted of each; nothing is computed but a look at the study itself.

    Raises
    ------
    StudyError
        If there is no matrix, nothing to be found of a case, or a name that is unknown.
    """
    matrix = study.matrix
    if matrix is None:
        raise StudyError(
            "a sweep needs cases: --vary mechanism.parameters.r=30:50:5, or a section 'matrix' in the study"
        )
    wanted = wanted_in(_SECTION, matrix.results)
    if not commands_of(study, wanted):
        message = "what is to be found of each case? name 'results', such as kinematics.mu.min, or give 'requirements'"
        raise StudyError([study.problem(message, _SECTION)])
    cases = cases_of(study)
    foresee(study, wanted)
    # What is required has its column.
    required = requirement_names(study)
    return cases, [each for each in wanted if each.title not in required]


@one_thread()
def sweep(
    study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL,
    journal: Journal | None = None,
) -> Result:  # fmt: skip
    """Answer every case of a study's matrix; see `mechdesign.sweep`."""
    study = seeded(study, seed)
    cases, wanted = prepared(study)
    progress.start(len(cases), "cases")
    found: list[Answered] = []
    try:
        for answered in _found(study, cases, wanted, jobs, journal):
            found.append(answered)
            progress.update(1)
    except KeyboardInterrupt:
        if journal is not None:
            journal.save()
        if not found:
            raise
        raise Interrupted(_result(study, Cases(cases, found, wanted))) from None
    return _result(study, Cases(cases, found, wanted))


def _found(
    study: Study, cases: Sequence[Case], wanted: Sequence[Wanted], jobs: int | None, journal: Journal | None
) -> Iterator[Answered]:
    """What comes of the cases in their order; what a journal holds is not computed again."""
    words: list[str] = []

    def kept(answered: Answered) -> Answered:
        k = len(words)
        words.append(json.dumps(asdict(answered)))
        if journal is not None:
            journal.add(_key(cases[k]), np.array([[float(k)]]), words)
        return answered

    before = list(journal.words) if journal is not None else []
    for case, told in zip(cases, before, strict=False):
        if journal is None or journal.recall(_key(case)) is None:
            break
        yield kept(_recalled(json.loads(told)))
    for answered in answers(study, cases[len(words) :], wanted, jobs=jobs):
        yield kept(answered)


def _key(case: Case) -> bytes:
    return digest([np.frombuffer(json.dumps(case.changes).encode(), dtype=np.uint8).astype(float)])


def _recalled(content: Mapping[str, Any]) -> Answered:
    numbers = tuple(Number(*each) for each in content["numbers"])
    verdicts = tuple(Verdict(**each) for each in content["verdicts"])
    return Answered(numbers, verdicts, tuple(content["warnings"]), content["exit_code"], content["failed"])


def _result(study: Study, found: Cases) -> Result:
    """The table of the cases that were answered."""
    answered, asked = found.answers, len(found.cases)
    failed = [k for k, each in enumerate(answered) if each.exit_code >= IMPOSSIBLE]
    counts = {
        "cases": len(answered),
        "not_met": sum(each.exit_code == 1 for each in answered),
        "failed": len(failed),
    }
    told = ""
    if failed:
        first = f"{found.named(failed[0])}: {answered[failed[0]].failed}"
        told = f"{len(failed)} of {counted(len(answered), 'case')} failed; the first, {first}"
    part = f"{len(answered)} of {asked} cases were answered; this is what they are" if len(answered) < asked else ""
    return Result(
        "sweep", {"sweep": Table("sweep", tuple(_columns(study, found)), "what becomes of each case of the matrix")},
        tuple(_warnings(study, found)), counts, told, interrupted=part, drawn=_drawn(study, found),
    )  # fmt: skip


def _drawn(study: Study, found: Cases) -> dict[str, Any]:
    """What pictures show: the entries that vary, and the results with what is required of them."""
    bounds = [(each.at_least, each.at_most) for each in study.requirements]
    limits = dict(zip(requirement_names(study), bounds, strict=True))
    results = limits | {each.title: (None, None) for each in found.wanted}
    return {"cases": found, "entries": [name for name, _ in found.cases[0].changes], "results": results}


def _columns(study: Study, found: Cases) -> Iterator[Column]:
    """The number of the case and how it ended, what varies, the requirements, the results, and why it failed."""
    count, answered = len(found.answers), found.answers
    yield Column("case", np.arange(1, count + 1), "", "number of the case")
    codes = np.array([each.exit_code for each in answered])
    yield Column("exit_code", codes, "", "0 done, 1 a requirement not met, 3 impossible, 4 a numerical failure")
    for place, name in enumerate(name for name, _ in found.cases[0].changes):
        values = [case.changes[place][1] for case in found.cases[:count]]
        yield Column(name, _array(values, study.units), unit_of(study, name), VARIED)
    for k, name in enumerate(requirement_names(study)):
        verdicts = [each.verdicts[k] for each in answered]
        unit = next((each.unit for each in verdicts if each.unit), "")
        worst = np.array([each.worst for each in verdicts])
        yield Column(name, worst, unit, f"worst row; required is {verdicts[0].requirement}")
        yield Column(f"{name}_met", np.array([each.met for each in verdicts]), "", "1 where the requirement is met")
    for k, wanted in enumerate(found.wanted):
        numbers = [each.numbers[k] for each in answered]
        unit = next((each.unit for each in numbers if each.unit), "")
        yield Column(wanted.title, np.array([each.value for each in numbers]), unit, "chosen result")
    yield Column("warnings", np.array([len(each.warnings) for each in answered]), "", "number of warnings")
    yield Column("reason", np.array([each.failed for each in answered]), "", "why the case failed")


def _array(values: Sequence[Any], units: Units) -> NDArray[Any]:
    """Values as numbers, in these units, where each is one; else as words."""
    numbers = [
        units.convert(value) if isinstance(value, str) and QUANTITY.fullmatch(value) else value for value in values
    ]
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in numbers):
        return np.array(numbers, dtype=float)
    return np.array([_text(value) for value in values])


def _text(value: Any) -> str:
    """A value in words."""
    if isinstance(value, float):
        return f"{value:.6g}"
    return value if isinstance(value, str) else in_yaml(value)


def requirement_names(study: Study) -> list[str]:
    """Columns of the requirements: the result that each judges, with its bounds where another judges the same."""
    names = [f"|{each.name}|" if each.abs else each.name for each in study.requirements]
    return [
        in_words(each) if names.count(name) > 1 else name
        for each, name in zip(study.requirements, names, strict=True)
    ]  # fmt: skip


def unit_of(study: Study, name: str) -> str:
    """Unit of an entry, as far as the study or its format tell it."""
    keys = entry(study.resolved, name)
    for k in range(len(keys), 0, -1):
        if keys[:k] in study.kinds:
            return study.units.label(study.kinds[keys[:k]])
    # What a short form stands for lies below it.
    kinds = kinds_of(keys) | {kind for path, kind in study.kinds.items() if path[:-1] == keys}
    if len(kinds) == 1:
        return study.units.label(*kinds)
    section, *path = keys
    if keys[:2] == ("reliability", "dimensions"):
        return study.unit_of(str(keys[2])) or ""
    if section != "mechanism" or len(path) < 2:
        return ""
    kind, owner, *rest = path
    if kind == "parameters":
        return study.unit_of(str(owner)) or ""
    if kind == "links" and rest:
        rest = ["length"] if rest == [2] else [each for each in rest if each != "points"]
        rest[-1] = "x" if rest[-1] == 0 else "y" if rest[-1] == 1 else rest[-1]
    places = study.mechanism.description.places
    place = ".".join(map(str, ([kind] if kind == "limits" else []) + [owner, *rest]))
    return study.unit_of(place) or "" if place in places else ""


def _warnings(study: Study, found: Cases) -> Iterator[str]:
    matrix, cases = study.matrix, found.cases
    assert matrix is not None
    samples = len(cases)
    if matrix.method == "sobol" and matrix.vary is not None and samples & (samples - 1):
        near = 1 << samples.bit_length()
        yield f"{samples} samples of a Sobol' sequence are less even than a power of two: {near // 2} or {near}"
    first: dict[str, int] = {}
    twice = []
    for k, case in enumerate(cases):
        if (seen := first.setdefault(json.dumps(case.changes), k)) != k:
            twice.append((k, seen))
    if twice:
        k, seen = twice[0]
        yield f"{len(twice)} of {len(cases)} cases are repeated; {found.named(k)} is case {seen + 1} once more"
    warned = [k for k, each in enumerate(found.answers) if each.warnings]
    if warned:
        k = warned[0]
        more = f" (and {len(found.answers[k].warnings) - 1} more)" if len(found.answers[k].warnings) > 1 else ""
        yield (
            f"{len(warned)} of {counted(len(found.answers), 'case')} have warnings; the first, {found.named(k)}: "
            f"{found.answers[k].warnings[0]}{more}"
        )
