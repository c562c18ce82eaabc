"""The methods declared in the schema, one a file: ``run(task)`` says what each finds at every pose."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib import import_module

import numpy as np

from mechdesign.analyses.reliability.engine.problem import Estimate
from mechdesign.analyses.reliability.question import ReliabilityQuestion
from mechdesign.analyses.reliability.simulation import Setting
from mechdesign.analyses.reliability.task import MethodResult, Partial, Task
from mechdesign.numerics.arrays import Floats
from mechdesign.study.schema.methods import METHODS
from mechdesign.work.chunks import map_chunks

# Streams of random numbers, besides those of the plain samples.
SEARCH, QUASI = 1, 2


def run(name: str, task: Task) -> MethodResult:
    """What a method says."""
    found: MethodResult = import_module(METHODS[name].place).run(task)
    return found


def normal(name: str, task: Task, mean: Floats, covariance: Floats) -> MethodResult:
    """Normal errors of these means, shape (channels, poses), and covariances, shape (poses, channels, channels).

    No interval is claimed.
    """
    found = MethodResult(name, normal=(mean, covariance))
    if task.question.limited:
        found.estimates.update(of_normal(task, task.question, mean, covariance))
    return found


def of_normal(task: Task, question: ReliabilityQuestion, mean: Floats, covariance: Floats) -> dict[int, Estimate]:
    """Estimates by pose from normal errors, as of `normal`, for the limits of a question about the task's channels.

    What cannot be assembled breaks them.
    """
    # SciPy takes a quarter of a second to import, and a study without limits does not need it.
    from mechdesign.analyses.reliability.probability import made_failure

    rows = np.flatnonzero(task.assembled)
    question = question.take(rows).at(task.nominal[:, rows])
    linear, closing = task.linear.take(rows), task.closing.take(rows)
    values = made_failure(linear, closing, question.bands, question.discs, mean.T[rows], covariance[rows])
    return {pose: Estimate(value, value, value, 0) for pose, value in zip(rows.tolist(), values.tolist(), strict=True)}


def pose_by_pose(name: str, task: Task, work: Callable[[Task, Setting], MethodResult]) -> MethodResult:
    """What `work`, a function of a module, says of each pose; an interrupt keeps the poses that are finished."""
    found = MethodResult(name)
    task.progress.start(len(task.settings), "poses")
    try:
        for part in map_chunks(partial(_at, work, task), range(len(task.settings)), task.jobs, travels=True):
            found.add(part)
            task.progress.update(1)
    except KeyboardInterrupt:
        raise Partial(found) from None
    return found


def of_limits(name: str, task: Task, work: Callable[[Task, Setting], Estimate]) -> MethodResult:
    """What `work`, a function of a module, estimates at each pose; nothing where there are no limits."""
    if not task.question.limited:
        return MethodResult(name)
    return pose_by_pose(name, task, partial(_estimated, name, work))


def _at(work: Callable[[Task, Setting], MethodResult], task: Task, place: int) -> MethodResult:
    return work(task, task.settings[place])


def _estimated(name: str, work: Callable[[Task, Setting], Estimate], task: Task, setting: Setting) -> MethodResult:
    return MethodResult(name, {setting.pose: work(task, setting)})
