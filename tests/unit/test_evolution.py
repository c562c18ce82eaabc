"""Evolution towards a front: directions, who survives, children; fronts, hypervolumes, the cube of variables."""

from __future__ import annotations

from math import comb

import numpy as np
import pytest

import mechdesign
from mechdesign.ground.numerics.evolution import MUTATION_INDEX, offspring, simplex, survivors
from mechdesign.ground.numerics.fronts import crowding, front, hypervolume
from mechdesign.questions.optimize.variables import from_cube


@pytest.mark.parametrize(("goals", "divisions"), [(2, 1), (2, 9), (3, 12), (4, 6), (5, 4)])
def test_directions_are_all_fractions_whose_sum_is_one(goals, divisions):
    parts = simplex(goals, divisions) * divisions
    assert len(np.unique(parts, axis=0)) == len(parts) == comb(divisions + goals - 1, divisions)
    assert parts == pytest.approx(parts.round(), abs=1e-12)
    assert (parts > -1e-12).all()
    assert parts.sum(axis=1) == pytest.approx(divisions)


def test_survivors_are_sorted_by_front_then_by_crowding_then_by_what_they_miss():
    first = np.array([[0.0, 4.0], [1.0, 2.9], [2.0, 2.0], [4.0, 0.0]])
    values = np.concatenate([first + 5, [[np.nan, np.nan], [0.0, 0.0]], first])
    violations = np.array([0, 0, 0, 0, 2.0, 1.0, 0, 0, 0, 0])
    order = survivors(values, violations, None, np.random.default_rng(0))
    # Of each front the ends, then the row between farther neighbours; the rows that miss least come last but one.
    assert order.tolist() == [6, 9, 8, 7, 0, 3, 2, 1, 5, 4]


def test_nothing_feasible_is_sorted_by_what_it_misses():
    values, violations = np.zeros((3, 3)), np.array([3.0, np.inf, 1.0])
    for directions in (None, simplex(3, 2)):
        assert survivors(values, violations, directions, np.random.default_rng(0)).tolist() == [2, 0, 1]


def test_with_directions_the_nearest_of_each_survives_before_any_second():
    ends, middles = np.eye(3), (1 - np.eye(3)) / 2
    # Beside each direction a row that no other surpasses, a little off it.
    values = np.concatenate([ends, middles, ends + np.array([0.02, -0.02, 0]), middles + np.array([0.02, -0.03, 0.01])])
    order = survivors(values, np.zeros(len(values)), simplex(3, 2), np.random.default_rng(0))
    assert len(np.unique(order)) == len(values)
    shares = values[order[:6]] / np.linalg.norm(values[order[:6]], axis=1)[:, None]
    directions = simplex(3, 2) / np.linalg.norm(simplex(3, 2), axis=1)[:, None]
    assert sorted((shares @ directions.T).argmax(axis=1).tolist()) == list(range(6))


def test_children_keep_the_mean_of_their_parents_and_lie_in_the_unit_cube():
    random = np.random.default_rng(2)
    parents = 0.3 + 0.4 * random.random((4000, 5))
    children = offspring(parents, random)
    assert children.shape == parents.shape
    assert ((children >= 0) & (children <= 1)).all()
    # Parents are chosen by their position alone, which says nothing of where they lie.
    assert children.mean(axis=0) == pytest.approx(parents.mean(axis=0), abs=0.015)
    assert len(offspring(parents[:7], random)) == 6
    assert offspring(parents[:1], random).shape == (0, 5)


def test_equal_parents_have_children_that_only_mutate():
    """Of one variable in ten, by a step s with E|s| = 1 / (index + 2) [Deb & Goyal, 1996]."""
    children = offspring(np.full((20_000, 10), 0.5), np.random.default_rng(1))
    steps = np.abs(children - 0.5)
    assert (steps > 0).mean() == pytest.approx(0.1, rel=0.03)
    assert steps[steps > 0].mean() == pytest.approx(1 / (MUTATION_INDEX + 2), rel=0.03)


def test_better_parents_have_more_children():
    """Of 100 rows the better of two at random: the first half is three of four parents."""
    positions = np.arange(100.0)[:, None] / 100
    children = np.concatenate([offspring(positions, np.random.default_rng(k)) for k in range(100)])
    assert (children < 0.5).mean() == pytest.approx(0.75, abs=0.02)


