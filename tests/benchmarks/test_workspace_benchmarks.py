"""All designs of the 2-RRR's grid, beside brute force in C where a compiler and its source are at hand."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import mechdesign

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
