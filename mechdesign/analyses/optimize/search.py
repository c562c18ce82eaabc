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

from mechdesign.analyses.optimize.descent import LADDER, ROUGH_LADDER, descend
from mechdesign.analyses.optimize.explorer import CONDITION_MISSED, UNKNOWN, Explorer, Known, Spent
from mechdesign.numerics.arrays import Floats

# Evaluations per row of weights and per (variables + 1): the fewest of a start, and the default of a search.
START_EVALUATIONS = 500
DEFAULT_EVALUATIONS = 1800
# That default where designs are evaluated one by one, per (variables + 1) and per row of weights and end of a goal.
SLOW_DEFAULT_EVALUATIONS = 20
MAX_STARTS = 12
# Points of a start's sample per (variables + 1); it takes one in so many of the start's evaluations, at least.
SAMPLE_POINTS = 16
SAMPLE_SHARE = 6
# With no more variables than these the cube's vertices join the sample.
MAX_VERTICES = 4
# Differential evolution: population per variable, smallest population, the part of a start's evaluations that it takes.
POPULATION = 8
SMALLEST_POPULATION = 24
EVOLUTION_PART = 0.5
# Generations that improve the objective by less than this part of its range end it; fewer of values with noise.
STALLED_GAIN = 1e-3
STALLED_GENERATIONS = 8
ROUGH_STALLED_GENERATIONS = 3
# Most descents at once, and the smallest distance between their beginnings, in parts of the ranges.
MAX_DESCENTS = 6
START_DISTANCE = 0.05
# Evaluations that a descent takes as a rule, in those of its slopes (2 n + 1).
DESCENT_EVALUATIONS = 40
# Rounds of descents in a start: where the search may end early, and where it uses all its evaluations.
MIN_ROUNDS = 2
MAX_ROUNDS = 1000
# Length of the steps that may not improve the optimum, in parts of the ranges, and rounds of such steps.
CHECK_STEP = 1e-4
MAX_CHECKS = 12
# Evaluations kept for these rounds, in those of slopes; those of a root mean square have the narrowest valleys.
CHECK_EVALUATIONS = 40
SQUARES_CHECK_EVALUATIONS = 200
# Improvements below these parts of the objective, and of its range, are rounding; of values known to a tolerance.
ROUNDING = 1e-9
RANGE_ROUNDING = 1e-10
NOISE = 1e-5
# A descent that gains more than this part of the objective has not come to its end.
ENDED_GAIN = 1e-6
# Starts that end within this part of the best agree.
AGREEMENT = 0.01


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
    best : list of float
        For each row of weights the smallest value after the last steps from the best start; nan where none is feasible.
    """

    checked: bool
    ends: list[Floats]
    rounding: list[float]
    best: list[float]


def allowance(dimensions: int, rows: int, goals: int, *, slow: bool) -> int:
    """Evaluations of a search where the study says none."""
    if slow:
        return SLOW_DEFAULT_EVALUATIONS * (dimensions + 1) * (rows + 2 * goals)
    return DEFAULT_EVALUATIONS * (dimensions + 1) * rows


def search(
    explorer: Explorer, smallest: Sequence[bool], rows: Sequence[Sequence[float]], seed: int, *, use_all: bool = True
) -> Ending:
    """Fill an explorer's memory with what the goals' extremes and the best weighted sums need, while evaluations last.

    Parameters
    ----------
    smallest : sequence of bool
        Which goals are minimised.
    rows : sequence of sequence of float
        Rows of weights.
    use_all : bool
        Whether all evaluations are used; else it ends when two starts have found the same.
    """
    rng = np.random.default_rng(seed)
    budget, slope = explorer.left, 2 * explorer.dimensions + 1
    starts = int(np.clip(budget // (START_EVALUATIONS * (explorer.dimensions + 1) * len(rows)), 1, MAX_STARTS))
    checks = SQUARES_CHECK_EVALUATIONS if any(part.squares for part in explorer.parts) else CHECK_EVALUATIONS
    last = min(budget // 4, checks * slope * len(rows))
    begins = []
    for k, own in enumerate(rng.spawn(starts)):
        begins.append(budget - explorer.left)
        explorer.reserve = last + (budget - last) * (starts - 1 - k) // starts
        _start(explorer, smallest, rows, own, begins[-1], use_all)
        known, done = explorer.known, [*begins, budget - explorer.left]
        if not known.feasible.any():
            # Too few for anything but to look around.
            explorer(own.random((explorer.left - explorer.reserve, explorer.dimensions)))
        elif not use_all:
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
    best = [float(_ends(known, each, [0, len(known.u)])[0]) for each in objectives]
    return Ending(checked, [_ends(known, each, begins) for each in objectives], rounding, best)


def _start(
    explorer: Explorer,
    smallest: Sequence[bool],
    rows: Sequence[Sequence[float]],
    rng: np.random.Generator,
    begin: int,
    use_all: bool,
) -> None:
    """Search from points of its own, rows of `explorer.known` from `begin` on, until its evaluations are used up.

    Where not all need be used it ends after `MIN_ROUNDS` of descents, or one in which two came to the same.
    """
    n, allowed = explorer.dimensions, explorer.left - explorer.reserve
    ladder = ROUGH_LADDER if explorer.rough else LADDER
    tried: list[list[int]] = [[] for _ in rows]
    try:
        explorer(sample(n, rng, max(SAMPLE_POINTS * (n + 1), allowed // SAMPLE_SHARE), allowed // 3))
        if begin == 0 and len(smallest) > 1 and allowed > 4 * len(smallest) * DESCENT_EVALUATIONS * (2 * n + 1):
            _extremes(explorer, smallest, rng, allowed)
        for row in rows:
            most = int(EVOLUTION_PART * allowed) // len(rows)
            evolve(explorer, _weighted(explorer.known, smallest, row), rng, begin, most)
        for _ in range(MAX_ROUNDS if use_all else MIN_ROUNDS):
            room = (explorer.left - explorer.reserve) // (DESCENT_EVALUATIONS * (2 * n + 1) * len(rows))
            objectives = [_weighted(explorer.known, smallest, row) for row in rows]
            promising = [
                _apart(explorer.known, objective, done, begin, int(np.clip(room, 1, MAX_DESCENTS)))
                for objective, done in zip(objectives, tried, strict=True)
            ]
            found = [(each, k) for each, points in zip(objectives, promising, strict=True) for k in points]
            ends = descend(explorer, found, ladder)
            agreed = True
            for objective, points, done in zip(objectives, promising, tried, strict=True):
                own, ends = ends[: len(points)], ends[len(points) :]
                done += [*points, *own]
                agreed &= _agree(explorer.known, objective, explorer.known.merit(objective)[own])
            if agreed and not use_all:
                break
            if len(found) < len(rows) * MAX_DESCENTS:
                explorer(rng.random((SAMPLE_POINTS, n)))
    except Spent:
        pass


def _extremes(explorer: Explorer, smallest: Sequence[bool], rng: np.random.Generator, allowed: int) -> None:
    """Both ends of every goal, to normalise by; they need not be known to the last digit."""
    goals = len(smallest)
    ends = [sign * line for line in np.eye(goals) for sign in (1.0, -1.0)]
    for goal, down in enumerate(smallest):
        evolve(explorer, ends[2 * goal + (not down)], rng, 0, int(EVOLUTION_PART * allowed) // (4 * goals))
    descend(explorer, [(end, k) for end in ends for k in _apart(explorer.known, end, [], 0, 1)], ROUGH_LADDER[1:])


def _apart(known: Known, objective: Floats, tried: Sequence[int], begin: int, most: int) -> list[int]:
    """Rows of the best points with a value that lie apart from each other and from those that were tried."""
    merit = known.merit(objective)[begin:]
    found: list[int] = []
    free = np.isfinite(merit) & known.valid[begin:]
    for k in tried:
        free &= np.abs(known.u[begin:] - known.u[k]).max(axis=1) > START_DISTANCE
    while free.any() and len(found) < most:
        k = begin + int(np.argmin(np.where(free, merit, np.inf)))
        found.append(k)
        free &= np.abs(known.u[begin:] - known.u[k]).max(axis=1) > START_DISTANCE
    return found


def _confirmed(explorer: Explorer, objectives: Sequence[Floats], rng: np.random.Generator) -> bool:
    """Whether no small step improves the best point of any objective; descends from where one does."""
    n, open_ = explorer.dimensions, list(objectives)
    ladder: Sequence[tuple[float, float]] = ROUGH_LADDER[-1:] if explorer.rough else LADDER
    for _ in range(MAX_CHECKS):
        known = explorer.known
        starts = [_best(known, each) for each in open_]
        if not known.feasible[starts].all():
            return False
        before = [known.merit(each)[start] for each, start in zip(open_, starts, strict=True)]
        descend(explorer, list(zip(open_, starts, strict=True)), ladder, final=True)
        bests = [_best(explorer.known, each) for each in open_]
        steps = [np.concatenate([np.eye(n), -np.eye(n), rng.uniform(-1, 1, (4 * n, n))]) for _ in open_]
        points = [explorer.known.u[best] + CHECK_STEP * around for best, around in zip(bests, steps, strict=True)]
        explorer(np.concatenate(points))
        moving = []
        for each, best, begun in zip(open_, bests, before, strict=True):
            merit = explorer.known.merit(each)
            little = _rounding(explorer.known, merit, merit[best], NOISE if explorer.rough else ROUNDING)
            still = begun - merit[best] > max(ENDED_GAIN * abs(merit[best]), little)
            if still or merit[best] - merit.min() > little:
                moving.append(each)
        if not moving:
            return True
        open_, ladder = moving, ladder[-1:]
    return False


def _best(known: Known, objective: Floats) -> int:
    return int(np.argmin(known.merit(objective)))


def _rounding(known: Known, merit: Floats, value: float, part: float = ROUNDING) -> float:
    """How far values of an objective may differ and still count as the same."""
    inside = merit[known.feasible]
    return part * abs(value) + RANGE_ROUNDING * float(np.ptp(inside) if inside.size else 0.0)


def _ends(known: Known, objective: Floats, begins: Sequence[int]) -> Floats:
    """The best that each start found, nan where that is not feasible."""
    merit = np.where(known.feasible, known.merit(objective), np.nan)
    parts = [merit[a:b] for a, b in pairwise(begins)]
    return np.array([np.nan if np.isnan(part).all() else np.nanmin(part) for part in parts])


def _agree(known: Known, objective: Floats, found: Floats) -> bool:
    """Whether the two smallest of some values of an objective are feasible and the same."""
    two = np.sort(found[found < CONDITION_MISSED])[:2]
    return len(two) == 2 and bool(np.ptp(two) <= _rounding(known, known.merit(objective), two[0]))


def sample(dimensions: int, rng: np.random.Generator, count: int, most: int) -> Floats:
    """A Latin hypercube, and the vertices of the unit cube where they are few."""
    count = min(count, most)
    strata = np.stack([rng.permutation(count) for _ in range(dimensions)], axis=1)
    u = (strata + rng.random((count, dimensions))) / max(count, 1)
    if dimensions > MAX_VERTICES or count + 2**dimensions > most:
        return np.asarray(u)
    vertices = np.stack(np.meshgrid(*[[0.0, 1.0]] * dimensions, indexing="ij"), axis=-1).reshape(-1, dimensions)
    return np.concatenate([vertices, u])


def _weighted(known: Known, smallest: Sequence[bool], row: Sequence[float]) -> Floats:
    """The weighted sum of normalised goals [S1, eq. 28], turned round so that less is better; a goal alone as it is."""
    signs = np.where(smallest, 1.0, -1.0)
    if np.count_nonzero(row) == 1:
        return np.asarray(signs * np.sign(row))
    values = known.values[known.feasible if known.feasible.any() else known.valid]
    span = np.ptp(values, axis=0) if len(values) else np.ones(len(row))
    return np.asarray(np.asarray(row) * signs / np.where(span > 0, span, np.inf))


def evolve(explorer: Explorer, objective: Floats, rng: np.random.Generator, begin: int = 0, most: int = 1000) -> None:
    """Differential evolution, a generation a batch, begun with the best known points and some others.

    It begins with rows of `explorer.known` from `begin` on, and evaluates `most` points.
    [Storn & Price, Differential evolution, 1997; scipy.optimize.differential_evolution.]
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
    most_stalled = ROUGH_STALLED_GENERATIONS if explorer.rough else STALLED_GENERATIONS

    def energies(u: Floats) -> Floats:
        rows = explorer(u.T)
        merit = explorer.known.merit(objective)[rows]
        return np.asarray(np.where(np.isfinite(merit), merit, UNKNOWN))

    def stalls(x: Floats, convergence: float) -> bool:
        merit = explorer.known.merit(objective)[begin:]
        merits.append(float(merit.min()))
        if len(merits) <= most_stalled:
            return False
        inside = merit[merit < CONDITION_MISSED]
        gained = merits[-1 - most_stalled] - merits[-1]
        return bool(gained <= STALLED_GAIN * (float(np.ptp(inside)) if inside.size else abs(merits[-1])))

    begin_evolution(
        energies, [(0.0, 1.0)] * explorer.dimensions, init=first, vectorized=True, updating="deferred",
        maxiter=most // size, polish=False, tol=1e-3, recombination=0.9, callback=stalls, seed=rng,
    )  # fmt: skip
