"""The reliability question: error moments, reliability and contributions, analytically and by simulation."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.kinematics.rates import DriveRates, drive_rates
from mechdesign.analyses.poses import SolvedPoses, judge_failures, of_poses, solve_poses, study_poses
from mechdesign.analyses.reliability import methods, sobol, tables
from mechdesign.analyses.reliability.allocation import allocate
from mechdesign.analyses.reliability.cycle import with_cycle
from mechdesign.analyses.reliability.deflection import Elastic, cautions, elasticity
from mechdesign.analyses.reliability.engine.problem import WIDTH, Estimate, reached
from mechdesign.analyses.reliability.first_order import FirstOrder, linear_errors, linear_margins, nominal_values
from mechdesign.analyses.reliability.methods.auto import FACTOR, disagree
from mechdesign.analyses.reliability.question import ask, unsaid
from mechdesign.analyses.reliability.simulation import Setting, forward_plan
from mechdesign.analyses.reliability.sobol import SobolIndices
from mechdesign.analyses.reliability.sources import Sources, find_sources
from mechdesign.analyses.reliability.task import MAX_SAMPLES, MethodResult, Partial, Task
from mechdesign.cautions import Caution
from mechdesign.errors import Interrupted, StudyError
from mechdesign.mechanism import Reason
from mechdesign.progress import NULL, Progress
from mechdesign.results import Result, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses
from mechdesign.study.schema.methods import METHODS
from mechdesign.work.chunks import Divided, apart
from mechdesign.work.threads import keep_freed_memory, one_thread

# Poses whose sensitivities are computed together.
_POSES_TOGETHER = 2048
# Distance of a dead centre, in standard deviations of its margin, up to which there is a warning (1 in a million).
_NEAR = 4.75
# Listed poses that have a density.
_DENSITIES = 12
# Poses that give the same coordinates, and the rates of their drives.
_Groups = Sequence[tuple[SolvedPoses, DriveRates]]


@one_thread()
def reliability(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Result:
    """Errors of a study's outputs from its tolerances and clearances; see `mechdesign.reliability`."""
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
        task = replace(task, precision=section.precision)
    found: list[MethodResult] = []
    left: list[Divided] = []
    interrupted = ""
    indices: dict[int, SobolIndices] = {}
    allocated = Result("allocation", {})
    try:
        for method in section.methods:
            with apart(left):
                found.append(with_cycle(methods.run(method, task), task, found))
        with apart(left):
            indices = sobol.indices(task, section)
        if left:
            raise left[0]
        allocated = allocate(task, section)
    except Partial as partial:
        found.append(partial.result)
        interrupted = "interrupted: "
    except KeyboardInterrupt:
        if not found:
            raise
        interrupted = "interrupted: "
    counts = {"poses": poses.count}
    done = [sums for result in found for sums in result.sums.values()]
    if done:
        counts["samples"] = sum(sums.samples for sums in done)
        counts["invalid"] = sum(sums.samples - sums.valid for sums in done)
        if counts["invalid"]:
            words = f"{counts['invalid']} of {counts['samples']} samples cannot be assembled; they count as failures"
            failures.append(Caution("unassembled", words))
    cycles = [part.cycle.samples for part in found if part.cycle is not None and part.cycle.samples]
    if cycles:
        counts["cycles"] = cycles[0]
    if interrupted:
        interrupted += f"{counts.get('samples', 0)} samples, "
        interrupted += f"{counts['cycles']} whole cycles, " if cycles else ""
        interrupted += f"{', '.join(part.method for part in found)}"
    built = [tables.moments(task, found)]
    if task.question.limited:
        built += [tables.success(task, found), tables.capability(task, found)]
    built += [tables.contributions(task, indices)]
    # Samples of the first method that samples the errors.
    sampled = next((part.sums for part in found if part.sums), {})
    built += tables.of_drawn(task, sampled)
    result = Result(
        "reliability", of_poses(built, task.reason) | dict(allocated.tables),
        [*warnings, *notes(found, task), *sobol.doubts(task, indices), *failures, *allocated.warnings], counts,
        "; ".join(filter(None, (failed, allocated.failed))), allocated.files, interrupted,
        tables.DrawnErrors(poses, tables.drawn_samples(task, sampled)), reached=bool(failed) or not allocated.failed,
    )  # fmt: skip
    if interrupted:
        raise Interrupted(result)
    return result


