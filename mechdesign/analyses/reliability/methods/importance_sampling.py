"""A mixture of normal densities about the design points, that learns where failures lie."""

from __future__ import annotations

from dataclasses import replace

from mechdesign.analyses.reliability.engine.design_points import find
from mechdesign.analyses.reliability.engine.importance import importance_sampling
from mechdesign.analyses.reliability.engine.problem import Estimate
from mechdesign.analyses.reliability.methods import SEARCH, counted, of_limits
from mechdesign.analyses.reliability.setting import Setting, problem_of
from mechdesign.analyses.reliability.simulation import Sums, generator, simulate
from mechdesign.analyses.reliability.task import MethodResult, Task

rung = importance_sampling


def run(task: Task) -> MethodResult:
    """Of every pose; where no failure was seen, plain samples bound what was missed."""

    def work(setting: Setting) -> Estimate:
        problem = problem_of(setting, task.sources)
        rng = generator(task.seed, setting.pose, SEARCH, 1)
        found = importance_sampling(problem, find(problem, rng), rng, task.samples)
        if found.failures:
            return found
        sums: dict[int, Sums] = {}
        simulate([setting], task.sources, task.seed, task.samples, sums)
        found = counted(sums[setting.pose])
        return replace(found, evaluations=found.evaluations + problem.evaluations)

    return of_limits("importance_sampling", task, work)
