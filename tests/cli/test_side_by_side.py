"""Several studies at a time: the same results and messages, in the same order, and each one's troubles are its own."""

from __future__ import annotations

import csv
import io
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from junitparser import JUnitXml

from .conftest import SLIDER, answer

pty = pytest.importorskip("pty")
if sys.platform != "linux":
    pytest.skip("processes are forked on Linux", allow_module_level=True)

GATE = "requirements:\n  - {result: kinematics.theta, at_most: 80}\n"


def rows(done):
    return [(row["study"], row["command"], row["outcome"]) for row in csv.DictReader(io.StringIO(done.stdout))]


@pytest.fixture
def studies(folder):
    """Studies a to d, of which b does not meet its requirement, c has a dead parameter, and d is wrong."""
    for name, text in {
        "a": SLIDER,
        "b": SLIDER + GATE,
        "c": SLIDER.replace("r: 40", "r: 40, dead: 1"),
        "d": SLIDER.replace("crank: [O, A, r]", "crank: [O, A, q]"),
    }.items():
        (folder / f"{name}.yaml").write_text(text)
    return folder


@pytest.mark.nightly
def test_results_and_messages_do_not_depend_on_the_processes(studies, invoke, monkeypatch):
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    told, files = [], []
    for jobs in (1, 2):
        arguments = (
            "a.yaml",
            "d.yaml",
            "b.yaml",
            "c.yaml",
            "--no-plots",
            "--report",
            "--junit",
            "out/junit.xml",
            "--out",
            "out",
        )
        done = invoke("run", *arguments, "--jobs", jobs)
        assert done.exit_code == 2
        told.append((done.stdout, done.stderr))
        there = {str(path): path.read_bytes() for path in Path("out").rglob("*") if path.is_file()}
        there["out/junit.xml"] = re.sub(rb' time="[\d.]+"', b"", there["out/junit.xml"])
        # The list of what was written has the digest of each file.
        kept = json.loads(there["out/.mechdesign.json"])
        assert kept["files"].pop("junit.xml")
        there["out/.mechdesign.json"] = kept
        files.append(there)
        Path("out").rename(f"out{jobs}")
    assert told[0] == told[1]
    assert files[0] == files[1]
    assert {"out/a/kinematics/motion.csv", "out/b/report.html", "out/index.html", "out/summary.csv"} < files[0].keys()
    assert [row[0] for row in rows(done)] == ["a", "d", "b", "c"]
    lines = done.stderr.splitlines()
    speakers = [line.partition(":")[0] for line in lines if line[:3] in {"a: ", "b: ", "c: "}]
    assert speakers == sorted(speakers)
    assert sum("dead" in line for line in lines) == 2


def test_the_study_that_ends_its_process_is_the_only_one_lost(studies, analysis, invoke):
    def fall(study, **options):
        if study.label == "b":
            os.kill(os.getpid(), signal.SIGKILL)
        return answer()

    analysis(fall)
    done = invoke("run", "a.yaml", "b.yaml", "c.yaml", "--no-plots", "--jobs", 2)
    assert done.exit_code == 4
    assert rows(done) == [("a", "kinematics", "done"), ("b", "run", "failed"), ("c", "kinematics", "done")]
    assert "b: run: the process that computed it was killed" in done.stderr
    # Nothing of it is in the way of the next run.
    analysis(lambda study, **options: answer())
    assert invoke("run", "b.yaml", "--no-plots").exit_code == 1


def test_fail_fast_does_not_wait_for_the_others(studies, analysis, invoke):
    def slow(study, **options):
        if study.label != "b":
            (studies / f"{study.label}.begun").touch()
            time.sleep(60)
        while not (studies / "a.begun").exists():
            time.sleep(0.01)
        return answer()

    analysis(slow)
    begun = time.monotonic()
    done = invoke("run", "a.yaml", "b.yaml", "c.yaml", "--no-plots", "--jobs", 2, "--fail-fast")
    assert time.monotonic() - begun < 30
    assert done.exit_code == 1
    assert rows(done) == [("b", "kinematics", "requirement not met")]
    assert "2 of 3 studies were not answered" in done.stderr
    assert not (studies / "c.begun").exists()
    assert not (studies / "results/a").exists()


