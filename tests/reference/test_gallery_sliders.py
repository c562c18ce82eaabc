"""Slider-cranks and their inversions in the gallery against closed forms and worked examples."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.gallery import point, result_of, row, study_named, unit

from mechdesign.experiments.sweep import sweep


def test_slider_crank_has_the_published_motion() -> None:
    """r = 1, l = 3 at 15 deg and 1 rad/s: the verification numbers of issue 3; the rest by the closed form."""
    motion = result_of("slider_crank").tables["motion"]
    pose = [motion[name][3] for name in ("crank", "B.x", "B.x_velocity", "B.x_acceleration")]
    assert pose == pytest.approx([15, 3.954740, -0.342464, -1.258022], abs=5e-7)
    t = np.radians(motion["crank"])
    sine, rod = np.sin(t), np.sqrt(9 - np.sin(t) ** 2)
    assert motion["B.x"] == pytest.approx(np.cos(t) + rod, abs=1e-13)
    speed = -sine - sine * np.cos(t) / rod
    assert motion["B.x_velocity"] == pytest.approx(speed, abs=1e-13)
    # Virtual work: the crank's torque balances 100 N on the piston.
    assert motion["crank_effort"] == pytest.approx(100 * speed, abs=1e-11)
    # At the dead centres the acceleration is r (1 + r/l) and r (1 - r/l).
    assert motion["B.x_acceleration"][[0, 36]] == pytest.approx([-(1 + 1 / 3), 1 - 1 / 3], abs=1e-13)


def test_offset_slider_crank_has_the_stroke_and_time_ratio_of_its_dead_centres() -> None:
    """Crank and rod in one line: hypotenuses l + r and l - r over the offset c."""
    extremes = row(result_of("offset_slider_crank").tables["extremes"], "B.x")
    r, length, c = 1.4, 4, 1
    far, near = np.sqrt((length + r) ** 2 - c**2), np.sqrt((length - r) ** 2 - c**2)
    assert (extremes["min"], extremes["max"]) == pytest.approx((near, far), abs=1e-12)
    swing = np.degrees(np.arcsin(c / (length - r)) - np.arcsin(c / (length + r)))
    assert extremes["time_ratio"] == pytest.approx((180 + swing) / (180 - swing), abs=1e-8)


def test_offset_slider_cranks_of_the_matrix_have_the_stroke_of_their_dead_centres() -> None:
    table = sweep(study_named("offset_slider_crank")).main
    c, r = table["mechanism.parameters.c"], table["mechanism.parameters.r"]
    stroke = np.sqrt((4 + r) ** 2 - c**2) - np.sqrt((4 - r) ** 2 - c**2)
    assert len(stroke) == 6
    assert table["kinematics.extremes.B.x.range"] == pytest.approx(stroke, abs=1e-8)


def test_inverted_slider_crank_is_a_right_triangle() -> None:
    """The rocker stands at right angles on the coupler: |AB|^2 = |AD|^2 - c^2, and AB turns the rocker by 90 deg."""
    motion = result_of("inverted_slider_crank").tables["motion"]
    pin = 2 * unit(motion["crank"])
    span = pin - 6
    slide = np.sqrt(np.abs(span) ** 2 - 16)
    rocker = np.angle(span) - np.arccos(4 / np.abs(span))
    assert motion["valid"].all()
    assert motion["block.slide"] == pytest.approx(slide, abs=1e-12)
    assert unit(motion["rocker.angle"]) == pytest.approx(np.exp(1j * rocker), abs=1e-12)
    assert point(motion, "T") == pytest.approx(pin - 9j * np.exp(1j * rocker), abs=1e-11)
    # The slide's rate: |AB| d|AB| = |AD| d|AD|, at 10 rad/s.
    speed = np.real(span.conjugate() * 1j * pin) * 10 / slide
    assert motion["block.slide_velocity"] == pytest.approx(speed, abs=1e-9)


def test_oscillating_cylinder_swings_by_the_tangents_to_the_crank_circle() -> None:
    """Length by the law of cosines; the swing asin(r/d) either way, in times of 180 deg plus and minus twice that."""
    result = result_of("oscillating_cylinder")
    motion = result.tables["motion"]
    t = np.radians(motion["crank"])
    assert motion["cylinder.length"] == pytest.approx(np.sqrt(20**2 + 100**2 + 4000 * np.sin(t)), abs=1e-11)
    length, angle = (row(result.tables["extremes"], f"cylinder.{what}") for what in ("length", "angle"))
    assert (length["min"], length["max"]) == pytest.approx((80, 120), abs=1e-11)
    swing = np.degrees(np.arcsin(0.2))
    assert (angle["min"], angle["max"]) == pytest.approx((90 - swing, 90 + swing), abs=1e-10)
    assert angle["time_ratio"] == pytest.approx((180 + 2 * swing) / (180 - 2 * swing), abs=1e-7)


def test_whitworth_has_the_published_time_ratio() -> None:
    """Crank 150 mm, centres 100 mm: return 96.4 deg, ratio 2.735.

    R. S. Khurmi and J. K. Gupta, Theory of Machines, ch. 5 (Whitworth quick return motion).
    """
    result = result_of("whitworth")
    ram = row(result.tables["extremes"], "R.x")
    assert ram["time_ratio"] == pytest.approx(2.735, abs=5e-4)
    back = 2 * np.degrees(np.arccos(100 / 150))
    assert back == pytest.approx(96.4, abs=0.05)
    assert ram["time_ratio"] == pytest.approx((360 - back) / back, abs=1e-7)
    assert ram["range"] == pytest.approx(2 * 70, abs=1e-10)
    # The arm turns with the crank, seen from inside its circle.
    motion = result.tables["motion"]
    arm = np.angle(-(150 * unit(motion["crank"]) + 100j))
    assert unit(motion["arm.angle"]) == pytest.approx(np.exp(1j * arm), abs=1e-12)
    assert np.ptp(motion["arm.angle"]) == pytest.approx(360, abs=1e-9)


def test_shaper_has_the_published_swing_ratio_and_stroke() -> None:
    """Centres 240 mm, crank 120 mm, slotted bar 450 mm: inclination 30 deg, ratio 2, stroke 450 mm.

    R. S. Khurmi and J. K. Gupta, Theory of Machines, ch. 5 (crank and slotted lever quick return).
    """
    extremes = result_of("shaper").tables["extremes"]
    arm, ram = row(extremes, "arm.angle"), row(extremes, "R.x")
    assert (90 - arm["min"], arm["max"] - 90) == pytest.approx((30, 30), abs=1e-9)
    assert ram["time_ratio"] == pytest.approx(2, abs=1e-6)
    assert ram["range"] == pytest.approx(450, abs=1e-9)


def test_scotch_yoke_is_harmonic() -> None:
    """The pin's projection: x = r cos t, v = -r sin t, a = -r cos t."""
    motion = result_of("scotch_yoke").tables["motion"]
    t = np.radians(motion["crank"])
    assert motion["P.x"] == pytest.approx(120 + 50 * np.cos(t), abs=1e-12)
    assert motion["P.x_velocity"] == pytest.approx(-50 * np.sin(t), abs=1e-12)
    assert motion["P.x_acceleration"] == pytest.approx(-50 * np.cos(t), abs=1e-12)
    assert motion["slot.slide"] == pytest.approx(50 * np.sin(t), abs=1e-12)


