"""Tasks that no linkage does, or that are no tasks: what is said of them."""

from typing import Any

import numpy as np
import pytest
import yaml

import mechdesign

THREE = [{"x": 0, "y": 0, "angle": 0}, {"x": 2, "y": 1, "angle": 30}, {"x": 3, "y": 3, "angle": 75}]
SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1]]


def solved(task: Any) -> Any:
    return mechdesign.synthesize(mechdesign.load(text=yaml.safe_dump({"synthesis": task})), seed=1)


@pytest.mark.parametrize(
    ("task", "words"),
    [
        ({}, "a task is one of body, function and path"),
        ({"body": []}, "2 to 1000 positions, not 0"),
        ({"body": [THREE[0], THREE[0]]}, "position 2 of the body is one of those before it"),
        ({"body": [THREE[0], THREE[0] | {"angle": 360}]}, "position 2 of the body is one of those before it"),
        ({"body": THREE, "pivots": {"x": [4, -4]}}, r"^<study>:\d+:\d+: synthesis.pivots: x: -4 is not beyond 4$"),
        ({"body": THREE, "pins": "near"}, "pins: expected a box, a line or points, not 'near'"),
        ({"function": {"input": [1, 2, 3], "output": [7, 7, 7]}}, "all outputs are one"),
        ({"body": [THREE[0], {"x": 1e300, "y": 0, "angle": 0}]}, "too large"),
        ({"body": [THREE[0], {"x": float("inf"), "y": 0, "angle": 0}]}, "finite"),
        ({"body": THREE, "pivots": []}, "expected a box, a line or points"),
        ({"body": THREE, "lengths": {"cramk": [1, 2]}}, "no link 'cramk'; links are ground, crank"),
        ({"body": THREE, "lengths": {"crank": [2, 1]}}, "crank: 1 is not beyond 2"),
        ({"function": {"input": [], "output": []}}, "3 to 1000 pairs, not 0"),
        ({"function": {"input": [1, 2, 3], "output": [1, 2]}}, "3 values of 'input' for 2 of 'output'"),
        ({"path": {"points": []}}, "two points or more, not 0"),
        ({"path": {"points": [[1, 1], [1, 1]]}}, "all points of the path are one"),
        ({"path": {"points": [[float("nan"), 0], [1, 0]]}}, "finite number, not nan"),
        ({"path": {"points": [[0, 0]] * 10_001}}, "at most 10000 points, not 10001"),
        ({"path": {"points": "missing.csv"}}, "missing.csv cannot be read"),
        ({"path": {"points": [[1e300, 0], [0, 1]]}}, r"synthesis.path.points.0.0: the number 1e\+300 is too large"),
        ({"path": {"points": SQUARE, "closed": True}, "full_turn": False}, "the same way forth and back"),
        ({"path": {"points": SQUARE, "timing": [0, 1]}}, "2 crank angles for 4 points"),
        ({"path": {"points": SQUARE}, "kinds": "trammel"}, "no trammel is looked for from a path"),
        ({"path": {"points": SQUARE}, "rank": "yield"}, "a yield needs 'judge'"),
    ],
)  # fmt: skip
def test_what_is_no_task_is_said(task: Any, words: str) -> None:
    with pytest.raises(mechdesign.StudyError, match=words):
        solved(task)


@pytest.mark.parametrize(
    ("conditions", "words"),
    [
        ({"pivots": {"x": [100, 101], "y": [100, 101]}}, "a pivot is too far away"),
        ({"keep_out": {"x": [-99, 99], "y": [-99, 99]}}, "a pivot lies where none may"),
    ],
)
def test_conditions_that_contradict_each_other_are_named(conditions: Any, words: str) -> None:
    with pytest.raises(mechdesign.AssemblyError, match=words) as raised:
        solved({"body": THREE, **conditions, "kinds": "four_bar"})
    assert "the nearest is in nearest.yaml: a pivot" in str(raised.value)


@pytest.mark.slow
def test_many_positions_are_met_by_linkages_whose_pivots_are_within_reach() -> None:
    """The best links of all have pivots 290 mm away from the middle of a way of 90 mm; within 270 mm others do it."""
    s = np.linspace(0, 1, 12)
    places = zip(90 * s, 20 * np.sin(3 * s), 70 * s, strict=True)
    table = solved({"body": [{"x": float(x), "y": float(y), "angle": float(a)} for x, y, a in places]}).main
    row = next(iter(table.take(table["defects"] == "")))
    assert row["error"] < 1.5
    assert max(abs(row["ground.O.x"] - 45), abs(row["ground.O.y"])) < 290


