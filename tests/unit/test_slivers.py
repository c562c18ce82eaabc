"""Pieces thinner than a raster's cells, tips, against closed forms and rasters."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

# Upper arm, forearm, and the ranges of both joints in degrees.
THIN = (0.4, 0.25, (-14.5, -13.3), (37.9, 39.3))
LONG = (0.52, 0.43, (-58.8, -49.6), (110.6, 305.7))


@pytest.mark.nightly
@pytest.mark.parametrize("about", ["[0, 0]", "[0.37, 0.57]", "[-1.9, -2.2]"])
@pytest.mark.parametrize("arm", [THIN, LONG], ids=["thin", "long"])
def test_an_arm_with_narrow_limits(
    arm: tuple[float, float, tuple[float, float], tuple[float, float]], about: str
) -> None:
    """With the elbow on one side dA = l1 l2 sin(q2) dq1 dq2; the rectangle by points all along both limits."""
    one, two, first, second = arm
    q1, q2 = np.radians(np.linspace(*first, 4001)), np.radians(np.linspace(second[0], min(second[1], 180), 40001))
    area = one * two * np.ptp(q1) * (np.cos(q2[0]) - np.cos(q2[-1]))
    forearm = one + two * np.exp(1j * q2)
    border = np.concatenate(
        [np.exp(1j * q) * forearm for q in q1[[0, -1]]] + [np.exp(1j * q1) * forearm[k] for k in (0, -1)]
    )
    box = np.ptp(border.real) * np.ptp(border.imag)
    elbow, hand = one * np.exp(1j * q1[1000]), np.exp(1j * q1[1000]) * forearm[100]
    found = mechdesign.workspace(study_of(f"""
mechanism:
  links: {{ground: {{O: [0, 0]}}, upper: [O, A, {one}], fore: [A, P, {two}]}}
  drives: {{q1: {{angle: upper}}, q2: {{angle: fore, from: upper}}}}
  limits: [{{drive: q1, min: {first[0]}, max: {first[1]}}}, {{drive: q2, min: {second[0]}, max: {second[1]}}}]
  sketch: {{A: [{elbow.real}, {elbow.imag}], P: [{hand.real}, {hand.imag}]}}
workspace: {{point: P, indices: [], scan: {{about: {about}}}}}
""")).main  # fmt: skip
    assert abs(found["area"][0] - area) <= found["area_error"][0] + 1e-9 * area
    assert abs(found["SUI"][0] - area / box) <= found["SUI_error"][0] + 1e-7
    assert found["SUI_error"][0] <= 0.02
