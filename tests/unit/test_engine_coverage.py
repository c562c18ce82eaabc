"""Intervals at 99.7 % hold the exact value in 99.7 % of seeds, within the binomial error of so many seeds."""

from __future__ import annotations

import numpy as np
import pytest
from helpers import limit_states
from helpers.limit_states import Case

from mechdesign.questions.reliability.engine.design_points import find
from mechdesign.questions.reliability.engine.problem import (
    CONFIDENCE,
    WIDTH,
    Estimate,
    LimitStates,
    binomial,
    failed,
    weighted,
)
from mechdesign.questions.reliability.methods.auto import climb, rungs
from mechdesign.questions.reliability.methods.importance_sampling import importance_sampling
from mechdesign.questions.reliability.schema.section import Precision

SEEDS = 80
CASES = {
    "half_space": limit_states.linear(8, 4.5),
    "four_branches": limit_states.four_branches(7),
    "four_branches_in_one": limit_states.four_branches(7, together=True),
    "parabola": limit_states.parabola(),
    "ring": limit_states.ring(4.0),
    "ends": limit_states.ends(4.0),
    "two_uniforms": limit_states.uniforms(2, 1.95),
}
# Where learning takes longer.
HARD_SEEDS = 40
HARD = {
    "largest_of_eight": limit_states.largest(8, 5.55),
    "two_outliers_of_three": limit_states.outliers(3, 0.002, 4.5),
    "measured": limit_states.measured(5, 0.35),
}


def generator(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.SFC64(seed))


def check(intervals: list[tuple[float, float]], exact: float) -> None:
    """Four standard errors of the share that is covered."""
    covered = np.mean([low <= exact <= high for low, high in intervals])
    assert covered >= CONFIDENCE - 4 * np.sqrt(CONFIDENCE * (1 - CONFIDENCE) / len(intervals))


def plain(problem: LimitStates, seed: int, count: int) -> Estimate:
    """Plain Monte Carlo; more samples go on with the same ones."""
    broken = int(failed(problem.margins(generator(seed).standard_normal((count, problem.dimension)).T)).sum())
    return Estimate(broken / count, *binomial(broken, count), count, count, broken)


@pytest.mark.nightly
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_importance_sampling(case: Case) -> None:
    intervals = []
    for seed in range(SEEDS):
        rng, problem = generator(seed), case.problem
        found = importance_sampling(problem, find(problem, rng), rng, 2000)
        intervals.append((found.low, found.high))
        # An interval as wide as that of plain samples would cover without importance.
        assert found.high - found.low < found.failure
    check(intervals, case.exact)


@pytest.mark.nightly
@pytest.mark.parametrize("case", HARD.values(), ids=HARD)
def test_importance_sampling_of_many_places_of_failure(case: Case) -> None:
    """One limit that is broken in many corners, or in boxes where nothing has a slope."""
    intervals = []
    for seed in range(1000, 1000 + HARD_SEEDS):
        rng, problem = generator(seed), case.problem
        found = importance_sampling(problem, find(problem, rng), rng, 2000)
        intervals.append((found.low, found.high))
    # Plain samples would have an interval of a thousandth at the least.
    assert np.median(np.diff(intervals)) < 2 * case.exact
    check(intervals, case.exact)


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["four_branches", "parabola", "ring"])
def test_importance_sampling_that_ends_at_its_precision(name: str) -> None:
    case, intervals = CASES[name], []
    for seed in range(SEEDS):
        rng, problem = generator(seed + 10_000), case.problem
        found = importance_sampling(problem, find(problem, rng), rng, 100_000, Precision(relative=0.1 / WIDTH))
        intervals.append((found.low, found.high))
        assert found.high - found.low <= 0.2 * found.failure
    check(intervals, case.exact)


@pytest.mark.nightly
@pytest.mark.parametrize(("name", "used"), [
    ("half_space_2", "monte_carlo"), ("four_branches_in_one", "importance_sampling"), ("ring", "importance_sampling"),
])  # fmt: skip
def test_auto(name: str, used: str) -> None:
    case, intervals = {**CASES, "half_space_2": limit_states.linear(3, 1.0)}[name], []
    for seed in range(SEEDS):
        problem, other = case.problem, case.problem
        found, method, _ = climb(
            problem, Precision(relative=0.1 / WIDTH), lambda n, s=seed, p=other: plain(p, s + 10**6, n), rungs(),
            generator(seed), 100_000, 100_000,
        )  # fmt: skip
        assert method == used
        assert found.high - found.low <= 0.2 * found.failure
        intervals.append((found.low, found.high))
    check(intervals, case.exact)


@pytest.mark.slow
@pytest.mark.parametrize(("spread", "expected"), [(0.0, 5), (0.3, 5), (0.6, 50), (1.0, 500)])
def test_mean_of_weights_that_are_rare_and_skewed(spread: float, expected: float) -> None:
    """Lognormal weights at a few of 10,000 samples: the interval knows that more of the largest may come."""
    rng, samples, intervals = generator(7), 10_000, []
    exact = expected / samples * np.exp(0.5 * spread**2)
    for _ in range(2000):
        weights = np.exp(spread * rng.standard_normal(rng.binomial(samples, expected / samples)))
        intervals.append(weighted(weights.sum(), weights @ weights, weights.max(initial=0.0), samples))
    check(intervals, exact)


def test_equal_rare_weights_have_the_interval_of_a_poisson_count() -> None:
    # Garwood (1936) at 99.7 %: of 10 events the quantiles of gamma laws of shapes 10 and 11.
    from scipy.special import gammaincinv

    low, high = weighted(10 * 1e-3, 10 * 1e-6, 1e-3, 10**9)
    assert 1e12 * low == pytest.approx(gammaincinv(10, 0.0015), rel=1e-6)
    assert 1e12 * high == pytest.approx(gammaincinv(11, 0.9985), rel=1e-6)
    assert weighted(0.0, 0.0, 0.0, 1000) == (0.0, 1.0)
    assert weighted(1000.0, 1000.0, 1.0, 1000) == pytest.approx((1.0, 1.0))
