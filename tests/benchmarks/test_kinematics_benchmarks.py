"""Speed of kinematics: closed forms with their derivatives, groups solved by Newton's method, and single poses.

Populations of designs, in processor time a design, stand beside a closed form of the same written in NumPy by hand.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from floors import ends_of_turns, five_bar_ranges
from helpers.memory import peak_of
from helpers.studies import study_of

import mechdesign
from mechdesign.door.report.tables import csv_blocks
from mechdesign.family.evaluator import Evaluator
from mechdesign.family.stacked import at_poses
from mechdesign.ground.work.chunks import map_chunks
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.plan import THREAD_CHUNK
from mechdesign.questions.kinematics.analysis import kinematics
from mechdesign.questions.optimize.question import designs_question
from mechdesign.questions.poses import study_poses
from mechdesign.study import Study
from mechdesign.study.designs import Designs

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


DESIGNS = 100
LENGTHS = ("crank.length", "rod.length", "rocker.length")
TURN = """
kinematics:
  sweep: {crank: {from: 0, to: 360, step: 5}}
  outputs: [C, rocker.angle, mu]
"""
MEASURED = (
    FOUR_BAR.replace("rod: [A, B, 3.5]", "rod: {from: A, to: B, length: 3.5, points: {C: [1.75, 1.5]}}").replace(
        "theta: {angle: crank}", "crank: {angle: crank}"
    )
    + "  measures: {mu: {angle: [rod, rocker]}}\n"
)
FIVE_BAR = """
mechanism:
  links:
    ground: {B1: [100, 0], B2: [-100, 0]}
    lower_1: [B1, D1, 100]
    upper_1: [D1, C, 215]
    lower_2: [B2, D2, 100]
    upper_2: [D2, C, 215]
  drives: {phi1: {angle: lower_1}, phi2: {angle: lower_2}}
  sketch: {D1: [170, 72], D2: [-170, 72], C: [0, 205]}
kinematics:
  sweep: {C.x: {from: 0, to: 0, number: 1}, C.y: {from: 160, to: 250, number: 91}}
  outputs: [C, lower_1.angle]
"""


def population(names: Sequence[str], study: Study, width: float = 0.05) -> dict[str, np.ndarray]:
    random = np.random.default_rng(1)
    return {name: study.mechanism.nominal[name] * (1 + width * random.uniform(-1, 1, DESIGNS)) for name in names}


def processor_time(work: Callable[[], object], rounds: int = 7) -> float:
    """Least processor time of some rounds, in ms a design."""
    spent = []
    for _ in range(rounds):
        begin = time.process_time()
        work()
        spent.append(time.process_time() - begin)
    return 1e3 * min(spent) / DESIGNS


def evaluated(text: str, names: Sequence[str], minimised: str, condition: str) -> tuple[Evaluator, Mapping[str, Any]]:
    ranges = ", ".join(f"{name}: {{from: 0, to: 1, number: 2}}" for name in names)
    section = f"optimize={{variables: {{{ranges}}}, minimize: [{minimised}], subject_to: [{condition}]}}"
    study = study_of(text, section)
    return Evaluator(designs_question(study)), population(names, study)


def test_ends_of_a_turn_of_many_designs(benchmark: Any) -> None:
    """At most 0.3 ms a design: a range, a time ratio and the least transmission angle of a four-bar's turn."""
    goals = "kinematics.extremes.C.x.range, kinematics.extremes.rocker.angle.time_ratio"
    evaluator, batch = evaluated(MEASURED + TURN, LENGTHS, goals, "{result: kinematics.mu, at_least: 20}")
    found = benchmark.pedantic(evaluator, (batch,), rounds=3, warmup_rounds=1)
    assert not any(found.reasons)
    floor = ends_of_turns(*batch.values())
    np.testing.assert_allclose(found.table[:, 0], floor[0], rtol=1e-6)
    benchmark.extra_info["ms_a_design"] = processor_time(lambda: evaluator(batch))
    benchmark.extra_info["floor_ms_a_design"] = processor_time(lambda: ends_of_turns(*batch.values()))


def test_a_sweep_of_a_five_bar_of_many_designs(benchmark: Any) -> None:
    """At most 0.3 ms a design: 91 poses over three lengths, with what lies between the poses."""
    names = ("lower_1.length", "upper_1.length", "lower_2.length")
    goal, condition = "kinematics.extremes.lower_1.angle.range", "{result: kinematics.inverse_condition, at_least: 0}"
    text = FIVE_BAR.replace("outputs: [C, lower_1.angle]", "outputs: [C, lower_1.angle]\n  jacobian: [C]")
    evaluator, batch = evaluated(text, names, goal, condition)
    found = benchmark.pedantic(evaluator, (batch,), rounds=3, warmup_rounds=1)
    assert not any(found.reasons)
    floor = five_bar_ranges(*batch.values())
    assert (found.table[:, 0] >= floor - 1e-9).all()
    np.testing.assert_allclose(found.table[:, 0], floor, rtol=1e-2)
    benchmark.extra_info["ms_a_design"] = processor_time(lambda: evaluator(batch))
    benchmark.extra_info["floor_ms_a_design"] = processor_time(lambda: five_bar_ranges(*batch.values()))


def test_all_tables_of_many_designs(benchmark: Any) -> None:
    """At most 1.5 ms a design: every table, count and warning of a four-bar's turn; beside that one by one."""
    study = study_of(MEASURED + TURN + "  rates: {crank: 1 rad/s}\n")
    designs = population(LENGTHS, study)
    poses = study_poses(study, "kinematics", Designs(study, designs).numbers)
    found = benchmark.pedantic(at_poses, (study, "kinematics", poses), rounds=3, warmup_rounds=1)
    assert all({"motion", "extremes", "limits", "loops", "toggles"} <= set(group.result.tables) for group in found)
    benchmark.extra_info["ms_a_design"] = processor_time(lambda: at_poses(study, "kinematics", poses))
    benchmark.extra_info["alone_ms"] = DESIGNS * processor_time(lambda: kinematics(study))


def test_single_studies(benchmark: Any) -> None:
    """At most 25 ms in the median over the shipped studies: a single small study in a process."""
    studies = [mechdesign.load(path) for path in sorted(CONFIGS.rglob("*.yaml"))]
    studies = [study for study in studies if study.kinematics is not None]
    benchmark.pedantic(lambda: [kinematics(study) for study in studies], rounds=2, warmup_rounds=1)
    each = [DESIGNS * processor_time(partial(kinematics, study), 3) for study in studies]
    benchmark.extra_info["median_ms"] = float(np.median(each))
