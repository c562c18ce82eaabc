"""Optima of a two-link arm that are known in closed form, by each method."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

ARM = """
units: {length: m}
mechanism:
  parameters: {l1: 0.6, l2: "1 - l1"}
  links:
    ground: {O: [0, 0]}
    upper: [O, E, l1]
    lower: [E, P, l2]
  drives: {q1: {angle: upper}, q2: {angle: lower, from: upper}}
  sketch: {E: [0.3, 0.3], P: [0.1, 0.7]}
workspace: {point: P, scan: {about: [0, 0]}}
"""


def optimised(section: str, *changes: str):
    return mechdesign.optimize(study_of(ARM + f"optimize: {section}\n", *changes)).tables


def test_the_largest_annulus_for_a_given_reach_has_equal_links() -> None:
    """area = 4 pi l1 l2, greatest at l1 = l2 (J. J. Craig, Introduction to Robotics, on workspaces); by a grid."""
    tables = optimised("{variables: {l1: {from: 0.3, to: 0.8, step: 0.05}}, maximize: [area]}")
    designs = tables["designs"]
    assert designs["area"] == pytest.approx(4 * np.pi * designs["l1"] * (1 - designs["l1"]), rel=1e-6)
    assert tables["optimum"]["l1"][0] == pytest.approx(0.5, abs=1e-12)
    assert tables["optimum"]["l2"][0] == pytest.approx(0.5, abs=1e-12)


def test_search_finds_equal_links() -> None:
    """The same, where no step of a grid meets it: the interval is not symmetrical about it."""
    tables = optimised("{method: search, variables: {l1: {from: 0.31, to: 0.87}}, maximize: [area]}")
    assert tables["optimum"]["l1"][0] == pytest.approx(0.5, abs=1e-3)
    assert tables["optimum"]["area"][0] == pytest.approx(np.pi, rel=1e-6)


def test_the_arm_that_can_be_isotropic_has_links_of_root_two_to_one() -> None:
    """J. K. Salisbury and J. J. Craig (1982): only then is the condition number 1 anywhere.

    The best inverse condition of other ratios is the maximum over q2 of the closed form, here by a fine table.
    """
    tables = optimised(
        "{variables: {l1: {from: 0.45, to: 0.75, step: 0.05}}, maximize: [inverse_condition_max]}",
        "mechanism.parameters.l2=0.4",
    )
    designs = tables["designs"]
    q2 = np.linspace(0.01, np.pi - 0.01, 20001)
    for l1, best in zip(designs["l1"], designs["inverse_condition_max"], strict=True):
        half = (l1**2 + 2 * 0.4**2 + 2 * l1 * 0.4 * np.cos(q2)) / (2 * l1 * 0.4 * np.sin(q2))
        assert best == pytest.approx((half - np.sqrt(half**2 - 1)).max(), abs=1e-4)
    assert tables["optimum"]["l1"][0] == pytest.approx(0.55)


@pytest.mark.nightly
def test_the_front_of_reach_and_room_has_equal_links() -> None:
    """Area 4 pi l1 l2 against the square around it, 4 (l1 + l2)^2: their ratio is at most pi/4, at l1 = l2."""
    front = optimised(
        "{method: pareto, variables: {l1: {from: 0.2, to: 1}, l2: {from: 0.2, to: 1}}, maximize: [area],"
        " minimize: [box_area], evaluations: 800}",
        "mechanism.parameters.l2=0.4",
    )["pareto"]
    assert (front["area"] <= np.pi / 4 * front["box_area"] * (1 + 1e-9)).all()
    share = front["area"] / (np.pi / 4 * front["box_area"])
    assert np.median(share) > 0.995
    assert share.min() > 0.9
    # From end to end of the variables' range.
    assert (front["area"].min(), front["area"].max()) == pytest.approx((np.pi * 0.16, np.pi * 4), rel=0.02)
    assert front["knee"].sum() == 1
