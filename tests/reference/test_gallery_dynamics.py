"""Forces of the mechanisms in the gallery against energies and statics by hand."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.gallery import point, row, study_named, unit
from scipy.special import ellipk

import mechdesign
from mechdesign.ground.results import Result


def result_of(name: str) -> Result:
    """Ask a study of the gallery what its dynamics section asks."""
    return mechdesign.dynamics(study_named(name))


def test_mean_torque_of_the_press_is_the_work_of_its_cut() -> None:
    """250 kN over a trapezium of 4 mm with ramps of 1 mm: 750 kN mm a turn; weights and masses take and give back."""
    extremes = result_of("flywheel_press").tables["extremes"]
    effort, power = row(extremes, "crank_effort"), row(extremes, "crank_power")
    assert effort["mean"] == pytest.approx(750 / (2 * np.pi), rel=1e-9)
    assert power["mean"] == pytest.approx(750, rel=1e-9)
    # Where the cut bears in full, 7 mm above the lowest place, virtual work gives most of the peak.
    height = np.arccos((60**2 + (360 - 7) ** 2 - 300**2) / (2 * 60 * (360 - 7)))
    lever = 60 * np.sin(height) * (1 + 60 * np.cos(height) / np.sqrt(300**2 - (60 * np.sin(height)) ** 2))
    assert effort["peak"] == pytest.approx(250 * lever, rel=0.02)
    # The peak is at the corner of the load, where it begins to bear in full.
    assert effort["peak_at"] == pytest.approx(270 - np.degrees(height), rel=1e-11)


def test_spring_of_no_length_balances_the_arm_everywhere() -> None:
    """No effort beside the weight's largest moment; the pivot bears the weight and the pull k times the span."""
    result = result_of("balanced_arm")
    forces = result.tables["dynamics"]
    moment = 3 * 9.81 * 400
    assert np.abs(forces["arm_effort"]).max() < 1e-12 * moment
    # The sum of both energies is the same at every angle: k (h^2 + a^2) / 2.
    stiffness = moment / (200 * 150)
    assert forces["potential_energy"] == pytest.approx(stiffness * (200**2 + 150**2) / 2, rel=1e-12)
    joints = result.tables["joint_forces"]
    pull = stiffness * (200j - 150 * unit(forces["arm"]))
    assert joints["fx"] + 1j * joints["fy"] == pytest.approx(29.43j - pull, abs=1e-11)


def test_counterweight_leaves_the_second_order_of_the_v_twin() -> None:
    """Pistons with the rods' small ends, x'' in closed form; the counterweight takes the first order whole."""
    table = result_of("twin_cylinder").tables["dynamics"]
    r, length, omega, mass = 40.0, 140.0, 100 * np.pi, 0.35 + 0.4 * 40 / 140
    turn = np.radians(table["crank"])
    # N from kg mm/s^2 by 1/1000; along each bore its piston's acceleration.
    force = 1e-3 * mass * r * omega**2 * unit(table["crank"])
    for bore in (np.pi / 4, 3 * np.pi / 4):
        sine, cosine = np.sin(turn - bore), np.cos(turn - bore)
        root = np.sqrt(length**2 - (r * sine) ** 2)
        second = -r * omega**2 * (cosine + r * (cosine**2 - sine**2) / root + r**3 * (sine * cosine) ** 2 / root**3)
        force = force - 1e-3 * mass * second * np.exp(1j * bore)
    force -= 2e-3 * mass * r * omega**2 * unit(table["crank"])
    assert table["shaking.x"] + 1j * table["shaking.y"] == pytest.approx(force, abs=1e-9)
    # No first order, and the second level: sqrt(2) m r^2 w^2 / l, and a little more of the orders above.
    harmonics = np.fft.fft(table["shaking.x"][:-1] + 1j * table["shaking.y"][:-1]) / (len(table) - 1)
    assert np.abs(harmonics[[1, -1]]).max() < 1e-9
    level = 1e-3 * np.sqrt(2) * mass * r**2 * omega**2 / length * (1 + (r / length) ** 2 / 4)
    assert np.abs(table["shaking.x"]).max() == pytest.approx(level, rel=5e-3)


