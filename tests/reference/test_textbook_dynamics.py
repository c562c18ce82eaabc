"""Forces of published mechanisms, each with its source, and of mechanisms that balance themselves exactly."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from helpers.studies import study_of

from mechdesign.questions.dynamics.analysis import dynamics
from mechdesign.results import Result

SLENDER = 0.01  # height of the links of Marghitu's examples, m


def asked(text: str) -> Result:
    result = dynamics(study_of(text))
    assert result.main["valid"].all()
    return result


def force(result: Result, joint: str, on: str) -> complex:
    """The force of a joint on a link, or on this by a link, at the first pose."""
    table = result.tables["joint_forces"]
    for k in range(len(table)):
        if table["joint"][k] == joint and on in (table["on"][k], table["by"][k]):
            return complex(table["fx"][k], table["fy"][k]) * (1 if table["on"][k] == on else -1)
    raise AssertionError((joint, on))


# Andrews' squeezer mechanism. Data, initial values and the solution at 0.03 s: W. M. Lioen and J. J. B. de Swart, Test
# Set for Initial Value Problem Solvers, CWI, problem "Andrews' squeezing mechanism"; after E. Hairer and G. Wanner,
# Solving Ordinary Differential Equations II, section VII.7. Its multipliers are forces on K3, K4 and K6 where they meet
# K2; its motor turns K1 with 0.033 N m.
SQUEEZER = """
units: {length: m, angle: rad, force: N}
mechanism:
  links:
    ground: {O: [0, 0], A: [-0.06934, -0.00227], B: [-0.03635, 0.03273], C: [0.014, 0.072]}
    K1: {from: O, to: F, length: 0.007, mass: 0.04325, center: [0.00092, 0], inertia: 2.194e-6}
    K2: {from: F, to: E, length: 0.028, mass: 0.00365, center: [0.0115, 0], inertia: 4.410e-7}
    K3:
      points: {B: [0, 0], E: [0, -0.035], D: [0.02, -0.018]}
      mass: 0.02373
      center: [0.01043, -0.01874]
      inertia: 5.255e-6
    K4: {from: G, to: E, length: 0.02, mass: 0.00706, center: [0.00579, 0], inertia: 5.667e-7}
    K5: {from: A, to: G, length: 0.04, mass: 0.07050, center: [0.02308, 0.00916], inertia: 1.169e-5}
    K6: {from: H, to: E, length: 0.02, mass: 0.00706, center: [0.00579, 0], inertia: 5.667e-7}
    K7: {from: A, to: H, length: 0.04, mass: 0.05498, center: [0.01228, -0.00449], inertia: 1.912e-5}
  springs: {squeezed: {between: [D, C], stiffness: 4530, free_length: 0.07785}}
  drives: {beta: {angle: K1}}
  sketch: {F: [0.007, 0], E: [-0.021, 0.0013], D: [-0.0105, 0.0253], G: [-0.034, 0.01646], H: [-0.0316, -0.01556]}
dynamics: {poses: [{beta: %s}], rates: {beta: %s}, accelerations: {beta: %s}}
"""


@pytest.mark.parametrize(
    ("beta", "rate", "acceleration", "multipliers", "digits"),
    [
        pytest.param(
            "-0.0617138900142764496", "0", "14222.4439199541138706",
            (98.5668703962410896 - 6.12268834425566265j, 0j, 0j), 1e-13, id="start",
        ),
        # The solution at the end is printed with all digits of an integration; as its torque shows, it has seven.
        pytest.param(
            "15.81077119629904", "1139.920302151208", "-24631.76316945196",
            (199.1753333731910 - 29.75531228015052j, 23.06654119098399 + 31.45271365475927j,
             22.64249232082739 + 11.61740700019673j), 2e-7, id="end",
        ),
    ],
)  # fmt: skip
def test_torque_and_reactions_of_andrews_squeezer(
    beta: str, rate: str, acceleration: str, multipliers: tuple[complex, ...], digits: float
) -> None:
    result = asked(SQUEEZER % (beta, rate, acceleration))
    assert result.main["beta_effort"][0] == pytest.approx(0.033, rel=digits)
    for link, multiplier in zip(("K3", "K4", "K6"), multipliers, strict=True):
        assert force(result, "E", link) == pytest.approx(multiplier, abs=digits * abs(multipliers[0])), link


def test_joint_forces_of_a_slider_crank() -> None:
    # D. B. Marghitu, Mechanisms and Robots Analysis with MATLAB, Springer 2009, p. 144, F12 after eq. (4.52):
    # crank and rod of 1 m and 1 kg, slider of 1 kg, 1 rad/s at 45 deg, 100 N against the motion, g = 10 m/s^2.
    result = asked("""
