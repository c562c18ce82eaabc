"""Answers of the live page: in which order questions are asked, and what the mechanism shows of all of them."""

from __future__ import annotations

from itertools import accumulate, chain, repeat
from types import SimpleNamespace

import pytest
from helpers.studies import COMMENTED_FOUR_BAR

from mechdesign import load
from mechdesign.door.live import session as sessions
from mechdesign.door.live.session import Session

SWEEP = "sweep: {theta: {from: 0, to: 360, step: 30}}"
ROCKER = "{from: D, to: B, length: 60, mass: 2 kg}"
HEAVY = f"""{COMMENTED_FOUR_BAR.replace("[D, B, 60]", ROCKER)}\
kinematics: {{{SWEEP}, outputs: [rocker.angle]}}
dynamics: {{{SWEEP}, rates: {{theta: 60 rpm}}}}
"""
ASKED = {"page": "p", "changes": {"rocker.length": 61.0}, "sheet": None}


@pytest.fixture(scope="module")
def session():
    return Session(load(text=HEAVY))


@pytest.mark.slow
def test_the_question_that_took_least_the_last_time_is_asked_first(session, monkeypatch):
    # Kinematics takes 5 s, dynamics 2 s, then 9 s.
    clock = chain(accumulate([0, 5, 0, 2, 0, 9]), repeat(100))
    monkeypatch.setattr(sessions, "time", SimpleNamespace(perf_counter=lambda: next(clock)))
    orders = [session.answer({**ASKED, "turn": turn, "question": question})["order"]
              for turn, question in enumerate(["kinematics", "dynamics", "dynamics"])]  # fmt: skip
    assert orders == [["kinematics", "dynamics"], ["dynamics", "kinematics"], ["kinematics", "dynamics"]]


@pytest.mark.slow
@pytest.mark.parametrize(
    "order", [pytest.param(("kinematics", "dynamics"), marks=pytest.mark.nightly), ("dynamics", "kinematics")]
)
def test_the_mechanism_shows_the_forces_whichever_question_was_quicker(session, order):
    answers = [session.answer({**ASKED, "turn": 10, "question": question, "page": order[0]}) for question in order]
    assert "data" in answers[order.index("kinematics")]
    titles = {layer["title"] for group in answers[1]["data"]["arrows"] for layer in group["layers"]}
    assert "Joint forces" in titles
    # The numbers of both stand beside the mechanism.
    assert "rocker.angle" in answers[1]["numbers"]
    assert "theta_effort" in answers[1]["numbers"]


@pytest.mark.nightly
def test_pages_keep_their_own_answers(session):
    pages = ["one", "other"]
    for page in pages:
        session.answer({**ASKED, "turn": 1, "question": "kinematics", "page": page})
    for page in pages:
        assert session.pictures({**ASKED, "turn": 1, "question": "kinematics", "page": page})["html"]
