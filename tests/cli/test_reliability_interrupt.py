"""Ctrl-C in a simulation that would take minutes: what was drawn is a result, and memory stays bounded."""

import csv
import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from threading import Timer

import pytest

pty = pytest.importorskip("pty")
if not Path("/proc/self/status").exists():
    pytest.skip("memory is read from /proc", allow_module_level=True)

SECONDS = 120
ARM = Path(__file__).parents[2] / "configs" / "two_link_arm.yaml"


def interrupted(folder, stage, *changes):
    """Exit code and kilobytes of a command on a pseudo-terminal, interrupted when it tells of a stage (a pattern)."""
    controller, terminal = pty.openpty()
    command = [sys.executable, "-m", "mechdesign", "reliability", str(ARM), "--out", str(folder)]
    command += [part for change in changes for part in ("--set", change)]
    # A CI server gets no bar.
    person = {**os.environ, "CI": "", "TERM": "xterm"}
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=terminal, env=person)
    os.close(terminal)
    # A command that hears of no interrupt goes on for minutes.
    end = Timer(SECONDS, process.kill)
    end.start()
    told = b""
    while not re.search(stage, told):
        told += os.read(controller, 4096)
    memory = re.search(r"VmHWM:\s*(\d+)", Path(f"/proc/{process.pid}/status").read_text(encoding="utf-8"))
    process.send_signal(signal.SIGINT)
    while True:
        # A pseudo-terminal ends by an error when nobody holds its other end.
        try:
            if not os.read(controller, 4096):
                break
        except OSError:
            break
    os.close(controller)
    end.cancel()
    assert memory is not None
    return process.wait(60), int(memory[1])


@pytest.mark.nightly
def test_a_billion_samples_interrupted(tmp_path):
    code, kilobytes = interrupted(tmp_path, rb"[1-9]\d*%", "reliability.samples=1000000000")
    assert code == 130
    assert kilobytes < 400 * 1024
    with (tmp_path / "reliability.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["method"] == "monte_carlo"]
    manifest = json.loads((tmp_path / "manifest.json").read_text(encoding="utf-8"))
    drawn = [int(row["samples"]) for row in rows]
    # All poses come forward together, chunk by chunk.
    assert drawn[0] > 0
    assert max(drawn) - min(drawn) <= 20_000
    assert manifest["counts"]["samples"] == sum(drawn)
    assert manifest["interrupted"].startswith(f"interrupted: {sum(drawn)} samples")
    low, value, high = (float(rows[0][name]) for name in ("failure_low", "failure", "failure_high"))
    assert low < value < high
    assert not list(tmp_path.glob("*.png"))
