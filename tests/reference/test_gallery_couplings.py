"""Gears, belts, racks and cams of the gallery against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.gallery import meet, point, result_of, study_named, unit

import mechdesign
from mechdesign.mechanism.wheels import meshes
from mechdesign.questions.dynamics.analysis import dynamics
from mechdesign.questions.stiffness.analysis import stiffness
from mechdesign.questions.workspace.analysis import workspace


def test_geared_five_bar_draws_the_coupler_curve_of_its_four_bar() -> None:
    """The same point by belts and by the four-bar, and both as the four-bar drawn with circles."""
    motion = result_of("geared_five_bar").tables["motion"]
    assert motion["valid"].all()
    assert point(motion, "P") == pytest.approx(point(motion, "Q"), abs=1e-11)
    for order in ("velocity", "acceleration"):
        for axis in "xy":
            assert motion[f"P.{axis}_{order}"] == pytest.approx(motion[f"Q.{axis}_{order}"], abs=1e-9)
    turned = unit(motion["one"] - np.degrees(np.arctan2(50, 35)))
    # Inverted: with the coupler's direction given, A is where |OA| = 100 meets |BC| = 80 moved back by the coupler.
    a = meet(0, 100, 40 - 90 * turned, 80, -1)
    assert point(motion, "P") == pytest.approx(a + turned * (35 + 50j), abs=1e-11)


def test_planetary_train_turns_as_willis_has_it() -> None:
    motion = result_of("planetary").tables["motion"]
    assert motion["arm.angle"] == pytest.approx(motion["sun"] / 4, abs=1e-10)
    assert motion["planet.angle"] == pytest.approx(motion["arm.angle"] * (1 - 90 / 30), abs=1e-10)
    assert motion["arm.angle_velocity"] == pytest.approx(np.full(73, 360 / 4), abs=1e-9)


def test_planetary_train_divides_its_moment_and_bears_it_at_its_teeth() -> None:
    """The sun's moment is a quarter of the arm's; the planet's pin bears twice the force of each mesh.

    With the moment M on the arm of radius a the pin bears M/a across the arm, half of it from each mesh, and the
    pressures of both meshes on the planet cancel. The sun bears its moment over its radius, and the pressure.
    """
    result = dynamics(study_named("planetary"))
    assert result.main["sun_effort"] == pytest.approx(np.full(73, 100), abs=1e-9)
    forces = result.tables["joint_forces"]
    at_planet = forces["joint"] == "A"
    assert np.hypot(forces["fx"], forces["fy"])[at_planet] == pytest.approx(np.full(73, 400 / 30), abs=1e-9)
    on_sun = np.isin(forces["on"], ["sun"]) & (forces["joint"] == "O")
    tooth = 100 / 15
    assert np.hypot(forces["fx"], forces["fy"])[on_sun] == pytest.approx(
        np.full(73, tooth / np.cos(np.radians(20))), abs=1e-9
    )


def test_pitch_circles_of_a_planetary_train_are_those_of_its_teeth() -> None:
    mechanism = study_named("planetary").mechanism
    found = meshes(mechanism.description, mechanism.graph, mechanism.couplings, mechanism.sketch_configuration)
    assert [mesh.links for mesh in found] == [("planet", "sun"), ("planet", "ground")]
    radii = [[float(r) for r in mesh.radii(mechanism.sketch_configuration)] for mesh in found]
    assert radii == [pytest.approx([15, 15]), pytest.approx([15, 45])]


def test_one_tooth_of_difference_reduces_by_the_teeth() -> None:
    result = dynamics(study_named("one_tooth_difference"))
    motion = result_of("one_tooth_difference").tables["motion"]
    assert motion["output.angle"] == pytest.approx(-motion["eccentric"] / 49, abs=1e-9)
    assert motion["output.angle_velocity"] == pytest.approx(np.full(61, -1500 * 6 / 49), abs=1e-8)
    # Work on the output, 4900 N*mm, against that of the eccentric, which turns 49 times as far the other way.
    assert result.main["eccentric_effort"] == pytest.approx(np.full(61, 100), abs=1e-9)


def test_cycloidal_crank_stands_still_exactly() -> None:
    """S goes r (turn - sin turn), with the turn of the wheel from where its pin touches the rack."""
    motion = result_of("cycloidal_crank").tables["motion"]
    turn = np.radians(-90 - motion["theta"])
    assert motion["S.x"] == pytest.approx(20 * (turn - np.sin(turn)), abs=1e-11)
    assert motion["S.x_velocity"] == pytest.approx(20 * (1 - np.cos(turn)), abs=1e-11)
    assert motion["S.x_acceleration"] == pytest.approx(20 * np.sin(turn), abs=1e-11)
    assert motion["P.y"] == pytest.approx(-20 * np.cos(turn), abs=1e-11)
    # Within 1 % of a turn's way on both sides of its dwell.
    within = np.linspace(0, np.pi, 200001)
    near = within[20 * (within - np.sin(within)) < 0.005 * 40 * np.pi]
    assert 2 * np.degrees(near.max()) == pytest.approx(66.07, abs=0.01)


def test_rack_driven_table_goes_twice_the_way() -> None:
    motion = result_of("rack_slider").tables["motion"]
    t = np.radians(motion["crank"])
    crosshead = 40 * np.cos(t) + np.sqrt(130**2 - (40 * np.sin(t)) ** 2)
    assert motion["B.x"] == pytest.approx(crosshead, abs=1e-11)
    assert motion["T.x"] == pytest.approx(2 * (crosshead - 130), abs=1e-11)
    slope = -40 * np.sin(t) - 40**2 * np.sin(t) * np.cos(t) / np.sqrt(130**2 - (40 * np.sin(t)) ** 2)
    assert motion["T.x_velocity"] == pytest.approx(2 * slope, abs=1e-11)
    assert motion["crank_effort"] == pytest.approx(200 * slope, abs=1e-9)


def test_parallel_gripper_opens_by_twice_the_sine() -> None:
    motion = result_of("parallel_gripper").tables["motion"]
    t = np.radians(motion["theta"])
    assert motion["opening"] == pytest.approx(2 * (20 - 15 + 60 * np.sin(t)), abs=1e-11)
    assert motion["upper_jaw.angle"] == pytest.approx(np.zeros(len(t)), abs=1e-11)
    assert motion["theta_effort"] == pytest.approx(-2 * 50 * 60 * np.cos(t), abs=1e-9)


def test_differential_adds_its_inputs() -> None:
    motion = result_of("differential").tables["motion"]
    assert motion["arm.angle"] == pytest.approx((24 * motion["sun"] + 60 * motion["ring"]) / 84, abs=1e-9)
    assert motion["arm.angle_velocity"] == pytest.approx(np.full(125, (24 * 360 - 60 * 120) / 84), abs=1e-9)
    assert motion["sun_effort"] == pytest.approx(np.full(125, 300 * 24 / 84), abs=1e-9)
    assert motion["ring_effort"] == pytest.approx(np.full(125, 300 * 60 / 84), abs=1e-9)


def test_cam_with_dwells_follows_its_law() -> None:
    motion = result_of("cam_dwell").tables["motion"]
    cam, h, b = motion["cam"], 20, np.radians(120)
    rise, back = (np.clip((cam - begin) / 120, 0, 1) for begin in (0, 180))

    def law(u):
        return u - np.sin(2 * np.pi * u) / (2 * np.pi)

    assert motion["F.y"] == pytest.approx(40 + h * (law(rise) - law(back)), abs=1e-11)
    speed = h / b * (np.cos(2 * np.pi * back) - np.cos(2 * np.pi * rise))
    assert motion["F.y_velocity"] == pytest.approx(speed, abs=1e-10)
    bend = 2 * np.pi * h / b**2 * (np.sin(2 * np.pi * rise) - np.sin(2 * np.pi * back))
    assert motion["F.y_acceleration"] == pytest.approx(bend, abs=1e-10)
    still = (cam > 120) & (cam < 180)
    assert not motion["F.y_velocity"][still].any()
    assert np.abs(motion["F.y_velocity"]).max() == pytest.approx(2 * h / b, rel=1e-3)


def test_cam_with_dwells_has_the_pressure_angle_of_its_law() -> None:
    table = result_of("cam_dwell").tables["cam"]
    cam, lift, h, b = table["cam"], table["valve.slide"], 20, np.radians(120)
    rise, back = (np.clip((cam - begin) / 120, 0, 1) for begin in (0, 180))
    slope = h / b * (np.cos(2 * np.pi * back) - np.cos(2 * np.pi * rise))
    assert np.tan(np.radians(table["pressure_angle"])) == pytest.approx(slope / lift, abs=1e-12)
    profile = table["x"] + 1j * table["y"]
    assert np.abs(profile)[[0, 150, 330]] == pytest.approx([32, 52, 32], rel=1e-12)


def test_arm_with_a_flat_face_is_pushed_square_to_it() -> None:
    cam, result = result_of("cam_arm").tables["cam"], dynamics(study_named("cam_arm"))
    joints = result.tables["joint_forces"]
    force, contact = joints["normal"][joints["joint"] == "lift"], cam["face"][::5]
    assert force * contact == pytest.approx(50 * 140 * np.cos(np.radians(cam["arm.angle"][::5])), rel=1e-12)
    assert not np.abs(cam["pressure_angle"]).max() > 1e-12
    # The profile is the envelope of the face, whose distance from the cam's axis is h = 80 sin(a) + 30 cos(a).
    turn, a = np.radians(cam["cam"]), np.radians(cam["arm.angle"])
    h = 80 * np.sin(a) + 30 * np.cos(a)
    assert ((cam["x"] + 1j * cam["y"]) * np.exp(1j * (turn - a))).imag == pytest.approx(h, rel=1e-12)


def test_scara_with_an_elbow_belt_reaches_a_ring_and_keeps_its_tool() -> None:
    table = result_of("belt_scara").tables
    motion = table["motion" if "motion" in table else "poses"]
    assert motion["tool.angle"] == pytest.approx([90, 90, 90], abs=1e-10)
    assert point(motion, "T") == pytest.approx(point(motion, "P") + 30j, abs=1e-10)
    elbow = 200 * unit(motion["arm"])
    assert elbow + 150 * unit(motion["motor"]) == pytest.approx(point(motion, "P"), abs=1e-10)
    spans = np.stack([elbow, 150 * unit(motion["motor"])]) * 1j
    jacobians = np.stack([spans.real, spans.imag])
    soft = np.array([1 / 2e6, 1 / 2e6 + 1 / (1000 * 20**2)])
    compliance = stiffness(study_named("belt_scara")).tables["compliance"]
    for (i, j), name in {(0, 0): "C11", (0, 1): "C12", (1, 1): "C22"}.items():
        expected = np.einsum("kn,k,kn->n", jacobians[i], soft, jacobians[j])
        assert compliance[name] == pytest.approx(expected, rel=1e-9)
    region = workspace(study_named("belt_scara"))
    area = float(region.main["area"][0])
    assert area == pytest.approx(4 * np.pi * 200 * 150, rel=1e-9)


def test_backlash_of_a_belt_moves_the_scara_across_its_forearm() -> None:
    """The variances of x and y by it add up to (l2 b)^2/12 at every pose."""
    study = study_named("belt_scara", "reliability.methods=analytic", "reliability.sobol=0")
    linear = mechdesign.reliability(study).tables["contributions"]
    own = linear["source"] == "elbow"
    sigma = linear["derivative"][own] * 0.06 / np.sqrt(12)
    assert np.hypot(sigma[::2], sigma[1::2]) == pytest.approx(np.full(3, 150 * np.radians(0.06) / np.sqrt(12)))
