"""The Pareto front: designs that no other design surpasses in every goal at once, and its knee."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from contextlib import suppress
from itertools import count
from math import comb
from typing import NamedTuple

import numpy as np
import scipy

from mechdesign.ground.cautions import Caution
from mechdesign.ground.numerics import fronts
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.ground.numerics.evolution import offspring, simplex, survivors
from mechdesign.ground.results import Table
from mechdesign.questions.optimize.columns import HYPERVOLUME, PARETO
from mechdesign.questions.optimize.descent import descend
from mechdesign.questions.optimize.explorer import Explorer, Points, Spent
from mechdesign.questions.optimize.judge import DesignSet
from mechdesign.questions.optimize.search import sample, search

# Most evaluations for each goal where the study gives none: of designs in batches, and of designs one by one.
FRONT_EVALUATIONS, ALONE_FRONT_EVALUATIONS = 30_000, 400
# Most evaluations, as one in so many of all, for the best of each goal, for the ends of the front, and for the weighted
# sums of a round.
BEST_PART, END_PART, SUMS_PART = 6, 20, 10
# Size of a population for two goals, the least number of its generations, and the size of the smallest population. More
# than two goals are spread by directions that divide each goal into this many parts, by the number of goals; else the
# last.
POPULATION, GENERATIONS, SMALLEST_POPULATION = 50, 25, 8
DIVISIONS = {3: 12, 4: 6, 5: 4}
MOST_DIVISIONS = 3
# Weight of the other goals at the end of one goal, which chooses among designs that are equal in that goal.
BESIDE = 1e-6
# Number of weighted sums in a round.
WEIGHTED_SUMS = 12
# Designs nearer to each other than this part of the front's extent count as one, as descents end with many that hardly
# differ. With more than two goals the front is a surface of many thousand designs, and the distance is larger.
DESIGN_DISTANCE, SURFACE_DISTANCE = 1e-4, 2e-3
# A population is spread until the last quarter of its designs adds less than this part of the hypervolume, which is
# computed every so many generations. Rounds of spreading and filling end when a round adds less, too.
LEAST_GROWTH, LOOKS = 2e-4, 20
# A front still grows if the last tenth of the evaluated designs adds more than this part of its hypervolume.
STILL_GROWING = 1e-3
# Designs midway between neighbours on a front are evaluated: neighbours at the widest distance, in parts of the front's
# extent, then at half of that, down to the finest, by the number of goals or else the last. Neighbours are at most so
# many cells of this width apart.
WIDEST_GAP, FINEST_GAPS, FINEST_GAP = 0.25, {2: 1 / 256, 3: 1 / 32}, 1 / 8
BESIDE_CELL = 1.5
# Part of a front's extent up to which values of a goal count as equal.
ROUNDING = 1e-8
# Corner of the hypervolume, in parts of the way from each goal's best value on the front to its worst, and the number
# of rows of its table.
CORNER, VOLUME_ROWS = 1.1, 10


def allowance(goals: int, *, alone: bool) -> int:
    """Most evaluations of a front where the study says none; fewer where designs are evaluated one by one."""
    return (ALONE_FRONT_EVALUATIONS if alone else FRONT_EVALUATIONS) * goals


def search_front(explorer: Explorer, signs: Floats, seed: int, *, use_all: bool) -> None:
    """Search the front: its ends, each the best design of one goal, then designs between them.

    Parameters
    ----------
    signs : ndarray, shape (goals,)
        1 where a goal is minimised, -1 where it is maximised.
    use_all : bool
        Whether all evaluations are used; else it ends when the front's hypervolume no longer grows.
    """
    budget, goals = explorer.left, np.eye(len(signs))
    explorer.left = budget // BEST_PART
    search(explorer, signs, goals.tolist(), seed, use_all=False)
    explorer.left += budget - budget // BEST_PART
    # The ends of the front: the best of each goal; the others count as far as that leaves them free.
    _descend(explorer, signs, goals + BESIDE, budget // END_PART)
    for k in count():
        before = explorer.evaluated
        _spread(explorer, signs, seed + k)
        # Between the ends weighted sums of the goals find designs where the front is convex.
        weights = np.random.default_rng(seed + k).dirichlet(np.ones(len(signs)), WEIGHTED_SUMS)
        _descend(explorer, signs, weights, budget // SUMS_PART)
        _fill(explorer, signs)
        if explorer.evaluated == before or not (use_all or _grows(explorer.points, signs, before)):
            break
    if use_all:
        # The evaluations that are left are too few for a population.
        explorer(np.random.default_rng(seed).random((explorer.left, explorer.dimensions)))


def _divisions(goals: int) -> int:
    """Divisions of each goal by which more than two goals are spread."""
    return DIVISIONS.get(goals, MOST_DIVISIONS)


def _front_rows(points: Points, signs: Floats) -> Ints:
    """Rows of the feasible designs that no other surpasses."""
    rows = np.flatnonzero(points.feasible)
    return np.asarray(rows[front(points.values[rows] * signs)])


def _spread(explorer: Explorer, signs: Floats, seed: int) -> None:
    """Spread a population along the front with half of the evaluations left, begun at the widest gaps of the front."""
    divisions = _divisions(len(signs))
    size = POPULATION if len(signs) == 2 else comb(divisions + len(signs) - 1, divisions)
    half = explorer.left // 2
    size = int(np.clip(half // GENERATIONS, max(SMALLEST_POPULATION, len(signs)), size))
    points = explorer.points
    begun = _front_rows(points, signs)
    if len(begun):
        begun = begun[np.argsort(-fronts.crowding(points.values[begun] * signs), kind="stable")[: size // 2]]
    others = sample(explorer.dimensions, np.random.default_rng(seed), size - len(begun), explorer.left)
    explorer.reserve = half
    evolve_front(explorer, signs, np.concatenate([points.u[begun], others]), seed)
    explorer.reserve = 0


def _descend(explorer: Explorer, signs: Floats, weights: Floats, most: int) -> None:
    """Descend from the front by weighted sums of the normalised goals; at most `most` designs are evaluated.

    `weights` are of shape (sums, goals).
    """
    points = explorer.points
    rows = _front_rows(points, signs)
    if not len(rows):
        return
    values = points.values[rows] * signs
    span = np.ptp(values, axis=0)
    begun = rows[np.argmin(weights @ normalised(values).T, axis=1)]
    factors = weights * signs / np.where(span > 0, span, np.inf)
    explorer.reserve = max(0, explorer.left - most)
    with suppress(Spent):
        descend(explorer, [*zip(factors, begun.tolist(), strict=True)])
    explorer.reserve = 0


def _fill(explorer: Explorer, signs: Floats) -> None:
    """Evaluate designs midway between neighbours on the front, at finer and finer distances.

    Designs of a front mostly lie on a smooth surface, so that midway between two of them is nearly another one.
    """
    distance = WIDEST_GAP
    while distance >= FINEST_GAPS.get(len(signs), FINEST_GAP):
        points = explorer.points
        rows = _front_rows(points, signs)
        if not len(rows):
            return
        share = normalised(points.values[rows] * signs)
        # One design in each cell of this width, and those in the cells beside it.
        cells = np.unique(np.floor(share / distance), axis=0, return_index=True)[1]
        pairs = cells[scipy.spatial.cKDTree(share[cells]).query_pairs(BESIDE_CELL * distance, output_type="ndarray")]
        pairs = pairs[np.linalg.norm(share[pairs[:, 0]] - share[pairs[:, 1]], axis=1) > distance / 2]
        middles = points.u[rows[pairs]].mean(axis=1)
        with suppress(Spent):
            explorer(middles)
        distance /= 2


def evolve_front(explorer: Explorer, signs: Floats, first: Floats, seed: int) -> None:
    """Spread a population along the front, from points of shape (points, dimensions), while its hypervolume grows.

    With two goals by NSGA-II [Deb et al., 2002], with more by NSGA-III [Deb & Jain, 2014]. It also ends when the
    evaluations are used up, or the population finds no new design.
    """
    goals, random = len(signs), np.random.default_rng(seed)
    # No more directions than members of the population.
    fitting = [n for n in range(1, _divisions(goals) + 1) if n == 1 or comb(n + goals - 1, n) <= len(first)]
    directions = None if goals == 2 else simplex(goals, fitting[-1])
    begun, before = explorer.evaluated, -1
    with suppress(Spent):
        rows = explorer(first)
        for generation in count(1):
            points = explorer.points.take(rows)
            order = survivors(points.values * signs, points.merit(np.zeros(goals)), directions, random)[: len(first)]
            rows = np.unique(np.concatenate([rows[order], explorer(offspring(points.u[order], random))]))
            if generation % LOOKS == 0:
                # Where all designs are evaluated already, further generations find nothing.
                if explorer.evaluated == before:
                    return
                before = explorer.evaluated
                if not _grows(explorer.points, signs, (begun + 3 * before) // 4):
                    return


def _grows(points: Points, signs: Floats, begun: int) -> bool:
    """Whether the designs evaluated since row `begun` added more than `LEAST_GROWTH` of the front's hypervolume."""
    rows = np.flatnonzero(points.feasible)
    before, last = volumes(points.values[rows] * signs, np.searchsorted(rows, [begun, len(points.u)]))[1]
    return bool(last - before > LEAST_GROWTH * last)


