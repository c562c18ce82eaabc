"""`check`: what it says, and the drawing of the sketch as understood."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from .conftest import SLIDER

PNG = b"\x89PNG\r\n\x1a\n"


def test_the_sketch_is_drawn_and_the_file_named(folder, invoke):
    done = invoke("check", "slider.yaml")
    assert done.exit_code == 0
    assert "mobility: 1" in done.stdout
    drawing = Path("results/slider/check/mechanism.png")
    assert str(drawing) in done.stderr
    assert (folder / drawing).read_bytes().startswith(PNG)


@pytest.mark.nightly
def test_where_the_drawing_goes(folder, invoke):
    (folder / "other.yaml").write_text(SLIDER)
    invoke("check", "slider.yaml", "--out", "one")
    assert (folder / "one/mechanism.png").exists()
    invoke("check", "slider.yaml", "other.yaml", "--out", "several")
    assert {path.parent.name for path in (folder / "several").rglob("*.png")} == {"slider", "other"}
    assert not (folder / "results").exists()


def test_without_drawing_nothing_is_written(folder, invoke):
    done = invoke("check", "slider.yaml", "--no-plots")
    assert done.exit_code == 0
    assert "mobility: 1" in done.stdout
    assert done.stderr == ""
    assert not (folder / "results").exists()


def test_quiet_says_nothing_and_draws(folder, invoke):
    done = invoke("check", "slider.yaml", "--quiet")
    assert (done.stdout, done.stderr) == ("", "")
    assert (folder / "results/slider/check/mechanism.png").exists()


def test_a_folder_that_cannot_be_written(folder, invoke):
    (folder / "file").write_text("")
    done = invoke("check", "slider.yaml", "--out", "file/deep")
    assert done.exit_code == 4
    assert "mobility: 1" in done.stdout
    assert "file is a file" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_two_studies_of_one_name_do_not_overwrite_each_other(folder, invoke):
    (folder / "deep").mkdir()
    (folder / "deep/slider.yaml").write_text(SLIDER.replace("120", "130"))
    invoke("check", "slider.yaml")
    before = (folder / "results/slider/check/mechanism.png").read_bytes()
    done = invoke("check", "slider.yaml", "deep/slider.yaml")
    assert done.exit_code == 2
    assert "would overwrite" in done.stderr
    assert (folder / "results/slider/check/mechanism.png").read_bytes() == before


def test_a_wrong_study_has_no_drawing(folder, invoke):
    (folder / "slider.yaml").write_text(SLIDER.replace("[O, A, r]", "[O, A, q]"))
    assert invoke("check", "slider.yaml").exit_code == 2
    assert not (folder / "results").exists()


def test_goals_and_conditions_of_optimize_are_checked_with_the_requirements(folder, invoke):
    section = """\
optimize:
  variables: {r: {from: 30, to: 40, number: 2}}
  minimize: [kinematics.nonsense, r]
  maximize:
    - kinematics.B.x
    - {result: kinematics.extremes.range, where: {output: B.z}}
  subject_to:
    - {result: kinematics.det_J, at_least: 0, at_most: 9}
requirements: [{result: kinematics.B.q, at_least: 0}, {result: optimize.scores, at_least: 0}]
"""
    (folder / "slider.yaml").write_text(SLIDER + section)
    begin = SLIDER.count("\n")
    done = invoke("check", "slider.yaml", "--no-plots")
    assert done.exit_code == 2
    *lines, words = done.stderr.splitlines()
    assert words == "(mechdesign docs optimize.maximize optimize.minimize optimize.subject_to)"
    told = [line.split(": ")[:2] for line in lines]
    assert told == [
        [f"slider.yaml:{begin + 6}:7", "optimize.maximize.1"],
        [f"slider.yaml:{begin + 3}:14", "optimize.minimize.0"],
        [f"slider.yaml:{begin + 8}:7", "optimize.subject_to.0"],
        [f"slider.yaml:{begin + 9}:16", "requirements.0"],
    ]
    assert "kinematics has no det_J: no outputs are named" in done.stderr
    (folder / "slider.yaml").write_text(SLIDER + section.replace("nonsense", "A.y").replace("B.z", "B.x"))
    change = ["--set", "kinematics.jacobian=[B.x]", "--set", "requirements="]
    assert invoke("check", "slider.yaml", "--no-plots", *change).exit_code == 0


def test_requirements_matrix_and_sensitivities_are_checked_in_one_go(folder, invoke):
    (folder / "slider.yaml").write_text(
        SLIDER
        + """\
requirements: [{result: kinematics.B.z, at_least: 1}]
matrix: {vary: {mechanism.parameters.r: [30, 40]}, results: [kinematics.B.y]}
sensitivities: {results: [kinematics.B.x.max], parameters: [q]}
"""
    )
    done = invoke("check", "slider.yaml", "--no-plots", "--quiet")
    assert done.exit_code == 2
    keys = [line.split(": ")[1] for line in done.stderr.splitlines()[:-1]]
    assert keys == ["requirements.0", "matrix.results.0", "sensitivities.parameters.0"]


@pytest.mark.nightly
@pytest.mark.parametrize("arguments", [["--no-plots"], []])
def test_checking_imports_no_solver_of_scipy(folder, arguments):
    code = (
        "import sys\nfrom mechdesign.door.cli.app import main\n"
        f"sys.argv = ['mechdesign', 'check', 'slider.yaml', *{arguments!r}]\n"
        "try:\n    main()\nexcept SystemExit as end:\n    assert not end.code\n"
        "import json\njson.dump([*sys.modules], open('modules.json', 'w'))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    modules = set(json.loads((folder / "modules.json").read_text()))
    assert ("matplotlib" in modules) == (not arguments)
    solvers = {
        f"scipy.{part}" for part in ("integrate", "interpolate", "linalg", "optimize", "sparse", "special", "stats")
    }
    assert not modules & {"rich", *solvers}


def test_centres_and_inertias_that_are_left_out_are_said(folder, invoke):
    (folder / "flap.yaml").write_text("""
units: {length: m}
mechanism:
  links: {ground: {O: [0, 0]}, flap: {from: O, to: P, length: 0.8, mass: 2 kg}}
  drives: [flap]
dynamics: {gravity: [0, -9.81], forward: {duration: 2 s}}
fail_on: [assumed]
""")
    done = invoke("check", "flap.yaml", "--no-plots")
    assert done.exit_code == 1
    assert "flap [0.4, 0] m between O and P; give 'center' [assumed]" in done.stderr
    assert "flap (inertia: rod would be 0.106667 kg*m^2) [assumed]" in done.stderr
