"""What acts between two rows of a motion: corners, jumps, narrow pulses and infinite places, against closed forms."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import mechdesign

FOUR_BAR = """
mechanism:
  links:
    ground: {O: [0, 0], D: [100, 0]}
    crank: [O, A, 30]
    rod: {from: A, to: B, length: 90}
    rocker: [D, B, 60]
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
"""
ARM = """
mechanism:
  links:
    ground: {O: [0, 0]}
    arm: [O, A, 100]
  drives: {theta: {angle: arm}}
  sketch: {A: [100, 0]}
"""
FOLLOWER = """
mechanism:
  links:
    ground: {O: [0, 0], G: [100, 0]}
    cam: [O, A, 30]
    follower: {points: {F: [0, 0]}}
  joints:
    guide: {prismatic: [ground, follower], through: G, direction: 90}
  drives: {w: {angle: cam}}
  sketch: {A: [0, 30], F: [100, 40]}
"""


def extremes(answer, output):
    """Smallest and largest value of an output, and where they are."""
    table = answer.tables["extremes"]
    row = table["output"].tolist().index(output)
    return [float(table[name][row]) for name in ("min", "min_at", "max", "max_at")]


def verdicts(text):
    """Whether each requirement of a study on its kinematics or dynamics is met, and the worst value."""
    study = mechdesign.load(text=text)
    answer = mechdesign.dynamics(study) if "\ndynamics:" in text else mechdesign.kinematics(study)
    return [(verdict.met, verdict.worst) for verdict in answer.verdicts]


@pytest.mark.slow
@pytest.mark.parametrize("width", [4, 0.4, 0.02])
def test_a_load_that_acts_between_two_rows_is_seen(width):
    """The arm's effort is the load times its lever, however narrow the pulse and coarse the rows."""
    study = mechdesign.load(
        text=ARM + "kinematics:\n  sweep: {theta: {from: 0, to: 360, step: 5}}\n"
        f'  loads: [{{at: A, force: [0, "-20*max(0, 1 - abs(theta - 123.4)/{width / 2})"]}}]\n'
        "  outputs: [A]\n"
    )
    low, _, _, _ = extremes(mechdesign.kinematics(study), "theta_effort")
    # The product of the pulse and the cosine is largest beside the top of the pulse by less than its width.
    theta = np.radians(np.linspace(123.4 - width / 2, 123.4 + width / 2, 200_001))
    efforts = 20 * (1 - np.abs(np.degrees(theta) - 123.4) / (width / 2)) * 100 * np.cos(theta)
    assert low == pytest.approx(efforts.min(), rel=1e-9)


def test_a_bell_of_a_tenth_of_a_degree_is_seen_between_rows_of_five():
    text = (
        ARM.rstrip()
        + """
  measures: {bell: "exp(-((theta - 123.4)/0.1)**2)", witch: "1/(1 + ((theta - 77.7)/0.1)**2)"}
kinematics: {outputs: [bell, witch], sweep: {theta: {from: 0, to: 360, step: 5}}}
requirements: [{result: kinematics.bell, at_most: 0.99}, {result: kinematics.bell.mean, at_most: 1}]
"""
    )
    gate, mean = verdicts(text)
    assert gate == (False, pytest.approx(1, rel=1e-12))
    assert mean == (True, pytest.approx(0.1 * math.sqrt(math.pi) / 360, rel=1e-9))
    _, _, high, place = extremes(mechdesign.kinematics(mechdesign.load(text=text)), "witch")
    assert (high, place) == pytest.approx((1, 77.7), rel=1e-12)


@pytest.mark.parametrize("width", [1, 0.2, 0.004])
def test_extremes_and_means_of_a_narrow_measure_are_those_of_its_triangle(width):
    text = (
        ARM.rstrip()
        + f"""
  measures: {{pulse: "100*max(0, 1 - abs(theta - 123.4)/{width})"}}
kinematics: {{outputs: [pulse], sweep: {{theta: {{from: 0, to: 360, step: 5}}}}}}
requirements:
  - {{result: kinematics.pulse, at_most: 99.99}}
  - {{result: kinematics.pulse.mean, at_most: 1e9}}
  - {{result: kinematics.pulse.rms, at_most: 1e9}}
  - {{result: kinematics.pulse.peak, at_most: 99.99}}
"""
    )
    gate, mean, rms, peak = verdicts(text)
    assert gate == (False, pytest.approx(100, rel=1e-9))
    assert peak == gate
    assert mean[1] == pytest.approx(100 * width / 360, rel=1e-9)
    assert rms[1] == pytest.approx(100 * math.sqrt(2 / 3 * width / 360), rel=1e-9)
    _, _, top, place = extremes(mechdesign.kinematics(mechdesign.load(text=text)), "pulse")
    assert (top, place) == (pytest.approx(100, rel=1e-9), pytest.approx(123.4, abs=1e-9))


