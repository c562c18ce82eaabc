"""Which linkages do it? Solutions of a task, judged, ranked, and each written as a study."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechdesign.ground.errors import AssemblyError, StudyError, counted
from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.ground.progress import NULL, Progress
from mechdesign.ground.results import Drawn, Result, Table
from mechdesign.ground.work.threads import one_thread
from mechdesign.questions.synthesize.columns import CENTRE_POINTS, SOLUTIONS
from mechdesign.questions.synthesize.curves import centre_points
from mechdesign.questions.synthesize.files import judged, study_data, study_files
from mechdesign.questions.synthesize.solutions import Conditions, Linkages, Solution, clear, distinct, ranked, rounded
from mechdesign.questions.synthesize.tasks import BodyGuidance, Task, task_of
from mechdesign.questions.synthesize.words import faults, linkage
from mechdesign.study import Study
from mechdesign.study.loading import load_data
from mechdesign.study.text.inputs import Folder

FOUND = "Found by synthesize as"  # how the comment begins under which the study of a linkage stands


@dataclass(frozen=True, eq=False)
class DrawnSolutions(Drawn):
    """The solutions as studies, best first, whose sketches are at the first position, and the task."""

    data: tuple[Mapping[str, Any], ...]  # of the studies
    folder: Folder
    output: str  # the point, or the coordinate, that does the task
    places: Complexes  # of the point at the positions; empty of a coordinate
    directions: Complexes  # of the body there; empty of a point
    errors: Floats  # in the study's unit, 0 where they are rounding

    def linkage(self, row: int) -> Study:
        """The study of a solution."""
        return load_data(self.data[row], (), None, self.folder)

    @property
    def study(self) -> Study:
        """That of the best."""
        return self.linkage(0)


@one_thread()
def synthesize(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Result:
    """Find linkages that do a task; see `mechdesign.synthesize`."""
    section = study.synthesis
    if section is None:
        message = "is missing: say what linkages shall do, for example {path: {points: [[0, 0], [40, 25], [80, 0]]}}"
        raise StudyError((study.problem(message, "synthesis"),))
    if seed is None:
        seed = study.seed if section.seed is None else section.seed
    random = np.random.default_rng(seed)
    task = task_of(study, section)
    conditions = Conditions(section, task.centre, task.size, task.factor, progress)
    pools = [*_pools(task, random, conditions, progress)]
    solutions = distinct([solution for pool in pools for solution in conditions.solutions(pool)], task.size)
    told = [*conditions.told, *_told(pools, solutions, conditions, seed)]
    if section.judge is not None:
        best = solutions[: section.judge.best]
        progress.start(len(best), "linkages judged")
        solutions = []
        for one in best:
            solutions.append(replace(one, made=judged(study, study_data(study, task, one, study.name))))
            progress.update(1)
        told.append(f"the best {len(solutions)} are judged" if len(solutions) != 1 else "the best is judged")
    solutions, scores = ranked(solutions, section.rank, task.size, section.solutions)
    if not solutions:
        raise _none(study, task, pools, conditions, told)
    result = _answer(study, task, solutions, scores, told)
    counts = {"linkages": sum(len(pool.way) for pool in pools), "kept": len(result.main)}
    return replace(result, counts=counts)


def _pools(task: Task, random: np.random.Generator, conditions: Conditions, progress: Progress) -> Iterator[Linkages]:
    """Linkages of every kind and assembly, one after the other; between two a search may be ended."""
    progress.start(1, "linkages looked for")
    for pool in task.pools(random, conditions):
        progress.update(0)
        yield pool


def _answer(
    study: Study, task: Task, solutions: Sequence[Solution], scores: Sequence[float], told: Sequence[str],
    missed: str = "",
) -> Result:  # fmt: skip
    """The answer that some solutions are, best first; or the one that comes nearest, with what it has `missed`."""
    table = solutions_table(study, task, solutions, scores[: len(solutions)])
    unit = task.error_factor
    errors = np.array([clear(solution.error, task.size) / unit for solution in solutions])
    words = [", ".join(linkage(table, row, float(error))) for row, error in enumerate(errors)]
    data, files = [], dict[str, str]()
    for number, solution in enumerate(solutions, 1):
        name = "nearest" if missed else f"solution {number}"
        file = f"{name.replace(' ', '_')}.yaml"
        fault = "; ".join(faults(solution.defects, solution.elsewhere))
        # It stays true where a hand changes the file, and names no file.
        heading = [f"{FOUND} {name} of {study.name}: {words[number - 1]}",
                   *([f"It missed: {missed}"] if missed else []),
                   *([f"In its assembly it did not move through its task: {fault}"] if fault else [])]  # fmt: skip
        data.append(study_data(study, task, solution, f"{study.name}, {name}"))
        files |= study_files(file, solution.kind, data[-1], heading)
    drawn = DrawnSolutions(
        tuple(data), study.folder, task.targets(solutions[0])[0], task.points, task.directions, errors
    )
    notes = [f"{'nearest' if missed else 'best'}: {words[0]}", *told]
    tables = {table.name: table, **curve_tables(study, task)}
    return Result("synthesize", tables, files=files, drawn=drawn, notes=notes)


def _told(pools: Sequence[Linkages], solutions: Sequence[Solution], conditions: Conditions, seed: int) -> list[str]:
    """How many linkages there were, what became of them, and the seed."""
    count, whole = sum(len(pool.way) for pool in pools), sum(not solution.defects for solution in solutions)
    told = [f"{len(solutions)} of {counted(count, 'linkage')} within the conditions, {whole} without a defect"]
    lost = [
        f"{counted(number, what)} as {reason}" for (what, reason), number in conditions.dropped.most_common() if number
    ]
    return [*told, *([f"dropped: {'; '.join(lost)}"] if lost else []), f"seed {seed}"]


def _none(
    study: Study, task: Task, pools: Sequence[Linkages], conditions: Conditions, told: Sequence[str]
) -> AssemblyError:
    """Why there is no solution, with the linkage that comes nearest where there is one."""
    every = [(reasons, pool.solution(row)) for pool in pools for row, reasons in enumerate(conditions.missed(pool))]
    if not every:
        return AssemblyError("\n".join(("no linkage does it", *told)))
    # It misses the fewest conditions; of several it has the smallest error, then the best transmission.
    reasons, solution = min(
        every, key=lambda one: (len(one[0]), rounded(one[1].error, task.size), -one[1].transmission)
    )
    missed = "; ".join(reasons)
    result = _answer(study, task, [solution], [np.nan], told, missed)
    message = f"no linkage does it; the nearest is in nearest.yaml: {missed}"
    return AssemblyError("\n".join((message, *result.notes)), replace(result, failed=message))


def solutions_table(study: Study, task: Task, solutions: Sequence[Solution], scores: Sequence[float]) -> Table:
    """A row a linkage."""
    labels, unit = study.units.labels, task.error_factor
    error = labels["length"] if task.error_factor == 1.0 else labels["angle"]
    columns = SOLUTIONS.columns(
        {**labels, "as the task": error},
        solution=np.arange(1, len(solutions) + 1), kind=np.array([one.kind.name for one in solutions]),
        error=np.array([one.error / unit for one in solutions]),
        max_error=np.array([one.max_error / unit for one in solutions]),
        defects=np.array([one.defects for one in solutions]),
        **{"class": np.array([one.grashof for one in solutions])},
        full_turn=np.array([one.full_turn for one in solutions]).astype(int),
        transmission_angle=np.array([one.transmission for one in solutions]) / task.factor,
        size=np.array([one.size for one in solutions]),
    )  # fmt: skip
    judge, made = task.section.judge, np.array([one.made for one in solutions]).T
    if judge is not None and judge.within is not None:
        columns += SOLUTIONS.columns({}, **dict(zip(("yield", "yield_low", "yield_high"), made[:3], strict=True)))
    if judge is not None and judge.loads:
        columns += SOLUTIONS.columns(labels, peak_effort=made[3])
    columns += SOLUTIONS.columns({}, score=np.array(scores))
    kinds = {place: one.kind for one in solutions for place in one.kind.places if place not in task.apart}
    written = [dict(zip(one.kind.places, one.kind.written(one.values, task.factor), strict=True)) for one in solutions]
    for place, kind in kinds.items():
        values = np.array([own.get(place, np.nan) for own in written])
        columns.append(SOLUTIONS["<dimension>"].column(values, kind.unit_of(place, study.units), dimension=place))
    return SOLUTIONS.table(columns)


def curve_tables(study: Study, task: Task) -> dict[str, Table]:
    """The links of four positions of a body along the curve of their pivots; empty for other tasks."""
    if not isinstance(task, BodyGuidance) or len(task.positions.places) != 4 or task.positions.shifts:
        return {}
    parts = centre_points(task.positions, task.section.limits.reach * task.size)
    columns = CENTRE_POINTS.columns(
        study.units.labels, curve=np.repeat(np.arange(1, len(parts) + 1), [len(part) for part in parts]),
        **{f"{name}.{way}": np.concatenate([getattr(getattr(part, field), side) for part in parts] or [np.empty(0)])
           for name, field in (("centre", "pivot"), ("circle", "pin")) for way, side in (("x", "real"), ("y", "imag"))},
        length=np.concatenate([part.length for part in parts] or [np.empty(0)]),
    )  # fmt: skip
    return {CENTRE_POINTS.name: CENTRE_POINTS.table(columns)}
