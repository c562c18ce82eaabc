"""The methods declared in the schema, one a file, each with a function ``run(task)`` that returns its result."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from importlib import import_module
from typing import TypeVar

import numpy as np

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.work.chunks import map_chunks
from mechdesign.questions.reliability.engine.problem import Estimate
from mechdesign.questions.reliability.question import ReliabilityQuestion
from mechdesign.questions.reliability.schema.methods import METHODS
from mechdesign.questions.reliability.simulation import Setting
from mechdesign.questions.reliability.task import MethodResult, Partial, Task

Value = TypeVar("Value")

# Name of the stream of random numbers of searches for design points.
SEARCH = 1


def run(name: str, task: Task) -> MethodResult:
    """The result of a method, with its name.

    Raises
    ------
    Partial
        On an interrupt, with the result so far.
    """
    try:
        result: MethodResult = import_module(METHODS[name].place).run(task)
    except Partial as error:
        raise Partial(replace(error.result, method=name)) from None
    return replace(result, method=name)


def normal(task: Task, mean: Floats, covariance: Floats) -> MethodResult:
    """Result for normal errors with these means, shape (channels, poses), and covariances, (poses, channels, channels).

    The channels are those of the linear model's `whole`. Its estimates have no interval but that of limits
    whose common probability is sampled.
    """
    estimates = of_normal(task, task.question, mean, covariance) if task.question.limits else {}
    return MethodResult(estimates, normal=(mean, covariance))


def of_normal(task: Task, question: ReliabilityQuestion, mean: Floats, covariance: Floats) -> dict[int, Estimate]:
    """Estimates by pose from normal errors as of `normal`, for the limits of a question about the task's channels.

    A mechanism that cannot be assembled is a failure.
    """
    # SciPy takes a quarter of a second to import, and a study without limits does not need it.
    from mechdesign.questions.reliability.probability import made_failure

    rows = np.flatnonzero(task.assembled)
    question = question.take(rows).at(task.nominal[:, rows])
    linear, closing = task.linear.take(rows), task.closing.take(rows)
    values = np.stack(made_failure(linear, closing, question.limits, mean.T[rows], covariance[rows]))
    return {pose: Estimate(value, max(value - doubt, 0.0), min(value + doubt, 1.0), 0)
            for pose, (value, doubt) in zip(rows.tolist(), values.T.tolist(), strict=True)}  # fmt: skip


def pose_by_pose(task: Task, work: Callable[[Task, Setting], MethodResult]) -> MethodResult:
    """Results of `work`, a function of a module, at all poses; an interrupt keeps the poses that are finished.

    Moments of normal errors are not put together here but by `of_moments`.
    """
    result = MethodResult()
    try:
        for _, part in _at_poses(task, work):
            result.add(part)
    except KeyboardInterrupt:
        raise Partial(result) from None
    return result


def of_moments(task: Task, work: Callable[[Task, Setting], tuple[Floats, Floats]]) -> MethodResult:
    """Result as of `normal`, from the mean, shape (channels,), and the covariance by `work`, as `pose_by_pose`."""
    mean = np.full((len(task.question.rows), task.poses.count), np.nan)
    covariance = np.full((task.poses.count, len(mean), len(mean)), np.nan)
    try:
        for pose, (middle, spread) in _at_poses(task, work):
            mean[:, pose], covariance[pose] = middle, spread
    except KeyboardInterrupt:
        raise Partial(normal(task, mean, covariance)) from None
    return normal(task, mean, covariance)


def _at_poses(task: Task, work: Callable[[Task, Setting], Value]) -> Iterator[tuple[int, Value]]:
    """Each pose with the value of `work`, spread over the task's jobs."""
    task.progress.start(len(task.settings), "poses")
    values = map_chunks(partial(_at, work, task), range(len(task.settings)), task.jobs, travels=True)
    for setting, value in zip(task.settings, values, strict=True):
        yield setting.pose, value
        task.progress.update(1)


def _at(work: Callable[[Task, Setting], Value], task: Task, place: int) -> Value:
    return work(task, task.settings[place])
