"""Cumulants of all that varies: what mean and variance of a quadratic function of it need.

[McCullagh, Tensor methods in statistics, 1987, ch. 2 and 3.]
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from mechdesign.analyses.reliability.correlation import pair_nodes
from mechdesign.analyses.reliability.marginals import Normal
from mechdesign.analyses.reliability.pins import PIN_LAWS
from mechdesign.analyses.reliability.sources import Pin, Sources
from mechdesign.numerics.arrays import Floats, Ints


@dataclass(frozen=True, eq=False)
class Cumulants:
    """Joint cumulants of the components: the scalars, then x and y of each pin's offset.

    Parameters
    ----------
    mean : ndarray, shape (components,)
    covariance : ndarray, shape (components, components)
    third, fourth : (ndarray of int, shape (terms, 3 or 4), ndarray, shape (terms,))
        Cumulants that are not zero, with their components; every order of unlike components is a term.
    """

    mean: Floats
    covariance: Floats
    third: tuple[Ints, Floats]
    fourth: tuple[Ints, Floats]


def cumulants(sources: Sources) -> Cumulants:
    """Cumulants with the pins' laws of the analytic method.

    A clearance's radius R multiplies its pin's place of unit clearance (x, y), which is isotropic: E[(R x)^2] =
    E[R^2] E[x^2], E[(R x)^4] = E[R^4] E[x^4], E[R^4 x^2 y^2] = E[R^4] E[x^4]/3, and all odd moments are zero. Of
    correlated dimensions that are not normal the cumulants of two are counted, those of three and more together not.
    """
    laws = [scalar.law.moments for scalar in sources.scalars]
    count = len(laws)
    size = count + 2 * len(sources.pins)
    mean, covariance = np.zeros(size), np.zeros((size, size))
    third: dict[tuple[int, ...], float] = {}
    fourth: dict[tuple[int, ...], float] = {}
    for k, (middle, second, skew, flat) in enumerate(laws):
        mean[k], covariance[k, k] = middle, second
        third[k, k, k] = skew
        fourth[k, k, k, k] = flat - 3.0 * second**2
    if sources.correlation is not None:
        sigma = np.sqrt(np.diagonal(covariance)[:count])
        covariance[:count, :count] = sources.correlation.coefficients * np.outer(sigma, sigma)
        for places, value in _of_pairs(sources, covariance):
            (third if len(places) == 3 else fourth)[places] = value
    for k, pin in enumerate(sources.pins):
        second, flat, mixed = _pin(pin)
        x, y = count + 2 * k, count + 2 * k + 1
        for axis in (x, y):
            covariance[axis, axis] = second
            fourth[axis, axis, axis, axis] = flat - 3.0 * second**2
        fourth[x, x, y, y] = mixed - second**2
    return Cumulants(mean, covariance, _terms(third, 3), _terms(fourth, 4))


def _pin(pin: Pin) -> tuple[float, float, float]:
    """E[x^2], E[x^4] and E[x^2 y^2] of a pin's offset (x, y)."""
    law = PIN_LAWS[pin.analytic]
    radius, second, skew, flat = pin.moments
    squared = radius**2 + second
    fourth = radius**4 + 6.0 * radius**2 * second + 4.0 * radius * skew + flat
    return law.variance * squared, law.fourth * fourth, law.fourth * fourth / 3.0


def _of_pairs(sources: Sources, covariance: Floats) -> Iterator[tuple[tuple[int, ...], float]]:
    assert sources.correlation is not None
    behind = sources.correlation.root @ sources.correlation.root.T
    laws = [scalar.law for scalar in sources.scalars]
    for i, j in zip(*np.nonzero(np.triu(sources.correlation.coefficients, 1)), strict=True):
        if isinstance(laws[i], Normal) and isinstance(laws[j], Normal):
            continue
        u, v, weight = pair_nodes(float(behind[i, j]))
        x, y = laws[i].at(u) - laws[i].moments[0], laws[j].at(v) - laws[j].moments[0]
        a, b, c = covariance[i, i], covariance[j, j], covariance[i, j]

        def expected(value: Floats, weight: Floats = weight) -> float:
            return float((weight * value).sum())

        one, other = int(i), int(j)
        yield (one, one, other), expected(x * x * y)
        yield (one, other, other), expected(x * y * y)
        yield (one, one, one, other), expected(x**3 * y) - 3.0 * a * c
        yield (one, one, other, other), expected(x * x * y * y) - a * b - 2.0 * c * c
        yield (one, other, other, other), expected(x * y**3) - 3.0 * b * c


def _terms(found: dict[tuple[int, ...], float], order: int) -> tuple[Ints, Floats]:
    terms = [(each, value) for places, value in found.items() if value for each in sorted(set(permutations(places)))]
    index = np.array([each for each, _ in terms], dtype=np.intp).reshape(-1, order)
    return index, np.array([value for _, value in terms], dtype=float)
