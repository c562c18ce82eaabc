"""The ladder of `auto`: which rung it ends at, and what it says where none is precise enough."""

from __future__ import annotations

import numpy as np
import pytest
from helpers import limit_states
from helpers.limit_states import Case

from mechdesign.questions.reliability.engine.problem import WIDTH, Estimate, binomial, failed, reached
from mechdesign.questions.reliability.methods.auto import FEW, PILOT, climb, disagree, rungs
from mechdesign.questions.reliability.schema.section import Precision

Said = tuple[Estimate, str, dict[str, Estimate]]


def climbed(case: Case, precision: Precision, most: int = 200_000, sees: Case | None = None) -> Said:
    """Climb; plain samples see `sees`, where this is another case."""
    seen = sees or case

    def plain(count: int) -> Estimate:
        u = np.random.default_rng(11).standard_normal((count, seen.dimension)).T
        margins = seen.margins(u)
        broken = int(failed(margins).sum())
        invalid = int(np.isnan(margins).any(axis=0).sum())
        return Estimate(broken / count, *binomial(broken, count), count, count, broken, invalid)

    return climb(case.problem, precision, plain, rungs(), np.random.default_rng(3), most, most)


def relative(share: float) -> Precision:
    """Half the interval as a share of the probability."""
    return Precision(relative=share / WIDTH)


def precise(found: Estimate, precision: Precision) -> bool:
    return reached(precision, found.failure, found.low, found.high)


@pytest.mark.slow
@pytest.mark.parametrize(("case", "share", "used"), [
    (limit_states.linear(3, 0.0), 0.2, "monte_carlo"),
    (limit_states.linear(3, 1.0), 0.05, "monte_carlo"),
    (limit_states.linear(3, 3.0), 0.05, "importance_sampling"),
    (limit_states.linear(3, 6.0), 0.05, "importance_sampling"),
    (limit_states.linear(3, -4.0), 0.01, "monte_carlo"),
    (limit_states.linear(3, 1.0), 0.002, "importance_sampling"),
    (limit_states.ends(4.5), 0.05, "importance_sampling"),
])  # fmt: skip
def test_it_ends_at_the_cheapest_rung_that_is_precise(case: Case, share: float, used: str) -> None:
    found, method, rungs = climbed(case, relative(share), 2_000_000)
    assert method == used
    assert method in rungs
    assert precise(found, relative(share))
    assert found.low <= case.exact <= found.high


def test_the_pilot_is_enough_where_nearly_everything_fails() -> None:
    found, _, rungs = climbed(limit_states.linear(3, -2.0), relative(0.05))
    assert found.evaluations == PILOT
    assert list(rungs) == ["monte_carlo"]


def test_evaluations_are_those_of_all_rungs() -> None:
    found, used, rungs = climbed(limit_states.linear(3, 5.0), relative(0.05))
    assert used == "importance_sampling"
    assert list(rungs) == ["monte_carlo", "form", "importance_sampling"]
    assert found.evaluations == rungs["importance_sampling"].evaluations + PILOT
    assert rungs["form"].evaluations < rungs["importance_sampling"].evaluations - rungs["importance_sampling"].samples


@pytest.mark.parametrize("half", [1e-2, 1e-3, 1e-5])
def test_half_a_width(half: float) -> None:
    case = limit_states.linear(3, 3.0)
    found, _, _ = climbed(case, Precision(half_width=half))
    assert 0.5 * (found.high - found.low) <= half
    assert found.low <= case.exact <= found.high


def test_half_a_width_of_failures_that_the_pilot_does_not_see() -> None:
    case = limit_states.linear(3, 5.0)
    found, _, _ = climbed(case, Precision(half_width=1e-8))
    assert 0.5 * (found.high - found.low) <= 1e-8
    assert found.low <= case.exact <= found.high


@pytest.mark.parametrize("precision", [relative(0.05), Precision(half_width=1e-9)])
def test_where_no_failure_is_seen_there_is_a_value_of_0_and_a_bound(precision: Precision) -> None:
    found, used, rungs = climbed(Case(3, lambda u: np.ones((1, u.shape[1])), 0.0), precision, FEW)
    assert used == "monte_carlo"
    assert found.failures == 0
    assert found.failure == found.low == 0.0
    assert found.high == pytest.approx(1 - 0.0015 ** (1 / FEW), rel=1e-9)
    assert rungs["form"].failure == 0.0


def test_the_most_samples_end_it_short_of_the_precision() -> None:
    case = limit_states.parabola()
    found, _, rungs = climbed(case, relative(0.01), 5000)
    assert all(each.samples <= 5000 for each in rungs.values())
    assert not precise(found, relative(0.01))
    assert found.low <= case.exact <= found.high


def test_plain_samples_catch_what_importance_sampling_misses() -> None:
    """Importance sampling is shown one of two limits only."""
    half = limit_states.linear(2, 4.0)
    both = Case(2, lambda u: np.concatenate([half.margins(u), 2.0 + u[1:]]), 0.0)
    found, used, rungs = climbed(half, relative(0.1), sees=both)
    assert used == "monte_carlo"
    assert rungs["importance_sampling"].high < rungs["monte_carlo"].low
    assert precise(found, relative(0.1))
    assert disagree(rungs["importance_sampling"], rungs["monte_carlo"]) > 100


def test_methods_agree_where_their_intervals_meet() -> None:
    one, other = Estimate(1.0, 0.5, 2.0, 0), Estimate(3.0, 1.5, 6.0, 0)
    assert disagree(one, other) == disagree(other, one) == 1.0
    assert disagree(one, Estimate(8.0, 8.0, 8.0, 0)) == 4.0
    assert disagree(one, Estimate(0.0, 0.0, 0.0, 0)) == np.inf