def first_order_tables(
    study: Study, poses: Poses, wanted: Collection[str]
) -> tuple[dict[str, Table], NDArray[np.int8]]:
    """The `wanted` tables of the first-order analysis at poses, which may be of several designs, and why poses fail.

    Raises
    ------
    StudyError
        If nothing varies.
    """
    task, _, _ = _first_order(study, poses, find_sources(study, poses)[0])
    results = [MethodResult("analytic", normal=(task.linear.shift(), task.linear.covariance()))]
    if "reliability" in wanted:
        results = [with_cycle(methods.run("analytic", task), task, ())]
    built = [tables.moments(task, results)] if "moments" in wanted else []
    if "reliability" in wanted and task.question.limited:
        built.append(tables.success(task, results))
    if "capability" in wanted and task.question.limited:
        built.append(tables.capability(task, results))
    if "contributions" in wanted:
        built.append(tables.contributions(task, {}))
    return {table.name: table for table in built}, task.reason


def _first_order(study: Study, poses: Poses, sources: Sources) -> tuple[Task, _Groups, list[Caution]]:
    """The nominal mechanism and its linear error model at every pose, nan where it is not assembled; warnings.

    Poses that do not hold the study's load have the reason `NOT_HELD`.
    """
    mechanism, section = study.mechanism, study.reliability
    assert section is not None
    question = ask(study, poses.section(section))
    bent, doubts = elasticity(study, poses)
    channels = question.channels
    reason = np.zeros(poses.count, dtype=np.int8)
    nominal = np.full((len(channels), poses.count), np.nan)
    elastic = None if bent is None else Elastic(np.full((len(channels), 3, poses.count), np.nan), bent.load)
    linear = FirstOrder.unknown(sources, len(channels), poses.count)
    closing = FirstOrder.unknown(sources, 0, poses.count)
    groups = []
    for solved in solve_poses(study, poses, [channel.coordinate for channel in channels]):
        configuration, rows = solved.configuration, solved.rows
        reason[rows] = configuration.reason
        rates = DriveRates((), ())
        if any(channel.order for channel in channels):
            # Made mechanisms have the same rates of the drives.
            rates = drive_rates(study, section, poses, solved, mechanism.linearize(configuration))
        for row, value in zip(nominal, nominal_values(mechanism, configuration, channels, rates), strict=True):
            row[rows] = value
        for begin in range(0, len(rows), _POSES_TOGETHER):
            block = np.arange(begin, min(begin + _POSES_TOGETHER, len(rows)))
            part, block_elastic = configuration.take(block), None
            if bent is not None and elastic is not None:
                block_elastic = bent.at(part, channels, rows[block])
                elastic.flexibility[:, :, rows[block]] = block_elastic.flexibility
            with np.errstate(invalid="ignore", divide="ignore"):
                block_sources = sources.take(rows[block])
                errors = linear_errors(mechanism, part, channels, block_sources, rates.take(block), block_elastic)
                margins = linear_margins(mechanism, part, block_sources)
            linear.components[:, :, rows[block]] = errors.components
            if not len(closing.components):
                closing = FirstOrder.unknown(sources, len(margins.components), poses.count)
            closing.components[:, :, rows[block]], closing.offset[:, rows[block]] = margins.components, margins.offset
        groups.append((solved, rates))
    if bent is not None and elastic is not None:
        doubts += cautions(study, bent, channels)
        reason = np.where(np.isin(reason, (Reason.OK, Reason.LIMIT)) & ~elastic.held, np.int8(Reason.NOT_HELD), reason)
        linear = replace(linear, offset=elastic.offset)
    task = Task(study, poses, question, sources, reason, nominal, linear, closing, elastic)
    linear.components[:, :, ~task.assembled] = np.nan
    return task, groups, doubts


def _settings(task: Task, groups: _Groups) -> list[Setting]:
    """Settings of the poses that can be assembled, in their order."""
    mechanism, pair = task.study.mechanism, task.question.pair
    mean, sigma = task.linear.shift(), task.linear.deviation()
    assembled = np.flatnonzero(task.assembled).tolist()
    followed = _followed(task)
    settings = []
    for solved, rates in groups:
        by_drives = set(solved.given) == set(mechanism.drives)
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
                    None if task.elastic is None else task.elastic.take([row]), scale, row == followed,
                )
            )  # fmt: skip
    return sorted(settings, key=lambda setting: setting.pose)


def _followed(task: Task) -> int:
    """The pose whose samples are kept: the study's `shown`, else the one that fails most often by the first order.

    Without limits the first one; -1 where no pose can be assembled.
    """
    section, assembled = task.study.reliability, np.flatnonzero(task.assembled)
    assert section is not None
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


