"""Couplings of links that turn fully and are not driven: whole turns count along every motion, at any step."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of
from scipy.interpolate import CubicSpline

import mechdesign

# Whitworth's slotted arm follows the pin of a crank about a pivot inside of its circle, and a wheel follows the arm.
WHITWORTH = """
mechanism:
  links:
    ground: {O: [0, 0], C: [%(c)s, 0], W: [140, 0]}
    crank: [O, A, 100]
    arm: [C, Q, 250]
    wheel: [W, P, 20]
  joints: {slot: {slot: arm, through: C, direction: 0, point: A}}
  drives: {theta: {angle: %(drive)s}}
  couplings: {gear: {set: wheel.angle, %(law)s}}
  sketch: {A: [0, 100], Q: [%(c)s, 250]}
kinematics:
  outputs: [P, wheel.angle, arm.angle, crank.angle]
  sweep: {%(swept)s: {from: %(begin)s, to: %(end)s, step: %(step)s}}
"""


def whitworth(
    begin: float, end: float, step: float, *, c: float = 40.0, law: str = "to: -0.5*arm.angle", drive: str = "crank",
    swept: str = "theta",
) -> str:  # fmt: skip
    return WHITWORTH % locals()


def arm_of(crank: np.ndarray, radius: float, pivot: float) -> np.ndarray:
    """Angle of an arm about a pivot inside of a crank's circle, on the axis; less than half a turn from the crank's."""
    pin = radius * np.exp(1j * np.radians(crank))
    return crank + np.degrees(np.angle((pin - pivot) * np.exp(-1j * np.radians(crank))))


@pytest.mark.parametrize("step", [1, 5, 45, 120])
@pytest.mark.parametrize(
    ("begin", "end", "c", "ratio"),
    [(0, 360, 40, -0.5), (720, -720, 40, -0.5), (3600, 4320, -70, 0.3), (-90, 990, 99, 1.7)],
)
def test_a_wheel_counts_the_turns_of_a_slotted_arm(
    begin: float, end: float, c: float, ratio: float, step: float
) -> None:  # fmt: skip
    step = step if end > begin else -step
    motion = mechdesign.kinematics(study_of(whitworth(begin, end, step, c=c, law=f"to: {ratio}*arm.angle"))).tables[
        "motion"
    ]
    wheel = ratio * arm_of(motion["theta"], 100, c)
    assert motion["wheel.angle"] == pytest.approx(wheel, abs=1e-9)
    assert motion["P.y"] == pytest.approx(20 * np.sin(np.radians(wheel)), abs=1e-9)


@pytest.mark.parametrize(("begin", "step"), [(-1000, 45), (1000, -120), (300, 5)])
@pytest.mark.parametrize(
    ("swept", "drive", "law", "ratio"),
    [
        ("arm.angle", "crank", "to: -0.5*arm.angle", -0.5), ("wheel.angle", "crank", "to: 0.3*arm.angle", 0.3),
        ("crank.angle", "arm", "to: 0.3*crank.angle", 0.0), ("theta", "arm", "to: 0.3*crank.angle", 0.0),
    ],
)  # fmt: skip
def test_turns_count_in_sweeps_of_any_coordinate(
    begin: float, step: float, swept: str, drive: str, law: str, ratio: float
) -> None:  # fmt: skip
    study = study_of(whitworth(begin, begin + 12 * step, step, swept=swept, drive=drive, law=law))
    motion = mechdesign.kinematics(study).tables["motion"]
    followed = motion["arm.angle"] if ratio else motion["crank.angle"]
    assert motion["wheel.angle"] == pytest.approx((ratio or 0.3) * followed, abs=1e-9)
    # Whole turns aside, which are those of the first pose, both go on without a jump.
    assert np.ptp(motion["arm.angle"] - arm_of(motion["crank.angle"], 100, 40)) < 1e-9


def test_expressions_and_tables_count_turns() -> None:
    rows = [(x, 40 * float(np.sin(x / 300)) + x / 9) for x in range(-400, 1500, 50)]
    table = "[" + ", ".join(f"[{x}, {y!r}]" for x, y in rows) + "]"
    spline = CubicSpline(*np.transpose(rows))
    for law, value in (
        (f"of: arm.angle, table: {table}", spline),
        ("to: 90*sin(arm.angle/3) + arm.angle/7", lambda x: 90 * np.sin(np.radians(x / 3)) + x / 7),
    ):
        motion = mechdesign.kinematics(study_of(whitworth(-200, 1240, 120, law=law))).tables["motion"]
        assert motion["wheel.angle"] == pytest.approx(value(arm_of(motion["theta"], 100, 40)), abs=1e-9)


# The pin of the wheel moves a second arm, which a second wheel follows.
CHAIN = """
mechanism:
  links:
    ground: {O: [0, 0], C: [40, 0], W: [340, 0], D: [325, 0], V: [640, 0]}
    crank: [O, A, 100]
    arm: [C, Q, 250]
    wheel: [W, P, 30]
    second: [D, R, 90]
    last: [V, S, 25]
  joints:
    slot: {slot: arm, through: C, direction: 0, point: A}
    other: {slot: second, through: D, direction: 0, point: P}
  drives: {theta: {angle: crank}}
  couplings: {one: {set: wheel.angle, to: %r*arm.angle}, two: {set: last.angle, to: 3*second.angle}}
  sketch: {A: [0, 100], Q: [-50, 220], P: %r, R: %r}
