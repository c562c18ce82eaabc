"""Curves of zeros over a grid: known functions of the plane, and stretches that are joined."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from mechdesign.ground.numerics.zero_curves import joined, zero_curves

# Lines of a grid, on none of which a known function has a root.
LINES = np.linspace(-1.05, 1, 40)


def zeros(function: Callable[[np.ndarray], np.ndarray]) -> list[np.ndarray]:
    """Curves on which a function of the plane is zero, by a grid of 40 lines each way over a square."""

    def place(row: np.ndarray, column: np.ndarray) -> np.ndarray:
        return np.interp(row, np.arange(40), LINES) + 1j * np.interp(column, np.arange(40), LINES)

    found = zero_curves(function(LINES[:, None] + 1j * LINES), lambda row, column: function(place(row, column)))
    return joined([place(*lines) for lines in found], 1e-9)


def test_zero_curves_of_known_functions() -> None:
    """A circle closes and lies on its radius; two crossing lines are four branches put in order."""
    (circle,) = zeros(lambda z: np.abs(z) - 0.7)
    assert circle[0] == circle[-1]
    assert np.abs(circle) == pytest.approx(np.full(len(circle), 0.7), abs=1e-12)
    assert np.abs(np.diff(circle)).sum() == pytest.approx(2 * np.pi * 0.7, rel=2e-3)
    lines = zeros(lambda z: (z**2).imag - 0.01)
    assert len(lines) == 2
    for z in lines:
        assert (z**2).imag == pytest.approx(np.full(len(z), 0.01), abs=1e-12)


def test_many_short_curves_are_joined() -> None:
    """A circle in 500 stretches, in any order and direction; a single point is none."""
    random = np.random.default_rng(3)
    turn = np.exp(2j * np.pi * np.arange(5001) / 5000)
    turn[-1] = turn[0]
    parts = [turn[10 * k : 10 * k + 11][:: random.choice([-1, 1])] for k in random.permutation(500)]
    (loop,) = joined([np.array([2.0 + 0j]), *parts], 1e-9)
    assert len(loop) == 5001
    assert loop[0] == loop[-1]
    assert np.abs(np.diff(loop)) == pytest.approx(np.full(5000, 2 * np.sin(np.pi / 5000)), rel=1e-9)


def test_a_dip_above_zero_and_a_pole_are_no_curves() -> None:
    assert zeros(lambda z: (np.abs(z) - 0.7) ** 2 + 1e-6) == []
    assert zeros(lambda z: 1 / (z.real - 0.111)) == []


def test_a_curve_ends_where_the_function_does() -> None:
    """A circle of which only the upper half is known."""
    (arc,) = zeros(lambda z: np.where(z.imag > -1e-9, np.abs(z) - 0.7, np.nan))
    assert np.abs(arc) == pytest.approx(np.full(len(arc), 0.7), abs=1e-12)
    assert np.abs(np.diff(arc)).sum() == pytest.approx(np.pi * 0.7, abs=0.1)


def test_a_line_along_the_grid() -> None:
    """Zero at the nodes of one of the grid's lines."""
    (line,) = zeros(lambda z: z.real - LINES[7])
    assert line.real == pytest.approx(np.full(len(line), LINES[7]), abs=1e-12)
    assert abs(line[-1] - line[0]) == pytest.approx(2.05, abs=1e-9)


@pytest.mark.parametrize("width", [0.3, 0.09])
def test_two_curves_two_lines_apart(width: float) -> None:
    """Concentric circles: both whole."""
    found = zeros(lambda z: (np.abs(z) - 0.7) ** 2 - (width / 2) ** 2)
    assert len(found) == 2
    for z, radius in zip(sorted(found, key=lambda z: abs(z[0])), (0.7 - width / 2, 0.7 + width / 2), strict=True):
        assert z[0] == z[-1]
        assert np.abs(z) == pytest.approx(np.full(len(z), radius), abs=1e-12)


def test_curves_that_cross() -> None:
    """Two lines that part by a half: both but for the crossing's cells, whichever branches are told as one."""
    found = zeros(lambda z: (z.imag - 0.011 - 0.25 * z.real) * (z.imag - 0.011 + 0.25 * z.real))
    assert len(found) == 2
    for z in found:
        assert np.abs(z.imag - 0.011) == pytest.approx(0.25 * np.abs(z.real), abs=1e-12)
    assert sum(np.abs(np.diff(z)).sum() for z in found) == pytest.approx(2 * 2.05 * np.hypot(1, 0.25), rel=5e-2)
