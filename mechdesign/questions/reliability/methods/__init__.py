"""The methods declared in the schema, one a file, each with a function ``run(task)`` that returns its result."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib import import_module

import numpy as np

from mechdesign.numerics.arrays import Floats
from mechdesign.questions.reliability.engine.problem import Estimate
from mechdesign.questions.reliability.question import ReliabilityQuestion
from mechdesign.questions.reliability.schema.methods import METHODS
from mechdesign.questions.reliability.simulation import Setting
from mechdesign.questions.reliability.task import MethodResult, Partial, Task
from mechdesign.work.chunks import map_chunks

# Names of streams of random numbers: of searches for design points, and of quasi-Monte Carlo's scrambling.
SEARCH, QUASI = 1, 2


def run(name: str, task: Task) -> MethodResult:
    """The result of a method."""
    result: MethodResult = import_module(METHODS[name].place).run(task)
    return result


def normal(name: str, task: Task, mean: Floats, covariance: Floats) -> MethodResult:
    """Result for normal errors with these means, shape (channels, poses), and covariances, (poses, channels, channels).

    Its estimates have no interval.
    """
    estimates = of_normal(task, task.question, mean, covariance) if task.question.limited else {}
    return MethodResult(name, estimates, normal=(mean, covariance))


def of_normal(task: Task, question: ReliabilityQuestion, mean: Floats, covariance: Floats) -> dict[int, Estimate]:
    """Estimates by pose from normal errors as of `normal`, for the limits of a question about the task's channels.

    A mechanism that cannot be assembled is a failure.
    """
    # SciPy takes a quarter of a second to import, and a study without limits does not need it.
    from mechdesign.questions.reliability.probability import made_failure

    rows = np.flatnonzero(task.assembled)
    question = question.take(rows).at(task.nominal[:, rows])
    linear, closing = task.linear.take(rows), task.closing.take(rows)
    values = made_failure(linear, closing, question.bands, question.discs, mean.T[rows], covariance[rows])
    return {pose: Estimate(value, value, value, 0) for pose, value in zip(rows.tolist(), values.tolist(), strict=True)}


def pose_by_pose(name: str, task: Task, work: Callable[[Task, Setting], MethodResult]) -> MethodResult:
    """Results of `work`, a function of a module, at all poses; an interrupt keeps the poses that are finished."""
    result = MethodResult(name)
    task.progress.start(len(task.settings), "poses")
    try:
        for part in map_chunks(partial(_at, work, task), range(len(task.settings)), task.jobs, travels=True):
            result.add(part)
            task.progress.update(1)
    except KeyboardInterrupt:
        raise Partial(result) from None
    return result


def of_limits(name: str, task: Task, work: Callable[[Task, Setting], Estimate]) -> MethodResult:
    """Estimates by `work`, a function of a module, at all poses; an empty result where there are no limits."""
    if not task.question.limited:
        return MethodResult(name)
    return pose_by_pose(name, task, partial(_estimated, name, work))


def _at(work: Callable[[Task, Setting], MethodResult], task: Task, place: int) -> MethodResult:
    return work(task, task.settings[place])


def _estimated(name: str, work: Callable[[Task, Setting], Estimate], task: Task, setting: Setting) -> MethodResult:
    return MethodResult(name, {setting.pose: work(task, setting)})
