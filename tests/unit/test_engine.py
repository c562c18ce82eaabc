"""The probability engine alone: limit states with exact answers, and what is odd about some."""

from __future__ import annotations

import numpy as np
import pytest
from helpers import limit_states
from helpers.limit_states import Case
from scipy.special import ndtr

from mechdesign.questions.reliability.engine.design_points import find
from mechdesign.questions.reliability.engine.problem import WIDTH, Estimate, LimitStates, reached
from mechdesign.questions.reliability.methods.form import form
from mechdesign.questions.reliability.methods.importance_sampling import importance_sampling
from mechdesign.questions.reliability.schema.section import Precision

CASES = {
    **{f"half_space_{d}_{beta:g}": limit_states.linear(d, beta) for d in (1, 2, 30, 100) for beta in (2.0, 4.0, 7.0)},
    "band_1": limit_states.band(1, 4.0),
    "band_30": limit_states.band(30, 5.0),
    "four_branches_7": limit_states.four_branches(7),
    "four_branches_6": limit_states.four_branches(6),
    "four_branches_in_one": limit_states.four_branches(7, together=True),
    "parabola": limit_states.parabola(),
    "parabola_far": limit_states.parabola(9.0),
    "ring_near": limit_states.ring(2.5),
    "ring_far": limit_states.ring(5.5),
    "ring_of_two_among_ten": limit_states.ring(5.0, 10),
    "ends_near": limit_states.ends(3.0),
    "ends_far": limit_states.ends(5.0),
    "one_uniform": limit_states.uniforms(1, 0.9999),
    "two_uniforms": limit_states.uniforms(2, 1.99),
    "four_uniforms": limit_states.uniforms(4, 3.7),
    "lognormals_2": limit_states.lognormals(2),
    "lognormals_40": limit_states.lognormals(40),
    "noisy": limit_states.noisy(),
}
PRECISION = Precision(relative=0.05 / WIDTH)
# Distances of the parabola's design points: where x + y dy/dx = 0, the outer two.
_X = np.sort(np.roots([0.5, -0.15, -3.985, 0.4995]).real)[[0, 2]]
PARABOLA = sorted(np.hypot(_X, 5 - 0.5 * (_X - 0.1) ** 2).tolist())


def generator(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.SFC64(seed))


def sampled(problem: LimitStates, seed: int = 1, most: int = 100_000) -> Estimate:
    rng = generator(seed)
    return importance_sampling(problem, find(problem, rng), rng, most, PRECISION)


def tangents(problem: LimitStates, seed: int = 1) -> float:
    return form(problem, find(problem, generator(seed))).failure


def test_published_probabilities() -> None:
    """Those of the literature, to the digits that it prints; the cases' own are by quadrature."""
    assert CASES["four_branches_7"].exact == pytest.approx(2.223e-3, abs=5e-7)
    assert CASES["parabola"].exact == pytest.approx(3.016e-3, abs=5e-7)
    assert CASES["lognormals_40"].exact == pytest.approx(1.97e-3, abs=2e-5)
    assert CASES["noisy"].exact == pytest.approx(1.22e-2, abs=1e-4)


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_importance_sampling_covers_the_exact_value(case: Case) -> None:
    found = sampled(case.problem)
    assert found.low <= case.exact <= found.high
    assert reached(PRECISION, found.failure, found.low, found.high)


@pytest.mark.parametrize("name", [name for name in CASES if name.startswith(("half_space", "band", "one_uniform"))])
def test_form_of_flat_limits_is_exact(name: str) -> None:
    assert tangents(CASES[name].problem) == pytest.approx(CASES[name].exact, rel=2e-3)


def test_form_of_a_series_system_is_the_union_of_its_tangents() -> None:
    tangent = 2 * ndtr(-3.0) + 2 * ndtr(-3.5) - 4 * ndtr(-3.0) * ndtr(-3.5)
    assert tangents(CASES["four_branches_7"].problem) == pytest.approx(tangent, rel=0.01)
    assert tangents(CASES["four_branches_in_one"].problem) == pytest.approx(tangent, rel=0.01)


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("name", ["ends_near", "ends_far"])
def test_form_knows_where_margins_end(name: str, seed: int) -> None:
    """Without a slope: the tangent is that of a point found by a walk, a little too near or too far."""
    assert tangents(CASES[name].problem, seed) == pytest.approx(CASES[name].exact, rel=0.35)


@pytest.mark.parametrize("seed", range(40))
@pytest.mark.parametrize(("name", "distances"), [
    ("four_branches_in_one", [3.0, 3.0, 3.5, 3.5]), ("parabola", PARABOLA), ("band_30", [5.0, 5.0]),
])  # fmt: skip
def test_all_design_points_of_one_limit_are_found(name: str, distances: list[float], seed: int) -> None:
    found = find(CASES[name].problem, generator(seed))
    assert np.linalg.norm(found.u, axis=1) == pytest.approx(distances, abs=0.01)
    assert np.linalg.norm(found.normal, axis=1) == pytest.approx(1.0)


