"""Speed of stiffness over many poses and of many designs: a 3-RPR, an elastic five-bar, a press of two loops."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdesign
from mechdesign.family.evaluator import Evaluator
from mechdesign.family.goals import goal
from mechdesign.family.stacked import answers
from mechdesign.questions.optimize.question import designs_question
from mechdesign.study.designs import Designs

CONFIGS = Path(__file__).parents[2] / "configs"
POSES = 200_000


def measure(benchmark: Any, study: mechdesign.study.Study, jobs: int) -> None:
    """Poses a second, from the study's poses to the tables."""
    result = benchmark.pedantic(mechdesign.stiffness, (study,), {"jobs": jobs}, rounds=3, warmup_rounds=1)
    assert result.counts["poses"] == POSES
    benchmark.extra_info["poses_per_second"] = POSES / benchmark.stats.stats.min


def test_three_rpr_poses_a_second(benchmark: Any) -> None:
    sweep = "{P.x: {from: -0.4, to: 0.4, number: 500}, P.y: {from: 0.6, to: 1.4, number: 400}, platform.angle: 0}"
    study = mechdesign.load(
        CONFIGS / "planar_3rpr.yaml", ["stiffness.poses=null", "stiffness.loads=[]", f"stiffness.sweep={sweep}"]
    )
    measure(benchmark, study, 2)


def test_five_bar_with_elastic_links_poses_a_second(benchmark: Any) -> None:
    sweep = "{C.x: {from: -60, to: 60, number: 500}, C.y: {from: 180, to: 280, number: 400}}"
    study = mechdesign.load(
        CONFIGS / "five_bar.yaml", ["stiffness.poses=null", "stiffness.loads=[]", f"stiffness.sweep={sweep}"]
    )
    measure(benchmark, study, 2)


def test_six_bar_by_the_force_method_poses_a_second(benchmark: Any) -> None:
    """The toggle under its ram, all links elastic."""
    section = (
        "{link: slider, at: S, sections: {bar: {E: 200 GPa, width: 2, height: 4}}, "
        "elastic: {crank: bar, connecting_rod: bar, lower_link: bar, upper_link: bar}, actuators: {theta2: 1e6}, "
        f"sweep: {{theta2: {{from: 0, to: 360, number: {POSES}}}}}}}"
    )
    measure(benchmark, mechdesign.load(CONFIGS / "toggle.yaml", [f"stiffness={section}"]), 2)


# Of each study ten poses, and what its designs differ in: lengths and numbers of the section. Sections and actuators
# follow parameters that are added here.
DESIGNS = {
    "planar_3rpr.yaml": (
        ["platform.B1.x", "ground.A3.y", "e", "h", "k"],
        ["mechanism.parameters={e: 2e11, h: 0.04, k: 5e7}", "stiffness.sections.beam={E: e, width: 0.02, height: h}",
         "stiffness.actuators={l1: k, l2: k, l3: k}", "stiffness.poses=null",
         "stiffness.sweep={P.x: {from: -0.3, to: 0.3, number: 10}, P.y: 1, platform.angle: 0}"],
    ),
    "five_bar.yaml": (
        ["lower_1.length", "upper_2.length", "e", "w", "k"],
        ["mechanism.parameters.e=70000", "mechanism.parameters.w=20", "mechanism.parameters.k=5e6",
         "stiffness.sections.arm={E: e, width: w, height: 30}",
         "stiffness.actuators={phi1: k, phi2: k}", "stiffness.poses=null",
         "stiffness.sweep={C.x: {from: -40, to: 40, number: 10}, C.y: 230}"],
    ),
    "gallery/press_stiffness.yaml": (
        ["rod.length", "upper.length", "h", "d", "pin", "across"],
        ["mechanism.parameters={h: 80, d: 60, pin: 2e6, across: 1e6}", "stiffness.sections.bar.height=h",
         "stiffness.sections.shaft.diameter=d", "stiffness.bearings={B: pin, guide: {radial: across, moment: 5e8}}",
         "stiffness.sweep={theta: {from: 0, to: 300, number: 10}}"],
    ),
}  # fmt: skip


