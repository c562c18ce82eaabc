"""Fronts: what no other point surpasses, against the definition, of points with and without ties."""

from __future__ import annotations

import numpy as np
import pytest

from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.numerics.fronts import front


def by_definition(values: Floats) -> Flags:
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