def notes(found: Sequence[MethodResult], task: Task) -> list[Caution]:
    """Warnings about the results of the methods."""
    return [
        *_outside(task), *disagreements(found, task), *_unseen(found, task), *_unreached(found, task),
        *_pointless(found, task), *_not_assembled(found, task), *_unassembled(found), *_of_cycles(found, task),
    ]  # fmt: skip


def _outside(task: Task) -> list[Caution]:
    """Warnings of nominal values outside their own limits, each at its farthest pose."""
    found = []
    for limit, band in zip(task.question.bands, task.question.at(task.nominal).bands, strict=True):
        beyond = np.where(task.assembled & limit.absolute, np.maximum(band.low, -band.high), 0.0)
        poses = np.flatnonzero(beyond > 0)
        if not len(poses):
            continue
        pose, scale, unit = int(np.argmax(beyond)), task.scale[band.output], task.labels[2][band.output]
        value = scale * task.nominal[band.output, pose]
        low, high = (value + scale * end[pose] for end in np.broadcast_arrays(band.low, band.high))
        between = f"{low:.6g} to {high:.6g}"
        if not np.isfinite(low) or not np.isfinite(high):
            between = f"at least {low:.6g}" if np.isfinite(low) else f"at most {high:.6g}"
        several = f" (the farthest of {len(poses)} poses)" if len(poses) > 1 else ""
        found.append(Caution(
            "suspect",
            f"{task.question.channels[band.output].name}: the nominal value {value:.6g} at {task.where(pose)}{several} "
            f"lies outside its limits, {between}{f' {unit}' if unit else ''}",
            pose=task.where(pose),
        ))  # fmt: skip
    return found


def disagreements(results: Sequence[MethodResult], task: Task) -> list[Caution]:
    """Warnings of pairs of methods whose intervals are more than `FACTOR` apart, each at its worst pose."""
    apart: dict[tuple[str, str], list[tuple[float, int, Estimate, Estimate]]] = {}
    for pose in range(task.poses.count):
        estimates: dict[str, Estimate] = {}
        for result in results:
            for rung, estimate in result.rungs.get(pose, {}).items():
                estimates.setdefault(rung, estimate)
            if pose in result.estimates and not result.rungs:
                estimates[result.method] = result.estimates[pose]
        for pair in itertools.combinations(estimates, 2):
            one, other = (estimates[name] for name in pair)
            times = disagree(one, other)
            if times > FACTOR:
                apart.setdefault(pair, []).append((times, pose, one, other))
    warnings = []
    for (name, second), cases in apart.items():
        factor, pose, one, other = max(cases, key=lambda case: case[0])
        times_apart = f"{factor:.3g} times" if factor < 1e6 else "many orders of magnitude"
        several = task.poses.count > 1
        others = f" (at {len(cases)} of {task.poses.count} poses; here they are farthest)" if several else ""
        warnings.append(Caution(
            "disagree",
            f"{name} and {second} disagree at {task.where(pose)}: the probability of failure is {one.failure:.3g} by "
            f"the one and {other.failure:.3g} by the other, {times_apart} apart{others}",
            "reliability", pose=task.where(pose),
        ))  # fmt: skip
    return warnings


def _unseen(results: Sequence[MethodResult], task: Task) -> list[Caution]:
    """Warnings of methods without a failed sample, with the upper end of the interval."""
    cases = []
    for result in results:
        poses = {pose: e for pose, e in result.estimates.items() if e.samples and not e.failures}
        if poses:
            pose, widest = max(poses.items(), key=lambda item: item[1].high)
            where = f"at {task.where(pose)}" if len(poses) == 1 else f"at {len(poses)} poses"
            cases.append((result.method, widest, "samples", where))
        if result.cycle is not None and result.cycle.samples and not result.cycle.failures:
            cases.append((result.method, result.cycle, "made mechanisms", "over the whole cycle"))
    return [
        Caution(
            "unconverged",
            f"{method}: no failure in {estimate.samples} {what} {where}: the probability of failure is below "
            f"{estimate.high:.2g}",
            "reliability",
        )
        for method, estimate, what, where in cases
    ]


