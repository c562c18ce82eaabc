"""Goals of many designs at once: every question's tables together, or design by design where that is not possible."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain

import numpy as np
from numpy.typing import ArrayLike

from mechdesign.family import stacked
from mechdesign.family.batch import FAILED, Batch, Evaluated, first_reason, without_numbers
from mechdesign.family.goals import Goal, shape_of
from mechdesign.family.question import DesignsQuestion, regions_of
from mechdesign.family.stacked import grouped
from mechdesign.ground.errors import AssemblyError, MechdesignError
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.ground.results import Result
from mechdesign.ground.rows import UnknownColumnError
from mechdesign.ground.terms import terms_of
from mechdesign.motion.rows import Poses
from mechdesign.motion.solving import solve_poses
from mechdesign.questions.look import ask
from mechdesign.questions.poses import study_poses
from mechdesign.questions.workspace.answer import answer
from mechdesign.questions.workspace.question import Question, split
from mechdesign.region.growth import fitted
from mechdesign.region.rays import BATCH
from mechdesign.study import Study
from mechdesign.study.designs import Designs

NO_REGION = "nothing of the workspace can be reached"
BETWEEN = "the motion cannot be assembled between its poses"
SAMPLES = "samples cannot be assembled"


class Evaluator:
    """Evaluates goals for designs of one study, which differ in numbers alone: parameters or single places.

    Where the question is graded, it also gives the rows whose worst is a goal, or whose root mean square is one, and
    how far poses are from assembling.
    """

    def __init__(self, question: DesignsQuestion) -> None:
        self.question, self.study, self.goals, self.layout = question, question.study, question.goals, question.layout

    def __call__(self, designs: Mapping[str, Floats]) -> Evaluated:
        """Evaluate designs by the values of what changes, each of shape (designs,), in the study's units."""
        batch = Batch(Designs(self.study, designs), self.layout)
        values: dict[str, ArrayLike] = {**self.study.parameters.nominal, **batch.designs.parameters}
        for goal in self.goals:
            if goal.expression is not None:
                numbers = np.asarray(goal.expression.evaluate(values))
                numbers = np.where(np.isfinite(numbers), numbers, np.nan)
                batch.table[:, self.layout.column[goal]] = np.abs(numbers) if goal.absolute else numbers
        if self.question.regions and self.question.regions_together:
            self._regions(batch, batch.feasible, self.question.regions)
        for command, tables in self.question.together.items():
            for rows, study, poses in grouped(batch.designs, command, batch.feasible, batch.failed):
                self._tables(batch, command, tables, rows, study, poses)
        if self.question.alone or not self.question.regions_together:
            for k in batch.feasible.tolist():
                batch.reasons[k] = self._one(batch, k)
        for goal, column in zip(self.goals, batch.table[:, self.layout.values].T, strict=True):
            batch.note(slice(None), np.isnan(column), f"{goal.name} has no value")
            # Nothing is best at infinity; a condition may well be met there.
            infinite = np.isinf(column) & (not goal.gate)
            batch.note(slice(None), infinite, f"{goal.name} is infinite")
            batch.table[infinite, self.layout.shortfall] = np.nan
        return Evaluated(batch.table, [str(reason) for reason in batch.reasons])

    def _regions(self, batch: Batch, rows: Ints, questions: Sequence[Question]) -> None:
        """Numbers of the workspaces of some designs, the worst over all values of the held coordinates.

        `questions` are those of the study, or of a single design.
        """
        if not len(rows):
            return
        numbers, own = batch.designs.take(rows).numbers, questions is self.question.regions
        try:
            regions = [
                answer(question, question.places(numbers) if own else {}, len(rows), BATCH) for question in questions
            ]
        except AssemblyError as error:
            # The workspace of one design has no end.
            for half in batch.halves(rows, error):
                self._regions(batch, half, questions)
            return
        for question, region in zip(questions, regions, strict=True):
            there = question.where if len(questions) > 1 else ""
            batch.note(rows, ~(region.panels.closes & (region.values["area"] > 0)), NO_REGION + there)
        lanes = np.arange(len(rows))
        for goal in self.question.regional:
            column, outline = self.layout.column[goal], goal.outline
            shape = None if outline is None else shape_of(outline, numbers.of)
            values = np.stack([
                region.values[goal.column] if shape is None else fitted(shape, region.panels)[0]
                for region in regions
            ])  # fmt: skip
            # A missing value counts as the worst.
            worst = np.where(np.isnan(values), np.inf, values if goal.smallest else -values).argmax(axis=0)
            batch.table[rows, column] = values[worst, lanes]
            if split(goal.column)[1] == "mean":
                errors = np.stack([region.errors[goal.column] for region in regions])
                batch.table[rows, len(self.goals) + column] = errors[worst, lanes]

    def _tables(
        self, batch: Batch, command: str, tables: Mapping[str, Sequence[Goal]], rows: Ints, study: Study, poses: Poses
    ) -> None:
        names = {*tables, "motion"} if self.question.squares.intersection(chain(*tables.values())) else set(tables)
        try:
            stack = stacked.tables(study, command, names, poses, self.question.outputs, self.question.requests)
        except MechdesignError as error:
            for half in batch.halves(rows, error):
                own = study_poses(study, command, batch.designs.take(half).numbers)
                self._tables(batch, command, tables, half, study, own)
            return
        failed = FAILED[first_reason(stack.reason)]
        wrong = stack.reason != 0
        partly = all(goal.unassembled for goals in tables.values() for goal in goals)
        batch.note(rows, wrong.all(axis=1) if partly else wrong.any(axis=1), failed)
        batch.note(rows, ~stack.whole & (not partly), BETWEEN)
        clear = self.layout.assembly.get(command)
        if self.question.graded and (clear is not None or (batch.reasons[rows] != "").any()):
            margins = stacked.assembly_margins(study, poses, stack.solved)
            batch.table[rows, self.layout.shortfall] = stacked.shortfall(margins)
            if clear is not None and margins.shape[1] == clear.stop - clear.start:
                batch.table[rows, clear] = margins
        for goal in [goal for goals in tables.values() for goal in goals]:
            lost = np.isnan(batch.judge(goal, stack.result, rows))
            batch.note(rows, lost & (failed != ""), failed)

    def _needed(self, study: Study) -> Study:
        """The study without costly parts that no goal needs: allocation of tolerances, Sobol' indices."""
        section, columns = study.reliability, [goal.column for goal in self.goals]
        if section is None:
            return study
        if "cost_allocated" not in columns:
            section = section.model_copy(update={"allocate": None})
        if not any(column.startswith("sobol_") for column in columns):
            section = section.model_copy(update={"sobol": 0})
        return study.with_sections(reliability=section)

    def _one(self, batch: Batch, k: int) -> str:
        """Evaluate the other goals of one design; returns why it is infeasible, empty if it is not."""
        row = np.array([k])
        command = ""
        try:
            other = batch.designs.one(k)
            if not self.question.regions_together:
                self._regions(batch, row, regions_of(other, self.goals))
                if batch.reasons[k]:
                    return str(batch.reasons[k])
            other = self._needed(other)
            for command, goals in self.question.alone.items():
                result = ask(other, command)
                partly = ["" if goal.unassembled else missing(goal, result) for goal in goals]
                values = [batch.judge(goal, result, row) for goal in goals]
                if result.failed or any(partly) or np.isnan(values).any():
                    gap = next(filter(None, partly), "")
                    between = SAMPLES if gap.endswith(SAMPLES) else BETWEEN if gap else ""
                    return self._pose_reason(batch, k, other, command) or between
        except UnknownColumnError as error:
            return str(error)
        except AssemblyError as error:
            return (self._pose_reason(batch, k, other, command) if command else "") or without_numbers(error)
        except MechdesignError as error:
            return without_numbers(error)
        return ""

    def _pose_reason(self, batch: Batch, k: int, study: Study, command: str) -> str:
        """Why poses of a design fail, empty where none does; notes their shortfall from assembling."""
        if command == "workspace":
            return NO_REGION
        poses = study_poses(study, command)
        solved = list(solve_poses(study.motion(poses)))
        if self.question.graded:
            batch.table[k, self.layout.shortfall] = stacked.shortfall(stacked.assembly_margins(study, poses, solved))[0]
        return str(FAILED[first_reason(np.concatenate([part.configuration.reason for part in solved])[None])[0]])


def missing(goal: Goal, result: Result) -> str:
    """Invalid poses, samples or parts of the motion that a goal judges, in words; empty where all are valid."""
    parts = terms_of(result, goal.column, dict(goal.where)).parts
    return next((gap for chosen in parts for gap in chosen.gaps), "")
