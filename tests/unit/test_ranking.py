"""The best of many cases: ranks, ties and fronts against their definitions; what has no rank, and what is told."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import mechdesign
from mechdesign.door.report.cases import best_of
from mechdesign.door.report.page.cases import MOST_CELLS, gates, telling_rows
from mechdesign.door.report.page.headlines import headlines
from mechdesign.experiments.ranking import ranked
from mechdesign.motion.functions import Functions
from tests.unit.test_cases import SLIDER_CRANK

STROKE, ANGLE = "kinematics.extremes.B.x.range", "kinematics.rod.angle.max"
R, L = "mechanism.parameters.r", "mechanism.parameters.l"


def swept(best: dict[str, Any], vary: dict[str, Any] | None = None) -> Any:
    vary = vary or {R: "34:44:2", L: "90:130:10"}
    return mechdesign.sweep(mechdesign.load(text=SLIDER_CRANK, overrides={"matrix": {"vary": vary, "best": best}}))


@pytest.mark.slow
def test_one_goal_ranks_the_cases_that_meet_every_requirement_by_itself():
    table = swept({"minimize": ANGLE}).main
    met = table["exit_code"] == 0
    assert 3 < met.sum() < len(table)
    # Cranks and rods of the same ratio swing alike.
    ratio = [r / length for r, length in zip(map(Fraction, table[R]), map(Fraction, table[L]), strict=True)]
    ranks = [1 + sum(other < each for other, good in zip(ratio, met, strict=True) if good) for each in ratio]
    np.testing.assert_array_equal(table["rank"][met], np.array(ranks)[met])
    assert len(set(ranks)) < len(ranks)
    assert np.isnan(table["rank"][~met]).all()
    np.testing.assert_array_equal(table["front"], table["rank"] == 1)


@pytest.mark.slow
def test_several_goals_rank_by_the_sum_of_parts_of_their_ranges_and_mark_the_front():
    table = swept({"maximize": STROKE, "minimize": ANGLE}).main
    met = table["exit_code"] == 0
    stroke, angle = table[STROKE][met], table[ANGLE][met]
    score = (stroke - stroke.min()) / np.ptp(stroke) + (angle.max() - angle) / np.ptp(angle)
    ranks = [1 + int((score > each + 1e-9).sum()) for each in score]
    np.testing.assert_array_equal(table["rank"][met], ranks)
    # Strokes of the same crank are equal but for rounding.
    longer, smaller = stroke - stroke[:, None] > 1e-9, angle[:, None] - angle > 1e-9
    no_shorter, no_larger = stroke - stroke[:, None] > -1e-9, angle[:, None] - angle > -1e-9
    surpassed = (no_shorter & no_larger & (longer | smaller)).any(axis=1)
    np.testing.assert_array_equal(table["front"][met], ~surpassed)
    assert not table["front"][~met].any()
    assert 1 < table["front"].sum() < met.sum()
    assert table["front"][table["rank"] == 1].all()


def test_equal_cases_share_a_rank_and_rounding_makes_none_better():
    values = np.array([2.0, 1.0, 1.0 + 1e-15, 3.0, np.nan, 0.0])
    admitted = np.array([True, True, True, True, True, False])
    rank, front = ranked(values[:, None], admitted)
    np.testing.assert_array_equal(rank, [3, 1, 1, 4, np.nan, np.nan])
    assert front.tolist() == [False, True, True, False, False, False]
    assert ranked(-values[:, None], admitted)[0][3] == 1
    flat = np.stack([values, -np.array([1, 1, 1, 1 - 1e-16, 1, 1])], axis=1)
    np.testing.assert_array_equal(ranked(flat, admitted)[0], rank)


@pytest.mark.slow
def test_a_goal_has_a_column_among_the_results_and_what_was_there_stays_where_it_was():
    plain = mechdesign.sweep(mechdesign.load(text=SLIDER_CRANK, overrides={"matrix": {"vary": {R: [35, 40]}}})).main
    names = swept({"maximize": [STROKE, "kinematics.B.x.max"]}, {R: [35, 40]}).main.names
    assert names == (*plain.names[:-2], "kinematics.B.x.max", "warnings", "reason", "rank", "front")
    assert "rank" not in plain


@pytest.mark.slow
def test_the_best_case_may_be_the_first_row_and_cases_without_a_rank_come_last_in_their_order():
    plain, table = (swept({"maximize": STROKE, "sort": sort}).main for sort in (False, True))
    met = int((plain["exit_code"] == 0).sum())
    assert (np.diff(table["rank"][:met]) >= 0).all()
    assert np.isnan(table["rank"][met:]).all()
    assert (np.diff(table["case"][met:]) > 0).all()
    rows = np.argsort(table["case"])
    for column in plain.columns:
        np.testing.assert_array_equal(table[column.name][rows], column.values)


@pytest.mark.slow
def test_what_is_best_is_told_in_words():
    result = swept({"maximize": STROKE, "minimize": ANGLE})
    best, table = best_of(result.main), result.main
    assert best is not None
    row = int(np.flatnonzero(table["rank"] == 1)[0])
    ranked, front = int((table["exit_code"] == 0).sum()), int(table["front"].sum())
    case = f"case {row + 1} (r {table[R][row]:g}, l {table[L][row]:g})"
    assert str(best) == f"best of {ranked} ranked cases is {case}; {front} of them are on the Pareto front"
    told = {
        each.label: (each.value, each.unit, each.note.replace("\N{NO-BREAK SPACE}", " ")) for each in headlines(result)
    }
    assert told == {
        "best case": (str(row + 1), "", f"r = {table[R][row]:g} mm, l = {table[L][row]:g} mm"),
        f"{STROKE} of the best case": (f"{table[STROKE][row]:.4g}", "mm", ""),
        f"{ANGLE} of the best case": (f"{table[ANGLE][row]:.4g}", "deg", ""),
        "cases on the Pareto front": (str(front), "", f"of {ranked} ranked cases"),
        "cases that meet every requirement": (str(ranked), "", f"of {len(table)} cases"),
    }
    alike = best_of(swept({"maximize": STROKE}, {R: [36, 40], L: [100, 120]}).main)
    assert str(alike) == "best of 4 ranked cases is case 3 (r 40, l 100) and 1 more as good"


def test_where_no_case_meets_every_requirement_none_is_ranked():
    result = swept({"maximize": STROKE}, {R: [-1, 20]})
    assert np.isnan(result.main["rank"]).all()
    assert not result.main["front"].any()
    assert str(result.warnings[-1]) == "no case is ranked: none was answered and meets every requirement"
    assert best_of(result.main) is None
    assert [(each.label, each.value, each.note) for each in headlines(result)] == [
        ("cases that meet every requirement", "0", "of 2 cases")
    ]
    told = gates(result)
    assert told is not None
    assert told["case"] is None
    assert {row["name"]: row["kept"] for row in told["rows"] if row["limit"]} == {
        name: f"{result.main[f'{name}_met'].sum()} of 2" for name in result.main.names if f"{name}_met" in result.main
    }


@pytest.mark.slow
def test_a_page_says_which_limits_the_best_case_keeps_and_how_many_cases_do():
    result = swept({"maximize": STROKE, "minimize": ANGLE})
    table, told = result.main, gates(result)
    assert told is not None
    row = int(np.flatnonzero(table["rank"] == 1)[0])
    assert told["case"] == f"{row + 1}"
    rows = {each["name"]: each for each in told["rows"]}
    assert rows["r"]["value"] == f"{table[R][row]:g}"
    assert rows[STROKE]["sense"] == "more is better"
    for name in [name for name in table.names if f"{name}_met" in table]:
        assert rows[name]["met"] is True
        assert rows[name]["kept"] == f"{table[f'{name}_met'].sum()} of {len(table)}"


def test_of_many_cases_a_page_has_the_best_or_else_the_first():
    count = MOST_CELLS
    columns = (mechdesign.Column("case", np.arange(1, count + 1)), mechdesign.Column("rank", np.arange(count, 0, -1.0)))
    table, words = telling_rows(mechdesign.Table("sweep", columns))
    assert words == f"the best {count // 2} of"
    assert table["rank"].tolist() == [*range(1, count // 2 + 1)]
    table, words = telling_rows(mechdesign.Table("sweep", (*columns[:1], mechdesign.Column("met", np.zeros(count)))))
    assert words == f"the first {count // 2} of"
    assert table["case"].tolist() == [*range(1, count // 2 + 1)]
    assert telling_rows(table)[1] == "all"


@pytest.mark.slow
def test_a_case_that_does_not_turn_has_no_rank_and_is_told_unless_it_may_be_so():
    text = SLIDER_CRANK.partition("requirements")[0]
    # A rod shorter than the crank does not let it turn, and the slider moves the farther before it sticks.
    matrix = {"vary": {L: [20, 100, 110]}, "best": {"maximize": STROKE}, "results": [STROKE]}
    result = mechdesign.sweep(mechdesign.load(text=text, overrides={"matrix": matrix}))
    assert result.main["exit_code"].tolist() == [0, 0, 0]
    np.testing.assert_array_equal(result.main["rank"], [np.nan, 1, 1])
    assert np.isnan(result.main[STROKE]).tolist() == [True, False, False]
    assert "1 of 3 cases that meet every requirement have no rank" in str(result.warnings[-1])
    assert str(result.warnings[-1]).endswith("the first is case 1 (l 20)")
    required = {"result": STROKE, "at_least": 10, "unassembled": "allowed"}
    allowed = mechdesign.load(text=text, overrides={"matrix": matrix, "requirements": [required]})
    assert np.isfinite(mechdesign.sweep(allowed).main["rank"]).all()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("best", "message"),
    [
        ({}, "say what to 'maximize' or 'minimize'"),
        ({"sort": True}, "say what to 'maximize' or 'minimize'"),
        ({"maximize": ANGLE, "minimize": ANGLE}, "cannot be both large and small"),
        ({"maximize": [ANGLE, ANGLE]}, "is listed twice"),
        ({"maximize": "kinematics.rod.angle"}, "13 rows; ask for kinematics.rod.angle.min"),
        ({"minimize": "kinematics.rod.angel.max"}, "did you mean 'rod.angle.max'?"),
        ({"minimize": "kinematic.mu"}, "there is no command 'kinematic'; did you mean"),
        ({"maximise": ANGLE}, "did you mean 'maximize'?"),
    ],
)
def test_what_is_wrong_with_the_goals_is_told(best: dict[str, Any], message: str):
    with pytest.raises(mechdesign.ground.errors.StudyError) as error:
        swept(best)
    assert message in str(error.value)


def test_thousands_of_requirements_do_not_multiply(monkeypatch: pytest.MonkeyPatch):
    calls: list[int] = []
    extremes = Functions.extremes
    monkeypatch.setattr(Functions, "extremes", lambda *given: calls.append(1) or extremes(*given))
    many = [{"result": "kinematics.B.x", "at_most": 1000 + k} for k in range(40)]
    matrix = {"vary": {R: "25:43:2"}}
    study = mechdesign.load(text=SLIDER_CRANK, overrides={"requirements": many, "matrix": matrix})
    assert len(mechdesign.sweep(study).main) == 10
    assert 0 < len(calls) < 20
