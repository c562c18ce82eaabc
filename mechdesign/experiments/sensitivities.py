"""The question ``sensitivities``: derivatives of results with respect to numbers of the study."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from pydantic_core import PydanticCustomError

from mechdesign.cautions import Caution
from mechdesign.commands import SENSITIVITIES
from mechdesign.errors import Problem, StudyError, counted
from mechdesign.experiments import columns
from mechdesign.experiments.answered import Answered
from mechdesign.experiments.case_numbers import CaseNumber, numbers_in
from mechdesign.experiments.cases import answers, foresee, seeded
from mechdesign.experiments.schema.sensitivities import Changed
from mechdesign.numerics.arrays import Floats
from mechdesign.numerics.differences import STEPS, slope
from mechdesign.progress import NULL, Progress
from mechdesign.results import Result, Table
from mechdesign.study import Study
from mechdesign.study.schema.study_file import entry
from mechdesign.study.text.document import dotted, value_at
from mechdesign.study.text.fields import Context, read_number, shown
from mechdesign.study.text.units import Amount, QuantityError, Units
from mechdesign.study.variants import Changes, entry_unit
from mechdesign.work.threads import one_thread

# Largest change where the study names none, as a part of the value.
_PART = 0.01
# Relative error from which on a derivative is uncertain, unless the change over a step is less than this part of the
# result.
_UNCERTAIN, _NOTHING = 0.01, 1e-9


@dataclass(frozen=True)
class Changing:
    """A number of the study that changes."""

    given: str  # the name in the section
    name: str  # the name of the entry
    value: float
    step: float  # the largest step
    unit: str

    def cases(self) -> Iterator[Changes]:
        """Cases with the number reduced by each step, then with it increased by each step."""
        for sign in (-1, 1):
            yield from (((self.name, self.value + sign * step),) for step in (self.step * STEPS).tolist())


def prepared(study: Study) -> tuple[list[CaseNumber], list[Changing]]:
    """The results to differentiate and the numbers that change, checked by a short look at the study's answers.

    Raises
    ------
    StudyError
        If there is no section, a name is unknown, or a parameter is no number that can change by itself.
    """
    section = study.sensitivities
    if section is None:
        raise StudyError(
            "sensitivities need a section of that name, e.g. sensitivities: {results: [GII], parameters: [r]}"
        )
    results = numbers_in(SENSITIVITIES.name, section.results)
    changes: list[Changing] = []
    problems: list[Problem] = []
    for k, parameter in enumerate(section.parameters):
        try:
            changing = _changing(study, parameter)
            if changing.name in [other.name for other in changes]:
                raise StudyError(f"{changing.given} is listed twice")
            changes.append(changing)
        except StudyError as error:
            problems.append(study.problem(error.problems[0].message, "sensitivities", "parameters", k))
    if problems:
        raise StudyError(problems)
    foresee(study, results)
    return results, changes


def _changing(study: Study, changed: Changed) -> Changing:
    title = changed.parameter
    path = entry(study.resolved, f"mechanism.parameters.{title}" if title in study.parameters.nominal else title)
    raw = value_at(study.resolved, path)
    if raw is None:
        raise StudyError(f"{title} is left to its default; give it a value in the study first")
    try:
        number = read_number(raw, Context(study.units, study.parameters.nominal))
    except PydanticCustomError:
        raise StudyError(f"{title} is {shown(raw)}, and only a number can change a little") from None
    if number.expression is not None:
        raise StudyError(f"{title} is the expression {shown(raw)}; name a parameter in it")
    if changed.step is None and not number:
        raise StudyError(f"{title} is 0; say by how much it changes, {{parameter: {title}, step: 0.1}}")
    name = dotted(path)
    unit = entry_unit(study, name)
    try:
        given_step = Amount.of(changed.step or 0.0)
        step = (given_step.within(unit) if unit else given_step) or _PART * abs(number)
    except QuantityError as error:
        raise StudyError(f"{title}: {error}") from None
    return Changing(title, name, number, step, unit)


@one_thread()
def sensitivities(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Result:
    """Differentiate results of a study by central differences; see `mechdesign.sensitivities`."""
    study = seeded(study, seed)
    results, numbers = prepared(study)
    judged_by_none = {key: value for key, value in study.resolved.items() if key != "requirements"}
    plain = replace(study, requirements=(), fail_on=(), resolved=judged_by_none)
    cases: list[Changes] = [(), *(case for number in numbers for case in number.cases())]
    progress.start(len(cases), "cases")
    whole = Answered()
    for answered in answers(plain, cases, results, jobs=jobs):
        whole.add(answered)
        progress.update(len(answered))
    rows = list(_rows(results, numbers, whole))
    table = _table(rows, whole.units, numbers)
    counts = {"cases": len(cases), "derivatives": len(rows), "uncertain": sum(bool(row.doubt) for row in rows)}
    failed = f"the study itself has no answer: {whole.reason(0)}" if whole.reason(0) else ""
    warnings = [
        Caution("unconverged", f"{row.result} by {row.parameter}: {row.doubt}", table.name, k)
        for k, row in enumerate(rows)
        if row.doubt
    ]
    for kind, warned in whole.warned.items():
        words = f"{warned.cases} of {counted(len(whole), 'case')} have warnings; the first: {warned.message}"
        warnings.append(Caution(kind, words))
    return Result(SENSITIVITIES.name, {table.name: table}, warnings, counts, failed)


@dataclass(frozen=True)
class Row:
    """The derivative of a result by a number."""

    result: str
    parameter: str
    value: float
    at: float
    derivative: float
    error: float
    below: float
    above: float
    doubt: str  # why it is unknown or uncertain; empty if it is neither

    @property
    def elasticity(self) -> float:
        """Change of the result, in % of its size, for 1 % of the number's size more; nan where either is zero."""
        return self.derivative * abs(self.at / self.value) if self.value and self.at else math.nan


