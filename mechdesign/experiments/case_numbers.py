"""Numbers of cases by the names of results, and their margins from requirements, of many cases at once."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from mechdesign.experiments.schema.matrix import Named
from mechdesign.family.goals import Goal, goal
from mechdesign.family.judge import Judgement, judge
from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.ground.rows import ChosenRows, UnknownColumnError
from mechdesign.ground.terms import Sum, path_of, terms_of
from mechdesign.motion.group import DesignGroup
from mechdesign.study.schema.conditions import Requirement
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.units import text_of


def goals_in(
    section: KeyPath, results: Iterable[Named], *, smallest: bool = False, whole: bool = False
) -> dict[Goal, KeyPath]:
    """The numbers that a section of the study lists as its results, with their places in the study."""
    return {
        goal(result.result, smallest=smallest, where=result.where, single=True, whole=whole): (*section, k)
        for k, result in enumerate(results)
    }


def number_of(goal: Goal, group: DesignGroup) -> tuple[Floats, str]:
    """A number of each design, shape (designs,), nan where a row that counts has none; and its unit.

    Raises
    ------
    UnknownColumnError
        If there is no such column or row, or several rows count and no statistic is named; also where designs differ in
        their number of rows, so that each has to be read by itself.
    """
    terms = _terms(group, goal.column, dict(goal.where))
    numbers = terms.numbers(len(group.ends))
    return np.where(incomplete(group, terms), np.nan, numbers) if goal.whole else numbers, terms.unit


def judged(group: DesignGroup, required: Sequence[Requirement]) -> tuple[Judgement, Flags, str]:
    """Worst value and margin of each design by a requirement, which of them meet it, and the unit.

    Parameters
    ----------
    required : sequence of Requirement
        That of each design.

    Raises
    ------
    UnknownColumnError
        See `number_of`; also where designs are judged on other rows.
    """
    one = required[0]
    if any(other is not one and _subject(other) != _subject(one) for other in required):
        raise UnknownColumnError("designs are not judged on the same rows")
    terms = _terms(group, path_of(one.result), dict(one.where))

    def bound(key: str) -> Floats | None:
        """The bounds of the designs, in the unit of the terms."""
        own = [(getattr(other, key), text_of(getattr(other, key))) for other in required]
        limits = {limit: terms.bound(limit[0]) for limit in {*own}} if getattr(one, key) is not None else {}
        return np.array([limits[limit] for limit in own]) if limits else None

    judged = judge(
        terms, (bound("at_least"), bound("at_most")), len(group.ends), absolute=one.abs,
        assembled=one.unassembled is not None, number=isinstance(terms, Sum) or bool(terms.statistic),
    )  # fmt: skip
    partly = incomplete(group, terms) & (one.unassembled is None)
    return judged, judged.met & ~partly, terms.unit


def incomplete(group: DesignGroup, terms: ChosenRows | Sum) -> Flags:
    """Designs of which poses, samples or a part of the motion are missing in what is judged."""
    if len(group.ends) == 1:
        return np.array([any(part.gaps for part in terms.parts)])
    return group.missing & any(part.table.scope for part in terms.parts)


def _subject(requirement: Requirement) -> dict[str, Any]:
    """What a requirement judges, and from which sides."""
    limits = {key: getattr(requirement, key) is None for key in ("at_least", "at_most")}
    return requirement.model_copy(update=limits).__dict__


def _terms(group: DesignGroup, path: str, where: dict[str, Any]) -> ChosenRows | Sum:
    """The rows that a path names, of which each design has the same number, and at least one that counts."""
    terms, designs = terms_of(group.result, path, where), len(group.ends)
    if designs == 1 and terms.missing:
        raise UnknownColumnError(terms.missing)
    for part in terms.parts if designs > 1 else ():
        even = part.table.name not in group.uneven
        if not even or not (part.part or part.counts.reshape(designs, -1).any(axis=1).all()):
            raise UnknownColumnError(f"designs have not as many rows of {part.table.name} each")
    return terms
