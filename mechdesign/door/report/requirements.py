"""Requirements: does the worst row of a result meet what the study requires of it?"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from mechdesign.commands import SWEEP
from mechdesign.door.report.row_words import place_of
from mechdesign.family.judge import Judgement, along, by_rows, judge
from mechdesign.ground.cautions import ALL, Caution, fails
from mechdesign.ground.errors import AssemblyError, Problem, StudyError, counted, few_comparisons
from mechdesign.ground.numerals import numeral
from mechdesign.ground.results import POSES_ONLY, Drawn, Result
from mechdesign.ground.rows import ChosenRows, UnknownColumnError, choose, located
from mechdesign.ground.statistics import AT_END, STATISTICS
from mechdesign.ground.table_text import Rounding
from mechdesign.ground.terms import Sum, is_plain, path_of, terms_of
from mechdesign.ground.terms import command_of as command_named
from mechdesign.mechanism.plates import CLEARANCE
from mechdesign.study import Study
from mechdesign.study.schema.conditions import Requirement
from mechdesign.study.text.units import QUANTITY, Amount, text_of, written

Limits = tuple[float | None, float | None]
"""Lowest and highest value, in the unit of what is judged."""
Check = Callable[[Result], Iterable[Problem]]
# Larger values are looked at for rounding by no verdict: it takes a look at all columns of a table.
_SMALL = 1e-6
# Place of a verdict where the motion never enters the part that a requirement is about.
_OUTSIDE = "no place of the motion"


@dataclass(frozen=True)
class Verdict:
    """The verdict on one requirement.

    >>> import mechdesign
    >>> study = mechdesign.load(text='''
    ... mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, 100]}, drives: [arm]}
    ... kinematics: {poses: [{arm: 0}, {arm: 60}], outputs: [P]}
    ... requirements: [{result: kinematics.P.y, at_most: 80}]
    ... ''')
    >>> (verdict,) = mechdesign.kinematics(study).verdicts
    >>> print(verdict)
    kinematics.P.y at most 80: NOT MET, worst 86.6025 at arm 60 (of the asked poses only)
    >>> print(f"{verdict.margin:.4f} {verdict.unit}")
    -6.6025 mm
    """

    requirement: str  #: in words
    met: bool  #: whether the worst row meets it
    worst: float  #: the value where it is worst; nan where a row has none or no row was found
    place: str = ""  #: the pose or row where it is worst
    margin: float = float("nan")  #: of the worst row to the limit, negative beyond it
    unit: str = ""  #: of `worst` and `margin`
    note: str = ""  #: which poses or parts of a motion it does not speak of
    reason: str = ""  #: why it is not met whatever the value: what cannot be assembled, or has no value
    limit_unit: str = ""  #: unit in which the nearer limit is written; empty where it is a bare number

    @property
    def as_required(self) -> Verdict:
        """The verdict in the unit in which the nearer limit is written."""
        if not self.limit_unit:
            return self
        factor = Amount(1.0, f"1 {self.limit_unit}").within(self.unit)
        return replace(self, worst=self.worst / factor, margin=self.margin / factor, unit=self.limit_unit)

    def __str__(self) -> str:
        place, note = f" at {self.place}" if self.place else "", f" ({self.note})" if self.note else ""
        own = self.as_required
        unit = f" {self.limit_unit}" if self.limit_unit and not np.isnan(self.worst) else ""
        return f"{self.requirement}: {'met' if self.met else 'NOT MET'}, worst {numeral(own.worst)}{unit}{place}{note}"


@dataclass(frozen=True, eq=False)
class DrawnCases(Drawn):
    """Columns of the table of a sweep by what they are, and what became of the requirements over its cases.

    Parameters
    ----------
    entries : sequence of str
        Columns of the entries that vary.
    results : mapping of str to Limits
        Columns of results, with the limits that a requirement sets, in the unit of the column.
    goals : mapping of str to int
        Columns of goals: 1 where one is to be small, -1 where it is to be large.
    verdicts : tuple of Verdict
        The worst over the cases, a requirement each.
    case : callable
        The study of a case by its number, from 1.
    """

    entries: Sequence[str]
    results: Mapping[str, Limits]
    goals: Mapping[str, int]
    verdicts: tuple[Verdict, ...]
    case: Callable[[int], Study]


def named(kind: str) -> str:
    """An entry of `fail_on` in words."""
    return "warnings" if kind == ALL else f"warnings of kind {kind}"


def on_warnings(study: Study, warnings: Iterable[Caution]) -> tuple[Verdict, ...]:
    """Verdicts on the warnings of a study's file and of a result: a kind that the study's `fail_on` lists has none."""
    warnings = [*study.cautions, *warnings]
    verdicts = []
    for kind in study.barred:
        same = [str(warning) for warning in warnings if fails(warning, [kind])]
        more = f"; and {len(same) - 1} more" if len(same) > 1 else ""
        note = f"{same[0]}{more}" if same else ""
        verdicts.append(Verdict(f"{named(kind)} at most 0", not same, len(same), margin=0.0 - len(same), note=note))
    return tuple(verdicts)


def judged_again(study: Study, verdicts: Sequence[Verdict], warnings: Iterable[Caution]) -> tuple[Verdict, ...]:
    """The verdicts after warnings were added, such as those of pictures; none if there were none before."""
    return (*verdicts[: len(verdicts) - len(study.barred)], *on_warnings(study, warnings)) if verdicts else ()


def command_of(requirement: Requirement) -> str:
    """The command whose result a requirement judges."""
    return command_named(requirement.result)


def judged_by(study: Study, command: str) -> list[int]:
    """Which requirements of a study a command's verdicts are on: those of its result, of a sweep all of them."""
    return [k for k, requirement in enumerate(study.requirements) if command in (command_of(requirement), SWEEP.name)]


