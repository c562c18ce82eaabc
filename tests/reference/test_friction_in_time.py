"""Motions in time with friction: what slides, comes to rest, sticks and jams, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from helpers.studies import study_of

from mechdesign.ground.results import Result, Table
from mechdesign.questions.dynamics.analysis import dynamics

G = 9.81
UNITS = "units: {length: m, angle: rad, force: N}\n"


def run(text: str) -> Result:
    return dynamics(study_of(UNITS + text))


def kept(table: Table) -> float:
    """The gain of both energies beyond the work, as a part of the largest kinetic energy."""
    energy = table["kinetic_energy"] + table["potential_energy"] - table["work"]
    return float(np.abs(energy - energy[0]).max() / table["kinetic_energy"].max())


def block(slope: float, speed: float, efforts: str = "{}", more: str = "", duration: float = 2) -> Result:
    """A block of 2 kg on an incline, mu = 0.2."""
    return run(f"""
mechanism:
  links: {{ground: {{O: [0, 0]}}, block: {{points: {{B: [0, 0]}}, mass: 2{more}}}}}
  joints: {{way: {{prismatic: [ground, block], through: O, direction: {slope}}}}}
  drives: {{s: {{slide: way}}}}
  sketch: {{B: [0, 0]}}
  friction: {{way: {{coefficient: 0.2}}}}
dynamics:
  gravity: [0, -{G}]
  forward: {{duration: {duration}, start: {{s: 0, s_velocity: {speed}}}, rows: 21, efforts: {efforts}}}
""")


def test_a_guide_that_is_too_short_jams_at_once() -> None:
    # Its centre of mass lies beside the guide: friction would turn it with 2 mu e / L of what slows it down.
    result = run(f"""
mechanism:
  links: {{ground: {{O: [0, 0]}}, block: {{points: {{B: [0, 0]}}, mass: 2, center: [0, 0.5]}}}}
  joints: {{way: {{prismatic: [ground, block], through: O}}}}
  drives: {{s: {{slide: way}}}}
  sketch: {{B: [0, 0]}}
  friction: {{way: {{coefficient: 0.3, length: 0.29}}}}
dynamics: {{gravity: [0, -{G}], forward: {{duration: 2, start: {{s: 0, s_velocity: 1}}, rows: 11}}}}
""")
    assert len(result.main) == 1
    (warning,) = result.warnings
    assert "ended early: friction in way jams the mechanism, no acceleration agrees with it, at 0 s" in str(warning)


@pytest.mark.nightly
def test_friction_of_its_pin_brings_a_pendulum_to_rest() -> None:
    mass, reach, inertia, arm = 1.5, 0.5, 0.1, 0.3 * 0.1
    result = run(f"""
mechanism:
  links:
    ground: {{O: [0, 0]}}
    arm: {{from: O, to: P, length: 1, mass: {mass}, center: [{reach}, 0], inertia: {inertia}}}
  drives: {{theta: {{angle: arm}}}}
  friction: {{O: {{coefficient: 0.3, radius: 0.1}}}}
dynamics: {{gravity: [0, -{G}], forward: {{duration: 9.5, start: {{theta: 0.5}}, rows: 96}}}}
""")
    table, events = result.main, result.tables["events"]
    assert kept(table) < 1e-10
    # An integration of its own, from turning point to turning point, ends there at this time.
    assert events["event"].tolist() == ["standstill"]
    assert events["time"][0] == pytest.approx(9.369292581349, abs=1e-8)
    assert table["theta"][-1] == pytest.approx(-1.545638494513, abs=1e-8)
    assert abs(math.cos(table["theta"][-1])) * reach < arm


@pytest.mark.nightly
def test_a_slider_crank_coasts_down_by_friction_alone() -> None:
    pin = "{coefficient: 0.1, radius: 0.01}"
    result = run(f"""
mechanism:
  links:
    ground: {{O: [0, 0]}}
    crank: {{from: O, to: A, length: 0.05, mass: 1, center: [0.01, 0], inertia: 0.004}}
    rod: {{from: A, to: B, length: 0.2, mass: 0.5, center: [0.07, 0], inertia: 0.003}}
    piston: {{points: {{B: [0, 0]}}, mass: 0.8}}
  joints: {{bore: {{prismatic: [ground, piston], through: O}}}}
  drives: {{theta: {{angle: crank}}}}
  sketch: {{A: [0.05, 0.01], B: [0.25, 0]}}
  friction: {{O: {pin}, A: {pin}, B: {pin}, bore: {{coefficient: 0.1}}}}
dynamics: {{gravity: [0, -{G}], forward: {{duration: 4, start: {{theta: 0.5, theta_velocity: 15}}}}}}
""")
    table, events = result.main, result.tables["events"]
    assert kept(table) < 1e-10
    assert np.array_equal(table["work"], table["friction_work"])
    assert (np.diff(table["friction_work"]) <= 0).all()
    assert events["event"].tolist() == ["standstill"]
    still = table["time"] > events["time"][0]
    assert still.any()
    assert not table["theta_velocity"][still].any()


@pytest.mark.nightly
def test_joints_of_an_arm_stick_and_slip_one_by_one() -> None:
    # A double pendulum of an integration of its own, with tanh(w / 2e-5) in place of the sign: 1e-5 apart.
    result = run(f"""
mechanism:
  links:
    ground: {{O: [0, 0]}}
    a: {{from: O, to: P, length: 1, mass: 1, center: [0.5, 0], inertia: 0.0833}}
    b: {{from: P, to: Q, length: 0.8, mass: 1, center: [0.4, 0], inertia: 0.05}}
  drives: {{t1: {{angle: a}}, t2: {{angle: b, from: a}}}}
  friction: {{O: {{coefficient: 0.3, radius: 0.1}}, P: {{coefficient: 0.3, radius: 0.15}}}}
dynamics:
  gravity: [0, -{G}]
  forward:
    {{duration: 2.5, start: {{t1: -0.8, t2: 1.0, t1_velocity: 1}}, rows: 26, efforts: {{t1: "6*cos(3*time)"}}}}
""")
    table = result.main
    rows = np.searchsorted(table["time"], [1.0 - 1e-9, 1.3 - 1e-9, 2.0 - 1e-9, 2.5 - 1e-9])
    assert table["t1"][rows] == pytest.approx([-2.14608431, -2.88721363, -1.98251063, -0.22401411], abs=5e-6)
    assert table["t2"][rows] == pytest.approx([0.26832262, 0.16595454, -0.86655166, -0.03075052], abs=5e-6)
    # Between 1.2 s and 1.3 s the elbow sticks.
    assert np.abs(table["t2_velocity"][12:14]).max() < 1e-9
    assert kept(table) < 1e-10
