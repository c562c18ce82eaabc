"""Angles are continuous over turns, however coarse the steps of a sweep or a path."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

FOUR_BAR = """
mechanism:
  links:
    ground: {O: [0, 0], D: [100, 0]}
    crank: [O, A, 30]
    rod: {from: A, to: B, length: 90, points: {C: [40, 30]}}
    rocker: [D, B, 60]
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
  measures: {between: {angle: [rocker, crank]}}
kinematics:
  sweep: {theta: {from: -30, to: 1770, step: STEP}}
  outputs: [crank.angle, rod.angle, rocker.angle, between]
"""
# Both cranks of a drag link turn fully; the second by far more than the first where it hurries.
DRAG_LINK = """
mechanism:
  links: {ground: {O: [0, 0], D: [1, 0]}, crank: [O, A, 3], rod: [A, B, 2.2], follower: [D, B, 3]}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 3], B: [1.5, 4]}
kinematics:
  sweep: {theta: {from: 0, to: 1440, step: STEP}}
  outputs: [rod.angle, follower.angle]
"""
ARM = """
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 10], fore: [E, P, 8]}
  drives: [upper, fore]
  sketch: {E: [8, 5], P: [13, 11]}
kinematics:
"""


def motion(text: str, *overrides: str) -> dict[str, np.ndarray]:
    table = mechdesign.kinematics(study_of(text, *overrides)).tables["motion"]
    return {name: table[name] for name in table.names}


@pytest.mark.nightly
@pytest.mark.parametrize("step", [60, 90, 150, 180, 200, 300, 360, 450, 600])
@pytest.mark.parametrize("text", [FOUR_BAR, DRAG_LINK])
def test_the_step_of_a_sweep_does_not_matter(text: str, step: int) -> None:
    fine = motion(text.replace("STEP", "5"))
    coarse = motion(text.replace("STEP", str(step)))
    rows = np.searchsorted(fine["theta"], coarse["theta"])
    for name in ("crank.angle", "rod.angle", "rocker.angle", "between", "follower.angle"):
        if name in fine:
            assert coarse[name] == pytest.approx(fine[name][rows], abs=1e-9)
    turning = "crank.angle" if "crank.angle" in fine else "follower.angle"
    # Over five turns, or four.
    assert fine[turning][-1] - fine[turning][0] == pytest.approx(fine["theta"][-1] - fine["theta"][0], abs=1e-9)


def test_the_last_axis_of_a_grid_is_continuous_too() -> None:
    sweep = "kinematics.sweep={fore: {from: 0, to: 90, step: 45}, upper: {from: 0, to: 720, step: 240}}"
    found = motion(ARM, sweep, "kinematics.outputs=[upper.angle, fore.angle]")
    assert found["upper.angle"] == pytest.approx(found["upper"])
    assert found["fore.angle"] == pytest.approx(found["fore"])


def test_drives_of_an_inverse_problem_are_continuous_along_a_coarse_path() -> None:
    # Round the shoulder twice, four points a turn: the upper arm follows by right angles.
    corners = [[3, 12], [-12, 3], [-3, -12], [12, -3]] * 2 + [[3, 12]]
    found = motion(ARM, f"kinematics.path={{P: {corners}}}")
    assert np.diff(found["upper"]) == pytest.approx(90, abs=1e-9)
    assert np.diff(found["fore"]) == pytest.approx(90, abs=1e-9)
    assert found["upper"][-1] - found["upper"][0] == pytest.approx(720, abs=1e-9)


def test_a_leg_that_swings_over_in_one_step_goes_the_way_it_goes() -> None:
    # A slider far beyond both ends of its guide: the rod turns from -177 to -3 degrees, by way of -90.
    study = """
mechanism:
  links: {ground: {O: [0, 0], G: [0, 1]}, leg: {from: O, to: P, telescopic: true}, slider: {P: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], through: G, point: P}}
  drives: {x: {slide: guide}}
  sketch: {P: [1, 1]}
kinematics: {sweep: {x: {from: -20, to: 20, number: 2}}, outputs: [leg.angle]}
"""
    angle = motion(study)["leg.angle"]
    assert angle[1] - angle[0] == pytest.approx(-180 + 2 * np.degrees(np.arctan2(1, 20)), abs=1e-9)
    below = motion(study.replace("G: [0, 1]", "G: [0, -1]"))["leg.angle"]
    assert below[1] - below[0] == pytest.approx(180 - 2 * np.degrees(np.arctan2(1, 20)), abs=1e-9)


def test_poses_that_fail_are_stepped_over() -> None:
    study = """
mechanism:
  links: {ground: {O: [0, 0], D: [4, 0]}, crank: [O, A, 3], rod: [A, B, 3.5], rocker: [D, B, 3]}
  drives: {q: {angle: crank}}
  sketch: {A: [2, 2.2], B: [5, 3]}
kinematics: {sweep: {q: {from: 0, to: 720, step: 40}}, outputs: [crank.angle, B.x]}
"""
    found = motion(study)
    valid = found["valid"]
    assert not valid.all()
    assert np.isnan(found["crank.angle"][~valid]).all()
    assert (found["crank.angle"] - found["q"])[valid] / 360 == pytest.approx(
        np.round((found["crank.angle"] - found["q"])[valid] / 360), abs=1e-12
    )


def test_listed_poses_keep_their_own_turn() -> None:
    found = motion(
        FOUR_BAR.replace("STEP", "5"), "kinematics={poses: [{theta: 0}, {theta: 540}], outputs: [crank.angle]}"
    )
    assert found["crank.angle"] == pytest.approx([0, 180])
