"""Scrambled Sobol points, in replicates that give the interval."""

from __future__ import annotations

from dataclasses import replace

from mechdesign.analyses.reliability.engine import quasi
from mechdesign.analyses.reliability.methods import QUASI, pose_by_pose
from mechdesign.analyses.reliability.setting import Setting
from mechdesign.analyses.reliability.simulation import Sums, generator, sums_of
from mechdesign.analyses.reliability.task import MethodResult, Task

NAME = "quasi_monte_carlo"


def run(task: Task) -> MethodResult:
    """About as many points as asked at each pose."""
    sources, counts = task.sources, quasi.replicates(task.samples)

    def work(setting: Setting) -> MethodResult:
        seeds = generator(task.seed, setting.pose, QUASI, 0).integers(2**62, size=len(counts))
        parts: list[list[Sums]] = []
        for count, seed in zip(counts, seeds.tolist(), strict=True):
            begun = sum(map(len, parts))
            parts.append([
                sums_of(replace(setting, scale=None), sources.made(sources.at(u)), u.shape[1], begun + block)
                for block, u in enumerate(quasi.points(len(sources.owners), count, seed))
            ])  # fmt: skip
        total = Sums.total([part for replicate in parts for part in replicate])
        # Points that are spread evenly have no trend.
        found = MethodResult(NAME, sums={setting.pose: replace(total, trend=total.trend[:0])})
        if task.question.limited:
            broken = [sum(part.failures for part in replicate) for replicate in parts]
            found.estimates[setting.pose] = quasi.estimate(broken, counts[0], total.samples - total.valid)
        return found

    return pose_by_pose(NAME, task, work)
