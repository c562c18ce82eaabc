"""Speed of kinematics: closed forms with their derivatives, groups solved by Newton's method, and single poses.

pylinkage's compiled stepping of the same four-bar runs beside it where it is installed (`pip install .[benchmark]`).
"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.memory import peak_of
from helpers.studies import study_of

import mechdesign
from mechdesign.analyses.kinematics.analysis import kinematics
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.plan import THREAD_CHUNK
from mechdesign.parallel import map_chunks
from mechdesign.report.tables import csv_blocks

CONFIGS = Path(__file__).parents[2] / "configs"
POSES = 2_000_000
FOUR_BAR = """
mechanism:
  links: {ground: {O: [0, 0], D: [4, 0]}, crank: [O, A, 1], rod: [A, B, 3.5], rocker: [D, B, 3]}
  drives: {theta: {angle: crank}}
  sketch: {A: [0.5, 0.87], B: [3.3, 2.9]}
"""
SIX_BAR = """
mechanism:
  links:
    ground: {O: [0, 0], D: [4, 0], G: [8, 0]}
    crank: [O, A, 1]
    rod: [A, B, 3.5]
    rocker: [D, B, 3]
    link: [B, F, 4]
    last: [G, F, 3]
  drives: {theta: {angle: crank}}
  sketch: {A: [0.5, 0.87], B: [3.3, 2.9], F: [7.3, 3]}
"""


def angles() -> np.ndarray:
    return np.random.default_rng(0).uniform(-math.pi, math.pi, POSES)


@pytest.mark.parametrize("text", [FOUR_BAR, SIX_BAR], ids=["four_bar", "six_bar"])
def test_positions_a_second(benchmark: Any, text: str) -> None:
    mechanism = study_of(text).mechanism
    found = benchmark.pedantic(mechanism.forward.solve, ([angles()],), {"jobs": 2}, rounds=7, warmup_rounds=1)
    assert found.valid.all()
    benchmark.extra_info["poses_per_second"] = POSES / benchmark.stats.stats.min


def test_velocities_and_accelerations_a_second(benchmark: Any) -> None:
    mechanism = study_of(FOUR_BAR).mechanism
    theta = angles()

    def chunk(begin: int) -> None:
        linear = mechanism.linearize(mechanism.forward.solve([theta[begin : begin + THREAD_CHUNK]]))
        velocity = linear.velocity([1.0])
        linear.acceleration(velocity, [0.0])

    def whole() -> None:
        for _ in map_chunks(chunk, range(0, POSES, THREAD_CHUNK), 2):
            pass

    benchmark.pedantic(whole, rounds=7, warmup_rounds=1)
    benchmark.extra_info["poses_per_second"] = POSES / benchmark.stats.stats.min


def test_all_tables_of_a_fine_sweep(benchmark: Any) -> None:
    study = study_of(FOUR_BAR + "kinematics: {sweep: {theta: {from: 0, to: 360, number: 1000001}}}\n")
    result = benchmark.pedantic(kinematics, (study,), {"jobs": 2}, rounds=7, warmup_rounds=1)
    assert {"motion", "extremes", "limits", "loops", "toggles"} <= set(result.tables)
    benchmark.extra_info["poses_per_second"] = 1_000_001 / benchmark.stats.stats.min


def test_tables_of_a_fine_sweep_as_text(benchmark: Any) -> None:
    number = 500_001
    study = study_of(FOUR_BAR + f"kinematics: {{sweep: {{theta: {{from: 0, to: 360, number: {number}}}}}}}\n")
    table = kinematics(study).main
    size = benchmark.pedantic(lambda: sum(map(len, csv_blocks(table))), rounds=5, warmup_rounds=1)
    assert size > 100 * number
    benchmark.extra_info["rows_per_second"] = number / benchmark.stats.stats.min


def test_memory_of_ten_million_poses(tmp_path: Path) -> None:
    study = tmp_path / "study.yaml"
    study.write_text(FOUR_BAR + "kinematics: {sweep: {theta: {from: 0, to: 360, number: 10000000}}}\n")
    command = [sys.executable, "-m", "mechdesign", "kinematics", str(study), "--quiet", "--out", str(tmp_path / "out")]
    assert peak_of(command) < 1e9


def test_pylinkage_steps_a_second(benchmark: Any) -> None:
    pylinkage = pytest.importorskip("pylinkage")
    o, d = pylinkage.Ground(0.0, 0.0, name="O"), pylinkage.Ground(4.0, 0.0, name="D")
    crank = pylinkage.Crank(anchor=o, radius=1.0, angular_velocity=0.01, name="A")
    pin = pylinkage.RRRDyad(anchor1=crank.output, anchor2=d, distance1=3.5, distance2=3.0, name="B")
    linkage = pylinkage.Linkage([o, d, crank, pin])
    places = benchmark.pedantic(linkage.step_fast, (POSES,), rounds=7, warmup_rounds=1)
    assert np.isfinite(places).all()
    benchmark.extra_info["poses_per_second"] = POSES / benchmark.stats.stats.min


def platform_drives(mechanism: Mechanism, count: int) -> list[np.ndarray]:
    """Leg lengths for random poses about the sketch."""
    random = np.random.default_rng(0)
    pose = ("P.x", "P.y", "platform.angle")
    middle = [float(mechanism.sketch_configuration.value(mechanism.coordinate(name))) for name in pose]
    found = mechanism.plan(pose).solve([value + random.uniform(-0.2, 0.2, count) for value in middle])
    return [np.asarray(found.value(mechanism.coordinate(name))) for name in mechanism.drives]


def test_three_rpr_forward_poses_a_second(benchmark: Any) -> None:
    mechanism = mechdesign.load(CONFIGS / "planar_3rpr.yaml").mechanism
    count = 500_000
    given = platform_drives(mechanism, count)
    found = benchmark.pedantic(mechanism.forward.solve, (given,), {"jobs": 2}, rounds=5, warmup_rounds=1)
    assert found.valid.all()
    benchmark.extra_info["poses_per_second"] = count / benchmark.stats.stats.min


def test_one_pose(benchmark: Any) -> None:
    mechanism = study_of(FOUR_BAR).mechanism
    pose = benchmark(mechanism.solve, {"theta": 60})
    assert float(pose["rocker.angle"]) == pytest.approx(102.890327, abs=5e-7)
