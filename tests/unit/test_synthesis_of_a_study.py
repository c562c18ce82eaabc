"""Linkages of a study's own mechanism, found by ranges of its parameters."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers.syntheses import four_bar, third

import mechdesign

FOUR_BAR = """
# A tracer.
mechanism:
  parameters: {a: 15, b: 70, u: 20, v: 20, w: 2*v}   # w follows
  links:
    ground: {O: [0, 0], D: [70, 0]}
    crank: [O, A, a]      # turns
    rod: {from: A, to: B, length: b, points: {P: [u, w]}}
    rocker: [D, B, 80]
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 20], B: [60, 80]}
kinematics:
  sweep: {theta: {from: 0, to: 360, step: 5}}
  outputs: [P]
"""
# The rod's end A runs along the x axis, B on a circle about (90, d).
SLIDER = """
mechanism:
  parameters: {b: 60, u: 30, v: 20, d: 10}
  links:
    ground: {O: [0, 0], D: [90, d]}
    rod: {from: A, to: B, length: b, points: {P: [u, v]}}
    rocker: [D, B, 70]
  joints: {rail: {slot: ground, through: O, direction: 0, point: A}}
  drives: {s: {slide: rail}}
  sketch: {A: [20, 0], B: [60, 50]}
kinematics:
  sweep: {s: {from: 0, to: 60, step: 1}}
  outputs: [P]
"""
RANGES = {"a": [10, 30], "b": [60, 120], "u": [0, 60], "v": [0, 40]}


def solved(folder: Path, text: str, points: np.ndarray, ranges: dict[str, list[float]], **task: object):
    (folder / "own.yaml").write_text(text)
    path = {"points": [[z.real, z.imag] for z in points.tolist()], "closed": task.pop("closed", False)}
    path |= {key: task.pop(key) for key in ("timing", "point") if key in task}
    synthesis = {"path": path, "of": "own.yaml", "ranges": ranges, "seed": 1, "evaluations": 800, **task}
    (folder / "task.yaml").write_text(yaml.safe_dump({"synthesis": synthesis}))
    return mechdesign.synthesize(mechdesign.load(folder / "task.yaml"))


@pytest.mark.slow
def test_a_four_bar_of_a_study_is_found_from_its_curve(tmp_path: Path) -> None:
    points = four_bar(20, 90, 80, 30, 25, np.arange(0, 360, 36), 70, 1.0)[0][0]
    result = solved(tmp_path, FOUR_BAR, points, {**RANGES, "v": [0, 20]}, closed=True)
    table = result.tables["solutions"]
    assert [table[name][0] for name in RANGES] == pytest.approx([20, 90, 30, 12.5], rel=1e-6)
    assert table["defects"][0] == ""
    # The solution is the study with its comments, and kinematics comes to the same error.
    text = result.files["solution_1.yaml"]
    assert "# A tracer." in text
    assert "# w follows" in text
    assert "w: 2*v}" in text
    made = mechdesign.load(text=text)
    result = mechdesign.kinematics(made)
    assert result.tables["targets"]["max_abs"][0] < 1e-6
    assert [one.met for one in mechdesign.requirements(made, result)] == [True]


@pytest.mark.slow
def test_a_mechanism_whose_drive_slides_is_found_from_its_curve(tmp_path: Path) -> None:
    pin = np.arange(4.0, 48, 5)
    other, _ = third(pin, 90 - 5j, 75.0, 70.0, 1.0)
    points = pin + (other - pin) / 75 * (40 + 15j)
    table = solved(tmp_path, SLIDER, points, {"b": [40, 100], "u": [0, 60], "v": [0, 40], "d": [-20, 20]}).tables[
        "solutions"
    ]
    assert [table[name][0] for name in "buvd"] == pytest.approx([75, 40, 15, -5], rel=1e-6)
    assert table["defects"][0] == ""


@pytest.mark.slow
def test_timing_is_kept_where_it_is_given(tmp_path: Path) -> None:
    turned = np.array([0.0, 25, 60, 110, 150, 200])
    points = four_bar(20, 90, 80, 30, 25, 70 + turned, 70, 1.0)[0][0]
    result = solved(tmp_path, FOUR_BAR, points, {**RANGES, "v": [0, 20]}, timing=turned.tolist())
    table = result.tables["solutions"]
    assert [table[name][0] for name in RANGES] == pytest.approx([20, 90, 30, 12.5], rel=1e-6)
    made = mechdesign.kinematics(mechdesign.load(text=result.files["solution_1.yaml"])).tables["motion"]
    np.testing.assert_allclose(np.mod(made["theta"] - 70, 360), turned, atol=1e-6)
    assert made["P_error"].max() < 1e-6


def test_the_files_that_a_task_names_are_files_of_its_study(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text(FOUR_BAR)
    (tmp_path / "points.csv").write_text("1,2\n3,4\n")
    synthesis = {"path": {"points": "points.csv"}, "of": "own.yaml", "ranges": RANGES}
    (tmp_path / "task.yaml").write_text(yaml.safe_dump({"synthesis": synthesis}))
    study = mechdesign.load(tmp_path / "task.yaml")
    assert [file.name for _, file, _ in study.inputs()] == ["points.csv", "own.yaml"]


@pytest.mark.parametrize(
    ("text", "task", "words"),
    [
        (FOUR_BAR, {"ranges": {"aa": [1, 2]}}, "has no parameter 'aa'; did you mean 'a'"),
        (FOUR_BAR.replace("w follows", "").replace("P: [u, w]", "P: [u, 5]"), {"ranges": {"v": [1, 2]}}, "follows v"),
        (FOUR_BAR, {"point": "Q"}, "has no point 'Q'"),
        (FOUR_BAR.replace("outputs: [P]", "outputs: [P, B]"), {}, "which point of own.yaml passes them"),
        (FOUR_BAR.replace("mechanism", "units: {length: m}\nmechanism", 1), {}, "its units are not those of the task"),
        (SLIDER, {"closed": True, "ranges": {"b": [40, 100]}}, "s of own.yaml does not turn fully"),
        (FOUR_BAR, {"kinds": "four_bar"}, "and no 'kinds'"),
        (FOUR_BAR, {"closed": True, "full_turn": False}, "the same way forth and back"),
        (FOUR_BAR, {"of": "other.yaml"}, "other.yaml cannot be read"),
    ],
)
def test_what_is_no_family_is_said(tmp_path: Path, text: str, task: dict, words: str) -> None:
    ranges = task.pop("ranges", RANGES)
    with pytest.raises(mechdesign.StudyError, match=words):
        solved(tmp_path, text, np.array([1j, 1.0, 2.0]), ranges, **task)
