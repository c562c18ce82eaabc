"""The reliability question: error moments, reliability and contributions, analytically and by simulation."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mechdesign.cautions import Caution
from mechdesign.errors import Interrupted, StudyError
from mechdesign.mechanism import Reason
from mechdesign.motion.motion import SolvedPoses
from mechdesign.motion.rows import Poses
from mechdesign.motion.solving import solve_poses
from mechdesign.progress import NULL, Progress
from mechdesign.questions.dynamics.assumed import assumed
from mechdesign.questions.kinematics.rates import DriveRates, drive_rates
from mechdesign.questions.poses import study_poses
from mechdesign.questions.reliability import methods, sobol, tables
from mechdesign.questions.reliability.allocation import allocate
from mechdesign.questions.reliability.between import between_poses, places_between
from mechdesign.questions.reliability.cycle import with_cycle
from mechdesign.questions.reliability.deflection import Elastic, cautions, elasticity
from mechdesign.questions.reliability.first_order import FirstOrder, linear_errors, linear_margins, nominal_values
from mechdesign.questions.reliability.forces import force_model, kinds_of_forces, pace
from mechdesign.questions.reliability.lengths import model_of
from mechdesign.questions.reliability.method_warnings import method_warnings
from mechdesign.questions.reliability.question import ambiguous_points, ask
from mechdesign.questions.reliability.schema.methods import METHODS
from mechdesign.questions.reliability.schema.section import ReliabilitySection
from mechdesign.questions.reliability.simulation import Setting, forward_plan
from mechdesign.questions.reliability.sobol import SobolIndices
from mechdesign.questions.reliability.sources import Sources
from mechdesign.questions.reliability.study_sources import find_sources
from mechdesign.questions.reliability.task import MAX_SAMPLES, MethodResult, Partial, Task
from mechdesign.results import Result, Table
from mechdesign.study import Study
from mechdesign.work.threads import keep_freed_memory, one_thread

# Poses whose sensitivities are computed together.
_POSES_TOGETHER = 2048
# Number of listed poses that have a density.
_DENSITIES = 12
# Poses that give the same coordinates, and the rates of their drives.
_Groups = Sequence[tuple[SolvedPoses, DriveRates]]


@one_thread()
def reliability(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Result:
    """Errors of a study's outputs from its tolerances and clearances; see `mechdesign.reliability`."""
    keep_freed_memory()
    poses = study_poses(study, "reliability")
    sources, warnings = find_sources(study)
    section = ReliabilitySection.of(study)
    task, groups, doubts = _first_order(study, poses, sources)
    warnings += [*doubts, *ambiguous_points(study, task.question)]
    closer = places_between(study, task.question, poses) if task.question.limited else None
    if closer is not None:
        warnings += between_poses(task, _first_order(study, closer, sources)[0])
    if kinds_of_forces(study):
        warnings += assumed(study)
    failures, failed = study.motion(poses).failures(task.reason)
    task = replace(
        task, settings=_settings(task, groups), seed=study.seed if seed is None else seed, samples=section.samples,
        most=section.samples if "samples" in section.model_fields_set else MAX_SAMPLES, jobs=jobs, progress=progress,
    )  # fmt: skip
    if section.precision is not None:
        task = replace(task, precision=section.precision)
    results: list[MethodResult] = []
    interrupted = ""
    indices: dict[int, SobolIndices] = {}
    allocated = Result("allocation", {})
    try:
        for method in section.methods:
            results.append(with_cycle(methods.run(method, task), task, results))
        indices = sobol.indices(task, section)
        allocated = allocate(task, section)
    except Partial as partial:
        results.append(partial.result)
        interrupted = "interrupted: "
    except KeyboardInterrupt:
        if not results:
            raise
        interrupted = "interrupted: "
    counts = {"poses": poses.count}
    done = [sums for result in results for sums in result.sums.values()]
    if done:
        counts["samples"] = sum(sums.samples for sums in done)
        counts["invalid"] = sum(sums.samples - sums.valid for sums in done)
        if counts["invalid"]:
            words = f"{counts['invalid']} of {counts['samples']} samples cannot be assembled; they count as failures"
            failures.append(Caution("unassembled", words))
    cycles = [part.cycle.samples for part in results if part.cycle is not None and part.cycle.samples]
    if cycles:
        counts["cycles"] = cycles[0]
    if interrupted:
        interrupted += f"{counts.get('samples', 0)} samples, "
        interrupted += f"{counts['cycles']} whole cycles, " if cycles else ""
        interrupted += f"{', '.join(part.method for part in results)}"
    built = [tables.moments(task, results)]
    if task.question.limited:
        built += [tables.success(task, results), tables.capability(task, results)]
    built += [tables.contributions(task, indices)]
    # Samples of the first method that samples the errors.
    sampled = next((part.sums for part in results if part.sums), {})
    built += tables.of_drawn(task, sampled)
    result = Result(
        "reliability", study.motion(poses).of_poses(built, task.reason) | dict(allocated.tables),
        [*warnings, *method_warnings(results, task), *sobol.doubts(task, indices), *failures, *allocated.warnings],
        counts, "; ".join(filter(None, (failed, allocated.failed))), allocated.files, interrupted,
        tables.DrawnErrors(poses, tables.drawn_samples(task, sampled)), reached=bool(failed) or not allocated.failed,
    )  # fmt: skip
    if interrupted:
        raise Interrupted(result)
    return result


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
    task, groups, _ = _first_order(study, poses, find_sources(study, poses)[0])
    results = [MethodResult(normal=(task.linear.whole.shift(), task.linear.whole.covariance()), method="analytic")]
    if "reliability" in names:
        results = [with_cycle(methods.run("analytic", task), task, ())]
    built = [tables.moments(task, results)] if "moments" in names else []
    if "reliability" in names and task.question.limited:
        built.append(tables.success(task, results))
    if "capability" in names and task.question.limited:
        built.append(tables.capability(task, results))
    if "contributions" in names:
        built.append(tables.contributions(task, {}))
    return {table.name: table for table in built}, task.reason, [solved for solved, _ in groups]


