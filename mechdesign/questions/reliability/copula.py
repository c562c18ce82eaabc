"""Correlated deviations: the correlation of the normal variables behind their laws.

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
import scipy

from mechdesign.ground.errors import StudyError
from mechdesign.ground.expressions import Number
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.questions.reliability.laws import Marginal, Normal, at_rows

# Edges of the quadrature panels over a standard normal variable; the kinks of its law are added. Three nodes a panel.
_EDGES = np.linspace(-9.0, 9.0, 241)
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)
# Terms of the Hermite series: 0.97 to the power of 600 is 1e-8.
_TERMS = 600
# Largest magnitude of the correlation of the normal variables behind two laws.
_MAX_CORRELATION = 0.999999


@dataclass(frozen=True, eq=False)
class Correlation:
    """Correlation matrix of the deviations, and the Cholesky factor `root` of that of the normal variables behind them.

    Both of shape (laws, laws), or (poses, laws, laws) where designs differ in them. ``root @ u`` makes correlated
    normal variables from independent ones.
    """

    coefficients: Floats
    root: Floats

    def take(self, rows: Sequence[int] | Ints) -> Correlation:
        """The correlation at these poses."""
        return self if self.root.ndim == 2 else Correlation(self.coefficients[rows], self.root[rows])

    @staticmethod
    def of(laws: Sequence[Marginal], pairs: Mapping[tuple[int, int], Number]) -> Correlation:
        """Correlation from coefficients of pairs of laws; a StudyError where such laws cannot have them."""
        bent = [laws[k] for i, j in pairs if not (isinstance(laws[i], Normal) and isinstance(laws[j], Normal))
                for k in (i, j)]  # fmt: skip
        numbers = np.broadcast_arrays(*pairs.values(), *(number for law in bent for number in law.numbers))
        if not numbers[0].ndim:
            return Correlation._of(laws, {pair: float(coefficient) for pair, coefficient in pairs.items()})
        # All poses of a design, and often all designs, share the numbers: each distinct set is computed once.
        _, first, inverse = np.unique(np.stack(numbers), axis=1, return_index=True, return_inverse=True)
        distinct = [Correlation._of([law.take(row) for law in laws],
                                    {pair: float(at_rows(value, row)) for pair, value in pairs.items()})
                    for row in first]  # fmt: skip
        rows = inverse.ravel()
        return Correlation(
            np.stack([part.coefficients for part in distinct])[rows], np.stack([part.root for part in distinct])[rows]
        )

    @staticmethod
    def _of(laws: Sequence[Marginal], pairs: Mapping[tuple[int, int], float]) -> Correlation:
        matrix, behind = np.eye(len(laws)), np.eye(len(laws))
        for (i, j), coefficient in pairs.items():
            matrix[i, j] = matrix[j, i] = coefficient
            behind[i, j] = behind[j, i] = _behind(laws[i], laws[j], coefficient)
        try:
            return Correlation(matrix, np.asarray(np.linalg.cholesky(behind), dtype=np.float64))
        except np.linalg.LinAlgError:
            raise StudyError(
                "reliability.correlation: these coefficients contradict each other (their matrix is not positive "
                "definite)"
            ) from None


class JointMoments:
    """Joint central moments E[x^p y^q] of two laws, for any correlation of the normal variables behind them."""

    def __init__(self, one: Marginal, other: Marginal, powers: int = 1) -> None:
        self._one, self._other = _hermite(one, powers), _hermite(other, powers)
        # Moments at the correlations 1 and -1.
        u, weight = _nodes(np.concatenate([one.kinks, other.kinks, -other.kinks]))
        x, y, against = one.at(u) - one.moments[0], other.at(u) - other.moments[0], other.at(-u) - other.moments[0]
        power = np.arange(1, powers + 1)[:, None]
        self._ends = {sign: (x**power * weight) @ (value**power).T for sign, value in ((1, y), (-1, against))}

    def at(self, rho: float, p: int = 1, q: int = 1) -> float:
        """E[x^p y^q]; the terms left out of the series are taken to fall as k^(-3/2), as for laws with jumps."""
        sign = 1 if rho > 0 else -1
        terms = self._one[p - 1] * self._other[q - 1] * float(sign) ** np.arange(_TERMS)
        # Sum of all terms left out, from the moment at the correlation of 1 or -1.
        rest = self._ends[sign][p - 1, q - 1] - terms.sum()
        fall = -_TERMS * math.log(max(abs(rho), 1e-300))
        left = math.exp(-fall) - math.sqrt(math.pi * fall) * math.erfc(math.sqrt(fall))
        return float(terms @ abs(rho) ** np.arange(_TERMS) + rest * left)


def _nodes(kinks: Floats) -> tuple[Floats, Floats]:
    """Quadrature nodes of a standard normal variable, and their probabilities."""
    edges = np.union1d(_EDGES, np.clip(kinks, _EDGES[0], _EDGES[-1]))
    half = 0.5 * np.diff(edges)[:, None]
    u = (0.5 * (edges[1:] + edges[:-1])[:, None] + half * _NODES).ravel()
    return u, (half * _WEIGHTS).ravel() * np.exp(-0.5 * u * u) / np.sqrt(2.0 * np.pi)


def _hermite(law: Marginal, powers: int) -> Floats:
    """Hermite coefficients of the powers of a law's distance from its mean, shape (powers, terms)."""
    u, weight = _nodes(law.kinks)
    values = weight * (law.at(u) - law.moments[0]) ** np.arange(1, powers + 1)[:, None]
    coefficients = np.empty((powers, _TERMS))
    before, polynomial = np.zeros(len(u)), np.ones(len(u))
    for k in range(_TERMS):
        coefficients[:, k] = (values * polynomial).sum(axis=1)
        before *= -np.sqrt(k)
        before += u * polynomial
        before /= np.sqrt(k + 1.0)
        before, polynomial = polynomial, before
    return coefficients


def _behind(one: Marginal, other: Marginal, coefficient: float) -> float:
    """Correlation of the normal variables behind two laws whose deviations have this coefficient."""
    size = float(np.sqrt(one.moments[1] * other.moments[1]))
    if size == 0 or (isinstance(one, Normal) and isinstance(other, Normal)):
        return coefficient
    moments, most = JointMoments(one, other), _MAX_CORRELATION
    low, high = (moments.at(sign * most) / size for sign in (-1, 1))
    if not low <= coefficient <= high:
        raise StudyError(
            f"reliability.correlation: two dimensions of these distributions cannot have {coefficient:g}, only "
            f"{low:.4g} to {high:.4g}"
        )
    return float(scipy.optimize.brentq(lambda rho: moments.at(rho) / size - coefficient, -most, most, xtol=1e-12))