kinematics: {outputs: [S, second.angle], sweep: {theta: {from: %r, to: %r, step: %r}}}
"""


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [-0.5, 7.3])
@pytest.mark.parametrize(("begin", "step"), [(0, 5), (-1440, 120), (1440, -45)])
def test_a_coupling_that_follows_by_a_coupling_counts_turns(ratio: float, begin: float, step: float) -> None:
    drawn = ratio * arm_of(np.array([90.0]), 100, 40)
    pin = 340 + 30 * np.exp(1j * np.radians(drawn[0]))
    tip = 325 + 90 * (pin - 325) / abs(pin - 325)
    places = ([float(place.real), float(place.imag)] for place in (pin, tip))
    study = study_of(CHAIN % (ratio, *places, begin, begin + 16 * step, step))
    motion = mechdesign.kinematics(study).tables["motion"]
    # In the sketch angles lie between -180 and 180 deg.
    at_sketch = arm_of(drawn, 30, -15)
    turns = 360 * np.round(at_sketch / 360)
    second = arm_of(ratio * arm_of(motion["theta"], 100, 40), 30, -15) - turns
    assert motion["second.angle"] == pytest.approx(second, abs=1e-7)
    assert motion["S.y"] == pytest.approx(25 * np.sin(np.radians(3 * second)), abs=1e-7)


@pytest.mark.parametrize(
    "path",
    [
        "{circle: {center: [20, 0], radius: 150}, points: 5}", "{circle: {center: [0, 10], radius: 150}, points: 73}",
        "[[100, 100], [-100, 100], [-100, -100], [100, -100], [100, 100], [-100, 100], [-100, -100], [100, -99]]",
    ],
)  # fmt: skip
def test_a_path_round_a_pivot_counts_the_turns_of_the_link_on_it(path: str) -> None:
    study = study_of(f"""
mechanism:
  links: {{ground: {{O: [0, 0], W: [300, 0]}}, one: [O, B, 100], two: [B, C, 80], wheel: [W, P, 20]}}
  drives: {{first: {{angle: one}}, second: {{angle: two, from: one}}}}
  couplings: {{belt: {{set: wheel.angle, to: 0.5*one.angle}}}}
  sketch: {{B: [0, 100], C: [70, 140]}}
kinematics: {{path: {{C: {path}}}, outputs: [C, one.angle, wheel.angle]}}
""")
    motion = mechdesign.kinematics(study).tables["motion"]
    place = motion["C.x"] + 1j * motion["C.y"]
    reach = np.abs(place)
    one = np.unwrap(np.angle(place)) + np.arccos((100**2 + reach**2 - 80**2) / (200 * reach))
    one -= 2 * np.pi * np.round((one[0] - np.radians(motion["one.angle"][0])) / (2 * np.pi))
    assert motion["one.angle"] == pytest.approx(np.degrees(one), abs=1e-9)
    assert motion["wheel.angle"] == pytest.approx(np.degrees(one) / 2, abs=1e-9)
    assert abs(motion["one.angle"][0]) < 180


@pytest.mark.slow
def test_extremes_between_poses_and_efforts_are_those_of_the_turns() -> None:
    text = whitworth(0, 720, 120)
    extremes = mechdesign.kinematics(study_of(text)).tables["extremes"]
    rows = list(extremes["output"])
    angle = arm_of(np.linspace(0, 720, 100_001), 100, 40)
    assert extremes["max"][rows.index("P.y")] == pytest.approx(np.sin(np.radians(-0.5 * angle)).max() * 20, abs=1e-6)
    loads = "dynamics: {loads: [{at: P, force: [10, 0]}], sweep: {theta: {from: 0, to: 720, step: 120}}}"
    effort = mechdesign.dynamics(study_of(text + loads)).tables["dynamics"]

    def work(theta: np.ndarray) -> np.ndarray:
        return 200 * np.cos(np.radians(-0.5 * arm_of(theta, 100, 40)))

    slope = np.degrees(work(effort["theta"] + 1e-3) - work(effort["theta"] - 1e-3)) / 2e-3
    assert effort["theta_effort"] == pytest.approx(-slope, abs=1e-4)


@pytest.mark.slow
def test_made_mechanisms_count_the_turns_of_the_nominal_pose() -> None:
    study = study_of(
        whitworth(0, 720, 5)
        + """
reliability:
  sweep: {theta: {from: 0, to: 720, step: 90}}
  outputs: [P]
  dimensions: {crank.length: 0.01}
  methods: [analytic, monte_carlo]
  samples: 1000
"""
    )
    moments = mechdesign.reliability(study).tables["moments"]
    place = 140 + 20 * np.exp(-0.5j * np.radians(arm_of(moments["theta"], 100, 40)))
    nominal = np.where(moments["output"] == "P.x", place.real, place.imag)
    assert moments["nominal"] == pytest.approx(nominal, abs=1e-9)
    assert moments["mean"] == pytest.approx(nominal, abs=1e-3)