def designs_of(name: str, count: int, *more: str) -> Designs:
    """Designs of a study about its own."""
    varied, changes = DESIGNS[name]
    study, rng = mechdesign.load(CONFIGS / name, [*changes, *more]), np.random.default_rng(0)
    nominal = {**study.mechanism.nominal, **study.parameters.nominal}
    return Designs(study, {each: nominal[each] * (1 + 0.03 * rng.uniform(-1, 1, count)) for each in varied})


def cpu(work: Callable[[], Any]) -> float:
    """Seconds of the processor, the best of some."""
    found = []
    for _ in range(7):
        begin = time.process_time()
        work()
        found.append(time.process_time() - begin)
    return min(found)


@pytest.mark.parametrize("name", DESIGNS)
def test_populations_of_designs(benchmark: Any, name: str) -> None:
    """Milliseconds of the processor a design at ten poses, in populations of 100; 1 at most is asked for."""
    varied = ", ".join(f"{each}: {{from: 1, to: 2, number: 2}}" for each in DESIGNS[name][0])
    section = f"optimize={{variables: {{{varied}}}, maximize: [stiffness.k_min]}}"
    designs = designs_of(name, 100, section, "requirements=null")
    evaluator = Evaluator(designs_question(designs.study, [goal("stiffness.k_min")]))
    found = benchmark.pedantic(evaluator, (designs.changed,), rounds=5, warmup_rounds=1)
    assert found.reasons == [""] * 100
    benchmark.extra_info["cpu_ms_a_design"] = 1e3 * cpu(lambda: evaluator(designs.changed)) / 100
    if name == "planar_3rpr.yaml":
        floor = by_hand(designs)
        np.testing.assert_allclose(found.table[:, 0], floor, rtol=1e-9)
        benchmark.extra_info["floor_cpu_ms_a_design"] = 1e3 * cpu(lambda: by_hand(designs)) / 100


def by_hand(designs: Designs) -> np.ndarray:
    """Least k_min of the 3-RPR's designs over its poses in plain NumPy: C = J K^-1 J^T, with the legs' lines in J^-1.

    A leg that is hinged at both ends bears a force along it: its rod, L/EA, and its actuator give.
    """
    b1, a3, e, h, k = (designs.changed[name][:, None] for name in DESIGNS["planar_3rpr.yaml"][0])
    p = np.linspace(-0.3, 0.3, 10) + 1j
    lines, soft = np.empty((len(b1), 10, 3, 3)), np.empty((len(b1), 10, 3))
    for leg, (a, b) in enumerate(((-0.6, b1), (0.6, 0.2), (0.3 + 1j * a3, 0.25 + 0.15j))):
        span = p + b - a
        length = np.abs(span)
        u = span / length
        lines[..., leg, 0], lines[..., leg, 1] = u.real, u.imag
        lines[..., leg, 2] = np.imag(np.conj(b) * u)
        soft[..., leg] = 1 / k + length / (e * 0.02 * h)
    jacobian = np.linalg.inv(lines)
    compliance = (jacobian * soft[..., None, :]) @ jacobian.swapaxes(-1, -2)
    xx, xy, yy = compliance[..., 0, 0], compliance[..., 0, 1], compliance[..., 1, 1]
    return np.asarray((1 / ((xx + yy) / 2 + np.hypot((xx - yy) / 2, xy))).min(axis=1))


@pytest.mark.parametrize("name", DESIGNS)
def test_whole_answers_of_cases(benchmark: Any, name: str) -> None:
    """Milliseconds a case of 2,000: every table, warning and count of each at ten poses, loads and all."""
    designs = designs_of(name, 2000, "requirements=null")

    def ask() -> int:
        return sum(end.error is None for group in answers(designs, "stiffness") for end in group.ends)

    assert benchmark.pedantic(ask, rounds=3, warmup_rounds=1) == 2000
    benchmark.extra_info["cpu_ms_a_case"] = 1e3 * cpu(ask) / 2000
