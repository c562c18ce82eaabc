"""`mechdesign sweep`, and `run` of a study with a matrix: exit codes, JUnit, what stays, what is told."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from xml.etree import ElementTree

import pytest
from helpers.studies import IN_LINE

STUDY = (
    IN_LINE
    + """\
kinematics: {sweep: {crank: {from: 0, to: 360, step: 30}}, outputs: [B.x]}
requirements: [{result: kinematics.extremes.B.x.range, at_least: 50}]
"""
)
R = "mechanism.parameters.r"


@pytest.fixture
def study(folder) -> Path:
    (folder / "press.yaml").write_text(STUDY)
    return folder


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(text.splitlines()))


@pytest.mark.parametrize(("values", "code"), [("25,30", 0), ("20,30", 1), ("-1,20,30", 3)])
def test_the_exit_code_is_the_worst_of_the_cases(study, invoke, values, code):
    done = invoke("sweep", "press.yaml", "--vary", f"{R}={values}", "--no-plots", "--junit", "report.xml")
    assert done.exit_code == code
    table = rows(done.stdout)
    assert [row[R] for row in table] == values.split(",")
    assert max(int(row["exit_code"]) for row in table) == code
    assert rows((study / "results/press/sweep/sweep.csv").read_text()) == table
    question, requirement = ElementTree.parse(study / "report.xml").findall(".//testcase")
    assert (question.find("error") is not None) == (code == 3)
    failure = requirement.find("failure")
    assert (failure is None) == (code == 0)
    if failure is not None:
        count = len([row for row in table if row["kinematics.extremes.B.x.range_met"] == "0"])
        assert f"{count} of {len(table)} cases do not meet it, the first is case 1" in failure.get("message", "")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--vary", "mechanism.parameters.rr=1:2:1"], '--vary: matrix.vary.mechanism.parameters.rr: the study has no'),
        (["--vary", f"{R}=1", "--results", "kinematics.B.y.max"], "--results: matrix.results.0: the result of"),
        (["--vary", f"{R}"], f"--vary {R}: is <dotted name>=START:STOP:STEP"),
        (["--vary", f"{R}=1", "--vary", f"{R}=2"], f"--vary {R} is given twice"),
        (["--vary", f"{R}=1", "--results", "GII,GII"], "--results: matrix.results: 'GII' is listed twice"),
        (["--vary", f"{R}=1", "--cases", "cases.csv"], "--vary and --cases contradict each other"),
        (["--vary", f"{R}=1:2", "--method", "latin_hypercub", "--samples", "4"], "did you mean 'latin_hypercube'?"),
        (["--vary", f"{R}=1", "--maximize", "kinematics.B.y.max"], "--maximize: matrix.best.maximize.0: the result of"),
        (["--vary", f"{R}=1", "--minimize", "GII,GII"], "--minimize: matrix.best.minimize: 'GII' is listed twice"),
        (["--vary", f"{R}=1", "--sort"], "--sort: matrix.best: say what to 'maximize' or 'minimize'"),
        ([], "a sweep needs cases"),
    ],
)  # fmt: skip
def test_a_mistake_is_told_and_nothing_is_written(study, invoke, options, message):
    done = invoke("sweep", "press.yaml", *options, "--junit", "report.xml")
    assert done.exit_code == 2
    assert message in done.stderr
    assert not (study / "results").exists()
    (case,) = ElementTree.parse(study / "report.xml").findall(".//testcase")
    assert case.find("error") is not None


def test_run_answers_the_matrix_of_a_study(study, invoke):
    (study / "press.yaml").write_text(STUDY + f"matrix: {{vary: {{{R}: [20, 30]}}}}\n")
    done = invoke("run", "press.yaml", "--no-plots")
    assert done.exit_code == 1
    outcomes = {row["command"]: row["outcome"] for row in rows(done.stdout)}
    assert outcomes == {"kinematics": "done", "sweep": "requirement not met"}
    again = invoke("run", "press.yaml", "--no-plots", "--resume")
    assert again.exit_code == 1
    assert [row["outcome"] for row in rows(again.stdout)] == ["done (kept)", "requirement not met (kept)"]
    verified = invoke("run", "--verify", "results/press")
    assert (verified.exit_code, "NOT MET" in verified.stderr) == (1, True)
    wrong = invoke("check", "press.yaml", "--no-plots", "--set", "matrix.results=[kinematics.B.xx.max]")
    assert wrong.exit_code == 2


def test_cases_of_two_sweeps_are_compared_by_what_varies(study, invoke):
    for name, values in (("old", "30,35"), ("new", "25,30,35")):
        invoke("sweep", "press.yaml", "--vary", f"{R}={values}", "--no-plots", "--out", name)
    done = invoke("compare", "old", "new")
    assert done.exit_code == 1
    told = [(row["column"], row["change"], row["rows"], row["row"]) for row in rows(done.stdout)]
    assert told == [("", "new", "1", f"{R} 25"), ("case", "moved", "2", f"{R} 30")]


def test_an_interrupted_sweep_leaves_its_report(study, invoke, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("mechdesign.experiments.sweep.answers", interrupted)
    done = invoke("sweep", "press.yaml", "--vary", f"{R}=25,30", "--no-plots", "--junit", "report.xml")
    assert done.exit_code == 130
    (case,) = ElementTree.parse(study / "report.xml").findall(".//testcase")
    assert case.find("error").get("type") == "exit code 130"


def test_github_shows_requirements_that_cases_do_not_meet(study, invoke, monkeypatch):
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    done = invoke("run", "press.yaml", "--no-plots", "--set", f"matrix.vary={{{R}: [20, 30]}}")
    assert done.exit_code == 1
    assert "::error file=press.yaml,line=9,col=16::" in done.stderr
    assert "1 of 2 cases do not meet it" in done.stderr


@pytest.mark.nightly
def test_options_are_in_place_of_the_matrix_of_the_study(study, invoke):
    matrix = f"matrix: {{vary: {{{R}: '20:30'}}, method: sobol, samples: 8, results: [kinematics.B.x.max]}}\n"
    (study / "press.yaml").write_text(STUDY + matrix)
    table = rows(invoke("sweep", "press.yaml", "--vary", "mechanism.parameters.l=90,100", "--no-plots").stdout)
    assert [float(row["kinematics.B.x.max"]) for row in table] == pytest.approx([120, 130])
    few = ["--samples", "4", "--no-plots", "--quiet"]
    one, other, same = (
        [row[R] for row in rows(invoke("sweep", "press.yaml", *few, "--seed", seed).stdout)] for seed in "121"
    )
    assert (len(one), one == same, one == other) == (4, True, False)


def test_cases_of_a_file_are_looked_for_where_the_command_is_given(study, invoke):
    (study / "studies").mkdir()
    (study / "press.yaml").rename(study / "studies/press.yaml")
    (study / "studies/built.csv").write_text(f"{R},mechanism.branch\n30,side\n25,follow\n")
    done = invoke("sweep", "studies/press.yaml", "--cases", "studies/built.csv", "--no-plots")
    assert done.exit_code == 0
    assert [row[R] for row in rows(done.stdout)] == ["30", "25"]
    manifest = json.loads((study / "results/press/sweep/manifest.json").read_text())
    assert list(manifest["inputs"]) == ["built.csv"]


@pytest.mark.nightly
def test_pictures_and_report(study, invoke):
    done = invoke(
        "sweep", "press.yaml", "--vary", f"{R}=25,30", "--vary", "mechanism.branch=side,follow", "--quiet", "--report"
    )
    assert done.exit_code == 0
    assert {path.name for path in (study / "results/press/sweep").iterdir()} == {
        ".mechdesign.json",
        "main_effects.png", "manifest.json", "mechanism.png", "report.html", "report.json", "scatter.png", "sweep.csv",
    }  # fmt: skip


@pytest.mark.nightly
def test_the_best_case_is_told_on_the_terminal_and_in_the_report_also_of_what_is_kept(study, invoke):
    vary = ["--vary", f"{R}=25:40:5", "--vary", "mechanism.parameters.l=90:120:10"]
    goals = ["--maximize", "kinematics.B.x.range", "--minimize", "kinematics.B.x.max"]
    for more in ([], ["--resume"]):
        done = invoke("sweep", "press.yaml", *vary, *goals, "--sort", "--report", *more)
        assert done.exit_code == 0
        assert "best of 16 ranked cases is case 13 (r 40, l 90); 4 of them are on the Pareto front" in done.stderr
        table = rows(done.stdout)
        assert (table[0]["case"], table[0]["rank"], table[0]["front"]) == ("13", "1", "1")
        ranks = [int(row["rank"]) for row in table]
        assert ranks == sorted(ranks)
    page = (study / "results/press/sweep/report.html").read_text()
    assert "best case" in page
    assert "cases on the Pareto front" in page
    assert (study / "results/press/sweep/response.png").exists()


@pytest.mark.nightly
def test_the_best_case_is_told_by_sweep_run_and_merge(study, invoke):
    best = "best: {maximize: kinematics.B.x.range}"
    (study / "press.yaml").write_text(STUDY + f"matrix: {{vary: {{{R}: [25, 40, 30]}}, {best}}}\n")
    told = "press: sweep: best of 3 ranked cases is case 2 (r 40)"
    asked = ["press.yaml", "--no-plots"]
    assert told in invoke("sweep", *asked).stderr
    for more in ([], ["--resume"]):
        assert told in invoke("run", *asked, *more).stderr
    for k in (1, 2):
        assert "best of" not in invoke("sweep", *asked, "--out", "parts", "--shard", f"{k}/2").stderr
    for _ in range(2):
        assert told in invoke("merge", *asked, "--out", "parts").stderr


def test_options_are_in_place_of_the_goals_of_the_study(study, invoke):
    best = "best: {minimize: [kinematics.B.x.max, kinematics.B.x.range], sort: true}"
    (study / "press.yaml").write_text(STUDY + f"matrix: {{vary: {{{R}: [25, 30, 28]}}, {best}}}\n")
    table = rows(invoke("sweep", "press.yaml", "--maximize", "kinematics.B.x.max", "--no-plots").stdout)
    assert [row[R] for row in table] == ["30", "28", "25"]
    assert "kinematics.B.x.range" not in table[0]
    table = rows(invoke("sweep", "press.yaml", "--no-plots").stdout)
    assert [row["rank"] for row in table] == ["1", "2", "3"]
    assert table[0][R] == "25"


def test_words_of_cases_have_letters_beyond_the_first_plane(study, invoke):
    faces = ["\N{GRINNING FACE}", "\U0001d4b3"]
    (study / "cases.csv").write_text("\n".join(["name", *faces]))
    matrix = f"matrix.vary={{name: [{', '.join(faces)}]}}"
    for given in (["--vary", f"name={','.join(faces)}"], ["--cases", "cases.csv"], ["--set", matrix]):
        done = invoke("sweep", "press.yaml", *given, "--no-plots")
        assert done.exit_code == 0, done.stderr
        assert [row["name"] for row in rows(done.stdout)] == faces
