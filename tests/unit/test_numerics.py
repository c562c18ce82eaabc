"""Numerics by themselves: groups of equations, changes of sign, roots, slopes by differences."""

from __future__ import annotations

import time

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from mechdesign.ground.expressions import Expression
from mechdesign.ground.numerics.differences import STEPS, slope
from mechdesign.ground.numerics.graphs import components
from mechdesign.ground.numerics.roots import bracketed_roots
from mechdesign.ground.numerics.sign_changes import Resolved


@pytest.mark.parametrize("seed", range(30))
def test_components_of_random_graphs(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 30))
    arcs = rng.integers(0, count, (int(rng.integers(0, 3 * count)), 2))
    found = components([(int(a), int(b)) for a, b in arcs], count)
    graph = coo_array((np.ones(len(arcs)), (arcs[:, 0], arcs[:, 1])), shape=(count, count))
    _, labels = connected_components(graph, connection="strong")
    assert {frozenset(members) for members in found} == {
        frozenset(np.flatnonzero(labels == label).tolist()) for label in labels
    }
    place = {row: k for k, members in enumerate(found) for row in members}
    assert all(place[int(b)] <= place[int(a)] for a, b in arcs)
    assert found == components([(int(a), int(b)) for a, b in arcs[::-1]], count)


def test_thousands_of_rows_take_no_time():
    count = 3000
    arcs = [(k, (7 * k) % max(k, 1)) for k in range(count)] + [(k, k // 2) for k in range(count)]
    begun = time.process_time()
    assert len(components(arcs, count)) == count
    # A matrix of reach took 20 s.
    assert time.process_time() - begun < 5


def resolved(*functions: str, ends: tuple[float, ...] = (0.0, 1.0)) -> Resolved:
    parsed = [Expression.parse(function) for function in functions]

    def look(places: np.ndarray) -> np.ndarray:
        return np.array([np.broadcast_to(one.evaluate({"x": places}), places.shape) for one in parsed])

    return Resolved.of(look, np.array(ends), np.zeros(len(parsed)))


@pytest.mark.parametrize(("function", "expected"), [
    ("x - 0.3", [0.3]), ("(x - 0.3)**2 - 1e-8", [0.2999, 0.3001]), ("(x - 0.3)**2", []), ("(x - 0.3)**2 + 1e-9", []),
    ("abs(x - 0.7) - 1e-6", [0.699999, 0.700001]), ("sin(1000*x)", np.pi * np.arange(1, 319) / 1000),
    ("sqrt(x - 0.5) - 0.1", [0.51]), ("1 + 0*x", []),
])  # fmt: skip
def test_signs_change_at_the_zeros_that_are_no_touching(function: str, expected: list[float]) -> None:
    whole = resolved(function)
    start = whole.look(np.array([1e-9]))[0]
    side = 1.0 if np.isnan(start[0]) else float(np.sign(start[0]))
    places = [change.place for change in whole.changes(np.array([side]))]
    if "sqrt" in function:
        # Without a value it counts as positive.
        places = places[1:]
    assert places == pytest.approx(expected, abs=1e-10)


def test_changes_of_several_functions_come_in_order_with_their_signs() -> None:
    changes = resolved("x - 0.6", "0.2 - x").changes(np.array([-1.0, 1.0]))
    assert [(change.function, change.sign) for change in changes] == [(1, -1.0), (0, 1.0)]


def test_places_where_a_function_touches_zero_and_turns_back() -> None:
    assert resolved("(x - 0.4)**2").touched() == pytest.approx([0.4], abs=1e-7)
    assert resolved("(x - 0.4)**2 + 3").turning() == pytest.approx([0.4], abs=1e-7)
    assert not len(resolved("(x - 0.4)**2 + 3").touched())


def test_an_expression_is_kept_on_a_side_of_its_corners() -> None:
    expression = Expression.parse("max(0, abs(x - 3) - 1)*min(y, 2)")
    corners = [corner.argument for corner in expression.corners()]
    assert [corner.evaluate({"x": 10.0, "y": 5.0}) for corner in corners] == [7, -6, 3]
    sides = dict(zip([corner.program for corner in corners], (1.0, -1.0, 1.0), strict=True))
    for x, y in ((10.0, 5.0), (1.0, 0.5)):
        assert expression.held(sides).evaluate({"x": x, "y": y}) == (x - 3 - 1) * 2
    assert expression.held({}) == expression


def differences(function, at, step):
    """What `slope` finds of a function of an array."""
    places = at + step * np.array([[0], [-1], [1]]) * STEPS
    middle, below, above = function(places)
    return slope(middle[:1], below[:, None], above[:, None], step)


@pytest.mark.parametrize(
    ("function", "exact"),
    [
        (np.sin, np.cos(0.7)),
        (np.exp, np.exp(0.7)),
        (lambda x: 1 / (0.72 - x), 1 / 0.02**2),
        (np.ones_like, 0.0),
    ],
)
def test_a_slope_is_within_its_error(function, exact):
    found = differences(function, 0.7, 0.007)
    assert abs(found.value[0] - exact) <= found.error[0] + 1e-15
    assert found.error[0] <= 1e-3 * abs(exact) + 1e-12


def test_a_kink_has_two_slopes_and_no_derivative():
    found = differences(lambda x: np.where(x < 2, 3 * (x - 2) ** 2 - 2 * x, 3 * x - 10), 2.0, 0.02)
    assert np.isnan(found.value[0])
    assert (found.below[0], found.above[0]) == pytest.approx((-2, 3), rel=1e-6)


def test_counts_of_samples_are_not_taken_for_a_smooth_result():
    """A piecewise constant result has a slope of 0 at small steps; its own is that over many of its parts."""
    random = np.random.default_rng(4)
    places = np.sort(random.uniform(-1, 1, 20_000))
    covered = 0
    for at in random.uniform(-0.5, 0.5, 50):
        found = differences(lambda x: np.searchsorted(places, x) / 10_000, at, 0.01)
        assert found.error[0] > 0.01
        covered += abs(found.value[0] - 1.0) <= found.error[0]
    assert covered >= 40


def test_roots_of_many_functions() -> None:
    """Quadratics in one step; a kink, a step and a function that ends (nan) by halving."""
    functions = [
        lambda x: x * x - 2, lambda x: np.cos(x) - x, lambda x: np.where(x < 1.1, 1.0, -1.0),
        lambda x: np.where(x < 1.3, 2 - x, np.nan), lambda x: np.abs(x - 1.5) - 0.4,
    ]  # fmt: skip
    calls = np.zeros(5, dtype=int)

    def evaluate(which: np.ndarray, x: np.ndarray) -> np.ndarray:
        np.add.at(calls, which, 1)
        return np.array([functions[k](v) for k, v in zip(which, x, strict=True)])

    low, high = np.array([0.0, 0, 0, 0, 0]), np.array([2.0, 2, 2, 2, 1.5])
    third = np.array([1.0, 1, 1, 1, 1])
    every = np.arange(5)
    at = [evaluate(every, v) for v in (low, high, third)]
    calls[:] = 0
    found = bracketed_roots(evaluate, low, at[0], high, at[1], third, at[2], np.full(5, 1e-13))
    assert found == pytest.approx([np.sqrt(2), 0.7390851332151607, 1.1, 1.3, 1.1], abs=1e-12)
    assert calls[0] <= 2
