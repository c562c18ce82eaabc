"""`kinematics --animate`: the motion as a GIF, stored and vouched for like every other file."""

import hashlib
import io
import json

import numpy as np
import pytest
from PIL import Image

from mechdesign.questions.kinematics.analysis import kinematics

from .conftest import SLIDER

TURN = SLIDER.replace("to: 90, step: 45", "to: 360, step: 2")
ROCKER = """\
mechanism:
  links: {ground: {O: [0, 0], D: [60, 0]}, crank: [O, A, 50], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: [crank]
  sketch: {A: [20, 45], B: [110, 34]}
kinematics:
  sweep: {crank: {from: -180, to: 180, step: 5}}
"""


def folder_of(root, study="slider"):
    return root / "results" / study / "kinematics"


def frames(data):
    """Every frame of a GIF as an array, and what the file says about itself."""
    with Image.open(io.BytesIO(data)) as picture:
        found = []
        for k in range(picture.n_frames):
            picture.seek(k)
            found.append(np.asarray(picture.convert("RGB")))
        return found, dict(picture.info)


@pytest.mark.nightly
def test_a_turn_is_a_loop_of_bounded_size(folder, invoke):
    (folder / "slider.yaml").write_text(TURN)
    done = invoke("kinematics", "slider.yaml", "--animate", "--quiet")
    assert done.exit_code == 0
    data = (folder_of(folder) / "motion.gif").read_bytes()
    shown, info = frames(data)
    assert len(shown) == 36
    assert info["loop"] == 0
    assert info["duration"] * len(shown) == pytest.approx(3600)
    assert {frame.shape[1] for frame in shown} == {480}
    assert len(data) < 300_000
    # No frame twice, and each on white paper.
    assert len({frame.tobytes() for frame in shown}) == 36
    assert all((frame[2, -3] == 255).all() for frame in shown)
    manifest = json.loads((folder_of(folder) / "manifest.json").read_text())
    assert manifest["files"]["motion.gif"] == hashlib.sha256(data).hexdigest()
    assert manifest["animate"] is True


@pytest.mark.nightly
def test_the_same_study_gives_the_same_bytes(folder, invoke):
    for out in ("one", "two"):
        invoke("kinematics", "slider.yaml", "--animate", "--out", out)
    assert (folder / "one/motion.gif").read_bytes() == (folder / "two/motion.gif").read_bytes()


@pytest.mark.nightly
def test_a_sweep_that_does_not_close_goes_there_and_back(folder, invoke):
    invoke("kinematics", "slider.yaml", "--animate")
    shown, _ = frames((folder_of(folder) / "motion.gif").read_bytes())
    assert len(shown) == 4  # 0, 45, 90 and 45 deg again
    assert (shown[1] == shown[3]).all()
    assert not (shown[0] == shown[2]).all()


@pytest.mark.nightly
def test_poses_that_fail_have_no_frame(folder, invoke):
    (folder / "rocker.yaml").write_text(ROCKER)
    done = invoke("kinematics", "rocker.yaml", "--animate")
    assert done.exit_code == 0
    motion = np.genfromtxt(folder_of(folder, "rocker") / "motion.csv", delimiter=",", names=True)
    valid = int(motion["valid"].sum())
    shown, _ = frames((folder_of(folder, "rocker") / "motion.gif").read_bytes())
    # -180 and 180 deg are one pose; the frames between the ends come twice.
    assert 0 < valid < len(motion)
    assert len(shown) == min(2 * (valid - 1) - 2, 36)


@pytest.mark.parametrize("poses", ["poses: [{theta: 10}, {theta: 20}]", "sweep: {theta: 20}"])
def test_what_is_no_motion_is_told(folder, invoke, poses):
    (folder / "slider.yaml").write_text(SLIDER.replace("sweep: {theta: {from: 0, to: 90, step: 45}}", poses))
    done = invoke("kinematics", "slider.yaml", "--animate")
    assert done.exit_code == 0
    assert "no animation: it needs a sweep of one coordinate or a path" in done.stderr
    assert not (folder_of(folder) / "motion.gif").exists()


@pytest.mark.nightly
def test_without_the_option_an_older_animation_goes(folder, invoke):
    invoke("kinematics", "slider.yaml", "--animate")
    assert (folder_of(folder) / "motion.gif").exists()
    invoke("kinematics", "slider.yaml")
    assert not (folder_of(folder) / "motion.gif").exists()


def test_pictures_wanted_and_not_wanted(folder, invoke):
    done = invoke("kinematics", "slider.yaml", "--animate", "--no-plots")
    assert done.exit_code == 2
    assert "--animate" in done.stderr
    assert not (folder / "results").exists()


@pytest.mark.nightly
def test_run_animates_and_resumes(folder, analysis, invoke):
    computed = []
    analysis(lambda study, **options: computed.append(study) or kinematics(study))
    for arguments, times in ((["--animate"], 1), (["--animate", "--resume"], 1), (["--resume"], 1)):
        done = invoke("run", "slider.yaml", *arguments)
        assert done.exit_code == 0, done.output
        assert len(computed) == times
        assert (folder_of(folder) / "motion.gif").exists()
    invoke("run", "slider.yaml")
    assert not (folder_of(folder) / "motion.gif").exists()
    invoke("run", "slider.yaml", "--animate", "--resume")
    assert len(computed) == 3
    assert (folder_of(folder) / "motion.gif").exists()
