"""Samples a second of plain Monte Carlo, beside hand-tuned C where there is a compiler; what rare failures cost."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from helpers.memory import peak_of

import mechdesign

CONFIGS = Path(__file__).parents[2] / "configs"
ARM_SAMPLES = 2_000_000


@pytest.fixture(scope="session")
def floor(compiled: Callable[[str], Path]) -> float:
    """Samples a second of kernel A of the arm in C, on two threads."""
    command = [str(compiled("arm_monte_carlo")), "10000000", "2", "5"]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    found = re.search(r"^A .*?([\d.]+) Msamples/s", said, re.MULTILINE)
    assert found is not None
    return 1e6 * float(found[1])


def arm(samples: int) -> Any:
    changes = [
        f"reliability.samples={samples}",
        "reliability.poses=[{theta1: 30, theta2: 60}]",
        "reliability.methods=[monte_carlo]",
    ]
    return mechdesign.load(CONFIGS / "two_link_arm.yaml", overrides=changes)


def test_arm_against_c(benchmark: Any, floor: float) -> None:
    study = arm(ARM_SAMPLES)
    benchmark.pedantic(lambda: mechdesign.reliability(study, jobs=2), rounds=5, warmup_rounds=1)
    rate = ARM_SAMPLES / benchmark.stats["min"]
    benchmark.extra_info.update(samples_per_second=rate, of_the_floor=rate / floor)


def test_arm(benchmark: Any) -> None:
    study = arm(ARM_SAMPLES)
    benchmark.pedantic(lambda: mechdesign.reliability(study, jobs=2), rounds=5, warmup_rounds=1)
    benchmark.extra_info.update(samples_per_second=ARM_SAMPLES / benchmark.stats["min"])


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
