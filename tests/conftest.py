"""Hypothesis: no deadlines, for machines are noisy; in CI the same examples at every run, to repeat it by.

Linear algebra keeps to one thread: the matrices are small, and several workers share the processors.
`--budget 30m` is how long the random searches of `tests/hunt` go on, `--cases` how many each looks at.
What is imported and collected is never garbage: the collector need not go through it at every study.
Signals are as on a terminal: where they are ignored, as of a job in the background, commands that are tested would
ignore them too.
"""

from __future__ import annotations

import gc
import os
import re
import shutil
import signal
from collections.abc import Iterator
from contextlib import nullcontext
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pytest
from hypothesis import settings

try:
    from playwright.sync_api import sync_playwright
except ImportError:
    sync_playwright = None

if TYPE_CHECKING:
    from playwright.sync_api import Browser

settings.register_profile("here", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "here")

signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP"):  # Windows has none
    signal.signal(signal.SIGHUP, signal.SIG_DFL)

SECONDS = {"s": 1.0, "m": 60.0, "h": 3600.0}  # of the units that --budget takes
# Of each generation of the garbage collector, in place of 700, 10, 10.
THRESHOLDS = (20_000, 20, 50)
BROWSERS = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
# Tests that took a third of a second or more where they were measured, and are left to the night.
NIGHTLY = Path(__file__).with_name("nightly.txt")
ROOMS = re.compile(r"^\s*from (mechdesign\.|helpers\.(designs|limit_states|random_|regions))", re.MULTILINE)
ABSENT = "no browser: install Debian's chromium-headless-shell and pip's playwright to look at the pages"


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """One browser for all tests of a file."""
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None or sync_playwright is None:
        pytest.skip(ABSENT)
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=found, args=["--no-sandbox", "--disable-gpu"])
        yield opened
        opened.close()


@pytest.fixture(autouse=True)
def silent(request: pytest.FixtureRequest) -> Iterator[None]:
    """NumPy does not warn where a file asks rooms of the package, which questions ask the same way."""
    with np.errstate(all="ignore") if asks_rooms(request.path) else nullcontext():
        yield


@cache
def asks_rooms(path: Path) -> bool:
    """Whether a file of tests imports rooms of the package, or helpers that do."""
    return ROOMS.search(path.read_text(encoding="utf-8")) is not None


def seconds_of(text: str) -> float:
    """Seconds of `90s`, `30m` or `2h`."""
    return float(text[:-1]) * SECONDS[text[-1]]


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--budget", type=seconds_of, default=None, help="time for the random searches of tests/hunt: 90s, 30m, 2h"
    )
    parser.addoption("--cases", type=int, default=None, help="cases of each random search of tests/hunt")
    parser.addoption("--first", type=int, default=0, help="seed of the first case")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item], config: pytest.Config) -> None:
    """Tests of the list are nightly ones; a line that names no test of a file is an error."""
    listed = set(NIGHTLY.read_text(encoding="utf-8").splitlines())
    for item in items:
        if item.nodeid in listed:
            item.add_marker(pytest.mark.nightly)
    if not any("::" in argument for argument in config.args):
        read = {item.nodeid.partition("::")[0] for item in items}
        lost = {line for line in listed if line.partition("::")[0] in read} - {item.nodeid for item in items}
        if lost:
            raise pytest.UsageError(f"{NIGHTLY.name} names no test: {min(lost)}")


def pytest_collection_finish() -> None:
    gc.collect()
    gc.freeze()
    gc.set_threshold(*THRESHOLDS)
