"""The cheapest choice of standard grades with which the first-order model reaches what is asked.

Branch and bound. A necessary condition of every pose and limit is linear in the squares of the tolerances: the variance
of an error is at most that with which its own limit is kept as often as asked. Its dual, the linear programme in which
grades may be mixed, bounds the cost from below for every part of a choice [Geoffrion, Lagrangean relaxation for integer
programming, 1974]; what is left is asked of the model in the order of its cost.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mechdesign.analyses.reliability.cheapest import ToleranceModel
from mechdesign.analyses.reliability.first_order import FirstOrder
from mechdesign.numerics.arrays import Flags, Floats, Ints

# Partial choices that are followed at once, fewer where there are many conditions, to so many numbers in all; choices
# that the model is asked of, and how many of them together.
_MOST_BRANCHES = 100_000
_LEAST_BRANCHES = 2_000
_MOST_NUMBERS = 10_000_000
_MOST_ASKED = 20_000
_TOGETHER = 64
# Costs that count as the same.
_SAME = 1e-9
# A variance so little beyond what is allowed is rounding.
_ROUNDING = 1e-9


class Graded(NamedTuple):
    """Factors of all tolerances, and a bound of their cost: no choice that reaches what is wanted costs less."""

    scales: Floats
    bound: float


class _Choices:
    """Choices of grades, rows of numbers of each free tolerance's steps; the finest is 0."""

    def __init__(self, model: ToleranceModel, wanted: Floats) -> None:
        self.model, self.wanted = model, wanted
        free = [model.tolerances[k] for k in model.free]
        self.costs = [np.array([tolerance.price(tolerance.given * scale) for scale in steps.tolist()])
                      for tolerance, steps in zip(free, model.steps, strict=True)]  # fmt: skip

    def scales(self, choices: Ints) -> Floats:
        """Factors of all tolerances, shape (sources, choices)."""
        found = np.ones((len(self.model.tolerances), len(choices)))
        for k, steps, column in zip(self.model.free.tolist(), self.model.steps, choices.T, strict=True):
            found[k] = steps[column]
        return found

    def cost(self, choices: Ints) -> Floats:
        """What they cost, shape (choices,)."""
        return np.asarray(sum(cost[column] for cost, column in zip(self.costs, choices.T, strict=True)))

    def reach(self, choices: Ints) -> Flags:
        """Which of them reach what is wanted, shape (choices,)."""
        every = range(len(self.model.task.settings))
        levels = self.model.aim.level(self.model.reached(self.scales(choices), every))
        short = levels.reshape(len(self.wanted), len(choices), -1) < self.wanted[:, None]
        return np.asarray(~short.any(axis=(0, 2)))


def graded(model: ToleranceModel, wanted: Floats) -> Graded:
    """The cheapest choice; the finest where not even that reaches the levels wanted, shape (limits, poses)."""
    choices = _Choices(model, wanted)
    finest = np.zeros((1, len(model.free)), dtype=np.intp)
    if not choices.reach(finest)[0]:
        return Graded(choices.scales(finest)[:, 0], float(choices.cost(finest)[0]))
    best = _coarsened(choices, finest)
    row, bound = _searched(choices, best)
    return Graded(choices.scales(row)[:, 0], bound)


def _coarsened(choices: _Choices, row: Ints) -> Ints:
    """A choice, shape (1, tolerances), made coarser step by step, where most is saved, as long as it does."""
    while True:
        steps = [(k, cost, step) for k, (cost, step) in enumerate(zip(choices.costs, row[0].tolist(), strict=True))
                 if step + 1 < len(cost)]  # fmt: skip
        order = [k for k, cost, step in sorted(steps, key=lambda each: each[1][each[2] + 1] - each[1][each[2]])]
        coarser = np.repeat(row, len(order), axis=0)
        coarser[np.arange(len(order)), order] += 1
        good = np.flatnonzero(choices.reach(coarser)) if order else np.zeros(0, dtype=np.intp)
        if not len(good):
            return row
        row = coarser[good[:1]]


