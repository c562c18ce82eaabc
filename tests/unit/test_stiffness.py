"""The stiffness question: tables, awkward poses, errors."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.stiffness import (
    ARM,
    FIVE_BAR,
    MEETING_STRUTS,
    ask_stiffness,
    matrix,
)
from helpers.studies import study_of

import mechdesign


def test_five_bar_with_rigid_links_on_its_motors() -> None:
    result = ask_stiffness(FIVE_BAR)
    expected = np.array([[18769.834, -361.013], [-361.013, 13431.882]])
    assert matrix(result, "K") == pytest.approx(expected, abs=5e-4)
    assert matrix(result, "K") @ matrix(result, "C") == pytest.approx(np.eye(2), abs=1e-12)
    table = result.tables["stiffness"]
    assert "k_phi" not in table
    assert "K33" not in table
    principal = 1 / np.linalg.eigvalsh(matrix(result, "C"))
    assert [table["k_max"][0], table["k_min"][0]] == pytest.approx(principal, rel=1e-12)


def test_the_same_answer_in_millimetres() -> None:
    """K in N/m and N/mm; the motors in N m/rad and N mm/rad."""
    metres = ask_stiffness(FIVE_BAR)
    text = FIVE_BAR.replace("length: m,", "length: mm,").replace("actuators: {a1: 1000, a2: 1000}",
                            "actuators: {a1: 1000 N*m/rad, a2: 1e6}")  # fmt: skip
    for metre, millimetre in (("0.15", "150"), ("0.25", "250"), ("0.40", "400"), ("0.3,", "300,"), ("0.2]", "200]"),
                              ("0.05", "50"), ("0.45", "450")):  # fmt: skip
        text = text.replace(metre, millimetre)
    assert matrix(ask_stiffness(text), "K") * 1000 == pytest.approx(matrix(metres, "K"), rel=1e-10)


def test_pin_of_one_link_is_asked_with_the_link_free_to_turn() -> None:
    whole = ask_stiffness(ARM)
    part = ask_stiffness(ARM.replace("  link: lower\n", ""))
    assert matrix(part, "C") == pytest.approx(matrix(whole, "C")[:2, :2], rel=1e-12)
    assert matrix(part, "K") == pytest.approx(np.linalg.inv(matrix(whole, "C")[:2, :2]), rel=1e-9)


def test_under_constrained_pose_reports_its_free_twist() -> None:
    """A platform whose three struts meet: it turns about their common point."""
    text = (
        MEETING_STRUTS
        + """\
  poses: [{P.x: 0, P.y: 1, platform.angle: 0}, {P.x: 0.1, P.y: 1, platform.angle: 0}]
"""
    )
    result = ask_stiffness(text)
    table = result.tables["stiffness"]
    assert table["rank"].tolist() == [2, 3]
    assert [table[f"free_{axis}"][0] for axis in ("x", "y", "phi")] == pytest.approx([0, 0, 1], abs=1e-12)
    assert np.isnan([table[f"free_{axis}"][1] for axis in ("x", "y", "phi")]).all()
    assert np.isfinite(matrix(result, "K")).all()
    assert np.isnan(matrix(result, "C")).all()
    assert np.isfinite(matrix(result, "C", 1)).all()
    assert any("under-constrained" in warning for warning in map(str, result.warnings))
    assert table["valid"].all()


def test_deflections_are_compliance_times_loads() -> None:
    result = ask_stiffness(ARM, "stiffness.loads=[[10, -20, 3], [0, 5, 0]]")
    table = result.tables["deflections"]
    assert len(table) == 2
    moved = matrix(result, "C") @ [10, -20, 3]
    assert [table[name][0] for name in ("dx", "dy", "dphi")] == pytest.approx(moved)
    assert table["fy"].tolist() == [-20, 5]


def test_listed_pose_that_fails_is_told_after_the_others() -> None:
    result = ask_stiffness(FIVE_BAR, "stiffness.poses=[{P.x: 0.05, P.y: 0.45}, {P.x: 5, P.y: 5}]")
    assert "P.x = 5" in result.failed
    assert result.tables["stiffness"]["valid"].tolist() == [True, False]
    assert np.isnan(result.tables["stiffness"]["K11"][1])
    assert len(result.tables["springs"]) == 2
    with pytest.raises(mechdesign.AssemblyError, match="no pose"):
        ask_stiffness(FIVE_BAR, "stiffness.poses=[{P.x: 5, P.y: 5}]")


def test_sweep_with_unreachable_poses_is_a_table_with_gaps() -> None:
    text = FIVE_BAR.replace("poses: [{P.x: 0.05, P.y: 0.45}]", "sweep: {P.x: 0, P.y: {from: 0.3, to: 0.9, step: 0.1}}")
    result = ask_stiffness(text)
    assert not result.failed
    assert len(result.tables["stiffness"]) == 7
    assert result.counts["invalid"] == np.isnan(result.tables["stiffness"]["k_x"]).sum() > 0


def test_result_does_not_depend_on_jobs_or_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    text = FIVE_BAR.replace(
        "poses: [{P.x: 0.05, P.y: 0.45}]", "sweep: {P.x: {from: -0.1, to: 0.1, number: 40}, P.y: 0.4}"
    )
    whole = ask_stiffness(text).tables["stiffness"]
    monkeypatch.setattr("mechdesign.questions.stiffness.analysis.CHUNK", 7)
    parts = mechdesign.stiffness(study_of(text), jobs=2).tables["stiffness"]
    for name in whole.names:
        assert whole[name].tobytes() == parts[name].tobytes()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (FIVE_BAR.split("stiffness:")[0], "stiffness: is missing: say which point"),
        (FIVE_BAR.replace("at: P", "at: O1"), "^<study>:13:7: stiffness.at: point 'O1' belongs to the ground"),
    ],
)
def test_what_has_no_stiffness_is_told(text: str, said: str) -> None:
    with pytest.raises(mechdesign.StudyError, match=said):
        ask_stiffness(text)


def test_motor_and_transmission_in_series() -> None:
    """Compliances of what is in series add up, whatever units they are given in."""
    series = ask_stiffness(FIVE_BAR, "stiffness.actuators={a1: [3000, 1.5e6 N*mm/rad], a2: [2000, 2000]}")
    assert matrix(series, "K") == pytest.approx(matrix(ask_stiffness(FIVE_BAR), "K"), rel=1e-12)


def test_a_deflection_that_is_not_small_is_told() -> None:
    """A strip that bends to F L^3 / 3 E I: 10 N move its tip by 0.02 of its length, 100 N by 0.2."""
    strip = """
mechanism:
  links: {ground: {O: [0, 0]}, arm: [O, P, 1000]}
  drives: [arm]
  sketch: {P: [1000, 0]}
stiffness:
  link: arm
  at: P
  sections: {strip: {E: 200 GPa, width: 10, height: 10}}
  elastic: {arm: strip}
  poses: [{arm: 0}, {arm: 90}]
  loads: [[0, -10, 0], [0, -100, 0]]
"""
    (large,) = (
        warning for warning in mechdesign.stiffness(mechdesign.load(text=strip)).warnings if warning.kind == "suspect"
    )
    assert "under load 2 the asked point moves by 0.2 times the mechanism's size" in str(large)
    assert (large.table, large.row, large.pose) == ("deflections", 1, "arm = 0 deg")
    small = mechdesign.stiffness(mechdesign.load(text=strip, overrides=["stiffness.loads=[[0, -10, 0]]"]))
    assert all(warning.kind != "suspect" for warning in small.warnings)
