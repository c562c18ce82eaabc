"""What keeps linkages of a family within a section's limits while they are polished."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TypeVar

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats
from mechdesign.questions.synthesize.judging import sines
from mechdesign.questions.synthesize.kinds import Kind
from mechdesign.questions.synthesize.own import OwnKind
from mechdesign.questions.synthesize.schema import SynthesisSection
from mechdesign.questions.synthesize.sites import Site

Slopes = TypeVar("Slopes", Floats, Complexes)
# Poses of a turn at which transmission angles are looked at in a polish, of so many linkages at once.
_AROUND, _AT_ONCE = 32, 1000
# By this part their sines are kept larger than what is asked, as they are not followed between these poses.
_SURE = 1e-3


class Bounds(ABC):
    """Keeps linkages of a family within limits, as far as each value by itself can.

    Parameters
    ----------
    turning : bool
        Whether drives must turn fully.
    least : float
        Sine of the transmission angle that they keep then.
    in_place : bool
        Whether samples are put where they must be, so that only their forms are free.
    """

    def __init__(self, kind: Kind, *, turning: bool, least: float, in_place: bool) -> None:
        self.kind, self.turning, self.least, self.in_place = kind, turning, least, in_place

    def placed(self, values: Floats) -> Floats:
        """Samples where they must be, if `in_place`."""
        return values

    @abstractmethod
    def __call__(self, values: Floats) -> Floats:
        """The nearest values within the limits of each."""

    @property
    def freedom(self) -> int:
        """How many values are left to choose."""
        return len(self.kind.places)

    def left(self, values: Floats, slopes: Slopes) -> Slopes:
        """Derivatives by values, shape (places, count, ...), without those by what is held."""
        return slopes

    def accepts(self, modes: tuple[int, ...], values: Floats) -> Flags:
        """Which linkages have the transmission angle that is asked for over a turn of the crank."""
        if not self.least:
            return np.ones(len(values), dtype=bool)
        good = np.zeros(len(values), dtype=bool)
        turn = 2 * np.pi * np.arange(_AROUND)[None] / _AROUND
        for first in range(0, len(values), _AT_ONCE):
            some = slice(first, first + _AT_ONCE)
            around = sines(self.kind, self.kind.solve(values[some], turn, modes))
            # The least is that of a parabola through the lowest pose and those beside it.
            low, lane = around.argmin(axis=1), np.arange(len(around))
            before, least, after = (around[lane, (low + k) % _AROUND] for k in (-1, 0, 1))
            bend = np.maximum(before - 2 * least + after, np.finfo(float).tiny)
            good[some] = least - (before - after) ** 2 / (8 * bend) >= self.least * (1 + _SURE)
        return good


class KindBounds(Bounds):
    """Those of a declared kind by the section's limits: pivots in their site, lengths in their ranges."""

    def __init__(self, kind: Kind, section: SynthesisSection, site: Site, factor: float) -> None:
        held = len(site.given) >= len(kind.pivots)
        super().__init__(kind, turning=section.needs_turn, least=section.least_sine(factor), in_place=held)
        self.section, self.site = section, site
        self.links = [k for k, place in enumerate(kind.places) if place.endswith(".length")]
        self.ends = {
            kind[f"{name}.length"]: ends for name, ends in section.lengths.items() if f"{name}.length" in kind.places
        }
        self.ground = section.lengths.get("ground", (0.0, np.inf))

    def placed(self, values: Floats) -> Floats:
        """Linkages turned, scaled and shifted to the first two of the given pivots."""
        first, second, *_ = self.kind.frame(values).T
        turned = (self.site.given[1] - self.site.given[0]) / (second - first)
        return self(self.kind.moved(values, turned, self.site.given[0] - turned * first))

    @property
    def freedom(self) -> int:
        """How many dimensions are left to choose; where a rail is told by any of its points, that is no dimension."""
        (along, across), pivots = self.site.fixed, len(self.kind.pivots)
        if len(self.site.given):
            return len(self.kind.places) - 2 * min(pivots, len(self.site.given))
        held = along + across
        return len(self.kind.places) - held * pivots - (len(self.kind.rails) if not held else 0)

    def __call__(self, values: Floats) -> Floats:
        values = self._with_lengths(values)
        for (x, y), place in zip(self.kind.pivots, self._pivots(values).T, strict=True):
            values[:, x], values[:, y] = place.real, place.imag
        return values

    def _with_lengths(self, values: Floats) -> Floats:
        """Linkages of the nearest lengths: the shortest gives way to the ratio; negative ones are to the other side."""
        values, own = values.copy(), np.abs(values[:, self.links])
        values[:, self.links] = np.maximum(own, own.max(axis=1, keepdims=True) / self.section.bounds.ratio)
        for column, (low, high) in self.ends.items():
            values[:, column] = np.clip(values[:, column], low, high)
        return values

    def _pivots(self, values: Floats) -> Complexes:
        """The nearest places of the pivots within reach of the task, and in their site where that holds them."""
        site, ratio = self.site, self.section.bounds.ratio
        away = self.kind.frame(values) - site.centre
        places = site.centre + away / np.maximum(np.abs(away) / (site.reach * site.size), 1.0)
        if not self.in_place and self.links:
            # The frame keeps the ratio by its second pivot.
            own, frame = values[:, self.links], places[:, 1] - places[:, 0]
            length = np.maximum(np.abs(frame), np.finfo(float).tiny)
            least = np.maximum(own.max(axis=1) / ratio, self.ground[0])
            most = np.minimum(own.min(axis=1) * ratio, self.ground[1])
            places[:, 1] = places[:, 0] + frame * np.clip(length, least, most) / length
        for pivot, column in self.kind.rails.items():
            # A rail is told by that of its points that is in place, and nearest to the middle.
            places[:, pivot] = site.crossed(places[:, pivot], 1j * np.exp(1j * values[:, column]))
        return np.where(self._held(places), site.nearest(places), places)

    def _held(self, places: Complexes) -> Flags:
        """Which pivots the site holds, shape (count, pivots): all, or of fewer given points the nearest to each.

        Rails have given points only where there are more than other pivots.
        """
        held, given = np.full(places.shape, self.in_place or not len(self.site.given)), self.site.given
        rails = [*self.kind.rails] if len(given) + len(self.kind.rails) <= places.shape[1] else []
        for point in [] if self.in_place else given:
            gaps = np.where(held, np.inf, np.abs(places - point))
            gaps[:, rails] = np.inf
            held[np.arange(len(places)), gaps.argmin(axis=1)] = True
        return held

    def left(self, values: Floats, slopes: Slopes) -> Slopes:
        slopes, axis, (along, across) = slopes.copy(), self.site.axis, self.site.fixed
        held = self._held(self.kind.frame(values)).T.reshape(-1, len(values), *(1,) * (slopes.ndim - 2))
        for (x, y), rows in zip(self.kind.pivots, held, strict=True):
            way = slopes[x] * axis.real + slopes[y] * axis.imag
            off = slopes[y] * axis.real - slopes[x] * axis.imag
            way, off = np.where(rows & along, 0.0, way), np.where(rows & across, 0.0, off)
            slopes[x], slopes[y] = way * axis.real - off * axis.imag, way * axis.imag + off * axis.real
        return slopes


class RangeBounds(Bounds):
    """Those of a study's own mechanism by the ranges of its parameters; it is where they say."""

    def __init__(self, kind: OwnKind, *, turning: bool, least: float = 0.0) -> None:
        super().__init__(kind, turning=turning, least=least, in_place=True)
        self.low, self.high = kind.low, kind.high

    def __call__(self, values: Floats) -> Floats:
        return np.clip(values, self.low, self.high)
