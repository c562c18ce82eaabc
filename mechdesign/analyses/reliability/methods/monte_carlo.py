"""Plain simulation of made mechanisms."""

from __future__ import annotations

from mechdesign.analyses.reliability.simulation import Sums, simulate
from mechdesign.analyses.reliability.task import MethodResult, Partial, Task


def run(task: Task) -> MethodResult:
    """As many samples as asked at each pose; an interrupt leaves what was drawn so far."""
    sums: dict[int, Sums] = {}
    task.progress.start(len(task.settings) * task.samples, "samples")
    try:
        simulate(task.settings, task.sources, task.seed, task.samples, sums, task.jobs, task.progress)
    except KeyboardInterrupt:
        raise Partial(_found(task, sums)) from None
    return _found(task, sums)


def _found(task: Task, sums: dict[int, Sums]) -> MethodResult:
    estimates = {pose: each.estimate for pose, each in sums.items()} if task.question.limited else {}
    return MethodResult("monte_carlo", estimates, sums)
