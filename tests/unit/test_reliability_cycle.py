"""The probability that one made mechanism keeps its limits over a whole motion."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.studies import study_of
from scipy.special import ndtr

import mechdesign

CONFIGS = Path(__file__).parents[2] / "configs"
LEVER = """
mechanism:
  links: {ground: {O: [0, 0]}, lever: [O, P, 100]}
  drives: {theta: {angle: lever}}
  sketch: {P: [100, 0]}
reliability:
  sweep: {theta: {from: 0, to: 90, step: 15}}
  limits: {P: {radius: 0.2}}
  samples: 100000
"""
FOUR_BAR = """
mechanism:
  parameters: {a: 1, b: 3.5, c: 3, d: 4}
  links: {ground: {A: [0, 0], D: [d, 0]}, crank: [A, B, a], coupler: [B, C, b], rocker: [D, C, c]}
  drives: {theta: {angle: crank}}
  sketch: {B: [0, 1], C: [2.5, 2.6]}
reliability:
  dimensions:
    a: {tolerance: 0.8, distribution: uniform}
    b: {tolerance: 0.8, distribution: uniform}
    c: {tolerance: 0.8, distribution: uniform}
  sweep: {theta: {from: 0, to: 360, step: 20}}
  outputs: [rocker.angle]
  limits: {rocker.angle: 1000}
  methods: [monte_carlo]
  samples: 200000
"""


def ask(text: str, *changes: str, jobs: int = 1) -> mechdesign.Answer:
    return mechdesign.reliability(study_of(text, *changes), jobs=jobs)


def row(result: mechdesign.Answer, method: str) -> dict[str, Any]:
    table = result.tables["reliability"]
    rows = np.flatnonzero((table["scope"] == "cycle") & (table["method"] == method))
    assert len(rows) == 1
    return {column.name: column.values[rows[0]] for column in table.columns}


@pytest.mark.nightly
def test_share_of_four_bars_that_cannot_turn_fully() -> None:
    """0.02975 of 1, 3.5, 3, 4 with +-0.8 on crank, coupler and rocker; both extremes, 0 and 180 deg, are poses."""
    result = ask(FOUR_BAR, jobs=2)
    found = row(result, "monte_carlo")
    assert found["invalid"] == round(found["failure"] * 200_000)
    assert found["failure"] == pytest.approx(0.02975, abs=4 * np.sqrt(0.02975 / 200_000))
    assert found["failure_low"] < 0.02975 < found["failure_high"]
    assert f"{found['invalid']} of 200000 made mechanisms cannot be assembled at some pose" in " ".join(
        map(str, result.warnings)
    )
    assert result.counts["cycles"] == 200_000


@pytest.mark.slow
def test_a_sweep_that_steps_over_the_extremes_sees_fewer() -> None:
    """The step is the resolution: far from 0 and 180 deg cranks that cannot turn fully seem to."""
    missed = ask(FOUR_BAR, "reliability.sweep.theta.from=60", "reliability.sweep.theta.to=120", jobs=2)
    assert 0 < row(missed, "monte_carlo")["failure"] < 0.5 * 0.02975


def test_dimensions_are_held_over_the_cycle() -> None:
    """A length error is along the lever at every pose, so the cycle fails just where one pose does."""
    result = ask(LEVER, "reliability.dimensions={lever.length: 0.3}")
    exact = 2 * ndtr(-2.0)
    found, by_poses = row(result, "monte_carlo"), row(result, "analytic")
    assert found["failure_low"] < exact < found["failure_high"]
    # Of seven poses that fail together the lower bound is the truth, and the upper one is seven times it.
    assert by_poses["failure_low"] == pytest.approx(exact, rel=1e-12)
    assert by_poses["failure_high"] == pytest.approx(7 * exact, rel=1e-12)
    assert by_poses["failure"] == by_poses["failure_high"]
    assert by_poses["reliability"] == by_poses["low"] < by_poses["high"]
    assert by_poses["samples"] == 0
    assert np.isnan(found["theta"])


def test_pins_are_drawn_anew_at_every_pose() -> None:
    """A clearance alone: seven independent Rayleigh errors."""
    result = ask(LEVER, "reliability.clearances={O: {radial: 0.3, link: lever}}")
    exact = 1 - (1 - np.exp(-2.0)) ** 7
    found = row(result, "monte_carlo")
    assert found["failure_low"] < exact < found["failure_high"]
    assert found["failure_high"] - found["failure_low"] < 0.02
    bounds = row(result, "analytic")
    assert bounds["failure_low"] < exact < bounds["failure_high"]


def test_radii_of_clearances_are_held() -> None:
    """With a radius that is either of two, a cycle's failures come from the wide half of the mechanisms."""
    clearance = "reliability.clearances={O: {radial: 0.3, tolerance: 0.3, distribution: uniform, link: lever}}"
    result = ask(LEVER, clearance)
    radius = np.linspace(0, 0.6, 20_001)[1:]
    kept = (1 - np.exp(-0.5 * (0.2 / (radius / 3)) ** 2)) ** 7
    exact = 1 - kept.mean()
    found = row(result, "monte_carlo")
    assert found["failure_low"] < exact < found["failure_high"]


