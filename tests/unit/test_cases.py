"""Cases of a study: closed forms of a slider-crank, assembly modes that stay, and cases that fail."""

from __future__ import annotations

import math
import pickle

import pytest
from helpers.studies import IN_LINE

import mechdesign
from mechdesign.errors import StudyError
from mechdesign.experiments.cases import Answered, Case, Wanted, answers, foresee, variant

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
STROKE = Wanted("kinematics.extremes.B.x.range")
SWING = Wanted("kinematics.rod.angle.max")


def asked(text: str, cases: list[dict[str, object]], *wanted: Wanted, jobs: int = 1) -> list[Answered]:
    study = mechdesign.load(text=text)
    return list(answers(study, map(Case.of, cases), wanted, jobs=jobs))


def test_stroke_and_swing_of_slider_cranks():
    radii = (20.0, 30.0, 35.0, 45.0)
    found = asked(SLIDER_CRANK, [{"mechanism.parameters.r": r} for r in radii], STROKE, SWING)
    for r, each in zip(radii, found, strict=True):
        (stroke, unit), (swing, _) = each.numbers
        assert (stroke, unit) == (pytest.approx(2 * r), "mm")
        assert swing == pytest.approx(math.degrees(math.asin(r / 100)))
        long, steep = each.verdicts
        assert (long.met, long.worst, long.margin) == (2 * r >= 70, stroke, pytest.approx(2 * r - 70))
        assert (steep.met, steep.worst) == (swing <= 25, pytest.approx(swing))
        assert steep.place in ("crank 90", "crank 270")
        assert each.exit_code == int(not (long.met and steep.met))
        assert not each.failed


def test_cases_come_in_their_order_whatever_the_workers():
    cases: list[dict[str, object]] = [{"mechanism.parameters.l": 100 + k} for k in range(7)]
    assert asked(SLIDER_CRANK, cases, STROKE, jobs=2) == asked(SLIDER_CRANK, cases, STROKE)


def test_a_case_that_fails_is_answered_with_its_reason():
    cases: list[dict[str, object]] = [
        {"mechanism.parameters.r": -1}, {"mechanism.parameters.rr": 1}, {"kinematics.poses": [{"B.x": 200}],
        "kinematics.sweep": None}, {},
    ]  # fmt: skip
    negative, misspelt, unreached, good = asked(SLIDER_CRANK, cases, STROKE)
    assert (negative.exit_code, negative.failed) == (3, "mechanism.links.crank.2: must be positive, not -1")
    assert misspelt.exit_code == 3
    assert "did you mean 'r'?" in misspelt.failed
    assert unreached.exit_code == 3
    assert "cannot be assembled" in unreached.failed
    for each in (negative, misspelt, unreached):
        assert math.isnan(each.numbers[0].value)
        assert [verdict.met for verdict in each.verdicts] == [False, False]
    assert (good.exit_code, good.failed) == (1, "")


def test_the_assembly_stays_that_of_the_sketch_unless_that_is_changed():
    # With the crank this much shorter the sketched B would be nearer to the other side.
    height = Wanted("kinematics.B.y")
    moved = {"mechanism.links.ground.D": [100, 90]}
    kept, mirrored = asked(FOUR_BAR, [moved, moved | {"mechanism.sketch.B": [75, -55]}], height)

    def height_of(side: int) -> float:
        a, d = 30j, 100 + 90j
        line = d - a
        along = (90**2 - 60**2 + abs(line) ** 2) / (2 * abs(line))
        return (a + line / abs(line) * complex(along, side * math.sqrt(90**2 - along**2))).imag

    assert kept.numbers[0].value == pytest.approx(height_of(1))
    assert mirrored.numbers[0].value == pytest.approx(height_of(-1))


def test_another_mechanism_is_assembled_anew():
    study = mechdesign.load(text=FOUR_BAR)
    other = variant(study, Case.of({"mechanism.drives": ["rocker"], "kinematics.poses": [{"rocker": 90}]}))
    assert other.mechanism.drives == ("rocker",)
    assert float(other.mechanism.solve({"rocker": 90})["B.y"]) == pytest.approx(60)


def test_what_no_result_has_is_found_before_anything_is_computed():
    study = mechdesign.load(text=SLIDER_CRANK)
    wrong = [Wanted("kinematics.rod.angel.max"), Wanted("kinematics.B.x")]
    with pytest.raises(StudyError) as error:
        foresee(study, [STROKE, SWING, *wrong])
    misspelt, several = map(str, error.value.problems)
    assert "did you mean 'rod.angle'?" in misspelt
    assert "13 rows; ask for kinematics.B.x.min" in several


def test_a_case_and_its_answer_can_be_pickled():
    case = Case.of({"mechanism.parameters.r": 30, "kinematics.outputs": ["B.x"]})
    assert pickle.loads(pickle.dumps(case)) == case
    (answer,) = asked(SLIDER_CRANK, [{}], STROKE)
    assert pickle.loads(pickle.dumps(answer)) == answer