def volumes(values: Floats, counts: Ints) -> tuple[Ints, Floats]:
    """Sizes and hypervolumes of the fronts of the first `counts` rows of values, shape (designs, goals).

    Less is better. The unit of a hypervolume is the box between each goal's best and worst value on the front of all
    rows; its corner is a tenth beyond that box [Zitzler & Thiele, 1999]. It is 0 where there is no front.
    """
    sizes, hypervolumes = np.zeros(len(counts), dtype=np.intp), np.zeros(len(counts))
    if not len(values):
        return sizes, hypervolumes
    last = values[front(values)]
    low, span = last.min(axis=0), np.ptp(last, axis=0)
    shares = (values - low) / np.where(span > 0, span, 1.0)
    rows, done = np.empty(0, dtype=np.intp), 0
    for k in np.argsort(counts, kind="stable").tolist():
        # A design that another one surpasses never comes back to the front.
        rows = np.concatenate([rows, np.arange(done, counts[k])])
        rows, done = rows[front(shares[rows])], int(counts[k])
        sizes[k], hypervolumes[k] = len(rows), fronts.hypervolume(shares[rows], CORNER)
    return sizes, hypervolumes


def front(values: Floats) -> Ints:
    """Rows of values, shape (designs, goals), that no other surpasses, less being better; of equals the first."""
    rows = np.flatnonzero(fronts.front(values))
    # Of designs that differ only by rounding in one goal, those that are better in the other goals.
    settled = np.round(normalised(values[rows]) / ROUNDING) if len(rows) else values
    unique = np.unique(settled, axis=0, return_index=True)[1]
    return np.sort(rows[unique[fronts.front(settled[unique])]])


