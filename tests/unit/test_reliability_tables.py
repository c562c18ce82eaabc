"""Tables of what was drawn: histogram with its normal fit, convergence of means and of the probability of failure."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.studies import study_of
from scipy.stats import binomtest

import mechdesign

CONFIGS = Path(__file__).parents[2] / "configs"
# At 90 deg the rod is 101 +- 3 against a crank of 100: one in six cannot be assembled.
FOLD = """
mechanism:
  links:
    ground: {O: [0, 0], G: [0, 0]}
    crank: [O, A, 100]
    rod: [A, B, 101]
    slider: {B: [0, 0]}
  joints: {guide: {prismatic: [ground, slider], through: G}}
  drives: {theta: {angle: crank}}
  sketch: {A: [70, 70], B: [142, 0]}
reliability:
  poses: [{theta: 90}, {theta: 60}]
  outputs: [B.x, B.y]
  dimensions: {rod.length: 3}
  limits: {B.x: 8}
  methods: [monte_carlo]
  samples: 30500
"""


def ask(*changes: str) -> mechdesign.Answer:
    return mechdesign.reliability(study_of(FOLD, *changes))


@pytest.mark.slow
@pytest.mark.parametrize("method", ["monte_carlo", "auto"])
def test_histogram_counts_what_was_drawn_at_the_first_pose(method: str) -> None:
    result = ask("reliability.poses=[{theta: 60}]", f"reliability.methods=[{method}]", "reliability.precision=0.1")
    table, moments = result.tables["histogram"], result.tables["moments"]
    # B.y does not vary: the guide holds it.
    assert set(table["output"]) == {"B.x"}
    assert set(table["theta"]) == {60.0}
    width = table["high"] - table["low"]
    assert (table["low"][1:] == table["high"][:-1]).all()
    most = np.argmax(table["count"])
    drawn = round(float(table["count"][most] / (table["density"] * width)[most]))
    assert (table["density"] * width * drawn) == pytest.approx(table["count"])
    assert table["count"].sum() == drawn
    mean, sigma = (float(moments[name][moments["output"] == "B.x"][-1]) for name in ("mean", "sigma"))
    nominal = float(moments["nominal"][moments["output"] == "B.x"][-1])
    middle = 0.5 * (table["low"] + table["high"]) + nominal
    fit = np.exp(-0.5 * ((middle - mean) / sigma) ** 2) / (sigma * np.sqrt(2 * np.pi))
    assert table["normal"] == pytest.approx(fit, rel=0.05)
    expected = drawn * table["normal"] * width
    assert (np.abs(table["count"] - expected) < 6 * np.sqrt(expected + 1)).all()


def test_far_samples_do_not_stretch_the_histogram() -> None:
    """The bins end six deviations from the mean; what lies beyond is in no bin."""
    result = ask("reliability.poses=[{theta: 90}]", "reliability.dimensions={rod.length: {tolerance: 1, "
                 "distribution: lognormal}}")  # fmt: skip
    table, moments = result.tables["histogram"], result.tables["moments"]
    sigma = float(moments["sigma"][0])
    assert table["high"][-1] - table["low"][0] <= 12 * sigma * (1 + 1e-12)


def test_estimate_counts_what_cannot_be_assembled_and_ends_at_the_result() -> None:
    result = ask()
    table, success = result.tables["estimate"], result.tables["reliability"]
    assert table["samples"].tolist() == [*range(1000, 30_001, 1000), 30_500]
    assert (np.diff(table["failure"] * table["samples"]) >= 0).all()
    for name in ("failure", "failure_low", "failure_high"):
        assert table[name][-1] == success[name][0]
    failures = round(table["failure"][4] * 5000)
    # Clopper and Pearson's interval.
    interval = binomtest(failures, 5000).proportion_ci(0.997)
    assert (table["failure_low"][4], table["failure_high"][4]) == pytest.approx((interval.low, interval.high), rel=1e-9)
    # Means are over those that can be assembled.
    trend, moments = result.tables["convergence"], result.tables["moments"]
    assert trend["samples"][-1] == success["samples"][0] - success["invalid"][0] < 30_500
    assert trend["mean"][trend["output"] == "B.x"][-1] == pytest.approx(moments["mean"][0], rel=1e-12)


@pytest.mark.slow
def test_estimate_of_many_samples_goes_on_at_powers_of_two() -> None:
    study = mechdesign.load(
        CONFIGS / "two_link_arm.yaml",
        overrides=["reliability.samples=700000", "reliability.poses=[{theta1: 30, theta2: 60}]"],
    )
    result = mechdesign.reliability(study, jobs=2)
    samples = result.tables["estimate"]["samples"]
    # Chunks of 20,000: sixteen are followed closely, then the one after 2^k others.
    assert samples[-2:].tolist() == [340_000, 660_000]
    assert samples[319] == 320_000
    assert len(result.tables["histogram"]) > 0
    assert result.tables["histogram"]["count"].sum() == 2 * 320_000


@pytest.mark.slow
def test_no_estimate_without_limits_and_no_histogram_without_samples() -> None:
    assert "estimate" not in ask("reliability.limits={}").tables
    assert "histogram" in ask("reliability.limits={}").tables
    analytic = ask("reliability.methods=[analytic]", "reliability.poses=[{theta: 60}]").tables
    assert analytic.keys() == {"moments", "reliability", "capability", "contributions"}


def test_columns_of_reliability_are_those_of_the_format() -> None:
    names = (
        ask("reliability.poses=null", "reliability.sweep={theta: {from: 50, to: 60, step: 5}}")
        .tables["reliability"]
        .names
    )
    asked = ["scope", "theta", "method", "reliability", "low", "high", "failure", "failure_low", "failure_high"]
    asked += ["error", "samples", "invalid"]
    assert list(names[: len(asked)]) == asked
    assert {"evaluations", "used", "valid"} <= set(names)


def test_sensitivities_in_the_units_of_the_study() -> None:
    """B.x of the slider-crank by a slide's direction, its drive, lengths and a pure number; rates likewise."""
    study = study_of(
        """
mechanism:
  parameters: {ratio: 1.2, a: 100, tilt: 0}
  links: {ground: {O: [0, 0]}, crank: [O, A, a], rod: [A, B, 200*ratio], slider: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], through: O, direction: tilt}}
  drives: {theta: {angle: crank}}
  sketch: {A: [87, 50], B: [285, 0]}
reliability:
  poses: [{theta: 60}]
  outputs: [rod.angle, B.x]
  rates: {theta: 10}
  dimensions: {ratio: 0.001, a: 0.1, tilt: 0.1, theta: 0.1}
  clearances: {A: {radial: 0.02}}
  methods: [analytic]
"""
    )
    table = mechdesign.reliability(study).tables["contributions"]
    position, turn = table["order"] == "position", np.degrees(1.0)
    found = {
        (output, source): (derivative, unit)
        for output, source, derivative, unit in zip(
            *(table[name][position] for name in ("output", "source", "derivative", "unit")), strict=True
        )
    }
    cosine, sine = np.cos(np.radians(60.0)), np.sin(np.radians(60.0))
    lean = 100 * sine / 240 / np.sqrt(1 - (100 * sine / 240) ** 2)
    root = np.sqrt(1 - (100 * sine / 240) ** 2)
    assert found["B.x", "theta"] == (pytest.approx((-100 * sine - lean * 100 * cosine) / turn), "mm/deg")
    assert found["B.x", "a"] == (pytest.approx(cosine - lean * sine), "mm/mm")
    assert found["B.x", "ratio"] == (pytest.approx(200 / root), "mm/ratio")
    assert found["rod.angle", "theta"] == (pytest.approx(-100 * cosine / (240 * root)), "deg/deg")
    assert found["rod.angle", "a"] == (pytest.approx(-sine / (240 * root) * turn), "deg/mm")
    assert found["rod.angle", "tilt"][1] == "deg/deg"
    assert found["B.x", "A"][1] == "mm/mm"
    rates = dict(zip(table["source"], table["unit"], strict=True))
    assert rates["theta"] == "mm/(s^2*deg)"
