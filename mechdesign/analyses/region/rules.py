"""Quadrature rules that estimate their error, and maps that make the ends of an interval smooth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mechdesign.numerics.arrays import Floats

# Share of an interval and its slope, over [0, 1/2], for a share of the variable.
Map = Callable[[Floats], tuple[Floats, Floats]]


@dataclass(frozen=True, eq=False)
class Rule:
    """Gauss-Legendre rule on [-1, 1] and the matrix that gives the Legendre coefficients of the integrand."""

    nodes: Floats
    weights: Floats
    spectrum: Floats
    window: int
    power: float
    safety: float

    @staticmethod
    def of(count: int, window: int, safety: float) -> Rule:
        """Rule of `count` nodes that judges the decay of coefficients by groups of `window`, with a safety factor."""
        nodes, weights = np.polynomial.legendre.leggauss(count)
        degrees = np.arange(count)
        basis = np.polynomial.legendre.legvander(nodes, count - 1).T
        middle = count - 0.5 * (window + 1)
        power = np.log(2) / np.log(middle / (middle - window))
        return Rule(nodes, weights, (degrees[:, None] + 0.5) * weights * basis, window, power, safety)

    def apply(self, values: Floats) -> tuple[Floats, Floats]:
        """Integral and its estimated error for values at the nodes (first axis).

        The error is about the first Legendre coefficient that the rule takes for a constant, of degree 2n. It is
        extrapolated from the slowest decay between the last groups of degree below n, as a power of the degree: the
        decay of what is not analytic (isotropic points), and safe for what is.
        """
        size = np.abs((self.spectrum @ values)[-(len(self.nodes) // self.window) * self.window :])
        groups = size.reshape(-1, self.window, values.shape[1]).max(axis=1)[-4:]
        with np.errstate(divide="ignore", invalid="ignore"):
            decay = np.minimum((groups[1:] / groups[:-1]).max(axis=0), 1.0)
        decay = np.where(np.isfinite(decay), decay, 1.0)
        return self.weights @ values, self.safety * groups[-1] * decay**self.power


def cosine(v: Floats) -> tuple[Floats, Floats]:
    """Map of [0, 1] onto itself with a double point at 0 (and, mirrored, at 1): (1 - cos pi v)/2, and its slope."""
    return np.sin(0.5 * np.pi * v) ** 2, 0.5 * np.pi * np.sin(np.pi * v)


def cubic(v: Floats) -> tuple[Floats, Floats]:
    """Map of [0, 1] onto itself with a threefold point at either end, and its slope."""
    w = v * (1 - v)
    return v**3 * (10 + v * (6 * v - 15)), 30 * w * w


def spread(low: Floats, high: Floats, v: Floats, bend: Map) -> tuple[Floats, Floats]:
    """Points of [low, high] at `v` of [0, 1] and their density, without cancellation near either end."""
    near, slope = bend(np.minimum(v, 1 - v))
    width = high - low
    return np.where(v < 0.5, low + width * near, high - width * near), width * slope
