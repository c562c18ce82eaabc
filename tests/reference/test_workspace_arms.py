"""Workspaces of open chains, whose area element is known in closed form: l1 l2 |sin q2| dq1 dq2."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of
from scipy.integrate import quad

import mechdesign

ARM = """
units: {{length: m}}
mechanism:
  parameters: {{l1: {l1!r}, l2: {l2!r}}}
  links:
    ground: {{O: [0, 0]}}
    upper: [O, E, l1]
    lower: [E, P, l2]
  drives: {{q1: {{angle: upper}}, q2: {{angle: lower, from: upper}}}}
  sketch: {{E: [0.3, 0.3], P: [0.1, 0.7]}}
workspace: {{point: P, scan: {{about: [0, 0]}}}}
"""
LENGTHS = [(0.5, 0.3), (0.3, 0.5), (np.sqrt(2) * 0.4, 0.4)]


def arm(l1: float, l2: float, *changes: str):
    return study_of(ARM.format(l1=float(l1), l2=float(l2)), *changes)


def inverse_condition(l1: float, l2: float, q2):
    """From the trace and the determinant of J^T J of the Jacobian in the frame of the first link."""
    trace, determinant = 2 * l1 * l2 * np.cos(q2) + l1**2 + 2 * l2**2, l1 * l2 * np.abs(np.sin(q2))
    half = trace / (2 * determinant)
    return half - np.sqrt(half**2 - 1)


def mean(function, l1: float, l2: float) -> float:
    """Mean over the annulus of what depends on q2 alone."""
    return quad(lambda q2: function(q2) * np.sin(q2), 0, np.pi, epsabs=1e-12)[0] / 2


@pytest.mark.nightly
@pytest.mark.parametrize(("l1", "l2"), LENGTHS)
def test_the_region_of_two_links_is_an_annulus(l1: float, l2: float) -> None:
    """Between the circles of |l1 - l2| and l1 + l2: J. J. Craig, Introduction to Robotics, the two-link planar arm."""
    found = mechdesign.workspace(arm(l1, l2)).main
    assert found["area"][0] == pytest.approx(np.pi * ((l1 + l2) ** 2 - (l1 - l2) ** 2), rel=1e-8)
    assert found["box_area"][0] == pytest.approx(4 * (l1 + l2) ** 2, rel=1e-8)
    assert found["GII"][0] == pytest.approx(mean(lambda q2: inverse_condition(l1, l2, q2), l1, l2), rel=1e-5)
    # 1/|det J| times the area element is a constant.
    assert found["GRI"][0] == pytest.approx(np.pi / (2 * l1 * l2), rel=1e-5)


def test_two_links_of_root_two_to_one_are_isotropic_at_135_degrees() -> None:
    """J. K. Salisbury and J. J. Craig, Articulated hands: force control and kinematic issues, IJRR 1 (1982).

    There the inverse condition is 1; it is nowhere else, so the elbow of the best node of the map shows it.
    """
    l2 = 0.4
    study = arm(np.sqrt(2) * l2, l2, "workspace.scan.rays=9")
    poses = study.mechanism.solve({"q1": np.array([10.0, 77.0]), "q2": 135.0})
    # From the elbow of 135 deg the tip lies at l2 from the base, at right angles to the lower link.
    assert np.hypot(poses["P.x"], poses["P.y"]) == pytest.approx([l2, l2], abs=1e-12)
    local = mechdesign.workspace(study).tables["local"]
    radius = np.hypot(local["x"], local["y"])
    cosine = (radius**2 - 3 * l2**2) / (2 * np.sqrt(2) * l2**2)
    assert local["inverse_condition"] == pytest.approx(
        inverse_condition(np.sqrt(2) * l2, l2, np.arccos(np.clip(cosine, -1, 1))), abs=1e-6
    )
    best = np.argmax(local["inverse_condition"])
    assert radius[best] == pytest.approx(l2, abs=0.04)
    assert inverse_condition(np.sqrt(2), 1, np.radians(135)) == pytest.approx(1, abs=1e-7)


@pytest.mark.nightly
@pytest.mark.parametrize(("l1", "l2"), LENGTHS)
def test_yoshikawas_manipulability_of_two_links(l1: float, l2: float) -> None:
    """w = sqrt(det(J J^T)) = l1 l2 |sin q2|, greatest with the elbow at a right angle whatever the lengths.

    T. Yoshikawa, Manipulability of robotic mechanisms, Int. J. Robotics Research 4 (1985), two-joint link mechanism.
    """
    local = mechdesign.workspace(arm(l1, l2, "workspace.scan.rays=9")).tables["local"]
    radius = np.hypot(local["x"], local["y"])
    cosine = (radius**2 - l1**2 - l2**2) / (2 * l1 * l2)
    sine = np.sqrt(np.clip(1 - cosine**2, 0, None))
    assert np.abs(local["det_J"]) == pytest.approx(l1 * l2 * sine, abs=1e-7)
    assert local["resistivity"] == pytest.approx(1 / np.abs(local["det_J"]), rel=1e-12)
    best = np.argmax(np.abs(local["det_J"]))
    assert radius[best] == pytest.approx(np.hypot(l1, l2), abs=0.04)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ((-180, 180), (20, 150)),
        ((-150, 150), (10, 140)),
        ((-60, 95), (40, 170)),
        pytest.param((-125, 125), (1, 145), marks=pytest.mark.nightly),
    ],
)
def test_joint_limits_cut_the_annulus(first: tuple[float, float], second: tuple[float, float]) -> None:
    """A SCARA arm between stops: area = (q1 range) l1 l2 (cos q2_min - cos q2_max), from the area element.

    The region is bent round its base, and with a full turn of the shoulder it has a hole.
    """
    l1, l2 = 0.35, 0.25
    limits = (
        f"mechanism.limits=[{{drive: q1, min: {first[0]}, max: {first[1]}}},"
        f" {{drive: q2, min: {second[0]}, max: {second[1]}}}]"
    )
    found = mechdesign.workspace(arm(l1, l2, limits)).main
    low, high = np.radians(second)
    exact = np.radians(first[1] - first[0]) * l1 * l2 * (np.cos(low) - np.cos(high))
    assert found["area"][0] == pytest.approx(exact, rel=1e-6)
    area = np.radians(first[1] - first[0]) * (high - low)
    assert found["GRI"][0] == pytest.approx(area / exact, rel=1e-4)


@pytest.mark.nightly
def test_a_hand_held_at_an_angle_moves_the_annulus() -> None:
    """Three links, the hand's angle held: the wrist's annulus about the end of the hand turned round."""
    text = """
units: {length: m}
mechanism:
  links:
    ground: {O: [0, 0]}
    upper: [O, A, 0.4]
    lower: [A, B, 0.3]
    hand: [B, T, 0.1]
  drives: {q1: {angle: upper}, q2: {angle: lower, from: upper}, q3: {angle: hand, from: lower}}
  sketch: {A: [0.2, 0.35], B: [0.48, 0.28], T: [0.48, 0.18]}
workspace:
  point: T
  at: {hand.angle: [-90, 0, 60]}
  characteristic_length: 0.1
"""
    result = mechdesign.workspace(study_of(text))
    assert result.main["area"] == pytest.approx(np.full(3, np.pi * (0.7**2 - 0.1**2)), rel=1e-7)
    boundary = result.tables["boundary"]
    tip = boundary["x"] + 1j * boundary["y"]
    wrist = np.abs(tip - 0.1 * np.exp(1j * np.radians(boundary["hand.angle"])))
    assert np.minimum(np.abs(wrist - 0.7), np.abs(wrist - 0.1)).max() < 1e-8
