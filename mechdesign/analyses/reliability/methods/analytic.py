"""First-order errors, normal [S2, S3]."""

from __future__ import annotations

from mechdesign.analyses.reliability.methods import normal
from mechdesign.analyses.reliability.task import MethodResult, Task


def run(task: Task) -> MethodResult:
    """Normal errors of the linear model."""
    return normal("analytic", task, task.linear.shift(), task.linear.covariance())