@pytest.mark.parametrize("step", [5, 7, 45])
def test_a_velocity_that_jumps_does_not_overshoot(step):
    """d/dt (40 + 10 |sin w|) has the values 10 and -10 on the two sides of each half turn."""
    text = (
        FOLLOWER.rstrip()
        + f"""
  couplings: {{lift: {{set: guide.slide, to: "40 + 10*abs(sin(w))"}}}}
kinematics: {{outputs: [F.y], rates: {{w: 1 rad/s}}, sweep: {{w: {{from: 0, to: 360, step: {step}}}}}}}
requirements: [{{result: kinematics.F.y_velocity, at_most: 10.1, at_least: -10.1}}]
"""
    )
    assert verdicts(text)[0][0]
    low, _, high, _ = extremes(mechdesign.kinematics(mechdesign.load(text=text)), "F.y_velocity")
    assert (low, high) == (pytest.approx(-10, rel=1e-12), pytest.approx(10, rel=1e-12))


def test_a_bump_of_a_follower_between_coarse_rows_is_seen_and_its_limits_too():
    text = (
        FOLLOWER.rstrip()
        + """
  couplings: {lift: {set: guide.slide, to: "40 + max(0, 1 - abs(w - 47)/0.5)"}}
kinematics: {outputs: [F.y], rates: {w: 1 rad/s}, sweep: {w: {from: 0, to: 360, step: 30}}}
requirements: [{result: kinematics.F.y, at_most: 40.5}]
"""
    )
    assert verdicts(text) == [(False, pytest.approx(41, rel=1e-12))]
    answer = mechdesign.kinematics(mechdesign.load(text=text))
    steep = math.degrees(1) / 0.5
    assert extremes(answer, "F.y_velocity") == pytest.approx([-steep, 47, steep, 46.5], rel=1e-9)
    bounded = text.replace(
        "kinematics: {", "  measures: {height: F.y}\n  limits: [{measure: height, max: 40.5}]\nkinematics: {", 1
    )
    limits = mechdesign.kinematics(mechdesign.load(text=bounded)).tables["limits"]
    assert limits["w"] == pytest.approx([46.75, 47.25], abs=1e-9)


@pytest.mark.slow
def test_a_pulse_in_time_between_two_instants_is_seen():
    """A force of 8 ms on a motion of 1 s, of which the rows hold 1.2 %."""
    text = (
        ARM
        + """
dynamics:
  motion: {theta: [{from: 0, to: 90, time: 1 s, law: constant}]}
  loads: [{at: A, force: [0, "-50*max(0, 1 - abs(time - 0.5012)/0.004)"]}]
requirements:
  - {result: dynamics.theta_effort, at_most: 10}
  - {result: dynamics.theta_effort.peak, at_most: 10}
  - {result: dynamics.theta_effort.mean, at_most: 1e9}
"""
    )
    time = np.linspace(0.4972, 0.5052, 400_001)
    efforts = 50 * (1 - np.abs(time - 0.5012) / 0.004) * 100 * np.cos(np.pi / 2 * time)
    gate, peak, mean = verdicts(text)
    assert gate == peak == (False, pytest.approx(efforts.max(), rel=1e-9))
    assert mean[1] == pytest.approx(np.trapezoid(efforts, time), rel=1e-8)


def test_a_load_of_a_velocity_bends_where_the_velocity_changes_its_sign():
    """A brake -c |v| v/|v| is largest at the crank's fastest rod; a force max(0, v - limit) acts over a few degrees."""
    text = (
        FOUR_BAR
        + """
kinematics:
  outputs: [B.x]
  rates: {theta: 1 rad/s}
  sweep: {theta: {from: 0, to: 360, step: STEP}}
  loads: [{at: B, force: ["-max(0, B.x_velocity - 27)", 0]}]
requirements: [{result: kinematics.theta_effort, at_most: 1e9}]
"""
    )
    coarse, fine = (verdicts(text.replace("STEP", step))[0][1] for step in ("15", "0.05"))
    assert fine > 0
    assert coarse == pytest.approx(fine, rel=1e-12)


