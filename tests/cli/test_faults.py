"""Faults of processes and files: signals, streams that fail, full disks, two runs in one folder."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from .conftest import SLIDER
from .test_optimize_resume import METHODS, STUDY

if sys.platform != "linux":
    pytest.skip("processes are looked at in /proc", allow_module_level=True)

ARM = STUDY.replace("METHOD", "grid").replace("NUMBER", METHODS["grid"].replace("40", "3000"))
COMMAND = [sys.executable, "-m", "mechdesign"]


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.yaml").write_text(ARM)
    (tmp_path / "slider.yaml").write_text(SLIDER)
    return tmp_path


def children(pid):
    return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def until(condition, seconds=30.0):
    """Wait for a condition, and give what it gives."""
    end = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < end
        time.sleep(0.005)
    return found


def alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except FileNotFoundError:
        return False


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGHUP])
def test_workers_end_with_their_parent(here, number):
    command = [*COMMAND, "optimize", "arm.yaml", "--no-plots", "--jobs", "2", "--out", "out"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        workers = until(lambda: len(found := children(process.pid)) == 2 and found)
        time.sleep(0.3)
        process.send_signal(number)
        # Ends when nobody holds the other end.
        told = process.stderr.read()
        code = process.wait(30)
    until(lambda: not any(map(alive, workers)), 5)
    if number == signal.SIGKILL:
        assert code == -number
    else:
        assert code == 128 + number
        assert "interrupted" in told
    assert "Traceback" not in told
    assert not [path for path in here.rglob("*") if ".tmp" in path.name]


def hears(pid):
    """Whether a process handles SIGTERM, as Python does by itself not."""
    caught = re.search(r"SigCgt:\s*(\w+)", Path(f"/proc/{pid}/status").read_text())
    return int(caught[1], 16) >> (signal.SIGTERM - 1) & 1


@pytest.mark.parametrize("module", ["", "_multiarray_umath", "pydantic_core"])
def test_an_interrupt_during_imports(here, module):
    """It comes while a module is loaded, which its library in the memory shows."""
    command = [*COMMAND, "kinematics", "slider.yaml", "--no-plots"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        until(lambda: hears(process.pid))
        until(lambda: process.poll() is not None or module in Path(f"/proc/{process.pid}/maps").read_text())
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=30)
    assert process.returncode in (0, 130)
    assert "Traceback" not in told
    assert "rror" not in told


BAD = ("closed", "full", "broken")


@pytest.mark.parametrize("stream", [1, 2])
@pytest.mark.parametrize("how", BAD)
def test_no_stream_can_fail_a_run(here, stream, how):
    def spoil():
        if how == "closed":
            os.close(stream)
        elif how == "full":
            os.dup2(os.open("/dev/full", os.O_WRONLY), stream)
        else:
            reader, writer = os.pipe()
            os.close(reader)
            os.dup2(writer, stream)

    (here / "wrong.yaml").write_text(SLIDER.replace("crank: [O, A, r]", "crank: [O, A, q]"))
    command = [*COMMAND, "run", "slider.yaml", "wrong.yaml", "--no-plots", "--junit", "junit.xml"]
    done = subprocess.run(command, capture_output=True, text=True, preexec_fn=spoil, check=False)
    assert done.returncode == 2
    assert 'tests="2"' in (here / "junit.xml").read_text()
    assert (here / "results/slider/kinematics/manifest.json").exists()
    if stream == 2:
        assert done.stdout.startswith("study,command")
    else:
        assert "wrong.yaml:6:19" in done.stderr
        assert "Traceback" not in done.stderr
        assert ("not whole" in done.stderr) == (how == "full")
