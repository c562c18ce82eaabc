"""What keeps linkages of a family within a section's limits while they are polished."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.questions.synthesize.judging import sines
from mechdesign.questions.synthesize.kinds import Kind
from mechdesign.questions.synthesize.own import OwnKind
from mechdesign.questions.synthesize.schema import Region, SynthesisSection

# Poses of a turn at which transmission angles are looked at in a polish, of so many linkages at once.
_AROUND, _AT_ONCE = 32, 1000
# By this part their sines are kept larger than what is asked, as they are not followed between these poses.
_SURE = 1e-3


class KindBounds:
    """Keeps the values of linkages of a kind within the section's limits, as far as each by itself can.

    Attributes
    ----------
    fixed : ndarray of bool, shape (places,)
        Which values are given.
    in_place : bool
        Whether samples are where they must be, so that only their forms are free.
    turning : bool
        Whether drives must turn fully.
    least : float
        Sine of the transmission angle that they keep then.
    """

    def __init__(self, kind: Kind, section: SynthesisSection, centre: complex, size: float, factor: float) -> None:
        self.kind, self.section, self.centre, self.size = kind, section, centre, size
        self.turning, self.fixed = section.needs_turn, np.zeros(len(kind.places), dtype=bool)
        self.least = section.least_sine(factor)
        self.links = [k for k, place in enumerate(kind.places) if place.endswith(".length")]
        self.ends = {
            kind[f"{name}.length"]: ends for name, ends in section.lengths.items() if f"{name}.length" in kind.places
        }
        self.ground = section.lengths.get("ground", (0.0, np.inf))
        pivots = section.pivots
        self.given = None if pivots is None or isinstance(pivots, Region) else np.array([complex(*p) for p in pivots])
        self.box = pivots if isinstance(pivots, Region) and pivots.through is None else None
        self.in_place = self.given is not None and len(self.given) >= len(kind.pivots)
        if self.in_place:
            self.fixed[[column for pair in kind.pivots for column in pair]] = True

    def placed(self, values: Floats) -> Floats:
        """Linkages turned, scaled and shifted to the first two of the given pivots."""
        assert self.given is not None
        first, second, *_ = self.kind.frame(values).T
        turned = (self.given[1] - self.given[0]) / (second - first)
        return self(self.kind.moved(values, turned, self.given[0] - turned * first))

    def __call__(self, values: Floats) -> Floats:
        """The nearest values within the limits of each."""
        values, limits = values.copy(), self.section.bounds
        for number, (x, y) in enumerate(self.kind.pivots):
            place = values[:, x] + 1j * values[:, y]
            if self.given is not None and self.in_place:
                place = np.full(len(values), self.given[number])
            away = place - self.centre
            far = np.maximum(np.abs(away) / (limits.reach * self.size), 1.0)
            place = self.centre + away / far
            if self.box is not None:
                place = np.clip(place.real, *_ends(self.box.x)) + 1j * np.clip(place.imag, *_ends(self.box.y))
            values[:, x], values[:, y] = place.real, place.imag
        # The shortest gives way to the ratio; a negative length is one to the other side.
        own = np.abs(values[:, self.links])
        values[:, self.links] = np.maximum(own, own.max(axis=1, keepdims=True) / limits.ratio)
        for column, (low, high) in self.ends.items():
            values[:, column] = np.clip(values[:, column], low, high)
        if not self.in_place and self.links:
            # The frame keeps the ratio by its second pivot.
            (x, y), (u, v), *_ = self.kind.pivots
            own, frame = values[:, self.links], values[:, u] - values[:, x] + 1j * (values[:, v] - values[:, y])
            length = np.maximum(np.abs(frame), np.finfo(float).tiny)
            low, high = self.ground
            least = np.maximum(own.max(axis=1) / limits.ratio, low)
            moved = frame * np.clip(length, least, np.minimum(own.min(axis=1) * limits.ratio, high)) / length
            values[:, u], values[:, v] = values[:, x] + moved.real, values[:, y] + moved.imag
        return values

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


class RangeBounds(KindBounds):
    """Keeps the parameters of a study's own mechanism within their ranges; it is where they say."""

    def __init__(self, kind: OwnKind, *, turning: bool, least: float = 0.0) -> None:
        self.kind, self.turning, self.least = kind, turning, least
        self.in_place, self.fixed = True, np.zeros(len(kind.places), dtype=bool)
        self.low, self.high = kind.low, kind.high

    def placed(self, values: Floats) -> Floats:
        return values

    def __call__(self, values: Floats) -> Floats:
        return np.clip(values, self.low, self.high)


def _ends(ends: Any) -> tuple[float, float]:
    return ends if isinstance(ends, tuple) else (-np.inf, np.inf) if ends is None else (ends, ends)
