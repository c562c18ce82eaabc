"""What is to be known of the methods' answers: where they disagree, saw no failure, or fell short of what was asked."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from mechdesign.analyses.reliability.engine.problem import WIDTH, Estimate
from mechdesign.analyses.reliability.methods.auto import FACTOR, disagree
from mechdesign.analyses.reliability.task import MethodResult, Task
from mechdesign.study.schema.methods import METHODS


def notes(found: Sequence[MethodResult], task: Task) -> list[str]:
    """All of it, in sentences."""
    return [
        *disagreements(found, task), *_unseen(found, task), *_unreached(found, task), *_pointless(found, task),
        *_unassembled(found), *_of_cycles(found, task),
    ]  # fmt: skip


def disagreements(found: Sequence[MethodResult], task: Task) -> list[str]:
    """One sentence for each two methods that are apart by more than a factor beyond their intervals: the worst pose."""
    apart: dict[tuple[str, str], list[tuple[float, int, Estimate, Estimate]]] = {}
    for pose in range(task.poses.count):
        estimates: dict[str, Estimate] = {}
        for each in found:
            for rung, estimate in each.rungs.get(pose, {}).items():
                estimates.setdefault(rung, estimate)
            if pose in each.estimates and not each.rungs:
                estimates[each.method] = each.estimates[pose]
        for pair in itertools.combinations(estimates, 2):
            one, other = (estimates[name] for name in pair)
            times = disagree(one, other)
            if times > FACTOR:
                apart.setdefault(pair, []).append((times, pose, one, other))
    sentences = []
    for (name, second), cases in apart.items():
        factor, pose, one, other = max(cases, key=lambda case: case[0])
        times_apart = f"{factor:.3g} times" if factor < 1e6 else "many orders of magnitude"
        several = task.poses.count > 1
        rest = f" (at {len(cases)} of {task.poses.count} poses; here they are farthest)" if several else ""
        sentences.append(
            f"{name} and {second} disagree at {task.where(pose)}: the probability of failure is {one.failure:.3g} by "
            f"the one and {other.failure:.3g} by the other, {times_apart} apart{rest}"
        )
    return sentences


def _unseen(found: Sequence[MethodResult], task: Task) -> list[str]:
    """Where counted failures are none: the upper end of the interval."""
    cases = []
    for each in found:
        poses = {pose: e for pose, e in each.estimates.items() if e.samples and not e.failures}
        if poses:
            pose, widest = max(poses.items(), key=lambda item: item[1].high)
            where = f"at {task.where(pose)}" if len(poses) == 1 else f"at {len(poses)} poses"
            cases.append((each.method, widest, "samples", where))
        if each.cycle is not None and each.cycle.samples and not each.cycle.failures:
            cases.append((each.method, each.cycle, "made mechanisms", "over the whole cycle"))
    return [
        f"{method}: no failure in {estimate.samples} {what} {where}: the probability of failure is below "
        f"{estimate.high:.2g}"
        for method, estimate, what, where in cases
    ]


def _unreached(found: Sequence[MethodResult], task: Task) -> list[str]:
    """Where `auto` ended before the precision asked: the worst pose and what was reached there."""
    precision = task.precision
    short: dict[int, float] = {}
    for each in found:
        for pose in each.rungs:
            estimate = each.estimates[pose]
            # What no failure at all says is told elsewhere.
            if estimate.failures and not precision.reached(estimate.failure, estimate.low, estimate.high):
                half = 0.5 * (estimate.high - estimate.low)
                short[pose] = half / (WIDTH * estimate.failure) if precision.half_width is None else half
    if not short:
        return []
    pose = max(short, key=lambda each: short[each])
    if precision.half_width is None:
        asked, reached = (f"{100 * (part or 0.0):.3g} %" for part in (precision.relative, short[pose]))
        what = "the coefficient of variation"
    else:
        asked, reached = (f"{part:.3g}" for part in (precision.half_width, short[pose]))
        what = "half the interval"
    others = f" (the worst of {len(short)} poses)" if len(short) > 1 else ""
    return [
        f"auto: {what} is {reached} at {task.where(pose)}{others}, not the {asked} asked; it ends at {task.most} "
        "samples, which reliability.samples sets"
    ]


def _pointless(found: Sequence[MethodResult], task: Task) -> list[str]:
    """Where `form` found no design point although limits are broken."""
    unknown = [pose for each in found if each.method == "form"
               for pose, estimate in each.estimates.items() if math.isnan(estimate.failure)]  # fmt: skip
    if not unknown:
        return []
    others = f" and at {len(unknown) - 1} more poses" if len(unknown) > 1 else ""
    return [
        f"form: samples break a limit at {task.where(unknown[0])}{others}, but no design point was found: it has no "
        "probability there"
    ]


def _unassembled(found: Sequence[MethodResult]) -> list[str]:
    """Where samples drawn about the limits meet what cannot be assembled."""
    sentences = []
    for each in found:
        used = [(METHODS[each.used.get(pose, each.method)], estimate) for pose, estimate in each.estimates.items()]
        drawn = [e for method, e in used if e.invalid and method.sampled and not method.errors]
        if drawn:
            invalid, samples = sum(part.invalid for part in drawn), sum(part.samples for part in drawn)
            sentences.append(
                f"{each.method}: {invalid} of {samples} samples drawn about the limits cannot be assembled; they count "
                "as failures"
            )
    return sentences


def _of_cycles(found: Sequence[MethodResult], task: Task) -> list[str]:
    """Of made mechanisms that cannot be assembled at some pose, and where `auto` ended too early."""
    sentences = []
    simulated = {each.method: each.cycle for each in found if each.cycle is not None and each.cycle.samples}
    first = next(iter(simulated.values()), None)
    if first is not None and first.invalid:
        sentences.append(
            f"{first.invalid} of {first.samples} made mechanisms cannot be assembled at some pose of the cycle; "
            "they count as failures"
        )
    return sentences + [
        f"{method}: half the interval of the whole cycle is {0.5 * (last.high - last.low):.3g} at {last.failure:.3g}, "
        f"not as precise as asked; it ends at {last.samples} made mechanisms, which reliability.samples sets"
        for method, last in simulated.items()
        if METHODS[method].precise and last.failures and not task.precision.reached(last.failure, last.low, last.high)
    ]
