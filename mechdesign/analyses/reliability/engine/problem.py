"""What fails where: margins over the space of independent standard normal variables."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.reliability.engine.intervals import binomial
from mechdesign.numerics.arrays import Flags, Floats

# Step of a difference quotient of margins, in standard deviations: the third root of what rounding leaves in doubt.
_STEP = 1e-4
# Points evaluated at once: what is computed of each then stays in the cache.
BLOCK = 20_000


@dataclass(frozen=True)
class Estimate:
    """A probability of failure by one method.

    Parameters
    ----------
    failure, low, high : float
        Value and interval at 99.7 %; all three alike where the method claims no interval.
    evaluations : int
        Points at which margins were evaluated, all told.
    samples : int
        Those that the value is a mean over; 0 where it is none.
    failures : int
        Samples that failed.
    invalid : int
        Samples without margins; they are failures.
    """

    failure: float
    low: float
    high: float
    evaluations: int
    samples: int = 0
    failures: int = 0
    invalid: int = 0

    @property
    def error(self) -> float:
        """Three standard errors of counted failures [S2, eq. 16]; of another method half the interval."""
        if self.samples and self.failure == self.failures / self.samples:
            return 3.0 * math.sqrt(self.failure * (1.0 - self.failure) / self.samples)
        return 0.5 * (self.high - self.low)


def counted(failures: int, samples: int, invalid: int, evaluations: int) -> Estimate:
    """Estimate from counted failures, with the interval of Clopper and Pearson."""
    return Estimate(failures / samples, *binomial(failures, samples), evaluations, samples, failures, invalid)


class Problem:
    """Limit states, and how often they were evaluated.

    Parameters
    ----------
    dimension : int
        Number of independent standard normal variables.
    margins : callable
        From points, shape (dimension, n), to margins, shape (limits, n). A limit is broken where its margin is
        negative; nan is a failure of its own kind (what cannot be assembled has no margins).
    gradients : callable, optional
        From points to margins and their derivatives, shape (limits, dimension, n); left out, difference quotients.
    circles : sequence of (int, int)
        Variables that are no normal ones: the cosine and the sine of a direction that is as likely as any other.
        Derivatives by them are those of margins that go on off the circle.
    """

    def __init__(
        self,
        dimension: int,
        margins: Callable[[Floats], Floats],
        gradients: Callable[[Floats], tuple[Floats, Floats]] | None = None,
        circles: Sequence[tuple[int, int]] = (),
    ) -> None:
        self.dimension = dimension
        self.circles = np.array(circles, dtype=np.intp).reshape(-1, 2)
        self.normals = np.setdiff1d(np.arange(dimension), self.circles)
        self.evaluations = 0
        self._margins = margins
        self._gradients = gradients

    def draw(self, rng: np.random.Generator, count: int, spread: float = 1.0) -> Floats:
        """Points, shape (dimension, count), normal variables with this standard deviation and all directions."""
        return self.on_circles(
            np.where(self.straight[:, None], spread, 1.0) * rng.standard_normal((self.dimension, count))
        )

    @property
    def straight(self) -> Flags:
        """Which of the variables are normal."""
        return np.isin(np.arange(self.dimension), self.normals)

    def on_circles(self, u: Floats) -> Floats:
        """Points, shape (dimension, n), changed in place: their directions are cosine and sine again."""
        for pair in self.circles:
            length = np.linalg.norm(u[pair], axis=0)
            u[pair[0]] = np.where(length > 0, u[pair[0]], 1.0)
            u[pair] /= np.where(length > 0, length, 1.0)
        return u

    def margins(self, u: Floats) -> Floats:
        """Margins at points `u` of shape (dimension, n): shape (limits, n)."""
        self.evaluations += u.shape[1]
        parts = [self._margins(u[:, k : k + BLOCK]) for k in range(0, u.shape[1], BLOCK)]
        return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)

    def gradients(self, u: Floats) -> tuple[Floats, Floats]:
        """Margins, shape (limits, n), and their derivatives, shape (limits, dimension, n)."""
        if self._gradients is not None:
            self.evaluations += u.shape[1]
            return self._gradients(u)
        return self.margins(u), slopes(self.margins, u, _STEP)


def slopes(function: Callable[[Floats], Floats], u: Floats, step: float) -> Floats:
    """Difference quotients of functions, from shape (dimension, n) to (rows, n): shape (rows, dimension, n)."""
    d, n = u.shape
    steps = step * np.eye(d)[:, :, None]
    points = np.concatenate([(u + way * steps).swapaxes(0, 1).reshape(d, d * n) for way in (1, -1)], axis=1)
    ahead, back = function(points).reshape(-1, 2, d, n).swapaxes(0, 1)
    return np.asarray((ahead - back) / (2 * step))


def failed(margins: Floats) -> Flags:
    """Which points fail, shape (n,), from margins of shape (limits, n)."""
    return np.asarray(~np.all(margins >= 0, axis=0))
