"""Velocities that jump along a motion: what has mass takes an impulse there, which no row of efforts has."""

from __future__ import annotations

import pytest

import mechdesign

TABLE_DRIVE = """
mechanism:
  links:
    ground: {O: [0, 0]}
    cart: {points: {P: [0, 0]}%(mass)s}
  joints: {rail: {prismatic: [ground, cart], through: O, point: P}}
  drives: [rail]
  sketch: {P: [10, 0]}
dynamics:
  motion: {rail: [{from: 0, to: 50, time: 0.4, law: %(law)s}, {dwell: 0.3}]}
requirements: [{result: dynamics.rail_effort, abs: true, at_most: 100}]
"""
GANTRY = """
mechanism:
  links:
    ground: {O: [0, 0]}
    bridge: {points: {B: [0, 0]}, mass: 2}
    head: {points: {P: [0, 0]}, mass: 1}
  joints:
    x: {prismatic: [ground, bridge], through: O, point: B}
    y: {prismatic: [bridge, head], through: B, point: P, direction: 90}
  drives: [x, y]
  sketch: {B: [10, 0], P: [10, 10]}
dynamics: {path: {P: %s}, speed: 100}
requirements: [{result: dynamics.x_effort, abs: true, at_most: 1e6}]
"""
FOLLOWER = """
mechanism:
  links: {ground: {O: [0, 0], C: [80, 0]}, crank: [O, A, 30], wheel: {from: C, to: B, length: 20%(mass)s}}
  drives: {theta: {angle: crank}}
  couplings: {law: {set: wheel.angle, to: "%(to)s"}}
  sketch: {A: [30, 0], B: [100, 0]}
dynamics: {sweep: {theta: {from: 0, to: 360, step: %(step)s}}, rates: {theta: 100}}
requirements: [{result: dynamics.theta_effort, abs: true, at_most: 1e9}]
"""


@pytest.mark.parametrize(("law", "mass", "jumps"), [
    ("constant", ", mass: 1", True), ("constant", "", False), ("cycloidal", ", mass: 1", False),
])  # fmt: skip
def test_a_mass_that_stops_at_once_takes_an_impulse(law: str, mass: str, jumps: bool) -> None:
    study = mechdesign.load(text=TABLE_DRIVE % {"law": law, "mass": mass})
    answer = mechdesign.dynamics(study)
    words = " ".join(str(warning) for warning in answer.warnings)
    assert ("the velocity jumps at 1 instant, the first: time = 0.4 s" in words) == jumps
    (verdict,) = answer.verdicts
    assert verdict.met == (not jumps)
    assert ("the impulses of 1 velocity jump are missing" in str(verdict)) == jumps


@pytest.mark.parametrize(
    ("path", "corners"),
    [
        ("[[0, 0], [40, 0], [40, 30], [0, 60]]", 2), ("{line: [[0, 0], [40, 30]], points: 9}", 0),
        ("{circle: {center: [0, 0], radius: 20}, points: 9}", 0),
    ],
)  # fmt: skip
def test_a_corner_of_a_path_takes_an_impulse(path: str, corners: int) -> None:
    answer = mechdesign.dynamics(mechdesign.load(text=GANTRY % path))
    words = " ".join(str(warning) for warning in answer.warnings)
    assert (f"the path has corners at {corners} poses, the first: P.x = 40 mm, P.y = 0 mm" in words) == (corners > 0)
    assert [verdict.met for verdict in answer.verdicts] == [corners == 0]


@pytest.mark.slow
@pytest.mark.parametrize("step", [20, 50, 90])
@pytest.mark.parametrize(
    ("to", "places"),
    [
        ("40 + 10*abs(sin(theta))", ["theta = 180 deg"]), ("max(0, theta - 123.4)", ["theta = 123.4 deg"]),
        ("40 + 10*sin(theta)", []), ("theta + max(0, theta - 123.4)**2/200", []),
        ("abs(theta - 123.4)*(theta - 123.4)/50", []),
    ],
)  # fmt: skip
def test_a_corner_of_a_coupling_takes_an_impulse(to: str, places: list[str], step: int) -> None:
    heavy = mechdesign.dynamics(mechdesign.load(text=FOLLOWER % {"to": to, "step": step, "mass": ", mass: 1"}))
    words = " ".join(str(warning) for warning in heavy.warnings)
    assert ("velocity jumps at 1 instant" in words) == bool(places)
    assert all(place in words for place in places)
    assert [verdict.met for verdict in heavy.verdicts] == [not places]
    light = mechdesign.dynamics(mechdesign.load(text=FOLLOWER % {"to": to, "step": step, "mass": ""}))
    assert [verdict.met for verdict in light.verdicts] == [True]
    text = FOLLOWER % {"to": to, "step": step, "mass": ""}
    motion = mechdesign.kinematics(
        mechdesign.load(text=text.replace("dynamics:", "kinematics:", 1).split("require")[0])
    )
    assert ("velocity jumps" in " ".join(str(warning) for warning in motion.warnings)) == bool(places)
