"""`mechdesign kinematics`: columns, continuity, efforts, extremes, limits of motion, failures."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

SLIDER_CRANK = """
mechanism:
  links: {ground: {O: [0, 0]}, crank: [O, A, 1], rod: [A, B, 3], slider: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], point: B}}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 1], B: [2.8, 0]}
kinematics:
  sweep: {theta: {from: 0, to: 360, step: 15}}
  rates: {theta: 1 rad/s}
  outputs: [B.x, rod.angle]
  loads: [{at: B, force: [-7, 0]}]
"""

LINKAGE = """
mechanism:
  links: {ground: {O: [0, 0], D: [4, 0]}, crank: [O, A, 3], rod: [A, B, 3.5], rocker: [D, B, 3]}
  drives: {q: {angle: crank}}
  sketch: {A: [2, 2.2], B: [5, 3]}
kinematics:
  sweep: {q: {from: 0, to: 180, step: 1}}
"""

ARM = """
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 10], forearm: [E, P, 8]}
  drives: {t1: {angle: upper}, t2: {angle: forearm}}
  sketch: {E: [9, 4], P: [12, 11]}
kinematics:
  poses: [{t1: 30, t2: 60}, {P.x: 3, P.y: 12}]
  outputs: [P]
"""


def test_slider_crank_agrees_with_its_textbook_solution() -> None:
    # r = 1, l = 3 at 15 deg and 1 rad/s.
    table = mechdesign.kinematics(study_of(SLIDER_CRANK)).tables["motion"]
    row = int(np.flatnonzero(table["theta"] == 15)[0])
    assert table["B.x"][row] == pytest.approx(3.954740, abs=5e-7)
    assert table["B.x_velocity"][row] == pytest.approx(-0.342464, abs=5e-7)
    assert table["B.x_acceleration"][row] == pytest.approx(-1.258022, abs=5e-7)


def test_effort_balances_the_load_by_virtual_work() -> None:
    table = mechdesign.kinematics(study_of(SLIDER_CRANK)).tables["motion"]
    # Power in equals power out: effort * 1 rad/s + force * velocity = 0.
    assert table["theta_effort"] == pytest.approx(7 * table["B.x_velocity"], abs=1e-12)


def test_crank_angle_is_continuous_over_turns() -> None:
    study = study_of(SLIDER_CRANK, "kinematics.sweep.theta.to=1080", "kinematics.outputs=[crank.angle]")
    table = mechdesign.kinematics(study).tables["motion"]
    assert table["crank.angle"] == pytest.approx(table["theta"], abs=1e-9)


def test_extremes_are_the_stroke() -> None:
    table = mechdesign.kinematics(study_of(SLIDER_CRANK)).tables["extremes"]
    stroke = table["output"] == "B.x"
    assert table["range"][stroke] == pytest.approx(2)
    assert table["min_at"][stroke] == 180
    assert table["time_ratio"][stroke] == pytest.approx(1)


def test_extremes_between_the_poses_of_a_sweep() -> None:
    # Offset slider-crank, r = 40, l = 120, e = -20: stretched and folded positions by Pythagoras.
    study = study_of(
        """
mechanism:
  links: {ground: {O: [0, 0], G: [0, -20]}, crank: [O, A, 40], rod: [A, B, 120], slider: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], through: G, point: B}}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 40], B: [110, -20]}
