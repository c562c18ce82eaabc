"""Warnings about the results of the methods of reliability, and about how far they can be trusted."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from mechdesign.ground.cautions import Caution
from mechdesign.ground.numerals import numeral
from mechdesign.ground.numerics.arrays import evenly
from mechdesign.ground.progress import NULL
from mechdesign.questions.reliability import methods
from mechdesign.questions.reliability.engine.problem import WIDTH, Estimate, reached
from mechdesign.questions.reliability.methods.auto import FACTOR, disagree
from mechdesign.questions.reliability.schema.methods import METHODS
from mechdesign.questions.reliability.task import MethodResult, Task

# Poses at which the first order alone is compared with the second, and mechanisms that are solved for it; least
# probability that is compared, and the ratio from which on a warning says so.
_CURVED_POSES = 100
_CURVED_WORK = 100_000
_CURVED_LEAST = 1e-5
_CURVED_FACTOR = 2.0
# Least deviation that counts, as a part of the largest in the same unit.
_FLAT_LEAST = 1e-3
# Distance of a dead centre, in standard deviations of its margin, up to which there is a warning (1 in a million).
_NEAR = 4.75


def method_warnings(results: Sequence[MethodResult], task: Task) -> list[Caution]:
    """Warnings about the results of the methods."""
    return [
        *_outside(task), *_cornered(task), *_curved(results, task), *disagreements(results, task),
        *_unseen(results, task), *_unreached(results, task), *_pointless(results, task), *_not_assembled(results, task),
        *_unassembled(results), *_of_cycles(results, task),
    ]  # fmt: skip


def _outside(task: Task) -> Iterator[Caution]:
    """Warnings of nominal values outside their own limits, each at its farthest pose."""
    for limit, band in zip(task.question.limits, task.question.at(task.nominal).limits, strict=True):
        away = np.hypot(*band.middle) - band.high if band.round else np.maximum(band.low, -band.high)
        beyond = np.where(task.assembled & limit.absolute, away, 0.0)
        poses = np.flatnonzero(beyond > 0)
        if not len(poses):
            continue
        pose, scale, unit = int(np.argmax(beyond)), task.scale[band.output], task.labels[2][band.output]
        several = f" (the farthest of {len(poses)} poses)" if len(poses) > 1 else ""
        name, where = task.question.channels[band.output].name, f"at {task.where(pose)}{several}"
        if band.round:
            radius, distance = (
                numeral(scale * np.broadcast_to(end, beyond.shape)[pose]) for end in (band.high, away + band.high)
            )
            point = name.replace(".x", "")
            words = f"{point}: the nominal place {where} is {distance} from its target, of {radius} {unit} allowed"
        else:
            value = scale * task.nominal[band.output, pose]
            low, high = (value + scale * end[pose] for end in np.broadcast_arrays(band.low, band.high))
            between = f"{numeral(low)} to {numeral(high)}"
            if not np.isfinite(low) or not np.isfinite(high):
                between = f"at least {numeral(low)}" if np.isfinite(low) else f"at most {numeral(high)}"
            between = f"{between} {unit}".rstrip()
            words = f"{name}: the nominal value {numeral(value)} {where} lies outside its limits, {between}"
        yield Caution("suspect", words, pose=task.where(pose))


def _cornered(task: Task) -> Iterator[Caution]:
    """Warnings of outputs with a corner among their errors, which have no first order there."""
    for output in dict.fromkeys(output for output, *_ in task.question.bends):
        poses = np.flatnonzero(np.isnan(task.linear.whole.components[output]).any(axis=0) & task.assembled)
        if len(poses):
            where = task.where(int(poses[0]))
            several = f" (the first of {len(poses)} poses)" if len(poses) > 1 else ""
            yield Caution(
                "undefined",
                f"{task.question.channels[output].name} bends, jumps or ends within its errors at {where}{several}: "
                "it has no derivative there by which analytic, second_order and the contributions could judge it; ask "
                "for monte_carlo",
                pose=where,
            )  # fmt: skip


def _curved(results: Sequence[MethodResult], task: Task) -> list[Caution]:
    """A warning where `analytic` alone is asked and its errors curve over the tolerances, by their second order.

    Beside another method `disagreements` tells.
    """
    if [result.method for result in results] != ["analytic"]:
        return []
    components = task.linear.components.shape[1]
    some = evenly(len(task.settings), max(1, min(_CURVED_POSES, _CURVED_WORK // (components * components + 1))))
    settings = [task.settings[k] for k in some.tolist()]
    second = methods.run("second_order", replace(task, settings=settings, progress=NULL))
    first, other = results[0].estimates, second.estimates
    apart = {
        pose: disagree(first[pose], other[pose]) for pose in (setting.pose for setting in settings)
        if task.question.limits and max(first[pose].failure, other[pose].failure) > _CURVED_LEAST
    }  # fmt: skip
    pose = max(apart, key=apart.__getitem__, default=-1)
    if pose >= 0 and apart[pose] > _CURVED_FACTOR:
        what = f"the probability of failure is {numeral(first[pose].failure, 3)}", f"{numeral(other[pose].failure, 3)}"
    elif (worst := _flat(task, second)) is not None:
        output, pose, sigma, true = worst
        what = (
            f"the standard deviation of {task.question.channels[output].name} is {numeral(sigma, 3)}",
            f"{numeral(true, 3)}",
        )
    else:
        return []
    return [Caution(
        "disagree",
        f"analytic: errors curve over the tolerances at {task.where(pose)}: {what[0]} to the first order and {what[1]} "
        "to the second; ask for second_order or monte_carlo",
        pose=task.where(pose),
    )]  # fmt: skip


def _flat(task: Task, second: MethodResult) -> tuple[int, int, float, float] | None:
    """Output and pose whose deviation has the least part of the first order, where that is half or less; both."""
    deviation = task.linear.deviation() * task.scale[:, None]
    true = np.sqrt(np.diagonal(second.moments(task)[1], axis1=1, axis2=2).T) * task.scale[:, None]
    unit = task.labels[2]
    largest = np.array([np.nanmax(np.fmax(true, deviation)[unit == own], initial=0.0) for own in unit])[:, None]
    part = np.where(true > _FLAT_LEAST * largest, deviation / true, np.nan)
    if not (part < 1.0 / _CURVED_FACTOR).any():
        return None
    output, pose = np.unravel_index(np.nanargmin(part), part.shape)
    return int(output), int(pose), float(deviation[output, pose]), float(true[output, pose])


def disagreements(results: Sequence[MethodResult], task: Task) -> Iterator[Caution]:
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
    for (name, second), cases in apart.items():
        factor, pose, one, other = max(cases, key=lambda case: case[0])
        times_apart = f"{factor:.3g} times" if factor < 1e6 else "many orders of magnitude"
        several = task.poses.count > 1
        others = f" (at {len(cases)} of {task.poses.count} poses; here they are farthest)" if several else ""
        yield Caution(
            "disagree",
            f"{name} and {second} disagree at {task.where(pose)}: the probability of failure is "
            f"{numeral(one.failure, 3)} by the one and {numeral(other.failure, 3)} by the other, "
            f"{times_apart} apart{others}",
            "reliability", pose=task.where(pose),
        )  # fmt: skip


def _unseen(results: Sequence[MethodResult], task: Task) -> list[Caution]:
    """Warnings of methods without a failed sample, with the upper end of the interval."""
    cases = []
    # Where nothing is limited nothing need fail.
    limited = np.zeros(task.poses.count, dtype=bool)
    for limit in task.question.limits:
        limited |= np.isfinite(limit.high) | np.isfinite(limit.low)
    for result in results:
        poses = {pose: e for pose, e in result.estimates.items() if e.samples and not e.failures and limited[pose]}
        if poses:
            pose, widest = max(poses.items(), key=lambda item: item[1].high)
            where = f"at {task.where(pose)}" if len(poses) == 1 else f"at {len(poses)} poses"
            cases.append((result.method, widest, "samples", where))
        if result.cycle is not None and result.cycle.samples and not result.cycle.failures:
            cases.append((result.method, result.cycle, "made mechanisms", "over the whole cycle"))
    return [
        Caution(
            "unconverged",
            f"{method}: no failure in {estimate.samples} {noun} {where}: the probability of failure is below "
            f"{estimate.high:.2g}",
            "reliability",
        )
        for method, estimate, noun, where in cases
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
        goal, there = (f"{100 * (part or 0.0):.3g} %" for part in (precision.relative, short[pose]))
        measure = "the coefficient of variation"
    else:
        goal, there = (numeral(part, 3) for part in (precision.half_width, short[pose]))
        measure = "half the interval"
    others = f" (the worst of {len(short)} poses)" if len(short) > 1 else ""
    return [Caution(
        "unconverged",
        f"auto: {measure} is {there} at {task.where(pose)}{others}, not the {goal} asked; it ends at {task.most} "
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
        "probability there; trust the samples",
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


def _unassembled(results: Sequence[MethodResult]) -> Iterator[Caution]:
    """Warnings of importance samples, drawn about the limits, that cannot be assembled."""
    for result in results:
        used = [(METHODS[result.used.get(pose, result.method)], e) for pose, e in result.estimates.items()]
        drawn = [e for method, e in used if e.invalid and method.sampled and not method.errors]
        if drawn:
            invalid, samples = sum(part.invalid for part in drawn), sum(part.samples for part in drawn)
            yield Caution(
                "unassembled",
                f"{result.method}: {invalid} of {samples} samples drawn about the limits cannot be assembled; they "
                "count as failures",
            )  # fmt: skip


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
            f"{method}: half the interval of the whole cycle is {numeral(0.5 * (last.high - last.low), 3)} at "
            f"{numeral(last.failure, 3)}, not as precise as asked; it ends at {last.samples} made mechanisms, which "
            "reliability.samples sets",
            "reliability",
        )
        for method, last in simulated.items()
        if METHODS[method].precise and last.failures and not reached(task.precision, last.failure, last.low, last.high)
    ]
