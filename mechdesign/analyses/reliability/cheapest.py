"""The cheapest tolerances that keep the failure probabilities of the first-order model below what is asked.

Minimise sum a_k / T_k^e_k over log T, where the normal errors of the linear model break their limits no more often than
asked at any pose. The cost is convex in log T, and so is the variance of every error; poses enter as constraints as
far as they are broken.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechdesign.analyses.reliability.first_order import FirstOrder
from mechdesign.analyses.reliability.sources import Sources
from mechdesign.analyses.reliability.task import Task
from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.study import Study
from mechdesign.study.schema.reliability import Cost

# Digits that allocated numbers are written with, rounded down: what is tighter keeps what was asked.
DIGITS = 6
# Least and largest allocated tolerance, in multiples of the given one.
TIGHTEST = 1e-3
WIDEST = 10.0
# Step of difference quotients, in log T.
_LOG_STEP = 1e-4
# How far a constraint may be broken, in the logarithm of `distance`.
_SLACK = 1e-9
# Poses that become constraints at once, and how often more of them may.
_POSES_ADDED = 6
_MAX_ROUNDS = 30
# Least failure probability that is told from 0.
_LEAST_FAILURE = 1e-300


@dataclass(frozen=True)
class Tolerance:
    """The tolerance of one source, in the study's units, without a cost where it is held.

    By `kind`, half the width of a ``tolerance``, a ``sigma``, that of ``measured`` values, or a ``clearance``, mean and
    radial.
    """

    name: str
    given: float
    kind: str
    unit: str
    cost: Cost | None

    def price(self, size: float) -> float:
        """What it costs: a/T^exponent; nan where it is held."""
        return float("nan") if self.cost is None else self.cost.a / size**self.cost.exponent

    def size(self, scale: float) -> float:
        """The tolerance so many times as wide, without the dust of the product."""
        return float(f"{self.given * scale:.12g}")

    def rounded(self, scale: float) -> float:
        """The nearest scale, not above, whose tolerance has few digits."""
        size = self.given * scale
        unit = 10.0 ** (math.floor(math.log10(size)) + 1 - DIGITS)
        return float(f"{math.floor(size / unit * (1.0 + 1e-7)) * unit:.{DIGITS}g}") / self.given


def tolerances(study: Study, sources: Sources) -> list[Tolerance]:
    """Of all sources, in their order: dimensions are allocated, and what has a cost; other clearances are held."""
    section = study.reliability
    assert section is not None
    assert section.allocate is not None
    given = section.allocate.cost
    found = []
    for scalar in sources.scalars:
        dimension = section.dimensions[scalar.name]
        half = dimension.sigma
        if dimension.tolerance is not None:
            low, high = dimension.ends
            half = 0.5 * (high - low)
        elif half is None:
            half = math.sqrt(scalar.law.moments[1]) / scalar.factor
        allocated = half > 0 and dimension.kind != "measured" and (scalar.kind != "load" or scalar.name in given)
        cost = given.get(scalar.name, Cost()) if allocated else None
        found.append(Tolerance(scalar.name, half, dimension.kind, scalar.unit or "", cost))
    for pin in sources.pins:
        cost = given.get(pin.name) if pin.radius > 0 else None
        found.append(Tolerance(pin.name, pin.radius, "clearance", study.units.label("length"), cost))
    return found


@dataclass(frozen=True, eq=False)
class ToleranceModel:
    """Costs and failure probabilities by the first-order model, of tolerances so many times as wide as given.

    `free` are the sources whose tolerance is allocated, and `widest` their largest factors.
    """

    task: Task
    tolerances: Sequence[Tolerance]
    free: Ints
    widest: Floats

    def scales(self, x: Floats) -> Floats:
        """Factor of each source's tolerance; 1 where it is held."""
        scales = np.ones(len(self.tolerances))
        scales[self.free] = np.exp(x)
        return scales

    @property
    def tightest(self) -> Floats:
        """Logarithms of the least factors."""
        return np.full(len(self.free), np.log(TIGHTEST))

    def linear(self, scales: Floats) -> FirstOrder:
        """The linear model of these tolerances."""
        return replace(self.task.linear, sources=self.task.sources.widened(scales))

    def failures(self, scales: Floats, which: Sequence[int]) -> Floats:
        """Probability of failure at some of the task's settings."""
        # SciPy takes a quarter of a second to import, and a study without limits does not need it.
        from mechdesign.analyses.reliability.probability import made_failure

        poses = [self.task.settings[k].pose for k in which]
        linear, question = self.linear(scales).take(poses), self.task.question.at(self.task.nominal[:, poses])
        closing = replace(self.task.closing.take(poses), sources=linear.sources)
        return made_failure(linear, closing, question.bands, question.discs)

    def cost(self, x: Floats) -> tuple[float, Floats]:
        """Cost of all that is allocated, and its derivatives by x."""
        each = [self.tolerances[k] for k in self.free.tolist()]
        prices = np.array([t.price(t.given * scale) for t, scale in zip(each, np.exp(x).tolist(), strict=True)])
        return float(prices.sum()), -np.array([t.cost.exponent for t in each if t.cost is not None]) * prices


