"""The reliability question: error moments, reliability and contributions, analytically and by simulation."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import Interrupted, StudyError
from mechdesign.ground.progress import NULL, Progress
from mechdesign.ground.results import Result, Table
from mechdesign.ground.terms import command_of
from mechdesign.ground.work.threads import keep_freed_memory, one_thread
from mechdesign.motion.failures import failures
from mechdesign.motion.motion import SolvedPoses
from mechdesign.motion.question import evaluate
from mechdesign.motion.rows import Poses
from mechdesign.questions.dynamics.assumed import assumed
from mechdesign.questions.poses import study_poses
from mechdesign.questions.reliability import methods, sobol, tables
from mechdesign.questions.reliability.allocated import of_allocation
from mechdesign.questions.reliability.allocation import allocate
from mechdesign.questions.reliability.between import between_poses, places_between
from mechdesign.questions.reliability.cycle import with_cycle
from mechdesign.questions.reliability.drawn import drawn_errors
from mechdesign.questions.reliability.errors import Errors, first_order, linear_task
from mechdesign.questions.reliability.forces import kinds_of_forces
from mechdesign.questions.reliability.method_warnings import method_warnings
from mechdesign.questions.reliability.question import ambiguous_points
from mechdesign.questions.reliability.schema.methods import METHODS
from mechdesign.questions.reliability.schema.section import ReliabilitySection
from mechdesign.questions.reliability.simulation import Setting, forward_plan
from mechdesign.questions.reliability.sobol import SobolIndices
from mechdesign.questions.reliability.task import MAX_SAMPLES, MethodResult, Partial, Task
from mechdesign.study import Study

# Number of listed poses that have a density.
_DENSITIES = 12


@one_thread()
def reliability(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Result:
    """Errors of a study's outputs from its tolerances and clearances; see `mechdesign.reliability`."""
    keep_freed_memory()
    poses, section, solved = study_poses(study, "reliability"), ReliabilitySection.of(study), list[SolvedPoses]()
    errors = Errors.of(study, poses)
    values = evaluate(errors, also=solved.append)
    task = linear_task(values)
    warnings = [*errors.doubts, *ambiguous_points(study, task.question)]
    closer = places_between(study, task.question, poses) if task.question.limits else None
    if closer is not None:
        warnings += between_poses(task, first_order(errors.at(closer)))
    if kinds_of_forces(study):
        warnings += assumed(study)
    failed_poses, failed = failures(study.motion(poses), task.reason)
    task = replace(
        task, settings=_settings(task, errors, solved), seed=study.seed if seed is None else seed,
        samples=section.samples, most=section.samples if "samples" in section.model_fields_set else MAX_SAMPLES,
        precision=section.precision or task.precision, jobs=jobs, progress=progress,
    )  # fmt: skip
    results, stopped = list[MethodResult](), False
    indices: dict[int, SobolIndices] = {}
    allocated, made = Result("allocation", {}), dict[str, Table]()
    try:
        for method in section.methods:
            results.append(with_cycle(methods.run(method, task), task, results))
        indices = sobol.indices(task, section)
        allocated, own = allocate(task, section)
        if own is not None and _judges_errors(study):
            made = dict(reliability(own, seed=task.seed, jobs=jobs, progress=progress).tables)
    except KeyboardInterrupt as stop:
        results += [stop.result] if isinstance(stop, Partial) else []
        if not results:
            raise
        stopped = True
    done = [sums for result in results for sums in result.sums.values()]
    samples, invalid = sum(sums.samples for sums in done), sum(sums.samples - sums.valid for sums in done)
    cycles = next((part.cycle.samples for part in results if part.cycle is not None and part.cycle.samples), 0)
    counts = {"poses": poses.count} | ({"samples": samples, "invalid": invalid} if done else {})
    counts |= {"cycles": cycles} if cycles else {}
    if invalid:
        words = f"{invalid} of {samples} samples cannot be assembled; they count as failures"
        failed_poses.append(Caution("unassembled", words))
    named = f"{f'{cycles} whole cycles, ' * bool(cycles)}{', '.join(part.method for part in results)}"
    # Samples of the first method that samples the errors.
    sampled = next((part.sums for part in results if part.sums), {})
    built = [*tables.judged(task, results, indices), *tables.of_drawn(task, sampled)]
    result = Result(
        "reliability", study.motion(poses).of_poses(built, task.reason) | dict(allocated.tables),
        [*warnings, *method_warnings(results, task), *sobol.doubts(task, indices), *failed_poses, *allocated.warnings],
        counts, "; ".join(filter(None, (failed, allocated.failed))), allocated.files,
        f"interrupted: {samples} samples, {named}" if stopped else "",
        drawn_errors(task, values, sampled), reached=bool(failed) or not allocated.failed, allocated=made,
    )  # fmt: skip
    if stopped:
        raise Interrupted(result)
    return result


