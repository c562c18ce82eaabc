"""Warnings that fail: `fail_on` of a study and `--strict`, in exit codes, reports and what is kept."""

from __future__ import annotations

import json

import pytest
from junitparser import JUnitXml

from mechdesign.ground.cautions import Caution

from .conftest import GAP, SLIDER, answer

LIMIT = Caution("unassembled", "1 of 3 poses are not valid", "motion", 1, "theta = 45 deg")
SAID = "slider: kinematics: requirement: warnings of kind unassembled at most 0: NOT MET, worst 1 (1 of 3 poses are not"


@pytest.fixture
def warned(folder, analysis):
    """Answers with a warning of two kinds."""
    analysis(lambda study, **options: answer(warnings=[GAP, LIMIT]))
    return folder


def test_a_kind_that_the_study_lists_fails_one_question(warned, invoke):
    assert invoke("kinematics", "slider.yaml", "--no-plots").exit_code == 0
    done = invoke("kinematics", "slider.yaml", "--no-plots", "--quiet", "--set", "fail_on=[unassembled, disagree]")
    assert done.exit_code == 1
    assert SAID in done.stderr
    assert "disagree" not in done.stderr
    content = json.loads((warned / "results/slider/kinematics/manifest.json").read_text())
    assert content["warnings"][1] == {
        "kind": "unassembled", "message": LIMIT.message, "table": "motion", "row": 1, "pose": "theta = 45 deg",
    }  # fmt: skip
    assert [(each["requirement"], each["met"], each["worst"]) for each in content["requirements"]] == [
        ("warnings of kind unassembled at most 0", False, 1), ("warnings of kind disagree at most 0", True, 0),
    ]  # fmt: skip


def test_a_run_tells_it_in_its_summary_its_junit_file_and_its_page(warned, invoke):
    (warned / "slider.yaml").write_text(SLIDER + "fail_on: unassembled\n")
    done = invoke("run", "slider.yaml", "--junit", "junit.xml", "--report", "--no-plots")
    assert done.exit_code == 1
    assert "requirement not met,1,0/1,3,2," in done.stdout
    (suite,) = JUnitXml.fromfile("junit.xml")
    assert [(case.name, bool(case.result)) for case in suite] == [
        ("kinematics", False), ("kinematics: warnings of kind unassembled at most 0", True),
    ]  # fmt: skip
    page = (warned / "results/slider/report.html").read_text()
    assert "0 of 1 requirement met" in page
    assert "warnings of kind unassembled" in page


def test_strict_fails_by_every_warning_and_what_is_kept_is_judged_anew(warned, invoke):
    asked = "run", "slider.yaml", "--no-plots", "--resume", "--set", "fail_on=disagree"
    assert invoke(*asked).exit_code == 0
    strict = invoke(*asked, "--strict")
    assert strict.exit_code == 1
    assert "(kept)" in strict.stdout
    assert "warnings at most 0: NOT MET, worst 2 (mind the gap; and 1 more)" in strict.stderr
    assert invoke(*asked).exit_code == 0


def test_a_picture_that_cannot_be_drawn_is_a_warning_too(folder, analysis, invoke, monkeypatch):
    from mechdesign.drawing import mechanism

    def fails(*_):
        raise RuntimeError("no ink")

    monkeypatch.setattr(mechanism, "mechanism_picture", fails)
    done = invoke("kinematics", "slider.yaml", "--set", "fail_on=undrawn")
    assert done.exit_code == 1
    assert "picture mechanism.png could not be drawn" in done.stderr
    content = json.loads((folder / "results/slider/kinematics/manifest.json").read_text())
    assert [each["met"] for each in content["requirements"]] == [False]


def test_check_fails_by_its_own_doubts(folder, invoke):
    (folder / "slider.yaml").write_text(SLIDER.replace("parameters: {r: 40}", "parameters: {r: 40, idle: 1}"))
    assert invoke("check", "slider.yaml", "--no-plots").exit_code == 0
    done = invoke("check", "slider.yaml", "--no-plots", "--strict")
    assert done.exit_code == 1
    assert "nothing uses parameter 'idle' [suspect]" in done.stderr
    assert invoke("check", "slider.yaml", "--no-plots", "--set", "fail_on=singular").exit_code == 0


def test_github_sees_it_at_the_key(warned, invoke, monkeypatch):
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    (warned / "slider.yaml").write_text(SLIDER + "fail_on: unassembled\n")
    lines = invoke("kinematics", "slider.yaml", "--no-plots").stderr.splitlines()
    (told,) = [line for line in lines if line.startswith("::error")]
    assert f"line={len(SLIDER.splitlines()) + 1},col=10::fail_on: requirement: warnings of kind unassembled" in told
