"""Results of designs, which arrays of values of a study's entries give; what is compiled is kept for the next call."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.family.columns import EVALUATED
from mechdesign.family.family import DESIGNS_AT_ONCE, Family
from mechdesign.family.goals import Goal, goal
from mechdesign.family.question import DesignsQuestion
from mechdesign.ground.errors import Problem, StudyError
from mechdesign.ground.results import Table
from mechdesign.ground.work.threads import one_thread
from mechdesign.study import Study
from mechdesign.study.loading import load_document
from mechdesign.study.schema.study_file import entry
from mechdesign.study.text.document import Document, dotted, plain
from mechdesign.study.text.reading import shown

# Most families that are kept.
MOST_FAMILIES = 16

Column = Sequence[Any] | NDArray[Any]
"""Values of an entry, one a design."""
Named = str | Mapping[str, Any]
"""A result by its name, or with the rows that count: ``{"result": ..., "where": ...}``."""


@one_thread()
def evaluate(study: Study, values: Mapping[str, Column], results: Sequence[Named]) -> Table:
    """Results of designs of a study; see `mechdesign.evaluate`."""
    if isinstance(results, str) or not results:
        raise StudyError("'results' lists names, such as kinematics.extremes.C.x.range")
    columns = {name: _column(name, given) for name, given in values.items()}
    names, lengths = [*columns], [len(column) for column in columns.values()]
    if not names:
        raise StudyError("'values' names entries of the study, such as mechanism.parameters.r, each with an array")
    for name, length in zip(names, lengths, strict=True):
        if length != lengths[0]:
            raise StudyError([Problem(f"has {length} values, and {names[0]} has {lengths[0]}", name)])
    owns, family = _compiled(study, tuple(names), json.dumps([*results], default=str))
    designs = dict(zip(owns, columns.values(), strict=True))
    parts = [
        family({name: column[begin : begin + DESIGNS_AT_ONCE] for name, column in designs.items()})
        for begin in range(0, lengths[0], DESIGNS_AT_ONCE)
    ]
    reasons = np.array([reason for part in parts for reason in part.reasons], dtype=object)
    numbers = np.concatenate(
        [np.empty((0, len(family.goals))), *(part.table[:, family.layout.values] for part in parts)]
    )
    table = EVALUATED
    return table.table([
        *(table["<result>"].column(column, family.question.unit(goal), result=goal.name)
          for goal, column in zip(family.goals, numbers.T, strict=True)),
        *table.columns({}, valid=reasons == "", reason=reasons),
    ])  # fmt: skip


def _column(name: str, given: Column) -> NDArray[Any]:
    """The values of an entry: numbers as floats, others as they are.

    Raises
    ------
    StudyError
        If they are not one a design, or no values that a study may have.
    """
    column = np.empty(0, dtype=object)
    # Lists of several lengths make no array.
    with suppress(ValueError):
        column = np.asarray(given)
    numeric = column.dtype.kind in "iuf"
    if numeric and column.ndim == 1:
        return column.astype(float)
    if numeric or column.ndim == 0:
        what = f"an array of shape {column.shape}" if column.ndim else shown(given)
        raise StudyError([Problem(f"expected a value for each design, an array of shape (designs,), not {what}", name)])
    items = np.empty(len(given), dtype=np.object_)
    for k, item in enumerate(given):
        items[k] = item.item() if isinstance(item, np.generic) else item
        try:
            json.dumps(items[k])
        except (TypeError, ValueError, RecursionError):
            raise StudyError([Problem(f"a study has no value of type {type(item).__name__}", name)]) from None
    return items


@lru_cache(MOST_FAMILIES)
def _compiled(study: Study, names: tuple[str, ...], results: str) -> tuple[list[str], Family]:
    """The names of entries as the family of a study takes them, and this family.

    Raises
    ------
    StudyError
        If the study has no such entry or result; every mistake in one go.
    """
    problems: list[Problem] = []
    owns: list[str] = []
    for name in names:
        try:
            path = entry(study.resolved, name)
        except StudyError as error:
            problems += [replace(problem, key=name) for problem in error.problems]
            continue
        own = str(path[2]) if path[:2] == ("mechanism", "parameters") and len(path) == 3 else dotted(path)
        if own in owns:
            problems.append(Problem(f"is the entry {names[owns.index(own)]!r} once more", name))
        owns.append(own)
    try:
        goals = _goals(study, json.loads(results))
        own_numbers = [own for own in owns if own in study.parameters.nominal]
        family = Family(DesignsQuestion(study, dict.fromkeys(goals, ()), own_numbers))
    except StudyError as error:
        problems += error.problems
    if problems:
        raise StudyError(problems)
    return owns, family


def _goals(study: Study, results: Sequence[Named]) -> list[Goal]:
    """Results by their names, checked as those of a sweep."""
    data = plain(study.resolved) | {"matrix": {"vary": {"seed": [0]}, "results": results}}
    try:
        matrix = load_document(Document.of(data), study.source, original=study.mechanism).matrix
    except StudyError as error:
        names = [
            str(named["result"]) if isinstance(named, dict) and "result" in named else str(named) for named in results
        ]
        raise StudyError([_renamed(problem, names) for problem in error.problems]) from None
    assert matrix is not None
    return [goal(result.result, where=result.where, single=True) for result in matrix.results]


def _renamed(problem: Problem, names: Sequence[str]) -> Problem:
    """A mistake in a result, by the name of that."""
    number = problem.key.removeprefix("matrix.results").lstrip(".").partition(".")[0]
    return Problem(problem.message, names[int(number)] if number.isdigit() else "results")