def _searched(choices: _Choices, best: Ints) -> tuple[Ints, float]:
    """The cheapest choice, shape (1, tolerances), where one is known, and a bound of the cost."""
    variances, most = _conditions(choices)
    weights = _weights(choices, variances, most)
    # Of each step: cost, and with the price of the variances that it makes.
    priced = [cost + weights @ part for cost, part in zip(choices.costs, variances, strict=True)]
    order = sorted(range(len(priced)), key=lambda k: -float(np.ptp(priced[k])))
    bound, known = float("inf"), float(choices.cost(best)[0]) * (1.0 - _SAME)
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
        kept = (lower < known) & (sums + least[:, None] <= most[:, None]).all(axis=0)
        rows, lower, sums = rows[kept], lower[kept], sums[:, kept]
        if len(rows) > branches:
            nearest = np.argsort(lower, kind="stable")
            bound = min(bound, float(lower[nearest[branches]]))
            followed = np.sort(nearest[:branches])
            rows, lower, sums = rows[followed], lower[followed], sums[:, followed]
    rows = rows[np.argsort(choices.cost(rows), kind="stable")]
    rows = rows[choices.cost(rows) < known]
    for begin in range(0, len(rows), _TOGETHER):
        if begin >= _MOST_ASKED:
            bound = min(bound, float(choices.cost(rows[begin : begin + 1])[0]))
            break
        some = rows[begin : begin + _TOGETHER]
        good = np.flatnonzero(choices.reach(some))
        if len(good):
            best = some[good[:1]]
            break
    return best, min(bound, float(choices.cost(best)[0]))


def _conditions(choices: _Choices) -> tuple[list[Floats], Floats]:
    """Variances that each step of each tolerance makes, shape (conditions, steps), and the most that are allowed.

    None where a tolerance changes the mean, too, or deviations are correlated.
    """
    model = choices.model
    sources, scalars = model.task.sources, model.task.sources.scalars
    free = model.free.tolist()
    if sources.correlation is not None or any(scalars[k].law.moments[0] != scalars[k].law.mean for k in free):
        return [np.zeros((0, len(steps))) for steps in model.steps], np.zeros(0)
    poses = [setting.pose for setting in model.task.settings]
    linear, question = model.task.linear.take(poses), model.task.question.at(model.task.nominal[:, poses])
    bands = [(band.output, band.low, band.high) for band in question.bands]
    bands += [(axis, -disc.radius, disc.radius) for disc in question.discs for axis in (disc.x, disc.y)]
    mean, parts = linear.shift(), _variances(linear)
    found: list[list[Floats]] = [[] for _ in free]
    most = []
    for k, (output, low, high) in enumerate(bands):
        level = choices.wanted[min(k, len(choices.wanted) - 1)]
        widest = model.aim.widest(low - mean[output], high - mean[output], level)
        held = parts[output].sum(axis=0) - parts[output][free].sum(axis=0)
        most.append(widest**2 * (1.0 + _ROUNDING) - held)
        for own, each in zip(found, free, strict=True):
            own.append(parts[output][each])
    return [np.multiply.outer(np.concatenate(own), steps**2) for own, steps in zip(found, model.steps, strict=True)], (
        np.concatenate(most)
    )


def _variances(linear: FirstOrder) -> Floats:
    """The part of each source in the variance of each channel, shape (channels, sources, poses)."""
    return np.nan_to_num(linear.share() * (linear.deviation() ** 2)[:, None])


def _weights(choices: _Choices, variances: list[Floats], most: Floats) -> Floats:
    """What a variance is worth, shape (conditions,): the dual of the choice where grades may be mixed."""
    from scipy.optimize import linprog

    if not len(most):
        return np.zeros(0)
    size = np.maximum(np.abs(most), _ROUNDING * np.abs(most).max())
    owner = np.repeat(np.arange(len(variances)), [part.shape[1] for part in variances])
    single = (owner == np.arange(len(variances))[:, None]).astype(float)
    found = linprog(
        np.concatenate(choices.costs), np.concatenate(variances, axis=1) / size[:, None], most / size, single,
        np.ones(len(single)), method="highs",
    )  # fmt: skip
    return np.maximum(-found.ineqlin.marginals, 0.0) / size if found.status == 0 else np.zeros(len(most))
