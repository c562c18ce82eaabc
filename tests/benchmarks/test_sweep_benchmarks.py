"""Sweeps from end to end: processor time a case, and memory; MECHDESIGN_CASES says of how many, such as 1e6."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.memory import peak_of

import mechdesign

CASES = int(float(os.environ.get("MECHDESIGN_CASES", "4e4")))
FOUR_BAR = """
mechanism:
  parameters: {a: 30, c: 60}
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, a], rod: [A, B, 90], rocker: [D, B, c]}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
kinematics: {outputs: [rocker.angle]}
requirements: [{result: kinematics.loops.transmission_min, at_least: 20}]
"""
RANGE, RATIO = "kinematics.extremes.rocker.angle.range", "kinematics.extremes.rocker.angle.time_ratio"


def varied(cases: int) -> dict[str, Any]:
    each = round(cases**0.5)
    return {
        "mechanism.parameters.a": {"from": 20, "to": 40, "number": each},
        "mechanism.parameters.c": {"from": 60, "to": 80, "number": each},
    }


def test_cases_of_a_four_bar(benchmark: Any) -> None:
    """At most 0.5 ms a case: its turn with all warnings, a requirement, a range and a ratio of times."""
    study = mechdesign.load(text=FOUR_BAR, overrides={"matrix": {"vary": varied(CASES), "results": [RANGE, RATIO]}})
    spent = []

    def sweep() -> mechdesign.ground.results.Result:
        begun = time.process_time()
        result = mechdesign.sweep(study)
        spent.append(time.process_time() - begun)
        return result

    table = benchmark.pedantic(sweep, rounds=2).main
    a, c = table["mechanism.parameters.a"], table["mechanism.parameters.c"]

    def at_end(way: np.ndarray) -> np.ndarray:
        """Angle of the rocker from the ground, where crank and rod are so long together."""
        return np.degrees(np.arccos((100**2 + c**2 - way**2) / (2 * 100 * c)))

    np.testing.assert_allclose(table[RANGE], at_end(90 + a) - at_end(90 - a), rtol=1e-9)
    benchmark.extra_info["cpu_ms_a_case"] = 1e3 * min(spent) / len(table)


@pytest.mark.parametrize("cases", [2000, CASES])
def test_time_and_memory_of_a_command(benchmark: Any, tmp_path: Path, cases: int) -> None:
    """At most 5 s of 2,000 cases, and 1 GB of 10^6."""
    study = tmp_path / "study.yaml"
    study.write_text(FOUR_BAR)
    vary = [f"--vary={name}={text}" for name, text in _ranges(cases).items()]
    command = [
        sys.executable, "-m", "mechdesign", "sweep", str(study), *vary, f"--maximize={RANGE}", f"--minimize={RATIO}",
        "--no-plots", "--quiet", "--out", str(tmp_path / "out"),
    ]  # fmt: skip
    peak = benchmark.pedantic(peak_of, (command, 3600), rounds=1)
    rows = (tmp_path / "out/sweep.csv").read_text().count("\n") - 1
    assert rows == round(cases**0.5) ** 2
    assert peak < 1e9
    benchmark.extra_info["megabytes"] = peak / 1e6
    assert cases > 2000 or benchmark.stats.stats.max < 5


def _ranges(cases: int) -> dict[str, str]:
    """The same as `varied`, as options have it."""
    step = 20 / (round(cases**0.5) - 1)
    return {name: f"{each['from']}:{each['to']}:{step!r}" for name, each in varied(cases).items()}
