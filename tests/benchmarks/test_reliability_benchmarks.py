"""Samples a second of plain Monte Carlo, what rare failures cost, and the first order of many designs."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmark_rows import PRECISE
from floors import five_bar_deviations
from helpers.memory import peak_of

import mechdesign
from mechdesign.family.evaluator import Evaluator
from mechdesign.family.goals import goal
from mechdesign.questions.optimize.question import designs_question

CONFIGS = Path(__file__).parents[2] / "configs"
ARM_SAMPLES = 2_000_000


def arm(samples: int) -> Any:
    changes = [
        f"reliability.samples={samples}",
        "reliability.poses=[{theta1: 30, theta2: 60}]",
        "reliability.methods=[monte_carlo]",
    ]
    return mechdesign.load(CONFIGS / "two_link_arm.yaml", overrides=changes)


def processor() -> float:
    """Processor time of this process and of those that it waited for, in seconds."""
    return sum(os.times()[:4])


def test_two_workers_beside_one(benchmark: Any) -> None:
    """By turns, the best of each: by the clock, which others on the machine disturb, and by processor time."""
    study = arm(5 * ARM_SAMPLES)
    spent: dict[int, list[tuple[float, float]]] = {1: [], 2: []}

    def ask() -> None:
        for jobs, times in spent.items():
            begun = time.perf_counter(), processor()
            mechdesign.reliability(study, jobs=jobs)
            times.append((time.perf_counter() - begun[0], processor() - begun[1]))

    benchmark.pedantic(ask, rounds=3)
    (wall, alone), (wall_of_two, of_two) = (map(min, zip(*times, strict=True)) for times in spent.values())
    benchmark.extra_info.update(
        times_one_by_the_clock=wall / wall_of_two,
        times_one_by_processor_time=2 * alone / of_two,
        samples_per_second_of_a_worker=5 * ARM_SAMPLES / of_two,
    )


def limited(limit: float, precision: float) -> Any:
    changes = [
        f"reliability.limits={{P.x: {limit}, P.y: {limit}}}",
        "reliability.poses=[{theta1: 30, theta2: 60}]",
        "reliability.methods=[auto]",
        f"reliability.precision={precision}",
        "reliability.samples=2000000",
    ]
    return mechdesign.load(CONFIGS / "two_link_arm.yaml", overrides=changes)


def spent(result: Any) -> dict[str, float]:
    """Evaluations, and the coefficient of variation: half of an interval at 99.7 % is 2.97 of them."""
    table = result.tables["reliability"]
    width = table["failure_high"][0] - table["failure_low"][0]
    return {
        "evaluations": int(table["evaluations"][0]),
        "coefficient_of_variation": float(width / (2 * 2.97 * table["failure"][0])),
    }


# Exact failure probabilities of the arm; what plain Monte Carlo needs follows from them.
@pytest.mark.parametrize(("limit", "exact", "precision"), [
    (0.10, 1.6566e-9, 0.05), (0.05, 6.5387526e-3, 0.01),
])  # fmt: skip
def test_auto(benchmark: Any, limit: float, exact: float, precision: float) -> None:
    study = limited(limit, precision)
    benchmark.pedantic(lambda: mechdesign.reliability(study), rounds=5, warmup_rounds=1)
    plain = (1 - exact) / exact / precision**2
    found = [spent(mechdesign.reliability(study, seed=seed)) for seed in range(20)]
    most = max(each["evaluations"] for each in found)
    benchmark.extra_info.update(
        evaluations=sum(each["evaluations"] for each in found) / len(found),
        most_evaluations=most,
        largest_coefficient_of_variation=max(each["coefficient_of_variation"] for each in found),
        of_plain_samples=most / plain,
    )


def test_one_in_a_billion_after_start(benchmark: Any) -> None:
    """The first answer of a process, once the package and the study are there: with what is imported on the way."""
    study = (
        f"mechdesign.load({str(CONFIGS / 'two_link_arm.yaml')!r}, overrides=["
        "'reliability.limits={P.x: 0.1, P.y: 0.1}', 'reliability.poses=[{theta1: 30, theta2: 60}]', "
        "'reliability.methods=[auto]', 'reliability.precision=0.05'])"
    )
    code = (
        f"import time, mechdesign; study = {study}; begin = time.perf_counter(), time.process_time(); "
        "mechdesign.reliability(study); print(time.perf_counter() - begin[0], time.process_time() - begin[1])"
    )
    seconds = []

    def ask() -> None:
        said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
        seconds.append([float(part) for part in said.split()])

    benchmark.pedantic(ask, rounds=5)
    elapsed, processor = (min(column) for column in zip(*seconds, strict=True))
    benchmark.extra_info.update(seconds_after_start=elapsed, processor_seconds_after_start=processor)


def test_whole_cycle_of_three_orders(benchmark: Any) -> None:
    study = mechdesign.load(CONFIGS / "toggle.yaml")
    benchmark.pedantic(lambda: mechdesign.reliability(study, jobs=2), rounds=3, warmup_rounds=1)
    benchmark.extra_info.update(samples_per_second=73 * 40_000 / benchmark.stats["min"])


def test_probability_of_the_whole_cycle(benchmark: Any) -> None:
    """The same samples again, of mechanisms that are moved through all poses; of velocities, which are limited."""
    limits = "reliability.limits={S.y: 0.9, S.y_velocity: 0.6}"
    study = mechdesign.load(CONFIGS / "toggle.yaml", overrides=[limits])
    benchmark.pedantic(lambda: mechdesign.reliability(study, jobs=2), rounds=3, warmup_rounds=1)
    benchmark.extra_info.update(samples_per_second=2 * 73 * 40_000 / benchmark.stats["min"])


def test_second_order_of_the_whole_cycle(benchmark: Any) -> None:
    study = mechdesign.load(CONFIGS / "toggle.yaml", overrides=["reliability.methods=[second_order]"])
    benchmark.pedantic(lambda: mechdesign.reliability(study, jobs=2), rounds=3, warmup_rounds=1)


def test_whole_command_with_pictures(benchmark: Any, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "mechdesign", "reliability", str(CONFIGS / "toggle.yaml"), "--quiet", "--out"]
    benchmark.pedantic(
        lambda: subprocess.run([*command, str(tmp_path)], check=True, stdout=subprocess.DEVNULL), rounds=3
    )


def test_memory_of_ten_million_samples(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "mechdesign", "reliability", str(CONFIGS / "two_link_arm.yaml"), "--quiet"]
    changes = ["--set", "reliability.samples=10000000", "--set", "reliability.poses=[{theta1: 30, theta2: 60}]"]
    assert peak_of([*command, "--no-plots", *changes, "--out", str(tmp_path)]) < 500e6


DESIGNS = 100


@pytest.mark.parametrize(("result", "limits"), [
    ("moments.sigma", "{C.x: 0.1, C.y: 0.1}"), ("reliability", "{C.x: 0.1, C.y: 0.1}"),
    ("reliability", "{C: {radius: 0.1}}"), ("capability.cpk", "{C.x: 0.1, C.y: 0.1}"),
])  # fmt: skip
def test_first_order_of_designs(benchmark: Any, result: str, limits: str) -> None:
    """Milliseconds of one processor a design, in populations of 100, beside NumPy by hand."""
    variables = "{l1: {from: 35, to: 45}, tol: {from: 0.01, to: 0.03}}"
    search = f"{{method: search, variables: {variables}, minimize: [reliability.{result}]}}"
    study = mechdesign.load(text=f"{PRECISE}  limits: {limits}\noptimize: {search}\n")
    evaluator = Evaluator(designs_question(study, [goal(f"reliability.{result}", smallest=result == "moments.sigma")]))
    rng = np.random.default_rng(1)
    batch = {"l1": rng.uniform(35, 45, DESIGNS), "tol": rng.uniform(0.01, 0.03, DESIGNS)}
    seconds: list[float] = []

    def ask() -> Any:
        begin = time.process_time()
        found = evaluator(batch)
        seconds.append(time.process_time() - begin)
        return found

    found = benchmark.pedantic(ask, rounds=20, warmup_rounds=2)
    assert not any(found.reasons)
    if result == "moments.sigma":
        assert found.table[:, 0] == pytest.approx(five_bar_deviations(batch["l1"], batch["tol"]).max(axis=(0, 2)))
    begin = time.process_time()
    for _ in range(100):
        five_bar_deviations(batch["l1"], batch["tol"])
    floor = (time.process_time() - begin) / 100
    benchmark.extra_info.update(milliseconds_a_design=1e3 * min(seconds) / DESIGNS, of_the_floor=min(seconds) / floor)


@pytest.mark.parametrize("count", [8, 16, 24])
def test_allocation_in_grades(benchmark: Any, count: int) -> None:
    """So many lengths in eight grades, to a Cpk."""
    names = [f"p{k}" for k in range(count)]
    sizes = np.random.default_rng(1).uniform(20, 150, count)
    text = f"""
mechanism:
  parameters: {{{", ".join(f"{name}: {size:.4g}" for name, size in zip(names, sizes, strict=True))}}}
  links: {{ground: {{O: [0, 0], G: [{" + ".join(names)} - {70 * count}, 0]}}, slider: {{B: [0, 0]}}}}
  joints: {{guide: {{prismatic: [ground, slider], through: G}}}}
  drives: {{travel: {{slide: guide}}}}
  sketch: {{B: [30, 0]}}
reliability:
  dimensions: {{{", ".join(f"{name}: 0.05" for name in names)}}}
  poses: [{{travel: 10}}]
  outputs: [B.x]
  limits: {{B.x: {0.05 * count**0.5}}}
  methods: [analytic]
  allocate: {{cpk: 1.33, grades: true}}
"""
    study = mechdesign.load(text=text)
    found = benchmark.pedantic(lambda: mechdesign.reliability(study), rounds=3, warmup_rounds=1)
    assert not any("not all choices" in note for note in map(str, found.warnings))
