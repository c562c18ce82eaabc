"""What a synthesis shows: solutions as studies that move, pictures, words, and a task in place of a mechanism."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.command_line import ask, checked
from helpers.syntheses import four_bar
from matplotlib.text import Text

import mechdesign

FIVE = """
synthesis:
  body: [{x: 0, y: 0, angle: 0}, {x: 19, y: 13, angle: 20}, {x: 46, y: 21, angle: 45}, {x: 67, y: 18, angle: 65},
         {x: 89, y: -2, angle: 75}]
"""
POINTS = [[55, 60], [45, 75], [25, 75], [10, 55], [15, 35], [40, 40]]
CLOSED = f"synthesis: {{path: {{points: {POINTS}, closed: true}}, evaluations: 100, solutions: 3"


@pytest.fixture(scope="module")
def five() -> Any:
    return mechdesign.synthesize(mechdesign.load(text=FIVE))


@pytest.fixture(scope="module")
def closed() -> Any:
    """With a load of 20 N down at P."""
    text = f"{CLOSED}, judge: {{best: 3, loads: [{{at: P, force: [0, -20 N]}}]}}}}"
    return mechdesign.synthesize(mechdesign.load(text=text), seed=1)


def p_of(row: dict[str, Any], theta: Any, side: float) -> Any:
    """The point P of a four-bar in closed form; angles in degrees, O in the origin and the frame along x."""
    o, d = (row[f"ground.{name}.x"] + 1j * row[f"ground.{name}.y"] for name in "OD")
    turn = (d - o) / abs(d - o)
    angles = np.asarray(theta) - np.degrees(np.angle(turn))
    sizes = [[row[name]] for name in ("crank.length", "coupler.length", "rocker.length", "coupler.P.x", "coupler.P.y")]
    return o + turn * four_bar(*sizes, angles, abs(d - o), side)[0][0]


@pytest.mark.slow
def test_a_solution_goes_through_its_points_and_a_closed_path_comes_back_a_turn_later(closed: Any) -> None:
    row = next(iter(closed.main))
    study = mechdesign.load(text=closed.files["solution_1.yaml"])
    motion = mechdesign.kinematics(study).main
    assert abs(motion["theta"][-1] - motion["theta"][0]) == pytest.approx(360)
    ways = [p_of(row, motion["theta"], side) for side in (1, -1)]
    wished = np.array([complex(*point) for point in [*POINTS, POINTS[0]]])
    assert min(abs(way - wished).max() for way in ways) < 1e-6
    assert len(study.targets["P"].table) == 7


@pytest.mark.slow
def test_a_file_of_a_solution_says_what_it_is_and_has_short_lists_in_lines(closed: Any) -> None:
    lines = closed.files["solution_1.yaml"].splitlines()
    assert lines[0].startswith("# Found by synthesize as solution 1 of study: four-bar (")
    comments = " ".join(line.removeprefix("# ") for line in lines if line.startswith("#"))
    assert "error 0 mm, transmission angle" in comments
    assert "peak effort" in comments
    assert "no defect" in comments
    # A copy by another name says nothing wrong.
    assert ".yaml" not in comments
    assert f"  targets: {{P: {[*POINTS, POINTS[0]]}}}" in lines
    assert max(map(len, lines)) <= 120


@pytest.mark.slow
def test_the_peak_effort_of_a_linkage_is_that_of_virtual_work(closed: Any) -> None:
    """The drive's power is that of the load: M = 20 N times the rise of P by the crank's angle."""
    row = next(iter(closed.main))
    theta = np.linspace(0, 360, 3601)
    rises = [np.gradient(p_of(row, theta, side).imag, np.radians(theta))[1:-1] for side in (1, -1)]
    assert any(20 * abs(rise).max() == pytest.approx(row["peak_effort"], rel=1e-4) for rise in rises)


@pytest.mark.slow
def test_all_linkages_are_shown_with_kind_error_transmission_angle_and_defects(five: Any) -> None:
    figure = five.figure("solutions")
    titles = [axes.get_title(loc="left") or axes.get_title() for axes in figure.axes]
    titles += [text.get_text() for text in figure.findobj(Text)]  # type: ignore[arg-type]
    shown = [title for title in dict.fromkeys(titles) if "\N{GREEK SMALL LETTER MU} " in title and "error" in title]
    assert len(figure.axes) == len(five.main) == len(shown) == 6
    assert all("four-bar error 0 mm" in title.replace("\n", " ") for title in shown)
    assert sum("no defect" in title for title in shown) == 2
    assert sum("branch" in title for title in shown) == 4


@pytest.mark.slow
def test_linkages_without_an_error_trade_their_size_for_transmission(five: Any) -> None:
    (axes,) = five.figure("trade").axes
    assert axes.get_ylabel().startswith("size")
    table = five.main
    drawn = np.concatenate([line.get_xydata() for line in axes.lines if line.get_marker() == "o"])
    assert {*np.round(drawn[:, 1], 6)} == {*np.round(table["size"], 6)}
    # Of the two without a defect the one has the larger angle, and the other is smaller.
    best, other = (table.take(table["defects"] == "")[name] for name in ("transmission_angle", "size"))
    assert (best[0] > best[1], other[0] > other[1]) == (True, True)
    assert sum("front" in str(line.get_label()) for line in axes.lines) == 1


@pytest.mark.slow
def test_what_a_synthesis_says_stands_in_terminal_manifest_report_and_notebook(five: Any, tmp_path: Path) -> None:
    words = ("best: four-bar", "4 real dyads of at most 4", "2 without a defect", "seed 7")
    done = ask("synthesize", "-", "--seed", 7, "--report", "--no-plots", "--out", tmp_path, study=FIVE)
    assert done.exit_code == 0, done.stderr
    answer = mechdesign.synthesize(mechdesign.load(text=FIVE), seed=7)
    manifest = json.loads((tmp_path / "manifest.json").read_text())
    page = (tmp_path / "report.html").read_text()
    for text in (done.stderr, "\n".join(manifest["notes"]), page, answer._repr_html_(), repr(answer)):
        assert all(word in text for word in words)


@pytest.mark.slow
def test_the_report_of_a_task_has_no_mechanism_of_its_own(tmp_path: Path) -> None:
    ask("run", "-", "--report", "--no-plots", "--out", tmp_path, study=FIVE)
    page = (tmp_path / "report.html").read_text()
    assert "a body through 5 positions exactly" in page
    assert "Driven by" not in page
    assert 'id="mechanism"' not in page
    manifest = json.loads((tmp_path / "synthesize" / "manifest.json").read_text())
    assert "mechanism" not in manifest["study"]["resolved"]


@pytest.mark.slow
def test_a_sweep_over_a_number_of_the_task_finds_what_each_task_has() -> None:
    text = f"""{FIVE}
