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
