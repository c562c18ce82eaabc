"""Plain simulation of made mechanisms."""

from __future__ import annotations

from mechdesign.questions.reliability.simulation import Sums, simulate
from mechdesign.questions.reliability.task import MethodResult, Partial, Task


def run(task: Task) -> MethodResult:
    """`samples` of the study at each pose; an interrupt keeps the samples drawn so far."""
    sums: dict[int, Sums] = {}
    task.progress.start(len(task.settings) * task.samples, "samples")
    try:
        for pose, part in simulate(task.settings, task.sources, task.seed, task.samples, task.jobs):
            sums[pose] = sums[pose] + part if pose in sums else part
            task.progress.update(part.samples)
    except KeyboardInterrupt:
        raise Partial(_result(task, sums)) from None
    return _result(task, sums)


def _result(task: Task, sums: dict[int, Sums]) -> MethodResult:
    estimates = {pose: part.estimate for pose, part in sums.items()} if task.question.limits else {}
    return MethodResult(estimates, sums)