@pytest.mark.parametrize("step", [5, 7.2, 45])
def test_a_parallelogram_that_is_followed_moves_every_point_on_a_circle(step):
    """At 1 rad/s every velocity is 30 and every acceleration 30, through both change points."""
    answer = mechdesign.kinematics(
        mechdesign.load(
            text=f"""
mechanism:
  branch: follow
  links:
    ground: {{O: [0, 0], D: [100, 0]}}
    crank: [O, A, 30]
    rod: {{from: A, to: B, length: 100, points: {{M: [45, 20]}}}}
    rocker: [D, B, 30]
  drives: {{theta: {{angle: crank}}}}
  sketch: {{A: [10, 28], B: [110, 28]}}
kinematics:
  outputs: [M, rocker.angle]
  rates: {{theta: 1 rad/s}}
  sweep: {{theta: {{from: 0, to: 360, step: {step}}}}}
"""
        )
    )
    for output in ("M.x_velocity", "M.y_velocity", "M.x_acceleration", "M.y_acceleration"):
        low, _, high, _ = extremes(answer, output)
        assert (low, high) == (pytest.approx(-30, rel=1e-9), pytest.approx(30, rel=1e-9))
    low, _, high, _ = extremes(answer, "rocker.angle_velocity")
    assert (low, high) == (pytest.approx(math.degrees(1), rel=1e-9),) * 2
    low, _, high, _ = extremes(answer, "rocker.angle_acceleration")
    assert max(abs(low), abs(high)) < 1e-6


@pytest.mark.slow
def test_a_crossed_parallelogram_goes_smoothly_through_its_change_points():
    """With a = A and d = D, B - A is (d - a)^2 |d| / |d - a|^2, for d - a is the axis of the kite that mirrors it."""
    answer = mechdesign.kinematics(
        mechdesign.load(
            text="""
mechanism:
  branch: follow
  links:
    ground: {O: [0, 0], D: [84.519, 0]}
    crank: [O, A, 46.2367]
    rod: {from: A, to: B, length: 84.519, points: {M: [34.1277, -32.3175]}}
    rocker: [D, B, 46.2367]
  drives: [crank]
  sketch: {A: [-27.139609160, -37.433595092], B: [40.300297601, 13.510691507]}
kinematics:
  outputs: [M]
  rates: {crank: 1 rad/s}
  sweep: {crank: {from: -180, to: 180, step: 2}}
"""
        )
    )
    turn = np.linspace(-np.pi, np.pi, 400_001)
    a = 46.2367 * np.exp(1j * turn)
    along = (84.519 - a) ** 2 / np.abs(84.519 - a) ** 2
    velocity = np.gradient(a + along * (34.1277 - 32.3175j), turn, edge_order=2)
    acceleration = np.gradient(velocity, turn, edge_order=2)
    for name, values in (("velocity", velocity), ("acceleration", acceleration)):
        for axis, part in (("x", values.real[3:-3]), ("y", values.imag[3:-3])):
            low, _, high, _ = extremes(answer, f"M.{axis}_{name}")
            assert (low, high) == pytest.approx((part.min(), part.max()), rel=1e-5)


def test_a_slider_crank_of_equal_links_moves_as_twice_a_cosine():
    answer = mechdesign.kinematics(
        mechdesign.load(
            text="""
mechanism:
  branch: follow
  links:
    ground: {O: [0, 0]}
    crank: [O, A, 50]
    rod: [A, B, 50]
    slider: {B: [0, 0]}
  joints: {guide: {prismatic: [ground, slider], through: O}}
  drives: {theta: {angle: crank}}
  sketch: {A: [30, 40], B: [60, 0]}
kinematics: {outputs: [B], rates: {theta: 0.5 rad/s}, sweep: {theta: {from: 0, to: 360, step: 5}}}
"""
        )
    )
    assert extremes(answer, "B.x_velocity") == pytest.approx([-50, 90, 50, 270], rel=1e-9)
    assert extremes(answer, "B.x_acceleration")[::2] == pytest.approx([-25, 25], rel=1e-9)


@pytest.mark.parametrize("step", [1, 3, 5])
def test_what_is_infinite_at_a_dead_centre_has_an_infinite_rms_whatever_the_rows(step):
    """A slider pushed at 10 from one dead centre to the other: the crank's velocity has a mean, its square has none."""
    study = mechdesign.load(
        text=f"""
mechanism:
  links:
    ground: {{O: [0, 0]}}
    crank: [O, A, 30]
    rod: [A, B, 90]
    slider: {{B: [0, 0]}}
  joints: {{guide: {{prismatic: [ground, slider], through: O}}}}
  drives: {{push: {{slide: guide}}}}
  sketch: {{A: [0, 30], B: [84, 0]}}
kinematics:
  outputs: [A, crank.angle]
  rates: {{push: 10}}
  sweep: {{push: {{from: 60, to: 120, step: {step}}}}}
requirements:
  - {{result: kinematics.crank.angle_velocity.rms, at_most: 1e6, unassembled: allowed}}
  - {{result: kinematics.crank.angle_velocity, at_least: -1e6, unassembled: allowed}}
"""
    )
    answer = mechdesign.kinematics(study)
    assert not any(verdict.met for verdict in answer.verdicts)
    # A on its circle: y'' < 0 all the way, and y' goes from plus to minus infinity.
    assert extremes(answer, "A.y_velocity") == [-math.inf, 120, math.inf, 60]
    low, _, high, _ = extremes(answer, "A.y_acceleration")
    assert low == -math.inf
    assert high < 0


