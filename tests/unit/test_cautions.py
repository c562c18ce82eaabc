"""Warnings are values: of a kind, with a place; kinds that a study does not want fail it."""

from __future__ import annotations

import pytest
from helpers.studies import study_of

import mechdesign

# A crank that turns to 90 degrees, swept beyond.
FOUR_BAR = """
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: [crank]
  limits: [{drive: crank, min: 0, max: 90}]
  sketch: {A: [0, 30], B: [75, 55]}
kinematics: {sweep: {crank: {from: 0, to: 180, step: 30}}, outputs: [B]}
"""
# The arm stands where P.y is largest: to the first order its angle moves it not at all.
DISAGREEING = """
mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, 100]}, drives: [arm]}
reliability:
  poses: [{arm: 90}]
  dimensions: {arm: {sigma: 6}}
  limits: {P.y: [-1.5, 1.5]}
  methods: [analytic, form]
"""


def test_a_warning_has_its_kind_sentence_and_place():
    (warning,) = mechdesign.kinematics(study_of(FOUR_BAR)).warnings
    assert (warning.kind, warning.table, warning.row, warning.pose) == ("unassembled", "motion", 4, "crank = 120 deg")
    assert str(warning) == warning.message
    assert warning.message.startswith("3 of 7 poses are not valid")
    assert warning.as_data() == {
        "kind": "unassembled", "message": warning.message, "table": "motion", "row": 4, "pose": "crank = 120 deg",
    }  # fmt: skip
    assert mechdesign.Caution("suspect", "words").as_data() == {"kind": "suspect", "message": "words"}


@pytest.mark.parametrize(
    ("kinds", "met"),
    [("unassembled", [False]), ("[singular, unassembled]", [True, False]), ("all", [False]), ("[]", []),
     ("disagree", [True])],
)  # fmt: skip
def test_kinds_that_a_study_lists_fail_it(kinds: str, met: list[bool]):
    result = mechdesign.kinematics(study_of(FOUR_BAR, f"fail_on={kinds}"))
    assert [verdict.met for verdict in result.verdicts] == met
    for verdict in result.verdicts:
        assert verdict.worst == (0 if verdict.met else 1)
        assert (str(result.warnings[0]) in str(verdict)) is not verdict.met


def test_methods_that_disagree_fail_a_study_that_lists_them():
    result = mechdesign.reliability(study_of(DISAGREEING, "fail_on=disagree"))
    (warning,) = [each for each in result.warnings if each.kind == "disagree"]
    assert (warning.table, warning.pose) == ("reliability", "arm = 90 deg")
    assert warning.message.startswith("analytic and form disagree")
    assert [verdict.met for verdict in result.verdicts] == [False]


def test_what_the_file_is_doubted_for_counts_as_well():
    study = study_of(FOUR_BAR, "mechanism.parameters={idle: 1}", "fail_on=suspect")
    (verdict,) = mechdesign.kinematics(study).verdicts
    assert not verdict.met
    assert "nothing uses parameter 'idle'" in str(verdict)


def test_cases_of_a_sweep_fail_by_their_warnings_and_each_kind_is_told():
    vary = "matrix={vary: {mechanism.limits.0.max: [180, 90, 60]}, results: [kinematics.B.x.max]}"
    plain = mechdesign.sweep(study_of(FOUR_BAR, vary)).tables["sweep"]
    assert plain["exit_code"].tolist() == [0, 0, 0]
    result = mechdesign.sweep(study_of(FOUR_BAR, vary, "fail_on=unassembled"))
    table = result.tables["sweep"]
    assert table["exit_code"].tolist() == [0, 1, 1]
    assert table["reason"][0] == ""
    assert "3 of 7 poses are not valid" in table["reason"][1]
    (warning,) = result.warnings
    assert warning.kind == "unassembled"
    assert warning.message.startswith("2 of 3 cases have warnings; the first, case 2 (")
    assert [verdict.met for verdict in result.verdicts] == [False]


def test_a_kind_that_is_misspelt_is_refused_with_the_nearest():
    with pytest.raises(mechdesign.StudyError, match=r"fail_on\.1: .*did you mean 'unassembled'"):
        study_of(FOUR_BAR, "fail_on=[disagree, unasembled]")
