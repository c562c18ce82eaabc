"""Mechanisms of the gallery with several drives or driven by cylinders, against closed forms and statics."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.gallery import point, result_of, study_named, unit


def test_scissor_lift_rises_by_the_law_of_cosines() -> None:
    """l^2 = u^2 + v^2 - 2 u v cos(2 phi), h = L sin(phi), force = W L l/(4 u v sin(phi)) by virtual work."""
    motion = result_of("scissor_lift").tables["motion"]
    length = motion["stroke"]
    phi = np.arccos((250**2 + 350**2 - length**2) / (2 * 250 * 350)) / 2
    assert motion["valid"].all()
    assert motion["height"] == pytest.approx(1000 * np.sin(phi), abs=1e-9)
    assert motion["floor.slide"] == pytest.approx(1000 * np.cos(phi), abs=1e-9)
    gain = 1000 * length / (4 * 250 * 350 * np.sin(phi))
    assert motion["height_velocity"] == pytest.approx(10 * gain, abs=1e-9)
    assert motion["stroke_effort"] == pytest.approx(5000 * gain, abs=1e-6)


def test_robot_arm_reaches_with_its_hand_down() -> None:
    """The wrist lies above the tool; the elbow by the law of cosines; det J = l1 l2 sin(q2).

    J. J. Craig, Introduction to Robotics: the planar arm with three revolute joints.
    """
    motion = result_of("robot_arm").tables["motion"]
    wrist = point(motion, "T") + 0.1j
    q2 = -np.arccos((np.abs(wrist) ** 2 - 0.4**2 - 0.3**2) / (2 * 0.4 * 0.3))
    q1 = np.angle(wrist) - np.angle(0.4 + 0.3 * np.exp(1j * q2))
    for name, angle in (("q1", q1), ("q2", q2), ("q3", -np.pi / 2 - q1 - q2)):
        assert unit(motion[name]) == pytest.approx(np.exp(1j * angle), abs=1e-12)
    assert motion["det_J"] == pytest.approx(0.4 * 0.3 * np.sin(q2), abs=1e-12)
    # Each motor carries 20 N at the tool's distance from its axis.
    elbow = 0.4 * np.exp(1j * q1)
    for name, axis in (("q1", 0), ("q2", elbow), ("q3", wrist)):
        assert motion[f"{name}_effort"] == pytest.approx(20 * np.real(point(motion, "T") - axis), abs=1e-11)


def test_rrr_platform_comes_back_from_the_pose_that_newton_found() -> None:
    """The inverse problem is closed: each crank's pin is where two circles meet.

    From the platform's pose that the cranks gave, the cranks follow again (C. M. Gosselin and J.-P. Merlet, The direct
    kinematics of planar parallel manipulators, Mechanism and Machine Theory 29 (1994)).
    """
    motion = result_of("rrr_platform").tables["motion"]
    valid = motion["valid"] == 1
    assert 30 < valid.sum() < len(motion)
    centre, turn = point(motion, "P")[valid], unit(motion["platform.angle"][valid])
    for k, corner in enumerate((210, -30, 90), start=1):
        pivot, joint = 250 * unit(corner), centre + 60 * unit(corner) * turn
        pin = pivot + 120 * unit(motion[f"q{k}"][valid])
        # The rod's length is the residual of the inverse problem.
        assert np.abs(joint - pin) == pytest.approx(np.full(valid.sum(), 120.0), abs=1e-9)


def test_rrr_platform_ends_at_a_singularity() -> None:
    """The Jacobian from cranks to platform grows without bounds where the rods' lines meet in one point.

    C. M. Gosselin and J. Angeles, Singularity analysis of closed-loop kinematic chains, IEEE Trans. Robotics and
    Automation 6 (1990): singularities of the second kind.
    """
    result = result_of("rrr_platform")
    limit = result.tables["limits"]["q1"]
    assert len(limit) == 1
    near = study_named("rrr_platform").mechanism.solve({"q1": limit[0] - 1e-6, "q2": -174.0, "q3": -54.0})
    assert near.valid.all()
    lines = []
    for k in "123":
        foot, tip = (complex(near[f"{name}{k}.x"], near[f"{name}{k}.y"]) for name in "AC")
        along = (tip - foot) / abs(tip - foot)
        lines.append([along.real, along.imag, np.imag(np.conj(foot / 100) * along)])
    # Plucker coordinates of the three rods are all but dependent, at a length of 100 mm.
    assert abs(np.linalg.det(lines)) < 1e-3


def test_excavator_cylinders_carry_the_teeth() -> None:
    """Moments about O, J and K, each with the one cylinder that crosses it; the bucket's with its four-bar's rods.

    Virtual work in the analysis, free bodies here.
    """
    names = ["O", "G", "B", "S", "E", "H", "L", "M", "N", "K", "J", "T"]
    moving = [name for name in names if name not in "OG"]
    motion = result_of("excavator", f"kinematics.outputs=[{', '.join(moving)}]").tables["motion"]
    place = {name: point(motion, name) for name in moving} | {"O": 0, "G": 0.5 - 0.3j}
    force = 50 + 0j

    def moment(about: str, at: str, vector):
        return np.imag(np.conj(place[at] - place[about]) * vector)

    def along(start: str, end: str):
        span = place[end] - place[start]
        return span / np.abs(span)

    # Positive cylinder efforts push. Boom with all it carries, about O; stick with bucket, about J.
    boom = -moment("O", "T", force) / moment("O", "B", along("G", "B"))
    assert motion["boom_length_effort"] == pytest.approx(boom, abs=1e-9)
    stick = -moment("J", "T", force) / moment("J", "E", along("S", "E"))
    assert motion["stick_length_effort"] == pytest.approx(stick, abs=1e-9)
    # The coupler holds the bucket about K, and pin M holds coupler, rocker and cylinder in balance (moments about L).
    coupler = -moment("K", "T", force) / moment("K", "N", along("M", "N"))
    bucket = coupler * moment("L", "M", along("M", "N")) / moment("L", "M", along("H", "M"))
    assert motion["bucket_length_effort"] == pytest.approx(bucket, abs=1e-9)