matrix: {{vary: {{synthesis.body.4.y: [-2, 0]}}, results: [synthesize.solutions.transmission_angle.max]}}
"""
    cases = mechdesign.sweep(mechdesign.load(text=text)).main["synthesize.solutions.transmission_angle.max"]
    alone = [mechdesign.synthesize(mechdesign.load(text=FIVE.replace("y: -2", f"y: {y}"))).main for y in (-2, 0)]
    assert cases == pytest.approx([table["transmission_angle"].max() for table in alone], rel=1e-9)
    assert cases[0] - cases[1] > 0.5


def test_words_and_table_have_the_same_error() -> None:
    """Seven pairs of a function, which are met by least squares; its error is an angle."""
    task = "{input: [10, 20, 30, 40, 50, 60, 70], output: [10, 22, 31, 45, 52, 61, 75]}"
    text = f"synthesis: {{function: {task}, frame: 50, zeros: free, limits: {{ratio: 100}}}}"
    answer = mechdesign.synthesize(mechdesign.load(text=text))
    assert f"error {answer.main['error'][0]:.4g} deg" in answer.notes[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pairs", "more", "task", "words"),
    [
        (3, "", "3 pairs exactly", "1 real linkage of at most 1"),
        (3, "zeros: free", "3 pairs exactly", "from 240 samples of each choice"),
        (4, "", "4 pairs by least squares", "4 pairs with fixed zeros are met by least squares"),
        (5, "zeros: free", "5 pairs exactly", "1 real linkage of at most 3"),
        (6, "zeros: free", "6 pairs by least squares", "6 pairs are met by least squares"),
    ],
)
def test_how_complete_a_list_is_is_told_of_linkages_through_pairs(pairs: int, more: str, task: str, words: str) -> None:
    """Three pairs of links' own angles are three linear equations (Freudenstein); of four dyads one is the frame."""
    function = f"{{input: {[97, 108, 120, 131, 143, 150][:pairs]}, output: {[36, 50, 65, 76, 87, 92][:pairs]}}}"
    text = f"synthesis:\n  function: {function}\n  limits: {{ratio: 1000}}\n  frame: 100\n  {more}\n"
    assert task in checked(text)[1]
    notes = mechdesign.synthesize(mechdesign.load(text=text)).notes
    assert any(words in note for note in notes), notes
    assert not [note for note in notes if "dyad" in note]


