"""Published and textbook mechanisms, each with its source."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of

from mechdesign.mechanism.outputs import first, second

STEPHENSON = """
mechanism:
  links:
    ground: {A: [7, 4], D: [23, 10], G: [45, 17]}
    crank: {points: [A, B]}
    ternary: {points: [B, C, E]}
    rocker: {points: [C, D]}
    link: {points: [E, F]}
    output: {points: [F, G]}
  drives: [crank]
  sketch: {B: [5, 16], C: [25, 25], E: [18, 35], F: [43, 32]}
"""


def test_stephenson_six_bar() -> None:
    # The verification numbers of issue 3: crank at 10 rpm, 10 deg on from the drawn pose.
    mechanism = study_of(STEPHENSON).mechanism
    drawn = mechanism.sketch_configuration.value(mechanism.coordinate("crank"))
    configuration = mechanism.forward.solve([drawn + np.radians(10)])
    linear = mechanism.linearize(configuration)
    velocity = linear.velocity([2 * np.pi * 10 / 60])
    acceleration = linear.acceleration(velocity, [0.0])
    point = [mechanism.coordinate(name) for name in ("F.x", "F.y")]
    assert [float(configuration.value(c)) for c in point] == pytest.approx([40.240922, 31.364929], abs=5e-7)
    assert [first(configuration, c, velocity) for c in point] == pytest.approx([-16.383413, -5.427798], abs=5e-7)
    accelerations = [second(configuration, c, velocity, velocity, acceleration) for c in point]
    # The published x component, 2.248607, is not that of the published positions: central differences of the six-bar
    # drawn with circles, extrapolated to no step, give 2.2485086; y agrees in every digit.
    assert accelerations == pytest.approx([2.2485086, -19.991494], abs=5e-7)


def test_stephenson_driven_through_its_floating_side_moves_the_same() -> None:
    """Driven at the output link the six-bar is one group without a closed form: Newton and continuation."""
    forward = study_of(STEPHENSON).mechanism
    reverse = study_of(STEPHENSON.replace("drives: [crank]", "drives: [output]")).mechanism
    drawn = forward.sketch_configuration.value(forward.coordinate("crank"))
    expected = forward.forward.solve([drawn + np.radians(np.linspace(-20, 40, 31))])
    found = reverse.forward.solve([expected.value(forward.coordinate("output.angle"))])
    assert found.valid.all()
    assert found.point("C") == pytest.approx(expected.point("C"), abs=1e-10)


def test_four_bar_rates() -> None:
    # Lengths 1, 3.5, 3, 4 (crank, coupler, rocker, ground) at 60 deg, open, crank at 1 rad/s.
    mechanism = study_of("""
mechanism:
  links: {ground: {O: [0, 0], D: [4, 0]}, crank: [O, A, 1], rod: [A, B, 3.5], rocker: [D, B, 3]}
  drives: [crank]
  sketch: {A: [0.5, 0.9], B: [3.3, 2.9]}
""").mechanism
    configuration = mechanism.forward.solve([np.radians(60)])
    linear = mechanism.linearize(configuration)
    velocity = linear.velocity([1.0])
    rocker = mechanism.coordinate("rocker.angle")
    assert float(first(configuration, rocker, velocity)) == pytest.approx(0.147301, abs=5e-7)
    bend = second(configuration, rocker, velocity, velocity, linear.acceleration(velocity, [0.0]))
    assert float(bend) == pytest.approx(0.378656, abs=5e-7)


def test_peaucellier_cell_draws_a_straight_line() -> None:
    # O B * O D = l1^2 - l2^2, and B on a circle through O: D on a line [Artobolevsky, Mechanisms vol. 1].
    mechanism = study_of("""
mechanism:
  links:
    ground: {O: [0, 0], Q: [2, 0]}
    crank: [Q, B, 2]
    a: [O, A, 5]
    c: [O, C, 5]
    r1: [A, B, 2]
    r2: [C, B, 2]
    r3: [A, D, 2]
    r4: [C, D, 2]
  drives: [crank]
  sketch: {B: [4, 0.2], A: [4.8, 1.7], C: [4.8, -1.7], D: [5.3, 0]}
""").mechanism
    pose = mechanism.solve({"crank": np.linspace(-60, 60, 25)})
    assert pose["D.x"] == pytest.approx((5**2 - 2**2) / 4, abs=1e-12)


def test_oldham_coupling_turns_one_to_one_and_its_disc_runs_on_a_circle() -> None:
    # The disc's centre sees both shafts under a right angle, so it runs on the circle over their distance (Thales).
    mechanism = study_of("""
mechanism:
  links: {ground: {O: [0, 0], D: [1, 0.3]}, a: {O: [0, 0]}, disc: {M: [0, 0]}, b: {D: [0, 0]}}
  joints:
    one: {prismatic: [a, disc], through: O, point: M}
    two: {prismatic: [b, disc], through: D, point: M, angle: -90}
  drives: [a]
  sketch: {M: [0.5, 0]}
""").mechanism
    pose = mechanism.solve({"a": np.linspace(-170, 170, 35)})
    assert np.mod(pose["b.angle"] - pose["a.angle"], 360) == pytest.approx(90, abs=1e-10)
    centre = pose["M.x"] + 1j * pose["M.y"] - (0.5 + 0.15j)
    assert np.abs(centre) == pytest.approx(abs(0.5 + 0.15j), abs=1e-13)


def test_whitworth_quick_return_ratio() -> None:
    # Crank r inside the distance d of the pivots: the arm swings +-asin(r/d), return in 180 - 2 asin(r/d) of the turn.
    mechanism = study_of("""
mechanism:
  links: {ground: {O: [0, 3], D: [0, 0]}, crank: [O, A, 1.5], arm: [D, E, 6]}
  joints: {slot: {slot: arm, through: D, point: A}}
  drives: [crank]
  sketch: {A: [1, 4.1], E: [1.4, 5.8]}
""").mechanism
    angle = np.linspace(0, 360, 3601)
    arm = mechanism.solve({"crank": angle})["arm.angle"]
    swing = np.degrees(np.arcsin(1.5 / 3))
    assert (arm.min(), arm.max()) == pytest.approx((90 - swing, 90 + swing), abs=1e-9)
    forward = (angle[arm.argmax()] - angle[arm.argmin()]) % 360
    assert forward / (360 - forward) == pytest.approx((180 + 2 * swing) / (180 - 2 * swing))
