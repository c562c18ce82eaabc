"""Natural frequencies of what is indifferent, nearly so, or drawn at the origin."""

from __future__ import annotations

import numpy as np
import pytest

import mechdesign

ARM = """
units: {{length: m}}
mechanism:
  links:
    ground: {{O: [0, 0], H: [0, 0.3]}}
    arm: {{from: O, to: P, length: 1, mass: 2 kg, center: [{center}, 0], inertia: 0.1 kg*m^2}}
  drives: [arm]
  springs: {{lift: {{between: [H, P], stiffness: {stiffness} N/m, free_length: 0}}}}
dynamics: {{sweep: {{arm: {{from: 0, to: 360, step: 30}}}}, gravity: [0, -9.81 m/s^2], modes: true}}
"""
# Two slides whose points all lie at the origin of the sketch.
STAGE = """
units: {length: mm}
mechanism:
  links: {ground: {O: [0, 0]}, a: {points: {A: [0, 0]}, mass: 1 kg}, b: {points: {B: [0, 0]}, mass: 2 kg}}
  joints: {x: {prismatic: [ground, a], through: O}, y: {prismatic: [a, b], through: A, direction: 90}}
  drives: {x: {slide: x}, y: {slide: y}}
kinematics: {path: {B: [[0, 0], [10, 20], [30, 0]]}, speed: 10, outputs: [B]}
dynamics: {poses: [{x: 0, y: 0}], modes: true, loads: [{at: B, force: ["-0.9*B.x", "-0.6*B.y"]}]}
"""
# Weight and spring balance at every angle where the stiffness times its arms is the weight times its own.
BALANCED = 2 * 9.81 * 0.5 / 0.3


def frequencies(text: str) -> np.ndarray:
    return np.asarray(mechdesign.dynamics(mechdesign.load(text=text)).tables["modes"]["frequency"])


def test_an_indifferent_arm_has_the_frequency_zero() -> None:
    assert (frequencies(ARM.format(center=0, stiffness=0)) == 0).all()
    assert (frequencies(ARM.format(center=0.5, stiffness=BALANCED)) == 0).all()


def test_a_level_pendulum_is_indifferent_and_a_raised_one_unstable() -> None:
    frequency, angle = frequencies(ARM.format(center=0.5, stiffness=0)), np.deg2rad(np.arange(0, 361, 30))
    assert (frequency[[0, 6, 12]] == 0).all()
    assert np.isnan(frequency[1:6]).all()
    below = np.sqrt(-2 * 9.81 * 0.5 * np.sin(angle[7:12]) / 0.6) / (2 * np.pi)
    assert frequency[7:12] == pytest.approx(below, rel=1e-9)


def test_a_millionth_of_the_balance_is_no_rounding() -> None:
    frequency = frequencies(ARM.format(center=0.5, stiffness=BALANCED * (1 + 1e-6)))
    assert frequency[3] == pytest.approx(np.sqrt(2 * 9.81 * 0.5 * 1e-6 / 0.6) / (2 * np.pi), rel=1e-4)
    assert np.isnan(frequency[9])


def test_slides_drawn_at_the_origin_have_their_modes_and_follow_a_path() -> None:
    # 900 N/m on 3 kg and 600 N/m on 2 kg: one frequency twice.
    assert frequencies(STAGE) == pytest.approx(np.sqrt(300) / (2 * np.pi), rel=1e-9)
    motion = mechdesign.kinematics(mechdesign.load(text=STAGE)).tables["motion"]
    assert np.asarray(motion["x_velocity"]) == pytest.approx([10 / np.sqrt(5), 10 / np.sqrt(2), 10 / np.sqrt(2)])


def test_no_modes_without_inertia_along_a_motion() -> None:
    assert np.isnan(frequencies(STAGE.replace("mass: 2 kg", "mass: 0 kg"))).all()
