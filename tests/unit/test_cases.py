"""Cases of a study: closed forms of a slider-crank, assembly modes that stay, and cases that fail."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from helpers.studies import IN_LINE

import mechdesign
from mechdesign.errors import StudyError
from mechdesign.experiments.case_numbers import CaseNumber
from mechdesign.experiments.cases import answers, foresee
from mechdesign.experiments.tally import Tally
from mechdesign.study.variants import with_entries

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
STROKE = CaseNumber("kinematics.extremes.B.x.range")
SWING = CaseNumber("kinematics.rod.angle.max")


def asked(text: str, cases: list[dict[str, object]], *wanted: CaseNumber, jobs: int = 1) -> Tally:
    study, given = mechdesign.load(text=text), [tuple(case.items()) for case in cases]
    tally = Tally(given, len(wanted), len(study.requirements))
    for answered in answers(study, given, wanted, jobs=jobs):
        tally.add(answered)
    return tally


def test_stroke_and_swing_of_slider_cranks():
    radii = np.array([20.0, 30.0, 35.0, 45.0])
    found = asked(SLIDER_CRANK, [{"mechanism.parameters.r": r} for r in radii.tolist()], STROKE, SWING)
    (stroke, unit), (swing, _) = found.result(0), found.result(1)
    np.testing.assert_allclose(stroke, 2 * radii, rtol=1e-9)
    np.testing.assert_allclose(swing, np.degrees(np.arcsin(radii / 100)), rtol=1e-9)
    assert unit == "mm"
    long, steep = found.required(0), found.required(1)
    assert long[0].tolist() == stroke.tolist()
    assert long[1].tolist() == (2 * radii >= 70).tolist()
    np.testing.assert_allclose(steep[0], swing, rtol=1e-9)
    assert steep[1].tolist() == (swing <= 25).tolist()
    assert found.table[:, 0].tolist() == (1 - long[1] * steep[1]).tolist()
    assert not found.failed
    short, broad = found.verdicts
    assert (short.worst, short.margin) == (pytest.approx(40), pytest.approx(-30))
    assert short.place.startswith("case 1 (r 20)")
    assert "case 4 (r 45), crank 90" in broad.place or "case 4 (r 45), crank 270" in broad.place


@pytest.mark.slow
def test_numbers_and_limits_that_follow_are_those_of_each_case_alone():
    text = SLIDER_CRANK.replace("at_least: 70", "at_least: 2*r - 5").replace("at_most: 25", "at_least: 3, at_most: r")
    cases: list[dict[str, object]] = [{"mechanism.parameters.r": 20 + 0.5 * k} for k in range(20)]
    found = asked(text, cases, STROKE, SWING)
    for k, case in enumerate(cases):
        study = mechdesign.load(text=text, overrides=case)
        verdicts = mechdesign.requirements(study, mechdesign.kinematics(study))
        for j, verdict in enumerate(verdicts):
            worst, met, unit = (part[k] if isinstance(part, np.ndarray) else part for part in found.required(j))
            assert (worst, bool(met), unit) == (pytest.approx(verdict.worst, rel=1e-12), verdict.met, verdict.unit)
    assert [each.margin for each in found.verdicts] == [pytest.approx(5), pytest.approx(-3)]


@pytest.mark.slow
def test_cases_come_in_their_order_whatever_the_workers():
    cases: list[dict[str, object]] = [{"mechanism.parameters.l": 100 + k} for k in range(7)]
    one, two = (asked(SLIDER_CRANK, cases, STROKE, jobs=jobs) for jobs in (1, 2))
    assert one.table.tobytes() == two.table.tobytes()
    assert one.verdicts == two.verdicts


def test_a_case_that_fails_is_answered_with_its_reason():
    cases: list[dict[str, object]] = [
        {"mechanism.parameters.r": -1}, {"mechanism.parameters.rr": 1}, {"kinematics.poses": [{"B.x": 200}],
        "kinematics.sweep": None}, {},
    ]  # fmt: skip
    found = asked(SLIDER_CRANK, cases, STROKE)
    assert found.table[:, 0].tolist() == [3, 3, 3, 1]
    assert found.reason(0) == "mechanism.links.crank.2: must be positive, not -1"
    assert "did you mean 'r'?" in found.reason(1)
    assert "cannot be assembled" in found.reason(2)
    assert found.reason(3) == ""
    assert np.isnan(found.result(0)[0]).tolist() == [True, True, True, False]
    for k in (0, 1):
        assert not found.required(k)[1][:3].any()
        assert math.isnan(found.verdicts[k].worst)
        assert found.verdicts[k].place.startswith("case 1 (r -1)")


def test_the_assembly_stays_that_of_the_sketch_unless_that_is_changed():
    # With the crank this much shorter the sketched B would be nearer to the other side.
    height = CaseNumber("kinematics.B.y")
    moved = {"mechanism.links.ground.D": [100, 90]}
    kept, mirrored = asked(FOUR_BAR, [moved, moved | {"mechanism.sketch.B": [75, -55]}], height).result(0)[0]

    def height_of(side: int) -> float:
        a, d = 30j, 100 + 90j
        line = d - a
        along = (90**2 - 60**2 + abs(line) ** 2) / (2 * abs(line))
        return (a + line / abs(line) * complex(along, side * math.sqrt(90**2 - along**2))).imag

    assert kept == pytest.approx(height_of(1))
    assert mirrored == pytest.approx(height_of(-1))


def test_another_mechanism_is_assembled_anew():
    study = mechdesign.load(text=FOUR_BAR)
    other = with_entries(study, [("mechanism.drives", ["rocker"]), ("kinematics.poses", [{"rocker": 90}])])
    assert other.mechanism.drives == ("rocker",)
    assert float(other.mechanism.solve({"rocker": 90})["B.y"]) == pytest.approx(60)


def test_what_no_result_has_is_found_before_anything_is_computed():
    study = mechdesign.load(text=SLIDER_CRANK)
    wrong = [CaseNumber("kinematics.rod.angel.max"), CaseNumber("kinematics.B.x")]
    with pytest.raises(StudyError) as error:
        foresee(study, [STROKE, SWING, *wrong])
    misspelt, several = map(str, error.value.problems)
    assert "did you mean 'rod.angle'?" in misspelt
    assert "13 rows; ask for kinematics.B.x.min" in several


def test_the_answer_of_a_case_can_be_pickled():
    (answer,) = answers(mechdesign.load(text=SLIDER_CRANK), [()], [STROKE])
    again = pickle.loads(pickle.dumps(answer))
    assert again.table.tobytes() == answer.table.tobytes()
    assert (again.reasons, again.units, again.warned, again.worst) == (
        answer.reasons, answer.units, answer.warned, answer.worst
    )  # fmt: skip
