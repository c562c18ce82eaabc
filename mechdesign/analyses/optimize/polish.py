"""The last digits of an optimum: quadratic models of the objective and the conditions in a shrinking box.

A derivative of results that are known to six digits would be noise. A model fitted over a box of some width is not, and
what lies beyond a bound of a variable need not be evaluated for it. [Conn, Scheinberg & Vicente, Introduction to
Derivative-Free Optimization, 2009, ch. 10.]
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from mechdesign.analyses.optimize.explorer import Explorer, Objective
from mechdesign.analyses.optimize.models import ROUNDING, Program
from mechdesign.analyses.workspace.rays import Floats

WIDTH, NARROWEST, SHRINK = 0.1, 5e-4, 4.0
MOST_ROUNDS = 60
# A step shorter than this fraction of the box narrows it, one longer than this widens it again.
SHORT, LONG = 0.3, 0.9
# With more variables the mixed terms of the model come from what lies near by chance.
MOST_MIXED = 4
# Rows of tables are known to many more digits, and lead along valleys as far as their models reach.
MOST_MIXED_ROWS, SMOOTHER = 6, 1e-3
# Along the edge of what can be assembled no model leads on: a descent ends that in so many rounds gained less.
PATIENCE, CREEP = 8, 1e-2


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
    centre, edged = start, explorer.edged(objective)
    if edged:
        narrowest *= SMOOTHER
    best: list[float] = []
    for _ in range(MOST_ROUNDS):
        if width < narrowest:
            break
        at = explorer.known.u[centre]
        yield _stencil(at, width, MOST_MIXED_ROWS if edged else MOST_MIXED)
        steps = _steps(explorer, objective, centre, width)
        # Where the objective has a cliff at a bound, no smooth model leads onto the bound itself.
        wanted = np.array([at, *(at + width * step for step in steps)])
        wanted = np.concatenate([wanted[1:], _onto_bounds(wanted, width)])
        yield wanted
        reached = _best_near(explorer, objective, centre, 2 * width)
        moved = np.abs(explorer.known.u[reached] - at).max()
        centre = reached
        best.append(float(explorer.known.merit(objective)[centre]))
        if edged and len(best) > PATIENCE and best[-1 - PATIENCE] - best[-1] < CREEP * abs(best[-1]):
            break
        width = width / SHRINK if moved < SHORT * width else min(2 * width, WIDTH) if moved > LONG * width else width


def _stencil(at: Floats, width: float, mixed: int) -> Floats:
    """Points about another one, on both sides along each variable where both are inside, else two on one side."""
    n = len(at)
    below, above = np.minimum(at, width), np.minimum(1 - at, width)
    inward = np.where(above >= below, 1.0, -1.0)
    rows = []
    for k in range(n):
        for reach in (-below[k], above[k]) if min(below[k], above[k]) > 0.1 * width else (
            inward[k] * width, 0.5 * inward[k] * width):  # fmt: skip
            rows.append(at + reach * np.eye(n)[k])
    if n <= mixed:
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
    known, at = explorer.known, explorer.known.u[centre]
    z = (known.u - at) / width
    near = np.flatnonzero(known.valid & (np.abs(z).max(axis=1) <= 2 * (1 + 1e-9)))
    n = len(at)
    if len(near) <= n or not known.valid[centre]:
        return []
    order = np.argsort((z[near] ** 2).sum(axis=1), kind="stable")
    near = near[order[: 2 * (n + 1) * (n + 2)]]
    program = Program.near(explorer, objective, near, z[near])
    low, high = np.maximum(-at / width, -1.0), np.minimum((1 - at) / width, 1.0)
    found: list[Floats] = []
    # What a quadratic leaves out of a curved condition is of this order: another point keeps clear of it by as much.
    for slack in (ROUNDING, width**2) if known.margins.shape[1] else (0.0,):
        for begin in (np.zeros(n), np.clip(-program.descent, low, high)):
            step = program.best(begin, low, high, slack)
            if np.isfinite(step).all() and all(np.abs(step - other).max() > 1e-3 for other in (np.zeros(n), *found)):
                found.append(step)
    return found