units: {length: m, angle: rad, force: N}
mechanism:
  links:
    ground: {A: [0, 0]}
    crank: {from: A, to: B, length: 1, mass: 1, center: [0.5, 0], inertia: 0.0833417}
    rod: {from: B, to: C, length: 1, mass: 1, center: [0.5, 0], inertia: 0.0833417}
    slider: {points: {C: [0, 0]}, mass: 1, inertia: 0.0000166667}
  joints: {guide: {prismatic: [ground, slider], through: A}}
  drives: [crank]
  sketch: {B: [0.7, 0.7], C: [1.4, 0]}
dynamics: {gravity: [0, -10], poses: [{crank: pi/4}], rates: {crank: 1}, loads: [{at: C, force: [100, 0]}]}
""")
    expected = complex(-(400 + 7 * math.sqrt(2)) / 4, 5 * (84 + math.sqrt(2)) / 4)
    assert force(result, "B", "rod") == pytest.approx(expected, rel=1e-14)


def bar(length: float) -> tuple[float, float]:
    """Mass and moment of inertia of a bar of Marghitu's: 8000 kg/m^3, 0.01 m high, 0.001 m deep."""
    mass = 8000 * length * SLENDER * 0.001
    return mass, mass * (length**2 + SLENDER**2) / 12


def test_joint_force_of_a_quick_return_mechanism() -> None:
    # D. B. Marghitu, Mechanisms and Robots Analysis with MATLAB, Springer 2009, section 4.7 (R-RTR-RTR), p. 176:
    # F03 = -431.027 i - 878.152 j N. We have read this page, not the one with the data, which we took as those of the
    # book's other chapters: AB = 0.15 m, AC = 0.10 m, CD = 0.15 m, DF = 0.40 m, AG = 0.30 m, sliders of 0.05 m by
    # 0.02 m, crank at 30 deg and 50 rpm, 100 N m against the output, g = 9.807 m/s^2. Six digits of both numbers agree.
    mass = 8000 * 0.05 * 0.02 * 0.001
    slider = f"mass: {mass}, inertia: {mass * (0.05**2 + 0.02**2) / 12}"
    crank, rod, output = (f"mass: {m}, inertia: {j}" for m, j in map(bar, (0.15, 0.40, 0.30)))
    result = asked(f"""
units: {{length: m, angle: deg, force: N, time: min}}
mechanism:
  links:
    ground: {{A: [0, 0], C: [0, 0.1]}}
    crank: {{from: A, to: B, length: 0.15, {crank}}}
    block: {{points: {{B: [0, 0]}}, {slider}}}
    rod: {{from: C, to: D, length: 0.15, {rod}, center: [{0.15 - 0.40 / 2}, 0]}}
    sleeve: {{points: {{D: [0, 0]}}, {slider}}}
    output: {{points: {{A: [0, 0]}}, {output}, center: [0.15, 0]}}
  joints:
    inner: {{prismatic: [rod, block], through: C}}
    outer: {{prismatic: [output, sleeve], through: A}}
  drives: [crank]
  sketch: {{B: [0.13, 0.075], D: [-0.147, 0.128]}}
dynamics:
  gravity: [0, -9.807 m/s^2]
  poses: [{{crank: 30}}]
  rates: {{crank: 50*360}}
  loads: [{{link: output, moment: -100}}]
""")
    found = force(result, "C", "rod")
    assert [f"{found.real:.3f}", f"{found.imag:.3f}"] == ["-431.027", "-878.152"]


# Mechanisms that balance themselves: what is left is rounding, here a part of what is balanced.
LEFT = 1e-12


def test_an_arm_is_balanced_by_a_spring_of_no_free_length() -> None:
    # k a b = m g r balances a mass m at r: F. L. S. te Riele and J. L. Herder, Perfect static balance with normal
    # springs, ASME DETC 2001.
    mass, r, a, b = 3.7, 231.0, 173.0, 119.0
    gravity = mass * 9.81 * r  # N mm
    result = asked(f"""
mechanism:
  links:
    ground: {{O: [20, 30], S: [20, {30 + a}]}}
    arm: {{from: O, to: P, length: 300, points: {{B: [{b}, 0]}}, mass: {mass}, center: [{r}, 0]}}
  springs: {{balance: {{between: [S, B], stiffness: {gravity / (a * b)!r}, free_length: 0}}}}
  drives: [arm]
dynamics: {{gravity: [0, -9.81 m/s^2], sweep: {{arm: {{from: -180, to: 180, number: 73}}}}}}
""")
    table = result.main
    assert np.abs(table["arm_effort"]).max() < LEFT * gravity
    assert np.ptp(table["potential_energy"]) < LEFT * gravity


