"""The cheapest method that reaches the precision asked; moments from its plain samples."""

from __future__ import annotations

from importlib import import_module

from mechdesign.analyses.reliability.engine import ladder
from mechdesign.analyses.reliability.engine.problem import Estimate
from mechdesign.analyses.reliability.methods import SEARCH, counted, pose_by_pose
from mechdesign.analyses.reliability.setting import Setting, problem_of
from mechdesign.analyses.reliability.simulation import Sums, generator, simulate_chunk
from mechdesign.analyses.reliability.task import MethodResult, Task
from mechdesign.study.schema.methods import METHODS


def rungs() -> dict[str, ladder.Rung]:
    """Of the methods that are declared as steps, in their order."""
    steps = sorted((method for method in METHODS.values() if method.step), key=lambda method: method.step)
    return {method.name: import_module(method.place).rung for method in steps}


def run(task: Task) -> MethodResult:
    """Plain samples first, then the steps, until one is precise enough."""
    steps = rungs()

    def work(setting: Setting) -> MethodResult:
        drawn: list[Sums] = []

        def plain(count: int) -> Estimate:
            while (have := sum(part.samples for part in drawn)) < count:
                # The first chunk is the pilot, the following ones are whole.
                size = min(ladder.PILOT if not drawn else ladder.FEW, count - have)
                drawn.append(simulate_chunk(setting, task.sources, task.seed, len(drawn), size))
            return counted(Sums.total(drawn))

        if not task.question.limited:
            plain(min(ladder.FEW, task.most))
            return MethodResult("auto", sums={setting.pose: Sums.total(drawn)})
        rng = generator(task.seed, setting.pose, SEARCH, 2)
        # Where nothing else helps, plain samples are as many all told.
        problem, shared = problem_of(setting, task.sources), max(ladder.FEW, task.most // task.poses.count)
        estimate, used, said = ladder.climb(problem, task.precision, plain, steps, rng, task.most, shared)
        pose = setting.pose
        return MethodResult("auto", {pose: estimate}, {pose: Sums.total(drawn)}, {pose: used}, {pose: said})

    return pose_by_pose("auto", task, work)
