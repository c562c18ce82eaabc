"""Which cases are best: their order by the chosen results, and the Pareto front of these."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from mechdesign.columns import Column
from mechdesign.experiments.case_numbers import CaseNumber
from mechdesign.experiments.columns import SWEEP
from mechdesign.experiments.schema.matrix import Best
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.numerics.fronts import front
from mechdesign.report.cases import FRONT, RANK

# Differences up to this part of the largest number count as none, the precision of tables.
_RESOLUTION = 1e-12


def goals_of(best: Best | None) -> dict[CaseNumber, int]:
    """The goals, with the sign -1 where they are maximised and 1 where they are minimised."""
    chosen = [] if best is None else [("maximize", -1, best.maximize), ("minimize", 1, best.minimize)]
    return {
        CaseNumber(result.result, tuple(result.where.items()), ("matrix", "best", key, k), whole=True): sign
        for key, sign, results in chosen
        for k, result in enumerate(results)
    }


@dataclass(frozen=True, eq=False)
class Ranking:
    """The order of cases; arrays are of shape (cases,).

    Parameters
    ----------
    rank : ndarray of float
        1 is the best. Equally good cases share a rank, and the next ranks are left out. nan of cases without a rank.
    front : ndarray of bool
        The Pareto front: cases for which no ranked one is as good in every goal and better in one.
    """

    rank: Floats
    front: Flags

    @classmethod
    def of(cls, goals: Mapping[str, int], columns: Mapping[str, Floats], admitted: Flags) -> Ranking:
        """Rank the admitted cases that have a number for each goal.

        Cases are ranked by the sum over the goals of the distance from the best case, as a part of the goal's range
        over these cases: the order of an optimisation with equal weights [S1, eqs. 27, 28].

        Parameters
        ----------
        goals : dict of str to int
            1 for a minimised result, -1 for a maximised one.
        columns : dict of str to ndarray
            Values of each case; nan where there is none.
        admitted : ndarray of bool
        """
        values = np.stack([columns[name] for name in goals], axis=1)
        rows = np.flatnonzero(admitted & np.isfinite(values).all(axis=1))
        rank, on_front = np.full(len(admitted), np.nan), np.zeros(len(admitted), dtype=bool)
        if len(rows):
            steps = _steps(values[rows] * [*goals.values()])
            spans = np.ptp(steps, axis=0)
            shortfall = ((steps - steps.min(axis=0)) / np.where(spans > 0, spans, 1.0)).sum(axis=1)
            rank[rows] = 1 + np.searchsorted(np.sort(shortfall), shortfall)
            on_front[rows] = front(steps)
        return cls(rank, on_front)

    def columns(self) -> Iterator[Column]:
        """The rank of each case, and whether it is on the front."""
        yield from SWEEP.columns({}, **{RANK: self.rank, FRONT: self.front})


def _steps(values: Floats) -> Floats:
    """Values, shape (cases, goals), as whole numbers of the smallest differences that count."""
    size = np.abs(values).max(axis=0)
    return np.asarray(np.rint(values / (_RESOLUTION * np.where(size > 0, size, 1.0))))
