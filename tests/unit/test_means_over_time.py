"""What means along a motion are over, in words, and means over time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import mechdesign

SLIDER_CRANK = """
mechanism:
  links: {ground: {O: [0, 0]}, crank: [O, A, 30], rod: [A, C, 90], slider: {C: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], through: O}}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], C: [84, 0]}
%(command)s:
  sweep: {%(swept)s}
  rates: {theta: -50}
  loads: [{at: C, force: [-10, 0]}]
  %(more)s
requirements:
  - {result: %(command)s.theta_effort.mean, at_most: 1e9}
  - {result: %(command)s.theta_effort.rms, at_most: 1e9}
  - {result: %(command)s.theta_effort, at_most: 1e9}
"""


def slider(turn: float) -> float:
    return float(30 * np.cos(turn) + np.sqrt(8100 - 900 * np.sin(turn) ** 2))


def effort(turn: float) -> float:
    return -10 * slope(turn)


def slope(turn: float) -> float:
    return (slider(turn + 1e-6) - slider(turn - 1e-6)) / 2e-6


def asked(command: str, swept: str, more: str = "") -> mechdesign.Answer:
    study = mechdesign.load(text=SLIDER_CRANK % {"command": command, "swept": swept, "more": more})
    return getattr(mechdesign, command)(study)


@pytest.mark.slow
@pytest.mark.parametrize("command", ["kinematics", "dynamics"])
@pytest.mark.parametrize(("low", "high", "step"), [(70, 110, 2), (62.5, 100, 7.5), (60, 120, 15)])
def test_means_over_a_slider_are_told_and_time_is_offered(command: str, low: float, high: float, step: float) -> None:
    first, last = (brentq(lambda turn, end=end: slider(turn) - end, 0, np.pi) if 60 < end < 120 else np.pi * (end == 60)
                   for end in (high, low))  # fmt: skip

    def mean(function: Callable[[float], float], weight: Callable[[float], float]) -> float:
        return quad(lambda t: function(t) * weight(t), first, last)[0] / quad(weight, first, last)[0]

    sweep = f"C.x: {{from: {low}, to: {high}, step: {step}}}"
    for more, weight in (("", slope), ("means: time", lambda turn: 1.0)):
        verdicts = asked(command, sweep, more).verdicts
        assert abs(verdicts[0].worst) == pytest.approx(abs(mean(effort, weight)), rel=1e-6)
        assert verdicts[1].worst == pytest.approx(np.sqrt(mean(lambda t: effort(t) ** 2, weight)), rel=1e-6)
        told = ["mean over C.x, not time" in str(verdict) for verdict in verdicts]
        assert told == ([False, False, False] if more else [True, True, False])


@pytest.mark.slow
def test_where_what_is_swept_goes_evenly_with_time_nothing_is_told() -> None:
    sweep = "theta: {from: 0, to: 360, step: 30}"
    plain, timed = asked("dynamics", sweep), asked("dynamics", sweep, "means: time")
    assert [str(verdict) for verdict in plain.verdicts] == [str(verdict) for verdict in timed.verdicts]
    assert "not time" not in str(plain.verdicts[0])
    assert "not time" not in plain.tables["extremes"].meaning


@pytest.mark.slow
def test_the_table_of_extremes_says_what_its_means_are_over() -> None:
    sweep = "C.x: {from: 70, to: 110, step: 5}"
    assert "means over C.x and not time" in asked("dynamics", sweep).tables["extremes"].meaning
    timed = asked("dynamics", sweep, "means: time").tables["extremes"]
    assert "not time" not in timed.meaning
    row = list(timed["output"]).index("theta_effort")
    assert timed["mean"][row] == pytest.approx(asked("dynamics", sweep, "means: time").verdicts[0].worst)


def test_means_over_time_need_velocities() -> None:
    text = SLIDER_CRANK % {"command": "kinematics", "swept": "C.x: {from: 70, to: 110, step: 5}", "more": "means: time"}
    with pytest.raises(mechdesign.StudyError, match="means over time need velocities"):
        mechdesign.load(text=text.replace("rates: {theta: -50}", "outputs: [C]"))
