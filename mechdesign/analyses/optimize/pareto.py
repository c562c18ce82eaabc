"""The Pareto front: designs none of which is surpassed in every goal at once, and its knee."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mechdesign.analyses.optimize.explorer import Explorer, Spent
from mechdesign.analyses.optimize.judge import Designs
from mechdesign.analyses.optimize.search import sample
from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.results import Column, Table

# Evaluations for each goal where the study says none.
FRONT_EVALUATIONS = 1200
# Generations that a population is given of those that are left.
GENERATIONS = 25
SMALLEST_FRONT_POPULATION = 8
LARGEST_FRONT_POPULATION = 200
# Designs nearer to each other than this part of the front's extent are one: descents end with many that hardly differ.
DESIGN_DISTANCE = 1e-4
# A front whose hypervolume grows by more than this part in the last tenth of the evaluations is not at its end; of so
# many goals the volume is computed at most.
STILL_GROWING, MAX_VOLUME_GOALS = 2e-3, 4


def spread(explorer: Explorer, signs: Floats, seed: int) -> None:
    """Use the evaluations that are left to spread a population along the front, from its widest gaps so far.

    `signs`, shape (goals,), are 1 where a goal is minimised, -1 where it is maximised.
    """
    size = int(np.clip(explorer.left // GENERATIONS, SMALLEST_FRONT_POPULATION, LARGEST_FRONT_POPULATION))
    known = explorer.known
    begun = np.flatnonzero(known.feasible)
    if len(begun):
        rows = begun[front(known.values[begun] * signs)]
        begun = rows[np.argsort(-crowding(known.values[rows] * signs), kind="stable")[: size // 2]]
    others = sample(explorer.dimensions, np.random.default_rng(seed), size - len(begun), explorer.left)
    evolve_front(explorer, signs, np.concatenate([known.u[begun], others]), seed)


def evolve_front(explorer: Explorer, signs: Floats, first: Floats, seed: int) -> None:
    """Spread a population along the front by NSGA-II [Deb et al., 2002], from points of shape (points, dimensions)."""
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
    """Rows of values, shape (designs, goals), that no other surpasses, less being better; of equals the first."""
    from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

    unique, first = np.unique(values, axis=0, return_index=True)
    rows = NonDominatedSorting().do(unique, only_non_dominated_front=True)
    return np.sort(first[rows])


def normalised(values: Floats) -> Floats:
    """Values of a front as fractions of the way from each goal's best value on it to its worst."""
    low, span = values.min(axis=0), np.ptp(values, axis=0)
    return np.asarray((values - low) / np.where(span > 0, span, 1.0))


def distinct(values: Floats) -> Ints:
    """Rows of a front, its ends among them, of which no two are closer than `DESIGN_DISTANCE` in every goal."""
    share = normalised(values)
    kept: list[int] = []
    for k in (*_ends(share), *range(len(share))):
        if (np.abs(share[kept] - share[k]).max(axis=1, initial=0.0) > DESIGN_DISTANCE).all():
            kept.append(k)
    return np.sort(np.array(kept, dtype=np.intp))


def _ends(share: Floats) -> list[int]:
    """The best row in each goal; of rows equally good in it the one that is best in the others."""
    return [int(np.lexsort((share.sum(axis=1), column))[0]) for column in share.T]


def knee(values: Floats) -> int:
    """The row farthest from the plane through the extremes of a front (the line, for two goals), towards the ideal.

    Less is better. [Das, On characterizing the 'knee' of the Pareto curve, 1999.]
    """
    share = normalised(values)
    ones = np.ones(share.shape[1])
    try:
        normal = np.linalg.solve(share[_ends(share)], ones)
    except np.linalg.LinAlgError:
        normal = ones
    if not np.isfinite(normal).all() or (normal <= 0).any():
        normal = ones
    return int(np.argmax((1 - share @ normal) / np.linalg.norm(normal)))


def crowding(values: Floats) -> Floats:
    """Crowding distance of each row of a front: the sum over goals of the normalised gap between its neighbours.

    Infinite at the ends [Deb et al., 2002].
    """
    from pymoo.operators.survival.rank_and_crowding.metrics import calc_crowding_distance

    return np.asarray(calc_crowding_distance(values) * values.shape[1])


def doubts(designs: Designs, evaluations: int) -> Iterator[str]:
    """A warning of a front whose hypervolume still grows in the last tenth of its evaluations.

    The volume is that between the front and its worst corner, each goal in parts of the front's extent.
    """
    from pymoo.indicators.hv import HV

    if len(designs.goals) > MAX_VOLUME_GOALS:
        return
    rows = np.flatnonzero(designs.feasible)
    values = designs.values[rows] * [1 if goal.smallest else -1 for goal in designs.goals]
    last = values[front(values)]
    low, span = last.min(axis=0), np.ptp(last, axis=0)
    shares = (values - low) / np.where(span > 0, span, 1.0)
    volume = HV(ref_point=np.ones(len(designs.goals)))
    before, whole = (volume(part) if len(part) else 0.0 for part in (shares[rows < 0.9 * len(designs)], shares))
    growth = 1 - before / whole if whole > 0 else 0.0
    if growth > STILL_GROWING:
        yield (f"the front still grows: its hypervolume by {100 * growth:.2g} % in the last tenth of the evaluations; "
               f"allow more, e.g. optimize.evaluations: {4 * evaluations}")  # fmt: skip


def pareto_table(designs: Designs) -> tuple[Table, int]:
    """The front over all feasible designs that were evaluated, the best of the first goal first, and its knee's row."""
    feasible = np.flatnonzero(designs.feasible)
    values = designs.values[feasible] * [1 if each.smallest else -1 for each in designs.goals]
    on_front = front(values)
    on_front = on_front[np.lexsort(values[on_front].T[::-1])]
    on_front = on_front[distinct(values[on_front])]
    rows, values = feasible[on_front], values[on_front]
    marked = np.arange(len(rows)) == knee(values)
    columns = (
        *designs.columns(rows),
        Column("knee", marked, "", "1 at the design farthest from the plane through the extremes of the front"),
        Column("crowding", crowding(values), "", "gap between the neighbours on the front; inf at its ends"),
    )
    table = Table("pareto", columns, "designs none of which is surpassed in every goal at once")
    return table, int(rows[marked][0])
