"""Expressions see angles as the columns beside them show them: along a motion, about a nominal pose, within limits."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

# A slider to the left of its crank: the rod points at 180 deg.
LEFT = """
units: {length: mm, angle: deg}
mechanism:
  links:
    ground: {O: [0, 0], G: [0, 0]}
    crank: [O, A, 20]
    rod: [A, B, 60]
    block: {B: [0, 0]}
  joints: {guide: {prismatic: [ground, block], through: G}}
  drives: {th: {angle: crank}}
  sketch: {A: [-5, 19], B: [-62, 0]}
  measures: {tilt: rod.angle - 180, half: th/2, wave: sin(rod.angle)}
"""
SWEEP = "  sweep: {th: {from: 0, to: 720, step: 5}}\n"
FOUR_BAR = """
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
  measures: {m: 2*theta - rocker.angle}
kinematics: {sweep: {theta: {from: -100, to: 700, step: STEP}}, outputs: [m, rocker.angle]}
"""
ARM = """
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 10], fore: [E, P, 8]}
  drives: {a: {angle: upper}, b: {angle: fore, from: upper}}
  sketch: {E: [8, 5], P: [13, 11]}
  measures: {both: a + b}
"""


def test_a_rod_that_points_to_the_left() -> None:
    text = LEFT + "  targets: {half: th/2}\nkinematics:\n" + SWEEP + "  outputs: [tilt, half, rod.angle, wave]\n"
    tables = mechdesign.kinematics(study_of(text)).tables
    motion, extremes = tables["motion"], tables["extremes"]
    tilt = np.degrees(np.arcsin(np.sin(np.radians(motion["th"])) / 3))
    assert motion["tilt"] == pytest.approx(tilt, abs=1e-9)
    assert motion["rod.angle"] == pytest.approx(tilt + 180)
    assert motion["half"] == pytest.approx(motion["th"] / 2)
    assert motion["wave"] == pytest.approx(-np.sin(np.radians(tilt)), abs=1e-12)
    assert motion["half_error"] == pytest.approx(0, abs=1e-9)
    ranges = dict(zip(extremes["output"].tolist(), extremes["range"].tolist(), strict=True))
    assert ranges["tilt"] == pytest.approx(2 * math.degrees(math.asin(1 / 3)))
    assert tables["targets"]["max_abs"] == pytest.approx(0, abs=1e-9)


def test_samples_about_the_cut_are_near_their_nominal_pose() -> None:
    text = LEFT.replace("O: [0, 0], G", "O: [0, 0.02], G")
    text += "reliability:\n  poses: [{th: 0}, {th: 180}]\n  dimensions: {ground.G.y: {sigma: 0.02}}\n"
    text += "  outputs: [tilt]\n  limits: {tilt: 0.9}\n  methods: [analytic, monte_carlo, form]\n  samples: 20000\n"
    tables = mechdesign.reliability(study_of(text)).tables
    drawn = np.random.default_rng(1).normal(0, 0.02, 100_000)
    sigma = np.degrees(np.arcsin((drawn - 0.02) / 60)).std()
    assert tables["moments"]["sigma"] == pytest.approx(sigma, rel=0.02)
    assert tables["reliability"]["failure"].max() < 1e-9


def test_a_range_is_the_same_for_designs_together() -> None:
    text = LEFT.replace("rod: [A, B, 60]", "rod: [A, B, l]").replace("  links:", "  parameters: {l: 60}\n  links:", 1)
    text += "kinematics:\n" + SWEEP + "  outputs: [tilt]\n"
    text += "optimize:\n  variables: {l: {from: 50, to: 70, step: 10}}\n  minimize: [kinematics.extremes.range]\n"
    designs = mechdesign.optimize(study_of(text)).tables["designs"]
    expected = 2 * np.degrees(np.arcsin(20 / designs["l"]))
    assert designs["kinematics.extremes.range"] == pytest.approx(expected)


@pytest.mark.slow
@pytest.mark.parametrize("step", [5, 30, 100])
def test_a_limit_of_a_measure_follows_the_motion(step: int) -> None:
    limited = FOUR_BAR.replace("kinematics:", "  limits: [{measure: m, min: -100, max: 900}]\nkinematics:")
    free = mechdesign.kinematics(study_of(FOUR_BAR.replace("STEP", "1"))).tables["motion"]
    tables = mechdesign.kinematics(study_of(limited.replace("STEP", str(step)))).tables
    motion, limits = tables["motion"], tables["limits"]
    assert np.abs(np.diff(free["m"])).max() < 4
    assert motion["m"] == pytest.approx(np.interp(motion["theta"], free["theta"], free["m"]))
    assert (motion["valid"] == (motion["m"] >= -100) & (motion["m"] <= 900)).all()
    assert limits["m"] == pytest.approx([-100, 900])
    assert limits["theta"] == pytest.approx(np.interp([-100, 900], free["m"], free["theta"]), abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("low", "high"), [(0, 500), (0, 360), (-60, 60), (200, 260)])
def test_a_drive_that_turns_on_counts_as_given(low: float, high: float) -> None:
    limited = FOUR_BAR.replace("kinematics:", f"  limits: [{{drive: theta, min: {low}, max: {high}}}]\nkinematics:")
    tables = mechdesign.kinematics(study_of(limited.replace("STEP", "7"))).tables
    theta = tables["motion"]["theta"]
    assert (tables["motion"]["valid"] == (theta >= low) & (theta <= high)).all()
    assert tables["limits"]["theta"] == pytest.approx([low, high])


def test_listed_poses() -> None:
    text = ARM + "kinematics: {poses: [{a: 200, b: 30}, {P.x: -15, P.y: 2}], outputs: [upper.angle, both, a]}\n"
    found = mechdesign.kinematics(study_of(text)).tables["motion"]
    # What is given keeps its turn, what is found is in (-180, 180].
    assert found["both"][0] == pytest.approx(230)
    assert found["upper.angle"][0] == pytest.approx(-160)
    assert abs(found["a"][1]) < 180
    # A drive that is found lies within its limits.
    limited = study_of(text.replace("kinematics:", "  limits: [{drive: a, min: 400, max: 600}]\nkinematics:"))
    again = mechdesign.kinematics(limited).tables["motion"]
    assert again["valid"].tolist() == [False, True]
    assert 400 <= again["a"][1] <= 600
    assert np.cos(np.radians(again["a"][1] - found["a"][1])) == pytest.approx(1)
    assert again["both"][1] == pytest.approx(again["a"][1] + again["b"][1])


@pytest.mark.nightly
def test_drives_on_the_boundary_of_a_shipped_robot() -> None:
    study = mechdesign.load(Path(__file__).parents[2] / "configs/gallery/scara.yaml")
    boundary = mechdesign.workspace(study).tables["boundary"]
    assert np.abs(boundary["q1"]).max() == pytest.approx(125)
    assert boundary["q2"].min() == pytest.approx(15)
    assert boundary["q2"].max() == pytest.approx(140)
