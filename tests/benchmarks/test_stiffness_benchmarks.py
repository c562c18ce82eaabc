"""Speed of stiffness over many poses: a 3-RPR, a five-bar with elastic links, and a six-bar by the force method."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mechdesign

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
