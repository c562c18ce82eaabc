"""One question from the study to files, tables, exit code."""

import hashlib
import io
import json
import os
import re

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from mechdesign.door.cli.app import app
from mechdesign.ground.errors import AssemblyError, MechdesignError
from mechdesign.study import template_path

from .conftest import GAP, SLIDER, answer

REQUIREMENT = "requirements:\n  - {{result: kinematics.B.x, where: {{theta: 90}}, at_least: {}}}\n"


def test_data_goes_to_stdout_as_csv_and_talk_to_stderr(folder, analysis, invoke):
    done = invoke("kinematics", "slider.yaml", "--no-plots")
    assert done.exit_code == 0
    assert done.stdout == "theta,B.x,valid\n0,0.333333333333,1\n45,nan,0\n90,3,1\n"
    assert "slider: kinematics" in done.stderr
    assert (folder / "results/slider/kinematics/motion.csv").read_text() == done.stdout


def test_json_is_one_array_and_nothing_else(folder, analysis, invoke):
    done = invoke("kinematics", "slider.yaml", "--json", "--no-plots")
    assert json.loads(done.stdout)[1] == {"theta": 45.0, "B.x": None, "valid": 0}


def test_quiet_leaves_only_data(folder, analysis, invoke):
    analysis(lambda study, **options: answer(warnings=[GAP]))
    loud = invoke("kinematics", "slider.yaml", "--no-plots")
    assert "slider: kinematics: warning: mind the gap" in loud.stderr
    quiet = invoke("kinematics", "slider.yaml", "--no-plots", "--quiet")
    assert quiet.stderr == ""
    assert quiet.stdout == loud.stdout


def test_options_reach_the_study_and_the_analysis(folder, analysis, invoke):
    seen = {}

    def spy(study, *, seed, jobs, progress):
        seen.update(seed=seed, study_seed=study.seed, jobs=jobs, r=study.parameters.nominal["r"])
        progress.start(3, "poses")
        progress.update(3)
        return answer()

    analysis(spy)
    arguments = (
        "--seed",
        0,
        "--jobs",
        2,
        "--set",
        "mechanism.parameters.r=41",
        "--no-plots",
        "--out",
        "here/and there",
    )
    assert invoke("kinematics", "slider.yaml", *arguments).exit_code == 0
    assert seen == {"seed": 0, "study_seed": 0, "jobs": 2, "r": 41.0}
    content = json.loads((folder / "here/and there/manifest.json").read_text())
    assert content["overrides"] == ["mechanism.parameters.r=41"]


def test_the_manifest_tells_what_was_computed_from_what(folder, analysis, invoke):
    analysis(lambda study, **options: answer(warnings=[GAP]))
    assert invoke("kinematics", "slider.yaml").exit_code == 0
    out = folder / "results/slider/kinematics"
    content = json.loads((out / "manifest.json").read_text())
    assert content["study"]["sha256"] == hashlib.sha256(SLIDER.encode()).hexdigest()
    assert content["study"]["resolved"]["mechanism"]["parameters"] == {"r": 40}
    assert content["command"] == "kinematics"
    assert content["seed"] == 0
    assert content["counts"] == {"poses": 3, "invalid": 1}
    assert content["warnings"] == [{"kind": "suspect", "message": "mind the gap"}]
    assert {"python", "numpy", "scipy", "matplotlib"} <= content["libraries"].keys()
    assert content["tables"]["motion.csv"]["columns"][1] == {"name": "B.x", "unit": "mm", "meaning": "position"}
    assert content["files"].keys() == {"motion.csv", "mechanism.png"}
    for name, digest in content["files"].items():
        assert hashlib.sha256((out / name).read_bytes()).hexdigest() == digest
    assert str(folder) not in (out / "manifest.json").read_text()
    assert {path.name for path in out.iterdir()} == {*content["files"], "manifest.json"}


def test_files_of_an_older_result_are_removed_and_others_kept(folder, analysis, invoke):
    invoke("kinematics", "slider.yaml")
    out = folder / "results/slider/kinematics"
    (out / "notes.txt").write_text("mine")
    invoke("kinematics", "slider.yaml", "--no-plots")
    assert {path.name for path in out.iterdir()} == {"motion.csv", "manifest.json", "notes.txt"}


