"""Correlated dimensions: normal variables behind them whose mixing gives the asked coefficients.

[Der Kiureghian & Liu, Structural reliability under incomplete probability information, 1986.]
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.reliability.marginals import Marginal, Normal
from mechdesign.errors import StudyError
from mechdesign.numerics.arrays import Floats

_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(48)
_WEIGHTS = _WEIGHTS / _WEIGHTS.sum()
# Farther than this from what was asked the normal variables cannot be brought.
_MOST = 0.999999


@dataclass(frozen=True, eq=False)
class Correlation:
    """Correlation of scalar sources.

    Parameters
    ----------
    coefficients : ndarray, shape (scalars, scalars)
        Of the deviations, as the study gives them.
    root : ndarray, shape (scalars, scalars)
        Lower triangular; mixes independent normal variables.
    """

    coefficients: Floats
    root: Floats

    @staticmethod
    def of(laws: Sequence[Marginal], pairs: Mapping[tuple[int, int], float]) -> Correlation:
        """Correlation where these pairs of laws have these coefficients, and all others none.

        Raises
        ------
        StudyError
            If no random variables of these laws have these coefficients.
        """
        wanted, behind = np.eye(len(laws)), np.eye(len(laws))
        for (i, j), coefficient in pairs.items():
            wanted[i, j] = wanted[j, i] = coefficient
            behind[i, j] = behind[j, i] = _behind(laws[i], laws[j], coefficient)
        try:
            root: Floats = np.asarray(np.linalg.cholesky(behind), dtype=np.float64)
        except np.linalg.LinAlgError:
            raise StudyError(
                "reliability.correlation: these coefficients contradict each other (their matrix is not positive "
                "definite)"
            ) from None
        return Correlation(wanted, root)

    def mix(self, u: Floats) -> Floats:
        """Correlated standard normal variables from independent ones, shape (scalars, count)."""
        return np.asarray(self.root @ u)


def pair_nodes(rho: float) -> tuple[Floats, Floats, Floats]:
    """Nodes of two standard normal variables of this correlation, and their weights, each of shape (nodes, nodes)."""
    first = np.broadcast_to(_NODES[:, None], (len(_NODES), len(_NODES)))
    second = rho * first + np.sqrt(1 - rho * rho) * _NODES
    return first, second, np.outer(_WEIGHTS, _WEIGHTS)


def _behind(one: Marginal, other: Marginal, coefficient: float) -> float:
    """Correlation of the normal variables behind two laws."""
    from scipy.optimize import brentq

    (m, v, *_), (n, w, *_) = one.moments, other.moments
    if v == 0 or w == 0 or (isinstance(one, Normal) and isinstance(other, Normal)):
        return coefficient
    x = (one.at(_NODES) - m) / np.sqrt(v)

    def excess(rho: float) -> float:
        y = (other.at(rho * _NODES[:, None] + np.sqrt(1 - rho * rho) * _NODES) - n) / np.sqrt(w)
        return float((_WEIGHTS * x) @ y @ _WEIGHTS) - coefficient

    if excess(-_MOST) > 0 or excess(_MOST) < 0:
        raise StudyError(f"reliability.correlation: two dimensions of these distributions cannot have {coefficient:g}")
    return float(brentq(excess, -_MOST, _MOST, xtol=1e-12))
