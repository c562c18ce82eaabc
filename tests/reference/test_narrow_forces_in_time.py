"""Motions in time under what acts briefly, on a short way, or near a turning point, against closed forms and SciPy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from helpers.studies import study_of
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipk

from mechdesign.ground.results import Result
from mechdesign.questions.dynamics.analysis import dynamics

G = 9.81
UNITS = "units: {length: m, angle: rad, force: N}\n"


def run(text: str) -> Result:
    return dynamics(study_of(UNITS + text))


def slid(effort: str, duration: float, speed: float = 0.0, more: str = "", mass: float = 1.0) -> Result:
    """A mass on a straight way, from 0 at some speed."""
    return run(f"""
mechanism:
  links: {{ground: {{O: [0, 0]}}, block: {{points: {{B: [0, 0]}}, mass: {mass}}}}}
  joints: {{way: {{prismatic: [ground, block], through: O}}}}
  drives: {{s: {{slide: way}}}}
  sketch: {{B: [0, 0]}}
  {more}
dynamics:
  gravity: [0, -{G}]
  forward: {{duration: {duration}, start: {{s: 0, s_velocity: {speed}}}, rows: 21, efforts: {{s: "{effort}"}}}}
""")


def wheel(load: str, duration: float, inertia: float = 5, speed: float = 6.283, more: str = "") -> Result:
    """A wheel that turns under a load."""
    return run(f"""
mechanism:
  links:
    ground: {{O: [0, 0]}}
    wheel: {{from: O, to: P, length: 1, mass: 1, center: [0, 0], inertia: {inertia}}}
  drives: {{t: {{angle: wheel}}}}
dynamics:
  loads: [{{link: wheel, moment: "{load}"}}]
  forward: {{duration: {duration}, start: {{t: 0, t_velocity: {speed}}}, rows: 21{more}}}
""")


@pytest.mark.parametrize(
    ("height", "force", "duration"), [(0.996, 20000, 5), pytest.param(0.99, 2000, 9, marks=pytest.mark.nightly)]
)
def test_a_wheel_is_braked_on_a_few_degrees_of_each_turn(height: float, force: float, duration: float) -> None:
    table = wheel(f"-{force}*max(0, sin(t) - {height})", duration).main
    # Each time the place is passed the same work is done.
    edge = math.asin(height)
    work = -force * (2 * math.cos(edge) - height * (math.pi - 2 * edge))
    passes = int((table["t"][-1] - math.pi / 2) / (2 * math.pi)) + 1
    assert table["work"][-1] == pytest.approx(passes * work, rel=1e-8)
    assert table["t_velocity"][-1] == pytest.approx(math.sqrt(6.283**2 + passes * work / 2.5), rel=1e-9)


@pytest.mark.nightly
def test_a_wheel_is_braked_for_a_few_milliseconds_of_each_period() -> None:
    table = wheel("-3000*max(0, sin(3*time) - 0.999)", 7).main
    loss = sum(quad(lambda at: max(0.0, math.sin(3 * at) - 0.999), middle - 0.02, middle + 0.02,
                    points=[middle - math.acos(0.999) / 3, middle + math.acos(0.999) / 3])[0]
               for middle in (math.pi / 2 + 2 * math.pi * np.arange(4)) / 3 if middle < 7)  # fmt: skip
    assert table["t_velocity"][-1] == pytest.approx(6.283 - 3000 * loss / 5, rel=1e-9)


@pytest.mark.parametrize(("begin", "end", "duration"), [(4.3, 6.2, 10), (0.51, 0.5101, 3)])
def test_an_effort_that_is_switched_on_and_off_gives_its_impulse(begin: float, end: float, duration: float) -> None:
    switched = f"5*(abs(time - {begin})/(time - {begin}) - abs(time - {end})/(time - {end}))"
    table = slid(switched, duration).main
    assert table["s_velocity"][-1] == pytest.approx(10 * (end - begin), rel=1e-9)
    way = 5 * (end - begin) ** 2 + 10 * (end - begin) * (duration - end)
    assert table["s"][-1] == pytest.approx(way, rel=1e-9)


def test_a_block_at_rest_does_not_miss_a_pulse_of_fifty_milliseconds() -> None:
    result = slid("30*max(0, 1 - abs(time - 1.234)/0.025)", 4, more="friction: {way: {coefficient: 0.2}}", mass=2)
    held = 0.2 * 2 * G
    begin, peak = 1.234 - 0.025 * (1 - held / 30), 1.234

    def slope(time: float, state: np.ndarray) -> list[float]:
        return [state[1], (30 * max(0, 1 - abs(time - peak) / 0.025) - held) / 2]

    def rests(time: float, state: np.ndarray) -> float:
        return float(state[1]) if time > peak else 1.0

    rests.terminal = True  # type: ignore[attr-defined]
    exact = solve_ivp(slope, (begin, 4), [0, 0], rtol=1e-11, atol=1e-14, max_step=1e-3, events=rests)
    assert result.main["s"][-1] == pytest.approx(exact.y[0, -1], rel=1e-7)
    events = result.tables["events"]
    assert events["time"][events["event"] == "standstill"] == pytest.approx([exact.t[-1]], abs=1e-7)


@pytest.mark.nightly
def test_a_block_stays_at_rest_under_a_pulse_below_its_friction() -> None:
    table = slid("3.9*max(0, 1 - abs(time - 1.234)/0.025)", 4, more="friction: {way: {coefficient: 0.2}}", mass=2).main
    assert not table["s"].any()


@pytest.mark.parametrize("place", [3.17, pytest.param(7.5, marks=pytest.mark.nightly)])
def test_a_braking_zone_of_twenty_millimetres_takes_its_work(place: float) -> None:
    table = slid(f"-20*max(0, 1 - abs(s - {place})/0.01)", 10, speed=1).main
    assert table["s_velocity"][-1] == pytest.approx(math.sqrt(1 - 2 * 20 * 0.01), rel=1e-10)
    # A damper there takes a velocity in proportion to the way.
    table = slid(f"-5*s_velocity*max(0, min(1, (0.01 - abs(s - {place}))*1e7))", 10, speed=1).main
    assert table["s_velocity"][-1] == pytest.approx(1 - 5 * 0.02, abs=2e-6)


@pytest.mark.nightly
def test_a_smooth_bump_of_a_force_is_seen_in_time_and_on_the_way() -> None:
    impulse = 0.02 * math.sqrt(math.pi)
    assert slid("10*exp(-((time - 4.3)/0.02)**2)", 10).main["s_velocity"][-1] == pytest.approx(10 * impulse, rel=1e-8)
    table = slid("-10*exp(-((s - 4.3)/0.02)**2)", 10, speed=1).main
    assert table["s_velocity"][-1] == pytest.approx(math.sqrt(1 - 20 * impulse), rel=1e-8)


CAM = """
mechanism:
  links:
    ground: {O: [0, 0], G: [2, 0]}
    wheel: {from: O, to: P, length: 1, mass: 1, center: [0, 0], inertia: 5}
    follower: {points: {F: [0, 0]}, mass: 3}
  joints: {guide: {prismatic: [ground, follower], through: G}}
  couplings: {cam: {set: guide.slide, %s}}
  drives: {theta: {angle: wheel}}
  sketch: {P: [1, 0], F: [2, 0]}
