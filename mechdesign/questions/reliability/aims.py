"""The target of an allocation at every pose: a reliability, or a Cpk of every limited output.

An aim has a measure: the probability of failure, or the Cpk. The `level` of a measure is the logarithm of the distance
from the limits in standard deviations. It is nearly linear in the logarithms of the tolerances, and a higher level is
better.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
import scipy

from mechdesign.ground.expressions import Number
from mechdesign.ground.numerals import numeral
from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.questions.reliability import methods
from mechdesign.questions.reliability.engine.problem import WIDTH
from mechdesign.questions.reliability.first_order import FirstOrder
from mechdesign.questions.reliability.question import ReliabilityQuestion
from mechdesign.questions.reliability.schema.allocation import Allocate
from mechdesign.questions.reliability.schema.section import ReliabilitySection
from mechdesign.questions.reliability.task import Task

# Lower bound of a failure probability before its quantile is taken.
_LEAST_FAILURE = 1e-300
# Lower bound of a distance from a limit, in standard deviations, before its logarithm is taken.
_LEAST_DISTANCE = 1e-6
# Expected failures among the study's samples from which on plain Monte Carlo confirms a reliability.
_ENOUGH_FAILURES = 100
# Largest probability of failure that is assumed where no sample failed, as a share of the target.
_UNSEEN = 0.01
# Bisection steps in the search of a standard deviation.
_HALVINGS = 60


class Simulated(NamedTuple):
    """Simulated measures, and the worse and the better end of their 99.7 % intervals, shape (limits, poses).

    `unseen` marks poses without a failed sample; `evaluations` are the mechanisms solved at each pose.
    """

    value: Floats
    worst: Floats
    best: Floats
    unseen: Flags
    evaluations: list[int]


@dataclass(frozen=True)
class Reliable:
    """A reliability of all limits together; the measure is the probability of failure, `goal` that of the target."""

    goal: float
    noun: ClassVar[str] = "reliability"

    def level(self, measure: Number) -> Floats:
        """Logarithm of the distance, in standard deviations, of symmetric limits broken with this probability."""
        return np.log(np.maximum(-scipy.special.ndtri(0.5 * np.maximum(measure, _LEAST_FAILURE)), _LEAST_DISTANCE))

    def measure(self, level: Number) -> Floats:
        """The inverse of `level`."""
        return np.asarray(2.0 * scipy.special.ndtr(-np.exp(level)))

    def shown(self, measure: Floats) -> Floats:
        """The measure as tables have it: the reliability."""
        return 1.0 - measure

    def in_words(self, measure: float) -> str:
        """The measure as messages have it: the reliability with enough digits to differ from 1."""
        digits = 6 if measure <= 0 else max(6, math.ceil(-math.log10(measure)) + 3)
        return f"{1.0 - measure:.{digits}f}".rstrip("0").rstrip(".")

    def by_model(self, question: ReliabilityQuestion, linear: FirstOrder, closing: FirstOrder) -> Floats:
        """Measures by the linear model of the errors and that of the margins of assembly, shape (limits, poses)."""
        # SciPy takes a quarter of a second to import, and a study without limits does not need it.
        from mechdesign.questions.reliability.probability import made_failure

        return made_failure(linear, closing, question.limits)[0][None]

    def method(self, task: Task, section: ReliabilitySection) -> str:
        """The simulation method that confirms the target."""
        return "auto" if "auto" in section.methods or task.samples * self.goal < _ENOUGH_FAILURES else "monte_carlo"

    def simulate(self, task: Task, method: str) -> Simulated:
        """Measures at the settings of a task by a simulation method."""
        result = methods.run(method, task)
        estimates = [result.estimates[setting.pose] for setting in task.settings]
        value, low, high = (np.array([[getattr(e, name) for e in estimates]]) for name in ("failure", "low", "high"))
        return Simulated(value, high, low, value == 0, [e.evaluations for e in estimates])

    def safe(self, simulated: Simulated) -> Floats:
        """Measures no better than the simulated ones, from which the model's target is corrected."""
        # With few failures, or none, the end of the interval is used.
        few = (2.0 * simulated.best < simulated.worst) & (simulated.worst < self.goal)
        measure = np.where(few, simulated.worst, simulated.value)
        return np.where(simulated.unseen, np.minimum(simulated.worst, _UNSEEN * self.goal), measure)

    def widest(self, low: Floats, high: Floats, level: Floats) -> Floats:
        """Largest standard deviation of an error of mean 0 that reaches `level` within [low, high]; 0 where none does.

        Limits that have to be kept together reach a level only if each of them alone does.
        """
        from mechdesign.ground.numerics.statistics import outside

        allowed = self.measure(level)
        # Bracket of the deviation's logarithm: exact for symmetric limits, wider where one limit is farther.
        least, most = (np.log(np.minimum(high, -low) * factor / np.exp(level)) for factor in (0.1, 1e3))
        for _ in range(_HALVINGS):
            middle = 0.5 * (least + most)
            kept = outside(low / np.exp(middle), high / np.exp(middle)) <= allowed
            least, most = np.where(kept, middle, least), np.where(kept, most, middle)
        return np.where((low < 0) & (high > 0), np.exp(most), 0.0)


