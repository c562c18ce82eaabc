"""Integrals and means of functions along motions, and where they do not exist."""

from __future__ import annotations

import numpy as np

from mechdesign.ground.numerics import chebyshev
from mechdesign.ground.numerics.arrays import Flags, Floats, Ints, distinct
from mechdesign.motion.pieces import MOST_HALVINGS, between_marks
from mechdesign.motion.series import Series

# A function without a divisor is infinite if it still rises by more than this part of itself from node to node of a
# piece that cannot be halved.
RISES = 1e-2
# A function that rises to the end of a piece as this power of one over the distance, or more, has no integral there.
ENDLESS_POWER = 0.9
# It does so only where its series is no closer than this part of its size.
UNRESOLVED = 1e-3


class Means(Series):
    """Integrals of functions along the motions of a curve; see `Series` for the parameters."""

    def means(
        self, name: str, power: int = 1, measure: str | None = None, *, absolute: bool = False
    ) -> Floats:  # fmt: skip
        """Mean of a power of a function (or of its absolute value) over each line, weighted by another.

        Of shape (lines,); nan without values. Where the integral does not exist it is infinite if no value is negative,
        and else nan.
        """
        values = self._table[self.names[name]] ** power
        pace = 1.0 if measure is None else self._table[self.names[measure]]
        weights = np.where(np.isfinite(values), self.pieces.weights * pace, 0.0)
        parts = (weights * np.where(weights != 0, values, 0.0)).sum(axis=1)
        if absolute:
            parts = self._sizes_of(values, pace, np.abs(parts))
        total, sums = (np.bincount(self.pieces.line, part, self.curve.lines) for part in (weights.sum(axis=1), parts))
        mean = np.asarray(sums / np.where(total > 0, total, np.nan))
        row = self.names[name]
        size = np.maximum(self._scale[row], self._sizes[row])[self.pieces.line]
        large = np.abs(np.nan_to_num(values)).max(axis=1) > (UNRESOLVED * size) ** power
        endless = distinct(self.pieces.line[large & self._endless(values * pace * self.pieces.stretch)])
        negative = distinct(self.pieces.line[(values < 0).any(axis=1)])
        mean[endless] = np.where(absolute | ~np.isin(endless, negative), np.inf, np.nan)
        return mean

    def _endless(self, flow: Floats) -> Flags:
        """Pieces over which a function has no integral: it rises too steeply to an end, or through a pole inside."""
        sizes = np.where(np.isfinite(flow), np.abs(flow), 0.0)
        rough = np.flatnonzero(chebyshev.remainder(chebyshev.series(sizes)) > UNRESOLVED * sizes.max(axis=1))
        endless = np.zeros(len(flow), dtype=bool)
        for k in rough.tolist():
            top, present = int(sizes[k].argmax()), np.flatnonzero(np.isfinite(flow[k]))
            inwards = np.arange(top, chebyshev.COUNT) if top < chebyshev.COUNT // 2 else np.arange(top, -1, -1)
            # At the pole itself a node may have no value.
            if top in (present[0], present[-1]):
                near = inwards[:4]
                powers = -np.diff(np.log(sizes[k, near])) / np.diff(np.log(1.0 - np.abs(chebyshev.NODES[near])))
                endless[k] = (powers >= ENDLESS_POWER).all()
            else:
                endless[k] = self.pieces.depth[k] >= MOST_HALVINGS - 1 and rises(sizes[k, inwards])
        return endless

    def _sizes_of(self, values: Floats, pace: Floats | float, sizes: Floats) -> Floats:
        """Integrals of absolute values over each piece; `sizes` are those of pieces without a change of sign."""
        series = chebyshev.series(values)
        piece, x = chebyshev.zeros(series, chebyshev.turning_points(series))
        of, low, high = between_marks(piece, x, distinct(piece))
        flow = chebyshev.series(values * pace * self.pieces.stretch)[of]
        between = np.abs(chebyshev.primitive(flow, high) - chebyshev.primitive(flow, low))
        crossed = np.bincount(of, between, len(sizes))
        return np.where(np.isin(np.arange(len(sizes)), of) & np.isfinite(crossed), crossed, sizes)

    def integral(self, name: str, line: Ints, s: Floats) -> tuple[Floats, float]:
        """Integrals of a function from the begin of lines to places of them, shape (n,), and the error of the whole."""
        series = chebyshev.series(self._table[self.names[name]] * self.pieces.stretch)
        whole = chebyshev.primitive(series, np.ones(len(series)))
        before = np.cumsum(whole) - whole
        first = np.searchsorted(self.pieces.line, line)
        piece = self.curve.piece_at(line, s, self.pieces)
        part = chebyshev.primitive(series[piece], self.pieces.take(piece).within(s))
        return before[piece] - before[first] + part, float(np.sum(chebyshev.remainder(series)))


def rises(inwards: Floats) -> bool:
    """Whether values still rise to the first of them, as to a pole; at a corner or a jump they do not."""
    first, second, third = inwards[:3].tolist() if len(inwards) > 2 else (0.0, 0.0, 0.0)
    return bool(first - second > RISES * abs(first) and second - third > RISES * abs(second))