def _judges_errors(study: Study) -> bool:
    """Whether requirements of a study judge its reliability, and not its allocation alone."""
    results = [requirement.result for requirement in study.requirements]
    return any(command_of(name) == "reliability" and not of_allocation(name) for name in results)


def first_order_tables(
    study: Study, poses: Poses, names: Collection[str]
) -> tuple[dict[str, Table], NDArray[np.int8], list[SolvedPoses]]:
    """The tables `names` of the first-order analysis at poses of one or several designs.

    Returns them, why poses fail, and the solved poses.

    Raises
    ------
    StudyError
        If nothing varies.
    """
    parts: list[SolvedPoses] = []
    task = first_order(Errors.of(study, poses), parts.append)
    results = [MethodResult(normal=(task.linear.whole.shift(), task.linear.whole.covariance()), method="analytic")]
    if "reliability" in names:
        results = [with_cycle(methods.run("analytic", task), task, ())]
    return {table.name: table for table in tables.judged(task, results, {}, names)}, task.reason, parts


def _settings(task: Task, errors: Errors, parts: Sequence[SolvedPoses]) -> list[Setting]:
    """Settings of the poses that can be assembled, in their order."""
    mechanism, pair = task.study.mechanism, task.question.pair
    mean, sigma = task.linear.shift(), task.linear.deviation()
    assembled = np.flatnonzero(task.assembled).tolist()
    followed, forces = _followed(task), errors.forces
    whole = task.question.whole
    settings = []
    for solved in parts:
        rates, by_drives = errors.rates(solved), set(solved.names) == set(mechanism.drives)
        for k, row in enumerate(solved.rows.tolist()):
            if not task.assembled[row]:
                continue
            pose = solved.configuration.take(k)
            scale = None
            if pair is not None and task.poses.listed and row in (*assembled[:_DENSITIES], followed):
                x, y = ((float(mean[channel, row]), float(sigma[channel, row])) for channel in pair)
                scale = (x, y) if x[1] > 0 and y[1] > 0 else None
            settings.append(
                Setting(
                    task.question.take(row).at(task.nominal[:, row]), row, mechanism,
                    mechanism.forward if by_drives else forward_plan(mechanism, pose), pose, rates.take(k),
                    task.nominal[:, row].tolist(),
                    None if task.elastic is None else task.elastic.take([row]).of(whole, task.question.vectors),
                    None if forces is None else forces.take([row]), scale, row == followed,
                )
            )  # fmt: skip
    return sorted(settings, key=lambda setting: setting.pose)


def _followed(task: Task) -> int:
    """The pose whose samples are kept: the study's `shown`, else the one that fails most often by the first order.

    Without limits the first one; -1 where no pose can be assembled.
    """
    section, assembled = ReliabilitySection.of(task.study), np.flatnonzero(task.assembled)
    if section.shown is not None:
        if section.shown - 1 not in assembled:
            count = len(task.assembled)
            why = f"there are only {count} poses" if section.shown > count else "this pose cannot be assembled"
            raise StudyError((task.study.problem(f"{why}; choose another", "reliability", "shown"),))
        return section.shown - 1
    if not task.question.limits or len(assembled) < 2 or not any(METHODS[name].sampled for name in section.methods):
        return int(assembled[0]) if len(assembled) else -1
    estimates = methods.run("analytic", task).estimates
    return max(estimates, key=lambda pose: np.nan_to_num(estimates[pose].failure))
