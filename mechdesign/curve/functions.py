"""Functions along motions: their extremes, zeros and means, between the poses as well.

Each function is a Chebyshev series on every piece of a motion, which is halved until the series is exact or the piece
can hold no extreme. One that has poles, such as a drive's effort at a singularity, is followed as the quotient of two
that have none; at its poles it is infinite.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.curve.motion import AT_ONCE, BUDGET, Curve
from mechdesign.curve.pieces import MOST_HALVINGS, Pieces
from mechdesign.numerics import chebyshev
from mechdesign.numerics.arrays import Flags, Floats, Ints, Lanes

# Series that leave less than this part of a function's size are exact; near a singularity, where fewer digits are
# known, as many times more as one is to the conditioning.
EXACT = 2e-15
# Means are known to this part of a function's size.
MEAN_ERROR = 1e-10
# A function is infinite where its divisor is zero and the product of both is more than this part of its size.
POLE = 1e-9
# Where its divisor is this part of its size or less, at the end of a piece, it is zero.
ZERO = 1e-8
# At a dead centre, whose place is known to the root of rounding, links lie in line.
ZERO_AT_FOLD = 1e-4
# An extreme so near to a pose (in rows) may be that pose.
BESIDE_ROW = 1e-4
# A value of a series that is farther than this part of the function's size from the function is not one of it.
TRUE = 1e-7
# Nodes of a piece at which a quotient may have no value.
MOST_LOST = 4
# A function without a divisor that grows by this factor over its halvings, and goes on to, is infinite.
ENDLESS = 1e4

# Values of shape (functions, n) at places of lines, and the conditioning of the poses, shape (n,).
Evaluate = Callable[[Ints, Floats], tuple[Floats, Floats]]


@dataclass(frozen=True, eq=False)
class Extremes:
    """The largest values of functions on each line, of shape (functions, lines); nan where there is none.

    Parameters
    ----------
    value : ndarray
        Of the functions times the sign that was asked for.
    place : ndarray
        Along the line, in rows.
    """

    value: Floats
    place: Floats


@dataclass(frozen=True, eq=False)
class Zeros(Lanes):
    """Places at which functions are zero, arrays of shape (n,): number of the function, line, and place in rows."""

    function: Ints
    line: Ints
    place: Floats


class Functions:
    """Functions along the motions of a curve.

    Parameters
    ----------
    names : sequence of str
        The functions that `evaluate` gives, in its order.
    sizes : sequence of float
        What rounding of each is judged by, at least.
    divisors : mapping of str to sequence of (str, int)
        Of functions with poles: others, whose zeros these are, and of which order.
    extremes, means, zeros : sequence of str
        Functions of which these are wanted; the others are evaluated only.
    """

    def __init__(
        self, curve: Curve, names: Sequence[str], evaluate: Evaluate, sizes: Sequence[float],
        divisors: Mapping[str, Sequence[tuple[str, int]]] | None = None, *,
        extremes: Sequence[str] = (), means: Sequence[str] = (), zeros: Sequence[str] = (),
    ) -> None:  # fmt: skip
        self.curve, self.names, self._evaluate = curve, {name: k for k, name in enumerate(names)}, evaluate
        self._sizes = np.array(sizes, dtype=float)
        self._divisors = {
            self.names[name]: [(self.names[by], power) for by, power in by_what]
            for name, by_what in (divisors or {}).items()
        }
        self._poled = np.array([k in self._divisors for k in range(len(names))], dtype=bool)
        self._extremes, self._means, self._zeros = (
            np.array([name in wanted for name in names], dtype=bool) for wanted in (extremes, means, zeros)
        )
        self.unresolved = np.zeros(curve.lines, dtype=bool)
        self._follow()

    def at(self, line: Ints, s: Floats) -> Floats:
        """Values of all functions at places of lines, shape (functions, n)."""
        return self._values(line, s)[0]

    def _values(self, line: Ints, s: Floats) -> tuple[Floats, Floats]:
        parts = [self._evaluate(line[k : k + AT_ONCE], s[k : k + AT_ONCE]) for k in range(0, max(len(s), 1), AT_ONCE)]
        return np.concatenate([part[0] for part in parts], axis=1), np.concatenate([part[1] for part in parts])

    def _sampled(self, pieces: Pieces) -> tuple[Floats, Floats, Floats]:
        """At the nodes of pieces: functions (those with poles times their divisors), divisors, and exactness.

        Of shapes (functions, pieces, nodes), twice, and (pieces,).
        """
        s = pieces.nodes
        values, conditioning = self._values(np.repeat(pieces.line, s.shape[1]), s.ravel())
        values = values.reshape(len(self.names), *s.shape)
        divisors = np.ones_like(values)
        for k, by_what in self._divisors.items():
            for by, power in by_what:
                divisors[k] *= values[by] ** power
        with np.errstate(invalid="ignore", over="ignore"):
            products = np.where(self._poled[:, None, None], values * divisors, values)
        # At a pole itself a quotient has no value: its product goes on through the other nodes.
        lost = ~np.isfinite(products) & self._poled[:, None, None]
        number = np.count_nonzero(lost, axis=2)
        for k, piece in np.argwhere((number > 0) & (number <= MOST_LOST)).tolist():
            products[k, piece] = chebyshev.filled(products[k, piece], ~lost[k, piece])
        least = np.where(np.isfinite(conditioning), conditioning, 1.0).reshape(s.shape).min(axis=1, initial=1.0)
        return products, divisors, EXACT / np.clip(least, 1e-6, 1.0)

    def _follow(self) -> None:
        """Halve pieces until every function is known where it matters."""
        lines, spent = self.curve.lines, np.zeros(self.curve.lines)
        pieces = pending = self.curve.pieces
        values, divisors, exact = self._sampled(pieces)
        done: list[tuple[Pieces, Floats, Floats, Floats, Flags]] = []
        self._scale = np.zeros((len(self.names), lines))
        self._divisor_scale = np.zeros((len(self.names), lines))
        best = np.full((2, len(self.names), lines), -np.inf)
        span = max(float(self.curve.poses.end), 1.0)
        while len(pending.line):
            spent += chebyshev.COUNT * np.bincount(pending.line, minlength=lines)
            size = np.nanmax(np.where(np.isfinite(values), np.abs(values), 0.0), axis=2, initial=0.0)
            for k in range(len(self.names)):
                np.maximum.at(self._scale[k], pending.line, size[k])
                np.maximum.at(self._divisor_scale[k], pending.line, np.abs(np.nan_to_num(divisors[k])).max(axis=1))
            known = np.where(np.isfinite(values) & ~self._poled[:, None, None], values, np.nan)
            ends = [
                np.where(np.isnan(known), -np.inf, sign * known).max(axis=2, initial=-np.inf) for sign in (1.0, -1.0)
            ]
            for end, top in zip(ends, best, strict=True):
                for k in range(len(self.names)):
                    np.maximum.at(top[k], pending.line, end[k])
            scale = np.maximum(self._scale, self._sizes[:, None] * ~self._poled[:, None])[:, pending.line]
            rest = chebyshev.remainder(chebyshev.series(values))
            rough = ~(rest <= exact * scale) & np.isfinite(values).any(axis=2)
            with np.errstate(invalid="ignore"):
                steps = np.abs(np.diff(known, axis=2))
                steps = np.where(np.isnan(known[..., 1:]) != np.isnan(known[..., :-1]), np.inf, np.nan_to_num(steps))
                above = np.stack([
                    end + 2 * steps.max(axis=2, initial=0.0) >= top[:, pending.line] - exact * scale
                    for end, top in zip(ends, best, strict=True)
                ]).any(axis=0)  # fmt: skip
            left = chebyshev.remainder(chebyshev.series(values * pending.stretch))
            mean = left > MEAN_ERROR * span * scale
            crossed = np.nanmin(np.abs(np.where(np.isfinite(values), values, np.inf)), axis=2) <= steps.max(axis=2)
            matters = (
                (self._extremes[:, None] & (self._poled[:, None] | above))
                | (self._means[:, None] & mean)
                | (self._zeros[:, None] & (self._poled[:, None] | crossed))
            )
            halve = (rough & matters).any(axis=0) & (pending.depth < MOST_HALVINGS)
            self.unresolved |= np.bincount(pending.line[halve], minlength=lines).astype(bool) & (spent > BUDGET)
            halve &= spent[pending.line] <= BUDGET
            done.append((pending.take(~halve), values[:, ~halve], divisors[:, ~halve], exact[~halve], rough[:, ~halve]))
            pending = pending.take(halve).halves()
            if len(pending.line):
                values, divisors, exact = self._sampled(pending)
        parts = list(zip(*done, strict=True)) if done else None
        if parts is None:
            self.pieces = pieces
            self._table = self._divisor = values
            self._rough = np.zeros(values.shape[:2], dtype=bool)
            return
        joined = Pieces.joined(parts[0])
        order = np.lexsort((joined.begin, joined.line))
        self.pieces = joined.take(order)
        self._table, self._divisor = (np.concatenate(part, axis=1)[:, order] for part in parts[1:3])
        self._rough = np.concatenate(parts[4], axis=1)[:, order]

    def at_end(self, name: str, line: int, place: float, x: int) -> float:
        """Value of a function at an end of the motion: of the piece that ends (`x` 1) or begins (-1) there."""
        ends = self.pieces.end if x > 0 else self.pieces.begin
        piece = np.flatnonzero((self.pieces.line == line) & (ends == place))
        if not len(piece):
            return np.nan
        k, end = self.names[name], np.array([float(x)])
        with np.errstate(divide="ignore"):
            value = chebyshev.value(chebyshev.series(self._table[k, piece]), end) / chebyshev.value(
                chebyshev.series(self._divisor[k, piece]), end
            )
        lines = np.array([line])
        places = self.curve.inside(lines, np.array([place]))
        return float(self._true(np.array([k]), 1, lines, places, value)[0])

    def means(self, name: str, power: int = 1, measure: str | None = None) -> Floats:
        """Mean of a power of a function over each line, shape (lines,), weighted by another; nan without values."""
        values = self._table[self.names[name]] ** power
        weights = self.pieces.weights * (1.0 if measure is None else self._table[self.names[measure]])
        weights = np.where(np.isfinite(values), weights, 0.0)
        total, sums = (
            np.bincount(self.pieces.line, part.sum(axis=1), self.curve.lines)
            for part in (weights, weights * np.where(weights != 0, values, 0.0))
        )
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(sums / np.where(total > 0, total, np.nan))

    def integral(self, name: str, line: Ints, s: Floats) -> tuple[Floats, float]:
        """Integrals of a function from the begin of lines to places of them, shape (n,), and the error of the whole."""
        series = chebyshev.series(self._table[self.names[name]] * self.pieces.stretch)
        whole = chebyshev.primitive(series, np.ones(len(series)))
        before = np.cumsum(whole) - whole
        first = np.searchsorted(self.pieces.line, line)
        piece = self.curve.piece_at(line, s, self.pieces)
        part = chebyshev.primitive(series[piece], self.pieces.take(piece).within(s))
        return before[piece] - before[first] + part, float(np.sum(chebyshev.remainder(series)))

    def extremes(self, names: Sequence[str], sign: int, still: Floats) -> Extremes:
        """Largest values of some functions times a sign, the first along the line of those within rounding.

        Parameters
        ----------
        still : ndarray, shape (functions, lines)
            Their rounding.
        """
        rows = np.array([self.names[name] for name in names], dtype=np.intp)
        shape = len(rows), self.curve.lines
        if not len(self.pieces.line) or not len(rows):
            return Extremes(np.full(shape, np.nan), np.full(shape, np.nan))
        function, piece, x, value = self._tops(rows, sign, still)
        poles = self._poles(rows, sign)
        function, piece, x = (np.concatenate(pair) for pair in zip((function, piece, x), poles, strict=True))
        value = np.concatenate([value, np.full(len(poles[0]), np.inf)])
        line, place = self.pieces.line[piece], self.pieces.take(piece).places(x)
        lane = function * shape[1] + line
        best = np.full(shape[0] * shape[1], -np.inf)
        np.maximum.at(best, lane, value)
        tie = np.flatnonzero(value >= (best - still.ravel())[lane])
        tie = tie[np.lexsort((place[tie], lane[tie]))]
        lanes, first = np.unique(lane[tie], return_index=True)
        chosen = tie[first]
        found = np.full((2, shape[0] * shape[1]), np.nan)
        own, line, place = rows[function[chosen]], line[chosen], place[chosen]
        place = self.curve.inside(line, place)
        exact = self._true(own, sign, line, place, value[chosen])
        # An extreme is flat: a pose that is as good as the place beside it is that place.
        row = np.round(place)
        beside = np.flatnonzero((np.abs(row - place) <= BESIDE_ROW) & np.isfinite(exact))
        at_row = sign * self.at(line[beside], row[beside])[own[beside], np.arange(len(beside))]
        good = beside[at_row >= exact[beside] - still.ravel()[lanes[beside]]]
        exact[good], place[good] = sign * self.at(line[good], row[good])[own[good], np.arange(len(good))], row[good]
        found[:, lanes] = exact, place
        return Extremes(*found.reshape(2, *shape))

    def _true(self, rows: Ints, sign: int, line: Ints, place: Floats, value: Floats) -> Floats:
        """Values of the functions themselves at places found on their series, where they have the digits."""
        table = sign * self.at(line, place)[rows, np.arange(len(rows))] if len(rows) else value
        size = np.maximum(self._scale, self._sizes[:, None])[rows, line]
        with np.errstate(invalid="ignore"):
            near = np.abs(table - value) <= TRUE * np.where(self._poled[rows], np.abs(value), size)
        return np.where(near & np.isfinite(value), table, value)

    def _tops(self, rows: Ints, sign: int, still: Floats) -> tuple[Ints, Ints, Floats, Floats]:
        """Local maxima of functions times a sign that may be their largest: function, piece, place in it, value."""
        line, poled = self.pieces.line, self._poled[rows]
        series = chebyshev.series(self._table[rows])
        below = chebyshev.series(self._divisor[rows])
        rough = self._rough[rows] & ~poled[:, None]
        with np.errstate(invalid="ignore", divide="ignore"):
            table = sign * chebyshev.at_places(series)
            if poled.any():
                table[poled] /= chebyshev.at_places(below[poled])
                # Where both are zero the quotient says nothing.
                table[poled] = np.where(np.isfinite(table[poled]), table[poled], -np.inf)
        table = np.where(np.isnan(table) | rough[..., None], -np.inf, table)
        nodes = np.where(np.isnan(self._table[rows]) | poled[:, None, None], -np.inf, sign * self._table[rows])
        best = np.full((len(rows), self.curve.lines), -np.inf)
        for k in range(len(rows)):
            np.maximum.at(best[k], line, np.where(rough[k], nodes[k].max(axis=1), table[k].max(axis=1)))
        low = np.full((*table.shape[:2], 1), -np.inf)
        with np.errstate(invalid="ignore"):
            padded = np.concatenate([low, table, low], axis=2)
            top = (table >= padded[..., :-2]) & (table >= padded[..., 2:]) & np.isfinite(table)
            bend = np.abs(np.nan_to_num(table[..., 2:] - 2 * table[..., 1:-1] + table[..., :-2], posinf=0, neginf=0))
        bend = np.concatenate([bend[..., :1], bend, bend[..., -1:]], axis=2)
        # The first place of a line counts with what is as large but for rounding.
        top[:, np.append(True, line[1:] != line[:-1]), 0] = True
        top &= np.isfinite(table)
        function, piece, m = np.nonzero(top & (table + bend >= best[:, line, None] - still[:, line, None]))
        one, two = np.maximum(m - 1, 0), np.minimum(m + 1, len(chebyshev.PLACES) - 1)
        x, value = chebyshev.PLACES[m], table[function, piece, m]
        c, d = series[function, piece], below[function, piece]
        slope, divisor_slope = chebyshev.slope_series(c), chebyshev.slope_series(d)
        bends, divisor_bends = chebyshev.slope_series(slope), chebyshev.slope_series(divisor_slope)
        quotient = poled[function]

        def rise(lane: Flags | Ints, at: Floats) -> tuple[Floats, Floats]:
            """What has the sign of the slope, and its own slope."""
            first, second = chebyshev.value(slope[lane], at), chebyshev.value(bends[lane], at)
            own, by = chebyshev.value(c[lane], at), chebyshev.value(d[lane], at)
            by_first, by_second = chebyshev.value(divisor_slope[lane], at), chebyshev.value(divisor_bends[lane], at)
            apart = quotient[lane]
            return (
                np.where(apart, first * by - own * by_first, first),
                np.where(apart, second * by - own * by_second, second),
            )

        every = np.arange(len(function))
        ends = [rise(every, chebyshev.PLACES[side])[0] for side in (one, two)]
        turning = np.flatnonzero((sign * ends[0] > 0) & (sign * ends[1] < 0))
        at = chebyshev.root(
            lambda place: rise(turning, place), chebyshev.PLACES[one[turning]], ends[0][turning],
            chebyshev.PLACES[two[turning]], ends[1][turning],
        )  # fmt: skip
        x[turning] = at
        refined = sign * chebyshev.value(c[turning], at)
        refined = np.where(quotient[turning], refined / chebyshev.value(d[turning], at), refined)
        value[turning] = np.maximum(refined, value[turning])
        # Of a function with a corner its values are what is known.
        corner, where = np.nonzero(rough & (nodes.max(axis=2) >= best[:, line]) & np.isfinite(nodes.max(axis=2)))
        k = nodes[corner, where].argmax(axis=1)
        tops = nodes[corner, where, k]
        endless = self.pieces.depth[where] >= MOST_HALVINGS - 1
        for j in np.flatnonzero(endless).tolist():
            endless[j] = tops[j] > ENDLESS * np.abs(np.nanmedian(self._table[rows[corner[j]]]))
        return (
            np.concatenate([function, corner]), np.concatenate([piece, where]),
            np.concatenate([x, chebyshev.NODES[k]]),
            np.concatenate([value, np.where(endless & (tops > 0), np.inf, tops)]),
        )  # fmt: skip

    def _poles(self, rows: Ints, sign: int) -> tuple[Ints, Ints, Floats]:
        """Places at which functions times a sign run to plus infinity: function, piece, place in it."""
        found: list[tuple[Ints, Ints, Floats]] = [(np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp), np.empty(0))]
        for k in np.flatnonzero(self._poled[rows]).tolist():
            product, divisor = (chebyshev.series(table[rows[k]]) for table in (self._table, self._divisor))
            sizes = self._scale[rows[k], self.pieces.line], self._divisor_scale[rows[k], self.pieces.line]
            piece, x = chebyshev.zeros(divisor)
            turned, place, level = chebyshev.turning_points(divisor)
            flat = np.abs(level) <= ZERO * sizes[1][turned]
            dead = np.stack([self.pieces.fold < 0, self.pieces.fold > 0], axis=1)
            least = np.where(dead, ZERO_AT_FOLD, ZERO) * sizes[1][:, None]
            end = np.abs(chebyshev.at_places(divisor)[:, [0, -1]]) <= least
            rim, side = np.nonzero(end)
            piece = np.concatenate([piece, turned[flat], rim])
            x = np.concatenate([x, place[flat], 2.0 * side - 1.0])
            height = chebyshev.value(product[piece], x)
            real = np.abs(height) > POLE * sizes[0][piece]
            # From either side the divisor has its sign a little before the place.
            beside = np.stack([x - 1e-4, x + 1e-4])
            by = np.stack([chebyshev.value(divisor[piece], np.clip(at, -1, 1)) for at in beside])
            up = ((sign * height * by > 0) & (np.abs(beside) <= 1)).any(axis=0) & real
            found.append((np.full(np.count_nonzero(up), k), piece[up], x[up]))
        return tuple(np.concatenate(part) for part in zip(*found, strict=True))  # type: ignore[return-value]

    def zeros(self, names: Sequence[str], touching: float) -> Zeros:
        """Places at which some functions cross zero, or come nearer to it than `touching` and turn back or end."""
        rows = np.array([self.names[name] for name in names], dtype=np.intp)
        count = len(self.pieces.line)
        if not len(rows) or not count:
            none = np.empty(0, dtype=np.intp)
            return Zeros(none, none, np.empty(0))
        series = chebyshev.series(self._table[rows]).reshape(-1, chebyshev.COUNT)
        which, x = chebyshev.zeros(series)
        turned, place, least = chebyshev.turning_points(series)
        near = np.abs(least) <= touching
        # Where the motion goes on, a function that crosses zero at the very end of a piece is zero there.
        goes_on = self.pieces.joined_to_next
        rims = np.stack([np.append(False, goes_on), np.append(goes_on, False)], axis=1)
        rims = np.tile(np.where(rims, EXACT, touching), (len(rows), 1))
        rim, side = np.nonzero(np.abs(chebyshev.at_places(series)[:, [0, -1]]) <= rims)
        which = np.concatenate([which, turned[near], rim])
        x = np.concatenate([x, place[near], 2.0 * side - 1.0])
        function, piece = which // count, which % count
        places = self.pieces.take(piece).places(x)
        # Where a function only touches zero a pose that is as near to zero as the place beside it is that place.
        flat = np.arange(len(x)) >= len(x) - len(rim) - np.count_nonzero(near)
        row = np.round(places)
        lanes = np.flatnonzero(flat & (np.abs(row - places) <= BESIDE_ROW))
        own, line = rows[function[lanes]], self.pieces.line[piece[lanes]]
        one, two = (np.abs(self.at(line, s[lanes])[own, np.arange(len(lanes))]) for s in (row, places))
        places[lanes] = np.where(one <= two + EXACT, row[lanes], places[lanes])
        return Zeros(function, self.pieces.line[piece], places)
