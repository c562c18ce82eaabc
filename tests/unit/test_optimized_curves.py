"""A search for designs whose paths pass the points of a curve begins with linkages that are polished to it."""

import numpy as np
import pytest
from helpers.syntheses import four_bar

import mechdesign

STUDY = """
mechanism:
  parameters: {a: 15, b: 70, u: 20, v: 20}
  links:
    ground: {O: [0, 0], D: [70, 0]}
    crank: [O, A, a]
    rod: {from: A, to: B, length: b, points: {P: [u, v]}}
    rocker: [D, B, 80]
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 20], B: [60, 80]}
  targets: {P: {curve: CURVE, closed: CLOSED}}
kinematics:
  sweep: {theta: {from: FIRST, to: LAST, step: 5}}
  outputs: [P]
optimize:
  method: search
  variables: {a: {from: 10, to: 30}, b: {from: 60, to: 120}, u: {from: 0, to: 60}, v: {from: 0, to: 40}}
  minimize: [kinematics.targets.P.rms]
  subject_to: [{result: kinematics.conditioning, at_least: 0.2}]
  evaluations: 200
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("first", "last", "angles"),
    [pytest.param(0, 360, range(0, 360, 40), marks=pytest.mark.nightly), (20, 150, range(30, 140, 20))],
)
def test_few_designs_are_enough_for_a_curve_that_one_of_them_draws(first: int, last: int, angles: range) -> None:
    points = four_bar(20, 90, 80, 30, 25, np.array(angles, dtype=float), 70, 1.0)[0][0]
    text = STUDY.replace("CURVE", str([[z.real, z.imag] for z in points.tolist()]))
    text = text.replace("CLOSED", str(last == 360).lower()).replace("FIRST", str(first)).replace("LAST", str(last))
    best = mechdesign.optimize(mechdesign.load(text=text)).tables["optimum"]
    assert best["kinematics.targets.P.rms"][0] < 1e-6
    assert [best[name][0] for name in "abuv"] == pytest.approx([20, 90, 30, 25], rel=1e-5)
