"""Motions in time under given efforts, against closed forms and published solutions."""

from __future__ import annotations

import math

import numpy as np
import pytest
from helpers.studies import study_of
from scipy.special import ellipk

from mechdesign.ground.results import Result, Table
from mechdesign.questions.dynamics.analysis import dynamics
from tests.reference.test_textbook_dynamics import SQUEEZER

UNITS = "units: {length: m, angle: rad, force: N}\n"
BAR = f"mass: 1, center: [0.5, 0], inertia: {1 / 12!r}"


def run(text: str) -> Result:
    return dynamics(study_of(text))


def balance(table: Table) -> np.ndarray:
    """What the energies have gained beyond the work that was put in; 0."""
    energy = table["kinetic_energy"] + table["potential_energy"] - table["work"]
    return np.asarray(energy - energy[0])


@pytest.mark.nightly
def test_a_physical_pendulum_swings_with_the_period_of_the_elliptic_integral() -> None:
    # Period 4 sqrt(J / (m g r)) K(sin^2(a / 2)), a the amplitude: passes its lowest place every half of it.
    amplitude = 2.5
    result = run(f"""{UNITS}
mechanism:
  links: {{ground: {{O: [0, 0]}}, arm: {{from: O, to: P, length: 1, {BAR}}}}}
  drives: {{theta: {{angle: arm}}}}
dynamics:
  gravity: [0, -9.81]
  forward: {{duration: 10, start: {{theta: -pi/2 + {amplitude}}}, events: {{lowest: {{of: theta, value: -pi/2}}}}}}
""")
    period = 4 * math.sqrt((1 / 12 + 0.25) / (9.81 * 0.5)) * ellipk(math.sin(amplitude / 2) ** 2)
    table, events = result.main, result.tables["events"]
    lowest = events["time"]
    assert len(lowest) == int(2 * 10 / period + 0.5)
    assert lowest == pytest.approx(period / 4 + period / 2 * np.arange(len(lowest)), rel=1e-9)
    assert np.abs(balance(table)).max() < 1e-9 * table["kinetic_energy"].max()


@pytest.mark.nightly
def test_andrews_squeezer_moves_to_its_published_state() -> None:
    # CWI test set, state at 0.03 s: see `SQUEEZER`; nine digits of the printed ones agree.
    text = SQUEEZER.split("dynamics:")[0] + (
        "dynamics: {forward: {duration: 0.03, start: {beta: -0.0617138900142764496}, efforts: {beta: 0.033}, rows: 4}}"
    )
    table = run(text).main
    assert table["beta"][-1] == pytest.approx(15.81077119629904, rel=1e-9)
    assert table["beta_velocity"][-1] == pytest.approx(1139.920302151208, rel=1e-9)
    assert table["beta_acceleration"][-1] == pytest.approx(-24631.76316945196, rel=2e-7)
    assert np.abs(balance(table)).max() < 1e-9 * table["kinetic_energy"].max()


def test_a_double_pendulum_keeps_its_energy() -> None:
    table = run(f"""{UNITS}
mechanism:
  links: {{ground: {{O: [0, 0]}}, a: {{from: O, to: P, length: 1, {BAR}}}, b: {{from: P, to: Q, length: 1, {BAR}}}}}
  drives: {{t1: {{angle: a}}, t2: {{angle: b, from: a}}}}
dynamics: {{gravity: [0, -9.81], forward: {{duration: 2, start: {{t1: 1, t2: 1}}}}}}
""").main
    assert np.abs(balance(table)).max() < 1e-9 * table["kinetic_energy"].max()


