"""What is the same all along a motion has no place of its extreme: in tables, verdicts, pictures and key numbers."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from helpers.pages import faults
from helpers.pictures import figure_of

import mechdesign
from mechdesign.door.report.page.headlines import headlines
from mechdesign.drawing import style

# A crank that bears a force of a constant size, which turns with it, and of a size that changes.
CRANK = """
mechanism:
  links: {ground: {O: [0, 0]}, crank: [O, A, 40]}
  drives: [crank]
  sketch: {A: [40, 0]}
kinematics:
  sweep: {crank: {from: 0, to: 360, step: 40}}
  rates: {crank: 60 rpm}
  outputs: [crank.angle]
dynamics:
  loads: [{at: A, force: FORCE, in: crank}]
requirements:
  - {result: dynamics.O_force, at_most: 5}
  - {result: dynamics.magnitude, where: {joint: O}, at_most: 5}
  - {result: dynamics.O_force.max, at_most: 5}
"""
CONSTANT, CHANGING = "[0, 10]", '[0, "20 + 10*sin(crank)"]'


@cache
def answered(force: str) -> tuple[mechdesign.Study, mechdesign.Answer]:
    study = mechdesign.load(text=CRANK.replace("FORCE", force))
    return study, mechdesign.dynamics(study)


def test_a_constant_force_has_extremes_without_places() -> None:
    table = answered(CONSTANT)[1].tables["extremes"]
    (row,) = np.flatnonzero(table["output"] == "O_force")
    assert [table[name][row] for name in ("min", "max", "peak", "mean")] == pytest.approx([10.0] * 4)
    assert np.isnan([table[name][row] for name in ("min_at", "max_at", "peak_at")]).all()
    changing = answered(CHANGING)[1].tables["extremes"]
    assert changing["peak_at"][row] == pytest.approx(90)


def test_a_constant_velocity_has_extremes_without_places() -> None:
    table = mechdesign.kinematics(answered(CONSTANT)[0]).tables["extremes"]
    (row,) = np.flatnonzero(table["output"] == "crank.angle_velocity")
    assert table["max"][row] == pytest.approx(360)
    assert np.isnan([table["min_at"][row], table["max_at"][row]]).all()


DAMPED = """
mechanism:
  links: {ground: {O: [0, 0]}, crank: [O, A, 30], rod: [A, B, 90], piston: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, piston], point: B}}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [80, 0]}
dynamics:
  sweep: {theta: {from: 20, to: 100, step: 40}}
  rates: {theta: 300 rpm}
  loads: [{at: B, force: ["FORCE", 0]}]
"""


@pytest.mark.parametrize("force", ["-0.2*B.x_velocity", "-0.2*B.x", "-20*max(-1, min(1, B.x_velocity))"])
def test_what_a_load_by_the_motion_leaves_at_rounding_is_zero(force: str) -> None:
    """Nothing but the load acts, along the line through the crank's pivot: it turns the frame nowhere."""
    result = mechdesign.dynamics(mechdesign.load(text=DAMPED.replace("FORCE", force)))
    table = result.tables["extremes"]
    (row,) = np.flatnonzero(table["output"] == "shaking_moment")
    assert [table[name][row] for name in ("min", "max", "peak", "mean", "rms")] == [0] * 5
    (row,) = np.flatnonzero(table["output"] == "shaking")
    assert table["peak"][row] >= np.abs(result.main["shaking.x"]).max() > 10


@pytest.mark.slow
def test_the_extreme_of_a_force_that_keeps_its_size_is_that_of_the_rows() -> None:
    """Dry friction changes sides within a thousandth of a degree: there the piston is 4/3 as fast as the crank pin."""
    force = "-20*max(-1, min(1, B.x_velocity/0.02))"
    turn = "theta: {from: 0, to: 360, step: 5}"
    text = DAMPED.replace("FORCE", force).replace("theta: {from: 20, to: 100, step: 40}", turn)
    result = mechdesign.dynamics(mechdesign.load(text=text))
    table = result.tables["extremes"]
    (row,) = np.flatnonzero(table["output"] == "shaking.x")
    assert [table[name][row] for name in ("min", "max", "peak")] == [-20, 20, 20]
    assert result.main["shaking.x"].max() == 20
    assert table["max_at"][row] == pytest.approx(np.degrees(0.02 / (10 * np.pi * 30 * 4 / 3)), rel=1e-6)


