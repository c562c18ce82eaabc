"""The question ``sensitivities``: derivatives of results with respect to numbers of the study."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from pydantic_core import PydanticCustomError

from mechdesign.commands import SENSITIVITIES
from mechdesign.experiments import columns
from mechdesign.experiments.answered import Answered
from mechdesign.experiments.case_numbers import goals_in
from mechdesign.experiments.cases import answers, foresee, seeded
from mechdesign.experiments.schema.sensitivities import Changed
from mechdesign.family.goals import Goal
from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import Problem, StudyError, counted
from mechdesign.ground.numerals import numeral
from mechdesign.ground.numerics.differences import STEPS, slope
from mechdesign.ground.progress import NULL, Progress
from mechdesign.ground.results import Result, Table
from mechdesign.ground.work.threads import one_thread
from mechdesign.study import Study
from mechdesign.study.schema.study_file import entry
from mechdesign.study.text.document import dotted, value_at
from mechdesign.study.text.reading import Context, read_number, shown
from mechdesign.study.text.units import Amount, QuantityError, Units
from mechdesign.study.variants import Changes, entry_unit

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


def prepared(study: Study) -> tuple[list[Goal], list[Changing]]:
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
    results = goals_in((SENSITIVITIES.name, "results"), section.results)
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
    return [*results], changes


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
    table, doubts = _table(results, numbers, whole)
    counts = {"cases": len(cases), "derivatives": len(table), "uncertain": sum(map(bool, doubts))}
    failed = f"the study itself has no answer: {whole.reason(0)}" if whole.reason(0) else ""
    warnings = [
        Caution("unconverged", f"{table['result'][k]} by {table['parameter'][k]}: {doubt}", table.name, k)
        for k, doubt in enumerate(doubts)
        if doubt
    ]
    for kind, warned in whole.warned.items():
        words = f"{warned.cases} of {counted(len(whole), 'case')} have warnings; the first: {warned.message}"
        warnings.append(Caution(kind, words))
    return Result(SENSITIVITIES.name, {table.name: table}, warnings, counts, failed)


def _table(results: Sequence[Goal], numbers: Sequence[Changing], whole: Answered) -> tuple[Table, list[str]]:
    """The derivative of each result by each number, and why it is unknown or uncertain; empty where it is neither."""
    middle, size = whole.table[0, 3:], 2 * len(STEPS)
    sides = whole.table[1:, 3:].reshape(len(numbers), 2, len(STEPS), len(results))
    steps = [number.step for number in numbers]
    slopes = np.array([slope(middle, below, above, step) for (below, above), step in zip(sides, steps, strict=True)])
    reasons = [next(filter(None, map(whole.reason, range(1 + k * size, 1 + (k + 1) * size))), whole.reason(0))
               for k in range(len(numbers))]  # fmt: skip
    pairs = [*product(range(len(results)), range(len(numbers)))]
    doubts = [_doubt(slopes[k, :, j].tolist(), middle[j], numbers[k], reasons[k]) for j, k in pairs]
    derivative, error, low, high = np.moveaxis(slopes, 0, 2).reshape(4, -1)
    value, at = np.repeat(middle, len(numbers)), np.array([number.value for number in numbers] * len(results))
    elasticity = np.where((value != 0) & (at != 0), derivative * np.abs(at / value), np.nan)
    units = [(whole.units[j], numbers[k].unit) for j, k in pairs]
    table = columns.SENSITIVITIES
    return table.table(table.columns(
        {}, result=np.array([results[j].name for j, _ in pairs]),
        parameter=np.array([numbers[k].given for _, k in pairs]), derivative=derivative, error=error,
        unit=np.array([Units.ratio(*both) for both in units]), elasticity=elasticity, below=low, above=high,
        value=value, value_unit=np.array([unit for unit, _ in units]), at=at,
        at_unit=np.array([unit for _, unit in units]), settled=np.array([not doubt for doubt in doubts]),
    )), doubts  # fmt: skip


def _doubt(found: Sequence[float], middle: float, number: Changing, reason: str) -> str:
    """Why a derivative is unknown or uncertain, with its error and the slopes on both sides; empty if it is neither."""
    value, error, below, above = found
    if not math.isnan(below):
        slopes = f"{numeral(below)} below {numeral(number.value)} and {numeral(above)} above"
        return f"has a kink here; its slope is {slopes}"
    if math.isnan(value):
        return f"is not known near {number.value:g}: {reason or 'it is nan there'}"
    if error <= max(_UNCERTAIN * abs(value), abs(middle) * _NOTHING / number.step):
        return ""
    # Noise needs longer steps, strong curvature shorter ones.
    other = number.step * 10 if number.step <= _PART * abs(number.value) else number.step / 10
    return (
        f"differences do not agree: {numeral(value, 4)} with an error of {numeral(error, 2)}; it may jump here or be "
        f"rough (few samples); another step may help, {{parameter: {number.given}, step: {other:g}}}"
    )