dynamics: {forward: {duration: 1, start: {theta: 1.5, theta_velocity: 3}, rows: 101}}
"""
LOBE = [[0, 0], [2.9, 0], [3, 0], [3.05, 0.2], [3.1, 0.3], [3.15, 0.2], [3.2, 0], [3.3, 0], [5, 0], [2 * math.pi, 0]]


@pytest.mark.parametrize("law", [
    "to: '0.05*max(0, 1 - ((theta - 3)/0.09)**2)'", *(pytest.param(law, marks=pytest.mark.nightly) for law in (
        "to: '2000*max(0, cos(theta - 3) - 0.9962)**2'", "to: '0.1*exp(-((theta - 3)/0.05)**2)'",
        f"of: theta, table: {LOBE}"))
])  # fmt: skip
def test_a_flywheel_keeps_its_energy_over_a_cam_of_ten_degrees(law: str) -> None:
    # Where the law has a corner, velocities jump as at one that is rounded.
    result = run(CAM % law)
    table = result.main
    assert table["theta"][-1] > 3.3
    assert table["kinetic_energy"].max() > 0
    assert np.ptp(table["kinetic_energy"]) < 1e-8 * table["kinetic_energy"].max()
    kinks = [str(warning) for warning in result.warnings if "velocities jump" in str(warning)]
    assert len(kinks) == ("**2)" in law and "max(0, 1" in law)


@pytest.mark.parametrize("part", [0.97, 0.9999])
def test_a_ceiling_a_little_below_the_height_of_a_throw_ends_it(part: float) -> None:
    height, speed = 25 / 2 / G, 5.0
    text = f"""
