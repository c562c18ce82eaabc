"""Tangents of the limits at their design points; no interval is claimed."""

from __future__ import annotations

import numpy as np

from mechdesign.analyses.reliability.engine.design_points import DesignPoints, find
from mechdesign.analyses.reliability.engine.form import form
from mechdesign.analyses.reliability.engine.intervals import Precision
from mechdesign.analyses.reliability.engine.problem import Estimate, Problem
from mechdesign.analyses.reliability.methods import SEARCH, of_limits
from mechdesign.analyses.reliability.setting import Setting, problem_of
from mechdesign.analyses.reliability.simulation import generator
from mechdesign.analyses.reliability.task import MethodResult, Task


def run(task: Task) -> MethodResult:
    """Of every pose."""

    def work(setting: Setting) -> Estimate:
        problem = problem_of(setting, task.sources)
        return form(problem, find(problem, generator(task.seed, setting.pose, SEARCH, 0)))

    return of_limits("form", task, work)


def rung(
    problem: Problem, points: DesignPoints, rng: np.random.Generator, most: int, precision: Precision
) -> Estimate | None:
    """A check of what is sampled about the design points."""
    # The mean of tangents over directions costs more than what it checks.
    return None if len(problem.circles) else form(problem, points)