def test_a_requirement_on_what_is_constant_names_no_pose() -> None:
    places = [verdict.place for verdict in answered(CONSTANT)[1].verdicts]
    assert places == ["joint O, on crank, by ground"] * 3
    assert answered(CHANGING)[1].verdicts[0].place == "crank 90, joint O, on crank, by ground"


@pytest.mark.slow
def test_pictures_say_of_a_constant_force_that_it_is_the_same_everywhere() -> None:
    study, result = answered(CONSTANT)
    with style.context():
        title = figure_of(study, result, "joint_forces").axes[0].get_title("left")
        heading = figure_of(study, result, "free_bodies").texts[0].get_text()
        effort = figure_of(study, result, "efforts").axes[0]
    assert title == "force 10 N everywhere, in O"
    assert "bears most" not in heading
    assert effort.get_title("left").endswith("400 N\N{MIDDLE DOT}mm everywhere")


@pytest.mark.slow
def test_key_numbers_of_what_is_constant_have_no_pose() -> None:
    numbers = {number.label: number for number in headlines(answered(CONSTANT)[1])}
    assert numbers["largest joint force, at O"].value == "10"
    assert numbers["largest joint force, at O"].at == ""
    changing = {number.label: number for number in headlines(answered(CHANGING)[1])}
    assert changing["largest joint force, at O"].at.replace("\N{NO-BREAK SPACE}", " ") == "at crank = 90 deg"


def test_the_cubic_mean_of_a_bearing_load_is_its_constant_load_of_the_same_life() -> None:
    # The mean of (a + b sin)^3 over a turn is a^3 + 3 a b^2/2.
    table = answered(CHANGING)[1].tables["extremes"]
    cubic = dict(zip(table["output"].tolist(), table["cubic_mean"].tolist(), strict=True))
    assert cubic["O_force"] == pytest.approx(np.cbrt(20**3 + 3 * 20 * 10**2 / 2), rel=1e-9)
    assert np.isnan(cubic["crank_effort"])


FRICTION = """
mechanism:
  links:
    ground: {O: [0, 0], G: [200, 0]}
    crank: {from: O, to: A, length: 40, mass: 1, inertia: 20}
    rod: [A, B, 140]
    ram: {points: {B: [0, 0], R: [30, 0]}, mass: 2}
  joints: {guide: {prismatic: [ground, ram], point: B, through: O, angle: 0}}
  drives: [crank]
  sketch: {A: [0, 40], B: [130, 0]}
  friction: {guide: {coefficient: 0.1}}
kinematics:
  sweep: {crank: {from: 0, to: 360, step: 20}}
  outputs: [B.x]
  rates: {crank: 60 rpm}
  mechanical_advantage: {B.x: crank}
  loads: [{at: B, force: [-100, 0]}]
dynamics:
  loads: [{at: B, force: [-100, 0]}]
"""


@pytest.mark.slow
def test_a_mechanical_advantage_says_that_it_leaves_out_the_friction_that_there_is() -> None:
    study = mechdesign.load(text=FRICTION)
    result = mechdesign.kinematics(study)
    assert "without friction though its joints have some" in result.main.column("B.x_advantage").meaning
    with style.context():
        figure = figure_of(study, result, "transmission")
        style.encoded(figure)
        assert not list(faults(figure))
        titles = [axes.get_title("left") for axes in figure.axes]
    assert any("without the friction of the joints" in title for title in titles)
    smooth = mechdesign.load(text=FRICTION.replace("friction: {guide: {coefficient: 0.1}}", "measures: {}"))
    assert "some" not in mechdesign.kinematics(smooth).main.column("B.x_advantage").meaning


@pytest.mark.slow
def test_the_effort_that_balances_loads_and_that_of_the_motion_have_names_of_their_own() -> None:
    study = mechdesign.load(text=FRICTION)
    labels = [number.label for question in (mechdesign.kinematics, mechdesign.dynamics)
              for number in headlines(question(study)) if "effort" in number.label]  # fmt: skip
    assert labels == ["largest static effort of crank", "peak effort of crank with weights and inertia"]
