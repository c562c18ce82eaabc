"""Where a group without a closed form turns back: the end of its motion along one given coordinate.

There the determinant of the group's equations F(y, s) = 0 vanishes (a fold). With the borders b and c of the matrix J
of dF/dy chosen once, the number g of

    J w + b g = 0,   c w = 1

is zero exactly where J is singular, and F = 0, g = 0 is regular there (Griewank and Reddien 1984), so that it can be
solved to the last digit where a search for the last pose that converges cannot.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdesign.mechanism.algebra import quiet
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.continuation import unknowns_of
from mechdesign.mechanism.newton import equations, set_unknowns
from mechdesign.mechanism.solve import run
from mechdesign.mechanism.state import Guess, State, start_state
from mechdesign.numerics.arrays import Floats

if TYPE_CHECKING:
    from mechdesign.mechanism.plan import Plan

# Largest errors of the equations (parts of the mechanism's size) and of g that count as solved.
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
    guess = unknowns_of(plan.structure, plan.all_rotations(near, given), near.slides, near.nodes)
    angles = plan.structure.given[k].quantity == "angle"
    scale = 1.0 if angles else plan.core.size
    found = []
    for index in guess:
        fold = _Fold(plan, given, k, near, guess, index)
        solution = fold.solve(scale)
        if solution is not None:
            found.append((abs(solution[0] - given[k]), index, solution))
    if not found:
        return None
    _, index, (value, state) = min(found, key=lambda one: one[0])
    pose = plan.configuration(state, (), near.places, near.vectors, None, limits=False)
    return value, pose, index


class _Fold:
    def __init__(
        self, plan: Plan, given: Sequence[float], k: int, near: Configuration, guess: Guess, index: int
    ) -> None:  # fmt: skip
        self.plan, self.given, self.k, self.near, self.index = plan, list(given), k, near, index
        self.group = plan.structure.groups[index]
        self.guess = guess
        angles, slides = guess[index]
        self.start = np.array([*map(float, angles), *map(float, slides)])
        size = plan.core.size
        self.weights = np.array([1.0] * len(angles) + [size] * len(slides))
        matrix, _, _ = self.system(self.start, given[k])
        left, _, right = np.linalg.svd(matrix)
        self.b, self.c = left[:, -1], right[-1]

    @quiet
    def system(self, y: Floats, s: float) -> tuple[Floats, Floats, State]:
        """Matrix and errors of the group's equations, lengths in parts of the mechanism's size."""
        plan, size, count = self.plan, self.plan.core.size, len(self.group.angles)
        given = [np.asarray(v) for v in self.given]
        given[self.k] = np.asarray(s)
        state = start_state(plan.core.graph, plan.structure, self.near.vectors, given)
        run(state, plan.modes_at(given)[: self.index], self.guess, given, size)
        set_unknowns(state, self.group, list(y[:count]), list(y[count:]))
        rows, right = equations(state, self.group, given)
        matrix = np.array([[float(entry) for entry in row] for row in rows]) * self.weights / size
        return matrix, np.array([float(entry) for entry in right]) / size, state

    def residual(self, z: Floats) -> Floats:
        """Errors of the equations and g, for unknowns and the coordinate in their own scales."""
        matrix, errors, _ = self.system(z[:-1] * self.weights, z[-1])
        n = len(errors)
        bordered = np.block([[matrix, self.b[:, None]], [self.c[None, :], np.zeros((1, 1))]])
        try:
            g = np.linalg.solve(bordered, np.eye(n + 1)[n])[n]
        except np.linalg.LinAlgError:
            g = np.nan
        return np.append(errors, g)

    @quiet
    def solve(self, scale: float) -> tuple[float, State] | None:
        """The coordinate's value at the fold, and the state there."""
        from scipy.optimize import root

        begin = np.append(self.start / self.weights, self.given[self.k])
        answer: Any = root(self.residual, begin, method="hybr", options={"xtol": 1e-14, "factor": 0.1})
        errors = self.residual(answer.x)
        value = float(answer.x[-1])
        if not np.abs(errors).max() < SOLVED or abs(value - self.given[self.k]) > NEAR * scale:
            return None
        _, _, state = self.system(answer.x[:-1] * self.weights, value)
        state.place(self.group)
        given = [np.asarray(v) for v in self.given]
        given[self.k] = np.asarray(value)
        modes = self.plan.modes_at(given)
        return value, run(state, modes, self.guess, given, self.plan.core.size, begin=self.index + 1)
