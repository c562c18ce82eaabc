"""Quadrature rules that estimate their error, and changes of variable that smooth an integrand's ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mechdesign.ground.numerics.arrays import Floats

# Change of variable on [0, 1/2]: the fraction of the interval at a value of the new variable, and its derivative.
Map = Callable[[Floats], tuple[Floats, Floats]]


@dataclass(frozen=True, eq=False)
class Rule:
    """Gauss-Legendre rule on [-1, 1] with an estimate of its error.

    Parameters
    ----------
    nodes, weights : ndarray, shape (nodes,)
    spectrum : ndarray, shape (nodes, nodes)
        Takes values at the nodes to Legendre coefficients.
    window : int
        Coefficients in each group whose largest ones are compared.
    power : float
        Takes the decay between groups, as a power of the degree, to that from the last group to degrees twice as high.
    safety : float
        Factor of the estimated error.
    """

    nodes: Floats
    weights: Floats
    spectrum: Floats
    window: int
    power: float
    safety: float

    @staticmethod
    def of(count: int, window: int, safety: float) -> Rule:
        """Rule of `count` nodes; `window` and `safety` as in `Rule`."""
        nodes, weights = np.polynomial.legendre.leggauss(count)
        degrees = np.arange(count)
        basis = np.polynomial.legendre.legvander(nodes, count - 1).T
        middle = count - 0.5 * (window + 1)
        power = np.log(2) / np.log(middle / (middle - window))
        return Rule(nodes, weights, (degrees[:, None] + 0.5) * weights * basis, window, power, safety)

    def apply(self, values: Floats) -> tuple[Floats, Floats]:
        """Integrals and their estimated errors, shape (m,), for values at the nodes, shape (nodes, m).

        The error is about the Legendre coefficient of degree 2n, the first that the rule does not integrate to zero. It
        is extrapolated from the slowest decay between the last groups of degree below n, as a power of the degree. So
        decay integrands that are not analytic (at isotropic points); analytic ones decay faster.
        """
        size = np.abs((self.spectrum @ values)[-(len(self.nodes) // self.window) * self.window :])
        groups = size.reshape(-1, self.window, values.shape[1]).max(axis=1)[-4:]
        decay = np.minimum((groups[1:] / groups[:-1]).max(axis=0), 1.0)
        decay = np.where(np.isfinite(decay), decay, 1.0)
        return self.weights @ values, self.safety * groups[-1] * decay**self.power


def cosine(v: Floats) -> tuple[Floats, Floats]:
    """Map (1 - cos pi v)/2 of [0, 1] onto itself, and its derivative, which has a simple zero at either end."""
    return np.sin(0.5 * np.pi * v) ** 2, 0.5 * np.pi * np.sin(np.pi * v)


def cubic(v: Floats) -> tuple[Floats, Floats]:
    """Map 10 v^3 - 15 v^4 + 6 v^5 of [0, 1] onto itself, and its derivative, which has a double zero at either end."""
    w = v * (1 - v)
    return v**3 * (10 + v * (6 * v - 15)), 30 * w * w


def spread(low: Floats, high: Floats, v: Floats, bend: Map) -> tuple[Floats, Floats]:
    """Points of [low, high] for `v` in [0, 1], and their derivatives by v, without cancellation near either end."""
    near, slope = bend(np.minimum(v, 1 - v))
    width = high - low
    return np.where(v < 0.5, low + width * near, high - width * near), width * slope
