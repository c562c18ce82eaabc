"""Measures stand wherever a coordinate may."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of

from mechdesign.analyses.kinematics.analysis import kinematics
from mechdesign.analyses.reliability.analysis import reliability
from mechdesign.analyses.stiffness.analysis import stiffness
from mechdesign.analyses.workspace.analysis import workspace
from mechdesign.report.requirements import requirements

ARM = """
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 10], fore: [E, P, 8]}
  drives: {t1: {angle: upper}, t2: {angle: fore}}
  sketch: {E: [8, 5], P: [13, 11]}
  measures:
    far: {distance: [O, P]}
    bend: {angle: [upper, fore]}
    high: P.y - 2
    share: high/far
    twice: 2*bend
"""
FOUR_BAR = """
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
  measures: {reach: {distance: [O, B]}, mu: {angle: [rod, rocker]}, half: mu/2, drop: B.y - A.y, lower: drop - 1}
"""


@pytest.mark.parametrize(
    ("poses", "given"),
    [
        ("sweep: {far: {from: 9, to: 15, step: 3}, P.y: 8}", {"far": [9, 12, 15], "P.y": [8] * 3}),
        ("poses: [{far: 9, t1: 30}, {t1: 20, far: 11}]", {"far": [9, 11], "t1": [30, 20]}),
        ("path: {bend: [30, 50], P.x: [12, 13]}", {"bend": [30, 50], "P.x": [12, 13]}),
        ("path: {high: [7, 8], far: [14, 14]}", {"high": [7, 8], "far": [14, 14]}),
        ("path: {share: [0.5, 0.6], t1: 30}", {"share": [0.5, 0.6], "t1": [30, 30]}),
    ],
)
def test_measures_are_given(poses: str, given: dict[str, list[float]]) -> None:
    outputs = "outputs: [P, far, bend, high, share, twice, t1]"
    table = kinematics(study_of(ARM, f"kinematics={{{poses}, {outputs}}}")).tables["motion"]
    assert table["valid"].all()
    for name, values in given.items():
        assert table[name] == pytest.approx(values, rel=1e-9)
    far = np.hypot(table["P.x"], table["P.y"])
    assert table["far"] == pytest.approx(far)
    assert table["share"] == pytest.approx((table["P.y"] - 2) / far)
    assert table["twice"] == pytest.approx(2 * table["bend"])


def test_rates_of_chained_measures() -> None:
    kinematic = "kinematics={path: {share: [0.5], t1: 30}, rates: {share: 0.02, t1: 3}, outputs: [t2, share]}"
    study = study_of(ARM, kinematic)
    table = kinematics(study).tables["motion"]
    assert table["share_velocity"] == pytest.approx(0.02)
    h = 1e-4
    angles = [float(study.mechanism.solve({"share": 0.5 + 0.02 * t, "t1": 30 + 3 * t})["t2"]) for t in (-h, 0, h)]
    assert table["t2_velocity"] == pytest.approx((angles[2] - angles[0]) / (2 * h), rel=1e-6)
    assert table["t2_acceleration"] == pytest.approx((angles[2] - 2 * angles[1] + angles[0]) / h**2, rel=1e-4)


def test_measures_are_limited_and_required() -> None:
    limits = "mechanism.limits=[{measure: mu, min: 55, max: 180}, {measure: lower, max: 55}]"
    study = study_of(
        FOUR_BAR
        + "requirements: [{result: kinematics.half, at_least: 20}, {result: kinematics.lower_error, at_most: 1}]",
        limits,
        "kinematics.outputs=[mu, half, lower]",
        "mechanism.targets={lower: 20}",
    )
    result = kinematics(study)
    table = result.tables["motion"]
    outside = (table["mu"] < 55) | (table["lower"] > 55)
    assert outside.any()
    assert np.array_equal(table["valid"], ~outside)
    verdicts = requirements(study, result)
    assert verdicts[0].worst == np.min(table["half"])
    assert verdicts[1].worst == pytest.approx(np.max(table["lower"]) - 20)


def test_angles_of_measures_are_continuous() -> None:
    text = FOUR_BAR.replace("measures: {", "measures: {to_crank: {angle: [rocker, crank]}, ")
    table = kinematics(
        study_of(text, "kinematics={sweep: {theta: {from: 0, to: 720, step: 120}}, outputs: [to_crank]}")
    ).tables["motion"]
    assert table["to_crank"][-1] - table["to_crank"][0] == pytest.approx(720)


def test_measures_in_reliability() -> None:
    question = """
reliability:
  dimensions: {rod.length: 0.1, theta: 0.05}
  poses: [{reach: 100}, {mu: 60}]
  outputs: [half, lower]
  limits: {reach: 0.2, half: {max: 0.1}}
  methods: analytic
"""
    result = reliability(study_of(FOUR_BAR + question))
    assert set(result.tables["moments"]["output"]) == {"half", "lower", "reach"}
    assert np.isfinite(result.tables["reliability"]["reliability"]).all()


def test_measures_place_what_is_stiff() -> None:
    study = study_of(
        ARM.replace("t2: {angle: fore}", "t2: {angle: fore, from: upper}")
        + "stiffness: {at: P, actuators: {t1: 1e5, t2: 1e5}, poses: [{twice: 90, t1: 30}, {bend: 45, t1: 30}]}"
    )
    table = stiffness(study).tables["stiffness"]
    assert np.isfinite(table["k_x"]).all()
    assert table["k_x"][0] == pytest.approx(table["k_x"][1], rel=1e-12)


def test_a_measure_is_held_in_a_workspace() -> None:
    study = study_of(
        """
mechanism:
  links: {ground: {O: [0, 0]}, a: [O, E, 10], b: [E, F, 8], c: [F, P, 3]}
  drives: [a, b, c]
  sketch: {E: [8, 5], F: [13, 11], P: [16, 11]}
  measures: {reach: {distance: [O, F]}}
workspace: {point: P, at: {reach: 12}, characteristic_length: 5, scan: {rays: 40}}
"""
    )
    indices = workspace(study).tables["indices"]
    # The wrist F on a circle of 12, P 3 from it.
    assert indices["area"] == pytest.approx(np.pi * (15**2 - 9**2), rel=1e-4)
