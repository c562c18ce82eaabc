"""Continuous and global search: a sample of the whole space, differential evolution, then quadratic models.

Every evaluated design serves every objective: the goals' single optima, in both directions, which normalise them, and
the weighted sum of each row of weights.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mechdesign.analyses.optimize.explorer import Explorer, Known, Objective, Spent
from mechdesign.analyses.optimize.polish import NARROWEST, WIDTH, polish
from mechdesign.analyses.workspace.rays import Floats

# Points of the first sample a variable and one more; vertices of the cube join it in as few dimensions as these.
SAMPLE = 16
MOST_VERTICES = 4
POPULATION, SMALLEST_POPULATION = 5, 12
GENERATIONS, PATIENCE = 40, 3
# An improvement below this fraction of the objective's range is left to the last stage.
ENOUGH = 1e-3
# How far apart the starts of two descents are, and how much worse than the best a start may be, of the range.
APART, PROMISING = 0.2, 0.1
# Half the width of the last box of the extremes' descents, and of the first one of descents that follow others.
ROUGH, NEAR, NEAREST = 5e-3, 0.05, 1e-3


# Starts of descents in search of the best worst row, whose valleys end anywhere.
EDGED = 8


def allowance(dimensions: int, objectives: int) -> int:
    """Evaluations of a search where the study says none: several times what smooth results need."""
    return 200 * (dimensions + 1) + 300 * (dimensions + 1) * objectives


def objectives(goals: int, rows: Sequence[Sequence[float]]) -> int:
    """Number of objectives of a search: each goal up and down, and the rows that weigh several."""
    return 2 * goals + sum(sum(map(bool, row)) > 1 for row in rows)


def search(explorer: Explorer, smallest: Sequence[bool], rows: Sequence[Sequence[float]], seed: int) -> bool:
    """Fill an explorer's memory with what the goals' extremes and the best weighted sums need.

    Parameters
    ----------
    smallest : sequence of bool
        Which goals are minimised.
    rows : sequence of sequence of float
        Weights, in the order of the goals.

    Returns
    -------
    bool
        Whether it came to its end with the evaluations that were allowed.
    """
    rng = np.random.default_rng(seed)
    try:
        explorer(sample(explorer.dimensions, rng, SAMPLE * (explorer.dimensions + 1), explorer.left // 2))
        ends = [_single(goal, sign, len(smallest)) for goal in range(len(smallest)) for sign in (1.0, -1.0)]
        for goal, down in enumerate(smallest):
            evolve(explorer, ends[2 * goal + (not down)], rng)
        # To normalise by, extremes need not be known to the last digit.
        # What is worst has not been looked for all over; it begins twice.
        starts = [
            start
            for goal, down in enumerate(smallest)
            for start in [EDGED if explorer.edged(ends[2 * goal + (not down)]) else 1, 2][:: 1 if down else -1]
        ]
        descend(explorer, ends, starts=starts, narrowest=ROUGH)
        if explorer.known.feasible.any():
            for row in rows:
                if np.count_nonzero(row) > 1:
                    evolve(explorer, _weighted(explorer.known, smallest, row), rng)
            # Normalised by what has been found meanwhile, and once more where the descents have found more.
            for width in (NEAR, NEAREST):
                descend(explorer, [_weighted(explorer.known, smallest, row) for row in rows], width=width)
    except Spent:
        return False
    return True


def sample(dimensions: int, rng: np.random.Generator, count: int, most: int) -> Floats:
    """A Latin hypercube, and the vertices of the unit cube where they are few."""
    count = min(count, most)
    strata = np.stack([rng.permutation(count) for _ in range(dimensions)], axis=1)
    u = (strata + rng.random((count, dimensions))) / max(count, 1)
    if dimensions > MOST_VERTICES or count + 2**dimensions > most:
        return np.asarray(u)
    vertices = np.stack(np.meshgrid(*[[0.0, 1.0]] * dimensions, indexing="ij"), axis=-1).reshape(-1, dimensions)
    return np.concatenate([vertices, u])


def _single(goal: int, sign: float, goals: int) -> Objective:
    return Objective(sign * (np.arange(goals) == goal))


def _weighted(known: Known, smallest: Sequence[bool], row: Sequence[float]) -> Objective:
    """The weighted sum of normalised goals [S1, eq. 28], turned round so that less is better."""
    values = known.values[known.feasible]
    low, high = values.min(axis=0), values.max(axis=0)
    span = np.where(high > low, high - low, np.inf)
    return Objective(np.asarray(row) * np.where(smallest, 1.0, -1.0) / span)


def descend(
    explorer: Explorer,
    objectives: Sequence[Objective],
    *,
    starts: Sequence[int] | None = None,
    width: float = WIDTH,
    narrowest: float = NARROWEST,
) -> None:
    """Polish each objective's best known points that lie apart."""
    descents: list[tuple[Objective, int]] = []
    for objective, most in zip(objectives, starts or [1] * len(objectives), strict=True):
        merit = explorer.known.merit(objective)
        finite = merit[np.isfinite(merit)]
        enough = finite.min() + PROMISING * np.ptp(finite) if finite.size else -np.inf
        begun: list[int] = []
        for row in np.argsort(merit, kind="stable").tolist():
            if len(begun) == most or not merit[row] <= enough:
                break
            if all(np.abs(explorer.known.u[row] - explorer.known.u[other]).max() > APART for other in begun):
                begun.append(row)
        descents += [(objective, row) for row in begun]
    polish(explorer, descents, width, narrowest)


def evolve(explorer: Explorer, objective: Objective, rng: np.random.Generator) -> None:
    """Differential evolution, a generation a batch, begun with the best known points and some others.

    [Storn & Price, Differential evolution, 1997; scipy.optimize.differential_evolution.]
    """
    from scipy.optimize import differential_evolution

    # Its stubs know no vectorized functions.
    begin_evolution: Any = differential_evolution

    size = max(SMALLEST_POPULATION, POPULATION * explorer.dimensions)
    order = np.argsort(explorer.known.merit(objective), kind="stable")
    best, others = order[: size // 2], order[size // 2 :]
    chosen = np.concatenate([best, rng.permutation(others)[: size - len(best)]])
    begin = explorer.known.u[chosen]
    if len(begin) < size:
        begin = np.concatenate([begin, rng.random((size - len(begin), explorer.dimensions))])
    merits: list[float] = []

    def energies(u: Floats) -> Floats:
        rows = explorer(u.T)
        merit = explorer.known.merit(objective)
        finite = merit[np.isfinite(merit)]
        # Differential evolution compares; what cannot be built is worse than all else, but finite.
        return np.asarray(np.where(np.isfinite(merit), merit, finite.max() + 1.0 if finite.size else 1.0)[rows])

    def stalls(x: Floats, convergence: float) -> bool:
        merit = explorer.known.merit(objective)
        finite = merit[np.isfinite(merit)]
        merits.append(float(merit.min()))
        if len(merits) <= PATIENCE or not finite.size:
            return False
        return merits[-1 - PATIENCE] - merits[-1] <= ENOUGH * float(np.ptp(finite))

    begin_evolution(
        energies, [(0.0, 1.0)] * explorer.dimensions, init=begin, vectorized=True, updating="deferred",
        maxiter=GENERATIONS, polish=False, tol=1e-3, recombination=0.9, callback=stalls, seed=rng,
    )  # fmt: skip
