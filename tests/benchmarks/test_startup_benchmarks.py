"""How long a user waits before anything happens: `--help` (target: below 0.25 s), and a study's loading."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from mechdesign import load

CONFIGS = Path(__file__).parents[2] / "configs"


def test_help(benchmark) -> None:
    run = benchmark.pedantic(
        subprocess.run, ([sys.executable, "-m", "mechdesign", "--help"],), {"capture_output": True}, rounds=7
    )
    assert run.returncode == 0


@pytest.mark.parametrize("name", ["five_bar", "toggle"])
def test_load_a_study(benchmark, name: str) -> None:
    study = benchmark(load, CONFIGS / f"{name}.yaml")
    assert study.questions
