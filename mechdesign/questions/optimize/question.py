"""What an optimisation asks of every design: its goals and conditions."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from mechdesign.family.batch import Evaluated
from mechdesign.family.family import Family
from mechdesign.family.goals import Goal, bounds_of, goal
from mechdesign.family.question import DesignsQuestion
from mechdesign.ground.errors import StudyError
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.questions.optimize.schema import OptimizeSection
from mechdesign.questions.optimize.variables import choice_problems, entries, from_cube
from mechdesign.study import Study
from mechdesign.study.schema.variable import plainly
from mechdesign.study.text.document import KeyPath


def designs_question(study: Study, goals: Sequence[Goal] = (), *, graded: bool = False) -> DesignsQuestion:
    """Read what is asked of the designs of an optimisation.

    Without `goals` it is what the study asks: its goals and conditions, and its choices are tried.

    Raises
    ------
    StudyError
        See `DesignsQuestion`; also if a choice makes no study.
    """
    section = study.optimize
    assert section is not None
    places = goals_of(section) | conditions_of(section, study.parameters.moved(section.variables))
    judged = {goal: places.get(goal, ()) for goal in goals or places}
    problems = [] if goals else [*choice_problems(study)]
    try:
        question = DesignsQuestion(study, judged, [*section.variables], graded=graded)
    except StudyError as error:
        raise StudyError([*error.problems, *problems]) from None
    if problems:
        raise StudyError(problems)
    return question


def goals_of(section: OptimizeSection) -> dict[Goal, KeyPath]:
    """The goals that a section maximises, then those that it minimises, with their places in the study."""
    return {
        goal(
            judged.result, smallest=key == "minimize", where=judged.where, absolute=judged.abs,
            unassembled=judged.unassembled is not None,
        ): ("optimize", key, k)
        for key in ("maximize", "minimize")
        for k, judged in enumerate(getattr(section, key))
    }  # fmt: skip


def conditions_of(section: OptimizeSection, moved: Collection[str]) -> dict[Goal, KeyPath]:
    """The conditions of a section with their places in the study; designs differ in the parameters `moved`."""
    given = enumerate(section.subject_to)
    return {goal: ("optimize", "subject_to", k) for k, condition in given for goal in bounds_of(condition, moved)}


class VariableFamily:
    """Evaluates designs by the values of an optimisation's variables."""

    def __init__(self, question: DesignsQuestion) -> None:
        """Evaluate what a question asks, whose study has the variables."""
        assert question.study.optimize is not None
        lowest = from_cube(question.study, np.zeros((1, len(question.study.optimize.variables)))).designs
        self._study = question.study
        self._family = Family(question, {name: plainly(values.item()) for name, values in lowest.items()})

    def __call__(self, designs: Mapping[str, Floats]) -> Evaluated:
        """The results of designs."""
        return self._family(entries(self._study, designs))
