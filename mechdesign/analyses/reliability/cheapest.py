"""The cheapest tolerances with which the first-order model reaches what is asked.

Minimise sum a_k / T_k^e_k over log T, where the normal errors of the linear model reach the aim at every pose. The cost
is convex in log T, and so is the variance of every error; poses enter as constraints as far as they are missed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from mechdesign.analyses.reliability.aims import Aim
from mechdesign.analyses.reliability.first_order import FirstOrder
from mechdesign.analyses.reliability.sources import Sources
from mechdesign.analyses.reliability.task import Task
from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.study import Study
from mechdesign.study.schema.allocation import Cost, half_widths
from mechdesign.study.schema.iso_tolerances import ToleranceClassError

# Digits that allocated numbers are written with, rounded down: what is tighter keeps what was asked.
DIGITS = 6
# Least and largest allocated tolerance, in multiples of the given one.
TIGHTEST = 1e-3
WIDEST = 10.0
# Step of difference quotients, in log T.
_LOG_STEP = 1e-4
# How far a level may be missed.
_SLACK = 1e-9
# Poses that become constraints at once, and how often more of them may.
_POSES_ADDED = 6
_MAX_ROUNDS = 30


@dataclass(frozen=True)
class Tolerance:
    """The tolerance of one source, in the study's units, without a cost where it is held.

    By `kind`, half the width of a ``tolerance``, a ``sigma``, that of ``measured`` values, or a ``clearance``, mean and
    radial. `middle` is that of a tolerance, and `grades` are the widths it may have, by name, from the finest on; none
    where it may have any.
    """

    name: str
    given: float
    middle: float
    kind: str
    unit: str
    cost: Cost | None
    grades: Mapping[str, float] = field(default_factory=dict)

    def price(self, size: float) -> float:
        """What it costs: a/T^exponent; nan where it is held."""
        return float("nan") if self.cost is None else self.cost.a / size**self.cost.exponent

    def size(self, scale: float) -> float:
        """The tolerance so many times as wide, without the dust of the product."""
        return float(f"{self.given * scale:.12g}")

    def grade(self, scale: float) -> str:
        """The grade that is so many times as wide as given; empty where it is none."""
        return next((name for name, half in self.grades.items() if abs(self.given * scale / half - 1.0) < 1e-9), "")

    def rounded(self, scale: float) -> float:
        """The nearest scale, not above, whose tolerance has few digits."""
        size = self.given * scale
        unit = 10.0 ** (math.floor(math.log10(size)) + 1 - DIGITS)
        return float(f"{math.floor(size / unit * (1.0 + 1e-7)) * unit:.{DIGITS}g}") / self.given


def tolerances(study: Study, sources: Sources) -> list[Tolerance]:
    """Of all sources, in their order: dimensions are allocated, and what has a cost; other clearances are held.

    In grades those alone that have some.
    """
    section = study.reliability
    assert section is not None
    assert section.allocate is not None
    given, asked = section.allocate.cost, section.allocate.grades
    millimetre = study.units.convert("1 mm") if asked else 1.0
    found = []
    for scalar in sources.scalars:
        dimension = section.dimensions[scalar.name]
        low, high = map(float, dimension.ends(study.sizes.get(scalar.name, 0.0)))
        half = 0.5 * (high - low) if dimension.sigma is None else dimension.sigma
        if dimension.measured is not None:
            half = math.sqrt(scalar.law.moments[1]) / scalar.factor
        grades: dict[str, float] = {}
        if asked:
            with suppress(ToleranceClassError):
                places = study.mechanism.description.places
                grades = half_widths(scalar.name, dimension, asked, study.parameters, places, millimetre)
        possible = bool(grades) or not asked
        allocated = half > 0 and dimension.kind != "measured" and (scalar.kind != "load" or scalar.name in given)
        cost = given.get(scalar.name, Cost()) if allocated and possible else None
        found.append(Tolerance(scalar.name, half, 0.5 * (low + high), dimension.kind, scalar.unit or "", cost, grades))
    for pin in sources.pins:
        cost = given.get(pin.name) if pin.radius > 0 else None
        radius = float(pin.radius)
        found.append(Tolerance(pin.name, radius, 0.0, "clearance", study.units.label("length"), cost))
    return found


@dataclass(frozen=True, eq=False)
class ToleranceModel:
    """Costs and what is reached by the first-order model, of tolerances so many times as wide as given.

    `free` are the sources whose tolerance is allocated, and `widest` their largest factors.
    """

    task: Task
    aim: Aim
    tolerances: Sequence[Tolerance]
    free: Ints
    widest: Floats

    def scales(self, x: Floats) -> Floats:
        """Factor of each source's tolerance; 1 where it is held."""
        scales = np.ones(len(self.tolerances))
        scales[self.free] = np.exp(x)
        return scales

    @cached_property
    def steps(self) -> list[Floats]:
        """Factors of the grades that each may have, up to the widest; none where all may have any."""
        each = [(self.tolerances[k], widest) for k, widest in zip(self.free, self.widest, strict=True)]
        scales = [(np.array([*t.grades.values()]) / t.given, widest) for t, widest in each]
        return [part[(part <= widest) | (part == part[0])] for part, widest in scales if len(part)]

    @property
    def tightest(self) -> Floats:
        """Least factors."""
        return np.array([part[0] for part in self.steps]) if self.steps else np.full(len(self.free), TIGHTEST)

    def linear(self, scales: Floats) -> FirstOrder:
        """The linear model of these tolerances."""
        return replace(self.task.linear, sources=self.task.sources.widened(scales))

    def reached(self, scales: Floats, which: Sequence[int]) -> Floats:
        """What is reached, by limit, at some of the task's settings, shape (limits, settings).

        Of many choices of tolerances, shape (sources, choices), at all settings of one and then of the next.
        """
        poses = np.array([self.task.settings[k].pose for k in which])
        many = scales.shape[1] if scales.ndim > 1 else 1
        factors = np.repeat(scales, len(poses), axis=1) if scales.ndim > 1 else scales
        poses = np.tile(poses, many)
        sources = self.task.sources.widened(factors)
        linear, closing = (replace(part.take(poses), sources=sources) for part in (self.task.linear, self.task.closing))
        return self.aim.by_model(self.task.question.at(self.task.nominal[:, poses]), linear, closing)

    def cost(self, x: Floats) -> tuple[float, Floats]:
        """Cost of all that is allocated, and its derivatives by x."""
        each = [self.tolerances[k] for k in self.free.tolist()]
        prices = np.array([t.price(t.given * scale) for t, scale in zip(each, np.exp(x).tolist(), strict=True)])
        return float(prices.sum()), -np.array([t.cost.exponent for t in each if t.cost is not None]) * prices