def number_of(study: Study, command: str) -> int:
    """Number of a command's verdicts: those on requirements, and on kinds of warnings."""
    return len(judged_by(study, command)) + len(study.barred)


def foresee(
    study: Study, commands: Iterable[str], *, goals: bool = False, also: Mapping[str, Check] = MappingProxyType({})
) -> None:
    """Check before a long computation that the requirements of commands name columns that their results will have.

    Parameters
    ----------
    goals : bool
        Whether to look at the choices, goals and conditions of `optimize` as well, which its own computation begins
        with.
    also : mapping of str to callable
        What else is wrong with a look at the results of commands.

    Raises
    ------
    StudyError
        Every such mistake in one go, with its place.
    """
    from mechdesign.questions.look import look, with_fewer_rows

    problems: list[Problem] = []
    judged = {command_of(requirement) for requirement in study.requirements} | also.keys()
    if goals and study.optimize is not None:
        from mechdesign.questions.optimize.question import designs_question

        try:
            with suppress(AssemblyError):
                designs_question(study)
        except StudyError as error:
            problems += error.problems
            # Its requirements would report the same mistakes.
            judged.discard("optimize")
    for command in [name for name in commands if name in judged]:
        try:
            glance = look(study, command)
            problems += also[command](glance) if command in also else ()
            requirements(study, glance, fewer=with_fewer_rows(glance))
        except AssemblyError:
            # Its own computation reports it.
            continue
        except StudyError as error:
            problems += error.problems
    if problems:
        raise StudyError(problems)


@few_comparisons()
@np.errstate(all="ignore")
def requirements(study: Study, result: Result, *, fewer: Collection[str] = ()) -> tuple[Verdict, ...]:
    """Verdicts on those requirements of a study that concern a result, in the order of the study; then on its warnings.

    The worst row counts: the smallest value for `at_least`, the largest for `at_most`; along a motion the worst place
    between the rows, too. nan is not met, nor is a requirement on a motion that is not valid at every pose and between
    them (unless it says ``unassembled: allowed``), nor one that no row answers. Of a kind of warning that `fail_on`
    lists there may be none.

    Parameters
    ----------
    study : Study
        With the requirements.
    result : Result
        Of one question.
    fewer : collection of str
        Tables that have not all their rows: one that is missing there is no mistake.

    Raises
    ------
    StudyError
        If a requirement names a column that the result has not, or one of words, or a row that its table never has.
        Every such mistake in one go, with its place.

    Examples
    --------
    >>> import mechdesign
    >>> study = mechdesign.load(text='''
    ... mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, 100]}, drives: [arm]}
    ... kinematics: {poses: [{arm: 0}, {arm: 30}]}
    ... requirements: [{result: kinematics.P.x, at_least: 90}]
    ... ''')
    >>> for verdict in mechdesign.requirements(study, mechdesign.kinematics(study)):
    ...     print(verdict)
    kinematics.P.x at least 90: NOT MET, worst 86.6025 at arm 30 (of the asked poses only)
    """
    if isinstance(result.drawn, DrawnCases):
        return (*result.drawn.verdicts, *on_warnings(study, result.warnings))
    verdicts: list[Verdict] = []
    problems: list[Problem] = []
    for index, requirement in enumerate(study.requirements):
        if command_of(requirement) != result.command:
            continue
        try:
            verdicts.append(verdict_on(result, requirement, study.mechanism.mobility, fewer=fewer))
        except UnknownColumnError as error:
            problems.append(study.problem(str(error), "requirements", index))
    if problems:
        raise StudyError(problems)
    return (*verdicts, *on_warnings(study, result.warnings))


