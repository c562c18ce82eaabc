"""Limits of motion and change points, against closed forms."""

from __future__ import annotations

import time

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign


def limits(text: str, *overrides: str) -> mechdesign.Table:
    return mechdesign.kinematics(study_of(text, *overrides)).tables["limits"]


def warnings(text: str, *overrides: str) -> list[str]:
    return [*map(str, mechdesign.kinematics(study_of(text, *overrides)).warnings)]


def four_bar(a: float, b: float, c: float, d: float, sketch: str) -> str:
    return f"""
mechanism:
  links: {{ground: {{O: [0, 0], D: [{d}, 0]}}, crank: [O, A, {a}], rod: [A, B, {b}], rocker: [D, B, {c}]}}
  drives: [crank]
  sketch: {sketch}
kinematics: {{sweep: {{crank: {{from: 0, to: 360, step: 5}}}}, outputs: [B, rocker.angle]}}
"""


# The driven link oscillates between its folded and its stretched dead centre, on either side of the frame.
ROCKER = four_bar(3, 4, 2.5, 4, "{A: [1, 2.8], B: [4.3, 2.3]}")
# r > l: the crank turns no further than where the rod is perpendicular to the guide, sin(theta) = l/r = 1/2.
SLIDER = """
mechanism:
  links: {ground: {O: [0, 0]}, crank: [O, A, 2], rod: [A, B, 1], slider: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], through: O, point: B}}
  drives: [crank]
  sketch: {A: [2, 0.1], B: [2.9, 0]}
kinematics: {sweep: {crank: {from: 0, to: 90, step: 5}}, outputs: [B.x]}
"""
# A stated limit with three zeros: 10, 52.3 and 52.5 deg.
ISLAND = """
mechanism:
  links: {ground: {O: [0, 0]}, crank: [O, A, 2]}
  drives: [crank]
  measures: {m: "-(crank.angle - 10)*(crank.angle - 52.3)*(crank.angle - 52.5)"}
  limits: [{measure: m, min: 0}]
kinematics: {sweep: {crank: {from: 0, to: 90, step: 5}}}
"""
PARALLELOGRAM = """
mechanism:
  links: {ground: {O: [0, 0], D: [4, 0]}, crank: [O, A, 1], rod: [A, B, 4], rocker: [D, B, 1]}
  drives: [crank]
  sketch: {A: [0, 1], B: [4, 1]}
kinematics: {sweep: {crank: {from: 0, to: 360, step: 10}}}
"""
THREE_RPR = """
mechanism:
  links:
    ground: {A1: [0, 0], A2: [4, 0], A3: [2, 3.5]}
    platform: {B1: [0, 0], B2: [1, 0], B3: [0.5, 0.8]}
    l1: {from: A1, to: B1, telescopic: true}
    l2: {from: A2, to: B2, telescopic: true}
    l3: {from: A3, to: B3, telescopic: true}
  drives: [l1, l2, l3]
  sketch: {B1: [1.2, 1.3], B2: [2.2, 1.3], B3: [1.7, 2.1]}
kinematics: {sweep: {l1: {from: 1.6, to: 2, step: 0.05}, l2: 2.22, l3: 1.43}, outputs: [B1, B2, B3]}
"""


def by_cosine_law(a: float, d: float, reach: float) -> float:
    """Angle in degrees between sides a and d of the triangle whose third side is `reach`."""
    return float(np.degrees(np.arccos((a**2 + d**2 - reach**2) / (2 * a * d))))


def test_a_rocker_driven_from_its_pivot_ends_where_the_cosine_law_says() -> None:
    table = limits(ROCKER)
    folded, stretched = by_cosine_law(3, 4, 1.5), by_cosine_law(3, 4, 6.5)
    assert table["crank"] == pytest.approx([folded, stretched, 360 - stretched, 360 - folded], abs=1e-9)
    assert set(table["kind"]) == {"dead centre"}
    assert all(set(joint.split()) == {"A", "B", "D"} for joint in table["joint"])
    # In the pose there, rod and rocker lie in one line to the digits of rounding.
    a = 3 * np.exp(1j * np.radians(table["crank"]))
    b = table["B.x"] + 1j * table["B.y"]
    assert np.imag((b - a) * np.conj(b - 4)) == pytest.approx(np.zeros(4), abs=1e-12)
    assert np.angle(b - 4, deg=True) % 360 == pytest.approx(table["rocker.angle"] % 360, abs=1e-9)