def test_mean_torque_of_the_wiper_is_the_work_of_its_friction() -> None:
    """2 N m over the swing to and back, but for the moments in which friction turns over."""
    extremes = row(result_of("wiper_motor").tables["extremes"], "motor_effort")
    # The rocker's dead centres: crank and rod in line, by the law of cosines.
    span, rocker = abs(180 + 30j), 60
    ends = [np.arccos((span**2 + rocker**2 - reach**2) / (2 * span * rocker)) for reach in (170 + 36, 170 - 36)]
    swing = abs(ends[0] - ends[1])
    assert extremes["mean"] == pytest.approx(2 * 2 * swing / (2 * np.pi), rel=1e-4)


def test_boom_cylinder_of_the_excavator_holds_the_moment_of_all_weights() -> None:
    """Moments about O: weights times their distances over that of the cylinder, places from kinematics."""
    table = result_of("excavator_lift").tables["dynamics"]
    places = mechdesign.kinematics(study_named("excavator_lift")).tables["motion"]
    masses = {"boom": (1450, 0.0, 2.4 + 0.45j), "stick": (720, point(places, "J"), 0.8 + 0.15j),
              "bucket": (2300, point(places, "K"), 0.65 + 0.2j)}  # fmt: skip
    moment = sum(9.81e-3 * mass * (base + arm * unit(places[f"{name}.angle"])).real
                 for name, (mass, base, arm) in masses.items())  # fmt: skip
    foot, head = 0.5 - 0.3j, point(places, "B")
    lever = (foot.conjugate() * (head - foot)).imag / np.abs(head - foot)
    assert table["boom_length_effort"] == pytest.approx(moment / lever, rel=1e-11)


@pytest.mark.nightly
def test_a_braked_pendulum_sticks_inside_of_its_circle_of_friction() -> None:
    result = result_of("braked_pendulum")
    table, events = result.main, result.tables["events"]
    assert events["event"].tolist() == ["standstill"]
    still = table["time"] > events["time"][0]
    assert still.any()
    assert not table["swing_velocity"][still].any()
    assert abs(250 * np.cos(np.radians(table["swing"][-1]))) < 24
    energy = table["kinetic_energy"] + table["potential_energy"]
    assert energy - energy[0] == pytest.approx(table["friction_work"], abs=1e-9 * table["kinetic_energy"].max())


@pytest.mark.nightly
def test_pendulum_passes_its_lowest_place_every_half_of_its_period() -> None:
    """4 sqrt(J / (m g r)) K(sin^2(a / 2)), K the complete elliptic integral of the first kind, a = 170 deg."""
    result = result_of("pendulum")
    period = 4 * np.sqrt(500**2 / 3 / (9810 * 250)) * ellipk(np.sin(np.radians(85)) ** 2)
    times = result.tables["events"]["time"]
    assert times == pytest.approx(period / 4 + period / 2 * np.arange(len(times)), rel=1e-9)
    assert len(times) == 6
    energy = result.main["kinetic_energy"] + result.main["potential_energy"]
    assert np.ptp(energy) < 1e-9 * result.main["kinetic_energy"].max()


def test_push_of_the_wedge_press_is_that_of_a_slope_steeper_by_two_angles_of_friction() -> None:
    result = result_of("wedge_press")
    angle = np.arctan(0.1)
    assert result.main["push_effort"] == pytest.approx(1000 * np.tan(np.radians(8) + 2 * angle), rel=1e-12)
    smooth = 1000 * np.tan(np.radians(8))
    assert result.main["efficiency"] == pytest.approx(smooth / result.main["push_effort"], rel=1e-12)
    assert not result.main["back_efficiency"].any()
    assert "self_locking" in [warning.kind for warning in result.warnings]
