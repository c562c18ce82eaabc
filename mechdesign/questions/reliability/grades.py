"""The cheapest choice of standard grades with which the first-order model reaches the target.

Every pose and limit gives a necessary condition that is linear in the squares of the tolerances: the variance of an
error is at most the one with which its own limit alone reaches the target. A mixed-integer programme finds the cheapest
choice that keeps them all; where the model itself is not content with it, what is nowhere finer is left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from heapq import heappop, heappush
from itertools import islice

import numpy as np

from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.questions.reliability.cheapest import ToleranceModel
from mechdesign.questions.reliability.lengths import WithLengths

# Most programmes that are solved, most choices that are checked without conditions, and how many in one batch.
_MOST_PROGRAMMES = 1_000
_MOST_CHECKED = 20_000
_TOGETHER = 64
# Relative excess of a variance over its allowed value up to which it is rounding.
_ROUNDING = 1e-9
# Sum of the costs of all grades in the programme, of which differences above 1e-6 count.
_COSTS = 1e6


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


def graded(model: ToleranceModel, targets: Floats) -> tuple[Floats, float]:
    """Factors of all tolerances in the cheapest choice that reaches the levels `targets`, shape (limits, poses).

    With them a lower bound of the cost of any such choice. They are those of the finest grades where none reaches them.
    """
    choices = _Choices(model, targets)
    best = np.zeros((1, len(model.free)), dtype=np.intp)
    bound = float(choices.cost(best)[0])
    if choices.reach(best)[0]:
        conditions = _conditions(choices)
        best, bound = _compared(choices, best) if conditions is None else _programmed(choices, best, *conditions)
    return choices.scales(best)[:, 0], bound


def _programmed(choices: _Choices, finest: Ints, variances: list[Floats], most: Floats) -> tuple[Ints, float]:
    """The cheapest choice, shape (1, free), and a lower bound of the cost, by a mixed-integer programme."""
    from scipy.optimize import Bounds, LinearConstraint, milp

    owner = np.repeat(np.arange(len(variances)), [part.shape[1] for part in variances])
    grade = np.concatenate([np.arange(part.shape[1]) for part in variances])
    single = (owner == np.arange(len(variances))[:, None]).astype(float)
    size = np.maximum(np.abs(most), _ROUNDING * np.abs(most).max())
    rows, ends, costs = np.concatenate(variances, axis=1) / size[:, None], most / size, np.concatenate(choices.costs)
    bound = 0.0
    for _ in range(_MOST_PROGRAMMES):
        solution = milp(
            costs * (_COSTS / costs.sum()), integrality=np.ones(len(costs), dtype=np.int64), bounds=Bounds(0, 1),
            constraints=[LinearConstraint(single, 1, 1), LinearConstraint(rows, -np.inf, ends)],
            options={"mip_rel_gap": 0.0},
        )  # fmt: skip
        if solution.x is None:
            break
        choice = grade[solution.x > 0.5][None]
        bound = float(choices.cost(choice)[0])
        if choices.reach(choice)[0]:
            return choice, bound
        # One tolerance at least is finer.
        rows, ends = np.vstack([rows, -1.0 * (grade < choice[0, owner])]), np.append(ends, -1.0)
    return finest, bound


def _compared(choices: _Choices, finest: Ints) -> tuple[Ints, float]:
    """The cheapest choice and a lower bound of the cost as `_programmed`, by asking the model in the order of cost."""
    ordered, batch = _in_order(choices.costs), finest
    for _ in range(0, _MOST_CHECKED, _TOGETHER):
        batch = np.array(list(islice(ordered, _TOGETHER)))
        reaching = np.flatnonzero(choices.reach(batch))
        if len(reaching):
            return batch[reaching[:1]], float(choices.cost(batch[reaching[:1]])[0])
    return finest, float(choices.cost(batch[-1:])[0])


def _in_order(costs: list[Floats]) -> Iterator[tuple[int, ...]]:
    """Choices from the cheapest on; each is made from a cheaper one by a finer grade of one tolerance."""
    coarsest = tuple(len(cost) - 1 for cost in costs)
    waiting, known = [(0.0, coarsest)], {coarsest}
    while waiting:
        _, choice = heappop(waiting)
        yield choice
        for k, step in enumerate(choice):
            finer = (*choice[:k], step - 1, *choice[k + 1 :])
            if step and finer not in known:
                known.add(finer)
                heappush(waiting, (sum(cost[j] for cost, j in zip(costs, finer, strict=True)), finer))


def _conditions(choices: _Choices) -> tuple[list[Floats], Floats] | None:
    """The variance that each grade of each free tolerance causes, shape (conditions, grades), and the allowed ones.

    None where a tolerance also changes the mean, as of a length, or where deviations are correlated.
    """
    model = choices.model
    sources, scalars = model.task.sources, model.task.sources.scalars
    free = model.free.tolist()
    own = isinstance(model.task.linear, WithLengths) and model.task.linear.short.any()
    if own or sources.correlation is not None or any(scalars[k].law.moments[0] != scalars[k].law.mean for k in free):
        return None
    poses = [setting.pose for setting in model.task.settings]
    linear, question = model.task.linear.take(poses), model.task.question.take(poses).at(model.task.nominal[:, poses])
    bands = [side for limit in question.limits for side in limit.box]
    mean, parts = linear.shift(), np.nan_to_num(linear.share() * (linear.deviation() ** 2)[:, None])
    variances: list[list[Floats]] = [[] for _ in free]
    most = []
    for k, (output, low, high) in enumerate(bands):
        level = choices.targets[min(k, len(choices.targets) - 1)]
        widest = model.aim.widest(low - mean[output], high - mean[output], level)
        held = parts[output].sum(axis=0) - parts[output][free].sum(axis=0)
        most.append(widest**2 * (1.0 + _ROUNDING) - held)
        for column, source in zip(variances, free, strict=True):
            column.append(parts[output][source])
    # A pose without a target bounds nothing.
    bounds = np.concatenate(most)
    bounded = np.isfinite(bounds)
    by_grade = [np.multiply.outer(np.concatenate(column)[bounded], steps**2)
                for column, steps in zip(variances, model.steps, strict=True)]  # fmt: skip
    return by_grade, bounds[bounded]
