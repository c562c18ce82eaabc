"""A method of reliability is declared once: one added here alone is in the schema, in tables and in pictures."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign
from mechdesign.door.report.tables import to_csv
from mechdesign.drawing import style
from mechdesign.drawing.pictures import figures
from mechdesign.questions.reliability.engine.design_points import DesignPoints
from mechdesign.questions.reliability.engine.problem import Estimate, LimitStates
from mechdesign.questions.reliability.methods import normal
from mechdesign.questions.reliability.schema.methods import METHODS, Method
from mechdesign.questions.reliability.schema.section import Precision
from mechdesign.questions.reliability.task import MethodResult, Task
from mechdesign.study.schema.study_file import schema

LEVER = """
mechanism:
  links: {ground: {O: [0, 0]}, lever: [O, P, 100]}
  drives: {theta: {angle: lever}}
  sketch: {P: [100, 0]}
reliability:
  poses: [{theta: 30}]
  dimensions: {lever.length: 0.3}
  limits: {P.x: 0.17}
"""


def run(task: Task) -> MethodResult:
    """The first order with twice its deviations."""
    return normal(task, task.linear.shift(), 4.0 * task.linear.covariance())


def rung(
    problem: LimitStates, points: DesignPoints, rng: np.random.Generator, most: int, precision: Precision
) -> Estimate | None:
    return Estimate(0.5, 0.5, 0.5, problem.evaluations)


@pytest.fixture
def cautious() -> Iterator[None]:
    method = Method(
        "cautious", "cautious first order", "first-order errors, twice as wide", "Never.", 2, step=1, module=__name__
    )
    known = dict(METHODS)
    METHODS[method.name] = method
    yield
    METHODS.clear()
    METHODS.update(known)


def test_an_unknown_method_is_refused() -> None:
    with pytest.raises(mechdesign.StudyError, match="expected one of analytic, second_order"):
        study_of(LEVER, "reliability.methods=[cautious]")


@pytest.mark.slow
@pytest.mark.usefixtures("cautious")
def test_a_declared_method_is_in_schema_tables_and_pictures() -> None:
    for form in schema()["$defs"]["ReliabilitySection"]["properties"]["methods"]["anyOf"]:
        assert form.get("items", form)["enum"][-1] == "cautious"
    study = study_of(LEVER, "reliability.methods=[analytic, cautious, auto]", "reliability.precision=0.02")
    result = mechdesign.reliability(study)
    table = result.tables["reliability"]
    failure = dict(zip(table["method"].tolist(), table["failure"].tolist(), strict=True))
    assert failure["cautious"] > 5 * failure["analytic"]
    rows = list(csv.DictReader(io.StringIO(to_csv(table))))
    assert [row["method"] for row in rows] == ["analytic", "cautious", "auto"]
    with style.context():
        found = figures(study, result)
    assert "cautious first order" in [text.get_text() for text in found["reliability"].legends[0].get_texts()]
    # Among the steps of auto it says a half, whatever the others say.
    alone = mechdesign.reliability(study_of(LEVER, "reliability.methods=auto", "reliability.precision=0.02"))
    assert any(warning.startswith("form and cautious disagree") for warning in map(str, alone.warnings))
    with pytest.raises(mechdesign.StudyError, match="did you mean 'cautious'"):
        study_of(LEVER, "reliability.methods=[cautios]")