def test_hypervolume_of_boxes_and_of_a_plane():
    assert hypervolume(np.array([[0.5, 0.0, 0.0], [0.0, 0.5, 0.5]]), 1.0) == pytest.approx(0.5 + 0.25 - 0.125)
    assert hypervolume(np.array([[0.0, 2.0]]), 1.0) == 0
    assert hypervolume(np.empty((0, 2)), 1.0) == 0
    # Of n steps under the line x + y = 1 up to the corner (1, 1) half of the square, less half of a step.
    x = np.linspace(0, 1, 11)
    assert hypervolume(np.column_stack([x, 1 - x]), 1.0) == pytest.approx(0.5 - 0.05)


def test_crowding_of_few_rows_and_of_equal_values():
    assert crowding(np.array([[1.0, 2.0]])).tolist() == [np.inf]
    values = np.array([[0.0, 1.0, 3.0], [1.0, 0.0, 3.0], [0.5, 0.5, 3.0], [0.25, 0.75, 3.0]])
    assert np.isinf(crowding(values)[:2]).all()


def by_definition(values: np.ndarray) -> np.ndarray:
    smaller = (values[:, None] <= values).all(axis=2) & (values[:, None] < values).any(axis=2)
    return np.asarray(~smaller.any(axis=0))


@pytest.mark.slow
@pytest.mark.parametrize("goals", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("levels", [2, 5, 40, 0])
def test_a_front_is_what_no_other_point_surpasses(goals, levels):
    random = np.random.default_rng(17 * goals + levels)
    for count in (1, 2, 40, 600):
        values = random.integers(levels, size=(count, goals)) if levels else random.random((count, goals))
        np.testing.assert_array_equal(front(values.astype(float)), by_definition(values))


def test_no_points_have_no_front():
    assert front(np.empty((0, 3))).shape == (0,)


@pytest.mark.slow
@pytest.mark.parametrize("goals", [2, 3, 4])
def test_points_of_a_sphere_are_all_on_the_front_and_nothing_outside_of_it_is(goals):
    directions = np.abs(np.random.default_rng(3).standard_normal((20_000, goals))) + 1e-3
    # The distance to the ideal point, 1 in each goal, is 1 on the sphere.
    sphere = 1 - directions / np.linalg.norm(directions, axis=1)[:, None]
    outside = sphere[::7] + 1e-9
    found = front(np.concatenate([outside, sphere]))
    assert not found[: len(outside)].any()
    assert found[len(outside) :].all()


def varied(variables: str) -> mechdesign.Study:
    """An arm with these variables; d, l and r are lengths, n is a number."""
    return mechdesign.load(
        text=f"""
mechanism:
  parameters: {{r: 40, l: 110, d: 10, n: 5}}
  links: {{ground: {{O: [0, 0]}}, upper: [O, A, r], fore: [A, B, l + d]}}
  drives: [upper, fore]
  sketch: {{A: [40, 0], B: [40, 120]}}
kinematics: {{sweep: {{upper: {{from: 0, to: 90, number: n}}, fore: 0}}, outputs: [B]}}
optimize: {{variables: {{{variables}}}, maximize: kinematics.B.x}}
"""
    )


def test_whole_numbers_and_choices_have_equal_shares_of_the_cube() -> None:
    study = varied("n: {from: 2, to: 5, integer: true}, r: {from: 30, to: 50, step: 1}, d: {choices: [8, 12, 10]}")
    u = np.linspace(0, 1, 13)[:, None] * np.ones(3)
    designs, given, points = from_cube(study, u)
    assert given.all()
    assert designs["n"].tolist() == [2, 2, 2, 3, 3, 3, 4, 4, 4, 5, 5, 5, 5]
    assert designs["d"].tolist() == [8] * 4 + [12] * 4 + [10] * 5
    assert points[:, 0] == pytest.approx(np.repeat([1, 3, 5, 7], [3, 3, 3, 4]) / 8)
    assert points[:, 1].tolist() == u[:, 1].tolist()
    for name, column in from_cube(study, points)[0].items():
        assert column.tolist() == designs[name].tolist()


def test_a_point_without_a_value_is_no_design() -> None:
    study = varied("d: {choices: [8, 12]}, n: {from: d, to: 9, integer: true}")
    assert from_cube(study, np.array([[0.2, 0.9], [0.8, 0.9]]))[1].tolist() == [True, False]
