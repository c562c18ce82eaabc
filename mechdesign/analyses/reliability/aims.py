"""What allocated tolerances have to reach at every pose: a reliability, or a Cpk of every limited output.

An aim is measured by what is asked: a probability of failure, or a Cpk. Its `level`, the logarithm of a distance from
the limits in standard deviations, is nearly linear in the logarithms of tolerances, and grows with what is better.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from mechdesign.analyses.reliability import methods
from mechdesign.analyses.reliability.engine.problem import WIDTH
from mechdesign.analyses.reliability.first_order import FirstOrder
from mechdesign.analyses.reliability.question import ReliabilityQuestion
from mechdesign.analyses.reliability.task import Task
from mechdesign.expressions import Number
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.study.schema.allocation import Allocate
from mechdesign.study.schema.reliability import ReliabilitySection

# Least failure probability that is told from 0, and least distance from a limit.
_LEAST_FAILURE = 1e-300
_LEAST_DISTANCE = 1e-6
# Expected failures from which on the study's own samples confirm them.
_ENOUGH_FAILURES = 100
# Share of the failures asked that a simulation which sees none is counted for at most.
_UNSEEN = 0.01
# Halvings in the search of a deviation.
_HALVINGS = 60


class Simulated(NamedTuple):
    """What simulation finds, with the ends of its interval, 99.7 %; measures, shape (limits, poses).

    `unseen` is where no failure was seen; `evaluations` are of each pose.
    """

    value: Floats
    worst: Floats
    best: Floats
    unseen: Flags
    evaluations: list[int]


@dataclass(frozen=True)
class Aim(ABC):
    """What is asked, as a measure."""

    asked: float

    noun: ClassVar[str]

    @abstractmethod
    def level(self, measure: Number) -> Floats:
        """Logarithms of distances from the limits."""

    @abstractmethod
    def measure(self, level: Number) -> Floats:
        """The inverse of `level`."""

    @abstractmethod
    def shown(self, measure: Floats) -> Floats:
        """As tables have it."""

    @abstractmethod
    def plain(self, measure: float) -> str:
        """In words."""

    @abstractmethod
    def by_model(self, question: ReliabilityQuestion, linear: FirstOrder, closing: FirstOrder) -> Floats:
        """Measures of a linear model at poses, shape (limits, poses), and of its margins of assembly."""

    @abstractmethod
    def method(self, task: Task, section: ReliabilitySection) -> str:
        """The method that confirms it."""

    @abstractmethod
    def simulated(self, task: Task, method: str) -> Simulated:
        """What the method finds at the settings of a task."""

    @abstractmethod
    def safe(self, found: Simulated) -> Floats:
        """Measures on the safe side of what was found, from which the model is corrected."""

    @abstractmethod
    def widest(self, low: Floats, high: Floats, level: Floats) -> Floats:
        """Standard deviations with which an error of mean 0 has a level at most within an interval, 0 where with none.

        Where limits are kept together, a level of both is one of each by itself at least.
        """


class Reliable(Aim):
    """A probability of failure: of all limits together, by pose."""

    noun = "reliability"

    def level(self, measure: Number) -> Floats:
        """Log of the distance, in standard deviations, of two limits that are so often broken."""
        from scipy.special import ndtri

        return np.log(np.maximum(-ndtri(0.5 * np.maximum(measure, _LEAST_FAILURE)), _LEAST_DISTANCE))

    def measure(self, level: Number) -> Floats:
        from scipy.special import ndtr

        return np.asarray(2.0 * ndtr(-np.exp(level)))

    def shown(self, measure: Floats) -> Floats:
        return 1.0 - measure

    def plain(self, measure: float) -> str:
        """With as many digits as tell it from 1."""
        digits = 6 if measure <= 0 else max(6, math.ceil(-math.log10(measure)) + 3)
        return f"{1.0 - measure:.{digits}f}".rstrip("0").rstrip(".")

    def by_model(self, question: ReliabilityQuestion, linear: FirstOrder, closing: FirstOrder) -> Floats:
        # SciPy takes a quarter of a second to import, and a study without limits does not need it.
        from mechdesign.analyses.reliability.probability import made_failure

        return made_failure(linear, closing, question.bands, question.discs)[None]

    def method(self, task: Task, section: ReliabilitySection) -> str:
        return "auto" if "auto" in section.methods or task.samples * self.asked < _ENOUGH_FAILURES else "monte_carlo"

    def simulated(self, task: Task, method: str) -> Simulated:
        said = methods.run(method, task)
        each = [said.estimates[setting.pose] for setting in task.settings]
        value, low, high = (np.array([[getattr(e, name) for e in each]]) for name in ("failure", "low", "high"))
        return Simulated(value, high, low, value == 0, [e.evaluations for e in each])

    def safe(self, found: Simulated) -> Floats:
        # Where few failures are seen, or none, the interval's end keeps the correction on the safe side.
        few = (2.0 * found.best < found.worst) & (found.worst < self.asked)
        seen = np.where(few, found.worst, found.value)
        return np.where(found.unseen, np.minimum(found.worst, _UNSEEN * self.asked), seen)

    def widest(self, low: Floats, high: Floats, level: Floats) -> Floats:
        from mechdesign.numerics.statistics import outside

        allowed = self.measure(level)
        with np.errstate(divide="ignore", invalid="ignore"):
            # Log of the deviation; of two limits alike it is known, and of one it may be wider.
            least, most = (np.log(np.minimum(high, -low) * factor / np.exp(level)) for factor in (0.1, 1e3))
            for _ in range(_HALVINGS):
                middle = 0.5 * (least + most)
                kept = outside(low / np.exp(middle), high / np.exp(middle)) <= allowed
                least, most = np.where(kept, middle, least), np.where(kept, most, middle)
        return np.where((low < 0) & (high > 0), np.exp(most), 0.0)


class Capable(Aim):
    """A Cpk, of each limit by itself, by pose [ISO 22514]."""

    noun = "Cpk"

    def level(self, measure: Number) -> Floats:
        """Log of the distance of the nearer limit."""
        return np.log(np.maximum(3.0 * np.asarray(measure), _LEAST_DISTANCE))

    def measure(self, level: Number) -> Floats:
        return np.asarray(np.exp(level) / 3.0)

    def shown(self, measure: Floats) -> Floats:
        return measure

    def plain(self, measure: float) -> str:
        """With the digits that are counted."""
        return f"{measure:.6g}"

    def by_model(self, question: ReliabilityQuestion, linear: FirstOrder, closing: FirstOrder) -> Floats:
        return _cpk(question, linear.shift(), linear.deviation())

    def method(self, task: Task, section: ReliabilitySection) -> str:
        return "monte_carlo"

    def simulated(self, task: Task, method: str) -> Simulated:
        poses = [setting.pose for setting in task.settings]
        said = methods.run(method, task)
        mean, covariance = said.moments(task)
        sigma = np.sqrt(np.diagonal(covariance[poses], axis1=1, axis2=2).T)
        value = _cpk(task.question.at(task.nominal[:, poses]), mean[:, poses], sigma)
        counts = np.array([said.sums[pose].valid for pose in poses])
        # [Bissell, How reliable is your capability index?, 1990]
        half = WIDTH * np.sqrt(1.0 / (9.0 * counts) + value**2 / (2.0 * (counts - 1)))
        return Simulated(value, value - half, value + half, np.zeros(value.shape, dtype=bool), counts.tolist())

    def safe(self, found: Simulated) -> Floats:
        return found.value

    def widest(self, low: Floats, high: Floats, level: Floats) -> Floats:
        return np.maximum(np.minimum(high, -low), 0.0) / np.exp(level)


def aim_of(given: Allocate) -> Aim:
    """What a study asks."""
    return Reliable(1.0 - given.reliability) if given.reliability is not None else Capable(given.cpk or 0.0)


def _cpk(question: ReliabilityQuestion, mean: Floats, sigma: Floats) -> Floats:
    """Cpk of each band, shape (bands, poses), from moments of shape (channels, poses)."""
    with np.errstate(divide="ignore"):
        return np.stack([
            np.minimum(band.high - mean[band.output], mean[band.output] - band.low) / (3.0 * sigma[band.output])
            for band in question.bands
        ])  # fmt: skip
