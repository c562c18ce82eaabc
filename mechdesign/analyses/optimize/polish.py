"""The last digits of an optimum: quadratic models of the objective and the conditions in a shrinking box.

A derivative of results that are known to six digits would be noise. A model fitted over a box of some width is not, and
what lies beyond a bound of a variable need not be evaluated for it. [Conn, Scheinberg & Vicente, Introduction to
Derivative-Free Optimization, 2009, ch. 10.]
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechdesign.analyses.optimize.explorer import Explorer, Objective
from mechdesign.analyses.workspace.rays import Floats

WIDTH, NARROWEST, SHRINK = 0.1, 5e-4, 4.0
MOST_ROUNDS = 60
ROUNDING = 1e-9
# A step shorter than this fraction of the box narrows it, one longer than this widens it again.
SHORT, LONG = 0.3, 0.9
# With more variables the mixed terms of the model come from what lies near by chance.
MOST_MIXED = 4


@dataclass(frozen=True, eq=False)
class Quadratic:
    """``constant + slope z + z curvature z / 2``."""

    constant: float
    slope: Floats
    curvature: Floats

    def value(self, z: Floats) -> float:
        return float(self.constant + self.slope @ z + 0.5 * z @ self.curvature @ z)

    def gradient(self, z: Floats) -> Floats:
        return np.asarray(self.slope + self.curvature @ z)


def polish(
    explorer: Explorer,
    descents: Sequence[tuple[Objective, int]],
    width: float = WIDTH,
    narrowest: float = NARROWEST,
) -> None:
    """Descend from known points, all at once: a batch of designs costs little more than one.

    Parameters
    ----------
    descents : sequence of (Objective, int)
        What is made small, and the row of `explorer.known` from which.
    width, narrowest : float
        Half the first and the last box's width, in the unit cube.

    Raises
    ------
    Spent
        If the evaluations are used up.
    """
    under_way = [_descent(explorer, objective, start, width, narrowest) for objective, start in descents]
    while under_way:
        asked = [(each, next(each, None)) for each in under_way]
        under_way = [each for each, points in asked if points is not None]
        if under_way:
            explorer(np.concatenate([points for _, points in asked if points is not None]))


def _descent(explorer: Explorer, objective: Objective, start: int, width: float, narrowest: float) -> Iterator[Floats]:
    """Points to be evaluated before the next ones are asked for."""
    centre = start
    for _ in range(MOST_ROUNDS):
        if width < narrowest:
            break
        at = explorer.known.u[centre]
        yield _stencil(at, width)
        steps = _steps(explorer, objective, centre, width)
        # Where the objective has a cliff at a bound, no smooth model leads onto the bound itself.
        wanted = np.array([at, *(at + width * step for step in steps)])
        wanted = np.concatenate([wanted[1:], _onto_bounds(wanted, width)])
        yield wanted
        reached = _best_near(explorer, objective, centre, 2 * width)
        moved = np.abs(explorer.known.u[reached] - at).max()
        centre = reached
        width = width / SHRINK if moved < SHORT * width else min(2 * width, WIDTH) if moved > LONG * width else width


def _stencil(at: Floats, width: float) -> Floats:
    """Points about another one, on both sides along each variable where both are inside, else two on one side."""
    n = len(at)
    below, above = np.minimum(at, width), np.minimum(1 - at, width)
    inward = np.where(above >= below, 1.0, -1.0)
    rows = []
    for k in range(n):
        for reach in (-below[k], above[k]) if min(below[k], above[k]) > 0.1 * width else (
            inward[k] * width, 0.5 * inward[k] * width):  # fmt: skip
            rows.append(at + reach * np.eye(n)[k])
    if n <= MOST_MIXED:
        rows += [at + width * inward * (np.eye(n)[i] + np.eye(n)[j]) for i in range(n) for j in range(i)]
    return np.array(rows)


def _onto_bounds(points: Floats, width: float) -> Floats:
    """Points with every coordinate that is near an end of its range put there."""
    return np.where(points <= width, 0.0, np.where(points >= 1 - width, 1.0, points))


def _best_near(explorer: Explorer, objective: Objective, centre: int, width: float) -> int:
    known = explorer.known
    merit = known.merit(objective)
    merit[np.abs(known.u - known.u[centre]).max(axis=1) > width * (1 + 1e-9)] = np.inf
    best = int(np.argmin(merit))
    return best if merit[best] < known.merit(objective)[centre] else centre


def _steps(explorer: Explorer, objective: Objective, centre: int, width: float) -> list[Floats]:
    """Where models fitted to the points near by are best, in widths from the centre."""
    from scipy.optimize import minimize as scipy_minimize

    # Its stubs know no bounds of other than plain numbers.
    minimize: Any = scipy_minimize

    known, at = explorer.known, explorer.known.u[centre]
    z = (known.u - at) / width
    near = np.flatnonzero(known.valid & (np.abs(z).max(axis=1) <= 2 * (1 + 1e-9)))
    n = len(at)
    if len(near) <= n or not known.valid[centre]:
        return []
    order = np.argsort((z[near] ** 2).sum(axis=1), kind="stable")
    near = near[order[: 2 * (n + 1) * (n + 2)]]
    z = z[near]
    target = _fit(z, objective(known.values[near]))
    conditions = [_fit(z, column) for column in known.margins[near].T]
    low, high = np.maximum(-at / width, -1.0), np.minimum((1 - at) / width, 1.0)
    found: list[Floats] = []
    # What a quadratic leaves out of a curved condition is of this order: another point keeps clear of it by as much.
    for slack in (ROUNDING, width**2) if conditions else (0.0,):
        limits = [{"type": "ineq", "fun": _shifted(each, slack), "jac": each.gradient} for each in conditions]
        for begin in (np.zeros(n), np.clip(-target.slope, low, high)):
            answer = minimize(
                target.value, begin, jac=target.gradient, method="SLSQP", bounds=list(zip(low, high, strict=True)),
                constraints=limits, options={"maxiter": 60, "ftol": 1e-12},
            )  # fmt: skip
            step = np.clip(answer.x, low, high)
            if np.isfinite(step).all() and all(np.abs(step - other).max() > 1e-3 for other in (np.zeros(n), *found)):
                found.append(step)
    return found


def _shifted(condition: Quadratic, slack: float) -> Callable[[Floats], float]:
    return lambda z: condition.value(z) - slack


def _fit(z: Floats, values: Floats) -> Quadratic:
    """The quadratic nearest to values at points, up to a factor (of least coefficients, where they leave a choice)."""
    n = z.shape[1]
    first, second = np.tril_indices(n)
    mixed = z[:, first] * z[:, second] * np.where(first == second, 0.5, 1.0)
    columns = np.column_stack([np.ones(len(z)), z, mixed])
    weight = 1 / (1 + (z**2).sum(axis=1))
    found = np.linalg.lstsq(columns * weight[:, None], values * weight, rcond=None)[0]
    # Brought to order one, for whoever minimises it to a tolerance.
    found /= max(float(np.abs(found[1:]).max()), np.finfo(float).tiny)
    curvature = np.zeros((n, n))
    curvature[first, second] = curvature[second, first] = found[n + 1 :]
    return Quadratic(float(found[0]), found[1 : n + 1], curvature)
