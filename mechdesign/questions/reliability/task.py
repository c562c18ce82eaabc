"""The common input of all methods of reliability, and the result of a method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.ground.progress import NULL, Progress
from mechdesign.mechanism import Reason
from mechdesign.motion.rows import Poses
from mechdesign.questions.poses import pose_in_words
from mechdesign.questions.reliability.deflection import Elastic
from mechdesign.questions.reliability.engine.problem import Estimate
from mechdesign.questions.reliability.first_order import FirstOrder
from mechdesign.questions.reliability.question import ORDERS, ReliabilityQuestion
from mechdesign.questions.reliability.schema.section import Precision
from mechdesign.questions.reliability.simulation import Setting, Sums
from mechdesign.questions.reliability.sources import Sources
from mechdesign.study import Study

Strings = NDArray[np.str_]

# Most samples of `auto` where the study gives no number of samples.
MAX_SAMPLES = 2_000_000
# Its coefficient of variation of the probability of failure where the study gives no precision.
RELATIVE_PRECISION = 0.05


@dataclass(frozen=True, eq=False)
class Task:
    """The common input of all methods: the question, and the nominal mechanism at every pose.

    Parameters
    ----------
    reason : int8 array, shape (poses,)
        See `mechdesign.mechanism.Reason`.
    nominal : ndarray, shape (channels, poses)
        Values of the channels (radians, lengths).
    linear : FirstOrder
        The linear error model of the channels.
    closing : FirstOrder
        The linear model of the margins of assembly, negative where a made mechanism cannot be assembled.
    settings : sequence of Setting
        A `Setting` for each pose that can be assembled, in the order of the poses: what a made mechanism is solved
        with there, and how its error is judged. ``setting.pose`` is the pose's place in the arrays above. It is empty
        where only the first order is computed, as of the designs of `optimize`.
    most : int
        Most samples of methods that stop at a precision.
    """

    study: Study
    poses: Poses
    question: ReliabilityQuestion
    sources: Sources
    reason: NDArray[np.int8]
    nominal: Floats
    linear: FirstOrder
    closing: FirstOrder
    elastic: Elastic | None = None
    settings: Sequence[Setting] = ()
    seed: int = 0
    samples: int = 0
    most: int = MAX_SAMPLES
    precision: Precision = field(default_factory=lambda: Precision(relative=RELATIVE_PRECISION))
    jobs: int | None = 1
    progress: Progress = NULL

    def __getstate__(self) -> dict[str, Any]:
        """A copy in a worker process shows no progress and starts no processes."""
        return self.__dict__ | {"progress": NULL, "jobs": 1}

    @cached_property
    def assembled(self) -> Flags:
        """Poses that can be assembled, inside or outside the limits of motion."""
        return np.isin(self.reason, (Reason.OK, Reason.LIMIT))

    @cached_property
    def scale(self) -> Floats:
        """Study units in one unit of the core, shape (channels,)."""
        turn = 1.0 / self.study.units.angle_factor
        return np.array([turn if channel.turns else 1.0 for channel in self.question.channels])

    @cached_property
    def labels(self) -> tuple[Strings, Strings, Strings]:
        """Output, order and unit of each channel."""
        units = self.study.units
        parts = [(c.output, ORDERS[c.order], units.label(c.kind)) for c in self.question.channels]
        outputs, orders, labels = (np.array(part) for part in zip(*parts, strict=True))
        return outputs, orders, labels

    def where(self, pose: int) -> str:
        """A pose in words."""
        return pose_in_words(self.study, self.poses, pose)


@dataclass(frozen=True, eq=False)
class MethodResult:
    """The result of a method, by pose, and over the whole cycle.

    Parameters
    ----------
    estimates : dict of int to Estimate
        Probability of failure, where there are limits.
    sums : dict of int to Sums
        Sums of the sampled errors, of methods that sample them.
    used : dict of int to str
        The method that the value comes from, where it is not this one.
    rungs : dict of int to dict of str to Estimate
        Estimates of all methods that `auto` tried.
    normal : (ndarray, ndarray) or None
        Mean, shape (channels, poses), and covariance, shape (poses, channels, channels), of errors that are not drawn
        (radians, lengths), of the channels of the linear model's `whole`; None where the method gives none.
    cycles : tuple of Estimate
        One for each design; empty where no cycle is estimated.
    method : str
        Name of the method; `methods.run` sets it.
    """

    estimates: dict[int, Estimate] = field(default_factory=dict)
    sums: dict[int, Sums] = field(default_factory=dict)
    used: dict[int, str] = field(default_factory=dict)
    rungs: dict[int, dict[str, Estimate]] = field(default_factory=dict)
    normal: tuple[Floats, Floats] | None = None
    cycles: tuple[Estimate, ...] = ()
    method: str = ""

    @property
    def cycle(self) -> Estimate | None:
        """Estimate of the first design's whole cycle, if there is one."""
        return self.cycles[0] if self.cycles else None

    def moments(self, task: Task) -> tuple[Floats, Floats]:
        """Mean and covariance of the errors, in the shapes of `normal`, or those of the samples; nan where unknown."""
        if self.normal is not None:
            return task.linear.own(*self.normal)
        channels, poses = task.nominal.shape
        mean, covariance = np.full((channels, poses), np.nan), np.full((poses, channels, channels), np.nan)
        for pose, sums in self.sums.items():
            if sums.valid:
                mean[:, pose], covariance[pose] = sums.mean, sums.covariance
        return mean, covariance

    def add(self, other: MethodResult) -> None:
        """Add the estimates and samples of other poses."""
        self.estimates.update(other.estimates)
        self.sums.update(other.sums)
        self.used.update(other.used)
        self.rungs.update(other.rungs)


class Partial(KeyboardInterrupt):
    """An interrupted method, and its result so far."""

    def __init__(self, result: MethodResult) -> None:
        super().__init__()
        self.result = result
