"""Speed of evaluating designs: path and function synthesis, stiffness, reliability; memory of a million of them."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.memory import peak_of

import mechdesign
from mechdesign.family.evaluator import Evaluator
from mechdesign.family.goals import goal
from mechdesign.questions.optimize.question import designs_question

CONFIGS = Path(__file__).parents[2] / "configs"
# A coupler point is to follow a rounded triangle, with a point every five degrees of the crank.
PATH = "mechanism.targets.C=[[0.6, 1.9], [1.6, 1.2], [2.6, 1.6], [2.4, 2.4], [1.2, 2.5], [0.6, 1.9]]"


def measure(
    benchmark: Any, path: str, variables: Sequence[str], result: str, designs: int, width: float, *changes: str
) -> None:
    """Designs a second on one processor, about the study's own."""
    ranges = ", ".join(f"{name}: {{from: 0, to: 1, number: 2}}" for name in variables)
    section = f"optimize={{variables: {{{ranges}}}, minimize: [{result}]}}"
    study = mechdesign.load(CONFIGS / path, [section, *changes])
    evaluator = Evaluator(designs_question(study, [goal(result, smallest=True)]))
    rng = np.random.default_rng(1)
    nominal = {name: study.parameters.nominal.get(name, study.mechanism.nominal.get(name)) for name in variables}
    batch = {name: value * (1 + width * rng.uniform(-1, 1, designs)) for name, value in nominal.items()}
    found = benchmark.pedantic(evaluator, (batch,), rounds=3, warmup_rounds=1)
    assert sum(not reason for reason in found.reasons) > designs / 2
    benchmark.extra_info["designs_per_second"] = designs / benchmark.stats.stats.min


@pytest.mark.parametrize("result", ["kinematics.targets.rms", "kinematics.C_error", "kinematics.extremes.C.x.range"])
def test_path_synthesis_designs_a_second(benchmark: Any, result: str) -> None:
    variables = ["crank.length", "coupler.length", "rocker.length", "coupler.C.x", "coupler.C.y"]
    changes = (PATH, "kinematics.rates=", "kinematics.outputs=[C]")
    measure(benchmark, "gallery/four_bar.yaml", variables, result, 10_000, 0.05, *changes)


def test_function_synthesis_designs_a_second(benchmark: Any) -> None:
    variables = ["crank.length", "coupler.length", "follower.length"]
    result = "kinematics.follower.angle_error"
    measure(benchmark, "gallery/function_generator.yaml", variables, result, 10_000, 0.01)


def test_transmission_angles_designs_a_second(benchmark: Any) -> None:
    variables = ["coupler.length", "rocker.length"]
    result = "kinematics.loops.transmission_min"
    measure(benchmark, "gallery/four_bar.yaml", variables, result, 2_000, 0.05, "kinematics.rates=")


@pytest.mark.parametrize("path", ["planar_3rpr.yaml", "five_bar.yaml"])
def test_stiffness_designs_a_second(benchmark: Any, path: str) -> None:
    places = [name for name in mechdesign.load(CONFIGS / path).mechanism.nominal if name.endswith((".length", "B1.x"))]
    measure(benchmark, path, places[:2], "stiffness.k_min", 20_000, 0.05)


@pytest.mark.parametrize(("result", "designs"), [("moments.sigma", 2_000), ("reliability", 200)])
def test_first_order_reliability_designs_a_second(benchmark: Any, result: str, designs: int) -> None:
    places = ["lower_1.length", "upper_2.length"]
    result, methods = f"reliability.{result}", "reliability.methods=analytic"
    measure(benchmark, "five_bar.yaml", places, result, designs, 0.05, methods)


@pytest.mark.skipif(not hasattr(os, "wait4"), reason="the peak memory of a process is told by POSIX")
def test_memory_of_a_million_designs(benchmark: Any, tmp_path: Path) -> None:
    """A grid from end to end, with its tables, pictures and journal."""
    ranges = {"crank.length": (0.8, 1.2, 16), "coupler.length": (3.2, 4.2, 16), "coupler.C.x": (1, 3, 62),
              "coupler.C.y": (0.5, 2, 63)}  # fmt: skip
    variables = ", ".join(f"{name}: {{from: {a}, to: {b}, number: {n}}}" for name, (a, b, n) in ranges.items())
    section = f"optimize={{variables: {{{variables}}}, minimize: [kinematics.C_error, kinematics.targets.rms]}}"
    poses = "kinematics={poses: [{crank: 30}, {crank: 60}, {crank: 90}, {crank: 120}], outputs: [C]}"
    changes = [part for change in (PATH, poses, section) for part in ("--set", change)]
    command = [sys.executable, "-m", "mechdesign", "optimize", str(CONFIGS / "gallery" / "four_bar.yaml"), *changes]

    peak = benchmark.pedantic(lambda: peak_of([*command, "--out", str(tmp_path)]), rounds=1)
    benchmark.extra_info["peak_megabytes"] = peak / 1e6
    with (tmp_path / "designs.csv").open() as lines:
        assert sum(1 for _ in lines) == 16 * 16 * 62 * 63 + 1
    assert peak < 500e6
