"""What executors cost: processor time and waiting beyond the chunks' own time, once the workers are up.

MECHDESIGN_SAMPLES and MECHDESIGN_DESIGNS say how many; a cluster's figures are of 10^9 and 10^6.
"""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

import pytest

import mechdesign
from mechdesign.door.report.tables import to_csv
from mechdesign.ground.work.chunks import on
from mechdesign.ground.work.executors import named
from mechdesign.ground.work.pool import ChunkMap

CONFIGS = Path(__file__).parents[2] / "configs"
SAMPLES = int(float(os.environ.get("MECHDESIGN_SAMPLES", "2e7")))
DESIGNS = int(float(os.environ.get("MECHDESIGN_DESIGNS", "2e4")))
WORKERS = 2
DASK = "dask:local"


def arm(samples: int) -> Any:
    changes = ["reliability.poses=[{theta1: 30, theta2: 60}]", "reliability.methods=[monte_carlo]"]
    return mechdesign.load(CONFIGS / "two_link_arm.yaml", [*changes, f"reliability.samples={samples}"])


def generator(designs: int) -> Any:
    each = round(designs**0.5)
    spread = f"{{from: 80, to: 90, number: {each}}}"
    bounds = f"{{rod.length: {spread}, ground.D.x: {spread}}}"
    text = f"""
    mechanism:
      links: {{ground: {{O: [0, 0], D: [100, 0]}}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}}
      drives: [crank]
      sketch: {{A: [0, 30], B: [75, 55]}}
    kinematics: {{sweep: {{crank: {{from: 0, to: 360, step: 5}}}}, outputs: [rocker.angle]}}
    optimize: {{variables: {bounds}, method: grid, maximize: [kinematics.loops.transmission_min]}}
    """
    return mechdesign.load(text=text)


@pytest.fixture
def seconds(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Lengths of the tasks, in the workers."""
    found: list[float] = []
    before = ChunkMap._values

    def heard(self: Any, task: Any) -> Any:
        values = before(self, task)
        found.append(task.future.result()[1])
        return values

    monkeypatch.setattr(ChunkMap, "_values", heard)
    return found


def busy() -> float:
    """Processor time of this process and those that it started, in seconds."""
    import psutil

    here = psutil.Process()
    times = [each.cpu_times() for each in (here, *here.children(recursive=True))]
    return sum(each.user + each.system for each in times)


@pytest.mark.parametrize("executor", [DASK, "concurrent.futures:ProcessPoolExecutor"])
@pytest.mark.parametrize(
    ("command", "make", "number"), [("reliability", arm, SAMPLES), ("optimize", generator, DESIGNS)]
)
def test_overhead(
    command: str, make: Any, number: int, executor: str, seconds: list[float], capsys: Any
) -> None:  # fmt: skip
    ask, study = getattr(mechdesign, command), make(number)
    begun = time.process_time()
    expected = ask(study, jobs=1)
    alone = time.process_time() - begun
    with on(named(executor, WORKERS)):
        # Workers come up.
        ask(make(number // 10))
        seconds.clear()
        before, begun = busy(), time.perf_counter()
        found = ask(study)
        used, wall = busy() - before, time.perf_counter() - begun
    assert to_csv(found.main) == to_csv(expected.main)
    with capsys.disabled():
        print(
            f"\n{command} of {number} on {executor}: "
            f"{alone:.1f} s of processor alone, {used:.1f} s there ({used / alone - 1:+.1%}); "
            f"{wall:.1f} s by the clock, the {len(seconds)} tasks' own {sum(seconds) / WORKERS:.1f} s "
            f"({wall * WORKERS / sum(seconds) - 1:+.1%}), the median task {sorted(seconds)[len(seconds) // 2]:.2f} s"
        )
