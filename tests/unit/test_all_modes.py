"""`kinematics(study, all_modes=True)`: every assembly of the same links, the sketch's first."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

FOUR_BAR = """
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
kinematics:
  sweep: {theta: {from: 0, to: 360, step: 30}}
  rates: {theta: 1}
  outputs: [B]
"""
SIX_BAR = """
mechanism:
  links:
    ground: {O: [0, 0], D: [100, 0], G: [150, 160]}
    crank: [O, A, 30]
    rod: [A, B, 90]
    rocker: [D, B, 60]
    second: [B, F, 110]
    last: [G, F, 60]
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55], F: [170, 110]}
"""
ARM = """
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 10], fore: [E, P, 8]}
  drives: [upper, fore]
  sketch: {E: [8, 5], P: [13, 11]}
"""


@pytest.mark.slow
def test_both_modes_of_a_four_bar() -> None:
    result = mechdesign.kinematics(study_of(FOUR_BAR), all_modes=True)
    motion, modes = result.tables["motion"], result.tables["modes"]
    assert modes.names == ("mode", *motion.names)
    assert result.counts["modes"] == 2
    assert len(modes) == 2 * len(motion)
    first, other = modes["mode"][0], modes["mode"][-1]
    assert first != other
    assert list(modes["mode"]) == [first] * len(motion) + [other] * len(motion)
    for name in motion.names:
        assert np.array_equal(modes[name][: len(motion)], motion[name])
    # The other B is the mirror image in the line from A to D.
    drawn, mirrored = (
        (modes["B.x"] + 1j * modes["B.y"])[rows] for rows in (slice(0, len(motion)), slice(len(motion), None))
    )
    a = 30 * np.exp(1j * np.radians(motion["theta"]))
    along = (100 - a) / abs(100 - a)
    assert mirrored == pytest.approx(a + along**2 * np.conj(drawn - a))
    assert mechdesign.kinematics(study_of(FOUR_BAR)).tables.keys() == result.tables.keys() - {"modes"}


def test_modes_that_fail_are_told_one_by_one() -> None:
    result = mechdesign.kinematics(study_of(SIX_BAR), all_modes=True)
    assert result.counts["modes"] == 4
    told = {w.split(":")[0]: w for w in map(str, result.warnings) if w.startswith("mode ")}
    modes = result.tables["modes"]
    for label in dict.fromkeys(modes["mode"]):
        bad = np.count_nonzero(~modes["valid"][modes["mode"] == label])
        assert (f"mode {label}" in told) == (bad > 0)
        if bad:
            part = "no pose is valid" if bad == 73 else f"{bad} of 73 poses are not valid"
            assert part in told[f"mode {label}"]
    assert any("no pose is valid" in line for line in told.values())


def test_modes_of_the_inverse_problem_are_its_own() -> None:
    result = mechdesign.kinematics(study_of(ARM, "kinematics={path: {P: [[3, 12], [5, 11]]}}"), all_modes=True)
    modes = result.tables["modes"]
    assert result.counts["modes"] == 2
    assert modes["P.x"] == pytest.approx([3, 5, 3, 5])
    elbow = np.angle((modes["P.x"] + 1j * modes["P.y"]) / np.exp(1j * np.radians(modes["upper"])))
    assert elbow[:2] == pytest.approx(-elbow[2:])


def test_modes_of_different_sets_of_coordinates_are_an_error() -> None:
    study = study_of(ARM, "kinematics={poses: [{P.x: 3, P.y: 12}, {upper: 10, fore: 50}]}")
    with pytest.raises(mechdesign.StudyError, match=r"kinematics\.poses: the poses give different coordinates"):
        mechdesign.kinematics(study, all_modes=True)