def verdict_on(result: Result, requirement: Requirement, freedom: int = 1, *, fewer: Collection[str] = ()) -> Verdict:
    """The verdict on one requirement; `freedom` is how many numbers make a pose, see `requirements`.

    Raises
    ------
    UnknownColumnError
        See `requirements`.
    """
    judged, named = result, requirement.result.split(".")[1:2]
    allocated = bool(result.allocated) and not {*named} & (result.tables.keys() - result.allocated.keys())
    if allocated:
        judged = replace(result, tables={**result.tables, **result.allocated})
    verdict = _judged(judged, requirement, freedom, fewer)
    if allocated:
        verdict = replace(verdict, note="; ".join(filter(None, ("with the allocated tolerances", verdict.note))))
    return _with_unit_of_limit(verdict, requirement)


def _with_unit_of_limit(verdict: Verdict, requirement: Requirement) -> Verdict:
    """The verdict with the unit in which the nearer limit is written, if it has one."""
    limits = [limit for limit in (requirement.at_least, requirement.at_most) if limit is not None]
    if len(limits) == 2 and not np.isnan(verdict.margin):
        low, high = (Amount.of(limit).within(verdict.unit) for limit in limits)
        limits = limits[:1] if verdict.worst - low <= high - verdict.worst else limits[1:]
    quantity = QUANTITY.fullmatch(text_of(limits[0]))
    return verdict if quantity is None else replace(verdict, limit_unit=quantity["unit"])


def _judged(result: Result, requirement: Requirement, freedom: int, fewer: Collection[str]) -> Verdict:
    """The verdict in the unit of the result."""
    path = path_of(requirement.result)
    if not is_plain(result, path):
        return _of_number(terms_of(result, path, requirement.where), requirement, freedom)
    table, column, rows = located(result, path)
    worst, place, begin = None, "", 0
    # A word that selects rows may occur in a few blocks only.
    for part in table.blocks() if rows.all() else [table]:
        chosen = choose(replace(result, tables={**result.tables, table.name: part}), path, requirement.where)
        bounds = _bounds(chosen, requirement)
        own = by_rows(chosen, bounds, absolute=requirement.abs, assembled=bool(requirement.unassembled))
        row, margin = int(own.row[0]), own.margins[0]
        if row >= 0 and (worst is None or not (np.isnan(worst.margins[0]) or margin >= worst.margins[0])):
            worst, place = own, "" if len(table) == 1 else place_of(part, row, column, freedom, begin)
        begin += len(part)
    chosen = replace(chosen, table=table)
    if worst is None and not (chosen.part and chosen.courses):
        if table.name not in fewer and (missing := choose(result, path, requirement.where).missing):
            raise UnknownColumnError(missing)
        return Verdict(in_words(requirement), met=False, worst=float("nan"), place=f"no row of {table.name}")
    judged = along(worst or own, chosen, bounds, absolute=requirement.abs)
    words, course = [*chosen.courses.items()][judged.strand[0]] if judged.strand[0] >= 0 else ("", None)
    if course is not None and np.isfinite(judged.at[0]):
        place = ", ".join(filter(None, (course.shown(float(judged.at[0])), words)))
    elif judged.row[0] < 0:
        # Of no row, between which the motion has no place either.
        place = _OUTSIDE if worst is None else words
    return _verdict(requirement, judged, place, chosen)


def _of_number(terms: ChosenRows | Sum, requirement: Requirement, freedom: int) -> Verdict:
    """The verdict on one number: a statistic of a column, or a sum."""
    bounds, assembled = _bounds(terms, requirement), bool(requirement.unassembled)
    judged = judge(terms, bounds, absolute=requirement.abs, assembled=assembled, number=True)
    place = _place_of_end(terms, requirement, freedom) if isinstance(terms, ChosenRows) else ""
    if np.isnan(judged.values[0]):
        outside = any(chosen.part for chosen in terms.parts) and not any(chosen.lacking for chosen in terms.parts)
        place = _OUTSIDE if outside else ""
    return _verdict(requirement, judged, place, terms)