@pytest.mark.parametrize(("bound", "code", "word"), [(2.5, 0, "met"), (3.5, 1, "NOT MET")])
def test_a_requirement_decides_the_exit_code(folder, analysis, invoke, bound, code, word):
    (folder / "slider.yaml").write_text(SLIDER + REQUIREMENT.format(bound))
    done = invoke("kinematics", "slider.yaml", "--no-plots")
    assert done.exit_code == code
    assert f"{word}, worst 3" in done.stderr
    content = json.loads((folder / "results/slider/kinematics/manifest.json").read_text())
    assert content["requirements"][0]["met"] == (code == 0)


def test_a_requirement_of_a_column_that_is_not_there_is_a_mistake_of_the_study(folder, analysis, invoke):
    (folder / "slider.yaml").write_text(SLIDER + "requirements: [{result: kinematics.B.xx, at_least: 1}]\n")
    done = invoke("kinematics", "slider.yaml", "--no-plots")
    assert done.exit_code == 2
    assert "did you mean 'B.x'" in done.stderr


def test_a_listed_pose_that_fails_is_told_after_the_files_are_written(folder, analysis, invoke):
    analysis(lambda study, **options: answer(failed="pose 2 (theta = 45 deg) cannot be assembled"))
    done = invoke("kinematics", "slider.yaml", "--no-plots", "--quiet")
    assert done.exit_code == 3
    assert "pose 2 (theta = 45 deg) cannot be assembled" in done.stderr
    assert (folder / "results/slider/kinematics/motion.csv").exists()


@pytest.mark.parametrize(
    ("error", "code"),
    [(AssemblyError("no feasible design"), 3), (MechdesignError("no convergence"), 4), (KeyboardInterrupt(), 130)],
)
def test_what_an_analysis_raises_becomes_a_line_and_an_exit_code(folder, analysis, invoke, error, code):
    def fail(study, **options):
        raise error

    analysis(fail)
    done = invoke("kinematics", "slider.yaml")
    assert done.exit_code == code
    assert "Traceback" not in done.output
    assert (str(error) or "interrupted") in done.stderr
    assert not (folder / "results").exists()


def test_what_nobody_foresaw_asks_to_be_reported_in_one_line(folder, analysis, invoke):
    analysis(lambda study, **options: 1 / 0)
    done = invoke("kinematics", "slider.yaml")
    assert done.exit_code == 4
    assert "internal error: ZeroDivisionError: division by zero" in done.stderr
    assert "please report it" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_a_wrong_study_computes_nothing_and_tells_every_mistake(folder, analysis, invoke):
    (folder / "slider.yaml").write_text(SLIDER.replace("step: 45", "stepp: 45").replace("kinematics:", "kinematic:"))
    done = invoke("kinematics", "slider.yaml")
    assert done.exit_code == 2
    assert done.stderr.startswith("slider.yaml:12:1: kinematic: unknown key")
    assert not (folder / "results").exists()


def test_a_study_that_is_not_there(folder, invoke):
    done = invoke("kinematics", "nowhere.yaml")
    assert done.exit_code == 2
    assert "nowhere.yaml: cannot be read" in done.stderr


@pytest.mark.parametrize("arguments", [["--jobs", "0"], ["--seed", "-1"], ["--seed", "x"], ["--nonsense"]])
def test_wrong_options_are_exit_code_two(folder, invoke, arguments):
    assert invoke("kinematics", "slider.yaml", *arguments).exit_code == 2


def test_a_directory_that_cannot_be_written_is_found_before_computing(folder, analysis, invoke):
    analysis(lambda study, **options: pytest.fail("computed in vain"))
    (folder / "file").write_text("")
    done = invoke("kinematics", "slider.yaml", "--out", "file/deep/results")
    assert done.exit_code == 4
    assert "file is a file" in done.stderr


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="needs a directory in which nobody may write")
def test_a_write_that_fails_is_a_line(folder, analysis, invoke):
    done = invoke("kinematics", "slider.yaml", "--out", "/proc/self/results", "--no-plots")
    assert done.exit_code == 4
    assert len(done.stderr.splitlines()) == 1


def test_study_left_out(folder, analysis, invoke):
    built_in = invoke("kinematics", "--no-plots")
    assert built_in.stderr.splitlines()[0] == "study: the built-in two-link arm (no study.yaml here)"
    assert (folder / "results/two_link_arm/kinematics/motion.csv").exists()
    (folder / "study.yaml").write_text(SLIDER)
    here = invoke("kinematics", "--no-plots")
    assert here.stderr.splitlines()[0] == "study: study.yaml"
    assert (folder / "results/study/kinematics/motion.csv").exists()