mechanism:
  links: {{ground: {{O: [0, 0], Q: [0, 1]}}, ball: {{points: {{P: [0, 0]}}, mass: 3}}}}
  joints: {{guide: {{prismatic: [ground, ball], through: O, direction: 90 deg}}}}
  drives: {{z: {{slide: guide}}}}
  limits: [{{drive: z, max: {part * height!r}}}]
  sketch: {{P: [0, 0]}}
dynamics: {{gravity: [0, -{G}], forward: {{duration: 2, rows: 11, start: {{z: 0, z_velocity: {speed}}} %s}}}}
"""
    hit = (speed - math.sqrt(speed**2 * (1 - part))) / G
    table = run(text % "").main
    assert table["time"][-1] == pytest.approx(hit, rel=1e-11)
    assert (table["z"][table["valid"].astype(bool)] <= part * height * (1 + 1e-12)).all()
    bounced = run(text % ", restitution: 0.5").tables["events"]
    assert bounced["time"] == pytest.approx([hit], rel=1e-11)


def swing(more: str, duration: float, limits: str = "") -> Result:
    """A pendulum of 1 m that starts at rest 60 degrees beside its lowest place."""
    return run(f"""
mechanism:
  links: {{ground: {{O: [0, 0]}}, arm: {{from: O, to: P, length: 1, mass: 1, center: [1, 0], inertia: 1e-12}}}}
  drives: {{theta: {{angle: arm}}}}
  sketch: {{P: [0, -1]}}
  {limits}
dynamics:
  gravity: [0, -{G}]
  forward: {{duration: {duration}, rows: 11, start: {{theta: {-math.pi / 6!r}}}{more}}}
""")


PERIOD = 4 / math.sqrt(G) * float(ellipk(math.sin(math.pi / 6) ** 2))


def test_a_limit_a_hundredth_of_a_degree_inside_of_a_swing_ends_the_first_one() -> None:
    inside = math.radians(60 - 0.01)
    low, high = -math.pi / 2 - inside, -math.pi / 6 + 1
    table = swing("", 12, f"limits: [{{drive: theta, min: {low!r}, max: {high!r}}}]").main
    assert PERIOD / 2 * 0.98 < table["time"][-1] < PERIOD / 2
    assert table["theta"][-1] == pytest.approx(low, abs=1e-10)


@pytest.mark.parametrize("swings", [1, pytest.param(10, marks=pytest.mark.nightly)])
def test_crossings_near_the_turning_points_of_a_swing_are_all_found(swings: int) -> None:
    inside = -math.pi / 2 - 0.9999 * math.pi / 3
    events = swing(f", events: {{far: {{of: theta, value: {inside!r}}}}}", swings * PERIOD).tables["events"]
    assert len(events["time"]) == 2 * swings
    assert events["direction"].tolist() == ["down", "up"] * swings
    middles = (events["time"][::2] + events["time"][1::2]) / 2
    assert middles == pytest.approx(PERIOD * (np.arange(swings) + 0.5), rel=1e-8)
    assert np.isnan(swing(f", events: {{far: {{of: theta, value: {-math.pi / 2 - 1.0001 * math.pi / 3!r}}}}}", swings)
                    .tables["events"]["time"]).all()  # fmt: skip


@pytest.mark.nightly
def test_a_follower_that_lifts_off_between_two_instants_is_said() -> None:
    # At a constant speed w it is pulled where g + s'' w^2 < 0, of s = 0.4 (cos(turn) - 0.9)^2 within 26 degrees.
    speed = 12.0
    result = run(f"""
mechanism:
  links:
    ground: {{O: [0, 0]}}
    disc: {{from: O, to: N, length: 0.04, mass: 1, center: [0, 0], inertia: 1e6}}
    valve: {{points: {{F: [0, 0]}}, mass: 1}}
  joints: {{stem: {{prismatic: [ground, valve], through: O, direction: 90 deg}}}}
  couplings:
    lift:
      set: stem.slide
      to: "0.04 + 0.4*max(0, cos(disc.angle - 1) - 0.9)**2"
      cam: {{link: disc, roller: F, radius: 0.008}}
  drives: {{cam: {{angle: disc}}}}
  sketch: {{N: [0.04, 0], F: [0, 0.04]}}
dynamics: {{gravity: [0, -{G}], forward: {{duration: 0.2, rows: 2, start: {{cam: 0, cam_velocity: {speed}}}}}}}
""")

    def pressed(time: float) -> float:
        turn = speed * time - 1
        return G + speed**2 * 0.8 * (math.sin(turn) ** 2 - math.cos(turn) * (math.cos(turn) - 0.9))

    (warning,) = result.warnings
    assert "lifts off between the instants" in str(warning)
    assert f"first at {brentq(pressed, 0.06, 1 / speed):.6g} s" in str(warning)
