"""The cheapest tolerances with which the first-order model reaches the target.

Minimise sum a_k / T_k^e_k over log T, where the normal errors of the linear model reach the target at every pose. The
cost is convex in log T, and so is the variance of every error. A pose becomes a constraint once it misses the target.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy

from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.questions.reliability.aims import Aim
from mechdesign.questions.reliability.first_order import FirstOrder
from mechdesign.questions.reliability.schema.allocation import Cost, half_widths
from mechdesign.questions.reliability.schema.iso_tolerances import ToleranceClassError
from mechdesign.questions.reliability.schema.section import ReliabilitySection
from mechdesign.questions.reliability.sources import Sources
from mechdesign.questions.reliability.task import Task
from mechdesign.study import Study

# Significant digits of allocated tolerances, rounded down: a tighter tolerance still reaches the target.
DIGITS = 6
# Least and largest allocated tolerance, in multiples of the study's.
TIGHTEST = 1e-3
WIDEST = 10.0
# Step of the difference quotients in log T.
_LOG_STEP = 1e-4
# Largest shortfall of a level that counts as reached.
_SLACK = 1e-9
# Poses that become constraints after a minimisation.
_POSES_ADDED = 6
# Most minimisations.
_MAX_ROUNDS = 30


@dataclass(frozen=True)
class Allotment:
    """The tolerance of one source, in the study's units; `cost` is None where it is not allocated but held.

    `given` is, by `kind`: half the width of a ``tolerance``, a ``sigma``, the standard deviation of ``measured``
    values, or a ``clearance``: the mean radial one, or the backlash. `middle` is the middle of a tolerance. `grades`
    maps the names of the allowed standard grades onto half their widths, from the finest on; empty where any width is
    allowed.
    """

    name: str
    given: float
    middle: float
    kind: str
    unit: str
    cost: Cost | None
    grades: Mapping[str, float] = field(default_factory=dict)

    def price(self, size: float) -> float:
        """Cost of a tolerance of this size: a/T^exponent; nan where it is held."""
        return float("nan") if self.cost is None else self.cost.a / size**self.cost.exponent

    def size(self, scale: float) -> float:
        """The tolerance times a factor, without the rounding error of the product."""
        return float(f"{self.given * scale:.12g}")

    def grade(self, scale: float) -> str:
        """Name of the grade whose width is this multiple of the given tolerance; empty where there is none."""
        return next((name for name, half in self.grades.items() if abs(self.given * scale / half - 1.0) < 1e-9), "")

    def rounded(self, scale: float) -> float:
        """The factor rounded down so that the tolerance has `DIGITS` significant digits."""
        size = self.given * scale
        unit = 10.0 ** (math.floor(math.log10(size)) + 1 - DIGITS)
        return float(f"{math.floor(size / unit * (1.0 + 1e-7)) * unit:.{DIGITS}g}") / self.given


def tolerances(study: Study, sources: Sources) -> list[Allotment]:
    """Tolerances of all sources, in their order.

    Dimensions are allocated; loads and clearances only where `cost` names them. With grades, dimensions without any
    are held.
    """
    section = ReliabilitySection.of(study)
    assert section.allocate is not None
    costs, allowed = section.allocate.cost, section.allocate.grades
    millimetre = study.units.convert("1 mm") if allowed else 1.0
    rows = []
    for scalar in sources.scalars:
        dimension = section.dimensions[scalar.name]
        low, high = map(float, dimension.ends(study.sizes.get(scalar.name, 0.0)))
        half = 0.5 * (high - low) if dimension.sigma is None else dimension.sigma
        if dimension.measured is not None:
            half = math.sqrt(scalar.law.moments[1]) / scalar.factor
        grades: dict[str, float] = {}
        if allowed:
            with suppress(ToleranceClassError):
                places = study.mechanism.description.places
                grades = half_widths(scalar.name, dimension, allowed, study.parameters, places, millimetre)
        possible = bool(grades) or not allowed
        allocated = half > 0 and dimension.kind != "measured" and (scalar.kind != "load" or scalar.name in costs)
        cost = costs.get(scalar.name, Cost()) if allocated and possible else None
        rows.append(Allotment(scalar.name, half, 0.5 * (low + high), dimension.kind, scalar.unit or "", cost, grades))
    for pin in sources.pins:
        cost = costs.get(pin.name) if pin.radius > 0 else None
        clearance = section.clearances[pin.name]
        size = float(clearance.radius if clearance.backlash is None else clearance.backlash)
        rows.append(Allotment(pin.name, size, 0.0, "clearance", study.units.label(pin.quantity), cost))
    return rows


@dataclass(frozen=True, eq=False)
class ToleranceModel:
    """Cost of the tolerances, and the measure that they reach by the first-order model, by factors of the given ones.

    `free` are the indices of the sources whose tolerance is allocated, `widest` their largest factors, shape (free,).
    """

    task: Task
    aim: Aim
    tolerances: Sequence[Allotment]
    free: Ints
    widest: Floats

    def scales(self, x: Floats) -> Floats:
        """Factor of each source's tolerance, shape (sources,), from the logarithms x of the free ones; 1 where held."""
        scales = np.ones(len(self.tolerances))
        scales[self.free] = np.exp(x)
        return scales

    @cached_property
    def steps(self) -> list[Floats]:
        """Factors of the grades of each free tolerance, up to its widest; an empty list where any width is allowed."""
        free = [(self.tolerances[k], widest) for k, widest in zip(self.free, self.widest, strict=True)]
        scales = [(np.array([*t.grades.values()]) / t.given, widest) for t, widest in free]
        return [part[(part <= widest) | (part == part[0])] for part, widest in scales if len(part)]

    @property
    def tightest(self) -> Floats:
        """Least factors of the free tolerances, shape (free,)."""
        return np.array([part[0] for part in self.steps]) if self.steps else np.full(len(self.free), TIGHTEST)

    def linear(self, scales: Floats) -> FirstOrder:
        """The linear error model with tolerances times these factors."""
        return replace(self.task.linear, sources=self.task.sources.widened(scales))

    def reached(self, scales: Floats, which: Sequence[int]) -> Floats:
        """Measures by the linear model at some of the task's settings, shape (limits, settings).

        With `scales` of shape (sources, choices), measures of the first choice at all settings come first, then the
        next.
        """
        poses = np.array([self.task.settings[k].pose for k in which])
        many = scales.shape[1] if scales.ndim > 1 else 1
        factors = np.repeat(scales, len(poses), axis=1) if scales.ndim > 1 else scales
        poses = np.tile(poses, many)
        sources = self.task.sources.widened(factors)
        linear, closing = (replace(part.take(poses), sources=sources) for part in (self.task.linear, self.task.closing))
        return self.aim.by_model(self.task.question.take(poses).at(self.task.nominal[:, poses]), linear, closing)

    def cost(self, x: Floats) -> tuple[float, Floats]:
        """Cost of the allocated tolerances, and its derivatives by x = log(factor)."""
        free = [self.tolerances[k] for k in self.free.tolist()]
        prices = np.array([t.price(t.given * scale) for t, scale in zip(free, np.exp(x).tolist(), strict=True)])
        return float(prices.sum()), -np.array([t.cost.exponent for t in free if t.cost is not None]) * prices


def cheapest(model: ToleranceModel, targets: Floats) -> Floats:
    """Factors of the cheapest tolerances that reach the levels `targets`, shape (limits, poses); else the tightest."""
    count = len(model.free)
    lowest, highest = np.log(model.tightest), np.log(model.widest)
    every = range(len(model.task.settings))

    def margins(x: Floats, which: Sequence[int]) -> Floats:
        return model.aim.level(model.reached(model.scales(x), which)) - targets[:, list(which)]

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
        optimum: Any = scipy.optimize.minimize(
            lambda x: model.cost(x)[0] / unit, alike, jac=lambda x: model.cost(x)[1] / unit, method="SLSQP",
            bounds=list(zip(lowest.tolist(), highest.tolist(), strict=True)), constraints=constraint,
            options={"maxiter": 300, "ftol": 1e-12},
        )  # type: ignore[call-overload]  # fmt: skip
        x = np.clip(optimum.x, lowest, highest)
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
    """Logarithms x of the tolerances plus the largest common shift at which all poses reach their levels."""
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

        # The root's tolerance lies on the tighter side.
        shift = scipy.optimize.brentq(least, -reach, reach, xtol=1e-10) - 2e-10
        shifted = np.clip(x + shift, lowest, highest)
