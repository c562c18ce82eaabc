"""The command line with analyses of the test's making: what it does with a result, not the result itself."""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType

import numpy as np
import pytest
from helpers.live_page import FOUR_BAR, Live
from typer.testing import CliRunner

from mechdesign.door.cli.app import app
from mechdesign.drawing import pictures
from mechdesign.drawing.rendering import Gallery
from mechdesign.ground.cautions import Caution
from mechdesign.ground.columns import Column
from mechdesign.ground.results import Result, Table

SLIDER = """\
name: Offset slider-crank
mechanism:
  parameters: {r: 40}
  links:
    ground: {O: [0, 0], G: [0, -20]}
    crank: [O, A, r]
    rod: [A, B, 120]
    slider: {B: [0, 0]}
  joints: {guide: {prismatic: [ground, slider], through: G}}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 40], B: [110, -20]}
kinematics:
  sweep: {theta: {from: 0, to: 90, step: 45}}
"""

GAP = Caution("suspect", "mind the gap")


def answer(command="kinematics", **changes):
    """A small result, with one more column than a pose."""
    columns = (
        Column("theta", np.array([0.0, 45.0, 90.0]), "deg", "drive"),
        Column("B.x", np.array([1 / 3, np.nan, 3.0]), "mm", "position"),
        Column("valid", np.array([True, False, True])),
    )
    defaults = {"tables": {"motion": Table("motion", columns)}, "counts": {"poses": 3, "invalid": 1}}
    return Result(command, **(defaults | changes))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty working directory with one study, slider.yaml."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "slider.yaml").write_text(SLIDER)
    return tmp_path


@pytest.fixture
def analysis(monkeypatch):
    """Put a function in place of a command's analysis; it gets (study, **options)."""

    # What imports the analysis itself must do so before another stands in its place.
    import_module("mechdesign.door.cli.check")

    def install(function, command="kinematics"):
        module = ModuleType(f"mechdesign.questions.{command}.analysis")
        setattr(module, command, function)
        monkeypatch.setitem(sys.modules, module.__name__, module)
        monkeypatch.setattr(pictures, "figures", lambda *given: Gallery())

    install(lambda study, **options: answer())
    return install


@pytest.fixture
def invoke():
    """Run the command line in this process."""
    return lambda *arguments: CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture
def live(browser, tmp_path):
    """A function that opens the live page of a study; at the end nothing complained."""
    opened = []

    def start(text=FOUR_BAR, *, name="bar.yaml", **looks):
        path = tmp_path / name
        path.write_text(text)
        opened.append(Live(browser, path, **looks))
        return opened[-1]

    yield start
    for one in opened:
        one.close()
        assert one.complaints == []