# A small workspace section for the nodes.
NODES = ["workspace.point=P", "workspace.scan.rays=3", "workspace.scan.about=[0, 0]"]
GRID = "sweep: {theta1: {from: 30, to: 50, number: 3}, theta2: {from: 40, to: 60, number: 3}}"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("poses", "scopes"),
    [
        ("poses: [{theta1: 30, theta2: 60}, {theta1: 45, theta2: 45}]", {"pose"}),
        ("sweep: {theta1: 30, theta2: 60}", {"pose"}),
        (GRID, {"pose"}),
        ("poses: workspace", {"pose"}),
        ("sweep: {theta1: 30, theta2: {from: 40, to: 60, number: 3}}", {"pose", "cycle"}),
        ("path: {P: [[14, 10], [14, 11], [13, 11]]}", {"pose", "cycle"}),
    ],
)
def test_a_cycle_is_a_sweep_along_one_coordinate_or_a_path(poses: str, scopes: set[str]) -> None:
    text = (CONFIGS / "two_link_arm.yaml").read_text(encoding="utf-8")
    begin, end = text.rindex("  poses: ["), text.rindex("  outputs: [P]")
    study = study_of(text[:begin] + f"  {poses}\n" + text[end:], "reliability.samples=300", *NODES)
    assert set(mechdesign.reliability(study).tables["reliability"]["scope"]) == scopes


@pytest.mark.slow
def test_a_cycle_through_a_pose_that_cannot_be_assembled_has_no_probability() -> None:
    """The nominal crank of 2.6 does not pass 180 deg: nan, and not valid."""
    change = "mechanism.parameters.a=2.6"
    found = row(ask(FOUR_BAR, change, "reliability.samples=500"), "monte_carlo")
    assert np.isnan(found["failure"])
    assert not found["valid"]


@pytest.mark.nightly
@pytest.mark.parametrize("method", ["monte_carlo", "auto"])
def test_the_number_of_threads_changes_nothing(method: str) -> None:
    change = f"reliability.methods=[{method}]"
    one, two = (row(ask(FOUR_BAR, "reliability.samples=50000", change, jobs=jobs), method) for jobs in (1, 2))
    assert {k: v for k, v in one.items() if v == v} == {k: v for k, v in two.items() if v == v}
    assert one["used"] == "monte_carlo"


@pytest.mark.slow
def test_auto_stops_at_its_precision() -> None:
    changes = ["reliability.methods=[auto]", "reliability.precision={half_width: 0.01}", "reliability.samples=1000000"]
    found = row(ask(FOUR_BAR, *changes), "auto")
    assert 0.5 * (found["failure_high"] - found["failure_low"]) <= 0.01
    assert found["samples"] < 100_000


@pytest.mark.slow
def test_auto_tells_that_its_precision_was_not_reached() -> None:
    changes = ["reliability.methods=[auto]", "reliability.precision=0.01", "reliability.samples=20000"]
    result = ask(FOUR_BAR, *changes)
    assert row(result, "auto")["samples"] == 20_000
    assert any(
        note.startswith("auto: half the interval of the whole cycle is 0.00") for note in map(str, result.warnings)
    )


@pytest.mark.slow
def test_without_a_failure_monte_carlo_warns_and_gives_the_bound() -> None:
    changes = ["reliability.dimensions={lever.length: 0.03}", "reliability.methods=[monte_carlo]"]
    result = ask(LEVER, *changes, "reliability.samples=40000")
    plain = row(result, "monte_carlo")
    assert plain["failure"] == 0
    bound = -np.log(0.0015) / 40_000
    assert plain["failure_high"] == pytest.approx(bound, rel=1e-3)
    told = f"the probability of failure is below {bound:.2g}"
    assert f"monte_carlo: no failure in 40000 samples at 7 poses: {told}" in map(str, result.warnings)
    assert f"monte_carlo: no failure in 40000 made mechanisms over the whole cycle: {told}" in map(str, result.warnings)


