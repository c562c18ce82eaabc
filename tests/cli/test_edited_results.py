"""Folders of results that were edited, or that a study has left behind: no verdict of theirs is taken on trust."""

from __future__ import annotations

import hashlib
import json
import shutil

import pytest
from junitparser import JUnitXml

from mechdesign.ground.cautions import Caution

from .conftest import SLIDER, answer

NOT_MET = "kinematics.extremes.B.x.max at most 100"
GATE = "requirements: [{result: kinematics.extremes.B.x.max, at_most: 100}]\n"
CRANK_LOADED = "dynamics: {loads: [{at: B, force: [-10, 0]}]}\n"


def edit(path, change):
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content, indent=2))


def met(content):
    content["requirements"][0] |= {"met": True, "worst": 99.0, "margin": 1.0}


def silent(content):
    content["warnings"] = []


def assembled(content):
    content["failed"] = ""


@pytest.mark.parametrize(
    ("change", "code"), [(met, 1), (silent, 1), (assembled, 3), (lambda content: content.pop("sha256"), 1)]
)
def test_resume_computes_again_where_the_manifest_was_edited(folder, analysis, invoke, change, code):
    (folder / "slider.yaml").write_text(SLIDER + "requirements: [{result: kinematics.theta, at_most: 80}]\n")
    computed = []
    more = {"failed": "pose 2 cannot be assembled"} if code == 3 else {"warnings": [Caution("suspect", "a gap")]}
    analysis(lambda study, **options: computed.append(study) or answer(**more))
    asked = ("run", "slider.yaml", "--no-plots", "--resume", "--strict")
    for _ in range(2):
        assert invoke(*asked).exit_code == code
    assert len(computed) == 1
    edit(folder / "results/slider/kinematics/manifest.json", change)
    assert invoke(*asked).exit_code == code
    assert len(computed) == 2


def test_resume_computes_again_where_a_table_and_its_hash_were_edited(folder, invoke):
    """The worst pose is between two rows, so that the table alone could not say it either."""
    (folder / "slider.yaml").write_text(SLIDER + GATE)
    asked = ("run", "slider.yaml", "--no-plots", "--resume")
    assert invoke(*asked).exit_code == 1
    place = folder / "results/slider/kinematics"
    whole = (place / "extremes.csv").read_bytes()
    (place / "extremes.csv").write_bytes(whole.replace(b"B.x,", b"C.x,"))

    def hashed(content):
        content["files"]["extremes.csv"] = hashlib.sha256((place / "extremes.csv").read_bytes()).hexdigest()
        met(content)

    edit(place / "manifest.json", hashed)
    assert invoke(*asked).exit_code == 1
    assert (place / "extremes.csv").read_bytes() == whole


@pytest.mark.parametrize("change", [None, met])
def test_verify_judges_and_fails_where_a_requirement_is_not_met(folder, invoke, change):
    (folder / "slider.yaml").write_text(SLIDER + GATE)
    assert invoke("run", "slider.yaml", "--no-plots", "--out", "kept").exit_code == 1
    if change is not None:
        edit(folder / "kept/kinematics/manifest.json", change)
    done = invoke("run", "--verify", "kept", "--junit", "report.xml", "--quiet")
    assert done.exit_code == 1
    assert f"kept/kinematics: requirement: {NOT_MET}: NOT MET, worst 158.3" in done.stderr
    assert f"kinematics,,{NOT_MET},not met" in done.stdout
    assert JUnitXml.fromfile("report.xml").failures == 1


def test_verify_tells_what_is_met_and_passes(folder, invoke):
    (folder / "slider.yaml").write_text(SLIDER + GATE.replace("100", "160"))
    assert invoke("run", "slider.yaml", "--no-plots", "--out", "kept").exit_code == 0
    done = invoke("run", "--verify", "kept")
    assert (done.exit_code, "at most 160: met, worst 158.3" in done.stderr) == (0, True)


def test_verify_is_as_strict_as_the_run_was(folder, invoke):
    (folder / "slider.yaml").write_text(SLIDER.replace("parameters: {r: 40}", "parameters: {r: 40, idle: 1}"))
    for strict in ((), ("--strict",)):
        code = invoke("run", "slider.yaml", "--no-plots", "--out", "kept", *strict).exit_code
        assert code == len(strict)
        assert invoke("run", "--verify", "kept").exit_code == code


def test_verify_of_poses_that_cannot_be_assembled_is_the_code_of_the_run(folder, invoke):
    poses = "kinematics: {poses: [{theta: 0}, {B.x: 900}]}\n"
    (folder / "slider.yaml").write_text(SLIDER[: SLIDER.index("kinematics:")] + poses)
    assert invoke("run", "slider.yaml", "--no-plots", "--out", "kept").exit_code == 3
    assert invoke("run", "--verify", "kept").exit_code == 3


def test_results_of_a_question_that_is_no_longer_asked_are_named(folder, invoke):
    study = folder / "slider.yaml"
    study.write_text(SLIDER + CRANK_LOADED + GATE.replace("100", "160"))
    assert invoke("run", "slider.yaml", "--no-plots").exit_code == 0
    shutil.copytree(folder / "results/slider", folder / "before")
    study.write_text(SLIDER + GATE.replace("100", "160"))
    done = invoke("run", "slider.yaml", "--no-plots")
    told = "results/slider/dynamics answers a question that the study does not ask; remove it [stale]"
    assert (done.exit_code, f"slider: warning: {told}" in done.stderr) == (0, True)
    for more in (("--strict",), ("--set", "fail_on=stale")):
        assert invoke("run", "slider.yaml", "--no-plots", *more).exit_code == 1
    assert invoke("run", "slider.yaml", "--no-plots").exit_code == 0
    for arguments in (("compare", "before", "results/slider"), ("run", "--verify", "results/slider")):
        done = invoke(*arguments)
        assert done.exit_code == 1
        assert "dynamics: stale: the study of kinematics does not ask it" in done.stderr
    shutil.rmtree(folder / "results/slider/dynamics")
    done = invoke("run", "slider.yaml", "--no-plots", "--strict")
    assert (done.exit_code, "stale" in done.stderr) == (0, False)


def test_an_answer_to_the_same_study_is_not_stale_though_it_does_not_ask(folder, invoke):
    (folder / "slider.yaml").write_text(SLIDER[: SLIDER.index("kinematics:")] + CRANK_LOADED)
    assert invoke("kinematics", "slider.yaml", "--no-plots").exit_code == 0
    done = invoke("run", "slider.yaml", "--no-plots", "--strict")
    assert "[stale]" not in done.stderr
