"""A new question is one folder and one line: key, command, function, table, picture, report and gate follow."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import mechdesign

LINE = '        Command("mobility", "How free is it?", "Degrees of freedom, links and joints."),\n'
FOLDER = {
    "__init__.py": '''"""How free is it?"""\n''',
    "schema.py": '''
"""The mobility section of the study file."""

from typing import ClassVar, Self

from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.section import Section


class MobilitySection(Section):
    """What is counted."""

    command: ClassVar[str] = "mobility"
    ground: bool = True
    """Whether the ground counts as a link."""

    def checked(self, checker: Checker) -> Self:
        """Nothing in it can contradict the mechanism."""
        return self
''',
    "columns.py": '''
"""The table of mobility and its columns."""

from mechdesign.ground.results import KeyNumber, TableKind

MOBILITY = TableKind.of("mobility", "what moves", ("links", "number of links"), ("freedoms", "degrees of freedom"))
KEY_NUMBERS = (KeyNumber(MOBILITY, "freedoms", "degrees of freedom", "first"),)
''',
    "analysis.py": '''
"""Count what moves."""

from mechdesign.ground.progress import NULL, Progress
from mechdesign.ground.results import Result
from mechdesign.questions.mobility.columns import MOBILITY
from mechdesign.questions.mobility.schema import MobilitySection
from mechdesign.study import Study


def mobility(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Result:
    """Degrees of freedom of a study's mechanism, and its links."""
    count = len(study.mechanism.description.links) - (not MobilitySection.of(study).ground)
    columns = MOBILITY.columns({}, links=[count], freedoms=[study.mechanism.mobility])
    return Result("mobility", {MOBILITY.name: MOBILITY.table(columns)})
''',
    "figures/__init__.py": '''"""Pictures of mobility."""\n''',
    "figures/counts.py": '''
"""What was counted, as bars."""

import numpy as np

from mechdesign.drawing.marks import Axis, Bars, Panel, Picture
from mechdesign.drawing.pictures import View, picture


@picture(View, "counts")
def counts(view: View) -> Picture:
    """Links and degrees of freedom."""
    table = view.result.main
    bars = Bars(np.array([table[name][0] for name in table.names]))
    return Picture("What moves", [Panel([bars], Axis("number"), Axis(words=table.names))])
''',
}
STUDY = """
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
mobility: {ground: false}
requirements: [{result: mobility.freedoms, at_most: 0}]
"""
ASKED = "import mechdesign; print(mechdesign.mobility(mechdesign.load('study.yaml')).main['links'][0])"


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A copy of the package with the question; the study lies beside it."""
    home = Path(mechdesign.__file__).parent
    shutil.copytree(home, tmp_path / "mechdesign", ignore=shutil.ignore_patterns("__pycache__"))
    for name, text in FOLDER.items():
        file = tmp_path / "mechdesign/questions/mobility" / name
        file.parent.mkdir(exist_ok=True, parents=True)
        file.write_text(text.lstrip("\n"))
    shared = tmp_path / "mechdesign/commands.py"
    begin = '        Command(\n            "kinematics"'
    assert begin in shared.read_text()
    shared.write_text(shared.read_text().replace(begin, LINE + begin, 1))
    (tmp_path / "study.yaml").write_text(STUDY)
    return tmp_path


def told(package: Path, *arguments: str, code: int = 0) -> str:
    """What a command of the package with the question says."""
    environment = {**os.environ, "PYTHONPATH": str(package)}
    done = subprocess.run(
        [sys.executable, *arguments], cwd=package, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == code, done.stderr
    return done.stdout + done.stderr


@pytest.mark.slow
def test_a_question_is_a_folder_and_a_line(package: Path) -> None:
    assert told(package, "-c", ASKED) == "3\n"
    said = told(package, "-m", "mechdesign", "mobility", "study.yaml", "--report", "--out", "out", code=1)
    assert "requirement: mobility.freedoms at most 0: NOT MET, worst 1" in said
    assert (package / "out/mobility.csv").read_text() == "links,freedoms\n3,1\n"
    assert {"counts.png", "report.html"} <= {file.name for file in (package / "out").iterdir()}
    page = (package / "out/report.html").read_text()
    assert "How free is it?" in page
    assert "degrees of freedom" in page
    assert "Whether the ground counts as a link" in told(package, "-m", "mechdesign", "docs", "mobility.ground")
    assert "unknown key; did you mean 'ground'?" in told(
        package, "-m", "mechdesign", "check", "study.yaml", "--set", "mobility.grond=true", code=2
    )
    assert "mobility.freedoms" in told(package, "-m", "mechdesign", "run", "study.yaml", "--no-plots", code=1)
