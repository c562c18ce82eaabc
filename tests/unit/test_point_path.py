"""The workspace of a mechanism with one degree of freedom: the path of a point between the limits of motion."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

FOUR_BAR = """
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
workspace: {point: B}
"""
SLIDER = """
mechanism:
  links: {ground: {O: [0, 0]}, crank: [O, A, 40], rod: [A, B, 120], slider: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], through: O, direction: 0, point: B}}
  drives: {s: {slide: guide}}
  limits: [{drive: s, min: 90, max: 150}]
  sketch: {A: [0, 40], B: [110, 0]}
workspace: {point: A}
"""


def test_a_crank_pin_runs_on_a_whole_circle() -> None:
    result = mechdesign.workspace(study_of(FOUR_BAR, "workspace.point=A"))
    main = result.main
    assert main["closed"][0]
    assert main["length"][0] == pytest.approx(2 * np.pi * 30, rel=1e-12)
    assert [main[name][0] for name in ("box_x", "box_y", "box_width", "box_height")] == pytest.approx(
        [-30, -30, 60, 60]
    )
    assert result.tables["path"]["speed_ratio"] == pytest.approx(np.full(361, 30.0), rel=1e-12)


def test_a_rocker_pin_goes_to_and_fro_between_its_dead_centres() -> None:
    """The angle between them is that of the triangles with sides 100, 60 and 90 +- 30; it is run through twice."""
    far, near = (np.arccos((100**2 + 60**2 - c**2) / (2 * 100 * 60)) for c in (120, 60))
    main = mechdesign.workspace(study_of(FOUR_BAR)).main
    assert main["length"][0] == pytest.approx(2 * 60 * (far - near), rel=1e-10)
    assert main["length_error"][0] < 1e-8 * main["length"][0]


def test_a_driven_rocker_ends_at_its_dead_centres() -> None:
    """There the crank's pin still moves: the speed ratio is infinite, and the path's length finite."""
    study = study_of(FOUR_BAR.replace("drives: [crank]", "drives: [rocker]"), "workspace.point=A")
    result = mechdesign.workspace(study)
    far, near = (np.pi - np.arccos((100**2 + 60**2 - c**2) / (2 * 100 * 60)) for c in (60, 120))
    main, path = result.main, result.tables["path"]
    assert sorted([main["from"][0], main["to"][0]]) == pytest.approx(sorted(np.degrees([near, far])), abs=1e-9)
    assert main["from_at"][0].startswith("dead centre")
    assert np.isinf(path["speed_ratio"][[0, -1]]).all()
    assert np.isfinite(path["speed_ratio"][1:-1]).all()
    # The pin's own angle at both ends: crank and rod in line, stretched (OB = 120) and folded (OB = 60).
    stretched = np.arccos((100**2 + 120**2 - 60**2) / (2 * 100 * 120))
    folded = np.arccos((100**2 + 60**2 - 60**2) / (2 * 100 * 60)) + np.pi
    turned = folded - stretched  # the sketch has the crank at 90 deg, between them
    assert main["length"][0] == pytest.approx(30 * turned, rel=1e-9)


def test_limits_of_the_drive_end_the_path() -> None:
    study = study_of(FOUR_BAR, "workspace.point=A", "mechanism.limits=[{drive: crank, min: 20, max: 110}]")
    main = mechdesign.workspace(study).main
    assert (main["from"][0], main["to"][0]) == pytest.approx((20, 110), abs=1e-9)
    assert main["length"][0] == pytest.approx(np.pi / 2 * 30, rel=1e-10)
    assert main["box_y"][0] == pytest.approx(30 * np.sin(np.radians(20)), rel=1e-9)
    assert main["box_y"][0] + main["box_height"][0] == pytest.approx(30, rel=1e-12)


def test_a_driven_slide_within_its_limits_and_beyond_them() -> None:
    main = mechdesign.workspace(study_of(SLIDER)).main
    angles = [np.arccos((40**2 + s**2 - 120**2) / (2 * 40 * s)) for s in (90, 150)]
    assert main["length"][0] == pytest.approx(40 * abs(angles[0] - angles[1]), rel=1e-10)
    # Wider limits than it can move: from dead centre to dead centre, half a turn of the crank.
    whole = mechdesign.workspace(study_of(SLIDER, "mechanism.limits=[{drive: s, min: 10, max: 350}]")).main
    assert (whole["from"][0], whole["to"][0]) == pytest.approx((80, 160), abs=1e-9)
    assert whole["length"][0] == pytest.approx(40 * np.pi, rel=1e-9)


def test_a_slide_without_limits_has_no_path() -> None:
    with pytest.raises(mechdesign.StudyError, match="give it limits"):
        mechdesign.workspace(study_of(SLIDER, "mechanism.limits=[]"))


def test_limits_that_nothing_meets() -> None:
    with pytest.raises(mechdesign.AssemblyError, match="no position"):
        mechdesign.workspace(study_of(SLIDER, "mechanism.limits=[{drive: s, min: 200, max: 350}]"))