@dataclass(frozen=True)
class Capable:
    """A Cpk of each limit by itself [ISO 22514]; methods are those of `Reliable`."""

    goal: float
    noun: ClassVar[str] = "Cpk"

    def level(self, measure: Number) -> Floats:
        """Logarithm of the distance of the nearer limit, in standard deviations."""
        return np.log(np.maximum(3.0 * np.asarray(measure), _LEAST_DISTANCE))

    def measure(self, level: Number) -> Floats:
        return np.asarray(np.exp(level) / 3.0)

    def shown(self, measure: Floats) -> Floats:
        return measure

    def in_words(self, measure: float) -> str:
        return numeral(measure)

    def by_model(self, question: ReliabilityQuestion, linear: FirstOrder, closing: FirstOrder) -> Floats:
        return _cpk(question, linear.shift(), linear.deviation())

    def method(self, task: Task, section: ReliabilitySection) -> str:
        return "monte_carlo"

    def simulate(self, task: Task, method: str) -> Simulated:
        poses = [setting.pose for setting in task.settings]
        result = methods.run(method, task)
        mean, covariance = result.moments(task)
        sigma = np.sqrt(np.diagonal(covariance[poses], axis1=1, axis2=2).T)
        value = _cpk(task.question.take(poses).at(task.nominal[:, poses]), mean[:, poses], sigma)
        counts = np.array([result.sums[pose].valid for pose in poses])
        # [Bissell, How reliable is your capability index?, 1990]
        half = WIDTH * np.sqrt(1.0 / (9.0 * counts) + value**2 / (2.0 * (counts - 1)))
        return Simulated(value, value - half, value + half, np.zeros(value.shape, dtype=bool), counts.tolist())

    def safe(self, simulated: Simulated) -> Floats:
        return simulated.value

    def widest(self, low: Floats, high: Floats, level: Floats) -> Floats:
        return np.maximum(np.minimum(high, -low), 0.0) / np.exp(level)


Aim = Reliable | Capable


def aim_of(allocate: Allocate) -> Aim:
    """The target that a study's `allocate` gives."""
    if allocate.reliability is not None:
        return Reliable(1.0 - allocate.reliability)
    return Capable(allocate.cpk or 0.0)


def _cpk(question: ReliabilityQuestion, mean: Floats, sigma: Floats) -> Floats:
    """Cpk of each limit, shape (limits, poses), from moments of shape (channels, poses)."""
    return np.stack([
        np.minimum(limit.high - mean[limit.output], mean[limit.output] - limit.low) / (3.0 * sigma[limit.output])
        for limit in question.limits
    ])  # fmt: skip