def cheapest(model: ToleranceModel, allowed: Floats) -> Floats:
    """Factors of all tolerances; the tightest where not even these keep each pose's failures, of shape (poses,)."""
    from scipy.optimize import minimize

    count = len(model.free)
    lowest, highest = model.tightest, np.log(model.widest)
    every = range(len(model.task.settings))
    wanted = distance(allowed)

    def margins(x: Floats, which: Sequence[int]) -> Floats:
        return distance(model.failures(model.scales(x), which)) - wanted[list(which)]

    def slopes(x: Floats, which: Sequence[int]) -> Floats:
        steps = _LOG_STEP * np.eye(count)
        return np.stack([(margins(x + h, which) - margins(x - h, which)) / (2 * _LOG_STEP) for h in steps], axis=1)

    if margins(lowest, every).min() < 0:
        return model.scales(lowest)
    if margins(highest, every).min() >= 0:
        return model.scales(highest)
    alike = _shifted(margins, np.zeros(count), lowest, highest, every)
    unit = model.cost(alike)[0]
    active = [int(np.argmin(margins(alike, every)))]
    for _ in range(_MAX_ROUNDS):
        constraint = {"type": "ineq", "fun": margins, "jac": slopes, "args": (tuple(active),)}
        found: Any = minimize(
            lambda x: model.cost(x)[0] / unit, alike, jac=lambda x: model.cost(x)[1] / unit, method="SLSQP",
            bounds=list(zip(lowest.tolist(), highest.tolist(), strict=True)), constraints=constraint,
            options={"maxiter": 300, "ftol": 1e-12},
        )  # type: ignore[call-overload]  # fmt: skip
        x = np.clip(found.x, lowest, highest)
        left = margins(x, every)
        broken = [k for k in np.argsort(left).tolist() if left[k] < -_SLACK and k not in active]
        if not broken:
            break
        active += broken[:_POSES_ADDED]
    x = _shifted(margins, x, lowest, highest, every)
    return model.scales(x if model.cost(x)[0] <= model.cost(alike)[0] else alike)


def distance(failure: Floats) -> Floats:
    """Log of the distance, in standard deviations, of a limit so often broken: nearly linear in log T."""
    from scipy.special import ndtri

    return np.asarray(np.log(np.maximum(-ndtri(0.5 * np.maximum(failure, _LEAST_FAILURE)), 1e-6)))


def _shifted(
    margins: Callable[..., Floats], x: Floats, lowest: Floats, highest: Floats, every: Sequence[int]
) -> Floats:
    """All tolerances wider or tighter by one common factor, as far as the poses allow."""
    from scipy.optimize import brentq

    reach = float((highest - lowest).max())
    active: list[int] = []
    shifted = x
    while True:
        left = margins(shifted, every)
        worst = int(np.argmin(left))
        if active and (left[worst] >= -_SLACK or worst in active):
            return shifted
        active.append(worst)

        def least(shift: float) -> float:
            return float(margins(np.clip(x + shift, lowest, highest), tuple(active)).min())

        # On the safe side of the root.
        shift = brentq(least, -reach, reach, xtol=1e-10) - 2e-10
        shifted = np.clip(x + shift, lowest, highest)
