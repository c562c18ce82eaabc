"""Continuous and global search: independent starts, each a sample, differential evolution and descents.

All objectives share the evaluated designs: the smallest and largest value of each goal, which normalise it, and the
weighted sum of each row of weights.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.questions.optimize.descent import descend
from mechdesign.questions.optimize.explorer import CONDITION_MISSED, UNKNOWN, Explorer, Points, Spent

# Most evaluations of a search where the study gives none, per (variables + 1) and per row of weights; fewer where
# designs are evaluated one by one.
DEFAULT_EVALUATIONS = 8000
ALONE_DEFAULT_EVALUATIONS = 200
# An optimum is confirmed if so many independent starts, and half of all starts, came to it.
CONFIRMATIONS = 3
# Points of a start's sample per (variables + 1); the sample uses at most one in so many of the evaluations that are
# left.
SAMPLE_POINTS = 16
SAMPLE_SHARE = 3
# Most variables with which the vertices of the cube are part of the sample.
MAX_VERTICES = 4
# Differential evolution: population per variable, smallest population, most evaluations of a start per (variables + 1),
# and the largest part of the evaluations left that it uses.
POPULATION = 8
SMALLEST_POPULATION = 24
EVOLUTION = 250
EVOLUTION_PART = 0.4
# The evolution ends after so many generations that improve the objective by less than this part of its range; after
# fewer where values have noise.
STALLED_GAIN = 1e-3
STALLED_GENERATIONS = 8
ROUGH_STALLED_GENERATIONS = 3
# Most descents of a start, fewer where values have noise, and the least distance between the points that they start
# from, in parts of the ranges.
MAX_DESCENTS = 6
ROUGH_MAX_DESCENTS = 2
START_DISTANCE = 0.05
# Least distance between the starting points of as many further descents, which begin at points of the sample.
SAMPLE_DISTANCE = 0.15
# Typical number of evaluations of a descent, in units of those for its slopes (2 n + 1).
DESCENT_EVALUATIONS = 40
# Length of the steps that confirm an optimum, none of which may improve it, in parts of the ranges; most rounds of
# these.
CHECK_STEP = 1e-4
MAX_CHECKS = 12
# Half the first width of the boxes of the descents that confirm an optimum.
CHECK_WIDTH = 1e-3
# Evaluations that are reserved for these rounds, in units of those for slopes.
CHECK_EVALUATIONS = 40
# Improvements below these parts of the objective and of its range are rounding errors; the last is the part of the
# objective where values are known to a tolerance only.
ROUNDING = 1e-9
RANGE_ROUNDING = 1e-10
NOISE = 1e-5
# A descent that gains more than this part of the objective is not finished.
ENDED_GAIN = 1e-6
# Starts that end within this part of the best came to the same optimum. The warning of unconfirmed optima counts the
# starts that end within the second part.
SAME_OPTIMUM = 1e-3
AGREEMENT = 0.01


@dataclass(frozen=True)
class Ending:
    """How a search ended.

    Parameters
    ----------
    checked : bool
        Whether several starts came to each optimum, a descent from it is finished, and no small step improves it.
    ends : list of ndarray
        For each row of weights the smallest objective of every start, in the goal's own unit where a single goal has a
        weight; nan where a start found no feasible point.
    rounding : list of float
        For each row of weights the difference up to which two of these values count as equal.
    best : list of float
        For each row of weights the smallest objective of the whole search; nan where no point is feasible.
    """

    checked: bool
    ends: list[Floats]
    rounding: list[float]
    best: list[float]


def allowance(dimensions: int, rows: int, *, alone: bool = False) -> int:
    """Most evaluations of a search where the study gives none; fewer where designs are evaluated one by one."""
    return (ALONE_DEFAULT_EVALUATIONS if alone else DEFAULT_EVALUATIONS) * (dimensions + 1) * rows


def search(
    explorer: Explorer, signs: Floats, rows: Sequence[Sequence[float]], seed: int, *, use_all: bool = True,
    near: Floats | None = None,
) -> Ending:  # fmt: skip
    """Evaluate designs until the extremes of the goals and the best weighted sums are known, or evaluations used up.

    Parameters
    ----------
    signs : ndarray, shape (goals,)
        1 where a goal is minimised, -1 where it is maximised.
    rows : sequence of sequence of float
        Rows of weights.
    use_all : bool
        Whether all evaluations are used; else the search ends when several starts have found the same optimum for each
        row.
    near : ndarray, shape (points, dimensions)
        Points of the unit cube that every start visits.
    """
    rng = np.random.default_rng(seed)
    budget, slope = explorer.left, 2 * explorer.dimensions + 1
    visits: list[Ints] = []
    explorer.reserve = min(budget // 4, CHECK_EVALUATIONS * slope * len(rows))
    _starts(explorer, signs, rows, rng, visits, use_all, near)
    explorer.reserve = 0
    try:
        checked = _confirmed(explorer, [_weighted(explorer.points, signs, row) for row in rows], rng)
    except Spent:
        checked = False
    size = len(explorer.points.u)
    if use_all:
        _starts(explorer, signs, rows, rng, visits, use_all, near)
    points = explorer.points
    objectives = [_weighted(points, signs, row) for row in rows]
    checked &= all(_reached(points, objective, visits) for objective in objectives)
    # Evaluations after these steps have not improved the optima.
    checked &= all(_best(points, objective) < size for objective in objectives)
    merits = [points.merit(objective) for objective in objectives if points.feasible.any()]
    rounding = [_rounding(points, merit, merit.min()) for merit in merits] or [0.0] * len(rows)
    best = [float(_ends(points, objective, [np.arange(len(points.u))])[0]) for objective in objectives]
    return Ending(checked, [_ends(points, objective, visits) for objective in objectives], rounding, best)


def _starts(
    explorer: Explorer, signs: Floats, rows: Sequence[Sequence[float]], rng: np.random.Generator,
    visits: list[Ints], use_all: bool, near: Floats | None,
) -> None:  # fmt: skip
    """Start until each row's optimum is confirmed, or with `use_all` until evaluations, or designs, are used up.

    The rows of `explorer.points` that each start visits are added to `visits`.
    """
    open_ = list(rows)
    while open_ and explorer.left > explorer.reserve:
        (own,) = rng.spawn(1)
        explorer.forget()
        left = explorer.left
        try:
            _start(explorer, signs, open_, own, near, first=not visits)
            visits.append(explorer.visited)
        except Spent:
            # The evaluations left are too few for a start: they are random points of the last one.
            explorer(own.random((explorer.left - explorer.reserve, explorer.dimensions)))
            visits[-1:] = [np.concatenate([*visits[-1:], explorer.visited])]
            return
        if explorer.left == left:
            return
        if not use_all:
            points = explorer.points
            open_ = [row for row in open_ if not _reached(points, _weighted(points, signs, row), visits)]


def _start(
    explorer: Explorer, signs: Floats, rows: Sequence[Sequence[float]], rng: np.random.Generator,
    near: Floats | None, *, first: bool,
) -> None:  # fmt: skip
    """One start; the first one also searches the extremes of several goals."""
    n, allowed = explorer.dimensions, explorer.left - explorer.reserve
    if allowed < SMALLEST_POPULATION:
        raise Spent
    sampled = sample(n, rng, SAMPLE_POINTS * (n + 1), allowed // SAMPLE_SHARE)
    begin = explorer(sampled if near is None else np.concatenate([sampled, near]))
    if first and len(signs) > 1 and allowed > 4 * len(signs) * DESCENT_EVALUATIONS * (2 * n + 1):
        _extremes(explorer, signs, rng, allowed)
    for row in rows:
        most = min(EVOLUTION * (n + 1), int(EVOLUTION_PART * allowed) // len(rows))
        evolve(explorer, _weighted(explorer.points, signs, row), rng, most)
    room = (explorer.left - explorer.reserve) // (DESCENT_EVALUATIONS * (2 * n + 1) * len(rows))
    most = int(np.clip(room // 2, 1, ROUGH_MAX_DESCENTS if explorer.rough else MAX_DESCENTS))
    points, descents = explorer.points, []
    for row in rows:
        objective = _weighted(points, signs, row)
        apart = _apart(points, objective, explorer.visited, most, START_DISTANCE)
        apart += _apart(points, objective, np.setdiff1d(begin, apart), most, SAMPLE_DISTANCE)
        descents += [(objective, k) for k in apart]
    descend(explorer, descents)


def _extremes(explorer: Explorer, signs: Floats, rng: np.random.Generator, allowed: int) -> None:
    """Search the smallest and the largest value of every goal, which normalise it and need few digits."""
    goals = len(signs)
    ends = [sign * line for line in np.eye(goals) for sign in (1.0, -1.0)]
    for end in np.diag(signs):
        evolve(explorer, end, rng, int(EVOLUTION_PART * allowed) // (4 * goals))
    descend(explorer, [(end, k) for end in ends for k in [_best(explorer.points, end)]])


def _apart(points: Points, objective: Floats, rows: Ints, most: int, distance: float) -> list[int]:
    """The best of some rows, each at least `distance` from the others."""
    merit, u = points.merit(objective)[rows], points.u[rows]
    chosen: list[int] = []
    free = np.isfinite(merit)
    while free.any() and len(chosen) < most:
        k = int(np.argmin(np.where(free, merit, np.inf)))
        chosen.append(int(rows[k]))
        free &= np.abs(u - u[k]).max(axis=1) > distance
    return chosen


def _confirmed(explorer: Explorer, objectives: Sequence[Floats], rng: np.random.Generator) -> bool:
    """Whether no small step improves the best point of any objective, with descents from points that one improves."""
    n, open_ = explorer.dimensions, list(objectives)
    for _ in range(MAX_CHECKS):
        points = explorer.points
        starts = [_best(points, objective) for objective in open_]
        if not points.feasible[starts].all():
            return False
        before = [points.merit(objective)[start] for objective, start in zip(open_, starts, strict=True)]
        descend(explorer, list(zip(open_, starts, strict=True)), width=CHECK_WIDTH)
        bests = [_best(explorer.points, objective) for objective in open_]
        steps = [np.concatenate([np.eye(n), -np.eye(n), rng.uniform(-1, 1, (4 * n, n))]) for _ in open_]
        trials = [explorer.points.u[best] + CHECK_STEP * around for best, around in zip(bests, steps, strict=True)]
        explorer(np.concatenate(trials))
        moving = []
        for objective, best, begun in zip(open_, bests, before, strict=True):
            merit = explorer.points.merit(objective)
            little = _rounding(explorer.points, merit, merit[best], NOISE if explorer.rough else ROUNDING)
            still = begun - merit[best] > max(ENDED_GAIN * abs(merit[best]), little)
            if still or merit[best] - merit.min() > little:
                moving.append(objective)
        if not moving:
            return True
        open_ = moving
    return False


def _best(points: Points, objective: Floats) -> int:
    return int(np.argmin(points.merit(objective)))


def _rounding(points: Points, merit: Floats, value: float, part: float = ROUNDING) -> float:
    """How far values of an objective may differ and still count as the same."""
    inside = merit[points.feasible]
    return part * abs(value) + RANGE_ROUNDING * float(np.ptp(inside) if inside.size else 0.0)


def _ends(points: Points, objective: Floats, visits: Sequence[Ints]) -> Floats:
    """The smallest objective that each start found; nan where that is not feasible."""
    merit = np.where(points.feasible, points.merit(objective), np.inf)
    ends = np.array([merit[rows].min(initial=np.inf) for rows in visits])
    return np.where(np.isfinite(ends), ends, np.nan)


def _reached(points: Points, objective: Floats, visits: Sequence[Ints]) -> bool:
    """Whether `CONFIRMATIONS` starts, and half of all, came to the best value of an objective.

    Where no point is feasible, twice as many starts have to come to the least violation of the conditions.
    """
    if points.feasible.any():
        ends, needed = _ends(points, objective, visits), CONFIRMATIONS
        least = float(points.merit(objective).min())
        same = max(SAME_OPTIMUM * abs(least), _rounding(points, points.merit(objective), least))
    else:
        merit, needed = points.merit(objective), 2 * CONFIRMATIONS
        ends = np.array([merit[rows].min(initial=np.inf) for rows in visits]) / CONDITION_MISSED - 1
        least = float(ends.min())
        same = SAME_OPTIMUM * least
    return bool(np.isfinite(least)) and int((ends <= least + same).sum()) >= max(needed, len(ends) / 2)


def sample(dimensions: int, rng: np.random.Generator, count: int, most: int) -> Floats:
    """A Latin hypercube, and the vertices of the unit cube where they are few."""
    count = min(count, most)
    strata = np.stack([rng.permutation(count) for _ in range(dimensions)], axis=1)
    u = (strata + rng.random((count, dimensions))) / max(count, 1)
    if dimensions > MAX_VERTICES or count + 2**dimensions > most:
        return np.asarray(u)
    vertices = np.stack(np.meshgrid(*[[0.0, 1.0]] * dimensions, indexing="ij"), axis=-1).reshape(-1, dimensions)
    return np.concatenate([vertices, u])


def _weighted(points: Points, signs: Floats, row: Sequence[float]) -> Floats:
    """Factors of the goals in their weighted sum [S1, eq. 28], less being better; of a single goal its sign."""
    if np.count_nonzero(row) == 1:
        return np.asarray(signs * np.sign(row))
    values = points.values[points.feasible if points.feasible.any() else points.valid]
    span = np.ptp(values, axis=0) if len(values) else np.ones(len(row))
    return np.asarray(np.asarray(row) * signs / np.where(span > 0, span, np.inf))


def evolve(explorer: Explorer, objective: Floats, rng: np.random.Generator, most: int) -> None:
    """Differential evolution from the best visited points and some others, each generation one batch.

    It evaluates at most `most` points. [Storn & Price, Differential evolution, 1997;
    scipy.optimize.differential_evolution.]
    """
    # SciPy's stubs do not know `vectorized`.
    begin_evolution: Any = scipy.optimize.differential_evolution

    size = max(SMALLEST_POPULATION, POPULATION * explorer.dimensions)
    if most < size:
        return
    rows = explorer.visited
    order = rows[np.argsort(explorer.points.merit(objective)[rows], kind="stable")]
    best, others = order[: size // 2], order[size // 2 :]
    chosen = np.concatenate([best, rng.permutation(others)[: size - len(best)]])
    population = explorer.points.u[chosen]
    if len(population) < size:
        population = np.concatenate([population, rng.random((size - len(population), explorer.dimensions))])
    lowest: list[float] = []
    most_stalled = ROUGH_STALLED_GENERATIONS if explorer.rough else STALLED_GENERATIONS

    def energies(u: Floats) -> Floats:
        rows = explorer(u.T)
        merit = explorer.points.merit(objective)[rows]
        lowest.append(min([float(merit.min()), *lowest[-1:]]))
        return np.asarray(np.where(np.isfinite(merit), merit, UNKNOWN))

    def stalls(x: Floats, convergence: float) -> bool:
        if len(lowest) <= most_stalled:
            return False
        points = explorer.points
        inside = points.merit(objective)[points.feasible]
        gained = lowest[-1 - most_stalled] - lowest[-1]
        return bool(gained <= STALLED_GAIN * (float(np.ptp(inside)) if inside.size else abs(lowest[-1])))

    begin_evolution(
        energies, [(0.0, 1.0)] * explorer.dimensions, init=population, vectorized=True, updating="deferred",
        maxiter=most // size, polish=False, tol=1e-3, recombination=0.9, callback=stalls, seed=rng,
    )  # fmt: skip