def test_closed_derivatives_count_as_one_evaluation_each() -> None:
    case = limit_states.linear(30, 4.0)
    slope = (case.margins(np.eye(30)) - case.margins(np.zeros((30, 1))))[0]

    def gradients(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return case.margins(u), np.repeat(slope[None, :, None], u.shape[1], axis=2)

    closed, differenced = LimitStates(30, case.margins, gradients), case.problem
    assert tangents(closed) == pytest.approx(tangents(differenced), rel=1e-6)
    assert closed.evaluations < differenced.evaluations


def test_what_cannot_be_assembled_is_counted_among_the_failures() -> None:
    found = sampled(CASES["ends_near"].problem)
    assert 0 < found.invalid < found.failures < found.samples


def test_nothing_fails() -> None:
    problem = LimitStates(3, lambda u: np.ones((2, u.shape[1])))
    points = find(problem, generator(1))
    assert len(points.u) == 0
    assert form(problem, points).failure == 0.0
    found = importance_sampling(problem, points, generator(1), 1000)
    assert (found.failure, found.low, found.high, found.failures) == (0.0, 0.0, 1.0, 0)


@pytest.mark.parametrize("dead", [-1.0, np.nan])
def test_everything_fails(dead: float) -> None:
    problem = LimitStates(3, lambda u: np.full((1, u.shape[1]), dead))
    found = sampled(problem, most=10_000)
    assert found.failure <= 1.0
    assert found.high == pytest.approx(1.0, abs=0.05)


def test_form_does_not_know_what_breaks_a_limit_without_a_design_point() -> None:
    assert np.isnan(tangents(LimitStates(3, lambda u: np.full((1, u.shape[1]), -1.0))))
    # Nor where another limit has one.
    assert np.isnan(tangents(LimitStates(3, lambda u: np.stack([3.0 - u[0], np.full(u.shape[1], -1.0)]))))


def test_a_band_without_width_is_always_left() -> None:
    problem = LimitStates(3, lambda u: np.stack([u[0], -u[0]]))
    assert tangents(problem) == pytest.approx(1.0, abs=1e-6)
    assert max(tangents(problem, seed) for seed in range(1, 6)) <= 1.0
    found = sampled(problem, most=10_000)
    assert found.low <= found.failure <= found.high <= 1.0


@pytest.mark.parametrize("beta", [-0.5, -2.0, -4.0])
def test_the_mean_itself_fails(beta: float) -> None:
    case = limit_states.linear(4, beta)
    assert tangents(case.problem) == pytest.approx(case.exact, rel=1e-3)
    found = sampled(case.problem)
    assert found.low <= case.exact <= found.high


def test_a_limit_out_of_reach_of_a_bounded_variable_is_never_broken() -> None:
    case = limit_states.uniforms(2, 2.0)
    assert case.exact == 0.0
    assert sampled(case.problem, most=10_000).failure < 1e-12


@pytest.mark.slow
def test_pins_in_contact() -> None:
    """Two pins on their rims: the x offset of both beyond a limit, against the integral over the one's direction."""
    from mechdesign.questions.reliability.pin_laws import PIN_LAWS

    limit = 1.99

    def margins(u: np.ndarray) -> np.ndarray:
        law = PIN_LAWS["contact"]
        return np.asarray((limit - law.at(u[0], u[1])[0] - law.at(u[2], u[3])[0])[None])

    reach = np.arccos(limit - 1)
    turn = reach * (np.arange(20_000) + 0.5) / 20_000
    exact = float(np.mean(np.arccos(limit - np.cos(turn))) / np.pi * reach / np.pi)
    case = Case(4, margins, exact)
    found = sampled(case.problem)
    assert found.low <= case.exact <= found.high
    assert found.high - found.low < 0.15 * exact


def test_the_same_seed_gives_the_same_bits() -> None:
    case = CASES["parabola"]
    assert sampled(case.problem, 5) == sampled(case.problem, 5)
    assert sampled(case.problem, 5).failure != sampled(case.problem, 6).failure


@pytest.mark.slow
def test_design_points_leave_no_wide_gap_on_a_circle() -> None:
    """Where all of a circle is as near, what lies in a gap between its points is not sampled, and not missed."""
    for seed in range(40):
        points = find(limit_states.ring(4.8, 6).problem, np.random.default_rng(seed)).u
        turns = np.sort(np.arctan2(points[:, 1], points[:, 0]))
        assert np.diff([*turns, turns[0] + 2 * np.pi]).max() < np.radians(85)


@pytest.mark.parametrize("count", [1, 2, 6, 16])
def test_dozens_of_equal_design_points_of_one_limit_are_all_found(count: int) -> None:
    points = find(limit_states.largest(count, 5.5).problem, np.random.default_rng(count))
    signs = np.round(points.u / 5.5)
    assert np.abs(points.u / 5.5 - signs).max() < 0.02
    assert len(np.unique(signs, axis=0)) == len(signs) == 2 * count
