"""Quadratic models of goals and conditions near a point, and the step to where the models are best.

The worst of several rows has edges where another row becomes the worst, and along the floor of the valleys between
them no model of it is worth much. Its rows are smooth: each has a model of its own, and the worst of them is made small
by its epigraph, ``min t`` where no row exceeds ``t``. [Nocedal & Wright, Numerical Optimization, 2006, ch. 18.]
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.optimize.explorer import Explorer, Objective
from mechdesign.analyses.workspace.rays import Floats

Integers = NDArray[np.intp]

ROUNDING = 1e-9
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, eq=False)
class Quadratics:
    """``constant + slope z + z curvature z / 2`` of several columns.

    Parameters
    ----------
    constant : ndarray, shape (columns,)
    slope : ndarray, shape (columns, n)
    curvature : ndarray, shape (columns, n, n)
    """

    constant: Floats
    slope: Floats
    curvature: Floats

    @classmethod
    def fit(cls, z: Floats, values: Floats) -> Quadratics:
        """Nearest to values, shape (points, columns), at points (of least coefficients, where they leave a choice)."""
        n = z.shape[1]
        first, second = np.tril_indices(n)
        mixed = z[:, first] * z[:, second] * np.where(first == second, 0.5, 1.0)
        terms = np.column_stack([np.ones(len(z)), z, mixed])
        weight = 1 / (1 + (z**2).sum(axis=1, keepdims=True))
        found = np.linalg.lstsq(terms * weight, values * weight, rcond=None)[0].T
        curvature = np.zeros((len(found), n, n))
        curvature[:, first, second] = curvature[:, second, first] = found[:, n + 1 :]
        return cls(found[:, 0], found[:, 1 : n + 1], curvature)

    @property
    def reach(self) -> Floats:
        """The most by which each column differs from its constant for ``|z| <= 1``."""
        return np.asarray(np.abs(self.slope).sum(axis=1) + 0.5 * np.abs(self.curvature).sum(axis=(1, 2)))

    @property
    def size(self) -> Floats:
        """The largest coefficient of each column, its constant aside."""
        return np.asarray(np.maximum(np.abs(self.slope).max(axis=1), np.abs(self.curvature).max(axis=(1, 2))))

    def scaled(self, columns: NDArray[np.bool_], scale: Floats | float) -> Quadratics:
        """Some columns, each divided by a scale."""
        scale = np.broadcast_to(scale, self.constant.shape)[columns]
        return Quadratics(
            self.constant[columns] / scale,
            self.slope[columns] / scale[:, None],
            self.curvature[columns] / scale[:, None, None],
        )

    def value(self, z: Floats) -> Floats:
        return np.asarray(self.constant + self.slope @ z + 0.5 * (self.curvature @ z) @ z)

    def gradient(self, z: Floats) -> Floats:
        return np.asarray(self.slope + self.curvature @ z)


@dataclass(frozen=True, eq=False)
class Program:
    """What a step is chosen by: ``min smooth + sum of t`` where no piece exceeds its ``t`` nor a condition zero.

    Parameters
    ----------
    owners : ndarray of int, shape (pieces,)
        Which of the ``t`` bounds each piece.
    """

    smooth: Quadratics
    pieces: Quadratics
    owners: Integers
    conditions: Quadratics

    @classmethod
    def near(cls, explorer: Explorer, objective: Objective, rows: Integers, z: Floats) -> Program:
        """Fitted to points that are known."""
        known, at = explorer.known, rows
        goals = known.values.shape[1]
        smooth, conditions = objective.factors.copy(), np.ones(known.margins.shape[1], dtype=bool)
        blocks, owners, held = [np.empty((len(at), 0))], [np.empty(0, dtype=np.intp)], [np.empty((len(at), 0))]
        for part in explorer.parts:
            found = part.pieces(known.rows[at])
            if np.isnan(found).any():
                continue
            if part.column >= goals:
                held.append(found)
                conditions[part.column - goals] = False
            elif objective.factors[part.column] * part.sign > 0:
                blocks.append(found * abs(objective.factors[part.column]))
                owners.append(np.full(found.shape[1], len(owners) - 1))
                smooth[part.column] = 0.0
        plain = Quadratics.fit(z, (known.values[at] @ smooth)[:, None])
        pieces = Quadratics.fit(z, np.concatenate(blocks, axis=1))
        limits = Quadratics.fit(z, np.concatenate([-known.margins[at][:, conditions], *held], axis=1))
        # Brought to order one, for whoever minimises it to a tolerance.
        scale = max(float(plain.size.max()), float(pieces.size.max(initial=0.0)), TINY)
        owner = np.concatenate(owners)
        floor = pieces.constant - pieces.reach
        lowest = np.array([floor[owner == k].max() for k in range(len(owners) - 1)])
        # Rows that stay below the worst one wherever a step may lead say nothing.
        counts = pieces.constant + pieces.reach >= lowest[owner] if len(owner) else np.zeros(0, dtype=bool)
        binds = limits.constant + limits.reach >= 0
        return cls(
            plain.scaled(np.ones(1, dtype=bool), scale),
            pieces.scaled(counts, scale),
            owner[counts],
            limits.scaled(binds, np.maximum(limits.size, TINY)),
        )

    @property
    def descent(self) -> Floats:
        """The smooth part's slope; with rows, what brings the nearest to their mean, in the sense of least squares."""
        if not len(self.owners):
            return np.asarray(self.smooth.slope[0])
        counts = np.bincount(self.owners)
        mean = (np.bincount(self.owners, self.pieces.constant) / counts)[self.owners]
        return np.asarray(np.linalg.lstsq(self.pieces.slope, self.pieces.constant - mean, rcond=None)[0])

    def best(self, begin: Floats, low: Floats, high: Floats, slack: float) -> Floats:
        """Where it is best from a point on; conditions are kept by a slack."""
        from scipy.optimize import minimize as scipy_minimize

        # Its stubs know no bounds of other than plain numbers.
        minimize: Any = scipy_minimize

        n, more = len(begin), int(self.owners.max(initial=-1)) + 1
        bounded = np.eye(more)[self.owners]
        unbounded = np.zeros((len(self.conditions.constant), more))

        def cost(y: Floats) -> tuple[float, Floats]:
            gradient = np.concatenate([self.smooth.gradient(y[:n])[0], np.ones(more)])
            return float(self.smooth.value(y[:n])[0] + y[n:].sum()), gradient

        def room(y: Floats) -> Floats:
            below = bounded @ y[n:] - self.pieces.value(y[:n])
            return np.concatenate([below, -self.conditions.value(y[:n]) - slack])

        def slopes(y: Floats) -> Floats:
            return np.block(
                [[-self.pieces.gradient(y[:n]), bounded], [-self.conditions.gradient(y[:n]), unbounded]]
            )  # fmt: skip

        at = self.pieces.value(begin)
        tops = np.array([at[self.owners == k].max() for k in range(more)])
        box = [*zip(low, high, strict=True), *[(None, None)] * more]
        constraint = {"type": "ineq", "fun": room, "jac": slopes}
        answer = minimize(
            cost, np.concatenate([begin, tops]), jac=True, method="SLSQP", bounds=box,
            constraints=[constraint] if len(self.owners) + len(unbounded) else (),
            options={"maxiter": 60, "ftol": 1e-12},
        )  # fmt: skip
        return np.asarray(np.clip(answer.x[:n], low, high))