def test_two_links_are_balanced_by_two_springs() -> None:
    """A parallelogram carries the direction of gravity to the elbow, where the second spring hangs on it."""
    m1, m2, r1, r2, length, a, b1, b2 = 4.0, 2.5, 160.0, 190.0, 400.0, 90.0, 110.0, 70.0
    torques = 9.81 * (m1 * r1 + m2 * length), 9.81 * m2 * r2
    k1, k2 = torques[0] / (a * b1), torques[1] / (a * b2)
    result = asked(f"""
mechanism:
  links:
    ground: {{O: [0, 0], Q: [0, {a}]}}
    upper: {{from: O, to: E, length: {length}, points: {{B: [{b1}, 0]}}, mass: {m1}, center: [{r1}, 0]}}
    stay: {{from: Q, to: T, length: {length}}}
    mast: {{from: E, to: T, length: {a}}}
    fore: {{from: E, to: P, length: 350, points: {{C: [{b2}, 0]}}, mass: {m2}, center: [{r2}, 0]}}
  springs:
    shoulder: {{between: [Q, B], stiffness: {k1!r}, free_length: 0}}
    elbow: {{between: [T, C], stiffness: {k2!r}, free_length: 0}}
  drives: {{t1: {{angle: upper}}, t2: {{angle: fore}}}}
  sketch: {{E: [400, 0], T: [400, {a}], P: [700, 200]}}
dynamics:
  gravity: [0, -9.81 m/s^2]
  sweep: {{t1: {{from: -60, to: 60, number: 13}}, t2: {{from: -170, to: 180, number: 15}}}}
""")
    for drive in ("t1", "t2"):
        assert np.abs(result.main[f"{drive}_effort"]).max() < LEFT * max(torques), drive


def test_a_four_bar_is_force_balanced_after_berkof_and_lowen() -> None:
    # R. S. Berkof and G. G. Lowen, A new method for completely force balancing simple linkages, J. Eng. for Industry 91
    # (1969): the centres of crank and rocker for any coupler, here with its centre off its line.
    a1, a2, a3, speed = 50.0, 150.0, 120.0, 30.0
    m1, m2, m3, coupler = 1.9, 0.8, 2.3, complex(61.0, 17.0)
    crank, rocker = -m2 * (1 - coupler / a2) * a1 / m1, -m2 * (coupler / a2) * a3 / m3
    result = asked(f"""
units: {{angle: rad}}
mechanism:
  links:
    ground: {{O: [0, 0], D: [160, 20]}}
    crank: {{from: O, to: A, length: {a1}, mass: {m1}, center: [{crank.real!r}, {crank.imag!r}], inertia: 400}}
    rod: {{from: A, to: B, length: {a2}, mass: {m2}, center: [{coupler.real}, {coupler.imag}], inertia: 900}}
    rocker: {{from: D, to: B, length: {a3}, mass: {m3}, center: [{rocker.real!r}, {rocker.imag!r}], inertia: 700}}
  drives: [crank]
  sketch: {{A: [30, 40], B: [140, 130]}}
dynamics:
  sweep: {{crank: {{from: 0, to: 2*pi, number: 61}}}}
  rates: {{crank: {speed}}}
  accelerations: {{crank: 200}}
""")
    largest = 1e-3 * m2 * abs(coupler) * speed**2  # N
    assert np.abs(result.main["shaking.x"]).max() < LEFT * largest
    assert np.abs(result.main["shaking.y"]).max() < LEFT * largest
    # The moment is not balanced, nor is the driving torque.
    assert np.abs(result.main["shaking_moment"]).max() > largest
    assert cmath.isfinite(force(result, "A", "rod"))


def test_a_turn_at_constant_speed_takes_no_work() -> None:
    """The mean effort over a turn is that of the load alone; extremes and means are those between the poses too."""
    text = """
mechanism:
  links:
    ground: {O: [0, 0], D: [160, 20]}
    crank: {from: O, to: A, length: 50, mass: 0.6, center: [20, 5], inertia: 400}
    rod: {from: A, to: B, length: 150, mass: 0.9, inertia: 900}
    rocker: {from: D, to: B, length: 120, mass: 0.7, inertia: 700}
  springs: {back: {between: [O, B], stiffness: 0.3, free_length: 90}}
  drives: [crank]
  sketch: {A: [30, 40], B: [140, 130]}
dynamics:
  gravity: [0, -9.81 m/s^2]
  sweep: {crank: {from: 0, to: 360, number: %d}}
  rates: {crank: 3000}
  loads: [{link: crank, moment: -250}]
"""
    extremes, fine = asked(text % 13).tables["extremes"], asked(text % 20001)
    (row,) = np.flatnonzero(extremes["output"] == "crank_effort")
    effort = fine.main["crank_effort"]
    assert extremes["mean"][row] == pytest.approx(250, rel=1e-9)
    assert extremes["max"][row] == pytest.approx(effort.max(), rel=1e-6)
    assert extremes["min"][row] == pytest.approx(effort.min(), rel=1e-6)
    assert extremes["rms"][row] == pytest.approx(np.sqrt(np.mean(effort[1:] ** 2)), rel=1e-9)
