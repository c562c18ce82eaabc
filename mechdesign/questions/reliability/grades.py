"""The cheapest choice of standard grades with which the first-order model reaches the target.

Branch and bound. Every pose and limit gives a necessary condition that is linear in the squares of the tolerances: the
variance of an error is at most the one with which its own limit alone reaches the target. The dual of the linear
programme in which grades may be mixed bounds the cost of every partial choice from below [Geoffrion, Lagrangean
relaxation for integer programming, 1974]. The remaining choices are checked with the model in the order of their cost.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.questions.reliability.cheapest import ToleranceModel
from mechdesign.questions.reliability.first_order import FirstOrder
from mechdesign.questions.reliability.lengths import WithLengths

# Most partial choices that are followed at once.
_MOST_BRANCHES = 100_000
# Most partial choices times conditions, which lowers the number of choices down to this least one.
_MOST_NUMBERS = 10_000_000
_LEAST_BRANCHES = 2_000
# Most choices that are checked with the model, and how many in one batch.
_MOST_CHECKED = 20_000
_TOGETHER = 64
# Relative difference up to which costs are equal.
_SAME = 1e-9
# Relative excess of a variance over its allowed value up to which it is rounding.
_ROUNDING = 1e-9


class Graded(NamedTuple):
    """Factors of all tolerances, and a lower bound of the cost of any choice that reaches the target levels."""

    scales: Floats
    bound: float


class _Choices:
    """Choices of grades, shape (choices, free): for each free tolerance the index of its grade, 0 for the finest."""

    def __init__(self, model: ToleranceModel, targets: Floats) -> None:
        self.model, self.targets = model, targets
        free = [model.tolerances[k] for k in model.free]
        self.costs = [np.array([tolerance.price(tolerance.given * scale) for scale in steps.tolist()])
                      for tolerance, steps in zip(free, model.steps, strict=True)]  # fmt: skip

    def scales(self, choices: Ints) -> Floats:
        """Factors of all tolerances, shape (sources, choices)."""
        factors = np.ones((len(self.model.tolerances), len(choices)))
        for k, steps, column in zip(self.model.free.tolist(), self.model.steps, choices.T, strict=True):
            factors[k] = steps[column]
        return factors

    def cost(self, choices: Ints) -> Floats:
        """Cost of each choice, shape (choices,)."""
        return np.asarray(sum(cost[column] for cost, column in zip(self.costs, choices.T, strict=True)))

    def reach(self, choices: Ints) -> Flags:
        """Which choices reach the wanted levels by the model, shape (choices,)."""
        every = range(len(self.model.task.settings))
        levels = self.model.aim.level(self.model.reached(self.scales(choices), every))
        short = levels.reshape(len(self.targets), len(choices), -1) < self.targets[:, None]
        return np.asarray(~short.any(axis=(0, 2)))


def graded(model: ToleranceModel, targets: Floats) -> Graded:
    """The cheapest choice that reaches the levels `targets`, shape (limits, poses); the finest where none does."""
    choices = _Choices(model, targets)
    finest = np.zeros((1, len(model.free)), dtype=np.intp)
    if not choices.reach(finest)[0]:
        return Graded(choices.scales(finest)[:, 0], float(choices.cost(finest)[0]))
    best = _coarsened(choices, finest)
    row, bound = _searched(choices, best)
    return Graded(choices.scales(row)[:, 0], bound)


def _coarsened(choices: _Choices, row: Ints) -> Ints:
    """A choice, shape (1, free), made coarser grade by grade where that saves most and still reaches the levels."""
    while True:
        steps = [(k, cost, step) for k, (cost, step) in enumerate(zip(choices.costs, row[0].tolist(), strict=True))
                 if step + 1 < len(cost)]  # fmt: skip
        order = [k for k, cost, step in sorted(steps, key=lambda item: item[1][item[2] + 1] - item[1][item[2]])]
        coarser = np.repeat(row, len(order), axis=0)
        coarser[np.arange(len(order)), order] += 1
        reaching = np.flatnonzero(choices.reach(coarser)) if order else np.zeros(0, dtype=np.intp)
        if not len(reaching):
            return row
        row = coarser[reaching[:1]]


def _searched(choices: _Choices, best: Ints) -> tuple[Ints, float]:
    """The cheapest choice, shape (1, free), and a lower bound of the cost, by branch and bound from a first choice."""
    variances, most = _conditions(choices)
    weights = _weights(choices, variances, most)
    # Cost of each grade plus the price of the variances that it causes.
    priced = [cost + weights @ part for cost, part in zip(choices.costs, variances, strict=True)]
    order = sorted(range(len(priced)), key=lambda k: -float(np.ptp(priced[k])))
    bound, best_cost = float("inf"), float(choices.cost(best)[0]) * (1.0 - _SAME)
    rows, sums = np.zeros((1, len(priced)), dtype=np.intp), np.zeros((len(most), 1))
    lower = np.full(1, sum(part.min() for part in priced) - weights @ most)
    least = sum((part.min(axis=1) for part in variances), start=np.zeros(len(most)))
    branches = min(_MOST_BRANCHES, max(_LEAST_BRANCHES, _MOST_NUMBERS // max(len(most), 1)))
    for k in order:
        steps, part = len(priced[k]), variances[k]
        rows = np.repeat(rows, steps, axis=0)
        rows[:, k] = np.tile(np.arange(steps), len(rows) // steps)
        lower = np.repeat(lower, steps) + (priced[k] - priced[k].min())[rows[:, k]]
        sums = np.repeat(sums, steps, axis=1) + part[:, rows[:, k]]
        least = least - part.min(axis=1)
        kept = (lower < best_cost) & (sums + least[:, None] <= most[:, None]).all(axis=0)
        rows, lower, sums = rows[kept], lower[kept], sums[:, kept]
        if len(rows) > branches:
            nearest = np.argsort(lower, kind="stable")
            bound = min(bound, float(lower[nearest[branches]]))
            followed = np.sort(nearest[:branches])
            rows, lower, sums = rows[followed], lower[followed], sums[:, followed]
    rows = rows[np.argsort(choices.cost(rows), kind="stable")]
    rows = rows[choices.cost(rows) < best_cost]
    for begin in range(0, len(rows), _TOGETHER):
        if begin >= _MOST_CHECKED:
            bound = min(bound, float(choices.cost(rows[begin : begin + 1])[0]))
            break
        batch = rows[begin : begin + _TOGETHER]
        reaching = np.flatnonzero(choices.reach(batch))
        if len(reaching):
            best = batch[reaching[:1]]
            break
    return best, min(bound, float(choices.cost(best)[0]))


def _conditions(choices: _Choices) -> tuple[list[Floats], Floats]:
    """The variance that each grade of each free tolerance causes, shape (conditions, grades), and the allowed ones.

    There are no conditions where a tolerance also changes the mean, as of a length, or where deviations are correlated.
    """
    model = choices.model
    sources, scalars = model.task.sources, model.task.sources.scalars
    free = model.free.tolist()
    own = isinstance(model.task.linear, WithLengths) and model.task.linear.short.any()
    if own or sources.correlation is not None or any(scalars[k].law.moments[0] != scalars[k].law.mean for k in free):
        return [np.zeros((0, len(steps))) for steps in model.steps], np.zeros(0)
    poses = [setting.pose for setting in model.task.settings]
    linear, question = model.task.linear.take(poses), model.task.question.at(model.task.nominal[:, poses])
    bands = [(band.output, band.low, band.high) for band in question.bands]
    bands += [(axis, -disc.radius, disc.radius) for disc in question.discs for axis in (disc.x, disc.y)]
    mean, parts = linear.shift(), _variances(linear)
    variances: list[list[Floats]] = [[] for _ in free]
    most = []
    for k, (output, low, high) in enumerate(bands):
        level = choices.targets[min(k, len(choices.targets) - 1)]
        widest = model.aim.widest(low - mean[output], high - mean[output], level)
        held = parts[output].sum(axis=0) - parts[output][free].sum(axis=0)
        most.append(widest**2 * (1.0 + _ROUNDING) - held)
        for column, source in zip(variances, free, strict=True):
            column.append(parts[output][source])
    by_grade = [np.multiply.outer(np.concatenate(column), steps**2)
                for column, steps in zip(variances, model.steps, strict=True)]  # fmt: skip
    return by_grade, np.concatenate(most)


def _variances(linear: FirstOrder) -> Floats:
    """The part of each source in the variance of each channel, shape (channels, sources, poses)."""
    return np.nan_to_num(linear.share() * (linear.deviation() ** 2)[:, None])


def _weights(choices: _Choices, variances: list[Floats], most: Floats) -> Floats:
    """Price of each condition's variance, shape (conditions,): the dual of the linear programme of mixed grades."""
    from scipy.optimize import linprog

    if not len(most):
        return np.zeros(0)
    size = np.maximum(np.abs(most), _ROUNDING * np.abs(most).max())
    owner = np.repeat(np.arange(len(variances)), [part.shape[1] for part in variances])
    single = (owner == np.arange(len(variances))[:, None]).astype(float)
    solution = linprog(
        np.concatenate(choices.costs), np.concatenate(variances, axis=1) / size[:, None], most / size, single,
        np.ones(len(single)), method="highs",
    )  # fmt: skip
    return np.maximum(-solution.ineqlin.marginals, 0.0) / size if solution.status == 0 else np.zeros(len(most))
