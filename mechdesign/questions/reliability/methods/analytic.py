"""First-order errors, normal [S2, S3]."""

from __future__ import annotations

from mechdesign.questions.reliability.methods import normal
from mechdesign.questions.reliability.task import MethodResult, Task


def run(task: Task) -> MethodResult:
    """Normal errors of the linear model."""
    return normal(task, task.linear.whole.shift(), task.linear.whole.covariance())
