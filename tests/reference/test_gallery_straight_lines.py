"""Straight-line linkages and a coupling of the gallery against exact geometry."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.gallery import meet, point, result_of, row, unit


def test_peaucellier_draws_an_exact_straight_line() -> None:
    """OB * OP = l1^2 - l2^2 in one direction, B on a circle of radius r through O: P on x = (l1^2 - l2^2)/(2 r).

    A. Peaucellier, Note sur une question de geometrie de compas, Nouvelles annales de mathematiques 12 (1873).
    """
    motion = result_of("peaucellier").tables["motion"]
    power = 100**2 - 40**2
    assert motion["P.x"] == pytest.approx(np.full(len(motion), power / 80), abs=1e-11)
    # Half the crank's angle at the circle's rim (the inscribed angle) is the angle at O.
    assert motion["P.y"] == pytest.approx(power / 80 * np.tan(np.radians(motion["crank"]) / 2), abs=1e-11)
    assert point(motion, "P") * point(motion, "B").conjugate() == pytest.approx(np.full(len(motion), power), abs=1e-9)
    # d/dt of c tan(t/2) at 1 rad/s
    half = np.cos(np.radians(motion["crank"]) / 2)
    assert motion["P.y_velocity"] == pytest.approx(power / 80 / (2 * half**2), abs=1e-9)


def test_hart_draws_an_exact_straight_line() -> None:
    """OP * OQ = t (1 - t) (long^2 - short^2) in a crossed parallelogram, P on a circle through O.

    H. Hart, On certain conversions of motion, Messenger of Mathematics 4 (1874).
    """
    motion = result_of("hart").tables["motion"]
    power = (200**2 - 100**2) / 4
    assert motion["Q.x"] == pytest.approx(np.full(len(motion), power / 90), abs=1e-11)
    assert motion["Q.y"] == pytest.approx(power / 90 * np.tan(np.radians(motion["crank"]) / 2), abs=1e-11)
    assert point(motion, "P") * point(motion, "Q").conjugate() == pytest.approx(np.full(len(motion), power), abs=1e-9)


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


def test_oldham_turns_evenly_and_its_disc_twice_as_fast() -> None:
    """The disc's centre sees both shafts under a right angle, so it runs on the circle over their distance (Thales).

    The central angle is twice the inscribed one: twice a turn, at the speed that makes the disc shake.
    """
    motion = result_of("oldham").tables["motion"]
    turn, speed = motion["shaft_1"], 3000 / 60 * 2 * np.pi
    assert motion["shaft_2.angle"] == pytest.approx(turn, abs=1e-9)
    assert np.radians(motion["shaft_2.angle_velocity"]) == pytest.approx(np.full(len(motion), speed), rel=1e-12)
    assert point(motion, "M") == pytest.approx(4 + 4 * unit(2 * turn), abs=1e-12)
    acceleration = motion["M.x_acceleration"] + 1j * motion["M.y_acceleration"]
    assert acceleration == pytest.approx(-4 * (2 * speed) ** 2 * unit(2 * turn), rel=1e-9)


def test_trammel_draws_the_ellipse_of_archimedes() -> None:
    """P of the bar of angle t is (arm cos t, (gap + arm) sin t); the middle M runs on a circle the other way round."""
    motion = result_of("trammel").tables["motion"]
    t = np.radians(motion["bar"])
    assert point(motion, "P") == pytest.approx(50 * np.cos(t) + 110j * np.sin(t), abs=1e-12)
    assert point(motion, "M") == pytest.approx(-30 * np.exp(-1j * t), abs=1e-12)
    assert motion["across.slide"] == pytest.approx(-60 * np.cos(t), abs=1e-12)
    assert motion["up.slide"] == pytest.approx(60 * np.sin(t), abs=1e-12)
    speed = 2 * np.pi
    assert motion["P.y_acceleration"] == pytest.approx(-110 * speed**2 * np.sin(t), abs=1e-8)


def test_pantograph_copies_to_scale() -> None:
    """O A P and O B Q are similar triangles with equal angles: Q = k P."""
    motion = result_of("pantograph").tables["motion"]
    assert motion["valid"].all()
    assert point(motion, "Q") == pytest.approx(2.5 * point(motion, "P"), abs=1e-10)
    # The inverse problem itself: two links of 250 mm that reach Q.
    elbow = meet(0, 250, point(motion, "Q"), 250, 1)
    assert 250 * unit(motion["arm_1"]) == pytest.approx(elbow, abs=1e-9)