def test_rapson_slide_gains_leverage_with_the_helm() -> None:
    """Travel R tan(delta) along the ram, R/cos(delta) along the tiller, torque F R/cos(delta)^2 by virtual work."""
    motion = result_of("rapson_slide").tables["motion"]
    helm = np.radians(motion["tiller_angle"] - 90)
    assert motion["cylinder.slide"] == pytest.approx(-600 * np.tan(helm), abs=1e-11)
    assert motion["block.slide"] == pytest.approx(600 / np.cos(helm), abs=1e-11)
    speed = np.radians(2.5)
    assert motion["cylinder.slide_velocity"] == pytest.approx(-600 * speed / np.cos(helm) ** 2, abs=1e-11)
    assert motion["tiller_angle_effort"] == pytest.approx(100 * 600 / np.cos(helm) ** 2, abs=1e-8)


def test_v_twin_has_a_primary_force_of_constant_size() -> None:
    """Both pistons by the slider-crank's closed form; the first harmonics of their accelerations add up to r w^2.

    For a 90 deg bank the sum of r cos(t -+ 45 deg) along the bores is r (cos t, sin t): it turns with the crank.
    """
    motion = result_of("v_twin").tables["motion"]
    t = np.radians(motion["crank"])
    banks = np.radians([45, 135])
    for name, bank in zip(("bore_1", "bore_2"), banks, strict=True):
        angle = t - bank
        slide = 40 * np.cos(angle) + np.sqrt(140**2 - (40 * np.sin(angle)) ** 2)
        assert motion[f"{name}.slide"] == pytest.approx(slide, abs=1e-11)
    total = sum(
        motion[f"bore_{k}.slide_acceleration"][:-1] * np.exp(1j * bank) for k, bank in enumerate(banks, start=1)
    )
    # The part of the force that turns once a turn, with the crank and against it.
    forward, backward = (np.mean(total * np.exp(sign * 1j * t[:-1])) for sign in (-1, 1))
    assert forward == pytest.approx(-40, abs=1e-9)
    assert abs(backward) == pytest.approx(0, abs=1e-9)


