"""Choices of words from end to end: what a terminal and the tables show, and a choice that names nothing."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from typer.testing import CliRunner

from mechdesign.door.cli.app import app

STUDY = """\
mechanism:
  parameters: {l: 110}
  links: {ground: {O: [0, 0]}, arm: [O, P, l]}
  drives: {theta: {angle: arm}}
stiffness:
  poses: [{theta: 30}]
  at: P
  sections: {bar: {E: 200 GPa, diameter: 10}, tube: {E: 200 GPa, diameter: 20, inner_diameter: 18}}
  elastic: {arm: bar}
  actuators: {theta: 1e5 N*m/rad}
optimize:
  method: METHOD
  variables: {stiffness.elastic.arm: {choices: [bar, WORD]}, l: {from: 100.5, to: 103, integer: true}}
  maximize: stiffness.k_min
  minimize: l
"""


@pytest.mark.parametrize("method", ["grid", "search", "pareto"])
def test_tables_and_the_optimum_have_the_word(method: str, tmp_path: Path) -> None:
    study = tmp_path / "arm.yaml"
    study.write_text(STUDY.replace("METHOD", method).replace("WORD", "tube"))
    result = CliRunner().invoke(app, ["optimize", str(study), "--out", str(tmp_path / "out")])
    assert result.exit_code == 0, result.output
    for table in ("designs", "optimum", "best", *(["pareto"] if method == "pareto" else [])):
        rows = list(csv.DictReader((tmp_path / "out" / f"{table}.csv").read_text().splitlines()))
        assert {row["stiffness.elastic.arm"] for row in rows} <= {"bar", "tube"}
        assert {row["l"] for row in rows} <= {"101", "102", "103"}
        if table == "designs":
            assert len({(row["stiffness.elastic.arm"], row["l"]) for row in rows}) == len(rows) == 6
    assert 'elastic: {arm: "tube"}' in (tmp_path / "out" / "optimum.yaml").read_text()


@pytest.mark.parametrize("command", ["check", "optimize"])
def test_a_choice_that_names_nothing_is_told_at_its_place(command: str, tmp_path: Path) -> None:
    study = tmp_path / "arm.yaml"
    study.write_text(STUDY.replace("METHOD", "grid").replace("WORD", "tub"))
    result = CliRunner().invoke(app, [command, str(study), "--out", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert (
        f"{study}:13:54: optimize.variables.stiffness.elastic.arm.choices.1: there is no section 'tub'" in result.output
    )
    assert not (tmp_path / "out").exists()
