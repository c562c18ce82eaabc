"""Results over the plane of two entries: cases at its places made one number each, and interpolated between them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mechdesign.experiments.figures.sweep.quantities import MOST_DRAWN, CaseAxis
from mechdesign.ground.numerics.arrays import Flags, Floats, Ints, evenly
from mechdesign.ground.results import Table

# Points of a map along each axis.
_FINE = 141
# Scattered cases of three entries or more: classes of each entry such that a cell holds about this many cases.
_CELL, _FEWEST_CLASSES, _MOST_CLASSES = 12, 3, 13
_FLAT = 1e-6  # part of the range of entries below which cases lie on a line

# Reduces groups of values, each of which begins at one of the given indices, to one number a group.
Reduction = Callable[[Floats, Ints], Floats]


def _mean(values: Floats, starts: Ints) -> Floats:
    finite = np.isfinite(values)
    number = np.add.reduceat(finite.astype(float), starts)
    total = np.add.reduceat(np.where(finite, values, 0.0), starts)
    return np.asarray(np.where(number > 0, total / np.maximum(number, 1.0), np.nan))


# Reduction of several cases, and its name, by what is better: 0 not known, 1 small values, -1 large values.
REDUCTIONS: Mapping[int, tuple[Reduction, str]] = {
    0: (_mean, "mean"), 1: (np.fmin.reduceat, "smallest"), -1: (np.fmax.reduceat, "largest"),
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class CasePlane:
    """Two entries, and the cases at each place of their plane.

    Parameters
    ----------
    steps : pair of ndarray
        Values of both entries, or of their classes.
    cells : ndarray of int, shape (places,)
        Where cases are: numbers of the steps of both entries as one, the second fastest.
    place : ndarray of int, shape (cases,)
    grid : bool
        Whether places are the nodes of a grid, of which some may be missing; else they are scattered.
    classes : int
        In how many classes of each entry cases are gathered; 0 where they are not.
    """

    x: CaseAxis
    y: CaseAxis
    steps: tuple[Floats, Floats]
    cells: Ints
    place: Ints
    grid: bool = True
    classes: int = 0

    @classmethod
    def of(cls, x: CaseAxis, y: CaseAxis, *, others: bool) -> CasePlane | None:
        """The plane of two entries, beside which others vary or not; None where the cases lie on a line."""
        steps = (x.distinct, y.distinct)
        across, up = (np.searchsorted(step, axis.values) for step, axis in zip(steps, (x, y), strict=True))
        plane = cls(x, y, steps, *np.unique(across * len(steps[1]) + up, return_inverse=True))
        if len(steps[0]) * len(steps[1]) <= 2 * len(plane.cells):
            return plane
        if others:
            classes = int(np.clip((len(plane.place) / _CELL) ** 0.5, _FEWEST_CLASSES, _MOST_CLASSES))
            # The outermost classes are half as wide: their values stand at the ends.
            values = np.stack([x.values, y.values], axis=1)
            across, up = np.rint(plane._shares(values) * (classes - 1)).astype(np.intp).T
            ends = [np.linspace(step[0], step[-1], classes) for step in steps]
            cells, place = np.unique(across * classes + up, return_inverse=True)
            return cls(x, y, (ends[0], ends[1]), cells, place, classes=classes)
        share = plane._shares(plane.where)
        flat = np.linalg.matrix_rank(share - share.mean(axis=0), tol=_FLAT) < 2
        return None if flat else replace(plane, grid=False)

    @property
    def where(self) -> Floats:
        """The places, shape (places, 2)."""
        numbers = np.divmod(self.cells, len(self.steps[1]))
        return np.stack([step[k] for step, k in zip(self.steps, numbers, strict=True)], axis=1)

    def reduced(self, values: Floats, reduction: Reduction) -> Floats:
        """One number of those of the cases at each place, shape (places,); nan where there is none."""
        order, starts = self._order
        return np.asarray(reduction(values[order], starts))

    @cached_property
    def _order(self) -> tuple[Ints, Ints]:
        """Cases place by place, and where each place begins."""
        order = np.argsort(self.place, kind="stable")
        return order, np.searchsorted(self.place[order], np.arange(len(self.cells)))

    @cached_property
    def fine(self) -> tuple[Floats, Floats]:
        """Values of the entries at which maps are drawn."""
        x, y = (np.linspace(step[0], step[-1], _FINE) for step in self.steps)
        return x, y

    def over(self, values: Floats) -> Floats:
        """Values at the places, interpolated, shape (fine y, fine x); nan beside a place without one."""
        from scipy.interpolate import LinearNDInterpolator, RegularGridInterpolator

        x, y = np.meshgrid(*self.fine)
        if not self.grid:
            corners = evenly(len(self.cells), MOST_DRAWN)
            return np.asarray(LinearNDInterpolator(self.where[corners], values[corners], rescale=True)(x, y))
        table = np.full((len(self.steps[0]), len(self.steps[1])), np.nan)
        table.flat[self.cells] = values
        return np.asarray(RegularGridInterpolator(self.steps, table)((x, y)))

    def field(self, values: Floats, counted: Flags, reduction: Reduction) -> Floats:
        """A result over the plane, of the cases that count at each place; of all of them where these have no number."""
        some = self.reduced(np.where(counted, values, np.nan), reduction)
        return self.over(np.where(np.isfinite(some), some, self.reduced(values, reduction)))

    def _shares(self, points: Floats) -> Floats:
        """Points in parts of the range of each entry."""
        low = np.array([step[0] for step in self.steps])
        return np.asarray((points - low) / (np.array([step[-1] for step in self.steps]) - low))


@dataclass(frozen=True, eq=False)
class Gates:
    """What is required over a plane, as parts of the range of each result.

    Parameters
    ----------
    single : list of ndarray, shape (fine y, fine x)
        By how much the best case at a place keeps the limits of each result; negative where it does not.
    joint : ndarray, shape (fine y, fine x)
        The same of all limits at once; negative also where there is no number.
    nearest : ndarray of bool, shape (cases,)
        The case at each place that keeps all limits with the most to spare, or misses them by the least.
    """

    single: Sequence[Floats]
    joint: Floats
    nearest: Flags

    @classmethod
    def of(cls, plane: CasePlane, limited: Sequence[CaseAxis], table: Table) -> Gates:
        """What results with limits make of a plane."""
        every = [_margin(axis, table[f"{axis.name}_met"] == 1) for axis in limited]
        single = [plane.over(plane.reduced(margin, np.fmax.reduceat)) for margin in every]
        margin = np.min(every, axis=0)
        most = plane.reduced(margin, np.fmax.reduceat)
        # Between cases that are alone at their places each result is interpolated by itself.
        joint = np.min(single, axis=0) if len(plane.cells) == len(plane.place) else plane.over(most)
        inside = np.isfinite(plane.over(np.zeros(len(plane.cells))))
        return cls(single, np.where(inside & np.isnan(joint), -1.0, joint), margin == most[plane.place])

    @property
    def unmet(self) -> bool:
        """Whether what is required is not met somewhere."""
        return bool((self.joint < 0).any())

    def crossed(self, k: int) -> bool:
        """Whether a limit of a result runs through the plane."""
        return bool((self.single[k] < 0).any() and (self.single[k] > 0).any())


def _margin(limited: CaseAxis, met: Flags) -> Floats:
    """By how much each case keeps the limits of a result; nan where it does and the requirement is not met yet."""
    above = np.inf if limited.low is None else limited.values - limited.low
    below = np.inf if limited.high is None else limited.high - limited.values
    margin = np.minimum(above, below) / (np.ptp(limited.ends or 0.0) or 1.0)
    return np.asarray(np.where(met | (margin < 0), margin, np.nan))
