"""Cases of a study: each as a study of its own, in their order, in the assembly of the sketch, and cases that fail."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from helpers.studies import IN_LINE

import mechdesign

SLIDER_CRANK = (
    IN_LINE
    + """\
kinematics: {sweep: {crank: {from: 0, to: 360, step: 30}}, outputs: [B.x, rod.angle]}
requirements:
  - {result: kinematics.extremes.B.x.range, at_least: 70}
  - {result: kinematics.rod.angle, abs: true, at_most: 25}
"""
)
FOUR_BAR = """
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
kinematics: {poses: [{crank: 90}], outputs: [B.y]}
"""
STROKE, SWING = "kinematics.extremes.B.x.range", "kinematics.rod.angle.max"
R = "mechanism.parameters.r"


def swept(text: str, vary: dict[str, Any], *results: str, jobs: int = 1) -> mechdesign.Answer:
    study = mechdesign.load(text=text, overrides={"matrix": {"vary": vary, "results": list(results)}})
    return mechdesign.sweep(study, jobs=jobs)


@pytest.mark.slow
def test_numbers_and_limits_that_follow_are_those_of_each_case_alone():
    text = SLIDER_CRANK.replace("at_least: 70", "at_least: 2*r - 5").replace("at_most: 25", "at_least: 3, at_most: r")
    radii = [20 + 0.5 * k for k in range(20)]
    result = swept(text, {R: radii}, STROKE, SWING)
    table = result.main
    assert table[STROKE] == pytest.approx(2 * np.array(radii), rel=1e-9)
    assert table[SWING] == pytest.approx(np.degrees(np.arcsin(np.array(radii) / 100)), rel=1e-9)
    for k, radius in enumerate(radii):
        study = mechdesign.load(text=text, overrides={R: radius})
        for name, verdict in zip(
            (STROKE, "|kinematics.rod.angle|"), mechdesign.kinematics(study).verdicts, strict=True
        ):
            assert table[name][k] == pytest.approx(verdict.worst, rel=1e-12)
            assert table[f"{name}_met"][k] == verdict.met
            assert table.column(name).unit == verdict.unit
    assert [verdict.margin for verdict in result.verdicts] == pytest.approx([5, -3])


@pytest.mark.slow
def test_cases_come_in_their_order_whatever_the_workers():
    lengths = [100 + k for k in range(7)]
    one, two = (swept(SLIDER_CRANK, {"mechanism.parameters.l": lengths}, STROKE, jobs=jobs) for jobs in (1, 2))
    assert one.main["mechanism.parameters.l"].tolist() == lengths
    for name in one.main.names:
        np.testing.assert_array_equal(one.main[name], two.main[name])
    assert one.verdicts == two.verdicts


def test_a_case_that_fails_is_answered_with_its_reason():
    found = swept(FOUR_BAR, {"kinematics.poses": [[{"B.x": 300}], [{"crank": 90}]]}, "kinematics.B.y").main
    assert found["exit_code"].tolist() == [3, 0]
    assert "cannot be assembled" in found["reason"][0]
    assert found["reason"][1] == ""
    assert np.isnan(found["kinematics.B.y"]).tolist() == [True, False]


def test_the_assembly_stays_that_of_the_sketch_unless_that_is_changed():
    # With the crank this much shorter the sketched B would be nearer to the other side.
    vary = {"mechanism.links.ground.D": [[100, 90]], "mechanism.sketch.B": [[75, 55], [75, -55]]}
    kept, mirrored = swept(FOUR_BAR, vary, "kinematics.B.y").main["kinematics.B.y"]

    def height_of(side: int) -> float:
        a, d = 30j, 100 + 90j
        line = d - a
        along = (90**2 - 60**2 + abs(line) ** 2) / (2 * abs(line))
        return (a + line / abs(line) * complex(along, side * math.sqrt(90**2 - along**2))).imag

    assert kept == pytest.approx(height_of(1))
    assert mirrored == pytest.approx(height_of(-1))


def test_another_mechanism_is_assembled_anew():
    vary = {"mechanism.drives": [["rocker"]], "kinematics.poses": [[{"rocker": 90}]]}
    assert swept(FOUR_BAR, vary, "kinematics.B.y").main["kinematics.B.y"] == pytest.approx([60])


def test_what_no_result_has_is_found_before_anything_is_computed():
    with pytest.raises(mechdesign.StudyError) as error:
        swept(SLIDER_CRANK, {R: [20]}, STROKE, SWING, "kinematics.rod.angel.max", "kinematics.B.x")
    misspelt, several = map(str, error.value.problems)
    assert "did you mean 'rod.angle.max'?" in misspelt
    assert "13 rows; ask for kinematics.B.x.min" in several
