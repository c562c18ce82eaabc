"""Clearances between plates over a motion, against hulls of differences and against searches of the tests' own."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.drawings import distance
from scipy.optimize import minimize_scalar

import mechdesign

FOUR_BAR = """
mechanism:
  parameters: {w: 10}
  links:
    ground: {points: {O: [0, 0], D: [60, 0]}}
    crank: {from: O, to: A, length: 30}
    coupler: {from: A, to: B, length: 70}
    rocker: {from: D, to: B, length: 60}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [55, 60]}
  plates: {width: w, pin: 4}
kinematics:
  sweep: {theta: {from: 90, to: 300, step: 30}}
  collisions: [[crank, rocker]]
"""


def clearance(theta, width=10.0):
    """Of crank and rocker of the four-bar, by its closed form."""
    a = 30 * np.exp(1j * np.radians(theta))
    along = 60 - a
    share = (70**2 - 60**2 + abs(along) ** 2) / (2 * abs(along) ** 2)
    height = np.sqrt(70**2 - (share * abs(along)) ** 2) / abs(along)
    b = a + along * (share + 1j * height)
    return distance([0j, a], [60 + 0j, b]) - width


def test_the_smallest_clearance_is_found_between_the_poses():
    result = mechdesign.kinematics(mechdesign.load(text=FOUR_BAR))
    motion, extremes = result.tables["motion"], result.tables["extremes"]
    assert motion["crank.rocker.clearance"] == pytest.approx([clearance(theta) for theta in motion["theta"]], abs=1e-9)
    np.testing.assert_array_equal(motion["clearance"], motion["crank.rocker.clearance"])
    row = list(extremes["output"]).index("crank.rocker.clearance")
    angles = np.linspace(90, 300, 421)
    near = angles[np.argmin([clearance(theta) for theta in angles])]
    best = minimize_scalar(clearance, bounds=(near - 1, near + 1), method="bounded", options={"xatol": 1e-10})
    assert extremes["min"][row] == pytest.approx(best.fun, abs=1e-9)
    assert extremes["min_at"][row] == pytest.approx(best.x, abs=1e-4)
    assert best.fun < motion["crank.rocker.clearance"].min() - 0.01


def test_clearances_are_goals_and_conditions_of_designs():
    study = mechdesign.load(
        text=FOUR_BAR
        + """
optimize:
  variables: {w: {choices: [8, 10, 12, 14]}, coupler.length: {choices: [66, 70]}}
  maximize: kinematics.clearance.min
  subject_to: [{result: kinematics.crank.rocker.clearance.min, at_least: 25}]
"""
    )
    designs = mechdesign.optimize(study).tables["designs"]
    values = designs["kinematics.clearance.min"]
    alone = [
        mechdesign.kinematics(mechdesign.load(text=FOUR_BAR, overrides={"mechanism.parameters.w": w})) for w in (8, 14)
    ]
    least = [min(result.tables["extremes"]["min"][-1:]) for result in alone]
    long = designs["coupler.length"] == 70
    assert values[long][[0, -1]] == pytest.approx(least, abs=1e-9)
    assert np.diff(values[long]) == pytest.approx([-2, -2, -2], abs=1e-9)
    np.testing.assert_array_equal(designs["feasible"], values >= 25)


def test_pins_meet_what_lies_between_the_links_that_they_join():
    links = ("ground", "crank", "coupler", "rocker")
    layers = {f"mechanism.links.{link}.layer": layer for layer, link in enumerate(links, start=1)}
    study = mechdesign.load(text=FOUR_BAR, overrides={**layers, "kinematics.collisions": True})
    motion = mechdesign.kinematics(study).tables["motion"]
    # The rocker's pin in the frame passes the layers of crank and coupler; those at A and B join neighbours.
    assert [name for name in motion.names if name.endswith("clearance")] == [
        "D.crank.clearance", "D.coupler.clearance", "clearance",
    ]  # fmt: skip
    ends = 30 * np.exp(1j * np.radians(motion["theta"]))
    expected = [distance([60 + 0j], [0j, end]) - 5 - 2 for end in ends]
    assert motion["D.crank.clearance"] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("pairs", "words"),
    [
        ([["crank", "coupler"]], "'crank' and 'coupler' are joined at A"),
        ([["crank", "crank"]], "'crank' has a clearance with another link, not with itself"),
        ([], "name pairs of links"),
    ],
)
def test_wrong_pairs_are_refused(pairs, words):
    with pytest.raises(mechdesign.StudyError, match=words):
        mechdesign.load(text=FOUR_BAR, overrides={"kinematics.collisions": pairs})


def test_all_pairs_of_which_none_is_left_are_refused():
    arm = "mechanism: {links: {ground: {O: [0, 0]}, arm: [O, A, 9]}, drives: [arm], plates: {width: 2}, "
    with pytest.raises(mechdesign.StudyError, match="nothing is left to compare"):
        mechdesign.load(text=arm + "sketch: {A: [9, 0]}}", overrides={"kinematics.collisions": True})


def test_clearances_need_plates():
    with pytest.raises(mechdesign.StudyError, match=r"give mechanism.plates, such as {width: 20}"):
        mechdesign.load(text=FOUR_BAR.replace("  plates: {width: w, pin: 4}\n", ""))