@pytest.mark.nightly
@pytest.mark.parametrize(("count", "energy", "angle"), [(2, 1e-9, 1e-7), (40, 5e-9, 1e-6)])
def test_four_bars_go_through_the_pose_in_which_all_links_lie_on_a_line(
    count: int, energy: float, angle: float
) -> None:
    # IFToMM library of computational benchmark problems, N four-bars: links of 1 m and 1 kg, from the upright position
    # with 1 m/s, here 5 s of its 10 s. All links are on a line twice a turn, where the loops lose rank; the mechanism
    # is a pendulum of N + 1 bars that turn with the crank and N that do not, of J = (N + 1)/3 + N and
    # m r = (N + 1)/2 + N.
    points = ", ".join(f"A{k}: [{k}, 0]" for k in range(count + 1))
    cranks = "\n".join(f"    r{k}: {{from: A{k}, to: B{k}, length: 1, {BAR}}}" for k in range(count + 1))
    rods = "\n".join(f"    c{k}: {{from: B{k}, to: B{k + 1}, length: 1, {BAR}}}" for k in range(count))
    pins = ", ".join(f"B{k}: [{k}, 1]" for k in range(count + 1))
    text = f"""{UNITS}
mechanism:
  links:
    ground: {{{points}}}
{cranks}
{rods}
  drives: {{theta: {{angle: r0}}}}
  sketch: {{{pins}}}
dynamics: {{gravity: [0, -9.81], forward: {{duration: 5, start: {{theta: pi/2, theta_velocity: -1}}, rows: 51}}}}
"""
    table = run(text).main
    assert np.abs(balance(table)).max() < energy * table["kinetic_energy"].max()
    inertia, moment = (count + 1) / 3 + count, (count + 1) / 2 + count
    alone = run(f"""{UNITS}
mechanism:
  links:
    ground: {{O: [0, 0]}}
    arm: {{from: O, to: P, length: 1, mass: {moment}, center: [1, 0], inertia: {inertia + 10 - moment}}}
  drives: {{theta: {{angle: arm}}}}
dynamics:
  gravity: [0, {-9.81 * (inertia + 10) / inertia!r}]
  forward: {{duration: 5, start: {{theta: pi/2, theta_velocity: -1}}, rows: 51}}
""").main
    assert table["theta"] == pytest.approx(alone["theta"], abs=angle)


def test_a_planetary_train_moves_with_its_reduced_inertia() -> None:
    # Ring held: the arm turns with 1/5 of the sun, the planet with -7/5. Weights turn back with m r g cos(th/5)/5.
    arm, planet = 0.2, -1.4
    inertia = 0.001 + arm**2 * (0.002 + 0.4 * 0.02**2 + 0.3 * 0.06**2) + planet**2 * 0.0005
    table = run(f"""{UNITS}
mechanism:
  links:
    ground: {{O: [0, 0]}}
    sun: {{from: O, to: S, length: 0.02, mass: 0.5, center: [0, 0], inertia: 0.001}}
    arm: {{from: O, to: P, length: 0.06, mass: 0.4, center: [0.02, 0], inertia: 0.002}}
    planet: {{from: P, to: Q, length: 0.02, mass: 0.3, center: [0, 0], inertia: 0.0005}}
  couplings:
    inner: {{set: planet.angle, to: "-2*sun.angle + 3*arm.angle"}}
    ring: {{set: arm.angle, to: "sun.angle/5"}}
  drives: {{theta: {{angle: sun}}}}
  sketch: {{S: [0.02, 0], P: [0.06, 0], Q: [0.08, 0]}}
dynamics:
  gravity: [0, -9.81]
  forward: {{duration: 1, start: {{theta: 0, theta_velocity: 3}}, efforts: {{theta: 0.02}}, rows: 11}}
""").main
    back = 9.81 * (0.4 * 0.02 + 0.3 * 0.06) * arm * np.cos(arm * table["theta"])
    assert table["theta_acceleration"] == pytest.approx((0.02 - back) / inertia, rel=1e-12)
    energy = 0.5 * inertia * table["theta_velocity"] ** 2
    assert table["kinetic_energy"] == pytest.approx(energy, rel=1e-12)
    assert np.abs(balance(table)).max() < 1e-9 * table["kinetic_energy"].max()


@pytest.mark.nightly
def test_a_slider_crank_is_driven_through_its_dead_centres_by_its_slider() -> None:
    # The crank turns through the dead centres of the slider, which is the drive; without friction it turns on for ever.
    text = f"""{UNITS}
mechanism:
  links:
    ground: {{A: [0, 0]}}
    crank: {{from: A, to: B, length: 1, {BAR}}}
    rod: {{from: B, to: C, length: 2, mass: 1, center: [1, 0], inertia: 0.3}}
    slider: {{points: {{C: [0, 0]}}, mass: 1}}
  joints: {{guide: {{prismatic: [ground, slider], through: A}}}}
  drives: {{%s}}
  sketch: {{B: [0.7, 0.7], C: [2.5708, 0]}}
dynamics:
  outputs: [crank.angle]
  forward: {{duration: 3, start: {{%s}}, rows: 61}}
"""
    angle, speed = 0.7, 6.0
    place = math.cos(angle) + math.sqrt(4 - math.sin(angle) ** 2)
    rate = -speed * (math.sin(angle) + math.sin(angle) * math.cos(angle) / math.sqrt(4 - math.sin(angle) ** 2))
    by_slider = run(text % ("s: {slide: guide}", f"s: {place!r}, s_velocity: {rate!r}")).main
    by_crank = run(text % ("theta: {angle: crank}", f"theta: {angle}, theta_velocity: {speed}")).main
    assert by_crank["theta"][-1] > 6
    assert by_slider["crank.angle"] == pytest.approx(by_crank["theta"], abs=1e-8)
    assert np.abs(balance(by_slider)).max() < 1e-9 * by_slider["kinetic_energy"].max()


