"""Workspaces of the gallery against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.circles import common_area
from helpers.gallery import study_named

import mechdesign


def test_scara_covers_its_joints_ranges_but_for_the_post() -> None:
    """(range of q1) l1 l2 (cos q2_min - cos q2_max), from |det J| = l1 l2 sin q2 (Yoshikawa, 1985), less a circle."""
    tables = mechdesign.workspace(study_named("scara")).tables
    ring = np.radians(250) * 250 * 200 * (np.cos(np.radians(15)) - np.cos(np.radians(140)))
    assert tables["indices"]["area"][0] == pytest.approx(ring - np.pi * 50**2, rel=1e-6)
    # Nowhere more than with the elbow at a right angle.
    local = tables["local"]
    best = np.argmax(local["manipulability"])
    assert local["manipulability"].max() == pytest.approx(250 * 200, rel=1e-3)
    assert np.hypot(local["x"][best], local["y"][best]) == pytest.approx(np.hypot(250, 200), abs=15)
    # The boundary closes round the post, where rays only touch it, too.
    edge = tables["boundary"]["x"] + 1j * tables["boundary"]["y"] - (290 + 60j)
    around = np.sort(np.angle(edge[np.abs(np.abs(edge) - 50) < 1e-6]))
    assert np.diff(around, append=around[0] + 2 * np.pi).max() < np.radians(10)


@pytest.mark.nightly
def test_rrr_platform_at_several_orientations_reaches_three_annuli() -> None:
    """Merlet, Gosselin and Mouly (1998); the exact area by arcs. On the singularities the rods meet or are parallel."""
    study = study_named("rrr_orientations")
    tables = mechdesign.workspace(study).tables
    corners = np.exp(1j * np.radians([210, -30, 90]))
    for angle, area in zip(tables["indices"]["platform.angle"], tables["indices"]["area"], strict=True):
        turn = np.exp(1j * np.radians(angle))
        annuli = [(complex(250 * corner - 60 * turn * corner), 40.0, 280.0) for corner in corners]
        assert area == pytest.approx(common_area(annuli), rel=1e-6)
    lines = tables["singularities"]
    rows = np.flatnonzero(lines["kind"] == "forward")[::10]
    given = {"P.x": lines["x"][rows], "P.y": lines["y"][rows], "platform.angle": lines["platform.angle"][rows]}
    pose = study.mechanism.solve(given)
    rods = []
    for k in "123":
        foot, tip = (pose[f"{name}{k}.x"] + 1j * pose[f"{name}{k}.y"] for name in "AC")
        along = (tip - foot) / 120
        rods.append([along.real, along.imag, np.imag(np.conj(foot) * along) / 60])
    determinant = np.linalg.det(np.moveaxis(np.array(rods), 2, 0))
    assert len(rows) > 10
    assert np.abs(determinant).max() < 1e-6
