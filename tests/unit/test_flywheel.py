"""Flywheels bear the surplus of a whole cycle, however coarse its rows, and what is no cycle is said."""

from __future__ import annotations

import re

import numpy as np
import pytest

import mechdesign

WHEEL = """
units: {{length: m, angle: rad}}
mechanism:
  links: {{ground: {{O: [0, 0]}}, wheel: {{from: O, to: P, length: 1, mass: 1, center: [0, 0], inertia: 0.5}}}}
  drives: {{theta: {{angle: wheel}}}}
dynamics:
  loads: [{{link: wheel, moment: "{moment}"}}]
  flywheel: {{fluctuation: 0.05}}
  sweep: {{theta: {{from: 0, to: {to}, number: 10}}}}
  rates: {{theta: 7}}
"""
PRESS = """
units: {length: m}
mechanism:
  links:
    ground: {O: [0, 0]}
    crank: {from: O, to: A, length: 0.05, mass: 1, center: [0.01, 0], inertia: 0.004}
    rod: {from: A, to: B, length: 0.2, mass: 0.5, center: [0.07, 0], inertia: 0.003}
    piston: {points: {B: [0, 0]}, mass: 0.8}
  joints: {bore: {prismatic: [ground, piston], through: O}}
  drives: {theta: {angle: crank}}
  sketch: {A: [0.05, 0], B: [0.25, 0]}
dynamics:
  sweep: {theta: {from: 0, to: 360, step: 15}}
  rates: {theta: 200 rpm}
  loads: [{at: B, force: ["-900*max(0, min(1, (0.162 - B.x)/0.0005))*max(0, min(1, 10*B.x_velocity))", 0]}]
  flywheel: {fluctuation: 0.05}
"""
# A wheel with its mass beside its axis, geared to the drive so that it turns once in two turns of this.
GEARED = """
units: {{length: m}}
mechanism:
  links:
    ground: {{A: [0, 0], B: [0.3, 0]}}
    a: {{from: A, to: P, length: 0.05, mass: 1, center: [0, 0], inertia: 0.01}}
    b: {{from: B, to: Q, length: 0.05, mass: 2, center: [0.05, 0], inertia: 0.01}}
  couplings: {{g: {{set: b, of: a, ratio: -0.5}}}}
  drives: [a]
  sketch: {{P: [0.05, 0], Q: [0.35, 0]}}
dynamics:
  gravity: [0, -9.81]
  flywheel: {{fluctuation: 0.05}}
  sweep: {{a: {{from: {begin}, to: {end}, step: 10}}}}
  rates: {{a: 60 rpm}}
"""


def answer(text: str, **changes: object) -> mechdesign.Answer:
    changed = {name.replace("__", "."): value for name, value in changes.items()}
    return mechdesign.dynamics(mechdesign.load(text=text, overrides=changed))


def number(result: mechdesign.Answer, name: str) -> float:
    return float(result.tables["flywheel"][name][0])


@pytest.mark.slow
def test_the_surplus_of_a_press_does_not_follow_the_step() -> None:
    fine = answer(PRESS, dynamics__sweep__theta__step=0.05).tables["dynamics"]
    angle, effort = np.deg2rad(fine["theta"]), fine["theta_effort"]
    gained = np.concatenate([[0.0], np.cumsum((effort[1:] + effort[:-1]) / 2 * np.diff(angle))])
    mean = gained[-1] / (2 * np.pi)
    for step in (15, 7.2, 5):
        result = answer(PRESS, dynamics__sweep__theta__step=step)
        assert not result.warnings
        assert number(result, "mean_effort") == pytest.approx(mean, rel=1e-4)
        assert number(result, "surplus") == pytest.approx(np.ptp(gained - mean * angle), rel=1e-4)
        extremes = result.tables["extremes"]
        assert number(result, "mean_effort") == extremes["mean"][extremes["output"] == "theta_effort"][0]


