"""A population that evolves towards a Pareto front: NSGA-II of two goals, NSGA-III of more."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.ground.numerics.fronts import crowding

# Distribution indices: the larger, the nearer are children to their parents [Deb et al., 2002].
CROSSOVER_INDEX, MUTATION_INDEX = 15, 20
# Fraction of the pairs, and of the variables of a pair, that are crossed.
CROSSED_PAIRS, CROSSED_VARIABLES = 0.9, 0.5


def simplex(goals: int, divisions: int) -> Floats:
    """Directions with positive parts in multiples of 1/divisions whose sum is 1, shape (directions, goals).

    There are ``comb(divisions + goals - 1, divisions)`` of them [Das & Dennis, 1998].
    """
    bars = np.array([*combinations(range(divisions + goals - 1), goals - 1)])
    edges = np.pad(bars, ((0, 0), (1, 1)), constant_values=((0, 0), (-1, divisions + goals - 1)))
    return np.asarray((np.diff(edges, axis=1) - 1) / divisions)


def survivors(values: Floats, violations: Floats, directions: Floats | None, random: np.random.Generator) -> Ints:
    """Rows from the best to the worst: feasible ones by front, then by crowding; then the others by their violations.

    On a front the larger crowding distance is better [Deb et al., 2002]. With directions, each row belongs to the
    nearest direction, and it is the better the fewer better rows this direction has [Deb & Jain, 2014].

    Parameters
    ----------
    values : ndarray, shape (points, goals)
        Less is better; of no meaning where a point is not feasible.
    violations : ndarray, shape (points,)
        0 where a point is feasible, else positive; less is better.
    directions : ndarray, shape (directions, goals), or None
    """
    from moocore import pareto_rank

    feasible = np.flatnonzero(violations == 0)
    inside = values[feasible]
    ranks = np.asarray(pareto_rank(inside)) if len(feasible) else np.empty(0, dtype=int)
    crowd = np.empty(len(feasible))
    if directions is None:
        for rank in np.unique(ranks):
            crowd[ranks == rank] = -crowding(inside[ranks == rank])
    elif len(feasible):
        best = inside[ranks == 0]
        span = np.ptp(best, axis=0)
        share = (inside - best.min(axis=0)) / np.where(span > 0, span, 1.0)
        along = share @ (directions / np.linalg.norm(directions, axis=1)[:, None]).T
        distances = (share**2).sum(axis=1)[:, None] - along**2
        niches = distances.argmin(axis=1)
        order = np.lexsort((distances.min(axis=1), ranks, niches))
        first = np.searchsorted(niches[order], niches[order])
        crowd[order] = np.arange(len(order)) - first + random.random(len(order))
    others = np.flatnonzero(violations != 0)
    return np.concatenate([feasible[np.lexsort((crowd, ranks))], others[np.argsort(violations[others], kind="stable")]])


def offspring(parents: Floats, random: np.random.Generator) -> Floats:
    """As many children in the unit cube as parents, shape (points, dimensions), which are sorted, best first.

    The better of two random rows is a parent. Pairs of parents are crossed [simulated binary crossover: Deb &
    Agrawal, 1995], and of each child one variable on average changes [polynomial mutation: Deb & Goyal, 1996].
    """
    number, dimensions = len(parents), parents.shape[1]
    drawn = random.permuted(np.tile(np.arange(number), (2, 1)), axis=1)[:, : number // 2 * 2]
    one, other = parents[drawn.reshape(2, 2, -1).min(axis=0)]
    share = random.random(one.shape)
    spread = np.where(share < 0.5, 2 * share, 0.5 / (1 - share)) ** (1 / (CROSSOVER_INDEX + 1))
    crossed = random.random((len(one), 1)) < CROSSED_PAIRS
    crossed = crossed & (random.random(one.shape) < CROSSED_VARIABLES)
    spread = np.where(crossed, spread * random.choice([-1.0, 1.0], one.shape), 1.0)
    half = spread * (one - other) / 2
    children = np.concatenate([(one + other) / 2 + half, (one + other) / 2 - half])
    share = random.random(children.shape)
    step = 1 - (2 * np.minimum(share, 1 - share)) ** (1 / (MUTATION_INDEX + 1))
    changed = random.random(children.shape) < min(0.5, 1 / dimensions)
    return np.asarray(np.clip(children + np.where(changed, np.where(share < 0.5, -step, step), 0.0), 0.0, 1.0))