@pytest.mark.slow
def test_an_interrupt_gives_the_cycles_that_were_counted() -> None:
    class Impatient:
        """Ctrl-C at the third report of whole cycles."""

        def start(self, total: int, stage: str) -> None:
            self.stage, self.reports = stage, 0

        def update(self, n: int) -> None:
            self.reports += 1
            if (self.stage, self.reports) == ("whole cycles", 3):
                raise KeyboardInterrupt

    study = study_of(FOUR_BAR, "reliability.samples=100000")
    with pytest.raises(KeyboardInterrupt) as caught:
        mechdesign.reliability(study, progress=Impatient())
    result = caught.value.result
    found = row(result, "monte_carlo")
    assert found["samples"] == 3 * 20_000
    assert found["failure_low"] < 0.02975 < found["failure_high"]
    # The poses had been simulated before.
    table = result.tables["reliability"]
    assert (table["samples"][table["scope"] == "pose"] == 100_000).all()
    assert "60000 whole cycles" in result.interrupted


SWEPT = """
mechanism:
  links: {ground: {O: [0, 0], C: [200, 0]}, crank: [O, A, 60], rocker: [C, B, 130], rod: [A, B, 170]}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 60], B: [165, 125]}
reliability:
  sweep: {theta: {from: 0, to: 360, step: 5}}
  dimensions: {rod.length: {sigma: 0.1}, crank.length: {sigma: 0.1}}
  limits: {rocker.angle: {usl: 150}}
  methods: [analytic]
"""


def between(step: float, top: float) -> tuple[list[str], float]:
    result = ask(
        SWEPT, f"reliability.sweep.theta.step={step}", f"reliability.limits={{rocker.angle: {{usl: {top!r}}}}}"
    )
    warnings = [str(w) for w in result.warnings if str(w).startswith("between the poses")]
    table = result.tables["reliability"]
    return warnings, float(table["failure"][table["scope"] == "pose"].max())


@pytest.mark.slow
def test_a_limit_that_fails_between_the_poses_of_a_sweep_is_told() -> None:
    moved = mechdesign.kinematics(mechdesign.load(text=SWEPT.partition("reliability:")[0] + """
kinematics: {sweep: {theta: {from: 0, to: 360, step: 0.25}}, outputs: [rocker.angle]}
""")).tables["motion"]  # fmt: skip
    fine = moved["rocker.angle"]
    for step in (60, 40, 15):
        rows = fine[:: 4 * step].max()
        top = float(rows + 0.9 * (fine.max() - rows))
        warnings, worst = between(step, top)
        assert len(warnings) == 1
        # The sweep passes the limit, where at least half of the made mechanisms fail.
        told = float(warnings[0].partition("failure is ")[2].split()[0])
        assert told > 0.5 > worst
        place = float(warnings[0].partition("theta = ")[2].split()[0])
        assert place == pytest.approx(moved["theta"][fine.argmax()], abs=step / 16 + 0.25)
    assert not between(1, float(fine.max()) + 1.0)[0]


def test_poses_between_which_a_motion_cannot_be_assembled_are_told() -> None:
    # At 180 deg the rocker's pin is 260.5 from the crank's, and rocker and rod reach 260.4.
    result = ask(
        SWEPT, "mechanism.links.rod=[A, B, 130.4]", "mechanism.links.crank=[O, A, 60.5]",
        "mechanism.sketch.A=[60.5, 0]", "mechanism.sketch.B=[150, 120]",
        "reliability.sweep.theta={from: 150, to: 210, step: 60}", "reliability.limits={rocker.angle: 3}",
    )  # fmt: skip
    (warning,) = [str(w) for w in result.warnings if str(w).startswith("between the poses")]
    assert "1, as it cannot be assembled there" in warning


@pytest.mark.slow
@pytest.mark.parametrize("limit", ["{pulse: {usl: 0.5}}", "{theta_effort: {lsl: -100, usl: 100}}"])
def test_what_is_narrow_between_the_poses_is_told(limit: str) -> None:
    """A measure and a load that act over a tenth of a degree, between poses of 5 deg."""
    pulse = "max(0, 1 - abs(theta - 123.4)/0.05)"
    text = SWEPT.replace("reliability:", f"""
  measures: {{pulse: "{pulse} + A.x/1000"}}
dynamics: {{loads: [{{at: B, force: [0, "-100*{pulse}"]}}]}}
reliability:""").replace("{usl: 150}", "{usl: 1000}")  # fmt: skip
    result = ask(text, "reliability.dimensions.theta={sigma: 0.001}", f"reliability.limits={limit}")
    (warning,) = [str(w) for w in result.warnings if str(w).startswith("between the poses")]
    assert float(warning.partition("theta = ")[2].split()[0]) == pytest.approx(123.4, abs=0.05)
    assert "failure is 1 to the first order" in warning
