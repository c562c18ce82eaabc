"""Targets: function generation, values a pose, paths with and without timing, and the errors they give."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

FOUR_BAR = """\
mechanism:
  parameters: {k: 0.6}
  links:
    ground: {O: [0, 0], D: [100, 0]}
    crank: [O, A, 30]
    rod: {from: A, to: B, length: 90, points: {C: [40, 30]}}
    rocker: [D, B, 60]
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
  measures: {mu: {angle: [rod, rocker]}, gap: {distance: [O, B]}, half: gap/2}
  targets: TARGETS
kinematics:
  sweep: {theta: {from: 0, to: 360, step: 10}}
"""
ARM = """
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 10], fore: [E, P, 8]}
  drives: [upper, fore]
  sketch: {E: [8, 5], P: [13, 11]}
  targets: TARGETS
"""


def motion(targets: str, *overrides: str, text: str = FOUR_BAR) -> mechdesign.Table:
    return mechdesign.kinematics(study_of(text.replace("TARGETS", targets), *overrides)).tables["motion"]


def test_a_function_of_the_drive_and_parameters() -> None:
    table = motion('{rocker.angle: "67 + k*(theta - 40)"}', "kinematics.sweep.theta.to=180")
    wanted = 67 + 0.6 * (table["theta"] - 40)
    assert table["rocker.angle_error"] == pytest.approx(table["rocker.angle"] - wanted, abs=1e-12)


@pytest.mark.slow
def test_angle_errors_are_wrapped() -> None:
    table = motion('{crank.angle: "theta + 200"}', "kinematics.sweep.theta.to=1080")
    assert table["crank.angle_error"] == pytest.approx(160)
    assert motion('{crank.angle: "theta + 180"}')["crank.angle_error"] == pytest.approx(180)


@pytest.mark.slow
def test_functions_of_other_coordinates_see_them_continuous() -> None:
    table = motion('{rod.angle: "crank.angle**2/1000"}', "kinematics.sweep.theta.to=720")
    turn = (table["rod.angle"] - table["theta"] ** 2 / 1000 - table["rod.angle_error"]) / 360
    assert turn == pytest.approx(np.round(turn), abs=1e-9)


def test_trigonometry_is_in_the_studys_unit() -> None:
    table = motion('{B.x: "70 + 5*sin(theta)"}')
    assert table["B.x_error"] == pytest.approx(table["B.x"] - 70 - 5 * np.sin(np.radians(table["theta"])), abs=1e-12)


def test_measures_have_targets() -> None:
    table = motion("{mu: 90 deg, gap: 0.09 m, half: 45}")
    assert table["mu_error"] == pytest.approx(table["mu"] - 90)
    assert table["half_error"] == pytest.approx(table["gap_error"] / 2)


def test_what_has_a_target_is_an_output_but_not_of_the_jacobian() -> None:
    result = mechdesign.kinematics(
        study_of(FOUR_BAR.replace("TARGETS", "{C.y: 40}"), "kinematics.outputs=[rocker.angle]")
    )
    assert result.tables["jacobian"].names == ("theta", "rocker.angle_by_theta", "valid")
    names = result.tables["motion"].names
    assert names == ("theta", "rocker.angle", "C.y", "C.y_error", "det_J", "inverse_condition", "conditioning", "valid")


@pytest.mark.slow
def test_a_path_with_as_many_rows_as_poses_is_prescribed_timing() -> None:
    free = motion("{}")
    rows = [[round(float(x), 3), round(float(y), 3) + 1] for x, y in zip(free["C.x"], free["C.y"], strict=True)]
    table = motion(f"{{C: {rows}}}")
    assert table["C.x_error"] == pytest.approx(0, abs=6e-4)
    assert table["C.y_error"] == pytest.approx(-1, abs=6e-4)
    assert table["C_error"] == pytest.approx(np.hypot(table["C.x_error"], table["C.y_error"]))


@pytest.mark.slow
def test_a_path_of_its_own_is_met_at_its_nearest_point_not_at_a_corner() -> None:
    table = motion("{C: [[-100, 50], [200, 50]]}")
    assert table["C.x_error"] == pytest.approx(0, abs=1e-12)
    assert table["C.y_error"] == pytest.approx(table["C.y"] - 50)
    assert table["C_error"] == pytest.approx(abs(table["C.y"] - 50))


def test_three_columns_are_the_drive_and_the_point() -> None:
    table = motion("{C: [[360, 36, 0], [0, 0, 72]]}")  # in any order
    assert table["C.x_error"] == pytest.approx(table["C.x"] - table["theta"] / 10, abs=1e-12)
    assert table["C.y_error"] == pytest.approx(table["C.y"] - 72 + table["theta"] / 5, abs=1e-12)


def test_a_table_over_one_turn_serves_all_turns_and_nothing_outside_it() -> None:
    targets = "{B.x: [[0, 70], [90, 79], [180, 70]]}"
    result = mechdesign.kinematics(
        study_of(FOUR_BAR.replace("TARGETS", targets), "kinematics.sweep.theta={from: -360, to: 0, step: 90}")
    )
    table = result.tables["motion"]
    wanted = np.array([70, 79, 70, np.nan, 70])
    assert table["B.x_error"] == pytest.approx(table["B.x"] - wanted, nan_ok=True)
    assert any(
        "1 of 5 poses" in w and "B.x_error is nan; the first: theta = -90 deg" in w for w in map(str, result.warnings)
    )
    assert np.isfinite(result.tables["targets"]["rms"]).all()


def test_several_drives_are_interpolated_over_the_one_that_is_swept() -> None:
    sweep = "kinematics.sweep={fore: {from: 0, to: 90, step: 30}, upper: 20}"
    table = motion("{P: [[0, 0, 0], [90, 9, 18]]}", sweep, text=ARM)
    assert table["P.x_error"] == pytest.approx(table["P.x"] - table["fore"] / 10)
    assert table["P.y_error"] == pytest.approx(table["P.y"] - table["fore"] / 5)


def test_files_stand_beside_the_study(tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("theta,x,y\n0,1,2\n360,1,2\n")
    (tmp_path / "values.csv").write_text("\n".join(["y", *["7"] * 37]))
    targets = "{C: {file: path.csv}, B.y: values.csv}"
    (tmp_path / "study.yaml").write_text(FOUR_BAR.replace("TARGETS", targets))
    table = mechdesign.kinematics(mechdesign.load(tmp_path / "study.yaml")).tables["motion"]
    assert table["C.x_error"] == pytest.approx(table["C.x"] - 1)
    assert table["B.y_error"] == pytest.approx(table["B.y"] - 7)


@pytest.mark.slow
def test_errors_of_a_turn_are_those_of_the_curve() -> None:
    targets = '{rocker.angle: "100", C: [[0, 50], [60, 50]]}'
    table = mechdesign.kinematics(study_of(FOUR_BAR.replace("TARGETS", targets), "kinematics.sweep.theta.step=30"))
    fine = motion(targets, "kinematics.sweep.theta.step=0.1")
    table = table.tables["targets"]
    assert list(table["output"]) == ["rocker.angle", "C.x", "C.y", "C"]
    for k, output in enumerate(table["output"]):
        # The last pose of a turn is its first. Sums of steps are as good as the corners where the path's ends are near.
        error = fine[f"{output}_error"][:-1]
        assert table["rms"][k] == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-6)
        assert table["mean"][k] == pytest.approx(np.mean(error), rel=1e-6)
        assert table["max_abs"][k] == pytest.approx(np.max(np.abs(error)), rel=1e-5)
        assert table["at"][k] == pytest.approx(fine["theta"][np.argmax(np.abs(error))], abs=0.1)


def test_errors_of_listed_poses_are_those_of_the_poses() -> None:
    poses = "{poses: [{theta: 0}, {theta: 90}, {theta: 180}, {theta: 270}]}"
    result = mechdesign.kinematics(study_of(FOUR_BAR.replace("TARGETS", "{A.x: 0}"), f"kinematics={poses}"))
    (rms, *_), (largest, *_) = result.tables["targets"]["rms"], result.tables["targets"]["max_abs"]
    assert (rms, largest) == pytest.approx((np.sqrt(450), 30))


def test_the_root_mean_square_over_a_turn_counts_its_start_once() -> None:
    targets = mechdesign.kinematics(study_of(FOUR_BAR.replace("TARGETS", "{A.x: 0}"))).tables["targets"]
    assert targets["rms"][0] == pytest.approx(30 / np.sqrt(2), rel=1e-12)
    assert targets["mean"][0] == pytest.approx(0, abs=1e-12)


def test_errors_count_up_to_a_limit() -> None:
    study = study_of(
        FOUR_BAR.replace("TARGETS", "{A.y: 0}").replace(
            "kinematics:", "  limits: [{drive: theta, min: 0, max: 85}]\nkinematics:"
        )
    )
    table = mechdesign.kinematics(study).tables["targets"]
    assert table["max_abs"][0] == pytest.approx(30 * np.sin(np.radians(85)), rel=1e-9)


@pytest.mark.slow
def test_extremes_of_errors_lie_between_the_poses() -> None:
    targets = '{B.x: "70 + 5*sin(theta)", C: [[0, 50], [20, 60], [60, 50]], gap: 90}'
    coarse, fine = (
        mechdesign.kinematics(
            study_of(FOUR_BAR.replace("TARGETS", targets), f"kinematics.sweep.theta.step={step}")
        ).tables["extremes"]
        for step in (10, 0.01)
    )
    rows = [name.endswith("_error") for name in fine["output"]]
    assert sum(rows) == 5
    for column in ("min", "max"):
        assert coarse[column][rows] == pytest.approx(fine[column][rows], abs=1e-5)
    sampled = motion(targets)
    assert coarse["max"][list(coarse["output"]).index("B.x_error")] > np.max(sampled["B.x_error"])


def to_polyline(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Errors of an arm's end, held at points, of a path given by corners, as x + iy."""
    poses = [{"P.x": float(point.real), "P.y": float(point.imag)} for point in points]
    path = [[float(corner.real), float(corner.imag)] for corner in corners]
    table = motion(f"{{P: {path}}}", f"kinematics={{poses: {poses}}}", text=ARM)
    assert table["P_error"] == pytest.approx(np.hypot(table["P.x_error"], table["P.y_error"]), nan_ok=True)
    return table["P.x_error"] + 1j * table["P.y_error"]


