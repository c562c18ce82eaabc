"""Interrupted optimisations: what was finished is written, --resume goes on and ends with the same bytes."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import mechdesign
from mechdesign.ground.work.journal import NAME, Journal, digest
from mechdesign.questions.optimize.question import VariableFamily

STUDY = """\
mechanism:
  parameters: {r1: 5, r2: 5}
  links: {ground: {O: [0, 0]}, upper: [O, E, r1], fore: [E, P, r2]}
  drives: {theta1: {angle: upper}, theta2: {angle: fore}}
  sketch: {E: [4, 3], P: [6, 8]}
kinematics: {poses: [{theta1: 30, theta2: 60}, {theta1: 40, theta2: 70}], outputs: [P]}
optimize:
  method: METHOD
  variables: {r1: {from: 1, to: 11, NUMBER}, r2: {from: 1, to: 11, NUMBER}}
  maximize: kinematics.P.y
  minimize: kinematics.P.x
  weights: [[1, 1], [1, 3]]
  subject_to: [{result: kinematics.P.y, at_least: 6}]
"""
METHODS = {"grid": "number: 40", "search": "step: 0.1", "pareto": "step: 0.1"}


@pytest.fixture
def interrupt(monkeypatch):
    """Press Ctrl-C when so many batches have been evaluated."""
    evaluate = VariableFamily.__call__

    def press(after):
        calls = []

        def counted(self, designs):
            if len(calls) == after:
                raise KeyboardInterrupt
            calls.append(len(next(iter(designs.values()))))
            return evaluate(self, designs)

        monkeypatch.setattr(VariableFamily, "__call__", counted)
        return calls

    return press


@pytest.fixture
def study(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def write(method="grid"):
        text = STUDY.replace("METHOD", method).replace("NUMBER", METHODS[method])
        path = tmp_path / "arm.yaml"
        path.write_text(text + ("  evaluations: 200\n" if method != "grid" else ""))
        return path

    return write


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.nightly
@pytest.mark.parametrize("method", METHODS)
def test_resumed_results_are_those_of_an_uninterrupted_run(study, invoke, interrupt, method):
    path = study(method)
    arguments = ("optimize", path, "--no-plots", "--jobs", 1)
    calls = interrupt(10**9)
    whole = invoke(*arguments, "--out", "whole")
    assert whole.exit_code == 0, whole.output
    total = len(calls)
    assert total >= 4
    calls = interrupt(3)
    broken = invoke(*arguments, "--out", "again")
    assert broken.exit_code == 130
    assert "--resume goes on" in broken.output
    finished = sum(calls)
    rows = (Path("again") / "designs.csv").read_text().splitlines()
    assert len(rows) == finished + 1
    assert {path.name for path in Path("again").iterdir()} == {".mechdesign.json", "designs.csv", "manifest.json", NAME}
    assert json.loads((Path("again") / "manifest.json").read_text())["interrupted"]
    # A second interrupt loses nothing of the first run.
    interrupt(0)
    assert invoke(*arguments, "--out", "again", "--resume").exit_code == 130
    calls = interrupt(10**9)
    resumed = invoke(*arguments, "--out", "again", "--resume")
    assert resumed.exit_code == 0, resumed.output
    assert len(calls) == total - 3
    assert contents(Path("again")) == contents(Path("whole"))


def test_designs_of_the_finished_part_are_those_of_the_whole(study, invoke, interrupt):
    path = study()
    invoke("optimize", path, "--no-plots", "--jobs", 1, "--out", "whole")
    interrupt(2)
    invoke("optimize", path, "--no-plots", "--jobs", 1, "--out", "part")
    whole, part = (
        np.genfromtxt(Path(folder) / "designs.csv", delimiter=",", skip_header=1, usecols=range(4))
        for folder in ("whole", "part")
    )
    assert (whole[: len(part)] == part).all()


@pytest.mark.parametrize(
    "other", [("--seed", 3), ("--set", "mechanism.parameters.r1=4"), ("--set", "optimize.weights=[[1, 2]]")]
)
def test_another_study_begins_anew(study, invoke, interrupt, other):
    arguments = ("optimize", study(), "--no-plots", "--jobs", 1, "--out", "out", "--resume")
    interrupt(2)
    invoke(*arguments)
    calls = interrupt(10**9)
    done = invoke(*arguments, *other)
    assert done.exit_code == 0
    assert "another study, seed or version; begins anew" in done.output
    assert sum(calls) >= 1600


def test_without_resume_it_begins_anew_and_clears_up(study, invoke, interrupt):
    arguments = ("optimize", study(), "--no-plots", "--jobs", 1, "--out", "out")
    interrupt(2)
    invoke(*arguments)
    calls = interrupt(10**9)
    assert invoke(*arguments).exit_code == 0
    assert sum(calls) >= 1600
    assert not (Path("out") / NAME).exists()


@pytest.mark.parametrize(("bound", "code"), [(0, 0), (1e6, 1)])
def test_what_is_finished_is_not_computed_again(study, invoke, interrupt, bound, code):
    path = study()
    path.write_text(path.read_text() + f"requirements: [{{result: optimize.score, at_least: {bound}}}]\n")
    arguments = ("optimize", path, "--no-plots", "--jobs", 1, "--out", "out")
    first = invoke(*arguments)
    assert first.exit_code == code, first.output
    before = contents(Path("out"))
    calls = interrupt(10**9)
    again = invoke(*arguments, "--resume")
    assert (again.exit_code, again.stdout) == (code, first.stdout)
    assert "whole, and not computed again" in again.stderr
    assert ("NOT MET" in again.stderr) == bool(code)
    assert not calls
    assert contents(Path("out")) == before
    (Path("out") / "best.csv").write_text("spoilt")
    assert invoke(*arguments, "--resume").exit_code == code
    assert sum(calls) >= 1600
    assert contents(Path("out")) == before


@pytest.mark.parametrize(
    "other",
    [("--seed", 3), ("--set", "mechanism.parameters.r1=4"), ("--set", "optimize.weights=[[1, 2]]"), "text", "data"],
)
def test_what_is_finished_of_another_study_is_computed(study, invoke, interrupt, other):
    path = study()
    path.with_name("line.csv").write_text("P.x,P.y\n6,4\n5,5\n")
    path.write_text(path.read_text().replace("sketch:", "targets: {P: {file: line.csv}}\n  sketch:"))
    arguments = ("optimize", path, "--no-plots", "--jobs", 1, "--out", "out", "--resume")
    assert invoke(*arguments).exit_code == 0
    if other == "text":
        path.write_text(path.read_text() + "# more\n")
    elif other == "data":
        path.with_name("line.csv").write_text("P.x,P.y\n6,4\n5,6\n")
    calls = interrupt(10**9)
    done = invoke(*arguments, *(other if isinstance(other, tuple) else ()))
    assert done.exit_code == 0
    assert sum(calls) >= 1600


def test_nothing_finished_leaves_nothing(study, invoke, interrupt):
    interrupt(0)
    done = invoke("optimize", study(), "--no-plots", "--jobs", 1, "--out", "out")
    assert done.exit_code == 130
    assert not Path("out").exists()


def test_an_interrupted_question_is_not_kept_by_run(study, invoke, interrupt):
    path = study()
    arguments = ("run", path, "--no-plots", "--jobs", 1, "--out", "out", "--resume")
    interrupt(2)
    assert invoke(*arguments).exit_code == 130
    calls = interrupt(10**9)
    done = invoke(*arguments)
    assert done.exit_code == 0, done.output
    assert 0 < sum(calls) < 1600
    assert "interrupted" not in json.loads((Path("out") / "optimize" / "manifest.json").read_text())
    calls = interrupt(10**9)
    assert "done (kept)" in invoke(*arguments).stdout
    assert not calls


@pytest.mark.nightly
def test_interrupt_of_a_run_with_workers(study, invoke):
    """A real signal: whatever was finished by then, the resumed results are those of one run."""
    arguments = ("optimize", str(study()), "--no-plots", "--jobs", "2", "--set", "optimize.variables.r1.number=600")
    assert invoke(*arguments, "--out", "whole").exit_code == 0
    command = [sys.executable, "-m", "mechdesign", *arguments, "--out", "again"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        time.sleep(1.5)
        process.send_signal(signal.SIGINT)
        # -SIGINT where it came before the command line was there to hear it.
        assert process.wait(60) in (0, 130, -signal.SIGINT)
    assert invoke(*arguments, "--out", "again", "--resume").exit_code == 0
    assert contents(Path("again")) == contents(Path("whole"))


def test_a_damaged_journal_is_not_used(tmp_path):
    path = tmp_path / NAME
    journal = Journal(path, {"seed": 1})
    key = digest([np.arange(3.0)])
    journal.add(key, np.ones((3, 2)), [""])
    journal.save()
    assert Journal(path, {"seed": 1}, resume=True).recall(key).tolist() == [[1, 1]] * 3
    assert not Journal(path, {"seed": 2}, resume=True).usable
    path.write_bytes(path.read_bytes()[:-40])
    assert not Journal(path, {"seed": 1}, resume=True).usable
    assert Journal(path, {"seed": 1}, resume=True).recall(key) is None


def test_a_full_disk_ends_no_computation(tmp_path):
    """What is kept of it is tried again; in the end it is told."""
    journal = Journal(tmp_path / "file" / NAME, {})
    journal._patience = 0.0
    (tmp_path / "file").write_text("in the way")
    journal.add(b"0" * 16, np.zeros((1, 1)), [])
    with pytest.raises(mechdesign.MechdesignError, match="could not be written"):
        journal.save()
    (tmp_path / "file").unlink()
    journal._patience = 0.0
    journal.add(b"1" * 16, np.ones((1, 1)), [])
    assert Journal(tmp_path / "file" / NAME, {}, resume=True).recall(b"0" * 16) == 0


def test_a_journal_of_other_batches_is_void(tmp_path):
    path = tmp_path / NAME
    journal = Journal(path, {})
    keys = [digest([np.full(2, float(k))]) for k in range(3)]
    for key in keys:
        journal.add(key, np.zeros((2, 1)), [""])
    journal.save()
    again = Journal(path, {}, resume=True)
    assert again.recall(keys[0]) is not None
    assert again.recall(keys[2]) is None
    assert again.recall(keys[2]) is None


def test_api_gives_the_finished_part_with_the_interrupt(study, interrupt):
    interrupt(1)
    with pytest.raises(mechdesign.ground.errors.Interrupted) as stopped:
        mechdesign.optimize(mechdesign.load(study()))
    assert len(stopped.value.result.tables["designs"]) == 384


def test_resume_says_how_often_what_is_finished_is_kept(study, invoke, interrupt):
    arguments = ("optimize", study(), "--no-plots", "--jobs", 1, "--out", "out")
    interrupt(2)
    invoke(*arguments)
    interrupt(10**9)
    done = invoke(*arguments, "--resume")
    assert re.search(r"optimize: goes on after \d+ designs; what is finished is kept every 30 s\n", done.stderr)
    assert "nothing to resume" not in done.stderr
    (Path("out") / "optimum.csv").unlink()
    done = invoke(*arguments, "--resume")
    assert "optimize: nothing to resume, as what is finished is kept every 30 s; begins anew\n" in done.stderr
