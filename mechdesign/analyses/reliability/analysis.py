"""How precise is it when it is made? Error moments, reliability and contributions, analytically and by simulation."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.kinematics.rates import DriveRates, drive_rates
from mechdesign.analyses.poses import SolvedPoses, judge_failures, solve_poses, study_poses
from mechdesign.analyses.reliability import methods, sobol, tables
from mechdesign.analyses.reliability.allocation import allocate
from mechdesign.analyses.reliability.cycle import with_cycle
from mechdesign.analyses.reliability.deflection import Elastic, elasticity, unknown
from mechdesign.analyses.reliability.engine.problem import Precision
from mechdesign.analyses.reliability.first_order import FirstOrder, linear_errors, nominal_values
from mechdesign.analyses.reliability.notes import notes
from mechdesign.analyses.reliability.question import ask, unsaid
from mechdesign.analyses.reliability.simulation import Setting, forward_plan
from mechdesign.analyses.reliability.sobol import SobolIndices
from mechdesign.analyses.reliability.sources import Sources, find_sources
from mechdesign.analyses.reliability.task import MAX_SAMPLES, MethodResult, Partial, Task
from mechdesign.errors import Interrupted
from mechdesign.mechanism import Reason
from mechdesign.parallel import keep_freed_memory
from mechdesign.progress import NULL, Progress
from mechdesign.results import Result, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses
from mechdesign.threads import one_thread

# Poses whose sensitivities are computed together.
_POSES_TOGETHER = 2048
# Listed poses that get a density of their own.
_DENSITIES = 12
# Poses that give the same coordinates, and the rates of their drives.
_Groups = Sequence[tuple[SolvedPoses, DriveRates]]


@one_thread()
def reliability(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Result:
    """Errors of a study's outputs from its tolerances and clearances.

    Parameters
    ----------
    study : Study
    seed : int, optional
        In place of the study's.
    jobs : int or None
        Threads; the result does not depend on it.

    Returns
    -------
    Result
        Tables ``moments``, ``reliability`` (where there are limits) and ``contributions``; of methods that sample the
        errors ``density`` (of two outputs), ``histogram``, ``convergence`` and ``estimate`` (where there are limits);
        where tolerances are allocated ``allocation`` and ``confirmation``, and the study ``allocated.yaml`` that has
        them.

    Raises
    ------
    StudyError
        If nothing varies.
    AssemblyError
        If no pose at all can be assembled.
    Interrupted
        On Ctrl-C, with what was found so far.
    """
    keep_freed_memory()
    sources, warnings = find_sources(study)
    section = study.reliability
    assert section is not None
    task, groups, doubts = _first_order(study, study_poses(study, "reliability"), sources)
    poses = task.poses
    warnings += [*doubts, *unsaid(study, task.question)]
    failures, failed = judge_failures(study, poses, task.reason)
    task = replace(
        task, settings=_settings(task, groups), seed=study.seed if seed is None else seed, samples=section.samples,
        most=section.samples if "samples" in section.model_fields_set else MAX_SAMPLES, jobs=jobs, progress=progress,
    )  # fmt: skip
    if section.precision is not None:
        task = replace(task, precision=Precision(section.precision.relative, section.precision.half_width))
    found: list[MethodResult] = []
    interrupted = ""
    indices: dict[int, SobolIndices] = {}
    allocated = Result("allocation", {})
    try:
        for method in section.methods:
            found.append(with_cycle(methods.run(method, task), task, found))
        indices = sobol.indices(task, section)
        allocated = allocate(task, section)
    except Partial as partial:
        found.append(partial.found)
        interrupted = "interrupted: "
    except KeyboardInterrupt:
        if not found:
            raise
        interrupted = "interrupted: "
    counts = {"poses": poses.count}
    done = [sums for each in found for sums in each.sums.values()]
    if done:
        counts["samples"] = sum(sums.samples for sums in done)
        counts["invalid"] = sum(sums.samples - sums.valid for sums in done)
        if counts["invalid"]:
            failures.append(
                f"{counts['invalid']} of {counts['samples']} samples cannot be assembled; they count as failures"
            )
    cycles = [each.cycle.samples for each in found if each.cycle is not None and each.cycle.samples]
    if cycles:
        counts["cycles"] = cycles[0]
    if interrupted:
        interrupted += f"{counts.get('samples', 0)} samples, "
        interrupted += f"{counts['cycles']} whole cycles, " if cycles else ""
        interrupted += f"{', '.join(each.method for each in found)}"
    made = [tables.moments(task, found), *([tables.success(task, found)] if task.question.limited else ())]
    made += [tables.contributions(task, indices)]
    # Of the first method that samples the errors.
    made += tables.of_drawn(task, next((each.sums for each in found if each.sums), {}))
    result = Result(
        "reliability", {table.name: table for table in made} | dict(allocated.tables),
        [*warnings, *notes(found, task), *sobol.doubts(task, indices), *failures, *allocated.warnings], counts,
        "; ".join(filter(None, (failed, allocated.failed))), allocated.files, interrupted,
        {"poses": poses},
    )  # fmt: skip
    if interrupted:
        raise Interrupted(result)
    return result


def first_order_tables(
    study: Study, poses: Poses, wanted: Collection[str]
) -> tuple[dict[str, Table], NDArray[np.int8]]:
    """Wanted tables of the first-order analysis at poses, perhaps of several designs, and why poses fail.

    Raises
    ------
    StudyError
        If nothing varies.
    """
    task, _, _ = _first_order(study, poses, find_sources(study)[0])
    found = [methods.run("analytic", task)]
    made = [tables.moments(task, found)] if "moments" in wanted else []
    if "reliability" in wanted and task.question.limited:
        made.append(tables.success(task, found))
    if "contributions" in wanted:
        made.append(tables.contributions(task, {}))
    return {table.name: table for table in made}, task.reason


def _first_order(study: Study, poses: Poses, sources: Sources) -> tuple[Task, _Groups, list[str]]:
    """The nominal mechanism and its linear error model at every pose, nan where it is not assembled; what is doubtful.

    Poses that do not hold the study's load are marked.
    """
    mechanism, section = study.mechanism, study.reliability
    assert section is not None
    question = ask(study, section)
    bent, doubts = elasticity(study)
    channels = question.channels
    reason = np.zeros(poses.count, dtype=np.int8)
    nominal = np.full((len(channels), poses.count), np.nan)
    elastic = None if bent is None else Elastic(np.full((len(channels), 3, poses.count), np.nan), bent.load)
    linear = FirstOrder.unknown(sources, len(channels), poses.count)
    groups = []
    for solved in solve_poses(study, poses, [channel.coordinate for channel in channels]):
        configuration, rows = solved.configuration, solved.rows
        reason[rows] = configuration.reason
        rates = DriveRates((), ())
        if any(channel.order for channel in channels):
            # Held for made mechanisms too.
            rates = drive_rates(study, section, poses, solved, mechanism.linearize(configuration))
        for row, value in zip(nominal, nominal_values(mechanism, configuration, channels, rates), strict=True):
            row[rows] = value
        for begin in range(0, len(rows), _POSES_TOGETHER):
            block = np.arange(begin, min(begin + _POSES_TOGETHER, len(rows)))
            part, here = configuration.take(block), None
            if bent is not None and elastic is not None:
                here = bent.at(part, channels)
                elastic.flexibility[:, :, rows[block]] = here.flexibility
            with np.errstate(invalid="ignore", divide="ignore"):
                found = linear_errors(mechanism, part, channels, sources, rates.take(block), here)
            linear.components[:, :, rows[block]] = found.components
        groups.append((solved, rates))
    if bent is not None and elastic is not None:
        doubts += unknown(bent, channels)
        reason = np.where(np.isin(reason, (Reason.OK, Reason.LIMIT)) & ~elastic.held, np.int8(Reason.NOT_HELD), reason)
        linear = replace(linear, offset=elastic.offset)
    task = Task(study, poses, question, sources, reason, nominal, linear, elastic)
    linear.components[:, :, ~task.assembled] = np.nan
    return task, groups, doubts


def _settings(task: Task, groups: _Groups) -> list[Setting]:
    """Poses that can be assembled, in their order."""
    mechanism, pair = task.study.mechanism, task.question.pair
    mean, sigma = task.linear.shift(), task.linear.deviation()
    assembled = np.flatnonzero(task.assembled).tolist()
    settings = []
    for solved, rates in groups:
        given = set(solved.given) == set(mechanism.drives)
        for k, row in enumerate(solved.rows.tolist()):
            if not task.assembled[row]:
                continue
            pose = solved.configuration.take(k)
            scale = None
            if pair is not None and task.poses.listed and row in assembled[:_DENSITIES]:
                one, two = ((float(mean[channel, row]), float(sigma[channel, row])) for channel in pair)
                scale = (one, two) if one[1] > 0 and two[1] > 0 else None
            settings.append(
                Setting(
                    task.question, row, mechanism, mechanism.forward if given else forward_plan(mechanism, pose), pose,
                    rates.take(k), task.nominal[:, row].tolist(),
                    None if task.elastic is None else task.elastic.take([row]), scale, row == assembled[0],
                )
            )  # fmt: skip
    return sorted(settings, key=lambda setting: setting.pose)
