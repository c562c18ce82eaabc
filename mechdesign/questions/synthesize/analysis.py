"""Which linkages do it? Solutions of a task, judged, ranked, and each written as a study."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mechdesign.ground.errors import AssemblyError, StudyError
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.progress import NULL, Progress
from mechdesign.ground.results import Drawn, Result, Table
from mechdesign.ground.work.threads import one_thread
from mechdesign.questions.synthesize.columns import SOLUTIONS
from mechdesign.questions.synthesize.files import judged_share, study_data, study_text
from mechdesign.questions.synthesize.solutions import Conditions, Pool, Solution, distinct, ranked, rounded
from mechdesign.questions.synthesize.tasks import Task, task_of
from mechdesign.study import Study
from mechdesign.study.loading import load_data


@dataclass(frozen=True, eq=False)
class DrawnSolutions(Drawn):
    """The task and its solutions."""

    asked: Study  # with the task
    task: Task
    solutions: tuple[Solution, ...]

    @cached_property
    def study(self) -> Study:
        """That of the best."""
        return load_data(
            study_data(self.asked, self.task, self.solutions[0], self.asked.name), (), None, self.asked.folder
        )

    @property
    def errors(self) -> Floats:
        """Errors of the solutions in the study's unit, 0 where they are rounding."""
        errors = [rounded(solution.error, self.task.size) for solution in self.solutions]
        return np.array(errors) / self.task.error_factor


@one_thread()
def synthesize(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Result:
    """Find linkages that do a task; see `mechdesign.synthesize`."""
    section = study.synthesis
    if section is None:
        raise StudyError((study.problem("there is no task", "synthesis"),))
    own = study.seed if seed is None else seed
    random = np.random.default_rng(own if section.seed is None or seed is not None else section.seed)
    task = task_of(study, section)
    conditions = Conditions(section, task.centre, task.size, task.factor)
    with np.errstate(all="ignore"):
        pools = [*task.pools(random, conditions)]
        solutions = distinct([solution for pool in pools for solution in conditions.solutions(pool)], task.size)
        if section.judge is not None:
            solutions = _judged(study, task, solutions[: section.judge.best])
        solutions, scores = ranked(solutions, section.rank, task.size)
    told = [*conditions.told, *_told(pools, solutions, conditions)]
    if not solutions:
        raise _none(study, task, pools, conditions, told)
    solutions, scores = solutions[: section.solutions], scores[: section.solutions]
    files = {
        f"solution_{number}.yaml": study_text(
            study_data(study, task, solution, f"{study.name}, solution {number}"),
            f"Solution {number} of {study.name}: {solution.kind.name.replace('_', ' ')}",
        )
        for number, solution in enumerate(solutions, 1)
    }
    table = solutions_table(study, task, solutions, scores)
    counts = {"linkages": sum(len(pool.way) for pool in pools), "kept": len(solutions)}
    drawn = DrawnSolutions(study, task, tuple(solutions))
    return Result("synthesize", {table.name: table}, counts=counts, files=files, drawn=drawn, notes=told)


def _judged(study: Study, task: Task, solutions: Sequence[Solution]) -> list[Solution]:
    """Solutions with their yields."""
    return [
        replace(solution, share=judged_share(study, study_data(study, task, solution, study.name)))
        for solution in solutions
    ]


def _told(pools: Sequence[Pool], solutions: Sequence[Solution], conditions: Conditions) -> list[str]:
    """How many linkages there were, and what became of them."""
    count, whole = sum(len(pool.way) for pool in pools), sum(not solution.defects for solution in solutions)
    words = [f"{count} linkages, {len(solutions)} of them keep the conditions, {whole} without a defect"]
    return words + [
        f"{lost} {what} dropped: {reason}" for (what, reason), lost in conditions.dropped.most_common() if lost
    ]


def _none(
    study: Study, task: Task, pools: Sequence[Pool], conditions: Conditions, told: Sequence[str]
) -> AssemblyError:
    """Why there is no solution, with the linkage that comes nearest where there is one."""
    words = "no linkage does it: " + "; ".join(told)
    every = [(reasons, pool.solution(row)) for pool in pools for row, reasons in enumerate(conditions.missed(pool))]
    if not every:
        return AssemblyError(words)
    # It misses the fewest conditions; of several it has the smallest error, then the best transmission.
    reasons, solution = min(
        every, key=lambda one: (len(one[0]), rounded(one[1].error, task.size), -one[1].transmission)
    )
    missed = "; ".join(reasons)
    message = f"{words}; the nearest is in nearest.yaml: {missed}"
    data = study_data(study, task, solution, f"{study.name}, nearest")
    table = solutions_table(study, task, [solution], [np.nan])
    files = {"nearest.yaml": study_text(data, f"Nearest to {study.name}: {missed}")}
    return AssemblyError(message, Result("synthesize", {table.name: table}, failed=message, files=files))


def solutions_table(study: Study, task: Task, solutions: Sequence[Solution], scores: Sequence[float]) -> Table:
    """A row a linkage."""
    labels, unit = study.units.labels, task.error_factor
    error = labels["length"] if task.error_factor == 1.0 else labels["angle"]
    columns = SOLUTIONS.columns(
        {**labels, "as the task": error},
        solution=np.arange(1, len(solutions) + 1), kind=np.array([one.kind.name for one in solutions]),
        error=np.array([one.error / unit for one in solutions]),
        max_error=np.array([one.errors.max() / unit for one in solutions]),
        defects=np.array([one.defects for one in solutions]),
        **{"class": np.array([one.grashof for one in solutions])},
        full_turn=np.array([one.full_turn for one in solutions]).astype(int),
        transmission_angle=np.array([one.transmission for one in solutions]) / task.factor,
        size=np.array([one.size for one in solutions]),
    )  # fmt: skip
    if task.section.judge is not None:
        shares = np.array([one.share for one in solutions]).T
        columns += SOLUTIONS.columns({}, **dict(zip(("yield", "yield_low", "yield_high"), shares, strict=True)))
    columns += SOLUTIONS.columns({}, score=np.array(scores))
    places = {
        place: declared.quantity for one in solutions
        for place, declared in one.kind.mechanism.description.places.items() if place not in task.apart
    }  # fmt: skip
    for place, quantity in places.items():
        values = np.array([one.values[one.kind[place]] if place in one.kind.places else np.nan for one in solutions])
        values = values / task.factor if quantity == "angle" else values
        columns.append(SOLUTIONS["<dimension>"].column(values, labels[quantity], dimension=place))
    return SOLUTIONS.table(columns)