def test_a_moment_of_a_five_hundredth_of_a_turn_between_rows_is_borne() -> None:
    result = answer(WHEEL.format(moment="-100*max(0, 1 - abs(cos(theta/2))/0.003)", to="2*pi"))
    work = 100 * 2 * (2 * np.arcsin(0.003) - 2 * (1 - np.sqrt(1 - 0.003**2)) / 0.003)
    inside = 4 * np.arcsin(0.003 * (1 - work / (2 * np.pi) / 100))
    # Of the triangle, nearly, what is above the mean.
    assert number(result, "mean_effort") == pytest.approx(work / (2 * np.pi), rel=1e-9)
    assert number(result, "surplus") == pytest.approx(100 / 2 * inside * (1 - work / (2 * np.pi) / 100), rel=1e-4)
    assert not result.warnings


def test_half_a_turn_is_a_cycle_of_what_returns_after_it() -> None:
    result = answer(WHEEL.format(moment="-3 - 2*cos(2*theta)", to="pi"))
    assert number(result, "surplus") == pytest.approx(2, rel=1e-12)
    assert not result.warnings


def test_an_effort_that_jumps_over_its_mean_has_its_surplus_at_the_jump() -> None:
    result = answer(WHEEL.format(moment="-abs(sin(theta + 0.3))/sin(theta + 0.3)", to="2*pi"))
    assert number(result, "surplus") == pytest.approx(np.pi, rel=1e-12)


@pytest.mark.parametrize(
    ("moment", "to"),
    [
        ("-3 - 2*cos(theta)", "6.2"),  # a little less than a turn
        ("-3*cos(theta/2)", "2*pi"),  # one turn of two
        ("-3*sin(theta)**2 - theta*0.01", "2*pi"),  # the effort does not return
    ],
)
def test_a_sweep_that_is_no_cycle_has_no_flywheel(moment: str, to: str) -> None:
    result = answer(WHEEL.format(moment=moment, to=to))
    assert np.isnan(number(result, "surplus"))
    (warning,) = result.warnings
    assert warning.kind == "undefined"
    assert "the effort is another" in warning.message


def test_a_load_that_is_written_for_one_turn_alone_is_taken_to_repeat_with_a_word() -> None:
    result = answer(WHEEL.format(moment="-100*max(0, 1 - abs(theta - 5.1)/0.003)", to="2*pi"))
    assert number(result, "mean_effort") == pytest.approx(0.3 / (2 * np.pi), rel=1e-9)
    assert [warning.kind for warning in result.warnings] == ["assumed"]


@pytest.mark.slow
@pytest.mark.parametrize(("begin", "end", "whole"), [(0, 360, False), (180, 540, False), (90, 810, True)])
def test_a_wheel_geared_down_returns_after_two_turns(begin: float, end: float, whole: bool) -> None:
    result = answer(GEARED.format(begin=begin, end=end))
    assert bool(result.warnings) != whole
    assert number(result, "surplus") == pytest.approx(2 * 9.81 * 0.05 * 2 if whole else np.nan, rel=1e-12, nan_ok=True)


def test_a_cycle_within_limits_of_a_turn_is_one() -> None:
    text = WHEEL.format(moment="-2*cos(theta)", to="2*pi")
    limited = text.replace("dynamics:", "  limits: [{drive: theta, min: 0, max: 2*pi}]\ndynamics:")
    assert number(answer(limited), "surplus") == pytest.approx(4, rel=1e-12)


@pytest.mark.slow
def test_the_flywheel_has_its_units_and_is_a_key_number() -> None:
    result = answer(PRESS)
    table = result.tables["flywheel"]
    assert [table[f"{kind}_unit"][0] for kind in ("speed", "moment", "inertia")] == ["deg/s", "N*m", "kg*m^2"]
    assert table.column("added_inertia").unit == "kg*m^2"
    shown = re.search(r"that the flywheel adds on theta: <strong>(\S+) kg·m²</strong>", result._repr_html_())
    assert float(shown[1]) == pytest.approx(number(result, "added_inertia"), rel=1e-2)