@pytest.mark.slow
def test_a_path_is_met_at_the_nearest_point_of_its_pieces() -> None:
    corners = 10 + 3j + np.array([0, 0.5, 1, 1, 1 + 1j])  # with a corner twice
    points = 10 + 3j + np.array([0.5 + 0.2j, -1 - 1j, 2 + 0.5j, 2 + 3j])
    assert to_polyline(points, corners) == pytest.approx([0.2j, -1 - 1j, 1, 1 + 2j], abs=1e-9)
    # Against every point of a fine subdivision of each piece.
    rng = np.random.default_rng(1)
    points, corners = (10 + 3j + rng.normal(size=(count, 2)) @ [1, 1j] for count in (40, 400))
    fine = (corners[:-1, None] + np.diff(corners)[:, None] * np.linspace(0, 1, 201)).ravel()
    distance = np.abs(points[:, None] - fine).min(axis=1)
    found = np.abs(to_polyline(points, corners))
    assert (found <= distance + 1e-9).all()
    assert found == pytest.approx(distance, abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("targets", "message"),
    [
        ("{B.z: 3}", "11:13: mechanism.targets.B.z: there is no coordinate 'B.z'; did you mean 'B.y'?"),
        ("{rod: 3}", "mechanism.targets.rod: 'rod' is a link; its coordinate is rod.angle"),
        ("{B.x: 3 deg}", "11:18: mechanism.targets.B.x: '3 deg' is an angle, where a length is expected"),
        ("{B.x: thet + 1}", "there is no coordinate or parameter 'thet'; did you mean 'theta'?"),
        ("{B.x: B + 1}", "'B' is a point; its coordinates are B.x and B.y"),
        ("{B.x: 1/0}", "mechanism.targets.B.x: division by zero"),
        ("{B.x: 3 +}", "the expression '3 +' ends too early"),
        ("{B.x: B.x + 1}", "'B.x' is what the target is for: it cannot depend on it"),
        ("{B: theta}", "the target of a point is a path; give B.x and B.y their expressions"),
        ("{B: [[1, 2]], B.x: 3}", "11:26: mechanism.targets.B.x: B.x has a target already, by 'B'"),
        ("{B: [1, 2]}", "a row of the target of 'B' is [x, y] or [drive, x, y], not 1 numbers"),
        ("{B.x: [[1, 2, 3]]}", "a row of the target of 'B.x' is [value] or [drive, value], not 3 numbers"),
        ("{B.x: [1, 2]}", "2 values for 37 poses: give one a pose, or rows [drive, value] to interpolate between"),
        ("{B.x: []}", "mechanism.targets.B.x: an empty list: no target"),
        ("{B: [[1, 2], [3]]}", "entry 1: every row holds the same one, two or three numbers, not a list of 1"),
        ("{B: [[1, 2], [3, x]]}", "entry 1: unknown name 'x'"),
        ("{B.x: [[1, 2], [1, 3]]}", "the drive's value 1 stands in two rows"),
        ("{B: {file: missing.csv}}", "missing.csv cannot be read"),
        ("{B: {fil: missing.csv}}", "expected an expression, a number, {file: path.csv}"),
        ("{B: [[1, 2], [3 mm, 4 deg]]}", "11:32: mechanism.targets.B.1.1: '4 deg' is an angle, where a length is"),
        ("{rod.angle: [[1, 2], [3, 4 mm]]}", "mechanism.targets.rod.angle.1.1: '4 mm' is a length, where an angle is"),
        ("{rod.angle: [4 mm]}", "mechanism.targets.rod.angle.0: '4 mm' is a length, where an angle is expected"),
        ("{B.x: true}", "expected a number, not true"),
        ("{B.x: }", "mechanism.targets.B.x: expected an expression, a number"),
        ("[B.x]", "11:12: mechanism.targets: expected a mapping of names, not a list of 1"),
    ],
)
def test_wrong_targets(targets: str, message: str) -> None:
    with pytest.raises(mechdesign.StudyError) as caught:
        study_of(FOUR_BAR.replace("TARGETS", targets))
    assert message in str(caught.value)
    assert str(caught.value).startswith("<study>:11:")