def normalised(values: Floats) -> Floats:
    """Values of a front as fractions of the way from each goal's best value on it to its worst."""
    low, span = values.min(axis=0), np.ptp(values, axis=0)
    return np.asarray((values - low) / np.where(span > 0, span, 1.0))


def distinct(values: Floats) -> Ints:
    """Rows of a front without designs that count as one; the ends of the front stay."""
    share = normalised(values)
    order = np.array([*dict.fromkeys((*ends(share), *range(len(share))))])
    kept = np.ones(len(share), dtype=bool)
    distance = DESIGN_DISTANCE if values.shape[1] == 2 else SURFACE_DISTANCE
    pairs = np.sort(scipy.spatial.cKDTree(share[order]).query_pairs(distance, p=np.inf, output_type="ndarray"), axis=1)
    for one, other in pairs[np.lexsort(pairs.T[::-1])].tolist():
        kept[other] &= not kept[one]
    return np.sort(order[kept])


def ends(share: Floats) -> list[int]:
    """The best row in each goal; of rows equally good in it the one that is best in the others."""
    return [int(np.lexsort((share.sum(axis=1), column))[0]) for column in share.T]


def plane(values: Floats) -> Floats:
    """Factors of the normalised goals in the plane through the ends of a front, positive, shape (goals,)."""
    share = normalised(values)
    ones = np.ones(share.shape[1])
    try:
        normal = np.asarray(np.linalg.solve(share[ends(share)], ones), dtype=float)
    except np.linalg.LinAlgError:
        normal = ones
    return normal if np.isfinite(normal).all() and (normal > 0).all() else ones