def _rows(results: Sequence[CaseNumber], numbers: Sequence[Changing], whole: Answered) -> Iterator[Row]:
    values = whole.table[:, 3:]
    middle, sides = values[0], values[1:].reshape(len(numbers), 2, len(STEPS), len(results))
    slopes = [slope(middle, pair[0], pair[1], number.step) for number, pair in zip(numbers, sides, strict=True)]
    count = 2 * len(STEPS)
    reasons = [next(filter(None, map(whole.reason, range(1 + k * count, 1 + (k + 1) * count))), "")
               for k in range(len(numbers))]  # fmt: skip
    for k, result in enumerate(results):
        for number, found_slope, reason in zip(numbers, slopes, reasons, strict=True):
            value, error, below, above = (float(part[k]) for part in found_slope)
            scale = abs(middle[k]) * _NOTHING / number.step
            doubt = ""
            if not math.isnan(below):
                doubt = f"has a kink here; its slope is {below:.6g} below {number.value:g} and {above:.6g} above"
            elif math.isnan(value):
                doubt = f"is not known near {number.value:g}: {reason or whole.reason(0) or 'it is nan there'}"
            elif error > max(_UNCERTAIN * abs(value), scale):
                # Noise needs longer steps, strong curvature shorter ones.
                other = number.step * 10 if number.step <= _PART * abs(number.value) else number.step / 10
                doubt = (
                    f"differences do not agree: {value:.4g} with an error of {error:.2g}; it may jump here or be rough "
                    f"(few samples); another step may help, {{parameter: {number.given}, step: {other:g}}}"
                )
            yield Row(result.title, number.given, float(middle[k]), number.value, value, error, below, above, doubt)


def _table(rows: Sequence[Row], result_units: Sequence[str], numbers: Sequence[Changing]) -> Table:
    units = [unit for unit in result_units for _ in numbers]
    by = [number.unit for _ in result_units for number in numbers]
    ratio = [Units.ratio(one, other) for one, other in zip(units, by, strict=True)]

    def of(name: str) -> Floats:
        return np.array([getattr(row, name) for row in rows], dtype=float)

    table = columns.SENSITIVITIES
    return table.table(table.columns(
        {}, result=np.array([row.result for row in rows]), parameter=np.array([row.parameter for row in rows]),
        derivative=of("derivative"), error=of("error"), unit=np.array(ratio), elasticity=of("elasticity"),
        below=of("below"), above=of("above"), value=of("value"), value_unit=np.array(units), at=of("at"),
        at_unit=np.array(by), settled=np.array([not row.doubt for row in rows]),
    ))  # fmt: skip