def _unreached(results: Sequence[MethodResult], task: Task) -> list[Caution]:
    """A warning where `auto` ended before its precision, with the worst pose and the precision reached there."""
    precision = task.precision
    short: dict[int, float] = {}
    for result in results:
        for pose in result.rungs:
            estimate = result.estimates[pose]
            # `_unseen` warns where no sample failed.
            if estimate.failures and not reached(precision, estimate.failure, estimate.low, estimate.high):
                half = 0.5 * (estimate.high - estimate.low)
                short[pose] = half / (WIDTH * estimate.failure) if precision.half_width is None else half
    if not short:
        return []
    pose = max(short, key=short.__getitem__)
    if precision.half_width is None:
        asked, there = (f"{100 * (part or 0.0):.3g} %" for part in (precision.relative, short[pose]))
        what = "the coefficient of variation"
    else:
        asked, there = (f"{part:.3g}" for part in (precision.half_width, short[pose]))
        what = "half the interval"
    others = f" (the worst of {len(short)} poses)" if len(short) > 1 else ""
    return [Caution(
        "unconverged",
        f"auto: {what} is {there} at {task.where(pose)}{others}, not the {asked} asked; it ends at {task.most} "
        "samples, which reliability.samples sets",
        "reliability", pose=task.where(pose),
    )]  # fmt: skip


def _pointless(results: Sequence[MethodResult], task: Task) -> list[Caution]:
    """A warning where `form` found no design point although samples break limits."""
    unknown = [pose for result in results if result.method == "form"
               for pose, estimate in result.estimates.items() if math.isnan(estimate.failure)]  # fmt: skip
    if not unknown:
        return []
    others = f" and at {len(unknown) - 1} more poses" if len(unknown) > 1 else ""
    return [Caution(
        "unconverged",
        f"form: samples break a limit at {task.where(unknown[0])}{others}, but no design point was found: it has no "
        "probability there",
        "reliability", pose=task.where(unknown[0]),
    )]  # fmt: skip


def _not_assembled(results: Sequence[MethodResult], task: Task) -> list[Caution]:
    """A warning of dead centres near the nominal pose, to the first order, for methods that draw no mechanisms."""
    names = ", ".join(result.method for result in results if result.normal is not None)
    distance = task.closing.distance().min(axis=0, initial=math.inf)
    poses = np.flatnonzero(distance < _NEAR)
    if not names or not len(poses):
        return []
    pose = int(np.argmin(distance))
    share = 50.0 * math.erfc(float(distance[pose]) / math.sqrt(2.0))
    several = f" (the worst of {len(poses)} poses)" if len(poses) > 1 else ""
    return [Caution(
        "unassembled",
        f"{names}: {share:.2g} % of the made mechanisms cannot be assembled at {task.where(pose)}{several}, "
        "by the first order of the margin to a dead centre; they count as failures, and near a dead centre errors are "
        "not normal: compare with form or monte_carlo",
        pose=task.where(pose),
    )]  # fmt: skip


def _unassembled(results: Sequence[MethodResult]) -> list[Caution]:
    """Warnings of importance samples, drawn about the limits, that cannot be assembled."""
    warnings = []
    for result in results:
        used = [(METHODS[result.used.get(pose, result.method)], e) for pose, e in result.estimates.items()]
        drawn = [e for method, e in used if e.invalid and method.sampled and not method.errors]
        if drawn:
            invalid, samples = sum(part.invalid for part in drawn), sum(part.samples for part in drawn)
            warnings.append(Caution(
                "unassembled",
                f"{result.method}: {invalid} of {samples} samples drawn about the limits cannot be assembled; they "
                "count as failures",
            ))  # fmt: skip
    return warnings


def _of_cycles(results: Sequence[MethodResult], task: Task) -> list[Caution]:
    """Warnings of cycles that cannot be assembled at some pose, and where `auto` ended before its precision."""
    warnings = []
    simulated = {part.method: part.cycle for part in results if part.cycle is not None and part.cycle.samples}
    first = next(iter(simulated.values()), None)
    if first is not None and first.invalid:
        warnings.append(Caution(
            "unassembled",
            f"{first.invalid} of {first.samples} made mechanisms cannot be assembled at some pose of the cycle; "
            "they count as failures",
        ))  # fmt: skip
    return warnings + [
        Caution(
            "unconverged",
            f"{method}: half the interval of the whole cycle is {0.5 * (last.high - last.low):.3g} at "
            f"{last.failure:.3g}, not as precise as asked; it ends at {last.samples} made mechanisms, which "
            "reliability.samples sets",
            "reliability",
        )
        for method, last in simulated.items()
        if METHODS[method].precise and last.failures and not reached(task.precision, last.failure, last.low, last.high)
    ]