def _place_of_end(chosen: ChosenRows, requirement: Requirement, freedom: int) -> str:
    """Where the largest or smallest value is that a statistic takes; empty of a mean and a range."""
    statistic = STATISTICS[chosen.statistic] if chosen.statistic else None
    counts = chosen.counted(assembled=bool(requirement.unassembled)) & ~np.isnan(chosen.values)
    if statistic is None or not statistic.end or not counts.any():
        return ""
    sign, rows = statistic.end, np.flatnonzero(counts)
    values = sign * (np.abs(chosen.values) if statistic.absolute else chosen.values)
    row = int(rows[values[rows].argmax()])
    most, place = float(values[row]), place_of(chosen.table, row, chosen.column, freedom)
    for words, course in chosen.courses.items():
        end, at = (float(part[0]) for part in course.worst(sign, absolute=statistic.absolute))
        if np.isfinite(end) and np.isnan(at):
            return words
        if np.isfinite(at) and sign * end >= most - AT_END * abs(most):
            most, place = sign * end, ", ".join(filter(None, (course.shown(at), words)))
    return place


def _bounds(chosen: ChosenRows | Sum, requirement: Requirement) -> Limits:
    low, high = (None if end is None else chosen.bound(end) for end in (requirement.at_least, requirement.at_most))
    return low, high


def _verdict(requirement: Requirement, judged: Judgement, place: str, terms: ChosenRows | Sum) -> Verdict:
    """The verdict with a note of what it does not cover; not met where a part that must be valid is missing."""
    if isinstance(terms, ChosenRows) and terms.values.dtype.kind == "f" and 0 < abs(judged.values[0]) < _SMALL:
        column = terms.table.column(terms.column)
        if abs(judged.values[0]) <= Rounding.of(terms.table.seen.columns).still(column, terms.unit):
            judged = Judgement.of(np.zeros(1), _bounds(terms, requirement))
    value, margin = float(judged.values[0]), float(judged.margins[0])
    scopes = [chosen.table.scope for chosen in terms.parts]
    missing = [gap for chosen in terms.parts for gap in chosen.gaps]
    needed = missing if requirement.unassembled is None else []
    met = margin >= 0 and not needed
    notes = [POSES_ONLY] if any(chosen.isolated for chosen in terms.parts) else []
    courses = [course for chosen in terms.parts for course in chosen.courses.values() if chosen.requests[0].integral]
    notes += dict.fromkeys(f"mean over {course.means_over}, not time" for course in courses if course.means_over)
    ends = [scope.until for scope in scopes if scope is not None and scope.until]
    lacking = [chosen.lacking for chosen in terms.parts] if np.isnan(value) else []
    least = [chosen.column.rpartition(".")[2] for chosen in terms.parts if chosen.statistic in ("", "min")]
    notes += [f"an overlap of {-value:.6g} {terms.unit}".rstrip()] * (value < 0 and CLEARANCE in least)
    note = "; ".join([*notes, *dict.fromkeys(filter(None, [*lacking, *missing, *ends]))])
    reason = "" if met else "; ".join(dict.fromkeys(filter(None, [*lacking, *needed])))
    return Verdict(in_words(requirement), met, value, place, margin, terms.unit, note, reason)


def over_cases(worst: Verdict, name: str, unmet: int, count: int, first: str) -> Verdict:
    """The verdict on a requirement over cases: that of the worst, named in words, and how many of them miss it.

    `first` is the first one that does.
    """
    place = ", ".join(filter(None, (name, worst.place)))
    if unmet:
        place += f"; {unmet} of {counted(count, 'case')} do not meet it, the first is {first}"
    return replace(worst, met=not unmet, place=place)


def in_words(requirement: Requirement) -> str:
    """A requirement in words: the result, the rows that count, the bounds."""
    value = f"|{requirement.result}|" if requirement.abs else requirement.result
    where = ", ".join(f"{column} {cell}" for column, cell in requirement.where.items())
    limits = (("at least", requirement.at_least), ("at most", requirement.at_most))
    bounds = [f"{words} {written(bound)}" for words, bound in limits if bound is not None]
    allowed = ", unassembled allowed" if requirement.unassembled else ""
    return f"{value}{f' ({where})' if where else ''} {' and '.join(bounds)}{allowed}"
