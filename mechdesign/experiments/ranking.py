"""Which cases are best: their order by the chosen results, and the Pareto front of these."""

from __future__ import annotations

import numpy as np

from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.ground.numerics.fronts import front

# Differences up to this part of the largest number count as none, the precision of tables.
_RESOLUTION = 1e-12


def ranked(values: Floats, admitted: Flags) -> tuple[Floats, Flags]:
    """The rank of each case, 1 the best and nan where it has none, and which cases are on the Pareto front.

    Admitted cases with a number for each goal are ranked by the sum over the goals of the distance from the best case,
    as a part of the goal's range over these cases: the order of an optimisation with equal weights [S1, eqs. 27, 28].
    Equally good cases share a rank, and the next ranks are left out. On the front no other ranked case is as good in
    every goal and better in one.

    Parameters
    ----------
    values : ndarray, shape (cases, goals)
        Less is better; nan where there is none.
    admitted : ndarray of bool, shape (cases,)
    """
    rows = np.flatnonzero(admitted & np.isfinite(values).all(axis=1))
    rank, on_front = np.full(len(admitted), np.nan), np.zeros(len(admitted), dtype=bool)
    if len(rows):
        steps = _steps(values[rows])
        spans = np.ptp(steps, axis=0)
        shortfall = ((steps - steps.min(axis=0)) / np.where(spans > 0, spans, 1.0)).sum(axis=1)
        rank[rows] = 1 + np.searchsorted(np.sort(shortfall), shortfall)
        on_front[rows] = front(steps)
    return rank, on_front


def _steps(values: Floats) -> Floats:
    """Values, shape (cases, goals), as whole numbers of the smallest differences that count."""
    size = np.abs(values).max(axis=0)
    return np.asarray(np.rint(values / (_RESOLUTION * np.where(size > 0, size, 1.0))))