kinematics: {sweep: {theta: {from: 0, to: 360, step: 7.2}}, outputs: [B, theta]}
"""
    )
    result = mechdesign.kinematics(study)
    assert result.tables["motion"].names == ("theta", "B.x", "B.y", "conditioning", "valid")
    table = result.tables["extremes"]
    far, near = np.sqrt(160**2 - 20**2), np.sqrt(80**2 - 20**2)
    stretched, folded = 360 - np.degrees(np.arcsin(20 / 160)), 180 - np.degrees(np.arcsin(20 / 80))
    row = {name: table[name][0] for name in table.names}
    assert (row["max"], row["min"]) == pytest.approx((far, near), rel=1e-12)
    assert (row["max_at"], row["min_at"]) == pytest.approx((stretched, folded), rel=1e-12)
    part = stretched - folded
    assert row["time_ratio"] == pytest.approx(part / (360 - part), rel=1e-11)
    # The slide does not move across the guide: rounding is no range, and there is no place of an extreme.
    assert table["range"][1] == 0
    assert np.isnan([table["min_at"][1], table["max_at"][1]]).all()
    assert np.isnan(table["time_ratio"][1])
    assert (table["min"][2], table["max"][2]) == (0, 360)


@pytest.mark.slow
@pytest.mark.parametrize("sweep", ["P.x: {from: -14, to: 14, step: STEP}", "t1: {from: 10, to: 80, step: STEP}"])
def test_extremes_of_an_inverse_motion_lie_between_its_poses(sweep: str) -> None:
    coarse, fine = (
        mechdesign.kinematics(
            study_of(ARM, f"kinematics={{sweep: {{{sweep.replace('STEP', step)}, P.y: 8}}, outputs: [E, P]}}")
        )
        for step in ("3.5", "0.002")
    )
    table, motion = coarse.tables["extremes"], coarse.tables["motion"]
    for name in ("min", "max"):
        assert table[name] == pytest.approx(fine.tables["extremes"][name], abs=1e-6)
    beyond = [table["range"][k] - np.ptp(motion[output]) for k, output in enumerate(table["output"])]
    assert max(beyond) > 1e-3


def test_limits_of_motion_are_found_to_the_last_digits() -> None:
    result = mechdesign.kinematics(study_of(LINKAGE))
    limits = result.tables["limits"]
    # The rocker's triangle is stretched where the distance of A and D is 6.5.
    exact = np.degrees(np.arccos((3**2 + 4**2 - 6.5**2) / (2 * 3 * 4)))
    assert limits["q"] == pytest.approx([exact], abs=1e-9)
    assert list(limits["kind"]) == ["dead centre"]
    assert set(limits["joint"][0].split()) == {"A", "B", "D"}
    motion = result.tables["motion"]
    assert np.array_equal(motion["valid"], motion["q"] <= exact)
    for name in ("B.x", "B.y", "A.y", "rod.angle"):
        assert np.isnan(motion[name][~motion["valid"]]).all()
    assert result.warnings
    assert result.counts["invalid"] == np.count_nonzero(motion["q"] > exact)


def test_stated_limits_end_the_motion_too() -> None:
    study = study_of(
        LINKAGE.replace("kinematics:", "  limits: [{angle: [ground, rocker], max: 100, min: 10}]\nkinematics:")
    )
    limits = mechdesign.kinematics(study).tables["limits"]
    assert "limit" in list(limits["kind"])
    at = limits["q"][list(limits["kind"]).index("limit")]
    angle = study.mechanism.solve({"q": at})["rocker.angle"]
    assert min(abs(angle - 100), abs(angle - 10)) < 1e-7


def test_jacobian_of_an_arm() -> None:
    table = mechdesign.kinematics(study_of(ARM)).tables["motion"]
    t1, t2 = np.radians(table["t1"]), np.radians(table["t2"])
    assert table["det_J"] == pytest.approx(80 * np.sin(t2 - t1))
    columns = np.array([[-10 * np.sin(t1), -8 * np.sin(t2)], [10 * np.cos(t1), 8 * np.cos(t2)]])
    values = np.linalg.svd(np.moveaxis(columns, -1, 0), compute_uv=False)
    assert table["inverse_condition"] == pytest.approx(values[:, 1] / values[:, 0])
    assert (table["P.x"][1], table["P.y"][1]) == pytest.approx((3, 12))


def test_a_jacobian_that_mixes_units_needs_a_length() -> None:
    mixed = ("kinematics.outputs=[P.x, forearm.angle]",)
    result = mechdesign.kinematics(study_of(ARM, *mixed))
    assert np.isnan(result.tables["motion"]["inverse_condition"]).all()
    assert any("characteristic_length" in warning for warning in map(str, result.warnings))
    given = mechdesign.kinematics(study_of(ARM, *mixed, "kinematics.characteristic_length=9"))
    assert np.isfinite(given.tables["motion"]["inverse_condition"]).all()
    assert not given.warnings


def test_a_listed_pose_that_fails_is_named_after_the_others_are_solved() -> None:
    result = mechdesign.kinematics(study_of(ARM, "kinematics.poses=[{t1: 30, t2: 60}, {P.x: 30, P.y: 12}]"))
    assert "P.x = 30" in result.failed
    assert list(result.tables["motion"]["valid"]) == [True, False]
    with pytest.raises(mechdesign.AssemblyError, match="no pose is valid"):
        mechdesign.kinematics(study_of(ARM, "kinematics.poses=[{P.x: 30, P.y: 12}]"))


def test_the_pose_that_was_asked_for_stands_in_its_row() -> None:
    study = study_of(
        ARM, "kinematics.poses=[{P.x: 30, P.y: 12}, {P.x: 3, P.y: 12}]", "kinematics.outputs=[forearm.angle]"
    )
    table = mechdesign.kinematics(study).tables["motion"]
    assert table["P.x"].tolist() == [30, 3]
    assert np.isnan(table["forearm.angle"][0])


def test_dead_centres_are_told_wherever_a_sweep_meets_one() -> None:
    """At 180 and 360 deg rounding leaves a slope of 1e-15."""
    study = study_of(
        """
mechanism:
  links: {ground: {O: [0, 0], G: [0, 0]}, crank: [O, A, 40], rod: [A, B, 120], slider: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], through: G, point: B}}
  drives: [crank]
  sketch: {A: [0, 40], B: [110, 0]}
kinematics: {sweep: {crank: {from: 0, to: 360, step: 5}}, outputs: [B.x]}
"""
    )
    result = mechdesign.kinematics(study)
    assert [*map(str, result.warnings)] == ["3 poses are at a dead centre: B.x stands still there, and det_J is 0"]
    assert result.tables["motion"].column("det_J").unit == "mm"
    angle = mechdesign.kinematics(study_of(study.text.decode(), "kinematics.outputs=[rod.angle]"))
    assert [*map(str, angle.warnings)] == ["2 poses are at a dead centre: rod.angle stands still there, and det_J is 0"]
    assert angle.tables["motion"].column("det_J").unit == ""
