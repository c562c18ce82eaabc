"""Pictures draw what a result carries: they solve nothing themselves."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.stiffness import FIVE_BAR
from helpers.studies import study_of

import mechdesign
from mechdesign.door.report import writer
from mechdesign.door.report.manifest import Extras
from mechdesign.mechanism.plan import Plan
from mechdesign.questions import poses
from mechdesign.questions.kinematics.special_poses import MOST

FOUR_BAR = """
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
kinematics:
  sweep: {theta: {from: 0, to: 360, step: 5}}
"""
ARM = """
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 50], lower: [E, P, 30]}
  drives: {q1: {angle: upper}, q2: {angle: lower, from: upper}}
  sketch: {E: [30, 30], P: [10, 50]}
workspace: {point: P, scan: {about: [0, 0]}}
kinematics: {poses: [{q1: 0, q2: 30}]}
"""


@pytest.mark.nightly
@pytest.mark.parametrize(("command", "study", "options", "expected"), [
    ("workspace", ARM, {}, {"workspace.png"}),
    ("stiffness", FIVE_BAR + "  loads: [[10, -5]]\n", {}, {"springs.png", "deflections.png", "directions.png"}),
])  # fmt: skip
def test_nothing_is_solved_for_a_picture(command, study, options, expected, monkeypatch):
    """But for curves of a motion, which have places between the rows of its table."""
    given = study_of(study)
    result = getattr(mechdesign, command)(given, **options)

    solve = Plan.solve

    def refuse(plan, given, *arguments, **options):
        # The few poses of its limits and toggles are those of the picture alone.
        if np.size(given[0]) > MOST:
            raise AssertionError("solved a second time")
        return solve(plan, given, *arguments, **options)

    monkeypatch.setattr(Plan, "solve", refuse)
    drawn, failed = writer.pictures(given, result, Extras())
    assert expected <= set(drawn)
    # The mechanism's first pose is a question of kinematics; no table has the drives of the nodes in the joint space.
    others = ["joint_space", "mechanism.png"]
    assert not [warning for warning in failed if not any(name in str(warning) for name in others)]


def test_poses_of_a_long_motion_are_carried_whatever_their_chunks(monkeypatch):
    whole = mechdesign.kinematics(study_of(FOUR_BAR)).drawn.shown
    monkeypatch.setattr(poses, "POSES_AT_ONCE", 20)
    parts = mechdesign.kinematics(study_of(FOUR_BAR)).drawn.shown
    np.testing.assert_array_equal(parts.rows, whole.rows)
    for name in ("A", "B"):
        np.testing.assert_allclose(parts.configuration.point(name), whole.configuration.point(name), rtol=1e-12)
    np.testing.assert_allclose(parts.configuration.rotation("rod"), whole.configuration.rotation("rod"), rtol=1e-12)