@pytest.mark.nightly
def test_the_last_start_is_one_of_the_starts() -> None:
    points = "[[0, 0], [20, 8], [40, 10], [60, 8]]"
    text = f"synthesis: {{path: {{points: {points}, timing: [0, 20, 40, 60]}}, evaluations: 100}}"
    (words,) = [note for note in mechdesign.synthesize(mechdesign.load(text=text)).notes if "exact" in note]
    last, starts = re.findall(r"start (\d+) of (\d+)", words)[0]
    assert int(last) <= int(starts)


@pytest.mark.slow
def test_of_more_positions_each_linkage_stands_once_and_is_a_mechanism() -> None:
    text = f"{FIVE.rstrip().removesuffix(']')}, {{x: 95, y: -20, angle: 82}}]\n  limits: {{reach: 20, ratio: 50}}\n"
    answer = mechdesign.synthesize(mechdesign.load(text=text))
    lines = [(row["kind"], round(row["error"], 6), round(row["size"], 4)) for row in answer.main]
    assert len({*lines}) == len(lines)
    assert {mechdesign.load(text=answer.files[name]).kinematics is not None for name in answer.files} == {True}


@pytest.mark.slow
def test_a_linkage_that_misses_no_pair_by_more_than_it_must_in_one_assembly_needs_no_other() -> None:
    """At the fourth of four pairs another assembly comes nearer; the second is missed by more in any."""
    inputs, outputs = np.array([183.7, 205.7, 225.1, 240.4]), np.array([43.4, 35.8, -2.9, -42.5])
    task = {"function": {"input": inputs.tolist(), "output": outputs.tolist()}, "frame": 1}
    row = next(iter(mechdesign.synthesize(mechdesign.load({"synthesis": task})).main))
    crank, coupler, rocker = (row[f"{name}.length"] for name in ("crank", "coupler", "rocker"))
    _, angles, _ = four_bar(crank, coupler, rocker, 0, 0, inputs + 180, 1, -1)
    errors = (np.degrees(angles[0]) - outputs) % 360 - 180
    assert np.abs(errors) == pytest.approx([0, 19.07, 0, 17.12], abs=0.01)
    assert (row["error"], row["max_error"]) == pytest.approx((np.sqrt((errors**2).mean()), np.abs(errors).max()))
    assert row["defects"] == ""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pairs", "zeros", "kind"),
    [
        (5, "fixed", "four_bar"),
        (7, "free", "four_bar"),
        (4, "fixed", "slider_crank"),
        (7, "free", "slider_crank"),
    ],
)
def test_the_study_of_a_function_misses_its_pairs_by_the_error_of_the_table(pairs: int, zeros: str, kind: str) -> None:
    """The output as it moves; links' own angles count from the link or its other end, free ones from the best zero."""
    output = [36, 50, 65, 76, 87, 92, 95] if kind == "four_bar" else [10, 14, 19, 25, 31, 36, 40]
    function = f"{{input: {[97, 108, 120, 131, 143, 150, 155][:pairs]}, output: {output[:pairs]}}}"
    text = f"{{function: {function}, kind: {kind}, zeros: {zeros}, limits: {{ratio: 1000, reach: 100}}, solutions: 2}}"
    answer = mechdesign.synthesize(mechdesign.load(text=f"synthesis: {text}"))
    for row, number in zip(answer.main, (1, 2), strict=False):
        study = mechdesign.load(text=answer.files[f"solution_{number}.yaml"])
        motion = mechdesign.kinematics(study).main
        away = motion["rocker.angle" if kind == "four_bar" else "B.x"] - np.array(output[:pairs])
        zero = away.mean() if zeros == "free" else 180 * np.round(away.mean() / 180) if kind == "four_bar" else 0
        assert row["error"] > 0.1
        assert np.sqrt(((away - zero) ** 2).mean()) == pytest.approx(row["error"], rel=1e-6)
        assert abs(motion[f"{'rocker.angle' if kind == 'four_bar' else 'B.x'}_error"]).max() == pytest.approx(
            row["max_error"], rel=1e-6
        )


