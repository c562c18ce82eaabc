"""Correlated deviations: the normal variables behind laws, and what these have in common.

[Der Kiureghian & Liu, Structural reliability under incomplete probability information, 1986.] With the coefficients
a_k = E[f(U) h_k(U)] of a law in Hermite polynomials h_k, orthonormal in a standard normal variable U, two laws of
variables with the correlation r have [Mehler, 1866]

    E[f(U) g(V)] = sum over k of a_k b_k r^k
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.reliability.laws import Marginal, Normal, taken
from mechdesign.errors import StudyError
from mechdesign.expressions import Number
from mechdesign.numerics.arrays import Floats, Ints

# Panels over a normal variable, besides the kinks of its law, and nodes in each.
_EDGES = np.linspace(-9.0, 9.0, 241)
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)
# Hermite polynomials of the series: r = 0.97 to the power of so many is 1e-8.
_TERMS = 600
# Largest correlation of the normal variables behind two laws.
_MAX_CORRELATION = 0.999999


@dataclass(frozen=True, eq=False)
class Correlation:
    """Coefficients of the deviations, and the root of those of the normal variables behind them, shape (laws, laws).

    ``root @ u`` are correlated normal variables of independent ones. Where designs differ in them, (poses, laws, laws).
    """

    coefficients: Floats
    root: Floats

    def take(self, rows: Sequence[int] | Ints) -> Correlation:
        """At some of many poses."""
        return self if self.root.ndim == 2 else Correlation(self.coefficients[rows], self.root[rows])

    @staticmethod
    def of(laws: Sequence[Marginal], pairs: Mapping[tuple[int, int], Number]) -> Correlation:
        """Correlation of these pairs of laws; a StudyError where no variables of these laws have the coefficients."""
        bent = [laws[k] for i, j in pairs if not (isinstance(laws[i], Normal) and isinstance(laws[j], Normal))
                for k in (i, j)]  # fmt: skip
        numbers = np.broadcast_arrays(*pairs.values(), *(number for law in bent for number in law.numbers))
        if not numbers[0].ndim:
            return Correlation._of(laws, {pair: float(coefficient) for pair, coefficient in pairs.items()})
        # Alike at all poses of a design, and often in all designs.
        _, first, alike = np.unique(np.stack(numbers), axis=1, return_index=True, return_inverse=True)
        found = [Correlation._of([law.take(row) for law in laws],
                                 {pair: float(taken(each, row)) for pair, each in pairs.items()})
                 for row in first]  # fmt: skip
        rows = alike.ravel()
        return Correlation(np.stack([f.coefficients for f in found])[rows], np.stack([f.root for f in found])[rows])

    @staticmethod
    def _of(laws: Sequence[Marginal], pairs: Mapping[tuple[int, int], float]) -> Correlation:
        wanted, behind = np.eye(len(laws)), np.eye(len(laws))
        for (i, j), coefficient in pairs.items():
            wanted[i, j] = wanted[j, i] = coefficient
            behind[i, j] = behind[j, i] = _behind(laws[i], laws[j], coefficient)
        try:
            return Correlation(wanted, np.asarray(np.linalg.cholesky(behind), dtype=np.float64))
        except np.linalg.LinAlgError:
            raise StudyError(
                "reliability.correlation: these coefficients contradict each other (their matrix is not positive "
                "definite)"
            ) from None


class JointMoments:
    """Moments about the means of two laws, E[x^p y^q], of normal variables behind them of any correlation."""

    def __init__(self, one: Marginal, other: Marginal, powers: int = 1) -> None:
        self._one, self._other = _hermite(one, powers), _hermite(other, powers)
        # Where one follows the other, or goes against it.
        u, weight = _nodes(np.concatenate([one.kinks, other.kinks, -other.kinks]))
        x, y, against = one.at(u) - one.moments[0], other.at(u) - other.moments[0], other.at(-u) - other.moments[0]
        each = np.arange(1, powers + 1)[:, None]
        self._ends = {way: (x**each * weight) @ (there**each).T for way, there in ((1, y), (-1, against))}

    def at(self, rho: float, p: int = 1, q: int = 1) -> float:
        """E[x^p y^q]; what the series leaves out falls with k as that of laws with jumps, k^(-3/2)."""
        way = 1 if rho > 0 else -1
        terms = self._one[p - 1] * self._other[q - 1] * float(way) ** np.arange(_TERMS)
        # In all it is what lacks where one follows the other.
        rest = self._ends[way][p - 1, q - 1] - terms.sum()
        fall = -_TERMS * math.log(max(abs(rho), 1e-300))
        left = math.exp(-fall) - math.sqrt(math.pi * fall) * math.erfc(math.sqrt(fall))
        return float(terms @ abs(rho) ** np.arange(_TERMS) + rest * left)


def _nodes(kinks: Floats) -> tuple[Floats, Floats]:
    """Nodes of a standard normal variable, and their probabilities."""
    edges = np.union1d(_EDGES, np.clip(kinks, _EDGES[0], _EDGES[-1]))
    half = 0.5 * np.diff(edges)[:, None]
    u = (0.5 * (edges[1:] + edges[:-1])[:, None] + half * _NODES).ravel()
    return u, (half * _WEIGHTS).ravel() * np.exp(-0.5 * u * u) / np.sqrt(2.0 * np.pi)


def _hermite(law: Marginal, powers: int) -> Floats:
    """Coefficients of the powers of a law about its mean in Hermite polynomials, shape (powers, terms)."""
    u, weight = _nodes(law.kinks)
    values = weight * (law.at(u) - law.moments[0]) ** np.arange(1, powers + 1)[:, None]
    found = np.empty((powers, _TERMS))
    before, polynomial = np.zeros(len(u)), np.ones(len(u))
    for k in range(_TERMS):
        found[:, k] = (values * polynomial).sum(axis=1)
        before *= -np.sqrt(k)
        before += u * polynomial
        before /= np.sqrt(k + 1.0)
        before, polynomial = polynomial, before
    return found


def _behind(one: Marginal, other: Marginal, coefficient: float) -> float:
    """Correlation of the normal variables behind two laws."""
    from scipy.optimize import brentq

    size = float(np.sqrt(one.moments[1] * other.moments[1]))
    if size == 0 or (isinstance(one, Normal) and isinstance(other, Normal)):
        return coefficient
    moments, most = JointMoments(one, other), _MAX_CORRELATION
    low, high = (moments.at(way * most) / size for way in (-1, 1))
    if not low <= coefficient <= high:
        raise StudyError(
            f"reliability.correlation: two dimensions of these distributions cannot have {coefficient:g}, only "
            f"{low:.4g} to {high:.4g}"
        )
    return float(brentq(lambda rho: moments.at(rho) / size - coefficient, -most, most, xtol=1e-12))