def test_a_target_by_a_table_is_compared_between_its_rows_too():
    """The table has a peak of 1 deg within rows of 15 deg; the error's largest value is at its top."""
    answer = mechdesign.kinematics(
        mechdesign.load(
            text=FOUR_BAR.rstrip()
            + """
  measures: {m: 0*theta}
  targets: {m: [[0, 0], [222, 0], [222.5, 7], [223, 0], [360, 0]]}
kinematics: {outputs: [m], sweep: {theta: {from: 0, to: 360, step: 15}}}
"""
        )
    )
    assert extremes(answer, "m_error")[:2] == [pytest.approx(-7, rel=1e-12), pytest.approx(222.5, abs=1e-9)]


def test_the_error_from_a_path_has_its_largest_value_where_the_nearest_side_changes():
    """Between the sides y = 80 and y = -90 a point is farthest from both at y = -5: there it is 85 away."""
    answer = mechdesign.kinematics(
        mechdesign.load(
            text=ARM.rstrip()
            + """
  targets: {A: [[-300, 80], [300, 80], [300, -90], [-300, -90]]}
kinematics: {outputs: [A], sweep: {theta: {from: 0, to: 360, step: 30}}}
"""
        )
    )
    turn = math.degrees(math.asin(0.05))
    assert extremes(answer, "A_error")[2:] == pytest.approx([85, 180 + turn], rel=1e-12)


def test_a_path_through_a_singularity_is_told_where_the_outputs_are_the_path_itself():
    """Both motors of the five-bar lose the tip where its upper links lie in one line."""
    answer = mechdesign.kinematics(
        mechdesign.load(
            text="""
mechanism:
  links:
    ground: {O: [-100, 0], D: [100, 0]}
    left: [O, A, 100]
    right: [D, B, 100]
    upper_left: [A, C, 130]
    upper_right: [B, C, 130]
  drives: {q1: {angle: left}, q2: {angle: right}}
  sketch: {A: [-120, 70], B: [120, 70], C: [0, 170]}
kinematics:
  path: {C: {line: [[0, 170], [1, 40]], points: 14}}
  outputs: [C]
  speed: 50
  loads: [{at: C, force: [3, -20]}]
"""
        )
    )
    limits = answer.tables["limits"]
    assert limits["kind"].tolist() == ["singularity"]

    def across(part):
        """Sine between the upper links, with the tip at a part of its way."""
        tip = complex(part, 170 - 130 * part)
        elbows = []
        for motor, side in ((-100, 1), (100, -1)):
            way = tip - motor
            turn = math.acos((100**2 + abs(way) ** 2 - 130**2) / (2 * 100 * abs(way)))
            elbows.append(motor + 100 * way / abs(way) * np.exp(1j * side * turn))
        return ((elbows[0] - tip).conjugate() * (elbows[1] - tip)).imag

    part = brentq(across, 0.2, 0.9, xtol=1e-14)
    assert (limits["C.x"][0], limits["C.y"][0]) == pytest.approx((part, 170 - 130 * part), rel=1e-9)


@pytest.mark.nightly
def test_the_size_of_a_force_that_changes_its_sign_is_zero_there():
    """The rod of a crank that a load at B alone pushes bears F/cos: it is zero with the load, and never negative."""
    answer = mechdesign.dynamics(
        mechdesign.load(
            text="""
mechanism:
  links:
    ground: {O: [0, 0]}
    crank: [O, A, 30]
    rod: [A, B, 90]
    slider: {B: [0, 0]}
  joints: {guide: {prismatic: [ground, slider], through: O}}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [84, 0]}
dynamics:
  sweep: {theta: {from: 0, to: 360, step: 17}}
  loads: [{at: B, force: ["10*sin(theta - 77.77)*cos(3*theta)", 0]}]
"""
        )
    )
    for name in ("A_force", "guide_force"):
        low, _, high, _ = extremes(answer, name)
        assert 0 <= low < 1e-9
        assert high > 1