def test_of_five_positions_without_a_slide_the_nearest_is_a_four_bar_and_misses_it() -> None:
    for key, missed in (("slide: true", "no side of the body is a slide"), ("kinds: trammel", "it is of another kind")):
        with pytest.raises(mechdesign.AssemblyError, match=f"the nearest is in nearest.yaml: {missed}"):
            mechdesign.synthesize(mechdesign.load(text=f"{FIVE}  {key}\n"))


def test_a_task_may_follow_parameters() -> None:
    text = "mechanism: {parameters: {h: 21}}" + FIVE.replace("y: 21", "y: h")
    study = mechdesign.load(text=text, overrides=["mechanism.parameters.h=20"])
    assert study.is_task
    alone = mechdesign.synthesize(mechdesign.load(text=FIVE.replace("y: 21", "y: 20")))
    assert mechdesign.synthesize(study).main["crank.length"] == pytest.approx(alone.main["crank.length"], rel=1e-9)


def test_check_tells_the_task_and_a_question_about_a_mechanism_is_refused() -> None:
    lines = checked(FIVE)
    assert lines[1] == "task: a body through 5 positions exactly: x 0 to 89 mm, y -2 to 21 mm, angle 0 to 75 deg"
    assert not [line for line in lines if line.startswith(("links", "joint", "mobility"))]
    study = mechdesign.load(text=FIVE)
    assert "a task, no mechanism" in repr(study)
    with pytest.raises(mechdesign.StudyError, match="this study has only a task"):
        mechdesign.kinematics(study)
    with pytest.raises(mechdesign.StudyError, match="kinematics: asks about a mechanism"):
        mechdesign.load(text=FIVE + "kinematics: {outputs: [P]}")
    assert ask("export", "-", "--to", "mechanism.dxf", "--out", "nowhere.dxf", study=FIVE).exit_code == 2


@pytest.mark.parametrize(
    ("judge", "words"),
    [
        ("{within: 1}", "what deviates"),
        ("{tolerance: 0.1}", "a yield needs 'within'"),
        ("{loads: [{at: Q, force: [0, 1]}]}", "there is no point 'Q'"),
    ],
)
def test_what_cannot_be_judged_is_said_before_anything_is_looked_for(judge: str, words: str) -> None:
    with pytest.raises(mechdesign.StudyError, match=words):
        mechdesign.load(text=f"{FIVE}  judge: {judge}")


def test_where_nothing_passes_the_nearest_is_a_study_and_the_exit_code_3(tmp_path: Path) -> None:
    study = f"{FIVE}  kinds: four_bar\n  keep_out: {{x: [-999, 999], y: [-999, 999]}}\n"
    done = ask("synthesize", "-", "--no-plots", "--report", "--out", tmp_path, study=study)
    assert done.exit_code == 3
    page = (tmp_path / "report.html").read_text()
    assert page.count("no linkage does it; the nearest is in nearest.yaml") == 1
    assert "its smallest transmission angle" in page
    report, first, second, *_ = done.stderr.splitlines()
    assert report.endswith("report.html")
    assert first.endswith("no linkage does it; the nearest is in nearest.yaml: a pivot lies where none may (keep_out)")
    assert second.startswith("nearest: four-bar (triple-rocker), error 0 mm")
    near = mechdesign.load(tmp_path / "nearest.yaml")
    assert mechdesign.kinematics(near).tables["targets"]["max_abs"].max() < 1e-6
