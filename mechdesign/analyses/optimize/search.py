"""Continuous and global search: independent starts, each a sample, differential evolution and descents.

Every evaluated design serves every objective: the goals' single optima, in both directions, which normalise them, and
the weighted sum of each row of weights.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from mechdesign.analyses.optimize.descent import LADDER, ROUGH, descend
from mechdesign.analyses.optimize.explorer import MISSES, UNKNOWN, Explorer, Known, Objective, Spent
from mechdesign.numerics.arrays import Floats

# Evaluations per row of weights and per (variables + 1): the fewest of a start, and the default of a search.
START, USUAL = 500, 1800
# That default where designs are evaluated one by one, per (variables + 1) and per row of weights and end of a goal.
SLOW_USUAL = 20
MOST_STARTS = 12
# Points of a start's sample per (variables + 1); with no more variables than these the cube's vertices join it.
SAMPLE, MOST_VERTICES = 16, 4
# A start's sample takes one in so many of its evaluations, at least.
SAMPLED = 6
# Differential evolution: population per variable, smallest population, generations without gain that end it.
POPULATION, SMALLEST_POPULATION, PATIENCE, ROUGH_PATIENCE = 8, 24, 8, 3
# The part of a start's evaluations that differential evolution may take.
EVOLUTION = 0.5
# An improvement below this fraction of the objective's range is left to the descents.
ENOUGH = 1e-3
# Descents at once, and how far apart they begin, in parts of the ranges.
ABREAST, APART = 6, 0.05
# Evaluations that a descent takes as a rule, in those of its slopes (2 n + 1).
DESCENT = 40
# Rounds of descents in a start: where the search may end early, and where it uses all its evaluations.
ROUNDS, MOST_ROUNDS = 2, 1000
# Steps that may not improve the optimum, in parts of the ranges; evaluations kept for that, in those of slopes.
CHECKED, MOST_CHECKS, CHECKS, SQUARES_CHECKS = 1e-4, 12, 40, 200
# Improvements below these parts of the objective, and of all its values, are rounding; of values known to a tolerance.
ROUNDING, OF_ALL, NOISE = 1e-9, 1e-10, 1e-5
# A descent that gains more than this part of the objective has not come to its end.
STILL = 1e-6
# Starts that end within this part of the best agree.
AGREE = 0.01


@dataclass(frozen=True)
class Ending:
    """How a search ended.

    Parameters
    ----------
    checked : bool
        Whether a descent from each optimum came to its end, and no small step improves it.
    ends : list of ndarray
        For each row of weights the objective's smallest value of every start, in the goal's own units where it weighs
        one; nan where a start found no feasible point.
    rounding : list of float
        For each row of weights the difference below which two of these values are the same.
    """

    checked: bool
    ends: list[Floats]
    rounding: list[float]


def allowance(dimensions: int, rows: int, goals: int, *, slow: bool) -> int:
    """Evaluations of a search where the study says none."""
    if slow:
        return SLOW_USUAL * (dimensions + 1) * (rows + 2 * goals)
    return USUAL * (dimensions + 1) * rows


def search(
    explorer: Explorer, smallest: Sequence[bool], rows: Sequence[Sequence[float]], seed: int, *, patient: bool = True
) -> Ending:
    """Fill an explorer's memory with what the goals' extremes and the best weighted sums need, while evaluations last.

    Parameters
    ----------
    smallest : sequence of bool
        Which goals are minimised.
    rows : sequence of sequence of float
        Weights, in the order of the goals.
    patient : bool
        Whether all evaluations are used; else it ends when two starts have found the same.
    """
    rng = np.random.default_rng(seed)
    budget, slope = explorer.left, 2 * explorer.dimensions + 1
    starts = int(np.clip(budget // (START * (explorer.dimensions + 1) * len(rows)), 1, MOST_STARTS))
    # The valleys of a root mean square are the narrowest.
    checks = SQUARES_CHECKS if any(part.squares for part in explorer.parts) else CHECKS
    last = min(budget // 4, checks * slope * len(rows))
    begins = []
    for k, own in enumerate(rng.spawn(starts)):
        begins.append(budget - explorer.left)
        explorer.reserve = last + (budget - last) * (starts - 1 - k) // starts
        _start(explorer, smallest, rows, own, begins[-1], patient)
        known, done = explorer.known, [*begins, budget - explorer.left]
        if not known.feasible.any():
            # Too few for anything but to look around.
            explorer(own.random((explorer.left - explorer.reserve, explorer.dimensions)))
        elif not patient:
            objectives = [_weighted(known, smallest, row) for row in rows]
            if all(_agree(known, objective, _ends(known, objective, done)) for objective in objectives):
                break
    begins.append(budget - explorer.left)
    explorer.reserve = 0
    try:
        checked = _confirmed(explorer, [_weighted(explorer.known, smallest, row) for row in rows], rng)
    except Spent:
        checked = False
    known = explorer.known
    objectives = [_weighted(known, smallest, row) for row in rows]
    merits = [known.merit(each) for each in objectives if known.feasible.any()]
    rounding = [_rounding(known, merit, merit.min()) for merit in merits] or [0.0] * len(rows)
    return Ending(checked, [_ends(known, each, begins) for each in objectives], rounding)


def _start(
    explorer: Explorer,
    smallest: Sequence[bool],
    rows: Sequence[Sequence[float]],
    rng: np.random.Generator,
    begin: int,
    patient: bool,
) -> None:
    """Search from points of its own until the evaluations of this start are used up.

    Where not all need be used it ends after `ROUNDS` of descents, or one in which two came to the same.

    Parameters
    ----------
    begin : int
        First row of `explorer.known` that belongs to this start.
    """
    n, allowed = explorer.dimensions, explorer.left - explorer.reserve
    ladder = ROUGH if explorer.rough else LADDER
    tried: list[list[int]] = [[] for _ in rows]
    try:
        explorer(sample(n, rng, max(SAMPLE * (n + 1), allowed // SAMPLED), allowed // 3))
        if begin == 0 and len(smallest) > 1 and allowed > 4 * len(smallest) * DESCENT * (2 * n + 1):
            _extremes(explorer, smallest, rng, allowed)
        for row in rows:
            most = int(EVOLUTION * allowed) // len(rows)
            evolve(explorer, _weighted(explorer.known, smallest, row), rng, begin, most)
        for _ in range(MOST_ROUNDS if patient else ROUNDS):
            room = (explorer.left - explorer.reserve) // (DESCENT * (2 * n + 1) * len(rows))
            objectives = [_weighted(explorer.known, smallest, row) for row in rows]
            promising = [
                _apart(explorer.known, objective, done, begin, int(np.clip(room, 1, ABREAST)))
                for objective, done in zip(objectives, tried, strict=True)
            ]
            found = [(each, k) for each, points in zip(objectives, promising, strict=True) for k in points]
            ends = descend(explorer, found, ladder)
            agreed = True
            for objective, points, done in zip(objectives, promising, tried, strict=True):
                own, ends = ends[: len(points)], ends[len(points) :]
                done += [*points, *own]
                agreed &= _agree(explorer.known, objective, explorer.known.merit(objective)[own])
            if agreed and not patient:
                break
            if len(found) < len(rows) * ABREAST:
                explorer(rng.random((SAMPLE, n)))
    except Spent:
        pass


def _extremes(explorer: Explorer, smallest: Sequence[bool], rng: np.random.Generator, allowed: int) -> None:
    """Both ends of every goal, to normalise by; they need not be known to the last digit."""
    goals = len(smallest)
    for goal, down in enumerate(smallest):
        evolve(explorer, _single(goal, 1.0 if down else -1.0, goals), rng, 0, int(EVOLUTION * allowed) // (4 * goals))
    ends = [_single(goal, sign, goals) for goal in range(goals) for sign in (1.0, -1.0)]
    descend(explorer, [(end, k) for end in ends for k in _apart(explorer.known, end, [], 0, 1)], ROUGH[1:])


def _apart(known: Known, objective: Objective, tried: Sequence[int], begin: int, most: int) -> list[int]:
    """Rows of the best points with a value that lie apart from each other and from those that were tried."""
    merit = known.merit(objective)[begin:]
    found: list[int] = []
    free = np.isfinite(merit) & known.valid[begin:]
    for k in tried:
        free &= np.abs(known.u[begin:] - known.u[k]).max(axis=1) > APART
    while free.any() and len(found) < most:
        k = begin + int(np.argmin(np.where(free, merit, np.inf)))
        found.append(k)
        free &= np.abs(known.u[begin:] - known.u[k]).max(axis=1) > APART
    return found


def _confirmed(explorer: Explorer, objectives: Sequence[Objective], rng: np.random.Generator) -> bool:
    """Whether no small step improves the best point of any objective; descends from where one does."""
    n, open_ = explorer.dimensions, list(objectives)
    ladder: Sequence[tuple[float, float]] = ROUGH[-1:] if explorer.rough else LADDER
    for _ in range(MOST_CHECKS):
        known = explorer.known
        starts = [_best(known, each) for each in open_]
        if not known.feasible[starts].all():
            return False
        before = [known.merit(each)[start] for each, start in zip(open_, starts, strict=True)]
        descend(explorer, list(zip(open_, starts, strict=True)), ladder, final=True)
        bests = [_best(explorer.known, each) for each in open_]
        steps = [np.concatenate([np.eye(n), -np.eye(n), rng.uniform(-1, 1, (4 * n, n))]) for _ in open_]
        points = [explorer.known.u[best] + CHECKED * around for best, around in zip(bests, steps, strict=True)]
        explorer(np.concatenate(points))
        moving = []
        for each, best, begun in zip(open_, bests, before, strict=True):
            merit = explorer.known.merit(each)
            little = _rounding(explorer.known, merit, merit[best], NOISE if explorer.rough else ROUNDING)
            still = begun - merit[best] > max(STILL * abs(merit[best]), little)
            if still or merit[best] - merit.min() > little:
                moving.append(each)
        if not moving:
            return True
        open_, ladder = moving, ladder[-1:]
    return False


def _best(known: Known, objective: Objective) -> int:
    return int(np.argmin(known.merit(objective)))


def _rounding(known: Known, merit: Floats, value: float, part: float = ROUNDING) -> float:
    """How far values of an objective may differ and still count as the same."""
    inside = merit[known.feasible]
    return part * abs(value) + OF_ALL * float(np.ptp(inside) if inside.size else 0.0)


def _ends(known: Known, objective: Objective, begins: Sequence[int]) -> Floats:
    """The best that each start found, nan where that is not feasible."""
    merit = np.where(known.feasible, known.merit(objective), np.nan)
    parts = [merit[a:b] for a, b in pairwise(begins)]
    return np.array([np.nan if np.isnan(part).all() else np.nanmin(part) for part in parts])


def _agree(known: Known, objective: Objective, found: Floats) -> bool:
    """Whether the two smallest of some values of an objective are feasible and the same."""
    two = np.sort(found[found < MISSES])[:2]
    return len(two) == 2 and bool(np.ptp(two) <= _rounding(known, known.merit(objective), two[0]))


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
    """The weighted sum of normalised goals [S1, eq. 28], turned round so that less is better; a goal alone as it is."""
    signs = np.where(smallest, 1.0, -1.0)
    if np.count_nonzero(row) == 1:
        return Objective(signs * np.sign(row))
    values = known.values[known.feasible if known.feasible.any() else known.valid]
    span = np.ptp(values, axis=0) if len(values) else np.ones(len(row))
    return Objective(np.asarray(row) * signs / np.where(span > 0, span, np.inf))


def evolve(
    explorer: Explorer, objective: Objective, rng: np.random.Generator, begin: int = 0, most: int = 1000
) -> None:
    """Differential evolution, a generation a batch, begun with the best known points and some others.

    [Storn & Price, Differential evolution, 1997; scipy.optimize.differential_evolution.]

    Parameters
    ----------
    begin : int
        First row of `explorer.known` that it may begin with.
    most : int
        Evaluations.
    """
    from scipy.optimize import differential_evolution

    # Its stubs know no vectorized functions.
    begin_evolution: Any = differential_evolution

    size = max(SMALLEST_POPULATION, POPULATION * explorer.dimensions)
    if most < size:
        return
    order = begin + np.argsort(explorer.known.merit(objective)[begin:], kind="stable")
    best, others = order[: size // 2], order[size // 2 :]
    chosen = np.concatenate([best, rng.permutation(others)[: size - len(best)]])
    first = explorer.known.u[chosen]
    if len(first) < size:
        first = np.concatenate([first, rng.random((size - len(first), explorer.dimensions))])
    merits: list[float] = []
    patience = ROUGH_PATIENCE if explorer.rough else PATIENCE

    def energies(u: Floats) -> Floats:
        rows = explorer(u.T)
        merit = explorer.known.merit(objective)[rows]
        return np.asarray(np.where(np.isfinite(merit), merit, UNKNOWN))

    def stalls(x: Floats, convergence: float) -> bool:
        merit = explorer.known.merit(objective)[begin:]
        merits.append(float(merit.min()))
        if len(merits) <= patience:
            return False
        inside = merit[merit < MISSES]
        gained = merits[-1 - patience] - merits[-1]
        return bool(gained <= ENOUGH * (float(np.ptp(inside)) if inside.size else abs(merits[-1])))

    begin_evolution(
        energies, [(0.0, 1.0)] * explorer.dimensions, init=first, vectorized=True, updating="deferred",
        maxiter=most // size, polish=False, tol=1e-3, recombination=0.9, callback=stalls, seed=rng,
    )  # fmt: skip