# Analyses that take their time, but for study a, and leave what they have when they are interrupted.
PROGRAM = """
import sys, time
from dataclasses import replace
from types import ModuleType
import numpy as np
from mechdesign.door.cli import process
from mechdesign.ground.errors import Interrupted
from mechdesign.ground.columns import Column
from mechdesign.ground.results import Result, Table

def kinematics(study, *, seed, jobs, progress):
    result = Result("kinematics", {"motion": Table("motion", (Column("theta", np.arange(3.0), "deg"),))})
    progress.start(100, "poses")
    try:
        for _ in range(100 * (study.label != "a")):
            time.sleep(0.3)
            progress.update(1)
    except KeyboardInterrupt:
        raise Interrupted(replace(result, interrupted="interrupted: some poses")) from None
    return result

module = ModuleType("mechdesign.questions.kinematics.analysis")
module.kinematics = kinematics
sys.modules[module.__name__] = module

def command():
    from mechdesign.door.cli.app import app
    app()

process.run(command)
"""


def begin(*more, **streams):
    """Run PROGRAM with four studies, two at a time."""
    command = [sys.executable, "-c", PROGRAM, "run", "a.yaml", "b.yaml", "c.yaml", "slider.yaml", "--no-plots"]
    return subprocess.Popen([*command, "--jobs", "2", "--junit", "junit.xml", *more], **streams)


def ended(code, told):
    """What is left of a run that was interrupted while b and c were computed."""
    assert code in (130, 143)
    assert "Traceback" not in told
    assert "interrupted; what was finished is whole; 3 of 4 studies were not answered" in told
    assert Path("results/summary.csv").read_text().splitlines()[1:] == ["a,kinematics,done,0,,3,0,results/a/kinematics"]
    assert Path("results/a/kinematics/manifest.json").exists()
    assert JUnitXml.fromfile("junit.xml").errors == 1
    # What was finished of each is kept; of slider nothing was begun.
    assert '"interrupted": "interrupted: some poses"' in Path("results/b/kinematics/manifest.json").read_text()
    assert sorted(path.name for path in Path("results").glob("[!.]*")) == ["a", "b", "c", "summary.csv"]
    assert [path.name for path in Path("results").rglob(".*")] == [".mechdesign.json"]


def test_a_signal_to_the_command_reaches_all(studies):
    with begin(stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        while not Path("results/c/kinematics").exists():
            time.sleep(0.02)
        workers = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        process.terminate()
        told = process.stderr.read()
        code = process.wait(30)
    assert code == 143
    assert len(workers) == 2
    assert not [worker for worker in workers if Path(f"/proc/{worker}").exists()]
    ended(code, told)


def test_the_table_on_a_terminal_and_ctrl_c(studies):
    """The terminal sends Ctrl-C to all processes; its cursor is there again in the end."""
    ours, theirs = pty.openpty()
    environment = os.environ | {"COLUMNS": "80", "LINES": "24", "TERM": "xterm", "CI": ""}
    process = begin(stdout=theirs, stderr=theirs, stdin=theirs, env=environment, start_new_session=True)
    os.close(theirs)
    shown, pressed = b"", False
    while True:
        try:
            part = os.read(ours, 65536)
        except OSError:
            break
        shown += part
        plain = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown.decode(errors="replace"))
        if not pressed and re.search(r"(?s)a +kinematics +done .*b +kinematics +poses .*1 of 4 studies", plain):
            pressed = True
            os.killpg(process.pid, signal.SIGINT)
    os.close(ours)
    ended(process.wait(30), plain)
    assert shown.rindex(b"\x1b[?25h") > shown.rindex(b"\x1b[?25l")


def test_in_ci_there_are_plain_lines(studies, monkeypatch):
    (studies / "b.yaml").unlink()
    (studies / "c.yaml").unlink()
    ours, theirs = pty.openpty()
    command = [sys.executable, "-c", PROGRAM.replace("0.3", "0.015"), "run", "a.yaml", "slider.yaml", "--no-plots"]
    environment = os.environ | {"CI": "true"}
    subprocess.run(command, stdout=subprocess.DEVNULL, stderr=theirs, env=environment, check=True, timeout=120)
    os.close(theirs)
    told = os.read(ours, 65536)
    os.close(ours)
    assert b"\x1b" not in told
    assert b"a: kinematics: 3 rows in results/a/kinematics" in told
