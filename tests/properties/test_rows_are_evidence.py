"""Rows are evidence: no extreme, statistic or verdict of a study contradicts a row of its tables."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers.corner_motions import coupled_by_table, dynamic, kinematic, path
from helpers.evidence import rounding_of, rows_beyond, rows_of
from helpers.studies import study_of

import mechdesign

CONFIGS = sorted((Path(__file__).parents[2] / "configs").rglob("*.yaml"))
QUESTIONS = ("kinematics", "dynamics", "stiffness")
# Of every kind of motion, loads, couplings and ends that is shipped, and soon done.
FEW = (
    "cam_dwell",
    "flywheel_press",
    "rise_dwell_return",
    "parallelogram",
    "whitworth",
    "excavator_lift",
    "toggle_clamp",
)
# A gate lies inside of the rows by this part of the largest of them.
LITTLE = 1e-6


def asked() -> list[Any]:
    """Studies and questions whose rows are poses, those that take a while at night."""
    found = []
    for config in CONFIGS:
        sections = yaml.safe_load(config.read_text(encoding="utf-8"))
        for question in QUESTIONS:
            if question in sections:
                marks = [] if config.stem in FEW and question != "stiffness" else [pytest.mark.nightly]
                found.append(pytest.param(config, question, marks=marks, id=f"{config.stem}-{question}"))
    return found


def bounds(result: Any, question: str) -> Iterator[tuple[str, str, float]]:
    """Requirements that the rows of a result do not meet: the line, the column, and the row's value."""
    columns = {
        name: np.asarray(result.main[name])
        for name in result.main.names
        if name != "valid" and np.asarray(result.main[name]).dtype.kind == "f"
    }
    extremes = result.tables.get("extremes")
    columns |= {str(name): rows_of(result, str(name)) for name in (extremes["output"] if extremes is not None else [])}
    units = {name: result.main.column(name).unit for name in result.main.names}
    for name, values in columns.items():
        finite = values[np.isfinite(values)]
        # What is nowhere more than rounding says nothing.
        if not len(finite) or np.abs(finite).max() <= rounding_of(result, units.get(name, "")):
            continue
        little = LITTLE * max(float(np.abs(finite).max()), 1e-3)
        result_name = f"{question}.{name}" if name in result.main.names else f"{question}.extremes.{name}"
        for word, bound, row in (
            ("at_most", finite.max() - little, finite.max()), ("at_least", finite.min() + little, finite.min())
        ):  # fmt: skip
            end = {"at_most": "max", "at_least": "min"}[word]
            column = result_name if name in result.main.names else f"{result_name}.{end}"
            yield f"{{result: {column}, {word}: {float(bound)!r}}}", name, float(row)
            if name in result.main.names:
                yield f"{{result: {result_name}.{end}, {word}: {float(bound)!r}}}", name, float(row)


def check(load: Any, question: str) -> None:
    """No row lies beyond the extremes, and no gate that a row violates is met; its worst is that of extremes.csv."""
    result = getattr(mechdesign, question)(load())
    assert rows_beyond(result) == []
    gates = list(bounds(result, question))
    study = load(f"requirements=[{', '.join(line for line, *_ in gates)}]")
    result = getattr(mechdesign, question)(study)
    table = result.tables.get("extremes")
    outputs = [str(name) for name in table["output"]] if table is not None else []
    verdicts = mechdesign.requirements(study, result)
    assert len(verdicts) >= len(gates)
    for (line, name, row), verdict in zip(gates, verdicts, strict=False):
        assert not verdict.met, (line, str(verdict), row)
        if name in outputs and not np.isnan(verdict.worst):
            end = "max" if "at_most" in line else "min"
            extreme = float(table[end][outputs.index(name)])
            assert verdict.worst == pytest.approx(extreme, rel=1e-9, abs=1e-9), (line, str(verdict), extreme)


@pytest.mark.parametrize(("config", "question"), asked())
def test_nothing_that_a_shipped_study_says_contradicts_a_row(config: Path, question: str) -> None:
    check(lambda *changes: mechdesign.load(config, changes), question)


@pytest.mark.nightly
@pytest.mark.parametrize("make", [kinematic, path, dynamic, coupled_by_table])
def test_nothing_that_is_said_of_random_motions_contradicts_a_row(make: Any) -> None:
    for seed in range(500, 520):
        case = make(seed)
        check(lambda *changes, text=case.text: study_of(text, *changes), case.command)
