"""The probability that one made mechanism keeps every limit at all poses of a motion.

A made mechanism keeps whatever `dimensions` names and the radii of its clearances over the whole motion; only its pins
lie elsewhere at each pose. It fails where it breaks a limit, or cannot be assembled, at any of the poses asked: what
happens between two of them is not seen, so the step of a sweep is the resolution of the answer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from mechdesign.analyses.reliability.engine.problem import Estimate, counted, reached
from mechdesign.analyses.reliability.simulation import CHUNK, Setting, errors_of, generator
from mechdesign.analyses.reliability.sources import Sources
from mechdesign.analyses.reliability.task import MethodResult, Partial, Task
from mechdesign.numerics.arrays import Ints
from mechdesign.study.poses import Poses
from mechdesign.study.schema.methods import METHODS
from mechdesign.work.chunks import map_chunks

# Stream of random numbers: no other name has four numbers.
_STREAM = (3, 0)
# Mechanisms times poses of a chunk: about a second's work, so that an interrupt is soon heard.
_CHUNK_WORK = 1_500_000
# Least mechanisms of a chunk.
_CHUNK_LEAST = 200


def with_cycle(found: MethodResult, task: Task, before: Sequence[MethodResult]) -> MethodResult:
    """What a method says, with its estimate of the whole cycle where one is asked.

    Methods that sample the errors simulate whole cycles by Monte Carlo, `auto` until its precision is reached; of all
    others the poses' own estimates give bounds.

    Raises
    ------
    Partial
        On an interrupt, with what was counted so far.
    """
    if not task.question.limited or not task.poses.motion:
        return found
    method = METHODS[found.method]
    if not method.errors or not task.assembled.all():
        return replace(found, cycles=bounds(found, task.poses))
    known = [each.cycles for each in before if METHODS[each.method].errors and not METHODS[each.method].precise]
    if known and not method.precise:
        return replace(found, cycles=known[0])
    return _simulated(found, task)


def bounds(found: MethodResult, poses: Poses) -> tuple[Estimate, ...]:
    """Bounds of the cycle of each design, nan where the nominal mechanism itself does not reach some pose.

    A cycle fails at least as often as the worst pose and at most as their sum, its value [Boole's inequality].
    """
    ends = np.full((2, poses.count), np.nan)
    ends[:, list(found.estimates)] = np.array([(each.low, each.high) for each in found.estimates.values()]).T
    low, high = ends.reshape(2, poses.designs, -1)
    highest = np.minimum(1.0, high.sum(axis=1)).tolist()
    return tuple(Estimate(most, least, most, 0) for least, most in zip(low.max(axis=1).tolist(), highest, strict=True))


def _simulated(found: MethodResult, task: Task) -> MethodResult:
    precise = METHODS[found.method].precise
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
        raise Partial(replace(found, cycles=(counted(*total.tolist()),) if total[1] else ())) from None
    return replace(found, cycles=(counted(*total.tolist()),))


def _counted(settings: Sequence[Setting], sources: Sources, seed: int, samples: int, size: int, chunk: int) -> Ints:
    return count_chunk(settings, sources, seed, chunk, min(size, samples - chunk * size))


def count_chunk(settings: Sequence[Setting], sources: Sources, seed: int, chunk: int, count: int) -> Ints:
    """Draw `count` made mechanisms and move each through all poses; what cannot be assembled moves no further.

    Returns
    -------
    ndarray of int, shape (4,)
        Mechanisms that failed, those drawn, those that cannot be assembled somewhere, and poses solved.
    """
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
