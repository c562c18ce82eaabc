"""The one judge: the worst value of a result by its bounds, the margin from them, and where the worst value is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.ground.numerics.rounding import cleared
from mechdesign.ground.rows import ChosenRows
from mechdesign.ground.terms import Sum

Bound = Floats | float | None
Bounds = tuple[Bound, Bound]
"""Lowest and highest value, of all designs or of each, in the unit of what is judged."""


@dataclass(frozen=True, eq=False)
class Judgement:
    """How designs are by the worst value of a result; arrays of shape (designs,).

    Parameters
    ----------
    values, margins : ndarray
        The worst value and how far it is from the nearer bound, negative beyond it; nan where a row that counts or a
        part of the motion has no value, or none counts.
    row : ndarray of int
        The worst row, or the first that has no value; -1 where it is no row.
    at : ndarray
        Place of the motion between the rows, in rows, where that is worse; nan at a row.
    strand : ndarray of int
        Which of the columns that are followed is worse there.
    between : tuple of ndarray
        The worst value between the rows of each column that is followed.
    """

    values: Floats
    margins: Floats
    row: Ints
    at: Floats
    strand: Ints
    between: tuple[Floats, ...] = ()

    @classmethod
    def of(
        cls, values: Floats, bounds: Bounds, row: Ints | int = -1, at: Floats | float = np.nan, strand: int = -1
    ) -> Judgement:
        """Values by their nearer bounds."""
        shape = np.shape(values)
        margins = np.min([sign * (bound - values) for sign, bound in _sides(bounds)], axis=0)
        return cls(values, margins, np.broadcast_to(row, shape), np.broadcast_to(at, shape), np.full(shape, strand))

    @property
    def met(self) -> Flags:
        """Which keep their bounds; nan never does."""
        return self.margins >= 0

    def where(self, other: Judgement, take: Flags) -> Judgement:
        """Another judgement of the designs in a mask."""
        fields = ("values", "margins", "row", "at", "strand")
        return replace(self, **{name: np.where(take, getattr(other, name), getattr(self, name)) for name in fields})

    def worse(self, other: Judgement) -> Judgement:
        """The other judgement of designs that miss by more there, or have no row here."""
        none = (self.row < 0) & np.isnan(self.values)
        return self.where(other, (other.margins < self.margins) | none)


def judge(
    terms: ChosenRows | Sum, bounds: Bounds, designs: int = 1, *, absolute: bool = False, assembled: bool = False,
    number: bool = False,
) -> Judgement:  # fmt: skip
    """Judge a result of designs by the worst of its rows and of the motion between them.

    Parameters
    ----------
    terms : ChosenRows or Sum
        Of all designs, each with as many rows.
    absolute : bool
        Whether absolute values are judged.
    assembled : bool
        Whether rows that are not valid are left out.
    number : bool
        Whether the one number of each design counts, its statistic, as always of a sum.
    """
    if number or isinstance(terms, Sum):
        values = terms.numbers(designs, assembled=assembled)
        return Judgement.of(np.abs(values) if absolute else values, bounds)
    rows = by_rows(terms, bounds, designs, absolute=absolute, assembled=assembled)
    return along(rows, terms, bounds, absolute=absolute)


def by_rows(
    chosen: ChosenRows, bounds: Bounds, designs: int = 1, *, absolute: bool = False, assembled: bool = False
) -> Judgement:
    """Judge by the rows alone."""
    values, counts = chosen.shaped(designs, assembled=assembled)
    values, some = np.abs(values) if absolute else values, counts.any(axis=1)
    judged: Judgement | None = None
    for sign, bound in _sides(bounds):
        # Of several largest values, and of several without one, the first.
        own = Judgement.of(np.full(designs, np.nan), _one_side(sign, bound))
        if values.size:
            row = np.where(counts, sign * values, -np.inf).argmax(axis=1)
            worst = np.where(some, values[np.arange(designs), row], np.nan)
            own = Judgement.of(worst, _one_side(sign, bound), np.where(some, row, -1))
        judged = own if judged is None else judged.worse(own)
    assert judged is not None
    return judged


def along(judged: Judgement, chosen: ChosenRows, bounds: Bounds, *, absolute: bool = False) -> Judgement:
    """Judge by the motion between the rows as well, where it is followed."""
    if not chosen.courses:
        return judged
    lost = (judged.row >= 0) & np.isnan(judged.values)
    between, gone, rounding = [], np.zeros(len(lost), dtype=bool), np.zeros(len(lost))
    constant, least = np.ones(len(lost), dtype=bool), np.full(len(lost), np.inf)
    nearest = np.full(len(lost), -1)
    for strand, course in enumerate(chosen.courses.values()):
        for sign, bound in _sides(bounds):
            value, at = course.worst(int(sign), absolute=absolute)
            value = np.abs(value) if absolute else value
            own = Judgement.of(value, _one_side(sign, bound), -1, at, strand)
            judged = judged.where(judged.worse(own), ~lost)
            between.append(value)
            constant &= np.isfinite(value) & np.isnan(at)
            nearest, least = np.where(own.margins < least, strand, nearest), np.fmin(own.margins, least)
        gone |= course.lost > 0
        rounding = np.maximum(rounding, course.rounding)
    still = Judgement.of(cleared(judged.values, rounding), bounds, judged.row, judged.at)
    judged = judged.where(replace(still, strand=judged.strand), (np.abs(judged.values) <= rounding) & ~lost)
    # A motion without places of its extremes is the same everywhere: it has no worst row.
    judged = judged.where(replace(judged, row=np.full(len(lost), -1), strand=nearest), constant & ~lost)
    judged = judged.where(Judgement.of(np.full(len(lost), np.nan), bounds), gone & ~lost)
    return replace(judged, between=(*between,))


def _sides(bounds: Bounds) -> Iterator[tuple[float, Any]]:
    """The bounds that there are, each with the sign of values beyond it."""
    return ((sign, bound) for sign, bound in zip((-1.0, 1.0), bounds, strict=True) if bound is not None)


def _one_side(sign: float, bound: Any) -> Bounds:
    return (None, bound) if sign > 0 else (bound, None)
