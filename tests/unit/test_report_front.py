"""The designs of a Pareto front in a report: each in the poses of its own study, and which of them a page has."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from helpers.fronts import FRONTS
from helpers.tracks import decoded

import mechdesign
from mechdesign.door.report.page import front as page
from mechdesign.door.report.page.headlines import headlines
from mechdesign.door.report.page.section import section
from mechdesign.drawing import style
from mechdesign.questions.optimize.variables import study_of

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture(scope="module")
def asked() -> Any:
    """Hoeken's linkage with a few designs."""
    study = mechdesign.load(CONFIGS / "gallery" / "straight_line_front.yaml", ["optimize.evaluations=200"])
    return study, mechdesign.optimize(study)


def shown(result: Any) -> Any:
    with style.context("paper"):
        return page.front(result.drawn.designs, result.tables["pareto"], "front")


@pytest.mark.nightly
def test_every_design_moves_as_its_own_study_does(asked: Any) -> None:
    study, result = asked
    table, moving = result.tables["pareto"], shown(result)
    assert moving is not None
    for choice in moving.data["choices"][:: max(1, len(moving.data["choices"]) // 4)]:
        row = choice["number"] - 1
        own = study_of(study, {name: table[name][row].item() for name in study.optimize.variables})
        motion = mechdesign.kinematics(own).tables["motion"]
        which = choice["given"][0][2]
        decimals, steps = choice["numbers"][which]
        crank = decoded(steps, choice["poses"]) / 10**decimals
        x = choice["corner"][0] + decoded(choice["x"]["P"], choice["poses"]) / 20 / choice["scale"]
        there = np.searchsorted(crank, motion["crank"])
        np.testing.assert_allclose(crank[there], motion["crank"], atol=1e-3)
        np.testing.assert_allclose(x[there], motion["P.x"], atol=0.05 / choice["scale"])
        ElementTree.fromstring(f"<g>{choice['drawing']}</g>")


def test_a_page_has_the_knee_the_ends_and_as_many_designs_as_fit(asked: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    _, result = asked
    table = result.tables["pareto"]
    monkeypatch.setattr(page, "BUDGET", 25_000)
    moving = shown(result)
    choices = moving.data["choices"]
    assert 3 <= len(choices) < len(table)
    marks = [choice["mark"] for choice in choices if choice["mark"]]
    goals = ["kinematics.P.y_error", "kinematics.P.x_error"]
    assert marks == [f"A: best {goals[0]}", "knee", f"B: best {goals[1]}"]
    assert f"{len(choices)} of the {len(table)} designs" in moving.data["pace"]
    assert moving.words.endswith("knee")
    order = [table[goals[0]][choice["number"] - 1] for choice in choices]
    assert order == sorted(order)
    ((x, y),) = moving.data["front"]
    assert (np.diff(x) >= 0).all()
    assert (np.diff(y) >= 0).all()


def test_the_answers_name_the_knee_and_the_ends_with_their_values_and_units(asked: Any) -> None:
    _, result = asked
    optimum = result.tables["optimum"]
    told = headlines(result)
    goals = ["kinematics.P.y_error", "kinematics.P.x_error"]
    assert [number.label for number in told] == [
        *(f"{goal} of the knee" for goal in goals),
        *(f"best {g}" for g in goals),
    ]
    assert {number.unit for number in told} == {"cm"}
    assert told[0].pose == {name: optimum[name][0] for name in ("l1", "l3", "speed", *goals)}
    assert f"l3 = {optimum['l3'][1]:.4g} cm" in told[2].note.replace("\N{NO-BREAK SPACE}", " ")
    assert f"there {goals[1]} = " in told[2].note.replace("\N{NO-BREAK SPACE}", " ")


def test_the_front_stands_beside_the_linkage_and_not_once_more(asked: Any) -> None:
    study, result = asked
    part, warnings = section(study, result, {"pareto": "<svg/>", "optimum": "<svg/>"}, "", (), plots=True)
    assert warnings == ()
    assert [picture["name"] for picture in part["pictures"]] == ["optimum"]


def test_of_three_goals_the_designs_stand_in_every_panel() -> None:
    case = FRONTS["dtlz2"]
    result = mechdesign.optimize(
        case.study(3, "optimize.evaluations=150", "kinematics.sweep={arm: {from: 0, to: 90, step: 10}}")
    )
    moving = shown(result)
    assert len(moving.data["front"]) == 3
    assert all(len(x) == len(moving.data["choices"]) for panel in moving.data["front"] for x in panel)


@pytest.mark.slow
def test_a_front_without_a_motion_shows_the_workspace_of_its_knee() -> None:
    asked = "{method: pareto, evaluations: 12, maximize: [GII, area], variables: {l_a: {from: 90, to: 110}}}"
    study = mechdesign.load(CONFIGS / "five_bar.yaml", ["kinematics=", "requirements=", f"optimize={asked}"])
    result = mechdesign.optimize(study)
    part, warnings = section(study, result, {}, "", (), plots=True)
    assert warnings == ()
    assert "front" not in part["moving"]["data"]
    assert "point" in part["moving"]["data"]