def test_every_wrong_target_is_told_beside_other_mistakes() -> None:
    with pytest.raises(mechdesign.StudyError) as caught:
        study_of(FOUR_BAR.replace("TARGETS", "{B.x: 1/0, Q: 3, C.x: [1]}").replace("[D, B, 60]", "[D, B, -60]"))
    assert len(caught.value.problems) == 3


def test_no_single_drive_to_interpolate_over() -> None:
    with pytest.raises(mechdesign.StudyError, match="of upper, fore no single one is swept; give one row a pose"):
        study_of(ARM.replace("TARGETS", "{P: [[0, 1, 2], [9, 3, 4]]}"), "kinematics.poses=[{upper: 1, fore: 2}]")


@pytest.mark.slow
def test_an_optimisation_minimises_the_largest_error(tmp_path: Path) -> None:
    # The target is what a rocker of 60 does; its length is found again among others.
    values = [round(float(value), 6) for value in motion("{}")["rocker.angle"]]
    text = FOUR_BAR.replace("TARGETS", f"{{rocker.angle: {values}}}").replace("{k: 0.6}", "{k: 0.6, r: 55}")
    text = text.replace("[D, B, 60]", "[D, B, r]")
    (tmp_path / "study.yaml").write_text(
        text + "optimize: {variables: {r: {from: 50, to: 70, step: 5}}, minimize: [kinematics.rocker.angle_error]}"
    )
    optimum = mechdesign.optimize(mechdesign.load(tmp_path / "study.yaml")).tables["optimum"]
    assert optimum["r"] == [60]
    assert optimum["kinematics.rocker.angle_error"] == pytest.approx(0, abs=1e-6)
