"""All designs of the 2-RRR's grid, single regions, and batches of them."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.studies import FIVE_BAR, study_of

import mechdesign
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.ground.results import Result
from mechdesign.questions.workspace.answer import answer
from mechdesign.questions.workspace.local import Local
from mechdesign.questions.workspace.question import questions
from mechdesign.region.rays import BATCH, Scanned

STUDY = Path(__file__).parents[2] / "configs" / "two_rrr.yaml"
DESIGNS = 4556


def test_all_designs(benchmark: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Processor time of the whole grid to 1e-4, and nodes a design of its integrals."""
    study = mechdesign.load(STUDY)
    nodes, seconds = [], []
    on_rays = Local.on_rays

    def counted(designs: Scanned, design: Ints, theta: Floats, radius: Floats) -> Local:
        nodes.append(radius.size)
        return on_rays(designs, design, theta, radius)

    def all_designs() -> Result:
        begin = time.process_time()
        result = mechdesign.optimize(study, jobs=1)
        seconds.append(time.process_time() - begin)
        return result

    monkeypatch.setattr(Local, "on_rays", staticmethod(counted))
    result = benchmark.pedantic(all_designs, rounds=3)
    assert result.counts["designs"] == DESIGNS
    benchmark.extra_info.update(seconds=min(seconds), nodes_a_design=sum(nodes) / len(seconds) / DESIGNS)


def test_one_region(benchmark: Any) -> None:
    study = mechdesign.load(STUDY)
    benchmark(lambda: mechdesign.workspace(study))


def test_whole_command_with_pictures(benchmark: Any, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "mechdesign", "optimize", str(STUDY), "--quiet", "--out", str(tmp_path)]
    benchmark.pedantic(lambda: subprocess.run(command, check=True, stdout=subprocess.DEVNULL), rounds=3)


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


def test_largest_circles_of_designs(benchmark: Any) -> None:
    """Designs whose goal is the largest circle in their region, as `optimize` evaluates them."""
    variables = "variables: {left.length: {from: 0.23, to: 0.27, number: 24}}, maximize: workspace.circle_radius"
    study = study_of(FIVE_BAR, f"optimize={{{variables}}}")
    result = benchmark.pedantic(lambda: mechdesign.optimize(study, jobs=1), rounds=2, warmup_rounds=1)
    assert np.isfinite(result.tables["designs"]["workspace.circle_radius"]).all()
    benchmark.extra_info.update(milliseconds_a_design=1e3 * benchmark.stats["min"] / 24)