def test_where_pivots_are_wished_each_linkage_has_one_in_the_box() -> None:
    table = solved({"body": THREE, "pivots": {"x": [-4, 4], "y": [-3, 0]}}).tables["solutions"]
    assert table["max_error"].max() < 1e-9
    for point in ("ground.O", "ground.D"):
        x, y = table[f"{point}.x"], table[f"{point}.y"]
        assert ((abs(x) <= 4 + 1e-6) & (y <= 1e-6) & (y >= -3 - 1e-6)).all()


@pytest.mark.nightly
def test_points_that_come_twice_and_points_in_a_line_are_paths() -> None:
    for points in ([[0, 0], [0, 0], [1, 0], [1, 1], [1, 1]], [[0, 0], [1, 0], [2, 0], [3, 0]]):
        assert solved({"path": {"points": points}}).tables["solutions"]["error"][0] < 1e-6


def test_pivots_lie_on_the_line_that_is_given_by_its_angle() -> None:
    """Through (0, -1) at 30 deg from the x axis."""
    line = {"through": [0, -1], "direction": 30}
    table = solved({"body": THREE, "pivots": line, "kinds": "four_bar"}).tables["solutions"]
    for point in ("ground.O", "ground.D"):
        assert table[f"{point}.y"] == pytest.approx(-1 + table[f"{point}.x"] / 3**0.5, abs=1e-5)


@pytest.mark.slow
def test_of_many_points_it_is_told_how_many_count() -> None:
    points = [[float(x), float(abs(x % 4 - 2))] for x in range(401)]
    task = {"path": {"points": points}, "limits": {"reach": 100, "ratio": 1000}, "evaluations": 100}
    assert "134 of 401 points count, evenly chosen" in solved(task).notes


@pytest.mark.slow
@pytest.mark.parametrize("conditions", [{"lengths": {"crank": [1e6, 1e7]}}, {"pivots": [[0, 0], [0, 0]]}])
def test_a_path_with_conditions_that_contradict_each_other_says_so(conditions: Any) -> None:
    task = {"path": {"points": SQUARE}, "evaluations": 100, **conditions}
    with pytest.raises(
        mechdesign.AssemblyError, match="four-bar: no sample has a curve within all conditions"
    ) as raised:
        solved(task)
    # The nearest is a linkage without the conditions, and says which it misses.
    assert f"({next(iter(conditions))})" in str(raised.value).partition("\n")[0]
    assert mechdesign.load(text=raised.value.result.files["nearest.yaml"]).kinematics is not None


def test_the_nearest_to_a_function_tells_at_which_pairs_it_cannot_be_assembled() -> None:
    function = {"input": [10, 30, 55, 80, 110, 130, 160, 190], "output": [20, 60, 30, 90, 50, 120, 60, 10]}
    with pytest.raises(mechdesign.AssemblyError) as raised:
        solved({"function": function, "zeros": "free"})
    study = mechdesign.load(text=raised.value.result.files["nearest.yaml"])
    lost = np.flatnonzero(np.isnan(mechdesign.kinematics(study).tables["motion"]["rocker.angle"])) + 1
    assert len(lost)
    missed = f"it cannot be assembled at position {', '.join(map(str, lost))}"
    assert str(raised.value).partition("nearest.yaml: ")[2].partition("\n")[0] == missed


@pytest.mark.nightly
@pytest.mark.parametrize("size", [1e-12, 1.0, 1e12])
def test_ten_thousand_points_at_any_scale_are_a_path(size: float) -> None:
    turn = np.linspace(0, 2 * np.pi, 10_000, endpoint=False)
    points = size * np.stack([5 * np.cos(turn), 2 * np.sin(turn)], axis=1)
    result = solved({"path": {"points": points.tolist(), "closed": True}, "evaluations": 3000})
    # An ellipse is drawn by Cardan's motion, not by these four-bars, but nearly.
    assert result.tables["solutions"]["error"][0] < 0.02 * size
    assert "200 of 10000 points count, evenly chosen" in result.notes


def test_where_no_sample_keeps_a_condition_it_is_said() -> None:
    task = {"path": {"points": SQUARE, "closed": True}, "transmission": {"at_least": 89}, "evaluations": 100}
    with pytest.raises(mechdesign.AssemblyError, match="four-bar: no sample has a curve within all conditions"):
        solved(task)
