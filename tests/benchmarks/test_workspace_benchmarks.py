"""All designs of the 2-RRR's grid, beside brute force in C where a compiler and its source are at hand."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign
from mechdesign.analyses.region.rays import BATCH
from mechdesign.analyses.workspace.question import answer, questions

STUDY = Path(__file__).parents[2] / "configs" / "two_rrr.yaml"
DESIGNS = 4556


@pytest.fixture(scope="session")
def floor(compiled: Callable[[str], Path]) -> float:
    """Seconds of the C program's 200 x 300 midpoint nodes a design, on two threads."""
    seconds = []
    program = str(compiled("workspace_sums"))
    for _ in range(3):
        said = subprocess.run([program], capture_output=True, text=True, check=True).stdout
        found = re.search(r"designs ([\d.]+) s", said)
        assert found is not None
        seconds.append(float(found[1]))
    return min(seconds)


def test_all_designs_against_c(benchmark: Any, floor: float) -> None:
    study = mechdesign.load(STUDY)
    result = benchmark.pedantic(lambda: mechdesign.optimize(study, jobs=2), rounds=3)
    assert result.counts["designs"] == DESIGNS
    benchmark.extra_info.update(seconds=benchmark.stats["min"], of_the_floor=benchmark.stats["min"] / floor)


def test_one_region(benchmark: Any) -> None:
    study = mechdesign.load(STUDY)
    benchmark(lambda: mechdesign.workspace(study))


def test_whole_command_with_pictures(benchmark: Any, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "mechdesign", "optimize", str(STUDY), "--quiet", "--out", str(tmp_path)]
    benchmark.pedantic(lambda: subprocess.run(command, check=True, stdout=subprocess.DEVNULL), rounds=3)


FIVE_BAR = """
units: {length: m}
mechanism:
  links:
    ground: {A: [-0.15, 0], B: [0.15, 0]}
    left: [A, D, 0.25]
    left_rod: [D, P, 0.40]
    right: [B, E, 0.25]
    right_rod: [E, P, 0.40]
  drives: {q1: {angle: left}, q2: {angle: right}}
  sketch: {D: [-0.38, 0.1], E: [0.38, 0.1], P: [0.05, 0.45]}
workspace: {point: P, assembly: any}
"""
SOME = 384


@pytest.mark.parametrize("assembly", ["any", "same"])
@pytest.mark.parametrize("wanted", [("GII", "GRI", "SUI", "area"), None], ids=["indices", "statistics"])
def test_regions_of_five_bars(benchmark: Any, assembly: str, wanted: tuple[str, ...] | None) -> None:
    """Boundary, area and indices to 1e-4, or all statistics of all indices, in a batch as `optimize` evaluates it."""
    study = study_of(FIVE_BAR, f"workspace.assembly={assembly}")
    question = questions(study, 1e-4, wanted)[0]
    rods = np.linspace(0.36, 0.44, SOME)
    places = {"left_rod.length": rods, "right_rod.length": rods}
    given = benchmark.pedantic(lambda: answer(question, places, SOME, BATCH), rounds=3, warmup_rounds=1)
    assert (given.errors["area"] <= 1e-6 * given.values["area"]).all()
    benchmark.extra_info.update(milliseconds_a_design=1e3 * benchmark.stats["min"] / SOME)