@pytest.mark.slow
def test_limits_do_not_depend_on_the_direction_or_the_step() -> None:
    forth = limits(ROCKER)["crank"]
    assert limits(ROCKER, "kinematics.sweep.crank.step=0.7")["crank"] == pytest.approx(forth, abs=1e-9)
    back = ", ".join(str(angle) for angle in range(360, -1, -8))
    text = ROCKER.replace("sweep: {crank: {from: 0, to: 360, step: 5}}", f"path: {{crank: [{back}]}}")
    assert limits(text)["crank"] == pytest.approx(forth[::-1], abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("start", [0, 2.5])
def test_a_gap_narrower_than_a_step_is_found(start: float) -> None:
    # a + d = 3.9 is longer than b + c by 1e-5: the crank cannot pass 180 deg, where a pose lies or does not.
    text = four_bar(1, 2, 1.89999, 2.9, "{A: [1, 0.3], B: [2.3, 1.8]}")
    change = (f"kinematics.sweep.crank.from={start}", f"kinematics.sweep.crank.to={start + 355}")
    table = limits(text, *change)
    # 1 + cos from the half angle, without cancellation.
    half = np.sqrt((3.9**2 - 3.89999**2) / (4 * 1 * 2.9))
    exact = 180 - 2 * np.degrees(np.arcsin(half))
    assert table["crank"] == pytest.approx([exact, 360 - exact], abs=1e-9)
    hidden = [warning for warning in warnings(text, *change) if "between poses that are both valid" in warning]
    assert len(hidden) == (start > 0)


@pytest.mark.parametrize("step", [5, 30, 90])
def test_islands_and_several_limits_in_one_step_are_found(step: float) -> None:
    table = limits(ISLAND, f"kinematics.sweep.crank.step={step}")
    assert table["crank"] == pytest.approx([10, 52.3, 52.5], abs=1e-9)
    assert set(table["kind"]) == {"limit"}
    assert set(table["joint"]) == {"limits.0 min"}


def test_a_sweep_that_begins_in_a_gap_enters_the_motion() -> None:
    table = limits(ISLAND, "kinematics.sweep.crank.from=22.4", "kinematics.sweep.crank.step=10")
    assert table["crank"] == pytest.approx([52.3, 52.5], abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("begin", "end"), [(0, 90), (0, 30), (-30, 30), (-30, 0)])
def test_limits_at_poses_and_at_the_ends_of_the_sweep(begin: float, end: float) -> None:
    table = limits(SLIDER, f"kinematics.sweep.crank.from={begin}", f"kinematics.sweep.crank.to={end}")
    expected = [angle for angle in (-30, 30) if begin <= angle <= end]
    # At a pose the value is that of the pose itself.
    assert list(table["crank"]) == expected
    assert table["B.x"] == pytest.approx([np.sqrt(3)] * len(expected), abs=1e-12)


def test_a_sweep_between_a_drives_own_limits_ends_at_both() -> None:
    text = SLIDER.replace("  drives:", "  limits: [{drive: crank, min: -20, max: 25}]\n  drives:")
    table = limits(text, "kinematics.sweep.crank.from=-20", "kinematics.sweep.crank.to=25")
    assert list(table["crank"]) == [-20, 25]
    assert list(table["joint"]) == ["limits.0", "limits.0"]


def test_a_leg_whose_length_reaches_zero_is_named() -> None:
    # A slider-crank whose guide is a leg clamped to the ground; its end reaches the leg's foot at cos(crank) = 1/4.
    table = limits("""
mechanism:
  links:
    ground: {O: [0, 0], C: [1.5, 0]}
    crank: [C, A, 1]
    rod: [A, B, 2]
    ram: {from: O, to: B, telescopic: true}
  joints: {clamp: {fixed: [ground, ram], point: O, angle: 0}}
  drives: [crank]
  sketch: {A: [2.5, 0.1], B: [0.6, 0]}
kinematics: {sweep: {crank: {from: 0, to: 90, step: 4}}, outputs: [ram.length]}
""")
    exact = np.degrees(np.arccos(0.25))
    assert len(table) == 1
    assert table["crank"] == pytest.approx([exact], abs=1e-9)
    assert (table["kind"][0], table["joint"][0]) == ("leg at zero length", "ram")
    assert table["ram.length"] == pytest.approx([0], abs=1e-9)


@pytest.mark.slow
def test_a_leg_driven_to_zero_is_named() -> None:
    table = limits("""
mechanism:
  links: {ground: {O: [0, 0], D: [1, 0]}, leg: {from: O, to: B, telescopic: true}, arm: [D, B, 1]}
  drives: [leg]
  sketch: {B: [0.8, 0.9]}
kinematics: {sweep: {leg: {from: -1, to: 4, step: 0.3}}, outputs: [B]}
""")
    assert table["leg"] == pytest.approx([0, 2], abs=1e-9)
    assert list(table["kind"]) == ["leg at zero length", "dead centre"]
    assert table["joint"][0] == "leg"


@pytest.mark.slow
def test_slides_that_become_parallel_are_a_singularity() -> None:
    # A pin in a fixed slot y = 2 and in a slot along a lever: x = 2/tan(lever) is infinite at 180 deg.
    result = mechdesign.kinematics(
        study_of("""
mechanism:
  links: {ground: {O: [0, 0], G: [0, 2]}, pin: {Q: [0, 0], R: [1, 0]}, lever: [O, A, 1]}
  joints:
    across: {slot: ground, through: G, point: Q}
    along: {slot: lever, through: O, point: Q}
  drives: [lever, pin]
  sketch: {A: [0.5, 0.8], Q: [1, 2], R: [2, 2]}
kinematics: {sweep: {lever: {from: 10, to: 352, step: 9}, pin: 0}, outputs: [Q.x]}
""")
    )
    table = result.tables["limits"]
    assert result.counts["invalid"] == 0
    assert table["lever"] == pytest.approx([180], abs=1e-9)
    assert list(table["kind"]) == ["singularity"]
    assert np.isnan(table["Q.x"]).all()


@pytest.mark.slow
def test_a_platform_ends_where_its_three_legs_meet_in_a_point() -> None:
    table = limits(THREE_RPR)
    assert list(table["kind"]) == ["singularity"]
    assert set(table["joint"][0].split()) == {"A1", "A2", "A3", "B1", "B2", "B3"}
    feet = np.array([0, 4, 2 + 3.5j])
    tips = np.array([table[f"B{k}.x"][0] + 1j * table[f"B{k}.y"][0] for k in (1, 2, 3)])
    legs = tips - feet
    assert np.abs(legs) == pytest.approx([table["l1"][0], 2.22, 1.43], abs=1e-9)
    # The wrenches of three forces along the legs are dependent: their lines meet.
    unit = legs / np.abs(legs)
    wrenches = np.array([unit.real, unit.imag, np.imag(np.conj(feet) * unit)])
    assert np.linalg.det(wrenches) == pytest.approx(0, abs=1e-9)


@pytest.mark.slow
def test_change_points_at_poses_at_the_ends_and_between() -> None:
    def places(*overrides: str) -> list[str]:
        told = warnings(PARALLELOGRAM, *overrides)
        return [warning.split(" (")[0] for warning in told if warning.startswith("change point at")]

    every = [f"change point at crank = {angle} deg" for angle in (0, 180, 360)]
    assert places() == every
    assert places("kinematics.sweep.crank.step=7.2") == every
    assert places("kinematics.sweep.crank.from=-7", "kinematics.sweep.crank.to=357") == every[:2]
    assert not places("mechanism.branch=follow")


def test_a_change_point_of_two_groups_is_told_once() -> None:
    text = PARALLELOGRAM.replace("D: [4, 0]", "D: [4, 0], E: [8, 0]").replace(
        "rocker: [D, B, 1]", "rocker: [D, B, 1], rod2: [B, C, 4], rocker2: [E, C, 1]"
    )
    text = text.replace("B: [4, 1]", "B: [4, 1], C: [8, 1]")
    told = [w for w in warnings(text) if "crank = 180 deg (joints" in w]
    assert len(told) == 1
    assert "; " in told[0]


def test_a_crank_that_turns_fully_has_no_limits_and_nothing_to_warn_about() -> None:
    text = four_bar(1, 3.5, 3, 4, "{A: [0.5, 0.8], B: [3.3, 2.9]}")
    assert len(limits(text)) == 0
    assert warnings(text) == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_no_limit_of_a_random_six_bar_is_missed_or_invented(seed: int) -> None:
    """Steps of 10 deg find the same ends as poses every hundredth of a degree."""
    random = np.random.default_rng(seed)
    names = ("O", "D", "G", "A", "B", "E", "F")
    points = random.uniform(-3, 3, (7, 2)).round(2).tolist()
    at = dict(zip(names, points, strict=True))
    study = study_of(f"""
mechanism:
  links:
    ground: {{O: {at["O"]}, D: {at["D"]}, G: {at["G"]}}}
    crank: {{from: O, to: A}}
    rod: {{points: [A, B, E]}}
    rocker: {{from: D, to: B}}
    link: {{from: E, to: F}}
    swing: {{from: G, to: F}}
  drives: [crank]
  sketch: {{A: {at["A"]}, B: {at["B"]}, E: {at["E"]}, F: {at["F"]}}}
kinematics: {{sweep: {{crank: {{from: 1, to: 361, step: 10}}}}, outputs: [F]}}
""")
    fine = np.arange(100, 36101) / 100
    valid = study.mechanism.forward.solve([np.radians(fine)]).valid
    changes = np.flatnonzero(valid[1:] != valid[:-1])
    found = mechdesign.kinematics(study).tables["limits"]["crank"]
    assert found == pytest.approx((fine[changes] + fine[changes + 1]) / 2, abs=0.0051)


@pytest.mark.parametrize("sweep", ["{from: 0, to: 7.5e7, number: 7}", "{from: 0, to: 1e20, number: 7}"])
def test_steps_of_many_turns_are_told_instead_of_searched(sweep: str) -> None:
    """Each turn has two limits: steps of a million turns would take hours."""
    begun = time.process_time()
    told = warnings(ROCKER.replace("{from: 0, to: 360, step: 5}", sweep))
    assert time.process_time() - begun < 5
    assert "the steps of crank are too long for the motion between the poses" in " ".join(told)


def test_beyond_the_end_of_its_motion_a_pose_is_nan_without_a_warning_of_numpy() -> None:
    """The rod of length 1 reaches the guide from a crank of length 2 up to 30 deg, there as 2 cos(30 deg)."""
    pose = study_of(SLIDER).mechanism.solve({"crank": [0, 30, 31, 90]})
    assert pose.valid.tolist() == [True, True, False, False]
    assert pose["B.x"] == pytest.approx([3, 3**0.5, np.nan, np.nan], abs=1e-7, nan_ok=True)
