"""Every case of the verification manual: ours beside numbers that are printed, in closed form, or of another solver."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import verification
from cases import EVIDENCE, Row, cases

CASES = cases()


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.nightly if case.night else []) for name, case in CASES.items()]
)
def test_case(name: str) -> None:
    case = CASES[name]
    rows = list(case.rows())
    assert verification.wrong(case, rows) == []
    if case.recorded:
        # What the site shows of results/ is what comes out today.
        shown = list(case.rows(recorded=True))
        assert verification.wrong(case, shown) == []
        gaps = [abs(one.ours - other.ours) / (one.scale or 1.0) for one, other in zip(shown, rows, strict=True)
                if one.count == 1]  # fmt: skip
        assert max(gaps, default=0.0) < 1e-9


def test_every_question_has_cases_from_elsewhere_and_none_is_without_a_source() -> None:
    assert len(CASES) >= 120
    assert all(case.source.strip() and case.text.strip() and case.checks for case in CASES.values())
    assert {case.evidence for case in CASES.values()} == EVIDENCE.keys()
    for question in ("kinematics", "workspace", "optimize", "reliability", "stiffness", "dynamics", "synthesize"):
        evidence = {case.evidence for case in CASES.values() if case.question == question}
        assert evidence & {"second solver", "brute force"}, question
        assert "printed" in evidence, question


def of(check: dict[str, object]) -> Row:
    (row,) = replace(CASES["slider_crank"], checks=[check]).rows()
    return row


def test_a_number_that_differs_in_its_last_printed_digit_is_told() -> None:
    check = {"of": "B.x", "at": {"crank": 15}, "printed": "3.954741"}
    assert verification.wrong(CASES["slider_crank"], [of(check)]) == [
        "slider_crank: B.x at crank = 15: 3.9547404244 for 3.954741"
    ]
    assert of(check | {"printed": "3.954740"}).agrees


def test_a_closed_form_that_differs_in_one_row_of_many_is_told_with_this_row() -> None:
    form = "cos(radians(crank)) + sqrt(9 - sin(radians(crank))**2)"
    right, wrong = (of({"of": "B.x", "expected": form + more}) for more in ("", " + 1e-6*(crank == 40)"))
    assert (right.agrees, wrong.agrees, wrong.count) == (True, False, 73)
    assert wrong.difference == pytest.approx(1e-6, rel=1e-6)
    assert wrong.ours == pytest.approx(np.cos(np.radians(40)) + np.sqrt(9 - np.sin(np.radians(40)) ** 2))


def test_a_check_that_cannot_be_made_says_in_which_case_and_which_columns_there_are() -> None:
    for check, wrong in (
        ({"of": "B.z", "expected": 0}, "'B' is not defined"),
        ({"of": "rnge", "table": "extremes", "expected": 0}, "'rnge' is not defined"),
        ({"of": "range", "table": "extrems", "expected": 0}, "extrems"),
        ({"of": "B.x", "at": {"crnk": 15}, "expected": 0}, "crnk"),
    ):
        with pytest.raises((NameError, KeyError), match=wrong) as told:
            of(check)
        notes = "\n".join(told.value.__notes__)
        assert "case slider_crank, " in notes
        assert "\n  extremes: output, " in notes


@pytest.mark.parametrize(
    ("case", "wrong"),
    [
        ("source: Euclid, checks: [{of: B.x, expcted: 0}]", "no expcted; it takes .*expected"),
        ("source: Euclid, checks: [{of: B.x, within: 1e-9}]", "needs one of at_most, expected, printed"),
        ("checks: [{of: B.x, expected: 0}]", "source"),
        ("source: Euclid, title: A crank, checks: [{of: B.x, expected: 0}]", "'text'"),
    ],
)
def test_a_case_that_is_written_wrongly_is_named(
    case: str, wrong: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "odd.yaml").write_text(f"question: kinematics\ncases:\n  odd: {{study: gallery/hoeken, {case}}}\n")
    monkeypatch.setattr("cases.FOLDER", tmp_path)
    with pytest.raises((ValueError, KeyError, TypeError), match=wrong) as told:
        cases.__wrapped__()
    assert told.value.__notes__ == ["case odd in odd.yaml"]


def test_a_misprint_has_to_be_one_and_has_to_be_told() -> None:
    told = {
        "of": "B.x",
        "at": {"crank": 15},
        "printed": "3.9",
        "expected": 3.954740,
        "within": 5e-7,
        "misprint": "Why.",
    }
    assert of(told).agrees
    assert not of(told | {"printed": "3.954740"}).agrees
    notes = [{"within": 0.02, "text": "Why."}]
    assert verification.agreement(of(told)) == "see the note, 3.95474 is right"
    assert of({"of": "B.x", "name": "B", "at": {"crank": 15}, "printed": "3.9", "notes": notes}).note == "Why."
    assert not of({"of": "B.x", "name": "B", "at": {"crank": 15}, "printed": "3.8", "notes": notes}).agrees


def test_a_misprint_of_a_table_agrees_only_with_what_it_should_read() -> None:
    case = CASES["s1_table_2"]
    (row,) = replace(case, checks=[check for check in case.checks if check["name"] == "GRI, weights 0, 1, 1"]).rows(
        recorded=True
    )
    # The paper prints the row of the weights 1, 0, 1 here: 1.63565, and 2.38451 there.
    assert (row.printed, row.right, row.agrees) == ("1.63565", "2.38451", True)
    assert row.part < 5e-4
    (check,) = (check for check in case.checks if check["name"] == "GRI, weights 0, 1, 1")
    (wrong,) = replace(case, checks=[check | {"expected": 2.3, "reads": "2.3"}]).rows(recorded=True)
    assert not wrong.agrees


def test_a_page_has_source_study_numbers_and_the_command_that_repeats_it() -> None:
    case = CASES["hoeken_140"]
    page = verification.page(case, list(case.rows()))
    for words in (
        "R. L. Norton, *Design of Machinery*, Table 3-1",
        "| 3.623 | 3.6225601639 | 4.4e-04 | all 4 printed |",
        "--set 'mechanism.parameters.l1=2.5'",
        "python docs/verification.py hoeken_140",
        "../../configs/gallery/hoeken.yaml",
        "../../results/gallery/hoeken/",
    ):
        assert words in page


def test_the_overview_counts_cases_and_says_versions_and_largest_differences() -> None:
    names = ("hoeken_140", "notes_four_bar", "s2_formulas")
    page = verification.overview({name: list(CASES[name].rows(recorded=True)) for name in names})
    assert "| [kinematics](#kinematics) | 1 | 0 | 0 | 0 | 1 |" in page
    assert "| **all** | 2 | 1 | 0 | 0 | 3 |" in page
    assert f"NumPy {np.__version__}" in page
    assert "| printed | 1 | 5e-03 |" in page
    assert "python docs/verification.py" in page
