"""Where functions change their signs along an interval, however near to each other.

The interval is halved until every function is resolved by its Chebyshev series or is far from zero. Between two zeros
of a series lies a side; sides on which a function is no more than rounding are none, so that a function that touches
zero does not change its sign.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from mechdesign.ground.numerics import chebyshev
from mechdesign.ground.numerics.arrays import Floats

# A function is resolved if the truncation error of its series is below this part of its size.
RESOLVED = 1e-9
# A function that is below this part of its size is zero.
NOTHING = 1e-12
# A function that has its sign only from this part of the interval on had it before: it has just left zero.
EARLY = 1e-8
# Shortest piece, as a part of the interval; most pieces that are looked at.
SHORTEST, MOST_PIECES = 1e-11, 4096
# A zero moves by less than this part of its piece when it is polished.
POLISHED = 1e-2

# Values of functions, shape (functions, n), at places of shape (n,).
Look = Callable[[Floats], Floats]


class SignChange(NamedTuple):
    """A function, the place from which on it has another sign, and this sign."""

    function: int
    place: float
    sign: float


class Resolved(NamedTuple):
    """Functions along an interval as series on pieces in order.

    Attributes
    ----------
    low, high : Floats, shape (pieces,)
    coefficients : Floats, shape (functions, pieces, chebyshev.COUNT)
    sizes : Floats, shape (functions,)
        Largest absolute values.
    reach : float
        Up to where they are resolved; the last place where all are, and where the first piece is not.
    """

    look: Look
    low: Floats
    high: Floats
    coefficients: Floats
    sizes: Floats
    reach: float

    @classmethod
    def of(cls, look: Look, ends: Floats, sizes: Floats) -> Resolved:
        """Functions between the first and the last of some places, at which they may have corners.

        Parameters
        ----------
        sizes : Floats, shape (functions,)
            How large the functions were before.
        """
        low, high = ends[:-1], ends[1:]
        least, count, parts, reach = SHORTEST * float(ends[-1] - ends[0]), 0, [], float(ends[-1])
        while len(low):
            middle, half = (low + high) / 2, (high - low) / 2
            places = middle[:, None] + half[:, None] * chebyshev.NODES
            values = look(places.ravel()).reshape(-1, *places.shape)
            # Beyond the places where it has a value a function has no sign to change to.
            values = np.where(np.isfinite(values), values, sizes[:, None, None])
            sizes = np.maximum(sizes, np.abs(values).max(axis=(1, 2)))
            coefficients = chebyshev.series(values)
            rest = chebyshev.remainder(coefficients)
            alike = (np.abs(values).min(axis=2) > 4 * chebyshev.COUNT * rest) & (np.ptp(np.sign(values), axis=2) == 0)
            count += len(low)
            coarse = (~alike & (rest > RESOLVED * sizes[:, None])).any(axis=0) & (half > least)
            if count >= MOST_PIECES and coarse.any():
                reach, coarse = float(low[coarse].min()), np.zeros_like(coarse)
            parts.append((low[~coarse], high[~coarse], coefficients[:, ~coarse]))
            low, middle, high = low[coarse], middle[coarse], high[coarse]
            low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
        low, high = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
        order = np.argsort(low)
        whole = np.concatenate([part[2] for part in parts], axis=1)
        return cls(look, low[order], high[order], whole[:, order], sizes, reach if reach > ends[0] else float(ends[-1]))

    def places(self, piece: int, x: Floats) -> Floats:
        """Places in a piece, by where they are between -1 and 1."""
        low, high = self.low[piece], self.high[piece]
        return np.asarray((low + high) / 2 + x * (high - low) / 2)

    def changes(self, sides: Floats, least: Sequence[float] | float = 0.0) -> list[SignChange]:
        """Changes of sign in order, from `sides` before the interval on; 0 where a function has none yet.

        A function that is no more than `least` has no sign.
        """
        leading, others = self.coefficients[..., 0], np.abs(self.coefficients[..., 1:]).sum(axis=-1)
        noise = np.maximum(NOTHING * self.sizes, least)
        sure = np.abs(leading) > others
        begin, early = self.low[0], EARLY * (self.high[-1] - self.low[0])
        changes: list[SignChange] = []
        for k in np.flatnonzero(~(sure & (np.sign(leading) == sides[:, None])).all(axis=1)).tolist():
            side = float(sides[k])
            for piece in range(len(self.low)):
                for x, middle in [(-1.0, leading[k, piece])] if sure[k, piece] else self._between_zeros(k, piece):
                    sign = float(np.sign(middle))
                    if sign == side or abs(middle) <= noise[k]:
                        continue
                    change = SignChange(k, self._polished(k, piece, x), sign)
                    if changes and changes[-1][:2] == (k, begin) and sides[k] and change.place < begin + early:
                        changes.pop()
                    else:
                        changes.append(change)
                    side = sign
        return sorted(changes, key=lambda change: change.place)

    def touched(self) -> Floats:
        """Places at which some function is zero, or touches it."""
        changes = self.changes(np.zeros(len(self.sizes)))
        places = [change.place for change in changes if change.place > self.low[0]]
        return np.unique([*places, *self.turning(RESOLVED)])

    def turning(self, near: float = np.inf) -> Floats:
        """Places at which some function turns back, within a part of its size of zero."""
        owner, piece = np.nonzero(np.abs(self.coefficients).max(axis=-1) > 0)
        which, x, values = chebyshev.turning_points(self.coefficients[owner, piece])
        some = np.abs(values) <= near * self.sizes[owner[which]]
        low, high = (ends[piece[which[some]]] for ends in (self.low, self.high))
        return np.asarray((low + high) / 2 + x[some] * (high - low) / 2)

    def _between_zeros(self, k: int, piece: int) -> list[tuple[float, float]]:
        """Where each side of a function in a piece begins, from -1 on, and the value in its middle."""
        series = self.coefficients[k, piece][None]
        _, zeros = chebyshev.zeros(series, chebyshev.turning_points(series))
        bounds = np.concatenate([[-1.0], zeros, [1.0]])
        middles = chebyshev.value(np.repeat(series, len(bounds) - 1, axis=0), (bounds[:-1] + bounds[1:]) / 2)
        return [*zip(bounds[:-1].tolist(), middles.tolist(), strict=True)]

    def _polished(self, k: int, piece: int, x: float) -> float:
        """The place of a zero, by a step of Newton's method at the function itself."""
        if x == -1.0:
            return float(self.low[piece])
        place = float(self.places(piece, np.array(x)))
        width = self.high[piece] - self.low[piece]
        slope = float(chebyshev.slope(self.coefficients[k, piece][None], np.array([x]))[0]) * 2 / width
        value = float(self.look(np.array([place]))[k][0])
        moved = place - value / slope if slope else place
        return moved if abs(moved - place) < POLISHED * width else place
