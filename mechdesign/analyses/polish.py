"""The last digits of an optimum: quadratic models of the objective and the conditions in a shrinking box.

A derivative of results that are known to six digits would be noise. A model fitted over a box of some width is not, and
what lies beyond a bound of a variable need not be evaluated for it. [Conn, Scheinberg & Vicente, Introduction to
Derivative-Free Optimization, 2009, ch. 10.]
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mechdesign.analyses.explorer import Explorer, Objective
from mechdesign.analyses.rays import Floats

WIDTH, NARROWEST, SHRINK = 0.1, 5e-4, 4.0
MOST_ROUNDS = 60
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


def polish(explorer: Explorer, objective: Objective, start: int, *, width: float = WIDTH) -> int:
    """Descend from a known point; returns the row of the point reached.

    Parameters
    ----------
    start : int
        Row of `explorer.known`.
    width : float
        Half the first box's width, in the unit cube.

    Raises
    ------
    Spent
        If the evaluations are used up.
    """
    centre = start
    for _ in range(MOST_ROUNDS):
        if width < NARROWEST:
            break
        at = explorer.known.u[centre]
        explorer(_stencil(at, width))
        steps = _steps(explorer, objective, centre, width)
        if steps:
            explorer(at + width * np.array(steps))
        reached = _best_near(explorer, objective, centre, 2 * width)
        moved = np.abs(explorer.known.u[reached] - at).max()
        centre = reached
        width = width / SHRINK if moved < SHORT * width else min(2 * width, WIDTH) if moved > LONG * width else width
    return centre


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
    limits = [{"type": "ineq", "fun": each.value, "jac": each.gradient} for each in conditions]
    found: list[Floats] = []
    for begin in (np.zeros(n), np.clip(-target.slope, low, high)):
        answer = minimize(
            target.value, begin, jac=target.gradient, method="SLSQP", bounds=list(zip(low, high, strict=True)),
            constraints=limits, options={"maxiter": 60},
        )  # fmt: skip
        step = np.clip(answer.x, low, high)
        if np.isfinite(step).all() and not any(np.abs(step - other).max() < 1e-3 for other in (np.zeros(n), *found)):
            found.append(step)
    return found


def _fit(z: Floats, values: Floats) -> Quadratic:
    """The quadratic nearest to values at points (of least coefficients, where they leave a choice)."""
    n = z.shape[1]
    first, second = np.tril_indices(n)
    mixed = z[:, first] * z[:, second] * np.where(first == second, 0.5, 1.0)
    columns = np.column_stack([np.ones(len(z)), z, mixed])
    weight = 1 / (1 + (z**2).sum(axis=1))
    found = np.linalg.lstsq(columns * weight[:, None], values * weight, rcond=None)[0]
    curvature = np.zeros((n, n))
    curvature[first, second] = curvature[second, first] = found[n + 1 :]
    return Quadratic(float(found[0]), found[1 : n + 1], curvature)
