"""Gallery studies of stiffness against energy methods by hand."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.gallery import study_named

import mechdesign


def test_knuckle_press_by_castigliano() -> None:
    """All links but the crank bear forces along themselves: their energy, the crank's bending, motor, pins, guide."""
    table = mechdesign.stiffness(study_named("press_stiffness")).main
    crank, rod, lower, upper, base = 50.0, 140.0, 270.0, 440.0, 136 + 270j
    for theta, stiffness in zip(table["theta"], table["k_y"], strict=True):
        a = base + crank * np.exp(1j * np.radians(theta))
        # B by the law of cosines, right of the line from O4 to A's other side: nearer to the y axis than A.
        span = abs(a)
        along = (lower**2 - rod**2 + span**2) / (2 * span)
        b = a / span * (along + 1j * np.sqrt(lower**2 - along**2))
        s = 1j * (b.imag + np.sqrt(upper**2 - b.real**2))
        # The ram is pushed down by 1: the upper link's push, in line with itself; then the knuckle's balance.
        u_upper, u_lower, u_rod = (s - b) / upper, b / lower, (a - b) / rod
        push_upper = 1 / u_upper.imag
        matrix = np.array([[u_lower.real, -u_rod.real], [u_lower.imag, -u_rod.imag]])
        # At the knuckle: upper pushes along -u_upper, lower along +u_lower, rod along -u_rod.
        push_lower, push_rod = np.linalg.solve(matrix, [push_upper * u_upper.real, push_upper * u_upper.imag])
        guide = push_upper * u_upper.real
        on_crank = push_rod * u_rod
        arm = (a - base) / crank
        axial, across = (on_crank * arm.conjugate()).real, (on_crank * arm.conjugate()).imag
        E, G = 210e3, 81e3
        bar, inertia = 40 * 80, 40 * 80**3 / 12
        tube = np.pi / 4 * (60**2 - 30**2)
        energy = (
            push_upper**2 * upper / (E * bar) + push_lower**2 * lower / (E * bar) + push_rod**2 * rod / (E * tube)
            + axial**2 * crank / (E * bar)
            + across**2 * (crank**3 / (3 * E * inertia) + crank / (5 / 6 * G * bar))
            + (across * crank) ** 2 / 1e7
            + (push_upper**2 + push_lower**2 + push_rod**2) / 2e6
            + guide**2 / 1e6
        )  # fmt: skip
        assert stiffness == pytest.approx(1 / energy, rel=1e-9)
    assert table["k_y"].max() / table["k_y"].min() > 5.5
    assert abs(table["theta"][np.argmax(table["k_y"])] - 264) < 5


def test_stiffness_map_by_the_lines_of_force() -> None:
    """K = k J' J of three cylinders, rows of J the unit vectors along them and their moments about P."""
    table = mechdesign.workspace(study_named("stiffness_map", "workspace.at={platform.angle: 30}")).tables["local"]
    place = (table["x"] + 1j * table["y"])[::97]
    base = np.array([-300, 300, 520j])
    pins = np.array([-100 - 58j, 100 - 58j, 115j]) * np.exp(1j * np.radians(30))
    along = place[:, None] + pins - base
    along /= np.abs(along)
    rows = np.stack([along.real, along.imag, (np.conj(pins) * along).imag], axis=2)
    soft = np.linalg.inv(2e4 * np.einsum("nki,nkj->nij", rows, rows))
    assert table["k_min"][::97] == pytest.approx(1 / np.linalg.eigvalsh(soft[:, :2, :2])[:, -1], rel=1e-6)