def test_a_run_up_takes_the_work_of_its_motor() -> None:
    # A flywheel of J under the characteristic M0 - c omega: omega = (M0 / c)(1 - exp(-c t / J)).
    moment, slope, inertia = 5.0, 0.1, 0.2
    table = run(f"""{UNITS}
mechanism:
  links: {{ground: {{O: [0, 0]}}, wheel: {{from: O, to: P, length: 1, mass: 1, center: [0, 0], inertia: {inertia}}}}}
  drives: {{theta: {{angle: wheel}}}}
dynamics: {{forward: {{duration: 4, start: {{theta: 0}}, efforts: {{theta: "{moment} - {slope}*theta_velocity"}}}}}}
""").main
    speed = moment / slope * (1 - np.exp(-slope * table["time"] / inertia))
    assert table["theta_velocity"] == pytest.approx(speed, abs=1e-9)
    assert table["work"] == pytest.approx(0.5 * inertia * speed**2, abs=1e-8)


def test_a_mass_bounces_at_its_stop() -> None:
    # Falls of a height h under g, and bounces with 0.8 of its velocity: t1 = sqrt(2 h / g), then 2 * 0.8^k * t1 each.
    height, back = 2.0, 0.8
    text = f"""{UNITS}
mechanism:
  links: {{ground: {{O: [0, 0], Q: [0, 1]}}, block: {{points: {{P: [0, 0]}}, mass: 3}}}}
  joints: {{guide: {{prismatic: [ground, block], through: O, direction: 90 deg}}}}
  drives: {{z: {{slide: guide}}}}
  limits: [{{drive: z, min: 0, max: 9}}]
  sketch: {{P: [0, 2]}}
dynamics: {{gravity: [0, -9.81], forward: {{duration: 3, start: {{z: {height}}} %s}}}}
"""
    result = run(text % f", restitution: {back}")
    first = math.sqrt(2 * height / 9.81)
    times = first + np.cumsum([0.0, *(2 * first * back**k for k in range(1, 20))])
    events = result.tables["events"]["time"]
    assert events == pytest.approx(times[: len(events)], abs=1e-9)
    assert len(events) == np.sum(times <= 3)
    assert np.abs(balance(result.main)).max() < 1e-9 * result.main["kinetic_energy"].max()
    ended = run(text % "")
    assert ended.main["time"][-1] == pytest.approx(first, abs=1e-10)
    assert "limit" in str(ended.warnings[0])


def test_a_flywheel_bears_the_surplus_of_a_cycle() -> None:
    # Torque 3 + 2 cos 2 theta at 7 rad/s: the surplus is 2, of J = 0.5 the fluctuation 2 / (0.5 * 49).
    table = run(f"""{UNITS}
mechanism:
  links: {{ground: {{O: [0, 0]}}, wheel: {{from: O, to: P, length: 1, mass: 1, center: [0, 0], inertia: 0.5}}}}
  drives: {{theta: {{angle: wheel}}}}
dynamics:
  loads: [{{link: wheel, moment: "-3 - 2*cos(2*theta)"}}]
  flywheel: {{fluctuation: 0.05}}
  sweep: {{theta: {{from: 0, to: 2*pi, number: 361}}}}
  rates: {{theta: 7}}
""").tables["flywheel"]
    assert table["mean_effort"][0] == pytest.approx(3, rel=1e-9)
    assert table["fluctuation"][0] == pytest.approx(2 / 24.5, rel=1e-8)
    assert table["added_inertia"][0] == pytest.approx(2 / (49 * 0.05) - 0.5, rel=1e-8)


def test_two_pendulums_have_the_modes_of_their_linear_equations() -> None:
    table = run(f"""{UNITS}
mechanism:
  links: {{ground: {{O: [0, 0]}}, a: {{from: O, to: P, length: 1, {BAR}}}, b: {{from: P, to: Q, length: 1, {BAR}}}}}
  drives: {{t1: {{angle: a}}, t2: {{angle: b}}}}
dynamics: {{gravity: [0, -9.81], modes: true, poses: [{{t1: -pi/2, t2: -pi/2}}, {{t1: pi/2, t2: pi/2}}]}}
""").tables["modes"]
    mass = np.array([[4 / 3, 1 / 2], [1 / 2, 1 / 3]])
    stiffness = 9.81 * np.diag([1.5, 0.5])
    expected = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(mass, stiffness)))) / (2 * np.pi)
    assert table["frequency"][:2] == pytest.approx(expected, rel=1e-10)
    assert np.isnan(table["frequency"][2:]).all()