def cheapest(model: ToleranceModel, wanted: Floats) -> Floats:
    """Factors of all tolerances; the tightest where not even these reach the levels wanted, shape (limits, poses)."""
    from scipy.optimize import minimize

    count = len(model.free)
    lowest, highest = np.log(model.tightest), np.log(model.widest)
    every = range(len(model.task.settings))

    def margins(x: Floats, which: Sequence[int]) -> Floats:
        return model.aim.level(model.reached(model.scales(x), which)) - wanted[:, list(which)]

    def flat(x: Floats, which: Sequence[int]) -> Floats:
        return margins(x, which).ravel()

    def slopes(x: Floats, which: Sequence[int]) -> Floats:
        steps = _LOG_STEP * np.eye(count)
        return np.stack([(flat(x + h, which) - flat(x - h, which)) / (2 * _LOG_STEP) for h in steps], axis=1)

    if margins(lowest, every).min() < 0:
        return model.scales(lowest)
    if margins(highest, every).min() >= 0:
        return model.scales(highest)
    alike = _shifted(margins, np.zeros(count), lowest, highest, every)
    unit = model.cost(alike)[0]
    active = [int(np.argmin(margins(alike, every).min(axis=0)))]
    for _ in range(_MAX_ROUNDS):
        constraint = {"type": "ineq", "fun": flat, "jac": slopes, "args": (tuple(active),)}
        found: Any = minimize(
            lambda x: model.cost(x)[0] / unit, alike, jac=lambda x: model.cost(x)[1] / unit, method="SLSQP",
            bounds=list(zip(lowest.tolist(), highest.tolist(), strict=True)), constraints=constraint,
            options={"maxiter": 300, "ftol": 1e-12},
        )  # type: ignore[call-overload]  # fmt: skip
        x = np.clip(found.x, lowest, highest)
        left = margins(x, every).min(axis=0)
        broken = [k for k in np.argsort(left).tolist() if left[k] < -_SLACK and k not in active]
        if not broken:
            break
        active += broken[:_POSES_ADDED]
    x = _shifted(margins, x, lowest, highest, every)
    return model.scales(x if model.cost(x)[0] <= model.cost(alike)[0] else alike)


def _shifted(
    margins: Callable[..., Floats], x: Floats, lowest: Floats, highest: Floats, every: Sequence[int]
) -> Floats:
    """All tolerances wider or tighter by one common factor, as far as the poses allow."""
    from scipy.optimize import brentq

    reach = float((highest - lowest).max())
    active: list[int] = []
    shifted = x
    while True:
        left = margins(shifted, every).min(axis=0)
        worst = int(np.argmin(left))
        if active and (left[worst] >= -_SLACK or worst in active):
            return shifted
        active.append(worst)

        def least(shift: float) -> float:
            return float(margins(np.clip(x + shift, lowest, highest), tuple(active)).min())

        # On the safe side of the root.
        shift = brentq(least, -reach, reach, xtol=1e-10) - 2e-10
        shifted = np.clip(x + shift, lowest, highest)
