"""A process that imports a module while this one computes, and then does what it is given."""

from __future__ import annotations

import os
import pickle
import signal
import sys
from pathlib import Path

import pytest

import mechdesign
from mechdesign.ground.statistics import Request
from mechdesign.ground.work import ahead

MODULE = "module_that_takes_long"
FOUR_BAR = """
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
  branch: follow
kinematics: {outputs: [rocker.angle]}
"""


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A module that nothing has imported."""
    (tmp_path / f"{MODULE}.py").write_text("import os\nPROCESS = os.getpid()\n")
    monkeypatch.syspath_prepend(tmp_path)
    return MODULE


def imported_by() -> tuple[int, int]:
    """This process, and that which imported the module."""
    return os.getpid(), sys.modules[MODULE].PROCESS


def survive(here: int) -> str:
    """A word; every process but one is killed."""
    if os.getpid() != here:
        os.kill(os.getpid(), signal.SIGKILL)
    return "here"


def test_the_work_is_done_where_the_module_was_imported(module: str) -> None:
    with ahead.importing(module, 2):
        process, importer = ahead.call(imported_by)
        assert process == importer != os.getpid()
        assert ahead.call(imported_by) == (process, importer)
    assert module not in sys.modules
    assert ahead.call(os.getpid) == os.getpid()


@pytest.mark.parametrize(("name", "jobs"), [(MODULE, 1), ("sys", 2)])
def test_of_one_job_and_of_a_module_that_is_here_the_work_is_done_here(module: str, name: str, jobs: int) -> None:
    with ahead.importing(name, jobs):
        assert ahead.call(os.getpid) == os.getpid()


def test_what_a_killed_process_left_out_is_done_here(module: str) -> None:
    with ahead.importing(module, 2):
        assert ahead.call(survive, os.getpid()) == "here"


def test_an_error_of_the_work_is_raised(module: str) -> None:
    with ahead.importing(module, 2), pytest.raises(ZeroDivisionError):
        ahead.call(divmod, 1, 0)


def test_a_result_is_the_same_in_another_process() -> None:
    study = mechdesign.load(text=FOUR_BAR)
    result = mechdesign.kinematics(study)
    _, sent = pickle.loads(pickle.dumps((study, result.seen)))
    assert sent.main["rocker.angle"].tolist() == result.main["rocker.angle"].tolist()
    largest = [part.main.scope.follow([Request("rocker.angle")])[0].worst(1)[0] for part in (result, sent)]
    assert largest[0] == largest[1]
