"""What pictures of errors need besides the tables: samples at one pose, and the first order between the poses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.ground.results import Drawn, Table
from mechdesign.motion.finer import finer
from mechdesign.motion.question import PoseValues
from mechdesign.motion.rows import Poses
from mechdesign.motion.solving import curve_with
from mechdesign.questions.reliability import methods
from mechdesign.questions.reliability.errors import linear_task
from mechdesign.questions.reliability.limits import ErrorBound
from mechdesign.questions.reliability.simulation import Sums
from mechdesign.questions.reliability.tables import judged
from mechdesign.questions.reliability.task import Strings, Task

#: The method whose values are cheap between the poses as well.
FIRST_ORDER = "analytic"
# Probabilities below this are drawn by none.
_LEAST = 1e-16


@dataclass(frozen=True, eq=False)
class Samples:
    """Errors of sampled mechanisms at the pose that is shown, in the study's units.

    Parameters
    ----------
    outputs, orders, units : ndarray of str, shape (channels,)
    errors : ndarray, shape (channels, n)
        Errors of the samples that can be assembled.
    kept : ndarray of bool, shape (n,)
        Whether a sample keeps every limit.
    limits
        Those of errors.
    pair : (int, int) or None
        The two channels whose density is drawn.
    mean, covariance : ndarray, shapes (channels,) and (channels, channels)
        Mean and covariance of the errors to the first order.
    """

    pose: int
    outputs: Strings
    orders: Strings
    units: Strings
    errors: Floats
    kept: Flags
    limits: tuple[ErrorBound, ...]
    pair: tuple[int, int] | None
    mean: Floats
    covariance: Floats


@dataclass(frozen=True, eq=False)
class DrawnErrors(Drawn):
    """The poses at which errors were asked, and samples at one of them; None where no method samples errors.

    `limits` are the lowest and highest error of each limited output and order, of a circle for both coordinates of its
    point, in the study's units; numbers or arrays of poses. `values` is what the first order has at the poses.
    """

    poses: Poses
    samples: Samples | None
    limits: Mapping[tuple[str, str], tuple[ArrayLike, ArrayLike]]
    values: PoseValues

    @cached_property
    def finer(self) -> tuple[Self, Mapping[str, Table]]:
        """The same along a motion with as many poses as curves need, and the tables of the first order there."""
        values, poses = self.values, self.poses
        if poses.followed and poses.designs == 1:
            curve = curve_with(values.question.motion, values.question.watched)
            if not curve.spent.any():
                values = finer(values.question, curve, poses.numbers, values, _columns)[1]
        task = linear_task(values)
        made = {table.name: table for table in judged(task, [methods.run(FIRST_ORDER, task)], {})}
        return replace(self, poses=task.poses, limits=_limits(task), values=values), made


def _columns(values: PoseValues) -> dict[str, Floats]:
    """Means, deviations and powers of ten of the probability of failure, to the first order."""
    task = linear_task(values)
    mean, sigma = task.linear.shift(), task.linear.deviation()
    columns = {f"{name} {k}": row for name, rows in (("mean", mean), ("sigma", sigma)) for k, row in enumerate(rows)}
    if task.question.limits:
        failure = np.full(task.poses.count, np.nan)
        for pose, estimate in methods.run(FIRST_ORDER, task).estimates.items():
            failure[pose] = estimate.failure
        columns["failure"] = np.log10(np.maximum(failure, _LEAST))
    return columns


def drawn_errors(task: Task, values: PoseValues, sums: Mapping[int, Sums]) -> DrawnErrors:
    """What pictures show of a task, the first order at its poses, and its samples, by pose."""
    return DrawnErrors(task.poses, _samples(task, sums), _limits(task), values)


def _limits(task: Task) -> dict[tuple[str, str], tuple[ArrayLike, ArrayLike]]:
    output, order, _ = task.labels
    return {
        (str(output[k]), str(order[k])): (low * task.scale[k], high * task.scale[k])
        for limit in task.question.at(task.nominal).limits
        for k, low, high in limit.box
    }


def _samples(task: Task, sums: Mapping[int, Sums]) -> Samples | None:
    """The samples that pictures show; None where no errors are drawn."""
    setting = next((setting for setting in task.settings if setting.followed), None)
    if setting is None or setting.pose not in sums or not sums[setting.pose].kept.size:
        return None
    pose, question, scale, errors = setting.pose, setting.question, task.scale, sums[setting.pose].kept
    limits = (replace(limit, low=limit.low * scale[limit.output], high=limit.high * scale[limit.output])
              for limit in question.limits)  # fmt: skip
    return Samples(
        pose, *task.labels, errors * scale[:, None], np.logical_and.reduce(question.kept(errors)), tuple(limits),
        question.pair, task.linear.shift()[:, pose] * scale, task.linear.covariance()[pose] * np.outer(scale, scale),
    )  # fmt: skip
