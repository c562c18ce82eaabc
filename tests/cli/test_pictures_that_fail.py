"""A picture that cannot be drawn costs neither tables nor other pictures, and is told by its name."""

from __future__ import annotations

import hashlib
import importlib
import json
import os

import pytest

STUDY = "slider.yaml"
TABLES = {"motion.csv", "extremes.csv"}
PICTURES = {"motion.png", "paths.png", "mechanism.png", "motion.gif"}


def failing(*arguments, **options):
    raise RuntimeError("no   such\nfont")


@pytest.mark.parametrize(
    ("module", "function", "lost", "name"),
    [
        ("questions.kinematics.figures.curves", "motion_curves", "motion.png", "motion"),
        ("questions.kinematics.figures.paths", "paths_panel", "paths.png", "paths"),
        ("drawing.mechanism", "mechanism_picture", "mechanism.png", "mechanism.png"),
        ("questions.kinematics.figures.animation", "animation", "motion.gif", "motion.gif"),
    ],
)
def test_one_picture_fails(folder, invoke, monkeypatch, module, function, lost, name):
    monkeypatch.setattr(importlib.import_module(f"mechdesign.{module}"), function, failing)
    done = invoke("kinematics", STUDY, "--animate")
    assert done.exit_code == 0, done.output
    (told,) = [line for line in done.stderr.splitlines() if "could not be drawn" in line]
    who, _, told = told.removesuffix(" [undrawn]").partition(" warning: ")
    assert who == "slider: kinematics:"
    assert told.startswith(f"picture {name} could not be drawn: internal error: RuntimeError: no such font")
    assert "no animation" not in done.stderr
    out = folder / "results/slider/kinematics"
    files = {path.name for path in out.iterdir()} - {"manifest.json"}
    assert files >= TABLES
    assert files & PICTURES == PICTURES - set(lost.split())
    manifest = json.loads((out / "manifest.json").read_text())
    assert manifest["warnings"] == [{"kind": "undrawn", "message": told}]
    assert manifest["files"] == {each: hashlib.sha256((out / each).read_bytes()).hexdigest() for each in files}


def test_what_pictures_share_fails(folder, invoke, monkeypatch):
    from mechdesign.questions.kinematics.figures.view import MotionView

    monkeypatch.setattr(MotionView, "sweep", property(failing))
    done = invoke("kinematics", STUDY)
    assert done.exit_code == 0, done.output
    assert done.stderr.count("could not be drawn: internal error: RuntimeError: no such font") >= 2
    files = {path.name for path in (folder / "results/slider/kinematics").iterdir()}
    assert files >= TABLES
    assert files & PICTURES == {"mechanism.png"}


@pytest.mark.nightly
def test_every_picture_fails(folder, invoke, monkeypatch):
    from mechdesign.drawing import style

    invoke("kinematics", STUDY)
    monkeypatch.setattr(style, "encoded", failing)
    done = invoke("kinematics", STUDY)
    assert done.exit_code == 0
    for name in ("motion.png", "paths.png", "mechanism.png"):
        assert f"picture {name} could not be drawn" in done.stderr
    # Those of the older result are not left beside the new tables.
    assert not {path.name for path in (folder / "results/slider/kinematics").iterdir()} & PICTURES


def test_check_tells_a_drawing_that_fails(folder, invoke, monkeypatch):
    from mechdesign.drawing import mechanism

    monkeypatch.setattr(mechanism, "sketch_picture", failing)
    done = invoke("check", STUDY)
    assert done.exit_code == 0
    assert "warning: picture mechanism.png could not be drawn: internal error: RuntimeError" in done.stderr


@pytest.mark.nightly
def test_tables_stand_when_the_process_ends_among_the_pictures(folder, invoke, monkeypatch):
    from mechdesign.questions.kinematics.figures import curves

    def interrupt(*arguments):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(curves, "motion_curves", interrupt)
        assert invoke("run", STUDY).exit_code == 130
    out = folder / "results/slider/kinematics"
    assert {path.name for path in out.iterdir()} >= TABLES
    assert "the run ended before its pictures were written" in (out / "manifest.json").read_text()
    before = os.stat(out / "motion.csv").st_ino
    # They are whole for who wants tables alone, and computed again for who wants pictures too.
    assert "not computed again" in invoke("run", STUDY, "--resume", "--no-plots").stderr
    assert "not computed again" not in invoke("run", STUDY, "--resume").stderr
    assert os.stat(out / "motion.csv").st_ino != before
    assert (out / "motion.png").exists()
