"""Mechanisms of the gallery against geometry and statics by hand, where it takes more than a formula of a case."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.gallery import meet, point, result_of, row, study_named, unit

from mechdesign.mechanism.wheels import meshes
from mechdesign.questions.dynamics.analysis import dynamics


def test_jansen_foot_walks() -> None:
    """What the numbers are for: over a third of the turn, while it carries, the foot goes level and one way."""
    motion = result_of("jansen", "kinematics.sweep.crank={from: 0, to: 359.5, step: 0.5}").tables["motion"]
    foot, stride = point(motion, "F"), np.ptp(motion["F.x"])
    low = foot.imag < foot.imag.min() + 0.01 * stride
    assert np.count_nonzero(low != np.roll(low, 1)) == 2  # down once a turn
    assert low.mean() > 1 / 3
    assert np.ptp(foot.real[low]) > 0.75 * stride
    assert (motion["F.x_velocity"][low] < 0).all()


def test_watt_guides_the_piston_rod_as_a_larger_copy_of_his_three_bar() -> None:
    """The pantograph O A B D C copies P to D in the ratio b/a; the three-bar's path is drawn with circles.

    Watt's rule for the radius rod, a^2/(b - a), gives the path a tangent of the fourth order: half the beam's angle, a
    sixteenth of the deviation. Without it only an inflection is left, and an eighth.
    """
    motion = result_of("watt_parallel_motion").tables["motion"]
    beam = motion["beam"]
    joint = 1200 * unit(beam)
    foot = meet(joint, 800, 2000 - 800j, 800, -1)
    path = joint + 0.4 * (foot - joint)
    assert point(motion, "P") == pytest.approx(path, abs=1e-10)
    assert point(motion, "D") == pytest.approx(2.5 * path, abs=1e-10)
    sweeps = [f"kinematics.sweep.beam={{from: {-angle}, to: {angle}, number: 41}}" for angle in (0.5, 0.25)]
    deviations = [row(result_of("watt_parallel_motion", sweep).tables["extremes"], "D.x")["range"] for sweep in sweeps]
    assert np.log2(deviations[0] / deviations[1]) == pytest.approx(4, abs=0.1)


def test_pitch_circles_of_a_planetary_train_are_those_of_its_teeth() -> None:
    mechanism = study_named("planetary").mechanism
    found = meshes(mechanism.description, mechanism.graph, mechanism.couplings, mechanism.sketch_configuration)
    assert [mesh.links for mesh in found] == [("planet", "sun"), ("planet", "ground")]
    radii = [[float(r) for r in mesh.radii(mechanism.sketch_configuration)] for mesh in found]
    assert radii == [pytest.approx([15, 15]), pytest.approx([15, 45])]


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


@pytest.mark.nightly
def test_a_braked_pendulum_sticks_inside_of_its_circle_of_friction() -> None:
    result = dynamics(study_named("braked_pendulum"))
    table, events = result.main, result.tables["events"]
    assert events["event"].tolist() == ["standstill"]
    still = table["time"] > events["time"][0]
    assert still.any()
    assert not table["swing_velocity"][still].any()
    assert abs(250 * np.cos(np.radians(table["swing"][-1]))) < 24
    energy = table["kinetic_energy"] + table["potential_energy"]
    assert energy - energy[0] == pytest.approx(table["friction_work"], abs=1e-9 * table["kinetic_energy"].max())
