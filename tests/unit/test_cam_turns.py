"""Laws of cams that do not repeat by themselves: the closed profile repeats, and a part of a turn has ends."""

from __future__ import annotations

import numpy as np
import pytest

import mechdesign

CAM = """
mechanism:
  parameters: {base: 30, h: 10, half: 40}
  links: {ground: {O: [0, 0]}, disc: [O, N, 20], stem: {F: [0, 0], T: [60, 0]}}
  joints: {valve: {prismatic: [ground, stem], direction: 90, point: F}}
  drives: {cam: {angle: disc}}
  couplings: {lift: {set: valve, to: "%(law)s", cam: {link: disc, roller: F, radius: 8 mm%(more)s}}}
  sketch: {N: [20, 0], F: [0, 30], T: [0, 90]}
kinematics: {sweep: {cam: {from: %(begin)s, to: %(end)s, step: %(step)s}}, outputs: [F.y], rates: {cam: 100}}
dynamics: {loads: [{at: F, force: [0, -1]}]}
"""
LOBE = "base + h*max(0, 1 - ((cam - 90)/half)**2)**3"


def lobe(cam: object) -> object:
    return 30 + 10 * np.maximum(0, 1 - ((np.mod(cam, 360) - 90) / 40) ** 2) ** 3


@pytest.mark.parametrize("step", [1, 5, 45, 120])
@pytest.mark.parametrize(("begin", "end"), [(0, 360), (-720, 1440), (725, 0)])
def test_a_closed_profile_lifts_in_every_turn(begin: float, end: float, step: float) -> None:
    step = step if end > begin else -step
    study = mechdesign.load(text=CAM % {"law": LOBE, "more": "", "begin": begin, "end": end, "step": step})
    answer = mechdesign.kinematics(study)
    motion, extremes = answer.tables["motion"], answer.tables["extremes"]
    assert motion["F.y"] == pytest.approx(lobe(motion["cam"]), abs=1e-9)
    slope = (lobe(motion["cam"] + 1e-4) - lobe(motion["cam"] - 1e-4)) / 2e-4
    assert motion["F.y_velocity"] == pytest.approx(100 * slope, abs=1e-3)
    row = list(extremes["output"]).index("F.y")
    assert extremes["max"][row] == pytest.approx(40)
    assert extremes["min"][row] == pytest.approx(30)


def test_what_lies_outside_of_a_cam_s_range_is_told() -> None:
    for ask in (mechdesign.kinematics, mechdesign.dynamics):
        more = {"law": LOBE, "begin": 0, "end": 360, "step": 10}
        words = " ".join(map(str, ask(mechdesign.load(text=CAM % {**more, "more": ", range: [20, 200]"})).warnings))
        assert "cam lift: 18 of 37 poses lie outside of its range, cam from 20 to 200" in words
        assert "the first: cam = 0 deg" in words
        words = " ".join(map(str, ask(mechdesign.load(text=CAM % {**more, "more": ""})).warnings))
        assert "outside of its range" not in words


def test_a_range_of_a_law_that_repeats_holds_in_every_turn() -> None:
    more = {"law": "base + h*(1 - cos(cam))", "begin": 300, "end": 720, "step": 30, "more": ", range: [-45, 45]"}
    words = " ".join(map(str, mechdesign.kinematics(mechdesign.load(text=CAM % more)).warnings))
    assert "cam lift: 10 of 15 poses lie outside of its range, cam from -45 to 45" in words


def test_a_law_that_does_not_close_is_no_turn() -> None:
    more = {"law": "base + h*cam/360", "begin": 0, "end": 720, "step": 90, "more": ""}
    answer = mechdesign.kinematics(mechdesign.load(text=CAM % more))
    motion, words = answer.tables["motion"], " ".join(map(str, answer.warnings))
    assert motion["F.y"] == pytest.approx(30 + motion["cam"] / 36)
    assert "the profile does not close after a turn" in words
    assert "4 of 9 poses lie outside of its range, cam from 0 to 360" in words


def test_designs_repeat_as_the_study_does() -> None:
    text = CAM % {"law": LOBE, "begin": 400, "end": 700, "step": 5, "more": ""}
    study = mechdesign.load(
        text=text + "optimize: {variables: {h: {from: 5, to: 15, step: 5}}, maximize: kinematics.F.y.max}"
    )
    assert mechdesign.optimize(study).tables["designs"]["kinematics.F.y.max"] == pytest.approx([35, 40, 45])
