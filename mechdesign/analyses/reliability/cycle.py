"""The probability that one made mechanism keeps every limit at all poses of a motion.

A made mechanism keeps its dimensions and the radii of its clearances over the whole motion, and with them what else
`dimensions` names, such as a drive's positioning error; only its pins lie elsewhere at each pose. It fails where it
breaks a limit, or cannot be assembled, at any of the poses asked: what happens between two of them is not seen, so the
step of a sweep is the resolution of the answer (a crank that cannot turn fully is found where a pose lies in the range
that it cannot reach).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.analyses.reliability.engine.problem import Estimate
from mechdesign.analyses.reliability.sampling import CHUNK, generator
from mechdesign.analyses.reliability.simulation import Setting, errors_of, keeps, limited_part
from mechdesign.analyses.reliability.sources import Sources
from mechdesign.analyses.reliability.task import Found, Partial, Task, wanted_precision
from mechdesign.parallel import map_chunks

# Streams of their own: no other name has four numbers.
_STREAM = (3, 0)
# Mechanisms times poses of a chunk: about a second's work, so that an interrupt is soon heard.
_WORK = 1_500_000
_FEWEST = 200
# Methods whose values at the poses are samples of the errors.
_SAMPLED = ("monte_carlo", "quasi_monte_carlo", "auto")


@dataclass(frozen=True)
class Count:
    """Made mechanisms of a chunk: all, those that failed, those that cannot be assembled somewhere, poses solved."""

    samples: int = 0
    failures: int = 0
    invalid: int = 0
    evaluations: int = 0

    def __add__(self, other: Count) -> Count:
        return Count(
            self.samples + other.samples, self.failures + other.failures, self.invalid + other.invalid,
            self.evaluations + other.evaluations,
        )  # fmt: skip


def with_cycle(found: Found, task: Task, before: Sequence[Found]) -> Found:
    """What a method says, with its estimate of the whole cycle where one is asked.

    Methods that sample the errors simulate whole cycles by Monte Carlo, `auto` until its precision is reached; of all
    others the poses' own estimates give bounds.

    Raises
    ------
    Partial
        On an interrupt, with what was counted so far.
    """
    if not task.settings or not task.settings[0].limited or not task.cycle:
        return found
    if len(task.settings) < task.poses:
        # The nominal mechanism itself does not reach some pose.
        nothing = float("nan")
        return replace(found, cycle=Estimate(nothing, nothing, nothing, 0))
    if found.method not in _SAMPLED:
        return replace(found, cycle=bounds([found.estimates[setting.pose] for setting in task.settings]))
    known = [each.cycle for each in before if each.method in _SAMPLED[:2] and each.cycle is not None]
    if known and found.method in _SAMPLED[:2]:
        return replace(found, cycle=known[0])
    return _simulated(found, task)


def bounds(estimates: Sequence[Estimate]) -> Estimate:
    """Of poses one by one: a cycle fails at least as often as the worst pose, at most as often as all together.

    The value is the conservative end, whatever the dependence between the poses. [Boole's inequality.]
    """
    low = float(np.max([each.low for each in estimates]))
    high = float(np.minimum(1.0, np.sum([each.high for each in estimates])))
    return Estimate(high, low, high, 0)


def notes(found: Sequence[Found], task: Task) -> list[str]:
    """Sentences about made mechanisms that cannot be assembled at some pose, and where `auto` ended too early."""
    sentences = []
    simulated = {each.method: each.cycle for each in found if each.cycle is not None and each.cycle.samples}
    for cycle in list(simulated.values())[:1]:
        if cycle.invalid:
            sentences.append(
                f"{cycle.invalid} of {cycle.samples} made mechanisms cannot be assembled at some pose of the cycle; "
                "they count as failures"
            )
    last = simulated.get("auto")
    if last is not None and last.failures and not wanted_precision(task).reached(last.failure, last.low, last.high):
        sentences.append(
            f"auto: half the interval of the whole cycle is {0.5 * (last.high - last.low):.3g} at {last.failure:.3g}, "
            f"not as precise as asked; it ends at {last.samples} made mechanisms, which reliability.samples sets"
        )
    return sentences


def _simulated(found: Found, task: Task) -> Found:
    samples, precision = task.samples, None
    if found.method == "auto":
        precision = wanted_precision(task)
        samples = max(task.samples, task.most // task.poses)
    settings = [limited_part(setting) for setting in task.settings]
    size = max(_FEWEST, min(CHUNK, _WORK // len(settings)))
    chunks = -(-samples // size)
    total = Count()

    def work(chunk: int) -> Count:
        return count_chunk(settings, task.sources, task.seed, chunk, min(size, samples - chunk * size))

    task.progress.start(samples, "whole cycles")
    done, until = 0, chunks if precision is None else 1
    try:
        while done < chunks:
            for part in map_chunks(work, range(done, until), task.jobs):
                total += part
                task.progress.update(part.samples)
            done, until = until, min(chunks, 2 * until)
            estimate = _estimate(total)
            if precision is not None and precision.reached(estimate.failure, estimate.low, estimate.high):
                break
    except KeyboardInterrupt:
        cycle = _estimate(total) if total.samples else None
        raise Partial(replace(found, cycle=cycle)) from None
    return replace(found, cycle=_estimate(total))


def count_chunk(settings: Sequence[Setting], sources: Sources, seed: int, chunk: int, count: int) -> Count:
    """Draw `count` made mechanisms and move each through all poses; what cannot be assembled moves no further."""
    drawn = sources.draw(generator(seed, chunk, 0, *_STREAM), count)
    within = np.ones(count, dtype=bool)
    evaluations = 0
    for place, setting in enumerate(settings):
        left = len(within)
        if not left:
            break
        if place:
            drawn = sources.redraw_pins(drawn, generator(seed, chunk, place, *_STREAM), left)
        errors, valid = errors_of(setting, sources.made(drawn), left)
        evaluations += left
        kept = keeps(setting, errors)
        assert kept is not None
        within &= kept
        if not valid.all():
            drawn, within = drawn.take(valid), within[valid]
    return Count(count, count - int(np.count_nonzero(within)), count - len(within), evaluations)


def _estimate(count: Count) -> Estimate:
    from mechdesign.analyses.reliability.engine.intervals import binomial

    low, high = binomial(count.failures, count.samples)
    value = count.failures / count.samples if count.samples else float("nan")
    return Estimate(value, low, high, count.evaluations, count.samples, count.failures, count.invalid)
