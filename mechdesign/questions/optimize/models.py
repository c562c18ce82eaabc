"""Quadratic models of the smooth terms of an objective and its conditions, from differences about a point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.questions.optimize.explorer import ASSEMBLY, Explorer, Part

# Step of differences in parts of the ranges; a longer one where values are known to a tolerance only.
STEP, ROUGH_STEP = 1e-4, 1e-2
# Most variables with which mixed second differences are evaluated.
MOST_CROSSED = 24
# Value of a row that is not known, far from any bound.
FAR = -1e9


class Terms:
    """The smooth terms of an objective and of its conditions, as columns of evaluated points.

    Attributes
    ----------
    edges : int
        Number of goals that are the worst of rows.
    owner : ndarray of int
        The goal among these to which each row belongs.
    squared : bool
        Whether the objective is a root mean square, whose square is minimised.
    """

    def __init__(self, explorer: Explorer, objective: Floats) -> None:
        self._explorer, self._objective = explorer, objective
        goals = len(objective)
        squares: list[Part] = []
        self._edged: list[Part] = []
        self._held: list[Part] = []
        for part in explorer.parts:
            if part.column == ASSEMBLY or part.column >= goals:
                self._held.append(part)
            elif part.squares:
                squares += [part] if objective[part.column] > 0 else []
            elif objective[part.column] * part.sign > 0:
                self._edged.append(part)
        # The only goal is a root mean square: its square is minimised.
        self._residuals = squares[0] if len(squares) == np.count_nonzero(objective) == 1 else None
        self._smooth = objective.copy()
        self._smooth[[part.column for part in self._edged]] = 0.0

    @property
    def edges(self) -> int:
        return len(self._edged)

    @property
    def squared(self) -> bool:
        return self._residuals is not None

    def __call__(self, rows: Ints) -> tuple[Floats, Floats, Floats]:
        """Columns of points, shape (lanes, points, columns); nan where a value is not known.

        They are the smooth sum, or its residuals; the rows of the goals that are worst of rows; and the functions of
        the conditions, which must not be positive.
        """
        points, flat = self._explorer.points, rows.ravel()
        lines, values, margins = points.rows[flat], points.values[flat], points.margins[flat]

        def shaped(columns: Sequence[Floats]) -> Floats:
            return np.concatenate([np.empty((len(flat), 0)), *columns], axis=1).reshape(*rows.shape, -1)

        if self._residuals is not None:
            plain = shaped([lines[:, self._residuals.place]])
        else:
            smooth = self._smooth != 0
            plain = shaped([(values[:, smooth] @ self._smooth[smooth])[:, None]])
        pieces = []
        for part in self._edged:
            factor = self._objective[part.column]
            pieces.append(self._or_worst(part.pieces(lines) * abs(factor), values[:, part.column] * factor, rows))
        self.owner = np.repeat(np.arange(len(pieces)), [own.shape[1] for own in pieces])
        limits, with_rows = [], set()
        for part in self._held:
            own, goal = part.pieces(lines), part.column - len(self._objective)
            with_rows.add(goal)
            limits.append(own if part.column == ASSEMBLY else self._or_worst(own, -margins[:, goal], rows))
        limits += [-margins[:, [k]] for k in range(margins.shape[1]) if k not in with_rows]
        return plain, shaped(pieces), shaped(limits)

    @staticmethod
    def _or_worst(pieces: Floats, worst: Floats, rows: Ints) -> Floats:
        """Pieces, and their worst where the pieces are not known."""
        complete = np.isfinite(pieces.reshape(*rows.shape, -1)[:, 0]).all(axis=1)
        return np.column_stack([pieces, np.where(np.repeat(complete, rows.shape[1]), np.nan, worst)])


class Stencil:
    """Points evaluated about the point of each lane, from which differences are taken; their `rows` (lanes, points)."""

    def __init__(self, explorer: Explorer, rows: Sequence[int]) -> None:
        n = explorer.dimensions
        self.step = ROUGH_STEP if explorer.rough else STEP
        self.pairs = np.array([*combinations(range(n), 2)] if n <= MOST_CROSSED else [], dtype=int).reshape(-1, 2)
        one = np.eye(n)
        offsets = np.concatenate([np.zeros((1, n)), one, -one, one[self.pairs[:, 0]] + one[self.pairs[:, 1]]])
        self.at = explorer.points.u[list(rows)]
        self.centre = np.clip(self.at, self.step, 1 - self.step)
        points = self.centre[:, None] + self.step * offsets
        self.rows = explorer(points.reshape(-1, n)).reshape(points.shape[:2])

    def models(self, values: Floats) -> Models:
        """Quadratic models about the centres from values, shape (lanes, points, columns).

        Where one side has no value the slope is that of the other.
        """
        n, h = self.centre.shape[1], self.step
        middle, up, down = values[:, 0], values[:, 1 : n + 1], values[:, n + 1 : 2 * n + 1]
        right, left = (up - middle[:, None]) / h, (middle[:, None] - down) / h
        slope = np.where(np.isnan(left), right, np.where(np.isnan(right), left, (right + left) / 2))
        bend = np.zeros((*values.shape[::2], n, n))
        bend[:, :, range(n), range(n)] = np.moveaxis((right - left) / h, 1, 2)
        for k, (i, j) in enumerate(self.pairs.tolist()):
            mixed = (values[:, 2 * n + 1 + k] - up[:, i] - up[:, j] + middle) / h**2
            bend[:, :, i, j] = bend[:, :, j, i] = mixed
        return Models(middle, np.nan_to_num(np.moveaxis(slope, 1, 2)), np.nan_to_num(bend))


@dataclass(frozen=True)
class Models:
    """Values, shape (lanes, columns), slopes and curvatures of quadratic functions."""

    value: Floats
    slope: Floats
    bend: Floats

    def at(self, x: Floats) -> tuple[Floats, Floats]:
        """Values and slopes at a point of each lane, shape (lanes, n)."""
        turned = (self.bend @ x[:, None, :, None])[..., 0]
        linear = ((self.slope + turned / 2) @ x[:, :, None])[..., 0]
        return self.value + linear, self.slope + turned

    def summed(self, weights: Floats) -> Floats:
        """Sums of the curvatures times weights, shape (lanes, columns)."""
        lanes, columns, n, _ = self.bend.shape
        return np.asarray((weights[:, None] @ self.bend.reshape(lanes, columns, n * n)).reshape(lanes, n, n))

    def take(self, lanes: Ints) -> Models:
        return Models(self.value[lanes], self.slope[lanes], self.bend[lanes])

    def highest(self, widths: Floats, most: int) -> Ints:
        """At most `most` columns of each lane that may be the highest in a box of this half width."""
        lanes, count = self.value.shape
        if count <= most:
            return np.broadcast_to(np.arange(count), (lanes, count))
        width = widths[:, None]
        rise = width * np.abs(self.slope).sum(axis=2) + width**2 / 2 * np.abs(self.bend).sum(axis=(2, 3))
        # Half of them are the highest ones at the centre.
        first = np.argpartition(-self.value, most // 2, axis=1)[:, : most // 2]
        value = self.value + rise
        np.put_along_axis(value, first, np.inf, 1)
        return np.asarray(np.argpartition(-value, most - 1, axis=1)[:, :most])

    def columns(self, chosen: Ints) -> Models:
        """Chosen columns of each lane, shape (lanes, columns)."""
        lane = np.arange(len(chosen))[:, None]
        return Models(self.value[lane, chosen], self.slope[lane, chosen], self.bend[lane, chosen])

    def scaled(self, by: Floats) -> Models:
        """The models over a number for each value."""
        return Models(self.value / by, self.slope / by[..., None], self.bend / by[..., None, None])


def square(residuals: Models, x: Floats) -> tuple[Floats, Floats, Floats]:
    """The sum of squares at a point of each lane, its slope and its curvature."""
    value, slope = residuals.at(x)
    value = np.nan_to_num(value)
    bend = 2 * (np.swapaxes(slope, 1, 2) @ slope + residuals.summed(value))
    return (value**2).sum(axis=1), 2 * (value[:, None] @ slope)[:, 0], bend


def without_lost(models: Models) -> Models:
    """Models in which columns without a value are far from any bound."""
    lost = np.isnan(models.value)
    return Models(
        np.where(lost, FAR, models.value), np.where(lost[..., None], 0.0, models.slope),
        np.where(lost[..., None, None], 0.0, models.bend),
    )  # fmt: skip
