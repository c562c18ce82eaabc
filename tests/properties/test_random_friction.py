"""Friction in random mechanisms against bodies by Newton and Euler, whose friction is found by iteration."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.random_friction import Rubbed, rubbed
from hypothesis import assume, event, given, settings

# Part of the largest number that takes part within which numbers agree.
EXACT = 1e-9


def judge(case: Rubbed) -> None:
    """Efforts and the power of friction are those of the iteration, wherever it converges."""
    power = case.rub()
    event("converged" if power is not None else "diverged")
    assume(power is not None)
    assert power is not None
    table, bodies = case.result.main, case.bodies
    held = [np.abs(part).max(axis=1) for part in bodies.multipliers.values()]
    size = np.max([*held, np.abs(bodies.forces).max(axis=1)], axis=0)
    for name in case.layout.drives:
        effort = bodies.multipliers["drive", name][:, 0]
        assert np.all(np.abs(table[f"{name}_effort"] - effort) <= EXACT * size), name
        np.testing.assert_allclose(table[f"{name}_effort"], bodies_effort(case, name), atol=EXACT * size.max(), rtol=0)
    if case.friction:
        speed = 1 + np.abs(bodies.rates).max(axis=1)
        lost = sum(power.values(), np.zeros(bodies.poses))
        assert np.all(np.abs(table["friction_power"] - lost) <= EXACT * size * speed)
        assert np.all(table["friction_power"] <= EXACT * size * speed)


def bodies_effort(case: Rubbed, name: str) -> np.ndarray:
    """The effort of a drive by virtual work, friction among the forces."""
    case.bodies.__dict__.pop("virtual", None)
    return case.bodies.virtual[name]


@settings(max_examples=4)
@given(rubbed())
def test_friction_of_some_mechanisms(case: Rubbed) -> None:
    judge(case)


@pytest.mark.nightly
@settings(max_examples=300)
@given(rubbed())
def test_friction_of_three_hundred_mechanisms(case: Rubbed) -> None:
    judge(case)