def knee(values: Floats) -> int:
    """The row farthest from the plane through the ends of a front (the line, for two goals), towards the ideal.

    Less is better. [Das, On characterizing the 'knee' of the Pareto curve, 1999.]
    """
    return int(np.argmin(normalised(values) @ plane(values)))


class Front(NamedTuple):
    """The designs on the front, the best of the first goal first.

    Parameters
    ----------
    rows : ndarray of int
        Their rows in the designs.
    values : ndarray, shape (rows, goals)
        Of their goals, less being better.
    """

    rows: Ints
    values: Floats


def front_of(designs: DesignSet) -> Front:
    """The front over all feasible designs that were evaluated."""
    feasible = np.flatnonzero(designs.feasible)
    values = designs.costs[feasible]
    rows = front(values)
    rows = rows[np.lexsort(values[rows].T[::-1])]
    rows = rows[distinct(values[rows])]
    return Front(feasible[rows], values[rows])


def optima(designs: DesignSet, pareto_front: Front, typed: Floats) -> DesignSet:
    """The designs with the optima of their front: its knee, its ends, and the best for the study's own weights.

    The weights of the knee are the factors of the goals in the plane from which it is the farthest.

    Parameters
    ----------
    typed : ndarray, shape (rows, goals)
        The study's own weights.
    """
    inside = designs.values[designs.feasible]
    ranges, spans = np.ptp(inside, axis=0), np.ptp(pareto_front.values, axis=0)
    weights = plane(pareto_front.values) * np.divide(ranges, spans, out=np.ones_like(spans), where=spans > 0)
    rows = np.concatenate([[weights / weights.max()], np.eye(len(weights)), typed])
    names = ("knee", *(f"best {goal.name}" for goal in designs.goals), *["weights"] * len(typed))
    chosen = pareto_front.rows[[knee(pareto_front.values), *ends(normalised(pareto_front.values))]]
    return dataclasses.replace(designs, weights=rows, marks=names, chosen=chosen)


def doubts(growth: Table, evaluations: int) -> Iterator[Caution]:
    """A warning of a front whose hypervolume still grows in the last tenth of its designs."""
    share = float(growth["growth"][-1])
    if share > STILL_GROWING:
        yield Caution(
            "unconverged",
            f"the front still grows: its hypervolume by {100 * share:.2g} % in the last tenth of its designs; "
            f"allow more, e.g. optimize.evaluations: {4 * evaluations}",
            "hypervolume", len(growth) - 1,
        )  # fmt: skip


def growth_table(designs: DesignSet) -> Table:
    """Hypervolume of the front by the number of designs, and its growth."""
    rows = np.flatnonzero(designs.feasible)
    counts = np.unique(np.linspace(0, len(designs), VOLUME_ROWS + 1)[1:].astype(int))
    earlier = counts - counts // 10
    values = designs.costs[rows]
    sizes, hypervolumes = volumes(values, np.searchsorted(rows, np.concatenate([counts, earlier])))
    volume, before = np.split(hypervolumes, 2)
    return HYPERVOLUME.table(HYPERVOLUME.columns(
        {}, designs=counts, front=sizes[: len(counts)],
        hypervolume=volume, growth=np.divide(volume - before, volume, out=np.zeros(len(counts)), where=volume > 0),
    ))  # fmt: skip


def pareto_table(designs: DesignSet, pareto_front: Front) -> Table:
    """The designs on the front."""
    rows, values = pareto_front
    marks = PARETO.columns({}, knee=rows == rows[knee(values)], crowding=fronts.crowding(values))
    return PARETO.table([*designs.columns(rows), *marks])
