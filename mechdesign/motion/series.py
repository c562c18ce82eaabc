"""Functions along motions as Chebyshev series on pieces, which are halved until these are exact.

One that has poles, such as a drive's effort at a singularity, is followed as the quotient of two that have none.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from types import MappingProxyType

import numpy as np

from mechdesign.ground.numerics import chebyshev
from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.motion.curve import AT_ONCE, BUDGET, Curve
from mechdesign.motion.pieces import BESIDE, MOST_HALVINGS, RESOLVED, CurvePieces, largest

# A series is exact if its truncation error is less than this part of the function's size; near a singularity, where
# functions have fewer digits, less than this part over the conditioning.
EXACT = 2e-15
# A place is known to so many neighbouring numbers: a function that is steep there has no more digits.
PLACE = 2.0
# A truncation error below this part of the size, and not four times smaller in either half of the piece, is rounding,
# as of a load that begins on a short way; no halving would make it smaller. Of a corner one half has none.
ROUNDING = 1e-11
# The same of a piece that has been halved so often: a function that ends as a root has lost half of its digits there.
DEEP, ROUNDING_DEEP = 20, 1e-3
# A magnitude below this part of its size is nearly zero. Pieces are divided at such places so many times at the most.
NEARLY_ZERO, MOST_PARTED = 3e-2, 8
# Neighbouring numbers in the narrowest piece that is halved.
NARROW = 64
# Rounding of a value that has all its digits is below this part of it.
DIGITS = 1e-13
# Error of means, as a part of the function's size.
MEAN_ERROR = 1e-10
# Largest number of nodes of a piece at which a quotient may have no value.
MOST_LOST = 4
# Rounding of a quotient at a node, as a part of its value, with which the node says nothing of it.
NOISE = 2e-8

# A part of a motion on which a function has no value is rounding, such as of a root of zero, if it is shorter.
LOST = 1e-6

# Values of shape (functions, n) at places of lines, and the conditioning of the poses, shape (n,).
Evaluate = Callable[[Ints, Floats], tuple[Floats, Floats]]


class Series:
    """Functions along the motions of a curve, as series.

    Parameters
    ----------
    names : sequence of str
        The functions that `evaluate` gives, in its order.
    sizes : sequence of float
        Least size of each function, by which its rounding is judged.
    divisors : mapping of str to (str, int)
        For each function with poles: the function that is zero there, and the order of the poles.
    extremes, means, zeros : sequence of str
        Functions of which extremes, means and zeros are needed; the others are only evaluated.
    magnitudes : sequence of str
        Sizes of vectors, which have a corner where these are zero; their squares are smooth there.
    everywhere : sequence of str
        Functions whose series are needed on every piece.
    ends : mapping of str to int
        Which extreme of a function is needed: 1 for the largest value, -1 for the smallest, 0 for both.
    """

    def __init__(
        self, curve: Curve, names: Sequence[str], evaluate: Evaluate, sizes: Sequence[float],
        divisors: Mapping[str, tuple[str, int]] | None = None, *,
        extremes: Sequence[str] = (), means: Sequence[str] = (), zeros: Sequence[str] = (),
        everywhere: Sequence[str] = (), magnitudes: Sequence[str] = (), ends: Mapping[str, int] = MappingProxyType({}),
    ) -> None:  # fmt: skip
        self.curve, self.names, self._evaluate = curve, {name: k for k, name in enumerate(names)}, evaluate
        self._sizes = np.array(sizes, dtype=float)
        divisors = divisors or {}
        self._divisors = {self.names[name]: self.names[by] for name, (by, _) in divisors.items()}
        self._orders = np.array([divisors[name][1] if name in divisors else 1 for name in names], dtype=float)
        self._poled = np.array([name in divisors for name in names], dtype=bool)
        self._means, self._zeros, self._everywhere = (
            np.array([name in group for name in names], dtype=bool) for group in (means, zeros, everywhere)
        )
        self._magnitudes = np.array([name in magnitudes for name in names], dtype=bool)
        # Whether the largest and the smallest value of each function are needed.
        self._extremes = np.array(
            [[name in extremes and ends.get(name, 0) != -sign for name in names] for sign in (1, -1)], dtype=bool
        )
        self.unresolved = np.zeros(curve.lines, dtype=bool)
        # Largest rounding of each function with poles where it is followed on its own.
        self._noise = np.zeros((len(names), curve.lines))
        self._follow()

    def at(self, line: Ints, s: Floats) -> Floats:
        """Values of all functions at places of lines, shape (functions, n)."""
        return self._values(line, s)[0]

    def size(self, name: str) -> float:
        """What a function's rounding is judged by, whatever its values are."""
        return float(self._sizes[self.names[name]])

    def lost(self, name: str) -> Floats:
        """Part of each motion on which a function has no value, shape (lines,); 0 where that is rounding."""
        return np.asarray(self._lost[self.names[name]])

    @cached_property
    def _lost(self) -> Floats:
        pieces, end = self.pieces, self.curve.poses.end
        empty = np.isnan(self._table).sum(axis=2) > chebyshev.COUNT // 2
        length = np.zeros((len(empty), self.curve.lines))
        for row in np.flatnonzero(empty.any(axis=1)).tolist():
            length[row] = np.bincount(pieces.line, (pieces.end - pieces.begin) * empty[row], self.curve.lines)
        return np.where(length > LOST * end, length / max(end, LOST), 0.0)

    def _values(self, line: Ints, s: Floats) -> tuple[Floats, Floats]:
        parts = [self._evaluate(line[k : k + AT_ONCE], s[k : k + AT_ONCE]) for k in range(0, max(len(s), 1), AT_ONCE)]
        return np.concatenate([part[0] for part in parts], axis=1), np.concatenate([part[1] for part in parts])

    def _sampled(self, pieces: CurvePieces) -> tuple[Floats, Floats, Floats, Flags]:
        """Functions at the nodes of pieces (with poles: times their divisors), divisors, exactness, and which are own.

        Of shapes (functions, pieces, nodes), twice, (pieces,) and (functions, pieces). A function with poles is
        followed on its own where it is smooth: far from them, and where a motion goes smoothly through a singular pose,
        at which numerator and divisor are both zero.
        """
        s = pieces.nodes
        values, conditioning = self._values(np.repeat(pieces.line, s.shape[1]), s.ravel())
        values = values.reshape(len(self.names), *s.shape)
        divisors = np.ones_like(values)
        divisors[[*self._divisors]] = values[[*self._divisors.values()]]
        orders = self._orders[:, None, None]
        products = np.where(self._poled[:, None, None], values * divisors**orders, values)
        # At a pole a quotient has no value: its numerator is interpolated from the other nodes.
        _fill(products, ~np.isfinite(products) & self._poled[:, None, None])
        regular = np.clip(np.where(np.isfinite(conditioning), conditioning, 1.0).reshape(s.shape), 1e-6, 1.0)
        own = np.zeros((len(self.names), len(pieces.line)), dtype=bool)
        if self._poled.any():
            # Positions have lost digits there as well.
            noise = EXACT / regular ** (orders[self._poled] + 1)
            table = values[self._poled]
            lost = ~np.isfinite(table) | (noise > NOISE)
            _fill(table, lost)
            left = np.where(lost, 0.0, noise).max(axis=2)
            size = np.maximum(np.abs(table).max(axis=2), self._sizes[self._poled, None])
            some = _remainder(table, np.count_nonzero(lost, axis=2)) <= left * size
            # Far from singular poses a value has all its digits, whatever the largest is.
            rounded = np.where(some & (left > DIGITS), left * size, 0.0)
            own[self._poled], rounding = some, np.zeros(own.shape)
            rounding[self._poled] = rounded
            largest(self._noise, pieces.line, rounding)
            products[self._poled] = np.where(some[..., None], table, products[self._poled])
            divisors[own] = 1.0
        return products, divisors, EXACT / regular.min(axis=1, initial=1.0), own

    def _follow(self) -> None:
        """Halve pieces until every series is exact where extremes, means or zeros depend on it."""
        lines, spent = self.curve.lines, np.zeros(self.curve.lines)
        pieces = self.curve.pieces
        values, divisors, exact, own = self._sampled(pieces)
        for _ in range(MOST_PARTED if self._magnitudes.any() else 0):
            piece, x = self._nearly_zero(pieces, values, divisors)
            if not len(piece):
                break
            pieces = pieces.divided(piece, x)
            values, divisors, exact, own = self._sampled(pieces)
        pending = pieces
        done: list[tuple[CurvePieces, Floats, Floats, Floats, Flags]] = []
        self._scale = np.zeros((len(self.names), lines))
        self._divisor_scale = np.zeros((len(self.names), lines))
        best = np.full((2, len(self.names), lines), -np.inf)
        before: Floats | None = None
        span = max(float(self.curve.poses.end), 1.0)
        while len(pending.line):
            spent += chebyshev.COUNT * np.bincount(pending.line, minlength=lines)
            finite = np.isfinite(values)
            largest(self._scale, pending.line, np.where(finite, np.abs(values), 0.0).max(axis=2))
            largest(self._divisor_scale, pending.line, np.abs(np.nan_to_num(divisors)).max(axis=2))
            finite_values = np.where(finite & ~self._poled[:, None, None], values, np.nan)
            missing = np.isnan(finite_values)
            ends = [np.where(missing, -np.inf, sign * finite_values).max(axis=2) for sign in (1.0, -1.0)]
            for end, top in zip(ends, best, strict=True):
                largest(top, pending.line, end)
            scale = np.maximum(self._scale, self._sizes[:, None])[:, pending.line]
            rest = chebyshev.remainder(chebyshev.series(values))
            change = np.nan_to_num(values.max(axis=2) - values.min(axis=2))
            near = np.spacing(pending.end)
            blurred = change * PLACE * near / np.maximum(pending.end - pending.begin, near)
            rough = ~(rest <= exact * scale + blurred) & finite.any(axis=2) & ~own
            if before is not None:
                rounding = np.minimum(*np.split(rest, 2, axis=1)) > before / 4
                part = np.where(pending.depth >= DEEP, ROUNDING_DEEP, ROUNDING)
                rough &= ~(np.tile(rounding, 2) & (rest <= part * scale))
            steps = np.abs(np.diff(finite_values, axis=2))
            steps = np.where(missing[..., 1:] != missing[..., :-1], np.inf, np.nan_to_num(steps)).max(axis=2)
            above = [
                is_sought[:, None] & (end + 2 * steps >= top[:, pending.line] - exact * scale)
                for end, top, is_sought in zip(ends, best, self._extremes, strict=True)
            ]
            mean = np.zeros_like(rough)
            if self._means.any():
                left = chebyshev.remainder(chebyshev.series(values[self._means] * pending.stretch))
                mean[self._means] = left > MEAN_ERROR * span * scale[self._means]
            crossed = np.where(finite, np.abs(values), np.inf).min(axis=2) <= steps
            matters = (
                (self._extremes.any(axis=0) & self._poled)[:, None]
                | above[0]
                | above[1]
                | mean
                | (self._zeros[:, None] & (self._poled[:, None] | crossed))
                | self._everywhere[:, None]
            )
            # A piece of a few neighbouring numbers has no halves.
            wide = pending.end - pending.begin > NARROW * np.spacing(np.maximum(pending.end, 1.0))
            halve = (rough & matters).any(axis=0) & (pending.depth < MOST_HALVINGS) & wide
            self.unresolved |= np.bincount(pending.line[halve], minlength=lines).astype(bool) & (spent > BUDGET)
            halve &= spent[pending.line] <= BUDGET
            done.append((pending.take(~halve), values[:, ~halve], divisors[:, ~halve], exact[~halve], rough[:, ~halve]))
            pending, before = pending.take(halve).halves(), rest[:, halve]
            if len(pending.line):
                values, divisors, exact, own = self._sampled(pending)
        parts = list(zip(*done, strict=True)) if done else None
        if parts is None:
            self.pieces = pieces
            self._table = self._divisor = values
            self._rough = np.zeros(values.shape[:2], dtype=bool)
            return
        joined = CurvePieces.joined(parts[0])
        order = np.lexsort((joined.begin, joined.line))
        self.pieces = joined.take(order)
        self._table, self._divisor = (np.concatenate(part, axis=1)[:, order] for part in parts[1:3])
        self._rough = np.concatenate(parts[4], axis=1)[:, order]

    def _nearly_zero(self, pieces: CurvePieces, values: Floats, divisors: Floats) -> tuple[Ints, Floats]:
        """CurvePieces, and places in them, at which magnitudes are smallest and nearly zero, or may be so."""
        rows = self._magnitudes
        squares = (values[rows] / divisors[rows] ** self._orders[rows, None, None]) ** 2
        squares[~np.isfinite(squares)] = np.nan
        sizes = np.zeros((len(squares), self.curve.lines))
        largest(sizes, pieces.line, np.nan_to_num(squares).max(axis=2, initial=0.0))
        # What is rounding everywhere is nowhere nearly zero.
        sizes[sizes < (NOISE * self._sizes[rows, None]) ** 2] = 0.0
        small = NEARLY_ZERO**2 * sizes[:, pieces.line]
        most, least = (f(np.nan_to_num(squares), axis=2) for f in (np.max, np.min))
        # Where a magnitude does not change along a piece, such as zero in a dwell, its least value is rounding's.
        flat = most - least <= NOISE * np.maximum(most, NOISE * sizes[:, pieces.line])
        magnitude, piece = np.nonzero((squares.min(axis=2, initial=np.inf) < small) & ~flat)
        series = chebyshev.series(squares[magnitude, piece])
        # A value loses digits by the size of the largest, its square in proportion to both.
        size = np.sqrt(sizes[magnitude, pieces.line[piece]] * np.abs(series).max(axis=1, initial=0.0))
        rough = chebyshev.remainder(series) > RESOLVED * size
        which, x, value = chebyshev.turning_points(series)
        inside = ~rough[which] & (value < small[magnitude, piece][which]) & (np.abs(x) < 1.0 - BESIDE)
        owner = np.concatenate([piece[which[inside]], piece[rough]])
        return owner, np.concatenate([x[inside], np.zeros(np.count_nonzero(rough))])


def _fill(table: Floats, lost: Flags) -> None:
    """Put values of the polynomials through the other nodes where few nodes of a piece are lost."""
    number = np.count_nonzero(lost, axis=2)
    for k, piece in np.argwhere((number > 0) & (number <= MOST_LOST)).tolist():
        table[k, piece] = chebyshev.filled(table[k, piece], ~lost[k, piece])


def _remainder(table: Floats, number: Ints) -> Floats:
    """Truncation errors of series of which a `number` of nodes are filled, so that as many coefficients are zero."""
    series = chebyshev.series(table)
    rest = np.full(number.shape, np.inf)
    for filled in range(MOST_LOST + 1):
        some = number == filled
        rest[some] = chebyshev.remainder(series[some][:, : chebyshev.COUNT - filled])
    return rest
