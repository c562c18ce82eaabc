"""Where a group without a closed form turns back: the end of its motion along one given coordinate.

There the determinant of the group's equations F(y, s) = 0 vanishes (a fold). F = 0 and det(dF/dy) = 0 together are
regular there, so that the place can be solved for to the last digit where a search for the last pose that converges
cannot.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mechdesign.mechanism.algebra import Value, quiet
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.newton import equations, set_unknowns
from mechdesign.mechanism.plan import Plan
from mechdesign.mechanism.solve import run
from mechdesign.mechanism.state import State, Unknowns, start_state
from mechdesign.numerics.arrays import Floats

# Largest errors of the equations (parts of the mechanism's size) and of the determinant (parts of that at the last
# pose) that count as solved.
SOLVED = 1e-9
# The end is sought near the last pose only: this far along the coordinate (radians, or parts of the size).
NEAR = 0.1


def turning_point(
    plan: Plan, given: Sequence[float], k: int, near: Configuration
) -> tuple[float, Configuration, int] | None:
    """Value of given coordinate `k` at which the motion ends at a singularity of a group without a closed form.

    Parameters
    ----------
    given : sequence of float
        Values of the plan's coordinates at `near` (radians and lengths).
    near : Configuration
        A single valid pose shortly before the end.

    Returns
    -------
    (float, Configuration, int) or None
        The value, the pose there, and the index of the group in the plan; None where no singularity is near.
    """
    guess = plan.unknowns(near, given)
    reach = NEAR * (1.0 if plan.structure.given[k].quantity == "angle" else plan.core.size)
    folds = [(index, _fold(plan, given, k, near, guess, index)) for index in plan.structure.unknowns]
    found = [(abs(fold[0] - given[k]), index, fold) for index, fold in folds if fold is not None]
    distance, index, (value, state) = min(found, key=lambda one: one[:2], default=(np.inf, 0, (0.0, None)))
    if state is None or distance > reach:
        return None
    return value, plan.configuration(state, (), near.places, near.vectors, None, limits=False), index


@quiet
def _fold(
    plan: Plan, given: Sequence[float], k: int, near: Configuration, guess: Unknowns, index: int
) -> tuple[float, State] | None:
    """The coordinate's value at a fold of group `index`, and the state there."""
    from scipy.optimize import root

    group, size = plan.structure.groups[index], plan.core.size
    own = np.array(guess[plan.structure.unknowns[index]], dtype=float)
    weights = np.where(np.arange(len(own)) < len(group.angles), 1.0, size)

    def at(value: float) -> list[Value]:
        return [np.asarray(value if j == k else v) for j, v in enumerate(given)]

    def state_at(unknowns: Floats) -> State:
        """Everything up to the group, with its unknowns and the coordinate in their own scales."""
        values = at(unknowns[-1])
        state = start_state(plan.core.graph, plan.structure, near.vectors, values)
        state.size = size
        run(state, plan.modes_at(values)[:index], guess)
        set_unknowns(state, group, unknowns[:-1] * weights)
        return state

    def system(unknowns: Floats) -> tuple[Floats, float]:
        """Errors of the group's equations and their determinant, lengths in parts of the mechanism's size."""
        rows, right = equations(state_at(unknowns), group)
        matrix = np.array(rows, dtype=float) * weights / size
        return np.array(right, dtype=float) / size, float(np.linalg.det(matrix))

    def residual(unknowns: Floats) -> Floats:
        errors, determinant = system(unknowns)
        return np.append(errors, determinant / unit)

    begin = np.append(own / weights, given[k])
    unit = abs(system(begin)[1]) or 1.0
    answer: Any = root(residual, begin, method="hybr", options={"xtol": 1e-14, "factor": 0.1})
    if not np.abs(residual(answer.x)).max() < SOLVED:
        return None
    value, state = float(answer.x[-1]), state_at(answer.x)
    state.place(group)
    return value, run(state, plan.modes_at(at(value)), guess, begin=index + 1)