def _first_order(study: Study, poses: Poses, sources: Sources) -> tuple[Task, _Groups, list[Caution]]:
    """The nominal mechanism and its linear error model at every pose, nan where it is not assembled; warnings.

    Poses that do not hold the study's load, or of whose forces some are asked and not finite, are `NOT_HELD`.
    """
    mechanism, section = study.mechanism, ReliabilitySection.of(study)
    question = ask(study, poses.section(section))
    bent, doubts = elasticity(study, poses)
    channels, forces = question.whole, force_model(study, poses)
    coordinates = [*question.coordinates, *(forces.coordinates if forces is not None else ())]
    reason = np.zeros(poses.count, dtype=np.int8)
    nominal = np.full((len(channels), poses.count), np.nan)
    elastic = None if bent is None else Elastic(np.full((len(channels), 3, poses.count), np.nan), bent.load)
    linear = FirstOrder.unknown(sources, len(channels), poses.count)
    closing = FirstOrder.unknown(sources, 0, poses.count)
    groups = []
    for solved in solve_poses(study.motion(poses), coordinates):
        configuration, rows = solved.configuration, solved.rows
        reason[rows] = configuration.reason
        rates = DriveRates((), ())
        if question.moving:
            # Made mechanisms have the same rates of the drives.
            rates = drive_rates(pace(study), solved, mechanism.linearize(configuration))
        own = None if forces is None else forces.take(rows)
        for row, value in zip(nominal, nominal_values(mechanism, configuration, channels, rates, own), strict=True):
            row[rows] = value
        for begin in range(0, len(rows), _POSES_TOGETHER):
            block = np.arange(begin, min(begin + _POSES_TOGETHER, len(rows)))
            part, block_elastic = configuration.take(block), None
            if bent is not None and elastic is not None:
                block_elastic = bent.at(part, channels, rows[block])
                elastic.flexibility[:, :, rows[block]] = block_elastic.flexibility
            block_sources = sources.take(rows[block])
            errors = linear_errors(
                mechanism, part, channels, block_sources, rates.take(block), block_elastic,
                None if own is None else own.take(block),
            )  # fmt: skip
            margins = linear_margins(mechanism, part, block_sources)
            linear.components[:, :, rows[block]] = errors.components
            if not len(closing.components):
                closing = FirstOrder.unknown(sources, len(margins.components), poses.count)
            closing.components[:, :, rows[block]], closing.offset[:, rows[block]] = margins.components, margins.offset
        groups.append((solved, rates))
    if bent is not None and elastic is not None:
        doubts += cautions(study, bent, question.channels)
        reason = np.where(np.isin(reason, (Reason.OK, Reason.LIMIT)) & ~elastic.held, np.int8(Reason.NOT_HELD), reason)
        linear = replace(linear, offset=elastic.offset)
    if question.columns:
        held = np.isfinite(nominal[len(question.channels) - len(question.columns) : len(question.channels)]).all(axis=0)
        reason = np.where(np.isin(reason, (Reason.OK, Reason.LIMIT)) & ~held, np.int8(Reason.NOT_HELD), reason)
    linear.components[:, :, ~np.isin(reason, (Reason.OK, Reason.LIMIT))] = np.nan
    model = model_of(question, linear, nominal)
    nominal = nominal[: len(question.channels)]
    return Task(study, poses, question, sources, reason, nominal, model, closing, elastic), groups, doubts


def _settings(task: Task, groups: _Groups) -> list[Setting]:
    """Settings of the poses that can be assembled, in their order."""
    mechanism, pair = task.study.mechanism, task.question.pair
    mean, sigma = task.linear.shift(), task.linear.deviation()
    assembled = np.flatnonzero(task.assembled).tolist()
    followed, forces = _followed(task), force_model(task.study, task.poses)
    whole = task.question.whole
    settings = []
    for solved, rates in groups:
        by_drives = set(solved.names) == set(mechanism.drives)
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
                    task.question.at(task.nominal[:, row]), row, mechanism,
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
    if not task.question.limited or len(assembled) < 2 or not any(METHODS[name].sampled for name in section.methods):
        return int(assembled[0]) if len(assembled) else -1
    estimates = methods.run("analytic", task).estimates
    return max(estimates, key=lambda pose: np.nan_to_num(estimates[pose].failure))
