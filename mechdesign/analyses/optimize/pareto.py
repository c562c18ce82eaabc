"""The Pareto front: designs none of which is surpassed in every goal at once, and its knee."""

from __future__ import annotations

import numpy as np

from mechdesign.analyses.optimize.explorer import Explorer, Known, Spent
from mechdesign.numerics.arrays import Floats, Ints

# Evaluations where the study says none, a goal; and how many generations a population is given of them.
ALLOWANCE, GENERATIONS = 1200, 25
# Designs nearer to each other than this part of the front's extent are one: descents end with many that hardly differ.
CLOSE = 1e-4
SMALLEST_POPULATION, LARGEST_POPULATION = 8, 200


def allowance(goals: int) -> int:
    """Evaluations of a front where the study says none."""
    return ALLOWANCE * goals


def population(budget: int) -> int:
    """Size of the population for a number of evaluations."""
    return int(np.clip(budget // GENERATIONS, SMALLEST_POPULATION, LARGEST_POPULATION))


def evolve(explorer: Explorer, signs: Floats, first: Floats, seed: int) -> None:
    """Spread a population along the front by NSGA-II [Deb et al., 2002], as pymoo does it.

    Parameters
    ----------
    signs : ndarray, shape (goals,)
        1 where a goal is minimised, -1 where it is maximised.
    first : ndarray, shape (points, dimensions)
        Points of the unit cube to begin with.
    """
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.evaluator import Evaluator
    from pymoo.core.problem import Problem
    from pymoo.problems.static import StaticProblem

    def outcome(u: Floats) -> tuple[Floats, Floats]:
        rows = explorer(u)
        known = explorer.known
        valid = known.valid[rows]
        # What cannot be built misses one condition more than there are, by more than any other, and the more so by how
        # much it does not assemble.
        values = np.where(valid[:, None], known.values[rows] * signs, 0.0)
        missing = np.where(valid[:, None], np.maximum(-known.margins[rows], 0.0), 1.0)
        worst = missing.max(axis=0, initial=0.0)
        open_ = 1e3 * (1.0 + np.nan_to_num(known.shortfall[rows], nan=1e9))
        return values, np.column_stack([missing / np.where(worst > 0, worst, 1.0), np.where(valid, 0.0, open_)])

    try:
        conditions = outcome(first)[1].shape[1]
        problem = Problem(n_var=explorer.dimensions, n_obj=len(signs), n_ieq_constr=conditions, xl=0.0, xu=1.0)
        algorithm = NSGA2(pop_size=len(first), sampling=first)
        algorithm.setup(problem, termination=("n_gen", 100 * GENERATIONS), seed=seed, verbose=False)
        while algorithm.has_next():
            asked = algorithm.ask()
            if asked is None or not len(asked):
                break
            values, missing = outcome(np.asarray(asked.get("X"), dtype=float))
            Evaluator().eval(StaticProblem(problem, F=values, G=missing), asked)
            algorithm.tell(infills=asked)
    except Spent:
        return


def front(values: Floats) -> Ints:
    """Rows that no other row surpasses; of equal rows the first.

    Parameters
    ----------
    values : ndarray, shape (designs, goals)
        Less is better.
    """
    from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

    unique, first = np.unique(values, axis=0, return_index=True)
    rows = NonDominatedSorting().do(unique, only_non_dominated_front=True)
    return np.sort(first[rows])


def promising(known: Known, signs: Floats, count: int) -> Ints:
    """Rows to spread a population from: of the front so far those with the widest gaps about them.

    Parameters
    ----------
    signs : ndarray, shape (goals,)
        As `evolve` takes them.
    """
    feasible = np.flatnonzero(known.feasible)
    if not len(feasible):
        return feasible
    values = known.values[feasible] * signs
    rows = front(values)
    widest = np.argsort(-crowding(values[rows]), kind="stable")[:count]
    return np.asarray(feasible[rows[widest]])


def normalised(values: Floats) -> Floats:
    """Values of a front as fractions of the way from each goal's best value on it to its worst."""
    low, span = values.min(axis=0), np.ptp(values, axis=0)
    return np.asarray((values - low) / np.where(span > 0, span, 1.0))


def distinct(values: Floats) -> Ints:
    """Rows of a front, its ends among them, of which no two are closer than `CLOSE` in every goal."""
    share = normalised(values)
    ends = [int(np.lexsort((share.sum(axis=1), column))[0]) for column in share.T]
    kept: list[int] = []
    for k in (*ends, *range(len(share))):
        if not kept or (np.abs(share[kept] - share[k]).max(axis=1) > CLOSE).all():
            kept.append(k)
    return np.sort(np.array(kept, dtype=np.intp))


def knee(values: Floats) -> int:
    """The row farthest from the plane through the extremes of a front (the line, for two goals), towards the ideal.

    [Das, On characterizing the 'knee' of the Pareto curve, 1999.]

    Parameters
    ----------
    values : ndarray, shape (designs, goals)
        Of a front; less is better.
    """
    share = normalised(values)
    # Of designs equally good in a goal the extreme is the one that is best in the others.
    extremes = share[[int(np.lexsort((share.sum(axis=1), column))[0]) for column in share.T]]
    ones = np.ones(share.shape[1])
    try:
        normal = np.linalg.solve(extremes, ones)
    except np.linalg.LinAlgError:
        normal = ones
    if not np.isfinite(normal).all() or (normal <= 0).any():
        normal = ones
    return int(np.argmax((1 - share @ normal) / np.linalg.norm(normal)))


def crowding(values: Floats) -> Floats:
    """Crowding distance of each row of a front: the sum over goals of the normalised gap between its neighbours.

    Infinite at the ends [Deb et al., 2002].
    """
    share = normalised(values)
    distance = np.zeros(len(share))
    for column in share.T:
        order = np.argsort(column, kind="stable")
        distance[order[[0, -1]]] = np.inf
        distance[order[1:-1]] += column[order[2:]] - column[order[:-2]]
    return distance
