"""The probability that one made mechanism keeps every limit at all poses of a motion.

A made mechanism keeps its dimensions and the radii of its clearances over the whole motion; only the places of its pins
in their holes are drawn anew at each pose. It fails where it breaks a limit, or cannot be assembled, at any pose.
Failures between two poses are not seen: the step of a sweep is the resolution of the result. `between` warns of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from mechdesign.ground.numerics.arrays import Ints
from mechdesign.ground.work.chunks import map_chunks
from mechdesign.motion.rows import Poses
from mechdesign.questions.reliability.engine.problem import Estimate, counted, reached
from mechdesign.questions.reliability.schema.methods import METHODS
from mechdesign.questions.reliability.simulation import CHUNK, Setting, errors_of, generator
from mechdesign.questions.reliability.sources import Sources
from mechdesign.questions.reliability.task import MethodResult, Partial, Task

# End of the names of this module's streams of random numbers, the only names of four numbers.
_STREAM = (3, 0)
# Mechanisms times poses of a chunk: about a second of work, so that an interrupt takes effect soon.
_CHUNK_WORK = 1_500_000
# Least number of mechanisms of a chunk.
_CHUNK_LEAST = 200


def with_cycle(result: MethodResult, task: Task, before: Sequence[MethodResult]) -> MethodResult:
    """The result of a method with its estimate of the whole cycle, where there are limits and a motion.

    Methods that sample the errors simulate whole cycles by Monte Carlo, `auto` until its precision is reached. For all
    others the estimates at the poses give bounds. `before` are the results of the methods before this one.

    Raises
    ------
    Partial
        On an interrupt, with the cycles counted so far.
    """
    if not task.question.limits or not task.poses.followed:
        return result
    method = METHODS[result.method]
    if not method.errors or not task.assembled.all():
        return replace(result, cycles=bounds(result, task.poses))
    simulated = [past.cycles for past in before if METHODS[past.method].errors and not METHODS[past.method].precise]
    if simulated and not method.precise:
        return replace(result, cycles=simulated[0])
    return _simulated(result, task)


def bounds(result: MethodResult, poses: Poses) -> tuple[Estimate, ...]:
    """Bounds of the cycle's probability of failure by design; nan if the nominal one cannot reach a pose.

    A cycle fails at least as often as the worst pose, and at most as often as the sum over the poses [Boole's
    inequality]. The sum is the estimate's value.
    """
    ends = np.full((2, poses.count), np.nan)
    ends[:, list(result.estimates)] = np.array([(e.low, e.high) for e in result.estimates.values()]).T
    low, high = ends.reshape(2, poses.designs, -1)
    highest = np.minimum(1.0, high.sum(axis=1)).tolist()
    return tuple(Estimate(most, least, most, 0) for least, most in zip(low.max(axis=1).tolist(), highest, strict=True))


def _simulated(result: MethodResult, task: Task) -> MethodResult:
    precise = METHODS[result.method].precise
    samples = max(task.samples, task.most // task.poses.count) if precise else task.samples
    settings = [setting.narrowed() for setting in task.settings]
    size = max(_CHUNK_LEAST, min(CHUNK, _CHUNK_WORK // len(settings)))
    chunks = -(-samples // size)
    total = np.zeros(4, dtype=np.int64)
    work = partial(_counted, settings, task.sources, task.seed, samples, size)
    task.progress.start(samples, "whole cycles")
    done, until = 0, 1 if precise else chunks
    try:
        while done < chunks:
            for part in map_chunks(work, range(done, until), task.jobs, travels=True):
                total += part
                task.progress.update(int(part[1]))
            done, until = until, min(chunks, 2 * until)
            estimate = counted(*total.tolist())
            if precise and reached(task.precision, estimate.failure, estimate.low, estimate.high):
                break
    except KeyboardInterrupt:
        raise Partial(replace(result, cycles=(counted(*total.tolist()),) if total[1] else ())) from None
    return replace(result, cycles=(counted(*total.tolist()),))


def _counted(settings: Sequence[Setting], sources: Sources, seed: int, samples: int, size: int, chunk: int) -> Ints:
    """Draw the made mechanisms of a chunk and move each through all poses, up to one at which it cannot be assembled.

    Returns
    -------
    ndarray of int, shape (4,)
        Mechanisms that failed, those drawn, those that cannot be assembled at some pose, and poses solved.
    """
    count = min(size, samples - chunk * size)
    drawn = sources.draw(generator(seed, chunk, 0, *_STREAM), count)
    within = np.ones(count, dtype=bool)
    evaluations = 0
    for place, setting in enumerate(settings):
        left = len(within)
        if not left:
            break
        if place:
            drawn = sources.redraw_pins(drawn, generator(seed, chunk, place, *_STREAM))
        errors, valid = errors_of(setting, sources.made(drawn), left)
        evaluations += left
        within &= setting.question.kept(errors).all(axis=0)
        if not valid.all():
            drawn, within = drawn[:, valid], within[valid]
    return np.array([count - np.count_nonzero(within), count, count - len(within), evaluations])
