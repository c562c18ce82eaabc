"""No line of a library reaches a user: neither its warnings nor the paths of its files, whatever the numbers.

Each test is a process of its own, in which warnings are as a user has them; pytest makes them errors.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from itertools import product
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CONFIGS = sorted((ROOT / "configs").rglob("*.yaml"))
LIBRARY = re.compile(
    r"Warning:|Traceback|internal error|site-packages|[/\\]mechdesign[/\\]\w+[/\\].*\.py|lib[/\\]python"
)
# Commands in a row; each says first which it is.
COMMANDS = """
import json, sys
from mechdesign.door.cli import process
from mechdesign.door.cli.app import app

def command():
    for words in json.load(sys.stdin):
        print("$", *words, file=sys.stderr)
        try:
            app(words)
        except SystemExit as end:
            print("exit code", end.code, file=sys.stderr)

process.run(command)
"""
# Studies in Python, without the command's settings.
QUESTIONS = """
import json, sys
import mechdesign

for text, overrides, questions in json.load(sys.stdin):
    print("$", overrides, file=sys.stderr)
    try:
        study = mechdesign.load(text=text, overrides=overrides)
        for question in questions:
            getattr(mechdesign, question)(study)
    except mechdesign.MechdesignError as error:
        print(error.exit_code, file=sys.stderr)
"""
FOUR_BAR = """
mechanism:
  parameters: {a: 30}
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: {from: O, to: A, length: a, mass: 1 kg}, rod: [A, B, 90],
          rocker: {from: D, to: B, length: 60, mass: 2 kg}}
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
  measures: {q: "B.x**2/(A.y - 10)"}
  springs: {pull: {between: [D, A], stiffness: 2, free_length: 50}}
"""
ASKED = """
kinematics: {sweep: {crank: {from: 0, to: 360, step: 30}}, rates: {crank: 60 rpm}, outputs: [B, q]}
dynamics: {gravity: [0, -9.81], loads: [{at: B, force: [0, "-a*B.x_velocity"]}]}
reliability: {dimensions: {a: 0.1, rod.length: {sigma: 0.02}}, outputs: [B.y], poses: [{crank: 60}], samples: 500,
              limits: {B.y: 0.2}}
stiffness: {at: B, actuators: {crank: 1e6}, sections: {bar: {E: 70000, width: 5, height: 8}}, elastic: {rod: bar},
            poses: [{crank: 60}]}
optimize: {variables: {a: {from: 20, to: 35, number: 3}}, minimize: kinematics.q.max}
"""
QUESTIONS_ASKED = ["kinematics", "dynamics", "reliability", "stiffness", "optimize"]
NUMBERS = ["1e308", "-1e308", "1e-308", "5e-324", ".nan", ".inf", "-0.0", "1e59", "-1e59", "1e15", "1e-59", "1e-14"]
PLACES = [
    "mechanism.parameters.a", "mechanism.links.ground.D.0", "mechanism.links.rocker.mass", "mechanism.sketch.B.0",
    "mechanism.springs.pull.stiffness", "kinematics.sweep.crank.to", "kinematics.rates.crank", "dynamics.gravity.1",
    "reliability.dimensions.a", "reliability.limits", "reliability.poses.0.crank", "stiffness.actuators.crank",
    "stiffness.sections.bar.E", "optimize.variables.a.from", "optimize.variables.a.to",
]  # fmt: skip
READERS = {
    "motion": ("kinematics: {motion: {crank: {file: data.csv}}, outputs: [B]}", [[0, 0], [1, 3], [2, 10], [3, 0]]),
    "path": ("kinematics: {path: {crank: {file: data.csv}}, outputs: [B]}", [[1], [2], [3], [10]]),
    "spline": ("kinematics: {path: {B: {file: data.csv, spline: true}}, speed: 5}", [[75, 55], [80, 60], [80, 70]]),
    "target": ("  targets: {rocker.angle: data.csv}\nkinematics: {outputs: [B]}", [[0, 0], [90, 9], [200, 3]]),
    "measured": ("reliability: {dimensions: {a: {measured: data.csv}}, outputs: [B.x], poses: [{crank: 60}]}",
                 [[30 + 0.01 * k] for k in range(12)]),
    "cases": ("matrix: {cases: data.csv, results: [kinematics.B.x.max]}", [["mechanism.parameters.a"], [20], [30]]),
}  # fmt: skip


def stderr_of(code: str, data: object, folder: Path) -> str:
    """What a program, given data as JSON, writes to standard error."""
    done = subprocess.run(
        [sys.executable, "-c", code], input=json.dumps(data), capture_output=True, text=True, check=False, cwd=folder
    )
    return done.stderr


def lines_of_libraries(said: str) -> list[str]:
    """The lines that no user should see, each after the command that it belongs to."""
    lines, command = [], ""
    for line in said.splitlines():
        command = line if line.startswith("$") else command
        if LIBRARY.search(line.removeprefix("$")) and line != command:
            lines.append(f"{command}: {line}")
    return lines


def test_no_line_of_a_library_is_seen_where_shipped_studies_are_checked(tmp_path):
    said = stderr_of(COMMANDS, [["check", *map(str, CONFIGS), "--no-plots"]], tmp_path)
    assert "exit code 0" in said
    assert lines_of_libraries(said) == []


@pytest.mark.nightly
def test_no_line_of_a_library_is_seen_where_shipped_studies_run(tmp_path):
    runs = [["run", str(config), "--out", config.stem, "--report"] for config in CONFIGS]
    said = stderr_of(COMMANDS, runs, tmp_path)
    assert said.count("exit code 0") == len(CONFIGS)
    assert lines_of_libraries(said) == []


# Few in every run, all at night.
SOME = pytest.mark.parametrize("numbers", [["1e308", "1e59"], pytest.param(NUMBERS, marks=pytest.mark.nightly)])


@pytest.mark.nightly
@SOME
def test_no_line_of_a_library_is_seen_whatever_the_numbers(numbers, tmp_path):
    studies = [(FOUR_BAR + ASKED, [f"{place}={number}"], QUESTIONS_ASKED) for place, number in product(PLACES, numbers)]
    said = stderr_of(QUESTIONS, studies, tmp_path)
    assert said.count("$") == len(studies)
    assert lines_of_libraries(said) == []


@pytest.mark.nightly
@SOME
def test_no_line_of_a_library_is_seen_whatever_stands_in_files(numbers, tmp_path):
    commands = []
    for reader, (section, rows) in READERS.items():
        for k, number in product(
            range(1, len(rows), 2), [number.replace(".n", "n").replace(".i", "i") for number in numbers]
        ):
            name = f"{reader}_{k}_{number}"
            changed = [[*row[:-1], number] if row is rows[k] else row for row in rows]
            (tmp_path / f"{name}.csv").write_text("".join(",".join(map(str, row)) + "\n" for row in changed))
            (tmp_path / f"{name}.yaml").write_text(FOUR_BAR + section.replace("data.csv", f"{name}.csv") + "\n")
            question = {"measured": "reliability", "cases": "sweep"}.get(reader, "kinematics")
            commands.append([question, f"{name}.yaml", "--no-plots", "--out", "out", "--quiet"])
    said = stderr_of(COMMANDS, commands, tmp_path)
    assert said.count("exit code") == len(commands)
    assert not re.search("exit code [^0123]", said)
    assert lines_of_libraries(said) == []