def test_the_same_study_gives_the_same_bytes(folder, analysis, invoke):
    for out in ("one", "two"):
        assert invoke("kinematics", "slider.yaml", "--out", out).exit_code == 0
    for path in (folder / "one").iterdir():
        assert path.read_bytes() == (folder / "two" / path.name).read_bytes()


def test_an_interrupted_write_leaves_no_half_file(folder, analysis, invoke, monkeypatch):
    invoke("kinematics", "slider.yaml", "--no-plots")
    out = folder / "results/slider/kinematics"
    before = (out / "motion.csv").read_bytes()
    analysis(lambda study, **options: answer(tables=_shifted()))
    monkeypatch.setattr(os, "replace", _interrupt)
    assert invoke("kinematics", "slider.yaml", "--no-plots").exit_code == 130
    assert (out / "motion.csv").read_bytes() == before
    assert {path.name for path in out.iterdir()} == {"motion.csv", "manifest.json"}


def _interrupt(*arguments):
    raise KeyboardInterrupt


def _shifted():
    table = answer().main
    columns = tuple(type(c)(c.name, np.flip(c.values)) for c in table.columns)
    return {"motion": type(table)("motion", columns)}


def test_a_study_on_standard_input(folder, analysis):
    done = CliRunner().invoke(app, ["kinematics", "-", "--no-plots"], input=SLIDER)
    assert done.exit_code == 0, done.output
    assert (folder / "results/Offset_slider-crank/kinematics/motion.csv").exists()
    wrong = CliRunner().invoke(app, ["check", "-"], input=SLIDER.replace("O, A, r", "O, A, q"))
    assert wrong.exit_code == 2
    assert wrong.stderr.startswith("<study>:6:19: mechanism.links.crank")


@pytest.mark.nightly
def test_pictures_as_vectors_are_the_same_bytes_at_every_run(folder, invoke):
    for out in ("one", "two"):
        done = invoke("kinematics", template_path("two_link_arm"), "--format", "svg,pdf", "--out", out)
        assert done.exit_code == 0, done.output
    files = {path.name: path.read_bytes() for path in (folder / "one").iterdir()}
    assert files == {path.name: path.read_bytes() for path in (folder / "two").iterdir()}
    assert files["mechanism.svg"].startswith(b"<?xml")
    assert files["mechanism.pdf"].startswith(b"%PDF")
    assert not any(name.endswith(".png") for name in files)


@pytest.mark.nightly
def test_pictures_for_paper_are_as_wide_as_a_column(folder, invoke):
    wide = 88 / 25.4  # inches
    asked = ("run", "slider.yaml", "--style", "paper", "--format", "png,svg,pdf", "--out", "out")
    assert invoke(*asked).exit_code == 0
    png = Image.open(io.BytesIO((folder / "out/kinematics/mechanism.png").read_bytes()))
    assert png.width / png.info["dpi"][0] == pytest.approx(wide, abs=1 / 300)
    svg = (folder / "out/kinematics/mechanism.svg").read_text()
    assert float(re.search(r'<svg [^>]*width="([0-9.]+)pt"', svg)[1]) == pytest.approx(72 * wide, abs=1e-3)
    pdf = (folder / "out/kinematics/mechanism.pdf").read_bytes()
    assert float(re.search(rb"/MediaBox \[ 0 0 ([0-9.]+) ", pdf)[1]) == pytest.approx(72 * wide, abs=1e-3)
    assert json.loads((folder / "out/kinematics/manifest.json").read_text())["style"] == "paper"
    assert "(kept)" in invoke(*asked, "--resume").stdout
    assert "(kept)" not in invoke("run", "slider.yaml", "--format", "png,svg,pdf", "--out", "out", "--resume").stdout


def test_formats_that_are_none_are_refused(folder, invoke):
    done = invoke("kinematics", "slider.yaml", "--format", "png,jpg")
    assert done.exit_code == 2
    assert "--format takes png, svg, pdf or several with commas between, not 'jpg'" in done.stderr
    assert invoke("kinematics", "slider.yaml", "--format", "svg", "--no-plots").exit_code == 2
    done = invoke("check", "slider.yaml", "--style", "poster")
    assert done.exit_code == 2
    assert "--style takes screen or paper, not 'poster'" in done.stderr
