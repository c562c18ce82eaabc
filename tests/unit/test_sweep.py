"""Sweeps: strokes of slider-cranks, designs of experiments, and names that are wrong before anything is computed."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.pages import faults
from helpers.pictures import figure_of

import mechdesign
from mechdesign.door.report.page.headlines import headlines
from mechdesign.drawing import style
from tests.unit.test_cases import SLIDER_CRANK

STROKE = "kinematics.extremes.B.x.range"
R, L = "mechanism.parameters.r", "mechanism.parameters.l"
CRANK = "mechanism.links.crank.2"


def study_of(matrix: dict[str, Any], **more: Any) -> Any:
    return mechdesign.load(text=SLIDER_CRANK, overrides={"matrix": matrix} | more)


def columns_of(matrix: dict[str, Any], seed: int = 0) -> np.ndarray:
    table = mechdesign.sweep(study_of(matrix, seed=seed)).main
    return np.array([table[entry] for entry in matrix["vary"]]).T


def test_a_grid_of_slider_cranks():
    study = study_of({"vary": {R: "25:45:10", L: [100, "12 cm"]}, "results": ["kinematics.rod.angle.max"]})
    table = mechdesign.sweep(study).main
    assert table[R].tolist() == [25, 25, 35, 35, 45, 45]
    assert table[L].tolist() == [100, 120, 100, 120, 100, 120]
    np.testing.assert_allclose(table[STROKE], 2 * table[R], rtol=1e-9)
    swing = np.degrees(np.arcsin(table[R] / table[L]))
    np.testing.assert_allclose(table["kinematics.rod.angle.max"], swing, rtol=1e-9)
    assert table[f"{STROKE}_met"].tolist() == (2 * table[R] >= 70).tolist()
    assert table["|kinematics.rod.angle|_met"].tolist() == (swing <= 25).tolist()
    assert table["exit_code"].tolist() == (~((2 * table[R] >= 70) & (swing <= 25))).astype(int).tolist()
    units = {column.name: column.unit for column in table.columns}
    assert (units[R], units[STROKE], units["kinematics.rod.angle.max"]) == ("mm", "mm", "deg")


def test_requirements_are_judged_over_all_cases():
    result = mechdesign.sweep(study_of({"vary": {R: [45, 30, 20]}}))
    stroke, angle = result.verdicts
    assert (stroke.met, stroke.worst) == (False, pytest.approx(40))
    assert stroke.place == "case 3 (r 20), output B.x, min 80; 2 of 3 cases do not meet it, the first is case 2"
    assert (angle.met, angle.worst) == (False, pytest.approx(math.degrees(math.asin(0.45))))
    assert result.counts == {"cases": 3, "not_met": 3, "failed": 0}


def test_a_case_that_fails_is_a_row():
    result = mechdesign.sweep(study_of({"vary": {R: [-1, 40]}}))
    assert result.main["exit_code"].tolist() == [3, 0]
    assert result.main["reason"].tolist() == ["mechanism.links.crank.2: must be positive, not -1", ""]
    assert np.isnan(result.main[STROKE][0])
    assert result.failed.startswith("1 of 2 cases failed; the first, case 1 (r -1): mechanism.links.crank.2")
    assert [verdict.met for verdict in result.verdicts] == [False, False]


@pytest.mark.slow
def test_latin_hypercube_has_one_sample_in_each_stratum():
    matrix = {"vary": {R: "20:40", L: {"from": 90, "to": 120}}, "method": "latin_hypercube", "samples": 25}
    r, length = columns_of(matrix).T
    for values, low, high in ((r, 20, 40), (length, 90, 120)):
        assert sorted(np.floor((values - low) / (high - low) * 25).astype(int)) == list(range(25))
    assert columns_of(matrix, seed=0).tolist() == columns_of(matrix).tolist()
    assert columns_of(matrix, seed=1).tolist() != columns_of(matrix).tolist()


def test_sobol_has_one_sample_in_each_elementary_rectangle():
    # A scrambled (0, 4, 2)-net in base 2: each box of area 1/16 with sides of powers of 1/2 holds one point.
    points = (columns_of({"vary": {R: "0:1", L: "0:1"}, "method": "sobol", "samples": 16}) // 1e-12) * 1e-12
    for k in range(5):
        boxes = {(int(x * 2**k), int(y * 2 ** (4 - k))) for x, y in points}
        assert len(boxes) == 16


@pytest.mark.slow
def test_words_of_a_random_design_come_equally_often():
    matrix = {"vary": {"mechanism.branch": ["side", "follow"], R: "20:30"}, "method": "latin_hypercube", "samples": 10}
    words = mechdesign.sweep(study_of(matrix)).main["mechanism.branch"].tolist()
    assert (words.count("side"), words.count("follow")) == (5, 5)


def test_what_is_required_has_one_column_and_its_limits_in_pictures():
    result = mechdesign.sweep(study_of({"vary": {R: [25, 45]}, "results": [STROKE, "kinematics.rod.angle.max"]}))
    names = result.main.names
    assert len(names) == len(set(names))
    assert result.drawn.results[STROKE] == (70, None)


def test_quantities_in_a_file_of_cases_are_numbers(tmp_path: Path):
    (tmp_path / "cases.csv").write_bytes(f"\ufeff{R};{L}\r\n4 cm;100\r\n\r\n25;0.12 m\r\n".encode())
    (tmp_path / "study.yaml").write_text(SLIDER_CRANK + "matrix: {cases: cases.csv}\n")
    table = mechdesign.sweep(mechdesign.load(tmp_path / "study.yaml")).main
    assert (table[R].tolist(), table[L].tolist()) == ([40, 25], [100, 120])
    np.testing.assert_allclose(table[STROKE], [80, 50], rtol=1e-9)


@pytest.mark.slow
def test_cases_of_a_file(tmp_path: Path):
    (tmp_path / "cases.csv").write_text(f"{R},mechanism.branch\n# longer\n40,side\n25,follow\n40,side\n")
    (tmp_path / "study.yaml").write_text(SLIDER_CRANK + "matrix: {cases: cases.csv}\n")
    result = mechdesign.sweep(mechdesign.load(tmp_path / "study.yaml"))
    np.testing.assert_allclose(result.main[STROKE], [80, 50, 80], rtol=1e-9)
    assert result.main["mechanism.branch"].tolist() == ["side", "follow", "side"]
    assert str(result.warnings[0]) == "1 of 3 cases are repeated; case 3 (r 40, branch side) is case 1 once more"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        ({"vary": {"mechanism.parameters.rr": [1, 2]}}, "the study has no mechanism.parameters.rr; did you mean 'r'?"),
        ({"vary": {"r": [1, 2]}}, "the study has no r; did you mean 'mechanism.parameters.r'?"),
        ({"vary": {"mechansim.parameters.r": [1]}}, "the study has no mechansim; did you mean 'mechanism'?"),
        ({"vary": {"kinematics.sweep.crank.stp": [1]}}, "no kinematics.sweep.crank.stp; did you mean 'step'?"),
        ({"vary": {"mechanism.branch": ["side", "folow"]}}, "did you mean 'follow'?"),
        ({"vary": {CRANK: [1, "2 deg"]}}, "'2 deg' is an angle, where a length is expected"),
        ({"vary": {CRANK: "1 deg:3 deg:1 deg"}}, "'1 deg' is an angle, where a length is expected"),
        (
            {"vary": {R: [1]}, "results": [{"result": "kinematics.extremes.max", "where": {"output": "B.z"}}]},
            "no row of extremes has output B.z; did you mean 'B.x'?",
        ),
        ({"vary": {R: [1, 1]}}, "the number 1 is listed twice"),
        ({"vary": {R: "1:2"}}, "a grid needs a step"),
        ({"vary": {R: "2:1:1"}}, "1 is not above 2"),
        ({"vary": {R: "1:2:3:4"}}, "START:STOP:STEP, LOW:HIGH or a list of values, not '1:2:3:4'"),
        ({"vary": {R: "0:1:1e-8"}}, "a grid of 100,000,001 cases, and at most 10,000,000 are answered"),
        ({"vary": {R: "1:2:1"}, "method": "sobol", "samples": 4}, "sobol takes a range without a step"),
        ({"vary": {R: "1:2"}, "method": "sobol"}, "sobol needs 'samples'"),
        ({"vary": {R: [1]}, "samples": 4}, "'samples' is of latin_hypercube and sobol"),
        ({"vary": {"mechanism.links.crank.length": [1], "mechanism.links.crank.2": [2]}}, "the same entry"),
        ({"vary": {"mechanism.parameters": [{}], R: [2]}}, "the same entry"),
        ({"vary": {"matrix.samples": [1]}}, "a matrix does not vary itself"),
        ({"results": ["GII"]}, "a matrix says what to 'vary', or names a file of 'cases'"),
        ({"vary": {R: [1]}, "results": ["kinematic.mu"]}, "there is no command 'kinematic'; did you mean"),
        ({"vary": {R: [1]}, "results": ["kinematics.rod.angel.max"]}, "did you mean 'rod.angle.max'?"),
        ({"vary": {R: [1]}, "results": ["kinematics.rod.angle"]}, "13 rows; ask for kinematics.rod.angle.min"),
        ({"vary": {R: [1]}, "results": ["2*r"]}, "is of parameters alone"),
        ({"cases": "none.csv"}, "none.csv cannot be read"),
    ],
)
def test_what_is_wrong_is_told_before_anything_is_computed(matrix: dict[str, Any], message: str):
    class Untouched:
        """Progress of nothing."""

        def start(self, total: int, stage: str) -> None:
            raise AssertionError("a case was begun")

        update = start

    with pytest.raises(mechdesign.StudyError) as error:
        mechdesign.sweep(study_of(matrix), progress=Untouched())
    assert message in str(error.value)


def test_nothing_asked_of_a_case_is_an_error():
    study = mechdesign.load(text=SLIDER_CRANK.partition("requirements")[0], overrides={"matrix": {"vary": {R: [1]}}})
    with pytest.raises(mechdesign.StudyError, match="what is to be found of each case"):
        mechdesign.sweep(study)


@pytest.mark.slow
def test_pictures_show_means_ranges_limits_and_cases_that_miss_them():
    result = mechdesign.sweep(study_of({"vary": {R: [25, 35, 45], L: [100, 120]}}))
    swing = np.degrees(np.arcsin([[r / length for length in (100, 120)] for r in (25, 35, 45)]))
    panels = result.figure("main_effects").axes
    # Rows: the stroke, the rod's angle; columns: crank, rod.
    over_crank, over_rod = panels[2], panels[3]
    for axes, values in ((over_crank, swing), (over_rod, swing.T)):
        limit, means = (line.get_ydata() for line in axes.lines)
        np.testing.assert_allclose(means, values.mean(axis=1))
        np.testing.assert_allclose(limit, 25)
        bars = np.array(axes.collections[0].get_segments())[:, :, 1]
        np.testing.assert_allclose(bars, np.stack([values.min(axis=1), values.max(axis=1)], axis=1))
    met = (swing <= 25) & (np.array([[25], [35], [45]]) * 2 >= 70)
    points = {line.get_marker(): len(line.get_xdata()) for line in result.figure("scatter").axes[-1].lines}
    assert (points["o"], points["X"]) == (met.sum(), (~met).sum())


def labelled(tmp_path: Path) -> tuple[mechdesign.Study, mechdesign.Answer]:
    """Cases of a file with names."""
    (tmp_path / "press.yaml").write_text(SLIDER_CRANK)
    (tmp_path / "built.csv").write_text(f"label,{R},{L}\nM\u00fcller,40,120\nhall B,30,118\nspare,42,110\n")
    goals = {"minimize": "kinematics.rod.angle.max", "maximize": STROKE}
    study = mechdesign.load(tmp_path / "press.yaml", overrides={"matrix": {"cases": "built.csv", "best": goals}})
    return study, mechdesign.sweep(study)


def test_cases_are_called_by_their_labels_in_tables_and_verdicts(tmp_path: Path):
    _, result = labelled(tmp_path)
    assert result.main["label"].tolist() == ["M\u00fcller", "hall B", "spare"]
    stroke = next(verdict for verdict in result.verdicts if not verdict.met)
    assert stroke.place.startswith("case 2 (hall B: ")
    assert stroke.place.endswith("the first is case 2 (hall B)")
    best = next(number for number in headlines(result) if number.label == "best case")
    assert best.value in ("1 (M\u00fcller)", "3 (spare)")


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["response", "scatter", "main_effects"])
@pytest.mark.parametrize("look", ["screen", "paper"])
def test_cases_are_called_by_their_labels_in_pictures(tmp_path: Path, name: str, look: str):
    study, result = labelled(tmp_path)
    with style.context(look):
        figure = figure_of(study, result, name)
        style.encoded(figure)
        assert not list(faults(figure))
    for axes in figure.axes:
        if axes.lines and axes.get_label() != "<colorbar>":
            assert {text.get_text() for text in axes.texts} >= {"M\u00fcller", "hall B", "spare"}


@pytest.mark.slow
def test_of_many_cases_the_best_alone_are_called_by_their_labels(tmp_path: Path):
    rows = "".join(f"case of {k},{30 + k / 10},120\n" for k in range(60))
    (tmp_path / "press.yaml").write_text(SLIDER_CRANK)
    (tmp_path / "built.csv").write_text(f"label,{R},{L}\n{rows}")
    matrix = {"cases": "built.csv", "best": {"maximize": STROKE}}
    study = mechdesign.load(tmp_path / "press.yaml", overrides={"matrix": matrix})
    with style.context():
        figure = figure_of(study, mechdesign.sweep(study), "scatter")
    assert "case of 59" in [text.get_text() for text in figure.axes[0].texts]
    assert len(figure.axes[0].texts) < 5