def test_pusher_moves_by_its_laws_and_its_servo_by_the_law_of_cosines() -> None:
    """Peaks of the modified sine, 1.760 h/T and 5.528 h/T^2, and of the 3-4-5 polynomial, 1.875; h = 50 mm."""
    result = result_of("rise_dwell_return")
    motion, extremes = result.tables["motion"], result.tables["extremes"]
    slow = np.pi / (4 + np.pi)
    velocity, acceleration = row(extremes, "C.x_velocity"), row(extremes, "C.x_acceleration")
    assert velocity["max"] == pytest.approx(4 * slow * 50 / 0.25, rel=1e-12)
    assert velocity["min"] == pytest.approx(-15 / 8 * 50 / 0.35, rel=1e-12)
    assert (velocity["max_at"], velocity["min_at"]) == pytest.approx((0.125, 0.25 + 0.1 + 0.175), abs=1e-7)
    assert acceleration["max"] == pytest.approx(4 * np.pi * slow * 50 / 0.25**2, rel=1e-12)
    assert acceleration["min"] == pytest.approx(-acceleration["max"], rel=1e-12)
    # cos(servo) = (x^2 + r^2 - l^2)/(2 x r) and its derivatives by time.
    x, speed, r, rod = motion["C.x"], motion["C.x_velocity"], 40, 110
    cosine = (x**2 + r**2 - rod**2) / (2 * x * r)
    slope = (1 - (r**2 - rod**2) / x**2) / (2 * r)
    sine = np.sqrt(1 - cosine**2)
    turning = -slope * speed / sine
    bend = (r**2 - rod**2) / (x**3 * r) * speed**2 + slope * motion["C.x_acceleration"]
    assert motion["servo"] == pytest.approx(np.degrees(np.arccos(cosine)), abs=1e-11)
    assert motion["servo_velocity"] == pytest.approx(np.degrees(turning), abs=1e-9)
    assert motion["servo_acceleration"] == pytest.approx(np.degrees(-(bend + cosine * turning**2) / sine), abs=1e-7)
    dwell = (motion["time"] >= 0.25) & (motion["time"] < 0.35)
    assert np.all(motion["C.x"][dwell] == 135)
    assert not motion["servo_velocity"][dwell].any()
