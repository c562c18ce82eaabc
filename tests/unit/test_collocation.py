"""Integration at Chebyshev points, against known solutions."""

from __future__ import annotations

import numpy as np
import pytest

from mechdesign.numerics.arrays import Floats
from mechdesign.numerics.collocation import Solver


def test_an_oscillator_keeps_its_phase_over_many_periods() -> None:
    solver = Solver(lambda _, y: np.array([y[1], -y[0]]), 0.0, np.array([1.0, 0.0]), 100.0, np.ones(2), 1e-11, 1e-12)
    while solver.running:
        assert solver.step()
        times = np.linspace(solver.piece.begin, solver.piece.end, 7)
        np.testing.assert_allclose(solver.piece.at(times), [np.cos(times), -np.sin(times)], atol=1e-9)
    assert solver.time == 100.0


def test_a_corner_and_a_jump_are_found_by_short_steps() -> None:
    def slope(times: Floats, states: Floats) -> Floats:
        return np.array([np.abs(times - 0.3) + (times > 0.7) + 0 * states[0]])

    solver = Solver(slope, 0.0, np.zeros(1), 1.0, np.ones(1), 1e-11, 1e-12)
    while solver.running:
        assert solver.step()
    assert solver.state[0] == pytest.approx(0.5 * (0.09 + 0.49) + 0.3, abs=1e-9)


def test_a_solution_that_ends_is_followed_up_to_there() -> None:
    solver = Solver(lambda _, y: y * y, 0.0, np.ones(1), 2.0, np.ones(1), 1e-9, 1e-9)
    with np.errstate(all="ignore"):
        while solver.step():
            pass
    assert solver.time == pytest.approx(1.0, abs=1e-6)
